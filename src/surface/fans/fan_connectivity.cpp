// The encoder of fans; their decoder is in fan_decoder.cpp, what symbols do in fan_machine.h.
#include "surface/fans/fan_connectivity.h"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>

#include "base/bytes.h"
#include "entropy/static_rans.h"
#include "surface/fans/fan_machine.h"
#include "surface/fans/fan_tables.h"

namespace maille {
namespace {

/// Finds the symbol of a pattern.
/// Patterns that differ only in what a symbol does not tell (the spoke of a close, which is always 1) have
/// one key.
class FanSymbols {
 public:
  explicit FanSymbols(std::span<const FanPattern> patterns) {
    for (uint8_t symbol = 0; symbol < patterns.size(); ++symbol) {
      const FanPattern& pattern = patterns[symbol];
      if (pattern.end != FanEnd::none) of(pattern).push_back({key_of(pattern), symbol});
    }
  }
  /// Returns none where no symbol is this pattern: then some of the new vertices are coded first, see
  /// spelled().
  uint32_t find(const FanPattern& pattern) {
    if (pattern.added > most_added) return none;
    const uint64_t key = key_of(pattern);
    for (const auto& [listed, symbol] : of(pattern)) {
      if (listed == key) return symbol;
    }
    return none;
  }

 private:
  static constexpr unsigned most_added = 16;
  static uint64_t key_of(const FanPattern& pattern) {
    // These ends have a triangle of their own, of which the symbol tells whether it ends its polygon.
    const unsigned last = pattern.end == FanEnd::pocket || pattern.end == FanEnd::swallow ||
                          pattern.end == FanEnd::split || pattern.end == FanEnd::known ||
                          pattern.end == FanEnd::merge;
    const unsigned spokes = pattern.added + last;
    return uint64_t{pattern.taken} << 32 | (pattern.spokes & ((uint64_t{1} << spokes) - 1));
  }
  std::vector<std::pair<uint64_t, uint8_t>>& of(const FanPattern& pattern) {
    return symbols_[static_cast<size_t>(pattern.end)][pattern.added];
  }
  std::array<std::array<std::vector<std::pair<uint64_t, uint8_t>>, most_added + 1>, 9> symbols_;
};

/// The encoder's side of a FanMachine: it knows the mesh, finds the symbols and notes what is coded. It
/// keeps, for each entry of the ring, the half-edge beyond the entry's gate; the machine tells it when
/// entries move. Whatever it chooses is valid, so heuristics that give up cost bytes, never correctness: a
/// vertex that is not found on a ring is coded by its number ("known").
class FanFinder {
 public:
  static constexpr bool encoding = true;
  using Machine = FanMachine<FanFinder>;

  FanFinder(const HalfEdges& edges, uint32_t real_half_edges, uint32_t points)
      : edges_(edges),
        real_(real_half_edges),
        polygons_(!edges.all_triangles()),
        symbols_(patterns_of(polygons_)),
        number_of_(points, none),
        place_of_(points, none) {
    if (polygons_) list_faces();
    coded_.resize(faces());
  }

  EncodedFans run() {
    EncodedFans result;
    FanSurface& surface = result.surface;
    const auto points = static_cast<uint32_t>(number_of_.size());
    std::optional<uint32_t> polygons;
    if (polygons_) {
      polygons = faces();
      surface.offsets.push_back(0);
      surface.corners.reserve(real_);
    } else {
      surface.corners.resize(real_);
      surface.references.resize(points);
      surface.kinds.resize(points);
    }
    points_.reserve(points);
    half_edges_.reserve(faces());
    // A polygon of d corners is d - 2 triangles, so all are half-edges less two for each face.
    Machine machine(*this, surface, real_ - 2 * faces(), points, polygons);
    machine_ = &machine;
    while (!machine.done()) {
      if (machine.prepare()) {
        const unsigned symbol = choose();
        operations_.push_back({polygons_ ? machine.polygon_context() : machine.context(), symbol});
        machine.apply(patterns_of(polygons_)[symbol]);
      } else {
        choose_start();
        machine.start();
      }
    }
    surface.vertices = machine.vertices;
    if (!polygons_) {
      surface.references.resize(machine.vertices);
      surface.kinds.resize(machine.vertices);
    }
    result.points = std::move(points_);
    result.half_edges = std::move(half_edges_);
    result.operations = std::move(operations_);
    return result;
  }

  // These functions are what the machine calls. Numbers were put in order by choose() or choose_start();
  // references are coded as zigzag differences to the reference before, which the machine undoes.
  uint32_t number(FanNumber kind, uint32_t, uint32_t base = 0) {
    const uint32_t value = numbers_[next_number_++];
    uint32_t coded = value;
    if (kind == FanNumber::reference) {
      const uint32_t delta = value - base;
      coded = delta << 1 ^ (0 - (delta >> 31));
    }
    operations_.push_back({FanOperation::is_number + static_cast<uint32_t>(kind), coded});
    return kind == FanNumber::reference ? coded : value;
  }
  void moved(uint32_t to, uint32_t from) { set_gate(to, gate(from)); }
  void no_gate(uint32_t entry) { set_gate(entry, none); }
  /// The gate on the edge from the vertex before to the new one of the k-th triangle (from 1), or back from
  /// there to the focus.
  void gate_along(uint32_t entry, unsigned k) { set_gate(entry, edges_.opposite[fan_[k - 1].along]); }
  void gate_back(uint32_t entry, unsigned k) {
    const Triangle& triangle = fan_[k - 1];
    set_gate(entry, triangle.real ? edges_.opposite[triangle.back] : none);
  }
  void gates_of_start(uint32_t entry) {
    const Triangle& triangle = fan_[0];
    set_gate(entry, edges_.opposite[triangle.polygon]);
    gate_along(entry + 1, 1);
    gate_back(entry + 2, 1);
  }

 private:
  static constexpr unsigned longest_fan = 16;
  // A vertex of more triangles is taken for lost sometimes, which costs bytes only. Without a bound the
  // search for an apex would be quadratic around one vertex of a great many triangles (1e2858d). Chosen, not
  // swept.
  static constexpr unsigned longest_turn = 4096;
  // Gates that moved are looked for among so many entries from the tail on; farther ones are taken for lost,
  // too. Chosen, not swept: more would find more gates and cost time in meshes with many non-manifold
  // vertices.
  static constexpr uint32_t longest_search = 1024;
  /// If a polygon takes in more vertices of the ring than this, they are taken one by one, so that the test
  /// for a pocket stays bounded. Chosen, not swept.
  static constexpr unsigned longest_pocket = 64;

  /// A triangle of the fan at hand. `polygon` is the first half-edge of its polygon, which leaves the head.
  /// `along` runs from the vertex before to the third vertex, and `back` follows it; `back` runs to the head
  /// if the polygon ends there (`real`).
  struct Triangle {
    uint32_t polygon;
    uint32_t along;
    uint32_t back;
    bool real;
  };

  uint32_t faces() const { return polygons_ ? static_cast<uint32_t>(first_of_face_.size()) : real_ / 3; }
  uint32_t face_of(uint32_t h) const { return polygons_ ? face_of_[h] : h / 3; }
  void list_faces() {
    face_of_.reserve(real_);
    for (uint32_t h = 0; h < real_;) {
      const unsigned degree = edges_.degree(h);
      face_of_.resize(h + degree, static_cast<uint32_t>(first_of_face_.size()));
      first_of_face_.push_back(h);
      h += degree;
    }
  }

  uint32_t gate(uint32_t entry) const { return entry < gates_.size() ? gates_[entry] : none; }
  void set_gate(uint32_t entry, uint32_t h) {
    // Doubled, as entries are pushed one by one.
    if (entry >= gates_.size()) gates_.resize(std::max<size_t>(2 * gates_.size(), entry + size_t{1}), none);
    gates_[entry] = h;
    if (h >= real_) return;
    place_of_[machine_->vertex(entry)] = entry;
    // Until a fan gets there, this has come from memory.
    __builtin_prefetch(&edges_.origin[h]);
    __builtin_prefetch(&edges_.opposite[h]);
    __builtin_prefetch(&coded_[face_of(h)]);
  }
  bool is_uncoded(uint32_t h) const { return h < real_ && coded_[face_of(h)] == 0; }

  struct Place {
    uint32_t entry = none;
    uint32_t ring = none;  ///< among those that wait; none: the ring at hand
  };
  /// The entry with gate h, if there is one: it is beyond a face, not on the border.
  Place place_of_gate(uint32_t h) const {
    if (h >= real_ || edges_.opposite[h] >= real_) return {};
    const uint32_t number = number_of_[edges_.origin[edges_.next(h)]];
    uint32_t e = number < machine_->vertices ? place_of_[number] : none;
    if (e == none) return {};
    // A vertex may be there more than once.
    if (gate(e) != h) e = find_gate(h);
    if (e == none) return {};
    if (e >= machine_->head && e < machine_->tail) return {e, none};
    const auto& waiting = machine_->waiting;
    const auto above = std::upper_bound(waiting.begin(), waiting.end(), e,
                                        [](uint32_t x, const Machine::Ring& ring) { return x < ring.begin; });
    if (above == waiting.begin() || e >= (above - 1)->end) return {};
    return {e, static_cast<uint32_t>(above - 1 - waiting.begin())};
  }
  uint32_t find_gate(uint32_t h) const {
    const uint32_t end = machine_->tail;
    const uint32_t begin = end - std::min(end, longest_search);
    for (uint32_t e = end; e > begin; --e) {
      if (gate(e - 1) == h) return e - 1;
    }
    return none;
  }
  Place following(Place place) const {
    const uint32_t end = place.ring == none ? machine_->tail : machine_->waiting[place.ring].end;
    const uint32_t begin = place.ring == none ? machine_->head : machine_->waiting[place.ring].begin;
    return {place.entry + 1 == end ? begin : place.entry + 1, place.ring};
  }
  /// The entry of a triangle's third vertex. It is found by turning round that vertex through faces that are
  /// not coded yet, until a gate is met: first one way, then the other. An entry of the right vertex in the
  /// wrong place of the ring would be another surface, so the vertex alone is not enough.
  Place find_apex(const Triangle& triangle) const {
    const uint32_t number = number_of_[edges_.origin[triangle.back]];
    const uint32_t face = face_of(triangle.along);
    const auto turn = [&](uint32_t x, auto next) {
      for (unsigned i = 0; i < longest_turn; ++i) {
        const uint32_t over = edges_.opposite[x];
        if (!is_uncoded(over) || face_of(over) == face) break;
        x = next(over);
      }
      return place_of_gate(x);
    };
    Place place = turn(triangle.along, [&](uint32_t h) { return edges_.previous(h); });
    if (place.entry != none && machine_->vertex(place.entry) == number) return place;
    place = turn(triangle.back, [&](uint32_t h) { return edges_.next(h); });
    if (place.entry == none) return {};
    place = following(place);
    return machine_->vertex(place.entry) == number ? place : Place{};
  }

  /// The triangle that follows in the fan, or the first one; nothing where a border lies there.
  std::optional<Triangle> next_triangle() const {
    Triangle triangle;
    const bool first = fan_.empty();
    const bool in_polygon = first ? machine_->open() > 0 : !fan_.back().real;
    if (in_polygon) {
      const Triangle& before = first ? left_open_ : fan_.back();
      triangle.polygon = before.polygon;
      triangle.along = before.back;
    } else {
      const uint32_t g = first ? gate(machine_->tail - 1) : edges_.opposite[fan_.back().back];
      if (!is_uncoded(g)) return std::nullopt;
      triangle.polygon = g;
      triangle.along = edges_.next(g);
    }
    triangle.back = edges_.next(triangle.along);
    triangle.real = edges_.next(triangle.back) == triangle.polygon;
    return triangle;
  }

  /// Takes as many triangles as the fan has, as if all of them were coded: their vertices get numbers and
  /// their faces count as coded, because what comes next depends on that. commit() takes back what the symbol
  /// does not cover.
  unsigned choose() {
    numbers_.clear();
    next_number_ = 0;
    fan_.clear();
    const uint32_t first_number = machine_->vertices;
    FanPattern pattern{FanEnd::open, 0, 1, 0};
    while (pattern.added < longest_fan) {
      const std::optional<Triangle> triangle = next_triangle();
      if (!triangle) {
        pattern.end = FanEnd::border;
        break;
      }
      if (is_close(*triangle)) {
        pattern.end = FanEnd::close;
        fan_.push_back(*triangle);
        break;
      }
      const uint32_t apex = edges_.origin[triangle->back];
      if (number_of_[apex] != none) {
        choose_known(*triangle, pattern);
        break;
      }
      pattern.spokes |= uint32_t{triangle->real} << pattern.added++;
      fan_.push_back(*triangle);
      if (triangle->real) coded_[face_of(triangle->along)] = 1;
      number_of_[apex] = machine_->vertices + pattern.added - 1;
    }
    uint32_t symbol = symbols_.find(pattern);
    if (symbol == none) {
      numbers_.clear();
      pattern = spelled(pattern);
      symbol = symbols_.find(pattern);
    }
    commit(pattern, first_number);
    return symbol;
  }
  /// One or four of the new vertices, as there is no symbol for all that follows. Of polygons, the symbol for
  /// four has four diagonals.
  FanPattern spelled(const FanPattern& pattern) const {
    const bool four = pattern.added >= 4 && (!polygons_ || (pattern.spokes & 15) == 0);
    return {FanEnd::open, static_cast<uint8_t>(four ? 4 : 1), 1, pattern.spokes};
  }

  bool is_close(const Triangle& triangle) const {
    return machine_->vertex(machine_->head + 1) != none && triangle.real &&
           triangle.back == gate(machine_->head);
  }
  /// How many vertices of the ring beyond the next one the polygon takes in before it closes at the head; 0
  /// if it does not close that way.
  unsigned taken_by(const Triangle& triangle, uint32_t entry) const {
    const uint32_t head = machine_->head;
    const unsigned taken = entry - head - 1;
    if (triangle.real || taken > longest_pocket) return 0;
    uint32_t h = triangle.back;
    for (unsigned k = taken; k > 0; --k, h = edges_.next(h)) {
      if (machine_->vertex(head + k) == none || h != gate(head + k)) return 0;
    }
    return h == gate(head) && edges_.next(h) == triangle.polygon ? taken : 0;
  }

  void choose_known(const Triangle& triangle, FanPattern& pattern) {
    const Machine& ring = *machine_;
    const Place place = find_apex(triangle);
    const unsigned i = pattern.added;
    const uint32_t end = ring.tail + i;  // with the new vertices
    pattern.spokes |= uint32_t{triangle.real} << i;
    fan_.push_back(triangle);
    if (place.entry == none) return choose_lost(triangle, pattern);
    if (place.ring != none) {
      const Machine::Ring& other = ring.waiting[place.ring];
      const auto from_top = static_cast<uint32_t>(ring.waiting.size() - 1 - place.ring);
      // The decoder refuses streams that move more entries than this; a known vertex moves none.
      if (uint64_t{other.end - other.begin} + from_top + 1 > ring.moves_left())
        return choose_lost(triangle, pattern);
      numbers_ = {from_top, place.entry - other.begin};
      pattern.end = FanEnd::merge;
      return;
    }
    if (place.entry >= ring.head + 2 && place.entry + 2 <= end &&
        choose_pocket(triangle, place.entry, pattern))
      return;
    if (i == 0 && ring.tail - ring.head >= 3 && place.entry == ring.tail - 2 &&
        triangle.along == gate(ring.tail - 2)) {
      pattern.end = FanEnd::swallow;
      return;
    }
    if (place.entry < ring.head + 2 || place.entry + 2 > end || end < ring.head + 4)
      return choose_lost(triangle, pattern);
    const uint32_t ahead = place.entry - ring.head - 2;
    const uint32_t behind = end - 2 - place.entry;
    // As FanMachine::split() counts them: behind a diagonal the part at the head has to be copied.
    const uint32_t moves = triangle.real ? std::min(ahead, behind) : ahead;
    if (uint64_t{moves} + 3 > ring.moves_left()) return choose_lost(triangle, pattern);
    if (behind < ahead) {
      numbers_ = {1, behind};
    } else {
      numbers_ = {0, ahead};
    }
    pattern.end = FanEnd::split;
  }
  bool choose_pocket(const Triangle& triangle, uint32_t entry, FanPattern& pattern) {
    const Machine& ring = *machine_;
    if (const unsigned taken = polygons_ ? taken_by(triangle, entry) : 0; taken > 0) {
      pattern.end = FanEnd::pocket;
      pattern.taken = static_cast<uint8_t>(taken > most_listed_taken ? 0 : taken);
      if (pattern.taken == 0) numbers_ = {taken};
      return true;
    }
    if (!triangle.real || entry != ring.head + 2 || ring.vertex(ring.head + 1) == none) return false;
    const uint32_t beyond = edges_.opposite[triangle.back];
    if (!is_uncoded(beyond) || face_of(beyond) == face_of(triangle.along)) return false;
    const uint32_t along = edges_.next(beyond), back = edges_.next(along);
    if (edges_.next(back) != beyond || back != gate(ring.head) || along != gate(ring.head + 1)) return false;
    pattern.end = FanEnd::pocket;
    fan_.push_back({beyond, along, back, true});
    return true;
  }
  /// For a vertex that has a number already, but to which no ring leads. Any vertex may be coded so, at the
  /// price of its number.
  void choose_lost(const Triangle& triangle, FanPattern& pattern) {
    numbers_ = {number_of_[edges_.origin[triangle.back]]};
    pattern.end = FanEnd::known;
  }

  /// Keeps of the fan that was looked at what the symbol codes, and takes the rest back.
  void commit(const FanPattern& pattern, uint32_t first_number) {
    const unsigned i = pattern.added;
    for (size_t k = i; k < fan_.size(); ++k) {
      const uint32_t apex = edges_.origin[fan_[k].back];
      if (number_of_[apex] != none && number_of_[apex] >= first_number + i) number_of_[apex] = none;
      coded_[face_of(fan_[k].along)] = 0;
    }
    for (size_t k = 0; k < i; ++k) points_.push_back(edges_.origin[fan_[k].back]);
    if (pattern.end == FanEnd::open) fan_.resize(i);
    const bool whole = pattern.end == FanEnd::pocket || pattern.end == FanEnd::close;
    for (const Triangle& triangle : fan_) {
      if (!triangle.real && !whole) continue;
      // A polygon of several triangles is listed once.
      if (coded_[face_of(triangle.along)] != 0 && !half_edges_.empty() &&
          half_edges_.back() == triangle.polygon)
        continue;
      coded_[face_of(triangle.along)] = 1;
      half_edges_.push_back(triangle.polygon);
    }
    if (!fan_.empty()) left_open_ = fan_.back();
  }

  void choose_start() {
    numbers_.clear();
    next_number_ = 0;
    while (coded_[next_face_] != 0) ++next_face_;
    const uint32_t h = polygons_ ? first_of_face_[next_face_] : 3 * next_face_;
    const uint32_t along = edges_.next(h), back = edges_.next(along);
    fan_ = {{h, along, back, edges_.next(back) == h}};
    left_open_ = fan_[0];
    if (fan_[0].real) {
      coded_[next_face_] = 1;
      half_edges_.push_back(h);
    }
    numbers_.push_back(fan_[0].real ? 0 : 8);
    uint32_t next = machine_->vertices;
    unsigned k = 0;
    for (const uint32_t corner : {h, along, back}) {
      const uint32_t point = edges_.origin[corner];
      if (number_of_[point] != none) {
        numbers_[0] |= 1u << k;
        numbers_.push_back(number_of_[point]);
      } else {
        number_of_[point] = next++;
        points_.push_back(point);
      }
      ++k;
    }
  }

  const HalfEdges& edges_;
  uint32_t real_;
  bool polygons_;
  FanSymbols symbols_;
  std::vector<uint32_t> face_of_;        // by half-edge, and
  std::vector<uint32_t> first_of_face_;  // by face: its first half-edge; both of polygons only
  std::vector<uint8_t> coded_;           // by face
  std::vector<uint32_t> number_of_;      // by point: its vertex
  std::vector<uint32_t> place_of_;       // by vertex: the entry that had its gate last
  std::vector<uint32_t> gates_;          // by entry: the half-edge beyond the edge to the next entry
  std::vector<Triangle> fan_;            // triangles of the symbol at hand
  Triangle left_open_{};                 // the last one, if its polygon goes on
  std::vector<uint32_t> numbers_;
  size_t next_number_ = 0;
  uint32_t next_face_ = 0;
  std::vector<uint32_t> points_;
  std::vector<uint32_t> half_edges_;
  std::vector<FanOperation> operations_;
  Machine* machine_ = nullptr;
};

using Operations = std::vector<FanOperation>;

/// A number of the static tables: its symbol, and how many bits follow.
struct NumberSymbol {
  explicit NumberSymbol(uint32_t number) : symbol(number) {
    if (number < direct_numbers) return;
    // Not 0, for which clz is undefined: that is a direct number.
    const unsigned length = 32 - static_cast<unsigned>(__builtin_clz(number));
    symbol = direct_numbers + length - 4;
    bit_count = length - 1;
    bits = number - (1u << bit_count);
  }
  unsigned symbol;
  unsigned bit_count = 0;
  uint32_t bits = 0;
};

std::vector<std::byte> write_operations(const Operations& operations, const FanSurface& surface,
                                        bool polygons) {
  FanCounts counts(polygons);
  counts.add(operations);
  RansEncoder side;
  const FanTables made = counts.make_tables(side);
  ByteWriter out;
  out.put_count(surface.vertices);
  const auto tables = side.finish();
  out.put_count(tables.size());
  out.put_bytes(tables);
  out.put_bytes(write_fans(operations, made, surface.triangles()));
  return out.take();
}

}  // namespace

namespace {

unsigned event_context(unsigned context, bool polygons) {
  return polygons ? context : mapped_context(context);
}

}  // namespace

FanCounts::FanCounts(bool polygons)
    : polygons_(polygons),
      events_(polygons ? polygon_contexts : mapped_contexts),
      numbers_(number_contexts) {}

void FanCounts::add(std::span<const FanOperation> operations) {
  for (const auto& [context, value] : operations) {
    if (context < FanOperation::is_number) {
      ++events_[event_context(context, polygons_)][value];
    } else {
      ++numbers_[context - FanOperation::is_number][NumberSymbol(value).symbol];
    }
  }
}

void FanCounts::spread() {
  spread_symbols(events_, static_cast<unsigned>(patterns_of(polygons_).size()), true);
  spread_symbols(numbers_, number_symbols, true);
}

FanTables FanCounts::make_tables(RansEncoder& side) const {
  const auto symbols = static_cast<unsigned>(patterns_of(polygons_).size());
  StaticTables events = maille::make_tables(events_, symbols, fan_slot_bits, most_event_tables, side);
  return {polygons_, std::move(events),
          maille::make_tables(numbers_, number_symbols, fan_slot_bits, number_contexts, side)};
}

std::vector<std::byte> write_fans(std::span<const FanOperation> operations, const FanTables& tables,
                                  uint32_t triangles) {
  StaticRansEncoder encoder;
  for (const auto& [context, value] : operations) {
    if (context < FanOperation::is_number) {
      encoder.put(tables.events.of(event_context(context, tables.polygons)), fan_slot_bits, value);
      continue;
    }
    const NumberSymbol number(value);
    encoder.put(tables.numbers.of(context - FanOperation::is_number), fan_slot_bits, number.symbol);
    // Raw bits are at most 16 at a time, as words of the coder are.
    const unsigned low = std::min(number.bit_count, 16u);
    encoder.put_raw(number.bits & ((1u << low) - 1), low);
    if (number.bit_count > 16) encoder.put_raw(number.bits >> 16, number.bit_count - 16);
  }
  std::vector<std::byte> bytes = encoder.finish();
  // Symbols that cost nothing would let a few bytes claim any number of triangles; see can_hold().
  fill_up(bytes, triangles);
  return bytes;
}

/// A symbol that the tables' sample did not have has frequency 0, and cannot be coded by them.
bool can_write_fans(std::span<const FanOperation> operations, const FanTables& tables) {
  return std::all_of(operations.begin(), operations.end(), [&](const FanOperation& operation) {
    const auto& [context, value] = operation;
    if (context < FanOperation::is_number)
      return tables.events.of(event_context(context, tables.polygons)).frequency[value] != 0;
    return tables.numbers.of(context - FanOperation::is_number).frequency[NumberSymbol(value).symbol] != 0;
  });
}

void FanSurface::count_valences() {
  // Around an inner vertex each neighbour is met twice, so that the sum of all (exclusive or) vanishes; on a
  // border two are left. Two that cancel by chance only make a prediction worse, as both sides compute the
  // same. Numbers count from 1, so that vertex 0 counts, too. That sum is the lower half of a number whose
  // upper half counts faces.
  std::vector<uint64_t> around(vertices);
  const auto add = [&](uint32_t before, uint32_t at, uint32_t next) {
    around[at] = (around[at] + (uint64_t{1} << 32)) ^ (before + 1) ^ (next + 1);
  };
  for (size_t i = 0; offsets.empty() && i + 2 < corners.size(); i += 3) {
    const uint32_t a = corners[i], b = corners[i + 1], c = corners[i + 2];
    add(c, a, b);
    add(a, b, c);
    add(b, c, a);
  }
  for (uint32_t f = 0; !offsets.empty() && f < faces(); ++f) {
    const auto at = face(f);
    for (size_t k = 0; k < at.size(); ++k)
      add(at[k > 0 ? k - 1 : at.size() - 1], at[k], at[k + 1 < at.size() ? k + 1 : 0]);
  }
  // On a border half of the surface around a vertex is missing. Counting its faces twice makes the dragon in
  // charts 3 % smaller, ogre 0.6 % (13 bits, -5; f46b2b6).
  valences.resize(vertices);
  for (uint32_t v = 0; v < vertices; ++v) {
    const uint64_t count = around[v] >> 32;
    valences[v] = static_cast<uint8_t>(static_cast<uint32_t>(around[v]) != 0 ? 2 * count : count);
  }
}

void FanSurface::forget_vertices() {
  references = Scratch<VertexReferences>();
  kinds = Scratch<uint8_t>();
  valences = std::vector<uint8_t>();
  first = vertices;
}

/// Valences are counted before duplicates of faces are appended, as the decoder counts them.
EncodedFans encode_fans(HalfEdges surface, uint32_t real_half_edges, uint32_t point_count, FanModels models) {
  const bool polygons = !surface.all_triangles();
  EncodedFans result = FanFinder(surface, real_half_edges, point_count).run();
  // Half-edges are the largest thing in memory here, and nobody needs them while operations are written.
  surface = {};
  result.surface.count_valences();
  if (polygons) result.surface.find_polygon_references();
  if (models == FanModels::shared) return result;
  result.bytes = write_operations(result.operations, result.surface, polygons);
  std::vector<FanOperation>().swap(result.operations);
  return result;
}

}  // namespace maille
