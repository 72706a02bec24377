#include <maille/stream.h>
#include <maille/version.h>

#include <algorithm>
#include <cmath>

#include "base/result.h"
#include "volume/order/delay_buffer.h"
#include "volume/stream/mesh_stream.h"
#include "volume/stream/stream_batches.h"

namespace maille {
namespace {

/// Ends of points that wait for a block of cells: a mesh of points only has as many as points, and none of
/// its cells would ever end the block.
constexpr size_t most_ended = 1 << 16;

}  // namespace

/// The half of StreamWriter that takes cells and points in, checks them, and holds cells back. The other half
/// (StreamBatches) codes. What is given is checked here as strictly as if it came from a file: no number,
/// size or type of the caller reaches the coder unchecked.
class StreamWriter::Implementation {
 public:
  Implementation(Sink& sink, StreamOptions options, StreamHeader header, std::vector<std::byte> order_apart,
                 std::vector<uint8_t> borders, FileWriter file)
      : batches_(sink, std::move(options), std::move(header), std::move(order_apart), std::move(borders),
                 std::move(file)) {
    if (options_.delay > 0) delay_.emplace(options_.delay);
  }

  template <class NumberAt>
  Result<> add_points(uint64_t count, NumberAt number_at, Bytes positions, std::span<const Bytes> arrays);
  Result<> begin_block(std::string name, CellType type);
  // Cells of one type and size; their order is the order of the file unless cells are delayed.
  Result<> add_cells(CellType type, std::span<const uint64_t> connectivity, std::span<const uint8_t> last_use,
                     std::span<const Bytes> arrays, size_t nodes);
  Result<> add_polyhedron(std::span<const uint32_t> face_sizes, std::span<const uint64_t> connectivity,
                          std::span<const uint8_t> last_use, std::span<const Bytes> arrays);
  Result<> end_points(std::span<const uint64_t> numbers);
  Result<> flush();
  Result<StreamReport> finish();
  size_t position_size() const { return options_.positions.tuple_size(); }

 private:
  unsigned kind_in_block(CellType type, size_t nodes) const;
  Result<> check_cells(CellType type, size_t count, size_t nodes, std::span<const uint8_t> last_use,
                       std::span<const Bytes> arrays) const;
  Result<> add_alike(unsigned kind, CellType type, std::span<const uint64_t> numbers,
                     std::span<const uint8_t> last_use, std::span<const Bytes> arrays, size_t count);
  Result<> add_cell(unsigned kind, CellType type, std::span<const uint64_t> numbers,
                    std::span<const uint8_t> last_use, std::span<const uint32_t> face_sizes, size_t i,
                    size_t count, std::span<const Bytes> arrays);
  Result<> add_values(size_t i, size_t count, std::span<const Bytes> arrays);
  Result<> add_delayed();
  Result<> add_all_delayed();

  // The intake, the tail and the waiting points belong to the coding half; this half fills them between two
  // calls of run().
  StreamBatches batches_;
  const StreamOptions& options_ = batches_.options();
  Intake& intake_ = batches_.intake;
  StreamTail& tail_ = batches_.tail;
  std::optional<DelayBuffer> delay_;
  std::array<uint64_t, 256> cells_of_type_{};
  std::vector<uint64_t> sorted_;
  uint64_t cells_given_ = 0;
};

/// How cells of the type are coded in the block that is open.
unsigned StreamWriter::Implementation::kind_in_block(CellType type, size_t nodes) const {
  // Polygons of three and four corners are triangles and quads with another name, which the block remembers.
  const bool polygons = !tail_.blocks.empty() && tail_.blocks.back().type == CellType::polygon;
  if (polygons && type == CellType::polygon && nodes == 3) return kind_of(CellType::triangle);
  if (polygons && type == CellType::polygon && nodes == 4) return kind_of(CellType::quad);
  const unsigned kind = kind_of(type);
  // A polygon with more corners than FaceCoder takes is a list of points.
  return kind == face_cell && type == CellType::polygon && nodes > most_face_corners ? loose_cell : kind;
}

/// Values of points, which wait until a cell has them. `number_at(i)`: the number of the i-th. Only points
/// that no cell has had yet are known here: that a point comes again after its last use is told when a cell
/// asks for it.
template <class NumberAt>
Result<> StreamWriter::Implementation::add_points(uint64_t count, NumberAt number_at, Bytes positions,
                                                  std::span<const Bytes> arrays) {
  // Position and arrays of each point go side by side into the waiting points, in the order of the options.
  std::vector<std::pair<const std::byte*, size_t>> parts;
  const auto add_part = [&](Bytes bytes, const StreamArray& array) {
    parts.emplace_back(bytes.data(), array.tuple_size());
    return bytes.size() == count * array.tuple_size();
  };
  bool fit = add_part(positions, options_.positions);
  size_t next = 0;
  for (const StreamArray& array : options_.arrays) {
    if (array.domain != Domain::point) continue;
    fit = fit && next < arrays.size() && add_part(arrays[next], array);
    ++next;
  }
  if (!fit || next != arrays.size())
    return failure(ErrorCode::usage, "values of points do not have the size declared");
  for (uint64_t i = 0; i < count; ++i) {
    const uint64_t number = number_at(i);
    // WaitingPoints keeps number + 1, so the largest number cannot be told from none.
    if (number == ~uint64_t{0} || batches_.waiting.has(number)) {
      return failure(ErrorCode::usage, "point " + std::to_string(number) + " was given twice");
    }
    std::byte* out = batches_.waiting.add(number);
    for (const auto& [bytes, size] : parts) out = std::copy_n(bytes + i * size, size, out);
  }
  return {};
}

/// All cells held back belong to the block before.
Result<> StreamWriter::Implementation::begin_block(std::string name, CellType type) {
  if (std::string_view(name_of(type)) == "unknown")
    return failure(ErrorCode::usage, "a block of an unknown cell type");
  MAILLE_CHECK(add_all_delayed());
  intake_.blocks.push_back({batches_.records(), name, type});
  tail_.blocks.push_back({std::move(name), type, 0});
  return {};
}

/// What is given of `count` cells of one type and size; the error names the first of these cells.
Result<> StreamWriter::Implementation::check_cells(CellType type, size_t count, size_t nodes,
                                                   std::span<const uint8_t> last_use,
                                                   std::span<const Bytes> arrays) const {
  const auto wrong = [&](const std::string& what) {
    return failure(ErrorCode::malformed_input, "cell " + std::to_string(cells_given_) + ": " + what);
  };
  const CellType block = tail_.blocks.back().type;
  if (block != CellType::mixed && block != type) {
    return wrong(std::string(name_of(type)) + " in a block of type " + name_of(block));
  }
  // "mixed" is a type of blocks only.
  if (type == CellType::mixed || std::string_view(name_of(type)) == "unknown") return wrong("unknown type");
  const unsigned needed = nodes_of(type);
  // Also a bound for what one record takes in memory and in the file.
  if ((needed != 0 && nodes != needed) || nodes > most_loose_nodes) {
    return wrong(std::string(name_of(type)) + " with " + std::to_string(nodes) + " nodes");
  }
  if (!last_use.empty() && last_use.size() != count * nodes) return wrong("flags of last use do not fit");
  size_t next = 0;
  for (const StreamArray& array : options_.arrays) {
    if (array.domain != Domain::cell) continue;
    if (next >= arrays.size() || arrays[next].size() != count * array.tuple_size()) {
      return wrong("values of \"" + array.name + "\" do not have the size declared");
    }
    ++next;
  }
  // Fewer were found above, more are found here.
  return next == arrays.size() ? Result<>{} : wrong("more arrays than declared");
}

/// Takes cells of one type, `nodes` each (0: as many as the type has). Flags of last use, if any, are one for
/// each node.
Result<> StreamWriter::Implementation::add_cells(CellType type, std::span<const uint64_t> connectivity,
                                                 std::span<const uint8_t> last_use,
                                                 std::span<const Bytes> arrays, size_t nodes) {
  if (type == CellType::polyhedron) return failure(ErrorCode::usage, "polyhedra come by add_polyhedron()");
  if (tail_.blocks.empty()) MAILLE_CHECK(begin_block("", CellType::mixed));
  if (nodes == 0) nodes = nodes_of(type);
  if (nodes == 0 ? !connectivity.empty() : connectivity.size() % nodes != 0) {
    return failure(ErrorCode::malformed_input,
                   "the number of nodes of a " + std::string(name_of(type)) + " is not clear");
  }
  // A cell without any node is one cell.
  const size_t count = nodes == 0 ? 1 : connectivity.size() / nodes;
  if (count == 0) return {};
  MAILLE_CHECK(check_cells(type, count, nodes, last_use, arrays));
  const unsigned kind = kind_in_block(type, nodes);
  cells_of_type_[static_cast<uint8_t>(type)] += count;
  if (!delay_) return add_alike(kind, type, connectivity, last_use, arrays, count);
  for (size_t i = 0; i < count; ++i) {
    MAILLE_CHECK(add_cell(kind, type, connectivity.subspan(i * nodes, nodes),
                          last_use.empty() ? last_use : last_use.subspan(i * nodes, nodes), {}, i, count,
                          arrays));
  }
  return {};
}

/// Cells of one size, as many at once as a block has room for.
Result<> StreamWriter::Implementation::add_alike(unsigned kind, CellType type,
                                                 std::span<const uint64_t> numbers,
                                                 std::span<const uint8_t> last_use,
                                                 std::span<const Bytes> arrays, size_t count) {
  const size_t nodes = numbers.size() / count;
  for (size_t i = 0; i < count;) {
    const size_t some = std::min<size_t>(count - i, cells_per_block - intake_.records.size());
    tail_.blocks.back().cells += some;
    cells_given_ += some;
    tail_.corners += some * nodes;
    intake_.records.insert(intake_.records.end(), some,
                           {static_cast<uint8_t>(kind), type, static_cast<uint32_t>(nodes), 0});
    const auto append = [&](auto& to, const auto& from, size_t size) {
      const auto begin = from.begin() + static_cast<ptrdiff_t>(i * size);
      to.insert(to.end(), begin, begin + static_cast<ptrdiff_t>(some * size));
    };
    // A full block that begins with an empty intake is coded from where the caller has it. This is sound as
    // is_full() is true below, so that run() is done with it before this returns.
    if (intake_.numbers.empty() && some == cells_per_block && !last_use.empty() && intake_.ended.empty()) {
      intake_.given_numbers = numbers.subspan(i * nodes, some * nodes);
      intake_.given_last_use = last_use.subspan(i * nodes, some * nodes);
    } else {
      append(intake_.numbers, numbers, nodes);
      if (last_use.empty()) {
        intake_.last_use.resize(intake_.numbers.size());
      } else {
        append(intake_.last_use, last_use, nodes);
      }
    }
    for (size_t k = 0; k < arrays.size(); ++k)
      append(intake_.cell_arrays[k], arrays[k], arrays[k].size() / count);
    i += some;
    if (batches_.is_full()) MAILLE_CHECK(batches_.run());
  }
  return {};
}

/// Cell i of `count`, whose tuples are in `arrays`: held back, or given to the coder. Where cells are
/// delayed, the one that leaves the buffer is another one.
Result<> StreamWriter::Implementation::add_cell(unsigned kind, CellType type,
                                                std::span<const uint64_t> numbers,
                                                std::span<const uint8_t> last_use,
                                                std::span<const uint32_t> face_sizes, size_t i, size_t count,
                                                std::span<const Bytes> arrays) {
  ++tail_.blocks.back().cells;
  ++cells_given_;
  tail_.corners += numbers.size();
  if (!delay_) {
    intake_.add(kind, type, numbers, last_use);
    intake_.records.back().faces = static_cast<uint32_t>(face_sizes.size());
    intake_.face_sizes.insert(intake_.face_sizes.end(), face_sizes.begin(), face_sizes.end());
    return add_values(i, count, arrays);
  }
  if (delay_->is_full()) MAILLE_CHECK(add_delayed());
  DelayedCell& cell = delay_->next();
  cell.kind = kind;
  cell.type = type;
  cell.numbers.assign(numbers.begin(), numbers.end());
  cell.last_use.assign(last_use.begin(), last_use.end());
  cell.last_use.resize(numbers.size());
  cell.face_sizes.assign(face_sizes.begin(), face_sizes.end());
  // Values are kept with the cell, as the order of cells is not known yet.
  cell.values.clear();
  for (const Bytes array : arrays) {
    const Bytes tuple = array.subspan(i * (array.size() / count), array.size() / count);
    cell.values.insert(cell.values.end(), tuple.begin(), tuple.end());
  }
  delay_->enter();
  return {};
}

/// Hands on the best of the cells that are held back (delay_buffer.h).
Result<> StreamWriter::Implementation::add_delayed() {
  const DelayedCell& cell = delay_->take();
  intake_.add(cell.kind, cell.type, cell.numbers, cell.last_use);
  intake_.records.back().faces = static_cast<uint32_t>(cell.face_sizes.size());
  intake_.face_sizes.insert(intake_.face_sizes.end(), cell.face_sizes.begin(), cell.face_sizes.end());
  std::vector<Bytes> tuples;
  size_t at = 0;
  for (const StreamArray& array : options_.arrays) {
    if (array.domain != Domain::cell) continue;
    tuples.push_back(Bytes(cell.values).subspan(at, array.tuple_size()));
    at += array.tuple_size();
  }
  return add_values(0, 1, tuples);
}

Result<> StreamWriter::Implementation::add_all_delayed() {
  while (delay_ && !delay_->is_empty()) MAILLE_CHECK(add_delayed());
  return {};
}

/// The tuples of cell i of `count` behind its record.
Result<> StreamWriter::Implementation::add_values(size_t i, size_t count, std::span<const Bytes> arrays) {
  for (size_t k = 0; k < arrays.size(); ++k) {
    const size_t size = arrays[k].size() / count;
    const auto from = arrays[k].begin() + static_cast<ptrdiff_t>(i * size);
    intake_.cell_arrays[k].insert(intake_.cell_arrays[k].end(), from, from + static_cast<ptrdiff_t>(size));
  }
  return batches_.is_full() ? batches_.run() : Result<>{};
}

/// A polyhedron, its faces one behind the other. Its sizes must add up, and no count may exceed what a
/// decoder takes.
Result<> StreamWriter::Implementation::add_polyhedron(std::span<const uint32_t> face_sizes,
                                                      std::span<const uint64_t> connectivity,
                                                      std::span<const uint8_t> last_use,
                                                      std::span<const Bytes> arrays) {
  if (tail_.blocks.empty()) MAILLE_CHECK(begin_block("", CellType::mixed));
  MAILLE_CHECK(check_cells(CellType::polyhedron, 1, connectivity.size(), last_use, arrays));
  uint64_t corners = 0;
  for (const uint32_t size : face_sizes) corners += size;
  if (corners != connectivity.size() || corners > most_face_corners ||
      face_sizes.size() > most_face_corners) {
    return failure(ErrorCode::malformed_input,
                   "cell " + std::to_string(cells_given_) + ": a polyhedron with " +
                       std::to_string(face_sizes.size()) + " faces of " + std::to_string(corners) +
                       " corners, and " + std::to_string(connectivity.size()) + " points for them");
  }
  ++cells_of_type_[static_cast<uint8_t>(CellType::polyhedron)];
  // A member, as it would be allocated for every polyhedron.
  sorted_.assign(connectivity.begin(), connectivity.end());
  count_polyhedron(sorted_, face_sizes.size(), tail_.polyhedra);
  return add_cell(face_cell, CellType::polyhedron, connectivity, last_use, face_sizes, 0, 1, arrays);
}

/// The points are used no more: by cells held back, if one of them has the point; else by those in the
/// intake; else the end is a record of its own (StreamBatches::resolve_ends()).
Result<> StreamWriter::Implementation::end_points(std::span<const uint64_t> numbers) {
  for (const uint64_t number : numbers) {
    // A cell that is held back will end it when it comes.
    if (delay_ && delay_->end(number)) continue;
    if (intake_.ended.insert(number).second) intake_.told.push_back(number);
    if (intake_.ended.size() == most_ended) MAILLE_CHECK(batches_.run());
  }
  return {};
}

/// All that was given is in the file afterwards. Cells held back are given up, so the file gets larger the
/// more often it is called.
Result<> StreamWriter::Implementation::flush() {
  MAILLE_CHECK(add_all_delayed());
  return batches_.flush();
}

/// The last records, the tail and the footer; the sink is committed. Nothing may be called afterwards.
Result<StreamReport> StreamWriter::Implementation::finish() {
  MAILLE_CHECK(add_all_delayed());
  // By type, ascending, as TAIL has them.
  for (unsigned type = 0; type < cells_of_type_.size(); ++type) {
    if (cells_of_type_[type] > 0) tail_.types.emplace_back(static_cast<CellType>(type), cells_of_type_[type]);
  }
  return batches_.finish();
}

StreamWriter::StreamWriter(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
StreamWriter::StreamWriter(StreamWriter&&) noexcept = default;
StreamWriter::~StreamWriter() = default;

Result<> check_stream_arrays(const std::vector<StreamArray>& arrays, const std::string& holder) {
  for (const StreamArray& array : arrays) {
    if (array.components == 0 || array.components > 0xffff) {
      return failure(ErrorCode::usage, "array \"" + array.name + "\" must have 1 to 65535 components");
    }
    if (array.domain != Domain::point && array.domain != Domain::cell) {
      return failure(ErrorCode::unsupported, "array \"" + array.name + "\" is on " + name_of(array.domain) +
                                                 "s; a " + holder + " has arrays on points and on cells");
    }
  }
  return {};
}

Result<> check_stream_options(const StreamOptions& options) {
  if (options.positions.components != 3)
    return failure(ErrorCode::usage, "positions must have three components");
  if (options.effort < 1 || options.effort > 9)
    return failure(ErrorCode::usage, "the effort must be from 1 to 9");
  if (options.time && !std::isfinite(*options.time))
    return failure(ErrorCode::usage, "the time of the values must be a finite number");
  if (options.delay > 0 && !options.any_order)
    return failure(ErrorCode::usage, "cells can be delayed only if any order will do");
  return check_stream_arrays(options.arrays, "stream");
}

Result<StreamWriter> StreamWriter::begin(Sink& sink, StreamOptions options) {
  MAILLE_CHECK(check_stream_options(options));
  ArrayMapsList maps;
  maps.bounds.resize(options.arrays.size() + 1);
  // The diagonal of a box with equal sides (sqrt(3) = 1.7320508075688772): the bound is kept, if the box is
  // in the range declared. Boxes with unequal sides have a shorter diagonal for the same longest side, so
  // that the bound is rather too small than too large.
  const double diagonal = declared_width(options.positions) * 1.7320508075688772;
  maps.maps.push_back(MAILLE_TRY(declared_maps(options.positions, diagonal, maps.bounds[0])));
  for (size_t i = 0; i < options.arrays.size(); ++i) {
    maps.maps.push_back(
        MAILLE_TRY(declared_maps(options.arrays[i], declared_width(options.arrays[i]), maps.bounds[i + 1])));
  }
  return begin(sink, std::move(options), maps);
}

Result<StreamWriter> begin_with_maps(Sink& sink, StreamOptions options, const ArrayMapsList& maps) {
  MAILLE_CHECK(check_stream_options(options));
  return StreamWriter::begin(sink, std::move(options), maps);
}

Result<StreamWriter> StreamWriter::begin(Sink& sink, StreamOptions options, const ArrayMapsList& maps) {
  StreamHeader header;
  header.description = {options.positions,         options.arrays,     maps.numbered,  options.mesh_arrays,
                        options.metadata,          options.provenance, options.effort, options.any_order,
                        !maps.order_apart.empty(), options.time};
  header.mixing = mixing_at(options.effort);
  header.mixed_values =
      mixed_values_at(options.effort, maps.mixing_is_fast,
                      maps.bounded_numbers > 0 && maps.bounded_numbers <= most_bounded_mixed);
  header.gated = !maps.borders.empty();
  header.maps = maps.maps;
  header.bounds = maps.bounds;
  MAILLE_TRY(encode_header(header));  // it is written with the first cells: what is wrong is told here
  FileWriter file = MAILLE_TRY(
      FileWriter::begin(sink, {.major = format_major, .minor = format_minor, .mode = Mode::stream}));
  return StreamWriter(std::make_unique<Implementation>(sink, std::move(options), std::move(header),
                                                       maps.order_apart, maps.borders, std::move(file)));
}

Result<> StreamWriter::add_points(uint64_t first, Bytes positions, std::span<const Bytes> arrays) {
  const size_t size = implementation_->position_size();
  return implementation_->add_points(
      positions.size() / size, [first](uint64_t i) { return first + i; }, positions, arrays);
}
Result<> StreamWriter::add_points(std::span<const uint64_t> numbers, Bytes positions,
                                  std::span<const Bytes> arrays) {
  return implementation_->add_points(
      numbers.size(), [numbers](uint64_t i) { return numbers[i]; }, positions, arrays);
}
Result<> StreamWriter::begin_block(std::string name, CellType type) {
  return implementation_->begin_block(std::move(name), type);
}
Result<> StreamWriter::add_cells(CellType type, std::span<const uint64_t> connectivity,
                                 std::span<const uint8_t> last_use, std::span<const Bytes> arrays,
                                 size_t nodes) {
  return implementation_->add_cells(type, connectivity, last_use, arrays, nodes);
}
Result<> StreamWriter::add_polyhedron(std::span<const uint32_t> face_sizes,
                                      std::span<const uint64_t> connectivity,
                                      std::span<const uint8_t> last_use, std::span<const Bytes> arrays) {
  return implementation_->add_polyhedron(face_sizes, connectivity, last_use, arrays);
}
Result<> StreamWriter::end_points(std::span<const uint64_t> numbers) {
  return implementation_->end_points(numbers);
}
Result<> StreamWriter::flush() {
  return implementation_->flush();
}
Result<StreamReport> StreamWriter::finish() {
  return implementation_->finish();
}

}  // namespace maille
