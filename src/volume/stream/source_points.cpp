#include "volume/stream/source_points.h"

#include <algorithm>
#include <bit>

#include "base/result.h"

namespace maille {
namespace {

constexpr size_t positions = ~size_t{0};
/// About a page of the system: what reading one number costs in any case.
constexpr size_t page_bytes = 4096;

}  // namespace

SourcePoints::SourcePoints(MeshSource& mesh, uint64_t memory, bool arrays) : mesh_(mesh) {
  const MeshDescription& description = mesh.description();
  columns_.push_back({positions, 3 * size_of(description.point_type)});
  for (size_t i = 0; arrays && i < description.arrays.size(); ++i) {
    const Array& array = description.arrays[i];
    if (array.domain == Domain::point) columns_.push_back({i, array.tuple_size()});
  }
  size_t widest = 1;
  for (const Column& column : columns_) {
    stride_ += column.size;
    widest = std::max(widest, column.size);
  }
  // A power of two: divisions would take as long as all else.
  points_per_page_ = std::bit_floor(std::max<uint64_t>(page_bytes / widest, 1));
  page_shift_ = static_cast<unsigned>(std::countr_zero(points_per_page_));
  const uint64_t all = description.points / points_per_page_ + 1;
  const uint64_t fit = memory / (points_per_page_ * stride_ + sizeof(Page));
  // Sixteen sets at least, however little memory there is: 64 pages, or 256 KiB for an array.
  sets_ = std::max<uint64_t>(std::min(all, fit) / ways + 1, 16);
  pages_.resize(sets_ * ways);
}

/// Reads a page, each array's part of it at once. The last page of a mesh is shorter. A page whose reading
/// failed stays empty.
Result<> SourcePoints::load(Page& page, uint64_t number) {
  const uint64_t first = number * points_per_page_;
  const uint64_t count = std::min(points_per_page_, mesh_.description().points - first);
  page.number = none;
  page.bytes.resize(points_per_page_ * stride_);
  std::byte* out = page.bytes.data();
  for (const Column& column : columns_) {
    const std::span<std::byte> part(out, count * column.size);
    MAILLE_CHECK(column.array == positions ? mesh_.read_points(first, count, part)
                                           : mesh_.read_array(column.array, first, count, part));
    out += points_per_page_ * column.size;
  }
  page.number = number;
  return {};
}

/// The page of the last point is mostly that of the next one.
Result<const SourcePoints::Page*> SourcePoints::find(uint64_t number) {
  if (last_ != nullptr && last_->number == number) return last_;
  Page* const set = pages_.data() + number % sets_ * ways;
  Page* page = std::find_if(set, set + ways, [&](const Page& each) { return each.number == number; });
  if (page == set + ways) {
    page = std::min_element(set, set + ways, [](const Page& a, const Page& b) { return a.used < b.used; });
    MAILLE_CHECK(load(*page, number));
  }
  page->used = ++time_;
  last_ = page;
  return last_;
}

/// Copies the values of a point, positions first, to `out`. Error: malformed_input; those of the source.
Result<> SourcePoints::read(uint64_t number, std::byte* out) {
  if (number >= mesh_.description().points) {
    return failure(ErrorCode::malformed_input, "point " + std::to_string(number) + " is not there");
  }
  const Page* const page = MAILLE_TRY(find(number >> page_shift_));
  const uint64_t place = number & (points_per_page_ - 1);
  const std::byte* from = page->bytes.data();
  for (const Column& column : columns_) {
    out = std::copy_n(from + place * column.size, column.size, out);
    from += points_per_page_ * column.size;
  }
  return {};
}

}  // namespace maille
