#include <maille/source.h>

#include <algorithm>
#include <cstdint>

#include "base/result.h"
#include "base/source_range.h"

namespace maille {
namespace {

/// The range is checked first, because subspan() beyond the end is undefined.
Result<> copy_part(const Source& source, Bytes bytes, uint64_t offset, std::span<std::byte> out) {
  MAILLE_CHECK(check_range(source, offset, out.size()));
  const Bytes part = bytes.subspan(static_cast<size_t>(offset), out.size());
  std::copy(part.begin(), part.end(), out.begin());
  return {};
}

/// Bytes in memory, its own or the caller's: `bytes_` views either. It is only ever held by pointer, so the
/// view of `owned_` stays right.
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

/// A file within a file, such as a GLB's buffer view. Nothing outside of the part can be read.
class PartSource final : public Source {
 public:
  PartSource(const Source& source, uint64_t offset, uint64_t size)
      : source_(source), offset_(offset), size_(size) {}

  uint64_t size() const override { return size_; }
  Result<> read_at(uint64_t offset, std::span<std::byte> out) const override {
    MAILLE_CHECK(check_range(*this, offset, out.size()));
    return source_.read_at(offset_ + offset, out);
  }
  Result<> read_many(std::span<const Part> parts) const override {
    std::vector<Part> moved(parts.begin(), parts.end());
    for (Part& part : moved) {
      MAILLE_CHECK(check_range(*this, part.offset, part.out.size()));
      part.offset += offset_;
    }
    return source_.read_many(moved);
  }
  // A caller may name whole pages that reach beyond the part; the rest is not this part's to drop.
  bool forget(uint64_t offset, uint64_t size) const override {
    if (offset >= size_) return false;
    return source_.forget(offset_ + offset, std::min(size, size_ - offset));
  }
  Bytes view() const override {
    // An empty view means "not addressable", so subspan() must not be asked of it.
    const Bytes all = source_.view();
    return all.empty() ? all : all.subspan(static_cast<size_t>(offset_), static_cast<size_t>(size_));
  }
  std::string name() const override { return source_.name(); }

 private:
  const Source& source_;
  uint64_t offset_, size_;
};

}  // namespace

// One after the other is right for files and memory, where a request costs next to nothing. Sources with long
// ways (http_source()) override it.
Result<> Source::read_many(std::span<const Part> parts) const {
  for (const Part& part : parts) MAILLE_CHECK(read_at(part.offset, part.out));
  return {};
}

// Files and memory would give the same bytes again.
bool Source::forget(uint64_t, uint64_t) const {
  return false;
}

std::unique_ptr<Source> memory_source(Bytes bytes, std::string name) {
  return std::make_unique<MemorySource>(bytes, std::move(name));
}

std::unique_ptr<Source> memory_source(std::vector<std::byte> bytes, std::string name) {
  return std::make_unique<MemorySource>(std::move(bytes), std::move(name));
}

Result<std::unique_ptr<Source>> part_source(const Source& source, uint64_t offset, uint64_t size) {
  MAILLE_CHECK(check_range(source, offset, size));
  return std::make_unique<PartSource>(source, offset, size);
}

}  // namespace maille
