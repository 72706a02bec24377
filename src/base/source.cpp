#include <maille/source.h>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <algorithm>
#include <cstdint>

#include "base/posix.h"
#include "base/result.h"

namespace maille {
namespace {

Result<> copy_part(const Source& source, Bytes bytes, uint64_t offset, std::span<std::byte> out) {
  if (offset > bytes.size() || out.size() > bytes.size() - offset) {
    return failure(ErrorCode::cannot_read, source.name() + ": bytes " + std::to_string(offset) + ".." +
                                               std::to_string(offset + out.size()) +
                                               " were asked for, but it ends at byte " +
                                               std::to_string(bytes.size()));
  }
  const Bytes part = bytes.subspan(static_cast<size_t>(offset), out.size());
  std::copy(part.begin(), part.end(), out.begin());
  return {};
}

class MemorySource final : public Source {
 public:
  MemorySource(Bytes bytes, std::string name) : bytes_(bytes), name_(std::move(name)) {}
  MemorySource(std::vector<std::byte> bytes, std::string name)
      : owned_(std::move(bytes)), bytes_(owned_), name_(std::move(name)) {}

  uint64_t size() const override { return bytes_.size(); }
  Result<> read_at(uint64_t offset, std::span<std::byte> out) const override {
    return copy_part(*this, bytes_, offset, out);
  }
  Bytes view() const override { return bytes_; }
  std::string name() const override { return name_; }

 private:
  std::vector<std::byte> owned_;
  Bytes bytes_;
  std::string name_;
};

class MappedSource final : public Source {
 public:
  MappedSource(void* address, size_t size, std::string path)
      : bytes_(static_cast<const std::byte*>(address), size), path_(std::move(path)) {}
  MappedSource(const MappedSource&) = delete;
  MappedSource& operator=(const MappedSource&) = delete;
  ~MappedSource() override { ::munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size()); }

  uint64_t size() const override { return bytes_.size(); }
  Result<> read_at(uint64_t offset, std::span<std::byte> out) const override {
    return copy_part(*this, bytes_, offset, out);
  }
  Bytes view() const override { return bytes_; }
  std::string name() const override { return path_; }

 private:
  Bytes bytes_;
  std::string path_;
};

/// Reads to the end, in steps that double: what is allocated stays within twice of what has arrived.
Result<std::vector<std::byte>> read_whole(int fd, const std::string& name) {
  std::vector<std::byte> bytes;
  size_t used = 0;
  for (;;) {
    if (used == bytes.size()) bytes.resize(std::max<size_t>(size_t{64} << 10, 2 * used));
    const ssize_t got = ::read(fd, bytes.data() + used, bytes.size() - used);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return cannot_read(name);
    if (got == 0) break;
    used += static_cast<size_t>(got);
  }
  bytes.resize(used);
  return bytes;
}

}  // namespace

Result<> Source::read_many(std::span<const Part> parts) const {
  for (const Part& part : parts) MAILLE_CHECK(read_at(part.offset, part.out));
  return {};
}

bool Source::forget(uint64_t, uint64_t) const {
  return false;
}

std::unique_ptr<Source> memory_source(Bytes bytes, std::string name) {
  return std::make_unique<MemorySource>(bytes, std::move(name));
}

std::unique_ptr<Source> memory_source(std::vector<std::byte> bytes, std::string name) {
  return std::make_unique<MemorySource>(std::move(bytes), std::move(name));
}

Result<std::unique_ptr<Source>> file_source(const std::string& path) {
  const Descriptor fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!fd.valid()) return cannot_read(path);
  struct stat info {};
  if (::fstat(fd.get(), &info) != 0) return cannot_read(path);
  // Pipes and devices cannot be mapped; files below /proc are regular but claim no bytes.
  if (!S_ISREG(info.st_mode) || info.st_size == 0) {
    return memory_source(MAILLE_TRY(read_whole(fd.get(), path)), path);
  }
  if (static_cast<uint64_t>(info.st_size) > SIZE_MAX) {
    errno = EFBIG;
    return cannot_read(path);
  }
  const auto size = static_cast<size_t>(info.st_size);
  void* const address = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, fd.get(), 0);
  if (address == MAP_FAILED) return memory_source(MAILLE_TRY(read_whole(fd.get(), path)), path);
  return std::make_unique<MappedSource>(address, size, path);
}

Result<std::unique_ptr<Source>> stdin_source() {
  return memory_source(MAILLE_TRY(read_whole(STDIN_FILENO, "standard input")), "standard input");
}

}  // namespace maille
