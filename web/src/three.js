// three.js: a loader with the manners of DRACOLoader, and an object that refines itself as it is looked at.

import * as THREE from 'three';

import {MeshFile, setDecoder} from './maille.js';

/** What an array of a mesh is called in three.js, by its role. */
const attributeNames = {normal: 'normal', colour: 'color', texture_coordinate: 'uv', tangent: 'tangent'};
const normalised = new Set(['i8', 'u8', 'i16', 'u16']);

/** A BufferGeometry of what decodeNode() or decode({drawn: true}) gives; other arrays keep their names. */
export function toGeometry({positions, triangles, arrays, origin}) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
  const small = positions.length / 3 <= 65536;
  geometry.setIndex(new THREE.BufferAttribute(small ? Uint16Array.from(triangles) : triangles, 1));
  for (const array of arrays) {
    if (array.domain !== 'point') continue;
    const wide = array.values instanceof Float64Array || array.values instanceof BigInt64Array || array.values instanceof BigUint64Array;
    const values = wide ? Float32Array.from(array.values, Number) : array.values;
    const name = attributeNames[array.role] ?? array.name;
    if (!geometry.hasAttribute(name))
      geometry.setAttribute(name, new THREE.BufferAttribute(values, array.components, array.role !== 'none' && normalised.has(array.type)));
  }
  if (!geometry.hasAttribute('normal')) geometry.computeVertexNormals();
  geometry.userData.origin = origin;
  return geometry;
}

/** Loads whole files of any mode: `loader.load(url, geometry => ..., onProgress, onError)`, `loadAsync`, `parse`. */
export class MailleLoader extends THREE.Loader {
  #workers;

  /** The folder of maille.wasm, where it is not beside the library. */
  setDecoderPath(path) {
    setDecoder(`${path.replace(/\/?$/, '/')}maille.wasm`);
    return this;
  }
  setWorkerLimit(count) {
    this.#workers = count;
    return this;
  }
  preload() {
    import('./maille.js').then(({ready}) => ready()).catch(() => {});
    return this;
  }
  dispose() {
    return this;
  }

  load(url, onLoad, onProgress, onError) {
    const address = this.manager.resolveURL((this.path ?? '') + url);
    this.manager.itemStart(address);
    this.#read(address, onProgress).then(onLoad).catch(error => {
      if (onError) onError(error);
      else console.error(error);
      this.manager.itemError(address);
    }).finally(() => this.manager.itemEnd(address));
  }
  parse(buffer, onLoad, onError = console.error) {
    this.#read(buffer).then(onLoad, onError);
  }

  async #read(input, onProgress) {
    let size = 0;
    const onBytes = loaded => onProgress?.({lengthComputable: size > 0, loaded, total: size});
    const file = await MeshFile.open(input, {workers: this.#workers, headers: this.requestHeader, onBytes,
      credentials: this.withCredentials ? 'include' : 'same-origin', maxWhole: Infinity});
    size = file.size;
    try {
      const drawn = await file.decode({drawn: true});
      const geometry = toGeometry(drawn);
      // Loaded whole, geometry stands where the file has it.
      geometry.translate(...drawn.origin);
      return geometry;
    } finally {
      file.close();
    }
  }
}

/**
 * A file of mode random in a scene: the charts that a view needs, fetched and decoded as it moves. What is shown is
 * always one cut through the hierarchy, so there are no cracks. Events: 'progress' {loaded, wanted, triangles}, 'error' {error}.
 */
export class MailleObject extends THREE.Object3D {
  /**
   * @param {MeshFile} file
   * @param {object} options errorTarget: pixels; maxBytes: of geometry kept; material; uploadsPerFrame: charts that are
   *   made ready for the GPU in one frame
   */
  constructor(file, {errorTarget = 1.5, maxBytes = 256e6, material, uploadsPerFrame = 4} = {}) {
    super();
    Object.assign(this, {file, errorTarget, maxBytes, uploadsPerFrame, heldBytes: 0, triangles: 0});
    this.material = material ?? new THREE.MeshStandardMaterial({color: 0xc8c4bc, roughness: 0.8, side: THREE.DoubleSide});
    this.charts = new Map();   // by key: {mesh, bytes, used}
    this.loading = new Map();  // by key: AbortController
    this.arrived = [];
    this.frame = 0;
    this.shown = new Set();
  }

  static async open(input, options = {}) {
    return new MailleObject(await MeshFile.open(input, options), options);
  }

  dispose() {
    for (const controller of this.loading.values()) controller.abort();
    for (const chart of this.charts.values()) chart.mesh.geometry.dispose();
    this.charts.clear();
    this.file.close();
    this.removeFromParent();
  }

  /** Once a frame, before render(). Returns whether all that the view needs is shown. */
  update(camera, renderer) {
    ++this.frame;
    this.#upload();
    const request = this.#requestOf(camera, renderer);
    // The finest cut that is here is shown; what the next finer one lacks is fetched.
    let finer = null;
    for (let pixels = this.errorTarget; ; pixels *= 2) {
      const cut = this.file.selectNow({...request, view: {...request.view, pixels}});
      if (!cut) return false;
      const missing = cut.filter(chart => !this.charts.has(keyOf(chart)));
      const last = cut.every(chart => chart.level === this.file.levels.length - 1);
      if (missing.length === 0) {
        this.#show(cut);
        break;
      }
      finer = missing;
      if (last) break;
    }
    this.#fetch(finer ?? []);
    this.#forget();
    const done = finer === null;
    this.dispatchEvent({type: 'progress', loaded: this.charts.size, wanted: finer?.length ?? 0, triangles: this.triangles});
    return done;
  }

  #requestOf(camera, renderer) {
    camera.updateMatrixWorld();
    this.updateWorldMatrix(true, false);
    const inverse = this.matrixWorld.clone().invert();
    const toClip = new THREE.Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).multiply(this.matrixWorld);
    const planes = new THREE.Frustum().setFromProjectionMatrix(toClip, camera.coordinateSystem).planes
      .map(({normal, constant}) => ({normal: normal.toArray(), offset: constant}));
    const eye = new THREE.Vector3().setFromMatrixPosition(camera.matrixWorld).applyMatrix4(inverse).toArray();
    const height = renderer.getDrawingBufferSize(new THREE.Vector2()).y;
    const pixelsPerRadian = height / (2 * Math.tan(THREE.MathUtils.degToRad(camera.fov ?? 50) / 2) / (camera.zoom ?? 1));
    return {planes, view: {eye, pixelsPerRadian}};
  }

  #show(cut) {
    const wanted = new Set(cut.map(keyOf));
    this.triangles = 0;
    for (const key of this.shown) {
      if (!wanted.has(key)) this.charts.get(key).mesh.visible = false;
    }
    for (const key of wanted) {
      const chart = this.charts.get(key);
      chart.mesh.visible = true;
      chart.used = this.frame;
      this.triangles += chart.mesh.geometry.index.count / 3;
    }
    this.shown = wanted;
  }

  #fetch(wanted) {
    const keys = new Set(wanted.map(keyOf));
    for (const [key, controller] of this.loading) {
      if (!keys.has(key)) controller.abort();
    }
    for (const chart of wanted) {
      const key = keyOf(chart);
      if (this.loading.has(key) || this.charts.has(key)) continue;
      const controller = new AbortController();
      this.loading.set(key, controller);
      this.file.decodeNode(chart, {signal: controller.signal}).then(
        drawn => this.arrived.push({key, chart, drawn}),
        error => { if (!controller.signal.aborted) this.dispatchEvent({type: 'error', error}); },
      ).finally(() => this.loading.delete(key));
    }
  }

  #upload() {
    for (const {key, chart, drawn} of this.arrived.splice(0, this.uploadsPerFrame)) {
      if (this.charts.has(key)) continue;
      const geometry = toGeometry(drawn);
      const {centre, radius} = chart.sphere;
      geometry.boundingSphere = new THREE.Sphere(new THREE.Vector3(...centre).sub(new THREE.Vector3(...drawn.origin)), radius);
      const mesh = new THREE.Mesh(geometry, this.material);
      mesh.position.fromArray(drawn.origin);
      mesh.visible = false;
      mesh.userData.chart = chart;
      this.add(mesh);
      const bytes = [geometry.index, ...Object.values(geometry.attributes)].reduce((sum, a) => sum + a.array.byteLength, 0);
      this.charts.set(key, {mesh, bytes, used: this.frame});
      this.heldBytes += bytes;
    }
  }

  /** What was not shown for longest goes first; what is shown stays. */
  #forget() {
    if (this.heldBytes <= this.maxBytes) return;
    const unused = [...this.charts].filter(([key]) => !this.shown.has(key)).sort(([, a], [, b]) => a.used - b.used);
    for (const [key, {mesh, bytes}] of unused) {
      if (this.heldBytes <= this.maxBytes) return;
      this.remove(mesh);
      mesh.geometry.dispose();
      this.charts.delete(key);
      this.heldBytes -= bytes;
    }
  }

  /** What a ray of the world meets first, on the exact original; null: nothing. */
  async pick(raycaster, options) {
    const inverse = this.matrixWorld.clone().invert();
    const origin = raycaster.ray.origin.clone().applyMatrix4(inverse);
    const direction = raycaster.ray.direction.clone().transformDirection(inverse);
    return this.file.pick(origin.toArray(), direction.toArray(), options);
  }
}

function keyOf({group, chart}) {
  return `${group}/${chart}`;
}
