#include <maille/http.h>

#include <algorithm>
#include <mutex>

#include "base/result.h"
#include "io/http/block_cache.h"
#include "io/http/ranges.h"

namespace maille {
namespace {

constexpr uint64_t block_bytes = BlockCache::block_bytes;
/// A long range is fetched as several, over several connections. A shorter one would be here before another
/// connection is open, and servers count requests. Chosen, not swept (b9d6c24).
constexpr uint64_t piece_bytes = uint64_t{2} << 20;
/// Where a file is read on in order, more and more is fetched ahead, doubling from 64 KiB up to 4 MiB.
/// Chosen, not swept: a whole file is then asked for 4 MiB at a time, and who stops early has fetched about
/// twice what was read.
constexpr uint64_t least_ahead = uint64_t{64} << 10, most_ahead = uint64_t{4} << 20;
/// Who looks at the very end of a file wants what is before it next: a footer, then the index it points to.
/// Chosen, not swept; as much as the first request brings of the front.
constexpr uint64_t tail_bytes = uint64_t{64} << 10, small_read = 4096;

/// Blocks one after the other: first ... end - 1.
struct Run {
  uint64_t first, end;
};

/// A file on a web server as a Source: ranges that are wanted are widened to blocks, looked up in the cache,
/// joined where little is between them, and fetched at once. What goes wrong on the way is HttpRanges' part.
/// Reading is const for callers and may come from several threads; one lock serialises them, as all share the
/// cache.
class RangeSource final : public HttpSource {
 public:
  RangeSource(const std::string& url, const HttpOptions& options)
      : name_(shown_url(url)),
        // Below 1 MiB the cache could not hold what one request with its gaps brings.
        budget_(std::max(options.cache_bytes, uint64_t{1} << 20)),
        gap_(std::min(options.gap_bytes, budget_ / 16)),
        ranges_(url, options),
        cache_(budget_),
        allowed_(options.most_bytes) {}

  Result<> open() {
    std::vector<std::byte> front;
    MAILLE_CHECK(ranges_.open(front));
    keep(0, front);
    next_ = front.size();
    return {};
  }

  uint64_t size() const override { return ranges_.size(); }
  std::string name() const override { return name_; }
  Result<> read_at(uint64_t offset, std::span<std::byte> out) const override {
    const Part part{offset, out};
    return read_many({&part, 1});
  }
  Result<> read_many(std::span<const Part> parts) const override;
  bool forget(uint64_t offset, uint64_t size) const override;
  HttpStatistics statistics() const override {
    const std::lock_guard lock(mutex_);
    return ranges_.statistics();
  }
  void allow(uint64_t bytes) const override {
    const std::lock_guard lock(mutex_);
    allowed_ += std::min(bytes, std::numeric_limits<uint64_t>::max() - allowed_);
  }

 private:
  std::vector<Part> sorted_slices(std::span<const Part> parts) const;
  std::vector<Run> missing_runs(std::span<const Part> slices) const;
  void look_ahead(const Part& part, std::vector<Run>& runs) const;
  Result<> fetch(const std::vector<Run>& runs) const;
  Result<> read_slices(std::span<const Part> slices, bool alone) const;
  // Keeps bytes that begin at a block's begin and end at a block's end or the file's.
  void keep(uint64_t offset, Bytes bytes) const;
  uint64_t end_block() const { return (size() + block_bytes - 1) / block_bytes; }

  std::string name_;
  uint64_t budget_, gap_;
  mutable std::mutex mutex_;
  mutable HttpRanges ranges_;
  mutable BlockCache cache_;
  mutable uint64_t allowed_;
  mutable uint64_t next_ = 0;   ///< where what was fetched last ends
  mutable uint64_t ahead_ = 0;  ///< bytes that were fetched ahead
};

/// The parts in the order of the file, cut so that none is larger than half of what read_many() reads at
/// once.
std::vector<Source::Part> RangeSource::sorted_slices(std::span<const Part> parts) const {
  std::vector<Part> slices;
  const auto most = static_cast<size_t>(budget_ / 4);
  for (Part part : parts) {
    while (!part.out.empty()) {
      const size_t size = std::min(part.out.size(), most);
      slices.push_back({part.offset, part.out.first(size)});
      part = {part.offset + size, part.out.subspan(size)};
    }
  }
  std::stable_sort(slices.begin(), slices.end(),
                   [](const Part& a, const Part& b) { return a.offset < b.offset; });
  return slices;
}

/// Runs of blocks that are not in the cache; those with little between them as one, since a request costs
/// more than the bytes of the gap. Looking blocks up also marks them as used, so that fetching the rest does
/// not push them out.
std::vector<Run> RangeSource::missing_runs(std::span<const Part> slices) const {
  std::vector<Run> runs;
  const uint64_t gap = gap_ / block_bytes;
  uint64_t next = 0;  // the first block not looked at
  for (const Part& slice : slices) {
    const uint64_t end = (slice.offset + slice.out.size() - 1) / block_bytes + 1;
    for (uint64_t block = std::max(slice.offset / block_bytes, next); block < end; ++block) {
      if (!cache_.find(block).empty()) continue;
      if (!runs.empty() && block - runs.back().end <= gap) {
        runs.back().end = block + 1;
      } else {
        runs.push_back({block, block + 1});
      }
    }
    next = std::max(next, end);
  }
  return runs;
}

/// Widens the last run by what will be wanted next. Only for a single read: who asks for many parts knows
/// what it needs.
void RangeSource::look_ahead(const Part& part, std::vector<Run>& runs) const {
  Run& last = runs.back();
  const uint64_t begin = last.first * block_bytes;
  if (part.out.size() <= small_read && part.offset + part.out.size() == size()) {
    const uint64_t tail = (size() - std::min(size(), tail_bytes)) / block_bytes;
    last.first = std::min(last.first, tail);
    return;
  }
  // A block's tolerance before, as reads end inside blocks, and a gap's behind, as readers skip a little.
  const bool in_order = begin >= next_ - std::min(next_, block_bytes) && begin <= next_ + gap_;
  const uint64_t most = std::min(most_ahead, budget_ / 4);
  ahead_ = in_order ? std::min(std::max(least_ahead, 2 * ahead_), most) : 0;
  last.end = std::min(last.end + ahead_ / block_bytes, end_block());
}

void RangeSource::keep(uint64_t offset, Bytes bytes) const {
  while (!bytes.empty()) {
    const Bytes block = bytes.first(std::min<size_t>(bytes.size(), block_bytes));
    cache_.put(offset / block_bytes, block);
    offset += block.size();
    bytes = bytes.subspan(block.size());
  }
}

Result<> RangeSource::fetch(const std::vector<Run>& runs) const {
  uint64_t total = 0;
  for (const Run& run : runs) total += std::min(run.end * block_bytes, size()) - run.first * block_bytes;
  // What a whole session may fetch is bounded by the caller; the comparison subtracts, so it cannot overflow.
  const uint64_t fetched = ranges_.statistics().bytes;
  if (fetched > allowed_ || total > allowed_ - fetched) {
    return failure(ErrorCode::network, name_ + ": more than " + std::to_string(allowed_ >> 20) +
                                           " MiB of it would be fetched; download it, and open that");
  }
  std::vector<std::byte> bytes(static_cast<size_t>(total));
  std::vector<HttpPiece> pieces;
  size_t used = 0;
  for (const Run& run : runs) {
    const uint64_t end = std::min(run.end * block_bytes, size());
    for (uint64_t begin = run.first * block_bytes; begin < end; begin += piece_bytes) {
      const auto size = static_cast<size_t>(std::min(piece_bytes, end - begin));
      pieces.push_back({begin, std::span(bytes).subspan(used, size)});
      used += size;
    }
    next_ = end;
  }
  MAILLE_CHECK(ranges_.fetch(pieces));
  for (const HttpPiece& piece : pieces) keep(piece.offset, piece.out);
  return {};
}

/// Reads slices that together take at most half of what is kept, so that nothing goes before it is copied.
Result<> RangeSource::read_slices(std::span<const Part> slices, bool alone) const {
  std::vector<Run> runs = missing_runs(slices);
  if (!runs.empty()) {
    if (alone) look_ahead(slices.back(), runs);
    MAILLE_CHECK(fetch(runs));
  }
  for (const Part& slice : slices) {
    for (size_t done = 0; done < slice.out.size();) {
      const uint64_t at = slice.offset + done;
      const auto skip = static_cast<size_t>(at % block_bytes);
      const Bytes block = cache_.find(at / block_bytes);
      // Cannot happen while the bound above holds; a loop without progress would be worse than the error.
      if (block.size() <= skip) return failure(ErrorCode::network, name_ + ": a block is missing");
      const Bytes part = block.subspan(skip, std::min(block.size() - skip, slice.out.size() - done));
      std::copy(part.begin(), part.end(), slice.out.begin() + static_cast<ptrdiff_t>(done));
      done += part.size();
    }
  }
  return {};
}

Result<> RangeSource::read_many(std::span<const Part> parts) const {
  for (const Part& part : parts) {
    if (part.offset <= size() && part.out.size() <= size() - part.offset) continue;
    return failure(ErrorCode::cannot_read, name_ + ": bytes " + std::to_string(part.offset) + ".." +
                                               std::to_string(part.offset + part.out.size()) +
                                               " were asked for, but it ends at byte " +
                                               std::to_string(size()));
  }
  const std::lock_guard lock(mutex_);
  // A server without ranges has sent all of it once, into a temporary file.
  if (ScratchFile* const whole = ranges_.whole()) {
    for (const Part& part : parts) MAILLE_CHECK(whole->read_at(part.offset, part.out));
    return {};
  }
  const std::vector<Part> slices = sorted_slices(parts);
  for (size_t begin = 0, end = 0; begin < slices.size(); begin = end) {
    // What each slice may add to what is fetched: itself, the rest of its first and last block, and a gap.
    const auto cost = [&](const Part& slice) { return slice.out.size() + 2 * block_bytes + gap_; };
    uint64_t bytes = cost(slices[begin]);
    for (end = begin + 1; end < slices.size() && bytes + cost(slices[end]) <= budget_ / 2; ++end)
      bytes += cost(slices[end]);
    MAILLE_CHECK(read_slices(std::span(slices).subspan(begin, end - begin), slices.size() == 1));
  }
  return {};
}

// The checksum of what was read was wrong: it is fetched again, and from the server itself instead of a cache
// on the way.
bool RangeSource::forget(uint64_t offset, uint64_t size) const {
  const std::lock_guard lock(mutex_);
  if (ranges_.whole() != nullptr || size == 0) return false;
  cache_.drop(offset / block_bytes, (offset + size - 1) / block_bytes + 1);
  ranges_.distrust_caches();
  return true;
}

}  // namespace

Result<std::unique_ptr<HttpSource>> http_source(const std::string& url, const HttpOptions& options) {
  if (!is_url(url))
    return failure(ErrorCode::usage, url + ": is no address that begins with http:// or https://");
  auto source = std::make_unique<RangeSource>(url, options);
  MAILLE_CHECK(source->open());
  return source;
}

}  // namespace maille
