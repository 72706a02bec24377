// three.js: a loader with the manners of DRACOLoader, and an object that refines itself as it is looked at.

import * as THREE from 'three';

import {MeshFile, ready, setDecoder} from './maille.js';
import {toGeometry} from './three_geometry.js';

export {cacheBytesFor, MailleObject} from './three_object.js';
export {isOfCells, toGeometry, toInstances, tupleOfTriangle} from './three_geometry.js';

/** Loads whole files of any mode: `loader.load(url, geometry => ..., onProgress, onError)`, `loadAsync`, `parse`. */
export class MailleLoader extends THREE.Loader {
  #workers;

  /** The folder of maille.wasm, where it is not beside the library. */
  setDecoderPath(path) {
    setDecoder(`${path.replace(/\/?$/, '/')}maille.wasm`).catch(() => {});
    return this;
  }
  /** How many threads decode one file; 0: none. */
  setWorkerLimit(count) {
    this.#workers = count;
    return this;
  }
  /** Fetches the decoder before there is a file. */
  preload() {
    ready({mode: 'single'}).catch(() => {});
    return this;
  }
  /** Nothing is kept between files; here because other loaders have it. */
  dispose() {
    return this;
  }

  load(url, onLoad, onProgress, onError) {
    const address = this.manager.resolveURL((this.path ?? '') + url);
    this.manager.itemStart(address);
    this.#read(address, onProgress).then(onLoad).catch(error => {
      if (onError) onError(error);
      else console.error(error);
      this.manager.itemError(address);
    }).finally(() => this.manager.itemEnd(address));
  }
  parse(buffer, onLoad, onError = console.error) {
    this.#read(buffer).then(onLoad).catch(onError);
  }

  async #read(input, onProgress) {
    let total = 0, loaded = 0;
    const tell = () => onProgress?.({lengthComputable: total > 0, loaded, total});
    const onBytes = fetched => {
      loaded = fetched;
      if (total > 0) tell();
    };
    const file = await MeshFile.open(input, {workers: this.#workers, headers: this.requestHeader, onBytes,
      credentials: this.withCredentials ? 'include' : 'same-origin', maxWhole: Infinity});
    total = file.size;
    tell();
    try {
      const drawn = await file.surface();
      const geometry = toGeometry(drawn);
      // Loaded whole, geometry stands where the file has it.
      geometry.translate(...drawn.origin);
      geometry.userData.origin = [0, 0, 0];
      return geometry;
    } finally {
      file.close();
    }
  }
}
