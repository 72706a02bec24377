#include "volume/pieces/source_pieces.h"

#include <algorithm>
#include <array>
#include <limits>

#include "base/hash.h"
#include "base/pace.h"
#include "base/result.h"
#include "base/sort_unique.h"
#include "mesh/cell_faces.h"
#include "mesh/empty_like.h"
#include "volume/order/working_memory.h"
#include "volume/pieces/cut_rules.h"
#include "volume/pieces/in_rounds.h"

namespace maille {
namespace {

constexpr uint64_t cells_at_once = 4096;
/// Meshes of no more cells are cut as they are in memory, others by a sample of so many: 2 million middles
/// take 32 MiB. Pieces of a sampled mesh are of unequal size by as much as the sample is off.
constexpr uint64_t most_sampled = uint64_t{1} << 21;
constexpr CellType no_type = CellType{0};

/// Places of rising numbers in their list, for millions of look-ups: a table by equal steps narrows the
/// search to mostly one or two of them. The table has at most about twice as many entries as there are
/// numbers.
class RankTable {
 public:
  explicit RankTable(std::span<const uint32_t> numbers) : numbers_(numbers) {
    if (numbers.empty()) return;
    const uint64_t width = uint64_t{numbers.back()} - numbers.front() + 1;
    while (width >> shift_ > 2 * numbers.size()) ++shift_;
    begins_.resize((width >> shift_) + 2, static_cast<uint32_t>(numbers.size()));
    for (size_t i = numbers.size(); i-- > 0;) begins_[step_of(numbers[i])] = static_cast<uint32_t>(i);
    for (size_t i = begins_.size() - 1; i-- > 0;) begins_[i] = std::min(begins_[i], begins_[i + 1]);
  }
  /// The number is there.
  uint32_t rank(uint32_t number) const {
    const size_t step = step_of(number);
    const auto first = numbers_.begin() + begins_[step], last = numbers_.begin() + begins_[step + 1];
    return static_cast<uint32_t>(std::lower_bound(first, last, number) - numbers_.begin());
  }

 private:
  size_t step_of(uint32_t number) const { return (number - numbers_.front()) >> shift_; }
  std::span<const uint32_t> numbers_;
  unsigned shift_ = 0;
  std::vector<uint32_t> begins_;
};

/// Points of cells, each once in the end. Most cells have points of the cells just before them, which need
/// not be sorted again and again: a direct-mapped cache of 8,192 points keeps most repetitions out of the
/// list.
class RecentPoints {
 public:
  void add(uint32_t point) {
    uint32_t& known = last_[point % last_.size()];
    if (known != point) points_.push_back(known = point);
  }
  std::vector<uint32_t> sorted() {
    sort_unique(points_);
    return std::move(points_);
  }

 private:
  std::vector<uint32_t> points_, last_ = std::vector<uint32_t>(8192, ~uint32_t{0});
};

/// The numbers of the points of packed cells, rising, each once.
std::vector<uint32_t> points_of(Bytes cells, size_t values_size) {
  RecentPoints points;
  ByteReader in(cells);
  CellUnpacker unpacker;
  while (in.remaining() > 0) {
    for (const uint64_t node : unpacker.unpack(in).nodes) points.add(static_cast<uint32_t>(node));
    in.get_bytes(values_size);
  }
  return points.sorted();
}

/// Appends a cell with the numbers of the piece; with the first polyhedron of a block all its cells have
/// faces.
void append_cell(const PackedCell& cell, const RankTable& ranks, CellBlock& to) {
  const bool sized = nodes_of(to.type) == 0, polyhedron = !cell.faces.empty();
  if (sized && to.offsets.empty()) to.offsets.push_back(0);
  if (polyhedron && to.cell_faces.empty()) to.cell_faces.assign(to.offsets.size(), 0);
  if (to.type == CellType::mixed) to.types.push_back(cell.type);
  for (const uint64_t node : cell.nodes) to.connectivity.push_back(ranks.rank(static_cast<uint32_t>(node)));
  if (sized) to.offsets.push_back(to.connectivity.size());
  if (to.cell_faces.empty()) return;
  to.face_sizes.insert(to.face_sizes.end(), cell.faces.begin(), cell.faces.end());
  to.cell_faces.push_back(to.face_sizes.size());
}

/// Splits tuples that stand one beside the other into arrays, a column at a time.
void split_tuples(Bytes tuples, std::span<Array* const> columns) {
  size_t size = 0;
  for (const Array* column : columns) size += column->tuple_size();
  const uint64_t count = size == 0 ? 0 : tuples.size() / size;
  size_t at = 0;
  for (Array* column : columns) {
    const size_t width = column->tuple_size();
    column->resize(count);
    for (uint64_t i = 0; i < count; ++i)
      std::copy_n(tuples.data() + i * size + at, width, column->bytes.data() + i * width);
    at += width;
  }
}

}  // namespace

SourcePieces::SourcePieces(MeshSource& mesh, const WorkingSpace& space, const EncodeOptions& options)
    : mesh_(mesh),
      space_(space),
      options_(options),
      executor_(options.executor ? *options.executor : serial_executor()) {
  const auto& blocks = description().blocks;
  one_unknown_ = blocks.size() == 1 && blocks[0].name.empty() && blocks[0].type == CellType::mixed;
  for (const MeshDescription::Block& block : blocks) {
    block_ends_.push_back((block_ends_.empty() ? 0 : block_ends_.back()) + block.cells);
    block_types_.push_back(one_unknown_ ? no_type : block.type);
  }
  for (size_t i = 0; i < description().arrays.size(); ++i) {
    if (description().arrays[i].domain != Domain::cell) continue;
    columns_.push_back(i);
    values_size_ += description().arrays[i].tuple_size();
  }
}

// The block whose end is the first above the cell, empty blocks passed over.
uint32_t SourcePieces::block_of(uint64_t cell) const {
  return static_cast<uint32_t>(std::upper_bound(block_ends_.begin(), block_ends_.end(), cell) -
                               block_ends_.begin());
}

/// Reads all cells, some thousand at a time, and tells progress by what was read.
template <class Visit>
Result<> SourcePieces::visit_cells(const char* stage, Visit visit) {
  const uint64_t cells = description().cells;
  CellPiece piece;
  for (uint64_t first = 0; first < cells; first += cells_at_once) {
    const double share = static_cast<double>(first) / static_cast<double>(cells);
    if (options_.progress && !options_.progress({stage, share})) return cancelled();
    MAILLE_CHECK(mesh_.read_cells(first, std::min(cells_at_once, cells - first), piece));
    MAILLE_CHECK(visit(first, piece));
  }
  return {};
}

/// In the order of the corners: the same middle as cut_cells() finds.
Result<CellCorners> SourcePieces::corners_of(std::span<const uint64_t> nodes) {
  const Scalar type = description().point_type;
  CellCorners corners;
  std::array<std::byte, 24> position;
  for (const uint64_t node : nodes) {
    MAILLE_CHECK(points_->read(node, position.data()));
    corners.add(cut_position(type, position.data()));
  }
  return corners;
}

/// All cells, or of each stretch of so many one at a place that no lattice knows: split_mix() of the stretch,
/// which is the same each time.
Result<> SourcePieces::sample(std::vector<Middle>& middles, ReachCounts& reaches) {
  const uint64_t stretch = (description().cells + most_sampled - 1) / most_sampled;
  uint64_t wanted = 0;
  return visit_cells("looking", [&](uint64_t first, const CellPiece& piece) -> Result<> {
    while (wanted < first + piece.size()) {
      const uint64_t i = wanted - first;
      const auto nodes =
          std::span(piece.connectivity).subspan(piece.offsets[i], piece.offsets[i + 1] - piece.offsets[i]);
      const CellCorners corners = MAILLE_TRY(corners_of(nodes));
      middles.push_back({corners.middle(), static_cast<uint32_t>(wanted)});
      reaches.add(corners.reach());
      const uint64_t next = (wanted / stretch + 1) * stretch;
      wanted = next + split_mix(next) % stretch;
    }
    return {};
  });
}

/// The type that all cells have so far, or mixed.
void SourcePieces::note_type(uint8_t type) {
  CellType& common = block_types_[0];
  common = common == no_type || common == static_cast<CellType>(type) ? static_cast<CellType>(type)
                                                                      : CellType::mixed;
}

/// The second reading of the cells: each goes to the list of its piece, with its values behind it. The packer
/// of each piece tells cells by what differs from the one before.
Result<> SourcePieces::distribute() {
  std::vector<CellPacker> packers(cells_->count());
  std::vector<std::vector<std::byte>> values(columns_.size());
  MAILLE_CHECK(visit_cells("distributing", [&](uint64_t first, const CellPiece& piece) -> Result<> {
    for (size_t k = 0; k < columns_.size(); ++k) {
      values[k].resize(piece.size() * description().arrays[columns_[k]].tuple_size());
      MAILLE_CHECK(mesh_.read_array(columns_[k], first, piece.size(), values[k]));
    }
    for (uint64_t i = 0; i < piece.size(); ++i) {
      const auto nodes =
          std::span(piece.connectivity).subspan(piece.offsets[i], piece.offsets[i + 1] - piece.offsets[i]);
      // Middles are computed once more: keeping them would take memory for every cell.
      const uint32_t to =
          by_number_
              ? by_number_->piece_of(first + i)
              : cuts_.piece_of({MAILLE_TRY(corners_of(nodes)).middle(), static_cast<uint32_t>(first + i)});
      ++sizes_[to].cells;
      ByteWriter out;
      packers[to].pack(first + i, block_of(first + i), piece.types[i], nodes, face_sizes_of(piece, i), out);
      for (size_t k = 0; k < columns_.size(); ++k) {
        const size_t size = description().arrays[columns_[k]].tuple_size();
        out.put_bytes(Bytes(values[k]).subspan(i * size, size));
      }
      MAILLE_CHECK(cells_->append(to, out.bytes()));
      if (one_unknown_) note_type(piece.types[i]);
    }
    return {};
  }));
  for (CellType& type : block_types_) type = type == no_type ? CellType::mixed : type;
  return cells_->finish();
}

/// The points of each piece, found from its cells, in rounds of eight pieces.
Result<> SourcePieces::list_points() {
  constexpr size_t at_once = 8;
  point_lists_ = MAILLE_TRY(ScratchLists::create(space_.folder, cells_->count(), 0));
  MAILLE_CHECK((in_rounds<std::vector<std::byte>, std::vector<uint32_t>>(
      executor_, cells_->count(), at_once, [&](size_t piece) { return cells_->read(piece); },
      [&](size_t, const std::vector<std::byte>& cells) -> Result<std::vector<uint32_t>> {
        return points_of(cells, values_size_);
      },
      [&](size_t piece, const std::vector<uint32_t>& points) -> Result<> {
        RisingWriter list(*point_lists_, piece, size_t{1} << 16);
        for (const uint32_t point : points) MAILLE_CHECK(list.add(point));
        sizes_[piece].points = points.size();
        return list.finish();
      })));
  return point_lists_->finish();
}

/// Both ways of cutting are compared by what eight pieces of each have (number_cut.h): by planes they are
/// there already, by number they are read for it.
Result<> SourcePieces::cut(uint64_t target) {
  constexpr uint64_t most = std::numeric_limits<uint32_t>::max();
  if (description().cells > most || description().points > most)
    return failure(ErrorCode::unsupported,
                   "a mesh of more than 2^32 - 1 cells or points cannot be cut into pieces");
  points_.emplace(mesh_, working_memory(space_) / 4, false);
  std::vector<Middle> middles;
  middles.reserve(std::min(description().cells, most_sampled + 1));
  ReachCounts reaches;
  MAILLE_CHECK(sample(middles, reaches));
  cuts_ = bisect(middles, reaches.median(), pieces_of(description().cells, target), executor_);
  // Given back before buffers of lists are made.
  std::vector<Middle>().swap(middles);
  std::vector<uint32_t>().swap(cuts_.places);
  MAILLE_CHECK(divide(cuts_.ends.size()));
  const NumberCut numbered = {description().cells, cuts_.ends.size()};
  if (numbered.pieces < 2) return {};
  const LookedAt found = MAILLE_TRY(look_at_numbers(numbered));
  const MeshSize mesh = {description().cells, description().points};
  if (!is_better(found, look_at_pieces(), mesh, options_.order == Order::keep)) return {};
  by_number_ = numbered;
  return divide(cuts_.ends.size());
}

/// Positions are not needed where cells go by their numbers.
Result<> SourcePieces::divide(size_t pieces) {
  sizes_.assign(pieces, {});
  cells_ = MAILLE_TRY(ScratchLists::create(space_.folder, pieces, working_memory(space_) / 2));
  if (!by_number_) points_.emplace(mesh_, working_memory(space_) / 4, false);
  MAILLE_CHECK(distribute());
  points_.reset();
  return list_points();
}

// The sizes are known, as the pieces are there.
LookedAt SourcePieces::look_at_pieces() const {
  LookedAt all;
  for (const uint32_t piece : pieces_looked_at(sizes_.size())) all.add(sizes_[piece]);
  return all;
}

/// Reads the cells of some pieces only.
Result<LookedAt> SourcePieces::look_at_numbers(const NumberCut& cut) {
  LookedAt all;
  CellPiece some;
  for (const uint32_t piece : pieces_looked_at(cut.pieces)) {
    RecentPoints points;
    uint64_t flat = 0;
    for (uint64_t at = cut.begin(piece), end = cut.begin(piece + 1); at < end; at += some.size()) {
      MAILLE_CHECK(mesh_.read_cells(at, std::min(cells_at_once, end - at), some));
      for (const uint64_t node : some.connectivity) points.add(static_cast<uint32_t>(node));
      for (const uint8_t type : some.types) flat += dimension_of(static_cast<CellType>(type)) != 3;
    }
    all.add({cut.begin(piece + 1) - cut.begin(piece), points.sorted().size(), flat});
  }
  return all;
}

Result<> SourcePieces::share(const PointSharing::PlaceOf& place_of) {
  sharing_ = MAILLE_TRY(PointSharing::find(*point_lists_, description().points, space_, place_of));
  // A piece of points without cells is decoded whole, so it must not have a billion of them: 2^20 each.
  // One piece, as in memory, unless that would be large.
  constexpr uint64_t most_unused = uint64_t{1} << 20;
  unused_pieces_ = static_cast<size_t>((sharing_->unused() + most_unused - 1) / most_unused);
  unused_in_piece_ = most_unused;
  points_.emplace(mesh_, working_memory(space_) / 4, true);
  return {};
}

/// Points are read in rising order, page after page of the source.
Result<SourcePieces::Raw> SourcePieces::read(size_t piece) {
  Raw raw;
  if (has_cells(piece)) {
    raw.cells = MAILLE_TRY(cells_->read(piece));
    raw.points = MAILLE_TRY(read_rising(*point_lists_, piece));
    raw.shared = MAILLE_TRY(sharing_->shared_of(piece, raw.points));
  } else {
    raw.points = MAILLE_TRY(sharing_->next_unused(unused_in_piece_));
  }
  size_t size = 3 * size_of(description().point_type);
  for (const Array& array : description().arrays)
    size += array.domain == Domain::point ? array.tuple_size() : 0;
  raw.tuples.resize(raw.points.size() * size);
  std::byte* out = raw.tuples.data();
  for (const uint32_t point : raw.points) {
    MAILLE_CHECK(points_->read(point, out));
    out += size;
  }
  return raw;
}

/// Cells stand in the order of their numbers, so that blocks come one after the other.
Result<SourcePieces::Loaded> SourcePieces::load(Raw raw) const {
  Loaded loaded;
  Mesh& mesh = loaded.sub.mesh;
  const RankTable ranks(raw.points);
  std::vector<std::byte> values;
  ByteReader in(raw.cells);
  CellUnpacker unpacker;
  while (in.remaining() > 0) {
    const PackedCell& cell = unpacker.unpack(in);
    if (loaded.sub.block_numbers.empty() || loaded.sub.block_numbers.back() != cell.block) {
      loaded.sub.block_numbers.push_back(cell.block);
      CellBlock& block = mesh.blocks.emplace_back();
      block.name = description().blocks[cell.block].name;
      block.type = block_types_[cell.block];
    }
    append_cell(cell, ranks, mesh.blocks.back());
    loaded.cells.push_back(static_cast<uint32_t>(cell.number));
    const Bytes of_cell = in.get_bytes(values_size_);
    values.insert(values.end(), of_cell.begin(), of_cell.end());
  }
  mesh.points = make_array("position", Domain::point, description().point_type, 3);
  for (const Array& array : description().arrays) mesh.arrays.push_back(empty_like(array));
  std::vector<Array*> of_points = {&mesh.points}, of_cells;
  for (Array& array : mesh.arrays) (array.domain == Domain::point ? of_points : of_cells).push_back(&array);
  split_tuples(raw.tuples, of_points);
  split_tuples(values, of_cells);
  loaded.sub.points = std::move(raw.points);
  loaded.shared = std::move(raw.shared);
  // What a source gave is as hostile as any file.
  MAILLE_CHECK(validate(mesh));
  return loaded;
}

}  // namespace maille
