// Reads .maille files in browsers and node: any part at any level of detail, decoded where it is looked at.

import {bytesOf, CachedBytes} from './bytes.js';
import {compileDecoder, ErrorCode, MailleError, withCounts} from './decoder.js';
import {DecoderPool} from './pool.js';
import {Session} from './session.js';

export {ErrorCode, MailleError};

const MAGIC = [0x89, 0x4d, 0x41, 0x49, 0x0d, 0x0a, 0x1a, 0x0a];
const MODES = ['single', 'stream', 'random'];
const HEADER = 25;
/** Where the header has its required features, and the one of a volume in pieces. */
const FEATURES = 12, IN_PIECES = 1;
/** What extract() gives, unless it is told otherwise. */
const THE_MESH_ITSELF = {level: 0, clip: true};

// Charts of triangles; all of modes random and single at the usual levels; all modes: each twice as large as the one before.
const FILES = {charts: 'maille-charts.wasm', small: 'maille.wasm', full: 'maille-full.wasm'};
const KINDS = Object.keys(FILES);
// Written out, so that bundlers see them.
const besideThis = {
  charts: () => new URL('../dist/maille-charts.wasm', import.meta.url),
  small: () => new URL('../dist/maille.wasm', import.meta.url),
  full: () => new URL('../dist/maille-full.wasm', import.meta.url),
};
let given = null;
const compiled = new Map();

/**
 * Where the decoders are, if not beside this file: the URL of maille.wasm, beside which the others stand; or bytes or a
 * compiled module of one of them: of the full one if there is to be one only. `full`: of the full one.
 */
export function setDecoder(source, full) {
  given = {source, full};
  compiled.clear();
  return ready();
}
function isAddress(source) {
  return typeof source === 'string' || source instanceof URL;
}
async function load(kind) {
  if (given && kind === 'full' && given.full && !isAddress(given.full)) return compileDecoder(given.full);
  // With given bytes of one decoder alone that is what there is.
  if (given && !isAddress(given.source) && !(kind === 'full' && given.full)) return compileDecoder(given.source);
  const url = given ? addressOf(kind) : besideThis[kind]();
  if (url.protocol !== 'file:') return compileDecoder(fetch(url));
  // Under node only; a bundler that knows the name would warn that browsers have no such module.
  const files = 'node:fs/promises', {readFile} = await import(/* webpackIgnore: true */ /* @vite-ignore */ files);
  return compileDecoder(readFile(url));
}
function addressOf(kind) {
  const base = globalThis.document?.baseURI ?? globalThis.location?.href ?? import.meta.url;
  if (kind === 'full' && given.full) return new URL(given.full, base);
  const small = new URL(given.source, base);
  return kind === 'small' ? small : new URL(FILES[kind], small);
}
/** Where the one for charts is missing, the small one does as well. */
function loadOrMore(kind) {
  return kind === 'charts' ? load(kind).catch(() => decoder('small')) : load(kind);
}
function decoder(kind) {
  if (!compiled.has(kind)) {
    const loading = loadOrMore(kind);
    loading.catch(() => compiled.delete(kind));  // the next one tries again
    compiled.set(kind, loading);
  }
  return compiled.get(kind);
}
function kindOfMode(mode) {
  return {random: 'charts', single: 'small'}[mode] ?? 'full';
}
/** The compiled decoder with which files of a mode are begun; `full`: of all modes. */
export function ready({full = false, mode = 'random'} = {}) {
  return decoder(full ? 'full' : kindOfMode(mode));
}

/** An open file. */
export class MeshFile {
  #kind = 'full';

  /**
   * @param input URL, Blob, ArrayBuffer, typed array, or {size, readAt(offset, size, signal)}
   * @param {object} options fetch, headers, credentials; maxWhole: bytes that may be read where the server gives no
   *   ranges; cacheBytes: of what was fetched, kept; meshBytes: what one decoded mesh may take; pieceBytes: of pieces of a
   *   volume, kept for the next slice; workers: number of threads (0: none); onBytes(fetched); signal
   */
  static async open(input, options = {}) {
    const bytes = new CachedBytes(await bytesOf(input, options), options.cacheBytes ?? 32 * 2 ** 20);
    const file = new MeshFile(bytes, options);
    try {
      await file.#begin(options.signal);
    } catch (error) {
      file.close();
      throw error;
    }
    return file;
  }

  constructor(bytes, options) {
    this.bytes = bytes;
    this.options = options;
    this.size = bytes.size;
    this.name = bytes.name;
  }

  async #begin(signal) {
    if (!(this.size >= HEADER)) throw new MailleError(ErrorCode.corrupt, `${this.name}: is no .maille file, it has ${this.size} bytes`);
    const header = await this.bytes.read(0, HEADER, signal);
    if (!MAGIC.every((byte, i) => header[i] === byte)) throw new MailleError(ErrorCode.corrupt, `${this.name}: is no .maille file`);
    this.mode = MODES[header[20]];
    // What is no known mode is refused by the decoder, with a sentence.
    this.#kind = kindOfMode(this.mode);
    this.module = await decoder(this.#kind);
    const about = {size: this.size, name: this.name, mode: this.mode, meshBytes: this.options.meshBytes};
    if (this.mode === 'stream') about.keptMemory = 320 * 2 ** 20;
    const file = {about, modules: () => this.#modules(), read: (ranges, signal) => this.#read(ranges, signal)};
    if (this.mode === 'random') {
      this.session = new Session(file.modules(), about, file.read);
      Object.assign(this, await this.session.run({call: 'open'}, {signal}));
    }
    this.pool = new DecoderPool(file, this.options.workers);
    this.inPieces = this.mode === 'stream' && (header[FEATURES] & IN_PIECES) !== 0;
    if (this.mode === 'stream') this.session = new Session(file.modules(), about, file.read);
    if (this.inPieces) await this.#openVolume(signal);
  }
  /** A volume, of which parts are read: the index of one in pieces, others are one piece. */
  async #openVolume(signal) {
    if (this.mode !== 'stream') throw new MailleError(ErrorCode.usage, `${this.name}: only files of mode "random" and volumes are read in parts; decode() reads this one whole`);
    const {Volume} = await import('./volume.js');
    return this.volume ??= await Volume.open(this, (ranges, signal) => this.#read(ranges, signal), signal);
  }
  #modules() {
    const other = async kind => {
      const module = await decoder(kind);
      if (KINDS.indexOf(kind) > KINDS.indexOf(this.#kind)) Object.assign(this, {module}).#kind = kind;
      return {module: this.module, kind: this.#kind};
    };
    return {module: this.module, kind: this.#kind, other};
  }
  #read(ranges, signal) {
    return Promise.all(ranges.map(({offset, size}) => this.bytes.read(offset, size, signal)));
  }

  close() {
    this.session?.close();
    this.pool?.close();
    this.bytes.close();
  }

  /**
   * {name, size, mode}, and of a file of mode random levels [{faces, charts}] and sphere {centre, radius}; steps, as
   * soon as readSteps() has read them; of a volume in pieces volume {cells, points, keepsOrder, pieces, fields, box}.
   */
  get info() {
    const {name, size, mode, levels, sphere, steps, volume} = this;
    return {name, size, mode, levels, sphere, steps, volume: volume?.about};
  }
  /** What is held: {cacheBytes, decoderBytes}; and what was fetched so far: {fetchedBytes, requests}. */
  get usage() {
    const {bytes} = this;
    const decoderBytes = (this.session?.memoryBytes ?? 0) + (this.pool?.memoryBytes ?? 0);
    return {cacheBytes: bytes.held, decoderBytes, fetchedBytes: bytes.fetched, requests: bytes.requests};
  }

  /**
   * Steps of time behind the mesh, [{step, time}], from then on in info.steps: `step` is what surface() and pieces() take. They stand
   * in the file behind the mesh, so open() does not wait for them.
   */
  async readSteps({signal} = {}) {
    this.steps ??= this.mode === 'stream' ? await this.pool.run({call: 'steps'}, {signal}) : [];
    return this.steps;
  }

  /** Key and value, in the order of the source: comments, names of files it refers to, such as mtllib, units. */
  async readMetadata({signal} = {}) {
    if (this.metadata) return this.metadata;
    // It may stand at the end of what a server sends as a whole: nothing else waits for it.
    const worker = this.pool.own();
    try {
      return this.metadata = await worker.run({call: 'metadata'}, {signal});
    } finally {
      worker.end();
    }
  }

  /** Where a glTF scene has the blocks, with instances, [{name, blocks, matrix}]: nodes.js. */
  async readInstances(options) {
    const [metadata, {instancesOf}] = await Promise.all([this.readMetadata(options), import('./nodes.js')]);
    return instancesOf(metadata);
  }

  /**
   * Charts that together show a region without cracks; of a volume pieces, see volume.js.
   * @param request box {low, high}, sphere {centre, radius}, planes [{normal, offset}]: where; level, bound (world units),
   *   view {eye, pixelsPerRadian, pixels}, maxFaces: how fine. Nothing: the coarsest.
   * @returns [{group, chart, level, faces, bytes, sphere}]
   */
  async select(request = {}, {signal} = {}) {
    if (this.mode === 'stream') return (await this.#openVolume(signal)).select(request, {signal});
    this.#expectParts();
    return this.session.run({call: 'select', arguments: [request]}, {signal});
  }
  /** The same at once, or null where the index must be fetched first, which it then is. */
  selectNow(request) {
    this.#expectParts();
    return this.session.now('select', request);
  }

  /** Groups of charts from `first` on, for renderers that choose themselves what they show: see cut.js. */
  async groups(first, count = 256, {signal} = {}) {
    this.#expectParts();
    return this.session.run({call: 'groups', arguments: [first, count]}, {signal});
  }

  /**
   * A chart, for drawing: {origin, positions, triangles, points, cells, arrays}; positions are relative to origin. `lean`, for
   * renderers, spares memory: points and cells are null, not lists, where they are 0, 1, 2, ...
   */
  async decodeNode({group, chart}, {signal, lean = false} = {}) {
    this.#expectParts();
    const drawn = await this.pool.run({call: 'chart', arguments: [group, chart]}, {signal});
    return lean ? {points: null, cells: null, ...drawn} : withCounts(drawn);
  }

  /**
   * The faces of a region, bit for bit; `clip`: none that only share a chart with it. Without a region as decode(), in the
   * order of the input if the file has it. Of a volume, its cells: volume.js.
   */
  async extract(request = {}, {signal, onProgress} = {}) {
    if (this.mode === 'stream') return (await this.#openVolume(signal)).extract(request, {signal, onProgress});
    this.#expectParts();
    return this.pool.run({call: 'extract', arguments: [{...THE_MESH_ITSELF, ...request}]}, {signal, onProgress});
  }
  /** A volume's first picture; what a plane cuts out of it; the same piece by piece; and surfaces of its pieces: volume.js. */
  async coarse(options = {}) {
    return (await this.#openVolume(options.signal)).coarse(options);
  }
  async slice(plane, options = {}) {
    return (await this.#openVolume(options.signal)).slice(plane, options);
  }
  async *slices(plane, options = {}) {
    yield* (await this.#openVolume(options.signal)).slices(plane, options);
  }
  async *surfaces(options = {}) {
    yield* (await this.#openVolume(options.signal)).surfaces(options);
  }

  /** The same as a PLY file, with all arrays, the bytes of `maille extract`: {bytes, points, faces, notes}. */
  async extractPly(request = {}, {signal, onProgress} = {}) {
    this.#expectParts();
    return this.pool.run({call: 'extractPly', arguments: [{...THE_MESH_ITSELF, ...request}]}, {signal, onProgress});
  }

  /** The whole mesh of a file of any mode; `drawn`: as decodeNode() gives it. */
  async decode({signal, drawn = false, onProgress} = {}) {
    const mesh = await this.pool.run({call: 'decode', arguments: [drawn]}, {signal, onProgress});
    return drawn ? withCounts(mesh) : mesh;
  }

  /**
   * What can be seen of the whole mesh, also of volumes: faces, and the faces of solids that no other solid has. As
   * decodeNode() gives it, with arrays on cells (domain 'triangle') as one tuple for each triangle. A file of mode stream is
   * read front to back, in memory for the surface alone; `step`: of time. onProgress({loaded, total, cells}).
   */
  async surface({signal, step = 0, onProgress} = {}) {
    if (this.inPieces) return this.volume.surface({signal, step, onProgress});
    return this.pool.run({call: 'surface', arguments: this.mode === 'stream' ? [step] : []}, {signal, onProgress});
  }

  /**
   * A file of mode stream, some thousand cells after another, whatever its size: {firstCell, types, offsets, connectivity,
   * slots, faceSizes, cellFaces, points, pointSlots, positions, endedSlots, slotCount, arrays}. Numbers of cells and points
   * are those of the whole mesh; slots are small numbers for points in use.
   */
  async *pieces({signal, step = 0, onProgress} = {}) {
    if (this.mode !== 'stream') throw new MailleError(ErrorCode.usage, `${this.name}: only files of mode "stream" come in pieces; decode() reads it`);
    yield* (await import('./volume.js')).portions(this.pool, step, {signal, onProgress});
  }

  /** What a ray meets first, on the original: {position, distance, face, corners, weights, group, chart}, or null. */
  async pick(origin, direction, {signal} = {}) {
    this.#expectParts();
    return this.pool.run({call: 'hit', arguments: [origin, direction]}, {signal});
  }

  #expectParts() {
    if (this.mode === 'random') return;
    throw new MailleError(ErrorCode.usage, `${this.name}: only files of mode "random" are read in parts; decode() and surface() read this one whole`);
  }
}

/** Decodes a whole file: {positions, blocks, arrays}. */
export async function decode(input, options = {}) {
  const file = await MeshFile.open(input, {workers: 0, ...options});
  try {
    return await file.decode(options);
  } finally {
    file.close();
  }
}
