#include "volume/pieces/scratch_lists.h"

#include <algorithm>

#include "base/result.h"

namespace maille {

Result<ScratchLists> ScratchLists::create(const std::string& folder, size_t lists, uint64_t memory) {
  // Below, a write costs more than what it writes; above, nothing is gained.
  constexpr uint64_t least = 512, most = uint64_t{64} << 10;
  ScratchFile file = MAILLE_TRY(ScratchFile::create(folder));
  // The memory is shared out evenly: no list is known to be longer than another.
  const uint64_t waiting = std::clamp(memory / std::max<size_t>(lists, 1), least, most);
  return ScratchLists(std::move(file), lists, static_cast<size_t>(waiting));
}

/// Room for more of a list: as much as it has, up to 1 MiB, so that a list has about as many extents as the
/// logarithm of its size. The last list in the file just grows.
void ScratchLists::make_room(List& list, size_t bytes) {
  constexpr uint64_t most = uint64_t{1} << 20;  // what one list may leave unused
  uint64_t written = 0;
  for (const Extent& extent : list.extents) written += extent.size;
  const uint64_t room = std::max<uint64_t>(bytes, std::min(written, most));
  const bool is_last = !list.extents.empty() && list.extents.back().begin + list.extents.back().room == end_;
  if (is_last)
    list.extents.back().room += room;
  else
    list.extents.push_back({end_, 0, room});
  end_ += room;
}

Result<> ScratchLists::write(List& list, Bytes bytes) {
  while (!bytes.empty()) {
    if (list.extents.empty() || list.extents.back().size == list.extents.back().room)
      make_room(list, bytes.size());
    Extent& extent = list.extents.back();
    const auto count = static_cast<size_t>(std::min<uint64_t>(bytes.size(), extent.room - extent.size));
    MAILLE_CHECK(file_.write_at(extent.begin + extent.size, bytes.first(count)));
    extent.size += count;
    bytes = bytes.subspan(count);
  }
  return {};
}

// What is large goes to the file without a copy, behind what waited.
Result<> ScratchLists::append(size_t number, Bytes bytes) {
  List& list = lists_[number];
  list.size += bytes.size();
  if (list.waiting.size() + bytes.size() > most_waiting_) {
    MAILLE_CHECK(write(list, list.waiting));
    list.waiting.clear();
  }
  if (bytes.size() >= most_waiting_) return write(list, bytes);
  if (list.waiting.capacity() == 0) list.waiting.reserve(most_waiting_);
  list.waiting.insert(list.waiting.end(), bytes.begin(), bytes.end());
  return {};
}

// What is in the file, then what still waits: also before finish().
Result<std::vector<std::byte>> ScratchLists::read(size_t number) {
  const List& list = lists_[number];
  std::vector<std::byte> bytes(static_cast<size_t>(list.size));
  size_t at = 0;
  for (const Extent& extent : list.extents) {
    MAILLE_CHECK(file_.read_at(extent.begin, std::span(bytes).subspan(at, static_cast<size_t>(extent.size))));
    at += static_cast<size_t>(extent.size);
  }
  std::copy(list.waiting.begin(), list.waiting.end(), bytes.begin() + static_cast<ptrdiff_t>(at));
  return bytes;
}

// Memory of all lists is given back, which merging needs for buffers.
Result<> ScratchLists::finish() {
  for (List& list : lists_) {
    MAILLE_CHECK(write(list, list.waiting));
    std::vector<std::byte>().swap(list.waiting);
  }
  return {};
}

// From extent to extent, until `out` is full or the list ends.
Result<size_t> ScratchLists::read_some(size_t number, Place& place, std::span<std::byte> out) {
  const List& list = lists_[number];
  size_t done = 0;
  while (done < out.size() && place.extent < list.extents.size()) {
    const Extent& extent = list.extents[place.extent];
    const auto count = static_cast<size_t>(std::min<uint64_t>(out.size() - done, extent.size - place.offset));
    MAILLE_CHECK(file_.read_at(extent.begin + place.offset, out.subspan(done, count)));
    done += count;
    place.offset += count;
    if (place.offset == extent.size) place = {place.extent + 1, 0};
  }
  return done;
}

// The gap to the number that would follow: 0 within a run.
Result<> RisingWriter::add(uint64_t number) {
  out_.put_count(number - next_);
  next_ = number + 1;
  ++count_;
  return out_.size() < at_once_ ? Result<>() : finish();
}

Result<> RisingWriter::finish() {
  const std::vector<std::byte> bytes = out_.take();
  out_ = {};
  return lists_->append(list_, bytes);
}

/// Moves what is left to the front of the buffer and reads on. A short read means that the list has ended.
Result<> RisingCursor::fill() {
  std::copy(buffer_.begin() + static_cast<ptrdiff_t>(at_), buffer_.begin() + static_cast<ptrdiff_t>(end_),
            buffer_.begin());
  end_ -= at_;
  at_ = 0;
  const size_t count = MAILLE_TRY(lists_->read_some(list_, place_, std::span(buffer_).subspan(end_)));
  all_read_ = end_ + count < buffer_.size();
  end_ += count;
  return {};
}

Result<bool> RisingCursor::next() {
  // A number is decoded only if it is whole in the buffer, or nothing more will come.
  constexpr size_t longest = 10;  // bytes of a count
  if (!all_read_ && end_ - at_ < longest) MAILLE_CHECK(fill());
  if (at_ == end_) return false;
  ByteReader in(Bytes(buffer_).subspan(at_, end_ - at_));
  number_ = next_ + in.get_count();
  next_ = number_ + 1;
  at_ += in.position();
  return true;
}

Result<std::vector<uint32_t>> read_rising(ScratchLists& lists, size_t list) {
  const std::vector<std::byte> bytes = MAILLE_TRY(lists.read(list));
  std::vector<uint32_t> numbers;
  uint64_t next = 0;
  for (ByteReader in(bytes); in.remaining() > 0;) {
    numbers.push_back(static_cast<uint32_t>(next += in.get_count()));
    ++next;
  }
  return numbers;
}

}  // namespace maille
