#include "surface/fan_connectivity.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include <memory>
#include <string>

#include "base/bytes.h"
#include "base/large_pages.h"
#include "base/result.h"
#include "entropy/static_rans.h"
#include "surface/fan_machine.h"

namespace maille {
namespace {

constexpr unsigned slot_bits = 9;
constexpr uint32_t slots_per_table = 1 << slot_bits;
constexpr unsigned most_event_tables = 16;
constexpr auto number_contexts = static_cast<unsigned>(FanNumber::count);
// A number below 12 is its symbol; then come the number of bits, from 4 on, and the bits below the highest.
constexpr unsigned direct_numbers = 12;
constexpr unsigned number_symbols = direct_numbers + 29;

unsigned next_corner(uint32_t h) {
  return h % 3 == 2 ? h - 2 : h + 1;
}
unsigned previous_corner(uint32_t h) {
  return h % 3 == 0 ? h + 2 : h - 1;
}

/// The encoder's side of a FanMachine: knows the mesh, finds the symbols, notes what is coded.
class FanFinder {
 public:
  static constexpr bool encoding = true;
  using Machine = FanMachine<FanFinder>;

  FanFinder(const HalfEdges& edges, uint32_t real_half_edges, uint32_t points)
      : edges_(edges),
        real_(real_half_edges),
        coded_(real_half_edges / 3),
        number_of_(points, none),
        place_of_(real_half_edges, none) {}

  struct Operation {
    uint16_t context;  ///< of an event; fan_contexts + n for numbers
    uint16_t symbol;
    uint32_t bits;  ///< raw ones
    uint8_t bit_count;
  };

  EncodedFans run() {
    EncodedFans result;
    const uint32_t triangles = real_ / 3;
    result.surface.corners.resize(real_);
    result.surface.references.resize(number_of_.size());
    result.surface.kinds.resize(number_of_.size());
    Machine machine(*this, result.surface, triangles, static_cast<uint32_t>(number_of_.size()));
    machine_ = &machine;
    while (!machine.done()) {
      if (machine.prepare()) {
        const unsigned symbol = choose();
        operations_.push_back(
            {static_cast<uint16_t>(machine.context()), static_cast<uint16_t>(symbol), 0, 0});
        machine.apply(symbol);
      } else {
        choose_start();
        machine.start();
      }
    }
    result.surface.vertices = machine.vertices;
    result.surface.references.resize(machine.vertices);
    result.surface.kinds.resize(machine.vertices);
    result.points = std::move(points_);
    result.half_edges = std::move(half_edges_);
    return result;
  }
  const std::vector<Operation>& operations() const { return operations_; }

  // What the machine calls.
  uint32_t number(FanNumber kind, uint32_t, uint32_t base = 0) {
    const uint32_t value = numbers_[next_number_++];
    uint32_t coded = value;
    if (kind == FanNumber::reference) {
      const uint32_t delta = value - base;
      coded = delta << 1 ^ (0 - (delta >> 31));
    }
    Operation operation{static_cast<uint16_t>(fan_contexts + static_cast<unsigned>(kind)), 0, 0, 0};
    if (coded < direct_numbers) {
      operation.symbol = static_cast<uint16_t>(coded);
    } else {
      const unsigned length = 32 - static_cast<unsigned>(__builtin_clz(coded));
      operation.symbol = static_cast<uint16_t>(direct_numbers + length - 4);
      operation.bit_count = static_cast<uint8_t>(length - 1);
      operation.bits = coded - (1u << (length - 1));
    }
    operations_.push_back(operation);
    return kind == FanNumber::reference ? coded : value;
  }
  void moved(uint32_t to, uint32_t from) { set_gate(to, gate(from)); }
  void no_gate(uint32_t entry) { set_gate(entry, none); }
  /// The gate on the edge from the vertex before to the new one of the k-th triangle (from 1), or back from
  /// there to the focus.
  void gate_along(uint32_t entry, unsigned k) { set_gate(entry, edges_.opposite[next_corner(fan_[k - 1])]); }
  void gate_back(uint32_t entry, unsigned k) {
    set_gate(entry, edges_.opposite[previous_corner(fan_[k - 1])]);
  }
  void gates_of_start(uint32_t entry) {
    for (uint32_t k = 0; k < 3; ++k) set_gate(entry + k, edges_.opposite[fan_[0] + k]);
  }

 private:
  static constexpr unsigned longest_fan = 16;

  uint32_t gate(uint32_t entry) const { return entry < gates_.size() ? gates_[entry] : none; }
  void set_gate(uint32_t entry, uint32_t h) {
    if (entry >= gates_.size()) gates_.resize(std::max<size_t>(2 * gates_.size(), entry + size_t{1}), none);
    gates_[entry] = h;
    if (h < real_) place_of_[h] = entry;
  }
  bool is_uncoded(uint32_t h) const { return h < real_ && coded_[h / 3] == 0; }

  struct Place {
    uint32_t entry = none;
    uint32_t ring = none;  ///< among those that wait; none: the ring at hand
  };
  /// Where entry `e` with gate h is, if it is still in use.
  Place place_of_gate(uint32_t h) const {
    const uint32_t e = place_of_[h];
    if (e == none || gate(e) != h) return {};
    if (e >= machine_->head && e < machine_->tail) return {e, none};
    const auto& waiting = machine_->waiting;
    const auto above = std::upper_bound(waiting.begin(), waiting.end(), e,
                                        [](uint32_t x, const Machine::Ring& ring) { return x < ring.begin; });
    if (above == waiting.begin() || e >= (above - 1)->end) return {};
    return {e, static_cast<uint32_t>(above - 1 - waiting.begin())};
  }
  Place following(Place place) const {
    const uint32_t end = place.ring == none ? machine_->tail : machine_->waiting[place.ring].end;
    const uint32_t begin = place.ring == none ? machine_->head : machine_->waiting[place.ring].begin;
    return {place.entry + 1 == end ? begin : place.entry + 1, place.ring};
  }
  /// The entry of the apex of the triangle whose half-edge g is the gate: found by turning round the apex to
  /// a gate, through triangles that are not coded.
  Place find_apex(uint32_t g) const {
    const uint32_t along = next_corner(g);
    const uint32_t back = previous_corner(g);
    const uint32_t number = number_of_[edges_.origin[back]];
    uint32_t x = along;
    while (is_uncoded(edges_.opposite[x]) && edges_.opposite[x] / 3 != g / 3)
      x = previous_corner(edges_.opposite[x]);
    Place place = place_of_gate(x);
    if (place.entry != none && machine_->vertex(place.entry) == number) return place;
    x = back;
    while (is_uncoded(edges_.opposite[x]) && edges_.opposite[x] / 3 != g / 3)
      x = next_corner(edges_.opposite[x]);
    place = place_of_gate(x);
    if (place.entry == none) return {};
    place = following(place);
    return machine_->vertex(place.entry) == number ? place : Place{};
  }

  unsigned choose() {
    numbers_.clear();
    next_number_ = 0;
    fan_.clear();
    const uint32_t first_number = machine_->vertices;
    uint32_t g = gate(machine_->tail - 1);
    unsigned symbol = fan_open_4;
    for (;;) {
      const auto i = static_cast<unsigned>(fan_.size());
      if (i == longest_fan) break;
      if (!is_uncoded(g)) {
        symbol = limited(fan_border, i, most_border);
        break;
      }
      const uint32_t back = previous_corner(g);
      const uint32_t apex = edges_.origin[back];
      if (machine_->vertex(machine_->head + 1) != none && back == gate(machine_->head)) {
        fan_.push_back(g);
        symbol = i <= 3 ? fan_close + i : i <= most_closed ? fan_close_4 + i - 4 : fan_open_4;
        break;
      }
      if (number_of_[apex] != none) {
        symbol = choose_known(g, i);
        break;
      }
      fan_.push_back(g);
      coded_[g / 3] = 1;
      number_of_[apex] = first_number + i;
      g = edges_.opposite[back];
    }
    commit(symbol, first_number);
    return symbol;
  }

  /// Not too many new vertices for this symbol, else a symbol that takes some of them first.
  static unsigned limited(unsigned symbol, unsigned i, unsigned most) {
    if (i <= most) return symbol + i;
    return i >= 4 ? fan_open_4 : fan_open;
  }

  unsigned choose_known(uint32_t g, unsigned i) {
    const Machine& ring = *machine_;
    const Place place = find_apex(g);
    const uint32_t end = ring.tail + i;  // with the new vertices
    const uint32_t back = previous_corner(g);
    const uint32_t beyond = edges_.opposite[back];
    if (place.entry == none) return choose_lost(g, i);
    if (place.ring != none) {
      if (i > 0) return limited(0, i, 0);
      const Machine::Ring& other = ring.waiting[place.ring];
      const auto from_top = static_cast<uint32_t>(ring.waiting.size() - 1 - place.ring);
      if (uint64_t{other.end - other.begin} + from_top + 1 > ring.moves_left()) return choose_lost(g, i);
      numbers_ = {from_top, place.entry - other.begin};
      fan_.push_back(g);
      return fan_merge;
    }
    if (place.entry == ring.head + 2 && end >= ring.head + 4 && i <= 3 &&
        ring.vertex(ring.head + 1) != none && is_uncoded(beyond) && beyond / 3 != g / 3 &&
        previous_corner(beyond) == gate(ring.head) && next_corner(beyond) == gate(ring.head + 1)) {
      fan_.push_back(g);
      fan_.push_back(beyond);
      return fan_pocket + i;
    }
    if (i == 0 && ring.tail - ring.head >= 3 && place.entry == ring.tail - 2 &&
        next_corner(g) == gate(ring.tail - 2)) {
      fan_.push_back(g);
      return fan_swallow;
    }
    if (place.entry < ring.head + 2 || place.entry + 2 > end || end < ring.head + 4) return choose_lost(g, i);
    if (i > most_split) return fan_open_4;
    const uint32_t ahead = place.entry - ring.head - 2;
    const uint32_t behind = end - 2 - place.entry;
    if (uint64_t{std::min(ahead, behind)} + 3 > ring.moves_left()) return choose_lost(g, i);
    if (behind < ahead) {
      numbers_ = {1, behind};
    } else {
      numbers_ = {0, ahead};
    }
    fan_.push_back(g);
    return fan_split + i;
  }
  /// A vertex that is known, but that no ring leads to.
  unsigned choose_lost(uint32_t g, unsigned i) {
    if (i > 0) return limited(0, i, 0);
    numbers_ = {number_of_[edges_.origin[previous_corner(g)]]};
    fan_.push_back(g);
    return fan_known;
  }

  static unsigned new_vertices(unsigned symbol) {
    if (symbol < fan_close_4) return symbol % 4;
    if (symbol < fan_swallow) return symbol - fan_close_4 + 4;
    if (symbol >= fan_border && symbol < fan_split) return symbol - fan_border;
    if (symbol >= fan_split && symbol < fan_known) return symbol - fan_split;
    return symbol == fan_open ? 1 : symbol == fan_open_4 ? 4 : 0;
  }

  /// Keeps of the fan that was looked at what the symbol codes.
  void commit(unsigned symbol, uint32_t first_number) {
    const unsigned i = new_vertices(symbol);
    for (size_t k = i; k < fan_.size(); ++k) {
      const uint32_t apex = edges_.origin[previous_corner(fan_[k])];
      if (number_of_[apex] >= first_number + i) number_of_[apex] = none;
      coded_[fan_[k] / 3] = 0;
    }
    for (size_t k = 0; k < i; ++k) points_.push_back(edges_.origin[previous_corner(fan_[k])]);
    if (symbol == fan_open || symbol == fan_open_4) fan_.resize(i);
    for (const uint32_t g : fan_) {
      coded_[g / 3] = 1;
      half_edges_.push_back(g);
    }
  }

  void choose_start() {
    numbers_.clear();
    next_number_ = 0;
    while (coded_[next_face_] != 0) ++next_face_;
    fan_ = {3 * next_face_};
    coded_[next_face_] = 1;
    half_edges_.push_back(3 * next_face_);
    numbers_.push_back(0);
    uint32_t next = machine_->vertices;
    for (unsigned k = 0; k < 3; ++k) {
      const uint32_t point = edges_.origin[3 * next_face_ + k];
      if (number_of_[point] != none) {
        numbers_[0] |= 1u << k;
        numbers_.push_back(number_of_[point]);
      } else {
        number_of_[point] = next++;
        points_.push_back(point);
      }
    }
  }

  const HalfEdges& edges_;
  uint32_t real_;
  std::vector<uint8_t> coded_;       // by face
  std::vector<uint32_t> number_of_;  // by point: its vertex
  std::vector<uint32_t> place_of_;   // by half-edge: the entry whose gate it was last
  std::vector<uint32_t> gates_;      // by entry: the half-edge beyond the edge to the next entry
  std::vector<uint32_t> fan_;        // gates of the triangles of the symbol at hand
  std::vector<uint32_t> numbers_;
  size_t next_number_ = 0;
  uint32_t next_face_ = 0;
  std::vector<uint32_t> points_;
  std::vector<uint32_t> half_edges_;
  std::vector<Operation> operations_;
  Machine* machine_ = nullptr;
};

std::vector<std::byte> write_operations(const std::vector<FanFinder::Operation>& operations,
                                        uint32_t vertices) {
  std::vector<Histogram> events(fan_contexts), numbers(number_contexts);
  for (const auto& operation : operations) {
    if (operation.context < fan_contexts) {
      ++events[operation.context][operation.symbol];
    } else {
      ++numbers[operation.context - fan_contexts][operation.symbol];
    }
  }
  RansEncoder side;
  const StaticTables event_tables = make_tables(events, fan_symbols, slot_bits, most_event_tables, side);
  const StaticTables number_tables = make_tables(numbers, number_symbols, slot_bits, number_contexts, side);
  StaticRansEncoder encoder;
  for (const auto& operation : operations) {
    if (operation.context < fan_contexts) {
      encoder.put(event_tables.of(operation.context), slot_bits, operation.symbol);
      continue;
    }
    encoder.put(number_tables.of(operation.context - fan_contexts), slot_bits, operation.symbol);
    const unsigned low = std::min<unsigned>(operation.bit_count, 16);
    encoder.put_raw(operation.bits & ((1u << low) - 1), low);
    if (operation.bit_count > 16) encoder.put_raw(operation.bits >> 16, operation.bit_count - 16u);
  }
  ByteWriter out;
  out.put_count(vertices);
  const auto tables = side.finish();
  out.put_count(tables.size());
  out.put_bytes(tables);
  out.put_bytes(encoder.finish());
  return out.take();
}

/// The context by what the head (lowest bits), the next and the last entry have seen, four bits each.
constexpr unsigned idle_context = fan_contexts;
const auto packed_contexts = [] {
  std::array<uint8_t, 1 << 12> contexts{};
  for (unsigned i = 0; i < contexts.size(); ++i) {
    contexts[i] =
        static_cast<uint8_t>((i & 15) == 0 ? idle_context : fan_context(i & 15, i >> 4 & 15, i >> 8));
  }
  return contexts;
}();

/// The decoder's side of a FanMachine.
class FanReader {
 public:
  static constexpr bool encoding = false;

  FanReader(Bytes events, const StaticTables& event_tables, const StaticTables& number_tables)
      : rans(events), number_tables_(number_tables) {
    event_slots.resize((event_tables.tables.size() + 1) * slots_per_table);
    for (size_t i = 0; i < event_tables.tables.size(); ++i)
      fill_slots(event_tables.tables[i], slot_bits, {}, &event_slots[i * slots_per_table]);
    // A table that changes nothing: so that a marker at the head is found without a test.
    const size_t idle = event_tables.tables.size() * slots_per_table;
    for (uint32_t i = 0; i < slots_per_table; ++i)
      event_slots[idle + i] = fan_marker | slots_per_table << 9 | i << 20;
    number_slots_.resize(number_tables.tables.size() * slots_per_table);
    for (size_t i = 0; i < number_tables.tables.size(); ++i)
      fill_slots(number_tables.tables[i], slot_bits, {}, &number_slots_[i * slots_per_table]);
    std::array<uint32_t, fan_contexts + 1> first_slot;
    for (unsigned c = 0; c < fan_contexts; ++c) first_slot[c] = event_tables.table_of[c] * slots_per_table;
    first_slot[idle_context] = static_cast<uint32_t>(idle);
    for (size_t i = 0; i < table_at.size(); ++i) table_at[i] = first_slot[packed_contexts[i]];
  }

  uint32_t number(FanNumber kind, uint32_t, uint32_t = 0) {
    const size_t table = number_tables_.table_of[static_cast<unsigned>(kind)];
    const unsigned symbol = slot_symbol(rans.get(&number_slots_[table * slots_per_table], slot_bits));
    if (symbol < direct_numbers) return symbol;
    const unsigned count = symbol - direct_numbers + 3;
    const unsigned low = std::min(count, 16u);
    uint32_t bits = rans.get_raw(low);
    if (count > 16) bits |= rans.get_raw(count - 16) << 16;
    return (1u << count) + bits;
  }

  StaticRansDecoder rans;
  std::vector<StaticSlot> event_slots;
  std::array<uint32_t, 1 << 12> table_at;  ///< first slot, by what head, next and last have seen, 4 bits each

 private:
  const StaticTables& number_tables_;
  std::vector<StaticSlot> number_slots_;
};

/// Entries that the fast loop may write behind the ring before it looks for room again.
constexpr uint32_t fast_room = 1 << 9;
/// Vertices that are decoded beyond those asked for, at most; a slow symbol has up to 11.
constexpr uint32_t fast_vertices = fast_room + 16;
/// What it writes beyond what there is, harmlessly: vertices, and corners.
constexpr size_t spare_vertices = 4;

// Numbers of 32 bits are kept in 64: GCC 12 spills the halves and reloads the whole, which stalls.
[[gnu::always_inline]] inline uint64_t pair_of(uint64_t low, uint64_t high) {
  return low | high << 32;
}

#ifdef __SSE2__
[[gnu::always_inline]] inline void store_references(VertexReferences& to, __m128i first, uint64_t ff,
                                                    uint64_t before_last) {
  _mm_storeu_si128(reinterpret_cast<__m128i*>(to.at.data()), first);
  _mm_storeu_si128(reinterpret_cast<__m128i*>(to.at.data()) + 1,
                   _mm_set_epi64x(static_cast<int64_t>(before_last), static_cast<int64_t>(ff)));
}
#else
inline void store_references(VertexReferences& to, std::array<uint64_t, 2> first, uint64_t ff,
                             uint64_t before_last) {
  store(to.at.data(), first);
  store(to.at.data() + 4, ff);
  store(to.at.data() + 6, before_last);
}
#endif
/// References of three new vertices of a fan from v on.
[[gnu::always_inline]] inline void store_fan(VertexReferences* to, uint64_t f, uint64_t n, uint64_t o,
                                             uint64_t before, uint64_t last, uint64_t v) {
#ifdef __SSE2__
  const __m128i first =
      _mm_set_epi64x(static_cast<int64_t>(pair_of(o, f)), static_cast<int64_t>(pair_of(f, n)));
#else
  const std::array<uint64_t, 2> first{pair_of(f, n), pair_of(o, f)};
#endif
  const uint64_t ff = pair_of(f, f);
  store_references(to[0], first, ff, pair_of(before, last));
  store_references(to[1], first, ff, pair_of(last, v));
  store_references(to[2], first, ff, pair_of(v, v + 1));
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
  return a ^ ((a ^ b) & mask);
}

/// The symbols close and pocket with at most three new vertices, as long as they come: nine in ten, without
/// branches; close with more, and swallow, in between. What FanMachine::apply() does for them. False: a
/// marker was taken for a vertex.
bool run_fast(FanMachine<FanReader>& machine, FanReader& reader, FanSurface& out) {
  machine.make_room(fast_room);
  uint32_t steps = std::min({fast_room / 3 - 2, machine.vertices_left() / 3, machine.triangles_left() / 5});
  const StaticSlot* const slots = reader.event_slots.data();
  const uint32_t* const table_at = reader.table_at.data();
  VertexReferences* const references = out.references.data();
  uint8_t* const kinds = out.kinds.data();
  const uint64_t first = out.first;
  uint32_t* corner = out.corners.data() + size_t{3} * machine.triangle_count;
  const uint64_t nowhere = out.references.size() - 1;
  constexpr uint64_t one_seen = uint64_t{1} << fan_point_bits;
  constexpr uint64_t point_mask = most_fan_points - 1;
  // Entries as numbers: the vertex, above it the vertex beyond its gate, above that what it has seen.
  const auto vertex_in = [](uint64_t entry) { return entry & none; };
  const auto see = [](uint64_t rest, uint64_t triangles) {
    const uint64_t then = rest + triangles * one_seen;
    return then < (most_seen + 1) * one_seen ? then : (rest & point_mask) | most_seen * one_seen;
  };

  // In locals, so that they stay in registers.
  uint64_t state = reader.rans.state;
  StaticRansDecoder::Words words = reader.rans.words;
  uint64_t* head = machine.entries.data() + machine.head;
  uint64_t* tail = machine.entries.data() + machine.tail;
  uint64_t v = machine.vertices;
  uint64_t f = vertex_in(*head), f_rest = *head >> 32;
  uint64_t p = vertex_in(tail[-1]), p_rest = tail[-1] >> 32;
  uint64_t markers = 0;
  for (; steps > 0 && tail - head > 4 && words.end - words.next >= 4; --steps) {
    const uint64_t n_entry = head[1];
    const uint64_t f_seen = f_rest >> fan_point_bits;
    const uint64_t context = f_seen | n_entry >> (32 + fan_point_bits) << 4 | p_rest >> fan_point_bits << 8;
    const StaticSlot slot = slots[table_at[context] + (state & (slots_per_table - 1))];
    const uint64_t symbol = slot_symbol(slot);
    if (symbol >= fast_fan_symbols) [[unlikely]] {
      const uint64_t before_last = vertex_in(tail[-2]);
      if (symbol > fan_swallow || before_last == none || steps < 5) break;
      state = slot_frequency(slot) * (state >> slot_bits) + slot_offset(slot);
      if (state < lowest_static_state) {
        state = state << 32 | load<uint32_t>(words.next);
        words.next += 4;
      }
      if (symbol == fan_swallow) {
        store(corner, pair_of(f, p));
        store(corner + 2, static_cast<uint32_t>(before_last));
        corner += 3;
        --tail;
        f_rest = see(f_rest, 1);
        p_rest = (see(tail[-1] >> 32, 1) & ~point_mask) | p;
        p = before_last;
        tail[-1] = pair_of(p, p_rest);
        continue;
      }
      const auto i = static_cast<unsigned>(symbol - fan_close_4 + 4);
      const uint64_t n = vertex_in(n_entry);
      markers |= n;
      const auto then = static_cast<unsigned>(std::min<uint64_t>(f_seen + i + 1, most_seen));
      uint64_t before = p_rest & point_mask;
      tail[-1] = pair_of(p, (see(p_rest, 1) & ~point_mask) | f);
      for (unsigned j = 1; j <= i; ++j, ++v) {
        store_one(references[v - first], f, n, f_rest & point_mask, before, p);
        kinds[v - first] = static_cast<uint8_t>(fan_kind(true, i, j, then));
        store(corner, pair_of(f, p));
        store(corner + 2, static_cast<uint32_t>(v));
        corner += 3;
        *tail++ = pair_of(v, f | 2 * one_seen);
        before = p;
        p = v;
      }
      store(corner, pair_of(f, p));
      store(corner + 2, static_cast<uint32_t>(n));
      corner += 3;
      p_rest = f | 2 * one_seen;
      ++head;
      f = n;
      f_rest = see(*head >> 32, 1);
      // Eleven vertices at most, twelve triangles.
      steps -= 3;
      continue;
    }
    state = slot_frequency(slot) * (state >> slot_bits) + slot_offset(slot);
    if (state < lowest_static_state) {
      state = state << 32 | load<uint32_t>(words.next);
      words.next += 4;
    }
    const uint64_t i = symbol & 3;
    const uint64_t has_new = 0 - ((i + 3) >> 2);
    const uint64_t pocket = symbol >> 2;
    const uint64_t is_pocket = 0 - pocket;
    const uint64_t n = vertex_in(n_entry);
    const uint64_t m = vertex_in(head[2]);
    const uint64_t next = choose(is_pocket, n, m);
    const uint64_t next_opposite = choose(is_pocket, f_rest & point_mask, n);
    markers |= n | next;

    // A late triple for the vertex before, or for none.
    const uint64_t differs = (has_new & 1) | (p + 1 - v) | static_cast<uint64_t>(next_opposite == p);
    const uint64_t late = choose(0 - static_cast<uint64_t>(differs == 0), nowhere, p - first);
    uint32_t* const triple = references[late].at.data() + VertexReferences::late;
    store(triple, pair_of(f, next));
    store(triple + 2, static_cast<uint32_t>(next_opposite));
    kinds[late] |= 1;

    store_fan(references + (v - first), f, next, next_opposite, p_rest & point_mask, p, v);
    store(kinds + (v - first), fast_kinds[symbol][f_seen]);
    store(corner, pair_of(f, p));
    store(corner + 2, pair_of(v, f));
    store(corner + 4, pair_of(v, v + 1));
    store(corner + 6, pair_of(f, v + 1));
    store(corner + 8, static_cast<uint32_t>(v + 2));
    corner += 3 * i;
    const uint64_t last = choose(has_new, p, v + i - 1);
    store(corner, pair_of(f, last));
    store(corner + 2, static_cast<uint32_t>(next));
    store(corner + 3, pair_of(f, m));
    store(corner + 5, static_cast<uint32_t>(n));
    corner += 3 + 3 * pocket;

    // Entries have the focus beyond their gates now; the last one has seen a triangle more.
    const uint64_t p_then = (see(p_rest, 1) & ~point_mask) | f;
    const uint64_t rest = f | 2 * one_seen;
    tail[-1] = pair_of(p, p_then);
    tail[0] = pair_of(v, rest);
    tail[1] = pair_of(v + 1, rest);
    tail[2] = pair_of(v + 2, rest);
    tail += i;
    v += i;
    p = last;
    p_rest = choose(has_new, p_then, rest);
    head += 1 + pocket;
    f = next;
    // One triangle more for a next vertex, two for one beyond.
    f_rest = see(*head >> 32, 1 + pocket);
  }
  *head = pair_of(vertex_in(*head), f_rest);
  reader.rans.state = state;
  reader.rans.words = words;
  machine.head = static_cast<uint32_t>(head - machine.entries.data());
  machine.tail = static_cast<uint32_t>(tail - machine.entries.data());
  machine.vertices = static_cast<uint32_t>(v);
  machine.triangle_count = static_cast<uint32_t>((corner - out.corners.data()) / 3);
  return (markers >> 31) == 0;
}

tl::unexpected<Error> corrupt(const char* what) {
  return failure(ErrorCode::corrupt, std::string("topology: ") + what);
}

}  // namespace

EncodedFans encode_fans(const HalfEdges& surface, uint32_t real_half_edges, uint32_t point_count) {
  FanFinder finder(surface, real_half_edges, point_count);
  EncodedFans result = finder.run();
  result.bytes = write_operations(finder.operations(), result.surface.vertices);
  return result;
}

struct FanDecoder::State {
  State(Bytes events, StaticTables event_tables, StaticTables numbers, uint32_t triangles, uint32_t vertices)
      : number_tables(std::move(numbers)),
        reader(events, event_tables, number_tables),
        vertex_count(vertices),
        machine(reader, surface, triangles, vertices) {
    reserve_on_large_pages(surface.corners, size_t{3} * triangles);
    surface.corners.resize(size_t{3} * triangles);
    surface.references.resize(window + fast_vertices + spare_vertices);
    surface.kinds.resize(window + fast_vertices + spare_vertices);
    surface.kinds.back() = 0;
  }

  Result<> step();

  StaticTables number_tables;
  FanReader reader;
  uint32_t vertex_count;
  FanSurface surface;
  FanMachine<FanReader> machine;
};

/// As many symbols as the fast loop takes, and one more.
Result<> FanDecoder::State::step() {
  if (!machine.prepare()) {
    if (!machine.start()) return corrupt("a component begins with a vertex that is not there");
    if (reader.rans.exhausted()) return corrupt("the fans end early");
    return {};
  }
  if (!run_fast(machine, reader, surface)) return corrupt("a fan that ends at a border");
  if (machine.done() || !machine.prepare()) return {};
  const uint32_t table = reader.table_at[machine.seen(machine.head) | machine.seen(machine.head + 1) << 4 |
                                         machine.seen(machine.tail - 1) << 8];
  const unsigned symbol = slot_symbol(reader.rans.get(&reader.event_slots[table], slot_bits));
  if (!machine.apply(symbol)) return corrupt("a fan that cannot be completed");
  if (reader.rans.exhausted()) return corrupt("the fans end early");
  return {};
}

FanDecoder::FanDecoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
FanDecoder::FanDecoder(FanDecoder&&) noexcept = default;
FanDecoder& FanDecoder::operator=(FanDecoder&&) noexcept = default;
FanDecoder::~FanDecoder() = default;

Result<FanDecoder> FanDecoder::begin(Bytes bytes, uint32_t triangles, uint32_t most_vertices) {
  ByteReader in(bytes);
  const uint64_t vertices = in.get_count();
  const Bytes tables = in.get_bytes(in.get_count());
  const Bytes events = in.get_bytes(in.remaining());
  // A symbol that is not alone in its table has 1/512 bit at least.
  if (!in.ok() || vertices > std::min(most_vertices, most_fan_points) || vertices > 3 * uint64_t{triangles} ||
      triangles / 16384 > bytes.size() + 16) {
    return corrupt("the fans are more than their bytes can hold");
  }
  RansDecoder side(tables);
  StaticTables event_tables = read_tables(fan_contexts, fan_symbols, slot_bits, most_event_tables, side);
  StaticTables numbers = read_tables(number_contexts, number_symbols, slot_bits, number_contexts, side);
  if (side.exhausted()) return corrupt("the tables of the fans end early");
  return FanDecoder(std::make_unique<State>(events, std::move(event_tables), std::move(numbers), triangles,
                                            static_cast<uint32_t>(vertices)));
}

uint32_t FanDecoder::vertices() const {
  return state_->vertex_count;
}

Result<> FanDecoder::decode_until(uint32_t end) {
  // The newest vertex may still get a late triple.
  while (state_->machine.vertices <= end && !state_->machine.done()) MAILLE_CHECK(state_->step());
  if (state_->machine.vertices < end) return corrupt("the fans have another number of vertices");
  return {};
}

const VertexReferences* FanDecoder::references(uint32_t vertex) const {
  return state_->surface.references.data() + (vertex - state_->surface.first);
}
const uint8_t* FanDecoder::kinds(uint32_t vertex) const {
  return state_->surface.kinds.data() + (vertex - state_->surface.first);
}

void FanDecoder::release(uint32_t end) {
  FanSurface& surface = state_->surface;
  const uint32_t left = state_->machine.vertices - end;
  std::copy_n(references(end), left, surface.references.data());
  std::copy_n(kinds(end), left, surface.kinds.data());
  surface.first = end;
}

Result<FanSurface> FanDecoder::finish() {
  const uint32_t count = vertices();
  while (!state_->machine.done()) {
    MAILLE_CHECK(decode_until(std::min(count, state_->surface.first + window)));
    // All vertices are known before the last triangles are.
    release(std::max(state_->surface.first, std::min(count, state_->machine.vertices - 1)));
    if (state_->machine.vertices == count) {
      while (!state_->machine.done()) MAILLE_CHECK(state_->step());
    }
  }
  if (state_->machine.vertices != count) return corrupt("the fans have another number of vertices");
  FanSurface result = std::move(state_->surface);
  result.vertices = count;
  result.references = {};
  result.kinds = {};
  result.first = count;
  return result;
}

Result<FanSurface> decode_fans(Bytes bytes, uint32_t triangles, uint32_t most_vertices) {
  FanDecoder decoder = MAILLE_TRY(FanDecoder::begin(bytes, triangles, most_vertices));
  Unfilled<VertexReferences> references;
  Unfilled<uint8_t> kinds;
  for (uint32_t begin = 0; begin < decoder.vertices();) {
    const uint32_t end = std::min(decoder.vertices(), begin + FanDecoder::window);
    MAILLE_CHECK(decoder.decode_until(end));
    references.insert(references.end(), decoder.references(begin), decoder.references(begin) + (end - begin));
    kinds.insert(kinds.end(), decoder.kinds(begin), decoder.kinds(begin) + (end - begin));
    decoder.release(end);
    begin = end;
  }
  FanSurface result = MAILLE_TRY(decoder.finish());
  result.first = 0;
  result.references = std::move(references);
  result.kinds = std::move(kinds);
  return result;
}

}  // namespace maille
