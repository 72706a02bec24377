// Volumes of mode stream by parts: pieces decoded side by side, each where it was decoded last, and put together.

import {ErrorCode, MailleError} from './decoder.js';

/** Of the file, asked for at once: pieces that lie side by side come in one request. */
const BYTES_AT_ONCE = 4 * 2 ** 20;
/** The same in pieces, for each thread. */
const AHEAD = 16;

const PIECE_BYTES = 192 * 2 ** 20;

/** An open volume: what the index says, and its pieces. */
export class Volume {
  static async open(file, read, signal) {
    const about = await file.session.run({call: 'openVolume', arguments: [{}]}, {signal});
    return new Volume(about, file, read);
  }

  /**
   * @param index what openVolume() of volume_decoder.js gives
   * @param file {name, session: for the index, pool, options}
   */
  constructor(index, {name, session, pool, options}, read) {
    Object.assign(this, index, {name, session, pool, read});
    this.keptBytes = Math.floor((options.pieceBytes ?? PIECE_BYTES) / Math.min(pool.lanes, index.pieces.length || 1));
    this.about = aboutVolume(index);
    const {box} = this.about;
    this.origin = box?.low.map((x, k) => (x + box.high[k]) / 2);
    this.held = [];  // by thread: numbers of pieces, and of which request
  }

  /**
   * Pieces that may have cells that meet box, sphere and planes, have points on both sides of `plane`, values as `where` says
   * [{array, low, high, component}], and numbers from cells[0] to before cells[1]; only out of `pieces`.
   */
  async select(request, {signal} = {}) {
    this.expectArrays(request.arrays);
    const numbers = await this.session.run({call: 'selectPieces', arguments: [request]}, {signal});
    return numbers.map(number => this.pieces[number]);
  }

  /** A first picture, of the index alone: {positions, arrays} of vertices, each with the means of some thousand cells. */
  coarse({signal} = {}) {
    return this.session.run({call: 'coarseVolume', arguments: [{}]}, {signal});
  }

  /** Such cells, exactly; `arrays`: names of those that come; `step`: of time. */
  async extract(request, options) {
    this.expectArrays(request.arrays);
    const part = await this.pool.run({call: 'extractVolume', arguments: [request]}, options);
    if (!this.keepsOrder) part.cellNumbers = part.pointNumbers = null;
    return part;
  }

  /**
   * What a plane cuts out of solids, for drawing: polygons as triangles, with values of points between those of the edges' ends,
   * `cells` with the values of each; decoded is what it meets. problems: of damaged pieces, sentences.
   */
  async slice(plane, options) {
    const parts = [], problems = [];
    for await (const {drawn, error} of this.slices(plane, options)) {
      if (error?.code === ErrorCode.corrupt) problems.push(error.message);
      else if (error) throw error;
      else parts.push(drawn);
    }
    return {...joined(parts), problems};
  }
  /** The same piece by piece, as they come: {piece, drawn} or {piece, error}. `pieces`: in this order, only these. */
  async *slices(plane, {arrays, step, pieces, signal, onProgress} = {}) {
    const met = pieces ?? await this.select({plane, arrays}, {signal});
    yield* this.#parts('sliceOfPiece', met, {plane, arrays, step}, {signal, onProgress});
  }
  /** Surfaces of pieces, as they come: {piece, drawn} or {piece, error}; BorderFaces looks after faces between pieces. */
  async *surfaces({arrays, step, pieces, signal, onProgress} = {}) {
    this.expectArrays(arrays);
    yield* this.#parts('surfaceOfPiece', pieces ?? this.pieces, {arrays, step}, {signal, onProgress});
  }
  /** The surface of all. */
  async surface(options) {
    const parts = [], borders = new BorderFaces();
    for await (const {drawn, error} of this.surfaces(options)) {
      if (error) throw error;
      borders.add(drawn);
      parts.push(drawn);
    }
    return joined(parts.map(withoutGone));
  }

  expectArrays(names) {
    for (const name of names ?? []) {
      if (!this.fields.some(field => field.name === name)) throw new MailleError(ErrorCode.usage, `${this.name}: has no array named "${name}"`);
    }
  }

  /**
   * A call of volume_decoder.js for one piece after another; gives {piece, drawn} or {piece, error} as they come.
   * @param request of each; its `pieces` and `origin` are set here
   */
  async *#parts(call, pieces, request, {signal, onProgress} = {}) {
    // One for each piece: node warns of signals for which many wait.
    const stops = new Set(), come = [], total = pieces.length;
    const stop = reason => stops.forEach(each => each.abort(reason)), forward = () => stop(signal.reason);
    signal?.addEventListener('abort', forward, {once: true});
    let running = 0, done = 0, wake = () => {};
    const run = async (piece, given, own) => {
      try {
        come.push({piece, drawn: await this.#run(call, piece, request, given, own.signal)});
      } catch (error) {
        come.push({piece, error});
      }
      stops.delete(own);
      --running;
      wake();
    };
    const waiting = [...pieces];
    try {
      while (waiting.length > 0 || running > 0 || come.length > 0) {
        signal?.throwIfAborted();
        if (waiting.length > 0 && running < this.pool.lanes) {
          const batch = takeBatch(waiting, AHEAD * this.pool.lanes);
          running += batch.length;
          const own = batch.map(() => new AbortController()), given = this.#fetch(batch, request, own.map(each => each.signal));
          own.forEach(each => stops.add(each));
          batch.forEach((piece, i) => run(piece, given.then(parts => parts[i]), own[i]));
        }
        if (come.length === 0) await new Promise(resolve => { wake = resolve; });
        while (come.length > 0) {
          signal?.throwIfAborted();
          const part = come.shift();
          onProgress?.({pieces: ++done, of: total});
          yield part;
        }
      }
    } finally {
      signal?.removeEventListener('abort', forward);
      stop(new MailleError(ErrorCode.usage, 'no longer wanted'));
    }
  }

  async #run(call, piece, request, given, signal) {
    const lane = piece.piece % this.pool.lanes, parts = await given;
    const argument = {...request, pieces: [piece.piece], origin: this.origin, keptBytes: call === 'sliceOfPiece' ? this.keptBytes : 0};
    const drawn = await this.pool.run({call, arguments: [argument], given: parts}, {signal, lane, first: call === 'sliceOfPiece'});
    this.held[lane] = {key: keyOf(request), pieces: new Set(drawn.held)};
    delete drawn.held;
    if (call === 'sliceOfPiece') delete drawn.points;  // no points of the mesh
    if (!this.keepsOrder) number(drawn, piece);
    return drawn;
  }

  /** The bytes of pieces that no decoder has kept, all asked for in one turn: [[{offset, bytes}]] by piece. */
  async #fetch(pieces, request, signals) {
    const wanted = await Promise.all(pieces.map((piece, i) => this.#rangesOf(piece, request, signals[i])));
    return Promise.all(wanted.map(async (ranges, i) => {
      const bytes = await this.read(ranges, signals[i]);
      return ranges.map(({offset}, i) => ({offset, bytes: bytes[i]}));
    }));
  }
  async #rangesOf({piece}, request, signal) {
    const {key, pieces} = this.held[piece % this.pool.lanes] ?? {};
    if (!this.origin || (key === keyOf(request) && pieces.has(piece))) return [];
    return this.session.run({call: 'rangesOfPieces', arguments: [{...request, pieces: [piece]}]}, {signal});
  }
}

function keyOf({arrays, step}) {
  return JSON.stringify([arrays, step]);
}
function takeBatch(waiting, most) {
  let bytes = 0, size = 0;
  while (size < waiting.length && size < most && (size === 0 || bytes + waiting[size].bytes <= BYTES_AT_ONCE)) bytes += waiting[size++].bytes;
  return waiting.splice(0, size);
}
function boxOf(pieces) {
  const boxes = pieces.map(piece => piece.box).filter(Boolean);
  if (boxes.length === 0) return null;
  const each = (of, corner) => [0, 1, 2].map(k => boxes.reduce((x, box) => of(x, box[corner][k]), boxes[0][corner][k]));
  return {low: each(Math.min, 'low'), high: each(Math.max, 'high')};
}
function aboutVolume({cells, points, keepsOrder, pieces, fields}) {
  const merged = fields.map(({values, ...field}, i) => ({...field, ...rangeOf(pieces.map(piece => piece.ranges?.[i]))}));
  return {cells, points, keepsOrder, pieces: pieces.length, fields: merged, box: boxOf(pieces)};
}
/** Of all pieces, by component. */
function rangeOf(ranges) {
  if (ranges.some(range => !range)) return {};
  const each = (of, name, none) => ranges[0][name].map((_, k) => ranges.reduce((x, range) => (range.low[k] <= range.high[k] ? of(x, range[name][k]) : x), none));
  return {low: each(Math.min, 'low', Infinity), high: each(Math.max, 'high', -Infinity), nans: ranges.reduce((sum, {nans}) => sum + nans, 0)};
}
/** Where the order of the input is not kept, pieces are counted through. */
function number(drawn, {firstCell, firstPoint}) {
  drawn.cells = drawn.cells.map(cell => cell + firstCell);
  if (drawn.points) drawn.points = drawn.points.map(point => point + firstPoint);
}

/**
 * Faces between pieces, which both have, are no surface; a flat cell on the surface of a solid is drawn once, as a face of the
 * solid. Keys are those of BorderKeys of volume.cpp.
 */
export class BorderFaces {
  constructor() {
    this.solids = new Map();  // by key: the face that waits for that of another solid
    this.flats = new Map();   // by key: flat cells there
  }

  /** @returns the parts of which other faces are gone now: `drawn.gone`, by face */
  add(drawn) {
    const changed = new Set();
    drawn.gone = new Uint8Array(drawn.faces.length);
    for (const [face, key] of drawn.borderKeys.entries()) {
      if (key < 0) continue;
      const own = {drawn, face}, set = (other, gone) => {
        other.drawn.gone[other.face] = gone;
        changed.add(other.drawn);
      };
      if (key % 2 === 1) {
        this.flats.set(key - 1, [...this.flats.get(key - 1) ?? [], own]);
        set(own, Number(this.solids.has(key - 1)));
        continue;
      }
      const other = this.solids.get(key);
      if (other) {
        this.solids.delete(key);
        set(own, 1);
        set(other, 1);
      } else {
        this.solids.set(key, own);
      }
      for (const flat of this.flats.get(key) ?? []) set(flat, Number(!other));
    }
    return changed;
  }
}

/** A part without the faces that are gone, and without vertices that only these had. */
export function withoutGone(drawn) {
  const {faces, gone, positions, arrays} = drawn, all = drawn.triangles.length / 3;
  const triangles = [], kept = [];
  for (let face = 0; face < faces.length; ++face) {
    if (gone[face]) continue;
    const end = face + 1 < faces.length ? faces[face + 1] : all;
    for (let triangle = faces[face]; triangle < end; ++triangle) kept.push(triangle);
  }
  const numbers = new Int32Array(positions.length / 3).fill(-1), vertices = [];
  for (const triangle of kept) {
    for (let corner = 3 * triangle; corner < 3 * triangle + 3; ++corner) {
      const vertex = drawn.triangles[corner];
      if (numbers[vertex] < 0) numbers[vertex] = vertices.push(vertex) - 1;
      triangles.push(numbers[vertex]);
    }
  }
  return {
    origin: drawn.origin, positions: taken(positions, vertices, 3), triangles: Uint32Array.from(triangles),
    points: taken(drawn.points, vertices, 1), cells: taken(drawn.cells, kept, 1),
    arrays: arrays.map(array => ({...array, values: taken(array.values, array.domain === 'triangle' ? kept : vertices, array.components)})),
  };
}
function taken(values, numbers, components) {
  const out = new values.constructor(numbers.length * components);
  for (let i = 0; i < numbers.length; ++i) {
    for (let c = 0; c < components; ++c) out[i * components + c] = values[numbers[i] * components + c];
  }
  return out;
}

/** Parts with one origin as one. */
export function joined(parts) {
  let vertices = 0;
  const before = parts.map(({positions}) => (vertices += positions.length / 3) - positions.length / 3);
  const together = (Type, lists) => {
    const all = new Type(lists.reduce((sum, list) => sum + list.length, 0));
    let at = 0;
    for (const list of lists) {
      all.set(list, at);
      at += list.length;
    }
    return all;
  };
  const drawn = {
    origin: parts[0]?.origin ?? [0, 0, 0], positions: together(Float32Array, parts.map(part => part.positions)),
    triangles: together(Uint32Array, parts.map(({triangles}, i) => triangles.map(vertex => vertex + before[i]))),
    cells: together(Uint32Array, parts.map(part => part.cells)),
    arrays: (parts[0]?.arrays ?? []).map((array, i) => ({...array, values: together(array.values.constructor, parts.map(part => part.arrays[i].values))})),
  };
  if (parts.every(part => part.points)) drawn.points = together(Uint32Array, parts.map(part => part.points));
  return drawn;
}

/** What MeshFile.pieces() gives, of a decoder that has nothing else to do. */
export async function* portions(pool, step, {signal, onProgress}) {
  const worker = pool.own();
  try {
    await worker.run({call: 'beginPieces', arguments: [step]}, {signal});
    for (;;) {
      const piece = await worker.run({call: 'nextPiece'}, {signal, onProgress});
      if (!piece) return;
      yield piece;
    }
  } finally {
    worker.end();
  }
}
