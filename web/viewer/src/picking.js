// A click tells the exact face: its number, where it was hit, its corners, its values.

import * as THREE from 'three';

import {OVERLAY} from './layers.js';
import {count, number} from './text.js';

export class Picking {
  constructor(stage, card) {
    Object.assign(this, {stage, card, last: null});
    const geometry = new THREE.BufferGeometry().setAttribute('position', new THREE.BufferAttribute(new Float32Array(12), 3));
    this.outline = new THREE.Line(geometry, new THREE.LineBasicMaterial({color: 0xff5d2b, depthTest: false, transparent: true}));
    this.outline.renderOrder = 2;
    this.outline.frustumCulled = false;
    this.dot = new THREE.Points(
      new THREE.BufferGeometry().setAttribute('position', new THREE.BufferAttribute(new Float32Array(3), 3)),
      new THREE.PointsMaterial({color: 0xff5d2b, size: 9, sizeAttenuation: false, depthTest: false, transparent: true}));
    this.dot.renderOrder = 3;
    this.dot.frustumCulled = false;
    for (const mark of [this.outline, this.dot]) mark.layers.set(OVERLAY);
    this.marks = new THREE.Group().add(this.outline, this.dot);
    this.marks.visible = false;
    stage.scene.add(this.marks);
  }

  /** The face under a point of the page, exactly; null: there is none. */
  async at(model, event) {
    const raycaster = this.stage.rayAt(event);
    if (!advance(raycaster.ray, this.stage.clips)) return null;
    const hit = await model.pick(raycaster);
    // What a cut took away is not hit, nor what lies behind it.
    return hit && this.stage.isLeft(new THREE.Vector3(...hit.position), 1e-6 * this.stage.sphere.radius) ? hit : null;
  }

  show(hit) {
    this.last = hit;
    this.marks.visible = hit !== null;
    this.card.hidden = hit === null;
    this.stage.touch();
    if (!hit) return;
    place(this.dot, hit.position, [[0, 0, 0]]);
    if (hit.corners.length === 3) {
      const [a, b, c] = hit.corners.map(corner => corner.map((x, k) => x - hit.position[k]));
      place(this.outline, hit.position, [a, b, c, a]);
    }
    this.outline.visible = hit.corners.length === 3;
    this.#fill(hit);
  }

  #fill(hit) {
    const {card} = this;
    card.replaceChildren();
    const title = document.createElement('h3'), list = document.createElement('dl'), close = document.createElement('button');
    title.textContent = `Face ${count(hit.number)}`;
    Object.assign(close, {className: 'close', textContent: '×', title: 'Close', onclick: () => this.show(null)});
    const add = (term, value, exact = true) => {
      const dt = document.createElement('dt'), dd = document.createElement('dd');
      dt.textContent = term;
      dd.textContent = value;
      if (exact) dd.className = 'exact';
      dd.title = value;
      list.append(dt, dd);
    };
    ['x', 'y', 'z'].forEach((name, k) => add(name, hit.position[k].toPrecision(9)));
    if (hit.chart !== undefined) add('chart', `${hit.group}/${hit.chart}, its face ${hit.face}`);
    for (const {name, value} of hit.values) add(name || 'value', value.map(x => (typeof x === 'bigint' ? String(x) : number(x))).join(', '));
    card.append(title, close, list);
  }
}

/** Moves the beginning of a ray into what cuts leave; false: it never comes there. */
function advance(ray, planes) {
  let distance = 0;
  for (const plane of planes) {
    if (plane.distanceToPoint(ray.origin) >= 0) continue;
    const there = ray.distanceToPlane(plane);
    if (there === null) return false;
    distance = Math.max(distance, there);
  }
  ray.origin.addScaledVector(ray.direction, distance);
  return true;
}

/** Relative to a point nearby: single precision is enough then. */
function place(object, origin, points) {
  object.position.fromArray(origin);
  const attribute = object.geometry.getAttribute('position');
  points.forEach((point, i) => attribute.setXYZ(i, ...point));
  attribute.needsUpdate = true;
}
