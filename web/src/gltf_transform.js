// MAILLE_mesh_compression for gltf-transform: reads; what is written then is plain glTF.
//
//   const io = new NodeIO().registerExtensions([MailleMeshCompression]).registerDependencies({'maille.decoder': await createSyncDecoder()});
import {Extension, PropertyType} from '@gltf-transform/core';

import {compressedAccessors, EXTENSION} from './gltf.js';

export {createSyncDecoder} from './gltf.js';

export class MailleMeshCompression extends Extension {
  static EXTENSION_NAME = EXTENSION;
  extensionName = EXTENSION;
  prereadTypes = [PropertyType.PRIMITIVE];
  readDependencies = ['maille.decoder'];
  #decoder = null;

  install(key, dependency) {
    if (key === 'maille.decoder') this.#decoder = dependency;
    return this;
  }

  /** Before primitives are made: their accessors get values. */
  preread(context) {
    if (!this.#decoder) throw new Error(`${EXTENSION}: register the dependency 'maille.decoder', made by createSyncDecoder()`);
    const meshes = new Map();
    for (const [number, {view, values}] of compressedAccessors(context.jsonDoc.json)) {
      if (!meshes.has(view)) meshes.set(view, this.#decoder.decode(context.bufferViews[view], `buffer view ${view}`));
      context.accessors[number].setArray(values(meshes.get(view)).slice());
    }
    return this;
  }
  read() {
    return this;
  }
  /** Accessors have their values now, so that nothing is left of the extension. */
  write(context) {
    const {json} = context.jsonDoc;
    for (const key of ['extensionsUsed', 'extensionsRequired']) {
      json[key] = json[key]?.filter(name => name !== EXTENSION);
      if (!json[key]?.length) delete json[key];
    }
    return this;
  }
}
