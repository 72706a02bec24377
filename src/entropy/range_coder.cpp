#include "entropy/range_coder.h"

namespace maille {

void RangeEncoder::carry() {
  // The bytes already written are below the coded number, so a byte that can take the carry always exists.
  for (size_t i = bytes_.size(); i-- > 0;) {
    const auto byte = static_cast<uint8_t>(static_cast<uint8_t>(bytes_[i]) + 1);
    bytes_[i] = static_cast<std::byte>(byte);
    if (byte != 0) return;
  }
}

void RangeEncoder::put_word(uint32_t word) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes_.push_back(static_cast<std::byte>(word >> shift));
}

std::vector<std::byte> RangeEncoder::finish() {
  // Any number in [low, low + range) will do: the one with the most trailing zeros.
  for (unsigned zeros = 63; zeros > 0; --zeros) {
    const uint64_t mask = (uint64_t{1} << zeros) - 1;
    const uint64_t up = low_ + mask;
    const uint64_t rounded = up & ~mask;
    if (rounded - low_ < range_) {
      if (up < low_) carry();
      low_ = rounded;
      break;
    }
  }
  put_word(static_cast<uint32_t>(low_ >> 32));
  put_word(static_cast<uint32_t>(low_));
  // Not more than these two words: the decoder takes more missing ones for damage.
  for (int i = 0; i < 8 && bytes_.back() == std::byte{0}; ++i) bytes_.pop_back();
  return std::move(bytes_);
}

uint32_t RangeDecoder::get_last_word() {
  if (next_ == end_) ++overrun_;
  uint32_t word = 0;
  for (int shift = 24; shift >= 0 && next_ != end_; shift -= 8) {
    word |= static_cast<uint32_t>(*next_++) << shift;
  }
  return word;
}

}  // namespace maille
