// All times of a file as VTU files, and the list of them that ParaView opens.
#include <fmt/format.h>
#include <maille/decode.h>
#include <maille/file.h>
#include <maille/io.h>
#include <maille/path.h>
#include <maille/xml.h>

#include <algorithm>
#include <filesystem>

#include "files.h"
#include "result.h"
#include "summary.h"
#include "text.h"
#include "verbs.h"

namespace maille::tool {

namespace {

struct TimeOfFile {
  uint64_t step = 0;
  double time = 0;
  std::string name;  ///< of the VTU file, in the folder of the list
};

Result<Mesh> decode_time(const DecompressOptions& options, const Source& source, uint64_t step) {
  const Threads threads(options.common.threads);
  return decode(source, {.limits = {.mesh_bytes = options.common.memory},
                         .arrays = options.arrays,
                         .step = step,
                         .executor = threads.executor(),
                         .progress = {}});
}

Result<std::vector<TimeOfFile>> times_of_file(const DecompressOptions& options, const Source& source) {
  const FileInfo info = TOOL_TRY(inspect(source, {options.common.memory}));
  std::vector<TimeOfFile> times;
  for (const FileTime& time : times_of(info)) times.push_back({time.step, time.time, ""});
  if (times.empty()) times.push_back({0, 0, ""});
  const bool left_out = times[0].step > 0 && !info.time && !info.arrays.empty();
  if (left_out && !info.steps[0].repeats_mesh) {
    say_notes(input_name(options.input),
              {"the values that the mesh came with are of no known time, and left out; --step 0 writes them"},
              options.common.quiet);
  }
  return times;
}

/// `said`: notes of the files before, which are mostly the same for every time.
Result<uint64_t> write_file(const DecompressOptions& options, const Mesh& mesh, const std::string& path,
                            std::vector<std::string>& said) {
  const auto file = TOOL_TRY(open_output({path, options.input, options.force, true, false}));
  CountingSink sink(*file);
  auto notes = TOOL_TRY(write_mesh(mesh, sink, {.format = "vtu", .ascii = options.ascii}));
  TOOL_CHECK(sink.commit());
  std::erase_if(notes,
                [&](const auto& note) { return std::find(said.begin(), said.end(), note) != said.end(); });
  say_notes(path, notes, options.common.quiet);
  said.insert(said.end(), notes.begin(), notes.end());
  return sink.count();
}

/// A .pvd file, as ParaView reads it: one DataSet for each time.
std::string list_of(const std::vector<TimeOfFile>& times) {
  std::string text =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n  <Collection>\n";
  for (const TimeOfFile& time : times)
    text += fmt::format("    <DataSet timestep=\"{}\" file=\"{}\"/>\n", time.time, xml_escaped(time.name));
  return text + "  </Collection>\n</VTKFile>\n";
}

}  // namespace

Result<int> decompress_series(const DecompressOptions& options) {
  const Stopwatch whole;
  if (options.step || options.time || options.salvage) {
    return failure(ErrorCode::usage, options.output +
                                         ": a list holds all times; of one time, or with --salvage, "
                                         "write a .vtu");
  }
  const Input input = TOOL_TRY(open_maille(options.input));
  TOOL_CHECK(check_output({options.output, options.input, options.force, false, false}));
  // Decoded before anything is written, for the summary's counts; if the first time is that of step 0, it is
  // not decoded again.
  Mesh mesh = TOOL_TRY(decode_time(options, *input.source, 0));
  std::vector<TimeOfFile> times = TOOL_TRY(times_of_file(options, *input.source));
  const std::string stem = with_extension(options.output, "");
  for (size_t i = 0; i < times.size(); ++i) {
    // All names are checked before the first file is written.
    const std::string path = fmt::format("{}_{}.vtu", stem, i);
    times[i].name = path.substr(begin_of_name(path));
    TOOL_CHECK(check_output({path, options.input, options.force, true, false}));
  }
  const std::string folder = stem.substr(0, begin_of_name(stem));
  std::vector<std::string> said;
  uint64_t bytes = 0, cells = mesh.cell_count(), points = mesh.point_count();
  for (size_t i = 0; i < times.size(); ++i) {
    auto written = [&]() -> Result<uint64_t> {
      if (times[i].step > 0) mesh = TOOL_TRY(decode_time(options, *input.source, times[i].step));
      return write_file(options, mesh, folder + times[i].name, said);
    }();
    if (written) {
      bytes += *written;
      continue;
    }
    // Nothing half done stays.
    for (size_t k = 0; k < i; ++k) {
      std::error_code ignored;
      std::filesystem::remove(to_path(folder + times[k].name), ignored);
    }
    return tl::unexpected(written.error());
  }
  // The list is written last, so that it never names a file that does not exist.
  const auto list = TOOL_TRY(open_output({options.output, options.input, options.force, false, false}));
  const std::string text = list_of(times);
  TOOL_CHECK(list->write(std::as_bytes(std::span(text.data(), text.size()))));
  TOOL_CHECK(list->commit());
  if (options.common.json) {
    TOOL_CHECK(answer(dump({{"input", input_name(options.input)},
                            {"output", options.output},
                            {"input_bytes", input.source->size()},
                            {"output_bytes", bytes + text.size()},
                            {"points", points},
                            {"cells", cells},
                            {"times", times.size()},
                            {"seconds", whole.seconds()}})));
  } else if (!options.common.quiet) {
    say(fmt::format("{} -> {}: {}, {}, {}; {} -> {}, {:.2f} s", input_name(options.input), options.output,
                    counted(points, "point"), counted(cells, cell_word(mesh)), counted(times.size(), "time"),
                    human_bytes(static_cast<double>(input.source->size())),
                    human_bytes(static_cast<double>(bytes + text.size())), whole.seconds()));
  }
  return 0;
}

}  // namespace maille::tool
