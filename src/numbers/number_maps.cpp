#include "numbers/number_maps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "base/result.h"
#include "entropy/bit_model.h"
#include "entropy/rans.h"
#include "mesh/none.h"
#include "numbers/scaled_digits.h"

namespace maille {

namespace {

bool has_digits(NumberMap::Kind kind) {
  return kind == NumberMap::Kind::binary_digits || kind == NumberMap::Kind::decimal_digits;
}

bool is_lossy(NumberMap::Kind kind) {
  return kind == NumberMap::Kind::lattice || kind == NumberMap::Kind::logarithm;
}

constexpr unsigned table_flag = 128;
constexpr unsigned factor_flag = 64;

/// The numbers of a table by how far they are from zero, as many lie on both of its sides where a shape is
/// its own mirror image. Gaps between them: their lengths from the length before, two more bits, the rest
/// raw. Both directions run the same code; a decoder's codes are bounded to 63 bits by its caller.
class TableModel {
 public:
  static constexpr unsigned below = 1, above = 2;  ///< zero: sides of a distance

  template <class Coder>
  uint64_t code_gap(Coder& coder, uint64_t gap) {
    const unsigned length = code_length(coder, bit_length(gap));
    before_ = length;
    uint64_t value = length > 0 ? 1 : 0;
    for (unsigned left = length > 0 ? length - 1 : 0; left > 0;) {
      const unsigned known = length - left;
      if (known <= 2) {
        const bool bit = (gap >> (left - 1) & 1) != 0;
        value = value << 1 | (top_[length][value & 3].code(coder, bit) ? 1 : 0);
        --left;
        continue;
      }
      const unsigned count = left < 16 ? left : 16;
      const auto bits = static_cast<uint32_t>(gap >> (left - count) & ((1u << count) - 1));
      value = value << count | coder.code_raw(bits, count);
      left -= count;
    }
    return value;
  }

  /// On which sides the next distance has a number.
  template <class Coder>
  unsigned code_sides(Coder& coder, unsigned sides) {
    if (both_[sides_].code(coder, sides == (below | above))) {
      sides_ = below | above;
    } else {
      sides_ = above_[sides_].code(coder, sides == above) ? above : below;
    }
    return sides_;
  }

 private:
  /// Seven decisions hold up to 127, but a gap of a code has 64 bits at most: damaged lengths are clamped, so
  /// that the arrays below and the shifts of code_gap() stay in range.
  template <class Coder>
  unsigned code_length(Coder& coder, unsigned length) {
    unsigned prefix = 1;
    for (unsigned i = 7; i-- > 0;)
      prefix = prefix << 1 | (length_[before_][prefix].code(coder, (length >> i & 1) != 0) ? 1 : 0);
    return prefix - 128 < 64 ? prefix - 128 : 64;
  }

  std::array<std::array<BitModel, 128>, 65> length_;
  std::array<std::array<BitModel, 4>, 65> top_;
  std::array<BitModel, 4> both_, above_;  ///< by the sides before
  unsigned before_ = 0, sides_ = 0;
};

/// The code as far from zero on its other side.
int64_t mirrored(const NumberMap& map, int64_t code) {
  // These kinds tell -0 from 0, by codes -1 and 0; the others have one zero, with code 0.
  const bool two_zeros = map.kind == NumberMap::Kind::ordered || has_digits(map.kind);
  return two_zeros ? -1 - code : -code;
}

/// The code of a table's number in the map without its table.
std::vector<int64_t> codes_of_table(const NumberMap& map) {
  NumberMap plain = map;
  plain.table.clear();
  std::vector<int64_t> codes;
  for (const double number : map.table)
    codes.push_back(plain.code_of(Scalar::f64, reinterpret_cast<const std::byte*>(&number)));
  return codes;
}

void write_table(ByteWriter& out, const NumberMap& map) {
  const std::vector<int64_t> codes = codes_of_table(map);
  out.put_count(codes.size());
  RansEncoder encoder(1);
  const auto model = std::make_unique<TableModel>();
  // From zero on in both directions.
  auto above = std::lower_bound(codes.begin(), codes.end(), int64_t{0}), below = above;
  for (uint64_t next = 0; above != codes.end() || below != codes.begin();) {
    const uint64_t up = above != codes.end() ? static_cast<uint64_t>(*above) : ~uint64_t{0};
    const uint64_t down =
        below != codes.begin() ? static_cast<uint64_t>(mirrored(map, below[-1])) : ~uint64_t{0};
    const uint64_t distance = std::min(up, down);
    model->code_gap(encoder, distance - next);
    model->code_sides(encoder,
                      (up == distance ? TableModel::above : 0) | (down == distance ? TableModel::below : 0));
    if (up == distance) ++above;
    if (down == distance) --below;
    next = distance + 1;
  }
  const std::vector<std::byte> gaps = encoder.finish();
  out.put_count(gaps.size());
  out.put_bytes(gaps);
}

/// The codes of a table, ascending; empty if they are damaged. A round ends the loop when the decoder has run
/// out, and each takes at least eight decisions, so the bytes bound the rounds whatever `count` says.
/// Distances rise strictly and have 63 bits, so codes come out ascending, and negating one cannot overflow.
std::vector<int64_t> read_codes(const NumberMap& map, uint64_t count, Bytes gaps) {
  constexpr auto farthest = static_cast<uint64_t>(std::numeric_limits<int64_t>::max());
  RansDecoder decoder(gaps, 1);
  const auto model = std::make_unique<TableModel>();
  std::vector<int64_t> above, below;
  for (uint64_t next = 0; above.size() + below.size() < count;) {
    const uint64_t gap = model->code_gap(decoder, uint64_t{0});
    const unsigned sides = model->code_sides(decoder, 0);
    if (decoder.exhausted() || next > farthest || gap > farthest - next) return {};
    const auto code = static_cast<int64_t>(next + gap);
    if ((sides & TableModel::above) != 0) above.push_back(code);
    if ((sides & TableModel::below) != 0) below.push_back(mirrored(map, code));
    next += gap + 1;
  }
  // The last distance may have had numbers on both of its sides where one was wanted.
  if (above.size() + below.size() != count) return {};
  std::reverse(below.begin(), below.end());
  below.insert(below.end(), above.begin(), above.end());
  return below;
}

Result<> read_table(ByteReader& in, Scalar type, uint64_t most, NumberMap& map) {
  const auto corrupt = [] { return failure(ErrorCode::corrupt, "an array has a damaged table of numbers"); };
  const uint64_t count = in.get_count();
  const Bytes gaps = in.get_bytes(in.get_count());
  // This refuses absurd counts at once. read_codes() bounds the memory, as its lists grow while numbers come.
  if (!in.ok() || count == 0 || count > most || count / 16384 > gaps.size() + 16) return corrupt();
  const std::vector<int64_t> codes = read_codes(map, count, gaps);
  if (codes.empty()) return corrupt();
  std::vector<double> table;
  for (const int64_t code : codes) {
    std::byte number[8];
    map.store_number(type, code, number);
    const double value = number_as_double(type, number);
    if (!std::isfinite(value) || (!table.empty() && value < table.back())) return corrupt();
    table.push_back(value);
  }
  map.table = std::move(table);
  return {};
}

}  // namespace

void write_map(ByteWriter& out, const NumberMap& map, ByteWriter* tables) {
  out.put(static_cast<uint8_t>(static_cast<unsigned>(map.kind) | (map.table.empty() ? 0 : table_flag) |
                               (map.factor == 0 ? 0 : factor_flag)));
  if (map.kind == NumberMap::Kind::decimal || map.kind == NumberMap::Kind::binary) {
    out.put(static_cast<int16_t>(map.exponent));
  }
  if (has_digits(map.kind)) {
    out.put(static_cast<uint8_t>(map.digits));
    out.put(static_cast<int8_t>(map.decimals));
    out.put(static_cast<int16_t>(map.exponent));
  }
  if (map.factor != 0) out.put(map.factor);
  if (is_lossy(map.kind)) {
    out.put(map.origin);
    out.put(map.step);
  }
  if (!map.table.empty()) write_table(tables ? *tables : out, map);
}

namespace {

/// Is this a map that choose_maps() can make for this type? Of lattices only what machines agree on: bits of
/// NaN that come of NaN, or of 0 times infinity, are not the same in WebAssembly.
bool is_sensible(const NumberMap& map, Scalar type, bool in_stream) {
  if (map.factor != 0) {
    const bool allowed = map.kind == NumberMap::Kind::decimal || map.kind == NumberMap::Kind::binary ||
                         (map.kind == NumberMap::Kind::ordered && in_stream) ||
                         (has_digits(map.kind) && map.decimals < 0);
    // A float times such a factor is a finite double that keeps all of its bits, as is a double divided by
    // it.
    if (!allowed || type != Scalar::f64 || !(map.factor > 1e-100 && map.factor < 1e100)) return false;
    type = Scalar::f32;  // what the fields belong to
  }
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
      return std::isfinite(map.origin) && std::isfinite(map.step);
    case NumberMap::Kind::logarithm:
      return is_float(type) && map.step > 0 && std::isfinite(map.step) &&
             std::fabs(map.origin) < 9007199254740992.0;
    case NumberMap::Kind::binary_digits:
    case NumberMap::Kind::decimal_digits: {
      const uint32_t base = map.kind == NumberMap::Kind::binary_digits ? 2 : 10;
      return is_float(type) && map.digits >= 1 &&
             map.digits <= ScaledDigits::most_digits(base, size_of(type) == 8) &&
             map.exponent >= ScaledDigits::least_exponent(base) &&
             map.exponent <= ScaledDigits::most_exponent(base) && map.decimals >= -1 &&
             map.decimals <= (type == Scalar::f64 ? 9 : -1);
    }
  }
  return false;
}

}  // namespace

Result<NumberMap> read_map(ByteReader& in, Scalar type, ByteReader* tables) {
  NumberMap map;
  const auto kind = in.get<uint8_t>();
  map.kind = static_cast<NumberMap::Kind>(kind & ~(table_flag | factor_flag));
  if (map.kind == NumberMap::Kind::decimal || map.kind == NumberMap::Kind::binary)
    map.exponent = in.get<int16_t>();
  if (has_digits(map.kind)) {
    map.digits = in.get<uint8_t>();
    map.decimals = in.get<int8_t>();
    map.exponent = in.get<int16_t>();
  }
  if ((kind & factor_flag) != 0) map.factor = in.get<double>();
  if (is_lossy(map.kind)) {
    map.origin = in.get<double>();
    map.step = in.get<double>();
  }
  if (!in.ok() || !is_sensible(map, type, tables != nullptr) ||
      ((kind & factor_flag) != 0 && map.factor == 0))
    return failure(ErrorCode::corrupt, "an array has an impossible number map");
  if ((kind & table_flag) != 0) {
    if (!is_float(type)) return failure(ErrorCode::corrupt, "an array has an impossible number map");
    const uint64_t most = tables ? most_streamed_numbers : ~uint64_t{0};
    MAILLE_CHECK(read_table(tables ? *tables : in, type, most, map));
  }
  return map;
}

int64_t logarithm(uint64_t x) {
  const unsigned whole = bit_length(x) - 1;
  const uint64_t fraction = whole > 10 ? x >> (whole - 10) : x << (10 - whole);
  return int64_t{whole} * 1024 + static_cast<int64_t>(fraction & 1023);
}

namespace {

/// How many fewer bits (in 1/1024) ranks in a table take than codes, with the table. `codes` are those of all
/// numbers, in order. `price`: what must be saved for each of them. A residual among ranks is shorter than
/// one among codes by the logarithm of the gap around the number, for which the mean of both gaps stands.
/// Each different number costs the gap to the next one, which is written once, and the table costs 64 bits
/// for its head.
int64_t saving_of_table(std::span<const int64_t> codes, int64_t price) {
  // One and a half bits are about what TableModel takes for the length and the side of a gap, beside its raw
  // bits. This is an estimate, not a fit; a larger figure makes fewer tables.
  constexpr int64_t bits_of_gap = 1536;  // beyond the gap's logarithm
  const auto gap = [](int64_t low, int64_t high) {
    return static_cast<uint64_t>(high) - static_cast<uint64_t>(low);
  };
  int64_t saved = -64 * 1024 - price * static_cast<int64_t>(codes.size());
  uint64_t before = 0;
  for (size_t i = 0; i < codes.size();) {
    size_t end = i + 1;
    while (end < codes.size() && codes[end] == codes[i]) ++end;
    const uint64_t behind = end < codes.size() ? gap(codes[i], codes[end]) : before;
    if (behind == 0) return 0;  // all are one
    const uint64_t both = before == 0 ? behind : std::max<uint64_t>(1, before / 2 + behind / 2);
    saved += static_cast<int64_t>(end - i) * logarithm(both) - logarithm(behind) - bits_of_gap;
    before = behind;
    i = end;
  }
  return saved;
}

/// Of the numbers of one component that are coded; empty where it would not pay.
std::vector<double> make_table(const Array& array, const NumberMap& map, uint32_t component,
                               std::span<const uint32_t> source, int64_t& saving) {
  const size_t size = size_of(array.type);
  std::vector<int64_t> codes;
  codes.reserve(source.size());
  for (const uint32_t tuple : source) {
    if (tuple == none) continue;
    const std::byte* number = array.bytes.data() + (size_t{tuple} * array.components + component) * size;
    if (!std::isfinite(number_as_double(array.type, number))) return {};
    codes.push_back(map.code_of(array.type, number));
  }
  std::sort(codes.begin(), codes.end());
  // Codes in steps are predicted faster and more exactly, so a table must save half a bit for each number
  // there, and a sixteenth where the map is curved anyway. Chosen, not swept (9f6e31f).
  saving = saving_of_table(codes, map.is_curved() ? 64 : 512);
  if (saving <= 0) return {};
  codes.erase(std::unique(codes.begin(), codes.end()), codes.end());
  std::vector<double> table;
  for (const int64_t code : codes) {
    std::byte number[8];
    map.store_number(array.type, code, number);
    table.push_back(number_as_double(array.type, number));
  }
  return table;
}

}  // namespace

bool has_tables(std::span<const NumberMap> maps) {
  return std::any_of(maps.begin(), maps.end(), [](const NumberMap& map) { return !map.table.empty(); });
}

std::vector<NumberMap> with_tables(const Array& array, std::vector<NumberMap> maps,
                                   std::span<const uint32_t> source, std::vector<int64_t>* savings) {
  if (savings) savings->assign(maps.size(), 0);
  if (!is_float(array.type)) return maps;
  for (uint32_t k = 0; k < maps.size(); ++k) {
    if (is_lossy(maps[k].kind) || maps[k].kind == NumberMap::Kind::ordered) continue;
    int64_t saving = 0;
    maps[k].table = make_table(array, maps[k], k, source, saving);
    if (savings && saving > 0) (*savings)[k] = saving;
  }
  return maps;
}

}  // namespace maille
