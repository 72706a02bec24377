// Where the bytes of a file come from: ranges over HTTP, files a user chose, memory.

import {ErrorCode, MailleError} from './decoder.js';

/** What one more request costs, in bytes that could be read along instead. */
const GAP = 16 * 1024;
const FRONT = 64 * 1024;
/** Room for a whole file at first, whatever size a server claims. */
const FIRST_ROOM = 64 * 1024 * 1024;
const REQUESTS_AT_ONCE = 6;
const TRIES = 4;

/**
 * @param input URL, Blob, ArrayBuffer, typed array, or {size, readAt(offset, size, signal), name}
 * @returns {Promise<{size, name, read(offset, size, signal): Promise<Uint8Array>}>}
 */
export async function bytesOf(input, options = {}) {
  if (typeof input === 'string' || input instanceof URL) {
    checkAddress(String(input), options);
    return HttpBytes.open(String(input), options);
  }
  if (typeof Blob !== 'undefined' && input instanceof Blob) {
    return {
      size: input.size, name: input.name ?? '<blob>', isLocal: true,
      read: async (offset, size) => new Uint8Array(await input.slice(offset, offset + size).arrayBuffer()),
    };
  }
  if (input instanceof ArrayBuffer || ArrayBuffer.isView(input)) {
    const bytes = ArrayBuffer.isView(input) ? new Uint8Array(input.buffer, input.byteOffset, input.byteLength) : new Uint8Array(input);
    return {size: bytes.length, name: '<memory>', isLocal: true, read: async (offset, size) => bytes.subarray(offset, offset + size)};
  }
  if (typeof input?.readAt === 'function' && typeof input.size === 'number') {
    return {
      size: input.size, name: input.name ?? '<source>',
      read: async (offset, size, signal) => new Uint8Array(await input.readAt(offset, size, signal)),
    };
  }
  throw new MailleError(ErrorCode.usage, 'open() takes a URL, a Blob, an ArrayBuffer, or an object with size and readAt(offset, size)');
}

/** Where there is no page, as in node, an address has all its parts; paths of files are the first thing to be tried there. */
function checkAddress(address, {fetch}) {
  if (fetch || globalThis.location?.href || /^[a-z][a-z0-9+.-]*:/i.test(address)) return;
  throw new MailleError(ErrorCode.usage, `${address}: is no address (https://...); of a file give the bytes, in node open(await readFile('${address}'))`);
}

/**
 * A file on a server. One request gives its size and its front. Where the server knows no ranges the whole file is
 * read front to back, and each byte is there as soon as it has arrived.
 */
class HttpBytes {
  static async open(url, options) {
    const bytes = new HttpBytes(url, options);
    await bytes.#begin(options.signal);
    return bytes;
  }

  constructor(url, {fetch = globalThis.fetch.bind(globalThis), headers = {}, credentials, maxWhole = 256 * 2 ** 20, onBytes} = {}) {
    Object.assign(this, {url, name: url, size: 0, requests: 0, fetched: 0});
    this.options = {fetch, headers, credentials, maxWhole, onBytes};
    this.running = 0;
    this.waiting = [];  // of wanted ranges, to be joined into requests
    this.queued = [];   // requests
    this.closing = new AbortController();
  }

  /** Whatever is on its way is no longer wanted. */
  close() {
    this.closing.abort(new MailleError(ErrorCode.usage, `${this.url}: was closed`));
  }

  async read(offset, size, signal) {
    signal?.throwIfAborted();
    if (this.whole) return this.whole.read(offset, size, signal);
    if (offset + size <= this.front.length) return this.front.subarray(offset, offset + size);
    return new Promise((resolve, reject) => {
      const wanted = {offset, size, resolve, reject, aborted: false};
      signal?.addEventListener('abort', () => {
        wanted.aborted = true;
        reject(signal.reason);
        if (wanted.run?.wanted.every(w => w.aborted)) wanted.run.controller.abort(signal.reason);
      }, {once: true});
      this.waiting.push(wanted);
      if (this.waiting.length === 1) setTimeout(() => this.#join(), 0);
    });
  }

  async #begin(signal) {
    const response = await this.#request(`bytes=0-${FRONT - 1}`, signal);
    this.tag = response.headers.get('etag');
    if (this.tag?.startsWith('W/')) this.tag = null;
    this.modified = response.headers.get('last-modified');
    if (response.status === 206) {
      const range = contentRange(response);
      if (!range || range.first !== 0) throw this.#failure('the server answers with other bytes than it was asked for');
      this.size = range.size;
      this.front = await this.#body(response, Math.min(FRONT, this.size));
      return;
    }
    // The server gives all of it, or an empty file.
    const size = Number(response.headers.get('content-length') ?? NaN);
    if (size > this.options.maxWhole) {
      response.body?.cancel();
      throw this.#failure(`the server gives no parts of files, and this one has ${Math.ceil(size / 2 ** 20)} MB: raise maxWhole to read it all`);
    }
    this.whole = new WholeBody(response, Number.isFinite(size) ? size : null, this.options.maxWhole, this);
    this.size = Number.isFinite(size) && !response.headers.get('content-encoding') ? size : (await this.whole.end()).length;
  }

  /** Ranges that lie near one another become one request. */
  #join() {
    const wanted = this.waiting.filter(w => !w.aborted).sort((a, b) => a.offset - b.offset);
    this.waiting = [];
    let run = null;
    for (const w of wanted) {
      if (run && w.offset <= run.end + GAP) {
        run.end = Math.max(run.end, w.offset + w.size);
        run.wanted.push(w);
      } else {
        run = {begin: w.offset, end: w.offset + w.size, wanted: [w], controller: new AbortController()};
        this.queued.push(run);
      }
      w.run = run;
    }
    this.#start();
  }
  #start() {
    while (this.running < REQUESTS_AT_ONCE && this.queued.length > 0) {
      const run = this.queued.shift();
      if (run.wanted.every(w => w.aborted)) continue;
      ++this.running;
      this.#fetchRun(run).finally(() => { --this.running; this.#start(); });
    }
  }
  async #fetchRun(run) {
    try {
      const response = await this.#request(`bytes=${run.begin}-${run.end - 1}`, run.controller.signal);
      if (response.status !== 206) {
        response.body?.cancel();
        throw this.#failure(response.status === 200 ? 'the file changed on the server, or the server stopped giving parts: open it again'
          : `the server answered ${response.status}`);
      }
      const range = contentRange(response), tag = response.headers.get('etag');
      if (!range || range.first !== run.begin || range.size !== this.size || (this.tag && tag && tag !== this.tag))
        throw this.#failure('the file changed on the server: open it again');
      const bytes = await this.#body(response, run.end - run.begin);
      for (const w of run.wanted) w.resolve(bytes.subarray(w.offset - run.begin, w.offset - run.begin + w.size));
    } catch (error) {
      for (const w of run.wanted) w.reject(error);
    }
  }

  /** Tries again where that may help: lost connections, servers that are busy. */
  async #request(range, given) {
    const {fetch, headers, credentials} = this.options;
    const condition = this.tag ?? this.modified;
    const signal = eitherOf(given, this.closing.signal);
    for (let attempt = 1; ; ++attempt) {
      let problem;
      try {
        ++this.requests;
        const response = await fetch(this.url, {headers: {...headers, Range: range, ...(condition ? {'If-Range': condition} : {})}, credentials, cache: 'no-store', signal});
        if (response.ok) return response;
        problem = `the server answered ${response.status} ${response.statusText}`.trim();
        response.body?.cancel();
        if (response.status < 500 && response.status !== 429 && response.status !== 408) throw this.#failure(problem);
      } catch (error) {
        if (error instanceof MailleError) throw error;
        signal.throwIfAborted();
        problem ??= `${error.cause?.message ?? error.message}${isElsewhere(this.url) ? '; that server may not allow pages of others (CORS)' : ''}`;
      }
      if (attempt === TRIES) throw this.#failure(`${problem} (tried ${TRIES} times)`);
      await new Promise(resolve => setTimeout(resolve, 100 * 4 ** (attempt - 1)));
    }
  }
  async #body(response, size) {
    const bytes = new Uint8Array(size), reader = response.body.getReader();
    for (let arrived = 0; ;) {
      const {done, value} = await reader.read().catch(error => { throw this.#failure(error.message); });
      if (done && arrived === size) return bytes;
      const end = arrived + (value?.length ?? 0);
      if (done || end > size) {
        reader.cancel().catch(() => {});
        throw this.#failure(`${size} bytes were asked for, ${end > size ? 'more' : arrived} came`);
      }
      bytes.set(value, arrived);
      arrived = end;
      this.count(value.length);
    }
  }
  count(bytes) {
    this.fetched += bytes;
    this.options.onBytes?.(this.fetched);
  }
  #failure(what) {
    return new MailleError(ErrorCode.network, `${this.url}: ${what}`);
  }
}

/** Of another server than the page: browsers do not tell a program why they refuse it. */
function isElsewhere(url) {
  const page = globalThis.location?.href;
  return page !== undefined && new URL(url, page).origin !== new URL(page).origin;
}

/** Aborts as soon as one of them does. */
function eitherOf(a, b) {
  if (!a) return b;
  if (typeof AbortSignal.any === 'function') return AbortSignal.any([a, b]);
  const controller = new AbortController();
  for (const signal of [a, b]) {
    if (signal.aborted) controller.abort(signal.reason);
    signal.addEventListener('abort', () => controller.abort(signal.reason), {once: true});
  }
  return controller.signal;
}

function contentRange(response) {
  const match = /^bytes (\d+)-(\d+)\/(\d+)$/.exec(response.headers.get('content-range') ?? '');
  return match && {first: Number(match[1]), last: Number(match[2]), size: Number(match[3])};
}

/** The body of one response, read front to back. */
class WholeBody {
  constructor(response, size, most, owner) {
    this.size = size;
    this.bytes = new Uint8Array(Math.min(size ?? 1 << 20, FIRST_ROOM));
    this.arrived = 0;
    this.waiting = [];
    this.finished = this.#pump(response.body.getReader(), most, owner).catch(error => {
      this.error = error instanceof MailleError ? error : new MailleError(ErrorCode.network, `${owner.url}: ${error.message}`);
    }).then(() => { this.over = true; this.#wake(); });
  }
  async end() {
    await this.finished;
    if (this.error) throw this.error;
    return this.bytes.subarray(0, this.arrived);
  }
  read(offset, size, signal) {
    return new Promise((resolve, reject) => {
      this.waiting.push({offset, size, resolve, reject});
      signal?.addEventListener('abort', () => reject(signal.reason), {once: true});
      this.#wake();
    });
  }
  async #pump(reader, most, owner) {
    for (;;) {
      const {done, value} = await reader.read();
      if (done) return;
      const end = this.arrived + value.length;
      if (end > most) { reader.cancel(); throw new MailleError(ErrorCode.network, `${owner.url}: more than maxWhole bytes`); }
      if (end > this.bytes.length) {
        const larger = new Uint8Array(Math.max(end, Math.min(this.bytes.length * 2, this.size ?? Infinity)));
        larger.set(this.bytes.subarray(0, this.arrived));
        this.bytes = larger;
      }
      this.bytes.set(value, this.arrived);
      this.arrived = end;
      owner.count(value.length);
      this.#wake();
    }
  }
  #wake() {
    this.waiting = this.waiting.filter(({offset, size, resolve, reject}) => {
      if (offset + size <= this.arrived) resolve(this.bytes.subarray(offset, offset + size));
      else if (this.over) reject(this.error ?? new MailleError(ErrorCode.network, 'the file was cut off on its way'));
      else return true;
      return false;
    });
  }
}

/** What was read lately, up to a budget of bytes: blocks of ranges as they were asked for. */
export class CachedBytes {
  constructor(bytes, budget) {
    // What is on this machine needs no copy.
    Object.assign(this, {bytes, budget: bytes.isLocal ? 0 : budget, size: bytes.size, name: bytes.name, held: 0});
    this.ranges = new Map();  // by "offset size", the oldest first
  }
  get fetched() {
    return this.bytes.fetched;
  }
  get requests() {
    return this.bytes.requests;
  }
  close() {
    this.bytes.close?.();
    this.ranges.clear();
    this.held = 0;
  }
  async read(offset, size, signal) {
    const key = `${offset} ${size}`, known = this.ranges.get(key);
    if (known) {
      this.ranges.delete(key);
      this.ranges.set(key, known);
      return known;
    }
    const bytes = await this.#fetch(offset, size, signal);
    // What takes much of the budget is a whole file, which nobody reads twice.
    if (this.ranges.has(key) || bytes.length > this.budget / 4) return bytes;
    this.ranges.set(key, bytes.slice());
    this.held += bytes.length;
    for (const [oldest, old] of this.ranges) {
      if (this.held <= this.budget) break;
      this.ranges.delete(oldest);
      this.held -= old.length;
    }
    return bytes;
  }
  /** What of a range is here already, at its ends, is not asked for again. */
  async #fetch(offset, size, signal) {
    const end = offset + size;
    let begin = offset, stop = end, front = null, back = null;
    for (const [key, held] of this.ranges) {
      const first = Number(key.split(' ', 1)[0]), last = first + held.length;
      if (first <= offset && last > begin) [front, begin] = [held.subarray(offset - first, Math.min(last, end) - first), Math.min(last, end)];
      if (last >= end && first < stop) [back, stop] = [held.subarray(Math.max(first, offset) - first, end - first), Math.max(first, offset)];
    }
    if (!front && !back) return this.bytes.read(offset, size, signal);
    const middle = begin < stop ? await this.bytes.read(begin, stop - begin, signal) : null;
    const bytes = new Uint8Array(size);
    if (back) bytes.set(back, size - back.length);
    if (front) bytes.set(front);
    if (middle) bytes.set(middle, begin - offset);
    return bytes;
  }
}
