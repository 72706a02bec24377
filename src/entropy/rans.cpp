#include "entropy/rans.h"

#include <algorithm>

#include "base/bytes.h"

namespace maille {
namespace {

// Between operations a state is in [2^32, 2^64): one word at most is written or read for an operation.
constexpr uint64_t lowest_state = uint64_t{1} << 32;

void append(std::vector<std::byte>& bytes, const void* from, size_t size) {
  const auto* data = static_cast<const std::byte*>(from);
  bytes.insert(bytes.end(), data, data + size);
}

}  // namespace

void RansEncoder::flush() {
  std::array<uint64_t, most_lanes> states;
  states.fill(lowest_state);
  std::vector<uint32_t> words;
  for (size_t i = operations_.size(); i-- > 0;) {
    const auto [start, frequency, bits, lane] = operations_[i];
    if (bits == 0) continue;
    uint64_t& state = states[lane];
    // The decoder's state must be in [2^32, 2^64) before it takes its word, so the encoder's before it takes
    // in the operation must be below frequency * 2^(64 - bits) = ((2^32 >> bits) << 32) * frequency. Shifted
    // down, as that may be 2^64.
    if (state >> (64 - bits) >= frequency) {
      words.push_back(static_cast<uint32_t>(state));
      state >>= 32;
    }
    // Raw bits have frequency 1: no division for them.
    const uint64_t quotient = frequency == 1 ? state : state / frequency;
    state = (quotient << bits) + (state - quotient * frequency) + start;
  }
  std::reverse(words.begin(), words.end());
  append(bytes_, states.data(), lanes_ * sizeof(uint64_t));
  append(bytes_, words.data(), words.size() * sizeof(uint32_t));
  operations_.clear();
}

std::vector<std::byte> RansEncoder::finish() {
  if (!operations_.empty()) flush();
  return std::move(bytes_);
}

uint32_t RansDecoder::get_no_word() {
  exhausted_ = true;
  return 0;
}

void RansDecoder::next_block() {
  left_ = operations_per_block;
  for (unsigned lane = 0; lane < lanes_; ++lane) {
    states_[lane] = lowest_state;
    if (end_ - next_ < 8) {
      exhausted_ = true;
      continue;
    }
    states_[lane] = load<uint64_t>(next_);
    next_ += 8;
  }
}

}  // namespace maille
