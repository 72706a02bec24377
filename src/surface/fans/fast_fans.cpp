// The loop that decodes nearly all fans. FanMachine says what symbols do; this does the same without
// branches.
#include "surface/fans/fast_fans.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include "base/bytes.h"

namespace maille {
namespace {

// Numbers of 32 bits are kept in 64: GCC 12 spills the two halves and reloads the whole, and a load that is
// wider than the stores before it stalls.
[[gnu::always_inline]] inline uint64_t pair_of(uint64_t low, uint64_t high) {
  return low | high << 32;
}

[[gnu::always_inline]] inline void store_one(VertexReferences& to, uint64_t f, uint64_t n, uint64_t o,
                                             uint64_t before, uint64_t last) {
  uint32_t* const at = to.at.data();
  store(at, pair_of(f, n));
  store(at + 2, pair_of(o, f));
  store(at + 4, pair_of(f, f));
  store(at + 6, pair_of(before, last));
}

/// Kinds of the three vertices of a fast symbol, one byte each, by the symbol and what the focus has seen.
constexpr auto fast_kinds = [] {
  std::array<std::array<uint32_t, most_seen + 1>, fast_fan_symbols> table{};
  for (unsigned symbol = 0; symbol < fast_fan_symbols; ++symbol) {
    const unsigned i = symbol & 3;
    for (unsigned seen = 0; seen <= most_seen; ++seen) {
      const unsigned then = std::min(seen + i + (symbol < fan_pocket ? 1 : 2), most_seen);
      for (unsigned j = 1; j <= i; ++j) table[symbol][seen] |= fan_kind(true, i, j, then) << (8 * (j - 1));
    }
  }
  return table;
}();

/// a where the mask is 0, b where it is all ones. Compilers make branches of conditions, and these would be
/// unpredictable.
[[gnu::always_inline]] inline uint64_t choose(uint64_t mask, uint64_t a, uint64_t b) {
#ifdef __EMSCRIPTEN__
  return mask == 0 ? a : b;  // there it has an instruction of its own
#else
  return a ^ ((a ^ b) & mask);
#endif
}

/// Entries as numbers: the vertex, above it the vertex beyond its gate, above that what it has seen.
constexpr uint64_t one_seen = uint64_t{1} << fan_point_bits;
constexpr uint64_t point_mask = most_fan_points - 1;
[[gnu::always_inline]] inline uint64_t vertex_in(uint64_t entry) {
  return entry & none;
}
/// Of an entry without its vertex, when it has seen more triangles.
[[gnu::always_inline]] inline uint64_t see(uint64_t rest, uint64_t triangles) {
  const uint64_t then = rest + triangles * one_seen;
  return then < (most_seen + 1) * one_seen ? then : (rest & point_mask) | most_seen * one_seen;
}

/// What the fast loop stores for a symbol. It always stores three new vertices, from v on, however many there
/// are: what is too much is overwritten by the next symbol, and no branch depends on the number. The fan lies
/// around f, from p on, towards `next` with `opposite` beyond the gate to it; `before` is beyond the gate
/// from p.
struct FastFan {
  uint64_t f, p, next, opposite, before, v;
};

#ifdef __SSE2__
[[gnu::always_inline]] inline __m128i word_of(uint64_t number) {
  return _mm_cvtsi32_si128(static_cast<int>(number));
}
template <unsigned a, unsigned b, unsigned c, unsigned d>
[[gnu::always_inline]] inline __m128i lanes_of(__m128i low, __m128i high) {
  return _mm_castps_si128(_mm_shuffle_ps(_mm_castsi128_ps(low), _mm_castsi128_ps(high),
                                         static_cast<int>(a | b << 2 | c << 4 | d << 6)));
}
template <class T>
[[gnu::always_inline]] inline void store_lanes(T* to, __m128i lanes) {
  _mm_storeu_si128(reinterpret_cast<__m128i*>(to), lanes);
}
/// `late`: of the vertex whose late triple this is, or of none.
[[gnu::always_inline]] inline void store_fan(const FastFan& fan, uint32_t* late, VertexReferences* references,
                                             uint32_t* corner, uint64_t* entries) {
  const __m128i f = _mm_shuffle_epi32(word_of(fan.f), 0);
  const __m128i v = _mm_add_epi32(_mm_shuffle_epi32(word_of(fan.v), 0), _mm_set_epi32(3, 2, 1, 0));
  const __m128i p = word_of(fan.p);
  const __m128i first = _mm_unpacklo_epi64(_mm_unpacklo_epi32(f, word_of(fan.next)),
                                           _mm_unpacklo_epi32(word_of(fan.opposite), f));
  _mm_storel_epi64(reinterpret_cast<__m128i*>(late), first);
  store(late + 2, static_cast<uint32_t>(fan.opposite));
  const __m128i along = _mm_unpacklo_epi64(_mm_unpacklo_epi32(word_of(fan.before), p), v);
  const __m128i second = lanes_of<0, 0, 1, 2>(f, along), third = lanes_of<0, 0, 2, 3>(f, along);
  store_lanes(&references[0].at[0], first);
  store_lanes(&references[0].at[4], lanes_of<0, 0, 0, 1>(f, along));
  store_lanes(&references[1].at[0], first);
  store_lanes(&references[1].at[4], second);
  store_lanes(&references[2].at[0], first);
  store_lanes(&references[2].at[4], third);
  // f, p, v and f, v, v + 1 and f, v + 1, v + 2.
  store_lanes(corner, _mm_shuffle_epi32(second, _MM_SHUFFLE(0, 3, 2, 0)));
  store_lanes(corner + 4, _mm_shuffle_epi32(third, _MM_SHUFFLE(3, 0, 3, 2)));
  corner[8] = static_cast<uint32_t>(fan.v + 2);
  const __m128i rest = _mm_shuffle_epi32(word_of(fan.f | 2 << fan_point_bits), 0);
  store_lanes(entries, _mm_unpacklo_epi32(v, rest));
  store_lanes(entries + 2, _mm_unpackhi_epi32(v, rest));
}
#else
inline void store_fan(const FastFan& fan, uint32_t* late, VertexReferences* references, uint32_t* corner,
                      uint64_t* entries) {
  const uint64_t v = fan.v;
  store(late, pair_of(fan.f, fan.next));
  store(late + 2, static_cast<uint32_t>(fan.opposite));
  store_one(references[0], fan.f, fan.next, fan.opposite, fan.before, fan.p);
  store_one(references[1], fan.f, fan.next, fan.opposite, fan.p, v);
  store_one(references[2], fan.f, fan.next, fan.opposite, v, v + 1);
  store(corner, pair_of(fan.f, fan.p));
  store(corner + 2, pair_of(v, fan.f));
  store(corner + 4, pair_of(v, v + 1));
  store(corner + 6, pair_of(fan.f, v + 1));
  store(corner + 8, static_cast<uint32_t>(v + 2));
  for (unsigned k = 0; k < 3; ++k) store(entries + k, pair_of(v + k, fan.f | 2 * one_seen));
}
#endif

/// What the fast loop keeps in registers: the ring, its head f and its last entry p, as their vertices and
/// the rest. (In the array the rest of the head is older.)
struct Cursor {
  uint64_t* head;
  uint64_t* tail;
  uint64_t f, f_rest;
  uint64_t p, p_rest;
  uint64_t v;  ///< the next new vertex
  uint32_t* corner;
};

/// Symbols that interrupt the fast loop only for a call: one in ten on irregular meshes, where a way out of
/// the loop to FanMachine::apply() and back would take more time than all other symbols together. This class
/// does the same to the ring as apply(), on the loop's registers. abominevole (a soup of triangles) 11.1 to
/// 13.0 M triangles/s, featuretype and cheese 4 % faster (43254c8).
class RareSymbols {
 public:
  /// Symbols of the fast loop that one of these counts for: at most eleven vertices, twelve triangles.
  static constexpr uint32_t steps = 4;
  enum class Outcome : uint8_t { done, left, damaged };

  RareSymbols(FanMachine<FanReader>& machine, FanReader& reader, FanSurface& out)
      : machine_(machine), reader_(reader), out_(out) {}

  /// `left`: nothing was done. Reads from reader.rans, which must be what the cursor stands for.
  [[gnu::noinline]] Outcome take(const FanSlots::EventTable& table, unsigned symbol, Cursor& at) {
    const auto room = static_cast<uint64_t>(machine_.entries.data() + machine_.entries.size() - at.tail);
    const auto size = static_cast<uint64_t>(at.tail - at.head);
    // Nothing is read yet: the machine reads these symbols again.
    if (symbol == fan_swallow || symbol == fan_merge || symbol == fan_marker) return Outcome::left;
    // A close on a marker. No other symbol of those below needs the next entry to be a vertex.
    if (symbol < fan_swallow && vertex_in(at.head[1]) == none) return Outcome::damaged;
    // A split copies some of the ring.
    if (symbol >= fan_split && symbol < fan_known && room < size + fast_room) return Outcome::left;
    StaticRansDecoder& rans = reader_.rans;
    rans.state = table.next(rans.state, symbol);
    rans.refill();
    if (symbol < fan_swallow) return close(symbol - fan_close_4 + 4, at);
    if (symbol < fan_split) return border(symbol - fan_border, at);
    if (symbol < fan_known) return split(symbol - fan_split, at);
    if (symbol == fan_known) return known(at);
    return open(symbol == fan_open ? 1 : 4, at);
  }

 private:
  static void add_triangle(Cursor& at, uint64_t third) {
    store(at.corner, pair_of(at.f, at.p));
    at.corner[2] = static_cast<uint32_t>(third);
    at.corner += 3;
  }
  /// The last entry, with one triangle more and the head beyond its gate.
  static void close_gate(Cursor& at) {
    at.p_rest = (see(at.p_rest, 1) & ~point_mask) | at.f;
    at.tail[-1] = pair_of(at.p, at.p_rest);
  }
  static void push(Cursor& at, uint64_t vertex, uint64_t across) {
    at.p = vertex;
    at.p_rest = across | one_seen;
    *at.tail++ = pair_of(at.p, at.p_rest);
  }
  static void look_at_ends(Cursor& at) {
    at.f = vertex_in(*at.head);
    at.f_rest = *at.head >> 32;
    at.p = vertex_in(at.tail[-1]);
    at.p_rest = at.tail[-1] >> 32;
  }

  void add_fan(unsigned i, Cursor& at) {
    const auto seen = static_cast<unsigned>(at.f_rest >> fan_point_bits);
    const unsigned seen_then = std::min(seen + i, most_seen);
    uint64_t before = at.p_rest & point_mask;
    for (unsigned j = 1; j <= i; ++j, ++at.v) {
      store_one(out_.references[at.v - out_.first], at.f, at.f, at.f, before, at.p);
      out_.kinds[at.v - out_.first] = static_cast<uint8_t>(fan_kind(false, i, j, seen_then));
      add_triangle(at, at.v);
      close_gate(at);
      before = at.p;
      push(at, at.v, at.f);
    }
    at.f_rest = see(at.f_rest, i);
  }
  void add_closing(uint64_t third, Cursor& at) {
    add_triangle(at, third);
    close_gate(at);
    at.f_rest = see(at.f_rest, 1);
  }

  Outcome close(unsigned i, Cursor& at) {
    const uint64_t n = vertex_in(at.head[1]), n_opposite = at.f_rest & point_mask;
    const auto seen = static_cast<unsigned>(at.f_rest >> fan_point_bits);
    const unsigned seen_then = std::min(seen + i + 1, most_seen);
    uint64_t before = at.p_rest & point_mask;
    for (unsigned j = 1; j <= i; ++j, ++at.v) {
      store_one(out_.references[at.v - out_.first], at.f, n, n_opposite, before, at.p);
      out_.kinds[at.v - out_.first] = static_cast<uint8_t>(fan_kind(true, i, j, seen_then));
      add_triangle(at, at.v);
      close_gate(at);
      before = at.p;
      push(at, at.v, at.f);
    }
    add_triangle(at, n);
    close_gate(at);
    ++at.head;
    at.f = n;
    at.f_rest = see(*at.head >> 32, 1);
    return Outcome::done;
  }

  Outcome border(unsigned i, Cursor& at) {
    add_fan(i, at);
    if (vertex_in(at.head[1]) != none) {
      *at.tail++ = none;
      *at.tail++ = pair_of(at.f, at.f_rest);
    }
    ++at.head;
    pass_markers(at);
    look_at_ends(at);
    return Outcome::done;
  }
  /// As FanMachine::prepare(); at most two entries are new, since there is no marker at the end then.
  static void pass_markers(Cursor& at) {
    while (at.tail - at.head >= least_fast_ring) {
      const bool marker = vertex_in(*at.head) == none;
      const bool after_marker = vertex_in(at.tail[-1]) == none;
      if (!marker && !after_marker) return;
      if (marker ? !after_marker : vertex_in(at.head[1]) != none) {
        const uint64_t head = *at.head;
        *at.tail++ = head;
      }
      ++at.head;
    }
  }

  Outcome open(unsigned i, Cursor& at) {
    add_fan(i, at);
    at.p_rest = (at.p_rest & ~point_mask) | vertex_in(at.tail[-2]);
    at.tail[-1] = pair_of(at.p, at.p_rest);
    return Outcome::done;
  }

  Outcome known(Cursor& at) {
    machine_.vertices = static_cast<uint32_t>(at.v);
    uint32_t vertex;
    if (!machine_.take_known(vertex)) return Outcome::damaged;
    const uint64_t last = at.p;
    add_closing(vertex, at);
    push(at, vertex, last);
    return Outcome::done;
  }

  Outcome split(unsigned i, Cursor& at) {
    add_fan(i, at);
    const auto most = static_cast<uint64_t>(at.tail - at.head - 4);
    const bool at_tail = reader_.number(FanNumber::side, 0) != 0;
    const uint64_t offset = reader_.number(at_tail ? FanNumber::split_tail : FanNumber::split_head, 0);
    if (offset > most || !machine_.spend(offset + 3)) return Outcome::damaged;
    uint64_t* const place = at_tail ? at.tail - 2 - offset : at.head + 2 + offset;
    const uint64_t vertex = vertex_in(*place);
    if (vertex == none) return Outcome::damaged;
    const uint64_t last = at.p;
    add_closing(vertex, at);
    *place = pair_of(vertex, see(*place >> 32, 1));
    *at.head = pair_of(at.f, at.f_rest);
    // The entry of m in the ring that goes on, or in that which waits, has the last vertex beyond its gate.
    const uint64_t joint = pair_of(vertex, (*place >> 32 & ~point_mask) | last);
    if (at_tail) {
      std::copy_backward(place, at.tail, at.tail + 1);
      *place = joint;
      ++at.tail;
      wait(at.head, place + 1);
      at.head = place + 1;
    } else {
      uint64_t* const end = std::copy(at.head, place, at.tail);
      *end = joint;
      wait(place, at.tail);
      at.head = at.tail;
      at.tail = end + 1;
    }
    look_at_ends(at);
    return Outcome::done;
  }
  void wait(const uint64_t* begin, const uint64_t* end) {
    const uint64_t* const entries = machine_.entries.data();
    machine_.waiting.push_back(
        {static_cast<uint32_t>(begin - entries), static_cast<uint32_t>(end - entries)});
  }

  FanMachine<FanReader>& machine_;
  FanReader& reader_;
  FanSurface& out_;
};

/// A step of the decoder. False, and nothing is done, where a word is needed and there is none.
[[gnu::always_inline]] inline bool take_symbol(const FanSlots::EventTable& table, unsigned symbol,
                                               uint64_t& state, StaticRansDecoder::Words& words) {
  uint64_t then = table.next(state, symbol);
  if (then < lowest_static_state) {
    if (words.end - words.next < 4) return false;
    then = then << 32 | load<uint32_t>(words.next);
    words.next += 4;
  }
  state = then;
  return true;
}

/// Of whole entries: where what they have seen begins, and the vertex beyond their gate.
constexpr unsigned seen_shift = 32 + fan_point_bits;
constexpr uint64_t seen_once = uint64_t{1} << seen_shift;
constexpr uint64_t across_mask = point_mask << 32;
constexpr uint64_t marker_bit = uint64_t{1} << 31;
[[gnu::always_inline]] inline uint64_t class_in(uint64_t entry) {
  return seen_class(static_cast<unsigned>(entry >> seen_shift));
}
/// The classes of two entries that are known early, by what they have seen.
constexpr auto far_classes = [] {
  std::array<uint8_t, 256> table{};
  for (unsigned i = 0; i < 256; ++i)
    table[i] = static_cast<uint8_t>(seen_class(i >> 4) << 2 | seen_class(i & 15));
  return table;
}();
/// An entry that has seen more triangles. Hardly ever so many that it cannot count them.
[[gnu::always_inline]] inline uint64_t see_more(uint64_t entry, uint64_t more) {
  uint64_t then;
  if (__builtin_add_overflow(entry, more, &then)) [[unlikely]]
    return entry | most_seen * seen_once;
  return then;
}

}  // namespace

bool run_fast(FanMachine<FanReader>& machine, FanReader& reader, FanSurface& out) {
  machine.make_room(fast_room);
  // A symbol pushes at most three entries, and makes at most five triangles (a pocket of three new vertices),
  // so neither needs a test in the loop.
  uint32_t steps = std::min(fast_room / 3 - 2, machine.triangles_left() / 5);
  const uint64_t vertices_end = uint64_t{machine.vertices} + machine.vertices_left();
  const FanSlots& slots = reader.slots;
  VertexReferences* const references = out.references.data();
  uint8_t* const kinds = out.kinds.data();
  const uint64_t first = out.first;
  // A place to which late triples of no vertex are written.
  const uint64_t nowhere = out.references.size() - 1;
  uint32_t* corner = out.corners.data() + size_t{3} * machine.triangle_count;
  // In locals, so that they stay in registers: few, as WebAssembly has no more of them than it needs itself.
  uint64_t state = reader.rans.state;
  StaticRansDecoder::Words words = reader.rans.words;
  uint64_t* head = machine.entries.data() + machine.head;
  uint64_t* tail = machine.entries.data() + machine.tail;
  uint64_t v = machine.vertices;
  uint64_t f_entry = *head, p_entry = tail[-1];
  uint64_t markers = 0;
  RareSymbols rare(machine, reader, out);
  for (; steps > 0 && tail - head >= least_fast_ring; --steps) {
    const uint64_t n_entry = head[1], m_entry = head[2];
    const FanSlots::EventTable& table =
        slots.table_of(f_entry >> seen_shift << 8 | class_in(n_entry) << 6 | class_in(p_entry) << 4 |
                       far_classes[(m_entry >> (seen_shift - 4) & 0xf0) | tail[-2] >> seen_shift]);
    const unsigned symbol = table.symbol(state);
    const uint64_t f = vertex_in(f_entry), p = vertex_in(p_entry);
    if (symbol >= fast_fan_symbols) [[unlikely]] {
      const uint64_t before_last = vertex_in(tail[-2]);
      // A rare symbol counts for four steps; the fifth keeps the subtraction from wrapping.
      if (steps < 5 || (symbol == fan_swallow && before_last == none)) break;
      if (symbol == fan_swallow) {
        if (!take_symbol(table, symbol, state, words)) break;
        store(corner, pair_of(f, p));
        corner[2] = static_cast<uint32_t>(before_last);
        corner += 3;
        --tail;
        f_entry = see_more(f_entry, seen_once);
        p_entry = (see_more(tail[-1], seen_once) & ~across_mask) | p << 32;
        tail[-1] = p_entry;
        continue;
      }
      reader.rans.state = state;
      reader.rans.words = words;
      Cursor at{head, tail, f, f_entry >> 32, p, p_entry >> 32, v, corner};
      const RareSymbols::Outcome outcome = rare.take(table, symbol, at);
      if (outcome == RareSymbols::Outcome::damaged) return false;
      if (outcome == RareSymbols::Outcome::left) break;
      head = at.head, tail = at.tail;
      f_entry = pair_of(at.f, at.f_rest), p_entry = pair_of(at.p, at.p_rest);
      v = at.v;
      corner = at.corner;
      state = reader.rans.state;
      words = reader.rans.words;
      steps -= RareSymbols::steps - 1;
      continue;
    }
    if (!take_symbol(table, symbol, state, words)) break;
    const uint64_t i = symbol & 3;
    const uint64_t pocket = symbol >> 2;
    const uint64_t is_pocket = 0 - pocket;
    const uint64_t n = vertex_in(n_entry), m = vertex_in(m_entry);
    const uint64_t next_entry = choose(is_pocket, n_entry, m_entry);
    const uint64_t next = vertex_in(next_entry);
    const uint64_t next_opposite = choose(is_pocket, f_entry >> 32 & point_mask, n);
    // A marker's vertex is none, with bit 31 set, which no vertex has (most_fan_points): whether one was
    // taken for a vertex is asked once, behind the loop. Until then it does no harm, as vertices are only
    // stored here.
    markers |= n_entry | next_entry;

    // The vertex before gets a late triple if this symbol has no new ones and it is the newest; else nowhere
    // does.
    const uint64_t differs = i | (p + 1 - v) | static_cast<uint64_t>(next_opposite == p);
    const uint64_t at = choose(0 - static_cast<uint64_t>(differs == 0), nowhere, p - first);
    kinds[at] |= 1;
    store_fan({f, p, next, next_opposite, p_entry >> 32 & point_mask, v},
              references[at].at.data() + VertexReferences::late, references + (v - first), corner, tail);
    store(kinds + (v - first), fast_kinds[symbol][f_entry >> seen_shift]);

    // Entries have the focus beyond their gates now; the last one has seen a triangle more.
    const uint64_t p_then = (see_more(p_entry, seen_once) & ~across_mask) | f << 32;
    tail[-1] = p_then;
    p_entry = choose(0 - ((i + 3) >> 2), p_then, pair_of(v + i - 1, f) + 2 * seen_once);
    corner += 3 * i;
    store(corner, pair_of(f, p_entry));
    store(corner + 2, pair_of(next, f));
    store(corner + 4, pair_of(m, n));
    corner += 3 + 3 * pocket;
    tail += i;
    v += i;
    head += 1 + pocket;
    f_entry = see_more(next_entry, seen_once << pocket);
  }
  *head = f_entry;
  reader.rans.state = state;
  reader.rans.words = words;
  machine.head = static_cast<uint32_t>(head - machine.entries.data());
  machine.tail = static_cast<uint32_t>(tail - machine.entries.data());
  machine.vertices = static_cast<uint32_t>(v);
  machine.triangle_count = static_cast<uint32_t>((corner - out.corners.data()) / 3);
  // There is room for too many vertices, which are found out here.
  return (markers & marker_bit) == 0 && v <= vertices_end;
}

}  // namespace maille
