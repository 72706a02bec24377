#include <algorithm>
#include <optional>

#include "base/result.h"
#include "base/sort_unique.h"
#include "mesh/empty_like.h"
#include "mesh/ranked_set.h"
#include "volume/pieces/piece_reader.h"

namespace maille {
namespace {

/// By piece the numbers of its points in the joined mesh.
struct PointNumbers {
  std::vector<std::vector<uint32_t>> of_piece;
  uint64_t count = 0;
};

/// Shared points are known by place and copy; the others follow one another piece by piece.
PointNumbers numbers_by_places(const std::vector<DecodedPiece>& pieces) {
  std::vector<PieceOfPoints> points;
  for (const DecodedPiece& piece : pieces) points.push_back(piece_of_points(piece.mesh.points, piece.shared));
  const JoinedPoints joined = join_points(points);
  PointNumbers numbers;
  numbers.count = joined.count;
  for (const JoinedPart& part : joined.parts) numbers.of_piece.push_back(part.all_numbers());
  return numbers;
}

/// Numbers that pieces have, and the place of each among them: by a set with a bit for each possible number.
/// Where they are anywhere among four billion, as those of a few pieces may be, the list is sorted instead:
/// the set may take 64 bits for each number expected.
class InputNumbers {
 public:
  explicit InputNumbers(uint64_t expected) : most_(64 * expected) {}
  void add(std::span<const uint32_t> rising) {
    if (!rising.empty()) end_ = std::max<uint64_t>(end_, uint64_t{rising.back()} + 1);
    lists_.push_back(rising);
  }
  /// Behind the last add().
  void count() {
    if (end_ <= most_) {
      set_.emplace(end_);
      for (const auto list : lists_) {
        for (const uint32_t number : list) set_->add(number);
      }
      set_->count();
      return;
    }
    for (const auto list : lists_) sorted_.insert(sorted_.end(), list.begin(), list.end());
    sort_unique(sorted_);
  }
  uint64_t size() const { return set_ ? set_->size() : sorted_.size(); }
  uint32_t rank(uint32_t number) const {
    if (set_) return set_->rank(number);
    const auto at = std::lower_bound(sorted_.begin(), sorted_.end(), number);
    return static_cast<uint32_t>(at - sorted_.begin());
  }

 private:
  uint64_t most_, end_ = 0;
  std::vector<std::span<const uint32_t>> lists_;
  std::optional<RankedSet> set_;
  std::vector<uint32_t> sorted_;
};

/// Points in the order of their numbers in the input, gaps left out: of a part of a mesh they are numbered
/// without gaps.
PointNumbers numbers_by_input(const std::vector<DecodedPiece>& pieces, Executor& executor) {
  uint64_t expected = 0;
  for (const DecodedPiece& piece : pieces) expected += piece.numbers.points.size();
  InputNumbers all(expected);
  for (const DecodedPiece& piece : pieces) all.add(piece.numbers.points);
  all.count();
  PointNumbers numbers;
  numbers.count = all.size();
  numbers.of_piece.resize(pieces.size());
  executor.parallel_for(pieces.size(), [&](size_t p) {
    numbers.of_piece[p].reserve(pieces[p].numbers.points.size());
    for (const uint32_t number : pieces[p].numbers.points) numbers.of_piece[p].push_back(all.rank(number));
  });
  return numbers;
}

/// A cell of a piece.
struct CellPlace {
  uint32_t piece = 0, block = 0;
  uint32_t cell = 0;      ///< of that block
  uint32_t in_piece = 0;  ///< through its blocks
};

/// By block of the whole mesh, its cells.
using CellsOfBlocks = std::vector<std::vector<CellPlace>>;

/// The steps are those of run(): numbers of points, places of cells, then every array once. Threads write
/// disjoint stretches of the result, so that it does not depend on them.
class PieceJoiner {
 public:
  PieceJoiner(const std::vector<DecodedPiece>& pieces, const PieceReader& reader, bool numbered,
              Executor& executor)
      : pieces_(pieces), reader_(reader), numbered_(numbered), executor_(executor) {}

  Result<Mesh> run() {
    points_ = numbered_ ? numbers_by_input(pieces_, executor_) : numbers_by_places(pieces_);
    if (points_.count > max_points) return damaged("more points than a mesh in memory can have");
    MAILLE_CHECK(list_cells());
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

  static constexpr size_t stretch = size_t{1} << 14;
  /// work(begin, end) for stretches of so many of `count`, side by side.
  template <class Work>
  void for_stretches(size_t count, Work work) const {
    executor_.parallel_for((count + stretch - 1) / stretch,
                           [&](size_t i) { work(i * stretch, std::min(count, (i + 1) * stretch)); });
  }

  /// Cells of a piece in one block: these from `first` on, in the piece.
  struct Run {
    uint32_t block = 0;  ///< of the whole mesh
    uint64_t place = 0;  ///< among those of the block, piece after piece
    uint32_t first = 0, cells = 0;
  };

  /// Where each cell of the result comes from. With numbers the place of a cell is its rank in its block.
  Result<> list_cells() {
    cells_.resize(reader_.tail().blocks.size());
    std::vector<uint64_t> counts(cells_.size());
    std::vector<std::vector<Run>> runs(pieces_.size());
    for (size_t p = 0; p < pieces_.size(); ++p) {
      uint32_t first = 0;
      for (size_t b = 0; b < pieces_[p].blocks.size(); ++b) {
        const uint32_t block = pieces_[p].blocks[b];
        const auto cells = static_cast<uint32_t>(pieces_[p].mesh.blocks[b].size());
        runs[p].push_back({block, counts[block], first, cells});
        counts[block] += cells;
        first += cells;
      }
    }
    std::vector<InputNumbers> numbers;
    if (numbered_) numbers = MAILLE_TRY(numbers_of_blocks(runs, counts));
    for (size_t b = 0; b < cells_.size(); ++b) cells_[b].resize(counts[b]);
    executor_.parallel_for(pieces_.size(), [&](size_t p) {
      for (uint32_t b = 0; b < runs[p].size(); ++b) {
        const Run& run = runs[p][b];
        for (uint32_t i = 0; i < run.cells; ++i) {
          const uint64_t place =
              numbered_ ? numbers[run.block].rank(pieces_[p].numbers.cells[run.first + i]) : run.place + i;
          cells_[run.block][place] = {static_cast<uint32_t>(p), b, i, run.first + i};
        }
      }
    });
    return {};
  }

  /// The numbers of the cells of each block. They must be those of their blocks, each once: else two cells
  /// would have one place, and another none.
  Result<std::vector<InputNumbers>> numbers_of_blocks(const std::vector<std::vector<Run>>& runs,
                                                      const std::vector<uint64_t>& counts) const {
    std::vector<InputNumbers> numbers(counts.begin(), counts.end());
    std::vector<uint64_t> ends;
    for (const StreamTail::Block& block : reader_.tail().blocks)
      ends.push_back((ends.empty() ? 0 : ends.back()) + block.cells);
    for (size_t p = 0; p < runs.size(); ++p) {
      for (const Run& run : runs[p]) {
        if (run.cells == 0) continue;
        const auto cells = std::span(pieces_[p].numbers.cells).subspan(run.first, run.cells);
        const uint64_t first = run.block == 0 ? 0 : ends[run.block - 1];
        if (cells.front() < first || cells.back() >= ends[run.block]) return damaged("numbers of cells");
        numbers[run.block].add(cells);
      }
    }
    for (size_t b = 0; b < numbers.size(); ++b) {
      numbers[b].count();
      if (numbers[b].size() != counts[b]) return damaged("numbers of cells");
    }
    return numbers;
  }

  /// Points that several pieces have are written by each of them, with the same values; of steps they may
  /// differ within the bound, and the last piece wins.
  template <class ArrayOf>
  void take_points(Array& to, ArrayOf array_of) const {
    to.resize(points_.count);
    const size_t size = to.tuple_size();
    const auto take = [&](size_t p, size_t first, size_t last) {
      const std::vector<uint32_t>& numbers = points_.of_piece[p];
      const std::byte* from = array_of(pieces_[p].mesh).bytes.data() + first * size;
      for (size_t i = first; i < last; ++i, from += size)
        std::copy_n(from, size, to.bytes.data() + numbers[i] * size);
    };
    if (!numbered_) {
      for (size_t p = 0; p < pieces_.size(); ++p) take(p, 0, points_.of_piece[p].size());
      return;
    }
    // Numbers rise within each piece, so that stretches of them have nothing in common though pieces have: a
    // search finds where each begins.
    for_stretches(points_.count, [&](size_t begin, size_t end) {
      for (size_t p = 0; p < pieces_.size(); ++p) {
        const std::vector<uint32_t>& numbers = points_.of_piece[p];
        const auto place_of = [&](size_t number) {
          return static_cast<size_t>(std::lower_bound(numbers.begin(), numbers.end(), number) -
                                     numbers.begin());
        };
        take(p, place_of(begin), place_of(end));
      }
    });
  }

  /// Blocks of one size are copied by stretches; others grow cell by cell.
  CellBlock block_of(size_t b) const {
    const StreamTail::Block& described = reader_.tail().blocks[b];
    CellBlock to;
    to.name = described.name;
    to.type = described.type;
    const bool sized = nodes_of(to.type) == 0;
    if (!sized) {
      take_corners(b, to);
      return to;
    }
    const bool has_faces = std::any_of(cells_[b].begin(), cells_[b].end(), [&](const CellPlace& place) {
      return !block_at(place).cell_faces.empty();
    });
    make_room(b, has_faces, to);
    to.offsets.push_back(0);
    if (has_faces) to.cell_faces.push_back(0);
    for (const CellPlace& place : cells_[b]) {
      const CellBlock& from = block_at(place);
      const std::vector<uint32_t>& numbers = points_.of_piece[place.piece];
      for (const uint32_t point : from.cell(place.cell)) to.connectivity.push_back(numbers[point]);
      to.offsets.push_back(to.connectivity.size());
      if (to.type == CellType::mixed) to.types.push_back(from.types[place.cell]);
      if (!has_faces) continue;
      const auto faces = from.cell_faces.empty() ? std::span<const uint32_t>() : from.faces(place.cell);
      to.face_sizes.insert(to.face_sizes.end(), faces.begin(), faces.end());
      to.cell_faces.push_back(to.face_sizes.size());
    }
    return to;
  }
  /// For all cells of a block: lists that grow are there with their old room and with twice as
  /// much, 13 MB for the corners of 409,600 polygons instead of 5.
  void make_room(size_t b, bool has_faces, CellBlock& to) const {
    size_t corners = 0, faces = 0;
    for (const CellPlace& place : cells_[b]) {
      const CellBlock& from = block_at(place);
      corners += from.cell(place.cell).size();
      if (!from.cell_faces.empty()) faces += from.faces(place.cell).size();
    }
    const size_t cells = cells_[b].size();
    to.connectivity.reserve(corners);
    to.offsets.reserve(cells + 1);
    if (to.type == CellType::mixed) to.types.reserve(cells);
    if (!has_faces) return;
    to.face_sizes.reserve(faces);
    to.cell_faces.reserve(cells + 1);
  }
  /// Corners of a block whose cells have as many corners each.
  void take_corners(size_t b, CellBlock& to) const {
    const size_t nodes = nodes_of(to.type);
    to.connectivity.resize(cells_[b].size() * nodes);
    for_stretches(cells_[b].size(), [&](size_t begin, size_t end) {
      uint32_t* out = to.connectivity.data() + begin * nodes;
      for (size_t i = begin; i < end; ++i) {
        const CellPlace& place = cells_[b][i];
        const std::vector<uint32_t>& numbers = points_.of_piece[place.piece];
        const uint32_t* from = block_at(place).connectivity.data() + place.cell * nodes;
        for (size_t k = 0; k < nodes; ++k) *out++ = numbers[from[k]];
      }
    });
  }
  const CellBlock& block_at(const CellPlace& place) const {
    return pieces_[place.piece].mesh.blocks[place.block];
  }

  template <class ArrayOf>
  // Block after block, as the cells of the mesh are numbered.
  void take_cells(Array& to, ArrayOf array_of) const {
    uint64_t count = 0;
    for (const std::vector<CellPlace>& cells : cells_) count += cells.size();
    to.resize(count);
    const size_t size = to.tuple_size();
    std::byte* out = to.bytes.data();
    for (const std::vector<CellPlace>& cells : cells_) {
      for_stretches(cells.size(), [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
          const std::byte* from = array_of(pieces_[cells[i].piece].mesh).bytes.data();
          std::copy_n(from + cells[i].in_piece * size, size, out + i * size);
        }
      });
      out += cells.size() * size;
    }
  }

  // Pieces have the arrays that were asked for, in the order of the file.
  void take_arrays(Mesh& mesh) const {
    const StreamDescription& description = reader_.header().description;
    size_t next = 0;
    for (size_t i = 0; i < description.arrays.size(); ++i) {
      if (reader_.wanted()[i] == 0) continue;
      const size_t number = next++;
      const auto array_of = [&](const Mesh& piece) -> const Array& { return piece.arrays[number]; };
      // Labels are those of the file; pieces have them, too, but are not asked.
      Array& array = mesh.arrays.emplace_back(empty_like(description.arrays[i]));
      if (array.domain == Domain::point) {
        take_points(array, array_of);
        continue;
      }
      take_cells(array, array_of);
    }
    for (const Array& array : description.mesh_arrays) mesh.arrays.push_back(array);
  }

  const std::vector<DecodedPiece>& pieces_;
  const PieceReader& reader_;
  bool numbered_;
  Executor& executor_;
  PointNumbers points_;
  CellsOfBlocks cells_;
};

}  // namespace

Result<Mesh> join_pieces(const std::vector<DecodedPiece>& pieces, const PieceReader& reader, bool numbered,
                         Executor* executor) {
  return PieceJoiner(pieces, reader, numbered, executor ? *executor : serial_executor()).run();
}

}  // namespace maille
