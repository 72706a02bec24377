#include "entropy/mixing.h"

namespace maille {
namespace {

/// e^x by its series, for constants: |x| up to 20, to 1e-14 of its value.
constexpr double exponential(double x) {
  const double part = x / 64;
  double term = 1;
  double sum = 1;
  for (int i = 1; i < 14; ++i) {
    term = term * part / i;
    sum += term;
  }
  for (int i = 0; i < 6; ++i) sum *= sum;
  return sum;
}

/// ln(x) by the series of ln((1 + z) / (1 - z)), for x from 1/65536 to 65536: x is brought to between 0.75
/// and 1.5, where |z| is at most 0.2 and fifteen terms are enough for a double.
constexpr double natural_logarithm(double x) {
  double halvings = 0;
  for (; x > 1.5; x /= 2) halvings += 1;
  for (; x < 0.75; x *= 2) halvings -= 1;
  const double z = (x - 1) / (x + 1);
  double power = z;
  double sum = 0;
  for (int i = 1; i < 30; i += 2) {
    sum += power / i;
    power *= z * z;
  }
  return 2 * sum + halvings * 0.69314718055994530942;
}

constexpr int32_t rounded(double x) {
  return x < 0 ? -static_cast<int32_t>(0.5 - x) : static_cast<int32_t>(x + 0.5);
}

}  // namespace

// Tables are computed by the compiler from series with + - * / only: exp() and log() may differ in the last
// bit between libraries, and a table entry rounded the other way would be another format.
constexpr auto make_logistic_table = [] {
  std::array<uint16_t, 4096> table{};
  for (int i = 0; i < 4096; ++i) {
    const double p = 1 / (1 + exponential(-(i - 2048) / 256.0));
    table[static_cast<size_t>(i)] = static_cast<uint16_t>(rounded(p * 65536));
  }
  return table;
};
constexpr std::array<uint16_t, 4096> logistic_table = make_logistic_table();

constexpr auto make_logit_table = [] {
  std::array<int16_t, 4096> table{};
  for (int i = 0; i < 4096; ++i) {
    const double p = (i + 0.5) / 4096;
    const int32_t logit = rounded(natural_logarithm(p / (1 - p)) * 256);
    table[static_cast<size_t>(i)] = static_cast<int16_t>(clamp_logit(logit));
  }
  return table;
};
constexpr std::array<int16_t, 4096> logit_table = make_logit_table();

constexpr auto make_distribution_table = [] {
  std::array<uint32_t, 2 * 20 * 64 + 2> table{};
  for (int i = 0; i < 2 * 20 * 64 + 2; ++i) {
    const double p = 1 / (1 + exponential(-(i - 20 * 64) / 64.0));
    table[static_cast<size_t>(i)] = static_cast<uint32_t>(p * 1073741824.0 + 0.5);
  }
  return table;
};
constexpr std::array<uint32_t, 2 * 20 * 64 + 2> distribution_table = make_distribution_table();

/// The sum of all intervals' starts stays below the end of the first interval, so a carry always finds a byte
/// that takes it.
void RangeEncoder::carry() {
  for (size_t i = bytes_.size(); i-- > 0;) {
    bytes_[i] = static_cast<std::byte>(static_cast<uint8_t>(bytes_[i]) + 1);
    if (bytes_[i] != std::byte{0}) return;
  }
}

void RangeEncoder::flush_word() {
  for (int shift = 56; shift >= 32; shift -= 8)
    bytes_.push_back(static_cast<std::byte>(low_ >> shift & 0xff));
  low_ <<= 32;
  range_ <<= 32;
}

std::vector<std::byte> RangeEncoder::finish() {
  // The interval is wider than 2^32, so there is a number in it whose low word is zero and need not be
  // written.
  const uint64_t last = (low_ + 0xffffffff) & ~uint64_t{0xffffffff};
  if (last < low_) carry();
  low_ = last;
  flush_word();
  return std::move(bytes_);
}

uint32_t RangeDecoder::get_last_word() {
  uint32_t word = 0;
  for (int i = 0; i < 4; ++i) {
    const bool there = next_ < end_;
    word = word << 8 | (there ? static_cast<uint32_t>(*next_) : 0);
    next_ += there;
    missing_ += !there;
  }
  return word;
}

}  // namespace maille
