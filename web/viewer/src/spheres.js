// The spheres around the charts that are shown, which decide what is in sight and how fine it must be.

import * as THREE from 'three';

import {OVERLAY} from './layers.js';

export class Spheres {
  constructor(scene) {
    const circles = [];
    for (const [a, b] of [[0, 1], [1, 2], [2, 0]]) {
      for (let i = 0; i < 48; ++i) {
        for (const k of [i, i + 1]) {
          const at = [0, 0, 0];
          at[a] = Math.cos(k / 24 * Math.PI);
          at[b] = Math.sin(k / 24 * Math.PI);
          circles.push(...at);
        }
      }
    }
    this.geometry = new THREE.InstancedBufferGeometry();
    this.geometry.setAttribute('position', new THREE.Float32BufferAttribute(circles, 3));
    this.material = new THREE.LineBasicMaterial({color: 0x58a6ff, transparent: true, opacity: 0.3});
    // A place and a size each, before all else is done with the position.
    this.material.onBeforeCompile = shader => {
      shader.vertexShader = shader.vertexShader.replace('#include <common>', '#include <common>\nattribute vec4 sphere;')
        .replace('#include <begin_vertex>', 'vec3 transformed = position * sphere.w + sphere.xyz;');
    };
    this.lines = new THREE.LineSegments(this.geometry, this.material);
    this.lines.layers.set(OVERLAY);
    this.lines.frustumCulled = false;
    this.lines.visible = false;
    scene.add(this.lines);
  }

  show(model) {
    this.lines.visible = model !== null;
    if (!model) return;
    const {center} = model.sphere, spheres = model.shown.map(mesh => mesh.userData.chart.sphere);
    this.lines.position.copy(center);
    const values = new Float32Array(spheres.flatMap(({centre: [x, y, z], radius}) => [x - center.x, y - center.y, z - center.z, radius]));
    this.geometry.setAttribute('sphere', new THREE.InstancedBufferAttribute(values, 4));
    this.geometry.instanceCount = spheres.length;
  }
}
