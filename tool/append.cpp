#include <fmt/format.h>
#include <maille/decode.h>
#include <maille/file.h>
#include <maille/http.h>
#include <maille/path.h>
#include <maille/series.h>
#include <maille/stream.h>
#include <maille/volume_file.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <set>

#include "compress_one.h"
#include "files.h"
#include "in_parts.h"
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
  std::optional<uint64_t> number = {};  ///< in a file that has several
  bool mesh_may_change = true;
};

/// The files named, those that .pvd files list among them, and the steps of files that have several.
Result<std::vector<Step>> all_steps(const AppendOptions& options) {
  std::vector<Step> steps;
  for (const std::string& path : options.steps) {
    if (!is_series(path)) {
      steps.push_back({path, {}});
      continue;
    }
    for (const SeriesEntry& entry : TOOL_TRY(read_series(path)))
      steps.push_back({entry.path, entry.time, entry.step, !entry.step || entry.mesh_may_change});
  }
  for (size_t i = 0; i < steps.size() && options.time; ++i)
    steps[i].time = *options.time + static_cast<double>(i);
  return steps;
}

}  // namespace

std::optional<double> time_of(const Mesh& mesh) {
  for (const Array& array : mesh.arrays) {
    const bool names_it = array.name == "TimeValue" || array.name == "TIME";
    if (names_it && array.domain == Domain::mesh && array.type == Scalar::f64 && array.count() == 1)
      return array.values<double>()[0];
  }
  // The folder of a case of OpenFOAM: a number, or it would be no time.
  for (const auto& [key, value] : mesh.metadata) {
    if (key == "openfoam.time") return std::strtod(value.c_str(), nullptr);
  }
  return {};
}

namespace {

/// Reads a file that is one step, or one step of a file with several.
Result<LoadedMesh> load_step(const Step& step, const AppendOptions& options, std::set<std::string>& said,
                             ProgressDisplay& progress) {
  if (!step.number) {
    const Input input = TOOL_TRY(open_input(step.path, options.input_format));
    return load(input, options.common, progress);
  }
  ReadOptions reading;
  reading.limits.mesh_bytes = options.common.memory;
  ReadResult read = TOOL_TRY(read_series_entry({step.path, 0, step.number}, reading));
  // Once is enough; of the first time of a series it was said with the mesh.
  std::vector<std::string> notes;
  for (const std::string& note : read.notes) {
    if (said.insert(note).second && *step.number > 0) notes.push_back(note);
  }
  say_notes(input_name(step.path), notes, options.common.quiet);
  return LoadedMesh{std::move(read.mesh), std::move(read.notes), std::move(read.files_beside)};
}

Result<FileInfo> inspect_stream(const std::string& path, const Source& file, const Limits& limits) {
  FileInfo info = TOOL_TRY(inspect(file, limits));
  if (info.mode == Mode::stream) return info;
  return failure(ErrorCode::usage,
                 fmt::format("{}: is of mode {}; only files of mode stream take steps of time, "
                             "`maille compress --mode stream` makes one",
                             path, name_of(info.mode)));
}

/// The corners of all cells of a mesh, one after the other.
class Corners {
 public:
  explicit Corners(const Mesh& mesh) : mesh_(mesh) {}
  bool next_is(uint64_t point) {
    while (block_ < mesh_.blocks.size() && at_ == mesh_.blocks[block_].connectivity.size()) {
      ++block_;
      at_ = 0;
    }
    return block_ < mesh_.blocks.size() && mesh_.blocks[block_].connectivity[at_++] == point;
  }

 private:
  const Mesh& mesh_;
  size_t block_ = 0, at_ = 0;
};

constexpr const char* moved = "its points lie elsewhere";
constexpr const char* other_cells = "its cells have other points";

/// What is not as in the step, portion by portion; nullptr: nothing. `exact`: positions, too.
Result<const char*> difference_of_pieces(StreamReader& reader, const Mesh& step, bool exact) {
  const size_t size = step.points.tuple_size();
  Corners corners(step);
  StreamPortion portion;
  while (TOOL_TRY(reader.next(portion))) {
    for (size_t i = 0; exact && i < portion.points.size(); ++i) {
      const uint64_t number = portion.points[i];
      if (number >= step.point_count() || std::memcmp(portion.positions.data() + i * size,
                                                      step.points.bytes.data() + number * size, size) != 0)
        return moved;
    }
    for (const uint64_t point : portion.connectivity) {
      if (!corners.next_is(point)) return other_cells;
    }
  }
  return nullptr;
}

/// The same for a file whose pieces come in another order than the input: that is put back in memory only.
Result<const char*> difference_of_whole(const Source& file, const Mesh& step, bool exact,
                                        const StreamReadOptions& reading) {
  DecodeOptions decoding;
  decoding.limits = reading.limits;
  decoding.arrays.emplace();
  decoding.executor = reading.executor;
  const Mesh mesh = TOOL_TRY(decode(file, decoding));
  if (exact && mesh.points.bytes != step.points.bytes) return moved;
  Corners corners(step);
  for (const CellBlock& block : mesh.blocks) {
    for (const uint32_t point : block.connectivity) {
      if (!corners.next_is(point)) return other_cells;
    }
  }
  return nullptr;
}

/// A step has values only: points that moved, or other cells, would be lost without a word. Positions that
/// were rounded are not looked at, nor is a file in any order, which takes no steps.
Result<> check_same_mesh(const std::string& file_name, const Source& file, const FileInfo& info,
                         const std::string& step_name, const Mesh& step, const StreamReadOptions& reading) {
  if (info.order != Order::keep) return {};
  const bool exact = info.positions.lossless && info.positions.type == step.points.type;
  auto reader = StreamReader::open(file, 0, reading);
  const char* const difference = TOOL_TRY(reader ? difference_of_pieces(*reader, step, exact)
                                                 : difference_of_whole(file, step, exact, reading));
  if (difference == nullptr) return {};
  return failure(ErrorCode::usage,
                 fmt::format("{}: is not the mesh of {} at another time: {}; a step has the same "
                             "points and cells, and other values of arrays",
                             step_name, file_name, difference));
}

struct Appended {
  StepReport report;
  double time = 0;
  uint64_t bytes = 0;
  double seconds = 0;
};

void note_known_time(const AppendOptions& options, const std::vector<StreamStep>& known, double time) {
  const auto same =
      std::find_if(known.begin(), known.end(), [&](const StreamStep& step) { return step.time == time; });
  if (same == known.end()) return;
  say_notes(options.file,
            {fmt::format("step {} has the time {}, too: --time {} gives that one, --step the later one",
                         same - known.begin() + 1, time, time)},
            options.common.quiet);
}

/// What steps had so far.
struct Met {
  std::set<std::string> arrays, said;  ///< names; notes
  std::set<std::string> files_beside;
  bool left_out = false;
};

/// A step has arrays of points and cells: an array of the mesh as a whole, but its time, stays as it is in
/// the file.
Result<> note_mesh_arrays(const AppendOptions& options, const Step& step, const Mesh& mesh,
                          const Source& file, Met& met) {
  std::vector<const Array*> others;
  for (const Array& array : mesh.arrays) {
    if (array.domain == Domain::mesh && array.name != "TimeValue") others.push_back(&array);
  }
  if (others.empty()) return {};
  const VolumeFile volume = TOOL_TRY(VolumeFile::open(file));
  const std::vector<Array>& kept = volume.description().mesh_arrays;
  std::vector<std::string> notes;
  for (const Array* array : others) {
    const bool same = std::any_of(kept.begin(), kept.end(), [&](const Array& other) {
      return other.name == array->name && other.type == array->type && other.bytes == array->bytes;
    });
    if (same || !met.said.insert("array of the mesh " + array->name).second) continue;
    met.left_out = true;
    notes.push_back(fmt::format(
        "array \"{}\" is of the mesh as a whole: steps of time have none, so its values here are left out",
        array->name));
  }
  say_notes(input_name(step.path), notes, options.common.quiet);
  return {};
}

/// A step that says nothing new was probably appended by mistake.
void note_repeated(const AppendOptions& options, const Step& step, const StepReport& done) {
  const std::vector<uint64_t>& bytes = done.array_bytes;
  if (bytes.empty() || std::any_of(bytes.begin(), bytes.end(), [](uint64_t each) { return each > 0; }))
    return;
  say_notes(input_name(step.path),
            {fmt::format("all its values are those of the mesh or of the step before; if it was appended by "
                         "mistake, `maille append --remove-last {}` takes it away",
                         options.file)},
            options.common.quiet);
}

/// Appends one step as a whole, so a series that is interrupted keeps the steps before.
Result<Appended> append_one(const AppendOptions& options, const Step& step, const Tolerances& tolerances,
                            Met& met) {
  const Stopwatch whole;
  Appended done;
  {
    ProgressDisplay progress(options.common.progress, options.common.quiet);
    LoadedMesh loaded = TOOL_TRY(load_step(step, options, met.said, progress));
    met.files_beside.insert(loaded.files_beside.begin(), loaded.files_beside.end());
    met.left_out |= tell_of_loss(loaded.notes);
    TOOL_CHECK(select_arrays(options.quality.arrays, loaded.mesh, input_name(step.path)));
    // Of a case fields may be there at some times only: append_series() looks at the end.
    Tolerances found = tolerances;
    if (options.series.empty()) {
      found = TOOL_TRY(
          tolerances_of(tolerances, loaded.mesh.arrays, input_name(step.path), options.common.quiet));
    }
    for (const Array& array : loaded.mesh.arrays) met.arrays.insert(array.name);
    const Threads threads(options.common.threads);
    EncodeOptions encoding;
    encoding.arrays = found.arrays;
    encoding.executor = threads.executor();
    const Input file = TOOL_TRY(open_maille(options.file));
    const FileInfo info = TOOL_TRY(inspect_stream(options.file, *file.source, {options.common.memory}));
    const bool same_counts =
        info.points == loaded.mesh.point_count() && info.cells == loaded.mesh.cell_count();
    if (step.mesh_may_change && same_counts) {
      const StreamReadOptions reading{.limits = {options.common.memory}, .executor = threads.executor()};
      TOOL_CHECK(
          check_same_mesh(options.file, *file.source, info, input_name(step.path), loaded.mesh, reading));
    }
    const auto known = TOOL_TRY(list_steps(*file.source));
    done.time = step.time.value_or(time_of(loaded.mesh).value_or(static_cast<double>(known.size() + 1)));
    done.report = TOOL_TRY(append_step(options.file, done.time, loaded.mesh, encoding));
    note_known_time(options, known, done.time);
    TOOL_CHECK(note_mesh_arrays(options, step, loaded.mesh, *file.source, met));
  }
  for (const uint64_t each : done.report.array_bytes) done.bytes += each;
  done.seconds = whole.seconds();
  return done;
}

Result<> tell(const AppendOptions& options, const Step& step, const Appended& done) {
  if (options.common.json) {
    return answer(dump({{"file", options.file},
                        {"input", input_name(step.path)},
                        {"step", done.report.number},
                        {"time", done.time},
                        {"coded_bytes", done.bytes},
                        {"file_bytes", done.report.file_bytes},
                        {"seconds", done.seconds}}));
  }
  if (options.common.quiet) return {};
  say(fmt::format("{} -> {}: step {} at time {}, {}; {:.2f} s", input_name(step.path), options.file,
                  done.report.number, done.time, human_bytes(static_cast<double>(done.bytes)), done.seconds));
  return {};
}

uint64_t bytes_of_steps(const std::vector<Step>& steps) {
  std::set<std::string> paths;
  uint64_t bytes = 0;
  for (const Step& step : steps) {
    std::error_code error;
    const bool folder = std::filesystem::is_directory(to_path(step.path), error);
    const uint64_t size =
        folder ? bytes_of_folder(step.path) : std::filesystem::file_size(to_path(step.path), error);
    // Several steps may be in one file, which counts once.
    if (paths.insert(step.path).second && !error) bytes += size;
    if (folder && paths.size() == 1) bytes += bytes_of_case(to_utf8(to_path(step.path).parent_path()));
  }
  return bytes;
}

/// The steps of a series that is compressed: they are told one by one only where much is to be told.
Result<AppendedSteps> append_series(const AppendOptions& options, const std::string& output) {
  const Tolerances tolerances = TOOL_TRY(parse_tolerances(options.quality));
  const std::vector<Step> steps = TOOL_TRY(all_steps(options));
  AppendedSteps all;
  Met met;
  for (const Step& step : steps) {
    const Appended done = TOOL_TRY(append_one(options, step, tolerances, met));
    ++all.count;
    all.coded_bytes += done.bytes;
    all.file_bytes = done.report.file_bytes;
    AppendOptions telling = options;
    telling.file = output;
    if (options.common.verbose) TOOL_CHECK(tell(telling, step, done));
  }
  all.input_bytes = bytes_of_steps(steps) + bytes_of_files(met.files_beside);
  all.left_out = met.left_out;
  for (const auto& [name, bound] : tolerances.arrays) {
    if (met.arrays.count(name) == 0)
      return failure(ErrorCode::usage,
                     fmt::format("{}: has no array '{}' at any time", options.series, name));
  }
  return all;
}

Result<int> remove_last(const AppendOptions& options) {
  std::vector<StreamStep> steps;
  {
    const Input file = TOOL_TRY(open_maille(options.file));
    TOOL_TRY(inspect_stream(options.file, *file.source, {options.common.memory}));
    steps = TOOL_TRY(list_steps(*file.source));
  }
  const StepReport left = TOOL_TRY(remove_last_step(options.file));
  const double time = steps.size() == left.number ? steps.back().time : 0;
  if (options.common.json) {
    TOOL_CHECK(answer(dump({{"file", options.file},
                            {"removed_step", left.number},
                            {"time", time},
                            {"file_bytes", left.file_bytes}})));
  } else if (!options.common.quiet) {
    say(fmt::format("{}: step {} at time {} removed; {} left", options.file, left.number, time,
                    human_bytes(static_cast<double>(left.file_bytes))));
  }
  return 0;
}

}  // namespace

Result<int> run(const AppendOptions& options) {
  if (is_url(options.file)) {
    return failure(ErrorCode::usage, shown_url(options.file) +
                                         ": append writes into the file, which has to be on this machine");
  }
  const Tolerances tolerances = TOOL_TRY(parse_tolerances(options.quality));
  if (tolerances.positions) {
    return failure(ErrorCode::usage, "append: a step has no positions; bounds are of arrays, NAME=X");
  }
  if (options.remove_last) return remove_last(options);
  if (options.steps.empty())
    return failure(ErrorCode::usage, "append: name the STEP, a mesh with the values of a later time");
  Met met;
  for (const Step& step : TOOL_TRY(all_steps(options))) {
    const Appended done = TOOL_TRY(append_one(options, step, tolerances, met));
    note_repeated(options, step, done.report);
    TOOL_CHECK(tell(options, step, done));
  }
  return 0;
}

namespace {

bool ends_with_pvd(const std::string& path) {
  return path.size() > 4 && path.substr(path.size() - 4) == ".pvd";
}

}  // namespace

bool is_series(const std::string& path) {
  if (ends_with_pvd(path)) return true;
  if (!may_be_series(path)) return false;
  const auto steps = read_series(path);
  return steps && steps->size() > 1;
}

Result<uint64_t> compress_series(CompressOptions options) {
  std::string list = options.input;
  while (list.size() > 1 && list.back() == '/') list.pop_back();
  const std::vector<SeriesEntry> series = TOOL_TRY(read_series(list));
  if (series.empty()) return failure(ErrorCode::malformed_input, list + ": names no file");
  if (options.output.empty()) options.output = with_extension(list, ".maille");
  if (options.output == "-" || options.any_order || options.mode.value_or(Mode::stream) != Mode::stream) {
    // Files that have a mesh besides their steps are read as before: with the last one.
    if (!ends_with_pvd(list) && is_regular(list)) return compress_one(options);
    return failure(ErrorCode::usage,
                   list +
                       ": steps of time need a file of mode stream that keeps the order; leave out "
                       "--any-order, --mode and the output '-'");
  }
  options.mode = Mode::stream;
  if (!ends_with_pvd(list) && !is_regular(list)) options.series = list;
  options.input = series.front().path;
  // The mesh of a file with several steps comes with its last one; that of a case says of which time it is.
  if (!series.front().step) options.time = series.front().time;
  if (series.front().step && is_regular(list)) {
    options.time = series.back().time;
    options.step = series.back().step;
  }
  // All of them, so that the first has its time, too: what it shares with the mesh takes no room.
  AppendOptions append;
  append.common = options.common;
  append.common.json = false;
  append.steps = {list};
  append.series = options.series;
  options.arrays.lenient = true;  // at some times an array may be missing
  append.quality.arrays = options.arrays;
  const auto of_arrays = [](const std::vector<std::string>& bounds) {
    std::vector<std::string> named;
    for (const std::string& bound : bounds) {
      if (bound.find('=') != std::string::npos) named.push_back(bound);
    }
    return named;
  };
  for (const auto& [kind, bounds] : options.bounds) append.quality.bounds[kind] = of_arrays(bounds);
  const Series later{list, [&](const std::string& file) {
                       append.file = file;
                       return append_series(append, options.output);
                     }};
  return compress_one(options, &later);
}

}  // namespace maille::tool
