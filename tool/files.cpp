#include "files.h"

#include <fmt/format.h>
#include <maille/decode.h>
#include <maille/file.h>
#include <maille/io.h>
#include <maille/path.h>
#include <maille/series.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>

#include "result.h"
#include "system.h"
#include "text.h"

namespace maille::tool {

namespace fs = std::filesystem;

size_t begin_of_name(const std::string& path) {
  return path.size() - to_utf8(to_path(path).filename()).size();
}

namespace {

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() > end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

// RFC 1952: ID1, ID2 and the only method there is.
constexpr std::array<unsigned char, 3> gzip_magic = {0x1f, 0x8b, 8};

template <size_t size>
bool starts_with(const Source& source, const std::array<unsigned char, size>& bytes) {
  std::array<std::byte, size> start{};
  if (source.size() < size || !source.read_at(0, start)) return false;
  return std::memcmp(start.data(), bytes.data(), size) == 0;
}

// ".vtu" of "a.b/mesh.vtu", ".vtu.gz" of "mesh.vtu.gz"; empty where there is none.
std::string extension_of(const std::string& path) {
  const size_t name = begin_of_name(path);
  const size_t end = ends_with(path, ".gz") ? path.size() - 3 : path.size();
  const size_t dot = path.substr(0, end).rfind('.');
  return dot == std::string::npos || dot <= name ? "" : path.substr(dot);
}

bool exists(const std::string& path) {
  std::error_code error;
  return fs::exists(to_path(path), error);
}

bool is_folder(const std::string& path) {
  std::error_code error;
  return fs::is_directory(to_path(path), error);
}

// A terminal is refused, as it would wait for somebody to type a mesh.
Result<std::unique_ptr<Source>> open_source(const std::string& path, uint64_t fetch_limit) {
  if (path == "-") {
    if (isatty(STDIN_FILENO) != 0) {
      return failure(ErrorCode::usage, "standard input is a terminal; name a file or pipe one in");
    }
    return stdin_source();
  }
  // Both limits at once: a server without ranges may send a whole file of this size, and one with ranges no
  // more than this beyond what was asked for.
  if (is_url(path)) {
    HttpOptions options;
    options.whole_bytes = options.most_bytes = fetch_limit;
    return http_source(path, options);
  }
  // OpenFOAM's meshes are folders; their reader opens the files in them by itself.
  if (is_folder(path)) return memory_source(std::vector<std::byte>(), path);
  auto source = file_source(path);
  if (!source && path.find("//") != std::string::npos)
    source.error().message += "; addresses begin with http:// or https://";
  return source;
}

}  // namespace

std::string input_name(const std::string& path) {
  return path == "-" ? "standard input" : shown_url(path);
}

std::string output_name(const std::string& path) {
  return path == "-" ? "standard output" : path;
}

namespace {

/// A name in this folder for what an address names.
std::string name_in_url(const std::string& url) {
  const std::string shown = shown_url(url);
  const size_t host = shown.find("//") + 2, slash = shown.rfind('/');
  const std::string name = slash < host ? "" : shown.substr(slash + 1);
  return name.empty() || name[0] == '.' ? "mesh" : name;
}

}  // namespace

std::string with_extension(const std::string& path, const std::string& extension) {
  std::string stem = is_url(path) ? name_in_url(path) : path;
  if (ends_with(stem, ".gz")) stem.resize(stem.size() - 3);
  const size_t dot = stem.rfind('.');
  if (dot != std::string::npos && dot > begin_of_name(stem)) stem.resize(dot);
  return stem + extension;
}

Result<Input> open_input(const std::string& path, const std::string& format, uint64_t fetch_limit) {
  // Not within the braces: GCC 12 forgets the strings before it when TOOL_TRY returns from there.
  std::unique_ptr<Source> source = TOOL_TRY(open_source(path, fetch_limit));
  return make_input(std::move(source), path, format);
}

Input make_input(std::unique_ptr<Source> source, const std::string& path, const std::string& format) {
  Input input{path, format, std::move(source), false, nullptr};
  if (is_url(path)) input.remote = dynamic_cast<const HttpSource*>(input.source.get());
  // A file that lost its first bytes is still to be called damaged, not of unknown format.
  const bool looks_like_it = is_maille(*input.source) || (ends_with(path, ".maille") && !is_folder(path));
  input.is_maille = format == "maille" || (format.empty() && looks_like_it);
  return input;
}

Result<> check_maille(const Input& input) {
  // Anything else may still be a damaged .maille file under another name; the decoder tells.
  if (!input.is_maille) {
    if (const auto format = format_of(*input.source)) {
      return failure(
          ErrorCode::usage,
          fmt::format("{}: this is a file of format {}, not a .maille file; run `maille compress` first, or "
                      "`maille convert` for other formats",
                      input_name(input.path), *format));
    }
  }
  // Servers and archives often pack everything. Without this check the decoder would report damage.
  if (starts_with(*input.source, gzip_magic)) {
    return failure(ErrorCode::usage, fmt::format("{}: is packed with gzip; unpack it first, e.g. with gunzip",
                                                 input_name(input.path)));
  }
  return {};
}

Result<Input> open_maille(const std::string& path, uint64_t fetch_limit) {
  if (is_folder(path)) {
    return failure(ErrorCode::usage,
                   fmt::format("{}: this is a folder, not a .maille file; `maille compress` makes one of a "
                               "case of OpenFOAM, `maille compress -r` one of each mesh in the folder",
                               path));
  }
  Input input = TOOL_TRY(open_input(path, {}, fetch_limit));
  TOOL_CHECK(check_maille(input));
  return input;
}

std::string fetched_text(const Input& input) {
  if (input.remote == nullptr) return "";
  const HttpStatistics statistics = input.remote->statistics();
  return fmt::format("{} in {}, {}", human_bytes(static_cast<double>(statistics.bytes)),
                     counted(statistics.requests, "request"), counted(statistics.round_trips, "round trip"));
}

namespace {

Result<LoadedMesh> load_quietly(const Input& input, const CommonOptions& common, const Progress& watch) {
  const Limits limits{.mesh_bytes = common.memory};
  if (input.is_maille) {
    const Threads threads(common.threads);
    const DecodeOptions options{
        .limits = limits, .arrays = std::nullopt, .executor = threads.executor(), .progress = watch};
    return LoadedMesh{TOOL_TRY(decode(*input.source, options)), {}};
  }
  const ReadOptions options{.format = input.format, .limits = limits, .progress = watch};
  ReadResult result = TOOL_TRY(input.step ? read_series_entry({input.path, 0, input.step}, options)
                                          : read_mesh(*input.source, options));
  return LoadedMesh{std::move(result.mesh), std::move(result.notes), std::move(result.files_beside)};
}

}  // namespace

Result<LoadedMesh> load(const Input& input, const CommonOptions& common, ProgressDisplay& progress) {
  const Stopwatch step;
  const Progress watch = progress.watch(static_cast<double>(input.source->size()), "B");
  LoadedMesh loaded = TOOL_TRY(load_quietly(input, common, watch));
  progress.clear();
  step.done(common.verbose, "reading " + input_name(input.path));
  say_notes(input_name(input.path), loaded.notes, common.quiet);
  return loaded;
}

// thread_executor() takes 0 as the number of processors.
Threads::Threads(unsigned count) : executor_(&serial_executor()) {
  if (count == 1) return;
  owned_ = thread_executor(count);
  executor_ = owned_.get();
}

namespace {

Result<> check_existing(const OutputRequest& request) {
  if (is_same_file(request.input, request.path)) {
    return failure(ErrorCode::usage,
                   fmt::format("{}: output and input are the same file; name another output", request.path));
  }
  if (is_folder(request.path)) {
    return failure(ErrorCode::usage, fmt::format("{}: this is a folder; name a file in it", request.path));
  }
  std::error_code error;
  if (fs::is_regular_file(to_path(request.path), error) && !request.force) {
    return failure(ErrorCode::usage, fmt::format("{}: exists already; -f overwrites it", request.path));
  }
  return {};
}

Result<> check_folder(const OutputRequest& request) {
  if (request.path == "-" || request.path.empty())
    return failure(ErrorCode::usage, "a polyMesh is a folder of files; name a folder to write it to");
  const std::string folder = polymesh_folder(request.path);
  if (is_folder(request.input) && is_same_file(polymesh_folder(request.input), folder)) {
    return failure(ErrorCode::usage,
                   fmt::format("{}: output and input are the same mesh; name another output", request.path));
  }
  // The files that are replaced. A folder without any of them may hold what it likes, such as fields.
  for (const char* name : {"points", "faces", "owner", "neighbour", "boundary"}) {
    const std::string file = folder + "/" + name;
    if (!request.force && (exists(file) || exists(file + ".gz"))) {
      return failure(ErrorCode::usage, fmt::format("{}: holds a mesh already; -f overwrites it", folder));
    }
  }
  return {};
}

}  // namespace

Result<> check_json_output(const CommonOptions& common, const std::string& output) {
  if (!common.json || output != "-") return {};
  return failure(ErrorCode::usage,
                 "--json and the output '-' both want standard output; name an output file");
}

// This runs before the input is read: an hour of work must not end at a file that exists already.
Result<> check_output(const OutputRequest& request) {
  if (request.folder) return check_folder(request);
  if (request.path == "-") {
    if (request.binary && !request.force && isatty(STDOUT_FILENO) != 0) {
      return failure(ErrorCode::usage,
                     "standard output is a terminal; name an output file, pipe the output, or use -f");
    }
    return {};
  }
  return check_existing(request);
}

Result<std::unique_ptr<Sink>> open_output(const OutputRequest& request) {
  TOOL_CHECK(check_output(request));
  if (request.folder) return TOOL_TRY(polymesh_sink(request.path, request.force));
  return request.path == "-" ? stdout_sink() : file_sink(request.path);
}

std::optional<std::string> foreign_format(const std::string& path) {
  const std::string name = lower_case(path);
  for (const FormatInfo& info : formats()) {
    for (const std::string& extension : info.extensions) {
      if (ends_with(name, extension) || (info.gzip && ends_with(name, extension + ".gz"))) return info.name;
    }
  }
  return std::nullopt;
}

namespace {

/// Where `decompress` may put a mesh of OpenFOAM without being told the format.
bool looks_like_case(const std::string& path) {
  const std::string folder = path.substr(0, path.find_last_not_of('/') + 1);
  return folder.substr(begin_of_name(folder)) == "polyMesh" || is_folder(folder + "/constant") ||
         is_folder(folder + "/system");
}

}  // namespace

// An explicit format comes first, then the file's name, then what a folder looks like.
Result<std::string> output_format(const std::string& path, const std::string& format,
                                  const std::string& fallback) {
  if (!format.empty()) return format;
  if (ends_with(lower_case(path), ".maille")) return std::string("maille");
  if (const auto known = foreign_format(path)) return *known;
  if (looks_like_case(path)) return std::string("polymesh");
  if (!fallback.empty()) return fallback;
  if (const std::string extension = extension_of(path); path != "-" && !extension.empty()) {
    std::string known;
    for (const FormatInfo& info : formats()) {
      if (info.writable) known += (known.empty() ? "" : ", ") + info.name;
    }
    return failure(
        ErrorCode::usage,
        fmt::format("{}: {} files cannot be written; name another extension or --output-format: {}; "
                    "`maille convert` writes maille, too",
                    path, extension, known));
  }
  if (path != "-" && is_folder(path))
    return failure(ErrorCode::usage, path + ": this is a folder; name a file in it");
  return failure(ErrorCode::usage, fmt::format("{}: its name does not say which format to write; use "
                                               "--output-format",
                                               output_name(path)));
}

bool is_folder_format(const std::string& format) {
  return format == "polymesh" || format == "foam";
}

bool is_binary(const std::string& format, bool ascii) {
  static constexpr std::string_view text_only[] = {"obj", "off", "wrl", "mesh", "su2", "hedra"};
  static constexpr std::string_view either[] = {"ply", "stl", "vtp", "vtu", "vtk", "msh", "polymesh"};
  const auto is_in = [&](const auto& list) {
    return std::find(std::begin(list), std::end(list), format) != std::end(list);
  };
  return !is_in(text_only) && !(ascii && is_in(either));
}

Result<> CountingSink::begin_file(const std::string& file) {
  if (auto* const folder = dynamic_cast<FolderSink*>(&sink_)) return folder->begin_file(file);
  return failure(ErrorCode::usage, sink_.name() + ": is one file, not a folder of files");
}

Result<bool> CountingSink::begin_case_file(const std::string& path) {
  auto* const folder = dynamic_cast<FolderSink*>(&sink_);
  return folder == nullptr ? Result<bool>(false) : folder->begin_case_file(path);
}

Result<> CountingSink::write(Bytes bytes) {
  TOOL_CHECK(sink_.write(bytes));
  count_ += bytes.size();
  return {};
}

}  // namespace maille::tool
