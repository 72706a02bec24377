// What a plane cuts out of the solids of a volume: faces with the field on them, as they are decoded.

import * as THREE from 'three';

import {toGeometry} from '../../src/three.js';

/** A cut that takes longer gives way to the next one; what was decoded for it is kept. In milliseconds. */
const PATIENCE = 300;

export class CutFaces {
  /**
   * @param file a MeshFile with slices()
   * @param {object} on part(mesh): one is there, in `group`; error(error)
   */
  constructor(file, on) {
    Object.assign(this, {file, on, wanted: null, running: false, options: {}});
    this.group = new THREE.Group();
    this.group.name = 'cut';
  }
  get meshes() {
    return this.group.children.flatMap(parts => parts.children);
  }
  get triangles() {
    return this.meshes.reduce((sum, mesh) => sum + mesh.userData.triangles, 0);
  }

  /**
   * Shows the cut of a plane, null: none. Where the last one is still under way this one comes after it.
   * @param {object} options arrays, step: of MeshFile.slices()
   */
  set(plane, options = this.options) {
    this.options = options;
    const before = this.wanted;
    this.wanted = plane && {normal: plane.normal.toArray(), offset: plane.constant};
    // Where another plane was moved this one stays.
    if (before && this.wanted && JSON.stringify([before, this.given]) === JSON.stringify([this.wanted, options])) {
      this.wanted = before;
      return;
    }
    this.given = options;
    if (!this.wanted) {
      this.stop?.abort();
      this.#drop(...this.group.children);
    } else if (!this.running) {
      this.#run();
    } else if (performance.now() - this.begun > PATIENCE) {
      this.stop.abort();
    }
  }
  dispose() {
    this.set(null);
  }

  async #run() {
    this.running = true;
    while (this.wanted) {
      const plane = this.wanted;
      await this.#show(plane, this.stop = new AbortController());
      if (this.wanted === plane) break;
    }
    this.running = false;
  }
  /** Parts take the place of the last cut when all are there, or one after the other where they are long in coming. */
  async #show(plane, {signal}) {
    const parts = new THREE.Group(), before = [...this.group.children];
    this.begun = performance.now();
    const show = () => {
      if (parts.parent || !this.wanted) return;
      this.group.add(parts);
      this.#drop(...before);
    };
    try {
      for await (const {drawn, error} of this.file.slices(plane, {...this.options, signal})) {
        if (error) this.on.error(error);
        else if (drawn.triangles.length > 0) this.#add(parts, drawn);
        if (performance.now() - this.begun > PATIENCE) show();
      }
      show();
    } catch (error) {
      if (!signal.aborted) this.on.error(error);
    }
    if (!parts.parent) this.#drop(parts);
    this.on.changed?.();
  }
  #add(parts, drawn) {
    const geometry = toGeometry(drawn), mesh = new THREE.Mesh(geometry);
    geometry.userData.drawn = drawn;
    mesh.position.fromArray(drawn.origin);
    mesh.userData = {chart: {level: 0, group: 0, chart: 0}, triangles: drawn.triangles.length / 3, isCut: true};
    parts.add(mesh);
    this.on.part(mesh);
  }
  #drop(...groups) {
    for (const parts of groups) {
      for (const mesh of parts.children) {
        mesh.geometry.dispose();
        for (const edges of mesh.children) edges.geometry.dispose();
      }
      parts.removeFromParent();
    }
    if (groups.length > 0) this.on.changed?.();
  }
}

/** The cuts of several planes, as one. */
export class Cuts {
  /** @param file, on as of CutFaces */
  constructor(file, on) {
    Object.assign(this, {file, on, all: [], planes: []});
    this.group = new THREE.Group();
  }
  get meshes() { return this.all.flatMap(cut => cut.meshes); }
  get triangles() { return this.all.reduce((sum, cut) => sum + cut.triangles, 0); }
  get running() { return this.all.some(cut => cut.running); }

  /** @param {THREE.Plane[]} planes */
  set(planes, options) {
    this.planes = planes;
    while (this.all.length < planes.length) {
      const cut = new CutFaces(this.file, this.on);
      this.all.push(cut);
      this.group.add(cut.group);
    }
    this.all.forEach((cut, i) => cut.set(planes[i] ?? null, options));
  }
  dispose() {
    this.set([]);
  }
}

/** The sides of the polygons, which triangles have no more. */
export function edgesOf({faces, triangles, cells, positions}) {
  const lines = [];
  for (let face = 0; face < faces.length; ++face) {
    const first = faces[face], end = face + 1 < faces.length ? faces[face + 1] : cells.length;
    const corners = [triangles[3 * first], triangles[3 * first + 1]];
    for (let triangle = first; triangle < end; ++triangle) corners.push(triangles[3 * triangle + 2]);
    corners.forEach((corner, i) => lines.push(corner, corners[(i + 1) % corners.length]));
  }
  const geometry = new THREE.BufferGeometry().setAttribute('position', new THREE.BufferAttribute(positions, 3));
  return geometry.setIndex(lines);
}
