#pragma once

#include <gmock/gmock.h>
#include <maille/io.h>

#include <span>
#include <string>
#include <string_view>

#include "support/cases.h"
#include "support/random.h"
#include "support/sample_mesh.h"

namespace maille::testing {

/// For tests of formats within HDF5, skipped where its library is missing.
class Hdf5Test : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto probe = read_mesh(sample_path("pieces.vtkhdf"));
    if (!probe && probe.error().code == ErrorCode::unsupported) GTEST_SKIP() << probe.error().message;
  }
  static ReadResult read(const std::string& name) {
    auto result = read_mesh(sample_path(name));
    EXPECT_TRUE(result) << result.error().message;
    return result ? *std::move(result) : ReadResult();
  }
};

/// Damaged files are valid meshes or errors that name them. `letters`: what bytes become; any, if empty.
inline void expect_to_survive_damage(const std::string& whole, const std::string& name, uint64_t trials,
                                     std::string_view letters = {}) {
  Random random(1);
  for (uint64_t i = 0; i < cases(trials); ++i) {
    std::string damaged = whole;
    for (uint32_t change = random.between(1, 4); change > 0; --change)
      damaged[random.below(damaged.size())] =
          letters.empty() ? static_cast<char>(random.next()) : letters[random.below(letters.size())];
    if (random.chance(10)) damaged.resize(random.below(damaged.size()));
    const auto result = read_mesh(*memory_source(std::as_bytes(std::span(damaged)), name), {});
    if (result)
      EXPECT_TRUE(validate(result->mesh));
    else
      EXPECT_THAT(result.error().message, ::testing::HasSubstr(name + ": "));
  }
}

}  // namespace maille::testing
