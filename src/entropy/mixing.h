#pragma once

#include <maille/source.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/lanes.h"

namespace maille {

// Context mixing (after Mahoney's PAQ, 2002 to 2009): each binary decision is predicted by many models, whose
// predictions are added as logits, with weights that are learnt while coding. Everything here is integer
// arithmetic. Probabilities are in 1/65536, logits ln(p / (1 - p)) in 1/256 from -2047 to 2047.

inline constexpr int32_t largest_logit = 2047;
/// What is left to the improbable side of any decision; so the probable side costs at least 2^-11 bit:
/// -log2(1 - 24/65536) is 2^-10.9. A lower one would save a little in long runs of sure decisions, and loosen
/// the bound that a decoder's work has.
inline constexpr uint32_t least_probability = 24;

extern const std::array<uint16_t, 4096> logistic_table;  ///< probability of each logit, from -2048
extern const std::array<int16_t, 4096> logit_table;      ///< logit of each sixteenth probability

constexpr int32_t clamp_logit(int32_t logit) {
  return logit < -largest_logit ? -largest_logit : logit > largest_logit ? largest_logit : logit;
}
[[gnu::always_inline]] inline uint32_t probability_of(int32_t logit) {
  return logistic_table[static_cast<size_t>(clamp_logit(logit) + 2048)];
}
[[gnu::always_inline]] inline int32_t logit_of(uint32_t probability) {
  return logit_table[probability >> 4];
}

/// The distribution function of the logistic distribution, in 1/2^30, for arguments in 1/4096 from -81920 to
/// 81920.
inline constexpr int32_t largest_deviation = 20 * 4096;
extern const std::array<uint32_t, 2 * 20 * 64 + 2> distribution_table;
[[gnu::always_inline]] inline int32_t distribution(int32_t deviation) {
  const auto place = static_cast<uint32_t>(deviation + largest_deviation);
  const uint32_t low = distribution_table[place >> 6];
  return static_cast<int32_t>(low + ((distribution_table[(place >> 6) + 1] - low) * (place & 63) >> 6));
}

/// ln(above / below) as a logit, of numbers from 1 to 2^30, to 1/10 of its unit: the quotient's exponent, and
/// of its fraction y the polynomial y + y (1 - y) q(y), which is log2(1 + y). 177.44568 is 256 ln 2. Floats,
/// but each operation is rounded once, in this order, so all machines agree.
[[gnu::always_inline]] inline SignedLanes logit_of_ratio(SignedLanes above, SignedLanes below) {
  const FloatLanes ratio =
      __builtin_convertvector(above, FloatLanes) / __builtin_convertvector(below, FloatLanes);
  SignedLanes bits;
  static_assert(sizeof bits == sizeof ratio);
  __builtin_memcpy(&bits, &ratio, sizeof bits);
  const SignedLanes exponent = (bits >> 23) - 127;
  const FloatLanes y = __builtin_convertvector(bits & 0x7fffff, FloatLanes) * (1.0F / 8388608.0F);
  const FloatLanes q = 0.44078080F + y * (-0.24266946F + y * 0.08161574F);
  const FloatLanes logarithm = __builtin_convertvector(exponent, FloatLanes) + y + y * (1.0F - y) * q;
  const SignedLanes logit = __builtin_convertvector(logarithm * 177.44568F, SignedLanes);
  return clamp_lanes(logit, SignedLanes{} - largest_logit, SignedLanes{} + largest_logit);
}

/// A range coder for decisions, 64 bits wide, that writes words of 32 bits (after Martin 1979). It offers the
/// same calls as RansEncoder, so that all models work with it too; lanes are ignored.
class RangeEncoder {
 public:
  static constexpr bool encoding = true;

  bool code(bool bit, uint32_t probability, unsigned = 0) {
    const uint64_t bound = (range_ >> 16) * probability;
    if (bit) {
      range_ = bound;
    } else {
      move(bound);
      range_ -= bound;
    }
    if (range_ >> 32 == 0) flush_word();
    return bit;
  }
  uint32_t code_raw(uint32_t value, unsigned count, unsigned = 0) {
    put(value, 1, count, 0);
    return value;
  }
  void put(uint32_t start, uint32_t frequency, unsigned bits, unsigned) {
    const uint64_t unit = range_ >> bits;
    move(unit * start);
    range_ = unit * frequency;
    if (range_ >> 32 == 0) flush_word();
  }
  bool exhausted() const { return false; }
  /// Bytes so far.
  size_t size() const { return bytes_.size(); }
  /// Ends the stream and gives its bytes.
  std::vector<std::byte> finish();

 private:
  void move(uint64_t by) {
    low_ += by;
    if (low_ < by) carry();
  }
  void carry();
  void flush_word();

  uint64_t low_ = 0;
  uint64_t range_ = ~uint64_t{0};
  std::vector<std::byte> bytes_;
};

/// Reads what RangeEncoder wrote. Safe on any bytes: past their end it reads zeros, and exhausted() is true
/// as soon as it has read more of them than the one word that the encoder leaves away. Each decision with a
/// Mixer costs at least 2^-11 bit, so a loop that asks for each element is bounded by the bytes. The range is
/// at least 2^32 between operations and at least 1 within them, so one word refills it and peek() never
/// divides by zero, whatever the bytes are.
class RangeDecoder {
 public:
  static constexpr bool encoding = false;

  explicit RangeDecoder(Bytes bytes) : next_(bytes.data()), end_(bytes.data() + bytes.size()) {
    value_ = get_word();
    value_ = value_ << 32 | get_word();
  }

  [[gnu::always_inline]] bool code(bool, uint32_t probability, unsigned = 0) {
    const uint64_t bound = (range_ >> 16) * probability;
    const bool bit = value_ < bound;
    value_ -= bit ? 0 : bound;
    range_ = bit ? bound : range_ - bound;
    if (range_ >> 32 == 0) refill();
    return bit;
  }
  uint32_t code_raw(uint32_t, unsigned count, unsigned = 0) {
    const uint32_t value = peek(count, 0);
    advance(value, 1, count, 0);
    return value;
  }
  uint32_t peek(unsigned bits, unsigned) {
    const uint64_t slot = value_ / (range_ >> bits);
    const uint64_t most =
        (uint64_t{1} << bits) - 1;  // what is left over above the last slot is never written
    return static_cast<uint32_t>(slot < most ? slot : most);
  }
  void advance(uint32_t start, uint32_t frequency, unsigned bits, unsigned) {
    const uint64_t unit = range_ >> bits;
    value_ -= unit * start;
    range_ = unit * frequency;
    if (range_ >> 32 == 0) refill();
  }
  bool exhausted() const { return missing_ > 4; }

 private:
  void refill() {
    range_ <<= 32;
    value_ = value_ << 32 | get_word();
  }
  uint32_t get_word() {
    if (end_ - next_ < 4) return get_last_word();
    uint32_t word;
    __builtin_memcpy(&word, next_, 4);
    next_ += 4;
    return __builtin_bswap32(word);
  }
  uint32_t get_last_word();

  uint64_t value_ = 0;
  uint64_t range_ = ~uint64_t{0};
  const std::byte* next_;
  const std::byte* end_;
  uint32_t missing_ = 0;
};

/// 65536 / (n + 1.5), and 256 n / (n + 1.5), for cells that have been met n times. The second is how much of
/// a cell's logit counts: nothing before the first visit, nearly all after many.
inline constexpr auto cell_rates = [] {
  std::array<int32_t, 256> table{};
  for (int n = 0; n < 256; ++n) table[static_cast<size_t>(n)] = 131072 / (2 * n + 3);
  return table;
}();
inline constexpr auto cell_confidences = [] {
  std::array<int32_t, 256> table{};
  for (int n = 0; n < 256; ++n) table[static_cast<size_t>(n)] = 512 * n / (2 * n + 3);
  return table;
}();

/// An adaptive probability of 16 bits and how often it was met: for contexts of which there are few.
struct WideCell {
  static constexpr unsigned limit = 250;
  uint16_t probability = 32768;
  uint8_t visits = 0;

  [[gnu::always_inline]] int32_t logit() const {
    return logit_of(probability) * cell_confidences[visits] >> 8;
  }
  [[gnu::always_inline]] void update(bool bit) {
    const int32_t error = (bit ? 65535 : 0) - probability;
    probability = static_cast<uint16_t>(probability + (error * cell_rates[visits] >> 16));
    visits = static_cast<uint8_t>(visits + (visits < limit));
  }
};

/// The same in 16 bits: 12 of probability, 4 of visits. For hashed contexts. Adding 7 before the low bits are
/// cut off rounds nearly to nearest, so that small steps are not all lost.
struct NarrowCell {
  uint16_t bits = 0x8000;

  unsigned visits() const { return bits & 15; }
  [[gnu::always_inline]] int32_t logit() const {
    return logit_table[bits >> 4] * cell_confidences[visits()] >> 8;
  }
  [[gnu::always_inline]] void update(bool bit) {
    const auto probability = static_cast<int32_t>(bits & 0xfff0);
    const int32_t target = bit ? 65535 : 0;
    const int32_t moved = probability + ((target - probability) * cell_rates[visits()] >> 16);
    const unsigned count = visits() + (visits() < 15);
    bits = static_cast<uint16_t>((static_cast<uint32_t>(moved + 7) & 0xfff0) | count);
  }
};

/// Seven decisions of one hashed context (a tree of three bits) and 16 bits that tell contexts apart: 16
/// bytes that never cross a cache line, so that a context costs one access to memory and not one for each
/// decision.
struct alignas(16) CellBucket {
  uint16_t check = 0;
  std::array<NarrowCell, 7> cells;
};

/// Buckets by hash. A bucket that another context wants is lost to it; of two, the less used one. The check
/// is another mix of the hash, of 16 bits, so a stranger is taken for the context in one of 65,536 cases;
/// both sides err alike.
class BucketTable {
 public:
  explicit BucketTable(unsigned size_bits) : shift_(32 - size_bits), buckets_(size_t{1} << size_bits) {}

  void prefetch(uint32_t hash) const { __builtin_prefetch(&buckets_[hash >> shift_]); }
  [[gnu::always_inline]] CellBucket& find(uint32_t hash) {
    const auto check = static_cast<uint16_t>(hash * 0x2545f491u >> 16);
    CellBucket& first = buckets_[hash >> shift_];
    if (first.check == check) return first;
    CellBucket& second = buckets_[(hash >> shift_) ^ 1];
    if (second.check == check) return second;
    CellBucket& loser = first.cells[0].visits() <= second.cells[0].visits() ? first : second;
    loser = {};
    loser.check = check;
    return loser;
  }

 private:
  unsigned shift_;
  std::vector<CellBucket> buckets_;
};

/// Mixes a hash further with a value.
inline uint32_t hashed(uint32_t hash, uint32_t value) {
  hash = (hash ^ value) * 0x9e3779b1u;
  return hash ^ hash >> 15;
}

}  // namespace maille
