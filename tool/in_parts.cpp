#include "in_parts.h"

#include <fmt/format.h>
#include <maille/generate.h>
#include <maille/io.h>
#include <maille/surface_source.h>
#include <sys/stat.h>
#include <unistd.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "result.h"
#include "summary.h"
#include "text.h"

namespace maille::tool {

namespace {

/// Below, any order is found in memory: it is a little better.
constexpr uint64_t small_bytes = uint64_t{2} << 30;
/// What the command and the models of its coder take, about.
constexpr uint64_t fixed_bytes = uint64_t{48} << 20;

/// In $TMPDIR, else beside what is written: there is room for the result, at least.
std::string scratch_folder(const std::string& output) {
  const char* const told = std::getenv("TMPDIR");
  if (told != nullptr && *told != '\0') return told;
  const size_t slash = output.rfind('/');
  if (output == "-" || output.rfind("/dev/", 0) == 0) return {};
  return slash == std::string::npos ? "." : output.substr(0, slash + 1);
}

WorkingSpace space_for(const CommonOptions& common, const std::string& output, bool reorder) {
  WorkingSpace space;
  space.folder = scratch_folder(output);
  const bool asked = common.memory != CommonOptions{}.memory;
  const uint64_t left = common.memory > fixed_bytes ? common.memory - fixed_bytes : 0;
  if (reorder) space.memory = uint64_t{512} << 20;
  // Half of it is for what is in use in the stream.
  if (!asked) return space;
  space.memory = reorder ? left / 2 : std::min(space.memory, left / 2);
  space.in_use = left - space.memory;
  return space;
}

bool has_volume(MeshSource& mesh) {
  CellPiece piece;
  constexpr uint64_t at_once = 1 << 14;
  for (uint64_t first = 0; first < mesh.description().cells; first += at_once) {
    if (!mesh.read_cells(first, std::min(at_once, mesh.description().cells - first), piece)) return false;
    const auto solid = [](uint8_t type) { return dimension_of(static_cast<CellType>(type)) == 3; };
    if (std::any_of(piece.types.begin(), piece.types.end(), solid)) return true;
  }
  return false;
}

}  // namespace

bool is_regular(const std::string& path) {
  struct stat status = {};
  return stat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode);
}

uint64_t bytes_of_case(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path folder = fs::is_directory(path, error) ? fs::path(path) : fs::path(path).parent_path();
  for (const char* inside : {"constant/polyMesh", "polyMesh"}) {
    if (!fs::is_directory(folder / inside, error)) continue;
    folder /= inside;
    break;
  }
  uint64_t bytes = 0;
  for (fs::directory_iterator file(folder.empty() ? "." : folder, error), end; file != end;
       file.increment(error)) {
    if (file->is_regular_file(error)) bytes += file->file_size(error);
  }
  return bytes;
}

namespace {

/// Opening sorts all faces, so only where it has to be: read whole it takes about so many times its files.
std::optional<InputInParts> open_polymesh_in_parts(const CompressOptions& options,
                                                   ProgressDisplay& progress) {
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

/// And a face of text or of STL so many bytes of a file, at least.
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

/// What memory is for is a few tables that grow with the front, and are twice as large each time: those that
/// are left go back to the system at once, instead of waiting for something as large.
void keep_memory_small() {
#ifdef __GLIBC__
  constexpr int large = 64 << 10;
  mallopt(M_MMAP_THRESHOLD, large);
  mallopt(M_TRIM_THRESHOLD, 2 * large);
#endif
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

Result<std::optional<InputInParts>> open_in_parts(const CompressOptions& options, ProgressDisplay& progress) {
  if (options.mode == Mode::random && options.input != "-" && is_regular(options.input))
    return open_surface_in_parts(options, progress);
  const bool stream = !options.mode || options.mode == Mode::stream;
  if (!stream || options.input == "-") return std::nullopt;
  const auto format = options.input_format.empty() ? format_of(options.input) : options.input_format;
  if (format && *format == "polymesh") return open_polymesh_in_parts(options, progress);
  if (!format || !is_regular(options.input) || (*format != "vtu" && *format != "msh")) return std::nullopt;
  auto source = unmapped_source(options.input);
  if (!source) return std::nullopt;
  // What is wrong with a file is told by its reader, which knows more of it.
  auto mesh = open_mesh_source(**source, {options.common.memory});
  if (!mesh || !has_volume(**mesh)) return std::nullopt;
  const MeshDescription& description = (*mesh)->description();
  const uint64_t bytes = 64 * description.corners + 128 * description.points + (*source)->size();
  if (bytes < std::min(small_bytes, options.common.memory)) {
    // In memory, cells in no order can be coded in a better one with theirs beside it.
    const Result<double> bits = incoherence(**mesh);
    if (options.delay == 0 && (options.any_order || (bits && *bits > 2))) return std::nullopt;
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
  MeshSource* mesh = input.mesh.get();
  std::unique_ptr<MeshSource> ordered;
  const std::string output = options.output.empty() ? options.input : options.output;
  if (random) {
    WorkingSpace space;
    space.folder = scratch_folder(output);
    space.memory = std::min(options.common.memory, small_bytes);
    return encode(*mesh, sink, watched, space);
  }
  if (options.any_order && options.delay == 0 && TOOL_TRY(incoherence(*mesh)) > 2) {
    const Stopwatch step;
    ordered = TOOL_TRY(reordered(*mesh, space_for(options.common, output, true), watched.progress));
    mesh = ordered.get();
    step.done(options.common.verbose, "ordering cells");
  }
  WorkingSpace space = space_for(options.common, output, ordered != nullptr);
  space.delay = options.delay;
  return encode(*mesh, sink, watched, space);
}

// ---- streams ----------------------------------------------------------------------------------------------

namespace {

/// Standard input, with what was read of it.
class RecordedStdin final : public ByteStream {
 public:
  explicit RecordedStdin(std::vector<std::byte>* record) : record_(record) {}
  Result<size_t> read(std::span<std::byte> out) override {
    if (at_ < begin_.size()) {
      const size_t count = std::min(out.size(), begin_.size() - at_);
      std::copy_n(begin_.begin() + static_cast<ptrdiff_t>(at_), count, out.begin());
      at_ += count;
      return count;
    }
    const size_t count = TOOL_TRY(input_->read(out));
    *bytes_ += count;
    if (*recording_)
      record_->insert(record_->end(), out.begin(), out.begin() + static_cast<ptrdiff_t>(count));
    return count;
  }
  std::string name() const override { return "standard input"; }
  std::shared_ptr<bool> recording() const { return recording_; }
  std::shared_ptr<uint64_t> bytes() const { return bytes_; }

 private:
  std::unique_ptr<ByteStream> input_ = descriptor_stream(STDIN_FILENO, "standard input");
  std::vector<std::byte> begin_;
  size_t at_ = 0;
  std::vector<std::byte>* record_;
  std::shared_ptr<bool> recording_ = std::make_shared<bool>(true);
  std::shared_ptr<uint64_t> bytes_ = std::make_shared<uint64_t>(0);
};

}  // namespace

Result<std::optional<InputStream>> open_stream(const std::string& path, const CommonOptions& common,
                                               Executor* executor, std::vector<std::byte>& begin) {
  const StreamReadOptions reading{.limits = {common.memory}, .executor = executor};
  if (path == "-") {
    if (isatty(STDIN_FILENO) == 1) return std::nullopt;
    auto input = std::make_unique<RecordedStdin>(&begin);
    const auto recording = input->recording();
    auto bytes = input->bytes();
    auto reader = StreamReader::open(std::move(input), reading);
    *recording = false;
    if (!reader) return std::nullopt;
    begin = {};
    keep_memory_small();
    return InputStream{nullptr, *std::move(reader), std::move(bytes)};
  }
  if (!is_regular(path)) return std::nullopt;
  auto source = unmapped_source(path);
  if (!source) return std::nullopt;
  auto reader = StreamReader::open(source_stream(**source), reading);
  if (!reader) return std::nullopt;
  keep_memory_small();
  return InputStream{*std::move(source), *std::move(reader), nullptr};
}

Result<std::unique_ptr<Source>> rest_of_stdin(std::vector<std::byte> begin) {
  auto rest = TOOL_TRY(stdin_source());
  if (begin.empty()) return rest;
  const Bytes bytes = rest->view();
  begin.insert(begin.end(), bytes.begin(), bytes.end());
  return memory_source(std::move(begin), rest->name());
}

namespace {

/// Gives pieces of one stream to the writer of another.
class Recoder {
 public:
  Recoder(const StreamDescription& description, StreamWriter& writer) : writer_(writer) {
    for (const StreamArray& array : description.arrays) {
      if (array.domain == Domain::cell) cell_sizes_.push_back(array.tuple_size());
    }
  }

  Result<> add(const StreamPiece& piece) {
    points_.assign(piece.point_arrays.begin(), piece.point_arrays.end());
    if (!piece.points.empty()) TOOL_CHECK(writer_.add_points(piece.points, piece.positions, points_));
    if (numbers_.size() < piece.slot_count) numbers_.resize(piece.slot_count);
    for (size_t i = 0; i < piece.points.size(); ++i) numbers_[piece.point_slots[i]] = piece.points[i];
    mark_ends(piece);
    size_t next_block = 0;
    for (size_t i = 0; i < piece.cell_count();) {
      TOOL_CHECK(begin_blocks(piece, i, next_block));
      i += TOOL_TRY(add_run(piece, i, next_block));
    }
    TOOL_CHECK(begin_blocks(piece, piece.cell_count(), next_block));
    return writer_.end_points(late_);
  }

 private:
  /// Points that end in the piece end with the last entry that names them, or, if none does, later.
  void mark_ends(const StreamPiece& piece) {
    ending_.assign(piece.slot_count, 0);
    for (const uint32_t slot : piece.ended_slots) ending_[slot] = 1;
    flags_.assign(piece.slots.size(), 0);
    for (size_t i = piece.slots.size(); i-- > 0;) {
      flags_[i] = ending_[piece.slots[i]];
      ending_[piece.slots[i]] = 0;
    }
    late_.clear();
    for (const uint32_t slot : piece.ended_slots) {
      if (ending_[slot] != 0) late_.push_back(numbers_[slot]);
    }
  }
  Result<> begin_blocks(const StreamPiece& piece, size_t cell, size_t& next) {
    for (; next < piece.blocks.size() && piece.blocks[next].first_cell <= piece.first_cell + cell; ++next)
      TOOL_CHECK(writer_.begin_block(piece.blocks[next].name, piece.blocks[next].type));
    return {};
  }
  Result<size_t> add_run(const StreamPiece& piece, size_t i, size_t next_block) {
    const uint64_t nodes = piece.offsets[i + 1] - piece.offsets[i];
    size_t end = piece.cell_count();
    if (next_block < piece.blocks.size())
      end = std::min<size_t>(end, piece.blocks[next_block].first_cell - piece.first_cell);
    size_t next = i + 1;
    while (nodes != 0 && next < end && piece.types[next] == piece.types[i] &&
           piece.offsets[next + 1] - piece.offsets[next] == nodes)
      ++next;
    cells_.clear();
    for (size_t k = 0; k < cell_sizes_.size(); ++k)
      cells_.push_back(Bytes(piece.cell_arrays[k]).subspan(i * cell_sizes_[k], (next - i) * cell_sizes_[k]));
    const size_t begin = piece.offsets[i], corners = (next - i) * nodes;
    TOOL_CHECK(writer_.add_cells(piece.types[i], std::span(piece.connectivity).subspan(begin, corners),
                                 std::span(flags_).subspan(begin, corners), cells_, nodes));
    return next - i;
  }

  StreamWriter& writer_;
  std::vector<size_t> cell_sizes_;
  std::vector<Bytes> points_, cells_;
  std::vector<uint64_t> numbers_;  ///< by slot
  std::vector<uint8_t> ending_, flags_;
  std::vector<uint64_t> late_;
};

ArrayReport report_of(const StreamArray& array, uint64_t count, uint64_t coded_bytes) {
  ArrayReport report;
  report.name = array.name;
  report.domain = array.domain;
  report.type = array.type;
  report.components = array.components;
  report.elements = count;
  report.raw_bytes = count * array.tuple_size();
  report.coded_bytes = coded_bytes;
  report.lossless = array.tolerance.kind == Tolerance::Kind::lossless;
  report.bound = array.tolerance.kind == Tolerance::Kind::absolute ? array.tolerance.value : 0;
  return report;
}

EncodeReport report_of(const StreamOptions& options, const StreamReport& stream) {
  EncodeReport report;
  report.points = stream.points;
  report.cells = stream.cells;
  report.file_bytes = stream.file_bytes;
  report.connectivity.name = "connectivity";
  report.connectivity.domain = Domain::cell;
  report.connectivity.type = Scalar::u32;
  report.connectivity.elements = stream.cells;
  report.connectivity.raw_bytes = stream.corners * 4;
  report.connectivity.coded_bytes = stream.cell_bytes;
  report.order_bytes = stream.number_bytes;
  report.positions = report_of(options.positions, stream.points, stream.position_bytes);
  report.other_bytes = stream.file_bytes - stream.cell_bytes - stream.number_bytes - stream.position_bytes;
  for (size_t i = 0; i < options.arrays.size(); ++i) {
    const uint64_t count = options.arrays[i].domain == Domain::point ? stream.points : stream.cells;
    report.arrays.push_back(report_of(options.arrays[i], count, stream.array_bytes[i]));
    report.other_bytes -= stream.array_bytes[i];
  }
  return report;
}

}  // namespace

Result<EncodeReport> compress_stream(InputStream& input, Sink& sink, const EncodeOptions& encoding,
                                     uint64_t delay, ProgressDisplay& progress) {
  const StreamDescription& from = input.reader.description();
  StreamOptions options;
  options.delay = delay;
  options.positions = from.positions;
  options.positions.tolerance = encoding.positions;
  options.arrays = from.arrays;
  for (StreamArray& array : options.arrays) {
    const auto asked = encoding.arrays.find(array.name);
    array.tolerance = asked == encoding.arrays.end() ? Tolerance{} : asked->second;
  }
  options.mesh_arrays = from.mesh_arrays;
  options.metadata = from.metadata;
  options.provenance = encoding.provenance;
  options.effort = encoding.effort;
  options.any_order = from.any_order || encoding.order == Order::canonical;
  options.executor = encoding.executor;
  StreamWriter writer = TOOL_TRY(StreamWriter::begin(sink, options));
  Recoder recoder(from, writer);
  const Progress watch = progress.watch(0, "cells");
  StreamPiece piece;
  while (TOOL_TRY(input.reader.next(piece))) {
    TOOL_CHECK(recoder.add(piece));
    if (watch) watch({"cells", 0});
  }
  return report_of(options, TOOL_TRY(writer.finish()));
}

// ---- decompress -------------------------------------------------------------------------------------------

bool can_write_in_parts(const std::string& format, const std::string& output, bool ascii) {
  if (format == "polymesh") return output != "-";
  struct stat status = {};
  const bool special = stat(output.c_str(), &status) == 0 && !S_ISREG(status.st_mode);
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
  const uint64_t for_cells = format == "polymesh" ? 600 : 32;  // their faces are sorted
  uint64_t bytes = 16 * mesh.corners + 64 * mesh.points + for_cells * mesh.cells;
  for (const Array& array : mesh.arrays) bytes += mesh.count_of(array) * array.tuple_size();
  return in_place || bytes > std::min(small_bytes, options.common.memory);
}

}  // namespace

Result<std::optional<PartsWritten>> decompress_in_parts(const DecompressOptions& options,
                                                        const Source& source, const MeshDescription& mesh,
                                                        const std::string& output,
                                                        const std::string& format) {
  if (!goes_in_parts(mesh, format, options)) return std::nullopt;
  const bool folder = format == "polymesh";
  TOOL_CHECK(check_output({output, options.input, options.force, true, folder}));
  const uint64_t memory = space_for(options.common, output, false).memory;
  auto opened = mesh_sink(output, format, mesh, {options.ascii, scratch_folder(output), memory});
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
  TOOL_CHECK(decode(source, *sink, decoding));
  progress.clear();
  say_notes(output, sink->notes(), options.common.quiet);
  step.done(options.common.verbose, "decompressing");
  const auto named = [](const MeshDescription::Block& block) { return !block.name.empty(); };
  if (format == "vtu" && std::any_of(mesh.blocks.begin(), mesh.blocks.end(), named)) {
    say_notes(output, {"VTU has no named blocks: their names are in the cell array \"block\""},
              options.common.quiet);
  }
  struct stat status = {};
  stat(output.c_str(), &status);
  const uint64_t size = folder ? bytes_of_case(output) : static_cast<uint64_t>(status.st_size);
  return PartsWritten{mesh.points, mesh.cells, source.size(), size};
}

// ---- generate ---------------------------------------------------------------------------------------------

namespace {

class StreamedGeneration final : public GeneratedOutput {
 public:
  StreamedGeneration(const BlockDescription& description, Sink& sink, const GenerateOptions& options,
                     Executor* executor, ProgressDisplay& progress)
      : description_(description), sink_(sink), options_(options), executor_(executor), progress_(progress) {}

  Result<> begin(const GeneratedSize& size) override {
    StreamOptions stream;
    stream.positions.type = Scalar::f64;
    stream.any_order = options_.generation.streaming_order;
    stream.executor = executor_;
    StreamArray label{"patch", Domain::cell, Scalar::u16, 1, Role::label, {}, {}, {}};
    for (const HexBlock& block : description_.blocks) zones_.push_back(label_of(label.labels, block.zone));
    for (const BlockPatch& patch : size.patches) {
      patches_.push_back(label_of(label.labels, patch.name));
      stream.metadata.emplace_back("patch." + patch.name, patch.type);
    }
    if (label.labels.size() > 0xffff)
      return failure(ErrorCode::unsupported, "more than 65535 zones and patches");
    stream.arrays.push_back(std::move(label));
    writer_.emplace(TOOL_TRY(StreamWriter::begin(sink_, std::move(stream))));
    cells_ = size.cells;
    watch_ = progress_.watch(static_cast<double>(cells_), "cells");
    return {};
  }
  Result<> points(uint64_t first, std::span<const double> coordinates) override {
    alive_ += coordinates.size() / 3;
    if (alive_ > options_.common.memory / bytes_of_live_point) return too_many_points();
    return writer_->add_points(first, std::as_bytes(coordinates));
  }
  Result<> faces(uint32_t patch, CellType type, std::span<const uint64_t> nodes) override {
    return add(patches_[patch], type, nodes, {});
  }
  Result<> cells(uint32_t block, CellType type, std::span<const uint64_t> nodes,
                 std::span<const uint8_t> last_use) override {
    done_ += nodes.size() / nodes_of(type);
    for (const uint8_t last : last_use) alive_ -= last;
    if (watch_) watch_({"cells", static_cast<double>(done_) / static_cast<double>(cells_)});
    return add(zones_[block], type, nodes, last_use);
  }
  Result<StreamReport> finish() { return writer_->finish(); }

 private:
  /// The writer's tables for a point and the cells around it, about.
  static constexpr uint64_t bytes_of_live_point = 288;

  Result<> too_many_points() const {
    return failure(
        ErrorCode::memory_bound,
        fmt::format(
            "{}: more than {} points are in use at once, which takes more than --memory allows ({} MB); "
            "allow more, or refine less",
            options_.input, alive_ - 1, options_.common.memory >> 20));
  }
  static uint16_t label_of(std::vector<std::string>& labels, const std::string& name) {
    const auto place = std::find(labels.begin(), labels.end(), name) - labels.begin();
    if (static_cast<size_t>(place) == labels.size()) labels.push_back(name);
    return static_cast<uint16_t>(place);
  }
  Result<> add(uint16_t label, CellType type, std::span<const uint64_t> nodes,
               std::span<const uint8_t> last_use) {
    labels_.assign(nodes.size() / nodes_of(type), label);
    const Bytes bytes = std::as_bytes(std::span(labels_));
    return writer_->add_cells(type, nodes, last_use, {&bytes, 1});
  }

  const BlockDescription& description_;
  Sink& sink_;
  const GenerateOptions& options_;
  Executor* executor_;
  ProgressDisplay& progress_;
  Progress watch_;
  std::optional<StreamWriter> writer_;
  std::vector<uint16_t> zones_, patches_, labels_;
  uint64_t cells_ = 0, done_ = 0, alive_ = 0;
};

}  // namespace

Result<StreamReport> generate_stream(const BlockDescription& description, const GenerateOptions& options,
                                     Sink& sink, ProgressDisplay& progress) {
  keep_memory_small();
  const Threads threads(options.common.threads);
  StreamedGeneration output(description, sink, options, threads.executor(), progress);
  TOOL_CHECK(generate(description, options.generation, output));
  return output.finish();
}

}  // namespace maille::tool
