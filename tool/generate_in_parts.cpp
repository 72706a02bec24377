#include "generate_in_parts.h"

#include <maille/mesh_source.h>

#include <algorithm>
#include <map>

#include "files.h"
#include "in_parts.h"
#include "result.h"
#include "system.h"
#include "text.h"

namespace maille::tool {

namespace {

/// Collects what a sink has to know before the first point: the blocks that generate_mesh() would make. The
/// mesh is generated twice for this, which takes time but no memory.
class GeneratedBlocks final : public GeneratedOutput {
 public:
  explicit GeneratedBlocks(const BlockDescription& description) : description_(description) {}

  Result<> begin(const GeneratedSize& size) override {
    mesh_.points = size.points;
    mesh_.point_type = Scalar::f64;
    for (const BlockPatch& patch : size.patches) {
      patches_.push_back({patch.name, CellType::mixed, 0});
      mesh_.metadata.emplace_back("patch." + patch.name, patch.type);
    }
    return counts.begin(size);
  }
  Result<> points(uint64_t first, std::span<const double> coordinates) override {
    return counts.points(first, coordinates);
  }
  Result<> faces(uint32_t patch, CellType type, std::span<const uint64_t> nodes) override {
    add(patches_[patch], type, nodes.size());
    return counts.faces(patch, type, nodes);
  }
  Result<> cells(uint32_t block, CellType type, std::span<const uint64_t> nodes,
                 std::span<const uint8_t> last_use) override {
    const std::string& zone = description_.blocks[block].zone;
    if (mesh_.blocks.empty() || mesh_.blocks.back().name != zone)
      mesh_.blocks.push_back({zone, CellType::mixed, 0});
    add(mesh_.blocks.back(), type, nodes.size());
    return counts.cells(block, type, nodes, last_use);
  }
  MeshDescription finish() && {
    for (MeshDescription::Block& patch : patches_) {
      if (patch.cells != 0) mesh_.blocks.push_back(std::move(patch));
    }
    mesh_.types.assign(types_.begin(), types_.end());
    return std::move(mesh_);
  }

  GeneratedCounts counts;

 private:
  void add(MeshDescription::Block& block, CellType type, uint64_t corners) {
    const uint64_t cells = corners / nodes_of(type);
    block.type = block.cells == 0 || block.type == type ? type : CellType::mixed;
    block.cells += cells;
    types_[type] += cells;
    mesh_.cells += cells;
    mesh_.corners += corners;
  }

  const BlockDescription& description_;
  MeshDescription mesh_;
  std::vector<MeshDescription::Block> patches_;
  std::map<CellType, uint64_t> types_;
};

/// Hands cells to the sink a few thousand at a time, because each call of a sink costs a write.
class CellBatch {
 public:
  explicit CellBatch(MeshSink& sink) : sink_(sink) { clear(); }

  Result<> add(CellType type, std::span<const uint64_t> nodes) {
    const unsigned each = nodes_of(type);
    piece_.types.insert(piece_.types.end(), nodes.size() / each, static_cast<uint8_t>(type));
    for (size_t i = each; i <= nodes.size(); i += each)
      piece_.offsets.push_back(piece_.connectivity.size() + i);
    piece_.connectivity.insert(piece_.connectivity.end(), nodes.begin(), nodes.end());
    return piece_.size() < 4096 ? Result<>() : flush();
  }
  Result<> flush() {
    const auto written = sink_.write_cells(piece_);
    clear();
    return written;
  }

 private:
  void clear() {
    piece_.types.clear();
    piece_.offsets.assign(1, 0);
    piece_.connectivity.clear();
  }

  MeshSink& sink_;
  CellPiece piece_;
};

class GeneratedIntoSink final : public GeneratedOutput {
 public:
  GeneratedIntoSink(MeshSink& sink, bool faces_last, ProgressDisplay& progress)
      : sink_(sink), cells_(sink), faces_last_(faces_last), progress_(progress) {}

  Result<> begin(const GeneratedSize& size) override {
    waiting_.resize(size.patches.size());
    count_ = size.cells;
    watch_ = progress_.watch(static_cast<double>(count_), "cells");
    return {};
  }
  Result<> points(uint64_t first, std::span<const double> coordinates) override {
    return sink_.write_points(first, std::as_bytes(coordinates));
  }
  Result<> faces(uint32_t patch, CellType type, std::span<const uint64_t> nodes) override {
    if (faces_last_) return cells_.add(type, nodes);
    auto& runs = waiting_[patch];
    if (runs.empty() || runs.back().first != type) runs.push_back({type, {}});
    runs.back().second.insert(runs.back().second.end(), nodes.begin(), nodes.end());
    return {};
  }
  Result<> cells(uint32_t, CellType type, std::span<const uint64_t> nodes,
                 std::span<const uint8_t>) override {
    done_ += nodes.size() / nodes_of(type);
    if (watch_) watch_({"cells", static_cast<double>(done_) / static_cast<double>(count_)});
    return cells_.add(type, nodes);
  }
  Result<> finish() {
    for (const auto& patch : waiting_) {
      for (const auto& [type, nodes] : patch) TOOL_CHECK(cells_.add(type, nodes));
    }
    return cells_.flush();
  }

 private:
  MeshSink& sink_;
  CellBatch cells_;
  bool faces_last_;
  ProgressDisplay& progress_;
  Progress watch_;
  /// In streaming order faces come among the cells and are written behind them: 32 bytes each, by patch, in
  /// runs of one type.
  std::vector<std::vector<std::pair<CellType, std::vector<uint64_t>>>> waiting_;
  uint64_t count_ = 0, done_ = 0;
};

}  // namespace

Result<std::optional<GeneratedParts>> generate_in_parts(const BlockDescription& description,
                                                        const GenerateOptions& options,
                                                        const std::string& format) {
  if (!can_write_in_parts(format, options.output, false)) return std::nullopt;
  maille::GenerateOptions generation = options.generation;
  generation.faces_last = !generation.streaming_order;
  GeneratedBlocks blocks(description);
  // The mesh is generated twice: a sink must know blocks and counts before the first point. Generating takes
  // less time than writing.
  TOOL_CHECK(generate(description, generation, blocks));
  GeneratedParts parts{std::move(blocks.counts), 0};
  const MeshDescription mesh = std::move(blocks).finish();
  const bool folder = is_folder_format(format);
  TOOL_CHECK(check_output({options.output, options.input, options.force, true, folder}));
  const WorkingSpace space = space_for(options.common, options.output, false);
  auto opened = mesh_sink(options.output, format, mesh, {false, space.folder, space.memory});
  if (!opened && opened.error().code == ErrorCode::unsupported) return std::nullopt;
  const auto sink = TOOL_TRY(std::move(opened));
  keep_memory_small();
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  GeneratedIntoSink output(*sink, generation.faces_last, progress);
  TOOL_CHECK(generate(description, generation, output));
  TOOL_CHECK(output.finish());
  TOOL_CHECK(sink->commit());
  progress.clear();
  say_notes(options.output, notes_of(*sink, mesh, format), options.common.quiet);
  parts.output_bytes = bytes_of_output(options.output, folder);
  return parts;
}

}  // namespace maille::tool
