#pragma once

#include <maille/source.h>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace maille {

/// Binary range coder with a 64-bit range, renormalised 32 bits at a time (after Martin 1979; carry
/// propagation as in LZMA's description by Pavlov). Encoder and decoder offer the same calls, so that a model
/// is written once:
///
///   bit = coder.code(bit, probability)      the encoder writes the argument and returns it,
///   value = coder.code_raw(value, count)    the decoder ignores the argument and returns what it read.
///
/// `probability` is that of a set bit, in 1/65536, 1 to 65535.
class RangeEncoder {
 public:
  static constexpr bool encoding = true;

  bool code(bool bit, uint32_t probability) {
    const uint64_t split = (range_ >> 16) * probability;
    if (bit) {
      range_ = split;
    } else {
      add(split);
      range_ -= split;
    }
    normalise();
    return bit;
  }

  /// `count` bits (0 to 32) at equal odds.
  uint32_t code_raw(uint32_t value, unsigned count) {
    range_ >>= count;
    add(range_ * value);
    normalise();
    return value;
  }

  /// False: an encoder never runs out.
  bool exhausted() const { return false; }
  /// Ends the stream and gives its bytes; up to eight trailing zeros are left out, the decoder puts them
  /// back.
  std::vector<std::byte> finish();
  size_t size() const { return bytes_.size(); }

 private:
  void add(uint64_t amount) {
    low_ += amount;
    if (low_ < amount) carry();
  }
  void normalise() {
    if (range_ < (uint64_t{1} << 32)) {
      put_word(static_cast<uint32_t>(low_ >> 32));
      low_ <<= 32;
      range_ <<= 32;
    }
  }
  void carry();
  void put_word(uint32_t word);

  uint64_t low_ = 0;
  uint64_t range_ = ~uint64_t{0};
  std::vector<std::byte> bytes_;
};

/// Reads what RangeEncoder wrote. Safe on any bytes: past their end it reads zeros, and exhausted() turns
/// true soon. Every decode loop asks exhausted() once per element, which bounds its work by the size of the
/// stream, since each decision costs at least 2^-11 bit.
class RangeDecoder {
 public:
  static constexpr bool encoding = false;

  explicit RangeDecoder(Bytes bytes) : next_(bytes.data()), end_(bytes.data() + bytes.size()) {
    code_ = uint64_t{get_word()} << 32;
    code_ |= get_word();
  }

  bool code(bool, uint32_t probability) {
    const uint64_t split = (range_ >> 16) * probability;
    const bool bit = code_ < split;
    // Both outcomes as masks: the bits of a residual are unpredictable, and a mispredicted branch costs more.
    const uint64_t zero = bit ? 0 : split;
    range_ = bit ? split : range_ - split;
    code_ -= zero;
    normalise();
    return bit;
  }

  uint32_t code_raw(uint32_t, unsigned count) {
    range_ >>= count;
    const uint64_t value = code_ / range_;
    // Only a damaged stream can exceed: the encoder's code is always below range << count.
    const uint64_t limit = (uint64_t{1} << count) - 1;
    const uint64_t kept = value < limit ? value : limit;
    code_ -= kept * range_;
    normalise();
    return static_cast<uint32_t>(kept);
  }

  /// True once more was read than was written. (The encoder leaves out up to two words of zeros at the end.)
  bool exhausted() const { return overrun_ > 2; }

 private:
  void normalise() {
    if (range_ < (uint64_t{1} << 32)) {
      code_ = (code_ << 32) | get_word();
      range_ <<= 32;
    }
  }
  uint32_t get_word() {
    if (end_ - next_ >= 4) {
      uint32_t word;
      __builtin_memcpy(&word, next_, 4);
      next_ += 4;
      return __builtin_bswap32(word);
    }
    return get_last_word();
  }
  uint32_t get_last_word();

  uint64_t code_ = 0;
  uint64_t range_ = ~uint64_t{0};
  const std::byte* next_;
  const std::byte* end_;
  uint32_t overrun_ = 0;
};

}  // namespace maille
