#include "volume/values/mixed_values.h"

#include <algorithm>
#include <cmath>

#include "volume/cells/slots.h"

namespace maille {
namespace {

/// About 2 log2(x), rounded down, from -200 to 200. Exponent and a comparison of the fraction with that of
/// sqrt(2): no logarithm of a library, which may differ in its last bit.
int half_octave(double x) {
  if (!(x > 1e-30)) return -200;
  if (x > 1e30) return 200;
  const auto bits = bits_as<uint64_t>(x);
  return 2 * (static_cast<int>(bits >> 52) - 1023) +
         static_cast<int>((bits & 0xfffffffffffff) >= 0x6a09e667f3bcc);
}

/// 2^(x / 2) at whole numbers, between them along a straight line (0.41421356 = sqrt(2) - 1). ldexp and floor
/// are exact.
double from_half_octaves(double x) {
  const double whole = std::floor(x);
  const int half = static_cast<int>(whole);
  const double power = std::ldexp((half & 1) != 0 ? 1.4142135623730951 : 1.0, half >> 1);
  return power * (1 + (x - whole) * 0.41421356237309515);
}

unsigned bin(int value, int low, int count) {
  const int place = value - low;
  return static_cast<unsigned>(place < 0 ? 0 : place >= count ? count - 1 : place);
}

/// Narrowed to a range in which float squares do not overflow the products of the fit.
float to_float(double x) {
  constexpr double most = 1e32;
  return static_cast<float>(x < most ? x > -most ? x : -most : most);
}

// Chosen with the first version (24b5167), no sweep is on record: a fifth for each expert, a constant without
// weight, little for counts, more for codes that come again, which speak up only where they do. They only
// matter until the mixer has learnt.
template <unsigned inputs>
std::array<int32_t, inputs> initial_weights() {
  std::array<int32_t, inputs> weights;
  weights.fill(65536 * 35 / 100);  // codes that come again
  for (unsigned i = 0; i < 4; ++i) weights[i] = 65536 / 5;
  weights[4] = 0;
  for (unsigned i = 5; i < 8; ++i) weights[i] = 65536 / 25;
  return weights;
}

}  // namespace

/// In bytes, rounded up: weights, cells by bins, what came after which code, the fits, and what each
/// component has. Most of it is made only as numbers come: an array of three takes a third.
uint64_t mixed_coder_bytes(const StreamedArray& array) {
  const uint64_t fits = PointStencil::situations * uint64_t{array.follows ? 3500u : 1300u};
  const uint64_t codes = uint64_t{array.is_wide() ? 8u : 4u} << 15;
  return (uint64_t{288} << 10) + codes + fits + array.components * uint64_t{4000};
}

template <class Coder, unsigned Bits>
MixedValueCoder<Coder, Bits>::MixedValueCoder(const StreamedArray& array)
    : array_(array),
      number_size_(size_of(array.type)),
      exceptions_(array.components),
      last_(array.components),
      places_(array.components),
      situations_(array.components),
      mixer_(scale_bins * node_types, 64 * node_types, node_types, initial_weights<inputs>()),
      few_{std::vector<std::vector<WideCell>>(scale_bins * 2),
           std::vector<std::vector<WideCell>>(scale_bins * 2)} {
  for (const NumberMap& map : array.maps) spaces_.emplace_back(array.type, map);
  array_.maps.clear();  // with their tables
  if (array.follows) {
    following_fits_.resize(PointStencil::situations);
    last_before_.resize(array.components);
    places_before_.resize(array.components);
  } else {
    fits_.resize(PointStencil::situations);
  }
  for (auto& ratios : ratios_) ratios.fill(1.0F);
}

/// Components are coded one by one, as each one's residual is a feature of the next.
template <class Coder, unsigned Bits>
void MixedValueCoder<Coder, Bits>::code(Coder& coder, const PointStencil& stencil, uint32_t slot,
                                        std::byte* tuple) {
  const unsigned count = array_.components;
  if (values_.size() < (size_t{slot} + 1) * count) values_.resize(rows_for(slot) * count);
  if (array_.follows && known_before_.size() < values_.size()) known_before_.resize(values_.size());
  before_ = {};
  for (component_ = 0; component_ < count; ++component_) {
    code_number(coder, stencil, slot, tuple + component_ * number_size_);
    values_[size_t{slot} * count + component_] = value_;
    if (array_.follows)
      known_before_[size_t{slot} * count + component_] = last_before_[component_] = in_step_before_;
    before_ = {value_, before_[0]};
    places_[component_] = value_.place;
  }
  std::copy_n(values_.begin() + static_cast<ptrdiff_t>(size_t{slot} * count), count, last_.begin());
}

/// One number: what is expected, whether it is an exception, then its code by decisions, then what is learnt.
template <class Coder, unsigned Bits>
void MixedValueCoder<Coder, Bits>::code_number(Coder& coder, const PointStencil& stencil, uint32_t slot,
                                               std::byte* number) {
  expect(stencil);
  if (code_exception(coder, stencil, slot, number)) {
    // All else 0, and nothing is learnt: the number may be anything.
    value_ = {};
    value_.place = mean_[best];
    value_.code = static_cast<Code>(centre_);
    return;
  }
  if constexpr (encoding) target_ = static_cast<Code>(space().code_of(number));
  find_repeats(stencil);
  const Wide code = find_code(coder);
  learn(code);
  learn_repeats(code);
  if constexpr (!encoding) space().store_number(static_cast<int64_t>(code), number);
}

/// The three sums of a stencil. Full: the polynomial through the seven others, the mean of parallelograms,
/// that of neighbours. Else those of the stencil, the last one again where there are fewer; without any the
/// last number.
template <class Coder, unsigned Bits>
template <class PlaceOf>
void MixedValueCoder<Coder, Bits>::find_sums(const PointStencil& stencil, PlaceOf place_of, double last,
                                             Sums& sums) const {
  sums.fill(last);
  if (stencil.is_full()) {
    std::array<double, 7> p;
    for (unsigned k = 0; k < 7; ++k) p[k] = place_of(stencil.others[k]);
    // Neighbours, then those across faces, then the one across the cell (PointStencil::others). Brackets are
    // part of the format.
    const double near = (p[0] + p[1]) + p[2];
    const double across = (p[3] + p[4]) + p[5];
    sums = {near - across + p[6], near * (2 / 3.0) - across * (1 / 3.0), near * (1 / 3.0)};
    return;
  }
  for (unsigned i = 0; i < stencil.sums; ++i) {
    const PointSum& sum = stencil.sum[i];
    double place = 0;
    for (unsigned k = 0; k < sum.count; ++k) place += sum.weight[k] * place_of(sum.slot[k]);
    sums[i] = place;
  }
  for (unsigned i = stencil.sums; i > 0 && i < 3; ++i) sums[i] = sums[stencil.sums - 1];
}

/// What may tell by how much the first sum is off: by what it was off around here, and how far the sums lie
/// apart. Places of features are part of the format; those not set are 0.
template <class Coder, unsigned Bits>
void MixedValueCoder<Coder, Bits>::add_features(const PointStencil& stencil, const Sums& sums) {
  const Value& last = last_[component_];
  if (component_ > 0) features_[7] = before_[0].residual;
  if (stencil.plane != nullptr) {
    features_[12] = to_float(stencil.plane[component_] - origin_);
    for (unsigned k = 0; k < stencil.near_count; ++k) features_[13 + k] = at(stencil.near[k]).bend;
  }
  if (stencil.is_full()) {
    for (unsigned k = 0; k < 7; ++k) features_[k] = twist_at(stencil.others[k]);
    for (unsigned k = 0; k < 3; ++k) features_[8] += at(stencil.others[k]).residual;
    features_[9] = to_float(sums[1] - sums[0]);
    features_[10] = to_float(sums[2] - sums[0]);
    features_[11] = last.residual;
    return;
  }
  if (stencil.sums == 0) return;
  features_[0] = to_float(sums[1] - sums[0]);
  features_[1] = to_float(sums[2] - sums[0]);
  features_[5] = last.residual;
  constexpr std::array<unsigned, 3> twist_place = {6, 8, 11};
  for (unsigned k = 0; k < stencil.near_count; ++k) {
    const uint32_t near = stencil.near[k];
    features_[2 + k] = at(near).residual;
    features_[twist_place[k]] = twist_at(near);
    if (k > 0) features_[8 + k] = to_float(place_at(near) - place_at(stencil.near[0]));
  }
}

/// Sums of what has changed since the step before; and features of that step. If nothing changes but by a
/// smooth field, the number before plus the change of the sum is exact.
template <class Coder, unsigned Bits>
void MixedValueCoder<Coder, Bits>::find_changes(const PointStencil& stencil, const Sums& sums,
                                                Sums& changes) {
  Before& here = in_step_before_;
  here.place = stencil.before[component_];
  Sums then;
  const Before& last = last_before_[component_];
  find_sums(
      stencil, [&](uint32_t slot) { return before_at(slot).place; }, last.place, then);
  for (unsigned i = 0; i < 3; ++i) changes[i] = sums[i] - then[i];
  here.twist = to_float(here.place - then[0]);
  candidate_[as_before] = here.place;
  candidate_[changed] = here.place + changes[0];
  candidate_[changed + 1] = here.place + changes[2];
  features_[16] = here.twist;
  features_[17] = to_float(then[1] - then[0]);
  features_[18] = to_float(then[2] - then[0]);
  features_[19] = to_float(changes[0]);
  features_[27] = to_float(last_[component_].place - last.place - changes[0]);
  if (stencil.is_full()) {
    for (unsigned k = 0; k < 7; ++k) features_[20 + k] = before_at(stencil.others[k]).twist;
  } else {
    for (unsigned k = 0; k < stencil.near_count; ++k) features_[20 + k] = before_at(stencil.near[k]).twist;
  }
}

template <class Coder, unsigned Bits>
double MixedValueCoder<Coder, Bits>::place_at(uint32_t slot) const {
  return array_.follows ? at(slot).place - before_at(slot).place : at(slot).place;
}

template <class Coder, unsigned Bits>
float MixedValueCoder<Coder, Bits>::twist_at(uint32_t slot) const {
  return array_.follows ? at(slot).twist - before_at(slot).twist : at(slot).twist;
}

template <class Coder, unsigned Bits>
double MixedValueCoder<Coder, Bits>::predict() const {
  return array_.follows ? following_fits_[fit_].predict(features_) : fits_[fit_].predict(first_features());
}

/// By the weights, unless that is ten deviations from all else: a fit whose samples were of another kind must
/// not lead away.
template <class Coder, unsigned Bits>
double MixedValueCoder<Coder, Bits>::fitted_place() const {
  const double place = origin_ + predict();
  const auto is_near = [&](double other) {
    const double off = place - other;
    return off * off < 100 * deviation_ * deviation_;
  };
  if (is_near(origin_)) return place;
  if (array_.follows && (is_near(candidate_[as_before]) || is_near(candidate_[0]))) return place;
  return origin_;
}

template <class Coder, unsigned Bits>
const double* MixedValueCoder<Coder, Bits>::places_before(const std::byte* tuple) {
  for (unsigned c = 0; c < array_.components; ++c)
    places_before_[c] = bounded(spaces_[c].place_of(spaces_[c].code_of(tuple + c * number_size_)));
  return places_before_.data();
}

/// All that is known of a number before its first decision. `miss` has three candidates more for arrays that
/// follow a step.
template <class Coder, unsigned Bits>
void MixedValueCoder<Coder, Bits>::expect(const PointStencil& stencil) {
  situation_ = &situations_[component_][stencil.situation];
  fit_ = stencil.is_full() ? uint8_t{PointStencil::full} : stencil.situation;
  Sums sums;
  find_sums(
      stencil, [&](uint32_t slot) { return at(slot).place; }, last_[component_].place, sums);
  std::copy(sums.begin(), sums.end(), candidate_.begin());
  features_.fill(0);
  origin_ = sums[0];
  if (array_.follows) {
    Sums changes;
    find_changes(stencil, sums, changes);
    origin_ = candidate_[changed];
    add_features(stencil, changes);
  } else {
    add_features(stencil, sums);
  }
  find_sizes(stencil);
  // The first component has none before it to go by; the others are alike.
  row_ = stencil.situation * 2u + (component_ > 0 ? 1 : 0);
  const bool planed = stencil.plane != nullptr;
  candidate_[fitted] = fitted_place();
  candidate_[on_plane] = planed ? stencil.plane[component_] : candidate_[fitted];
  const auto& miss = situation_->miss;
  const auto end = array_.follows ? miss.end() : miss.begin() + as_before;
  // The first of equals, so that both sides take the same.
  const auto least = std::min_element(miss.begin(), end) - miss.begin();
  mean_ = {sums[0], planed ? candidate_[on_plane] : sums[1], candidate_[static_cast<size_t>(least)],
           candidate_[fitted]};
  if (array_.follows) {
    // Two experts are as the step before, where that has missed less.
    const unsigned usual = planed ? on_plane : 1;
    if (miss[changed] < miss[0]) mean_[0] = candidate_[changed];
    if (miss[changed + 1] < miss[usual]) mean_[1] = candidate_[changed + 1];
  }
  centre_ = code_near(mean_[best]);
  base_ = place(centre_);
  // The map's own step here, so that scales are never below what the codes can tell apart.
  step_ = std::fabs((centre_ < highest ? place(centre_ + 1) : place(centre_ - 1)) - base_);
  if (!(step_ > 1e-28)) step_ = 1e-28;
  set_scales();
}

/// How far off numbers were near here: the root of the mean square, which large misses rule, and the mean of
/// logarithms, which they do not. The best expert goes by the second.
template <class Coder, unsigned Bits>
void MixedValueCoder<Coder, Bits>::find_sizes(const PointStencil& stencil) {
  double squares = 0;
  int sum = 0;
  const auto add = [&](const Value& near) {
    squares += static_cast<double>(near.error) * static_cast<double>(near.error);
    sum += near.size;
  };
  for (unsigned k = 0; k < stencil.near_count; ++k) add(at(stencil.near[k]));
  if (stencil.near_count == 0) add(last_[component_]);
  // The situation's own mean counts as one more neighbour, so that it rules where little is known around.
  const unsigned count = stencil.near_count == 0 ? 1 : stencil.near_count;
  deviation_ = std::sqrt((squares + situation_->square) / (count + 1));
  size_ = static_cast<double>(sum) / count;
}

/// The scale of each expert's logistic: what is expected times what the ratio of the two has been in this
/// bin. 0.55 is about sqrt(3) / pi, which gives a logistic the standard deviation 1. At least a tenth of a
/// step, so that a certain expert does not become a step function.
template <class Coder, unsigned Bits>
void MixedValueCoder<Coder, Bits>::set_scales() {
  deviation_ = deviation_ > 0.3 * step_ ? deviation_ : 0.3 * step_;
  size_bin_ = bin(static_cast<int>(std::floor(size_)) - half_octave(step_), -3, scale_bins);
  size_ = from_half_octaves(size_);
  size_ = size_ > 0.3 * step_ ? size_ : 0.3 * step_;
  deviation_bin_ = bin(half_octave(deviation_ / step_), -3, scale_bins);
  for (unsigned j = 0; j < experts; ++j) {
    const unsigned row = j == best ? size_bin_ : deviation_bin_;
    const auto ratio = static_cast<double>(ratios_[j][row]);
    double scale = 0.55 * (j == best ? size_ : deviation_) * ratio;
    scale = scale > 0.1 * step_ ? scale : 0.1 * step_;
    if (j == best) scale_ = scale;
    inverse_scale_[j] = static_cast<float>(4096 / scale);
    relative_mean_[j] = to_float(mean_[j] - base_);
  }
  const unsigned row = size_bin_ * 2 + (mean_[0] > mean_[best] ? 1 : 0);
  const unsigned other = deviation_bin_ * 2 + (mean_[fitted] > mean_[best] ? 1 : 0);
  const auto cells = [](std::vector<WideCell>& of_bin) {
    if (of_bin.empty()) of_bin.resize(nodes);
    return of_bin.data();
  };
  few_base_ = {cells(few_[0][row]), cells(few_[1][other])};
  low_ = SignedLanes{};
  // Distribution functions at the ends of the whole range: 0 and 2^30 stand for 0 and 1.
  high_ = SignedLanes{} + (1 << 30);
}

/// Codes that may come again as they are. Where they do not, they are looked for at each sixteenth number
/// only, as hashing and comparing them takes time.
template <class Coder, unsigned Bits>
void MixedValueCoder<Coder, Bits>::find_repeats(const PointStencil& stencil) {
  repeats_.begin_number();
  follower_.fill(nullptr);
  if (repeat_score_ <= 0 && ++numbers_ % 16 != 0) return;
  const auto code_of = [&](unsigned k) { return static_cast<uint32_t>(at(stencil.near[k]).code); };
  const auto last = static_cast<uint32_t>(last_[component_].code);
  // Follow[0]: the code that came after this neighbour's; Follow[1]: after these components.
  const uint32_t near = stencil.near_count > 0 ? code_of(0) : last;
  const auto seed = [&](uint32_t kind) { return hashed(kind, component_ + 0x1234567u); };
  const std::array<uint32_t, followers> hash = {
      hashed(seed(1), near),
      hashed(hashed(seed(2), component_ > 0 ? static_cast<uint32_t>(before_[0].code) : last),
             component_ > 1 ? static_cast<uint32_t>(before_[1].code) : near)};
  if (followers_.empty()) followers_.resize(size_t{followers} << follower_bits);
  for (unsigned i = 0; i < followers; ++i)
    follower_[i] = &followers_[(size_t{i} << follower_bits) + (hash[i] >> (32 - follower_bits))];
  add_repeat(0, *follower_[0]);
  for (unsigned k = 0; k < stencil.near_count; ++k) add_repeat(1 + k, at(stencil.near[k]).code);
  add_repeat(4, centre_);
  add_repeat(5, *follower_[1]);
  add_repeat(6, last_[component_].code);
  if (array_.follows) add_repeat(7, code_near(in_step_before_.place));
}

/// Kinds are inputs of the mixer; the bin says how far the code is from the best guess.
template <class Coder, unsigned Bits>
void MixedValueCoder<Coder, Bits>::add_repeat(unsigned kind, Wide code) {
  if (code < lowest || code > highest) return;
  const double far = std::fabs(place(code) - mean_[best]) / deviation_;
  repeats_.add(kind, code, bin(half_octave(far), -3, 8));
}

/// First the side of the centre, then the number of bits of the distance, from the expected one on, then the
/// bits below. low is the code when the interval has shrunk to it; every decision shrinks it or is skipped,
/// so that the loops end after some 2 * Bits decisions.
template <class Coder, unsigned Bits>
auto MixedValueCoder<Coder, Bits>::find_code(Coder& coder) -> Wide {
  Wide low = lowest, high = highest;
  const bool up = ask(coder, centre_, low, high, 0, 1);
  const unsigned side = up ? 1 : 0;
  const Wide origin = up ? centre_ - 1 : centre_;
  const unsigned start = expected_length(up);
  const auto beyond = [&](unsigned k, unsigned type) {
    const Wide distance = Wide{2} << k;
    const Wide at_least = up ? origin + distance : origin - distance + 1;
    return ask(coder, at_least, low, high, type, 2 + side * 16 + (k < 15 ? k : 15)) == up;
  };
  unsigned length = start;
  WideCell& exact = exact_[deviation_bin_ * 8 + exact_hits_];
  if (up && exact.probability > often_exact && !beyond(0, 14)) {
    length = 0;
  } else if (beyond(length, 1)) {
    for (++length; length < Bits && beyond(length, std::min(1 + length - start, 3u)); ++length) {
    }
  } else {
    while (length > 0 && !beyond(length - 1, std::min(4 + start - length, 6u))) --length;
  }
  code_mantissa(coder, length, side, low, high);
  exact.update(low == centre_);
  exact_hits_ = (exact_hits_ << 1 | (low == centre_ ? 1 : 0)) & 7;
  return low;
}

/// Bits of the distance that the best expert expects on this side, one scale further than its mean.
template <class Coder, unsigned Bits>
unsigned MixedValueCoder<Coder, Bits>::expected_length(bool up) const {
  const double off = mean_[best] - base_;
  const double distance = std::max((up ? off : -off) + scale_, scale_ * 0.5);
  const int halves = half_octave(distance / step_ + 1);
  return std::min(static_cast<unsigned>(halves < 0 ? 0 : halves) / 2, Bits - 1);
}

/// The interval has a power of two of codes, unless the end of the range cuts it off. The first bits depend
/// on what came before; from the third on a flat interval is left to raw bits.
template <class Coder, unsigned Bits>
void MixedValueCoder<Coder, Bits>::code_mantissa(Coder& coder, unsigned length, unsigned side, Wide& low,
                                                 Wide& high) {
  unsigned prefix = 1;
  for (unsigned i = 0; low < high; ++i) {
    if (i >= 2 && is_flat(low, high)) {
      if (repeats_.code_whole(coder, target_, low)) return;
      return code_rest(coder, low, high);
    }
    const unsigned within = i == 0 ? 0 : 1 + (prefix & 1);
    const unsigned few = i < 2 ? 34 + (side * 16 + std::min(length, 15u)) * 3 + within : 0;
    const Wide half = low + ((high - low + 1) >> 1);
    const bool bit = ask(coder, half, low, high, 7 + std::min(i, 6u), few);
    prefix = prefix << 1 | static_cast<unsigned>(bit);
  }
}

/// Is the distribution flat over the interval, so that models would learn nothing? Codes must lie evenly,
/// too: those of floats near zero do not.
template <class Coder, unsigned Bits>
bool MixedValueCoder<Coder, Bits>::is_flat(Wide low, Wide high) const {
  const double from = boundary(low);
  const double width = boundary(high) - from;
  // Written so that NaN is not flat.
  if (!(width < scale_)) return false;
  const double half = boundary(low + ((high - low + 1) >> 1)) - from;
  return half > 0.3 * width && half < 0.7 * width;
}

template <class Coder, unsigned Bits>
// 16 bits at a time, as code_raw() takes. A value of all bits set stands for a rest that the power of two
// left over, hence the upper end stays.
void MixedValueCoder<Coder, Bits>::code_rest(Coder& coder, Wide& low, Wide& high) const {
  // The interval's size is a power of two unless it was cut off at the end of the range.
  while (low < high) {
    const Wide size = high - low + 1;
    unsigned bits = 0;
    while (bits < 16 && (Wide{2} << bits) <= size) ++bits;
    const Wide unit = size >> bits;
    const uint32_t most = (1u << bits) - 1;
    uint32_t value = 0;
    if constexpr (encoding) value = static_cast<uint32_t>((target_ - low) / unit);
    value = coder.code_raw(std::min(value, most), bits);
    low += unit * value;
    if (value < most) high = std::min(high, low + unit - 1);
  }
}

/// Is the code at least `at_least`? The interval from low to high shrinks to the side that is. What lies
/// outside of the interval is known and costs no decision. Each expert says the ratio of the parts of its
/// distribution above and below; parts below 2^-30 count as that, so that no logit is infinite.
template <class Coder, unsigned Bits>
bool MixedValueCoder<Coder, Bits>::ask(Coder& coder, Wide at_least, Wide& low, Wide& high, unsigned type,
                                       unsigned few) {
  if (at_least <= low) return true;
  // In floats relative to the centre: near it, where decisions matter, they are exact enough, and four lanes
  // take one instruction.
  if (at_least > high) return false;
  const float where = to_float(boundary(at_least) - base_);
  constexpr auto most = static_cast<float>(largest_deviation);
  const FloatLanes deviation =
      clamp_lanes((where - relative_mean_) * inverse_scale_, FloatLanes{} - most, FloatLanes{} + most);
  const SignedLanes far = __builtin_convertvector(deviation, SignedLanes);
  const SignedLanes between = {distribution(far[0]), distribution(far[1]), distribution(far[2]),
                               distribution(far[3])};
  const SignedLanes above = high_ - between, below = between - low_;
  const SignedLanes by_experts =
      logit_of_ratio(above > 1 ? above : SignedLanes{} + 1, below > 1 ? below : SignedLanes{} + 1);
  const std::array<WideCell*, 2> cell = {few_base_[0] + few, few_base_[1] + few};
  SignedLanes others = {77, 0, 0, 0};
  if (few != 0) others = SignedLanes{77, cell[0]->logit(), cell[1]->logit(), 0};
  typename Mixer<inputs>::Inputs logits = {};
  logits[0] = shortened(by_experts, others);
  const bool repeated = repeats_.any();
  if (repeated) {
    typename Repeats::Logits by_kind = {};
    repeats_.say(at_least, type, by_kind);
    logits[1] = shortened(by_kind[0], by_kind[1]);
  }
  const uint32_t probability = mixer_.predict(logits, deviation_bin_ * node_types + type,
                                              row_ * node_types + type, type, repeated ? inputs / 8 : 1);
  bool bit = false;
  if constexpr (encoding) bit = target_ >= at_least;
  bit = coder.code(bit, probability);
  mixer_.update(bit);
  if (few != 0) {
    cell[0]->update(bit);
    cell[1]->update(bit);
  }
  if (repeated) repeats_.learn(at_least, type, bit);
  (bit ? low : high) = bit ? at_least : at_least - 1;
  (bit ? low_ : high_) = between;
  return bit;
}

/// What the number teaches, in the order of docs/format.md, 16.12, "Learning". An error counts at least 0.22
/// steps (about the root mean square of rounding, 0.29 steps, a little less) and at most 20 deviations.
template <class Coder, unsigned Bits>
void MixedValueCoder<Coder, Bits>::learn(Wide code) {
  const double where = place(code);
  const double residual = where - mean_[best];
  const double least = 0.22 * step_, most = 20 * deviation_;
  const double error = std::min(std::max(std::fabs(residual), least), most);
  value_ = {where,
            to_float(where - candidate_[0]),
            to_float(where - candidate_[on_plane]),
            to_float(residual),
            to_float(error),
            static_cast<int16_t>(half_octave(std::fabs(residual) + 0.3 * step_)),
            static_cast<Code>(code)};
  // Rates: 1/n up to 1/50 for the square, 0.02 for misses and 0.03 for ratios. Chosen with the first version
  // (24b5167); "other learning rates" were within 0.4 % (docs/history.md).
  Situation& situation = *situation_;
  situation.visits += situation.visits < 50;
  situation.square += (error * error - situation.square) * (1.0 / situation.visits);
  for (unsigned i = 0; i < (array_.follows ? candidates : as_before); ++i) {
    const int miss = half_octave(std::fabs(where - candidate_[i]) + 0.3 * step_);
    situation.miss[i] += 0.02F * (static_cast<float>(miss) - situation.miss[i]);
  }
  for (unsigned j = 0; j < experts; ++j) {
    const double expected = j == best ? size_ : deviation_;
    const double ratio = std::min(std::fabs(where - mean_[j]) / expected, 20.0);
    float& known = ratios_[j][j == best ? size_bin_ : deviation_bin_];
    known += 0.03F * (static_cast<float>(ratio) - known);
  }
  // What was far off weighs less: errors have long tails, and the largest few would outweigh all others.
  const double missed = where - candidate_[fitted];
  const auto certainty = static_cast<float>(1 / std::sqrt(size_ * size_ + missed * missed));
  if (array_.follows) return following_fits_[fit_].learn(features_, to_float(where - origin_), certainty);
  fits_[fit_].learn(first_features(), value_.twist, certainty);
}

/// A hit raises the score by 100, a miss lowers it by 1: candidates stay as long as one number in a hundred
/// comes again.
template <class Coder, unsigned Bits>
void MixedValueCoder<Coder, Bits>::learn_repeats(Wide code) {
  if (!follower_[0]) return;
  const bool again = repeats_.end_number(code);
  repeat_score_ = std::max(-1, std::min(repeat_score_ + (again ? 100 : -1), 2000));
  *follower_[0] = *follower_[1] = static_cast<Code>(code);
}

/// Numbers that the map does not hold within the bound are written as they are.
template <class Coder, unsigned Bits>
bool MixedValueCoder<Coder, Bits>::code_exception(Coder& coder, const PointStencil& stencil, uint32_t slot,
                                                  std::byte* number) {
  if (space().exact()) return false;
  bool exception = false;
  if constexpr (encoding)
    exception = !keeps(array_, space(), number, static_cast<Code>(space().code_of(number)), largest_error_);
  const std::span near(stencil.near.data(), stencil.near_count);
  if (!exceptions_.code(coder, exception, component_, near, slot)) return false;
  uint64_t bits = 0;
  if constexpr (encoding) std::memcpy(&bits, number, number_size_);
  bits = exceptions_.code_bits(coder, bits, number_size_);
  if constexpr (!encoding) std::memcpy(number, &bits, number_size_);
  return true;
}

template class MixedValueCoder<RansEncoder, 32>;
template class MixedValueCoder<RansEncoder, 64>;
template class MixedValueCoder<RansDecoder, 32>;
template class MixedValueCoder<RansDecoder, 64>;

}  // namespace maille
