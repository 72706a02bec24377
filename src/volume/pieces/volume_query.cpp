#include "volume/pieces/volume_query.h"

#include <algorithm>
#include <cmath>

#include "base/result.h"
#include "numbers/number_map.h"
#include "numbers/point_position.h"

namespace maille {
namespace {

// Closed on both sides, as conditions are.
bool overlap(const ValueCondition& wanted, double low, double high) {
  return low <= wanted.high && high >= wanted.low;
}

/// Whether values that a field may have in a piece are wanted: those of a component, or of the length of its
/// tuples. Of a length the bounds follow from those of the components: the nearest and the farthest point of
/// their box. Many components share one range.
bool may_have(const PieceField& field, uint32_t components, const ValueCondition& wanted) {
  const bool shared = field.components.size() == 1;
  if (wanted.component || components == 1) {
    const PieceField::Component& range = field.components[shared ? 0 : *wanted.component];
    return range.low <= range.high &&
           overlap(wanted, static_cast<double>(range.low), static_cast<double>(range.high));
  }
  double least = 0, most = 0;
  for (uint32_t k = 0; k < components; ++k) {
    const PieceField::Component& range = field.components[shared ? 0 : k];
    const auto low = static_cast<double>(range.low), high = static_cast<double>(range.high);
    if (low > high) return false;
    const double near = low > 0 ? low : high < 0 ? -high : 0, far = std::max(std::abs(low), std::abs(high));
    least += near * near;
    most += far * far;
  }
  // Squares, sums and roots are rounded, but rounding is monotone: has_value() computes lengths by the same
  // steps in the same order, so no length in the piece is below `least` or above `most` as computed here. The
  // slack of 1e-12 is therefore not needed; it only loads a piece more where a wanted bound is that close.
  return overlap(wanted, std::sqrt(least) * (1 - 1e-12), std::sqrt(most) * (1 + 1e-12));
}

// Comparisons with NaN are false: what is no number has no wanted value.
bool has_value(const Array& array, uint64_t tuple, const ValueCondition& wanted) {
  const size_t size = size_of(array.type);
  const std::byte* numbers = array.bytes.data() + tuple * array.tuple_size();
  const auto component = [&](uint32_t k) { return number_as_double(array.type, numbers + k * size); };
  if (wanted.component || array.components == 1) {
    const double value = component(wanted.component.value_or(0));
    return value >= wanted.low && value <= wanted.high;
  }
  double square = 0;
  for (uint32_t k = 0; k < array.components; ++k) square += component(k) * component(k);
  const double length = std::sqrt(square);
  return length >= wanted.low && length <= wanted.high;
}

/// The box around some points. Points whose numbers are not finite are nowhere.
std::optional<Box> box_of(const Array& positions, std::span<const uint32_t> points) {
  std::optional<Box> box;
  for (const uint32_t point : points) {
    const Vector3 at = point_position(positions, point);
    if (!std::isfinite(at[0]) || !std::isfinite(at[1]) || !std::isfinite(at[2])) continue;
    if (!box) box = Box{at, at};
    for (unsigned k = 0; k < 3; ++k) {
      box->low[k] = std::min(box->low[k], at[k]);
      box->high[k] = std::max(box->high[k], at[k]);
    }
  }
  return box;
}

// Such a region need not be asked about each cell; it also takes cells that are nowhere.
bool is_everywhere(const Region& region) {
  return !region.box && !region.sphere && region.planes.empty();
}

/// A point on the plane is on both sides.
bool crosses(const Region::Plane& plane, const Array& positions, std::span<const uint32_t> points) {
  bool below = false, above = false;
  for (const uint32_t point : points) {
    const double side = dot(plane.normal, point_position(positions, point)) + plane.offset;
    below = below || side <= 0;
    above = above || side >= 0;
  }
  return below && above;
}

Box box_of(const PieceRecord& piece) {
  Box box;
  for (unsigned k = 0; k < 3; ++k) {
    box.low[k] = static_cast<double>(piece.low[k]);
    box.high[k] = static_cast<double>(piece.high[k]);
  }
  return box;
}

tl::unexpected<Error> no_array(const std::string& file, const std::string& name,
                               const std::vector<StreamArray>& arrays) {
  std::string known;
  for (const StreamArray& array : arrays) known += (known.empty() ? "" : ", ") + array.name;
  return failure(ErrorCode::usage,
                 file + ": has no array named \"" + name + "\"; it has " + (known.empty() ? "none" : known));
}

}  // namespace

// Names and components are checked once, so that the tests of pieces and cells can index by number.
Result<CheckedQuery> CheckedQuery::check(const VolumeQuery& query, const PieceReader& file) {
  CheckedQuery checked;
  checked.query_ = &query;
  if (query.cells && !file.kept()) {
    return failure(ErrorCode::usage,
                   file.name() + ": has its cells in another order than the input, so none has a number");
  }
  const std::vector<StreamArray>& arrays = file.header().description.arrays;
  for (const ValueCondition& wanted : query.conditions) {
    const auto found = std::find_if(arrays.begin(), arrays.end(),
                                    [&](const StreamArray& array) { return array.name == wanted.array; });
    if (found == arrays.end()) return no_array(file.name(), wanted.array, arrays);
    if (wanted.component && *wanted.component >= found->components) {
      return failure(ErrorCode::usage, file.name() + ": array \"" + wanted.array + "\" has " +
                                           (found->components == 1 ? "one component, number 0"
                                                                   : std::to_string(found->components) +
                                                                         " components, numbered from 0"));
    }
    checked.conditions_.push_back({static_cast<size_t>(found - arrays.begin()), found->components, wanted});
  }
  return checked;
}

bool CheckedQuery::may_have(const PieceRecord& piece) const {
  const bool has_box = piece.low[0] <= piece.high[0];
  if (!is_everywhere(query_->region) && !(has_box && query_->region.meets(box_of(piece)))) return false;
  // A plane as the two half spaces that meet in it.
  if (query_->plane) {
    Region both;
    both.planes = {*query_->plane, {query_->plane->normal * -1, -query_->plane->offset}};
    if (!has_box || !both.meets(box_of(piece))) return false;
  }
  if (query_->cells && (piece.first_cell >= query_->cells->second || piece.last_cell < query_->cells->first))
    return false;
  return piece.cells > 0 &&
         std::all_of(conditions_.begin(), conditions_.end(), [&](const Condition& condition) {
           return maille::may_have(piece.fields[condition.array], condition.components, condition.wanted);
         });
}

/// Cells whose box meets the region, not only cells within it; of a condition on points, one point of the
/// cell is enough.
std::vector<uint32_t> CheckedQuery::cells_of(const DecodedPiece& piece) const {
  const Mesh& mesh = piece.mesh;
  std::vector<std::pair<const Array*, ValueCondition>> conditions;
  for (const Condition& condition : conditions_) {
    const auto found = std::find_if(mesh.arrays.begin(), mesh.arrays.end(),
                                    [&](const Array& array) { return array.name == condition.wanted.array; });
    conditions.emplace_back(&*found, condition.wanted);
  }
  const bool everywhere = is_everywhere(query_->region);
  std::vector<uint32_t> cells;
  uint32_t number = 0;
  for (const CellBlock& block : mesh.blocks) {
    const uint64_t count = block.size();
    for (uint64_t i = 0; i < count; ++i, ++number) {
      const auto points = block.cell(i);
      if (query_->cells) {
        const uint64_t in_input = piece.numbers.cells[number];
        if (in_input < query_->cells->first || in_input >= query_->cells->second) continue;
      }
      if (!everywhere) {
        const std::optional<Box> box = box_of(mesh.points, points);
        if (!box || !query_->region.meets(*box)) continue;
      }
      if (query_->plane && !crosses(*query_->plane, mesh.points, points)) continue;
      const bool fits = std::all_of(conditions.begin(), conditions.end(), [&](const auto& condition) {
        const auto& [array, wanted] = condition;
        if (array->domain == Domain::cell) return has_value(*array, number, wanted);
        return std::any_of(points.begin(), points.end(),
                           [&, a = array, w = wanted](uint32_t point) { return has_value(*a, point, w); });
      });
      if (fits) cells.push_back(number);
    }
  }
  return cells;
}

}  // namespace maille
