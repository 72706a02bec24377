#include <fmt/format.h>
#include <fmt/ranges.h>
#include <maille/encode.h>
#include <maille/version.h>

#include "files.h"
#include "result.h"
#include "summary.h"
#include "text.h"
#include "tolerance.h"
#include "verbs.h"

namespace maille::tool {

namespace {

// No date, no folder, no threads: the same input and settings give the same file anywhere.
std::string provenance_of(const CompressOptions& options) {
  const size_t slash = options.input.rfind('/');
  const std::string name = slash == std::string::npos ? options.input : options.input.substr(slash + 1);
  std::string text = fmt::format("maille {}: {}", library_version(), input_name(name));
  for (const std::string& value : options.error) text += " --error " + value;
  for (const std::string& value : options.relative_error) text += " --rel-error " + value;
  for (const std::string& value : options.bits) text += " --bits " + value;
  return text;
}

EncodeOptions encode_options(const CompressOptions& options, const Tolerances& tolerances, const Mesh& mesh) {
  EncodeOptions encode;
  encode.mode = options.mode.value_or(usual_mode(mesh));
  encode.effort = options.effort;
  // A stream keeps the order of its cells: what a solver wrote is mostly a sweep, and fields go with it.
  const bool keep = options.keep_order || (encode.mode == Mode::stream && !options.any_order);
  encode.order = keep ? Order::keep : Order::canonical;
  encode.positions = tolerances.positions.value_or(Tolerance{});
  encode.arrays = tolerances.arrays;
  if (options.provenance) encode.provenance = provenance_of(options);
  return encode;
}

Result<> check(const CompressOptions& options, const std::string& output) {
  // With -f and a pattern of the shell, `compress -f *.off` would overwrite the second mesh.
  if (const auto format = foreign_format(output)) {
    return failure(
        ErrorCode::usage,
        fmt::format("{}: its name says {}, but compress writes .maille files; give it another name, "
                    "or use `maille convert` to write {}",
                    output, *format, *format));
  }
  if (output.ends_with(".gz")) {
    return failure(ErrorCode::usage,
                   fmt::format("{}: .maille files are packed as they are; leave the .gz away", output));
  }
  if (options.common.json && output == "-") {
    return failure(ErrorCode::usage,
                   "--json and the output '-' both want standard output; name an output file");
  }
  return {};
}

Result<> report(const CompressOptions& options, const EncodeReport& report, const std::string& output,
                uint64_t input_bytes, double seconds, const char* word) {
  const std::string input = input_name(options.input);
  if (options.common.json) return answer(dump(summary_json(report, input, output, input_bytes, seconds)));
  if (options.common.quiet) return {};
  std::string text =
      summary_text(report, input, output_name(output), input_bytes, seconds, options.common.verbose, word);
  if (!options.lossless && options.error.empty() && options.relative_error.empty() && options.bits.empty()) {
    text += "every value is kept bit for bit; -e or --bits makes smaller files\n";
  }
  text.pop_back();
  say(text);
  return {};
}

}  // namespace

Result<int> run(const CompressOptions& options) {
  const Stopwatch whole;
  std::string output = options.output;
  if (output.empty()) output = options.input == "-" ? "-" : with_extension(options.input, ".maille");
  TOOL_CHECK(check(options, output));
  const Tolerances tolerances = TOOL_TRY(parse_tolerances(options));
  const Input input = TOOL_TRY(open_input(options.input, options.input_format));
  const auto sink = TOOL_TRY(open_output({output, options.input, options.force, true}));

  EncodeReport result;
  const char* word = "face";
  {
    ProgressDisplay progress(options.common.progress, options.common.quiet);
    LoadedMesh loaded = TOOL_TRY(load(input, options.common, progress));
    TOOL_CHECK(check_names(tolerances, loaded.mesh, input_name(options.input)));
    const Threads threads(options.common.threads);
    EncodeOptions encoding = encode_options(options, tolerances, loaded.mesh);
    word = cell_word(loaded.mesh);
    encoding.executor = threads.executor();
    encoding.progress =
        progress.watch(static_cast<double>(loaded.mesh.cell_count()), std::string(word) + "s");
    const Stopwatch step;
    result = TOOL_TRY(encode(loaded.mesh, *sink, encoding));
    progress.clear();
    step.done(options.common.verbose, "compressing");
  }
  TOOL_CHECK(report(options, result, output, input.source->size(), whole.seconds(), word));
  return 0;
}

}  // namespace maille::tool
