#include "volume/stream/stream_file.h"

#include <maille/stream.h>

#include <algorithm>

#include "base/pace.h"
#include "base/result.h"
#include "container/file_reader.h"
#include "description/description.h"
#include "description/remains.h"
#include "mesh/empty_like.h"
#include "volume/order/cell_order.h"
#include "volume/order/mesh_order.h"
#include "volume/stream/numbered_arrays.h"
#include "volume/stream/portion_pipeline.h"
#include "volume/stream/stream_layout.h"
#include "volume/stream/time_steps.h"

namespace maille {
namespace {

/// Puts portions together again. Points come in the order of their first use, and go to the places of their
/// numbers in the end: nothing is reserved for a number that a file claims. All room is counted, and held
/// against the limit before it is made.
class MeshCollector {
 public:
  MeshCollector(const StreamDescription& description, std::string name, const DecodeOptions& options)
      : name_(std::move(name)), options_(options), numbered_(description.numbered) {
    mesh_.points = empty_like(description.positions);
    for (const StreamArray& array : description.arrays) {
      wanted_.push_back(is_wanted(options, array.name));
      arrays_.push_back(empty_like(array));
    }
    for (const Array& array : description.mesh_arrays) mesh_arrays_.push_back(array);
    mesh_.metadata = description.metadata;
    count_description();
  }

  /// Appends a portion. Arrays that are not wanted are decoded and dropped. `besides`: what the reader holds,
  /// in bytes. Error: memory_bound, corrupt.
  Result<> add(const StreamPortion& portion, uint64_t besides) {
    besides_ = besides;
    size_t next_block = 0;
    const bool plain =
        portion.blocks.empty() && !mesh_.blocks.empty() && nodes_of(mesh_.blocks.back().type) != 0;
    if (plain) MAILLE_CHECK(add_plain_cells(portion));
    for (size_t i = 0; i <= portion.cell_count() && !plain; ++i) {
      while (next_block < portion.blocks.size() &&
             portion.blocks[next_block].first_cell <= portion.first_cell + i) {
        MAILLE_CHECK(begin_block(portion.blocks[next_block++]));
      }
      if (i == portion.cell_count()) break;
      if (mesh_.blocks.empty()) MAILLE_CHECK(begin_block({}));
      MAILLE_CHECK(add_cell(portion, i));
    }
    MAILLE_CHECK(make_room(numbers_, portion.points.size()));
    numbers_.insert(numbers_.end(), portion.points.begin(), portion.points.end());
    MAILLE_CHECK(append(mesh_.points, portion.positions));
    size_t of_points = 0, of_cells = 0;
    for (size_t k = 0; k < arrays_.size(); ++k) {
      const bool points = arrays_[k].domain == Domain::point;
      const auto& bytes = points ? portion.point_arrays[of_points++] : portion.cell_arrays[of_cells++];
      if (wanted_[k]) MAILLE_CHECK(append(arrays_[k], bytes));
    }
    return check_memory(0);
  }

  /// What the end of the file says is made room for, up to `most` bytes: growing without it touches all
  /// memory twice (decoding a million hexahedra: 331 to 285 ns each, b092500). Nothing relies on it, as what
  /// comes is still checked.
  void expect(const StreamTail& tail, uint64_t most) {
    room_ = most;
    for (const StreamTail::Block& block : tail.blocks)
      expected_nodes_.push_back(saturated(block.cells, nodes_of(block.type)));
    size_ += expected_nodes_.size() * sizeof(uint64_t);
    reserve(numbers_, tail.points);
    reserve(mesh_.points.bytes, saturated(tail.points, mesh_.points.tuple_size()));
    for (size_t k = 0; k < arrays_.size(); ++k) {
      const uint64_t count = arrays_[k].domain == Domain::point ? tail.points : tail.cells;
      if (wanted_[k]) reserve(arrays_[k].bytes, saturated(count, arrays_[k].tuple_size()));
    }
  }

  /// For a part of a mesh: points that never came up leave gaps in the numbers, which are closed in the order
  /// of the numbers. A cell can only have points that came up, so that another one is damage.
  Result<> close_gaps() {
    std::vector<uint64_t> known = numbers_;
    std::sort(known.begin(), known.end());
    const auto place = [&](uint64_t number) {
      return static_cast<uint64_t>(std::lower_bound(known.begin(), known.end(), number) - known.begin());
    };
    for (CellBlock& block : mesh_.blocks) {
      for (uint32_t& point : block.connectivity) {
        const uint64_t now = place(point);
        if (now == known.size() || known[now] != point)
          return failure(ErrorCode::corrupt, name_ + ": a cell has a point that never came up");
        point = static_cast<uint32_t>(now);
      }
    }
    for (uint64_t& number : numbers_) number = place(number);
    return {};
  }

  /// Moves all points to their places and checks the mesh; then the input's order is restored. `order`: the
  /// input's, where the stream has another one. What is returned passes validate(), whatever the file held.
  Result<Mesh> finish(const std::optional<CodedOrder>& order) {
    MAILLE_CHECK(put_in_place());
    for (size_t k = 0; k < arrays_.size(); ++k) {
      if (wanted_[k]) mesh_.arrays.push_back(std::move(arrays_[k]));
    }
    for (Array& array : mesh_arrays_) mesh_.arrays.push_back(std::move(array));
    if (auto valid = validate(mesh_); !valid) {
      return failure(ErrorCode::corrupt, name_ + ": " + std::move(valid).error().message);
    }
    if (order && !(all_have_shapes(mesh_) && restore_order(mesh_, *order))) {
      return failure(ErrorCode::corrupt, name_ + ": the order of cells and points is damaged");
    }
    if (order) set_numbers();
    return std::move(mesh_);
  }

  /// Leaves out the arrays of numbers that only the input's order gives, and returns their names.
  std::vector<std::string> drop_numbered() {
    std::vector<std::string> names;
    for (const NumberedArray& numbered : numbered_) {
      const Array& array = arrays_[numbered.array];
      if (wanted_[numbered.array]) names.push_back(array_named(array.name, array.domain));
      wanted_[numbered.array] = false;
    }
    return names;
  }

 private:
  /// Pieces in another order had zeros.
  void set_numbers() {
    for (const NumberedArray& numbered : numbered_) {
      if (!wanted_[numbered.array]) continue;
      const auto before =
          std::count(wanted_.begin(), wanted_.begin() + static_cast<ptrdiff_t>(numbered.array), true);
      Array& array = mesh_.arrays[static_cast<size_t>(before)];
      RisingNumbers(numbered, array.type).store_all(0, array.bytes);
    }
  }
  Result<> append(Array& array, const std::vector<std::byte>& bytes) {
    MAILLE_CHECK(make_room(array.bytes, bytes.size()));
    array.bytes.insert(array.bytes.end(), bytes.begin(), bytes.end());
    return {};
  }
  /// Names and labels, which are copies of the reader's.
  void count_description() {
    for (const Array& array : arrays_) size_ += sizeof(Array) + memory_of(array.labels);
    for (const Array& array : mesh_arrays_)
      size_ += sizeof(Array) + array.bytes.size() + memory_of(array.labels);
    size_ += memory_of(mesh_.points.labels);
    for (const auto& [key, value] : mesh_.metadata)
      size_ += 2 * sizeof(std::string) + key.size() + value.size();
  }
  static uint64_t memory_of(const std::vector<std::string>& texts) {
    uint64_t bytes = 0;
    for (const std::string& text : texts) bytes += sizeof(std::string) + text.size();
    return bytes;
  }
  /// `more`: what is there for a moment. Error: memory_bound.
  Result<> check_memory(uint64_t more) const {
    if (size_ + besides_ + more <= options_.limits.mesh_bytes) return {};
    return failure(ErrorCode::memory_bound,
                   name_ + ": the mesh, and what decoding it needs, take more than the " +
                       std::to_string(options_.limits.mesh_bytes >> 20) + " MiB allowed");
  }
  /// Twice as much where there is no room for `more` elements; while they move the old room is there, too.
  template <class Elements>
  Result<> make_room(Elements& elements, size_t more) {
    if (elements.capacity() - elements.size() >= more) return {};
    constexpr size_t size = sizeof(typename Elements::value_type);
    const size_t before = elements.capacity(), room = std::max(2 * before, elements.size() + more);
    MAILLE_CHECK(check_memory(room * size));
    elements.reserve(room);
    size_ += (room - before) * size;
    return {};
  }
  Result<> begin_block(const StreamPortion::Block& start) {
    MAILLE_CHECK(make_room(mesh_.blocks, 1));
    size_ += start.name.size();
    CellBlock& block = mesh_.blocks.emplace_back();
    block.name = start.name;
    block.type = start.type;
    if (mesh_.blocks.size() <= expected_nodes_.size())
      reserve(block.connectivity, expected_nodes_[mesh_.blocks.size() - 1]);
    return {};
  }
  /// A product that a file's counts must not make wrap.
  static uint64_t saturated(uint64_t a, uint64_t b) {
    return b != 0 && a > ~uint64_t{0} / b ? ~uint64_t{0} : a * b;
  }
  /// Reserves as far as there is room: the rest grows.
  template <class Numbers>
  void reserve(Numbers& numbers, uint64_t count) {
    constexpr size_t size = sizeof(typename Numbers::value_type);
    const uint64_t some = std::min<uint64_t>(count, room_ / size);
    room_ -= some * size;
    numbers.reserve(static_cast<size_t>(some));
    size_ += numbers.capacity() * size;
  }
  tl::unexpected<Error> too_many_points() const {
    return failure(ErrorCode::memory_bound,
                   name_ + ": more points than a mesh in memory can have; read it in parts (StreamReader)");
  }
  /// Cells of the block's only type: the reader has looked at their types.
  Result<> add_plain_cells(const StreamPortion& portion) {
    // A portion that neither begins a block nor has cells of several sizes: its connectivity is copied as a
    // whole.
    Buffer<uint32_t>& connectivity = mesh_.blocks.back().connectivity;
    uint64_t bits = 0;  // of all: at once, where the largest would have to be found one by one
    for (const uint64_t point : portion.connectivity) bits |= point;
    if (bits > max_points &&
        *std::max_element(portion.connectivity.begin(), portion.connectivity.end()) > max_points)
      return too_many_points();
    const size_t before = connectivity.size();
    MAILLE_CHECK(make_room(connectivity, portion.connectivity.size()));
    connectivity.resize(before + portion.connectivity.size());
    for (size_t k = 0; k < portion.connectivity.size(); ++k) {
      connectivity[before + k] = static_cast<uint32_t>(portion.connectivity[k]);
    }
    return {};
  }
  Result<> add_cell(const StreamPortion& portion, size_t i) {
    CellBlock& block = mesh_.blocks.back();
    const bool varies = nodes_of(block.type) == 0;
    const uint64_t begin = portion.offsets[i], end = portion.offsets[i + 1];
    MAILLE_CHECK(make_room(block.connectivity, end - begin));
    if (varies) MAILLE_CHECK(make_room(block.offsets, 2));
    if (varies && block.offsets.empty()) block.offsets.push_back(0);
    for (uint64_t k = begin; k < end; ++k) {
      if (portion.connectivity[k] > max_points) return too_many_points();
      block.connectivity.push_back(static_cast<uint32_t>(portion.connectivity[k]));
    }
    if (varies) block.offsets.push_back(block.connectivity.size());
    MAILLE_CHECK(add_faces(portion, i, block));
    if (block.type != CellType::mixed) return {};
    MAILLE_CHECK(make_room(block.types, 1));
    block.types.push_back(static_cast<uint8_t>(portion.types[i]));
    return {};
  }
  /// With the first polyhedron of a block all its cells have faces, those before it none.
  Result<> add_faces(const StreamPortion& portion, size_t i, CellBlock& block) {
    const bool polyhedron = portion.types[i] == CellType::polyhedron;
    if (!polyhedron && block.cell_faces.empty()) return {};
    if (block.cell_faces.empty()) {
      MAILLE_CHECK(make_room(block.cell_faces, block.offsets.size()));
      block.cell_faces.assign(block.offsets.size() - 1, 0);
    }
    if (polyhedron) {
      const auto faces = portion.face_sizes.begin();
      const uint64_t first = portion.cell_faces[i], last = portion.cell_faces[i + 1];
      MAILLE_CHECK(make_room(block.face_sizes, last - first));
      block.face_sizes.insert(block.face_sizes.end(), faces + static_cast<ptrdiff_t>(first),
                              faces + static_cast<ptrdiff_t>(last));
    }
    MAILLE_CHECK(make_room(block.cell_faces, 1));
    block.cell_faces.push_back(block.face_sizes.size());
    return {};
  }
  /// Numbers of points must be 0 to n - 1, each once: then tuples can be moved to their places. Often they
  /// are there already.
  Result<> put_in_place() {
    std::vector<bool> seen(numbers_.size());
    bool in_order = true;
    for (size_t i = 0; i < numbers_.size(); ++i) {
      if (numbers_[i] >= seen.size() || seen[numbers_[i]]) {
        return failure(
            ErrorCode::corrupt,
            name_ + ": the numbers of points have gaps or repeat; read it in parts (StreamReader)");
      }
      seen[numbers_[i]] = true;
      in_order = in_order && numbers_[i] == i;
    }
    if (in_order) return {};
    MAILLE_CHECK(put_in_place(mesh_.points));
    for (size_t k = 0; k < arrays_.size(); ++k) {
      if (wanted_[k] && arrays_[k].domain == Domain::point) MAILLE_CHECK(put_in_place(arrays_[k]));
    }
    return {};
  }
  /// Through a copy: permuting in place would need as much time and a bit for each point.
  Result<> put_in_place(Array& array) {
    const size_t size = array.tuple_size();
    MAILLE_CHECK(check_memory(array.bytes.size()));
    size_ -= array.bytes.capacity() - array.bytes.size();  // a copy has no room to grow
    std::vector<std::byte> bytes(array.bytes.size());
    for (size_t i = 0; i < numbers_.size(); ++i) {
      std::copy_n(array.bytes.data() + i * size, size, bytes.data() + numbers_[i] * size);
    }
    array.bytes = std::move(bytes);
    return {};
  }

  std::string name_;
  const DecodeOptions& options_;
  std::vector<NumberedArray> numbered_;
  Mesh mesh_;
  std::vector<Array> arrays_, mesh_arrays_;
  std::vector<bool> wanted_;
  std::vector<uint64_t> numbers_;
  uint64_t size_ = 0;                     ///< of all above, in bytes
  uint64_t besides_ = 0;                  ///< what the reader took last
  std::vector<uint64_t> expected_nodes_;  ///< by block
  uint64_t room_ = 0;                     ///< bytes that may still be reserved
};

/// A file may claim any size. So room is made for so many bytes for each of its own, and in all, at most: the
/// rest grows as it comes, as does what is beyond in regular meshes, whose files are the smallest.
constexpr uint64_t reserved_per_byte = 64, most_reserved = uint64_t{128} << 20;

/// Opens files whose order stands apart, too: MeshCollector restores it.
Result<StreamReader> open_any(const Source& source, const DecodeOptions& options) {
  StreamReadOptions opened;
  opened.limits = options.limits;
  opened.any_order = true;
  opened.executor = options.executor;
  return StreamReader::open(source, options.step, opened);
}

/// The input's order, where it stands apart: still coded, as it can be decoded only beside the decoded cells.
Result<std::optional<CodedOrder>> order_of(const Source& source, const StreamDescription& description) {
  if (!description.order_apart) return std::optional<CodedOrder>();
  const FileReader file = MAILLE_TRY(FileReader::open(source, stream_chunk_types));
  const std::vector<std::byte> bytes = MAILLE_TRY(file.read_stream({"ordr"}));
  std::optional<CodedOrder> order = split_order(bytes);
  if (!order)
    return failure(ErrorCode::corrupt, source.name() + ": the order of cells and points is damaged");
  return order;
}

/// What the end of the file says, if it is there. What is wrong with it is no error here: the reader tells
/// when it comes there.
Result<StreamTail> tail_of(const Source& source, uint64_t most_memory) {
  const FileReader file = MAILLE_TRY(FileReader::open(source, stream_chunk_types));
  return maille::tail_of(file, most_memory);
}

/// Makes room for what the end of the file says. Returns how many cells that are; 0: nobody knows.
uint64_t expect_tail(const Source& source, const DecodeOptions& options, uint64_t besides,
                     MeshCollector& collector) {
  const uint64_t limit = options.limits.mesh_bytes, left = limit - std::min(besides, limit);
  const auto tail = tail_of(source, left);
  if (!tail) return 0;
  collector.expect(*tail, std::min({left, source.size() * reserved_per_byte, most_reserved}));
  return tail->cells;
}

}  // namespace

/// Decodes connectivity and order only: no array is wanted.
Result<std::optional<InputOrder>> input_order_of(const Source& source, const Limits& limits) {
  DecodeOptions options;
  options.limits = limits;
  options.arrays.emplace();
  StreamReader reader = MAILLE_TRY(open_any(source, options));
  const auto order = MAILLE_TRY(order_of(source, reader.description()));
  if (!order) return std::optional<InputOrder>();
  MeshCollector collector(reader.description(), source.name(), options);
  StreamPortion portion;
  while (MAILLE_TRY(reader.next(portion))) MAILLE_CHECK(collector.add(portion, reader.memory()));
  const Mesh coded = MAILLE_TRY(collector.finish({}));
  std::optional<InputOrder> found = all_have_shapes(coded) ? decode_order(coded, *order) : std::nullopt;
  if (!found)
    return failure(ErrorCode::corrupt, source.name() + ": the order of cells and points is damaged");
  return found;
}

Result<Mesh> decode_stream(const Source& source, const DecodeOptions& options) {
  StreamReader reader = MAILLE_TRY(open_any(source, options));
  const auto order = MAILLE_TRY(order_of(source, reader.description()));
  MeshCollector collector(reader.description(), source.name(), options);
  const uint64_t expected = expect_tail(source, options, reader.memory(), collector);
  const auto add = [&](const StreamPortion& portion) { return collector.add(portion, reader.memory()); };
  const auto cells = static_cast<double>(std::max<uint64_t>(expected, 1));
  MAILLE_CHECK(for_each_portion(reader, options.executor, add, [&](const StreamPortion& portion) -> Result<> {
    const auto done = static_cast<double>(expected > 0 ? portion.first_cell + portion.cell_count() : 0);
    if (options.progress && !options.progress({"cells", std::min(done / cells, 1.0)})) return cancelled();
    return {};
  }));
  return collector.finish(order);
}

namespace {

/// The input's order; none of a part, as it speaks of all points and cells. `damage`: of cells, or else of
/// it. Without the order, numbers that rise along it are lost, too.
Result<std::optional<CodedOrder>> salvage_order(const Source& source, const StreamDescription& description,
                                                MeshCollector& collector, std::optional<Error>& damage) {
  if (!description.order_apart) return std::optional<CodedOrder>();
  if (!damage) {
    Result<std::optional<CodedOrder>> order = order_of(source, description);
    if (order || order.error().code != ErrorCode::corrupt) return order;
    damage = std::move(order).error();
  }
  damage->message += "; lost: the input's order";
  for (const std::string& name : collector.drop_numbered()) damage->message += ", " + name;
  return std::optional<CodedOrder>();
}

}  // namespace

/// All whole batches before the first damage. Memory and other errors are not damage, and end it.
Result<Salvaged> salvage_stream(const Source& source, const DecodeOptions& options) {
  StreamReader reader = MAILLE_TRY(open_any(source, options));
  MeshCollector collector(reader.description(), source.name(), options);
  Salvaged salvaged;
  StreamPortion portion;
  for (;;) {
    const Result<bool> more = reader.next(portion);
    if (!more && more.error().code != ErrorCode::corrupt) return tl::unexpected(more.error());
    if (!more) salvaged.damage = more.error();
    if (!more || !*more) break;
    MAILLE_CHECK(collector.add(portion, reader.memory()));
    if (options.progress && !options.progress({"cells", 0})) return cancelled();
  }
  if (salvaged.damage) MAILLE_CHECK(collector.close_gaps());
  const auto order = MAILLE_TRY(salvage_order(source, reader.description(), collector, salvaged.damage));
  salvaged.mesh = MAILLE_TRY(collector.finish(order));
  return salvaged;
}

}  // namespace maille
