/** glTF files that hold .maille files: the extension MAILLE_mesh_compression. docs/gltf.md specifies it. */
import type {Mesh} from './maille.js';

export const EXTENSION: 'MAILLE_mesh_compression';

/** Decodes files of mode single without promises. */
export interface SyncDecoder {
  decode(bytes: Uint8Array, name?: string): Mesh;
}
/** `full`: also files of levels 7 to 9, by a decoder twice as large. One decoder serves many files. */
export function createSyncDecoder(options?: {full?: boolean}): Promise<SyncDecoder>;

/** What .maille files hold of a glTF document: by accessor, the buffer view with the file and what gives the values. */
export function compressedAccessors(json: object): Map<number, {view: number; values(mesh: Mesh): ArrayBufferView}>;

/** Plug-in for GLTFLoader of three.js: `loader.register(parser => new MailleMeshCompression(parser))`. */
export class MailleMeshCompression {
  constructor(parser: any);
  readonly name: string;
  beforeRoot(): null;
  loadBufferView(index: number): Promise<ArrayBuffer> | null;
}
