// What is shown: a file of mode random, which refines itself, a mesh that is here as a whole, or a scene of glTF (gltf_model.js).
// All have {object, sphere, meshes, triangles, fields, update(), pick(), dispose()}.

import * as THREE from 'three';

import {MeshFile} from '../../src/maille.js';
import {cacheBytesFor, isOfCells, MailleObject, toGeometry} from '../../src/three.js';
import {Cuts} from './cut_faces.js';
import {readMaterials} from './materials.js';
import {bytesText, counted, Rate} from './text.js';
import {cornersOf, pickDrawn, triangleOf, valuesAt, weightsOf} from './values.js';

/** Servers without ranges give all of a file: as much as a page can hold. */
const MOST_BYTES = 2 ** 31;
/** As fine as this, in pixels, is what is seen when the camera rests. */
const RESTING = 0.2;
/** A volume that is not in pieces is decoded whole for a cut: larger ones have none. */
const MOST_CUT = 64e6;

/**
 * @param input address, File or ArrayBuffer
 * @param {object} on bytes(fetched, size): how far it is; size 0: not known yet
 */
export async function openModel(input, on = {}, signal = undefined) {
  let file = null;
  const count = {fetched: 0};
  const onBytes = bytes => {
    count.fetched += bytes;
    on.bytes?.(count.fetched, file?.size ?? 0);
  };
  if (await isGltf(input)) {
    const {readGltf} = await import('./gltf_model.js');
    const bytes = await wholeOf(input, on, signal), address = typeof input === 'string' ? new URL(input, location.href) : null;
    return readGltf(bytes, address, address?.href ?? input.name ?? 'scene', {fetched: address ? bytes.byteLength : 0});
  }
  file = await MeshFile.open(input, {maxWhole: MOST_BYTES, cacheBytes: cacheBytesFor(budget()), fetch: countingFetch(onBytes), signal});
  try {
    if (file.mode === 'random') return new RefinedModel(file, count, () => materialsOf(file, input));
    if (file.inPieces) {
      const {VolumeModel} = await import('./volume_model.js');
      return new VolumeModel(file, count, await file.coarse({signal}));
    }
    const onProgress = ({loaded}) => on.bytes?.(Math.max(count.fetched, loaded ?? 0), file.size);
    const begin = performance.now(), drawn = await file.surface({signal, onProgress});
    const model = new WholeModel(file, count, drawn, performance.now() - begin);
    return file.mode === 'single' ? Object.assign(model, {materials: materialsOf(file, input)}) : model;
  } catch (error) {
    file.close();
    throw error;
  }
}

/** Addresses tell it by their end, other input by its first bytes: so do .glb and .maille.glb, and .gltf by its name. */
async function isGltf(input) {
  const name = typeof input === 'string' ? new URL(input, location.href).pathname : input.name ?? '';
  if (/\.(glb|gltf)$/i.test(name) || typeof input === 'string') return /\.(glb|gltf)$/i.test(name);
  const first = input instanceof ArrayBuffer ? input.slice(0, 4) : await input.slice(0, 4).arrayBuffer();
  return new TextDecoder().decode(first) === 'glTF';
}

/** All bytes of an address, File or ArrayBuffer. */
async function wholeOf(input, on, signal) {
  if (typeof input !== 'string') return input instanceof ArrayBuffer ? input : input.arrayBuffer();
  let fetched = 0, size = 0;
  const response = await countingFetch(bytes => on.bytes?.(fetched += bytes, size))(input, {signal});
  if (!response.ok) throw new Error(`${input}: the server answered ${response.status} ${response.statusText}`.trim());
  size = Number(response.headers.get('content-length')) || 0;
  return response.arrayBuffer();
}

/** A promise of the materials that a file names, see materials.js; null: it names none, or what it names is not beside it. */
async function materialsOf(file, input) {
  try {
    return await readMaterials(await file.readMetadata(), typeof input === 'string' ? new URL(input, location.href) : null);
  } catch {
    return null;  // the mesh is shown all the same
  }
}

/** fetch() that tells of bytes as they arrive, not only of answers that are complete. */
function countingFetch(onBytes) {
  return async (...given) => {
    const response = await fetch(...given);
    if (!response.ok || !response.body) return response;
    const counter = new TransformStream({
      transform(bytes, controller) {
        onBytes(bytes.byteLength);
        controller.enqueue(bytes);
      },
    });
    const {status, statusText, headers} = response;
    return new Response(response.body.pipeThrough(counter), {status, statusText, headers});
  };
}

class RefinedModel {
  /** @param {function} readMaterials gives a promise of them; is asked when there is something that has materials */
  constructor(file, count, readMaterials) {
    Object.assign(this, {file, count, refines: true, rate: new Rate()});
    let resolve;
    this.materials = new Promise(done => { resolve = done; });
    this.object = new MailleObject(file, {maxBytes: budget(), restTarget: RESTING});
    this.fields = new Map();
    this.object.addEventListener('chart', ({mesh}) => {
      const {arrays} = mesh.geometry.userData;
      noteFields(this.fields, arrays);
      if (resolve && arrays.some(({name, role}) => role === 'texture_coordinate' || name === 'material')) {
        readMaterials().then(resolve);
        resolve = null;
      }
      this.rate.add(mesh.userData.triangles);
    });
  }
  get sphere() { return this.object.boundingSphere; }
  /** Around what is shown; what will be shown may be larger. */
  get shownBox() { return boxOf(this.shown); }
  get meshes() { return this.object.meshes; }
  get shown() { return this.meshes.filter(mesh => mesh.visible); }
  get triangles() { return this.object.triangles; }
  get about() {
    const {levels} = this.file;
    return `${counted(levels[0]?.faces ?? 0, 'face')} · ${counted(levels.length, 'level')} · ${bytesText(this.file.size)}`;
  }
  get decodeRate() { return this.rate.value; }
  update(camera, renderer) { return this.object.update(camera, renderer); }
  weigh() { this.object.weigh(); }
  dispose() { this.object.dispose(); }

  /** The exact face that a ray meets: {position, distance, face, number, chart, values}. */
  async pick(raycaster) {
    const hit = await this.object.pick(raycaster);
    if (!hit) return null;
    const [drawn, finest] = await Promise.all([this.file.decodeNode(hit), this.file.select({level: 0})]);
    let number = hit.face;
    for (const chart of finest) {
      if (chart.group === hit.group && chart.chart === hit.chart) break;
      number += chart.faces;
    }
    const triangle = triangleOf(drawn, hit);
    return {
      ...hit, number, position: hit.position, values: triangle === null ? [] : valuesAt(drawn, triangle, weightsOf(drawn, triangle, hit)),
      corners: triangle === null ? [] : cornersOf(drawn, triangle, drawn.origin),
    };
  }
}

class WholeModel {
  constructor(file, count, drawn, milliseconds) {
    Object.assign(this, {file, count, drawn, step: 0, refines: false, undrawable: leaveOutUndrawable(drawn)});
    // The boundary of solids has edges: normals of points, which nobody gave it, would round them off.
    this.flat = file.mode === 'stream' && !drawn.arrays.some(array => array.role === 'normal');
    const geometry = toGeometry(drawn);
    geometry.computeBoundingSphere();
    const mesh = new THREE.Mesh(geometry);
    mesh.position.fromArray(drawn.origin);
    mesh.userData = {chart: {level: 0, group: 0, chart: 0}, triangles: drawn.triangles.length / 3};
    this.mesh = mesh;
    this.object = new THREE.Group().add(mesh);
    if (file.mode === 'stream' && file.size <= MOST_CUT) this.#offerCuts();
    this.fields = new Map();
    noteFields(this.fields, drawn.arrays);
    this.decodeRate = milliseconds > 0 ? mesh.userData.triangles / milliseconds * 1000 : null;
    this.triangles = mesh.userData.triangles;
    const {center, radius} = geometry.boundingSphere;
    this.sphere = new THREE.Sphere(center.clone().add(mesh.position), Number.isFinite(radius) ? radius : 1);
  }
  #offerCuts() {
    this.cut = new Cuts(this.file, {
      part: mesh => this.object.dispatchEvent({type: 'chart', mesh}), error: error => this.object.dispatchEvent({type: 'error', error}),
      changed: () => this.onChange?.(),
    });
    this.object.add(this.cut.group);
    this.object.retry = () => {};
  }
  get meshes() { return [this.mesh, ...this.cut?.meshes ?? []]; }
  get shown() { return this.meshes; }
  get box() { return boxOf([this.mesh]); }
  get about() {
    return `${counted(this.triangles, 'triangle')} shown · mode ${this.file.mode} · ${bytesText(this.file.size)}`;
  }
  update() { return !this.cut?.running; }
  dispose() {
    this.cut?.dispose();
    this.mesh.geometry.dispose();
    this.object.removeFromParent();
    this.file.close();
  }

  async pick(raycaster) {
    return pickDrawn(raycaster, this.meshes);
  }
  /** Of what pick() gave, at the step that is shown. */
  valuesAt({drawn, triangle, weights}) {
    return valuesAt(drawn, triangle, weights);
  }
  /** @param {THREE.Plane[]} planes of the cuts that are shown */
  setCuts(planes) {
    this.cut?.set(planes, {step: this.step});
  }

  /** The values of a step of time instead of those that are shown: on the same vertices and triangles. */
  async showStep(step, signal) {
    const {arrays} = await this.file.surface({step, signal});
    signal.throwIfAborted();
    noteFields(this.fields, arrays);
    // In place: the geometries have the same list.
    this.drawn.arrays.splice(0, Infinity, ...arrays);
    this.step = step;
    this.cut?.set(this.cut.planes, {step});
  }
}

/** Triangles with corners that are no finite numbers become points at the origin of the mesh; @returns how many. */
function leaveOutUndrawable({positions, triangles}) {
  if (positions.every(Number.isFinite)) return 0;
  const isDrawable = vertex => [0, 1, 2].every(c => Number.isFinite(positions[3 * vertex + c]));
  let leftOut = 0;
  for (let at = 0; at < triangles.length; at += 3) {
    if ([0, 1, 2].every(k => isDrawable(triangles[at + k]))) continue;
    triangles.fill(triangles[at], at, at + 3);
    ++leftOut;
  }
  for (let i = 0; i < positions.length; ++i) {
    if (!Number.isFinite(positions[i])) positions[i] = 0;
  }
  return leftOut;
}

/** What can be coloured by, with the range seen so far. */
function noteFields(fields, arrays) {
  for (const array of arrays) {
    const domain = isOfCells(array) ? 'cell' : 'point', key = `${domain} ${array.name}`, {name, role, components, type, labels} = array;
    if (domain === 'cell' || array.domain === 'point') fields.set(key, fields.get(key) ?? {key, name, domain, role, components, type, labels});
  }
}

function boxOf(meshes) {
  const box = new THREE.Box3();
  for (const {geometry, position, parent} of meshes) {
    if (!geometry.boundingBox) geometry.computeBoundingBox();
    if (!geometry.boundingBox.isEmpty()) box.union(geometry.boundingBox.clone().translate(position).translate(parent.position));
  }
  return box;
}

function budget() {
  return (navigator.deviceMemory ?? 4) * 64e6;
}
