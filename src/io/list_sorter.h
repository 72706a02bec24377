#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <queue>
#include <span>
#include <string>
#include <vector>

#include "base/bytes.h"
#include "base/result.h"
#include "base/scratch_file.h"

namespace maille {

/// What a ListSorter compares first; where that is equal, the other decides.
enum class SortBy { numbers, list };

/// Puts lists of points, each with `N` numbers, in order, out of core: runs that fit into memory are sorted,
/// and merged when they are read. All that fits stays in memory: there is no temporary file then. The order
/// is total (equal items are equal in all they hold), so the result depends neither on the memory nor on the
/// order of add(). The reader and the writer of polyMesh sort their faces with it.
template <size_t N, SortBy first_by = SortBy::numbers>
class ListSorter {
 public:
  using Numbers = std::array<uint64_t, N>;
  struct Item {
    Numbers numbers{};
    std::vector<uint32_t> list;
  };

  /// `memory`: bytes, about, for items that are added; merging takes half as much, or 4 KiB for each run if
  /// that is more. `folder`: as ScratchFile has it.
  ListSorter(uint64_t memory, std::string folder) : memory_(memory), folder_(std::move(folder)) {}

  Result<> add(const Numbers& numbers, std::span<const uint32_t> list) {
    entries_.push_back({numbers, lists_.size(), static_cast<uint32_t>(list.size())});
    lists_.insert(lists_.end(), list.begin(), list.end());
    // Vectors grow to twice of what they hold.
    const uint64_t bytes = 2 * (entries_.size() * sizeof(Entry) + lists_.size() * sizeof(uint32_t));
    return bytes < memory_ ? Result<>() : write_run();
  }
  /// Call this behind the last add(). front() is the first item afterwards.
  Result<> sort() {
    if (file_) {
      MAILLE_CHECK(write_run());
      entries_ = {};
      lists_ = {};
    } else {
      sort_entries();
    }
    return rewind();
  }
  /// Begins again at the first one.
  Result<> rewind() {
    next_ = 0;
    if (!file_) return load();
    waiting_ = {};
    // Half of the memory in windows, one for each run. Below 4 KiB reads from disk cost more than they bring,
    // above 64 KiB nothing more is gained; both chosen, not swept.
    const uint64_t each = memory_ / 2 / std::max<size_t>(runs_.size(), 1);
    window_bytes_ = static_cast<size_t>(std::clamp<uint64_t>(each, 4096, 1 << 16));
    for (size_t run = 0; run < runs_.size(); ++run) {
      runs_[run] = {runs_[run].begin, runs_[run].end, runs_[run].begin, {}, 0, {}};
      MAILLE_CHECK(advance(run));
    }
    return {};
  }
  /// The next one in order; nullptr behind the last. Valid until take().
  const Item* front() const {
    if (!file_) return next_ == entries_.size() ? nullptr : &loaded_;
    return waiting_.empty() ? nullptr : &runs_[waiting_.front()].item;
  }
  Result<> take() {
    if (!file_) {
      ++next_;
      return load();
    }
    std::pop_heap(waiting_.begin(), waiting_.end(), later());
    const size_t run = waiting_.back();
    waiting_.pop_back();
    return advance(run);
  }

 private:
  struct Entry {
    Numbers numbers;
    uint64_t begin;
    uint32_t size;
  };
  struct Run {
    uint64_t begin, end;
    uint64_t at;  ///< of what was not read yet
    std::vector<std::byte> window;
    size_t place = 0;
    Item item;
  };

  static bool is_before(const Numbers& a, std::span<const uint32_t> list_a, const Numbers& b,
                        std::span<const uint32_t> list_b) {
    if constexpr (first_by == SortBy::numbers) {
      if (a != b) return a < b;
    }
    const size_t common = std::min(list_a.size(), list_b.size());
    for (size_t i = 0; i < common; ++i) {
      if (list_a[i] != list_b[i]) return list_a[i] < list_b[i];
    }
    return list_a.size() != list_b.size() ? list_a.size() < list_b.size() : a < b;
  }
  std::span<const uint32_t> list_of(const Entry& entry) const {
    return std::span(lists_).subspan(entry.begin, entry.size);
  }
  void sort_entries() {
    std::sort(entries_.begin(), entries_.end(), [&](const Entry& a, const Entry& b) {
      return is_before(a.numbers, list_of(a), b.numbers, list_of(b));
    });
  }
  /// The least one is on top of the heap.
  auto later() const {
    return [this](size_t a, size_t b) {
      return is_before(runs_[b].item.numbers, runs_[b].item.list, runs_[a].item.numbers, runs_[a].item.list);
    };
  }
  Result<> load() {
    if (next_ == entries_.size()) return {};
    const auto list = list_of(entries_[next_]);
    loaded_.numbers = entries_[next_].numbers;
    loaded_.list.assign(list.begin(), list.end());
    return {};
  }

  // Differences modulo 2^64, so any two numbers fold and unfold exactly.
  static uint64_t folded(uint64_t value, uint64_t last) {
    const auto difference = static_cast<int64_t>(value - last);
    return (static_cast<uint64_t>(difference) << 1) ^ static_cast<uint64_t>(difference >> 63);
  }
  static uint64_t unfolded(uint64_t code, uint64_t last) { return last + ((code >> 1) ^ (0 - (code & 1))); }
  /// Writes an item as the difference to the one before it in its run: eight to twelve bytes for a quad.
  static void put(ByteWriter& out, const Item& item, const Item& last) {
    for (size_t i = 0; i < N; ++i) out.put_count(folded(item.numbers[i], last.numbers[i]));
    out.put_count(item.list.size());
    uint64_t previous = last.list.empty() ? 0 : last.list[0];
    for (const uint32_t value : item.list) {
      out.put_count(folded(value, previous));
      previous = value;
    }
  }
  static void get(ByteReader& in, Item& item) {
    for (uint64_t& number : item.numbers) number = unfolded(in.get_count(), number);
    const uint64_t size = in.get_count();
    uint64_t previous = item.list.empty() ? 0 : item.list[0];
    item.list.clear();
    for (uint64_t i = 0; i < size && in.ok(); ++i) {
      previous = unfolded(in.get_count(), previous);
      item.list.push_back(static_cast<uint32_t>(previous));
    }
  }

  Result<> write_run() {
    if (!file_) file_ = MAILLE_TRY(ScratchFile::create(folder_));
    sort_entries();
    const uint64_t begin = file_->size();
    Item last, item;
    for (const Entry& entry : entries_) {
      const auto list = list_of(entry);
      item.numbers = entry.numbers;
      item.list.assign(list.begin(), list.end());
      // The length in front lets the reader fill its window with a whole record before it decodes one.
      ByteWriter record, length;
      put(record, item, last);
      length.put_count(record.size());
      MAILLE_CHECK(file_->append(length.bytes()));
      MAILLE_CHECK(file_->append(record.bytes()));
      std::swap(item, last);
    }
    if (!entries_.empty()) runs_.push_back({begin, file_->size(), begin, {}, 0, {}});
    entries_.clear();
    lists_.clear();
    return {};
  }
  /// Makes so many bytes available behind the place in the window, or all that the run still has.
  Result<> provide(Run& run, size_t bytes) {
    const size_t here = run.window.size() - run.place;
    if (here >= bytes || run.at == run.end) return {};
    run.window.erase(run.window.begin(), run.window.begin() + static_cast<ptrdiff_t>(run.place));
    run.place = 0;
    const uint64_t more = std::min<uint64_t>(std::max(window_bytes_, bytes) - here, run.end - run.at);
    run.window.resize(here + static_cast<size_t>(more));
    MAILLE_CHECK(file_->read_at(run.at, std::span(run.window).subspan(here)));
    run.at += more;
    return {};
  }
  /// The next item of a run, if there is one.
  Result<> advance(size_t number) {
    Run& run = runs_[number];
    // The longest that put_count() makes of 64 bits.
    constexpr size_t most_count_bytes = 10;
    MAILLE_CHECK(provide(run, most_count_bytes));
    // A run that is empty does not go back onto the heap; its window is freed.
    if (run.place == run.window.size()) {
      run.window = {};
      return {};
    }
    ByteReader head(Bytes(run.window).subspan(run.place));
    const auto length = static_cast<size_t>(head.get_count());
    run.place += head.position();
    MAILLE_CHECK(provide(run, length));
    ByteReader in(Bytes(run.window).subspan(run.place, length));
    get(in, run.item);
    run.place += length;
    waiting_.push_back(number);
    std::push_heap(waiting_.begin(), waiting_.end(), later());
    return {};
  }

  uint64_t memory_;
  std::string folder_;
  std::optional<ScratchFile> file_;
  std::vector<Entry> entries_;
  std::vector<uint32_t> lists_;
  size_t next_ = 0;  ///< of the entries, where all are in memory
  Item loaded_;
  std::vector<Run> runs_;
  size_t window_bytes_ = 0;
  std::vector<size_t> waiting_;  ///< heap of runs by their next item
};

}  // namespace maille
