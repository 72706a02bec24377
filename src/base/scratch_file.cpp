#include "base/scratch_file.h"

#include <algorithm>

#include "base/result.h"

namespace maille {
Result<ScratchFile> ScratchFile::create(const std::string& folder) {
  std::string place = folder.empty() ? temporary_folder() : folder;
  Descriptor file = open_nameless(place);
  if (!file.valid()) return cannot_write("a temporary file in " + place);
  return ScratchFile(std::move(file), std::move(place));
}

Result<> ScratchFile::flush() {
  if (buffer_.empty()) return {};
  // write_at() flushes, too, so the buffer is empty meanwhile; its memory is kept for the next pieces.
  std::vector<std::byte> bytes;
  bytes.swap(buffer_);
  const auto written = write_at(written_, bytes);
  bytes.clear();
  bytes.swap(buffer_);
  return written;
}

Result<> ScratchFile::append(Bytes bytes) {
  // Pieces that still fit are collected; one that does not goes to the file at once, without a copy.
  if (buffer_.size() + bytes.size() <= buffer_bytes) {
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
    return {};
  }
  MAILLE_CHECK(flush());
  return write_at(written_, bytes);
}

Result<> ScratchFile::write_at(uint64_t offset, Bytes bytes) {
  MAILLE_CHECK(flush());
  if (!write_to(file_.get(), offset, bytes)) return cannot_write("a temporary file in " + folder_);
  // Callers may write behind the end first and fill in what lies before later.
  written_ = std::max(written_, offset + bytes.size());
  return {};
}

// Bytes that still wait in the buffer are part of the file, so they are written before anything is read.
Result<> ScratchFile::read_at(uint64_t offset, std::span<std::byte> out) {
  MAILLE_CHECK(flush());
  const ptrdiff_t count = read_from(file_.get(), offset, out);
  if (count < 0) return cannot_read("a temporary file in " + folder_);
  if (static_cast<size_t>(count) < out.size())
    return failure(ErrorCode::cannot_read, "a temporary file in " + folder_ + " is too short");
  return {};
}

}  // namespace maille
