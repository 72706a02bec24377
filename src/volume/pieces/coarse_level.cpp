#include "volume/pieces/coarse_level.h"

#include <maille/with_type.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "base/bytes.h"
#include "volume/pieces/cut_cells.h"

namespace maille {
namespace {

constexpr uint64_t least_group = 4096, most_points = 8192;

/// A number as a byte: so many steps from the least of the piece to the largest, or none. Within 1/508 of the
/// range.
constexpr uint8_t steps = 254, no_number = 255;

uint8_t code_of(double number, float low, float high) {
  if (!std::isfinite(number) || !(low < high)) return std::isfinite(number) ? 0 : no_number;
  const double least = static_cast<double>(low), range = static_cast<double>(high) - least;
  // Means of decoded numbers may leave the range by rounding.
  const double share = std::clamp((number - least) / range, 0.0, 1.0);  // NaN in ranges that are not finite
  return std::isnan(share) ? no_number : static_cast<uint8_t>(share * steps + 0.5);
}

/// Inverse, for a decoder: any byte gives a number within the range or NaN.
float number_of(uint8_t code, float low, float high) {
  if (code > steps || !(low <= high)) return std::numeric_limits<float>::quiet_NaN();
  const double least = static_cast<double>(low), range = static_cast<double>(high) - least;
  return static_cast<float>(least + range * code / steps);
}

/// Sums of finite numbers, and how many there are.
struct Mean {
  double sum = 0;
  uint64_t count = 0;

  void add(double number) {
    const bool finite = std::isfinite(number);
    sum += finite ? number : 0;
    count += finite ? 1 : 0;
  }
  double value() const {
    return count == 0 ? std::numeric_limits<double>::quiet_NaN() : sum / static_cast<double>(count);
  }
};

/// The group of each cell, through all blocks; `count` gets how many there are.
std::vector<uint32_t> groups_of(const Mesh& piece, uint64_t size, size_t& count) {
  const auto groups = group_cells(piece, size);
  std::vector<uint32_t> group_of(piece.cell_count());
  for (uint32_t group = 0; group < groups.size(); ++group) {
    for (const uint32_t cell : groups[group]) group_of[cell] = group;
  }
  count = groups.size();
  return group_of;
}

/// The means over the cells of each group, component by component; numbers of points count for each cell that
/// has them. Sums run in the order of cells, so that the file is the same for any executor.
template <class T>
std::vector<Mean> means_by(const Array& array, const Mesh& piece, std::span<const uint32_t> group_of,
                           size_t groups) {
  const size_t components = array.components;
  std::vector<Mean> means(groups * components);
  const auto add = [&](Mean* to, uint64_t tuple) {
    const std::byte* from = array.bytes.data() + tuple * components * sizeof(T);
    for (size_t k = 0; k < components; ++k) to[k].add(static_cast<double>(load<T>(from + k * sizeof(T))));
  };
  uint64_t cell = 0;
  for (const CellBlock& block : piece.blocks) {
    for (uint64_t i = 0, cells = block.size(); i < cells; ++i, ++cell) {
      Mean* const to = means.data() + group_of[cell] * components;
      if (array.domain == Domain::cell) {
        add(to, cell);
      } else {
        for (const uint32_t point : block.cell(i)) add(to, point);
      }
    }
  }
  return means;
}

std::vector<Mean> means_of(const Array& array, const Mesh& piece, std::span<const uint32_t> group_of,
                           size_t groups) {
  return with_type(array.type,
                   [&](auto zero) { return means_by<decltype(zero)>(array, piece, group_of, groups); });
}

// Labels have no mean; arrays with one range for many components have no range for each.
bool is_coarse(Role role, size_t components, size_t ranges) {
  return role != Role::label && ranges == components;
}

// Bytes of a coarse number are worth a float at most.
Array floats_like(const StreamArray& array, uint64_t count) {
  Array floats = make_array(array.name, array.domain, Scalar::f32, array.components, array.role);
  floats.resize(count);
  return floats;
}

}  // namespace

uint64_t cells_of_coarse_point(uint64_t cells) {
  return std::max(least_group, cells / most_points);
}

// Without a box there is nothing that places could be told in.
void add_coarse_points(const Mesh& piece, uint64_t group, PieceRecord& record) {
  if (piece.cell_count() == 0 || record.low[0] > record.high[0]) return;
  size_t groups = 0;
  const std::vector<uint32_t> group_of = groups_of(piece, group, groups);
  const std::vector<Mean> places = means_of(piece.points, piece, group_of, groups);
  for (size_t i = 0; i < places.size(); ++i)
    record.coarse.push_back(code_of(places[i].value(), record.low[i % 3], record.high[i % 3]));
  for (size_t a = 0; a < record.fields.size(); ++a) {
    const Array& array = piece.arrays[a];
    PieceField& field = record.fields[a];
    if (!is_coarse(array.role, array.components, field.components.size())) continue;
    const std::vector<Mean> means = means_of(array, piece, group_of, groups);
    for (size_t i = 0; i < means.size(); ++i) {
      const PieceField::Component& range = field.components[i % array.components];
      field.coarse.push_back(code_of(means[i].value(), range.low, range.high));
    }
  }
}

/// What coarse_mesh() relies on: a hostile index could have lists of any length.
bool has_coarse_sizes(const PieceRecord& record, const std::vector<StreamArray>& arrays) {
  const uint64_t points = record.coarse.size() / 3;
  if (record.coarse.size() % 3 != 0 || points > record.cells) return false;
  for (size_t i = 0; i < arrays.size(); ++i) {
    const PieceField& field = record.fields[i];
    const bool is = is_coarse(arrays[i].role, arrays[i].components, field.components.size());
    if (field.coarse.size() != (is ? points * arrays[i].components : 0)) return false;
  }
  return true;
}

/// Records of all pieces have as many fields with coarse values, so that the first one tells which arrays
/// there are.
Mesh coarse_mesh(const std::vector<PieceRecord>& records, const std::vector<StreamArray>& arrays) {
  uint64_t count = 0;
  for (const PieceRecord& record : records) count += record.coarse.size() / 3;
  Mesh mesh;
  mesh.points.resize(count);
  std::span<float> places = mesh.points.values<float>();
  for (const PieceRecord& record : records) {
    for (size_t i = 0; i < record.coarse.size(); ++i)
      places[i] = number_of(record.coarse[i], record.low[i % 3], record.high[i % 3]);
    places = places.subspan(record.coarse.size());
  }
  for (size_t a = 0; a < arrays.size() && !records.empty(); ++a) {
    if (!is_coarse(arrays[a].role, arrays[a].components, records.front().fields[a].components.size()))
      continue;
    Array& array = mesh.arrays.emplace_back(floats_like(arrays[a], count));
    std::span<float> values = array.values<float>();
    for (const PieceRecord& record : records) {
      const PieceField& field = record.fields[a];
      for (size_t i = 0; i < field.coarse.size(); ++i) {
        const PieceField::Component& range = field.components[i % array.components];
        values[i] = number_of(field.coarse[i], range.low, range.high);
      }
      values = values.subspan(field.coarse.size());
    }
  }
  CellBlock& vertices = mesh.blocks.emplace_back();
  vertices.type = CellType::vertex;
  for (uint32_t i = 0; i < count; ++i) vertices.connectivity.push_back(i);
  return mesh;
}

}  // namespace maille
