#include <maille/source.h>

#include "base/descriptor_output.h"
#include "base/result.h"
#include "base/system.h"

namespace maille {
namespace {

/// What is there already is never touched: whoever reads the file meanwhile, or after a crash, finds it
/// whole. Steps of time are appended so: a tail behind the footer counts only as a whole, so no rename is
/// needed, and a file of terabytes is not copied for each step.
class AppendSink final : public Sink {
 public:
  AppendSink(Descriptor file, uint64_t end, std::string name)
      : file_(std::move(file)), end_(end), output_(file_.get(), std::move(name)) {}
  AppendSink(const AppendSink&) = delete;
  AppendSink& operator=(const AppendSink&) = delete;
  /// What was written of a tail that failed is cut off again, or `verify` would find the file damaged. Where
  /// that fails, too, the next one who appends does it.
  ~AppendSink() override {
    if (!committed_) cut_to(file_.get(), end_);
  }

  Result<> write(Bytes bytes) override { return output_.write(bytes); }
  Result<> commit() override {
    MAILLE_CHECK(output_.flush());
    if (!sync(file_.get())) return cannot_write(output_.name());
    committed_ = true;
    return {};
  }
  std::string name() const override { return output_.name(); }

 private:
  Descriptor file_;
  uint64_t end_;
  DescriptorOutput output_;
  bool committed_ = false;
};

}  // namespace

Result<std::unique_ptr<Sink>> append_sink(const std::string& path, uint64_t size) {
  Descriptor file = open_to_write(path);
  if (!file.valid()) return cannot_write(path);
  // Two programs that append at once would overwrite each other.
  if (!lock(file.get())) {
    return failure(ErrorCode::write_failed, "cannot write " + path + ": somebody else is appending to it");
  }
  // Bytes behind `size` were left by a program that was killed while it appended.
  if (!cut_to(file.get(), size)) return cannot_write(path);
  return std::make_unique<AppendSink>(std::move(file), size, path);
}

}  // namespace maille
