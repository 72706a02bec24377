#include "surface/number_maps.h"

#include "base/result.h"
#include "mesh/scaled_digits.h"

namespace maille {

namespace {

bool has_digits(NumberMap::Kind kind) {
  return kind == NumberMap::Kind::binary_digits || kind == NumberMap::Kind::decimal_digits;
}

}  // namespace

void write_map(ByteWriter& out, const NumberMap& map) {
  out.put(map.kind);
  if (map.kind == NumberMap::Kind::decimal || map.kind == NumberMap::Kind::binary) {
    out.put(static_cast<int16_t>(map.exponent));
  }
  if (has_digits(map.kind)) {
    out.put(static_cast<uint8_t>(map.digits));
    out.put(static_cast<int16_t>(map.exponent));
  }
  if (map.kind == NumberMap::Kind::lattice) {
    out.put(map.origin);
    out.put(map.step);
  }
}

namespace {

/// Is this a map that choose_maps() can make for this type?
bool is_sensible(const NumberMap& map, Scalar type) {
  switch (map.kind) {
    case NumberMap::Kind::integer:
      return !is_float(type);
    case NumberMap::Kind::ordered:
      return is_float(type);
    case NumberMap::Kind::decimal:
      return is_float(type) && map.exponent >= 0 && map.exponent <= 15;
    case NumberMap::Kind::binary:
      return is_float(type) && map.exponent >= -1100 && map.exponent <= 1023;
    case NumberMap::Kind::lattice:
      return true;
    case NumberMap::Kind::binary_digits:
    case NumberMap::Kind::decimal_digits: {
      const uint32_t base = map.kind == NumberMap::Kind::binary_digits ? 2 : 10;
      return is_float(type) && map.digits >= 1 &&
             map.digits <= ScaledDigits::most_digits(base, size_of(type) == 8) &&
             map.exponent >= ScaledDigits::least_exponent(base) &&
             map.exponent <= ScaledDigits::most_exponent(base);
    }
  }
  return false;
}

}  // namespace

Result<NumberMap> read_map(ByteReader& in, Scalar type) {
  NumberMap map;
  map.kind = static_cast<NumberMap::Kind>(in.get<uint8_t>());
  if (map.kind == NumberMap::Kind::decimal || map.kind == NumberMap::Kind::binary)
    map.exponent = in.get<int16_t>();
  if (has_digits(map.kind)) {
    map.digits = in.get<uint8_t>();
    map.exponent = in.get<int16_t>();
  }
  if (map.kind == NumberMap::Kind::lattice) {
    map.origin = in.get<double>();
    map.step = in.get<double>();
  }
  if (!in.ok() || !is_sensible(map, type))
    return failure(ErrorCode::corrupt, "an array has an impossible number map");
  return map;
}

}  // namespace maille
