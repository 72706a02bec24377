#include "io/scratch_mesh.h"

#include "base/result.h"
#include "mesh/cell_faces.h"

namespace maille {
namespace {

tl::unexpected<Error> too_many() {
  return failure(ErrorCode::usage, "more values than the mesh was described to have");
}

/// What was never written reads as zeros, as in a file with holes.
Result<> read_from(ScratchFile& file, uint64_t at, std::span<std::byte> out) {
  const uint64_t there = std::min<uint64_t>(out.size(), file.size() - std::min(file.size(), at));
  std::fill(out.begin() + static_cast<ptrdiff_t>(there), out.end(), std::byte{0});
  return there == 0 ? Result<>() : file.read_at(at, out.first(static_cast<size_t>(there)));
}

}  // namespace

Result<std::unique_ptr<ScratchMesh>> ScratchMesh::create(const MeshDescription& description,
                                                         const std::string& folder) {
  CellFile cells = MAILLE_TRY(CellFile::create(folder));
  ScratchFile points = MAILLE_TRY(ScratchFile::create(folder));
  std::unique_ptr<ScratchMesh> mesh(new ScratchMesh(description, std::move(cells), std::move(points)));
  for (size_t i = 0; i < description.arrays.size(); ++i)
    mesh->arrays_.push_back(MAILLE_TRY(ScratchFile::create(folder)));
  return mesh;
}

Result<> ScratchMesh::write_points(uint64_t first, Bytes positions) {
  const size_t size = 3 * size_of(description_.point_type);
  if (first > description_.points || positions.size() / size > description_.points - first) return too_many();
  return points_.write_at(first * size, positions);
}

Result<> ScratchMesh::write_array(size_t array, uint64_t first, Bytes tuples) {
  const Array& described = description_.arrays[array];
  const uint64_t count = description_.count_of(described);
  if (first > count || tuples.size() / described.tuple_size() > count - first) return too_many();
  return arrays_[array].write_at(first * described.tuple_size(), tuples);
}

Result<> ScratchMesh::write_cells(const CellPiece& cells) {
  std::vector<uint32_t> nodes;
  for (uint64_t i = 0; i < cells.size(); ++i) {
    nodes.clear();
    // Pieces have 64-bit nodes, cells in the file and all formats that are spooled 32-bit ones.
    for (uint64_t k = cells.offsets[i]; k < cells.offsets[i + 1]; ++k) {
      if (cells.connectivity[k] >= max_points)
        return failure(ErrorCode::unsupported,
                       "a mesh of 2^32 points or more cannot be written in this format");
      nodes.push_back(static_cast<uint32_t>(cells.connectivity[k]));
    }
    const auto type = static_cast<CellType>(cells.types[i]);
    const bool polyhedron = type == CellType::polyhedron;
    if (polyhedron && cells.cell_faces.size() != cells.size() + 1)
      return failure(ErrorCode::usage, "polyhedra without faces");
    MAILLE_CHECK(cells_.add(type, nodes, polyhedron ? face_sizes_of(cells, i) : std::span<const uint32_t>()));
  }
  return {};
}

Result<> ScratchMesh::end() {
  MAILLE_CHECK(cells_.end());
  if (cells_.cells() == description_.cells && cells_.corners() == description_.corners) return {};
  return failure(ErrorCode::usage, "not as many cells were written as described");
}

Result<> ScratchMesh::read_points(uint64_t first, uint64_t count, std::span<std::byte> out) {
  const size_t size = 3 * size_of(description_.point_type);
  if (count > description_.points || first > description_.points - count || out.size() != count * size)
    return too_many();
  return read_from(points_, first * size, out);
}

Result<> ScratchMesh::read_array(size_t array, uint64_t first, uint64_t count, std::span<std::byte> out) {
  const Array& described = description_.arrays[array];
  const uint64_t all = description_.count_of(described);
  if (count > all || first > all - count || out.size() != count * described.tuple_size()) return too_many();
  return read_from(arrays_[array], first * described.tuple_size(), out);
}

}  // namespace maille
