#pragma once

#include <maille/error.h>
#include <maille/executor.h>

#include <cstdint>

namespace maille {

/// Tells the caller's progress function now and then how far one stage has come: every 65,536 elements, so
/// that a loop pays one test for each. `progress` and `stage` must outlive it.
class Pace {
 public:
  Pace(const Progress& progress, const char* stage, uint64_t total)
      : progress_(progress), stage_(stage), total_(total) {}

  /// One element more. False: the caller wants to stop.
  bool step() {
    if ((++done_ & 0xffff) != 0) return true;
    return report();
  }
  /// Some elements more, which is always told. False: the caller wants to stop.
  bool advance(uint64_t elements) {
    done_ += elements;
    return report();
  }
  bool report() {
    if (progress_ &&
        !progress_({stage_, total_ == 0 ? 0 : static_cast<double>(done_) / static_cast<double>(total_)})) {
      stopped_ = true;
    }
    return !stopped_;
  }
  bool stopped() const { return stopped_; }

 private:
  const Progress& progress_;
  const char* stage_;
  uint64_t total_;
  uint64_t done_ = 0;
  bool stopped_ = false;
};

inline tl::unexpected<Error> cancelled() {
  return failure(ErrorCode::cancelled, "cancelled");
}

}  // namespace maille
