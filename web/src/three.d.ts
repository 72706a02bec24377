/** maille in three.js. docs/viewer.md has it in sentences. */
import type {BufferGeometry, Camera, Group, Material, Mesh, Loader, Object3D, Raycaster, Sphere, WebGLRenderer} from 'three';

import type {CallOptions, Chart, DrawnMesh, LeanMesh, Hit, Input, Instance, MeshFile, OpenOptions} from './maille.js';

/** A BufferGeometry of what decodeNode(), surface() or decode({drawn: true}) gives. userData: origin, cells, points, arrays, materials (names, by the groups' materialIndex). */
export function toGeometry(drawn: DrawnMesh | LeanMesh): BufferGeometry;
/**
 * What the scene of a glTF file shows: a mesh for each block at each place that readInstances() gives, which share the vertices of
 * `geometry`, made by toGeometry() of the whole mesh. userData.block: its number.
 */
export function toInstances(geometry: BufferGeometry, instances: Instance[], material?: Material | Material[]): Group;
/** Of bytes fetched, what MailleObject.open() has kept: to open a file by oneself. */
export function cacheBytesFor(maxBytes?: number): number;

/** Loads whole files of any mode, with the manners of DRACOLoader. */
export class MailleLoader extends Loader<BufferGeometry> {
  /** The folder of maille.wasm, where it is not beside the library. */
  setDecoderPath(path: string): this;
  /** How many threads decode one file; 0: none. */
  setWorkerLimit(count: number): this;
  /** Fetches the decoder before there is a file. */
  preload(): this;
  dispose(): this;
  load(url: string, onLoad: (geometry: BufferGeometry) => void, onProgress?: (event: ProgressEvent) => void, onError?: (error: unknown) => void): void;
  loadAsync(url: string, onProgress?: (event: ProgressEvent) => void): Promise<BufferGeometry>;
  parse(buffer: ArrayBuffer, onLoad: (geometry: BufferGeometry) => void, onError?: (error: unknown) => void): void;
}

export interface MailleObjectOptions {
  /** Pixels. */
  errorTarget?: number;
  /** Pixels, when the camera has not moved for a while. Default: the same. */
  restTarget?: number;
  /** All of this level, whatever is seen of it; 0: the mesh itself. */
  level?: number | null;
  /** Of charts kept; arrays of those that go are given back at once. */
  maxBytes?: number;
  material?: Material | Material[];
  /** Charts that are made ready for the GPU in one frame while the camera moves; twice as many while it rests. */
  uploadsPerFrame?: number;
}
/** A file of mode random in a scene: refines itself as it is looked at. Events: 'progress', 'chart', 'error'. */
export class MailleObject extends Object3D {
  static open(input: Input, options?: OpenOptions & MailleObjectOptions): Promise<MailleObject>;
  constructor(file: MeshFile, options?: MailleObjectOptions);
  readonly file: MeshFile;
  errorTarget: number;
  restTarget: number;
  level: number | null;
  maxBytes: number;
  uploadsPerFrame: number;
  readonly heldBytes: number;
  /** That are shown. */
  readonly triangles: number;
  /** In pixels, of what is shown. */
  readonly error: number;
  readonly meshes: Mesh[];
  readonly boundingSphere: Sphere;
  /** Once a frame, before render(). Returns whether all that the view needs is shown. */
  update(camera: Camera, renderer: WebGLRenderer): boolean;
  /** To be called when geometry of charts was changed: how much memory they take now. */
  weigh(): void;
  /** Asks again for what could not be read. */
  retry(): void;
  pick(raycaster: Raycaster, options?: CallOptions): Promise<Hit | null>;
  dispose(): void;
}
export interface MailleObjectEvents {
  progress: {shown: number; wanted: number; triangles: number; error: number};
  chart: {mesh: Mesh; chart: Chart};
  error: {error: Error; chart: Chart | null};
}
