// Work on one file in one decoder, wherever that runs: asks for bytes until a call has all it needs. Threads have
// one each (worker.js), and so has MeshFile, for the index.

import {Decoder, DecoderFile, decoderFor, ErrorCode, GoesOn, isWhole, WantsBytes} from './decoder.js';

/** Of what is not the front nothing is kept from one call to the next: other charts are next. */
const KEPT_FRONT = 256 * 1024;
const LEAST_READ = 64 * 1024;
/** How much is read at once where a file is read front to back. */
const AHEAD = 1024 * 1024;
/** Larger files are not read as one, whatever of them is decoded. */
const MOST_WHOLE = 2 ** 30;
/** A decoder that has grown beyond this is given up after its call: memory of WebAssembly never shrinks. */
const KEPT_MEMORY = 64 * 2 ** 20;

export class Session {
  /**
   * @param modules {module, kind, other(kind)}: the decoder to begin with, 'charts', 'small' or 'full', and a function that
   *   gives {module, kind} of one that has at least what `kind` has
   * @param about {size, name, mode, meshBytes} of the file; keptMemory: of a decoder that is kept for the next call
   * @param read (ranges, signal) => Promise of their bytes
   */
  constructor({module, kind, other}, about, read) {
    Object.assign(this, {module, kind, other, about, read});
  }

  get memoryBytes() {
    return this.decoder?.memoryBytes ?? 0;
  }

  /**
   * @param task {call, arguments, given}: a method of DecoderFile, or one of those below; `given`: parts of the file that it
   *   will want, [{offset, bytes}]
   */
  async run({call, arguments: given = [], given: parts = []}, {signal, onProgress} = {}) {
    for (;;) {
      try {
        await (this.opened ??= this.#open());
        for (const {offset, bytes} of parts) this.file.give(offset, bytes);
        return await this.#call(call, given, signal, onProgress);
      } catch (error) {
        const wanted = this.#needed(error);
        if (!wanted) throw error;
        this.close();
        Object.assign(this, await this.other(wanted));
      } finally {
        this.#tidy(call);
      }
    }
  }

  /** What a call gives at once; null: bytes are wanted first, and are on their way. */
  now(call, ...given) {
    if (!this.file) return null;
    let later;
    try {
      const result = this.file[call](...given);
      if (!(result instanceof WantsBytes)) return result;
      later = () => this.#fetch(result, call);
    } catch (error) {
      if (!this.#needed(error)) throw error;
      later = () => this.run({call, arguments: given});  // in another decoder
    }
    this.pending ??= later().catch(() => {}).finally(() => { this.pending = null; });
    return null;
  }

  close() {
    this.file?.close();
    this.file = this.decoder = this.opened = null;
  }

  /** Which decoder has what this one leaves out; none: it is another error. */
  #needed({code}) {
    const wanted = decoderFor[code];
    return wanted === this.kind || this.kind === 'full' ? undefined : wanted;
  }

  async #open() {
    try {
      const {size, name, mode, meshBytes} = this.about;
      this.decoder = await Decoder.create(this.module);
      this.file = new DecoderFile(this.decoder, size, name, meshBytes);
      if (mode === 'random') return await this.#until('open', () => this.file.open());
    } catch (error) {
      this.close();
      throw error;
    }
  }

  async #call(call, given, signal, onProgress) {
    if (call === 'open') return this.opened;
    if (call === 'extract' || call === 'extractPly') {
      const whole = isWhole(given[0]);
      if (!whole) await this.#until('select', () => this.file.select(...given), signal);
      return this.#until(whole ? 'decode' : call, () => this.file[call](...given), signal, onProgress);
    }
    // What is of mode stream alone is loaded with the first call.
    const calls = this.about.mode === 'stream' ? await import('./volume_decoder.js') : {};
    const attempt = (name, given) => () => (calls[name] ? calls[name](this.file, ...given) : this.file[name](...given));
    if (call === 'surface' && calls.beginPieces) {
      await this.#until('beginPieces', attempt('beginPieces', given), signal);
      return this.#until('surface', attempt('surfaceOfPieces', []), signal, onProgress);
    }
    return this.#until(call, attempt(call, given), signal, onProgress);
  }

  async #until(call, attempt, signal, onProgress) {
    for (;;) {
      signal?.throwIfAborted();
      const result = attempt();
      if (result instanceof WantsBytes) {
        await this.#fetch(result, call, signal);
        onProgress?.({loaded: this.loaded, total: this.about.size, cells: this.cells});
      } else if (result instanceof GoesOn) {
        this.cells = result.cells;
        this.usedUp = true;
        onProgress?.({loaded: this.loaded, total: this.about.size, cells: this.cells});
        await new Promise(resolve => setTimeout(resolve, 0));  // so that an abort can come in
      } else {
        this.usedUp = true;
        return result;
      }
    }
  }

  async #fetch({ranges}, call, signal) {
    const {size, mode} = this.about;
    const inOrder = mode === 'stream' && (call === 'surface' || call === 'nextPiece');
    let wanted = ranges;
    // All of the rest at once, if memory holds it. Of what is read in order, what was read is used up when it gave something: a
    // call that has values of a later time needs some of the mesh and some behind it.
    const whole = (call === 'decode' || (call === 'surface' && !inOrder)) && size <= MOST_WHOLE;
    if (whole) wanted = [{offset: Math.min(...ranges.map(r => r.offset)), size}];
    if (inOrder && this.usedUp) this.file.forgetBehind(KEPT_FRONT);
    this.usedUp = false;
    const least = inOrder ? AHEAD : 0;
    wanted = wanted.map(range => {
      const atLeast = Math.max(range.size, range.offset === 0 ? LEAST_READ : least);
      return {offset: range.offset, size: Math.min(atLeast, size - range.offset)};
    });
    const parts = await this.read(wanted, signal);
    if (!this.file) throw closed(this.about.name);
    for (const [i, {offset}] of wanted.entries()) this.file.give(offset, parts[i]);
    this.loaded = Math.max(...wanted.map(range => range.offset + range.size));
  }

  #tidy(call) {
    if (!this.file) return;
    if (call !== 'beginPieces' && call !== 'nextPiece') {
      this.file.forgetBehind(KEPT_FRONT);
      if (this.memoryBytes > (this.about.keptMemory ?? KEPT_MEMORY)) this.close();
    }
  }
}

function closed(name) {
  const error = new Error(`${name}: was closed`);
  error.code = ErrorCode.usage;
  return error;
}
