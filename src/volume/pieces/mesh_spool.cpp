// A mesh that comes once, in temporary files, to be read in parts. Tuples go to their places by number, so
// that points may come in any order; cells are packed in groups, whose places are kept: eight bytes for 4,096
// cells are all the memory that grows.
#include <maille/out_of_core.h>

#include <algorithm>
#include <optional>

#include "base/result.h"
#include "base/scratch_file.h"
#include "mesh/empty_like.h"
#include "volume/pieces/packed_cells.h"

namespace maille {
namespace {

constexpr uint64_t cells_of_group = 4096;

/// Tuples by number, each at its place.
struct Column {
  ScratchFile file;
  size_t size;  ///< of a tuple
};

class SpooledMesh final : public MeshSource {
 public:
  explicit SpooledMesh(ScratchFile cells) : cells_(std::move(cells)) {}

  Result<> begin(const StreamOptions& options, const std::string& folder) {
    description_.point_type = options.positions.type;
    description_.mesh_arrays = options.mesh_arrays;
    description_.metadata = options.metadata;
    columns_.push_back({MAILLE_TRY(ScratchFile::create(folder)), options.positions.tuple_size()});
    for (const StreamArray& array : options.arrays) {
      description_.arrays.push_back(empty_like(array));
      columns_.push_back({MAILLE_TRY(ScratchFile::create(folder)), array.tuple_size()});
    }
    return {};
  }

  /// Runs of numbers are written at once. Gaps are holes until their points come; whether all came is told by
  /// their count alone, which a point given twice and another one left out would deceive.
  template <class NumberAt>
  Result<> add_points(uint64_t count, Bytes positions, std::span<const Bytes> arrays, NumberAt number_at) {
    size_t next = 0;
    MAILLE_CHECK(check(arrays.size() == count_of(Domain::point)));
    for (size_t c = 0; c < columns_.size(); ++c) {
      if (c > 0 && description_.arrays[c - 1].domain != Domain::point) continue;
      const Bytes tuples = c == 0 ? positions : arrays[next++];
      const size_t size = columns_[c].size;
      MAILLE_CHECK(check(tuples.size() == count * size));
      for (uint64_t i = 0, end = 0; i < count; i = end) {
        for (end = i + 1; end < count && number_at(end) == number_at(end - 1) + 1;) ++end;
        MAILLE_CHECK(
            columns_[c].file.write_at(number_at(i) * size, tuples.subspan(i * size, (end - i) * size)));
      }
    }
    for (uint64_t i = 0; i < count; ++i)
      description_.points = std::max(description_.points, number_at(i) + 1);
    points_given_ += count;
    return {};
  }

  void begin_block(std::string name, CellType type) {
    description_.blocks.push_back({std::move(name), type, 0});
  }

  // Types and nodes are checked by those who read the mesh in the end (SourcePieces::load()).
  Result<> add_cell(CellType type, std::span<const uint64_t> nodes, std::span<const uint32_t> faces) {
    if (description_.blocks.empty()) begin_block({}, CellType::mixed);
    packer_.pack(description_.cells, static_cast<uint32_t>(description_.blocks.size() - 1),
                 static_cast<uint8_t>(type), nodes, faces, out_);
    ++description_.blocks.back().cells;
    description_.corners += nodes.size();
    return ++description_.cells % cells_of_group == 0 ? end_group() : Result<>();
  }
  // Values of cells come in the order of the cells, so they are appended.
  Result<> add_values(uint64_t cells, std::span<const Bytes> arrays) {
    size_t next = 0;
    MAILLE_CHECK(check(arrays.size() == count_of(Domain::cell)));
    for (size_t c = 1; c < columns_.size(); ++c) {
      if (description_.arrays[c - 1].domain != Domain::cell) continue;
      MAILLE_CHECK(check(arrays[next].size() == cells * columns_[c].size));
      MAILLE_CHECK(columns_[c].file.append(arrays[next++]));
    }
    return {};
  }
  Result<> finish() {
    if (points_given_ != description_.points)
      return failure(ErrorCode::malformed_input, "the numbers of points have gaps or repeat");
    return end_group();
  }

  const MeshDescription& description() const override { return description_; }
  /// A description of the mesh so far; all of it is known after finish().
  Result<> read_points(uint64_t first, uint64_t count, std::span<std::byte> out) override {
    return read(0, first, count, description_.points, out);
  }
  Result<> read_array(size_t array, uint64_t first, uint64_t count, std::span<std::byte> out) override {
    return read(array + 1, first, count, description_.count_of(description_.arrays[array]), out);
  }
  Result<> read_cells(uint64_t first, uint64_t count, CellPiece& out) override {
    out = {};
    out.offsets.push_back(0);
    MAILLE_CHECK(check(count <= description_.cells && first <= description_.cells - count));
    for (uint64_t at = first; at < first + count;) {
      const uint64_t group = at / cells_of_group, end = std::min(first + count, (group + 1) * cells_of_group);
      MAILLE_CHECK(read_group(group, at, end, out));
      at = end;
    }
    return {};
  }

 private:
  static Result<> check(bool fits) {
    return fits ? Result<>() : failure(ErrorCode::usage, "values of another size than was declared");
  }
  size_t count_of(Domain domain) const {
    return static_cast<size_t>(std::count_if(description_.arrays.begin(), description_.arrays.end(),
                                             [&](const Array& array) { return array.domain == domain; }));
  }
  // A packer begins anew with each group, so that groups can be read alone.
  Result<> end_group() {
    begins_.push_back(cells_.size());
    const std::vector<std::byte> bytes = out_.take();
    out_ = {};
    packer_ = {};
    return cells_.append(bytes);
  }
  Result<> read(size_t column, uint64_t first, uint64_t count, uint64_t all, std::span<std::byte> out) {
    const size_t size = columns_[column].size;
    MAILLE_CHECK(check(count <= all && first <= all - count && out.size() == count * size));
    return columns_[column].file.read_at(first * size, out);
  }
  /// Groups are unpacked from their first cell on, as each cell is told by the one before: at most 4,095 are
  /// passed over.
  Result<> read_group(uint64_t group, uint64_t first, uint64_t end, CellPiece& out) {
    const uint64_t begin = begins_[group];
    std::vector<std::byte> bytes((group + 1 < begins_.size() ? begins_[group + 1] : cells_.size()) - begin);
    MAILLE_CHECK(cells_.read_at(begin, bytes));
    ByteReader in(bytes);
    CellUnpacker unpacker;
    for (uint64_t cell = group * cells_of_group; cell < end; ++cell) {
      const PackedCell& packed = unpacker.unpack(in);
      if (cell >= first) append(packed, out);
    }
    return {};
  }
  // Faces are noted for all cells from the first polyhedron on.
  static void append(const PackedCell& cell, CellPiece& out) {
    out.types.push_back(cell.type);
    out.connectivity.insert(out.connectivity.end(), cell.nodes.begin(), cell.nodes.end());
    out.offsets.push_back(out.connectivity.size());
    if (cell.faces.empty() && out.cell_faces.empty()) return;
    out.cell_faces.resize(out.types.size(), out.face_sizes.size());
    out.face_sizes.insert(out.face_sizes.end(), cell.faces.begin(), cell.faces.end());
    out.cell_faces.push_back(out.face_sizes.size());
  }

  MeshDescription description_;
  uint64_t points_given_ = 0;
  std::vector<Column> columns_;  ///< positions, then the arrays
  ScratchFile cells_;
  std::vector<uint64_t> begins_;  ///< of groups of cells
  CellPacker packer_;
  ByteWriter out_;
};

}  // namespace

class MeshSpool::Implementation {
 public:
  explicit Implementation(std::unique_ptr<SpooledMesh> given) : mesh(std::move(given)) {}
  std::unique_ptr<SpooledMesh> mesh;
};

MeshSpool::MeshSpool(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
MeshSpool::MeshSpool(MeshSpool&&) noexcept = default;
MeshSpool::~MeshSpool() = default;

Result<MeshSpool> MeshSpool::create(const StreamOptions& options, const WorkingSpace& space) {
  auto mesh = std::make_unique<SpooledMesh>(MAILLE_TRY(ScratchFile::create(space.folder)));
  MAILLE_CHECK(mesh->begin(options, space.folder));
  return MeshSpool(std::make_unique<Implementation>(std::move(mesh)));
}

Result<> MeshSpool::add_points(uint64_t first, Bytes positions, std::span<const Bytes> arrays) {
  const size_t size = 3 * size_of(implementation_->mesh->description().point_type);
  return implementation_->mesh->add_points(positions.size() / size, positions, arrays,
                                           [&](uint64_t i) { return first + i; });
}

Result<> MeshSpool::add_points(std::span<const uint64_t> numbers, Bytes positions,
                               std::span<const Bytes> arrays) {
  return implementation_->mesh->add_points(numbers.size(), positions, arrays,
                                           [&](uint64_t i) { return numbers[i]; });
}

Result<> MeshSpool::begin_block(std::string name, CellType type) {
  implementation_->mesh->begin_block(std::move(name), type);
  return {};
}

/// Flags of last use are not needed: pieces find their own.
Result<> MeshSpool::add_cells(CellType type, std::span<const uint64_t> connectivity, std::span<const uint8_t>,
                              std::span<const Bytes> arrays, size_t nodes) {
  if (nodes == 0) nodes = nodes_of(type);
  if (nodes == 0 && !connectivity.empty())
    return failure(ErrorCode::usage, std::string("how many nodes has a ") + name_of(type) + "?");
  const uint64_t cells = nodes == 0 ? 1 : connectivity.size() / nodes;
  for (uint64_t i = 0; i < cells; ++i)
    MAILLE_CHECK(implementation_->mesh->add_cell(type, connectivity.subspan(i * nodes, nodes), {}));
  return implementation_->mesh->add_values(cells, arrays);
}

Result<> MeshSpool::add_polyhedron(std::span<const uint32_t> face_sizes,
                                   std::span<const uint64_t> connectivity, std::span<const uint8_t>,
                                   std::span<const Bytes> arrays) {
  MAILLE_CHECK(implementation_->mesh->add_cell(CellType::polyhedron, connectivity, face_sizes));
  return implementation_->mesh->add_values(1, arrays);
}

Result<std::unique_ptr<MeshSource>> MeshSpool::finish() {
  MAILLE_CHECK(implementation_->mesh->finish());
  return std::unique_ptr<MeshSource>(std::move(implementation_->mesh));
}

}  // namespace maille
