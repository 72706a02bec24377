#include <gmock/gmock.h>

#include "io/obj/obj.h"
#include "io/off/off.h"
#include "io/ply/ply.h"
#include "io/same_mesh.h"

namespace maille {
namespace {

using ::testing::HasSubstr;

std::string refusal(const Format& format, const std::string& text, const std::string& name) {
  const auto read = testing::read_text(format, text, name);
  if (read) return "no error";
  EXPECT_EQ(read.error().code, ErrorCode::unsupported);
  return read.error().message;
}

std::string repeated(std::string_view line, size_t times) {
  std::string text;
  for (size_t i = 0; i < times; ++i) text += line;
  return text;
}

// Each takes some bytes here, and 64 in memory.
TEST(Comments, OfMoreThanThereIsRoomForAreRefusedWithoutTakingMemory) {
  constexpr size_t many = 1'100'000;
  const std::string point = "v 0 0 0\n", too_many = "more than the 16 MiB";
  EXPECT_THAT(refusal(obj_format(), point + repeated("#\n", many), "a.obj"), HasSubstr(too_many));
  EXPECT_THAT(refusal(off_format(), "OFF\n" + repeated("#\n", many) + "1 0 0\n0 0 0\n", "a.off"),
              HasSubstr(too_many));
  EXPECT_THAT(refusal(ply_format(),
                      "ply\nformat ascii 1.0\n" + repeated("comment\n", many) +
                          "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                          "end_header\n0 0 0\n",
                      "a.ply"),
              HasSubstr(too_many));
}

TEST(Comments, AreKeptByTheThousand) {
  constexpr size_t many = 10'000;
  const auto read =
      testing::read_good_text(obj_format(), "v 0 0 0\n" + repeated("# of old\n", many), "a.obj");
  EXPECT_EQ(read.mesh.metadata.size(), many);
}

}  // namespace
}  // namespace maille
