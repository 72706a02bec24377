// Decoders in threads of their own, where the platform has them; else one on this thread.

import {ErrorCode, MailleError} from './decoder.js';
import {Session} from './session.js';

export class DecoderPool {
  /** @param count number of threads; 0: none. Default: one less than cores, at most four, in browsers. */
  constructor(module, file, count) {
    Object.assign(this, {module, file, idle: [], busy: new Set(), queue: []});
    const cores = globalThis.navigator?.hardwareConcurrency ?? 2;
    this.count = typeof Worker === 'undefined' ? 0 : count ?? Math.max(1, Math.min(4, cores - 1));
    this.started = 0;
    this.next = 0;
  }

  async run(task, signal) {
    signal?.throwIfAborted();
    return new Promise((resolve, reject) => {
      const job = {id: this.next++, task, signal, resolve, reject, over: false};
      signal?.addEventListener('abort', () => this.#finish(job, () => reject(signal.reason)), {once: true});
      this.queue.push(job);
      this.#start();
    });
  }

  close() {
    this.closed = true;
    for (const worker of [...this.idle, ...this.busy]) worker.end();
    for (const job of this.queue.splice(0)) job.reject(new MailleError(ErrorCode.usage, `${this.file.name}: was closed`));
  }

  #finish(job, settle) {
    if (job.over) return;
    job.over = true;
    settle();
  }

  #start() {
    while (this.queue.length > 0 && !this.closed) {
      const worker = this.idle.pop() ?? (this.started < Math.max(1, this.count) ? this.#create() : null);
      if (!worker) return;
      const job = this.queue.shift();
      if (job.over) {
        this.idle.push(worker);
        continue;
      }
      this.busy.add(worker);
      worker.run(job.task, (offset, size) => this.file.bytes.read(offset, size, job.signal)).then(
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
    ++this.started;
    const about = {size: this.file.size, name: this.file.name, mode: this.file.mode};
    return this.count === 0 ? new SameThread(this.module, about) : new OwnThread(this.module, about);
  }
}

class SameThread {
  constructor(module, about) {
    this.session = new Session(module, about, (offset, size) => this.read(offset, size));
  }
  run(task, read) {
    this.read = read;
    return this.session.run(task);
  }
  end() {
    this.session.close();
  }
}

/** Talks with worker.js: a task, bytes it asks for, its result. */
class OwnThread {
  constructor(module, about) {
    this.worker = new Worker(new URL('./worker.js', import.meta.url), {type: 'module'});
    this.worker.postMessage({open: {module, about}});
  }
  run(task, read) {
    return new Promise((resolve, reject) => {
      this.worker.onerror = event => reject(new MailleError(ErrorCode.usage, `the decoder's thread failed: ${event.message ?? 'it could not be loaded'}`));
      this.worker.onmessage = async ({data}) => {
        if ('result' in data) return resolve(data.result);
        if (data.error) return reject(new MailleError(data.error.code, data.error.message));
        try {
          const bytes = (await read(data.offset, data.size)).slice();
          this.worker.postMessage({bytes}, [bytes.buffer]);
        } catch (error) {
          this.worker.postMessage({failed: {code: error.code ?? ErrorCode.network, message: error.message}});
        }
      };
      this.worker.postMessage({task});
    });
  }
  end() {
    this.worker.terminate();
  }
}
