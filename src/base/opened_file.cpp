#include "base/opened_file.h"

#include <algorithm>
#include <memory>

#include "base/result.h"
#include "base/source_range.h"

namespace maille {
namespace {

/// A regular file, which several threads may read at once. The size is that at opening; a file cut meanwhile
/// is an error, and one that grew is read up to the old size.
class FileSource final : public Source {
 public:
  FileSource(Descriptor file, uint64_t size, std::string path)
      : file_(std::move(file)), size_(size), path_(std::move(path)) {}

  uint64_t size() const override { return size_; }
  Result<> read_at(uint64_t offset, std::span<std::byte> out) const override {
    MAILLE_CHECK(check_range(*this, offset, out.size()));
    const ptrdiff_t count = read_from(file_.get(), offset, out);
    if (count < 0) return cannot_read(path_);
    if (static_cast<size_t>(count) == out.size()) return {};
    return failure(ErrorCode::cannot_read, path_ + " became shorter while it was read");
  }
  std::string name() const override { return path_; }

 private:
  Descriptor file_;
  uint64_t size_;
  std::string path_;
};

std::string shown(const std::string& folder, const std::string& name) {
  return folder == "." ? name : folder + "/" + name;
}

tl::unexpected<Error> not_beneath(const std::string& folder, const std::string& name, const char* why) {
  return failure(ErrorCode::cannot_read, "cannot read " + shown(folder, name) + ": " + why);
}

}  // namespace

// 0 also for pipes and devices, whose sizes say nothing about the bytes they will give.
Result<uint64_t> plain_size(int file, const std::string& path) {
  const FileStatus status = status_of(file);
  if (status.kind == FileStatus::Kind::none) return cannot_read(path);
  return status.kind == FileStatus::Kind::regular ? status.size : 0;
}

std::unique_ptr<Source> plain_source(Descriptor file, uint64_t size, const std::string& path) {
  return std::make_unique<FileSource>(std::move(file), size, path);
}

/// Reads to the end, in steps that double: what is allocated stays within twice of what has arrived. From 64
/// KiB on, the size of a pipe's buffer on Linux.
Result<std::vector<std::byte>> read_to_end(int fd, const std::string& name) {
  std::vector<std::byte> bytes;
  size_t used = 0;
  for (;;) {
    if (used == bytes.size()) bytes.resize(std::max<size_t>(size_t{64} << 10, 2 * used));
    const ptrdiff_t got = read_some(fd, std::span(bytes).subspan(used));
    if (got < 0) return cannot_read(name);
    if (got == 0) break;
    used += static_cast<size_t>(got);
  }
  bytes.resize(used);
  return bytes;
}

Result<Descriptor> open_beneath(const std::string& folder, const std::string& name) {
  Descriptor file = open_within(folder, name);
  if (!file.valid() && errno == EXDEV)
    return not_beneath(folder, name, "it is a link that leads out of the folder; put the file itself there");
  if (!file.valid()) return cannot_read(shown(folder, name));
  // The file that is open is asked; its name may belong to another file by now.
  const FileStatus status = status_of(file.get());
  if (status.kind == FileStatus::Kind::none) return cannot_read(shown(folder, name));
  if (status.kind != FileStatus::Kind::regular) return not_beneath(folder, name, "it is no regular file");
  return file;
}

Result<std::unique_ptr<Source>> file_source(const std::string& path) {
  Descriptor file = open_to_read(path);
  if (!file.valid()) return cannot_read(path);
  const uint64_t size = MAILLE_TRY(plain_size(file.get(), path));
  // An empty file is read like a pipe, because files below /proc claim to be empty.
  if (size != 0) return plain_source(std::move(file), size, path);
  return memory_source(MAILLE_TRY(read_to_end(file.get(), path)), path);
}

Result<std::unique_ptr<Source>> stdin_source() {
  return memory_source(MAILLE_TRY(read_to_end(STDIN_FILENO, "standard input")), "standard input");
}

}  // namespace maille
