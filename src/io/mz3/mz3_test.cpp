#include <gmock/gmock.h>

#include "base/bytes.h"
#include "io/format.h"
#include "io/same_mesh.h"

namespace maille {
namespace {

using namespace maille::testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

template <class T>
void put(std::string& text, std::initializer_list<T> values) {
  for (const T value : values) text.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// A triangle with a text of two bytes, colours and two scalars a point.
std::string triangle(uint16_t content = 1 + 2 + 4 + 8 + 64, uint32_t last_point = 2) {
  std::string text = "MZ";
  put<uint16_t>(text, {content});
  put<uint32_t>(text, {1, 3, 2});
  text += "{}";
  put<uint32_t>(text, {0, 1, last_point});
  put<float>(text, {0, 0, 0, 1, 0, 0, 0, 1, 0});
  put<uint8_t>(text, {1, 2, 3, 255, 4, 5, 6, 255, 7, 8, 9, 255});
  put<float>(text, {1.5f, 2.5f, 3.5f, 10, 20, 30});
  return text;
}

TEST(Mz3Reader, ReadsFacesColoursAndAllScalars) {
  const auto result = read_text(mz3_format(), triangle());
  ASSERT_TRUE(result) << result.error().message;
  const Mesh& mesh = result->mesh;
  EXPECT_EQ(mesh.point_count(), 3u);
  EXPECT_THAT(mesh.blocks.at(0).connectivity, ElementsAre(0, 1, 2));
  EXPECT_THAT(values_of<float>(mesh, "scalar", Domain::point), ElementsAre(1.5f, 2.5f, 3.5f));
  EXPECT_THAT(values_of<float>(mesh, "scalar_1", Domain::point), ElementsAre(10, 20, 30));
  EXPECT_EQ(mesh.find("colour", Domain::point)->role, Role::colour);
  EXPECT_THAT(mesh.metadata, ElementsAre(std::pair<std::string, std::string>("mz3.lookup", "{}")));
  EXPECT_TRUE(result->notes.empty());
}

TEST(Mz3Reader, RefusesWhatIsCutOrPointsNowhere) {
  const std::string whole = triangle();
  for (size_t size = 0; size < whole.size() - 24; ++size)
    EXPECT_FALSE(read_text(mz3_format(), whole.substr(0, size))) << size;
  EXPECT_FALSE(read_text(mz3_format(), triangle(1 + 2 + 4 + 8 + 64, 3)));
  const auto values_only = read_text(mz3_format(), triangle(8));
  ASSERT_FALSE(values_only);
  EXPECT_THAT(values_only.error().message, HasSubstr("no points"));
}

}  // namespace
}  // namespace maille
