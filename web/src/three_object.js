// A file of mode random in a three.js scene: refines itself as it is looked at.

import * as THREE from 'three';

import {BorderNormals} from './border_normals.js';
import {cutOf, Hierarchy} from './cut.js';
import {MeshFile} from './maille.js';
import {Rest} from './rest.js';
import {arraysOf, geometryBytes, toGeometry} from './three_geometry.js';

/**
 * Charts asked for at once, and those that wait to be drawn: enough for all threads and the network, few enough to turn round
 * soon; and where drawing is slow nothing heaps up.
 */
const LOADING_AT_ONCE = 12;

/** The camera rests when it has not moved for so long, in milliseconds. */
const REST = 200;
const MAX_BYTES = 256e6;
/** What the objects of one chart take beside its arrays, twice: so many more there may be before a browser collects old ones. */
const OBJECT_BYTES = 8192;
/** What a vertex at a border takes, with its share of BorderNormals. */
const BORDER_BYTES = 56;
/** Bytes fetched that are worth keeping beside charts: they are a quarter of a chart's size and rarely wanted again. */
export function cacheBytesFor(maxBytes = MAX_BYTES) {
  return Math.min(32 * 2 ** 20, maxBytes / 32);
}

function bytesOf({geometry}, border) {
  return geometryBytes(geometry) + OBJECT_BYTES + (border ? BORDER_BYTES * border.vertices.length : 0);
}
function touches(a, b) {
  const x = a.centre[0] - b.centre[0], y = a.centre[1] - b.centre[1], z = a.centre[2] - b.centre[2], reach = a.radius + b.radius;
  return x * x + y * y + z * z <= reach * reach;
}

/**
 * Events: 'progress' {shown, wanted, triangles, error: pixels} with every update that changed something; 'chart' {mesh, chart}
 * for each that arrives, before it is shown; 'error' {error, chart}: a chart that could not be read. Its place stays coarse.
 */
export class MailleObject extends THREE.Object3D {
  /**
   * @param {MeshFile} file of mode random, kept open until dispose()
   * @param {object} options errorTarget: pixels; restTarget: the same when the camera has not moved for a while (default: the same);
   *   level: all of one level, whatever is seen of it; maxBytes: of charts kept, whose arrays are gone with them; material; uploadsPerFrame: charts that are
   *   made ready for the GPU in one frame while the camera moves, and twice as many while it rests
   */
  constructor(file, {errorTarget = 1.5, restTarget = Infinity, level = null, maxBytes = MAX_BYTES, material, uploadsPerFrame = 2} = {}) {
    super();
    if (file.mode !== 'random') throw new Error(`${file.name}: only files of mode "random" refine themselves; use MailleLoader`);
    Object.assign(this, {file, errorTarget, restTarget, level, maxBytes, uploadsPerFrame, heldBytes: 0, triangles: 0, error: Infinity, failed: 0});
    this.material = material ?? new THREE.MeshStandardMaterial({color: 0xc8c4bc, roughness: 0.8, side: THREE.DoubleSide});
    this.hierarchy = new Hierarchy(file);
    this.charts = new Map();   // by key: {key, mesh, arrays, bytes, used, border}
    this.loading = new Map();  // by key: {chart, controller}
    this.arrived = [];
    this.borders = new BorderNormals();
    this.rest = new Rest(REST);
    this.shown = new Set();    // keys
    this.broken = new Set();   // keys: not asked for again
    this.frame = 0;
    this.pressure = 1;         // by how much the target is missed for the budget's sake
    // All charts are drawn from one origin: then points at their borders come out of the GPU the same, bit for bit.
    this.inner = new THREE.Group();
    this.inner.position.fromArray(file.sphere.centre);
    this.add(this.inner);
  }

  static async open(input, options = {}) {
    const file = await MeshFile.open(input, {cacheBytes: cacheBytesFor(options.maxBytes), ...options});
    return new MailleObject(file, options);
  }

  dispose() {
    this.disposed = true;
    for (const {controller} of this.loading.values()) controller.abort();
    for (const key of this.charts.keys()) this.#drop(key);
    this.shown.clear();
    this.arrived = [];
    this.file.close();
    this.removeFromParent();
  }

  /** The sphere around all of it, in the file's own coordinates. */
  get boundingSphere() {
    return new THREE.Sphere(new THREE.Vector3(...this.file.sphere.centre), this.file.sphere.radius);
  }
  get meshes() {
    return this.inner.children;
  }

  /** Once a frame, before render(). Returns whether all that the view needs is shown. */
  update(camera, renderer) {
    if (this.disposed) return true;
    ++this.frame;
    const uploaded = this.#upload();
    const view = this.#viewOf(camera, renderer);
    const cut = cutOf(this.hierarchy, view, chart => this.charts.has(chart.key));
    if (this.hierarchy.error) this.#fail(this.hierarchy.error);
    for (const chart of cut.needed) this.charts.get(chart.key).used = this.frame;
    const changed = this.#show(cut.shown);
    this.#forget();
    this.#fetch(cut.wanted);
    this.error = cut.error;
    let wanted = 0;
    for (const {key, inSight} of cut.wanted) {
      if (inSight && !this.broken.has(key)) ++wanted;
    }
    if (changed || uploaded > 0 || wanted !== this.lastWanted)
      this.dispatchEvent({type: 'progress', shown: this.shown.size, wanted, triangles: this.triangles, error: cut.error});
    this.lastWanted = wanted;
    return wanted === 0 && !cut.waits && (this.resting || this.restTarget >= this.errorTarget);
  }

  #viewOf(camera, renderer) {
    camera.updateMatrixWorld();
    this.updateWorldMatrix(true, false);
    const inverse = this.matrixWorld.clone().invert();
    const toClip = new THREE.Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).multiply(this.matrixWorld);
    const planes = new THREE.Frustum().setFromProjectionMatrix(toClip, camera.coordinateSystem).planes
      // The far plane is no reason to leave something out.
      .filter((_, i) => i !== 4)
      .map(({normal, constant}) => ({normal: normal.toArray(), offset: constant}));
    const eye = new THREE.Vector3().setFromMatrixPosition(camera.matrixWorld).applyMatrix4(inverse).toArray();
    const height = renderer.getDrawingBufferSize(new THREE.Vector2()).y;
    const pixelsPerRadian = height * (camera.zoom ?? 1) / (2 * Math.tan(THREE.MathUtils.degToRad(camera.fov ?? 50) / 2));
    return {planes, eye, pixelsPerRadian, pixels: this.#targetFor(camera), level: this.level};
  }
  /** Pixels. Where a resting view has to do with less for the budget's sake, a moving one has not more. */
  #targetFor(camera) {
    this.rest.look(camera.matrixWorld.elements, this.file.sphere.radius);
    this.resting = this.rest.resting;
    const finest = Math.min(this.errorTarget, this.restTarget) * this.pressure;
    return this.resting ? finest : Math.max(this.errorTarget, finest);
  }

  /** @returns whether that is a change; the set stays the same otherwise */
  #show(charts) {
    if (charts.length === this.shown.size && charts.every(({key}) => this.shown.has(key))) return false;
    const before = this.shown;
    this.shown = new Set(charts.map(({key}) => key));
    this.triangles = 0;
    for (const key of before) {
      if (!this.shown.has(key) && this.charts.has(key)) this.charts.get(key).mesh.visible = false;
    }
    for (const key of this.shown) {
      const {mesh} = this.charts.get(key);
      mesh.visible = true;
      this.triangles += mesh.userData.triangles;
    }
    return true;
  }

  #fetch(wanted) {
    for (const chart of wanted) chart.wanted = this.frame;
    for (const {chart, controller} of this.loading.values()) {
      if (chart.wanted !== this.frame) controller.abort();
    }
    const waiting = new Set(this.arrived.map(({key}) => key));
    for (const chart of wanted) {
      if (this.loading.size + this.arrived.length >= LOADING_AT_ONCE || this.heldBytes > this.maxBytes) return;
      const {key} = chart;
      if (!this.loading.has(key) && !waiting.has(key) && !this.broken.has(key)) this.#load(key, chart);
    }
  }

  #load(key, chart) {
    const controller = new AbortController();
    this.loading.set(key, {chart, controller});
    this.file.decodeNode(chart, {signal: controller.signal, lean: true}).then(
      drawn => { if (!this.disposed) this.arrived.push({key, chart, drawn}); },
      error => {
        if (controller.signal.aborted || this.disposed) return;
        this.broken.add(key);
        this.#fail(error, chart);
      },
    ).finally(() => this.loading.delete(key));
  }

  /** Asks again for what could not be read: after the network is back. */
  retry() {
    this.broken.clear();
    this.failed = 0;
    this.hierarchy.asked.clear();
  }

  #fail(error, chart = null) {
    this.hierarchy.error = null;
    ++this.failed;
    this.dispatchEvent({type: 'error', error, chart});
  }

  #upload() {
    // While it moves, each costs a part of the frame; at rest, nobody sees that.
    const batch = this.arrived.splice(0, this.resting ? 2 * this.uploadsPerFrame : this.uploadsPerFrame);
    for (const {key, chart, drawn} of batch) {
      if (this.charts.has(key)) continue;
      const geometry = toGeometry(drawn), arrays = arraysOf(geometry);
      const {centre, radius} = chart.sphere;
      geometry.boundingSphere = new THREE.Sphere(new THREE.Vector3(...centre).sub(this.inner.position), radius);
      const mesh = new THREE.Mesh(geometry, this.material);
      mesh.visible = false;
      mesh.userData = {chart, triangles: drawn.triangles.length / 3};
      this.inner.add(mesh);
      const border = geometry.userData.normalsComputed ? this.borders.add(geometry) : null;
      if (border) this.#fitNormals(chart, border);
      this.dispatchEvent({type: 'chart', mesh, chart});
      const bytes = bytesOf(mesh, border);
      this.charts.set(key, {key, mesh, arrays, bytes, border, used: this.frame});
      this.heldBytes += bytes;
    }
    return batch.length;
  }
  /** A chart and those that touch it have the same normals where they meet. */
  #fitNormals(chart, border) {
    this.borders.apply(border);
    for (const {mesh, border: other} of this.charts.values()) {
      if (other && touches(mesh.userData.chart.sphere, chart.sphere)) this.borders.apply(other);
    }
  }

  /** What was not needed for longest goes first. Where all of it is needed the view has to do with less. */
  #forget() {
    if (this.heldBytes > this.maxBytes) {
      const unused = [];
      for (const chart of this.charts.values()) {
        if (chart.used < this.frame) unused.push(chart);
      }
      for (const {key} of unused.sort((a, b) => a.used - b.used)) {
        if (this.heldBytes <= this.maxBytes) break;
        this.#drop(key);
      }
    }
    if (this.heldBytes > this.maxBytes) this.pressure *= 1.1;
    else if (this.heldBytes < 0.6 * this.maxBytes) this.pressure = Math.max(1, this.pressure / 1.02);
  }

  #drop(key) {
    const {mesh, arrays, bytes, border} = this.charts.get(key);
    if (border) this.borders.remove(border);
    this.inner.remove(mesh);
    mesh.geometry.dispose();
    // At once: until a browser looks for what nobody uses there may be a hundred megabytes of it.
    for (const buffer of new Set(arrays.map(array => array.buffer))) buffer.transfer?.(0);
    this.charts.delete(key);
    this.heldBytes -= bytes;
  }

  /** To be called when geometry of charts was changed: how much memory they take now. */
  weigh() {
    this.heldBytes = 0;
    for (const chart of this.charts.values()) {
      chart.bytes = bytesOf(chart.mesh, chart.border);
      this.heldBytes += chart.bytes;
    }
  }

  /** What a ray of the world meets first, on the exact original: see MeshFile.pick(). null: nothing. */
  async pick(raycaster, options) {
    const inverse = this.matrixWorld.clone().invert();
    const origin = raycaster.ray.origin.clone().applyMatrix4(inverse);
    const direction = raycaster.ray.direction.clone().transformDirection(inverse);
    return this.file.pick(origin.toArray(), direction.toArray(), options);
  }
}
