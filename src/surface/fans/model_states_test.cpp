#include "surface/fans/model_states.h"

#include <gtest/gtest.h>

#include <cmath>

#include "entropy/rans.h"
#include "support/random.h"

namespace maille {
namespace {

std::vector<SymbolModel> taught_models() {
  testing::Random random(1);
  std::vector<SymbolModel> models(200);
  RansEncoder unused;
  for (size_t m = 0; m < models.size(); ++m) {
    const uint64_t most = 1 + random.below(16);
    for (size_t i = 0; i < m; ++i) models[m].code(unused, static_cast<unsigned>(random.below(most)));
  }
  return models;
}

TEST(ModelStates, AreTheSameOnBothSidesAndNearWhatWasLearnt) {
  const std::vector<SymbolModel> taught = taught_models();
  std::vector<SymbolModel> written = taught, read(taught.size());
  RansEncoder encoder;
  ModelStateCoder writing(encoder);
  for (SymbolModel& model : written) writing(model);
  const std::vector<std::byte> bytes = encoder.finish();
  EXPECT_LT(bytes.size(), 16 * taught.size());
  RansDecoder decoder(bytes);
  ModelStateCoder reading(decoder);
  for (SymbolModel& model : read) reading(model);
  EXPECT_FALSE(decoder.exhausted());
  for (size_t m = 0; m < taught.size(); ++m) {
    EXPECT_EQ(written[m].visits(), read[m].visits()) << m;
    for (unsigned i = 0; i < 16; ++i) {
      ASSERT_EQ(written[m].frequency(i), read[m].frequency(i)) << m << " " << i;
      ASSERT_GE(read[m].frequency(i), 1u);
      if (read[m].visits() == 0 || taught[m].frequency(i) < 512) continue;
      const double factor = double{1} * read[m].frequency(i) / taught[m].frequency(i);
      EXPECT_LT(std::fabs(std::log2(factor)), 1.3) << m << " " << i;
    }
  }
}

TEST(ModelStates, OfAnyBytesAreDistributions) {
  testing::Random random(2);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<std::byte> bytes(random.below(200));
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(random.below(256));
    RansDecoder decoder(bytes);
    ModelStateCoder reading(decoder);
    for (int m = 0; m < 100; ++m) {
      SymbolModel model;
      reading(model);
      uint32_t sum = 0;
      for (unsigned i = 0; i < 16; ++i) {
        ASSERT_GE(model.frequency(i), 1u);
        sum += model.frequency(i);
      }
      ASSERT_EQ(sum, 32768u);
      ASSERT_LE(model.visits(), SymbolModel::most_visits);
    }
  }
}

}  // namespace
}  // namespace maille
