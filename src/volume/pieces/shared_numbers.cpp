#include "volume/pieces/shared_numbers.h"

#include <algorithm>
#include <cmath>

namespace maille {
namespace {

bool has_box(const PieceRecord& piece) {
  return piece.low[0] <= piece.high[0];
}

}  // namespace

SharedNumbers::SharedNumbers(const std::vector<PieceRecord>& pieces) : ends_(pieces.size()) {
  // So many steps in all, whatever the boxes claim.
  constexpr size_t most_steps = size_t{1} << 24, most_side = 32;
  while (side_ < most_side && pieces.size() * (side_ + 1) * (side_ + 1) * (side_ + 1) <= most_steps) ++side_;
  std::array<double, 3> high{};
  bool any = false;
  for (const PieceRecord& piece : pieces) {
    for (unsigned k = 0; k < 3 && has_box(piece); ++k) {
      low_[k] = any ? std::min<double>(low_[k], piece.low[k]) : static_cast<double>(piece.low[k]);
      high[k] = any ? std::max<double>(high[k], piece.high[k]) : static_cast<double>(piece.high[k]);
    }
    any = any || has_box(piece);
  }
  for (unsigned k = 0; k < 3; ++k) {
    const double width = high[k] - low_[k];
    scale_[k] = width > 0 && std::isfinite(width) ? side_ / width : 0;
  }
  last_.resize(size_t{side_} * side_ * side_);
  for (uint32_t p = 0; p < pieces.size(); ++p) {
    if (!has_box(pieces[p])) continue;
    std::array<uint32_t, 3> from{}, to{};
    for (unsigned k = 0; k < 3; ++k) {
      from[k] = step_of(static_cast<double>(pieces[p].low[k]), k);
      to[k] = step_of(static_cast<double>(pieces[p].high[k]), k);
    }
    for (uint32_t z = from[2]; z <= to[2]; ++z) {
      for (uint32_t y = from[1]; y <= to[1]; ++y) {
        for (uint32_t x = from[0]; x <= to[0]; ++x) last_[(size_t{z} * side_ + y) * side_ + x] = p;
      }
    }
  }
}

uint32_t SharedNumbers::step_of(double coordinate, unsigned axis) const {
  const double step = (coordinate - low_[axis]) * scale_[axis];
  return step > 0 ? static_cast<uint32_t>(std::min<double>(step, side_ - 1)) : 0;
}

size_t SharedNumbers::cell_of(const std::array<double, 3>& at) const {
  return (size_t{step_of(at[2], 2)} * side_ + step_of(at[1], 1)) * side_ + step_of(at[0], 0);
}

size_t SharedNumbers::Hash::operator()(const Key& key) const {
  uint64_t mixed = key.copy;
  for (const uint64_t bits : key.place) mixed = (mixed ^ bits ^ mixed >> 31) * 0x9e3779b97f4a7c15;
  return static_cast<size_t>(mixed ^ mixed >> 29);
}

uint64_t SharedNumbers::find_or_add(const Place& place, uint32_t copy, const std::array<double, 3>& at,
                                    uint64_t next) {
  const auto [found, is_new] = numbers_.try_emplace(Key{place, copy}, next);
  // What has no place may be in any piece.
  const bool placed = std::isfinite(at[0]) && std::isfinite(at[1]) && std::isfinite(at[2]);
  if (is_new && placed) ends_[last_[cell_of(at)]].push_back(found->first);
  return found->second;
}

void SharedNumbers::end_piece(uint32_t piece) {
  for (const Key& key : ends_[piece]) numbers_.erase(key);
  std::vector<Key>().swap(ends_[piece]);
}

}  // namespace maille
