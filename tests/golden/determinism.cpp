// What the encoder makes of some 220 meshes in all modes, and what the decoder makes of that, with one thread
// and with three: a line with a hash for each, or a file for each in a folder (of those whose name begins
// with NAME). scripts/check-determinism compares the lines of compilers and machines, scripts/test-windows
// the files.
#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/stream.h>

#include <cinttypes>
#include <cstdio>
#include <iterator>
#include <string>
#include <vector>

#include "base/hash.h"
#include "random/random_file.h"
#include "support/files.h"
#include "support/random.h"
#include "support/random_mesh.h"
#include "support/random_volume.h"
#include "support/shapes.h"
#include "support/three_threads.h"

namespace maille::testing {
namespace {

/// A way to compress a mesh. It may suit the mesh or not.
struct Way {
  std::string name;
  EncodeOptions options;
  uint32_t chart_faces = 0;  ///< mode random: charts so small that small meshes have levels
  bool steps = false;        ///< mode stream: two are appended
};

struct NamedMesh {
  std::string name;
  Mesh mesh;
  bool steps = false;  ///< has numbers only, so that other values can be made of its values
};

template <class T>
void append_values(std::vector<std::byte>& all, const Buffer<T>& values) {
  const auto bytes = std::as_bytes(std::span(values));
  all.insert(all.end(), bytes.begin(), bytes.end());
}

std::vector<std::byte> contents(const Mesh& mesh) {
  std::vector<std::byte> all = mesh.points.bytes.vector();
  for (const CellBlock& block : mesh.blocks) {
    append_values(all, block.connectivity);
    append_values(all, block.types);
    append_values(all, block.offsets);
    append_values(all, block.face_sizes);
  }
  for (const Array& array : mesh.arrays) append_values(all, array.bytes);
  return all;
}

/// Hashes to standard output, or files into a folder.
class Output {
 public:
  explicit Output(std::string folder) : folder_(std::move(folder)) {}
  bool add(const std::string& name, const char* kind, const std::vector<std::byte>& bytes) const {
    if (!folder_.empty()) return write_bytes(folder_ + "/" + name + "." + kind, bytes);
    return std::printf("%s %s %016" PRIx64 "\n", name.c_str(), kind, hash64(bytes)) > 0;
  }
  /// For files that have to be files while they are made.
  std::string scratch() const { return (folder_.empty() ? "." : folder_) + "/determinism.tmp"; }

 private:
  std::string folder_;
};

/// Numbers of a later time.
Mesh at_step(const Mesh& mesh, unsigned step) {
  Mesh later = mesh;
  for (Array& array : later.arrays) {
    if (array.type == Scalar::f32)
      for (float& value : array.values<float>()) value += static_cast<float>(step) / 8;
    else if (array.type == Scalar::f64)
      for (double& value : array.values<double>()) value *= 1 + step / 16.0;
  }
  return later;
}

Result<std::vector<std::byte>> with_steps(const Mesh& mesh, Bytes file, const EncodeOptions& options,
                                          const std::string& scratch) {
  if (!write_bytes(scratch, file)) return tl::unexpected(Error{ErrorCode::write_failed, scratch});
  for (const unsigned step : {1u, 2u}) {
    const auto report = append_step(scratch, step, at_step(mesh, step), options);
    if (!report) return tl::unexpected(report.error());
  }
  auto bytes = read_bytes(scratch);
  std::remove(scratch.c_str());
  return bytes;
}

Result<std::vector<std::byte>> compress(const Mesh& mesh, const Way& way, Executor* executor,
                                        const Output& output) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  EncodeOptions options = way.options;
  options.executor = executor;
  HierarchyOptions charts;
  charts.sizes = {way.chart_faces, way.chart_faces};
  const auto report =
      way.chart_faces == 0 ? encode(mesh, *sink, options) : encode_random(mesh, *sink, options, charts);
  if (!report) return tl::unexpected(report.error());
  return way.steps ? with_steps(mesh, bytes, options, output.scratch()) : std::move(bytes);
}

Result<std::vector<std::byte>> decompress(Bytes file, const Way& way, Executor* executor) {
  DecodeOptions options;
  options.executor = executor;
  options.step = way.steps ? 2 : 0;
  const auto mesh = decode(*memory_source(file), options);
  if (!mesh) return tl::unexpected(mesh.error());
  return contents(*mesh);
}

/// What is wrong; empty: nothing. A mesh that a mode does not take is left out.
std::string write_way(const Output& output, const std::string& name, const Mesh& mesh, const Way& way) {
  ThreeThreads threads;
  const auto file = compress(mesh, way, nullptr, output);
  if (!file) return file.error().code == ErrorCode::unsupported ? "" : file.error().message;
  const auto again = compress(mesh, way, &threads, output);
  if (!again || *again != *file) return "other bytes with three threads";
  const auto decoded = decompress(*file, way, nullptr);
  if (!decoded) return decoded.error().message;
  const auto decoded_again = decompress(*file, way, &threads);
  if (!decoded_again || *decoded_again != *decoded) return "decoded otherwise with three threads";
  // The input, too: when it differs, neither encoder nor decoder is to blame.
  const bool written = output.add(name, "input", contents(mesh)) && output.add(name, "maille", *file) &&
                       output.add(name, "decoded", *decoded);
  return written ? "" : "cannot write";
}

const char* const mode_names[] = {"single", "stream", "random"};

/// Orders and cuts take turns from mesh to mesh and from level to level.
Way way_of(Mode mode, int effort, size_t turn) {
  Way way;
  way.options.mode = mode;
  way.options.effort = effort;
  way.options.order = turn % 2 == 1 ? Order::keep : Order::canonical;
  const bool cut = turn / 2 % 2 == 1;
  if (cut && mode == Mode::random) way.chart_faces = 12;
  if (cut && mode != Mode::random) way.options.most_cells_per_part = mode == Mode::single ? 20 : 40;
  way.name = std::string(mode_names[static_cast<size_t>(mode)]) + std::to_string(effort) +
             (turn % 2 == 1 ? "-keep" : "") + (cut ? "-cut" : "");
  return way;
}

/// Bounds on everything but labels.
void bound(Way& way, const Mesh& mesh, size_t turn) {
  using Kind = Tolerance::Kind;
  static constexpr Tolerance tolerances[] = {
      {Kind::bits, 12}, {Kind::absolute, 0.003}, {Kind::relative, 1e-4}};
  const Tolerance tolerance = tolerances[turn % std::size(tolerances)];
  way.name += "-bound";
  way.options.positions = tolerance;
  for (const Array& array : mesh.arrays) {
    if (array.role != Role::label) way.options.arrays[array.name] = tolerance;
  }
}

std::vector<Way> ways_for(const NamedMesh& mesh, size_t number) {
  static constexpr int levels[] = {1, 3, 5, 9}, other_levels[] = {2, 5, 7};
  std::vector<Way> ways;
  for (const Mode mode : {Mode::single, Mode::stream, Mode::random}) {
    for (size_t i = 0; i < std::size(levels); ++i) ways.push_back(way_of(mode, levels[i], number + i));
    Way& bounded =
        ways.emplace_back(way_of(mode, other_levels[number % std::size(other_levels)], number / 3));
    bound(bounded, mesh.mesh, number / 4);
  }
  if (!mesh.steps) return ways;
  Way& steps = ways.emplace_back(way_of(Mode::stream, 5, number * 2 + 1));  // in the order kept
  steps.name += "-steps";
  steps.steps = true;
  return ways;
}

// Volumes by +, -, *, / only, each random number in a statement of its own.

enum class Cut { hexahedra, tetrahedra, mixed };

/// (n + 1)^3 points of a lattice, shaken.
template <class T>
void add_points(Mesh& mesh, uint32_t n, Random& random) {
  const uint32_t m = n + 1;
  mesh.points = make_array("position", Domain::point, scalar_of<T>(), 3);
  mesh.points.resize(uint64_t{m} * m * m);
  const double noise = random.chance(50) ? 0.2 : 0;
  const auto values = mesh.points.values<T>();
  for (uint32_t i = 0; i < m * m * m; ++i) {
    const double lattice[] = {i % m + i / m * 0.01, i / m % m * 0.75, i / m / m * 1.25};
    for (uint32_t k = 0; k < 3; ++k) {
      const double shaken = noise * random.unit();
      values[size_t{3} * i + k] = static_cast<T>(lattice[k] + shaken);
    }
  }
}

void add_cell(CellBlock& block, CellType type, std::initializer_list<uint32_t> points) {
  block.connectivity.insert(block.connectivity.end(), points);
  if (block.type != CellType::mixed) return;
  block.types.push_back(static_cast<uint8_t>(type));
  block.offsets.push_back(block.connectivity.size());
}

/// One brick, whole or in parts.
void add_brick(CellBlock& block, const uint32_t (&p)[8], unsigned parts) {
  if (parts == 0) add_cell(block, CellType::hexahedron, {p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7]});
  if (parts == 1) {
    add_cell(block, CellType::wedge, {p[0], p[1], p[2], p[4], p[5], p[6]});
    add_cell(block, CellType::wedge, {p[0], p[2], p[3], p[4], p[6], p[7]});
  }
  if (parts == 2) {
    add_cell(block, CellType::pyramid, {p[0], p[1], p[2], p[3], p[6]});
    add_cell(block, CellType::pyramid, {p[0], p[4], p[5], p[1], p[6]});
    add_cell(block, CellType::pyramid, {p[0], p[3], p[7], p[4], p[6]});
  }
  if (parts != 3) return;
  static constexpr unsigned around[] = {1, 2, 3, 7, 4, 5, 1};  // the diagonal from 0 to 6
  for (unsigned i = 0; i < 6; ++i)
    add_cell(block, CellType::tetrahedron, {p[0], p[around[i]], p[around[i + 1]], p[6]});
}

CellBlock bricks(uint32_t n, Cut cut, Random& random) {
  CellBlock block;
  block.type = cut == Cut::hexahedra    ? CellType::hexahedron
               : cut == Cut::tetrahedra ? CellType::tetrahedron
                                        : CellType::mixed;
  if (cut == Cut::mixed) block.offsets = {0};
  const uint32_t m = n + 1;
  std::vector<uint32_t> order(n * n * n);
  for (uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  if (random.chance(30)) shuffle(order, random);
  for (const uint32_t i : order) {
    const uint32_t a = i % n + i / n % n * m + i / n / n * m * m, b = a + m * m;
    const unsigned parts = cut == Cut::hexahedra ? 0 : cut == Cut::tetrahedra ? 3 : random.below(4);
    add_brick(block, {a, a + 1, a + 1 + m, a + m, b, b + 1, b + 1 + m, b + m}, parts);
  }
  return block;
}

template <class T>
void add_values(Mesh& mesh, const char* name, Domain domain, uint32_t components, Random& random) {
  Array array = make_array(name, domain, scalar_of<T>(), components);
  array.resize(mesh.count_of(domain));
  uint32_t number = 0;
  for (T& value : array.values<T>()) {
    const double noise = random.unit();
    value = static_cast<T>(number++ / 16 + 4 * noise);
  }
  mesh.arrays.push_back(std::move(array));
}

Mesh random_bricks(uint64_t seed, Cut cut) {
  Random random(seed);
  Mesh mesh;
  const uint32_t n = random.between(1, 5);
  if (random.chance(50))
    add_points<float>(mesh, n, random);
  else
    add_points<double>(mesh, n, random);
  mesh.blocks.push_back(bricks(n, cut, random));
  add_values<float>(mesh, "T", Domain::point, 1, random);
  add_values<double>(mesh, "U", Domain::point, 3, random);
  add_values<int32_t>(mesh, "region", Domain::cell, 1, random);
  add_values<float>(mesh, "p", Domain::cell, 1, random);
  return mesh;
}

std::vector<NamedMesh> all_meshes() {
  std::vector<NamedMesh> meshes = {{"tetrahedron", tetrahedron()}, {"cube", cube()},
                                   {"torus", torus(40, 25)},       {"grid", grid(30, 20)},
                                   {"sphere", sphere(24, 16)},     {"moebius", moebius(20, 3)}};
  for (uint64_t seed = 0; seed < 150; ++seed) {
    const std::string name = "surface" + std::to_string(seed);
    meshes.push_back({name, random_surface(seed, {.other_cells = seed % 3 == 0})});
  }
  for (uint64_t seed = 0; seed < 42; ++seed) {
    const std::string name = "bricks" + std::to_string(seed);
    meshes.push_back({name, random_bricks(seed, static_cast<Cut>(seed % 3)), true});
  }
  RandomVolumeOptions without_corners;  // which streams do not take
  without_corners.corner_arrays = false;
  for (uint64_t seed = 0; seed < 20; ++seed)
    meshes.push_back({"soup" + std::to_string(seed), random_volume(seed, without_corners)});
  return meshes;
}

/// `only`: files whose name begins so.
bool write_all(const Output& output, const std::string& only) {
  bool well = true;
  size_t number = 0;
  for (const NamedMesh& mesh : all_meshes()) {
    for (const Way& way : ways_for(mesh, number++)) {
      const std::string name = mesh.name + "-" + way.name;
      if (!name.starts_with(only)) continue;
      const std::string wrong = write_way(output, name, mesh.mesh, way);
      if (wrong.empty()) continue;
      std::fprintf(stderr, "%s: %s\n", name.c_str(), wrong.c_str());
      well = false;
    }
  }
  return well;
}

}  // namespace
}  // namespace maille::testing

int main(int count, char** arguments) {
  using namespace maille::testing;
  if (count > 3) {
    std::fputs("usage: determinism [FOLDER [NAME]]\n", stderr);
    return 2;
  }
  return write_all(Output(count > 1 ? arguments[1] : ""), count > 2 ? arguments[2] : "") ? 0 : 1;
}
