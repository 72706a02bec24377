// The distance of two points of the exact mesh, each picked by a click.

import * as THREE from 'three';

import {OVERLAY} from './layers.js';
import {number} from './text.js';

export class Measure {
  /** @param label of the page, which follows the line */
  constructor(stage, label) {
    Object.assign(this, {stage, label, points: []});
    const geometry = new THREE.BufferGeometry().setAttribute('position', new THREE.BufferAttribute(new Float32Array(6), 3));
    const look = {color: 0xffb020, depthTest: false, transparent: true, toneMapped: false};
    this.line = new THREE.Line(geometry, new THREE.LineBasicMaterial(look));
    this.ends = new THREE.Points(geometry, new THREE.PointsMaterial({...look, size: 9, sizeAttenuation: false}));
    for (const mark of [this.line, this.ends]) {
      mark.layers.set(OVERLAY);
      mark.renderOrder = 4;
      mark.frustumCulled = false;
      mark.visible = false;
      stage.scene.add(mark);
    }
    stage.addEventListener('frame', () => this.#follow());
  }

  /** @param hit what Picking.at() gave; the third point begins anew */
  add(hit) {
    if (this.points.length === 2) this.points = [];
    this.points.push(new THREE.Vector3(...hit.position));
    this.#show();
  }
  clear() {
    this.points = [];
    this.#show();
  }
  get distance() {
    return this.points.length === 2 ? this.points[0].distanceTo(this.points[1]) : null;
  }

  #show() {
    const {points, line, ends, label} = this, [a, b] = points, attribute = line.geometry.getAttribute('position');
    ends.visible = points.length > 0;
    line.visible = points.length === 2;
    label.hidden = points.length === 0;
    this.stage.touch();
    if (!a) return;
    // Relative to a point nearby: single precision is enough then.
    line.position.copy(a);
    ends.position.copy(a);
    const step = b ? b.clone().sub(a) : new THREE.Vector3();
    attribute.setXYZ(1, ...step.toArray());
    attribute.needsUpdate = true;
    label.replaceChildren(Object.assign(document.createElement('strong'), {textContent: b ? number(this.distance) : 'Click the other point'}));
    if (b) label.append(Object.assign(document.createElement('span'), {textContent: ['x', 'y', 'z'].map((axis, k) => `${axis} ${number(step.getComponent(k))}`).join('  ')}));
  }
  #follow() {
    const {points, label, stage} = this;
    if (points.length === 0) return;
    const middle = points.length === 2 ? points[0].clone().add(points[1]).multiplyScalar(0.5) : points[0], place = stage.placeOf(middle);
    label.style.visibility = place ? '' : 'hidden';
    if (place) label.style.transform = `translate(calc(${place.x.toFixed(1)}px - 50%), calc(${place.y.toFixed(1)}px - 130%))`;
  }
}
