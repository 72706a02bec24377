#pragma once

#include <maille/source.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace maille {

/// Asymmetric numeral systems (Duda 2009, 2013) with a state of 64 bits and words of 32, for adaptive models.
/// Encoder and decoder offer the same calls, so that a model is written once:
///
///   bit = coder.code(bit, probability)           the encoder writes the argument and returns it,
///   value = coder.code_raw(value, count)         the decoder ignores the argument and returns what it read.
///
/// Operations may go to one of several lanes, each with a state of its own: a processor decodes lanes side by
/// side. The encoder must work backwards, so it keeps a block of operations; the stream is a sequence of
/// blocks of operations_per_block, each its states (8 bytes a lane) and then its words, in the order in which
/// the decoder wants them.
///
/// A block bounds what an encoder keeps, 8 bytes an operation, to 1 MiB. The size of blocks is part of the
/// format (docs/format.md, 10.2).
inline constexpr uint32_t operations_per_block = 1 << 17;
inline constexpr unsigned most_lanes = 3;

class RansEncoder {
 public:
  static constexpr bool encoding = true;

  explicit RansEncoder(unsigned lanes = 1) : lanes_(lanes) {}

  /// One decision; `probability` is that of a set bit, in 1/65536, 1 to 65535.
  bool code(bool bit, uint32_t probability, unsigned lane = 0) {
    put(bit ? 0 : probability, bit ? probability : 65536 - probability, 16, lane);
    return bit;
  }
  /// `count` bits (0 to 32) at equal odds.
  uint32_t code_raw(uint32_t value, unsigned count, unsigned lane = 0) {
    put(value, 1, count, lane);
    return value;
  }
  /// An interval of a cumulative distribution over 2^bits; `bits` is from 0 to 32, `frequency` from 1 to
  /// 65535. With 0 bits nothing is written, but the operation counts for the block, as it does in the
  /// decoder.
  void put(uint32_t start, uint32_t frequency, unsigned bits, unsigned lane) {
    operations_.push_back(
        {start, static_cast<uint16_t>(frequency), static_cast<uint8_t>(bits), static_cast<uint8_t>(lane)});
    if (operations_.size() == operations_per_block) flush();
  }

  /// False: an encoder never runs out.
  bool exhausted() const { return false; }
  /// About how many bytes so far: four bits for each operation that waits.
  size_t size() const { return bytes_.size() + operations_.size() / 2; }
  /// Ends the stream and gives its bytes; none when nothing was coded.
  std::vector<std::byte> finish();

 private:
  struct Operation {
    uint32_t start;
    uint16_t frequency;
    uint8_t bits;
    uint8_t lane;
  };
  void flush();

  unsigned lanes_;
  std::vector<Operation> operations_;
  std::vector<std::byte> bytes_;
};

/// Reads what RansEncoder wrote. Safe on any bytes: past their end it reads zeros, and exhausted() is true.
/// Every decode loop asks exhausted() once per element, which bounds its work by the size of the stream,
/// since each decision costs at least 2^-11 bit.
class RansDecoder {
 public:
  static constexpr bool encoding = false;

  explicit RansDecoder(Bytes bytes, unsigned lanes = 1)
      : lanes_(lanes), next_(bytes.data()), end_(bytes.data() + bytes.size()) {}

  [[gnu::always_inline]] bool code(bool, uint32_t probability, unsigned lane = 0) {
    const uint32_t slot = peek(16, lane);
    const bool bit = slot < probability;
    // No branch: the bits of a residual are unpredictable.
    advance(bit ? 0 : probability, bit ? probability : 65536 - probability, 16, lane);
    return bit;
  }
  [[gnu::always_inline]] uint32_t code_raw(uint32_t, unsigned count, unsigned lane = 0) {
    begin();
    const auto value = static_cast<uint32_t>(states_[lane] & ((uint64_t{1} << count) - 1));
    refill(lane, states_[lane] >> count);
    return value;
  }
  /// The place in a cumulative distribution over 2^bits where the next symbol lies; advance() must follow.
  [[gnu::always_inline]] uint32_t peek(unsigned bits, unsigned lane) {
    begin();
    return static_cast<uint32_t>(states_[lane] & ((uint64_t{1} << bits) - 1));
  }
  [[gnu::always_inline]] void advance(uint32_t start, uint32_t frequency, unsigned bits, unsigned lane) {
    const uint64_t state = states_[lane];
    refill(lane, frequency * (state >> bits) + (state & ((uint64_t{1} << bits) - 1)) - start);
  }

  bool exhausted() const { return exhausted_; }

 private:
  [[gnu::always_inline]] void begin() {
    if (left_ == 0) [[unlikely]]
      next_block();
    --left_;
  }
  [[gnu::always_inline]] void refill(unsigned lane, uint64_t state) {
    if (state < (uint64_t{1} << 32)) state = state << 32 | get_word();
    states_[lane] = state;
  }
  [[gnu::always_inline]] uint32_t get_word() {
    if (end_ - next_ < 4) [[unlikely]]
      return get_no_word();
    uint32_t word;
    __builtin_memcpy(&word, next_, 4);
    next_ += 4;
    return word;
  }
  // Calls of their own, so that what hardly ever happens does not take registers in hot loops.
  [[gnu::noinline]] uint32_t get_no_word();
  [[gnu::noinline]] void next_block();

  std::array<uint64_t, most_lanes> states_ = {};
  unsigned lanes_;
  const std::byte* next_;
  const std::byte* end_;
  uint32_t left_ = 0;
  bool exhausted_ = false;
};

}  // namespace maille
