// A scene of glTF with its own materials and pictures, as GLTFLoader reads it; its geometry may be in .maille files (docs/gltf.md).
// It is shown as it is stored: nothing moves.

import * as THREE from 'three';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';

import {MailleMeshCompression} from '../../src/gltf.js';
import {bytesText, counted} from './text.js';
import {pickDrawn} from './values.js';

/** Roles of what can be coloured by: fields are none of these. */
const roles = {normal: 'normal', tangent: 'tangent', color: 'colour', uv: 'texture_coordinate'};

/**
 * @param {ArrayBuffer} bytes of a .glb or .gltf file
 * @param {URL | null} address of the file; null: nothing lies beside it
 * @param {string} name of the file
 * @param {object} count {fetched}: bytes that came from a server
 */
export async function readGltf(bytes, address, name, count) {
  checkLength(bytes, name);
  const manager = new THREE.LoadingManager(), missing = [];
  manager.setURLModifier(url => (mayBeAsked(url, address) ? url : 'data:,'));
  manager.onError = url => missing.push(url);
  const loader = new GLTFLoader(manager).register(parser => new MailleMeshCompression(parser)), begin = performance.now();
  const gltf = await loader.parseAsync(bytes, address ? new URL('.', address).href : '').catch(error => {
    throw new Error(`${name}: cannot be read as glTF: ${error.message}`, {cause: error});
  });
  return new GltfModel(gltf, {name, bytes: bytes.byteLength, count, missing: missing.length, milliseconds: performance.now() - begin});
}

/** GLTFLoader would read what is missing as nothing. */
function checkLength(bytes, name) {
  const GLB = 0x46546c67, header = new DataView(bytes), isGlb = bytes.byteLength >= 12 && header.getUint32(0, true) === GLB;
  const wanted = isGlb ? header.getUint32(8, true) : 0;
  if (wanted > bytes.byteLength) throw new Error(`${name}: is cut off: it has ${bytesText(bytes.byteLength)} of ${bytesText(wanted)}`);
}

/** Files that a scene names are read if they lie in its folder or below it; a scene of somebody else asks nobody else. */
function mayBeAsked(url, address) {
  return /^(blob|data):/.test(url) || Boolean(address) && new URL(url, address).href.startsWith(new URL('.', address).href);
}

class GltfModel {
  constructor(gltf, {name, bytes, count, missing, milliseconds}) {
    Object.assign(this, {count, refines: false, reflects: true, missing, object: gltf.scene ?? new THREE.Group(), meshes: []});
    // What the page asks of files: it has neither levels nor steps.
    this.file = {name, mode: 'gltf', size: bytes, levels: [], readSteps: async () => [], close() {}};
    this.fields = new Map();
    this.object.updateMatrixWorld(true);
    this.object.traverse(object => object.isMesh && this.#add(object));
    this.triangles = this.meshes.reduce((sum, mesh) => sum + mesh.userData.triangles, 0);
    this.decodeRate = milliseconds > 0 ? this.triangles / milliseconds * 1000 : null;
    this.materialsByName = new Map(this.meshes.flatMap(mesh => mesh.userData.own).map(each => [each.uuid, each]));
    this.materials = Promise.resolve(this.materialsByName);
    this.box = new THREE.Box3();
    for (const mesh of this.meshes) this.box.expandByObject(mesh);
    this.sphere = this.box.isEmpty() ? new THREE.Sphere(new THREE.Vector3(), 1) : this.box.getBoundingSphere(new THREE.Sphere());
  }
  #add(mesh) {
    const {geometry, material} = mesh;
    if (!geometry.userData.arrays) describe(geometry);
    material.userData = {isOfScene: true, flat: material.flatShading};
    mesh.userData = {chart: {level: 0, group: 0, chart: 0}, triangles: geometry.index.count / 3, own: material};
    for (const {name, role, components, type} of geometry.userData.arrays) {
      const key = `point ${name}`;
      this.fields.set(key, this.fields.get(key) ?? {key, name, domain: 'point', role, components, type});
    }
    this.meshes.push(mesh);
  }
  get shown() { return this.meshes; }
  get about() {
    return `${counted(this.triangles, 'triangle')} · ${counted(this.materialsByName.size, 'material')} · ${bytesText(this.file.size)}`;
  }
  update() { return true; }
  async pick(raycaster) {
    return pickDrawn(raycaster, this.meshes);
  }
  dispose() {
    for (const material of this.materialsByName.values()) {
      for (const value of Object.values(material)) if (value?.isTexture) disposeTexture(value);
      material.dispose();
    }
    for (const {geometry} of this.meshes) geometry.dispose();
    this.object.removeFromParent();
  }
}

/** Pictures of GLTFLoader are bitmaps, which no collector finds soon. */
function disposeTexture(texture) {
  texture.dispose();
  texture.source.data?.close?.();
}

/** What meshes of toGeometry() have in userData. */
function describe(geometry) {
  const {attributes} = geometry, {count} = attributes.position;
  if (!geometry.index) geometry.setIndex(Array.from({length: count}, (_, i) => i));
  const arrays = Object.entries(attributes).filter(([name]) => name !== 'position').map(([name, attribute]) => ({
    name, domain: 'point', role: roles[name.replace(/\d+$/, '')] ?? 'other', components: attribute.itemSize, type: 'f32', values: valuesOf(attribute)}));
  const cells = new Uint32Array(geometry.index.count / 3).map((_, i) => i);
  geometry.userData = {origin: [0, 0, 0], cells, arrays};
}
/** One after the other, as numbers that they stand for. */
function valuesOf(attribute) {
  const {count, itemSize} = attribute, values = new Float32Array(count * itemSize);
  for (let i = 0; i < values.length; ++i) values[i] = attribute.getComponent(Math.floor(i / itemSize), i % itemSize);
  return values;
}
