#include "mesh/mesh_as_source.h"

#include <algorithm>

#include "base/result.h"
#include "mesh/cell_faces.h"
#include "mesh/empty_like.h"

namespace maille {
namespace {

/// All calls copy from the mesh, so parts may be read in any order and again.
class MeshAsSource final : public MeshSource {
 public:
  explicit MeshAsSource(const Mesh& mesh) : mesh_(mesh) {
    description_.points = mesh.point_count();
    description_.cells = mesh.cell_count();
    description_.corners = mesh.corner_count();
    description_.point_type = mesh.points.type;
    description_.metadata = mesh.metadata;
    for (const CellBlock& block : mesh.blocks) {
      description_.blocks.push_back({block.name, block.type, block.size()});
      ends_.push_back((ends_.empty() ? 0 : ends_.back()) + block.size());
    }
    for (const Array& array : mesh.arrays) {
      if (array.domain == Domain::mesh) description_.mesh_arrays.push_back(array);
      // A source that is read in parts has no arrays on corners (MeshSource).
      if (array.domain != Domain::point && array.domain != Domain::cell) continue;
      description_.arrays.push_back(empty_like(array));
      arrays_.push_back(&array);
    }
  }

  const MeshDescription& description() const override { return description_; }
  Result<> read_points(uint64_t first, uint64_t count, std::span<std::byte> out) override {
    return copy(mesh_.points, first, count, out);
  }
  Result<> read_array(size_t array, uint64_t first, uint64_t count, std::span<std::byte> out) override {
    return copy(*arrays_[array], first, count, out);
  }
  Result<> read_cells(uint64_t first, uint64_t count, CellPiece& out) override {
    out.types.clear();
    out.connectivity.clear();
    out.face_sizes.clear();
    out.cell_faces.clear();
    out.offsets.assign(1, 0);
    // The sum of both could wrap around, so it is not formed.
    if (count > description_.cells || first > description_.cells - count)
      return failure(ErrorCode::usage, "more cells were asked for than there are");
    // The block that has the first cell; empty blocks end where they begin, so they are never it.
    auto b = static_cast<size_t>(std::upper_bound(ends_.begin(), ends_.end(), first) - ends_.begin());
    for (; count > 0; ++b) {
      const CellBlock& block = mesh_.blocks[b];
      const uint64_t here = std::min(count, ends_[b] - first), begin = first - (ends_[b] - block.size());
      for (uint64_t i = begin; i < begin + here; ++i)
        append_cell(block.type_of(i), block.cell(i), block.faces(i), out);
      first += here;
      count -= here;
    }
    return {};
  }

 private:
  static Result<> copy(const Array& array, uint64_t first, uint64_t count, std::span<std::byte> out) {
    const size_t size = array.tuple_size();
    if (count > array.count() || first > array.count() - count || out.size() != count * size)
      return failure(ErrorCode::usage, "more values were asked for than there are");
    std::copy_n(array.bytes.data() + first * size, count * size, out.data());
    return {};
  }

  const Mesh& mesh_;
  MeshDescription description_;
  std::vector<uint64_t> ends_;
  std::vector<const Array*> arrays_;
};

}  // namespace

std::unique_ptr<MeshSource> mesh_as_source(const Mesh& mesh) {
  return std::make_unique<MeshAsSource>(mesh);
}

}  // namespace maille
