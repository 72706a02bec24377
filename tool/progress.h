#pragma once

#include <maille/executor.h>

#include <chrono>
#include <memory>
#include <string>

#include "options.h"

namespace maille::tool {

/// Shows on standard error how far a job has come: one line that is rewritten about twice a second on a
/// terminal, a line per tenth elsewhere, or JSON lines. Functions of watch() share the display, and may be
/// called from several threads.
class ProgressDisplay {
 public:
  /// `automatic` shows progress only when standard error is a terminal.
  ProgressDisplay(ProgressStyle style, bool quiet);
  ~ProgressDisplay();
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  /// A function for DecodeOptions and the like. `amount` is what a whole stage goes through, in `unit`, for
  /// the rate; 0: no rate is shown. Must not outlive the display.
  Progress watch(double amount, std::string unit);
  /// Removes the line from the terminal, before something else is printed.
  void clear();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace maille::tool
