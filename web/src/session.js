// Work on one file in one decoder, wherever that runs: asks for bytes until a call has all it needs.

import {Decoder, DecoderFile, WantsBytes} from './decoder.js';

/** Of what is not the front nothing is kept from one call to the next: other charts are next. */
const KEPT_FRONT = 256 * 1024;
const LEAST_READ = 64 * 1024;

export class Session {
  constructor(module, {size, name, mode}, read) {
    Object.assign(this, {module, size, name, mode, read});
  }

  async run({call, arguments: given}) {
    // What failed once may go well later: the network comes back.
    await (this.opened ??= this.#open().catch(error => { this.opened = null; throw error; }));
    try {
      return call === 'extractAll' ? await this.#extract(...given) : await this.#until(() => this.file[call](...given), call === 'decode');
    } finally {
      this.file.forgetBehind(KEPT_FRONT);
    }
  }
  close() {
    this.file?.close();
  }

  async #open() {
    this.file = new DecoderFile(await Decoder.create(this.module), this.size, this.name);
    if (this.mode === 'random') await this.#until(() => this.file.open());
  }
  async #extract(request) {
    await this.#until(() => this.file.select(request));
    return this.#until(() => this.file.extract(request));
  }
  async #until(attempt, whole = false) {
    for (;;) {
      const result = attempt();
      if (!(result instanceof WantsBytes)) return result;
      const {offset} = result;
      const size = whole ? this.size - offset : Math.min(Math.max(result.size, offset === 0 ? LEAST_READ : 0), this.size - offset);
      this.file.give(offset, await this.read(offset, size));
    }
  }
}
