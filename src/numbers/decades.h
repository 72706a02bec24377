#pragma once

#include <cstdint>
#include <vector>

#include "base/bytes.h"
#include "numbers/scaled_digits.h"

namespace maille {

/// The maps of ScaledDigits with base 10, for many numbers: where decades begin is looked up, by the exponent
/// of a double and by the quotient of a code, instead of found by trial. What is beyond the tables goes to
/// ScaledDigits, so that results are the same for any number and any code.
class Decades {
 public:
  Decades() = default;
  /// Empty if digits are of base 2, or of sizes that a double does not hold exactly.
  explicit Decades(const ScaledDigits& digits);

  bool empty() const { return decades_.empty(); }
  /// As those of ScaledDigits; not if empty.
  int64_t code_of(double number) const {
    const auto bits = bits_as<uint64_t>(number);
    const uint64_t binade = (bits >> 52 & 2047) - first_binade_;
    if (binade >= binades_.size()) return digits_.code_of(number);
    const double size = bits_as<double>(bits & ~(uint64_t{1} << 63));
    const Binade& in = binades_[binade];
    const Decade& decade = decades_[in.decade + (size >= in.next ? 1u : 0u)];
    const double scaled = size * decade.scale;
    const auto whole = static_cast<int64_t>(scaled);
    const int64_t mantissa = whole + (scaled - static_cast<double>(whole) < 0.5 ? 0 : 1);
    const int64_t place = decade.first + mantissa;
    // For negative ones -1 - place. What rounds to zero without being it has code 0, as in ScaledDigits.
    return place == 0 ? 0 : place ^ -static_cast<int64_t>(bits >> 63);
  }
  double number_of(int64_t code) const {
    const int64_t sign = code >> 63;
    const int64_t place = code ^ sign;
    // The first decade has a ninth more places than each other one, so the guess is this one or the next.
    const double guess = static_cast<double>(place) * per_decade_;
    if (!(guess < static_cast<double>(decades_.size()))) return digits_.number_of(code);
    auto at = static_cast<size_t>(guess);
    at -= place < decades_[at].begin ? 1u : 0u;
    const Decade& decade = decades_[at];
    const double size = static_cast<double>(place - decade.first) / decade.scale;
    return sign < 0 ? -size : size;
  }

 private:
  struct Decade {
    int64_t begin;  ///< of its places
    int64_t first;  ///< places are mantissas plus this
    double scale;   ///< mantissas are numbers times this
  };
  /// Doubles of one exponent: the decade of the least of them, and where the next one begins.
  struct Binade {
    double next;
    uint32_t decade;
  };

  void add_binades();

  ScaledDigits digits_;
  std::vector<Decade> decades_;
  std::vector<Binade> binades_;
  uint64_t first_binade_ = 0;
  double per_decade_ = 0;
};

}  // namespace maille
