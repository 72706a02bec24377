#include "surface/arrays/facet_normal_coder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "numbers/number_maps.h"
#include "support/cases.h"
#include "support/coded_mesh.h"
#include "support/half_edges.h"
#include "support/random.h"
#include "support/random_mesh.h"

namespace maille::testing {
namespace {

/// Triangles of hills, 40 x 40, whose last row is flat.
Surface hills() {
  Surface surface = shapes::grid(40, 40);
  for (auto& p : surface.points) {
    const double x = p[0], y = p[1];
    p[2] = y < 38 ? 2 * std::sin(x / 3) * std::cos(y / 4) + x * y / 50 : 0;
  }
  return triangulated(surface);
}

Vector3 position(const Mesh& mesh, uint32_t point) {
  const std::byte* at = mesh.points.bytes.data() + point * mesh.points.tuple_size();
  const size_t size = size_of(mesh.points.type);
  return {{number_as_double(mesh.points.type, at), number_as_double(mesh.points.type, at + size),
           number_as_double(mesh.points.type, at + 2 * size)}};
}

Array normals_for(const Mesh& mesh, Scalar type = Scalar::f32) {
  Array array = make_array("normal", Domain::cell, type, 3, Role::normal);
  array.resize(mesh.cell_count());
  return array;
}

void set(Array& array, size_t cell, const Vector3& v) {
  for (unsigned k = 0; k < 3; ++k) {
    if (array.type == Scalar::f32) {
      array.values<float>()[3 * cell + k] = static_cast<float>(v[k]);
    } else {
      array.values<double>()[3 * cell + k] = v[k];
    }
  }
}

/// As a program with this formula writes them, from a corner that nothing tells.
Array computed(const Mesh& mesh, const FacetFormula& formula, Scalar type = Scalar::f32) {
  Array array = normals_for(mesh, type);
  Random random(5);
  for (size_t i = 0; i < array.count(); ++i) {
    const auto cell = mesh.blocks[0].cell(i);
    const size_t base = random.below(3);
    set(array, i,
        formula.normal(position(mesh, cell[base]), position(mesh, cell[(base + 1) % 3]),
                       position(mesh, cell[(base + 2) % 3])));
  }
  return array;
}

struct Coded {
  std::vector<std::byte> bytes;
  double bits = 0;  ///< for each cell
};

/// Codes an array, after a look at what the decoder makes of it.
Coded code(const CodedMesh& patch, const Array& array, const Tolerance& tolerance = {}) {
  const auto maps = choose_maps(array, tolerance, false);
  EXPECT_TRUE(maps);
  const auto sources = patch.sources(array);
  Coded coded{encode_array(patch.elements(), array, *maps, sources, false)};
  coded.bits = 8.0 * static_cast<double>(coded.bytes.size()) / static_cast<double>(array.count());
  Array decoded = make_array(array.name, array.domain, array.type, array.components, array.role);
  const auto done = decode_array(patch.elements(), coded.bytes, array.count(), decoded);
  EXPECT_TRUE(done) << (done ? "" : done.error().message);
  if (!done) return coded;
  const size_t size = array.tuple_size();
  for (size_t i = 0; i < sources.size(); ++i) {
    if (std::memcmp(array.bytes.data() + sources[i] * size, decoded.bytes.data() + i * size, size) == 0)
      continue;
    ADD_FAILURE() << "the normal of cell " << sources[i] << " is another one";
    break;
  }
  return coded;
}

TEST(FacetNormals, CostNothingWhereAFormulaInDoublesGivesThem) {
  const CodedMesh patch(to_mesh(hills()));
  for (unsigned bits = 0; bits < FacetFormula::count; bits += 4) {
    const FacetFormula formula{static_cast<uint8_t>(bits)};
    if (formula.cross_in_float() || formula.length_in_float()) continue;
    EXPECT_LT(code(patch, computed(patch.mesh, formula)).bits, 0.3) << bits;
  }
}

TEST(FacetNormals, OfAFormulaStayExactWhereABoundWouldTakeMore) {
  const CodedMesh patch(to_mesh(hills()));
  const Array array = computed(patch.mesh, {});
  EXPECT_EQ(code(patch, array, {Tolerance::Kind::bits, 10}).bytes.size(), code(patch, array).bytes.size());
}

TEST(FacetNormals, CostTheirCornerWhereAFormulaInFloatsGivesThem) {
  const CodedMesh patch(to_mesh(hills()));
  for (unsigned bits = 0; bits < FacetFormula::count; bits += 3)
    EXPECT_LT(code(patch, computed(patch.mesh, FacetFormula{static_cast<uint8_t>(bits)})).bits, 1.7) << bits;
}

TEST(FacetNormals, AreRoundedLikeTheNumbersOfTheFile) {
  const CodedMesh patch(to_mesh(hills()));
  Array array = computed(patch.mesh, {});
  for (float& x : array.values<float>()) x = static_cast<float>(std::floor(double{x} * 100 + 0.5) / 100);
  EXPECT_LT(code(patch, array).bits, 0.3);
}

TEST(FacetNormals, OfCornersBeforeTheyWereRoundedCostWhatRoundingTook) {
  const Mesh exact = to_mesh(hills(), Scalar::f64);
  Array array = computed(exact, {});
  Mesh rounded = exact;
  for (double& x : rounded.points.values<double>()) x = std::floor(x * 10000 + 0.5) / 10000;
  // Off by 5e-5 at edges of 1 to 4: ten bits above the unit of 6e-8, in two components.
  EXPECT_LT(code(CodedMesh(rounded), array).bits, 18);
  for (float& x : array.values<float>()) x = -x;
  EXPECT_LT(code(CodedMesh(rounded), array).bits, 18) << "inward";
}

TEST(FacetNormals, ComeAgainWhereFacesHaveTheSameDirection) {
  // A part and its mirror image, many times, with normals of another surface.
  Surface surface;
  for (int copy = 0; copy < 8; ++copy) {
    Surface part = triangulated(shapes::torus(12, 9));
    // No symmetry of its own, and positions that are moved without being rounded.
    for (size_t i = 0; i < 3 * part.points.size(); ++i) {
      double& x = part.points[i / 3][i % 3];
      x = std::floor(256 * x + static_cast<double>(i * i % 53)) / 256;
      if (copy % 2 != 0 && i % 3 == 0) x = -x;
    }
    append(surface, part, {32.0 * copy, 0, 0});
  }
  const CodedMesh patch(to_mesh(surface));
  Array array = normals_for(patch.mesh);
  Random random(7);
  const size_t cells = array.count() / 8;
  for (size_t i = 0; i < cells; ++i) {
    Vector3 v;
    for (double& x : v.x) x = 2 * random.unit() - 1;
    v = v * (1 / std::sqrt(dot(v, v)));
    for (size_t copy = 0; copy < 8; ++copy)
      set(array, copy * cells + i, {{copy % 2 == 0 ? v[0] : -v[0], v[1], v[2]}});
  }
  EXPECT_LT(code(patch, array).bits, 30);  // an eighth of some 75, and which of those it is
}

TEST(FacetNormals, OfAnyKindComeBack) {
  const double infinity = std::numeric_limits<double>::infinity();
  const std::vector<Vector3> odd = {{{0, 0, 0}},        {{-0.0, 0, -0.0}}, {{infinity, -infinity, NAN}},
                                    {{1e30, 1e-30, 0}}, {{5, 6, 7}},       {{1e-40, -1e-40, 1}}};
  for (uint64_t seed = 0; seed < cases(40); ++seed) {
    Random random(seed);
    const CodedMesh patch(random_surface(seed));
    if (patch.mesh.cell_count() == 0) continue;
    for (const Scalar type : {Scalar::f32, Scalar::f64}) {
      Array array = normals_for(patch.mesh, type);
      for (size_t i = 0; i < array.count(); ++i) {
        Vector3 v{{random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5}};
        if (random.chance(50)) v = v * (1 / std::sqrt(dot(v, v)));
        if (random.chance(20)) v = odd[random.below(odd.size())];
        set(array, i, v);
      }
      code(patch, array);
    }
  }
}

TEST(FacetNormals, OfTurnedFacesAreTheirOwn) {
  Surface surface = hills();
  for (size_t i = 0; i < surface.faces.size(); i += 3) std::swap(surface.faces[i][0], surface.faces[i][1]);
  const CodedMesh patch(to_mesh(surface));
  EXPECT_LT(code(patch, computed(patch.mesh, {})).bits, 0.4);
}

TEST(FacetNormals, OfDamagedStreamsAreRefusedOrAnything) {
  const CodedMesh patch(to_mesh(hills()));
  Array array = computed(patch.mesh, FacetFormula{3});
  Random random(11);
  for (float& x : array.values<float>()) x += random.chance(30) ? static_cast<float>(random.unit() / 100) : 0;
  const std::vector<std::byte> bytes = code(patch, array).bytes;
  ASSERT_EQ(bytes[0], std::byte{9}) << "they are coded as normals of facets";
  const auto decode = [&](const std::vector<std::byte>& damaged) {
    Array decoded = make_array(array.name, array.domain, array.type, array.components, array.role);
    const auto done = decode_array(patch.elements(), damaged, array.count(), decoded);
    EXPECT_EQ(decoded.count(), done ? array.count() : decoded.count());
  };
  for (size_t length = 0; length < bytes.size(); length += every(97))
    decode({bytes.begin(), bytes.begin() + static_cast<ptrdiff_t>(length)});
  for (uint64_t i = 0; i < cases(400); ++i) {
    std::vector<std::byte> damaged = bytes;
    for (uint64_t n = 0; n <= random.below(4); ++n)
      damaged[random.chance(50) ? random.below(40) : random.below(damaged.size())] =
          static_cast<std::byte>(random.next());
    decode(damaged);
  }
}

TEST(FacetNormals, OfAnyBytesAreRefusedOrAnything) {
  const std::vector<NumberMap> maps = {{NumberMap::Kind::ordered},
                                       {NumberMap::Kind::lattice, 0, 0.1, 1e-3},
                                       {NumberMap::Kind::lattice, 0, -1e300, 1e300},
                                       {NumberMap::Kind::decimal, 7},
                                       {NumberMap::Kind::binary_digits, -149, 0, 0, 24},
                                       {NumberMap::Kind::decimal_digits, -340, 0, 0, 7}};
  uint64_t decodable = 0;
  for (uint64_t seed = 0; seed < cases(400); ++seed) {
    Random random(seed);
    const CodedMesh patch(random_surface(seed));
    const Scalar type = random.chance(50) ? Scalar::f32 : Scalar::f64;
    ByteWriter out;
    out.put(uint8_t{9});
    out.put(uint8_t{0});
    out.put(static_cast<uint8_t>(random.below(FacetFormula::count)));
    out.put(static_cast<uint8_t>(random.below(32)));
    out.put(static_cast<int16_t>(static_cast<int>(random.below(1201)) - 600));
    const NumberMap& map = maps[random.below(maps.size())];
    for (unsigned k = 0; k < 3; ++k) write_map(out, map);
    out.put_count(1);  // bytes of exceptions: none
    out.put_count(0);
    for (uint32_t i = random.below(2000); i > 0; --i) out.put(static_cast<uint8_t>(random.next()));
    Array decoded = make_array("normal", Domain::cell, type, 3, Role::normal);
    const auto done = decode_array(patch.elements(), out.take(), 0, decoded);
    if (!done) continue;
    ++decodable;
    EXPECT_EQ(decoded.count(), patch.elements().cells()) << seed;
  }
  EXPECT_GT(decodable, cases(400) / 4);
}

}  // namespace
}  // namespace maille::testing
