// Which times a file of mode stream has.
#include <maille/file.h>

#include <algorithm>

namespace maille {
namespace {

/// The time of what the mesh came with, if that is one of the series.
std::optional<double> time_of_mesh(const FileInfo& info) {
  if (info.time) {
    const auto same = [&](const StepInfo& step) { return step.time == *info.time; };
    return std::any_of(info.steps.begin(), info.steps.end(), same) ? std::nullopt : info.time;
  }
  const bool counts = !info.steps.empty() && !info.arrays.empty() && !info.steps[0].repeats_mesh;
  return counts && info.steps[0].time > 0 ? std::optional<double>(0) : std::nullopt;
}

}  // namespace

std::vector<FileTime> times_of(const FileInfo& info) {
  std::vector<FileTime> times;
  if (const auto own = time_of_mesh(info)) times.push_back({0, *own});
  for (size_t i = 0; i < info.steps.size(); ++i) times.push_back({i + 1, info.steps[i].time});
  return times;
}

}  // namespace maille
