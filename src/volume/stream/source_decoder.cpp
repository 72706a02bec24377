// decode() into a mesh that is written in parts.
#include <maille/out_of_core.h>
#include <maille/stream.h>

#include <algorithm>
#include <numeric>

#include "base/pace.h"
#include "base/result.h"
#include "container/file_reader.h"
#include "description/description.h"
#include "mesh/empty_like.h"
#include "volume/stream/number_set.h"
#include "volume/stream/portion_pipeline.h"
#include "volume/stream/step_chain.h"
#include "volume/stream/stream_file.h"
#include "volume/stream/stream_layout.h"
#include "volume/stream/time_steps.h"

namespace maille {
namespace {

/// Writes portions where they belong: cells in their order, tuples of points by their numbers. Only numbers
/// of points are remembered, a bit each.
class SinkFeeder {
 public:
  SinkFeeder(const StreamDescription& stream, const MeshDescription& mesh, MeshSink& sink,
             const DecodeOptions& options, std::string name)
      : mesh_(mesh), sink_(sink), numbers_(options.limits.mesh_bytes / 2), name_(std::move(name)) {
    size_t next = 0;
    for (const StreamArray& array : stream.arrays)
      places_.push_back(is_wanted(options, array.name) ? next++ : not_wanted);
    for (const StreamArray& array : stream.arrays) domains_.push_back(array.domain);
  }

  /// Writes one portion. Its vectors are lent to the sink for the call, and are the same again afterwards.
  Result<> add(StreamPortion& portion) {
    MAILLE_CHECK(find_runs(portion.points));
    MAILLE_CHECK(add_points(portion.positions,
                            [&](uint64_t first, Bytes bytes) { return sink_.write_points(first, bytes); }));
    size_t of_points = 0, of_cells = 0;
    for (size_t k = 0; k < domains_.size(); ++k) {
      const bool on_points = domains_[k] == Domain::point;
      const auto& bytes = on_points ? portion.point_arrays[of_points++] : portion.cell_arrays[of_cells++];
      if (places_[k] == not_wanted) continue;
      if (on_points) {
        MAILLE_CHECK(add_points(
            bytes, [&](uint64_t first, Bytes part) { return sink_.write_array(places_[k], first, part); }));
      } else {
        MAILLE_CHECK(sink_.write_array(places_[k], portion.first_cell, bytes));
      }
    }
    return add_cells(portion);  // behind their values: some formats have these within the cells
  }

 private:
  static constexpr size_t not_wanted = ~size_t{0};

  // Vectors change hands instead of being copied: a portion has megabytes.
  Result<> add_cells(StreamPortion& portion) {
    // Counts that do not fit are damage: writers of many formats have fixed places for all cells by now.
    if (portion.cell_count() > mesh_.cells - std::min(mesh_.cells, portion.first_cell))
      return failure(ErrorCode::corrupt, name_ + ": more cells than its end says");
    cells_.types.resize(portion.types.size());
    for (size_t i = 0; i < portion.types.size(); ++i)
      cells_.types[i] = static_cast<uint8_t>(portion.types[i]);
    const auto exchange = [&] {
      cells_.offsets.swap(portion.offsets);
      cells_.connectivity.swap(portion.connectivity);
      cells_.face_sizes.swap(portion.face_sizes);
      cells_.cell_faces.swap(portion.cell_faces);
    };
    exchange();
    Result<> written = sink_.write_cells(cells_);
    exchange();
    return written;
  }

  /// Orders the points of a portion by number: neighbours are written at once. A number that is too large or
  /// comes twice is damage, found before anything is written.
  Result<> find_runs(const std::vector<uint64_t>& numbers) {
    order_.clear();
    sorted_ = numbers;
    if (!std::is_sorted(numbers.begin(), numbers.end())) {
      order_.resize(numbers.size());
      std::iota(order_.begin(), order_.end(), 0u);
      std::sort(order_.begin(), order_.end(),
                [&](uint32_t a, uint32_t b) { return numbers[a] < numbers[b]; });
      for (size_t i = 0; i < order_.size(); ++i) sorted_[i] = numbers[order_[i]];
    }
    for (const uint64_t number : sorted_) {
      if (number >= mesh_.points || !numbers_.add(number)) {
        return failure(
            ErrorCode::corrupt,
            name_ + ": the numbers of points have gaps or repeat; read it in parts (StreamReader)");
      }
    }
    if (numbers_.full())
      return failure(ErrorCode::memory_bound, name_ + ": the points take more memory than allowed");
    return {};
  }
  template <class Write>
  // A write for each run of numbers; find_runs() has put them in order.
  Result<> add_points(const std::vector<std::byte>& tuples, Write write) {
    const size_t size = sorted_.empty() ? 0 : tuples.size() / sorted_.size();
    for (size_t i = 0; i < sorted_.size();) {
      const size_t begin = i++;
      while (i < sorted_.size() && sorted_[i] == sorted_[i - 1] + 1) ++i;
      MAILLE_CHECK(write(sorted_[begin], tuples_between(tuples, size, begin, i)));
    }
    return {};
  }
  /// The tuples of points `begin` to `end` in the order of their numbers; valid until the next call.
  Bytes tuples_between(const std::vector<std::byte>& tuples, size_t size, size_t begin, size_t end) {
    if (order_.empty()) return Bytes(tuples).subspan(begin * size, (end - begin) * size);
    run_.resize((end - begin) * size);
    for (size_t i = begin; i < end; ++i)
      std::copy_n(tuples.data() + order_[i] * size, size, run_.data() + (i - begin) * size);
    return run_;
  }

  const MeshDescription& mesh_;
  MeshSink& sink_;
  NumberSet numbers_;
  std::string name_;
  std::vector<size_t> places_;  ///< by array of the stream, its number in the description
  std::vector<Domain> domains_;
  CellPiece cells_;
  std::vector<uint32_t> order_;
  std::vector<uint64_t> sorted_;
  std::vector<std::byte> run_;
};

}  // namespace

/// What a decoded mesh will hold, from the ends of the file alone: sinks need it before the first cell.
/// Error: usage, unsupported (an order apart needs the whole mesh in memory).
Result<MeshDescription> describe(const Source& source, const DecodeOptions& options) {
  const StreamEnds ends = MAILLE_TRY(read_stream_ends(source, options.limits));
  StreamDescription stream = ends.header.description;
  if (options.step != 0) {
    std::vector<StreamStep> steps = MAILLE_TRY(list_steps(source, true, options.limits));
    MAILLE_CHECK(check_step(options.step, steps.size(), source.name()));
    const FileReader file = MAILLE_TRY(FileReader::open(source, stream_chunk_types));
    stream.metadata = MAILLE_TRY(metadata_of_step(file, ends.header, options.step, options.limits));
    stream.arrays = std::move(steps[options.step - 1].arrays);
    set_time(steps[options.step - 1].time, stream.mesh_arrays);
  }
  // The order is decoded beside all cells (MeshCollector), which need not fit into memory here.
  if (stream.order_apart && !ends.in_pieces) {
    return failure(ErrorCode::unsupported,
                   source.name() +
                       ": cells and points stand in another order than in the mesh, so it cannot be "
                       "decoded in parts; decode() reads it whole");
  }
  MeshDescription mesh;
  mesh.points = ends.tail.points;
  mesh.cells = ends.tail.cells;
  mesh.corners = ends.tail.corners;
  mesh.point_type = stream.positions.type;
  mesh.types = ends.tail.types;
  mesh.polyhedra = ends.tail.polyhedra;
  for (const StreamTail::Block& block : ends.tail.blocks)
    mesh.blocks.push_back({block.name, block.type, block.cells});
  for (const StreamArray& array : stream.arrays) {
    if (is_wanted(options, array.name)) mesh.arrays.push_back(empty_like(array));
  }
  mesh.mesh_arrays = stream.mesh_arrays;
  mesh.metadata = stream.metadata;
  return mesh;
}

Result<> decode_stream(const Source& source, MeshSink& sink, const DecodeOptions& options) {
  const MeshDescription mesh = MAILLE_TRY(describe(source, options));
  StreamReader reader = MAILLE_TRY(
      StreamReader::open(source, options.step, {.limits = options.limits, .executor = options.executor}));
  SinkFeeder feeder(reader.description(), mesh, sink, options, source.name());
  const auto add = [&](StreamPortion& portion) { return feeder.add(portion); };
  // Writing goes beside decoding; the sink is used by one thread at a time.
  MAILLE_CHECK(for_each_portion(reader, options.executor, add, [&](const StreamPortion& portion) -> Result<> {
    const auto done = static_cast<double>(portion.first_cell + portion.cell_count());
    // An empty mesh divides by next to nothing instead of by nothing.
    if (options.progress && !options.progress({"cells", done / (static_cast<double>(mesh.cells) + 1e-9)}))
      return cancelled();
    return {};
  }));
  return sink.commit();
}

}  // namespace maille
