#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <unordered_map>

namespace maille {

/// Numbers that were met, each once: a bit for each, in pages of 32,768. Memory is that of the pages that
/// were met, not of what a file claims; numbers far apart cost a page each, which full() limits.
class NumberSet {
 public:
  explicit NumberSet(uint64_t most_bytes) : most_pages_(most_bytes / sizeof(Page)) {}
  /// Whether it takes more than allowed; asked now and then, so it may be exceeded by what came since.
  bool full() const { return pages_.size() > most_pages_; }
  /// False: it was there already.
  bool add(uint64_t number) {
    const uint64_t place = number / (sizeof(Page) * 8);
    if (place != last_place_) {
      auto& page = pages_[place];
      if (!page) page = std::make_unique<Page>();
      last_ = page.get();
      last_place_ = place;
    }
    uint64_t& word = (*last_)[number / 64 % last_->size()];
    const uint64_t bit = uint64_t{1} << number % 64;
    const bool is_new = (word & bit) == 0;
    word |= bit;
    return is_new;
  }

 private:
  using Page = std::array<uint64_t, 512>;
  std::unordered_map<uint64_t, std::unique_ptr<Page>> pages_;  ///< only looked up
  uint64_t most_pages_;
  Page* last_ = nullptr;
  uint64_t last_place_ = ~uint64_t{0};
};

}  // namespace maille
