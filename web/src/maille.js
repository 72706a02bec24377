// Reads .maille files in browsers and node: any part at any level of detail, decoded where it is looked at.

import {bytesOf, CachedBytes} from './bytes.js';
import {compileDecoder, Decoder, DecoderFile, ErrorCode, MailleError, WantsBytes} from './decoder.js';
import {DecoderPool} from './pool.js';

export {ErrorCode, MailleError};

const MAGIC = [0x89, 0x4d, 0x41, 0x49, 0x0d, 0x0a, 0x1a, 0x0a];
const MODES = ['single', 'stream', 'random'];
const HEADER = 25;
/** Charts are forgotten by the decoder that chooses among them; its index is not. */
const KEPT_FRONT = 64 * 1024;

let decoderModule = null;
/** Where the decoder is, if not beside this file: a URL, bytes, or a compiled module. */
export function setDecoder(source) {
  decoderModule = compileDecoder(typeof source === 'string' || source instanceof URL ? fetch(source) : source);
  return decoderModule;
}
async function defaultDecoder() {
  const url = new URL('../dist/maille.wasm', import.meta.url);
  if (url.protocol !== 'file:') return compileDecoder(fetch(url));
  const {readFile} = await import('node:fs/promises');
  return compileDecoder(readFile(url));
}
/** The compiled decoder. */
export function ready() {
  return decoderModule ??= defaultDecoder();
}

/** An open file. */
export class MeshFile {
  /**
   * @param input URL, Blob, ArrayBuffer, typed array, or {size, readAt(offset, size, signal)}
   * @param {object} options fetch, headers, credentials; maxWhole: bytes that may be read where the server gives no
   *   ranges; cacheBytes: of what was fetched, kept; workers: number of threads (0: none); onBytes(fetched); signal
   */
  static async open(input, options = {}) {
    const bytes = new CachedBytes(await bytesOf(input, options), options.cacheBytes ?? 64 * 2 ** 20);
    const file = new MeshFile(bytes, options);
    await file.#begin(options.signal);
    return file;
  }

  constructor(bytes, options) {
    this.bytes = bytes;
    this.options = options;
    this.size = bytes.size;
    this.name = bytes.name;
  }

  async #begin(signal) {
    if (this.size < HEADER) throw new MailleError(ErrorCode.corrupt, `${this.name}: is no .maille file, it has ${this.size} bytes`);
    const header = await this.bytes.read(0, HEADER, signal);
    if (!MAGIC.every((byte, i) => header[i] === byte)) throw new MailleError(ErrorCode.corrupt, `${this.name}: is no .maille file`);
    this.module = await ready();
    this.decoder = new DecoderFile(await Decoder.create(this.module), this.size, this.name);
    this.mode = MODES[header[20]];
    if (this.mode === 'random') {
      Object.assign(this, await this.#until(() => this.decoder.open(), this.decoder, signal));
    }
    this.pool = new DecoderPool(this.module, this, this.options.workers);
  }

  close() {
    this.decoder?.close();
    this.pool?.close();
  }

  /**
   * Charts that together show a region without cracks.
   * @param request box {low, high}, sphere {centre, radius}, planes [{normal, offset}]: where; level, bound (world units),
   *   view {eye, pixelsPerRadian, pixels}, maxFaces: how fine. Nothing: the coarsest.
   * @returns [{group, chart, level, faces, bytes, sphere}]
   */
  select(request = {}, {signal} = {}) {
    return this.#until(() => this.decoder.select(request), this.decoder, signal);
  }
  /** The same at once, or null where the index must be fetched first, which it then is. */
  selectNow(request) {
    const found = this.decoder.select(request);
    if (!(found instanceof WantsBytes)) return found;
    this.pending ??= this.bytes.read(found.offset, found.size)
      .then(bytes => this.decoder.give(found.offset, bytes)).finally(() => { this.pending = null; });
    this.pending.catch(() => {});
    return null;
  }

  /** Groups of charts from `first` on, for renderers that choose themselves what they show: see cut.js. */
  groups(first, count = 256, {signal} = {}) {
    return this.#until(() => this.decoder.groups(first, count), this.decoder, signal);
  }

  /** A chart, for drawing: {origin, positions, triangles, points, cells, arrays}; positions are relative to origin. */
  decodeNode({group, chart}, {signal} = {}) {
    return this.pool.run({call: 'chart', arguments: [group, chart]}, signal);
  }

  /** The faces of a region, bit for bit; `clip`: none that only share a chart with it. */
  async extract(request = {}, {signal} = {}) {
    const full = {level: 0, clip: true, ...request};
    return this.pool.run({call: 'extractAll', arguments: [full]}, signal);
  }

  /** The whole mesh of a file of any mode; `drawn`: as decodeNode() gives it. */
  decode({signal, drawn = false} = {}) {
    return this.pool.run({call: 'decode', arguments: [drawn]}, signal);
  }

  /** What a ray meets first, on the original: {position, distance, face, corners, weights, group, chart}, or null. */
  pick(origin, direction, {signal} = {}) {
    return this.pool.run({call: 'hit', arguments: [origin, direction]}, signal);
  }

  async #until(attempt, decoder, signal) {
    for (;;) {
      signal?.throwIfAborted();
      const result = attempt();
      if (!(result instanceof WantsBytes)) return result;
      const size = Math.min(Math.max(result.size, KEPT_FRONT), this.size - result.offset);
      decoder.give(result.offset, await this.bytes.read(result.offset, size, signal));
    }
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
