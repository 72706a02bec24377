// Cells in an order that streams well, out of core: a distribution sort by the place of each cell on a curve
// that fills space. A sample of places tells where to cut the curve, so that the cells of each part fit into
// memory wherever the mesh is dense; each part then is read, sorted, and ordered as the front would meet it.
// A shuffled mesh of a million hexahedra is coded within 34 MB so.
// Everything is read twice (looked through, then distributed) and written twice (records, then columns).
#include <maille/out_of_core.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/pace.h"
#include "base/result.h"
#include "base/scratch_file.h"
#include "base/sort_unique.h"
#include "mesh/space_curve.h"
#include "volume/cells/cell_coder.h"
#include "volume/order/cell_order.h"
#include "volume/order/working_memory.h"
#include "volume/stream/source_points.h"
#include "volume/stream/stream_layout.h"

namespace maille {
namespace {

constexpr uint64_t cells_at_once = 4096;
/// Bytes of a part that are written at once into the file of records, at least: below, a write costs more
/// than what it writes.
constexpr uint64_t least_waiting = 1024;

/// By block of the mesh, then along the curve.
struct CurvePlace {
  uint64_t block = 0;
  uint64_t key = 0;
  bool operator<(const CurvePlace& other) const {
    return block != other.block ? block < other.block : key < other.key;
  }
};

/// The place of a cell on the curve: that of the middle between two of its points. Two are enough for an
/// order, and each point read may cost a page of the source; the first and the last but one are opposite
/// corners of quads and hexahedra.
class CellPlaces {
 public:
  CellPlaces(MeshSource& mesh, uint64_t memory)
      : type_(mesh.description().point_type), points_(mesh, memory, false), mesh_(mesh) {
    for (const MeshDescription::Block& block : mesh.description().blocks)
      ends_.push_back((ends_.empty() ? 0 : ends_.back()) + block.cells);
  }

  /// The box of all points.
  Result<> measure() {
    const uint64_t points = mesh_.description().points;
    const size_t size = 3 * size_of(type_);
    std::vector<std::byte> bytes(cells_at_once * size);
    for (uint64_t first = 0; first < points; first += cells_at_once) {
      const uint64_t count = std::min(cells_at_once, points - first);
      MAILLE_CHECK(mesh_.read_points(first, count, std::span(bytes).first(count * size)));
      for (uint64_t i = 0; i < count; ++i) add(position(bytes.data() + i * size));
    }
    double widest = 0;
    for (unsigned c = 0; c < 3; ++c) widest = std::max(widest, high_[c] - low_[c]);
    // 2^20 - 1 steps along the longest side: 60 bits for three of them. Boxes too wide for that, and those of
    // a single point, have one place for all.
    scale_ = widest > 0 && widest < 1e300 ? 1048575.0 / widest : 0;
    return {};
  }

  Result<CurvePlace> of(uint64_t cell, std::span<const uint64_t> nodes) {
    CurvePlace place;
    place.block = static_cast<uint64_t>(std::upper_bound(ends_.begin(), ends_.end(), cell) - ends_.begin());
    if (nodes.empty()) return place;
    std::array<std::byte, 24> first{}, second{};
    MAILLE_CHECK(points_.read(nodes.front(), first.data()));
    MAILLE_CHECK(points_.read(nodes[nodes.size() > 2 ? nodes.size() - 2 : nodes.size() - 1], second.data()));
    const std::array<double, 3> a = position(first.data()), b = position(second.data());
    Vector3 middle;
    for (unsigned c = 0; c < 3; ++c) middle[c] = ((a[c] - low_[c]) + (b[c] - low_[c])) / 2 * scale_;
    place.key = place_on_curve(middle);
    return place;
  }

 private:
  // Points whose numbers are not finite are somewhere: at 0.
  std::array<double, 3> position(const std::byte* bytes) const {
    std::array<double, 3> at{};
    for (unsigned c = 0; c < 3; ++c) {
      const double value = number_as_double(type_, bytes + c * size_of(type_));
      at[c] = std::isfinite(value) ? value : 0;
    }
    return at;
  }
  void add(const std::array<double, 3>& at) {
    for (unsigned c = 0; c < 3; ++c) {
      low_[c] = any_ ? std::min(low_[c], at[c]) : at[c];
      high_[c] = any_ ? std::max(high_[c], at[c]) : at[c];
    }
    any_ = true;
  }

  Scalar type_;
  SourcePoints points_;
  MeshSource& mesh_;
  std::vector<uint64_t> ends_;  ///< of blocks, in cells
  std::array<double, 3> low_{}, high_{};
  bool any_ = false;
  double scale_ = 0;
};

/// A cell on its way to its part. In memory and in the file the head is followed by its points, the sizes of
/// its faces if it is a polyhedron, and its values; all in units of eight bytes, so that heads stay aligned.
struct RecordHead {
  uint64_t block, key, cell;
  uint64_t type_and_nodes;  ///< nodes * 256 + type
  uint64_t faces;           ///< of a polyhedron

  uint64_t nodes() const { return type_and_nodes >> 8; }
};

class ReorderedSource final : public MeshSource {
 public:
  ReorderedSource(MeshSource& mesh, const WorkingSpace& space)
      : mesh_(mesh), space_(space), memory_(working_memory(space)) {
    for (size_t i = 0; i < mesh.description().arrays.size(); ++i) {
      const Array& array = mesh.description().arrays[i];
      if (array.domain != Domain::cell) continue;
      columns_.push_back({i, array.tuple_size()});
      values_size_ += array.tuple_size();
    }
  }

  Result<> sort(const Progress& progress);

  const MeshDescription& description() const override { return mesh_.description(); }
  Result<> read_points(uint64_t first, uint64_t count, std::span<std::byte> out) override {
    return mesh_.read_points(first, count, out);
  }
  Result<> read_cells(uint64_t first, uint64_t count, CellPiece& out) override;
  Result<> read_array(size_t array, uint64_t first, uint64_t count, std::span<std::byte> out) override;

 private:
  struct Column {
    size_t array;
    size_t size;
  };
  /// Cells whose places are between two cuts. `pieces`: begin and size in the file of records.
  struct Part {
    std::vector<std::byte> waiting;                     ///< records that are not in the file yet
    std::vector<std::pair<uint64_t, uint64_t>> pieces;  ///< places of those that are
    uint64_t cells = 0;
  };

  template <class Visit>
  Result<> visit_cells(const Progress& progress, const char* stage, uint64_t stride, Visit visit);
  Result<> cut(CellPlaces& places, const Progress& progress);
  Result<> distribute(CellPlaces& places, const Progress& progress);
  Result<> put(Part& part, const RecordHead& head, const CellPiece& piece, uint64_t row);
  Result<> flush(Part& part);
  Result<std::vector<std::byte>> load(Part& part);
  Result<> order_part(Part& part);
  Result<> order_run(std::span<const RecordHead* const> run);
  Result<> append(const RecordHead& head);
  Result<> read_faces(uint64_t first, uint64_t count, CellPiece& out);
  static const uint64_t* nodes_of_record(const RecordHead& head) {
    return reinterpret_cast<const uint64_t*>(&head + 1);
  }
  size_t record_bytes(const RecordHead& head) const {
    return sizeof(RecordHead) + ((head.nodes() + head.faces) * 8 + values_size_ + 7) / 8 * 8;
  }
  /// What a cell takes in bytes while its part is put in order: 270 for a hexahedron, measured.
  uint64_t bytes_per_cell() const {
    return 110 + 22 * (description().corners / std::max<uint64_t>(description().cells, 1)) + values_size_;
  }
  /// Cells of a part. Parts come a quarter larger than planned where the sample is thin.
  uint64_t part_cells() const { return std::max<uint64_t>(memory_ / 5 * 4 / bytes_per_cell(), 64); }
  Result<> check_memory() const;

  MeshSource& mesh_;
  WorkingSpace space_;
  uint64_t memory_;              ///< bytes, about
  std::vector<Column> columns_;  ///< arrays on cells
  size_t values_size_ = 0;
  std::vector<std::vector<std::byte>> block_values_;  ///< of the cells being distributed
  std::vector<CurvePlace> cuts_;                      ///< where each part but the first begins
  std::vector<Part> parts_;
  size_t waiting_bytes_ = 0;  ///< of one part, at most
  std::optional<ScratchFile> records_;
  // What comes out: column by column.
  std::optional<ScratchFile> types_, sizes_, nodes_, face_counts_, face_sizes_;
  std::vector<ScratchFile> values_;
  /// In nodes_ and in face_sizes_, of every cell that is a multiple of cells_at_once.
  std::vector<uint64_t> begins_, face_begins_;
  uint64_t cells_ = 0, corners_ = 0, faces_ = 0;
};

template <class Visit>
Result<> ReorderedSource::visit_cells(const Progress& progress, const char* stage, uint64_t stride,
                                      Visit visit) {
  const uint64_t cells = description().cells;
  CellPiece piece;
  for (uint64_t first = 0; first < cells; first += cells_at_once * stride) {
    if (progress && !progress({stage, static_cast<double>(first) / static_cast<double>(cells)}))
      return cancelled();
    MAILLE_CHECK(mesh_.read_cells(first, std::min(cells_at_once, cells - first), piece));
    MAILLE_CHECK(visit(first, piece));
  }
  return {};
}

/// Finds where parts begin, by a sample of places: quantiles of it.
Result<> ReorderedSource::cut(CellPlaces& places, const Progress& progress) {
  const uint64_t cells = description().cells, parts = cells / part_cells() + 1;
  // Some 2,000 places a part: the share of a part then varies by 2 % (1 / sqrt(2000)).
  // Enough for parts that are a few per cent larger than planned.
  const uint64_t most = std::clamp<uint64_t>(memory_ / 8 / sizeof(CurvePlace), 1 << 14, 1 << 18);
  const uint64_t wanted = std::clamp<uint64_t>(2000 * parts, 1 << 14, most);
  const uint64_t stride = std::max<uint64_t>(cells / wanted, 1);
  std::vector<CurvePlace> sample;
  // One block of cells in eight is read, more densely: reading is what takes time.
  const uint64_t of_blocks = std::min<uint64_t>(stride, 8);
  const uint64_t within = std::max<uint64_t>(stride / of_blocks, 1);
  MAILLE_CHECK(
      visit_cells(progress, "looking", of_blocks, [&](uint64_t first, const CellPiece& piece) -> Result<> {
        for (uint64_t i = 0; i < piece.size(); i += within) {
          const auto nodes = std::span(piece.connectivity)
                                 .subspan(piece.offsets[i], piece.offsets[i + 1] - piece.offsets[i]);
          sample.push_back(MAILLE_TRY(places.of(first + i, nodes)));
        }
        return {};
      }));
  std::sort(sample.begin(), sample.end());
  for (uint64_t i = 1; i < parts; ++i) {
    const CurvePlace& at = sample[static_cast<size_t>(sample.size() * i / parts)];
    if (cuts_.empty() || cuts_.back() < at) cuts_.push_back(at);
  }
  parts_.resize(cuts_.size() + 1);
  waiting_bytes_ = std::clamp<size_t>(memory_ / 4 / parts_.size(), least_waiting, size_t{1} << 20);
  return {};
}

/// Refuses what cannot be done. Records of all parts wait side by side: n cells in parts of m need n / m *
/// least_waiting * 4 bytes for the records and m * bytes_per_cell for a part, which is least where both are
/// equal. A front of cells that fill space is as large as their number to the power of two thirds, at least.
Result<> ReorderedSource::check_memory() const {
  const auto cells = static_cast<double>(description().cells);
  const double parts = std::sqrt(cells * static_cast<double>(bytes_per_cell() * least_waiting * 4) * 5 / 4);
  return check_limit(space_, static_cast<uint64_t>(parts),
                     "putting " + std::to_string(description().cells) + " cells in order");
}

Result<> ReorderedSource::flush(Part& part) {
  part.pieces.emplace_back(records_->size(), part.waiting.size());
  MAILLE_CHECK(records_->append(part.waiting));
  part.waiting.clear();
  return {};
}

/// Packs a cell into its part; what waits is written before it would exceed its share.
Result<> ReorderedSource::put(Part& part, const RecordHead& head, const CellPiece& piece, uint64_t row) {
  const size_t at = part.waiting.size();
  if (part.waiting.capacity() == 0) part.waiting.reserve(waiting_bytes_);
  part.waiting.resize(at + record_bytes(head));
  std::byte* out = part.waiting.data() + at;
  out = std::copy_n(reinterpret_cast<const std::byte*>(&head), sizeof head, out);
  const Bytes nodes = std::as_bytes(std::span(piece.connectivity).subspan(piece.offsets[row], head.nodes()));
  out = std::copy(nodes.begin(), nodes.end(), out);
  for (uint64_t i = 0; i < head.faces; ++i, out += sizeof(uint64_t))
    store(out, uint64_t{piece.face_sizes[piece.cell_faces[row] + i]});
  for (size_t k = 0; k < columns_.size(); ++k)
    out = std::copy_n(block_values_[k].data() + row * columns_[k].size, columns_[k].size, out);
  ++part.cells;
  return part.waiting.size() + record_bytes(head) <= waiting_bytes_ ? Result<>() : flush(part);
}

Result<> ReorderedSource::distribute(CellPlaces& places, const Progress& progress) {
  block_values_.resize(columns_.size());
  return visit_cells(progress, "distributing", 1, [&](uint64_t first, const CellPiece& piece) -> Result<> {
    for (size_t k = 0; k < columns_.size(); ++k) {
      block_values_[k].resize(piece.size() * columns_[k].size);
      MAILLE_CHECK(mesh_.read_array(columns_[k].array, first, piece.size(), block_values_[k]));
    }
    for (uint64_t i = 0; i < piece.size(); ++i) {
      const auto nodes =
          std::span(piece.connectivity).subspan(piece.offsets[i], piece.offsets[i + 1] - piece.offsets[i]);
      const CurvePlace place = MAILLE_TRY(places.of(first + i, nodes));
      const auto part = std::upper_bound(cuts_.begin(), cuts_.end(), place) - cuts_.begin();
      const RecordHead head = {place.block, place.key, first + i, nodes.size() << 8 | piece.types[i],
                               piece.cell_faces.empty() ? 0 : piece.cell_faces[i + 1] - piece.cell_faces[i]};
      MAILLE_CHECK(put(parts_[static_cast<size_t>(part)], head, piece, i));
    }
    return {};
  });
}

/// All records of a part; what it held in memory is let go of.
Result<std::vector<std::byte>> ReorderedSource::load(Part& part) {
  std::vector<std::byte> bytes;
  size_t total = 0;
  for (const auto& [begin, size] : part.pieces) total += size;
  bytes.resize(total);
  size_t at = 0;
  for (const auto& [begin, size] : part.pieces) {
    MAILLE_CHECK(records_->read_at(begin, std::span(bytes).subspan(at, size)));
    at += size;
  }
  part = {};
  return bytes;
}

/// Appends a cell to what comes out. Of every 4,096th cell it is noted where its corners begin, as sizes
/// differ.
Result<> ReorderedSource::append(const RecordHead& head) {
  if (cells_ % cells_at_once == 0) {
    begins_.push_back(corners_);
    face_begins_.push_back(faces_);
  }
  const auto type = static_cast<uint8_t>(head.type_and_nodes & 255);
  const auto size = static_cast<uint32_t>(head.nodes());
  MAILLE_CHECK(types_->append(std::as_bytes(std::span(&type, 1))));
  MAILLE_CHECK(sizes_->append(std::as_bytes(std::span(&size, 1))));
  const uint64_t* const nodes = nodes_of_record(head);
  MAILLE_CHECK(nodes_->append(std::as_bytes(std::span(nodes, head.nodes()))));
  const std::vector<uint32_t> faces(nodes + head.nodes(), nodes + head.nodes() + head.faces);
  const auto count = static_cast<uint32_t>(faces.size());
  MAILLE_CHECK(face_counts_->append(std::as_bytes(std::span(&count, 1))));
  MAILLE_CHECK(face_sizes_->append(std::as_bytes(std::span(faces))));
  const auto* from = reinterpret_cast<const std::byte*>(nodes + head.nodes() + head.faces);
  for (size_t k = 0; k < columns_.size(); ++k) {
    MAILLE_CHECK(values_[k].append({from, columns_[k].size}));
    from += columns_[k].size;
  }
  ++cells_;
  corners_ += head.nodes();
  faces_ += count;
  return {};
}

/// Puts cells of one block and one part into the order of the front. The points are numbered anew for that,
/// as front_order() works on 32 bits.
Result<> ReorderedSource::order_run(std::span<const RecordHead* const> run) {
  std::vector<uint64_t> points;
  for (const RecordHead* head : run)
    points.insert(points.end(), nodes_of_record(*head), nodes_of_record(*head) + head->nodes());
  CellBlock block;
  block.type = CellType::mixed;
  block.connectivity.resize(points.size());
  block.offsets.push_back(0);
  std::vector<uint64_t> sorted = points;
  sort_unique(sorted);
  for (size_t i = 0; i < points.size(); ++i) {
    block.connectivity[i] =
        static_cast<uint32_t>(std::lower_bound(sorted.begin(), sorted.end(), points[i]) - sorted.begin());
  }
  // front_order() takes most of the memory of a part.
  points = {};
  sorted = {};
  for (const RecordHead* head : run) {
    block.offsets.push_back(block.offsets.back() + head->nodes());
    block.types.push_back(static_cast<uint8_t>(head->type_and_nodes & 255));
  }
  for (const uint64_t cell : front_order(block)) MAILLE_CHECK(append(*run[cell]));
  return {};
}

Result<> ReorderedSource::order_part(Part& part) {
  const std::vector<std::byte> bytes = MAILLE_TRY(load(part));
  std::vector<const RecordHead*> heads;
  for (size_t at = 0; at < bytes.size();) {
    const auto* head = reinterpret_cast<const RecordHead*>(bytes.data() + at);
    heads.push_back(head);
    at += record_bytes(*head);
  }
  // By number at last, so that the order is total.
  std::sort(heads.begin(), heads.end(), [](const RecordHead* a, const RecordHead* b) {
    if (a->block != b->block) return a->block < b->block;
    return a->key != b->key ? a->key < b->key : a->cell < b->cell;
  });
  // Where far too many cells have one place, they come in pieces all the same.
  const uint64_t most = 2 * part_cells();
  for (size_t first = 0; first < heads.size();) {
    size_t next = first + 1;
    while (next < heads.size() && next - first < most && heads[next]->block == heads[first]->block) ++next;
    MAILLE_CHECK(order_run(std::span(heads).subspan(first, next - first)));
    first = next;
  }
  return {};
}

Result<> ReorderedSource::sort(const Progress& progress) {
  MAILLE_CHECK(check_memory());
  records_ = MAILLE_TRY(ScratchFile::create(space_.folder));
  {
    CellPlaces places(mesh_, memory_ / 2);
    MAILLE_CHECK(places.measure());
    MAILLE_CHECK(cut(places, progress));
    MAILLE_CHECK(distribute(places, progress));
  }
  for (Part& part : parts_) {
    if (!part.waiting.empty()) MAILLE_CHECK(flush(part));
    std::vector<std::byte>().swap(part.waiting);
  }
  types_ = MAILLE_TRY(ScratchFile::create(space_.folder));
  sizes_ = MAILLE_TRY(ScratchFile::create(space_.folder));
  nodes_ = MAILLE_TRY(ScratchFile::create(space_.folder));
  face_counts_ = MAILLE_TRY(ScratchFile::create(space_.folder));
  face_sizes_ = MAILLE_TRY(ScratchFile::create(space_.folder));
  for (size_t k = 0; k < columns_.size(); ++k)
    values_.push_back(MAILLE_TRY(ScratchFile::create(space_.folder)));
  for (size_t i = 0; i < parts_.size(); ++i) {
    if (progress && !progress({"ordering", static_cast<double>(i) / static_cast<double>(parts_.size())}))
      return cancelled();
    MAILLE_CHECK(order_part(parts_[i]));
  }
  records_.reset();
  return {};
}

/// Cells from the group that `first` is in are counted up to it: at most 4,095 sizes more are read.
Result<> ReorderedSource::read_cells(uint64_t first, uint64_t count, CellPiece& out) {
  out.offsets.assign(1, 0);
  if (count > cells_ || first > cells_ - count)
    return failure(ErrorCode::usage, "more cells were asked for than there are");
  const uint64_t from = first / cells_at_once * cells_at_once;
  std::vector<uint32_t> sizes(first + count - from);
  MAILLE_CHECK(sizes_->read_at(from * 4, std::as_writable_bytes(std::span(sizes))));
  const uint64_t begin =
      (begins_.empty() || count == 0 ? 0 : begins_[from / cells_at_once]) +
      std::accumulate(sizes.begin(), sizes.begin() + static_cast<ptrdiff_t>(first - from), uint64_t{0});
  for (size_t i = first - from; i < sizes.size(); ++i) out.offsets.push_back(out.offsets.back() + sizes[i]);
  out.types.resize(count);
  out.connectivity.resize(out.offsets.back());
  MAILLE_CHECK(types_->read_at(first, std::as_writable_bytes(std::span(out.types))));
  MAILLE_CHECK(nodes_->read_at(begin * 8, std::as_writable_bytes(std::span(out.connectivity))));
  return faces_ == 0 ? Result<>() : read_faces(first, count, out);
}

Result<> ReorderedSource::read_faces(uint64_t first, uint64_t count, CellPiece& out) {
  const uint64_t from = first / cells_at_once * cells_at_once;
  std::vector<uint32_t> counts(first + count - from);
  MAILLE_CHECK(face_counts_->read_at(from * 4, std::as_writable_bytes(std::span(counts))));
  const uint64_t begin =
      (count == 0 ? 0 : face_begins_[from / cells_at_once]) +
      std::accumulate(counts.begin(), counts.begin() + static_cast<ptrdiff_t>(first - from), uint64_t{0});
  out.cell_faces.assign(1, 0);
  for (size_t i = first - from; i < counts.size(); ++i)
    out.cell_faces.push_back(out.cell_faces.back() + counts[i]);
  out.face_sizes.resize(out.cell_faces.back());
  return face_sizes_->read_at(begin * 4, std::as_writable_bytes(std::span(out.face_sizes)));
}

Result<> ReorderedSource::read_array(size_t array, uint64_t first, uint64_t count, std::span<std::byte> out) {
  for (size_t k = 0; k < columns_.size(); ++k) {
    if (columns_[k].array != array) continue;
    if (out.size() != count * columns_[k].size)
      return failure(ErrorCode::usage, "the room for values is of another size");
    return values_[k].read_at(first * columns_[k].size, out);
  }
  return mesh_.read_array(array, first, count, out);
}

}  // namespace

Result<std::unique_ptr<MeshSource>> reordered(MeshSource& mesh, const WorkingSpace& space,
                                              const Progress& progress) {
  auto source = std::make_unique<ReorderedSource>(mesh, space);
  MAILLE_CHECK(source->sort(progress));
  return std::unique_ptr<MeshSource>(std::move(source));
}

/// Bits that connectivity takes a cell in the order of the input, by the first 32,768 cells: what tells
/// whether an order is worth changing.
Result<double> incoherence(MeshSource& mesh) {
  constexpr uint64_t most_cells = 32768;
  // Of cells in no order fewer tell as much, as each takes all its points into memory: no more than 65,536
  // points in use are looked at.
  constexpr uint32_t most_points = 65536;
  const uint64_t cells = std::min(mesh.description().cells, most_cells);
  RangeEncoder topology, numbers;
  CellCoder<RangeEncoder> coder(Mixing::mixed, false);
  CodedCells out;
  StreamedCell cell;
  CellPiece piece;
  uint64_t seen = 0;
  for (; seen < cells && coder.hull().live_points() < most_points; seen += piece.size()) {
    MAILLE_CHECK(mesh.read_cells(seen, std::min(cells_at_once, cells - seen), piece));
    for (uint64_t i = 0; i < piece.size(); ++i) {
      cell.kind = kind_of(static_cast<CellType>(piece.types[i]));
      if (cell.kind >= shape_count) continue;  // given by faces, or as a list of points
      const uint64_t* const nodes = piece.connectivity.data() + piece.offsets[i];
      cell.final = 0;
      for (size_t k = 0; k < piece.offsets[i + 1] - piece.offsets[i]; ++k)
        cell.number[k] = nodes[cell_shapes[cell.kind].place[k]];
      coder.code(topology, numbers, cell, out);
    }
    out.clear();
    coder.end_block();
  }
  return seen == 0 ? 0.0 : 8.0 * static_cast<double>(topology.finish().size()) / static_cast<double>(seen);
}

}  // namespace maille
