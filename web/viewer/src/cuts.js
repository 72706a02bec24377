// Planes that cut a mesh open: along an axis or as the camera looks, several at once. What lies before all of them is seen.

import * as THREE from 'three';

const find = id => document.getElementById(id);
const MOST = 6;

export class CutList {
  /** @param {function} onChange(planes: THREE.Plane[]) */
  constructor(onChange) {
    Object.assign(this, {onChange, all: [], model: null});
    for (const button of find('clip-axis').querySelectorAll('[data-axis]')) button.onclick = () => this.toggle(button.dataset.axis);
    find('cut-view').onclick = () => this.add({name: 'view', normal: this.facing().negate()});
  }
  /** Of a mesh that is shown from now on, without cuts. @param {function} facing the direction in which the camera looks */
  offer(model, sphere, facing) {
    Object.assign(this, {model, sphere, facing});
    this.set([]);
  }

  has(axis) {
    return this.all.some(({name}) => name === axis);
  }
  toggle(axis) {
    if (this.has(axis)) this.set(this.all.filter(({name}) => name !== axis));
    else this.add({name: axis});
  }
  add(cut) {
    if (this.all.length < MOST) this.set([...this.all, cut]);
  }
  /** @param {object[]} cuts {name: 'x', 'y', 'z' or any with a normal, normal, share: from 0 to 1, where; flipped} */
  set(cuts) {
    this.all = cuts.map(({name, normal, share = 0.5, flipped = false}) => ({name, normal: normal ?? axisOf(name), share, flipped}));
    for (const button of find('clip-axis').querySelectorAll('[data-axis]')) button.setAttribute('aria-pressed', this.has(button.dataset.axis));
    find('cuts').replaceChildren(...this.all.map(cut => this.#row(cut)));
    this.#tell();
  }
  get planes() {
    return this.all.map(cut => {
      const [low, high] = this.#reach(cut.normal), sign = cut.flipped ? 1 : -1;
      return new THREE.Plane(cut.normal.clone().multiplyScalar(sign), -sign * (low + cut.share * (high - low)));
    });
  }
  /** How far the mesh goes along a direction. */
  #reach(normal) {
    const {box} = this.model, {center, radius} = this.sphere;
    if (!box) return [center.dot(normal) - radius, center.dot(normal) + radius];
    const ends = corners(box).map(corner => corner.dot(normal));
    return [Math.min(...ends), Math.max(...ends)];
  }
  #tell() {
    this.onChange(this.planes);
  }
  #row(cut) {
    const row = document.createElement('div'), name = cut.name === 'view' ? 'View' : cut.name.toUpperCase();
    const slider = Object.assign(document.createElement('input'), {type: 'range', min: 0, max: 1, step: 0.001, value: cut.share, ariaLabel: `Where the cut ${name} is`});
    slider.dataset.cut = cut.name;
    slider.oninput = () => {
      cut.share = slider.valueAsNumber;
      this.#tell();
    };
    const flip = Object.assign(document.createElement('button'), {textContent: 'Flip', title: 'The other side'});
    flip.onclick = () => {
      cut.flipped = !cut.flipped;
      this.#tell();
    };
    const away = Object.assign(document.createElement('button'), {textContent: '×', title: `Remove the cut ${name}`});
    away.onclick = () => this.set(this.all.filter(other => other !== cut));
    row.className = 'row cut';
    row.append(Object.assign(document.createElement('span'), {textContent: name}), slider, flip, away);
    return row;
  }

  /** For the page's address, and back. */
  get text() {
    return this.all.map(({name, normal, share, flipped}) => {
      const what = name === 'view' ? normal.toArray().map(x => Number(x.toPrecision(5))).join() : name;
      return `${what}${flipped ? '-' : '+'}${share}`;
    }).join(' ');
  }
  set text(text) {
    const cuts = [];
    for (const part of text.split(' ')) {
      const [, what, sign, share] = /^([xyz]|[-\d.,e]+)([+-])([\d.]+)$/.exec(part) ?? [], normal = what?.split(',').map(Number);
      if (!what || !(Number(share) <= 1)) continue;
      const cut = {share: Number(share), flipped: sign === '-'};
      if (axisOf(what)) cuts.push({name: what, ...cut});
      else if (normal.length === 3 && Math.hypot(...normal) > 0 && normal.every(Number.isFinite)) cuts.push({name: 'view', normal: new THREE.Vector3(...normal).normalize(), ...cut});
    }
    this.set(cuts.slice(0, MOST));
  }
}

function axisOf(name) {
  return {x: new THREE.Vector3(1, 0, 0), y: new THREE.Vector3(0, 1, 0), z: new THREE.Vector3(0, 0, 1)}[name];
}
export function corners({min, max}) {
  return Array.from({length: 8}, (_, i) => new THREE.Vector3(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z));
}
