#include <maille/source.h>

#include "base/opened_file.h"
#include "base/result.h"
#include "base/scratch_file.h"
#include "base/source_range.h"

namespace maille {
namespace {

/// What came through a pipe, in a file without a name.
class SpooledSource final : public Source {
 public:
  SpooledSource(ScratchFile file, std::string name) : file_(std::move(file)), name_(std::move(name)) {}
  uint64_t size() const override { return file_.size(); }
  Result<> read_at(uint64_t offset, std::span<std::byte> out) const override {
    MAILLE_CHECK(check_range(*this, offset, out.size()));
    return file_.read_at(offset, out);
  }
  std::string name() const override { return name_; }

 private:
  mutable ScratchFile file_;  ///< flushed before, so reading changes nothing
  std::string name_;
};

}  // namespace

Result<std::unique_ptr<Source>> unmapped_source(const std::string& path) {
  Descriptor file = open_to_read(path);
  if (!file.valid()) return cannot_read(path);
  const uint64_t size = MAILLE_TRY(plain_size(file.get(), path));
  // What is no regular file, or lies below /proc, claims to be empty; only reading it to the end tells its
  // size.
  if (size == 0) return spooled_source(file.get(), path);
  return plain_source(std::move(file), size, path);
}

Result<std::unique_ptr<Source>> spooled_source(int descriptor, const std::string& name,
                                               const std::string& folder) {
  ScratchFile file = MAILLE_TRY(ScratchFile::create(folder));
  // Chosen, not swept: a pipe of Linux gives 64 KiB at once by default, a file as much as is asked for.
  std::vector<std::byte> buffer(size_t{256} << 10);
  for (;;) {
    const ptrdiff_t count = read_some(descriptor, buffer);
    if (count < 0) return cannot_read(name);
    if (count == 0) break;
    // write_at() and not append(), so that nothing waits in the file's buffer and reading changes nothing.
    MAILLE_CHECK(file.write_at(file.size(), Bytes(buffer).first(static_cast<size_t>(count))));
  }
  return std::make_unique<SpooledSource>(std::move(file), name);
}

}  // namespace maille
