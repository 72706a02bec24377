#include <fmt/format.h>
#include <maille/io.h>
#include <maille/subdivide.h>

#include <algorithm>
#include <cstring>

#include "files.h"
#include "result.h"
#include "summary.h"
#include "text.h"
#include "verbs.h"

namespace maille::tool {

namespace {

/// Counts what comes by on its way to where it is kept.
class Output : public SubdivisionOutput {
 public:
  Result<> begin(uint64_t points, uint64_t triangles) override {
    point_count = points;
    triangle_count = triangles;
    return start();
  }
  uint64_t point_count = 0;
  uint64_t triangle_count = 0;

 protected:
  virtual Result<> start() = 0;
};

/// Binary PLY, little-endian as all machines we build for, written as it comes.
class PlyOutput final : public Output {
 public:
  PlyOutput(Sink& sink, Scalar type) : sink_(sink), type_(type == Scalar::f64 ? Scalar::f64 : Scalar::f32) {}

  Result<> start() override {
    const char* const type = type_ == Scalar::f64 ? "double" : "float";
    const std::string header = fmt::format(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty {} x\nproperty {} y\nproperty {} "
        "z\n"
        "element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        point_count, type, type, type, triangle_count);
    return sink_.write(std::as_bytes(std::span(header)));
  }
  Result<> points(std::span<const double> coordinates) override {
    if (type_ == Scalar::f64) return sink_.write(std::as_bytes(coordinates));
    const std::vector<float> rounded(coordinates.begin(), coordinates.end());
    return sink_.write(std::as_bytes(std::span(rounded)));
  }
  Result<> triangles(std::span<const uint32_t> corners) override {
    constexpr size_t record = 1 + 3 * sizeof(uint32_t);
    std::vector<std::byte> bytes(corners.size() / 3 * record);
    for (size_t i = 0; i < corners.size() / 3; ++i) {
      bytes[i * record] = std::byte{3};
      std::memcpy(bytes.data() + i * record + 1, corners.data() + 3 * i, record - 1);
    }
    return sink_.write(bytes);
  }

 private:
  Sink& sink_;
  Scalar type_;
};

/// A mesh in memory, for formats that are written from one.
class MeshOutput final : public Output {
 public:
  explicit MeshOutput(Scalar type) {
    mesh.points.type = type == Scalar::f64 ? Scalar::f64 : Scalar::f32;
    mesh.blocks.emplace_back();
    mesh.blocks[0].type = CellType::triangle;
  }
  Result<> start() override {
    mesh.points.resize(point_count);
    mesh.blocks[0].connectivity.reserve(3 * triangle_count);
    return {};
  }
  Result<> points(std::span<const double> coordinates) override {
    if (mesh.points.type == Scalar::f64) return append(mesh.points.values<double>(), coordinates);
    return append(mesh.points.values<float>(), coordinates);
  }
  Result<> triangles(std::span<const uint32_t> corners) override {
    auto& connectivity = mesh.blocks[0].connectivity;
    connectivity.insert(connectivity.end(), corners.begin(), corners.end());
    return {};
  }
  Mesh mesh;

 private:
  template <class T>
  Result<> append(std::span<T> all, std::span<const double> coordinates) {
    for (const double x : coordinates) all[next_++] = static_cast<T>(x);
    return {};
  }
  size_t next_ = 0;
};

/// PLY is written while the surface is made, because a level more means four times as many triangles; other
/// formats need the whole mesh.
Result<> write(const Mesh& mesh, const SubdivideOptions& options, const std::string& format, Sink& sink,
               std::unique_ptr<Output>& output, std::vector<std::string>& notes) {
  if (format == "ply") {
    output = std::make_unique<PlyOutput>(sink, mesh.points.type);
    TOOL_CHECK(subdivide(mesh, options.subdivision, *output));
    return sink.commit();
  }
  auto whole = std::make_unique<MeshOutput>(mesh.points.type);
  TOOL_CHECK(subdivide(mesh, options.subdivision, *whole));
  notes = TOOL_TRY(write_mesh(whole->mesh, sink, {.format = format}));
  output = std::move(whole);
  return sink.commit();
}

Result<> report(const SubdivideOptions& options, const Mesh& mesh, const Output& output, uint64_t bytes) {
  if (options.common.json) {
    return answer(
        dump({{"input", input_name(options.input)},
              {"output", output_name(options.output)},
              {"scheme", options.subdivision.scheme == SubdivisionScheme::sqrt3 ? "sqrt3" : "butterfly"},
              {"levels", options.subdivision.levels},
              {"input_points", mesh.point_count()},
              {"input_faces", mesh.cell_count()},
              {"points", output.point_count},
              {"faces", output.triangle_count},
              {"output_bytes", bytes}}));
  }
  if (options.common.quiet) return {};
  say(fmt::format("{} -> {}: {}, {} -> {}, {}; {}", input_name(options.input), output_name(options.output),
                  counted(mesh.point_count(), "point"), counted(mesh.cell_count(), "face"),
                  counted(output.point_count, "point"), counted(output.triangle_count, "face"),
                  human_bytes(static_cast<double>(bytes))));
  return {};
}

}  // namespace

Result<int> run(const SubdivideOptions& options) {
  TOOL_CHECK(check_json_output(options.common, options.output));
  const std::string format = TOOL_TRY(output_format(options.output, options.output_format, "ply"));
  if (format == "maille") {
    return failure(ErrorCode::usage, fmt::format("{}: write a PLY and `maille compress` it", options.output));
  }
  const Input input = TOOL_TRY(open_input(options.input, options.input_format));
  const auto file = TOOL_TRY(open_output(
      {options.output, options.input, options.force, is_binary(format, false), is_folder_format(format)}));
  CountingSink sink(*file);
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  const LoadedMesh loaded = TOOL_TRY(load(input, options.common, progress));
  const Stopwatch step;
  std::unique_ptr<Output> output;
  std::vector<std::string> notes;
  const auto written = write(loaded.mesh, options, format, sink, output, notes);
  if (!written && written.error().code == ErrorCode::malformed_input) {
    return failure(ErrorCode::malformed_input, input_name(options.input) + ": " + written.error().message);
  }
  TOOL_CHECK(written);
  step.done(options.common.verbose, "subdividing");
  if (!loaded.mesh.arrays.empty()) notes.emplace_back("arrays other than positions are left out");
  say_notes(output_name(options.output), notes, options.common.quiet);
  TOOL_CHECK(report(options, loaded.mesh, *output, sink.count()));
  return 0;
}

}  // namespace maille::tool
