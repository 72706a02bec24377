// Meshes of mode random over HTTP.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <maille/decode.h>
#include <maille/http.h>
#include <maille/random_access.h>

#include "io/http/testing.h"
#include "support/cases.h"
#include "support/codec.h"
#include "support/http_content.h"
#include "support/random_file.h"
#include "support/shapes.h"

namespace maille::testing {
namespace {

/// With a surface that nothing foresees: most of the file is the finest level.
Mesh rough_sphere() {
  Mesh mesh = sphere(240, 120);
  Random random(1);
  for (float& value : mesh.points.values<float>())
    value *= 1 + 1e-5f * static_cast<float>(random.below(1000));
  return mesh;
}

struct RemoteMesh {
  Mesh mesh = rough_sphere();
  std::string bytes;
  RemoteMesh() {
    const RandomFile file = random_file(mesh, {}, 1000);
    EXPECT_EQ(file.error, "");
    bytes.assign(reinterpret_cast<const char*>(file.bytes.data()), file.bytes.size());
  }
};

const RemoteMesh& remote_mesh() {
  static const RemoteMesh remote;
  return remote;
}

TEST(HttpMesh, TheFirstPictureIsOneRequestAndARegionAtMostTwoMore) {
  const RemoteMesh& remote = remote_mesh();
  ASSERT_GT(remote.bytes.size(), 150'000u);
  const TestServer server([&](const TestRequest& request, TestConnection& connection) {
    connection.send(good_answer(request, remote.bytes, strong_etag));
  });
  const auto source = http_source(server.url(), impatient());
  ASSERT_TRUE(source) << source.error().message;
  auto file = File::open(**source);
  ASSERT_TRUE(file) << file.error().message;
  const auto coarse = file->select({}, 1000);
  ASSERT_TRUE(coarse);
  ASSERT_TRUE(file->extract(*coarse));
  EXPECT_EQ((*source)->statistics().round_trips, 1u);
  EXPECT_EQ(server.requests(), 1u);
  Region region;
  region.sphere = Sphere{{{10, 0, 0}}, 3};
  const auto fine = file->select(region, Detail::full());
  ASSERT_TRUE(fine);
  ASSERT_FALSE(fine->charts.empty());
  ASSERT_TRUE(file->extract(*fine));
  EXPECT_LE((*source)->statistics().round_trips, 3u);
  EXPECT_LT((*source)->statistics().bytes, remote.bytes.size());
}

TEST(HttpMesh, DamageOnTheWayIsFetchedOnceMore) {
  const RemoteMesh& remote = remote_mesh();
  for (uint64_t seed = 0; seed < cases(12); ++seed) {
    std::mutex mutex;
    Random random(seed);
    bool fresh = false;
    // Every answer has a flipped bit, until somebody asks past the caches.
    const TestServer server([&](const TestRequest& request, TestConnection& connection) {
      std::string content = remote.bytes;
      const std::lock_guard lock(mutex);
      if (request.headers.count("cache-control") != 0) {
        fresh = true;
      } else {
        const uint64_t end = std::min<uint64_t>(request.last, content.size() - 1) + 1;
        char& c = content[request.first + random.below(end - request.first)];
        c = static_cast<char>(c ^ (1 << random.below(8)));
      }
      connection.send(good_answer(request, content));
    });
    const auto source = http_source(server.url(), impatient());
    ASSERT_TRUE(source) << source.error().message;
    const auto decoded = decode(**source);
    if (decoded) {
      EXPECT_EQ(differences_between(*decoded, remote.mesh), "") << seed;
    } else {
      // The header of the file has no second way.
      EXPECT_NE(decoded.error().code, ErrorCode::network) << decoded.error().message;
    }
    EXPECT_TRUE(fresh || decoded) << seed;
    EXPECT_LE(server.requests(), 60u);
  }
}

TEST(HttpMesh, ADamagedFileIsAsDamagedAsOnDisk) {
  RemoteMesh remote = remote_mesh();
  remote.bytes[remote.bytes.size() / 2] ^= 1;
  const TestServer server([&](const TestRequest& request, TestConnection& connection) {
    connection.send(good_answer(request, remote.bytes));
  });
  const auto source = http_source(server.url(), impatient());
  ASSERT_TRUE(source) << source.error().message;
  const auto decoded = decode(**source);
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::corrupt) << decoded.error().message;
  EXPECT_LE(server.requests(), 30u);
}

TEST(HttpMesh, LosingTheServerIsNoDamage) {
  const RemoteMesh& remote = remote_mesh();
  for (const unsigned good_requests : {0u, 1u}) {
    const TestServer server([&](const TestRequest& request, TestConnection& connection) {
      connection.send(request.number < good_requests ? good_answer(request, remote.bytes)
                                                     : answer("503 Service Unavailable", "", ""));
    });
    const auto source = http_source(server.url(), impatient());
    const auto decoded = source ? decode(**source) : tl::unexpected(source.error());
    ASSERT_FALSE(decoded);
    EXPECT_EQ(decoded.error().code, ErrorCode::network) << decoded.error().message;
  }
}

}  // namespace
}  // namespace maille::testing
