#include "support/random_mesh.h"

#include "support/pathologies.h"
#include "support/random_arrays.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

namespace maille::testing {

namespace {

bool repeats_a_point(std::vector<uint32_t> face) {
  std::sort(face.begin(), face.end());
  return face.size() < 3 || std::adjacent_find(face.begin(), face.end()) != face.end();
}

Surface random_faces(Random& random, const RandomMeshOptions& options) {
  const uint32_t faces =
      random.chance(10) ? random.between(1, 4) : random.between(1, std::max(1u, options.faces));
  Surface surface = random_shape(random, faces);
  if (random.chance(50)) vary_degrees(surface, random);
  if (options.pathologies && !surface.points.empty() && random.chance(75))
    mutilate(surface, random, options.degenerate_faces);
  if (random.chance(40)) shuffle(surface.faces, random);
  if (!options.degenerate_faces) std::erase_if(surface.faces, repeats_a_point);
  return surface;
}

/// Other magnitudes, steps and noise than the shapes have: all change how floats compress.
void vary_positions(Surface& surface, Random& random) {
  static constexpr double scales[] = {1, 1, 1000, 1e-30, 1e30, 0.001, -7};
  const double scale = scales[random.below(std::size(scales))];
  const double shift = random.chance(20) ? 1e6 : 0;
  const double noise = random.chance(40) ? 0.1 : 0;
  const bool stepped = random.chance(20);
  const bool flat = random.chance(10);
  for (auto& point : surface.points) {
    for (double& x : point) {
      x = scale * (x + noise * random.unit()) + shift;
      if (stepped) x = std::floor(x);
    }
    if (flat) point[2] = 0;
  }
}

Scalar position_type(Random& random, const RandomMeshOptions& options) {
  if (!options.any_position_type || random.chance(60)) return Scalar::f32;
  return random.chance(60) ? Scalar::f64 : static_cast<Scalar>(random.below(scalar_count));
}

CellType compact_type(size_t degree) {
  return degree == 3 ? CellType::triangle : degree == 4 ? CellType::quad : CellType::polygon;
}

/// The faces first ... last - 1 as one block: triangles or quads where all are, polygons, or one type per
/// face.
CellBlock block_of(const Surface& surface, size_t first, size_t last, Random& random) {
  CellBlock block;
  const auto degree_is = [&](size_t n) {
    return std::all_of(&surface.faces[first], &surface.faces[first] + (last - first),
                       [&](const auto& f) { return f.size() == n; });
  };
  if (random.chance(70) && last > first && (degree_is(3) || degree_is(4))) {
    block.type = compact_type(surface.faces[first].size());
  } else {
    block.type = random.chance(20) ? CellType::mixed : CellType::polygon;
    block.offsets.push_back(0);
  }
  for (size_t f = first; f < last; ++f) {
    const auto& face = surface.faces[f];
    block.connectivity.insert(block.connectivity.end(), face.begin(), face.end());
    if (!block.offsets.empty()) block.offsets.push_back(block.connectivity.size());
    if (block.type == CellType::mixed) {
      block.types.push_back(
          static_cast<uint8_t>(random.chance(70) ? compact_type(face.size()) : CellType::polygon));
    }
  }
  return block;
}

std::vector<CellBlock> random_blocks(Surface& surface, Random& random, const RandomMeshOptions& options) {
  static const char* const names[] = {"", "", "wing", "body", "größe"};
  if (options.several_blocks && random.chance(20)) {
    std::stable_sort(surface.faces.begin(), surface.faces.end(),
                     [](const auto& a, const auto& b) { return a.size() < b.size(); });
  }
  std::vector<CellBlock> blocks;
  for (size_t first = 0; first < surface.faces.size() || blocks.empty();) {
    size_t last = surface.faces.size();
    if (random.chance(40)) last = first + random.below(last - first + 1);
    blocks.push_back(surface.faces.empty() ? CellBlock{} : block_of(surface, first, last, random));
    blocks.back().name = names[random.below(std::size(names))];
    first = last;
    if (surface.faces.empty()) break;
  }
  return blocks;
}

CellBlock random_cells(const Mesh& mesh, Random& random) {
  static constexpr CellType types[] = {
      CellType::vertex,         CellType::line,        CellType::poly_line,
      CellType::poly_vertex,    CellType::tetrahedron, CellType::hexahedron,
      CellType::wedge,          CellType::pyramid,     CellType::quadratic_triangle,
      CellType::triangle_strip, CellType::mixed};
  CellBlock block;
  block.type = types[random.below(std::size(types))];
  if (nodes_of(block.type) == 0) block.offsets.push_back(0);
  for (uint32_t i = random.between(1, 6); i > 0; --i) {
    const CellType type =
        block.type == CellType::mixed ? types[random.below(std::size(types) - 1)] : block.type;
    const unsigned nodes = nodes_of(type) != 0 ? nodes_of(type) : random.below(6);
    for (unsigned k = 0; k < nodes; ++k) block.connectivity.push_back(random.below(mesh.point_count()));
    if (block.type == CellType::mixed) block.types.push_back(static_cast<uint8_t>(type));
    if (!block.offsets.empty()) block.offsets.push_back(block.connectivity.size());
  }
  return block;
}

/// tuples[i] of the result is tuple order[i] of the array.
void reorder(Array& array, const std::vector<uint64_t>& order) {
  const size_t size = array.tuple_size();
  std::vector<std::byte> bytes(array.bytes.size());
  for (size_t i = 0; i < order.size(); ++i)
    std::copy_n(&array.bytes[order[i] * size], size, &bytes[i * size]);
  array.bytes = std::move(bytes);
}

/// Old numbers by new number, for the three domains that have an order.
struct NewOrder {
  std::vector<uint64_t> points, cells, corners;
};

void apply(Mesh& mesh, const NewOrder& order) {
  if (!order.points.empty()) reorder(mesh.points, order.points);
  for (Array& array : mesh.arrays) {
    if (array.domain == Domain::point && !order.points.empty()) reorder(array, order.points);
    if (array.domain == Domain::cell) reorder(array, order.cells);
    if (array.domain == Domain::corner) reorder(array, order.corners);
  }
}

CellType type_of(const CellBlock& block, uint64_t cell) {
  return block.type == CellType::mixed ? static_cast<CellType>(block.types[cell]) : block.type;
}

/// Rebuilds a block with its cells in the given order, `corners_of` saying which old corner comes where, and
/// notes it in `order`.
template <class CornersOf>
void rebuild(CellBlock& block, const std::vector<uint64_t>& cells, NewOrder& order, CornersOf corners_of) {
  const CellBlock old = block;
  const uint64_t first_cell = order.cells.size(), first_corner = order.corners.size();
  block.connectivity.clear();
  block.types.clear();
  block.face_sizes.clear();
  if (!block.cell_faces.empty()) block.cell_faces.assign(1, 0);
  if (!block.offsets.empty()) block.offsets.assign(1, 0);
  for (const uint64_t cell : cells) {
    const auto nodes = old.cell(cell);
    const auto begin = static_cast<uint64_t>(nodes.data() - old.connectivity.data());
    for (size_t i = 0; i < nodes.size(); ++i) {
      const size_t from = corners_of(type_of(old, cell), nodes.size(), i);
      block.connectivity.push_back(nodes[from]);
      order.corners.push_back(first_corner + begin + from);
    }
    order.cells.push_back(first_cell + cell);
    if (!old.types.empty()) block.types.push_back(old.types[cell]);
    const auto faces = old.faces(cell);
    block.face_sizes.insert(block.face_sizes.end(), faces.begin(), faces.end());
    if (!old.cell_faces.empty()) block.cell_faces.push_back(block.face_sizes.size());
    if (!old.offsets.empty()) block.offsets.push_back(block.connectivity.size());
  }
}

std::vector<uint64_t> numbers_up_to(uint64_t count) {
  std::vector<uint64_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), uint64_t{0});
  return numbers;
}

}  // namespace

Mesh random_surface(uint64_t seed, const RandomMeshOptions& options) {
  Random random(seed);
  Surface surface = random_faces(random, options);
  vary_positions(surface, random);
  Mesh mesh = to_mesh(surface, position_type(random, options));
  if (options.several_blocks && random.chance(40)) mesh.blocks = random_blocks(surface, random, options);
  if (options.special_values && random.chance(15)) {
    sprinkle_special_values(mesh.points, random, random.chance(70) ? 3 : 60);
  }
  if (options.other_cells && mesh.point_count() > 0) {
    for (uint32_t i = random.below(4); i > 0; --i) {
      // Compilers evaluate arguments in different orders.
      CellBlock cells = random_cells(mesh, random);
      mesh.blocks.insert(mesh.blocks.begin() + random.below(mesh.blocks.size() + 1), std::move(cells));
    }
  }
  if (options.arrays) add_random_arrays(mesh, random, options.special_values);
  if (random.chance(20))
    mesh.metadata = {{"comment", "seed " + std::to_string(seed)}, {"comment", ""}, {"unit", "mm"}};
  return mesh;
}

Mesh shuffled(const Mesh& mesh, uint64_t seed) {
  Random random(seed);
  Mesh result = mesh;
  NewOrder order;
  order.points = numbers_up_to(mesh.point_count());
  shuffle(order.points, random);
  std::vector<uint32_t> new_number(order.points.size());
  for (size_t i = 0; i < order.points.size(); ++i) new_number[order.points[i]] = static_cast<uint32_t>(i);
  for (CellBlock& block : result.blocks) {
    std::vector<uint64_t> cells = numbers_up_to(block.size());
    shuffle(cells, random);
    size_t turn = 0;
    rebuild(block, cells, order, [&](CellType type, size_t degree, size_t i) {
      if (i == 0) turn = is_face(type) ? random.below(degree) : 0;
      return (i + turn) % degree;
    });
    for (uint32_t& point : block.connectivity) point = new_number[point];
  }
  apply(result, order);
  return result;
}

Mesh flipped(const Mesh& mesh, uint64_t seed, unsigned percent) {
  Random random(seed);
  Mesh result = mesh;
  NewOrder order;
  for (CellBlock& block : result.blocks) {
    bool flip = false;
    rebuild(block, numbers_up_to(block.size()), order, [&](CellType type, size_t degree, size_t i) {
      if (i == 0) flip = is_face(type) && random.chance(percent);
      return flip ? degree - 1 - i : i;
    });
  }
  apply(result, order);
  return result;
}

}  // namespace maille::testing
