#include <algorithm>
#include <tuple>

#include "base/result.h"
#include "volume/pieces/piece_reader.h"

namespace maille {
namespace {

/// By piece the numbers of its points in the joined mesh.
struct PointNumbers {
  std::vector<std::vector<uint32_t>> of_piece;
  uint64_t count = 0;
};

PointNumbers numbers_by_places(const std::vector<DecodedPiece>& pieces) {
  std::vector<PieceOfPoints> points;
  for (const DecodedPiece& piece : pieces) points.push_back(piece_of_points(piece.mesh.points, piece.shared));
  const JoinedPoints joined = join_points(points);
  PointNumbers numbers;
  numbers.count = joined.count;
  for (const JoinedPart& part : joined.parts) numbers.of_piece.push_back(part.all_numbers());
  return numbers;
}

/// Points in the order of their numbers in the input, gaps left out.
PointNumbers numbers_by_input(const std::vector<DecodedPiece>& pieces) {
  std::vector<uint32_t> all;
  for (const DecodedPiece& piece : pieces)
    all.insert(all.end(), piece.numbers.points.begin(), piece.numbers.points.end());
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  PointNumbers numbers;
  numbers.count = all.size();
  for (const DecodedPiece& piece : pieces) {
    std::vector<uint32_t>& of_piece = numbers.of_piece.emplace_back();
    auto at = all.begin();
    for (const uint32_t number : piece.numbers.points) {
      at = std::lower_bound(at, all.end(), number);
      of_piece.push_back(static_cast<uint32_t>(at - all.begin()));
    }
  }
  return numbers;
}

/// A cell of a piece.
struct CellPlace {
  uint32_t number = 0;  ///< in the input; 0 where that is not asked for
  uint32_t piece = 0, block = 0;
  uint32_t cell = 0;      ///< of that block
  uint32_t in_piece = 0;  ///< through its blocks
};

/// By block of the whole mesh, its cells.
using CellsOfBlocks = std::vector<std::vector<CellPlace>>;

class PieceJoiner {
 public:
  PieceJoiner(const std::vector<DecodedPiece>& pieces, const PieceReader& reader, bool numbered)
      : pieces_(pieces), reader_(reader), numbered_(numbered) {}

  Result<Mesh> run() {
    points_ = numbered_ ? numbers_by_input(pieces_) : numbers_by_places(pieces_);
    if (points_.count > max_points) return damaged("more points than a mesh in memory can have");
    list_cells();
    if (numbered_) MAILLE_CHECK(sort_cells());
    Mesh mesh;
    mesh.points = empty_like(reader_.header().description.positions);
    take_points(mesh.points, [](const Mesh& piece) -> const Array& { return piece.points; });
    for (size_t b = 0; b < cells_.size(); ++b) mesh.blocks.push_back(block_of(b));
    take_arrays(mesh);
    mesh.metadata = reader_.header().description.metadata;
    return mesh;
  }

 private:
  tl::unexpected<Error> damaged(const std::string& what) const {
    return failure(ErrorCode::corrupt, reader_.name() + ": the pieces do not fit: " + what);
  }

  void list_cells() {
    cells_.resize(reader_.tail().blocks.size());
    for (uint32_t p = 0; p < pieces_.size(); ++p) {
      const DecodedPiece& piece = pieces_[p];
      uint32_t in_piece = 0;
      for (uint32_t b = 0; b < piece.blocks.size(); ++b) {
        const auto count = static_cast<uint32_t>(piece.mesh.blocks[b].size());
        for (uint32_t i = 0; i < count; ++i, ++in_piece) {
          const uint32_t number = numbered_ ? piece.numbers.cells[in_piece] : 0;
          cells_[piece.blocks[b]].push_back({number, p, b, i, in_piece});
        }
      }
    }
  }

  /// Numbers of cells must be those of their blocks, each once.
  Result<> sort_cells() {
    uint64_t first = 0;
    for (size_t b = 0; b < cells_.size(); ++b) {
      std::vector<CellPlace>& cells = cells_[b];
      std::sort(cells.begin(), cells.end(),
                [](const CellPlace& x, const CellPlace& y) { return x.number < y.number; });
      const uint64_t end = first + reader_.tail().blocks[b].cells;
      for (size_t i = 0; i < cells.size(); ++i) {
        if (cells[i].number < first || cells[i].number >= end ||
            (i > 0 && cells[i].number == cells[i - 1].number))
          return damaged("numbers of cells");
      }
      first = end;
    }
    return {};
  }

  static Array empty_like(const StreamArray& described) {
    Array array =
        make_array(described.name, described.domain, described.type, described.components, described.role);
    array.labels = described.labels;
    return array;
  }

  template <class ArrayOf>
  void take_points(Array& to, ArrayOf array_of) const {
    to.resize(points_.count);
    const size_t size = to.tuple_size();
    for (size_t p = 0; p < pieces_.size(); ++p) {
      const std::vector<uint32_t>& numbers = points_.of_piece[p];
      const std::byte* from = array_of(pieces_[p].mesh).bytes.data();
      for (size_t i = 0; i < numbers.size(); ++i, from += size)
        std::copy_n(from, size, to.bytes.data() + numbers[i] * size);
    }
  }

  CellBlock block_of(size_t b) const {
    const StreamTail::Block& described = reader_.tail().blocks[b];
    CellBlock to;
    to.name = described.name;
    to.type = described.type;
    const bool sized = nodes_of(to.type) == 0;
    const bool has_faces = std::any_of(cells_[b].begin(), cells_[b].end(), [&](const CellPlace& place) {
      return !block_at(place).cell_faces.empty();
    });
    if (sized) to.offsets.push_back(0);
    if (has_faces) to.cell_faces.push_back(0);
    for (const CellPlace& place : cells_[b]) {
      const CellBlock& from = block_at(place);
      const std::vector<uint32_t>& numbers = points_.of_piece[place.piece];
      for (const uint32_t point : from.cell(place.cell)) to.connectivity.push_back(numbers[point]);
      if (sized) to.offsets.push_back(to.connectivity.size());
      if (to.type == CellType::mixed) to.types.push_back(from.types[place.cell]);
      if (!has_faces) continue;
      const auto faces = from.cell_faces.empty() ? std::span<const uint32_t>() : from.faces(place.cell);
      to.face_sizes.insert(to.face_sizes.end(), faces.begin(), faces.end());
      to.cell_faces.push_back(to.face_sizes.size());
    }
    return to;
  }
  const CellBlock& block_at(const CellPlace& place) const {
    return pieces_[place.piece].mesh.blocks[place.block];
  }

  void take_arrays(Mesh& mesh) const {
    const StreamDescription& description = reader_.header().description;
    size_t next = 0;
    for (size_t i = 0; i < description.arrays.size(); ++i) {
      if (reader_.wanted()[i] == 0) continue;
      const size_t number = next++;
      const auto array_of = [&](const Mesh& piece) -> const Array& { return piece.arrays[number]; };
      Array& array = mesh.arrays.emplace_back(empty_like(description.arrays[i]));
      if (array.domain == Domain::point) {
        take_points(array, array_of);
        continue;
      }
      const size_t size = array.tuple_size();
      for (const std::vector<CellPlace>& cells : cells_) {
        for (const CellPlace& place : cells) {
          const std::byte* from = array_of(pieces_[place.piece].mesh).bytes.data() + place.in_piece * size;
          array.bytes.insert(array.bytes.end(), from, from + size);
        }
      }
    }
    for (const Array& array : description.mesh_arrays) mesh.arrays.push_back(array);
  }

  const std::vector<DecodedPiece>& pieces_;
  const PieceReader& reader_;
  bool numbered_;
  PointNumbers points_;
  CellsOfBlocks cells_;
};

}  // namespace

Result<Mesh> join_pieces(const std::vector<DecodedPiece>& pieces, const PieceReader& reader, bool numbered) {
  return PieceJoiner(pieces, reader, numbered).run();
}

}  // namespace maille
