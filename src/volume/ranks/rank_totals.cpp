#include "volume/ranks/rank_totals.h"

#include <algorithm>

#include "base/bytes.h"
#include "description/description.h"
#include "surface/arrays/array_report.h"
#include "volume/ranks/collective.h"
#include "volume/values/value_range.h"

namespace maille {
namespace {

/// Ranges of least and largest numbers can be joined in any order, so that no rank counts more than another;
/// points are counted by who looks after them, once each.
void put_range(ByteWriter& out, const ValueRange& range) {
  out.put_count(range.components.size());
  for (const ValueRange::Component& component : range.components) {
    out.put(static_cast<uint8_t>(component.any));
    out.put(component.low);
    out.put(component.high);
  }
  out.put(range.nans);
}

// A rank without the array has no components, or none with a number.
void add_range(ByteReader& in, ValueRange& range) {
  const uint64_t components = in.get_count();
  if (range.components.size() < components) range.components.resize(components);
  for (uint64_t c = 0; c < components; ++c) {
    ValueRange::Component found;
    found.any = in.get<uint8_t>() != 0;
    found.low = in.get<double>();
    found.high = in.get<double>();
    ValueRange::Component& all = range.components[c];
    if (found.any && (!all.any || found.low < all.low)) all.low = found.low;
    if (found.any && (!all.any || found.high > all.high)) all.high = found.high;
    all.any = all.any || found.any;
  }
  range.nans += in.get<uint64_t>();
}

/// The ranges of positions and arrays, of the points that this rank looks after and the cells that it has.
ByteWriter ranges_here(const RankPart& part, const PartLayout& layout, const PointDirectory& points) {
  ByteWriter out;
  size_t offset = 0;
  const auto add_points = [&](const Array& array) {
    ValueRange range;
    widen(range, array.type, array.components, {});
    for (size_t i = 0; i < points.directory().count(); ++i)
      widen(range, array.type, array.components, Bytes(points.tuple(i) + offset, array.tuple_size()));
    offset += array.tuple_size();
    put_range(out, range);
  };
  add_points(layout.empty.points);
  size_t next = 0;
  const auto of_cells = [&](size_t number) -> Bytes {
    for (const Array& array : part.mesh->arrays) {
      if (array.domain == Domain::cell && number-- == 0) return array.bytes;
    }
    return {};
  };
  for (const Array& array : layout.empty.arrays) {
    if (array.domain == Domain::point) add_points(array);
    if (array.domain != Domain::cell) continue;
    ValueRange range;
    widen(range, array.type, array.components, of_cells(next++));
    put_range(out, range);
  }
  return out;
}

/// One message for all numbers.
CellTotals sum_cells(const CellTotals& mine, Ranks& ranks) {
  std::vector<uint64_t> numbers(mine.of_type.begin(), mine.of_type.end());
  const MeshDescription::Polyhedra& polyhedra = mine.polyhedra;
  numbers.insert(numbers.end(),
                 {mine.corners, polyhedra.cells, polyhedra.faces, polyhedra.corners, polyhedra.points});
  ranks.add(numbers);
  CellTotals all;
  std::copy_n(numbers.begin(), all.of_type.size(), all.of_type.begin());
  const uint64_t* const rest = &numbers[all.of_type.size()];
  all.corners = rest[0];
  all.polyhedra.cells = rest[1];
  all.polyhedra.faces = rest[2];
  all.polyhedra.corners = rest[3];
  all.polyhedra.points = rest[4];
  return all;
}

// The report that one process would begin with: names and sizes of the whole mesh.
EncodeReport begin_report(const RankPart& part, const PartLayout& layout, const StreamTail& tail,
                          Ranks& ranks) {
  EncodeReport report = report_of(*part.mesh);
  report.points = tail.points;
  report.cells = report.connectivity.elements = tail.cells;
  // Cells are in one rank each, so that their bytes add up; points are counted by the directory instead.
  report.connectivity.raw_bytes = sum_of(ranks, report.connectivity.raw_bytes);
  const auto add = [&](const Array& array) {
    ArrayReport of_array = report_of(array);
    if (array.domain == Domain::mesh) return of_array;
    of_array.elements = array.domain == Domain::point ? tail.points : tail.cells;
    of_array.raw_bytes = of_array.elements * array.tuple_size();
    return of_array;
  };
  report.positions = add(layout.empty.points);
  for (const Array& array : layout.empty.arrays) report.arrays.push_back(add(array));
  return report;
}

}  // namespace

// Blocks are known from the layout, cells by type from a sum, ranges from all to all: the result is the same
// in all ranks without any of them being asked twice.
RankTotals count_among_ranks(const RankPart& part, const PartLayout& layout, const PointDirectory& points,
                             Ranks& ranks) {
  RankTotals totals;
  StreamTail& tail = totals.tail;
  tail.points = points.directory().total();
  for (const PartLayout::Block& block : layout.blocks) {
    tail.blocks.push_back({block.name, block.type, block.cells});
    tail.cells += block.cells;
  }
  set_totals(sum_cells(count_cells(*part.mesh), ranks), tail);
  for (const auto& buffer : to_all(ranks, ranges_here(part, layout, points).bytes())) {
    size_t next = 0;
    for (ByteReader in(buffer); in.remaining() > 0; ++next) {
      if (next == tail.ranges.size()) tail.ranges.emplace_back();
      add_range(in, tail.ranges[next]);
    }
  }
  unsign_zeros(tail);
  totals.report = begin_report(part, layout, tail, ranks);
  return totals;
}

void add_reports_of_ranks(const PieceCoding& coding, Ranks& ranks, EncodeReport& report) {
  std::vector<ArrayReport*> arrays = {&report.positions};
  for (ArrayReport& array : report.arrays) {
    if (array.domain != Domain::mesh) arrays.push_back(&array);
  }
  std::vector<uint64_t> sums = {report.connectivity.coded_bytes, report.order_bytes};
  std::vector<uint64_t> errors;
  for (const ArrayReport* array : arrays) {
    sums.push_back(array->coded_bytes);
    errors.push_back(bits_as<uint64_t>(array->maximum_error));  // bits of what is not negative rise with it
  }
  ranks.add(sums);
  ranks.largest(errors);
  report.connectivity.coded_bytes = sums[0];
  report.order_bytes = sums[1];
  for (size_t i = 0; i < arrays.size(); ++i) {
    ArrayReport& array = *arrays[i];
    array.coded_bytes = sums[i + 2];
    array.maximum_error = bits_as<double>(errors[i]);
    array.bound = coding.maps.bounds[i];
    // Bounds are those of the maps, which all ranks have alike; only errors differ.
    array.lossless = array.bound == 0;
    if (array.lossless) continue;
    const EncodeOptions& options = coding.options;
    array.asked = i == 0 ? options.positions : tolerance_of(options, array.name);
    array.extent = coding.maps.extents[i];
    array.step = coding.maps.maps[i][0].step;
  }
}

}  // namespace maille
