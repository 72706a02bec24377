// The light of a studio: from all around, softer and darker from below, and two lamps that walk with the camera.

import * as THREE from 'three';

/** How bright it is; and how much brighter lamps are than soft light of the same sum. */
const AROUND = 0.82, BRIGHTER = 4;

/** What comes from a direction whose height above the horizon is `up`, with `aside` to the right: soft boxes on a grey wall. */
function studio({x, y, z}, box = softBox) {
  const at = (bx, by, bz, sharp) => box((x * bx + y * by + z * bz) / Math.hypot(bx, by, bz), sharp);
  const wall = 0.34 + 0.3 * y, above = 1.5 * at(0.1, 1, 0.15, 4), left = 0.75 * at(-1, 0.45, 0.5, 6), right = 0.55 * at(1, 0.2, -0.4, 6);
  const floor = 0.2 * softBox(-y, 2);
  const warm = above + left + floor, cold = right + wall;
  return [warm + 0.97 * cold, 0.985 * warm + 0.985 * cold, 0.95 * warm + 1.03 * cold];
}

/** By the cosine to its middle. */
function softBox(cosine, sharp) {
  return Math.max(0, cosine) ** sharp;
}
/** As much light, out of a disk that polished things show: softBox() gives 2 pi / (sharp + 1) in all. */
function lampDisk(cosine, sharp) {
  return 1 - cosine < 1 / (BRIGHTER * (sharp + 1)) ? BRIGHTER : 0;
}

/** As nine numbers a colour, which is all that rough surfaces see of it (Ramamoorthi and Hanrahan, 2001). */
function probeOf(environment) {
  const probe = new THREE.LightProbe(), {coefficients} = probe.sh, basis = new Array(9), rows = 32, columns = 64, direction = new THREE.Vector3();
  for (let i = 0; i < rows; ++i) {
    const polar = Math.PI * (i + 0.5) / rows, area = Math.sin(polar) * (Math.PI / rows) * (2 * Math.PI / columns);
    for (let k = 0; k < columns; ++k) {
      direction.setFromSphericalCoords(1, polar, 2 * Math.PI * (k + 0.5) / columns);
      const light = new THREE.Vector3(...environment(direction));
      THREE.SphericalHarmonics3.getBasisAt(direction, basis);
      coefficients.forEach((sum, j) => sum.addScaledVector(light, basis[j] * area));
    }
  }
  return probe;
}

/** The same for all roughnesses, as three.js has it. */
function mirrorOf(renderer, environment) {
  const columns = 256, rows = 128, values = new Uint16Array(4 * columns * rows), direction = new THREE.Vector3();
  for (let i = 0, at = 0; i < rows; ++i) {
    for (let k = 0; k < columns; ++k) {
      // From below upwards; the middle column looks along x.
      const polar = Math.PI * (1 - (i + 0.5) / rows), around = 2 * Math.PI * ((k + 0.5) / columns - 0.5);
      direction.set(Math.sin(polar) * Math.cos(around), Math.cos(polar), Math.sin(polar) * Math.sin(around));
      for (const light of [...environment(direction, lampDisk), 1]) values[at++] = THREE.DataUtils.toHalfFloat(light);
    }
  }
  const picture = new THREE.DataTexture(values, columns, rows, THREE.RGBAFormat, THREE.HalfFloatType, THREE.EquirectangularReflectionMapping);
  Object.assign(picture, {magFilter: THREE.LinearFilter, minFilter: THREE.LinearFilter, needsUpdate: true});
  const generator = new THREE.PMREMGenerator(renderer), target = generator.fromEquirectangular(picture);
  generator.dispose();
  picture.dispose();
  return target;
}

export class Light {
  constructor(scene, camera) {
    this.scene = scene;
    this.probe = new THREE.LightProbe();
    this.probe.intensity = AROUND;
    scene.add(this.probe);
    this.#lamp(camera, 1.75, [-0.9, 1, 0.7]);
    this.#lamp(camera, 0.5, [1.2, -0.1, 0.5]);
    this.setUp(new THREE.Vector3(0, 1, 0));
  }
  /** Which way the ceiling is. */
  setUp(up) {
    const toY = new THREE.Quaternion().setFromUnitVectors(up, new THREE.Vector3(0, 1, 0));
    this.environment = (direction, box) => studio(direction.clone().applyQuaternion(toY), box);
    this.probe.sh.copy(probeOf(this.environment).sh);
    if (this.mirror) this.setReflecting(this.mirror.renderer, true);
  }
  /** Metal and glass of a scene mirror the studio. What is rough sees no more than the probe, which takes less time. */
  setReflecting(renderer, on) {
    this.mirror?.target.dispose();
    this.mirror = on ? {renderer, target: mirrorOf(renderer, this.environment)} : null;
    Object.assign(this.scene, {environment: this.mirror?.target.texture ?? null, environmentIntensity: AROUND});
    this.probe.intensity = on ? 0 : AROUND;
  }
  #lamp(camera, intensity, position) {
    const lamp = new THREE.DirectionalLight(0xffffff, intensity);
    lamp.position.set(...position);
    camera.add(lamp, lamp.target);
    lamp.target.position.set(0, 0, -1);
  }
}

/**
 * Both sides of a surface are seen, and the normal of what is seen from behind is mirrored, not turned round: then it is the
 * same where a surface turns away, and outlines of rough scans have no dots. Applied to a shader of three.js.
 */
export function mirrorNormals(shader) {
  shader.fragmentShader = shader.fragmentShader.replace('#include <normal_fragment_begin>', `#include <normal_fragment_begin>
    #if defined(DOUBLE_SIDED) && !defined(FLAT_SHADED)
      normal *= faceDirection;
    #endif
    vec3 towardsEye = isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(vViewPosition);
    normal -= 2.0 * min(0.0, dot(normal, towardsEye)) * towardsEye;
    nonPerturbedNormal = normal;`);
}
