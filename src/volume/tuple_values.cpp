#include "volume/tuple_values.h"

#include <algorithm>

namespace maille {
namespace {

/// At first the first candidate is trusted, later whatever did best.
constexpr int32_t head_start = 16;
/// Components of an array with least squares of their own, which take 4 KiB each.
constexpr uint32_t most_fitted = 16;
constexpr uint32_t most_full_samples = 3 * 65536;

int32_t miss_of(double difference) {
  return std::max(half_octaves_of(difference), -400) * 16;
}

uint64_t magnitude(int64_t residual) {
  const auto bits = static_cast<uint64_t>(residual);
  return residual < 0 ? -bits : bits;
}

}  // namespace

uint64_t tuple_coder_bytes(const StreamedArray& array) {
  const uint64_t fits = array.components <= most_fitted ? most_corners * sizeof(OnlineLeastSquares<8>) : 0;
  return (uint64_t{256} << 10) + array.components * (PointStencil::situations * uint64_t{16} + 64 + fits);
}

template <class Coder, unsigned Bits>
TupleValueCoder<Coder, Bits>::TupleValueCoder(const StreamedArray& array)
    : array_(array),
      components_(array.components),
      last_(components_),
      last_size_(components_),
      records_(size_t{components_} * PointStencil::situations),
      fits_(components_ <= most_fitted ? size_t{components_} * most_corners : 0),
      residuals_(true),
      exceptions_(components_) {
  for (const NumberMap& map : array.maps) spaces_.emplace_back(array.type, map);
  for (Record& record : records_) {
    for (unsigned i = 0; i < most_candidates; ++i) record.miss[i] = static_cast<int32_t>(i) * head_start;
  }
}

template <class Coder, unsigned Bits>
void TupleValueCoder<Coder, Bits>::code(Coder& coder, const PointStencil& stencil, uint32_t slot,
                                        std::byte* tuple) {
  const size_t needed = (size_t{slot} + 1) * components_;
  if (needed > values_.size()) values_.resize((size_t{slot} + 16) * components_);
  const size_t size = size_of(array_.type);
  for (unsigned c = 0; c < components_; c += group_size) {
    code_group(coder, stencil, c, std::min(group_size, components_ - c), slot, tuple + c * size);
  }
}

template <class Coder, unsigned Bits>
typename TupleValueCoder<Coder, Bits>::Expectation TupleValueCoder<Coder, Bits>::expect(
    const PointStencil& stencil, unsigned c) {
  Expectation result;
  if (stencil.is_full()) {
    std::array<double, 7> place;
    for (unsigned k = 0; k < 7; ++k) {
      const Value& other = value(stencil.others[k], c);
      place[k] = other.place;
      result.twists[k] = other.twist;
    }
    const double base = ((place[0] + place[1]) + place[2]) - ((place[3] + place[4]) + place[5]) + place[6];
    result.twists[7] = 0;
    result.candidate[0] = result.base = base;
    result.count = 1;
    if (fits_.empty()) return result;
    const auto& fit = fits_[c * most_corners + stencil.situation];
    result.candidate[1] = base + static_cast<double>(fit.predict(result.twists));
    result.count = 2;
    return result;
  }
  for (unsigned i = 0; i < stencil.sums; ++i) {
    const PointSum& sum = stencil.sum[i];
    double place = 0;
    for (unsigned k = 0; k < sum.count; ++k) place += sum.weight[k] * value(sum.slot[k], c).place;
    result.candidate[result.count++] = place;
  }
  result.base = result.count > 0 ? result.candidate[0] : last_[c];
  if (stencil.sums == 0) {
    result.candidate[result.count++] = last_[c];
  }
  return result;
}

template <class Coder, unsigned Bits>
unsigned TupleValueCoder<Coder, Bits>::choose(const Expectation& expectation, const Record& record) const {
  unsigned best = 0;
  for (unsigned i = 1; i < expectation.count; ++i) {
    if (record.miss[i] < record.miss[best]) best = i;
  }
  return best;
}

/// Residuals of neighbours tell how large this one will be: in the same units, not in those of the last bit.
template <class Coder, unsigned Bits>
ResidualContext TupleValueCoder<Coder, Bits>::context_of(const PointStencil& stencil, unsigned c,
                                                         double place) {
  int sum = 0, least = 1 << 20, most = -(1 << 20);
  for (unsigned i = 0; i < stencil.near_count; ++i) {
    const int size = value(stencil.near[i], c).size;
    sum += size;
    least = std::min(least, size);
    most = std::max(most, size);
  }
  const auto count = static_cast<int>(stencil.near_count);
  const int mean = count == 0 ? last_size_[c] : (sum + 4096 * count) / count - 4096;
  const int expected = std::clamp(mean - spaces_[c].unit_at(place), 0, 2 * static_cast<int>(Bits) - 1);
  const unsigned spread = count < 2 ? 0 : most - least < 3 ? 0 : most - least < 8 ? 1 : 2;
  unsigned group = 3;
  if (stencil.is_full())
    group = 0;
  else if (stencil.situation >= PointStencil::partial + 4 && stencil.situation < PointStencil::between)
    group = 1;
  else if (stencil.situation < PointStencil::alone)
    group = 2;
  return {static_cast<unsigned>(expected), group * 3 + spread};
}

template <class Coder, unsigned Bits>
bool TupleValueCoder<Coder, Bits>::keeps(unsigned c, const std::byte* number) const {
  std::array<std::byte, 8> back{};
  int64_t code = spaces_[c].code_of(number);
  if constexpr (Bits == 32) code = static_cast<int32_t>(code);
  spaces_[c].store_number(code, back.data());
  if (array_.bound == 0) return std::equal(number, number + size_of(array_.type), back.data());
  const double difference =
      number_as_double(array_.type, number) - number_as_double(array_.type, back.data());
  return difference <= array_.bound && -difference <= array_.bound;
}

/// Numbers that the map does not hold are written as they are.
template <class Coder, unsigned Bits>
bool TupleValueCoder<Coder, Bits>::code_exception(Coder& coder, unsigned c, const std::byte* number) {
  if (spaces_[c].exact()) return false;
  bool exception = false;
  if constexpr (encoding) exception = !keeps(c, number);
  return exceptions_[c].code(coder, exception);
}

template <class Coder, unsigned Bits>
void TupleValueCoder<Coder, Bits>::code_bits(Coder& coder, std::byte* bytes) {
  const size_t size = size_of(array_.type);
  uint64_t bits = 0;
  if constexpr (encoding) std::memcpy(&bits, bytes, size);
  const uint64_t low =
      coder.code_raw(static_cast<uint32_t>(bits), static_cast<unsigned>(std::min<size_t>(size, 4) * 8));
  const uint64_t high = size == 8 ? coder.code_raw(static_cast<uint32_t>(bits >> 32), 32) : 0;
  bits = high << 32 | low;
  if constexpr (!encoding) std::memcpy(bytes, &bits, size);
}

template <class Coder, unsigned Bits>
void TupleValueCoder<Coder, Bits>::prepare(Coder& coder, const PointStencil& stencil, unsigned c,
                                           const std::byte* bytes, Number& number) {
  number.expectation = expect(stencil, c);
  number.record = &records_[c * size_t{PointStencil::situations} + stencil.situation];
  number.expected = number.expectation.candidate[choose(number.expectation, *number.record)];
  number.exception = code_exception(coder, c, bytes);
  number.context = context_of(stencil, c, number.expected);
  number.guess = spaces_[c].code_near(number.expected);
  if constexpr (encoding) {
    const int64_t code = number.exception ? 0 : spaces_[c].code_of(bytes);
    number.residual = static_cast<int64_t>(static_cast<uint64_t>(code) - static_cast<uint64_t>(number.guess));
    if constexpr (Bits == 32) number.residual = static_cast<int32_t>(number.residual);
  }
}

template <class Coder, unsigned Bits>
void TupleValueCoder<Coder, Bits>::code_group(Coder& coder, const PointStencil& stencil, unsigned first,
                                              unsigned count, uint32_t slot, std::byte* numbers) {
  const size_t size = size_of(array_.type);
  std::array<Number, group_size> group;
  for (unsigned k = 0; k < count; ++k) prepare(coder, stencil, first + k, numbers + k * size, group[k]);
  // Models are for three components; further ones share those of the last.
  const auto model = [&](unsigned k) { return std::min(first + k, 2u); };
  for (unsigned k = 0; k < count; ++k) {
    Number& number = group[k];
    if (number.exception) continue;
    const unsigned length = encoding ? bit_length(magnitude(number.residual)) : 0;
    number.length = residuals_.code_length(coder, length, model(k), number.context, k);
  }
  for (unsigned k = 0; k < count; ++k) {
    Number& number = group[k];
    if (number.exception) {
      code_bits(coder, numbers + k * size);
    } else {
      number.residual =
          residuals_.code_value(coder, encoding ? number.residual : 0, number.length, model(k), k);
    }
  }
  for (unsigned k = 0; k < count; ++k) finish(stencil, first + k, slot, numbers + k * size, group[k]);
}

template <class Coder, unsigned Bits>
void TupleValueCoder<Coder, Bits>::finish(const PointStencil& stencil, unsigned c, uint32_t slot,
                                          std::byte* bytes, Number& number) {
  Value& value_here = value(slot, c);
  if (number.exception) {
    value_here = {number.expected == number.expected ? number.expected : 0, 0, 0};
    return;
  }
  int64_t code =
      static_cast<int64_t>(static_cast<uint64_t>(number.guess) + static_cast<uint64_t>(number.residual));
  if constexpr (Bits == 32) code = static_cast<int32_t>(code);
  if constexpr (!encoding) spaces_[c].store_number(code, bytes);
  const double place = spaces_[c].place_of(code);
  const auto size = static_cast<int>(half_octaves(magnitude(number.residual)));
  value_here.place = place;
  value_here.twist = static_cast<float>(place - number.expectation.base);
  value_here.size = static_cast<int16_t>(size + spaces_[c].unit_at(number.expected));
  last_[c] = place;
  last_size_[c] = value_here.size;
  learn(stencil, number.expectation, c, place, *number.record);
}

template <class Coder, unsigned Bits>
void TupleValueCoder<Coder, Bits>::learn(const PointStencil& stencil, const Expectation& expectation,
                                         unsigned c, double place, Record& record) {
  for (unsigned i = 0; i < expectation.count; ++i) {
    const int32_t miss = miss_of(place - expectation.candidate[i]);
    record.miss[i] += (miss - record.miss[i]) / 64;
  }
  // Neighbouring samples say much the same: in the long run one in four is enough.
  if (!stencil.is_full() || fits_.empty() || (++samples_ > most_full_samples && samples_ % 4 != 0)) return;
  const double error = place - expectation.base;
  // The fit wants samples of about the same size: each is weighed by the size that its neighbours had.
  double scale = 0;
  for (const float twist : expectation.twists) {
    const auto size = static_cast<double>(twist < 0 ? -twist : twist);
    if (size > scale) scale = size;
  }
  if (!(scale > 0)) return;
  fits_[c * most_corners + stencil.situation].learn(expectation.twists, static_cast<float>(error),
                                                    static_cast<float>(1 / scale));
}

template class TupleValueCoder<RansEncoder, 32>;
template class TupleValueCoder<RansEncoder, 64>;
template class TupleValueCoder<RansDecoder, 32>;
template class TupleValueCoder<RansDecoder, 64>;

}  // namespace maille
