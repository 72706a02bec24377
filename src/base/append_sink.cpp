#include <fcntl.h>
#include <maille/source.h>
#include <sys/file.h>

#include "base/descriptor_output.h"
#include "base/posix.h"
#include "base/result.h"

namespace maille {
namespace {

/// What is there already is never touched: whoever reads the file meanwhile, or after a crash, finds it
/// whole. Steps of time are appended so: a tail behind the footer counts only as a whole, so no rename is
/// needed, and a file of terabytes is not copied for each step.
class AppendSink final : public Sink {
 public:
  AppendSink(Descriptor file, off_t end, std::string name)
      : file_(std::move(file)), end_(end), output_(file_.get(), std::move(name)) {}
  AppendSink(const AppendSink&) = delete;
  AppendSink& operator=(const AppendSink&) = delete;
  /// What was written of a tail that failed is cut off again, or `verify` would find the file damaged. Where
  /// that fails, too, the next one who appends does it.
  ~AppendSink() override {
    if (!committed_) [[maybe_unused]]
      const int ignored = ::ftruncate(file_.get(), end_);
  }

  Result<> write(Bytes bytes) override { return output_.write(bytes); }
  Result<> commit() override {
    MAILLE_CHECK(output_.flush());
    if (::fsync(file_.get()) != 0) return cannot_write(output_.name());
    committed_ = true;
    return {};
  }
  std::string name() const override { return output_.name(); }

 private:
  Descriptor file_;
  off_t end_;
  DescriptorOutput output_;
  bool committed_ = false;
};

}  // namespace

Result<std::unique_ptr<Sink>> append_sink(const std::string& path, uint64_t size) {
  Descriptor file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
  if (!file.valid()) return cannot_write(path);
  // Two programs that append at once would overwrite each other. The system releases the lock when the file
  // is closed, even if the process crashes.
  if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0) {
    return failure(ErrorCode::write_failed, "cannot write " + path + ": somebody else is appending to it");
  }
  const auto end = static_cast<off_t>(size);
  // Bytes behind `size` were left by a program that was killed while it appended.
  if (::ftruncate(file.get(), end) != 0 || ::lseek(file.get(), end, SEEK_SET) != end)
    return cannot_write(path);
  return std::make_unique<AppendSink>(std::move(file), end, path);
}

}  // namespace maille
