#include "volume/tuple_values.h"

#include <algorithm>

namespace maille {
namespace {

/// At first the first candidate is trusted, later whatever did best.
constexpr int32_t head_start = 16;
constexpr uint32_t most_full_samples = 3 * 65536;

int32_t miss_of(double difference) {
  return std::max(half_octaves_of(difference), -400) * 16;
}

}  // namespace

template <class Coder, unsigned Bits>
TupleCoder<Coder, Bits>::TupleCoder(const StreamedArray& array)
    : array_(array),
      components_(array.components),
      last_(components_),
      last_size_(components_),
      records_(size_t{components_} * PointStencil::situations),
      fits_(size_t{components_} * most_corners),
      residuals_(true),
      exceptions_(components_) {
  for (const NumberMap& map : array.maps) spaces_.emplace_back(array.type, map);
  for (Record& record : records_) {
    for (unsigned i = 0; i < most_candidates; ++i) record.miss[i] = static_cast<int32_t>(i) * head_start;
  }
}

template <class Coder, unsigned Bits>
void TupleCoder<Coder, Bits>::code(Coder& coder, const PointStencil& stencil, uint32_t slot, std::byte* tuple) {
  const size_t needed = (size_t{slot} + 1) * components_;
  if (needed > values_.size()) values_.resize((size_t{slot} + 16) * components_);
  const size_t size = size_of(array_.type);
  for (unsigned c = 0; c < components_; ++c) code_number(coder, stencil, c, slot, tuple + c * size);
}

template <class Coder, unsigned Bits>
void TupleCoder<Coder, Bits>::value_at(uint32_t slot, std::byte* tuple) const {
  for (unsigned c = 0; c < components_; ++c) {
    spaces_[c].store_number(values_[size_t{slot} * components_ + c].code, tuple + c * size_of(array_.type));
  }
}

template <class Coder, unsigned Bits>
typename TupleCoder<Coder, Bits>::Expectation TupleCoder<Coder, Bits>::expect(const PointStencil& stencil,
                                                                              unsigned c) {
  Expectation result;
  for (unsigned i = 0; i < stencil.sums; ++i) {
    const PointSum& sum = stencil.sum[i];
    double place = 0;
    for (unsigned k = 0; k < sum.count; ++k) place += sum.weight[k] * value(sum.slot[k], c).place;
    result.candidate[result.count++] = place;
  }
  result.base = result.count > 0 ? result.candidate[0] : last_[c];
  if (stencil.is_full()) {
    for (unsigned k = 0; k < 7; ++k) result.twists[k] = value(stencil.others[k], c).twist;
    result.twists[7] = 0;
    const auto& fit = fits_[c * most_corners + stencil.situation];
    result.candidate[result.count++] = result.base + static_cast<double>(fit.predict(result.twists));
  } else if (stencil.sums == 0) {
    result.candidate[result.count++] = last_[c];
  }
  return result;
}

template <class Coder, unsigned Bits>
unsigned TupleCoder<Coder, Bits>::choose(const Expectation& expectation, const Record& record) const {
  unsigned best = 0;
  for (unsigned i = 1; i < expectation.count; ++i) {
    if (record.miss[i] < record.miss[best]) best = i;
  }
  return best;
}

/// Residuals of neighbours tell how large this one will be: in the same units, not in those of the last bit.
template <class Coder, unsigned Bits>
ResidualContext TupleCoder<Coder, Bits>::context_of(const PointStencil& stencil, unsigned c, double place,
                                                    unsigned choice) {
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
  if (stencil.is_full()) group = 0;
  else if (stencil.situation >= PointStencil::partial + 4 && stencil.situation < PointStencil::between) group = 1;
  else if (stencil.situation < PointStencil::alone) group = 2;
  static_cast<void>(choice);
  return {static_cast<unsigned>(expected), group * 3 + spread};
}

template <class Coder, unsigned Bits>
bool TupleCoder<Coder, Bits>::keeps(unsigned c, const std::byte* number) const {
  std::array<std::byte, 8> back{};
  int64_t code = spaces_[c].code_of(number);
  if constexpr (Bits == 32) code = static_cast<int32_t>(code);
  spaces_[c].store_number(code, back.data());
  if (array_.bound == 0) return std::equal(number, number + size_of(array_.type), back.data());
  const double difference = number_as_double(array_.type, number) - number_as_double(array_.type, back.data());
  return difference <= array_.bound && -difference <= array_.bound;
}

/// Numbers that the map does not hold are written as they are.
template <class Coder, unsigned Bits>
bool TupleCoder<Coder, Bits>::code_exception(Coder& coder, unsigned c, const std::byte* number) {
  if (spaces_[c].exact()) return false;
  bool exception = false;
  if constexpr (encoding) exception = !keeps(c, number);
  return exceptions_[c].code(coder, exception);
}

template <class Coder, unsigned Bits>
int64_t TupleCoder<Coder, Bits>::code_residual(Coder& coder, int64_t residual, unsigned c,
                                               const ResidualContext& context) {
  const unsigned model = c < 3 ? c : 2, lane = c % 3;
  const uint64_t size = residual < 0 ? -static_cast<uint64_t>(residual) : static_cast<uint64_t>(residual);
  const unsigned length = residuals_.code_length(coder, bit_length(size), model, context, lane);
  return residuals_.code_value(coder, residual, length, model, lane);
}

template <class Coder, unsigned Bits>
void TupleCoder<Coder, Bits>::code_number(Coder& coder, const PointStencil& stencil, unsigned c, uint32_t slot,
                                          std::byte* number) {
  const Expectation expectation = expect(stencil, c);
  Record& record = records_[c * size_t{PointStencil::situations} + stencil.situation];
  const double expected = expectation.candidate[choose(expectation, record)];
  Value& value_here = value(slot, c);
  if (code_exception(coder, c, number)) {
    const size_t size = size_of(array_.type);
    uint64_t bits = 0;
    if constexpr (encoding) std::memcpy(&bits, number, size);
    bits = coder.code_raw(static_cast<uint32_t>(bits), static_cast<unsigned>(std::min<size_t>(size, 4) * 8)) |
           (size == 8 ? uint64_t{coder.code_raw(static_cast<uint32_t>(bits >> 32), 32)} << 32 : 0);
    if constexpr (!encoding) std::memcpy(number, &bits, size);
    value_here = {expected == expected ? expected : 0, 0, 0, 0};
    return;
  }
  const ResidualContext context = context_of(stencil, c, expected, 0);
  const int64_t guess = spaces_[c].code_near(expected);
  int64_t code = encoding ? spaces_[c].code_of(number) : 0;
  int64_t residual = static_cast<int64_t>(static_cast<uint64_t>(code) - static_cast<uint64_t>(guess));
  if constexpr (Bits == 32) residual = static_cast<int32_t>(residual);
  residual = code_residual(coder, residual, c, context);
  code = static_cast<int64_t>(static_cast<uint64_t>(guess) + static_cast<uint64_t>(residual));
  if constexpr (Bits == 32) code = static_cast<int32_t>(code);
  if constexpr (!encoding) spaces_[c].store_number(code, number);
  const double place = spaces_[c].place_of(code);
  const uint64_t size = residual < 0 ? -static_cast<uint64_t>(residual) : static_cast<uint64_t>(residual);
  const int unit = spaces_[c].unit_at(expected);
  value_here.place = place;
  value_here.code = code;
  value_here.twist = static_cast<float>(place - expectation.base);
  value_here.size = static_cast<int16_t>(static_cast<int>(half_octaves(size)) + unit);
  last_[c] = place;
  last_size_[c] = value_here.size;
  learn(stencil, expectation, c, place, record);
}

template <class Coder, unsigned Bits>
void TupleCoder<Coder, Bits>::learn(const PointStencil& stencil, const Expectation& expectation, unsigned c,
                                    double place, Record& record) {
  for (unsigned i = 0; i < expectation.count; ++i) {
    const int32_t miss = miss_of(place - expectation.candidate[i]);
    record.miss[i] += (miss - record.miss[i]) / 64;
  }
  // Neighbouring samples say much the same: in the long run one in four is enough.
  if (!stencil.is_full() || (++samples_ > most_full_samples && samples_ % 4 != 0)) return;
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

template class TupleCoder<RansEncoder, 32>;
template class TupleCoder<RansEncoder, 64>;
template class TupleCoder<RansDecoder, 32>;
template class TupleCoder<RansDecoder, 64>;

}  // namespace maille
