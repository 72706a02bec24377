#include "goals.h"

#include <fmt/format.h>
#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/io.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include "draco_arrays.h"
#include "paths.h"
#include "peers/workload.h"

namespace maille::bench {
namespace {

/// A mesh of more cells is cut into parts (EncodeOptions::most_cells_per_part).
constexpr uint64_t large = 400'000;

Tolerance bits(double number) {
  return {Tolerance::Kind::bits, number};
}

EncodeOptions level(int effort) {
  EncodeOptions options;
  options.effort = effort;
  return options;
}

std::optional<EncodeReport> encoded(const Mesh& mesh, const EncodeOptions& options,
                                    std::vector<std::byte>* into = nullptr) {
  std::vector<std::byte> bytes;
  const auto report = encode(mesh, *memory_sink(into ? *into : bytes), options);
  if (!report) fmt::print("not encoded: {}\n", report.error().message);
  return report ? std::optional(*report) : std::nullopt;
}

Mesh as_doubles(const Mesh& mesh) {
  Mesh wide = mesh;
  wide.points = make_array(mesh.points.name, Domain::point, Scalar::f64, 3);
  wide.points.resize(mesh.point_count());
  const auto from = mesh.points.values<float>();
  std::copy(from.begin(), from.end(), wide.points.values<double>().begin());
  return wide;
}

/// Numbers as a text of six digits has them, as doubles, and the floats nearest to these.
struct Decimals {
  Mesh floats, doubles;
};

Decimals decimals(const Mesh& mesh) {
  Decimals both{mesh, as_doubles(mesh)};
  for (size_t i = 0; i < 3 * mesh.point_count(); ++i) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", double{mesh.points.values<float>()[i]});
    both.doubles.points.values<double>()[i] = std::strtod(text, nullptr);
    both.floats.points.values<float>()[i] = std::strtof(text, nullptr);
  }
  return both;
}

/// The unit normal of each facet, zero where there is none, computed in T and rounded to float.
template <class T>
Array facet_normals(const Mesh& mesh) {
  Array normals = make_array("normal", Domain::cell, Scalar::f32, 3, Role::normal);
  normals.resize(mesh.cell_count());
  const auto xyz = mesh.points.values<float>();
  float* out = normals.values<float>().data();
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i, out += 3) {
      const auto face = block.cell(i);
      T a[3], b[3];
      for (size_t k = 0; k < 3; ++k) {
        a[k] = T{xyz[3 * size_t{face[1]} + k]} - T{xyz[3 * size_t{face[0]} + k]};
        b[k] = T{xyz[3 * size_t{face[2]} + k]} - T{xyz[3 * size_t{face[0]} + k]};
      }
      const T n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
      const T length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
      for (size_t k = 0; k < 3; ++k) out[k] = length > 0 ? static_cast<float>(n[k] / length) : 0.0F;
    }
  }
  return normals;
}

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

template <class Work>
double best_of(int times, const Work& work) {
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < times; ++i) {
    const double start = wall_seconds();
    work();
    best = std::min(best, wall_seconds() - start);
  }
  return best;
}

class Goals {
 public:
  explicit Goals(const GoalsOptions& options) : options_(options) {
    if (!options.json.empty()) json_.open(options.json);
  }

  bool run() {
    for (const std::string& path : meshes_in(options_.paths)) run_file(path);
    return ok_;
  }

 private:
  void run_file(const std::string& path) {
    const auto read = read_mesh(path);
    if (!read) return;
    const Mesh& mesh = read->mesh;
    if (options_.most_faces > 0 && mesh.cell_count() > options_.most_faces) return;
    const auto surface = surface_of(mesh);
    if (!surface) return;
    file_ = path;
    const Mesh floats = make_workload(*surface, 0).mesh_for_maille;
    const std::string folder = folder_of(path);
    if (folder == "tri" || folder == "poly") doubles(floats);
    if (folder == "tri" && surface->faces() > large) parts(make_workload(*surface, 14).mesh_for_maille);
    normals(mesh);
    textures(mesh);
    if (mesh_name(path) == "stanford_dragon_vrip") random(floats);
  }

  void tell(const std::string& goal, const std::string& variant, int effort, double value) {
    fmt::print("{:10} {:30} {:24} -{} {:.4f}\n", goal, mesh_name(file_), variant, effort, value);
    std::fflush(stdout);
    if (!json_.is_open()) return;
    json_ << nlohmann::json{{"goal", goal},
                            {"folder", folder_of(file_)},
                            {"mesh", mesh_name(file_)},
                            {"variant", variant},
                            {"level", effort},
                            {"value", value}}
                 .dump()
          << std::endl;
  }

  // Bytes of a file over those of another.
  void ratio(const std::string& goal, const std::string& variant, const Mesh& a, const EncodeOptions& for_a,
             const Mesh& b, const EncodeOptions& for_b) {
    const auto first = encoded(a, for_a), second = encoded(b, for_b);
    ok_ = ok_ && first && second;
    if (!first || !second) return;
    tell(goal, variant, for_a.effort,
         static_cast<double>(first->file_bytes) / static_cast<double>(second->file_bytes));
  }

  void doubles(const Mesh& mesh) {
    if (mesh.cell_count() > 100'000) return;  // enough of them are smaller
    const Mesh wide = as_doubles(mesh);
    const Decimals text = decimals(mesh);
    for (const int effort : {2, 5, 9}) {
      ratio("doubles", "floats", wide, level(effort), mesh, level(effort));
      ratio("doubles", "decimals", text.doubles, level(effort), text.floats, level(effort));
    }
  }

  void parts(const Mesh& mesh) {
    const auto threads = thread_executor(2);
    for (const int effort : {2, 5}) {
      EncodeOptions whole = level(effort), parallel = level(effort);
      whole.most_cells_per_part = ~uint64_t{0};
      parallel.executor = threads.get();
      ratio("parts", "bytes", mesh, level(effort), mesh, whole);
      std::vector<std::byte> file;
      const double one = best_of(2, [&] { encoded(mesh, level(effort)); });
      const double two = best_of(2, [&] {
        file.clear();
        encoded(mesh, parallel, &file);
      });
      tell("parts", "encode, two threads", effort, one / two);
      DecodeOptions decoding;
      const double back =
          best_of(3, [&] { ok_ = decode(*memory_source(file), decoding).has_value() && ok_; });
      decoding.executor = threads.get();
      const double fast =
          best_of(3, [&] { ok_ = decode(*memory_source(file), decoding).has_value() && ok_; });
      tell("parts", "decode, two threads", effort, back / fast);
    }
  }

  void normals(const Mesh& mesh) {
    const Array* stored = mesh.find("normal", Domain::cell);
    if (stored == nullptr || stored->type != Scalar::f32 || mesh.points.type != Scalar::f32) return;
    facets("as stored", mesh);
    Mesh computed = mesh;
    computed.arrays = {facet_normals<double>(mesh)};
    facets("computed in double", computed);
    computed.arrays = {facet_normals<float>(mesh)};
    facets("computed in float", computed);
  }

  void facets(const std::string& variant, const Mesh& mesh) {
    for (const int effort : {5, 9}) {
      const auto report = encoded(mesh, level(effort));
      if (!report) continue;
      for (const ArrayReport& array : report->arrays) {
        if (array.name == "normal")
          tell("normals", variant, effort,
               8 * static_cast<double>(array.coded_bytes) / static_cast<double>(mesh.cell_count()));
      }
    }
  }

  void textures(const Mesh& mesh) {
    const auto is_texture = [](const Array& array) { return array.role == Role::texture_coordinate; };
    if (std::none_of(mesh.arrays.begin(), mesh.arrays.end(), is_texture)) return;
    const auto draco = draco_texture_bytes(mesh);
    if (!draco) return;
    Mesh shape = mesh;
    std::erase_if(shape.arrays, [&](const Array& array) {
      return !is_float(array.type) || (array.role != Role::normal && !is_texture(array));
    });
    for (const int effort : {5, 9}) {
      const auto with = encoded(shape, lossy(shape, effort));
      Mesh bare = shape;
      std::erase_if(bare.arrays, is_texture);
      const auto without = encoded(bare, lossy(bare, effort));
      if (with && without)
        tell("textures", "bytes / draco", effort,
             (static_cast<double>(with->file_bytes) - static_cast<double>(without->file_bytes)) /
                 static_cast<double>(*draco));
    }
  }

  static EncodeOptions lossy(const Mesh& mesh, int effort) {
    EncodeOptions options = level(effort);
    options.positions = bits(14);
    for (const Array& array : mesh.arrays)
      options.arrays[array.name] = bits(array.role == Role::normal ? 10 : 12);
    return options;
  }

  // The lattice of 2^-15 that docs/random-access.md and Nexus have: 12.7 bits of the dragon's longest side.
  void random(const Mesh& mesh) {
    for (const int effort : {2, 5}) {
      EncodeOptions options = level(effort);
      options.mode = Mode::random;
      options.positions = {Tolerance::Kind::absolute, 1.52587890625e-5};
      const auto report = encoded(mesh, options);
      if (report)
        tell("random", "bytes a triangle", effort,
             static_cast<double>(report->file_bytes) / static_cast<double>(mesh.cell_count()));
    }
  }

  const GoalsOptions& options_;
  std::ofstream json_;
  std::string file_;
  bool ok_ = true;
};

}  // namespace

bool measure_goals(const GoalsOptions& options) {
  return Goals(options).run();
}

}  // namespace maille::bench
