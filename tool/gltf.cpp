#include "gltf.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <maille/compare.h>
#include <maille/decode.h>
#include <maille/file.h>
#include <maille/io.h>

#include <algorithm>

#include "result.h"
#include "summary.h"
#include "text.h"
#include "tolerance.h"
#include "verbs.h"

namespace maille::tool {

namespace {

bool names_text(const std::string& path) {
  return lower_case(path).ends_with(".gltf");
}

/// An asset keeps all of its attributes and holds files of mode single, so options that ask for anything else
/// are refused.
Result<> check_gltf_options(const CompressOptions& options) {
  const char* unfit = nullptr;
  if (options.mode.value_or(Mode::single) != Mode::single) unfit = "--mode";
  if (options.delay > 0) unfit = "--delay";
  if (!options.pieces.empty()) unfit = "--pieces";
  if (!options.arrays.takes_all()) unfit = "--arrays or --drop";
  if (unfit == nullptr) return {};
  return failure(
      ErrorCode::usage,
      fmt::format("{}: {} is not for glTF files, which keep all their attributes, in files of mode single",
                  options.output, unfit));
}

double ratio(uint64_t part, uint64_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

Json json_of(const GltfReport& done, const std::string& input, const std::string& output, double seconds) {
  return {{"input", input},
          {"output", output},
          {"primitives", done.primitives},
          {"compressed_primitives", done.compressed},
          {"points", done.points},
          {"triangles", done.triangles},
          {"maille_files", done.files},
          {"geometry_bytes", done.geometry_bytes},
          {"coded_bytes", done.coded_bytes},
          {"input_bytes", done.input_bytes},
          {"output_bytes", done.file_bytes},
          {"seconds", seconds}};
}

Result<> tell(const GltfReport& done, const CommonOptions& common, const std::string& input,
              const std::string& output, double seconds, bool compressing) {
  say_notes(compressing ? input : output_name(output), done.notes, common.quiet);
  if (common.json) return answer(dump(json_of(done, input, output, seconds)));
  if (common.quiet) return {};
  say(fmt::format("{} -> {}: {} of {}, {}, {}; {} -> {}, {:.2f} s", input, output_name(output),
                  done.compressed, counted(done.primitives, "primitive"), counted(done.points, "point"),
                  counted(done.triangles, "triangle"), human_bytes(static_cast<double>(done.input_bytes)),
                  human_bytes(static_cast<double>(done.file_bytes)), seconds));
  if (compressing) {
    say(fmt::format("  geometry {} -> {} (ratio {:.2f}); everything else is as it was",
                    human_bytes(static_cast<double>(done.geometry_bytes)),
                    human_bytes(static_cast<double>(done.coded_bytes)),
                    ratio(done.coded_bytes, done.geometry_bytes)));
  }
  return {};
}

}  // namespace

bool names_compressed_gltf(const std::string& path) {
  const std::string name = lower_case(path);
  return name.ends_with(".maille.glb") || name.ends_with(".maille.gltf");
}

Result<uint64_t> compress_to_gltf(const CompressOptions& options) {
  const Stopwatch whole;
  TOOL_CHECK(check_gltf_options(options));
  const Tolerances asked = TOOL_TRY(parse_tolerances(options));
  const Input input = TOOL_TRY(open_input(options.input, options.input_format));
  const std::string format = input.is_maille ? "maille" : input.format;
  const auto found = format.empty() ? format_of(*input.source) : Result<std::string>(format);
  // The output's name promises an asset with materials and scenes, which only glTF inputs have.
  if (!found || (*found != "glb" && *found != "gltf")) {
    return failure(ErrorCode::usage,
                   fmt::format("{}: its name says that the rest of a glTF file is kept, but {} is none; "
                               "name it .maille",
                               options.output, input_name(options.input)));
  }
  const std::vector<Array> arrays = TOOL_TRY(gltf_arrays(*input.source));
  const Tolerances tolerances = TOOL_TRY(
      tolerances_of(asked, arrays, input_name(options.input), options.common.quiet || options.lenient, 1));
  const auto sink = TOOL_TRY(
      open_output({options.output, options.input, options.force, !names_text(options.output), false}));
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  const Threads threads(options.common.threads);
  GltfCompressOptions compressing;
  compressing.encoding.effort = options.effort;
  compressing.encoding.order = options.keep_order ? Order::keep : Order::canonical;
  compressing.encoding.positions = tolerances.positions.value_or(Tolerance{});
  compressing.encoding.arrays = tolerances.arrays;
  compressing.encoding.executor = threads.executor();
  compressing.limits.mesh_bytes = options.common.memory;
  compressing.text = names_text(options.output);
  const GltfReport done = TOOL_TRY(compress_gltf(*input.source, *sink, compressing));
  progress.clear();
  TOOL_CHECK(tell(done, options.common, input_name(options.input), options.output, whole.seconds(), true));
  return done.input_bytes;
}

Result<std::vector<GltfPart>> parts_of_gltf(const Input& input) {
  if (input.is_maille) return std::vector<GltfPart>();
  return gltf_parts(*input.source);
}

Result<std::optional<Input>> open_compressed_gltf(const std::string& path) {
  const std::string name = lower_case(path);
  const bool may_be = name.ends_with(".glb") || name.ends_with(".gltf");
  if (!may_be || is_url(path)) return std::nullopt;
  Input input = TOOL_TRY(open_input(path));
  if (TOOL_TRY(parts_of_gltf(input)).empty()) return std::nullopt;
  return input;
}

Result<int> decompress_gltf_file(const DecompressOptions& options, const Input& input) {
  const Stopwatch whole;
  std::string output = options.output;
  if (output.empty() && !names_compressed_gltf(input.path)) {
    return failure(ErrorCode::usage, fmt::format("{}: name the file to write", input_name(input.path)));
  }
  if (output.empty()) {  // model.maille.glb: model.glb
    const size_t dot = input.path.rfind('.');
    output = input.path.substr(0, input.path.rfind('.', dot - 1)) + input.path.substr(dot);
  }
  TOOL_CHECK(check_json_output(options.common, output));
  const std::string format = TOOL_TRY(output_format(output, options.output_format, "glb"));
  const bool text = format == "gltf" || options.ascii;
  if (format != "glb" && format != "gltf") {
    return failure(
        ErrorCode::usage,
        fmt::format("{}: decompress turns {} back into glTF; `maille convert` writes other formats", output,
                    input_name(input.path)));
  }
  const auto sink = TOOL_TRY(open_output({output, options.input, options.force, !text, false}));
  const Threads threads(options.common.threads);
  const GltfReport done = TOOL_TRY(
      decompress_gltf(*input.source, *sink,
                      {.limits = {options.common.memory}, .executor = threads.executor(), .text = text}));
  TOOL_CHECK(tell(done, options.common, input_name(input.path), output, whole.seconds(), false));
  return 0;
}

namespace {

/// Assets may have thousands of primitives; the first four are enough to recognise one.
std::string some_of(const std::vector<std::string>& names) {
  constexpr size_t most = 4;
  if (names.size() <= most) return fmt::format("{}", fmt::join(names, ", "));
  return fmt::format("{} and {} more", fmt::join(names.begin(), names.begin() + most, ", "),
                     names.size() - most);
}

}  // namespace

Result<int> info_of_gltf(const InfoOptions& options, const Input& input) {
  const std::vector<GltfPart> parts = TOOL_TRY(parts_of_gltf(input));
  const std::string name = input_name(input.path);
  Json list = Json::array();
  std::string text = fmt::format("{}: glTF, {} within by MAILLE_mesh_compression\n", name,
                                 counted(parts.size(), ".maille file"));
  for (const GltfPart& part : parts) {
    const auto source = memory_source(Bytes(part.bytes));
    const FileInfo info = TOOL_TRY(inspect(*source, {options.common.memory}));
    const std::string title = fmt::format("buffer view {}", part.buffer_view);
    if (options.common.json) {
      Json one = {{"buffer_view", part.buffer_view}, {"primitives", part.primitives}};
      one["file"] = info_json(info, title, {});
      list.push_back(std::move(one));
    } else {
      text += fmt::format("\nof {}: {}\n", counted(part.primitives.size(), "primitive"),
                          some_of(part.primitives));
      text += info_text(info, title, {}, options.tree, options.chunks);
    }
  }
  TOOL_CHECK(answer(options.common.json ? dump({{"file", name}, {"parts", list}}) : text));
  return 0;
}

Result<> show_scene(Mesh& mesh, const std::string& format, bool as_stored, std::vector<std::string>& notes) {
  // These keep the scene's transforms as they are; other formats have no place for them, so they are applied.
  // These hold scenes themselves.
  if (as_stored || format == "glb" || format == "gltf" || format == "3mf" || format == "maille") return {};
  if (auto scene = TOOL_TRY(mesh_in_scene(mesh, notes))) mesh = *std::move(scene);
  return {};
}

}  // namespace maille::tool
