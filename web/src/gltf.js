// glTF files whose geometry is in .maille files: the extension MAILLE_mesh_compression (docs/gltf.md), read for whatever
// loads glTF. `MailleMeshCompression` is the plug-in for GLTFLoader of three.js; gltf_transform.js has that of gltf-transform.

import {Decoder, DecoderFile, decoderFor, ErrorCode, MailleError, WantsBytes} from './decoder.js';
import {ready} from './maille.js';

export const EXTENSION = 'MAILLE_mesh_compression';

const components = {SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4};
const arrayOfComponent = {5120: Int8Array, 5121: Uint8Array, 5122: Int16Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array};

function malformed(text) {
  return new MailleError(ErrorCode.malformed, `${EXTENSION}: ${text}`);
}

/**
 * Decodes files of mode single at once, without promises: `const decoder = await createSyncDecoder()`, then
 * `decoder.decode(bytes)`. `full`: also those of levels 7 to 9, by a decoder twice as large. One for many files.
 */
export async function createSyncDecoder({full = false} = {}) {
  const decoder = await Decoder.create(await ready(full ? {full} : {mode: 'single'}));
  return {
    /** {positions, arrays, blocks}, as MeshFile.decode(). */
    decode(bytes, name = 'a .maille file') {
      const file = new DecoderFile(decoder, bytes.byteLength, name);
      try {
        file.give(0, bytes);
        const mesh = file.decode(false);
        if (mesh instanceof WantsBytes) throw new MailleError(ErrorCode.corrupt, `${name}: is cut off`);
        return mesh;
      } catch (error) {
        if (decoderFor[error.code] !== 'full') throw error;
        const needs = 'needs the full decoder: createSyncDecoder({full: true})';
        throw Object.assign(new MailleError(ErrorCode.unsupported, `${name}: ${needs}`), {needsFull: true});
      } finally {
        file.close();
      }
    },
  };
}

/** Primitives that share their vertices: those of one .maille file with the same accessor of positions. */
class SharedVertices {
  blocks = new Set();

  constructor(file) {
    this.file = file;  // what all of one file know of it
    file.lists += 1;
  }
  /** The points that are vertices, in rising order, and the vertex of each point from `first` on; null: all points are. */
  of(mesh) {
    if (this.file.lists === 1) return null;
    if (this.mesh === mesh) return this.found;
    const corners = [...this.blocks].map(block => blockOf(mesh, block).connectivity);
    let first = Infinity, last = -1;
    for (const points of corners) {
      for (let i = 0; i < points.length; ++i) {
        if (points[i] < first) first = points[i];
        if (points[i] > last) last = points[i];
      }
    }
    const vertex = new Uint32Array(Math.max(last - first + 1, 0));
    for (const points of corners) for (let i = 0; i < points.length; ++i) vertex[points[i] - first] = 1;
    let count = 0;
    for (let i = 0; i < vertex.length; ++i) if (vertex[i]) vertex[i] = ++count;
    const points = new Uint32Array(count);
    for (let i = 0; i < vertex.length; ++i) if (vertex[i]) points[--vertex[i]] = i + first;
    this.mesh = mesh;
    this.found = {points, vertex, first};
    return this.found;
  }
}

function blockOf(mesh, number) {
  const block = mesh.blocks[number];
  if (!block || block.connectivity.length % 3 !== 0) throw malformed(`the file has no block ${number} of triangles`);
  return block;
}

function valuesOf(mesh, name, vertices) {
  const array = name === 'position' ? {values: mesh.positions, components: 3} : mesh.arrays.find(one => one.name === name && one.domain === 'point');
  if (!array) throw malformed(`the file has no array '${name}' of points`);
  const {values, components: size} = array;
  if (!vertices) return values;
  const {points} = vertices, picked = new values.constructor(points.length * size);
  for (let i = 0, to = 0; i < points.length; ++i) {
    const from = points[i] * size;
    for (let k = 0; k < size; ++k) picked[to++] = values[from + k];
  }
  return picked;
}

function indicesOf(mesh, block, vertices, Type) {
  const corners = blockOf(mesh, block).connectivity, indices = new Type(corners.length);
  if (!vertices) indices.set(corners);
  else for (let i = 0; i < corners.length; ++i) indices[i] = vertices.vertex[corners[i] - vertices.first];
  return indices;
}

/**
 * The accessors of a glTF document that .maille files hold: Map of their numbers to {view, values(mesh)}: the buffer view
 * with the file, and what gives the accessor's typed array when that is decoded.
 */
export function compressedAccessors(json) {
  const accessors = new Map(), files = new Map(), lists = new Map();
  const give = (number, view, values) => {
    const accessor = json.accessors?.[number];
    if (!accessor) throw malformed(`a primitive names accessor ${number}, which does not exist`);
    const Type = arrayOfComponent[accessor.componentType], size = accessor.count * components[accessor.type];
    if (accessors.has(number)) return;
    accessors.set(number, {view, values: mesh => {
      const array = values(mesh, Type);
      if (array.constructor !== Type || array.length !== size) throw malformed(`accessor ${number} is not what was decoded`);
      return array;
    }});
  };
  for (const mesh of json.meshes ?? []) {
    for (const primitive of mesh.primitives) {
      const link = primitive.extensions?.[EXTENSION];
      if (!link) continue;
      const view = link.bufferView, block = link.block ?? 0, key = `${view} ${primitive.attributes.POSITION}`;
      if (!files.has(view)) files.set(view, {lists: 0});
      if (!lists.has(key)) lists.set(key, new SharedVertices(files.get(view)));
      const vertices = lists.get(key);
      vertices.blocks.add(block);
      const giveAll = (names, numbers) => {
        for (const [semantic, name] of Object.entries(names)) give(numbers?.[semantic], view, decoded => valuesOf(decoded, name, vertices.of(decoded)));
      };
      giveAll(link.attributes, primitive.attributes);
      link.targets?.forEach((names, t) => giveAll(names, primitive.targets?.[t]));
      give(primitive.indices, view, (decoded, Type) => indicesOf(decoded, block, vertices.of(decoded), Type));
    }
  }
  return accessors;
}

let decoders = {};
function decoderOf(kind) {
  const made = decoders[kind] ??= createSyncDecoder({full: kind === 'full'});
  made.catch(() => { decoders[kind] = undefined; });  // the next one tries again
  return made;
}
async function decode(bytes, name) {
  try {
    return (await decoderOf('small')).decode(bytes, name);
  } catch (error) {
    if (!error.needsFull) throw error;
    return (await decoderOf('full')).decode(bytes, name);
  }
}

/** For GLTFLoader of three.js: `loader.register(parser => new MailleMeshCompression(parser))`. */
export class MailleMeshCompression {
  name = EXTENSION;
  #given = new Map();   // buffer views that we add, with the accessor whose values they hold
  #meshes = new Map();  // decoded, by the view with the file: {mesh, waiting}

  constructor(parser) {
    this.parser = parser;
  }

  /** Adds a buffer view for each accessor that has none; nothing is decoded before it is wanted. */
  beforeRoot() {
    const {json} = this.parser, waiting = new Map();
    for (const [number, {view, values}] of compressedAccessors(json)) {
      const accessor = json.accessors[number];
      accessor.bufferView = json.bufferViews.push({buffer: 0, byteOffset: 0, byteLength: 0}) - 1;
      waiting.set(view, (waiting.get(view) ?? 0) + 1);
      this.#given.set(accessor.bufferView, {view, values});
    }
    for (const [view, count] of waiting) this.#meshes.set(view, {mesh: null, waiting: count});
    return null;
  }

  /** ArrayBuffer of one of these; null: of another view, which the loader reads. */
  loadBufferView(index) {
    const given = this.#given.get(index);
    if (!given) return null;
    const entry = this.#meshes.get(given.view);
    entry.mesh ??= this.parser.getDependency('bufferView', given.view)
      .then(bytes => decode(new Uint8Array(bytes), `${EXTENSION}, buffer view ${given.view}`));
    return entry.mesh.then(mesh => {
      const array = given.values(mesh);
      if (--entry.waiting <= 0) entry.mesh = null;  // all have theirs
      const whole = array.byteOffset === 0 && array.byteLength === array.buffer.byteLength;
      return whole ? array.buffer : array.slice().buffer;
    });
  }
}
