#include "volume/pieces/coarse_level.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "numbers/number_map.h"
#include "volume/pieces/cut_cells.h"

namespace maille {
namespace {

constexpr uint64_t least_group = 4096, most_points = 8192;

/// A number as a byte: so many steps from the least of the piece to the largest, or none.
constexpr uint8_t steps = 254, no_number = 255;

uint8_t code_of(double number, float low, float high) {
  if (!std::isfinite(number) || !(low < high)) return std::isfinite(number) ? 0 : no_number;
  const double least = static_cast<double>(low), range = static_cast<double>(high) - least;
  const double share = std::clamp((number - least) / range, 0.0, 1.0);  // NaN in ranges that are not finite
  return std::isnan(share) ? no_number : static_cast<uint8_t>(share * steps + 0.5);
}

float number_of(uint8_t code, float low, float high) {
  if (code > steps || !(low <= high)) return std::numeric_limits<float>::quiet_NaN();
  const double least = static_cast<double>(low), range = static_cast<double>(high) - least;
  return static_cast<float>(least + range * code / steps);
}

/// The mean of a component over some tuples, those left out that are not finite; NaN where none is left.
class Mean {
 public:
  Mean(const Array& array, uint32_t component)
      : array_(array), first_(array.bytes.data() + component * size_of(array.type)) {}

  void add(uint64_t tuple) {
    const double number = number_as_double(array_.type, first_ + tuple * array_.tuple_size());
    if (!std::isfinite(number)) return;
    sum_ += number;
    ++count_;
  }
  double value() const {
    return count_ == 0 ? std::numeric_limits<double>::quiet_NaN() : sum_ / static_cast<double>(count_);
  }

 private:
  const Array& array_;
  const std::byte* first_;
  double sum_ = 0;
  uint64_t count_ = 0;
};

/// The points of cells by their number through all blocks.
class Cells {
 public:
  explicit Cells(const Mesh& mesh) : mesh_(mesh) {
    uint64_t first = 0;
    for (const CellBlock& block : mesh.blocks) {
      firsts_.push_back(first);
      first += block.size();
    }
  }
  std::span<const uint32_t> operator[](uint64_t cell) const {
    const auto after = std::upper_bound(firsts_.begin(), firsts_.end(), cell);
    const auto block = static_cast<size_t>(after - firsts_.begin()) - 1;
    return mesh_.blocks[block].cell(cell - firsts_[block]);
  }

 private:
  const Mesh& mesh_;
  std::vector<uint64_t> firsts_;
};

double mean_of(const Array& array, uint32_t component, const Cells& cells,
               const std::vector<uint32_t>& group) {
  Mean mean(array, component);
  for (const uint32_t cell : group) {
    if (array.domain == Domain::cell) {
      mean.add(cell);
    } else {
      for (const uint32_t point : cells[cell]) mean.add(point);
    }
  }
  return mean.value();
}

bool is_coarse(Role role, size_t components, size_t ranges) {
  return role != Role::label && ranges == components;
}

Array floats_like(const StreamArray& array, uint64_t count) {
  Array floats = make_array(array.name, array.domain, Scalar::f32, array.components, array.role);
  floats.resize(count);
  return floats;
}

}  // namespace

uint64_t cells_of_coarse_point(uint64_t cells) {
  return std::max(least_group, cells / most_points);
}

void add_coarse_points(const Mesh& piece, uint64_t group, PieceRecord& record) {
  if (piece.cell_count() == 0 || record.low[0] > record.high[0]) return;
  const auto groups = cut_cells(piece, group, serial_executor());
  const Cells cells(piece);
  for (const auto& each : groups) {
    for (uint32_t k = 0; k < 3; ++k)
      record.coarse.push_back(code_of(mean_of(piece.points, k, cells, each), record.low[k], record.high[k]));
  }
  for (size_t i = 0; i < record.fields.size(); ++i) {
    const Array& array = piece.arrays[i];
    PieceField& field = record.fields[i];
    if (!is_coarse(array.role, array.components, field.components.size())) continue;
    for (const auto& each : groups) {
      for (uint32_t k = 0; k < array.components; ++k) {
        const auto& [low, high, mean] = field.components[k];
        field.coarse.push_back(code_of(mean_of(array, k, cells, each), low, high));
      }
    }
  }
}

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
