#include "io/face_sorter.h"

#include <algorithm>

#include "base/bytes.h"
#include "base/result.h"

namespace maille {
namespace {

uint64_t folded(uint64_t value, uint64_t last) {
  const auto difference = static_cast<int64_t>(value - last);
  return (static_cast<uint64_t>(difference) << 1) ^ static_cast<uint64_t>(difference >> 63);
}

uint64_t unfolded(uint64_t code, uint64_t last) {
  return last + ((code >> 1) ^ (0 - (code & 1)));
}

/// A face as the difference to the one before it, in the order of cells: eight to twelve bytes for a quad.
void put_use(ByteWriter& out, const FaceUse& use, const FaceUse& last) {
  out.put_count(use.cell - last.cell);
  out.put_count(folded(use.face, last.face));
  out.put_count(use.corners.size() << 1 | (use.turned ? 1 : 0));
  uint64_t previous = last.corners.empty() ? 0 : last.corners[0];
  for (const uint32_t corner : use.corners) {
    out.put_count(folded(corner, previous));
    previous = corner;
  }
}

void take_use(ByteReader& in, FaceUse& use) {
  use.cell += in.get_count();
  use.face = unfolded(in.get_count(), use.face);
  const uint64_t size_and_side = in.get_count();
  use.turned = (size_and_side & 1) != 0;
  uint64_t previous = use.corners.empty() ? 0 : use.corners[0];
  use.corners.clear();
  for (uint64_t i = 0; i < size_and_side >> 1 && in.ok(); ++i) {
    previous = unfolded(in.get_count(), previous);
    use.corners.push_back(static_cast<uint32_t>(previous));
  }
}

}  // namespace

Result<> FaceSorter::add(uint64_t cell, uint64_t face, bool turned, std::span<const uint32_t> corners) {
  entries_.push_back({cell, face, corners_.size(), static_cast<uint32_t>(corners.size()), turned});
  corners_.insert(corners_.end(), corners.begin(), corners.end());
  // Vectors grow to twice of what they hold.
  const size_t bytes = 2 * (entries_.size() * sizeof(Entry) + corners_.size() * sizeof(uint32_t));
  return bytes < memory_ ? Result<>() : write_run();
}

Result<> FaceSorter::write_run() {
  if (!file_) file_ = MAILLE_TRY(ScratchFile::create(folder_));
  std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.face < b.face;
  });
  const uint64_t begin = file_->size();
  FaceUse last, use;
  for (const Entry& entry : entries_) {
    const auto corners = std::span(corners_).subspan(entry.begin, entry.size);
    use.cell = entry.cell;
    use.face = entry.face;
    use.turned = entry.turned;
    use.corners.assign(corners.begin(), corners.end());
    ByteWriter record, length;
    put_use(record, use, last);
    length.put_count(record.size());
    MAILLE_CHECK(file_->append(length.bytes()));
    MAILLE_CHECK(file_->append(record.bytes()));
    std::swap(use, last);
  }
  if (!entries_.empty()) runs_.push_back({begin, file_->size(), {}, 0, {}});
  entries_.clear();
  corners_.clear();
  return {};
}

Result<> FaceSorter::sort() {
  MAILLE_CHECK(write_run());
  entries_ = {};
  corners_ = {};
  const uint64_t each = memory_ / 2 / std::max<size_t>(runs_.size(), 1);
  window_bytes_ = static_cast<size_t>(std::clamp<uint64_t>(each, 4096, 1 << 16));
  for (size_t run = 0; run < runs_.size(); ++run) MAILLE_CHECK(advance(run));
  return {};
}

/// So many bytes behind the place in the window, or all there are.
Result<> FaceSorter::provide(Run& run, size_t bytes) {
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

/// The next face of a run, if there is one.
Result<> FaceSorter::advance(size_t number) {
  Run& run = runs_[number];
  constexpr size_t most_count_bytes = 10;
  MAILLE_CHECK(provide(run, most_count_bytes));
  if (run.place == run.window.size()) {
    run.window = {};
    return {};
  }
  ByteReader head(Bytes(run.window).subspan(run.place));
  const auto length = static_cast<size_t>(head.get_count());
  run.place += head.position();
  MAILLE_CHECK(provide(run, length));
  ByteReader in(Bytes(run.window).subspan(run.place, length));
  take_use(in, run.use);
  run.place += length;
  waiting_.push({run.use.cell, run.use.face, number});
  return {};
}

Result<> FaceSorter::take() {
  const size_t run = waiting_.top().run;
  waiting_.pop();
  return advance(run);
}

}  // namespace maille
