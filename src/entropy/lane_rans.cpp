#include "entropy/lane_rans.h"

#include "base/bytes.h"

namespace maille {

std::vector<std::byte> LaneRansEncoder::finish(unsigned lanes) const {
  std::array<uint64_t, symbol_lanes> states;
  states.fill(lowest_lane_state);
  std::vector<uint16_t> words;
  words.reserve(operations_.size() / 4);
  for (size_t i = operations_.size(); i-- > 0;) {
    const auto [start, frequency, lane] = operations_[i];
    uint64_t& state = states[lane];
    // As in rans.cpp, with words of 16 bits: below 2^30 * frequency the next state is below 2^40.
    if (state >= ((lowest_lane_state >> lane_table_bits) << 16) * frequency) {
      words.push_back(static_cast<uint16_t>(state));
      state >>= 16;
    }
    state = (state / frequency << lane_table_bits) + state % frequency + start;
  }
  ByteWriter out;
  for (unsigned lane = 0; lane < lanes; ++lane) {
    for (size_t byte = 0; byte < lane_state_bytes; ++byte)
      out.put(static_cast<uint8_t>(states[lane] >> (8 * byte)));
  }
  for (size_t i = words.size(); i-- > 0;) out.put(words[i]);
  return out.take();
}

}  // namespace maille
