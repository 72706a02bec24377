#include <gtest/gtest.h>
#include <maille/limits.h>
#include <unistd.h>

namespace maille {
namespace {

// A file of few bytes may decode to a mesh of any size.
TEST(Limits, AreBelowTheMemoryOfTheMachineByDefault) {
  const auto machine =
      static_cast<uint64_t>(::sysconf(_SC_PHYS_PAGES)) * static_cast<uint64_t>(::sysconf(_SC_PAGESIZE));
  EXPECT_LE(Limits{}.mesh_bytes, machine / 2);
  EXPECT_GT(Limits{}.mesh_bytes, 0u);
}

}  // namespace
}  // namespace maille
