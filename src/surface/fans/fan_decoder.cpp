// The decoder of fans; their encoder is in fan_connectivity.cpp, what symbols do in fan_machine.h,
// the loop for nearly all of them in fast_fans.cpp.
#include <algorithm>
#include <memory>
#include <string>

#include "base/bytes.h"
#include "base/cold.h"
#include "base/pages.h"
#include "base/result.h"
#include "surface/fans/fan_connectivity.h"
#include "surface/fans/fast_fans.h"

namespace maille {
namespace {

/// How many slow symbols are decoded in a row before the fast loop is tried again. abominevole, mostly slow
/// symbols, became 18 % faster with the commit that brought runs (73b64cc); their length was not swept.
constexpr int slow_run = 8;
/// Vertices that one step() may decode beyond those asked for: at most as many as entries that the fast loop
/// may write, then slow symbols of at most eleven each, then a component's three.
constexpr uint32_t fast_vertices = fast_room + slow_run * most_closed + 8;
static_assert(fast_vertices <= FanDecoder::most_ahead);
/// Corners are made in pieces that stay in the cache until they are written: zeros that go to memory first
/// took 3.5 % of the time instead of 1.8 % (ogre, 01657c4). The fast loop and its slow symbols make less than
/// half of a piece: at most 168 symbols of five triangles, and eight of twelve.
constexpr uint32_t piece_triangles = 1 << 11;

tl::unexpected<Error> corrupt(const char* what) {
  return failure(ErrorCode::corrupt, std::string("topology: ") + what);
}

/// Every count that memory is reserved by is held against the bytes: a writer fills short streams up
/// (fill_up()).
Result<> check_counts(Bytes bytes, uint32_t triangles, uint64_t vertices) {
  if (vertices > most_fan_points || vertices > 3 * uint64_t{triangles} ||
      !can_hold(bytes.size(), triangles)) {
    return corrupt("the fans are more than their bytes can hold");
  }
  return {};
}

}  // namespace

MAILLE_COLD FanTables read_fan_tables(RansDecoder& side, bool polygons) {
  const auto symbols = static_cast<unsigned>(patterns_of(polygons).size());
  StaticTables events = read_tables(polygons ? polygon_contexts : mapped_contexts, symbols, fan_slot_bits,
                                    most_event_tables, side);
  return {polygons, std::move(events),
          read_tables(number_contexts, number_symbols, fan_slot_bits, number_contexts, side)};
}

MAILLE_COLD FanSlots::FanSlots(const FanTables& tables) : polygons(tables.polygons) {
  const auto fill = [](const StaticTables& from, size_t more, auto& to) {
    to.resize(from.tables.size() + more);
    for (size_t i = 0; i < from.tables.size(); ++i) to[i].fill(from.tables[i]);
  };
  // One table more, whose only symbol is fan_marker: so a marker at the head, which has seen nothing, is
  // found by the symbol and needs no test in the fast loop.
  fill(tables.events, 1, events);
  events.back().fill(fan_marker);
  fill_table_at(tables);
  fill(tables.numbers, 0, numbers);
  std::copy_n(tables.numbers.table_of.begin(), number_contexts, number_at.begin());
}

MAILLE_COLD void FanSlots::fill_table_at(const FanTables& tables) {
  std::array<uint16_t, most_event_tables> place;
  const std::vector<uint8_t>& table_of = tables.events.table_of;
  for (size_t i = 0; i < tables.events.tables.size(); ++i)
    place[i] = static_cast<uint16_t>(i * sizeof(EventTable));
  // Heads of triangles have seen one at least; contexts of what has seen none belong to markers.
  uint16_t* const first = table_at.data() + (tables.polygons ? 0 : 256);
  for (size_t i = 0; i < table_of.size(); ++i) first[i] = place[table_of[i]];
  if (tables.polygons) return;
  std::fill_n(table_at.begin(), 256, static_cast<uint16_t>(tables.events.tables.size() * sizeof(EventTable)));
  for (unsigned head = mapped_heads + 1; head <= most_seen; ++head)
    // Contexts of heads that have seen more share the tables of mapped_heads: the file has no map for them.
    std::copy_n(&table_at[mapped_heads << 8], 256, &table_at[head << 8]);
}

/// A decoder of triangles at work. Not movable: the machine refers to reader and surface.
struct FanDecoder::State {
  State(Bytes events, std::unique_ptr<const FanSlots> own, const FanSlots& slots, uint32_t triangles,
        uint32_t vertices, uint64_t more, FanBuffers* reused)
      : buffers(reused),
        own_slots(std::move(own)),
        reader(events, slots),
        vertex_count(vertices),
        triangle_count(triangles),
        machine(reader, surface, triangles, vertices) {
    reserve_pages(surface.corners, 3 * (triangles + std::min<uint64_t>(more, triangles)));
    swap_buffers();
    if (machine.entries.empty()) machine.entries.resize(1024);
    make_room(window);
  }
  /// For so many vertices from surface.first on, and those that are decoded beyond.
  void make_room(size_t vertices) {
    surface.references.resize(vertices + fast_vertices + spare_vertices);
    surface.kinds.resize(vertices + fast_vertices + spare_vertices);
    // The last one is what the fast loop writes late triples of no vertex to; it is read before it is
    // written.
    surface.kinds.back() = 0;
  }

  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() { swap_buffers(); }
  void swap_buffers() {
    if (buffers == nullptr) return;
    surface.references.swap(buffers->references);
    surface.kinds.swap(buffers->kinds);
    machine.entries.swap(buffers->entries);
  }

  Result<> step();
  /// Corners grow a piece at a time, never beyond the triangles that were announced.
  void make_corners() {
    const uint64_t end = uint64_t{machine.triangle_count} + piece_triangles / 2;
    if (surface.corners.size() / 3 < std::min<uint64_t>(end, triangle_count))
      surface.corners.resize(3 * std::min<uint64_t>(end + piece_triangles / 2, triangle_count));
  }

  FanBuffers* buffers;
  std::unique_ptr<const FanSlots> own_slots;  ///< none where they are shared
  FanReader reader;
  uint32_t vertex_count;
  uint32_t triangle_count;
  FanSurface surface;
  FanMachine<FanReader> machine;
};

/// As many symbols as the fast loop takes, and the slow ones that follow. Each turn of a caller's loop takes
/// a symbol or begins a component, and exhausted() ends it when bytes do.
Result<> FanDecoder::State::step() {
  make_corners();
  if (!machine.prepare()) {
    if (!machine.start()) return corrupt("a component begins with a vertex that is not there");
    if (reader.rans.exhausted()) return corrupt("the fans end early");
    return {};
  }
  if (!run_fast(machine, reader, surface)) return corrupt("a fan that ends at a border");
  for (int i = 0; i < slow_run; ++i) {
    if (machine.done() || !machine.prepare()) return {};
    // The fast loop may go on where its ring is long enough; the first slow symbol is what it stopped at.
    if (i > 0 && machine.tail - machine.head >= least_fast_ring) return {};
    const unsigned symbol = reader.rans.get(reader.slots.table_of(machine.context()));
    if (symbol >= fan_symbols || !machine.apply(triangle_patterns[symbol]))
      return corrupt("a fan that cannot be completed");
    if (reader.rans.exhausted()) return corrupt("the fans end early");
  }
  return {};
}

FanDecoder::FanDecoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
FanDecoder::FanDecoder(FanDecoder&&) noexcept = default;
FanDecoder& FanDecoder::operator=(FanDecoder&&) noexcept = default;
FanDecoder::~FanDecoder() = default;

Result<FanDecoder> FanDecoder::begin(Bytes bytes, uint32_t triangles, uint32_t most_vertices, uint64_t more) {
  ByteReader in(bytes);
  const uint64_t vertices = in.get_count();
  const Bytes tables = in.get_bytes(in.get_count());
  const Bytes events = in.get_bytes(in.remaining());
  if (!in.ok() || vertices > most_vertices) return corrupt("the fans are more than their bytes can hold");
  RansDecoder side(tables);
  const FanTables read = read_fan_tables(side);
  if (side.exhausted()) return corrupt("the tables of the fans end early");
  MAILLE_CHECK(check_counts(bytes, triangles, vertices));
  auto slots = std::make_unique<const FanSlots>(read);
  const FanSlots& there = *slots;
  return FanDecoder(std::make_unique<State>(events, std::move(slots), there, triangles,
                                            static_cast<uint32_t>(vertices), more, nullptr));
}

Result<FanDecoder> FanDecoder::begin(Bytes operations, const FanSlots& slots, uint32_t triangles,
                                     uint32_t vertices, uint64_t more, FanBuffers* buffers) {
  MAILLE_CHECK(check_counts(operations, triangles, vertices));
  return FanDecoder(std::make_unique<State>(operations, nullptr, slots, triangles, vertices, more, buffers));
}

constexpr uint32_t references_of_page = large_page / sizeof(VertexReferences);

FanDecoder FanDecoder::over(FanSurface surface) {
  FanDecoder decoder(nullptr);
  decoder.complete_ = std::make_unique<FanSurface>(std::move(surface));
  return decoder;
}

Result<> FanDecoder::decode_all() {
  if (complete_ && complete_->valences.empty()) complete_->count_valences();
  if (complete_) return {};
  State& state = *state_;
  state.make_room(state.vertex_count);
  while (!state.machine.done()) MAILLE_CHECK(state.step());
  if (state.machine.vertices != state.vertex_count)
    return corrupt("the fans have another number of vertices");
  state.surface.vertices = state.vertex_count;
  complete_ = std::make_unique<FanSurface>(std::move(state.surface));
  state_.reset();
  complete_->references.resize(complete_->vertices);
  complete_->kinds.resize(complete_->vertices);
  complete_->count_valences();
  kept_ = 0;
  return {};
}

uint32_t FanDecoder::vertices() const {
  if (complete_) return complete_->vertices;
  return state_->vertex_count;
}

Result<> FanDecoder::decode_until(uint32_t end) {
  if (complete_) return {};
  // The newest vertex may still get a late triple.
  while (state_->machine.vertices <= end && !state_->machine.done()) MAILLE_CHECK(state_->step());
  if (state_->machine.vertices < end) return corrupt("the fans have another number of vertices");
  return {};
}

const VertexReferences* FanDecoder::references(uint32_t vertex) const {
  if (complete_) return complete_->references.data() + vertex;
  return state_->surface.references.data() + (vertex - state_->surface.first);
}
const uint8_t* FanDecoder::kinds(uint32_t vertex) const {
  if (complete_) return complete_->kinds.data() + vertex;
  return state_->surface.kinds.data() + (vertex - state_->surface.first);
}

void FanDecoder::release(uint32_t end) {
  if (complete_) {
    // A large page at a time, while positions need more and more memory.
    // (Positions' memory grows as that of references shrinks, so the sum stays about the same.)
    const uint32_t passed = end - end % references_of_page;
    if (passed <= kept_) return;
    drop_pages(complete_->references.data() + kept_, (passed - kept_) * sizeof(VertexReferences));
    kept_ = passed;
    return;
  }
  FanSurface& surface = state_->surface;
  const uint32_t left = state_->machine.vertices - end;
  // At most most_ahead are left. They move to the front, where the next window is written behind them.
  std::copy_n(references(end), left, surface.references.data());
  std::copy_n(kinds(end), left, surface.kinds.data());
  surface.first = end;
}

Result<FanSurface> FanDecoder::finish() {
  if (complete_) {
    complete_->forget_vertices();
    return std::move(*complete_);
  }
  // Nobody asked for positions up to here, or there are none for the last triangles: windows go on as before.
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
  FanSurface result;
  result.corners = std::move(state_->surface.corners);
  result.vertices = count;
  result.forget_vertices();
  return result;
}

Result<FanSurface> decode_fans(Bytes bytes, uint32_t triangles, uint32_t most_vertices) {
  FanDecoder decoder = MAILLE_TRY(FanDecoder::begin(bytes, triangles, most_vertices));
  MAILLE_CHECK(decoder.decode_all());
  return decoder.complete();
}

namespace {

/// Everything in one function: calls for vectors that grow took a third of the time. Polygons have no loop
/// without branches of their own; ns a triangle at -3: makehuman 34 to 26.5, lion_vase 29.4 to 24.5
/// (eb3dccd).
[[gnu::flatten]] Result<> run_polygons(FanMachine<FanReader>& machine, FanReader& reader) {
  while (!machine.done()) {
    if (!machine.prepare()) {
      if (!machine.start()) return corrupt("a component begins with a vertex that is not there");
    } else if (!machine.apply(
                   polygon_patterns[reader.rans.get(reader.slots.table_of(machine.polygon_context()))])) {
      return corrupt("a fan that cannot be completed");
    }
    if (reader.rans.exhausted()) return corrupt("the fans end early");
  }
  return {};
}

}  // namespace

Result<FanSurface> decode_polygon_fans(Bytes bytes, uint32_t polygons, uint32_t corners,
                                       uint32_t most_vertices) {
  ByteReader in(bytes);
  const uint64_t vertices = in.get_count();
  const Bytes tables = in.get_bytes(in.get_count());
  const Bytes events = in.get_bytes(in.remaining());
  if (!in.ok() || vertices > most_vertices) return corrupt("the fans are more than their bytes can hold");
  RansDecoder side(tables);
  const FanTables read = read_fan_tables(side, true);
  if (side.exhausted()) return corrupt("the tables of the fans end early");
  const auto slots = std::make_unique<const FanSlots>(read);
  return decode_polygon_fans(events, *slots, polygons, corners, static_cast<uint32_t>(vertices));
}

Result<FanSurface> decode_polygon_fans(Bytes operations, const FanSlots& slots, uint32_t polygons,
                                       uint32_t corners, uint32_t vertices) {
  if (vertices > corners || corners / 3 < polygons)
    return corrupt("the fans are more than their bytes can hold");
  const uint32_t triangles = corners - 2 * polygons;
  MAILLE_CHECK(check_counts(operations, triangles, vertices));
  FanSurface surface;
  reserve_pages(surface.corners, corners);
  reserve_pages(surface.offsets, size_t{polygons} + 1);
  reserve_pages(surface.across, polygons);
  surface.offsets.push_back(0);
  FanReader reader(operations, slots);
  FanMachine<FanReader> machine(reader, surface, triangles, vertices, polygons);
  MAILLE_CHECK(run_polygons(machine, reader));
  if (!machine.complete()) return corrupt("the fans have another number of vertices or faces");
  surface.vertices = vertices;
  surface.find_polygon_references();
  return surface;
}

}  // namespace maille
