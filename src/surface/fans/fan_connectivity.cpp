// The encoder of fans; their decoder is in fan_decoder.cpp, what symbols do in fan_machine.h.
#include "surface/fans/fan_connectivity.h"

#include <algorithm>
#include <memory>

#include "base/bytes.h"
#include "entropy/static_rans.h"
#include "surface/fans/adaptive_fan_model.h"
#include "surface/fans/adaptive_start.h"
#include "surface/fans/fan_machine.h"
#include "surface/fans/fan_tables.h"

namespace maille {
namespace {

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
        operations_.push_back({machine.context(), symbol});
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
  std::vector<FanOperation>& operations() { return operations_; }

  // What the machine calls.
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
  void gate_along(uint32_t entry, unsigned k) { set_gate(entry, edges_.opposite[next_corner(fan_[k - 1])]); }
  void gate_back(uint32_t entry, unsigned k) {
    set_gate(entry, edges_.opposite[previous_corner(fan_[k - 1])]);
  }
  void gates_of_start(uint32_t entry) {
    for (uint32_t k = 0; k < 3; ++k) set_gate(entry + k, edges_.opposite[fan_[0] + k]);
  }

 private:
  static constexpr unsigned longest_fan = 16;
  // Vertices of more triangles are taken for lost sometimes, which costs bytes only.
  static constexpr unsigned longest_turn = 4096;

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
    const auto turn = [&](uint32_t x, auto next) {
      for (unsigned i = 0; i < longest_turn; ++i) {
        const uint32_t over = edges_.opposite[x];
        if (!is_uncoded(over) || over / 3 == g / 3) break;
        x = next(over);
      }
      return place_of_gate(x);
    };
    Place place = turn(along, previous_corner);
    if (place.entry != none && machine_->vertex(place.entry) == number) return place;
    place = turn(back, next_corner);
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
  std::vector<FanOperation> operations_;
  Machine* machine_ = nullptr;
};

using Operations = std::vector<FanOperation>;

/// A number of the static tables: its symbol, and how many bits follow.
struct NumberSymbol {
  explicit NumberSymbol(uint32_t number) : symbol(number) {
    if (number < direct_numbers) return;
    const unsigned length = 32 - static_cast<unsigned>(__builtin_clz(number));
    symbol = direct_numbers + length - 4;
    bit_count = length - 1;
    bits = number - (1u << bit_count);
  }
  unsigned symbol;
  unsigned bit_count = 0;
  uint32_t bits = 0;
};

std::vector<std::byte> write_operations(const Operations& operations, uint32_t vertices) {
  FanCounts counts;
  counts.add(operations);
  RansEncoder side;
  const FanTables made = counts.make_tables(side);
  ByteWriter out;
  out.put_count(vertices);
  const auto tables = side.finish();
  out.put_count(tables.size());
  out.put_bytes(tables);
  out.put_bytes(write_fans(operations, made));
  return out.take();
}

std::vector<std::byte> write_adaptive(const Operations& operations, uint32_t vertices,
                                      const AdaptiveFanModel* start) {
  RansEncoder encoder;
  const auto model =
      start == nullptr ? std::make_unique<AdaptiveFanModel>() : std::make_unique<AdaptiveFanModel>(*start);
  for (const auto& [context, value] : operations) {
    if (context < FanOperation::is_number) {
      model->code_symbol(encoder, context, value);
    } else {
      model->code_number(encoder, static_cast<FanNumber>(context - FanOperation::is_number), value);
    }
  }
  ByteWriter out;
  out.put_count(vertices);
  out.put_bytes(encoder.finish());
  return out.take();
}

}  // namespace

FanCounts::FanCounts() : events_(mapped_contexts), numbers_(number_contexts) {}

void FanCounts::add(std::span<const FanOperation> operations) {
  for (const auto& [context, value] : operations) {
    if (context < FanOperation::is_number) {
      ++events_[mapped_context(context)][value];
    } else {
      ++numbers_[context - FanOperation::is_number][NumberSymbol(value).symbol];
    }
  }
}

void FanCounts::spread() {
  spread_symbols(events_, fan_symbols, true);
  spread_symbols(numbers_, number_symbols, true);
}

FanTables FanCounts::make_tables(RansEncoder& side) const {
  StaticTables events = maille::make_tables(events_, fan_symbols, fan_slot_bits, most_event_tables, side);
  return {std::move(events),
          maille::make_tables(numbers_, number_symbols, fan_slot_bits, number_contexts, side)};
}

std::vector<std::byte> write_fans(std::span<const FanOperation> operations, const FanTables& tables) {
  StaticRansEncoder encoder;
  for (const auto& [context, value] : operations) {
    if (context < FanOperation::is_number) {
      encoder.put(tables.events.of(mapped_context(context)), fan_slot_bits, value);
      continue;
    }
    const NumberSymbol number(value);
    encoder.put(tables.numbers.of(context - FanOperation::is_number), fan_slot_bits, number.symbol);
    const unsigned low = std::min(number.bit_count, 16u);
    encoder.put_raw(number.bits & ((1u << low) - 1), low);
    if (number.bit_count > 16) encoder.put_raw(number.bits >> 16, number.bit_count - 16);
  }
  return encoder.finish();
}

bool can_write_fans(std::span<const FanOperation> operations, const FanTables& tables) {
  return std::all_of(operations.begin(), operations.end(), [&](const FanOperation& operation) {
    const auto& [context, value] = operation;
    if (context < FanOperation::is_number)
      return tables.events.of(mapped_context(context)).frequency[value] != 0;
    return tables.numbers.of(context - FanOperation::is_number).frequency[NumberSymbol(value).symbol] != 0;
  });
}

void FanSurface::count_valences() {
  valences.assign(vertices, 0);
  for (const uint32_t v : corners) ++valences[v];
}

void FanSurface::forget_vertices() {
  references = {};
  kinds = {};
  valences = {};
  first = vertices;
}

EncodedFans encode_fans(const HalfEdges& surface, uint32_t real_half_edges, uint32_t point_count,
                        FanModels models) {
  return encode_fans(surface, real_half_edges, point_count, models, nullptr);
}

EncodedFans encode_fans(const HalfEdges& surface, uint32_t real_half_edges, uint32_t point_count,
                        FanModels models, const AdaptiveFanModel* start) {
  FanFinder finder(surface, real_half_edges, point_count);
  EncodedFans result = finder.run();
  result.surface.count_valences();
  if (models == FanModels::shared) {
    result.operations = std::move(finder.operations());
    return result;
  }
  const uint32_t vertices = result.surface.vertices;
  result.bytes = models == FanModels::adaptive ? write_adaptive(finder.operations(), vertices, start)
                                               : write_operations(finder.operations(), vertices);
  return result;
}

}  // namespace maille
