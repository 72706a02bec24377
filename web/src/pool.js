// Decoders in threads of their own, where the platform has them; else one on this thread.

import {ErrorCode, MailleError} from './decoder.js';
import {Session} from './session.js';

export class DecoderPool {
  /**
   * @param file {modules(): {module, kind, other(kind)}, about, read(ranges, signal)}: session.js
   * @param count number of threads; 0: none. Default: one less than cores, at most four, in browsers.
   */
  constructor(file, count) {
    Object.assign(this, {file, idle: [], busy: new Set(), queue: []});
    const cores = globalThis.navigator?.hardwareConcurrency ?? 2;
    this.count = typeof Worker === 'undefined' ? 0 : count ?? Math.max(1, Math.min(4, cores - 1));
    this.started = 0;
  }

  /** Bytes that the decoders hold. */
  get memoryBytes() {
    return [...this.idle, ...this.busy].reduce((sum, worker) => sum + worker.memoryBytes, 0);
  }

  run(task, {signal, onProgress} = {}) {
    signal?.throwIfAborted();
    return new Promise((resolve, reject) => {
      const job = {task, signal, onProgress, resolve, reject, over: false};
      signal?.addEventListener('abort', () => this.#finish(job, () => reject(signal.reason)), {once: true});
      this.queue.push(job);
      this.#start();
    });
  }

  /** A decoder that nobody else uses, for calls that belong together: {run(task, {signal}), end()}. */
  own() {
    const worker = this.#create();
    this.busy.add(worker);
    return {
      run: (task, options = {}) => worker.run(task, options),
      end: () => { this.busy.delete(worker); worker.end(); },
    };
  }

  close() {
    this.closed = true;
    for (const worker of [...this.idle, ...this.busy]) worker.end();
    for (const job of this.queue.splice(0)) job.reject(new MailleError(ErrorCode.usage, `${this.file.about.name}: was closed`));
  }

  #finish(job, settle) {
    if (job.over) return;
    job.over = true;
    settle();
  }

  #start() {
    while (this.queue.length > 0 && !this.closed) {
      if (this.queue[0].over) {
        this.queue.shift();
        continue;
      }
      if (this.idle.length === 0) {
        if (this.started === Math.max(1, this.count)) return;
        this.idle.push(this.#create());
        ++this.started;
      }
      const worker = this.idle.pop();
      const job = this.queue.shift();
      this.busy.add(worker);
      worker.run(job.task, job).then(
        result => this.#finish(job, () => job.resolve(result)),
        error => this.#finish(job, () => job.reject(error)),
      ).finally(() => {
        this.busy.delete(worker);
        this.idle.push(worker);
        this.#start();
      });
    }
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

/** Talks with worker.js: a task, questions that come up, its result. */
class OwnThread {
  constructor({modules, about, read}) {
    const {module, kind, other} = modules();
    Object.assign(this, {read, other, memoryBytes: 0});
    this.worker = new Worker(new URL('./worker.js', import.meta.url), {type: 'module'});
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
      this.worker.postMessage({task, progress: onProgress !== undefined});
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
