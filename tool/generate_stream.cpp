#include "generate_stream.h"

#include <maille/out_of_core.h>
#include <maille/stream.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "in_parts.h"
#include "result.h"
#include "system.h"

namespace maille::tool {

namespace {

/// Passes a generated mesh on to a stream. Zones and patches become the labels of one array, since their
/// cells come mixed and blocks of a stream would change all the time. `Writer` is StreamWriter or MeshSpool;
/// `begin` makes it when the size is known.
template <class Writer>
class StreamedGeneration final : public GeneratedOutput {
 public:
  using Begin = std::function<Result<Writer>(StreamOptions)>;
  StreamedGeneration(const BlockDescription& description, bool any_order, Begin begin,
                     ProgressDisplay& progress)
      : description_(description), any_order_(any_order), begin_(std::move(begin)), progress_(progress) {}

  Result<> begin(const GeneratedSize& size) override {
    StreamOptions stream;
    stream.positions.type = Scalar::f64;
    stream.any_order = any_order_;
    StreamArray label{"patch", Domain::cell, Scalar::u16, 1, Role::label, {}, {}, {}};
    for (const HexBlock& block : description_.blocks) zones_.push_back(label_of(label.labels, block.zone));
    for (const BlockPatch& patch : size.patches) {
      patches_.push_back(label_of(label.labels, patch.name));
      stream.metadata.emplace_back("patch." + patch.name, patch.type);
    }
    if (label.labels.size() > 0xffff)
      return failure(ErrorCode::unsupported, "more than 65535 zones and patches");
    stream.arrays.push_back(std::move(label));
    writer_.emplace(TOOL_TRY(begin_(std::move(stream))));
    cells_ = size.cells;
    watch_ = progress_.watch(static_cast<double>(cells_), "cells");
    return {};
  }
  Result<> points(uint64_t first, std::span<const double> coordinates) override {
    return writer_->add_points(first, std::as_bytes(coordinates));
  }
  Result<> faces(uint32_t patch, CellType type, std::span<const uint64_t> nodes) override {
    return add(patches_[patch], type, nodes, {});
  }
  Result<> cells(uint32_t block, CellType type, std::span<const uint64_t> nodes,
                 std::span<const uint8_t> last_use) override {
    done_ += nodes.size() / nodes_of(type);
    if (watch_) watch_({"cells", static_cast<double>(done_) / static_cast<double>(cells_)});
    return add(zones_[block], type, nodes, last_use);
  }
  auto finish() { return writer_->finish(); }

 private:
  static uint16_t label_of(std::vector<std::string>& labels, const std::string& name) {
    const auto place = std::find(labels.begin(), labels.end(), name) - labels.begin();
    if (static_cast<size_t>(place) == labels.size()) labels.push_back(name);
    return static_cast<uint16_t>(place);
  }
  Result<> add(uint16_t label, CellType type, std::span<const uint64_t> nodes,
               std::span<const uint8_t> last_use) {
    labels_.assign(nodes.size() / nodes_of(type), label);
    const Bytes bytes = std::as_bytes(std::span(labels_));
    return writer_->add_cells(type, nodes, last_use, {&bytes, 1});
  }

  const BlockDescription& description_;
  bool any_order_;
  Begin begin_;
  ProgressDisplay& progress_;
  Progress watch_;
  std::optional<Writer> writer_;
  std::vector<uint16_t> zones_, patches_, labels_;
  uint64_t cells_ = 0, done_ = 0;
};

}  // namespace

Result<StreamReport> generate_stream(const BlockDescription& description, const GenerateOptions& options,
                                     Sink& sink, ProgressDisplay& progress) {
  keep_memory_small();
  const Threads threads(options.common.threads);
  const auto begin = [&](StreamOptions stream) {
    stream.executor = threads.executor();
    return StreamWriter::begin(sink, std::move(stream));
  };
  StreamedGeneration<StreamWriter> output(description, options.generation.streaming_order, begin, progress);
  TOOL_CHECK(generate(description, options.generation, output));
  return output.finish();
}

Result<EncodeReport> generate_pieces(const BlockDescription& description, const GenerateOptions& options,
                                     Sink& sink, ProgressDisplay& progress) {
  keep_memory_small();
  const WorkingSpace space = space_for(options.common, options.output, false);
  const auto begin = [&](const StreamOptions& stream) { return MeshSpool::create(stream, space); };
  // All of it is there before it is cut, so that the order costs no memory.
  StreamedGeneration<MeshSpool> output(description, false, begin, progress);
  TOOL_CHECK(generate(description, options.generation, output));
  const auto mesh = TOOL_TRY(output.finish());
  const Threads threads(options.common.threads);
  EncodeOptions encoding;
  encoding.mode = Mode::stream;
  encoding.order = options.generation.streaming_order ? Order::canonical : Order::keep;
  encoding.most_cells_per_part = cells_of_piece(options.pieces);
  encoding.executor = threads.executor();
  encoding.progress = progress.watch(static_cast<double>(mesh->description().cells), "cells");
  return encode(*mesh, sink, encoding, space);
}

}  // namespace maille::tool
