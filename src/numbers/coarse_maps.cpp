#include "numbers/coarse_maps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "base/bytes.h"
#include "entropy/bit_model.h"
#include "mesh/none.h"
#include "numbers/number_maps.h"
#include "numbers/scaled_digits.h"

namespace maille {
namespace {

using Kind = NumberMap::Kind;

constexpr int64_t bit = 1024;  // as logarithm() counts
// Numbers that maps are looked for with, and compared with. Chosen, not swept: time grows with both. Of 384
// numbers a sixteenth, 24, is far from the 6 (+- 2.4) that are near a multiple by chance.
constexpr size_t most_tried = 384;
constexpr size_t most_compared = 4096;
// What a refined number must save, beside what is written of its details. Chosen, not swept: for each number
// a decoder has to look up one code more and decode some decisions.
constexpr int64_t least_saving = bit / 2;
// Numbers that were computed in a few operations are so many roundings off.
constexpr double roundings = 8;
// Predictions are seldom better than the range of numbers over 2^this. Coarser steps would only look cheap,
// because the rest of each residual would move into the details, which are not predicted.
constexpr int least_levels = 15;

double rounding_of(double number) {
  return std::fabs(number) * std::ldexp(1.0, -52);
}

/// Picks at most `most` numbers, evenly spread over all of them.
std::vector<double> every(const std::vector<double>& numbers, size_t most) {
  std::vector<double> few;
  const size_t stride = numbers.size() / most + 1;
  for (size_t i = 0; i < numbers.size(); i += stride) few.push_back(numbers[i]);
  return few;
}

/// Counts the bits that a coarse map saves: those of the codes that it spares, less what the details take.
/// Details are priced as DetailModel codes them: the class (how many trailing zeros, how long the rest is) by
/// the entropy of all classes, the sign and the bits between the first and the last as they are. Residuals of
/// codes get shorter by the step of a coarse code, counted in exact codes.
class Saving {
 public:
  Saving(const std::vector<double>& numbers, const NumberMap& exact) : numbers_(numbers), exact_(exact) {
    for (const double number : numbers)
      codes_.push_back(exact.code_of(Scalar::f64, reinterpret_cast<const std::byte*>(&number)));
  }

  int64_t of(const NumberMap& coarse) const {
    // Curved maps pay the same price as among lossless maps (lossless_map.cpp).
    int64_t saved = coarse.is_curved() && !exact_.is_curved() ? -bit / 8 * count() : 0;
    std::map<unsigned, int64_t> classes;
    for (size_t i = 0; i < numbers_.size(); ++i) {
      const int64_t code = coarse.code_of(Scalar::f64, reinterpret_cast<const std::byte*>(&numbers_[i]));
      const uint64_t base = exact_code(coarse, code);
      const uint64_t step = exact_code(coarse, code + 1) - base;
      // Here the coarse map is finer than the exact one, or codes have wrapped around.
      if (step == 0 || step >> 63 != 0) return INT64_MIN;
      const auto detail = static_cast<int64_t>(static_cast<uint64_t>(codes_[i]) - base);
      const auto size = static_cast<uint64_t>(detail < 0 ? -detail : detail);
      const unsigned zeros = size == 0 ? 0 : static_cast<unsigned>(__builtin_ctzll(size));
      const unsigned length = bit_length(size >> zeros);
      ++classes[size == 0 ? 0 : 1 + zeros * 64 + length];
      // The sign, and what is between the first bit and the last.
      const int64_t raw = size == 0 ? 0 : 1 + (length > 2 ? length - 2 : 0);
      saved += logarithm(step) - raw * bit;
    }
    for (const auto& [which, times] : classes) saved -= times * (logarithm_of_count() - log(times));
    return saved;
  }
  int64_t count() const { return static_cast<int64_t>(numbers_.size()); }

 private:
  uint64_t exact_code(const NumberMap& coarse, int64_t code) const {
    return static_cast<uint64_t>(exact_.nearest_code(Scalar::f64, coarse.value_of(Scalar::f64, code)));
  }
  static int64_t log(int64_t times) { return logarithm(static_cast<uint64_t>(times)); }
  int64_t logarithm_of_count() const { return log(count()); }

  const std::vector<double>& numbers_;
  const NumberMap& exact_;
  std::vector<int64_t> codes_;
};

/// Steps that many of the numbers are multiples of, with rounding: fractions of decimals, such as averages of
/// three or seven numbers that were read from text. Steps are 10^-places / (odd * 2^halves).
class DecimalFractions {
 public:
  DecimalFractions(const std::vector<double>& numbers, double range) : numbers_(numbers), range_(range) {
    for (const double number : numbers_) largest_ = std::max(largest_, std::fabs(number));
  }

  /// Those that look best, and decimals that all numbers are near, as floats are that were decimals once.
  std::vector<double> find() {
    // Powers of three come from repeated thirds, as in subdivision. The list is chosen, not swept: each
    // further number adds 154 steps to try.
    for (const uint32_t odd : {1u, 3u, 7u, 9u, 11u, 13u, 21u, 27u, 81u, 127u}) {
      for (unsigned places = 0; places <= 13; ++places) {
        // Ten is even, so that tenths have all halves of decimals after a while.
        for (unsigned halves = 0; halves <= 10; ++halves) {
          consider(1 / (exact_powers_of_ten[places] * odd * std::ldexp(1.0, static_cast<int>(halves))));
        }
      }
    }
    // By chance one number in 16 is within a 32nd of a step of a multiple; seven of eight must be.
    for (int places = 13; places >= 0; --places) {
      const double step = 1 / exact_powers_of_ten[places];
      if (!is_sensible(step) || count(step, 0, numbers_.size(), step / 32) * 8 < numbers_.size() * 7)
        continue;
      best_.push_back(step);
      break;
    }
    return best_;
  }

 private:
  bool is_sensible(double step) const { return step <= std::ldexp(range_, -least_levels); }
  void consider(double step) {
    // A number lies within 8 roundings of a multiple by chance in one of 64 cases if the step has 1,024
    // roundings. The share that is asked for below, a sixteenth, is therefore no accident.
    const double least = rounding_of(largest_) * 1024;
    if (!(step >= least) || !is_sensible(step)) return;
    // Most steps fail at the first few numbers, so all 1,540 of them are cheap to try.
    const size_t first = std::min<size_t>(numbers_.size(), 48);
    size_t hits = count(step, 0, first, 0);
    if (hits * 16 < first) return;
    hits += count(step, first, numbers_.size(), 0);
    int exponent;
    (void)std::frexp(step / least, &exponent);
    // The hits are spared so many bits; of steps whose bits are as many, the largest.
    const double score = static_cast<double>(hits) * (exponent + step / least * std::ldexp(1.0, -exponent));
    if (score > score_) {
      best_.insert(best_.begin(), step);
      if (best_.size() > 2) best_.pop_back();
      score_ = score;
    }
  }
  /// `tolerance`: of all numbers, beside that of rounding.
  size_t count(double step, size_t first, size_t last, double tolerance) const {
    size_t hits = 0;
    for (size_t i = first; i < last; ++i) {
      const double multiple = std::floor(numbers_[i] / step + 0.5);
      const double allowed = std::max(tolerance, roundings * rounding_of(numbers_[i]));
      hits += std::fabs(numbers_[i] - multiple * step) <= allowed && (multiple != 0 || numbers_[i] == 0);
    }
    return hits;
  }

  const std::vector<double>& numbers_;
  std::vector<double> best_;
  double range_;
  double largest_ = 0;
  double score_ = 0;
};

/// A factor such that numbers are floats times it, with rounding. Two such numbers are to each other as two
/// integers of 24 bits, which the convergents of their quotient give: a fraction p / q that is nearer to the
/// quotient than 1 / (2 q^2) is one of them (Legendre).
class FloatFactor {
 public:
  explicit FloatFactor(const std::vector<double>& numbers) : numbers_(numbers) { std::erase(numbers_, 0.0); }

  std::optional<double> find() const {
    constexpr size_t pairs = 48;
    double best = 0;
    size_t most = numbers_.size() * 7 / 8;
    for (size_t i = 0; i + 1 < numbers_.size() && i < 2 * pairs; i += 2) {
      const double a = mantissa_of(numbers_[i]);
      const double integer = numerator(a, mantissa_of(numbers_[i + 1]));
      if (integer == 0) continue;
      const double factor = mantissa_of(a / integer);
      // Three quarters of the first 32 numbers must fit, and in the end seven eighths of all. A pair of
      // numbers may give a factor by chance, but then the others do not follow it.
      if (hits(factor, std::min<size_t>(numbers_.size(), 32)) < 24) continue;
      const size_t found = hits(factor, numbers_.size());
      if (found <= most) continue;
      most = found;
      best = factor;
    }
    if (best == 0) return {};
    return best;
  }

 private:
  static double mantissa_of(double number) {
    int exponent;
    return std::frexp(std::fabs(number), &exponent);
  }
  /// The integer of a, for a / b a quotient of two integers below 2^25 (times a power of two); else 0.
  /// Denominators grow at least as Fibonacci's numbers, the 38th of which is above 2^25, so 40 rounds are
  /// enough.
  static double numerator(double a, double b) {
    constexpr double most = 33554432;
    const double quotient = a / b;
    double p0 = 0, p1 = 1, q0 = 1, q1 = 0;
    double rest = quotient;
    for (int i = 0; i < 40; ++i) {
      const double whole = std::floor(rest);
      const double p2 = whole * p1 + p0;
      const double q2 = whole * q1 + q0;
      if (!(p2 < most && q2 < most)) return 0;
      p0 = p1, p1 = p2, q0 = q1, q1 = q2;
      if (std::fabs(p1 / q1 - quotient) <= quotient * std::ldexp(1.0, -50)) return p1;
      rest = 1 / (rest - whole);
    }
    return 0;
  }
  /// Counts how many of the first numbers are a float times the factor, within 8 roundings; by chance one in
  /// 2^24 is.
  size_t hits(double factor, size_t most) const {
    size_t hits = 0;
    for (size_t i = 0; i < most; ++i) {
      const double integer = std::ldexp(mantissa_of(numbers_[i] / factor), 24);
      hits += std::fabs(integer - std::floor(integer + 0.5)) <= std::ldexp(roundings, 24 - 52);
    }
    return hits;
  }

  std::vector<double> numbers_;
};

/// Floats times a factor.
NumberMap floats_times(double factor, const std::vector<double>& numbers) {
  // Finer than the floats of the smallest number are none.
  int32_t least = ScaledDigits::most_exponent(2);
  for (const double number : numbers) {
    int exponent;
    (void)std::frexp(number / factor, &exponent);
    if (number != 0) least = std::min(least, exponent - 24);
  }
  NumberMap map{.kind = Kind::binary_digits, .exponent = std::max(least, -149)};
  map.digits = 24;
  map.factor = factor;
  return map;
}

/// The same, of fewer floats: of those that the numbers are nearest to, if they are decimals. For bunny times
/// 0.001 in doubles 108,535 bytes of positions instead of 534,320 (9f6e31f, -9, with all that it brought).
std::optional<NumberMap> decimals_times(double factor, const std::vector<double>& numbers) {
  Array floats = make_array("", Domain::point, Scalar::f32, 1);
  floats.resize(numbers.size());
  for (size_t i = 0; i < numbers.size(); ++i)
    floats.values<float>()[i] = static_cast<float>(numbers[i] / factor);
  NumberMap map = choose_lossless_map(floats, 0);
  if (map.kind != Kind::decimal && map.kind != Kind::decimal_digits) return {};
  map.factor = factor;
  return map;
}

/// Finds the best map of those considered: each is measured by what it saves on a sample, and the first one
/// that saves most is taken, so the result depends on nothing but the numbers.
class Search {
 public:
  Search(const std::vector<double>& all, const NumberMap& exact)
      : all_(all),
        numbers_(every(all, most_compared)),
        few_(every(all, most_tried)),
        range_(range_of(all)),
        saving_(numbers_, exact) {
    most_ = least_saving * saving_.count();
  }

  std::optional<CoarseMap> run() {
    for (const double step : DecimalFractions(few_, range_).find()) {
      NumberMap lattice{.kind = Kind::lattice};
      lattice.step = step;
      consider(lattice);
    }
    consider(floats_times(1, all_));
    consider_decimals(1);
    if (const auto factor = FloatFactor(few_).find()) consider_floats(nearest_factor(*factor));
    consider_halves();
    if (!best_) return {};
    // The saving was counted on the sample.
    const double share = static_cast<double>(all_.size()) / static_cast<double>(numbers_.size());
    return CoarseMap{*best_, static_cast<int64_t>(static_cast<double>(most_) * share)};
  }

 private:
  static double range_of(const std::vector<double>& numbers) {
    const auto [low, high] = std::minmax_element(numbers.begin(), numbers.end());
    return *high - *low;
  }
  /// Of the factors within three roundings, the one that saves most. The factor came from a rounded quotient,
  /// and if it is off by one rounding, many details are not 0.
  double nearest_factor(double factor) const {
    double near = factor;
    for (int i = 0; i < 3; ++i) near = std::nextafter(near, 0.0);
    double best = factor;
    int64_t most = INT64_MIN;
    for (int i = -3; i <= 3; ++i) {
      const int64_t saved = saving_.of(floats_times(near, numbers_));
      if (saved > most) most = saved, best = near;
      near = std::nextafter(near, 2.0);
    }
    return best;
  }
  void consider_floats(double factor) {
    const NumberMap floats = floats_times(factor, all_);
    const int64_t before = most_;
    consider(floats);
    if (most_ == before) return;
    // Integers are floats, too.
    NumberMap lattice{.kind = Kind::lattice};
    lattice.step = std::ldexp(factor, lowest_bit(floats));
    if (lattice.step > range_ * std::ldexp(1.0, -40)) consider(lattice);
    // FloatFactor finds the factor up to a power of two, so others are tried for 2^14 in both directions.
    // Chosen, not swept: decimals_times() refuses most of them at once, on the sample.
    constexpr int most_doublings = 14;
    for (int i = -most_doublings; i <= most_doublings; ++i) consider_decimals(std::ldexp(factor, i));
  }
  void consider_decimals(double factor) {
    if (!decimals_times(factor, few_)) return;
    if (const auto decimals = decimals_times(factor, all_)) consider(*decimals);
  }
  /// Powers of two that many numbers are multiples of.
  void consider_halves() {
    int highest;
    (void)std::frexp(range_, &highest);
    // Below 2^-48 of the range, a double in it has at most five bits left for details.
    for (int32_t exponent = highest - 48; exponent <= highest - least_levels; ++exponent) {
      if (exponent > -1000) consider({.kind = Kind::binary, .exponent = exponent});
    }
  }
  /// 2^this divides the floats nearest to all numbers.
  int lowest_bit(const NumberMap& floats) const {
    int lowest = 127;
    for (const double number : numbers_) {
      const auto nearest = static_cast<float>(number / floats.factor);
      if (nearest == 0) continue;
      int exponent;
      const auto mantissa = static_cast<uint32_t>(std::ldexp(std::frexp(std::fabs(nearest), &exponent), 24));
      lowest = std::min(lowest, exponent - 24 + __builtin_ctz(mantissa));
    }
    return lowest;
  }
  void consider(const NumberMap& map) {
    const int64_t saved = saving_.of(map);
    if (saved <= most_) return;
    most_ = saved;
    best_ = map;
  }

  const std::vector<double>& all_;
  std::vector<double> numbers_;
  std::vector<double> few_;
  double range_;
  Saving saving_;
  int64_t most_ = 0;
  std::optional<NumberMap> best_;
};

}  // namespace

std::optional<CoarseMap> find_coarse_map(const Array& array, uint32_t component, const NumberMap& exact,
                                         std::span<const uint32_t> source) {
  std::vector<double> numbers;
  const auto all = array.values<double>();
  double largest = 0;
  for (const uint32_t tuple : source) {
    if (tuple == none) continue;
    numbers.push_back(all[size_t{tuple} * array.components + component]);
    if (!std::isfinite(numbers.back())) return {};
    largest = std::max(largest, std::fabs(numbers.back()));
  }
  // Beyond, steps and quotients could leave the range of doubles.
  constexpr double most = 1e30;
  if (numbers.size() < 64 || !(largest < most && largest > 1 / most)) return {};
  return Search(numbers, exact).run();
}

}  // namespace maille
