export {createSyncDecoder} from './gltf.js';

/** An Extension of @gltf-transform/core, which is not needed to read these types; for `io.registerExtensions()`. */
export const MailleMeshCompression: any;
