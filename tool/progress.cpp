#include "progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <mutex>
#include <nlohmann/json.hpp>

#include "text.h"

namespace maille::tool {

using Clock = std::chrono::steady_clock;

namespace {

// This is often enough to show that something happens, and seldom enough to be read. Shorter jobs show
// nothing.
constexpr double refresh_seconds = 0.5;

enum class Look { none, line, lines, json };

Look look_of(ProgressStyle style, bool quiet) {
  const bool terminal = isatty(STDERR_FILENO) != 0;
  switch (style) {
    case ProgressStyle::automatic:
      return terminal && !quiet ? Look::line : Look::none;
    case ProgressStyle::always:
      return terminal ? Look::line : Look::lines;
    case ProgressStyle::json:
      return Look::json;
    case ProgressStyle::never:
      return Look::none;
  }
  return Look::none;
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::string duration_text(double seconds) {
  const auto whole = static_cast<long long>(seconds + 0.5);
  return whole < 60 ? fmt::format("{} s", whole) : fmt::format("{}:{:02} min", whole / 60, whole % 60);
}

std::string rate_text(double per_second, const std::string& unit) {
  if (unit == "B") return human_bytes(per_second) + "/s";
  return fmt::format("{:.2f} M {}/s", per_second / 1e6, unit);
}

}  // namespace

struct ProgressDisplay::State {
  Look look = Look::none;
  std::mutex mutex;
  std::string stage;
  Clock::time_point start = Clock::now();
  Clock::time_point stage_start = Clock::now();
  Clock::time_point reported = Clock::now();  ///< last: a stage starts where the one before ends
  Clock::time_point shown = Clock::now();
  int tenths = -1;
  size_t width = 0;  ///< of the line on the terminal

  void update(const ProgressReport& report, double amount, const std::string& unit);
  bool due(double fraction, bool new_stage);
  void show(double fraction, double amount, const std::string& unit);
  void clear();
};

bool ProgressDisplay::State::due(double fraction, bool new_stage) {
  // Not a terminal: a line for each tenth, as a log wants it.
  if (look == Look::lines) {
    const int now = static_cast<int>(fraction * 10);
    return std::exchange(tenths, std::max(tenths, now)) < now;
  }
  // A job that lasts is worth the name of every stage; a short one shows nothing.
  const bool named = new_stage && (look == Look::json || seconds_since(start) >= refresh_seconds);
  return named || seconds_since(shown) >= refresh_seconds;
}

void ProgressDisplay::State::update(const ProgressReport& report, double amount, const std::string& unit) {
  // Threads report side by side.
  const std::lock_guard lock(mutex);
  const bool new_stage = stage != report.stage;
  if (new_stage) {
    stage = report.stage;
    stage_start = reported;
    tenths = -1;
  }
  reported = Clock::now();
  const double fraction = std::clamp(report.fraction, 0.0, 1.0);
  if (!due(fraction, new_stage)) return;
  shown = Clock::now();
  show(fraction, amount, unit);
}

void ProgressDisplay::State::show(double fraction, double amount, const std::string& unit) {
  const double elapsed = seconds_since(stage_start);
  // The rate is that of the whole stage: rates of half a second would jump.
  const double rate = elapsed > 0 ? amount * fraction / elapsed : 0;
  // As long again for each equal part: stages work at an even rate, mostly.
  const double left = fraction > 0 ? elapsed * (1 - fraction) / fraction : 0;
  if (look == Look::json) {
    const nlohmann::ordered_json line = {
        {"stage", stage}, {"fraction", fraction}, {"elapsed_seconds", elapsed}, {"left_seconds", left}};
    say(line.dump());
    return;
  }
  std::string text = fmt::format("{}: {:3.0f} %", stage, fraction * 100);
  if (rate > 0) text += ", " + rate_text(rate, unit);
  if (elapsed > refresh_seconds && left >= 0.5) text += ", " + duration_text(left) + " left";
  if (look == Look::lines) return say(text);
  // Padded to the width of the line before, so that nothing of a longer one is left.
  fmt::print(stderr, "\r{:<{}}", text, width);
  std::fflush(stderr);
  width = text.size();
}

void ProgressDisplay::State::clear() {
  if (width == 0) return;
  fmt::print(stderr, "\r{:<{}}\r", "", width);
  std::fflush(stderr);
  width = 0;
}

ProgressDisplay::ProgressDisplay(ProgressStyle style, bool quiet) : state_(std::make_unique<State>()) {
  state_->look = look_of(style, quiet);
}

ProgressDisplay::~ProgressDisplay() {
  state_->clear();
}

Progress ProgressDisplay::watch(double amount, std::string unit) {
  if (state_->look == Look::none) return {};
  state_->reported = Clock::now();
  return [state = state_.get(), amount, unit = std::move(unit)](const ProgressReport& report) {
    state->update(report, amount, unit);
    return true;
  };
}

void ProgressDisplay::clear() {
  const std::lock_guard lock(state_->mutex);
  state_->clear();
}

}  // namespace maille::tool
