#include "in_parts.h"

#include <fmt/format.h>
#include <maille/io.h>
#include <maille/path.h>
#include <maille/surface_source.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "files.h"
#include "result.h"
#include "summary.h"
#include "system.h"
#include "text.h"

namespace maille::tool {

namespace {

namespace fs = std::filesystem;

/// Meshes below this size are ordered in memory, which finds a slightly better order. The limit is chosen,
/// not swept.
constexpr uint64_t small_bytes = uint64_t{2} << 30;
/// In $TMPDIR, else beside what is written: there is room for the result, at least.
std::string scratch_folder(const std::string& output) {
  const char* const told = std::getenv("TMPDIR");
  if (told != nullptr && *told != '\0') return told;
  if (output == "-" || output.rfind("/dev/", 0) == 0) return {};
  const std::string folder = output.substr(0, begin_of_name(output));
  return folder.empty() ? "." : folder;
}

/// Reads cells up to the first solid. Volumes usually begin with one, but patches of faces may come first.
Result<bool> has_volume(MeshSource& mesh) {
  CellPiece piece;
  constexpr uint64_t at_once = 1 << 14;
  for (uint64_t first = 0; first < mesh.description().cells; first += at_once) {
    TOOL_CHECK(mesh.read_cells(first, std::min(at_once, mesh.description().cells - first), piece));
    const auto solid = [](uint8_t type) { return dimension_of(static_cast<CellType>(type)) == 3; };
    if (std::any_of(piece.types.begin(), piece.types.end(), solid)) return true;
  }
  return false;
}

}  // namespace

// --memory is a bound for the process, which takes WorkingSpace::of_process before it holds anything. Without
// it half a gigabyte is for sorting: more makes fewer passes over temporary files.
WorkingSpace space_for(const CommonOptions& common, const std::string& output, bool reorder) {
  WorkingSpace space;
  space.folder = scratch_folder(output);
  // The default bounds a mesh that is held in memory; only a bound that somebody gave is one for the process.
  const bool asked = common.memory != Limits{}.mesh_bytes;
  if (asked) space.limit = common.memory;
  if (reorder) space.memory = asked ? common.memory : uint64_t{512} << 20;
  if (asked)
    space.memory = std::min(space.memory, common.memory - std::min(common.memory, WorkingSpace::of_process));
  return space;
}

bool is_regular(const std::string& path) {
  std::error_code error;
  return fs::is_regular_file(to_path(path), error);
}

// Estimated, not measured. As doubles, since counts of a damaged file may be anything.
bool fits_in_memory(uint64_t points, uint64_t corners, uint64_t file_bytes, const CommonOptions& common) {
  const double bytes = 64.0 * static_cast<double>(corners) + 128.0 * static_cast<double>(points) +
                       static_cast<double>(file_bytes);
  return bytes < static_cast<double>(std::min(small_bytes, common.memory));
}

std::optional<uint64_t> cells_of_piece(const std::string& pieces) {
  if (pieces.empty() || pieces == "off") return std::nullopt;
  return pieces == "auto" ? cells_of_volume_piece : std::stoull(pieces);
}

uint64_t bytes_of_case(const std::string& path) {
  std::error_code error;
  fs::path folder = fs::is_directory(to_path(path), error) ? to_path(path) : to_path(path).parent_path();
  for (const char* inside : {"constant/polyMesh", "polyMesh"}) {
    if (!fs::is_directory(folder / inside, error)) continue;
    folder /= inside;
    break;
  }
  return bytes_of_folder(folder.empty() ? "." : to_utf8(folder));
}

uint64_t bytes_of_input(const Input& input, const std::vector<std::string>& files_beside) {
  // A folder is an empty source (open_source()).
  if (input.source->size() == 0 && !is_regular(input.path) && input.path != "-")
    return bytes_of_case(input.path);
  return input.source->size() + bytes_of_files({files_beside.begin(), files_beside.end()});
}

uint64_t bytes_of_files(const std::set<std::string>& paths) {
  uint64_t bytes = 0;
  for (const std::string& path : paths) {
    std::error_code error;
    const uint64_t size = std::filesystem::file_size(to_path(path), error);
    if (!error) bytes += size;
  }
  return bytes;
}

uint64_t bytes_of_output(const std::string& path, bool folder) {
  return folder ? bytes_of_case(path) : bytes_of_files({path});
}

uint64_t bytes_of_folder(const std::string& path) {
  uint64_t bytes = 0;
  std::error_code error;
  for (std::filesystem::directory_iterator file(to_path(path), error), end; file != end;
       file.increment(error)) {
    if (file->is_regular_file(error)) bytes += file->file_size(error);
    // Of a case that was divided.
    const std::filesystem::path mesh = file->path() / "constant/polyMesh";
    if (to_utf8(file->path().filename()).starts_with("processor") &&
        std::filesystem::is_directory(mesh, error))
      bytes += bytes_of_case(to_utf8(mesh));
  }
  return bytes;
}

namespace {

/// Opening sorts all faces, so only where it has to be: read whole it takes about so many times its files.
std::optional<InputInParts> open_polymesh_in_parts(const CompressOptions& options,
                                                   ProgressDisplay& progress) {
  // Estimated, not swept: it only decides between two ways with the same result.
  constexpr uint64_t times_in_memory = 6;
  const uint64_t bytes = bytes_of_case(options.input);
  if (bytes < std::min(small_bytes, options.common.memory) / times_in_memory) return std::nullopt;
  const std::string output = options.output.empty() ? options.input : options.output;
  const WorkingSpace space = space_for(options.common, output, false);
  auto mesh = open_polymesh_source(options.input, {space.memory, space.folder, progress.watch(1, "faces")});
  progress.clear();
  if (!mesh) return std::nullopt;
  return InputInParts{nullptr, *std::move(mesh), bytes};
}

/// Levels of detail of a mesh in memory take so much for each face, about.
constexpr uint64_t random_bytes_of_face = 300;

/// The fewest bytes of a file that a face of text or of STL takes. The figure for text is low on purpose, so
/// that a mesh that does not fit into memory is never taken for one that does; a face of binary STL has
/// exactly 50.
constexpr uint64_t text_bytes_of_face = 32;
constexpr uint64_t stl_bytes_of_face = 50;

/// A surface for mode random that memory does not hold.
Result<std::optional<InputInParts>> open_surface_in_parts(const CompressOptions& options,
                                                          ProgressDisplay& progress) {
  const auto format = options.input_format.empty() ? format_of(options.input) : options.input_format;
  if (!format || (*format != "ply" && *format != "stl" && *format != "obj")) return std::nullopt;
  auto source = unmapped_source(options.input);
  if (!source) return std::nullopt;
  const uint64_t most = std::min(small_bytes, options.common.memory);
  const uint64_t size = (*source)->size();
  const auto fits = [&](uint64_t faces) { return random_bytes_of_face * faces + size < most; };
  auto mesh = *format == "ply" ? open_mesh_source(**source, {options.common.memory})
                               : Result<std::unique_ptr<MeshSource>>(failure(ErrorCode::unsupported, ""));
  if (mesh && fits((*mesh)->description().cells)) return std::nullopt;
  if (!mesh) {
    if (fits(size / (*format == "stl" ? stl_bytes_of_face : text_bytes_of_face))) return std::nullopt;
    const std::string output = options.output.empty() ? options.input : options.output;
    mesh = open_surface_source(**source, {.memory = std::min(options.common.memory, small_bytes),
                                          .folder = scratch_folder(output),
                                          .progress = progress.watch(0, "")});
    progress.clear();
    // What is wrong with a file is told by its reader, which knows more of it.
    if (!mesh && mesh.error().code != ErrorCode::cancelled) return std::nullopt;
    if (!mesh) return tl::unexpected(mesh.error());
  }
  return InputInParts{*std::move(source), *std::move(mesh), size};
}

}  // namespace

Result<> check_memory(const Mesh& mesh, Mode mode, const CommonOptions& common, const std::string& name) {
  if (mode != Mode::random) return {};
  const uint64_t needed = random_bytes_of_face * mesh.cell_count();
  if (needed <= common.memory) return {};
  const auto megabytes = [](uint64_t bytes) { return (bytes >> 20) + 1; };
  return failure(
      ErrorCode::memory_bound,
      fmt::format("{}: levels of detail of {} faces take about {} MB in memory, more than --memory allows "
                  "({} MB); `maille convert` it to a .ply file, which is built in parts",
                  name, mesh.cell_count(), megabytes(needed), common.memory >> 20));
}

namespace {

/// An open file without a name.
Result<std::unique_ptr<Source>> written_to_vtu(const Mesh& mesh, const std::string& folder) {
  std::error_code error;
  const std::string place = folder.empty() ? to_utf8(fs::temp_directory_path(error)) : folder;
  // A name is needed, as file_sink() writes by name; it is removed as soon as the file is open for reading.
  const std::string path = TOOL_TRY(make_empty_file(place + "/maille-", ".vtu"));
  const auto write = [&]() -> Result<std::unique_ptr<Source>> {
    const auto sink = TOOL_TRY(file_sink(path));
    TOOL_TRY(write_mesh(mesh, *sink, {.format = "vtu"}));
    TOOL_CHECK(sink->commit());
    return unmapped_source(path);
  };
  auto source = write();
  fs::remove(to_path(path), error);
  return source;
}

/// A volume of a format that is read whole, where --memory holds the mesh, but not what codes it, too: by way
/// of a temporary VTU file.
Result<std::optional<InputInParts>> open_whole_in_parts(const CompressOptions& options,
                                                        ProgressDisplay& progress) {
  // Of shared files in text, reading and coding took 7 to 9 times the file.
  constexpr uint64_t times_in_memory = 10;
  const auto named = [&](uint64_t bytes) {
    return fmt::format("{} is read whole: about {} MiB of memory are the least that will do",
                       input_name(options.input), (bytes >> 20) + 1);
  };
  const uint64_t memory = options.common.memory;
  if (memory == Limits{}.mesh_bytes) return std::nullopt;
  Input input = TOOL_TRY(open_input(options.input, options.input_format));
  const uint64_t bytes = input.source->size(), besides = WorkingSpace::of_process + bytes;
  if (input.is_maille || WorkingSpace::of_process + times_in_memory * bytes <= memory) return std::nullopt;
  // The mesh is about as large as its text.
  if (besides + bytes > memory) return failure(ErrorCode::memory_bound, named(besides + bytes));
  keep_memory_small();
  CommonOptions reading = options.common;
  reading.memory = memory - besides;
  reading.quiet = true;
  auto loaded = load(input, reading, progress);
  if (!loaded && loaded.error().code == ErrorCode::memory_bound)
    return failure(ErrorCode::memory_bound, loaded.error().message + "; " + named(2 * memory));
  if (!loaded || usual_mode(loaded->mesh) != Mode::stream) return std::nullopt;
  input.source.reset();
  const std::string output = options.output.empty() ? options.input : options.output;
  auto source = TOOL_TRY(written_to_vtu(loaded->mesh, scratch_folder(output)));
  const uint64_t needed = besides + 64 * loaded->mesh.corner_count() + 128 * loaded->mesh.point_count();
  const auto on_corners = [](const Array& array) { return array.domain == Domain::corner; };
  const bool has_corners = std::any_of(loaded->mesh.arrays.begin(), loaded->mesh.arrays.end(), on_corners);
  loaded->mesh = {};
  auto mesh = open_mesh_source(*source, {memory});
  if (!mesh || has_corners) return failure(ErrorCode::memory_bound, named(needed));  // or polyhedra
  say_notes(input_name(options.input), loaded->notes, options.common.quiet);
  return InputInParts{std::move(source), *std::move(mesh), bytes};
}

}  // namespace

Result<std::optional<InputInParts>> open_in_parts(const CompressOptions& options, ProgressDisplay& progress) {
  if (options.mode == Mode::random && options.input != "-" && is_regular(options.input))
    return open_surface_in_parts(options, progress);
  const bool stream = !options.mode || options.mode == Mode::stream;
  if (!stream || options.input == "-") return std::nullopt;
  const auto format = options.input_format.empty() ? format_of(options.input) : options.input_format;
  if (format && *format == "polymesh") return open_polymesh_in_parts(options, progress);
  if (!is_regular(options.input)) return std::nullopt;
  if (!format || (*format != "vtu" && *format != "msh")) return open_whole_in_parts(options, progress);
  auto source = unmapped_source(options.input);
  if (!source) return std::nullopt;
  // What is wrong with a file is told by its reader, which knows more of it.
  auto mesh = open_mesh_source(**source, {options.common.memory});
  if (!mesh && mesh.error().code == ErrorCode::unsupported) return open_whole_in_parts(options, progress);
  const auto solid = mesh ? has_volume(**mesh) : tl::unexpected(mesh.error());
  if (!solid && is_unreadable(solid.error())) return tl::unexpected(solid.error());
  if (!solid || !*solid) return std::nullopt;
  const MeshDescription& description = (*mesh)->description();
  if (fits_in_memory(description.points, description.corners, (*source)->size(), options.common)) {
    if (cells_of_piece(options.pieces)) return std::nullopt;
    // In memory, cells in no order can be coded in a better one with theirs beside it.
    // The estimate was 44 to 60 % of all instructions for 30,000 tetrahedra, so it comes last.
    const auto scattered = [&] {
      const Result<double> bits = incoherence(**mesh);
      return bits && *bits > 2;
    };
    if (options.delay == 0 && (options.any_order || scattered())) return std::nullopt;
  }
  const uint64_t size = (*source)->size();
  return InputInParts{*std::move(source), *std::move(mesh), size};
}

Result<EncodeReport> compress_in_parts(InputInParts& input, Sink& sink, const EncodeOptions& encoding,
                                       const CompressOptions& options, ProgressDisplay& progress) {
  EncodeOptions watched = encoding;
  const uint64_t cells = input.mesh->description().cells;
  const bool random = encoding.mode == Mode::random;
  if (!random) keep_memory_small();
  watched.progress = progress.watch(static_cast<double>(cells), random ? "faces" : "cells");
  MeshSource& mesh = *input.mesh;
  const std::string output = options.output.empty() ? options.input : options.output;
  if (random) {
    WorkingSpace space;
    space.folder = scratch_folder(output);
    space.memory = std::min(options.common.memory, small_bytes);
    return encode(mesh, sink, watched, space);
  }
  WorkingSpace space = space_for(options.common, output, false);
  if (encoding.most_cells_per_part) return encode(mesh, sink, watched, space);
  space.delay = options.delay;
  const bool may_order = options.any_order && options.delay == 0;
  // incoherence() estimates how many bits a cell the order costs. Meshes that were written in sweeps stay
  // below 2, and sorting would not improve them.
  if (!may_order || TOOL_TRY(incoherence(mesh)) <= 2) {
    auto encoded = encode(mesh, sink, watched, space);
    if (encoded || !may_order || encoded.error().code != ErrorCode::memory_bound) return encoded;
  }
  const Stopwatch step;
  const auto ordered = TOOL_TRY(reordered(mesh, space_for(options.common, output, true), watched.progress));
  step.done(options.common.verbose, "ordering cells");
  return encode(*ordered, sink, watched, space);
}

bool can_write_in_parts(const std::string& format, const std::string& output, bool ascii) {
  if (format == "polymesh") return output != "-";
  std::error_code error;
  const bool special = fs::exists(to_path(output), error) && !is_regular(output);
  return ((format == "vtu" && !ascii) || format == "msh") && output != "-" && !special;
}

Result<std::unique_ptr<Source>> open_for_parts(const std::string& path, const std::string& output) {
  if (path == "-") return spooled_source(STDIN_FILENO, "standard input", scratch_folder(output));
  if (is_url(path)) return std::move(TOOL_TRY(open_input(path)).source);
  return is_regular(path) ? unmapped_source(path) : file_source(path);
}

namespace {

/// In place (VTU, and Gmsh 2.2), otherwise where writing it whole takes too much memory: temporary files cost
/// time.
bool goes_in_parts(const MeshDescription& mesh, const std::string& format, const DecompressOptions& options) {
  const std::pair<std::string, std::string> older = {"gmsh.version", "2.2"};
  const bool in_place = format == "vtu" ||
                        (format == "msh" && !options.ascii &&
                         std::find(mesh.metadata.begin(), mesh.metadata.end(), older) != mesh.metadata.end());
  // What the mesh and its writer take in memory, about.
  const uint64_t for_cells = format == "polymesh" ? 600 : 32;  // their faces are sorted
  uint64_t bytes = 16 * mesh.corners + 64 * mesh.points + for_cells * mesh.cells;
  for (const Array& array : mesh.arrays) bytes += mesh.count_of(array) * array.tuple_size();
  return in_place || bytes > std::min(small_bytes, options.common.memory);
}

}  // namespace

std::vector<std::string> notes_of(const MeshSink& sink, const MeshDescription& mesh,
                                  const std::string& format) {
  std::vector<std::string> notes = sink.notes();
  const auto named = [](const MeshDescription::Block& block) { return !block.name.empty(); };
  if (format == "vtu" && std::any_of(mesh.blocks.begin(), mesh.blocks.end(), named))
    notes.emplace_back("VTU has no named blocks: their names are in the cell array \"block\"");
  return notes;
}

Result<std::optional<PartsWritten>> decompress_in_parts(const DecompressOptions& options,
                                                        const Source& source, const MeshDescription& mesh,
                                                        const std::string& output,
                                                        const std::string& format) {
  if (!goes_in_parts(mesh, format, options)) return std::nullopt;
  const bool folder = format == "polymesh";
  TOOL_CHECK(check_output({output, options.input, options.force, true, folder}));
  const WorkingSpace space = space_for(options.common, output, false);
  auto opened = mesh_sink(output, format, mesh, {options.ascii, space.folder, space.memory});
  if (!opened && opened.error().code == ErrorCode::unsupported) return std::nullopt;
  const auto sink = TOOL_TRY(std::move(opened));
  keep_memory_small();
  const Threads threads(options.common.threads);
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  const DecodeOptions decoding{.limits = {.mesh_bytes = options.common.memory},
                               .arrays = options.arrays,
                               .executor = threads.executor(),
                               .progress = progress.watch(static_cast<double>(mesh.cells), "cells")};
  const Stopwatch step;
  TOOL_CHECK(decode(source, *sink, decoding, space));
  progress.clear();
  say_notes(output, notes_of(*sink, mesh, format), options.common.quiet);
  step.done(options.common.verbose, "decompressing");
  return PartsWritten{mesh.points, mesh.cells, source.size(), bytes_of_output(output, folder)};
}

}  // namespace maille::tool
