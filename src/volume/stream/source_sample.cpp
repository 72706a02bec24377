#include "volume/stream/source_sample.h"

#include <algorithm>
#include <cmath>

#include "base/result.h"
#include "volume/stream/table_maps.h"

namespace maille {
namespace {

// 65,536: arrays up to that size are looked at whole. Stretches of 1,024, as neighbouring tuples are read
// together.
constexpr uint64_t tuples_in_all = TableSearch::most_tuples;
constexpr uint64_t tuples_at_once = 1 << 10;
constexpr size_t positions = ~size_t{0};

// Positions are read by a call of their own.
Result<> read_tuples(MeshSource& mesh, size_t array, uint64_t first, uint64_t count,
                     std::span<std::byte> out) {
  return array == positions ? mesh.read_points(first, count, out) : mesh.read_array(array, first, count, out);
}

/// Takes stretches of the array, evenly over all of it: 64 of them, from its first tuple to its last. Nothing
/// is drawn at random, so that the same mesh gives the same file.
Result<> take_sample(MeshSource& mesh, size_t array, uint64_t count, Array& sample) {
  const size_t size = sample.tuple_size();
  sample.resize(std::min(count, tuples_in_all));
  if (count <= tuples_in_all) return read_tuples(mesh, array, 0, count, sample.bytes);
  const uint64_t stretches = tuples_in_all / tuples_at_once;
  for (uint64_t i = 0; i < stretches; ++i) {
    const uint64_t first = (count - tuples_at_once) / (stretches - 1) * i;
    const auto room = std::span(sample.bytes).subspan(i * tuples_at_once * size, tuples_at_once * size);
    MAILLE_CHECK(read_tuples(mesh, array, first, tuples_at_once, room));
  }
  return {};
}

/// Adds the least and the largest finite number of each component, and the one nearest to 0, from which
/// logarithms count, as three tuples more: a lattice must reach them, and the sample may have missed them.
Result<> add_extremes(MeshSource& mesh, size_t array, uint64_t count, Array& sample) {
  const size_t number = size_of(sample.type), size = sample.tuple_size();
  std::vector<std::byte> part(tuples_at_once * size), low(size), high(size), near(size);
  std::vector<bool> any(sample.components);
  for (uint64_t first = 0; first < count; first += tuples_at_once) {
    const uint64_t here = std::min(tuples_at_once, count - first);
    MAILLE_CHECK(read_tuples(mesh, array, first, here, std::span(part).first(here * size)));
    for (uint64_t i = 0; i < here * sample.components; ++i) {
      const size_t c = i % sample.components;
      const std::byte* const from = part.data() + i * number;
      const double value = number_as_double(sample.type, from);
      if (!std::isfinite(value)) continue;
      const double nearest = number_as_double(sample.type, &near[c * number]);
      if (value != 0 && (nearest == 0 || std::fabs(value) < std::fabs(nearest)))
        std::copy_n(from, number, &near[c * number]);
      if (!any[c] || value < number_as_double(sample.type, &low[c * number]))
        std::copy_n(from, number, &low[c * number]);
      if (!any[c] || value > number_as_double(sample.type, &high[c * number]))
        std::copy_n(from, number, &high[c * number]);
      any[c] = true;
    }
  }
  for (const auto* tuple : {&low, &high, &near})
    sample.bytes.insert(sample.bytes.end(), tuple->begin(), tuple->end());
  return {};
}

// A sample with a bound must have the extremes, which takes all numbers; one without loss needs not.
Result<Array> sample_of(MeshSource& mesh, size_t array, Array sample, const Tolerance& tolerance) {
  const uint64_t count = array == positions ? mesh.description().points : mesh.description().count_of(sample);
  MAILLE_CHECK(take_sample(mesh, array, count, sample));
  const bool whole = count <= tuples_in_all;
  if (!whole && tolerance.kind != Tolerance::Kind::lossless)
    MAILLE_CHECK(add_extremes(mesh, array, count, sample));
  return sample;
}

/// Cells for trials of tables, from the front of the mesh.
Result<FirstCells> first_cells_of(MeshSource& mesh) {
  FirstCells first;
  CellPiece cells;
  MAILLE_CHECK(mesh.read_cells(0, std::min(FirstCells::most, mesh.description().cells), cells));
  for (uint64_t i = 0; i < cells.size(); ++i) {
    const auto points = std::span(std::as_const(cells.connectivity))
                            .subspan(cells.offsets[i], cells.offsets[i + 1] - cells.offsets[i]);
    first.add(static_cast<CellType>(cells.types[i]), points, i);
  }
  return first;
}

}  // namespace

// The sample of an array goes through choose_stream_maps() as a mesh of that array alone, so that both kinds
// of meshes choose by the same code.
Result<ArrayMapsList> choose_source_maps(MeshSource& mesh, const StreamOptions& options,
                                         std::optional<bool> mixes_values) {
  const MeshDescription& description = mesh.description();
  TableSearch tables(mixes_values.value_or(false), [&] { return first_cells_of(mesh); });
  StreamOptions one;
  one.positions = options.positions;
  Mesh sample;
  sample.points = make_array("position", Domain::point, description.point_type, 3);
  sample.points = MAILLE_TRY(sample_of(mesh, positions, sample.points, one.positions.tolerance));
  ArrayMapsList list = MAILLE_TRY(choose_stream_maps(sample, one));
  // A sample cannot tell whether numbers come again over the whole array.
  if (mixes_values && list.bounds[0] == 0 && description.points <= tuples_in_all)
    MAILLE_CHECK(tables.add_tables(sample.points, list.maps[0]));
  one.positions.tolerance = {};
  // One after the other: all samples together could be large.
  for (size_t i = 0; i < description.arrays.size(); ++i) {
    one.arrays.assign(1, options.arrays[i]);
    sample.points.bytes.clear();
    sample.arrays.clear();
    sample.arrays.push_back(
        MAILLE_TRY(sample_of(mesh, i, description.arrays[i], options.arrays[i].tolerance)));
    ArrayMapsList maps = MAILLE_TRY(choose_stream_maps(sample, one));
    list.maps.push_back(std::move(maps.maps[1]));
    list.bounds.push_back(maps.bounds[1]);
    if (mixes_values && list.bounds.back() == 0 &&
        description.count_of(description.arrays[i]) <= tuples_in_all)
      MAILLE_CHECK(tables.add_tables(sample.arrays[0], list.maps.back()));
    list.extents.push_back(maps.extents[1]);
  }
  return list;
}

}  // namespace maille
