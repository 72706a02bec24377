#include <maille/source.h>

#include "base/descriptor_output.h"
#include "base/pending_file.h"
#include "base/result.h"
#include "base/system.h"

namespace maille {
namespace {

class MemorySink final : public Sink {
 public:
  explicit MemorySink(std::vector<std::byte>& out) : out_(out) {}
  Result<> write(Bytes bytes) override {
    out_.insert(out_.end(), bytes.begin(), bytes.end());
    return {};
  }
  Result<> commit() override { return {}; }
  std::string name() const override { return "<memory>"; }

 private:
  std::vector<std::byte>& out_;
};

/// Standard output, and files that are no regular ones (/dev/null, a pipe): no temporary name, no rename.
class DirectSink final : public Sink {
 public:
  DirectSink(Descriptor owned, int fd, std::string name)
      : owned_(std::move(owned)), output_(fd, std::move(name)) {}
  Result<> write(Bytes bytes) override { return output_.write(bytes); }
  Result<> commit() override { return output_.flush(); }
  std::string name() const override { return output_.name(); }

 private:
  // Not valid for standard output, which others may still write to: it is not closed.
  Descriptor owned_;
  DescriptorOutput output_;
};

/// A file that appears whole or not at all (PendingFile). `output_` writes to the descriptor of `file_`,
/// which is therefore declared, and made, before it.
class FileSink final : public Sink {
 public:
  explicit FileSink(std::unique_ptr<PendingFile> file)
      : file_(std::move(file)), output_(file_->descriptor(), file_->path()) {}

  Result<> write(Bytes bytes) override { return output_.write(bytes); }
  Result<> commit() override {
    MAILLE_CHECK(output_.flush());
    return file_->commit();
  }
  std::string name() const override { return file_->path(); }

 private:
  std::unique_ptr<PendingFile> file_;
  DescriptorOutput output_;
};

/// Opens what exists and is no regular file.
Result<std::unique_ptr<Sink>> direct_sink(const std::string& path) {
  Descriptor file = open_to_write(path);
  if (!file.valid()) return cannot_write(path);
  const int fd = file.get();
  return std::make_unique<DirectSink>(std::move(file), fd, path);
}

Result<std::unique_ptr<Sink>> replacing_sink(const std::string& path, std::optional<unsigned> permissions) {
  return std::make_unique<FileSink>(MAILLE_TRY(PendingFile::create(path, permissions)));
}

}  // namespace

std::unique_ptr<Sink> memory_sink(std::vector<std::byte>& out) {
  return std::make_unique<MemorySink>(out);
}

// There are three cases: a new file, a file that is replaced and keeps its permissions, and a device or pipe,
// which is written to directly.
Result<std::unique_ptr<Sink>> file_sink(const std::string& path) {
  using Kind = FileStatus::Kind;
  const FileStatus status = status_of(path);
  if (status.kind == Kind::none) {
    if (!path.empty() && path.back() != '/') return replacing_sink(path, {});
    // A path that ends in a slash names a folder, even if there is none.
    errno = path.empty() ? ENOENT : EISDIR;
    return cannot_write(path.empty() ? "a file without a name" : path);
  }
  if (status.kind == Kind::folder) {
    errno = EISDIR;
    return cannot_write(path);
  }
  if (status.kind == Kind::other) return direct_sink(path);
  // rename() would replace a write-protected file without asking.
  if (!is_writable(path)) return cannot_write(path);
  return replacing_sink(path, status.permissions);
}

std::unique_ptr<Sink> stdout_sink() {
  return std::make_unique<DirectSink>(Descriptor(), STDOUT_FILENO, "standard output");
}

}  // namespace maille
