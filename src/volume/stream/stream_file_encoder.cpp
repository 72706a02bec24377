#include "volume/stream/stream_file.h"

#include <maille/stream.h>

#include <algorithm>
#include <deque>
#include <numeric>

#include "base/pace.h"
#include "base/result.h"
#include "mesh/space_curve.h"
#include "surface/arrays/array_report.h"
#include "volume/order/cell_order.h"
#include "volume/order/gate_order.h"
#include "volume/order/mesh_order.h"
#include "volume/stream/mesh_stream.h"
#include "volume/stream/numbered_arrays.h"
#include "volume/stream/table_maps.h"

namespace maille {
namespace {

/// The arrays of a mesh on points and cells, with zeros in the stead of numbers (numbered_arrays.h). Pointers
/// go to the mesh, which must outlive this, or to the zeros here; a deque, as it never moves them.
class StreamedArrays {
 public:
  explicit StreamedArrays(const Mesh& mesh) {
    for (const Array& array : mesh.arrays) {
      if (array.domain == Domain::mesh) continue;
      arrays.push_back(&array);
      auto found = find_numbered(array, arrays.size() - 1);
      if (!found) continue;
      numbered.push_back(std::move(*found));
      Array& zeros = zeros_.emplace_back(array);
      zeros.bytes.assign(array.bytes.size(), std::byte{0});
      arrays.back() = &zeros;
    }
  }
  bool has_numbered(Domain domain) const {
    return std::any_of(numbered.begin(), numbered.end(),
                       [&](const NumberedArray& each) { return arrays[each.array]->domain == domain; });
  }
  bool is_numbered(size_t i) const {
    return std::any_of(numbered.begin(), numbered.end(),
                       [&](const NumberedArray& each) { return each.array == i; });
  }

  std::vector<const Array*> arrays;
  std::vector<NumberedArray> numbered;

 private:
  std::deque<Array> zeros_;
};

/// Points of a mesh in memory, as the writer wants them: values are copied when a point comes up, so that
/// none waits in the writer.
class MeshPoints final : public PointSource {
 public:
  /// `order`: gets the numbers as they are asked for; may be nullptr.
  MeshPoints(const Mesh& mesh, const StreamedArrays& streamed, std::vector<uint32_t>* order) : order_(order) {
    add(mesh.points);
    for (const Array* array : streamed.arrays) {
      if (array->domain == Domain::point) add(*array);
    }
  }
  Result<> read(uint64_t number, std::byte* out) override {
    for (const auto& [bytes, size] : columns_) out = std::copy_n(bytes + number * size, size, out);
    if (order_ != nullptr) order_->push_back(static_cast<uint32_t>(number));
    return {};
  }

 private:
  void add(const Array& array) { columns_.emplace_back(array.bytes.data(), array.tuple_size()); }
  std::vector<std::pair<const std::byte*, size_t>> columns_;
  std::vector<uint32_t>* order_;
};

// Of a mesh in memory no range is declared: maps are chosen by all numbers.
StreamArray describe(const Array& array, const Tolerance& tolerance) {
  return {array.name, array.domain, array.type, array.components, array.role, array.labels, tolerance, {}};
}

/// When each point is used last, counted in cells as written; none for points that no cell uses. It is what
/// the flags of last use follow from.
std::vector<uint64_t> last_cells(const Mesh& mesh, const CellOrders& orders) {
  std::vector<uint64_t> last(mesh.point_count(), ~uint64_t{0});
  uint64_t time = 0;
  for (size_t b = 0; b < mesh.blocks.size(); ++b) {
    const CellBlock& block = mesh.blocks[b];
    const uint64_t nodes = nodes_of(block.type);
    if (nodes != 0 && orders[b].empty()) {
      const uint64_t cells = block.connectivity.size() / nodes;
      // Blocks of one size in their order need no look at offsets or orders: nearly all meshes.
      const uint32_t* point = block.connectivity.data();
      for (uint64_t i = 0; i < cells; ++i, ++time) {
        for (uint64_t k = 0; k < nodes; ++k) last[*point++] = time;
      }
      continue;
    }
    for (uint64_t i = 0; i < block.size(); ++i, ++time) {
      for (const uint32_t point : block.cell(orders[b].empty() ? i : orders[b][i])) last[point] = time;
    }
  }
  return last;
}

/// In which order cells are written, when each point is used last then, and the bytes that give the input's
/// order back if that is to be kept. There are four ways: as they are, at gates, as the front meets them, and
/// the last two with the input's order apart.
struct Ordering {
  CellOrders orders;
  std::vector<uint64_t> last;
  std::optional<CodedOrder> apart;
  bool by_front = false;         ///< not as they are in the input: few cells are found on the fast path
  std::vector<uint8_t> borders;  ///< where cells come at gates
  CellTurns turns;

  Ordering(const Mesh& mesh, CellOrders cells, bool front)
      : orders(std::move(cells)),
        last(last_cells(mesh, orders)),
        by_front(front),
        turns(mesh.blocks.size()) {}
};
Ordering as_they_are(const Mesh& mesh) {
  return {mesh, CellOrders(mesh.blocks.size()), false};
}
// Block by block: cells of different blocks are never mixed up.
Ordering in_front_order(const Mesh& mesh) {
  CellOrders orders;
  for (const CellBlock& block : mesh.blocks) orders.push_back(front_order(block));
  return {mesh, std::move(orders), true};
}

/// `turned`: cells may begin with another corner, so that they come by the lowest face they can
/// (docs/encoder.md, "Any order").
Ordering at_gates(const Mesh& mesh, bool turned) {
  GateOrder found = gate_order(mesh, turned);
  Ordering ordering(mesh, std::move(found.cells), true);
  ordering.borders = std::move(found.borders);
  ordering.turns = std::move(found.turns);
  return ordering;
}

/// At gates; as the front meets them where there are cells without shape, or polygons alone: connectivity of
/// these takes 4 to 5 % more at gates (mesh_cht_3cyl; docs/history.md, "Gates instead of the front"), and
/// positions lose more than gates save.
Ordering in_coded_order(const Mesh& mesh, bool turned) {
  const bool solids = std::any_of(mesh.blocks.begin(), mesh.blocks.end(),
                                  [](const CellBlock& block) { return has_cells_of(block, 3); });
  return solids && all_have_shapes(mesh) ? at_gates(mesh, turned) : in_front_order(mesh);
}

/// What of the input's order must come back: all, or only numbers of points and cells, with any corner first.
struct KeptOrder {
  bool points_only = false;
  bool turned = false;
};

// Gates with a plain order beside them, as effort 1 has it: nothing is mixed.
Ordering at_gates_apart(const Mesh& mesh, KeptOrder kept) {
  Ordering gates = at_gates(mesh, kept.turned);
  gates.apart = encode_plain_order(mesh, gates.orders, gates.turns, kept.points_only);
  return gates;
}

/// What the connectivity of the first cells takes in an order; with the numbers of points if they are kept.
/// Mostly it is tried without mixing: that makes all orders smaller, and takes longer. It runs the same coder
/// as the writer, on a hull of its own, and can go on from where it stopped.
class Trial {
 public:
  Trial(const Mesh& mesh, const Ordering& ordering, bool numbered = false, Mixing mixing = Mixing::none)
      : mesh_(mesh), ordering_(ordering), numbered_(numbered), coder_(mixing, numbered) {
    if (!ordering.borders.empty()) coder_.use_gates(&ordering.borders);
  }

  /// Goes on until so many cells are done, or all.
  void run(uint64_t most_cells) {
    for (; block_ < mesh_.blocks.size(); ++block_, in_block_ = 0) {
      const CellBlock& block = mesh_.blocks[block_];
      const uint64_t size = block.size();
      for (; in_block_ < size && done_ < most_cells; ++done_) code(block, ordering_.orders[block_]);
      if (in_block_ < size) return;
    }
  }
  uint64_t cells() const { return done_; }
  /// So far, to some bytes.
  uint64_t bytes() const { return topology_.size() + (numbered_ ? numbers_.size() : 0); }

 private:
  void code(const CellBlock& block, const std::vector<uint64_t>& order) {
    const uint64_t number = order.empty() ? in_block_ : order[in_block_];
    ++in_block_;
    cell_.kind = kind_of(block.type_of(number));
    // Cells without shape would need the memory of faces; orders are compared by the others.
    if (cell_.kind >= shape_count) return;
    std::array<uint32_t, most_corners> room;
    const auto points = turned_points(block, number, ordering_.turns[block_], room);
    cell_.final = 0;
    for (size_t k = 0; k < points.size(); ++k) {
      cell_.number[k] = points[cell_shapes[cell_.kind].place[k]];
      cell_.final |= (ordering_.last[cell_.number[k]] == done_ ? 1u : 0u) << k;
    }
    coder_.code(topology_, numbers_, cell_, out_);
    if (out_.size() < cells_per_block) return;
    out_.clear();
    coder_.end_block();
  }

  const Mesh& mesh_;
  const Ordering& ordering_;
  bool numbered_;
  CellCoder<RangeEncoder> coder_;
  RangeEncoder topology_, numbers_;
  CodedCells out_;
  StreamedCell cell_;
  size_t block_ = 0;
  uint64_t in_block_ = 0, done_ = 0;
};

/// Some thousand cells mostly tell; more are tried where they do not. Scattered cells take long to try. These
/// are choices of the encoder (docs/encoder.md, "Order"): chosen, with 4,000 instead of 20,000 cells where
/// that is enough since c3f90de.
constexpr uint64_t fewest = 1'000, few = 4'000, sample = 20'000;

// Positions and all arrays on points and cells: what mixing of values would take time for.
uint64_t count_numbers(const Mesh& mesh) {
  uint64_t numbers = mesh.point_count() * 3;
  for (const Array& array : mesh.arrays)
    numbers += array.domain == Domain::mesh ? 0 : array.count() * array.components;
  return numbers;
}

// Numbers of arrays with a bound, without positions, which are mixed only where all values are.
uint64_t count_bounded(const Mesh& mesh, const std::vector<double>& bounds) {
  uint64_t numbers = 0;
  size_t next = 0;
  for (const Array& array : mesh.arrays) {
    if (array.domain == Domain::mesh) continue;
    if (bounds[++next] > 0) numbers += array.count() * array.components;
  }
  return numbers;
}

/// Where all cells are of one type, the first ones stand for all: not so where a mesh begins with the cells
/// of its boundary.
bool all_alike(const Mesh& mesh) {
  return mesh.blocks.size() == 1 && mesh.blocks[0].type != CellType::mixed;
}

/// The order for files that keep the input's: as it is, unless cells come so scattered that the order of the
/// front is smaller with the input's order beside it. It goes from the cheapest look to the dearest, and
/// stops as soon as the answer is clear. `kept`: what must come back.
Ordering keep_order(const Mesh& mesh, int effort, Executor& executor, KeptOrder kept) {
  const Mixing mixing = mixing_at(effort);
  constexpr uint64_t scattered = 1;  // bytes a cell: less is a good order already
  Ordering given = as_they_are(mesh);
  const uint64_t cells = mesh.cell_count();
  // Orders apart number cells by 32 bits, and know the faces of cells with a shape only.
  if (cells >= no_cell || !all_have_shapes(mesh)) return given;
  Trial natural(mesh, given, true);
  const bool plain_order = effort_of(effort).plain_order;
  // At effort 1 the order apart is plain, which takes about the same whatever the order: more than two bytes
  // a cell of the first thousand and it is better.
  if (plain_order && all_alike(mesh)) {
    natural.run(fewest);
    if (natural.bytes() > 2 * scattered * natural.cells()) return at_gates_apart(mesh, kept);
  }
  natural.run(few);
  const bool alike = all_alike(mesh);
  if (alike && 2 * natural.bytes() <= scattered * natural.cells()) return given;
  if (natural.bytes() <= 2 * scattered * natural.cells()) {
    natural.run(sample);
    if (natural.bytes() <= scattered * natural.cells()) return given;
  }
  if (plain_order) return at_gates_apart(mesh, kept);
  std::optional<Ordering> front;
  // What the other order takes in all: the order apart, which is known, and connectivity, carried over from
  // the first cells.
  uint64_t apart = 0;
  executor.parallel_for(2, [&](size_t task) {
    if (task == 1) return natural.run(2 * few);
    front = in_coded_order(mesh, kept.turned);
    Trial trial(mesh, *front);
    trial.run(2 * few);
    front->apart = encode_order(mesh, front->orders, front->turns, mixing, kept.points_only);
    apart = front->apart->points.size() + front->apart->cells.size() + trial.bytes() * cells / trial.cells();
  });
  // The more points are in memory, the more a scattered cell takes: what is a quarter larger now will stay
  // so.
  if (4 * natural.bytes() * cells <= 5 * apart * natural.cells()) natural.run(sample);
  return natural.bytes() * cells <= apart * natural.cells() ? std::move(given) : std::move(*front);
}

/// Where any order will do: as they are, if that is a good order, else as in_coded_order() has them. Both
/// orders are tried mixed where the file will be.
Ordering any_order(const Mesh& mesh, int effort) {
  const Mixing mixing = mixing_at(effort);
  Ordering given = as_they_are(mesh);
  Trial natural(mesh, given, false, mixing);
  if (effort_of(effort).gates_untried && all_have_shapes(mesh)) {
    natural.run(fewest);
    if (4 * natural.bytes() <= natural.cells()) natural.run(sample);
    return 4 * natural.bytes() <= natural.cells() ? std::move(given) : in_coded_order(mesh, true);
  }
  natural.run(few);
  constexpr uint64_t regular = 16;  // cells a byte: no other order makes these much smaller
  if (all_alike(mesh) && regular * natural.bytes() <= natural.cells()) {
    natural.run(sample);
    if (regular * natural.bytes() <= natural.cells()) return given;
  }
  Ordering other = in_coded_order(mesh, true);
  Trial trial(mesh, other, false, mixing);
  trial.run(natural.cells());
  // Within a factor of two the first cells may mislead: more of both are looked at.
  if (natural.bytes() <= 2 * trial.bytes() && trial.bytes() <= 2 * natural.bytes()) {
    natural.run(sample);
    trial.run(sample);
  }
  return trial.bytes() < natural.bytes() ? std::move(other) : std::move(given);
}

/// Numbers of elements cost nothing where the order is kept, and as much as it in another: a file with such
/// numbers keeps its order, at least of the elements that have them.
Ordering choose_orders(const Mesh& mesh, const StreamedArrays& streamed, const EncodeOptions& options,
                       Executor& executor) {
  if (options.order == Order::keep) return keep_order(mesh, options.effort, executor, {});
  if (streamed.numbered.empty()) return any_order(mesh, options.effort);
  const KeptOrder kept = {.points_only = !streamed.has_numbered(Domain::cell), .turned = true};
  return keep_order(mesh, options.effort, executor, kept);
}

/// Hands the cells of a mesh to a writer, some hundred or a block at a time. The writer keeps no reference
/// beyond the call.
class MeshFeeder {
 public:
  MeshFeeder(const Mesh& mesh, const StreamedArrays& streamed, StreamWriter& writer, const Ordering& ordering,
             const EncodeOptions& options)
      : mesh_(mesh),
        writer_(writer),
        orders_(ordering.orders),
        turns_(ordering.turns),
        last_(ordering.last),
        pace_(options.progress, "cells", mesh.cell_count()),
        executor_(options.executor ? *options.executor : serial_executor()),
        any_order_(options.order == Order::canonical && streamed.numbered.empty()) {
    for (const Array* array : streamed.arrays) {
      if (array->domain == Domain::cell) columns_.push_back(array);
    }
    arrays_.resize(columns_.size());
  }
  Result<> feed() {
    for (size_t b = 0; b < mesh_.blocks.size(); ++b) {
      const CellBlock& block = mesh_.blocks[b];
      MAILLE_CHECK(writer_.begin_block(block.name, block.type));
      const bool plain = orders_[b].empty() && nodes_of(block.type) != 0;
      if (plain) MAILLE_CHECK(feed_plain(block));
      for (uint64_t i = 0; i < block.size() && !plain;) i += MAILLE_TRY(feed_run(block, b, i));
      first_ += block.size();
    }
    return writer_.end_points(unused_points());
  }

 private:
  /// Points without cells, which come last. In any order: along a Hilbert curve, so that each is near the one
  /// before; 13,644 such points in random order cost 20 of 52 bits in bumpy_torus (docs/history.md).
  std::vector<uint64_t> unused_points() const {
    std::vector<uint64_t> unused;
    std::vector<Vector3> places;
    const size_t size = size_of(mesh_.points.type);
    for (uint64_t point = 0; point < last_.size(); ++point) {
      if (last_[point] != ~uint64_t{0}) continue;
      unused.push_back(point);
      for (unsigned k = 0; any_order_ && k < 3; ++k) {
        if (k == 0) places.emplace_back();
        // A curve needs finite numbers: the others stand at 0.
        const double x =
            number_as_double(mesh_.points.type, mesh_.points.bytes.data() + (3 * point + k) * size);
        places.back()[k] = x > -1e300 && x < 1e300 ? x : 0;
      }
    }
    if (any_order_) sort_along_curve<uint64_t>(places, unused);
    return unused;
  }
  /// Some hundred cells of one type and size; returns how many. 512: chosen, no sweep is on record; enough
  /// that the writer's checks are paid once for many cells.
  Result<uint64_t> feed_run(const CellBlock& block, size_t b, uint64_t first) {
    const std::vector<uint64_t>& order = orders_[b];
    std::array<uint32_t, most_corners> room;
    const auto cell_at = [&](uint64_t i) { return order.empty() ? i : order[i]; };
    const auto type_of = [&](uint64_t i) {
      return block.type == CellType::mixed ? static_cast<CellType>(block.types[cell_at(i)]) : block.type;
    };
    const size_t nodes = block.cell(cell_at(first)).size();
    const bool single = nodes == 0 || type_of(first) == CellType::polyhedron;
    const uint64_t most = single ? 1 : std::min<uint64_t>(512, block.size() - first);
    numbers_.clear();
    finals_.clear();
    for (auto& bytes : arrays_) bytes.clear();
    uint64_t count = 0;
    for (; count < most && type_of(first + count) == type_of(first); ++count) {
      const uint64_t cell = cell_at(first + count);
      if (!order.empty()) ask_ahead(block, order, first + count);
      if (block.cell(cell).size() != nodes) break;
      for (const uint32_t point : turned_points(block, cell, turns_[b], room)) {
        numbers_.push_back(point);
        finals_.push_back(last_[point] == first_ + first + count);
      }
      for (size_t k = 0; k < columns_.size(); ++k) {
        const size_t size = columns_[k]->tuple_size();
        const auto from = columns_[k]->bytes.begin() + static_cast<ptrdiff_t>((first_ + cell) * size);
        arrays_[k].insert(arrays_[k].end(), from, from + static_cast<ptrdiff_t>(size));
      }
      if (!pace_.step()) return cancelled();
    }
    const std::vector<Bytes> arrays(arrays_.begin(), arrays_.end());
    if (type_of(first) == CellType::polyhedron) {
      MAILLE_CHECK(writer_.add_polyhedron(block.faces(cell_at(first)), numbers_, finals_, arrays));
      return count;
    }
    MAILLE_CHECK(writer_.add_cells(type_of(first), numbers_, finals_, arrays, nodes));
    return count;
  }

  /// In another order than the mesh's a cell and its points are anywhere in memory: hints that those of the
  /// next cells are wanted soon. Points are asked for once their cell has come, hence two distances; neither
  /// was swept. No byte depends on them.
  void ask_ahead(const CellBlock& block, const std::vector<uint64_t>& order, uint64_t i) const {
    constexpr uint64_t cell_ahead = 24, points_ahead = 8;
    const uint64_t nodes = nodes_of(block.type);
    if (nodes == 0 || i + cell_ahead >= order.size()) return;
    __builtin_prefetch(&block.connectivity[order[i + cell_ahead] * nodes]);
    const uint32_t* const points = &block.connectivity[order[i + points_ahead] * nodes];
    for (uint64_t k = 0; k < nodes; ++k) __builtin_prefetch(&last_[points[k]]);
  }

  /// Cells of one type in their order: while some are coded the next ones are made ready. Two runs take
  /// turns, each a whole block, which the writer codes in place.
  Result<> feed_plain(const CellBlock& block) {
    const size_t nodes = nodes_of(block.type);
    const uint64_t cells = block.connectivity.size() / nodes;
    std::array<Run, 2> runs;
    fill(block, 0, std::min<uint64_t>(cells, cells_per_block), runs[0]);
    for (uint64_t first = 0, k = 0; first < cells; first += cells_per_block, k = 1 - k) {
      const uint64_t next = first + cells_per_block;
      Result<> added;
      executor_.parallel_for(2, [&](size_t task) {
        if (task == 0) {
          added = writer_.add_cells(block.type, runs[k].numbers, runs[k].finals, runs[k].arrays, nodes);
        } else if (next < cells) {
          fill(block, next, std::min<uint64_t>(cells - next, cells_per_block), runs[1 - k]);
        }
      });
      MAILLE_CHECK(added);
      if (!pace_.advance(std::min<uint64_t>(cells - first, cells_per_block))) return cancelled();
    }
    return {};
  }

  struct Run {
    std::vector<uint64_t> numbers;
    std::vector<uint8_t> finals;
    std::vector<Bytes> arrays;
  };
  void fill(const CellBlock& block, uint64_t first, uint64_t count, Run& run) const {
    const size_t nodes = nodes_of(block.type);
    const auto points = std::span(block.connectivity).subspan(first * nodes, count * nodes);
    run.numbers.resize(points.size());
    run.finals.resize(points.size());
    // Through plain pointers: bytes could be anything, so members would be read again after each.
    const uint32_t* point = points.data();
    const uint64_t* const last = last_.data();
    uint64_t* number = run.numbers.data();
    uint8_t* final = run.finals.data();
    for (uint64_t time = first_ + first, end = time + count; time < end; ++time) {
      for (size_t k = 0; k < nodes; ++k) {
        number[k] = point[k];
        final[k] = last[point[k]] == time;
      }
      point += nodes, number += nodes, final += nodes;
    }
    run.arrays.clear();
    for (const Array* column : columns_) {
      const size_t size = column->tuple_size();
      run.arrays.push_back(Bytes(column->bytes).subspan((first_ + first) * size, count * size));
    }
  }

  const Mesh& mesh_;
  StreamWriter& writer_;
  const CellOrders& orders_;
  const CellTurns& turns_;
  const std::vector<uint64_t>& last_;
  Pace pace_;
  Executor& executor_;
  bool any_order_;
  std::vector<const Array*> columns_;
  uint64_t first_ = 0;  ///< cells of the blocks before
  std::vector<uint64_t> numbers_;
  std::vector<uint8_t> finals_;
  std::vector<std::vector<std::byte>> arrays_;
};

/// As many cells as table trials need, in the order in which they will be written.
FirstCells first_cells_of(const Mesh& mesh, const Ordering& ordering) {
  FirstCells first(ordering.borders.empty() ? nullptr : &ordering.borders);
  std::array<uint32_t, most_corners> room;
  uint64_t before = 0, done = 0;
  for (size_t b = 0; b < mesh.blocks.size(); before += mesh.blocks[b++].size()) {
    const CellBlock& block = mesh.blocks[b];
    const std::vector<uint64_t>& order = ordering.orders[b];
    for (uint64_t i = 0; i < block.size(); ++i, ++done) {
      if (done == FirstCells::most) return first;
      const uint64_t cell = order.empty() ? i : order[i];
      first.add(block.type_of(cell), turned_points(block, cell, ordering.turns[b], room), before + cell);
    }
  }
  return first;
}

// Only for arrays without loss: a lattice has even codes already. Arrays of numbers are zeros here.
Result<> add_tables(const Mesh& mesh, const StreamedArrays& streamed, const Ordering& ordering, int effort,
                    ArrayMapsList& maps) {
  TableSearch tables(mixes_values(effort, maps.mixing_is_fast),
                     [&] { return first_cells_of(mesh, ordering); });
  if (maps.bounds[0] == 0) MAILLE_CHECK(tables.add_tables(mesh.points, maps.maps[0]));
  for (size_t i = 0; i < streamed.arrays.size(); ++i) {
    if (maps.bounds[i + 1] == 0 && !streamed.is_numbered(i))
      MAILLE_CHECK(tables.add_tables(*streamed.arrays[i], maps.maps[i + 1]));
  }
  return {};
}

/// Array i, positions being 0.
ArrayReport report_of(const Array& array, const Tolerance& asked, const ArrayMapsList& maps,
                      const StreamReport& stream, size_t i) {
  ArrayReport report = report_of(array);
  report.coded_bytes = i == 0 ? stream.position_bytes : stream.array_bytes[i - 1];
  add_error(maps, stream, asked, i, report);
  return report;
}

EncodeReport report_of(const Mesh& mesh, const EncodeOptions& options, const StreamReport& stream,
                       const ArrayMapsList& maps, const std::optional<CodedOrder>& order) {
  EncodeReport report = report_of(mesh);
  report.file_bytes = stream.file_bytes;
  report.connectivity.coded_bytes = stream.cell_bytes + (order ? order->cells.size() : 0);
  report.order_bytes = stream.number_bytes + (order ? order->points.size() : 0);
  report.positions = report_of(mesh.points, options.positions, maps, stream, 0);
  size_t next = 0;
  for (const Array& array : mesh.arrays) {
    if (array.domain == Domain::mesh) {
      report.arrays.push_back(report_of(array));
      continue;
    }
    report.arrays.push_back(report_of(array, tolerance_of(options, array.name), maps, stream, next + 1));
    ++next;
  }
  set_other_bytes(report);
  return report;
}

}  // namespace

/// What encode() is told about arrays that the mesh does not have is an error, not a word that gets lost.
Result<StreamOptions> stream_options_of(const Mesh& mesh, const EncodeOptions& options) {
  StreamOptions stream;
  stream.positions = describe(mesh.points, options.positions);
  for (const Array& array : mesh.arrays) {
    const Tolerance tolerance = tolerance_of(options, array.name);
    if (array.domain == Domain::mesh) {
      stream.mesh_arrays.push_back(array);
    } else {
      stream.arrays.push_back(describe(array, tolerance));
    }
  }
  for (const auto& [name, tolerance] : options.arrays) {
    const auto same_name = [&name = name](const Array& array) { return array.name == name; };
    if (std::none_of(mesh.arrays.begin(), mesh.arrays.end(), same_name)) {
      return failure(ErrorCode::usage, "the mesh has no array named \"" + name + "\"");
    }
  }
  return complete_options(mesh, options, std::move(stream));
}

Result<EncodeReport> encode_stream(const Mesh& mesh, Sink& sink, const EncodeOptions& options) {
  MAILLE_CHECK(validate(mesh));
  StreamOptions stream = MAILLE_TRY(stream_options_of(mesh, options));
  ArrayMapsList maps = MAILLE_TRY(choose_stream_maps(mesh, stream));
  return encode_stream_by(mesh, sink, options, std::move(stream), std::move(maps));
}

/// Order first, as it says whether mixing will be fast, and which cells come first; then tables, which need
/// that; then all goes through the writer.
Result<EncodeReport> encode_stream_by(const Mesh& mesh, Sink& sink, const EncodeOptions& options,
                                      StreamOptions stream_options, ArrayMapsList maps,
                                      std::vector<uint32_t>* coded_points) {
  const StreamedArrays streamed(mesh);
  MeshPoints points(mesh, streamed, coded_points);
  stream_options.points = &points;
  maps.numbered = streamed.numbered;
  set_maps_of_zeros(maps);
  Executor& executor = options.executor ? *options.executor : serial_executor();
  const Ordering ordering = choose_orders(mesh, streamed, options, executor);
  maps.mixing_is_fast = mixing_is_fast(count_numbers(mesh), mesh.cell_count(), ordering.by_front);
  maps.bounded_numbers = count_bounded(mesh, maps.bounds);
  maps.borders = ordering.borders;
  // A mesh with numbers of elements keeps the order of those that have them.
  stream_options.any_order = stream_options.any_order && streamed.numbered.empty();
  const bool points_keep_order = !stream_options.any_order || ordering.apart;
  // What is written then counts as any order, and the order apart makes up for it.
  if (ordering.apart) {
    stream_options.any_order = true;
    maps.order_apart = join_order(*ordering.apart);
  }
  MAILLE_CHECK(add_tables(mesh, streamed, ordering, options.effort, maps));
  StreamWriter writer = MAILLE_TRY(begin_with_maps(sink, std::move(stream_options), maps));
  MAILLE_CHECK(MeshFeeder(mesh, streamed, writer, ordering, options).feed());
  // From here on the file is complete; what follows is for the caller.
  const StreamReport stream = MAILLE_TRY(writer.finish());
  if (points_keep_order && coded_points != nullptr) {
    coded_points->resize(mesh.point_count());
    std::iota(coded_points->begin(), coded_points->end(), 0u);
  }
  return report_of(mesh, options, stream, maps, ordering.apart);
}

}  // namespace maille
