#include "generate_stream.h"

#include <maille/stream.h>

#include <algorithm>
#include <optional>

#include "in_parts.h"
#include "result.h"

namespace maille::tool {

namespace {

class StreamedGeneration final : public GeneratedOutput {
 public:
  StreamedGeneration(const BlockDescription& description, Sink& sink, const GenerateOptions& options,
                     Executor* executor, ProgressDisplay& progress)
      : description_(description), sink_(sink), options_(options), executor_(executor), progress_(progress) {}

  Result<> begin(const GeneratedSize& size) override {
    StreamOptions stream;
    stream.positions.type = Scalar::f64;
    stream.any_order = options_.generation.streaming_order;
    stream.executor = executor_;
    StreamArray label{"patch", Domain::cell, Scalar::u16, 1, Role::label, {}, {}, {}};
    for (const HexBlock& block : description_.blocks) zones_.push_back(label_of(label.labels, block.zone));
    for (const BlockPatch& patch : size.patches) {
      patches_.push_back(label_of(label.labels, patch.name));
      stream.metadata.emplace_back("patch." + patch.name, patch.type);
    }
    if (label.labels.size() > 0xffff)
      return failure(ErrorCode::unsupported, "more than 65535 zones and patches");
    stream.arrays.push_back(std::move(label));
    writer_.emplace(TOOL_TRY(StreamWriter::begin(sink_, std::move(stream))));
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
  Result<StreamReport> finish() { return writer_->finish(); }

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
  Sink& sink_;
  const GenerateOptions& options_;
  Executor* executor_;
  ProgressDisplay& progress_;
  Progress watch_;
  std::optional<StreamWriter> writer_;
  std::vector<uint16_t> zones_, patches_, labels_;
  uint64_t cells_ = 0, done_ = 0;
};

}  // namespace

Result<StreamReport> generate_stream(const BlockDescription& description, const GenerateOptions& options,
                                     Sink& sink, ProgressDisplay& progress) {
  keep_memory_small();
  const Threads threads(options.common.threads);
  StreamedGeneration output(description, sink, options, threads.executor(), progress);
  TOOL_CHECK(generate(description, options.generation, output));
  return output.finish();
}

}  // namespace maille::tool
