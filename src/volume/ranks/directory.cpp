#include "volume/ranks/directory.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "base/bytes.h"

namespace maille {

Directory Directory::make(Ranks& ranks, std::span<const uint64_t> keys_here, uint64_t keys,
                          size_t payload_bytes, const std::function<void(size_t, std::byte*)>& payload) {
  const unsigned size = ranks.size();
  // Rounded up, so that the last key has an owner.
  const uint64_t share = keys / size + 1;
  const size_t record = sizeof(uint64_t) + payload_bytes;
  // Counted first, so that no buffer grows: keys of all points go through here.
  std::vector<size_t> counts(size);
  for (const uint64_t key : keys_here) ++counts[key / share];
  Buffers to(size);
  for (unsigned r = 0; r < size; ++r) to[r].resize(counts[r] * record);
  std::vector<size_t> at(size);
  for (size_t i = 0; i < keys_here.size(); ++i) {
    const auto owner = static_cast<unsigned>(keys_here[i] / share);
    std::byte* const out = to[owner].data() + at[owner]++ * record;
    store(out, keys_here[i]);
    if (payload_bytes > 0) payload(i, out + sizeof(uint64_t));
  }
  Directory all;
  all.rank_ = ranks.rank();
  all.arrived_ = ranks.exchange(std::move(to));
  for (unsigned r = 0; r < size; ++r) {
    for (size_t i = 0; i < all.arrived_[r].size(); i += record) {
      const std::byte* const from = all.arrived_[r].data() + i;
      all.entries_.push_back({load<uint64_t>(from), r, from + sizeof(uint64_t)});
    }
  }
  // By key, then by sender, then by place: a total order, which does not depend on how messages came.
  std::sort(all.entries_.begin(), all.entries_.end(), [](const Entry& a, const Entry& b) {
    return std::tie(a.key, a.from, a.payload) < std::tie(b.key, b.from, b.payload);
  });
  for (size_t i = 0; i < all.entries_.size(); ++i) {
    if (i == 0 || all.entries_[i].key != all.entries_[i - 1].key) all.places_.push_back(i);
  }
  const uint64_t distinct = all.places_.size();
  all.places_.push_back(all.entries_.size());
  // Numbers of a rank follow those of the ranks before, as its keys do.
  all.firsts_ = sums_before(ranks, distinct);
  // Answers stand where the questions stood, so that no key is sent back.
  // Answers stand where the questions stood.
  Buffers answers(size);
  for (unsigned r = 0; r < size; ++r) answers[r].resize(all.arrived_[r].size() / record * sizeof(uint32_t));
  for (size_t i = 0; i < distinct; ++i) {
    for (const Entry& entry : all.of(i)) {
      const auto question =
          static_cast<size_t>(entry.payload - sizeof(uint64_t) - all.arrived_[entry.from].data()) / record;
      store(answers[entry.from].data() + question * sizeof(uint32_t), static_cast<uint32_t>(all.first() + i));
    }
  }
  const Buffers answered = ranks.exchange(std::move(answers));
  std::fill(at.begin(), at.end(), 0);
  for (const uint64_t key : keys_here) {
    const auto owner = static_cast<unsigned>(key / share);
    all.numbers_.push_back(load<uint32_t>(answered[owner].data() + at[owner]++ * sizeof(uint32_t)));
  }
  return all;
}

// The last rank whose first number is not above; ranks without numbers are passed over, as their first is
// that of the next one.
unsigned Directory::owner(uint64_t number) const {
  return static_cast<unsigned>(std::upper_bound(firsts_.begin(), firsts_.end(), number) - firsts_.begin()) -
         1;
}

namespace {

/// A number that all keys of all ranks are below. Error where there is none. All ranks find the same.
Result<uint64_t> bound_of(Ranks& ranks, std::span<const uint64_t> keys) {
  std::vector<uint64_t> most = {keys.empty() ? 0 : *std::max_element(keys.begin(), keys.end())};
  ranks.largest(most);
  if (most[0] == ~uint64_t{0})
    return failure(ErrorCode::malformed_input, "a point has the number 2^64 - 1, which stands for none");
  return most[0] + 1;
}

}  // namespace

Result<PointDirectory> PointDirectory::make(const RankPart& part, Ranks& ranks) {
  std::vector<bool> used(part.mesh->point_count());
  for (const CellBlock& block : part.mesh->blocks) {
    for (const uint32_t point : block.connectivity) used[point] = true;
  }
  const Tuples tuples(*part.mesh, Domain::point);
  // Ranks without points may have other arrays, or none: agree_on_layout() lets them pass.
  // Ranks without points may have other arrays.
  std::vector<uint64_t> bytes = {part.mesh->point_count() > 0 ? tuples.size() : 0};
  ranks.largest(bytes);
  const uint64_t keys = MAILLE_TRY(bound_of(ranks, part.point_ids));
  PointDirectory points;
  points.directory_ =
      Directory::make(ranks, part.point_ids, keys, 1 + bytes[0], [&](size_t i, std::byte* out) {
        out[0] = used[i] ? std::byte{1} : std::byte{0};
        tuples.read(i, out + 1);
      });
  Result<> same;
  for (size_t i = 0; i < points.directory_.count() && same; ++i) {
    const auto all = points.directory_.of(i);
    for (const Directory::Entry& entry : all) {
      if (std::equal(entry.payload + 1, entry.payload + 1 + bytes[0], points.tuple(i))) continue;
      same = failure(ErrorCode::malformed_input,
                     "point " + std::to_string(entry.key) + " has other numbers in rank " +
                         std::to_string(entry.from) + " than in rank " + std::to_string(all[0].from) +
                         "; give both the same position and values, or different numbers of points");
    }
  }
  // Every rank finds the errors of its own stretch; the message names the ranks already.
  MAILLE_CHECK(agree(ranks, same, false));
  if (points.directory_.total() > max_points)
    return failure(ErrorCode::unsupported, "a file in pieces has no room for 2^32 points");
  return points;
}

// Some rank's cells are enough.
bool PointDirectory::is_used(size_t i) const {
  const auto all = directory_.of(i);
  return std::any_of(all.begin(), all.end(),
                     [](const Directory::Entry& entry) { return entry.payload[0] != std::byte{0}; });
}

Result<Directory> number_cells(const RankPart& part, const PartLayout& layout, Ranks& ranks) {
  std::vector<uint64_t> keys;
  for (size_t b = 0; b < part.mesh->blocks.size(); ++b) {
    const uint64_t cells = part.mesh->blocks[b].size();
    if (cells == 0) continue;
    const PartLayout::Block& block = layout.blocks[layout.block_of[b]];
    for (uint64_t i = 0; i < cells; ++i)
      keys.push_back(block.first_key + part.cell_ids[keys.size()] - block.first_id);
  }
  Directory cells = Directory::make(ranks, keys, layout.keys, 0, {});
  Result<> once;
  for (size_t i = 0; i < cells.count() && once; ++i) {
    const auto all = cells.of(i);
    if (all.size() == 1) continue;
    const auto block = std::find_if(layout.blocks.rbegin(), layout.blocks.rend(),
                                    [&](const auto& found) { return found.first_key <= all[0].key; });
    once = failure(ErrorCode::malformed_input,
                   "cell " + std::to_string(all[0].key - block->first_key + block->first_id) + " is there " +
                       std::to_string(all.size()) + " times, in ranks " + std::to_string(all[0].from) +
                       " and " + std::to_string(all[1].from) + "; leave ghost cells out");
  }
  MAILLE_CHECK(agree(ranks, once, false));
  if (cells.total() > max_points)
    return failure(ErrorCode::unsupported, "a file in pieces has no room for 2^32 cells");
  return cells;
}

}  // namespace maille
