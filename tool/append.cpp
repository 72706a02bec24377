#include <fmt/format.h>
#include <maille/series.h>
#include <maille/stream.h>

#include <algorithm>

#include "files.h"
#include "result.h"
#include "summary.h"
#include "text.h"
#include "tolerance.h"
#include "verbs.h"

namespace maille::tool {

namespace {

struct Step {
  std::string path;
  std::optional<double> time;
};

/// The files named, those that .pvd files list among them.
Result<std::vector<Step>> all_steps(const AppendOptions& options) {
  std::vector<Step> steps;
  for (const std::string& path : options.steps) {
    if (path.size() < 4 || path.substr(path.size() - 4) != ".pvd") {
      steps.push_back({path, {}});
      continue;
    }
    for (const SeriesEntry& entry : TOOL_TRY(read_series(path))) steps.push_back({entry.path, entry.time});
  }
  for (size_t i = 0; i < steps.size() && options.time; ++i)
    steps[i].time = *options.time + static_cast<double>(i);
  return steps;
}

/// What a VTK file says in its field data; nothing for others.
std::optional<double> time_in(const Mesh& mesh) {
  for (const Array& array : mesh.arrays) {
    const bool names_it = array.name == "TimeValue" || array.name == "TIME";
    if (names_it && array.domain == Domain::mesh && array.type == Scalar::f64 && array.count() == 1)
      return array.values<double>()[0];
  }
  return {};
}

Result<> append_one(const AppendOptions& options, const Step& step, const Tolerances& tolerances) {
  const Stopwatch whole;
  const Input input = TOOL_TRY(open_input(step.path, options.input_format));
  StepReport report;
  double time = 0;
  {
    ProgressDisplay progress(options.common.progress, options.common.quiet);
    const LoadedMesh loaded = TOOL_TRY(load(input, options.common, progress));
    TOOL_CHECK(check_names(tolerances, loaded.mesh, input_name(step.path)));
    const Threads threads(options.common.threads);
    EncodeOptions encoding;
    encoding.arrays = tolerances.arrays;
    encoding.executor = threads.executor();
    const auto known = TOOL_TRY(list_steps(*TOOL_TRY(open_maille(options.file)).source));
    time = step.time.value_or(time_in(loaded.mesh).value_or(static_cast<double>(known.size() + 1)));
    report = TOOL_TRY(append_step(options.file, time, loaded.mesh, encoding));
  }
  uint64_t bytes = 0;
  for (const uint64_t each : report.array_bytes) bytes += each;
  if (options.common.json) {
    return answer(dump({{"file", options.file},
                        {"input", input_name(step.path)},
                        {"step", report.number},
                        {"time", time},
                        {"coded_bytes", bytes},
                        {"file_bytes", report.file_bytes},
                        {"seconds", whole.seconds()}}));
  }
  if (options.common.quiet) return {};
  say(fmt::format("{} -> {}: step {} at time {}, {}; {:.2f} s", input_name(step.path), options.file,
                  report.number, time, human_bytes(static_cast<double>(bytes)), whole.seconds()));
  return {};
}

}  // namespace

Result<int> run(const AppendOptions& options) {
  const Tolerances tolerances = TOOL_TRY(parse_tolerances(options.quality));
  if (tolerances.positions) {
    return failure(ErrorCode::usage, "append: a step has no positions; bounds are of arrays, NAME=X");
  }
  for (const Step& step : TOOL_TRY(all_steps(options))) TOOL_CHECK(append_one(options, step, tolerances));
  return 0;
}

}  // namespace maille::tool
