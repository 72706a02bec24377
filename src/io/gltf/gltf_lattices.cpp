// The lattices of tolerances that go by a range ("14 bits"): each mesh of the asset has one for all of its
// primitives, as their common borders would open otherwise, and small meshes share one, and so a file.
#include <algorithm>
#include <cmath>

#include "io/gltf/gltf_compress.h"
#include "io/gltf/gltf_weights.h"

namespace maille {
namespace {

/// What finer lattices than asked for may cost all meshes that share one, in bits; then a new one pays. A
/// file of its own costs 350 to 450 bytes, measured with 200 spheres of 25 to 144 points.
constexpr double bits_of_a_file = 2400;

/// What is no tolerance is left to encode(), which says so.
bool goes_by_range(const Tolerance& tolerance) {
  using Kind = Tolerance::Kind;
  return (tolerance.kind == Kind::bits && tolerance.value >= 1 && tolerance.value <= 62) ||
         (tolerance.kind == Kind::relative && tolerance.value > 0);
}

struct Range {
  std::vector<double> low, high;

  void add(std::span<const float> values, size_t components) {
    low.resize(components, INFINITY);
    high.resize(components, -INFINITY);
    for (size_t i = 0; i < values.size(); ++i) {
      if (!std::isfinite(values[i])) continue;
      low[i % components] = std::min(low[i % components], static_cast<double>(values[i]));
      high[i % components] = std::max(high[i % components], static_cast<double>(values[i]));
    }
  }
  /// The error that a tolerance by range allows, as encode() has it for positions and for arrays.
  double error(const Tolerance& tolerance, bool are_positions) const {
    double longest = 0, squares = 0;
    for (size_t k = 0; k < low.size(); ++k) {
      const double side = std::max(high[k] - low[k], 0.0);
      longest = std::max(longest, side);
      squares += side * side;
    }
    // Bits: 2^bits - 1 steps over the longest side, of which the error is half a one.
    if (tolerance.kind == Tolerance::Kind::bits)
      return longest / (std::ldexp(1.0, static_cast<int>(tolerance.value)) - 1) / 2;
    return tolerance.value * (are_positions ? std::sqrt(squares) : longest);
  }
};

/// The logarithm to base 2, by lines between powers of 2: less than 0.09 off, and the same on every machine.
double octaves(double ratio) {
  int exponent = 0;
  const double part = std::frexp(ratio, &exponent);
  return exponent - 1 + (2 * part - 1);
}

/// Makes meshes share the finer errors of both if that costs less than a file.
bool join(GltfLattice& lattice, const GltfLattice& other) {
  GltfLattice both = lattice;
  ++both.meshes;
  for (const auto& [name, values] : other.arrays) {
    GltfLattice::Values& finest = both.arrays[name];
    if ((values.error > 0) != (finest.error > 0)) return false;
    if (values.error > finest.error)
      both.bits += octaves(values.error / finest.error) * static_cast<double>(values.numbers);
    if (values.error < finest.error)
      both.bits += octaves(finest.error / values.error) * static_cast<double>(finest.numbers);
    finest.error = std::min(finest.error, values.error);
    finest.numbers += values.numbers;
  }
  if (both.arrays.size() != other.arrays.size() || both.bits > bits_of_a_file) return false;
  lattice = std::move(both);
  return true;
}

}  // namespace

Tolerance GltfLattice::tolerance_of(const std::string& array, const Tolerance& asked) const {
  const auto found = arrays.find(array);
  if (found == arrays.end()) return asked;
  const double error = found->second.error;
  return error > 0 ? Tolerance{Tolerance::Kind::absolute, error} : Tolerance{};
}

/// nullptr where the values are kept, or no range matters: normals and tangents have the same one everywhere.
const Tolerance* GltfCompressor::tolerance_by_range(const GltfVertices::Attribute& attribute) const {
  const auto asked = options_.encoding.arrays.find(attribute.name);
  const bool are_positions = attribute.name == gltf_positions;
  const bool has_range = attribute.role != Role::normal && attribute.role != Role::tangent;
  if (attribute.layout.type != Scalar::f32 || !has_range || is_gltf_weights(attribute.name)) return nullptr;
  if (!are_positions && asked == options_.encoding.arrays.end()) return nullptr;
  const Tolerance& tolerance = are_positions ? options_.encoding.positions : asked->second;
  return goes_by_range(tolerance) ? &tolerance : nullptr;
}

Result<GltfLattice> GltfCompressor::lattice_of(const std::vector<size_t>& vertices) const {
  GltfLattice lattice;
  std::map<std::string, Range> ranges;
  std::map<std::string, const Tolerance*> tolerances;
  for (const size_t v : vertices) {
    for (const auto& attribute : vertices_[v].attributes) {
      const Tolerance* tolerance = tolerance_by_range(attribute);
      if (tolerance == nullptr) continue;
      const Array values = MAILLE_TRY(values_of(attribute, vertices_[v].count));
      ranges[attribute.name].add(values.values<float>(), attribute.layout.components());
      tolerances[attribute.name] = tolerance;
      lattice.arrays[attribute.name].numbers += values.count() * values.components;
    }
  }
  for (const auto& [name, range] : ranges)
    lattice.arrays[name].error = range.error(*tolerances[name], name == gltf_positions);
  return lattice;
}

/// Meshes share a lattice only where it lets them share files: with the same kinds of vertices, those whose
/// errors are closest.
Result<> GltfCompressor::choose_lattices() {
  struct Each {
    std::vector<size_t> vertices;
    std::set<std::string> kinds;
    GltfLattice lattice;
  };
  std::vector<Each> meshes(model_.meshes.size());
  for (size_t v = 0; v < vertices_.size(); ++v) {
    meshes[vertices_[v].mesh].vertices.push_back(v);
    meshes[vertices_[v].mesh].kinds.insert(kind_of(v));
  }
  std::vector<std::pair<double, size_t>> order;  // error of positions, mesh
  for (size_t m = 0; m < meshes.size(); ++m) {
    meshes[m].lattice = MAILLE_TRY(lattice_of(meshes[m].vertices));
    const auto positions = meshes[m].lattice.arrays.find(gltf_positions);
    order.emplace_back(positions == meshes[m].lattice.arrays.end() ? 0 : positions->second.error, m);
  }
  std::sort(order.begin(), order.end());
  std::map<std::set<std::string>, size_t> latest;  // lattice, by the kinds of its meshes
  lattice_of_mesh_.resize(meshes.size());
  for (const auto& [error, m] : order) {
    Each& mesh = meshes[m];
    const auto [place, is_new] = latest.emplace(std::move(mesh.kinds), lattices_.size());
    if (is_new || !join(lattices_[place->second], mesh.lattice)) {
      place->second = lattices_.size();
      lattices_.push_back(std::move(mesh.lattice));
    }
    lattice_of_mesh_[m] = place->second;
  }
  return {};
}

}  // namespace maille
