// What tells directions and lengths of the picture: axes, which can be clicked to look along one, and a scale.

import * as THREE from 'three';

import {number} from './text.js';

const SVG = 'http://www.w3.org/2000/svg';
const colours = {x: '#e4572e', y: '#4caf50', z: '#3f8efc'};
/** The longest scale, in pixels. */
const LONGEST = 110;

export class Gauges {
  /** @param axes an <svg>, from -1.3 to 1.3; @param scale an element with an <i>, as long as the text in its <span> says; @param look(direction) */
  constructor(stage, axes, scale, look) {
    Object.assign(this, {stage, axes, scale, target: new THREE.Vector3()});
    this.parts = ['x', 'y', 'z'].flatMap(axis => [1, -1].map(sign => this.#part(axis, sign, look)));
    stage.addEventListener('frame', () => this.#follow());
  }
  #part(axis, sign, look) {
    const [group, line, circle, text] = ['g', 'line', 'circle', 'text'].map(name => document.createElementNS(SVG, name));
    const direction = new THREE.Vector3().setComponent('xyz'.indexOf(axis), sign), name = `${sign < 0 ? '−' : ''}${axis}`;
    group.setAttribute('role', 'button');
    group.setAttribute('tabindex', -1);
    group.setAttribute('aria-label', `Look from ${name}`);
    group.onclick = () => look(direction.clone());
    line.setAttribute('stroke', colours[axis]);
    circle.setAttribute('r', sign > 0 ? 0.24 : 0.15);
    circle.setAttribute('fill', colours[axis]);
    if (sign < 0) circle.setAttribute('fill-opacity', 0.45);
    if (sign > 0) {
      text.textContent = axis.toUpperCase();
      group.append(line, circle, text);
    } else {
      group.append(circle);
    }
    return {group, line, circle, text, direction};
  }

  #follow() {
    const {camera, sphere, size} = this.stage, toEye = camera.quaternion.clone().invert(), key = `${camera.quaternion.toArray()}`;
    if (key !== this.lastSeen) {
      this.lastSeen = key;
      const placed = this.parts.map(part => ({...part, at: part.direction.clone().applyQuaternion(toEye)})).sort((a, b) => a.at.z - b.at.z);
      for (const {line, circle, text, at} of placed) {
        for (const [part, x, y] of [[circle, 'cx', 'cy'], [line, 'x2', 'y2'], [text, 'x', 'y']]) {
          part.setAttribute(x, at.x.toFixed(3));
          part.setAttribute(y, (-at.y).toFixed(3));
        }
      }
      this.axes.replaceChildren(...placed.map(({group}) => group));
    }
    // Where the point is that the camera turns around; where it flies, as far away as the mesh.
    const distance = Math.max(1e-30, camera.position.distanceTo(this.flying ? sphere.center : this.target));
    const perPixel = 2 * distance * Math.tan(THREE.MathUtils.degToRad(camera.fov) / 2) / size[1], length = roundBelow(LONGEST * perPixel);
    if (length === this.length && perPixel === this.perPixel) return;
    Object.assign(this, {length, perPixel});
    this.scale.querySelector('i').style.width = `${(length / perPixel).toFixed(1)}px`;
    this.scale.querySelector('span').textContent = number(length);
  }
}

/** 1, 2 or 5 times a power of ten. */
function roundBelow(x) {
  const power = 10 ** Math.floor(Math.log10(x)), times = x / power;
  return (times >= 5 ? 5 : times >= 2 ? 2 : 1) * power;
}
