#include <maille/generate.h>

#include <cstring>

#include "base/result.h"

namespace maille {

namespace {

/// Cells of any types of one zone or patch. Types are kept as runs, since nearly all cells are hexahedra: a
/// uniform block then takes nothing for them.
class BlockBuilder {
 public:
  explicit BlockBuilder(std::string name) { block_.name = std::move(name); }

  void add(CellType type, std::span<const uint64_t> nodes) {
    const unsigned each = nodes_of(type);
    if (counts_.empty() || counts_.back().first != type) counts_.push_back({type, 0});
    counts_.back().second += nodes.size() / each;
    for (const uint64_t node : nodes) block_.connectivity.push_back(static_cast<uint32_t>(node));
  }

  CellBlock finish() && {
    if (counts_.empty()) return std::move(block_);
    block_.type = counts_.size() == 1 ? counts_[0].first : CellType::mixed;
    if (counts_.size() > 1) {
      block_.offsets.push_back(0);
      for (const auto& [type, count] : counts_) {
        block_.types.insert(block_.types.end(), count, static_cast<uint8_t>(type));
        for (uint64_t i = 0; i < count; ++i) block_.offsets.push_back(block_.offsets.back() + nodes_of(type));
      }
    }
    return std::move(block_);
  }
  bool empty() const { return counts_.empty(); }
  const std::string& name() const { return block_.name; }

 private:
  CellBlock block_;
  std::vector<std::pair<CellType, uint64_t>> counts_;  // runs
};

// Gathers what is generated in memory: a block for each run of one zone, then one for each patch.
class MeshOutput final : public GeneratedOutput {
 public:
  MeshOutput(const BlockDescription& description, const Limits& limits)
      : description_(description), limits_(limits) {
    mesh.points.type = Scalar::f64;
  }

  Result<> begin(const GeneratedSize& size) override {
    // Three doubles for each point and eight 32-bit numbers for each cell; faces come beside, and are few.
    const double bytes = 24.0 * static_cast<double>(size.points) + 32.0 * static_cast<double>(size.cells);
    if (size.points > max_points || bytes > static_cast<double>(limits_.mesh_bytes)) {
      return failure(ErrorCode::memory_bound, std::to_string(size.cells) + " cells and " +
                                                  std::to_string(size.points) +
                                                  " points are more than fit into memory");
    }
    mesh.points.resize(size.points);
    for (const BlockPatch& patch : size.patches) {
      patches_.emplace_back(patch.name);
      mesh.metadata.emplace_back("patch." + patch.name, patch.type);
    }
    return {};
  }

  Result<> points(uint64_t first, std::span<const double> coordinates) override {
    std::memcpy(mesh.points.bytes.data() + 24 * first, coordinates.data(), coordinates.size_bytes());
    return {};
  }

  Result<> faces(uint32_t patch, CellType type, std::span<const uint64_t> nodes) override {
    patches_[patch].add(type, nodes);
    return {};
  }

  Result<> cells(uint32_t block, CellType type, std::span<const uint64_t> nodes,
                 std::span<const uint8_t>) override {
    // A block of cells for each run of one zone, so that the order of cells is kept.
    const std::string& zone = description_.blocks[block].zone;
    if (zones_.empty() || zones_.back().name() != zone) zones_.emplace_back(zone);
    zones_.back().add(type, nodes);
    return {};
  }

  Mesh finish() && {
    for (BlockBuilder& zone : zones_) mesh.blocks.push_back(std::move(zone).finish());
    for (BlockBuilder& patch : patches_) {
      if (!patch.empty()) mesh.blocks.push_back(std::move(patch).finish());
    }
    return std::move(mesh);
  }

  Mesh mesh;

 private:
  const BlockDescription& description_;
  const Limits limits_;
  std::vector<BlockBuilder> zones_;
  std::vector<BlockBuilder> patches_;
};

}  // namespace

Result<Mesh> generate_mesh(const BlockDescription& description, const GenerateOptions& options,
                           const Limits& limits) {
  MeshOutput output(description, limits);
  GenerateOptions whole = options;
  whole.faces_last = !options.streaming_order;
  MAILLE_CHECK(generate(description, whole, output));
  return std::move(output).finish();
}

}  // namespace maille
