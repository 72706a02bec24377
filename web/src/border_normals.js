// Normals at the borders of charts, which are computed from the triangles of one chart alone: what several charts have there is
// put together, so that light shows no seams. A point of a border has the same bits in all charts (see docs/viewer.md).

/**
 * Vertices that lie at the end of a surface: around all others the triangles close, and each neighbour follows once and
 * precedes once, so that the sum of (next - previous) is zero.
 */
export function borderVertices(triangles, vertices) {
  const sums = new Int32Array(vertices), found = [];
  for (let i = 0; i < triangles.length; i += 3) {
    const a = triangles[i], b = triangles[i + 1], c = triangles[i + 2];
    sums[a] += b - c;
    sums[b] += c - a;
    sums[c] += a - b;
  }
  for (let vertex = 0; vertex < vertices; ++vertex) {
    if (sums[vertex] !== 0) found.push(vertex);
  }
  return Uint32Array.from(found);
}

/** Sums of what charts say of the normals at their borders, by position. */
export class BorderNormals {
  constructor() {
    this.places = new Map();  // by key of a position: number of its sums
    this.keys = [];
    this.counts = [];         // how many charts have a place
    this.sums = new Float32Array(3 * 1024);
    this.free = [];
  }

  /**
   * Of a chart that is here from now on: {vertices, places, normals}.
   * @param geometry with normals of the chart alone, three of 16 bits a vertex
   */
  add(geometry) {
    const normals = geometry.getAttribute('normal'), positions = geometry.getAttribute('position').array;
    const vertices = borderVertices(geometry.index.array, normals.count), bits = new Uint32Array(positions.buffer, positions.byteOffset, positions.length);
    const border = {vertices, places: new Uint32Array(vertices.length), own: new Int16Array(3 * vertices.length), normals};
    vertices.forEach((vertex, i) => {
      const place = border.places[i] = this.#placeOf(keyOf(bits, 3 * vertex));
      ++this.counts[place];
      for (let k = 0; k < 3; ++k) {
        border.own[3 * i + k] = normals.array[3 * vertex + k];
        this.sums[3 * place + k] += border.own[3 * i + k];
      }
    });
    return border;
  }
  remove({places, own}) {
    places.forEach((place, i) => {
      for (let k = 0; k < 3; ++k) this.sums[3 * place + k] -= own[3 * i + k];
      if (--this.counts[place] > 0) return;
      this.places.delete(this.keys[place]);
      this.sums.fill(0, 3 * place, 3 * place + 3);
      this.free.push(place);
    });
  }
  /** Gives the vertices of a border the normals that all charts there have now. */
  apply({vertices, places, own, normals}) {
    const {array} = normals, {sums} = this;
    let changed = false;
    vertices.forEach((vertex, i) => {
      const at = 3 * places[i], x = sums[at], y = sums[at + 1], z = sums[at + 2], length = Math.sqrt(x * x + y * y + z * z);
      // Of a fold whose sides cancel each has its own.
      const scale = length > 1000 ? 32767 / length : 0;
      for (let k = 0; k < 3; ++k) {
        const value = scale > 0 ? Math.round(sums[at + k] * scale) : own[3 * i + k];
        if (array[3 * vertex + k] === value) continue;
        array[3 * vertex + k] = value;
        changed = true;
      }
    });
    if (changed) normals.needsUpdate = true;
  }

  #placeOf(key) {
    const known = this.places.get(key);
    if (known !== undefined) return known;
    const place = this.free.pop() ?? this.keys.length;
    this.places.set(key, place);
    this.keys[place] = key;
    this.counts[place] = 0;
    if (3 * place >= this.sums.length) {
      const larger = new Float32Array(2 * this.sums.length);
      larger.set(this.sums);
      this.sums = larger;
    }
    return place;
  }
}

/** 53 bits of a position's 96: where two are the same, which one in some million million is, a normal is a little wrong. */
function keyOf(bits, at) {
  let low = 0, high = 0;
  for (let k = 0; k < 3; ++k) {
    low = Math.imul(low ^ bits[at + k], 0x9e3779b1);
    low ^= low >>> 15;
    high = Math.imul(high ^ (bits[at + k] + low), 0x85ebca6b);
    high ^= high >>> 13;
  }
  return (low >>> 0) + (high & 0x1fffff) * 0x100000000;
}
