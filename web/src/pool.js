// Decoders in threads of their own, where the platform has them; else one on this thread.

import {ErrorCode, MailleError} from './decoder.js';
import {Session} from './session.js';

export class DecoderPool {
  /**
   * @param file {modules(): {module, kind, other(kind)}, about, read(ranges, signal)}: session.js
   * @param count number of threads; 0: none. Default: one less than cores, at most four, in browsers.
   */
  constructor(file, count) {
    Object.assign(this, {file, workers: [], idle: new Set(), others: new Set(), queue: []});
    const cores = globalThis.navigator?.hardwareConcurrency ?? 2;
    this.count = typeof Worker === 'undefined' ? 0 : count ?? Math.max(1, Math.min(4, cores - 1));
  }

  /** How many tasks run at once. */
  get lanes() {
    return Math.max(1, this.count);
  }
  /** Bytes that the decoders hold. */
  get memoryBytes() {
    return [...this.workers, ...this.others].reduce((sum, worker) => sum + (worker?.memoryBytes ?? 0), 0);
  }

  /**
   * Tasks of one `lane`, a number from 0 on, go to the same decoder, which may have kept something from the last one; what is
   * to come `first` does not wait for others that have not begun.
   */
  run(task, {signal, onProgress, lane, first = false} = {}) {
    signal?.throwIfAborted();
    return new Promise((resolve, reject) => {
      const job = {task, signal, onProgress, lane, resolve, reject, over: false};
      job.onAbort = () => this.#finish(job, () => reject(signal.reason));
      signal?.addEventListener('abort', job.onAbort, {once: true});
      if (first) this.queue.unshift(job);
      else this.queue.push(job);
      this.#start();
    });
  }

  /** A decoder that nobody else uses, for calls that belong together: {run(task, {signal}), end()}. */
  own() {
    const worker = this.#create();
    this.others.add(worker);
    return {
      run: (task, options = {}) => worker.run(task, options),
      end: () => { this.others.delete(worker); worker.end(); },
    };
  }

  close() {
    this.closed = true;
    for (const worker of [...this.workers, ...this.others]) worker?.end();
    for (const job of this.queue.splice(0)) job.reject(new MailleError(ErrorCode.usage, `${this.file.about.name}: was closed`));
  }

  #finish(job, settle) {
    if (job.over) return;
    job.over = true;
    job.signal?.removeEventListener('abort', job.onAbort);
    settle();
  }

  #start() {
    if (this.closed) return;
    this.queue = this.queue.filter(job => !job.over && !this.#give(job));
  }
  /** @returns whether there is a decoder for it */
  #give(job) {
    const number = job.lane === undefined ? this.#freeNumber() : job.lane % this.lanes;
    if (number < 0) return false;
    if (!this.workers[number]) this.idle.add(this.workers[number] = this.#create());
    const worker = this.workers[number];
    if (!this.idle.delete(worker)) return false;
    worker.run(job.task, job).then(
      result => this.#finish(job, () => job.resolve(result)),
      error => this.#finish(job, () => job.reject(error)),
    ).finally(() => {
      this.idle.add(worker);
      this.#start();
    });
    return true;
  }
  /** One that is there, before a new one; -1: all are busy. */
  #freeNumber() {
    const there = this.workers.findIndex(worker => this.idle.has(worker));
    if (there >= 0) return there;
    for (let number = 0; number < this.lanes; ++number) if (!this.workers[number]) return number;
    return -1;
  }

  #create() {
    return this.count === 0 ? new SameThread(this.file) : new OwnThread(this.file);
  }
}

class SameThread {
  constructor({modules, about, read}) {
    this.session = new Session(modules(), about, read);
  }
  get memoryBytes() {
    return this.session.memoryBytes;
  }
  run(task, {signal, onProgress}) {
    return this.session.run(task, {signal, onProgress});
  }
  end() {
    this.session.close();
  }
}

/** Written so that bundlers see it. */
const besideThis = () => new Worker(new URL('./worker.js', import.meta.url), {type: 'module'});

/** Browsers begin no worker of another origin, such as a network that delivers packages; but one that imports it. */
function newWorker() {
  try {
    return besideThis();
  } catch (error) {
    if (error.name !== 'SecurityError') throw error;
  }
  // Where bundlers have put it only besideThis() knows.
  const {Worker} = globalThis;
  let address;
  globalThis.Worker = function note(url) { address = url; };
  try {
    besideThis();
  } finally {
    globalThis.Worker = Worker;
  }
  const script = URL.createObjectURL(new Blob([`import ${JSON.stringify(String(address))};`], {type: 'text/javascript'}));
  return new Worker(script, {type: 'module'});
}

/** Talks with worker.js: a task, questions that come up, its result. */
class OwnThread {
  constructor({modules, about, read}) {
    const {module, kind, other} = modules();
    Object.assign(this, {read, other, memoryBytes: 0});
    this.worker = newWorker();
    this.worker.postMessage({open: {module, kind, about}});
  }

  run(task, {signal, onProgress}) {
    const abort = () => this.worker.postMessage({abort: true});
    signal?.addEventListener('abort', abort, {once: true});
    return new Promise((resolve, reject) => {
      this.reject = reject;
      this.worker.onerror = event => reject(new MailleError(ErrorCode.usage, `the decoder's thread failed: ${event.message ?? 'it could not be loaded'}`));
      this.worker.onmessage = ({data}) => {
        if ('result' in data) {
          this.memoryBytes = data.memoryBytes;
          resolve(data.result);
        } else if (data.error) {
          reject(new MailleError(data.error.code, data.error.message));
        } else if (data.progress) {
          onProgress?.(data.progress);
        } else {
          this.#answer(data, signal);
        }
      };
      const given = task.given?.map(({offset, bytes}) => ({offset, bytes: bytes.slice()})) ?? [];
      this.worker.postMessage({task: {...task, given}, progress: onProgress !== undefined}, given.map(part => part.bytes.buffer));
    }).finally(() => signal?.removeEventListener('abort', abort));
  }

  async #answer({ranges, other}, signal) {
    try {
      if (!ranges) return this.worker.postMessage({answer: await this.other(other)});
      const parts = (await this.read(ranges, signal)).map(bytes => bytes.slice());
      this.worker.postMessage({answer: parts}, parts.map(bytes => bytes.buffer));
    } catch (error) {
      this.worker.postMessage({failed: {code: error.code ?? ErrorCode.network, message: error.message}});
    }
  }

  end() {
    this.worker.terminate();
    this.reject?.(new MailleError(ErrorCode.usage, 'the file was closed'));
  }
}
