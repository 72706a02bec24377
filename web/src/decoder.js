// The WebAssembly decoder (bindings/wasm/reader.cpp), called from JavaScript: pointers and numbers end here.

const DONE = 0;
const WANTS_BYTES = 1000;
const GOES_ON = 1001;
/** What a decoder says of what it leaves out: which one has it. */
export const NEEDS_FULL = 1002;
export const decoderFor = {[NEEDS_FULL]: 'full', 1003: 'small'};

/** Kinds of failure, as the command's exit codes name them. */
export const ErrorCode = {
  usage: 2, cannotRead: 3, malformed: 4, unsupported: 5, corrupt: 6, memory: 7, network: 10,
};

/** What could not be done: `code` is one of ErrorCode, `message` a sentence for people. */
export class MailleError extends Error {
  constructor(code, message) {
    super(message);
    this.name = 'MailleError';
    this.code = code;
  }
}

/** What a call gives that needs bytes which are not here: fetch all `ranges`, give() them, call again. */
export class WantsBytes {
  constructor(numbers) {
    this.ranges = [];
    for (let i = 0; i < numbers.length; i += 2) this.ranges.push({offset: numbers[i], size: numbers[i + 1]});
  }
}
/** What a long call gives now and then: call again. */
export class GoesOn {
  constructor(cells) {
    this.cells = cells;
  }
}

const scalarArrays = [Int8Array, Uint8Array, Int16Array, Uint16Array, Int32Array, Uint32Array, BigInt64Array,
  BigUint64Array, Float32Array, Float64Array];
const scalarNames = ['i8', 'u8', 'i16', 'u16', 'i32', 'u32', 'i64', 'u64', 'f32', 'f64'];
const domains = ['point', 'corner', 'cell', 'mesh'];
const roles = ['none', 'normal', 'colour', 'texture_coordinate', 'tangent', 'label'];
const kinds = ['positions', 'points', 'triangles', 'cells', 'drawnArray', 'exactPositions', 'types', 'offsets',
  'connectivity', 'array', 'triangleArray', 'types', 'offsets', 'connectivity', 'slots', 'faceSizes', 'cellFaces', 'points',
  'pointSlots', 'endedSlots', 'faces', 'borderKeys', 'cellNumbers', 'pointNumbers'];
/** What maille_buffers() lists. */
export const Wanted = {exact: 0, drawn: 1, surface: 2, surfaceOfPieces: 3};
const texts = new TextDecoder();
const BUFFER_WORDS = 12;  // struct Buffer of reader.cpp

/** Compiles the decoder once; `source`: bytes, a Response or promise of one, or a compiled module. */
export async function compileDecoder(source) {
  try {
    source = await source;
  } catch (error) {
    throw new MailleError(ErrorCode.network, `the decoder cannot be read (${error.message}); setDecoder() tells where it is`);
  }
  if (source instanceof WebAssembly.Module) return source;
  if (typeof Response !== 'undefined' && source instanceof Response) {
    if (!source.ok) throw new MailleError(ErrorCode.network, `${source.url}: the decoder is not there (${source.status})`);
    return WebAssembly.compile(await source.arrayBuffer());
  }
  return WebAssembly.compile(source);
}

/** Does a request want the mesh itself, all of it? Then it is decoded as one: charts do not know the order of the input. */
export function isWhole({box, sphere, planes = [], level, bound = Infinity, view, maxFaces}) {
  return level === 0 && !box && !sphere && planes.length === 0 && bound === Infinity && !view && !maxFaces;
}

/** One instance of the decoder, with a memory of its own. */
export class Decoder {
  /** @param {WebAssembly.Module} module */
  static async create(module) {
    const decoder = new Decoder();
    const trap = name => () => { throw new MailleError(ErrorCode.memory, `the decoder stopped (${name}): not enough memory`); };
    const imports = {};
    for (const {module: space, name, kind} of WebAssembly.Module.imports(module)) {
      if (kind !== 'function') continue;
      (imports[space] ??= {})[name] = trap(name);
    }
    if (imports.env?.emscripten_notify_memory_growth) imports.env.emscripten_notify_memory_growth = () => {};
    const instance = await WebAssembly.instantiate(module, imports);
    decoder.calls = instance.exports;
    decoder.memory = instance.exports.memory;
    instance.exports._initialize?.();
    return decoder;
  }

  /** Copies bytes into the decoder's memory; whom they are passed to releases them. */
  put(bytes) {
    const address = this.calls.maille_allocate(bytes.byteLength);
    if (address === 0 && bytes.byteLength > 0) throw new MailleError(ErrorCode.memory, 'not enough memory for the decoder');
    new Uint8Array(this.memory.buffer, address, bytes.byteLength).set(bytes);
    return address;
  }
  text(address, size) {
    return texts.decode(new Uint8Array(this.memory.buffer, address, size));
  }
  get memoryBytes() {
    return this.memory.buffer.byteLength;
  }
}

/** One file in the decoder. Calls return what they say, or WantsBytes; they throw MailleError. Those of mode stream: volume_decoder.js. */
export class DecoderFile {
  /** @param meshBytes what a decoded mesh may take in memory */
  constructor(decoder, size, name, meshBytes = 2 ** 31) {
    this.decoder = decoder;
    const bytes = new TextEncoder().encode(name);
    this.reader = decoder.calls.maille_new_reader(size, decoder.put(bytes), bytes.byteLength, meshBytes);
  }

  give(offset, bytes) {
    this.decoder.calls.maille_give(this.reader, offset, this.decoder.put(bytes), bytes.byteLength);
  }
  /** Forgets all but the first `kept` bytes. */
  forgetBehind(kept) {
    this.decoder.calls.maille_forget_behind(this.reader, kept);
  }
  close() {
    if (this.reader !== 0) this.decoder.calls.maille_delete_reader(this.reader);
    this.reader = 0;
  }

  open() {
    return this.outcome(this.decoder.calls.maille_open(this.reader), () => {
      const n = this.numbers();
      const levels = [];
      for (let i = 0; i < n[4]; ++i) levels.push({faces: n[5 + 2 * i], charts: n[6 + 2 * i]});
      return {sphere: {centre: [n[0], n[1], n[2]], radius: n[3]}, levels};
    });
  }

  /** @returns the charts of a request, see MeshFile.select */
  select(request) {
    const packed = this.#pack(request);
    const outcome = this.decoder.calls.maille_select(this.reader, packed.address, packed.count, request.maxFaces ?? 0);
    this.decoder.calls.maille_release(packed.address);
    return this.outcome(outcome, () => {
      const n = this.numbers(), charts = [];
      for (let i = 0; i < n.length; i += 9) {
        charts.push({
          group: n[i], chart: n[i + 1], level: n[i + 2], faces: n[i + 3], bytes: n[i + 4],
          sphere: {centre: [n[i + 5], n[i + 6], n[i + 7]], radius: n[i + 8]},
        });
      }
      return charts;
    });
  }

  /**
   * Groups from `first` on, see GroupInfo of random_access.h: {all, groups: [{level, viewError, sphere, replaces,
   * charts: [{group, chart, level, refinedBy, faces, bytes, sphere}]}]}; refinedBy: -1 at level 0.
   */
  groups(first, count) {
    return this.outcome(this.decoder.calls.maille_groups(this.reader, first, count), () => {
      const n = this.numbers(), groups = [];
      const sphereAt = i => ({centre: [n[i], n[i + 1], n[i + 2]], radius: n[i + 3]});
      for (let i = 1; i < n.length;) {
        const group = {level: n[i], viewError: n[i + 1], sphere: sphereAt(i + 2), replaces: n[i + 6], charts: []};
        const end = i + 8 + 7 * n[i + 7];
        for (i += 8; i < end; i += 7) {
          group.charts.push({
            group: first + groups.length, chart: group.charts.length, level: group.level,
            refinedBy: n[i], faces: n[i + 1], bytes: n[i + 2], sphere: sphereAt(i + 3),
          });
        }
        groups.push(group);
      }
      return {all: n[0], groups};
    });
  }

  /** One chart, for drawing. */
  chart(group, chart) {
    return this.outcome(this.decoder.calls.maille_read_chart(this.reader, group, chart), () => this.drawn(this.buffers(Wanted.drawn)));
  }
  /** The charts that select() gave last, as one mesh: exactly, and clipped to the region if `clip`; or the mesh, see isWhole(). */
  extract(request) {
    return this.#extracted(request, () => this.exact(this.buffers(Wanted.exact)));
  }
  /** The same as a PLY file: {bytes, points, faces, notes}; `notes`: sentences about what PLY does not hold. */
  extractPly(request) {
    const {calls, memory} = this.decoder;
    if (!calls.maille_ply) throw new MailleError(NEEDS_FULL, 'the small decoder writes no files');
    return this.#extracted(request, () => this.outcome(calls.maille_ply(this.reader), () => {
      const [address, size, points, faces] = this.numbers(), notes = this.message().split('\n').filter(Boolean);
      const bytes = new Uint8Array(memory.buffer.slice(address, address + size));
      calls.maille_clear(this.reader);
      return {bytes, points, faces, notes};
    }));
  }
  /** The whole mesh of a file of any mode. */
  decode(drawn) {
    return this.outcome(this.decoder.calls.maille_decode(this.reader), () => drawn ? this.drawn(this.buffers(Wanted.drawn)) : this.exact(this.buffers(Wanted.exact)));
  }
  /** What can be seen of a file of mode single or random, as decode(true), with values of cells on triangles. */
  surface() {
    return this.outcome(this.decoder.calls.maille_decode(this.reader), () => this.drawn(this.buffers(Wanted.surface)));
  }
  /** What a ray meets first, exactly; null: nothing. */
  hit(origin, direction) {
    const address = this.decoder.put(new Uint8Array(Float64Array.from([...origin, ...direction]).buffer));
    const outcome = this.decoder.calls.maille_hit(this.reader, address);
    this.decoder.calls.maille_release(address);
    return this.outcome(outcome, () => {
      const n = this.numbers();
      if (n.length === 0) return null;
      return {
        group: n[0], chart: n[1], face: n[2], corners: [n[3], n[4], n[5]], weights: [n[6], n[7], n[8]],
        position: [n[9], n[10], n[11]], distance: n[12],
      };
    });
  }

  outcome(outcome, value) {
    if (outcome === DONE) return value();
    if (outcome === WANTS_BYTES) return new WantsBytes(this.numbers());
    if (outcome === GOES_ON) return new GoesOn(this.numbers()[0]);
    throw new MailleError(outcome, this.message());
  }
  message() {
    const {calls} = this.decoder;
    return this.decoder.text(calls.maille_message(this.reader), calls.maille_message_size(this.reader));
  }
  /** What `give` makes of the mesh that a request wants. */
  #extracted(request, give) {
    const {calls} = this.decoder, whole = isWhole(request);
    return this.outcome(whole ? calls.maille_decode(this.reader) : calls.maille_extract(this.reader), () => {
      if (request.clip && !whole) this.#clip(request);
      return give();
    });
  }
  /** Leaves of the mesh at hand the faces that touch a region. */
  #clip(request) {
    const packed = this.#pack(request);
    this.decoder.calls.maille_clip(this.reader, packed.address, packed.count);
    this.decoder.calls.maille_release(packed.address);
  }
  numbers() {
    const {calls, memory} = this.decoder;
    return new Float64Array(memory.buffer, calls.maille_numbers(this.reader), calls.maille_number_count(this.reader)).slice();
  }

  /** As request_of() of reader.cpp unpacks it. */
  #pack(request) {
    const {box, sphere, view, planes = []} = request, none = [NaN, NaN, NaN];
    const numbers = Float64Array.from([
      ...(box ? [...box.low, ...box.high] : [...none, ...none]),
      ...(sphere ? [...sphere.centre, sphere.radius] : [...none, NaN]),
      request.bound ?? Infinity, request.level ?? -1,
      ...(view ? [...view.eye, view.pixelsPerRadian, view.pixels ?? 1] : [0, 0, 0, 0, 1]),
      ...planes.flatMap(plane => [...plane.normal, plane.offset]),
    ]);
    return {address: this.decoder.put(new Uint8Array(numbers.buffer)), count: numbers.length};
  }

  /** What maille_buffers() lists of the mesh at hand. */
  buffers(wanted) {
    return this.list(this.decoder.calls.maille_buffers(this.reader, wanted));
  }
  /** Copies of the buffers that a call listed at an address. */
  list(address) {
    const {calls, memory} = this.decoder, count = calls.maille_buffer_count(this.reader);
    const words = new Uint32Array(memory.buffer, address, count * BUFFER_WORDS), list = [], labelled = [];
    let copy, begin = 0, end = 0;
    for (let i = 0; i < words.length; i += BUFFER_WORDS) {
      const type = words[i + 1], nameSize = words[i + 8], bytes = words[i + 9], size = words[i + 10], Type = scalarArrays[type];
      if (size > 0 && (bytes < begin || bytes + size > end || (bytes - begin) % Type.BYTES_PER_ELEMENT !== 0)) {
        // A copy that can be handed to other threads, of all that lies side by side.
        [begin, end] = [bytes, bytes + size];
        for (let next = i + BUFFER_WORDS; words[next + 9] === end; next += BUFFER_WORDS) end += words[next + 10];
        // Not slice(), which fills it with zeros first.
        copy = new Uint8Array(new Uint8Array(memory.buffer, begin, end - begin)).buffer;
      }
      // Empty vectors may have any address.
      const values = size === 0 ? new Type(0) : new Type(copy, bytes - begin, size / Type.BYTES_PER_ELEMENT);
      labelled.push(words[i + 11] !== 0);
      list.push({
        kind: kinds[words[i]], type: scalarNames[type], components: words[i + 2], domain: domains[words[i + 3]], role: roles[words[i + 4]],
        block: words[i + 5], cellType: words[i + 6], name: nameSize === 0 ? '' : this.decoder.text(words[i + 7], nameSize), values,
      });
    }
    list.forEach((buffer, i) => {
      if (labelled[i]) buffer.labels = this.#texts(() => calls.maille_labels(this.reader, i));
    });
    return list;
  }
  /** What a call leaves as the message: texts, each ended by a zero, in which labels and metadata have none. */
  #texts(call) {
    call();
    return this.message().split('\0').slice(0, -1);
  }
  /** Key and value, in the order of the source: comments, names of files it refers to, units. */
  metadata() {
    return this.outcome(this.decoder.calls.maille_metadata(this.reader), () => {
      const texts = this.#texts(() => {}), pairs = [];
      for (let i = 0; i + 1 < texts.length; i += 2) pairs.push([texts[i], texts[i + 1]]);
      return pairs;
    });
  }

  drawn(list) {
    const numbers = this.numbers(), drawn = {origin: [...numbers.subarray(0, 3)], arrays: []};
    if (numbers.length > 3) drawn.blockCells = [...numbers.subarray(3)];
    this.decoder.calls.maille_clear(this.reader);
    for (const buffer of list) {
      const {kind, values} = buffer;
      if (kind === 'drawnArray' || kind === 'array') drawn.arrays.push(describeArray(buffer));
      else if (kind === 'triangleArray') drawn.arrays.push({...describeArray(buffer), domain: 'triangle'});
      else drawn[kind] = values;
    }
    return drawn;
  }

  exact(list) {
    const exact = {positions: null, blocks: [], arrays: []};
    this.decoder.calls.maille_clear(this.reader);
    for (const buffer of list) {
      const {kind, values} = buffer;
      if (kind === 'exactPositions') exact.positions = values;
      else if (kind === 'array') exact.arrays.push(describeArray(buffer));
      else if (kind === 'cellNumbers' || kind === 'pointNumbers') exact[kind] = values;
      else if ((kind === 'faceSizes' || kind === 'cellFaces') && values.length === 0) continue;
      else (exact.blocks[buffer.block] ??= {name: buffer.name, cellType: buffer.cellType})[kind] = values;
    }
    return exact;
  }
}

/** What is drawn, with `points` and `cells` where the decoder leaves them out: 0, 1, 2, ..., made when they are asked for. */
export function withCounts(drawn) {
  if (!drawn.points) countLater(drawn, 'points', drawn.positions.length / 3);
  if (!drawn.cells) countLater(drawn, 'cells', drawn.triangles.length / 3);
  return drawn;
}
function countLater(drawn, name, count) {
  const set = value => Object.defineProperty(drawn, name, {value, enumerable: true, configurable: true, writable: true});
  const get = () => {
    const numbers = new Uint32Array(count);
    for (let i = 0; i < count; ++i) numbers[i] = i;
    set(numbers);
    return numbers;
  };
  Object.defineProperty(drawn, name, {get, set, enumerable: true, configurable: true});
}

/** `labels`, where an array has them: the value v stands for labels[v]. */
export function describeArray({name, domain, role, type, components, values, labels}) {
  return {name, domain, role, type, components, values, ...(labels && {labels})};
}

/** Every ArrayBuffer of a result, to be handed over instead of copied. */
export function buffersOf(value, found = new Set()) {
  if (ArrayBuffer.isView(value)) found.add(value.buffer);
  else if (value && typeof value === 'object') for (const part of Object.values(value)) buffersOf(part, found);
  return [...found];
}
