#include "io/vtk/part_cells.h"

#include <algorithm>

#include "base/bytes.h"
#include "io/buffered_writer.h"
#include "io/vtk/vtk_field_data.h"

namespace maille {

PartFaces PartFaces::stream(Array faces, Array ends) {
  PartFaces result;
  result.points_ = std::move(faces);
  result.cell_ends_ = std::move(ends);
  result.is_stream_ = true;
  return result;
}

PartFaces PartFaces::lists(Array points, Array face_ends, Array faces, Array cell_ends) {
  PartFaces result;
  result.points_ = std::move(points);
  result.face_ends_ = std::move(face_ends);
  result.faces_ = std::move(faces);
  result.cell_ends_ = std::move(cell_ends);
  return result;
}

bool PartFaces::append(uint64_t cell, Budget& budget, std::vector<uint64_t>& corners,
                       std::vector<uint32_t>& sizes) {
  return is_stream_ ? append_stream(cell, corners, sizes) : append_lists(cell, budget, corners, sizes);
}

// In lists, a cell that is no polyhedron may still have a range of faces, which is passed over.
void PartFaces::skip(uint64_t cell) {
  if (!is_stream_) at_ = std::max(at_, integer_at(cell_ends_, cell));
}

// Every count is compared with what is left of the cell's range, which is inside the array, so hostile counts
// end here.
bool PartFaces::append_stream(uint64_t cell, std::vector<uint64_t>& corners, std::vector<uint32_t>& sizes) {
  const uint64_t end = integer_at(cell_ends_, cell);
  if (end > points_.count() || at_ >= end) return false;
  const uint64_t faces = integer_at(points_, at_++);
  if (faces > end - at_) return false;
  for (uint64_t face = 0; face < faces; ++face) {
    if (at_ >= end) return false;
    const uint64_t size = integer_at(points_, at_++);
    if (size > end - at_) return false;
    for (uint64_t i = 0; i < size; ++i) corners.push_back(integer_at(points_, at_++));
    sizes.push_back(static_cast<uint32_t>(size));
  }
  return at_ == end;
}

bool PartFaces::append_lists(uint64_t cell, Budget& budget, std::vector<uint64_t>& corners,
                             std::vector<uint32_t>& sizes) {
  const uint64_t end = integer_at(cell_ends_, cell);
  if (end > faces_.count() || at_ > end) return false;
  for (; at_ < end; ++at_) {
    const uint64_t face = integer_at(faces_, at_);
    if (face >= face_ends_.count()) return false;
    const uint64_t first = face == 0 ? 0 : integer_at(face_ends_, face - 1);
    const uint64_t last = integer_at(face_ends_, face);
    if (first > last || last > points_.count() || last - first > UINT32_MAX) return false;
    // A list of faces may name a large face many times.
    if (!budget.take(last - first, sizeof(uint32_t))) return false;
    for (uint64_t i = first; i < last; ++i) corners.push_back(integer_at(points_, i));
    sizes.push_back(static_cast<uint32_t>(last - first));
  }
  return true;
}

namespace {

/// Appends numbers of points, raised by `base`. Gives the place of the first number that is none of `points`,
/// or `last`. Negative numbers become huge ones and are found by the same comparison.
uint64_t append_points(const Array& numbers, uint64_t first, uint64_t last, uint64_t base, uint64_t points,
                       std::vector<uint32_t>& out) {
  return with_type(numbers.type, [&](auto zero) {
    using T = decltype(zero);
    const std::byte* at = numbers.bytes.data() + first * sizeof(T);
    for (uint64_t i = first; i < last; ++i, at += sizeof(T)) {
      const auto point = static_cast<uint64_t>(load<T>(at));
      if (point >= points) return i;
      out.push_back(static_cast<uint32_t>(base + point));
    }
    return last;
  });
}

}  // namespace

Result<> append_part_cells(PartCells part, uint64_t base, uint64_t points, const std::string& where,
                           Budget& budget, CellStore& cells) {
  const uint64_t count = part.types.count(), corner_count = part.connectivity.count();
  const auto malformed = [&](const std::string& what) {
    return failure(ErrorCode::malformed_input, where + ": " + what);
  };
  MAILLE_CHECK(budget.take(corner_count, sizeof(uint32_t)));
  MAILLE_CHECK(budget.take(count, sizeof(uint64_t)));
  cells.nodes.reserve(cells.nodes.size() + corner_count);
  uint64_t begin = 0;
  std::vector<uint64_t> corners;
  for (uint64_t c = 0; c < count; ++c) {
    const uint64_t end = integer_at(part.ends, c);
    // Ends must not fall and not pass the connectivity, so each cell has its own piece of it.
    if (end < begin || end > corner_count) {
      return malformed("the end of cell " + std::to_string(c) + " is offset " + std::to_string(end) +
                       ", outside of " + std::to_string(begin) + " to " + std::to_string(corner_count));
    }
    const auto no_point = [&](uint64_t point) {
      return malformed("cell " + std::to_string(c) + " uses point " +
                       std::to_string(static_cast<int64_t>(point)) + ", but the piece has " +
                       std::to_string(points) + " points");
    };
    // Whether a type exists and has so many nodes is validate()'s question.
    const auto type = static_cast<CellType>(std::min<uint64_t>(integer_at(part.types, c), 255));
    if (type == CellType::polyhedron) {
      corners.clear();
      if (!part.faces || !part.faces->append(c, budget, corners, cells.face_sizes)) {
        return malformed("the faces of cell " + std::to_string(c) +
                         ", a polyhedron, are missing or end outside of their array");
      }
      for (const uint64_t point : corners) {
        if (point >= points) return no_point(point);
        cells.nodes.push_back(static_cast<uint32_t>(base + point));
      }
    } else {
      if (part.faces) part.faces->skip(c);
      const uint64_t bad = append_points(part.connectivity, begin, end, base, points, cells.nodes);
      if (bad != end) return no_point(integer_at(part.connectivity, bad));
    }
    cells.end_cell(type);
    begin = end;
  }
  return {};
}

}  // namespace maille
