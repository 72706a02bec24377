#pragma once

#include <compare>
#include <concepts>
#include <cstdint>
#include <type_traits>

namespace maille {

/// Signed, 128 bits, for machines whose compilers have none (those of 32 bits): what intervals of codes of 64
/// bits need. Overflow wraps around.
class TwoWords {
 public:
  constexpr TwoWords() = default;
  template <std::integral T>
  // NOLINTNEXTLINE(google-explicit-constructor): as the built-in type
  constexpr TwoWords(T value)
      : high_(std::is_signed_v<T> && value < 0 ? -1 : 0), low_(static_cast<uint64_t>(value)) {}
  /// Of 64 bits.
  constexpr explicit TwoWords(double value) : TwoWords(static_cast<int64_t>(value)) {}

  template <std::integral T>
  constexpr explicit operator T() const {
    return static_cast<T>(low_);
  }
  /// Rounded once where the size has 64 bits.
  constexpr explicit operator double() const {
    if (high_ < 0) return -static_cast<double>(-*this);
    return static_cast<double>(high_) * 0x1p64 + static_cast<double>(low_);
  }

  friend constexpr TwoWords operator+(TwoWords a, TwoWords b) {
    const uint64_t low = a.low_ + b.low_;
    return {a.word() + b.word() + (low < a.low_ ? 1 : 0), low};
  }
  friend constexpr TwoWords operator-(TwoWords a, TwoWords b) {
    return {a.word() - b.word() - (a.low_ < b.low_ ? 1 : 0), a.low_ - b.low_};
  }
  constexpr TwoWords operator-() const { return TwoWords() - *this; }
  friend constexpr TwoWords operator*(TwoWords a, uint32_t b) {
    const uint64_t low = (a.low_ & 0xffffffff) * b, middle = (a.low_ >> 32) * b + (low >> 32);
    return {a.word() * b + (middle >> 32), middle << 32 | (low & 0xffffffff)};
  }
  constexpr TwoWords operator<<(unsigned bits) const {
    if (bits == 0) return *this;
    if (bits >= 64) return {low_ << (bits - 64), 0};
    return {word() << bits | low_ >> (64 - bits), low_ << bits};
  }
  constexpr TwoWords operator>>(unsigned bits) const {
    if (bits == 0) return *this;
    const auto high = static_cast<uint64_t>(high_ >> (bits < 64 ? bits : 63));
    if (bits >= 64)
      return {static_cast<uint64_t>(high_ < 0 ? -1 : 0), static_cast<uint64_t>(high_ >> (bits - 64))};
    return {high, word() << (64 - bits) | low_ >> bits};
  }
  /// Both at least 0, the divisor above that; a bit of the result at a time.
  friend constexpr TwoWords operator/(TwoWords a, TwoWords b) {
    TwoWords result, rest;
    for (unsigned i = 127; i-- > 0;) {
      rest = (rest << 1) + ((a >> i).low_ & 1);
      result = result << 1;
      if (rest < b) continue;
      rest = rest - b;
      result = result + 1;
    }
    return result;
  }
  constexpr TwoWords& operator+=(TwoWords other) { return *this = *this + other; }

  friend constexpr bool operator==(const TwoWords&, const TwoWords&) = default;
  friend constexpr auto operator<=>(const TwoWords&, const TwoWords&) = default;  // the high word first

 private:
  constexpr TwoWords(uint64_t high, uint64_t low) : high_(static_cast<int64_t>(high)), low_(low) {}
  constexpr uint64_t word() const { return static_cast<uint64_t>(high_); }

  int64_t high_ = 0;
  uint64_t low_ = 0;
};

#ifdef __SIZEOF_INT128__
using WideInteger = __int128;
#else
using WideInteger = TwoWords;
#endif

}  // namespace maille
