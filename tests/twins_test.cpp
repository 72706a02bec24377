// Points that stand twice where an array has a seam: coded as one, and back as they were.
#include "support/codec.h"
#include "support/random.h"
#include "support/random_mesh.h"
#include "support/shapes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <maille/file.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace maille::testing {
namespace {

/// Every corner whose key differs gets a point of its own: `key` by cell and corner of the cell.
template <class Key>
Mesh split(const Mesh& mesh, Key key) {
  Mesh with_twins = mesh;
  std::map<std::pair<uint32_t, uint64_t>, uint32_t> numbers;
  std::vector<uint32_t> sources;
  uint64_t cell = 0;
  for (CellBlock& block : with_twins.blocks) {
    for (uint64_t i = 0, at = 0; i < block.size(); ++i, ++cell) {
      const uint64_t end = at + block.cell(i).size();
      for (uint64_t k = 0; at < end; ++at, ++k) {
        uint32_t& point = block.connectivity[at];
        const auto [found, is_new] = numbers.try_emplace({point, key(cell, k)}, sources.size());
        if (is_new) sources.push_back(point);
        point = found->second;
      }
    }
  }
  const auto take = [&](Array& array) {
    Array taken = array;
    taken.resize(sources.size());
    for (size_t i = 0; i < sources.size(); ++i)
      std::copy_n(&array.bytes[sources[i] * array.tuple_size()], array.tuple_size(),
                  &taken.bytes[i * array.tuple_size()]);
    array = taken;
  };
  take(with_twins.points);
  for (Array& array : with_twins.arrays) {
    if (array.domain == Domain::point) take(array);
  }
  return with_twins;
}

template <class T>
void make_rough(std::span<T> numbers) {
  for (size_t i = 0; i < numbers.size(); ++i)
    numbers[i] += static_cast<T>(i * 2654435761 >> 20 & 1023) / 8192;
}
void make_rough(Array& points) {
  if (points.type == Scalar::f32) return make_rough(points.values<float>());
  make_rough(points.values<double>());
}

/// A torus of triangles in 20 charts, which have points of their own.
Mesh with_seams(Scalar type = Scalar::f32) {
  Mesh whole = to_mesh(triangulated(shapes::torus(40, 30)), type);
  make_rough(whole.points);
  whole.blocks[0].type = CellType::triangle;
  whole.blocks[0].offsets.clear();
  const uint64_t cells = whole.cell_count();
  const auto chart = [&](uint64_t cell, uint64_t) { return cell * 20 / cells; };
  Mesh mesh = split(whole, chart);
  Array uv = make_array("uv", Domain::point, Scalar::f32, 2, Role::texture_coordinate);
  Array shade = make_array("shade", Domain::point, Scalar::u8, 1);
  uv.resize(mesh.point_count());
  shade.resize(mesh.point_count());
  for (uint64_t cell = 0; cell < cells; ++cell) {
    for (const uint32_t point : mesh.blocks[0].cell(cell)) {
      for (size_t k = 0; k < 2; ++k) {
        const size_t at = 3 * size_t{point} + k;
        const double x =
            type == Scalar::f32 ? double{mesh.points.values<float>()[at]} : mesh.points.values<double>()[at];
        uv.values<float>()[2 * point + k] =
            static_cast<float>(static_cast<double>(chart(cell, 0)) + std::floor(x * 64) / 64);
      }
      shade.values<uint8_t>()[point] = 7;
    }
  }
  mesh.arrays = {uv, shade};
  return mesh;
}

bool is_welded(const std::vector<std::byte>& bytes) {
  const auto info = inspect(*memory_source(Bytes(bytes)));
  return info && std::any_of(info->chunks.begin(), info->chunks.end(),
                             [](const auto& chunk) { return chunk.type == "TWIN"; });
}

std::string round_trip(const Mesh& mesh, const EncodeOptions& options, bool welded = true) {
  const auto encoded = encode_bytes(mesh, options);
  if (!encoded) return "encode: " + encoded.error().message;
  if (welded && !is_welded(encoded->bytes)) return "not welded";
  const auto decoded = decode_bytes(encoded->bytes);
  if (!decoded) return "decode: " + decoded.error().message;
  return differences_between(mesh, *decoded, options.order == Order::keep);
}

EncodeOptions level(int effort, Order order = Order::canonical) {
  EncodeOptions options;
  options.mode = Mode::single;
  options.effort = effort;
  options.order = order;
  return options;
}

TEST(Twins, ComeBackAtEveryLevelInEitherOrder) {
  for (const int effort : {1, 2, 5, 9}) {
    for (const Order order : {Order::canonical, Order::keep}) {
      EXPECT_EQ(round_trip(with_seams(), level(effort, order)), "") << effort;
      EXPECT_EQ(round_trip(shuffled(with_seams(), 3), level(effort, order)), "") << effort;
    }
  }
}

TEST(Twins, OfDoublesAndOfPolygonsInSeveralBlocksComeBack) {
  EXPECT_EQ(round_trip(with_seams(Scalar::f64), level(5)), "");
  Mesh quads = torus(40, 30);
  quads.blocks[0].type = CellType::quad;
  quads.blocks[0].offsets.clear();
  CellBlock second = quads.blocks[0];
  quads.blocks[0].connectivity.resize(4 * 500);
  second.connectivity.erase(second.connectivity.begin(), second.connectivity.begin() + 4 * 500);
  quads.blocks.push_back(second);
  quads.blocks.push_back({"lines", CellType::line, {}, {}, {0, 1, 700, 701}});
  const Mesh mesh = split(quads, [](uint64_t cell, uint64_t) { return cell < 500 ? 0 : 1 + cell % 2; });
  for (const Order order : {Order::canonical, Order::keep}) EXPECT_EQ(round_trip(mesh, level(5, order)), "");
}

TEST(Twins, WithTheSameValuesComeBack) {
  // Every face has points of its own, and no array tells them apart.
  const Mesh soup =
      split(to_mesh(triangulated(shapes::torus(30, 20))), [](uint64_t cell, uint64_t) { return cell; });
  ASSERT_EQ(soup.point_count(), 3 * soup.cell_count());
  const auto encoded = encode_bytes(soup, level(5));
  ASSERT_TRUE(encoded);
  EXPECT_TRUE(is_welded(encoded->bytes));
  EXPECT_EQ(round_trip(soup, level(5)), "");
  EXPECT_EQ(round_trip(soup, level(2, Order::keep)), "");
}

TEST(Twins, AreAsManyAfterLoss) {
  const Mesh mesh = with_seams();
  EncodeOptions options = level(5);
  options.positions = {Tolerance::Kind::bits, 10};
  options.arrays["uv"] = {Tolerance::Kind::bits, 4};
  const auto encoded = encode_bytes(mesh, options);
  ASSERT_TRUE(encoded);
  EXPECT_TRUE(is_welded(encoded->bytes));
  const auto decoded = decode_bytes(encoded->bytes);
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->point_count(), mesh.point_count());
  const auto again = encode_bytes(*decoded, options);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->bytes, encoded->bytes);
}

TEST(Twins, AreTheSplitPointsInReportAndDescription) {
  const Mesh mesh = with_seams();
  const auto encoded = encode_bytes(mesh, level(5));
  ASSERT_TRUE(encoded);
  ASSERT_TRUE(is_welded(encoded->bytes));
  const auto info = inspect(*memory_source(Bytes(encoded->bytes)));
  ASSERT_TRUE(info);
  EXPECT_EQ(info->points, mesh.point_count());
  EXPECT_EQ(encoded->report.points, mesh.point_count());
  EXPECT_EQ(info->positions.count, mesh.point_count());
  for (size_t i = 0; i < mesh.arrays.size(); ++i) {
    EXPECT_EQ(info->arrays[i].domain, Domain::point);
    EXPECT_EQ(info->arrays[i].count, mesh.point_count());
    EXPECT_EQ(info->arrays[i].coded_bytes, encoded->report.arrays[i].coded_bytes);
    EXPECT_EQ(encoded->report.arrays[i].domain, Domain::point);
  }
  EXPECT_EQ(info->connectivity.coded_bytes, encoded->report.connectivity.coded_bytes);
}

TEST(Twins, ComeBackWhenOnlySomeArraysAreWanted) {
  const Mesh mesh = with_seams();
  const auto encoded = encode_bytes(mesh, level(5));
  ASSERT_TRUE(encoded && is_welded(encoded->bytes));
  for (const std::vector<std::string>& wanted :
       std::vector<std::vector<std::string>>{{}, {"shade"}, {"uv"}}) {
    DecodeOptions options;
    options.arrays = wanted;
    const auto decoded = decode_bytes(encoded->bytes, options);
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_EQ(decoded->point_count(), mesh.point_count());
    EXPECT_EQ(decoded->arrays.size(), wanted.size());
    EXPECT_TRUE(validate(*decoded));
  }
}

TEST(Twins, OfAnyMeshComeBack) {
  RandomMeshOptions meshes;
  meshes.other_cells = true;
  uint64_t welded = 0, all = 0;
  for (const Order order : {Order::canonical, Order::keep}) {
    const auto property = [&](const Mesh& mesh) -> std::string {
      const Mesh with_twins = split(mesh, [&](uint64_t cell, uint64_t) { return cell % 3; });
      const auto encoded = encode_bytes(with_twins, level(5, order));
      if (!encoded) return encoded.error().message;
      welded += is_welded(encoded->bytes);
      ++all;
      return round_trip(with_twins, level(5, order), false);
    };
    EXPECT_EQ(check_random_surfaces(91000, 100, meshes, property), "");
  }
  EXPECT_GT(8 * welded, all);
}

TEST(Twins, OfADamagedStreamAreRefusedOrAMesh) {
  const auto encoded = encode_bytes(with_seams(), level(5));
  ASSERT_TRUE(encoded && is_welded(encoded->bytes));
  for (size_t at = 0; at < encoded->bytes.size(); at += 7) {
    std::vector<std::byte> damaged = encoded->bytes;
    damaged[at] ^= std::byte{0x10};
    const auto decoded = decode_bytes(damaged);
    if (decoded) {
      EXPECT_TRUE(validate(*decoded));
    }
  }
}

}  // namespace
}  // namespace maille::testing
