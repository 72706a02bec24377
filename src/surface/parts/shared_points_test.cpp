#include "surface/parts/shared_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "support/random_mesh.h"
#include "support/shapes.h"
#include "surface/parts/mesh_parts.h"

namespace maille::testing {
namespace {

using Shared = std::vector<std::vector<SharedPoint>>;

/// Parts of a random mesh, whose points keep their order; every fourth mesh has few places for its points.
struct Parts {
  explicit Parts(uint64_t seed) : random(static_cast<unsigned>(seed)) {
    const Mesh mesh = random_surface(seed);
    points = static_cast<uint32_t>(mesh.point_count());
    std::vector<uint32_t> part_of(mesh.cell_count());
    for (uint32_t& part : part_of) part = static_cast<uint32_t>(random() % 4);
    MeshParts cut(mesh, part_of, serial_executor());
    for (size_t p = 0; p < cut.count(); ++p) {
      MeshPart part = cut.take(p);
      borders.push_back(points_on_borders(part.mesh));
      numbers.push_back(std::move(part.numbers.points));
    }
    places_there_are = seed % 4 == 0 ? 3 : points + 1;
    const std::vector<std::span<const uint32_t>> whole(numbers.begin(), numbers.end());
    shared = find_shared(whole, points, [this](uint32_t point) { return place(point); });
  }
  Place place(uint32_t point) const { return {point % places_there_are, 1, 2}; }
  std::vector<std::byte> bytes(size_t p) const {
    return encode_shared(shared[p], static_cast<uint32_t>(numbers[p].size()), borders[p]);
  }
  JoinedPoints join(const Shared& from) const {
    std::vector<PieceOfPoints> pieces;
    for (size_t p = 0; p < from.size(); ++p) {
      pieces.push_back({static_cast<uint32_t>(numbers[p].size()), from[p]});
      for (const SharedPoint& point : from[p]) pieces[p].places.push_back(place(numbers[p][point.point]));
    }
    return join_points(pieces);
  }

  std::mt19937 random;
  uint32_t points = 0, places_there_are = 0;
  std::vector<std::vector<uint32_t>> numbers, borders;  ///< by part
  Shared shared;
};

Result<Shared> decoded(const Parts& parts, const std::vector<std::vector<std::byte>>& bytes) {
  Shared shared;
  for (size_t p = 0; p < bytes.size(); ++p) {
    auto of_part = decode_shared(bytes[p], static_cast<uint32_t>(parts.numbers[p].size()), parts.borders[p]);
    if (!of_part) return tl::unexpected(of_part.error());
    shared.push_back(*of_part);
  }
  return shared;
}

TEST(SharedPoints, TellWhichPointsAreOne) {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    const Parts parts(seed);
    std::vector<std::vector<std::byte>> bytes;
    for (size_t p = 0; p < parts.numbers.size(); ++p) bytes.push_back(parts.bytes(p));
    const auto shared = decoded(parts, bytes);
    ASSERT_TRUE(shared);
    const JoinedPoints joined = parts.join(*shared);
    EXPECT_EQ(joined.count, parts.points);
    std::vector<uint32_t> number_of(parts.points, ~0u);
    for (size_t p = 0; p < parts.numbers.size(); ++p) {
      const std::vector<uint32_t> numbers = joined.parts[p].all_numbers();
      ASSERT_EQ(numbers.size(), parts.numbers[p].size());
      for (size_t i = 0; i < numbers.size(); ++i) {
        uint32_t& number = number_of[parts.numbers[p][i]];
        if (number == ~0u) number = numbers[i];
        EXPECT_EQ(number, numbers[i]);
      }
    }
    std::sort(number_of.begin(), number_of.end());
    for (uint32_t i = 0; i < parts.points; ++i) EXPECT_EQ(number_of[i], i);
  }
}

TEST(SharedPoints, PlainCutsTakeNoBytes) {
  const Mesh mesh = torus(20, 12);
  std::vector<uint32_t> part_of(mesh.cell_count());
  for (size_t i = part_of.size() / 2; i < part_of.size(); ++i) part_of[i] = 1;
  MeshParts cut(mesh, part_of, serial_executor());
  std::vector<MeshPart> parts;
  for (size_t p = 0; p < 2; ++p) parts.push_back(cut.take(p));
  const std::vector<std::span<const uint32_t>> whole{parts[0].numbers.points, parts[1].numbers.points};
  const auto shared = find_shared(whole, static_cast<uint32_t>(mesh.point_count()),
                                  [&](uint32_t point) { return place_of(mesh.points, point); });
  for (size_t p = 0; p < 2; ++p) {
    EXPECT_FALSE(shared[p].empty());
    EXPECT_TRUE(
        encode_shared(shared[p], static_cast<uint32_t>(whole[p].size()), points_on_borders(parts[p].mesh))
            .empty());
  }
}

TEST(SharedPoints, DamageGivesAnErrorOrNumbersThatExist) {
  unsigned errors = 0;
  for (uint64_t seed = 0; seed < 40; ++seed) {
    Parts parts(seed);
    for (int i = 0; i < 50; ++i) {
      std::vector<std::vector<std::byte>> bytes;
      for (size_t p = 0; p < parts.numbers.size(); ++p) bytes.push_back(parts.bytes(p));
      for (std::vector<std::byte>& of_part : bytes) {
        if (of_part.empty()) continue;
        of_part[parts.random() % of_part.size()] ^= static_cast<std::byte>(1u << parts.random() % 8);
        if (i % 5 == 0) of_part.resize(1 + parts.random() % of_part.size());
      }
      const auto shared = decoded(parts, bytes);
      if (!shared) {
        ++errors;
        continue;
      }
      const JoinedPoints joined = parts.join(*shared);
      for (const JoinedPart& part : joined.parts) {
        for (const uint32_t number : part.all_numbers()) ASSERT_LT(number, joined.count);
      }
    }
  }
  EXPECT_GT(errors, 500u);
}

}  // namespace
}  // namespace maille::testing
