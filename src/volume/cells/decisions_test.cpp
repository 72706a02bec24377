#include "volume/cells/decisions.h"

#include <gtest/gtest.h>

namespace maille {
namespace {

/// Evidence and answers of a made-up mesh: one question that is nearly always answered no, one in some order.
struct Asked {
  unsigned question;
  Evidence evidence;
  bool answer;
};
Asked asked(uint32_t i) {
  const uint32_t mixed = hashed(0x1234567, i), kind = mixed >> 8 & 7;
  if (i % 3 == 0) return {0, {kind, i & 255, kind, mixed >> 16}, mixed % 5000 == 0};
  return {1, {mixed & 15, i, kind, mixed >> 20}, (mixed & 15) < 6 + kind};
}

TEST(Decisions, ComeBackWhileTheTableGrowsAndSureOnesAreCodedAlone) {
  constexpr uint32_t count = 400'000;  // new contexts all the time: the table grows as far as it can
  for (const Mixing mixing : {Mixing::none, Mixing::mixed}) {
    RangeEncoder out;
    Decisions<2> encoder(mixing);
    for (uint32_t i = 0; i < count; ++i) {
      const Asked question = asked(i);
      encoder.code(out, question.answer, question.question, question.evidence);
    }
    const std::vector<std::byte> bytes = out.finish();
    RangeDecoder in(bytes);
    Decisions<2> decoder(mixing);
    for (uint32_t i = 0; i < count; ++i) {
      const Asked question = asked(i);
      ASSERT_EQ(decoder.code(in, false, question.question, question.evidence), question.answer) << i;
    }
    EXPECT_FALSE(in.exhausted());
  }
}

TEST(Decisions, CostNextToNothingWhereTheAnswerIsAlwaysNo) {
  RangeEncoder out;
  Decisions<1> decisions(Mixing::mixed);
  for (uint32_t i = 0; i < 100'000; ++i) decisions.code(out, false, 0, {i & 3, i * 7, i * 31, i * 57});
  EXPECT_LT(out.finish().size(), 150u);
}

}  // namespace
}  // namespace maille
