#include "base/scratch_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "base/result.h"
#include "base/unfinished.h"

namespace maille {
namespace {

std::string folder_or_default(const std::string& folder) {
  if (!folder.empty()) return folder;
  const char* const told = std::getenv("TMPDIR");
  return told != nullptr && *told != '\0' ? told : "/tmp";
}

/// Without a name from the beginning where the file system can do that, else from the next moment on.
Descriptor open_nameless(const std::string& folder) {
#ifdef O_TMPFILE
  // 0600, here and below: temporary folders are open to everybody, and what is in the file may be private.
  Descriptor nameless(::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600));
  if (nameless.valid()) return nameless;
#endif
  const Descriptor place(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!place.valid()) return Descriptor();
  const std::string name = temporary_name("maille");
  // The name is registered before the file is there, so that a signal in between leaves nothing behind.
  const UnfinishedRegistration registration(place.get(), name);
  Descriptor file(::openat(place.get(), name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
  if (file.valid()) ::unlinkat(place.get(), name.c_str(), 0);
  return file;
}

}  // namespace

Result<ScratchFile> ScratchFile::create(const std::string& folder) {
  std::string place = folder_or_default(folder);
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
  while (!bytes.empty()) {
    const ssize_t count = ::pwrite(file_.get(), bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    // 0 is an error as well: the bytes left are never none here, so the loop would not end. It sets no errno.
    if (count == 0) errno = ENOSPC;
    if (count <= 0) return cannot_write("a temporary file in " + folder_);
    offset += static_cast<uint64_t>(count);
    bytes = bytes.subspan(static_cast<size_t>(count));
  }
  // Callers may write behind the end first and fill in what lies before later.
  written_ = std::max(written_, offset);
  return {};
}

// Bytes that still wait in the buffer are part of the file, so they are written before anything is read.
Result<> ScratchFile::read_at(uint64_t offset, std::span<std::byte> out) {
  MAILLE_CHECK(flush());
  while (!out.empty()) {
    const ssize_t count = ::pread(file_.get(), out.data(), out.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count == 0)
      return failure(ErrorCode::cannot_read, "a temporary file in " + folder_ + " is too short");
    if (count < 0) return cannot_read("a temporary file in " + folder_);
    offset += static_cast<uint64_t>(count);
    out = out.subspan(static_cast<size_t>(count));
  }
  return {};
}

}  // namespace maille
