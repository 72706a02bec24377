#include "generate_counts.h"

#include <fmt/format.h>

#include <algorithm>

#include "result.h"
#include "text.h"

namespace maille::tool {

namespace {

std::string cell_text(CellType type, uint64_t count) {
  std::string name = maille::name_of(type);
  // Plurals: tetrahedra and hexahedra, but wedges and pyramids.
  const size_t greek = name.rfind("hedron");
  if (count != 1) name = greek == std::string::npos ? name + "s" : name.substr(0, greek) + "hedra";
  return fmt::format("{} {}", count, name);
}

}  // namespace

Result<> GeneratedCounts::begin(const GeneratedSize& size) {
  patches.resize(size.patches.size());
  for (size_t i = 0; i < patches.size(); ++i) patches[i] = {size.patches[i].name, size.patches[i].type, 0};
  too_long_ = size.cells > most_counted;
  return {};
}

Result<> GeneratedCounts::points(uint64_t, std::span<const double> coordinates) {
  point_count += coordinates.size() / 3;
  alive_ += coordinates.size() / 3;
  most_alive = std::max(most_alive, alive_);
  // Small meshes are counted to the end, so that the message can say exactly how much memory they need.
  if (too_long_ && alive_ > most_allowed) return failure(ErrorCode::memory_bound, "");
  return {};
}

Result<> GeneratedCounts::faces(uint32_t patch, CellType type, std::span<const uint64_t> nodes) {
  patches[patch].faces += nodes.size() / nodes_of(type);
  return {};
}

Result<> GeneratedCounts::cells(uint32_t, CellType type, std::span<const uint64_t> nodes,
                                std::span<const uint8_t> last_use) {
  add(type, nodes.size() / nodes_of(type));
  // A point is in use from its own call up to the cell that uses it last.
  for (const uint8_t last : last_use) alive_ -= last;
  return {};
}

void GeneratedCounts::add(CellType type, uint64_t count) {
  const auto known =
      std::find_if(types.begin(), types.end(), [&](const auto& entry) { return entry.first == type; });
  if (known == types.end()) {
    types.emplace_back(type, count);
  } else {
    known->second += count;
  }
  cell_count += count;
}

GeneratedCounts GeneratedCounts::of(const Mesh& mesh) {
  GeneratedCounts counter;
  counter.point_count = mesh.point_count();
  // Keys are "patch." and the name, as generate_mesh() writes them.
  for (const auto& [key, type] : mesh.metadata) counter.patches.push_back({key.substr(6), type, 0});
  for (const CellBlock& block : mesh.blocks) {
    const CellType first = block.types.empty() ? block.type : static_cast<CellType>(block.types[0]);
    const bool volume = dimension_of(first) == 3;
    if (!volume) {
      for (auto& patch : counter.patches) patch.faces += patch.name == block.name ? block.size() : 0;
    } else if (block.types.empty()) {
      counter.add(block.type, block.size());
    } else {
      for (const uint8_t type : block.types) counter.add(static_cast<CellType>(type), 1);
    }
  }
  return counter;
}

Json GeneratedCounts::json() const {
  Json by_patch = Json::array();
  for (const Patch& patch : patches) {
    by_patch.push_back({{"name", patch.name}, {"type", patch.type}, {"faces", patch.faces}});
  }
  Json by_type = Json::object();
  for (const auto& [type, count] : types) by_type[maille::name_of(type)] = count;
  return {{"points", point_count}, {"cells", cell_count}, {"cell_types", by_type}, {"patches", by_patch}};
}

std::string GeneratedCounts::text() const {
  std::string text = counted(point_count, "point");
  for (const auto& [type, count] : types) text += ", " + cell_text(type, count);
  uint64_t faces = 0;
  for (const Patch& patch : patches) faces += patch.faces;
  return text + fmt::format("; {} in {}", counted(faces, "outer face"),
                            patches.size() == 1 ? "1 patch" : fmt::format("{} patches", patches.size()));
}

}  // namespace maille::tool
