#pragma once

#include "numbers/decades.h"
#include "numbers/number_map.h"

namespace maille {

/// value_of() and nearest_code() of a map whose codes are not proportional to its numbers, for loops over
/// many: what most files have is found without calls. The results are those of NumberMap, bit for bit, as an
/// encoder may use one of them and its decoder the other.
class CurvedMap {
 public:
  CurvedMap() = default;
  /// The map stays where it is. Of one that is not curved: none.
  CurvedMap(const NumberMap& map, Scalar type) : type_(type) {
    if (!map.is_curved()) return;
    map_ = &map;
    const bool digits = map.table.empty() && map.factor == 0;
    if (digits && map.kind == NumberMap::Kind::binary_digits) bits_ = {2, map.digits, map.exponent};
    if (digits && map.kind == NumberMap::Kind::decimal_digits)
      decades_ = Decades({10, map.digits, map.exponent});
  }

  explicit operator bool() const { return map_ != nullptr; }
  const NumberMap& map() const { return *map_; }
  double value_of(int64_t code) const {
    if (bits_.digits > 0) return bits_.number_of(code);
    return decades_.empty() ? map_->value_of(type_, code) : decades_.number_of(code);
  }
  int64_t nearest_code(double value) const {
    if (bits_.digits > 0) return bits_.code_of(value);
    return decades_.empty() ? map_->nearest_code(type_, value) : decades_.code_of(value);
  }

 private:
  const NumberMap* map_ = nullptr;
  Scalar type_ = Scalar::f64;
  ScaledDigits bits_{2, 0, 0};  ///< no digits: another kind
  Decades decades_;
};

}  // namespace maille
