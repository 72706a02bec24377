#include "peers/peers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <cstdlib>
#include "peers/packers.h"
#include "peers/rows.h"
#include "support/shapes.h"

namespace maille::bench {
namespace {

using ::testing::HasSubstr;

Surface torus() {
  return *surface_of(maille::testing::to_mesh(maille::testing::shapes::torus(24, 16)));
}

// Encodes to nothing, in one way or another.
class BadCodec final : public Codec {
 public:
  explicit BadCodec(std::function<void()> act) : act_(std::move(act)) {}
  std::string name() const override { return "bad"; }
  bool takes(int) const override { return true; }
  Result<Encoded> encode(const Workload&) const override {
    act_();
    return failure(ErrorCode::unsupported, "does not want to");
  }
  Result<Decoded> decode(Bytes, const Workload&) const override {
    return failure(ErrorCode::corrupt, "has nothing");
  }

 private:
  std::function<void()> act_;
};

TEST(Peers, BringBackASurface) {
  for (const int bits : {0, 12}) {
    const Workload workload = make_workload(torus(), bits);
    for (const Peer& peer : peers()) {
      if (!peer.codec || !peer.codec->takes(bits)) continue;
      const Row row = first_run(*peer.codec, workload);
      EXPECT_EQ(row.problem, "") << peer.name;
      EXPECT_TRUE(row.check.ok) << peer.name << ", " << bits << " bits: " << row.check.verdict;
      EXPECT_EQ(row.codec->name(), peer.name);
    }
  }
}

TEST(Peers, HaveAPackageEach) {
  EXPECT_EQ(peers().size(), 5U);
  for (const Peer& peer : peers()) EXPECT_THAT(peer.packages, HasSubstr("-dev"));
}

TEST(Rows, MailleIsExactAtEveryLevel) {
  const Workload workload = make_workload(torus(), 14);
  for (int level = 1; level <= 9; ++level) {
    const auto codec = maille_codec(level);
    const Row row = first_run(*codec, workload);
    EXPECT_EQ(row.check.verdict, "exact") << row.problem;
    EXPECT_GT(row.encode_trial.peak_bytes, 0U);
  }
}

TEST(Rows, ACodecThatCrashesOrFailsCostsItsRowOnly) {
  const Workload workload = make_workload(torus(), 14);
  EXPECT_THAT(first_run(BadCodec([] { std::abort(); }), workload).problem, HasSubstr("crashed"));
  EXPECT_THAT(first_run(BadCodec([] { _exit(3); }), workload).problem, HasSubstr("without an answer"));
  EXPECT_THAT(first_run(BadCodec([] {}), workload).problem, HasSubstr("does not want to"));
}

TEST(Rows, AreTimedOncePerRoundUntilThereIsEnough) {
  const Workload workload = make_workload(torus(), 14);
  const auto codec = maille_codec(5);
  std::vector<Row> rows = {first_run(*codec, workload)};
  for (int round = 0; round < 9; ++round) time_round(rows, workload, {2, 4, 1e9});
  EXPECT_EQ(rows[0].encode_seconds.size(), 2U);
  EXPECT_EQ(rows[0].decode_seconds.size(), 4U);
  EXPECT_GT(million_triangles_per_second(workload, rows[0].decode_seconds), 0);
}

TEST(RoundTrip, SeesATurnedFaceALostFaceAndAMovedPoint) {
  const Surface good = make_workload(torus(), 14).surface;
  EXPECT_EQ(check_round_trip(good, good).verdict, "exact");
  Surface turned = good;
  std::swap(turned.corners[0], turned.corners[1]);
  EXPECT_FALSE(check_round_trip(good, turned).ok);
  Surface lost = good;
  lost.degrees.pop_back();
  lost.corners.resize(lost.corners.size() - 4);
  EXPECT_FALSE(check_round_trip(good, lost).ok);
  Surface moved = good;
  moved.xyz[7] += 1;
  EXPECT_FALSE(check_round_trip(good, moved).ok);
  EXPECT_FALSE(check_within(good, moved, 0.5).ok);
}

TEST(Packers, MakeRepeatedBytesSmall) {
  const std::vector<std::byte> zeros(100'000);
  for (const Packer& packer : packers()) {
    const auto size = packer.packed_size(zeros);
    ASSERT_TRUE(size) << packer.name;
    EXPECT_LT(*size, 1000U) << packer.name;
  }
}

}  // namespace
}  // namespace maille::bench
