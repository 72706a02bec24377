#include "entropy/static_rans.h"

#include "base/bytes.h"

namespace maille {

std::vector<std::byte> StaticRansEncoder::finish() {
  uint64_t state = lowest_static_state;
  std::vector<uint32_t> words;
  for (size_t i = operations_.size(); i-- > 0;) {
    const auto [start, frequency, bits] = operations_[i];
    // As in rans.cpp: from frequency * 2^(63 - bits) on the next state would not be below 2^63.
    if (state >> (63 - bits) >= frequency) {
      words.push_back(static_cast<uint32_t>(state));
      state >>= 32;
    }
    state = (state / frequency << bits) + state % frequency + start;
  }
  ByteWriter out;
  out.put(state);
  for (size_t i = words.size(); i-- > 0;) out.put(words[i]);
  return out.take();
}

StaticRansDecoder::StaticRansDecoder(Bytes bytes) : words{bytes.data(), bytes.data() + bytes.size()} {
  if (bytes.size() < 8) {
    exhausted_ = true;
    state = lowest_static_state;
    return;
  }
  state = load<uint64_t>(words.next);
  words.next += 8;
}

}  // namespace maille
