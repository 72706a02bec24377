#include "volume/ranks/piece_exchange.h"

#include <algorithm>
#include <tuple>

#include "base/bytes.h"
#include "base/sort_unique.h"
#include "volume/ranks/collective.h"

namespace maille {
namespace {

/// By point of this part its number in the whole mesh.
using Numbers = std::vector<uint32_t>;

/// Writes a cell on its way to another rank: type, points by their numbers in the whole mesh, sizes of faces.
void put_cell(ByteWriter& out, const CellBlock& block, uint64_t cell, const Numbers& points) {
  out.put(static_cast<uint8_t>(block.type_of(cell)));
  const auto corners = block.cell(cell);
  out.put_count(corners.size());
  for (const uint32_t point : corners) out.put(points[point]);
  const auto faces = block.cell_faces.empty() ? std::span<const uint32_t>() : block.faces(cell);
  out.put_count(faces.size());
  for (const uint32_t size : faces) out.put_count(size);
}

// Each cell with its piece, its number, its block, its points and its values: whoever gets it needs nothing
// else of this rank but values of points.
Buffers packed_cells(const RankPart& part, const PartLayout& layout, const Numbers& points,
                     const Division& division, unsigned ranks) {
  std::vector<ByteWriter> to(ranks);
  const Tuples tuples(*part.mesh, Domain::cell);
  std::vector<std::byte> tuple(tuples.size());
  size_t next = 0;
  for (size_t b = 0; b < part.mesh->blocks.size(); ++b) {
    const CellBlock& block = part.mesh->blocks[b];
    for (uint64_t i = 0, cells = block.size(); i < cells; ++i, ++next) {
      const uint32_t piece = division.pieces[next];
      ByteWriter& out = to[rank_of_piece(piece, division.count, ranks)];
      out.put(piece);
      out.put(division.numbers[next]);
      out.put(layout.block_of[b]);
      put_cell(out, block, i, points);
      tuples.read(next, tuple.data());
      out.put_bytes(tuple);
    }
  }
  return buffers_of(to);
}

/// A cell that arrived.
struct Arrival {
  uint32_t piece = 0, number = 0, block = 0;
  Bytes cell;  ///< as put_cell() wrote it
  const std::byte* tuple = nullptr;
};

// Cells are sorted before they are unpacked, so that only places of them are moved.
void skip_cell(ByteReader& in) {
  in.get<uint8_t>();
  in.get_bytes(in.get_count() * sizeof(uint32_t));
  for (uint64_t left = in.get_count(); left > 0; --left) in.get_count();
}

std::vector<Arrival> arrivals(const Buffers& buffers, size_t tuple_bytes) {
  std::vector<Arrival> all;
  for (const auto& buffer : buffers) {
    for (ByteReader in(buffer); in.remaining() > 0;) {
      Arrival& cell = all.emplace_back();
      cell.piece = in.get<uint32_t>();
      cell.number = in.get<uint32_t>();
      cell.block = in.get<uint32_t>();
      const size_t from = in.position();
      skip_cell(in);
      cell.cell = Bytes(buffer).subspan(from, in.position() - from);
      cell.tuple = in.get_bytes(tuple_bytes).data();
    }
  }
  // Cells come from many ranks: by number they stand as one process would have them.
  std::sort(all.begin(), all.end(), [](const Arrival& a, const Arrival& b) {
    return std::tie(a.piece, a.number) < std::tie(b.piece, b.number);
  });
  return all;
}

// Whether a block has faces, or sizes of its own, is decided by the layout of all ranks, not by what this
// piece has.
void append_cell(const Arrival& cell, const PartLayout::Block& block, CellBlock& to) {
  ByteReader in(cell.cell);
  const auto type = in.get<uint8_t>();
  for (uint64_t left = in.get_count(); left > 0; --left) to.connectivity.push_back(in.get<uint32_t>());
  if (block.type == CellType::mixed) to.types.push_back(type);
  if (nodes_of(block.type) == 0) to.offsets.push_back(to.connectivity.size());
  if (!block.has_faces) return;
  for (uint64_t left = in.get_count(); left > 0; --left)
    to.face_sizes.push_back(static_cast<uint32_t>(in.get_count()));
  to.cell_faces.push_back(to.face_sizes.size());
}

// As CellBlock has lists of offsets: they begin with 0.
void begin_block(const PartLayout::Block& block, CellBlock& to) {
  to.name = block.name;
  to.type = block.type;
  if (nodes_of(block.type) == 0) to.offsets.push_back(0);
  if (block.has_faces) to.cell_faces.push_back(0);
}

/// Cells of one piece as a mesh, as take_cells() has them: points are numbered within the piece, in the order
/// of the whole mesh.
PieceOfRank piece_of(std::span<const Arrival> cells, const PartLayout& layout) {
  PieceOfRank piece;
  piece.number = cells[0].piece;
  Mesh& mesh = piece.sub.mesh;
  for (const Arrival& cell : cells) {
    if (piece.sub.block_numbers.empty() || piece.sub.block_numbers.back() != cell.block) {
      piece.sub.block_numbers.push_back(cell.block);
      begin_block(layout.blocks[cell.block], mesh.blocks.emplace_back());
    }
    append_cell(cell, layout.blocks[cell.block], mesh.blocks.back());
    piece.cells.push_back(cell.number);
  }
  std::vector<uint32_t>& points = piece.sub.points;
  for (const CellBlock& block : mesh.blocks)
    points.insert(points.end(), block.connectivity.begin(), block.connectivity.end());
  sort_unique(points);
  for (CellBlock& block : mesh.blocks) {
    for (uint32_t& point : block.connectivity)
      point = static_cast<uint32_t>(std::lower_bound(points.begin(), points.end(), point) - points.begin());
  }
  return piece;
}

void give_arrays(const PartLayout& layout, PieceOfRank& piece) {
  piece.sub.mesh.points = layout.empty.points;
  piece.sub.mesh.points.resize(piece.sub.points.size());
  // As take_cells() has them.
  for (const Array& array : layout.empty.arrays) {
    if (array.domain != Domain::point && array.domain != Domain::cell) continue;
    Array& to = piece.sub.mesh.arrays.emplace_back(array);
    to.resize(array.domain == Domain::point ? piece.sub.points.size() : piece.cells.size());
  }
}

// Cells stand by piece and number in `all`, so that pieces are stretches of it.
std::vector<PieceOfRank> receive_cells(const RankPart& part, const PartLayout& layout,
                                       const PointDirectory& points, const Division& division, Ranks& ranks) {
  const Buffers buffers =
      ranks.exchange(packed_cells(part, layout, points.directory().numbers(), division, ranks.size()));
  const Tuples tuples(layout.empty, Domain::cell);
  const std::vector<Arrival> all = arrivals(buffers, tuples.size());
  std::vector<PieceOfRank> pieces;
  for (size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    while (end < all.size() && all[end].piece == all[begin].piece) ++end;
    const auto cells = std::span(all).subspan(begin, end - begin);
    PieceOfRank& piece = pieces.emplace_back(piece_of(cells, layout));
    give_arrays(layout, piece);
    const std::vector<Array*> arrays = Tuples::of(piece.sub.mesh, Domain::cell);
    for (size_t i = 0; i < cells.size(); ++i) put_tuple(arrays, i, cells[i].tuple);
  }
  return pieces;
}

/// Brings the numbers of points that no cell uses to the rank that codes them. They arrive rank by rank, and
/// so rising, as each rank looks after a stretch of numbers.
void receive_unused(const PartLayout& layout, const PointDirectory& points, const Division& division,
                    Ranks& ranks, std::vector<PieceOfRank>& pieces) {
  const unsigned owner = rank_of_piece(division.count - 1, division.count, ranks.size());
  ByteWriter mine;
  for (size_t i = 0; i < points.directory().count(); ++i) {
    if (!points.is_used(i)) mine.put(static_cast<uint32_t>(points.directory().first() + i));
  }
  Buffers to(ranks.size());
  to[owner] = mine.take();
  const Buffers found = ranks.exchange(std::move(to));
  if (owner != ranks.rank()) return;
  PieceOfRank& piece = pieces.emplace_back();
  piece.number = division.count - 1;
  for (const auto& buffer : found) {
    for (ByteReader in(buffer); in.remaining() > 0;) piece.sub.points.push_back(in.get<uint32_t>());
  }
  give_arrays(layout, piece);
}

/// Asks those who look after them for the values of points, and learns which of these other pieces have, too:
/// who answers sees all that ask.
class PointFetch {
 public:
  PointFetch(const PointDirectory& points, const PartLayout& layout, Ranks& ranks)
      : points_(points), ranks_(ranks), record_(1 + Tuples(layout.empty, Domain::point).size()) {}

  void run(std::vector<PieceOfRank>& pieces) {
    std::vector<ByteWriter> asked(ranks_.size());
    for (const PieceOfRank& piece : pieces) {
      for (const uint32_t point : piece.sub.points) asked[points_.directory().owner(point)].put(point);
    }
    const Buffers found = ranks_.exchange(answer(ranks_.exchange(buffers_of(asked))));
    std::vector<size_t> at(ranks_.size());
    for (PieceOfRank& piece : pieces) {
      const std::vector<Array*> arrays = Tuples::of(piece.sub.mesh, Domain::point);
      for (size_t i = 0; i < piece.sub.points.size(); ++i) {
        const unsigned owner = points_.directory().owner(piece.sub.points[i]);
        const std::byte* const from = found[owner].data() + at[owner]++ * record_;
        if (from[0] != std::byte{0}) piece.shared.push_back(piece.sub.points[i]);
        put_tuple(arrays, i, from + 1);
      }
    }
  }

 private:
  /// Each piece asks for a point once: one that is asked for more often is shared. Counts stop at two.
  Buffers answer(const Buffers& asked) const {
    const uint64_t first = points_.directory().first();
    std::vector<uint8_t> times(points_.directory().count());
    for (const auto& buffer : asked) {
      for (ByteReader in(buffer); in.remaining() > 0;) {
        uint8_t& count = times[in.get<uint32_t>() - first];
        count = std::min<uint8_t>(2, count + 1);
      }
    }
    Buffers answers(asked.size());
    for (size_t r = 0; r < asked.size(); ++r) {
      answers[r].resize(asked[r].size() / sizeof(uint32_t) * record_);
      std::byte* out = answers[r].data();
      for (ByteReader in(asked[r]); in.remaining() > 0; out += record_) {
        const size_t i = in.get<uint32_t>() - first;
        out[0] = times[i] > 1 ? std::byte{1} : std::byte{0};
        std::copy_n(points_.tuple(i), record_ - 1, out + 1);
      }
    }
    return answers;
  }

  const PointDirectory& points_;
  Ranks& ranks_;
  size_t record_;
};

}  // namespace

std::vector<PieceOfRank> exchange_pieces(const RankPart& part, const PartLayout& layout,
                                         const PointDirectory& points, const Division& division,
                                         Ranks& ranks) {
  std::vector<PieceOfRank> pieces = receive_cells(part, layout, points, division, ranks);
  if (division.has_unused) receive_unused(layout, points, division, ranks, pieces);
  PointFetch(points, layout, ranks).run(pieces);
  return pieces;
}

}  // namespace maille
