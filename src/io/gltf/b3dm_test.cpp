#include <gmock/gmock.h>

#include "io/format.h"
#include "io/same_mesh.h"
#include "support/random_mesh.h"

namespace maille {
namespace {

using namespace maille::testing;
using ::testing::Contains;
using ::testing::HasSubstr;

/// A GLB file of ours as a tile.
std::string tile(const std::string& features) {
  Mesh mesh;
  mesh.points.resize(3);
  mesh.points.values<float>()[3] = mesh.points.values<float>()[7] = 1;
  mesh.blocks.resize(1);
  mesh.blocks[0].type = CellType::triangle;
  mesh.blocks[0].connectivity = {0, 1, 2};
  const std::string glb = write_text(glb_format(), mesh, {.format = "glb"}).text;
  std::string text = "b3dm";
  for (const size_t number :
       {size_t{1}, 28 + features.size() + glb.size(), features.size(), size_t{0}, size_t{0}, size_t{0}}) {
    const auto value = static_cast<uint32_t>(number);
    text.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  return text + features + glb;
}

TEST(B3dmReader, GivesTheMeshOfTheTileAndKeepsItsPlace) {
  const auto result = read_text(b3dm_format(), tile(R"({"BATCH_LENGTH":0,"RTC_CENTER":[1.5,2,3]})"));
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->mesh.cell_count(), 1u);
  EXPECT_THAT(result->mesh.metadata,
              Contains(std::pair<std::string, std::string>("b3dm.rtc_center", "[1.5,2,3]")));
  EXPECT_THAT(result->notes, Contains(HasSubstr("centre of the tile")));
}

TEST(B3dmReader, ATableNestedWithoutEndIsLeftOut) {
  const std::string deep =
      "{\"RTC_CENTER\":" + std::string(1'000'000, '[') + std::string(1'000'000, ']') + "}";
  const auto result = read_text(b3dm_format(), tile(deep));
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->mesh.cell_count(), 1u);
  EXPECT_THAT(result->notes, Contains(HasSubstr("nested too deep")));
}

TEST(B3dmReader, EveryTruncationIsAnError) {
  const std::string whole = tile("{}");
  for (size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(read_text(b3dm_format(), whole.substr(0, size))) << size;
}

}  // namespace
}  // namespace maille
