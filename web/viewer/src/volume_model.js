// A volume in pieces: boxes with mean values first, for some thousand cells each, which the index has; then surfaces, piece by
// piece, nearest first; and where it is cut open the cut, out of the pieces that the plane meets.

import * as THREE from 'three';

import {toGeometry} from '../../src/three.js';
import {BorderFaces, withoutGone} from '../../src/volume.js';
import {Cuts} from './cut_faces.js';
import {bytesText, counted, Rate} from './text.js';
import {pickDrawn, valuesAt} from './values.js';

/** Surfaces are read until they are so large, in triangles, or so much of the file was read, in bytes. */
const MOST_TRIANGLES = 4e6, MOST_BYTES = 128e6;
/** Of smaller files all arrays are read: a click tells their values. */
const ALL_ARRAYS = 64e6;
/** Faces between pieces are taken out so often, in milliseconds. */
const TIDY = 500;

export class VolumeModel {
  /** @param coarse what file.coarse() gives */
  constructor(file, count, coarse) {
    const {volume} = file.info;
    Object.assign(this, {file, count, volume, step: 0, refines: false, flat: true, undrawable: 0, rate: new Rate()});
    this.fields = new Map(volume.fields.map(field => {
      const key = `${field.domain} ${field.name}`;
      return [key, {...field, key}];
    }));
    this.object = new THREE.Group();
    this.object.retry = () => this.#read(this.broken.splice(0));
    this.surface = new THREE.Group();
    this.cut = new Cuts(file, {part: mesh => this.#tell(mesh), error: error => this.#fail(error), changed: () => this.onChange?.()});
    this.boxes = boxesOf(groupsOf(coarse, file.volume.pieces), coarse.arrays, file.volume.origin ?? [0, 0, 0]);
    this.object.add(this.boxes, this.surface, this.cut.group);
    const {low, high} = volume.box ?? {low: [0, 0, 0], high: [1, 1, 1]};
    this.box = new THREE.Box3(new THREE.Vector3(...low), new THREE.Vector3(...high));
    this.sphere = this.box.getBoundingSphere(new THREE.Sphere());
    this.parts = new Map();  // by piece: {drawn, mesh}
    this.broken = [];
  }
  get meshes() { return [this.boxes, ...this.surface.children, ...this.cut.meshes]; }
  get shown() { return [...this.surface.children, ...this.cut.meshes]; }
  get triangles() { return this.shown.reduce((sum, mesh) => sum + mesh.userData.triangles, 0); }
  get about() {
    const {cells, pieces} = this.volume;
    return `${counted(cells, 'cell')} · ${counted(pieces, 'piece')} · ${bytesText(this.file.size)}`;
  }
  get decodeRate() { return this.rate.value; }
  /** Lines for the statistics. */
  get rows() {
    return [['Surface of', `${this.parts.size} of ${counted(this.volume.pieces, 'piece')}`], ['Cut', this.cut.running ? '…' : counted(this.cut.triangles, 'triangle')]];
  }
  /** Of what is read unasked; null: nothing is. */
  get progress() {
    return this.reading ? this.parts.size / Math.max(1, this.reading.of) : null;
  }
  /** @returns whether all is there that is read unasked */
  update(camera) {
    if (!this.begun) {
      this.begun = true;
      const eye = camera.position, distance = ({box}) => (box ? boxOf(box).distanceToPoint(eye) : Infinity);
      const pieces = this.file.volume.pieces.filter(({cells}) => cells > 0);
      this.#read(pieces.map(piece => [distance(piece), piece]).sort((a, b) => a[0] - b[0]).map(([, piece]) => piece));
    }
    return !this.reading && !this.cut.running;
  }
  async pick(raycaster) {
    return pickDrawn(raycaster, this.shown);
  }
  valuesAt({drawn, triangle, weights}) {
    return valuesAt(drawn, triangle, weights);
  }
  dispose() {
    this.stop?.abort();
    this.cut.dispose();
    for (const mesh of [this.boxes, ...this.surface.children]) mesh.geometry.dispose();
    this.object.removeFromParent();
    this.file.close();
  }

  /** Which arrays are read: all, or of a large file the one that is shown. */
  get arrays() {
    if (this.file.size <= ALL_ARRAYS) return undefined;
    return this.field ? [this.field.name] : [];
  }
  /** The field that is shown from now on; of a large file it may have to be read. */
  setField(field) {
    if (this.field?.key === field?.key) return;
    this.field = field;
    if (!this.begun || this.file.size <= ALL_ARRAYS || !field) return;
    this.#again();
  }
  async showStep(step) {
    this.step = step;
    this.#again();
  }
  #again() {
    this.stop?.abort();
    const pieces = [...this.parts.keys()].map(number => this.file.volume.pieces[number]);
    for (const {mesh} of this.parts.values()) mesh.geometry.dispose();
    this.surface.clear();
    this.parts.clear();
    this.boxes.userData.show(pieces.map(({piece}) => piece));
    this.begun = false;
    this.cut.set(this.cut.planes, {arrays: this.arrays, step: this.step});
  }

  /** @param {THREE.Plane[]} planes of the cuts that are shown */
  setCuts(planes) {
    this.cut.set(planes, {arrays: this.arrays, step: this.step});
  }
  rangeOf({low, high, components}, component) {
    const k = components === 1 ? 0 : component;
    return k >= 0 && low?.length === components && low[k] <= high[k] ? [low[k], high[k]] : null;
  }

  /** Surfaces of pieces, in their order, as far as a page holds them. */
  async #read(pieces) {
    if (pieces.length === 0) return;
    const {file, arrays, step} = this, {signal} = this.stop = new AbortController(), borders = this.borders = new BorderFaces();
    const wanted = this.#affordable(pieces), reading = this.reading = {of: this.parts.size + wanted.length};
    let tidied = performance.now(), changed = new Set();
    try {
      for await (const {piece, drawn, error} of file.surfaces({pieces: wanted, arrays, step, signal})) {
        if (signal.aborted) return;
        if (error) {
          this.broken.push(piece);
          this.#fail(error);
          continue;
        }
        for (const part of borders.add(drawn)) changed.add(part);
        this.#show(piece, drawn);
        if (performance.now() - tidied > TIDY) {
          this.#tidy(changed);
          changed = new Set();
          tidied = performance.now();
        }
        if (this.triangles > MOST_TRIANGLES) break;
      }
      this.#tidy(changed);
    } catch (error) {
      if (!signal.aborted) this.#fail(error);
    } finally {
      if (this.reading === reading) this.reading = null;
      if (!signal.aborted) for (const part of this.parts.values()) part.drawn = null;
    }
    if (!signal.aborted && this.parts.size + this.broken.length < file.volume.pieces.length)
      this.onLimit?.(file.volume.pieces.length - this.parts.size - this.broken.length);
  }
  #affordable(pieces) {
    let bytes = 0;
    return pieces.filter(piece => (bytes += piece.bytes) <= MOST_BYTES);
  }
  #show({piece}, drawn) {
    this.rate.add(drawn.triangles.length / 3);
    const mesh = new THREE.Mesh();
    this.parts.set(piece, {drawn, mesh});
    this.#draw(mesh, drawn, piece);
    this.surface.add(mesh);
    this.boxes.userData.hide(piece);
    this.#tell(mesh);
  }
  #draw(mesh, drawn, piece) {
    const geometry = toGeometry(drawn);
    mesh.geometry.dispose();
    mesh.geometry = geometry;
    mesh.position.fromArray(drawn.origin);
    mesh.userData = {chart: {level: 0, group: 0, chart: piece}, triangles: drawn.triangles.length / 3};
  }
  /** Faces that two pieces have are no surface. */
  #tidy(changed) {
    for (const [piece, part] of this.parts) {
      if (!changed.has(part.drawn)) continue;
      this.#draw(part.mesh, withoutGone(part.drawn), piece);
      this.#tell(part.mesh);
    }
  }
  #tell(mesh) {
    this.object.dispatchEvent({type: 'chart', mesh});
    this.onChange?.();
  }
  #fail(error) {
    this.object.dispatchEvent({type: 'error', error});
  }
}

function boxOf({low, high}) {
  return new THREE.Box3(new THREE.Vector3(...low), new THREE.Vector3(...high));
}

/** A box for each coarse point: as much of its piece's as the point has of its points; coarse points come piece by piece. */
function groupsOf({positions}, pieces) {
  const groups = [], counts = new Map();
  let at = 0;
  for (let i = 0; i < positions.length; i += 3) {
    const middle = [...positions.subarray(i, i + 3)];
    let next = at;
    while (next < pieces.length && !contains(pieces[next].box, middle)) ++next;
    if (next < pieces.length) at = next;
    const {piece, box} = pieces[at];
    counts.set(piece, (counts.get(piece) ?? 0) + 1);
    groups.push({piece, middle, box});
  }
  for (const group of groups) {
    const {piece, box} = group, share = 0.96 / Math.cbrt(counts.get(piece));
    group.sides = box ? box.high.map((x, k) => share * (x - box.low[k])) : [0, 0, 0];
    if (counts.get(piece) === 1 && box) group.middle = box.low.map((x, k) => (x + box.high[k]) / 2);
  }
  return groups;
}
function contains(box, point) {
  return box !== null && point.every((x, k) => box.low[k] <= x && x <= box.high[k]);
}

/** One mesh of all boxes; userData: hide(piece), show(pieces), scalarsOf(field, component): mean values by vertex. */
function boxesOf(groups, arrays, origin) {
  const box = new THREE.BoxGeometry(1, 1, 1), corners = box.getAttribute('position').array, around = box.getAttribute('normal').array;
  const size = corners.length, per = box.index.count, positions = new Float32Array(size * groups.length), normals = new Float32Array(positions.length);
  const whole = new Uint32Array(per * groups.length), places = new Map();
  for (const [i, {piece, middle, sides}] of groups.entries()) {
    for (let k = 0; k < size; ++k) positions[size * i + k] = middle[k % 3] - origin[k % 3] + sides[k % 3] * corners[k];
    normals.set(around, size * i);
    whole.set(box.index.array.map(corner => corner + size / 3 * i), per * i);
    places.set(piece, [...places.get(piece) ?? [], per * i]);
  }
  const geometry = new THREE.BufferGeometry().setIndex(new THREE.BufferAttribute(whole.slice(), 1));
  geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3)).setAttribute('normal', new THREE.BufferAttribute(normals, 3));
  geometry.userData = {arrays: [], cells: [], points: []};
  const mesh = new THREE.Mesh(geometry);
  mesh.position.fromArray(origin);
  const turn = (pieces, on) => {
    for (const at of pieces.flatMap(piece => places.get(piece) ?? []))
      geometry.index.array.set(on ? whole.subarray(at, at + per) : new Uint32Array(per), at);
    geometry.index.needsUpdate = true;
  };
  const scalarsOf = ({name, components}, component) => {
    const array = arrays.find(other => other.name === name && other.components === components);
    const means = groups.map((_, i) => (array ? meanOf(array.values.subarray(i * components, (i + 1) * components), component) : NaN));
    return Float32Array.from({length: positions.length / 3}, (_, vertex) => means[Math.floor(3 * vertex / size)]);
  };
  mesh.userData = {chart: {level: 0, group: 0, chart: 0}, triangles: 0, hide: piece => turn([piece], false), show: pieces => turn(pieces, true), scalarsOf};
  return mesh;
}
function meanOf(values, component) {
  return values.length === 1 ? values[0] : component >= 0 ? values[component] : Math.hypot(...values);
}
