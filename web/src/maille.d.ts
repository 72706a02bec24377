/** Reads .maille files in browsers and node. docs/web.md has it in sentences. */

/** Kinds of failure, as the command's exit codes name them. */
export const ErrorCode: {
  readonly usage: 2;
  readonly cannotRead: 3;
  readonly malformed: 4;
  readonly unsupported: 5;
  readonly corrupt: 6;
  readonly memory: 7;
  readonly network: 10;
};

/** What could not be done: `message` is a sentence for people. Calls that were aborted throw the signal's reason instead. */
export class MailleError extends Error {
  constructor(code: number, message: string);
  readonly code: number;
}

export type Vector = [number, number, number];
export interface Sphere {
  centre: Vector;
  radius: number;
}
export interface Box {
  low: Vector;
  high: Vector;
}
/** normal . x + offset >= 0 inside; the normal has length 1. */
export interface Plane {
  normal: Vector;
  offset: number;
}
/** A perspective view: pixelsPerRadian is height / (2 tan(vertical field of view / 2)); pixels: error that may be seen. */
export interface View {
  eye: Vector;
  pixelsPerRadian: number;
  pixels?: number;
}

/** Where and how fine. Of everything that is said all holds; nothing said: everywhere, the coarsest. */
export interface Request {
  box?: Box;
  sphere?: Sphere;
  planes?: Plane[];
  /** No charts coarser than this level; 0 is the mesh itself. */
  level?: number;
  /** No point of the mesh is farther than this from what is chosen, in units of the mesh. */
  bound?: number;
  view?: View;
  /** As fine as so many faces allow; the worst error, as seen by `view`, is refined first. */
  maxFaces?: number;
}

/** A piece of the surface at one level of detail. */
export interface Chart {
  group: number;
  chart: number;
  level: number;
  faces: number;
  /** In the file. */
  bytes: number;
  sphere: Sphere;
}

/** Charts that are shown together, instead of those of a coarser level whose `refinedBy` is the number of this group. */
export interface Group {
  level: number;
  /** Of what the group replaces, in units of the mesh. */
  viewError: number;
  sphere: Sphere;
  /** How many charts it replaces. */
  replaces: number;
  /** refinedBy: the group that replaces it; -1 at level 0. */
  charts: (Chart & {refinedBy: number})[];
}

export type Values = Int8Array | Uint8Array | Int16Array | Uint16Array | Int32Array | Uint32Array | BigInt64Array |
  BigUint64Array | Float32Array | Float64Array;

export interface MeshArray {
  name: string;
  /** What its tuples belong to; 'triangle': to what is drawn of cells, see MeshFile.surface(). */
  domain: 'point' | 'corner' | 'cell' | 'mesh' | 'triangle';
  role: 'none' | 'normal' | 'colour' | 'texture_coordinate' | 'tangent' | 'label';
  type: 'i8' | 'u8' | 'i16' | 'u16' | 'i32' | 'u32' | 'i64' | 'u64' | 'f32' | 'f64';
  components: number;
  values: Values;
  /** Where the role is 'label' and labels have names: the value v stands for labels[v]. */
  labels?: string[];
}

/** Triangles over vertices in single precision. A point is a vertex once for each tuple that its corners have. */
export interface DrawnMesh {
  /** To be added to positions: far from zero floats are too coarse. */
  origin: number[];
  /** Three per vertex. */
  positions: Float32Array;
  /** Three vertices each; in 16 bits where that is enough, mostly in one buffer with `positions`. */
  triangles: Uint16Array | Uint32Array;
  /** By vertex: the point of the mesh. This and `cells` may be made when they are asked for. */
  points: Uint32Array;
  /** By triangle: the cell of the mesh. */
  cells: Uint32Array;
  /** On points and corners: domain 'point', a tuple for each vertex. */
  arrays: MeshArray[];
  /** Where there are several blocks: how many cells each has. */
  blockCells?: number[];
}
/** The same in less memory: no points and cells where they are 0, 1, 2, ... */
export interface LeanMesh extends Omit<DrawnMesh, 'points' | 'cells'> {
  points: Uint32Array | null;
  cells: Uint32Array | null;
}

/** Values that are wanted of an array: from low to high, both included. Of several components one, or the length of the tuple. */
export interface ValueCondition {
  array: string;
  low?: number;
  high?: number;
  component?: number;
}
/** Which cells of a volume: those that meet all of this. */
export interface VolumeRequest {
  /** Cells whose box meets these. */
  box?: Box;
  sphere?: Sphere;
  planes?: Plane[];
  /** Cells with points on both sides of it. */
  plane?: Plane;
  /** Cells with such a value, or with a point that has it. */
  where?: ValueCondition[];
  /** Their numbers in the input, from the first to before the second. */
  cells?: [number, number];
  /** Only out of these pieces. */
  pieces?: number[];
  /** Names of the arrays that come. */
  arrays?: string[];
  /** Of time. */
  step?: number;
}
/** What the index says of an array in a piece, by component. */
export interface ValueRange {
  name: string;
  domain: 'point' | 'cell';
  low: number[];
  high: number[];
  mean: number[];
  nans: number;
}
/** Cells of a volume that stand together in space, and in the file. */
export interface VolumePiece {
  piece: number;
  cells: number;
  points: number;
  /** In the file. */
  bytes: number;
  /** Null where nothing is known, as of volumes that are not in pieces. */
  box: Box | null;
  ranges: ValueRange[] | null;
}
export interface VolumeInfo {
  cells: number;
  points: number;
  /** Whether cells and points have numbers of the input. */
  keepsOrder: boolean;
  pieces: number;
  fields: (Omit<MeshArray, 'values'> & {low?: number[]; high?: number[]; nans?: number})[];
  box: Box | null;
}
export interface VolumeCells extends Mesh {
  /** In the input; null where its order is not kept. */
  cellNumbers: Uint32Array | null;
  pointNumbers: Uint32Array | null;
  /** That were read, and how many cells they have. */
  pieces: number;
  cellsRead: number;
  /** Damaged pieces that were left out, a sentence each. */
  problems: string[];
}
/** Polygons as triangles; the triangles of a polygon have one of `cells`. */
export interface DrawnSlice extends Omit<DrawnMesh, 'points'> {
  problems: string[];
}
/** What is drawn of one piece. */
export interface DrawnPiece extends Omit<DrawnMesh, 'points'> {
  points?: Uint32Array;
  /** By face or polygon: its first triangle; the others, around its first corner, follow. */
  faces: Uint32Array;
  /** By face: -1, or the same number as in other pieces that have it. */
  borderKeys: Float64Array;
}
export type DrawnPart = {piece: VolumePiece; drawn: DrawnPiece; error?: undefined} | {piece: VolumePiece; error: Error; drawn?: undefined};

export interface Block {
  name: string;
  /** A number of VTK; 255: each cell has its own, in `types`. */
  cellType: number;
  types: Uint8Array;
  /** Where cells begin in `connectivity`; empty where all have the same number of points. */
  offsets: Float64Array;
  connectivity: Uint32Array;
  /** Polyhedra: corners of each face, and where faces of cells begin. */
  faceSizes?: Uint32Array;
  cellFaces?: Float64Array;
}

/** Blocks of a mesh at one place of a glTF scene. A mesh that several nodes use is there once for each. */
export interface Instance {
  /** Of the node. */
  name: string;
  /** Their places in `Mesh.blocks`. */
  blocks: number[];
  /** From the mesh to the scene, column after column: Matrix4.fromArray() of three.js. */
  matrix: number[];
}

/** The mesh itself, bit for bit. */
export interface Mesh {
  positions: Values;
  blocks: Block[];
  arrays: MeshArray[];
}

/** Some thousand cells of a file of mode stream, and the points that come up with them. */
export interface Piece {
  /** Numbers of cells and points are those of the whole mesh. */
  firstCell: number;
  /** By cell: a number of VTK. */
  types: Uint8Array;
  /** Where cells begin in `connectivity`, and where the last one ends. */
  offsets: Float64Array;
  /** Numbers of points. */
  connectivity: Float64Array;
  /** The same as slots: small numbers, below slotCount, that no other point in use has. */
  slots: Uint32Array;
  /** Polyhedra: corners of each face, and by cell where its faces begin; empty where there are none. */
  faceSizes: Uint32Array;
  cellFaces: Float64Array;
  /** Points that come up here, their slots and positions. */
  points: Float64Array;
  pointSlots: Uint32Array;
  positions: Values;
  /** Points that no later piece uses. */
  endedSlots: Uint32Array;
  slotCount: number;
  /** On `points` (domain 'point') and on the cells of the piece. */
  arrays: MeshArray[];
}

/** What a ray meets first, on the mesh itself. */
export interface Hit {
  group: number;
  chart: number;
  /** In the chart. */
  face: number;
  /** Points of the chart, and their weights at the place that was hit. */
  corners: Vector;
  weights: Vector;
  position: Vector;
  /** In lengths of the direction. */
  distance: number;
}

export interface Progress {
  /** Bytes of the file that were read, of `total`. */
  loaded?: number;
  total: number;
  /** Cells that were decoded, where the file comes in pieces. */
  cells?: number;
}

/** Any storage with ranges. */
export interface ByteSource {
  size: number;
  name?: string;
  readAt(offset: number, size: number, signal?: AbortSignal): Promise<ArrayBuffer | Uint8Array> | ArrayBuffer | Uint8Array;
}
export type Input = string | URL | Blob | ArrayBuffer | ArrayBufferView | ByteSource;

export interface OpenOptions {
  fetch?: typeof fetch;
  headers?: Record<string, string>;
  credentials?: RequestCredentials;
  /** Bytes that may be read where a server gives no ranges. Default 256 MiB. */
  maxWhole?: number;
  /** Of what was fetched, kept. Default 32 MiB. */
  cacheBytes?: number;
  /** What one decoded mesh may take. Default 2 GiB; a call that would take more is refused before it is decoded. */
  meshBytes?: number;
  /** Of pieces of a volume, kept for the next slice by all threads together. Default 192 MiB. */
  pieceBytes?: number;
  /** Threads; 0: none. Default: one less than cores, at most four, in browsers. */
  workers?: number;
  /** Called with the bytes fetched so far. */
  onBytes?(fetched: number): void;
  signal?: AbortSignal;
}
/** Values of a later time. Step 0, which is not listed, is what the mesh came with. */
export interface Step {
  /** From 1 on: what `surface({step})` and `pieces({step})` take. */
  step: number;
  time: number;
}
export interface CallOptions {
  signal?: AbortSignal;
}
export interface PartOptions extends CallOptions {
  /** Names of the arrays that come. */
  arrays?: string[];
  step?: number;
  /** Of these alone, in this order. */
  pieces?: VolumePiece[];
  onProgress?(progress: {pieces: number; of: number}): void;
}
export interface LongCallOptions extends CallOptions {
  onProgress?(progress: Progress): void;
}

export class MeshFile {
  static open(input: Input, options?: OpenOptions): Promise<MeshFile>;
  close(): void;

  readonly name: string;
  readonly size: number;
  readonly mode: 'single' | 'stream' | 'random';
  /** Mode random: the mesh itself first. */
  readonly levels?: {faces: number; charts: number}[];
  readonly sphere?: Sphere;
  /** Once readSteps() has read them. */
  readonly steps?: Step[];
  readonly info: Pick<MeshFile, 'name' | 'size' | 'mode' | 'levels' | 'sphere' | 'steps'> & {volume?: VolumeInfo};
  /** Bytes held in caches and by decoders, and what was fetched so far. */
  readonly usage: {cacheBytes: number; decoderBytes: number; fetchedBytes?: number; requests?: number};

  /**
   * Steps of time behind the mesh; [] where there are none. Reads the end of the file and, step by step, where each begins: not
   * the mesh, nor values; from a server without ranges, all of the file.
   */
  readSteps(options?: CallOptions): Promise<Step[]>;
  /** Key and value, in the order of the source: comments, names of files it refers to (mtllib), units. */
  readMetadata(options?: CallOptions): Promise<[string, string][]>;
  /** Where the nodes of a glTF scene put the blocks; [] where each is there once, and not moved. */
  readInstances(options?: CallOptions): Promise<Instance[]>;

  /** Charts that together show a region without cracks. Mode random. */
  select(request?: Request, options?: CallOptions): Promise<Chart[]>;
  /** Pieces that may have such cells, by the index alone. Volumes of mode stream. */
  select(request: VolumeRequest, options?: CallOptions): Promise<VolumePiece[]>;
  /** Cells of a volume, bit for bit. */
  extract(request: VolumeRequest, options?: LongCallOptions): Promise<VolumeCells>;
  /** A first picture of a volume in pieces, of its index alone: vertices that stand for some thousand cells, with their means. */
  coarse(options?: CallOptions): Promise<Pick<Mesh, 'positions' | 'arrays'>>;
  /** What a plane cuts out of a volume, decoded from the pieces that it meets. */
  slice(plane: Plane, options?: PartOptions): Promise<DrawnSlice>;
  /** The same piece by piece, as they come. */
  slices(plane: Plane, options?: PartOptions): AsyncGenerator<DrawnPart, void, void>;
  /** Surfaces of pieces, as they come; each has the faces between pieces, too. */
  surfaces(options?: PartOptions): AsyncGenerator<DrawnPart, void, void>;
  /** The same at once, or null where the index must be fetched first, which it then is. */
  selectNow(request?: Request): Chart[] | null;
  /** Groups of charts from `first` on, for renderers that choose themselves what they show. Mode random. */
  groups(first: number, count?: number, options?: CallOptions): Promise<{all: number; groups: Group[]}>;
  /** A chart, for drawing. Mode random. */
  decodeNode(chart: Pick<Chart, 'group' | 'chart'>, options?: CallOptions & {lean?: false}): Promise<DrawnMesh>;
  decodeNode(chart: Pick<Chart, 'group' | 'chart'>, options: CallOptions & {lean: true}): Promise<LeanMesh>;
  /**
   * Faces of a region, bit for bit; `clip` (the default): none that only share a chart with it. Without a region the whole
   * mesh, in the order of the input if the file has it. Mode random.
   */
  extract(request?: Request & {clip?: boolean}, options?: LongCallOptions): Promise<Mesh>;
  /** The same as a PLY file, the bytes of `maille extract`; `notes`: sentences about what PLY does not hold. */
  extractPly(request?: Request & {clip?: boolean}, options?: LongCallOptions): Promise<{bytes: Uint8Array; points: number; faces: number; notes: string[]}>;
  /** What a ray meets first, on the original; null: nothing. Mode random. */
  pick(origin: ArrayLike<number> & Iterable<number>, direction: ArrayLike<number> & Iterable<number>, options?: CallOptions): Promise<Hit | null>;

  /** The whole mesh of a file of any mode. */
  decode(options?: LongCallOptions & {drawn?: false}): Promise<Mesh>;
  decode(options: LongCallOptions & {drawn: true}): Promise<DrawnMesh>;
  /**
   * What can be seen of the whole mesh: faces, and the faces of solids that no other solid has. Arrays on cells come with
   * domain 'triangle', a tuple for each triangle. Files of mode stream are read front to back with memory for the surface
   * alone; `step`: of time.
   */
  surface(options?: LongCallOptions & {step?: number}): Promise<DrawnMesh>;
  /** A file of mode stream, of any size, piece by piece. */
  pieces(options?: LongCallOptions & {step?: number}): AsyncGenerator<Piece, void, void>;
}

/** Decodes a whole file. */
export function decode(input: Input, options?: OpenOptions & LongCallOptions & {drawn?: false}): Promise<Mesh>;
export function decode(input: Input, options: OpenOptions & LongCallOptions & {drawn: true}): Promise<DrawnMesh>;

/**
 * Where the decoder is, if not beside this file: the URL of maille.wasm, with maille-charts.wasm and maille-full.wasm
 * beside it; or bytes or a compiled module of one. `full`: the full one, by itself.
 */
export function setDecoder(source: DecoderSource, full?: DecoderSource): Promise<WebAssembly.Module>;
export type DecoderSource = string | URL | BufferSource | WebAssembly.Module | Response | Promise<Response | BufferSource>;
/**
 * Loads and compiles a decoder before it is needed: the one with which files of a mode are begun ('random' if nothing is
 * said); `full`: the one that has all modes.
 */
export function ready(options?: {full?: boolean; mode?: 'random' | 'single' | 'stream'}): Promise<WebAssembly.Module>;
