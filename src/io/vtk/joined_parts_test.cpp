#include <maille/parts.h>

#include <fstream>

#include <gmock/gmock.h>

#include "support/cases.h"
#include "support/random.h"
#include "support/temporary_folder.h"

namespace maille {
namespace {

using namespace maille::testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

template <class T>
std::string words(const std::vector<T>& numbers) {
  std::string text;
  for (const T number : numbers) text += std::to_string(number) + " ";
  return text;
}

template <class T>
std::string data_array(const char* type, const std::string& name, const std::vector<T>& numbers,
                       int components = 1) {
  if (numbers.empty()) return "";
  return "<DataArray type=\"" + std::string(type) + "\" Name=\"" + name + "\" NumberOfComponents=\"" +
         std::to_string(components) + "\" format=\"ascii\">" + words(numbers) + "</DataArray>\n";
}

/// Cubes of a bar, from the first to the last, and which of them are ghosts.
struct Bar {
  int first = 0, last = 0;
  std::vector<int> ghosts = {};  ///< by cube
  bool point_numbers = false, cell_numbers = false;
  std::vector<int> values = {};  ///< by point
  int number_shift = 0;

  /// Four points at each end of a cube.
  std::string text() const {
    std::vector<int> positions, corners, ends, types, points, cells;
    for (int x = first; x <= last + 1; ++x) {
      for (int i = 0; i < 4; ++i) {
        positions.insert(positions.end(), {x, (i == 1 || i == 2), i / 2});
        points.push_back(100 - 4 * x - i + number_shift);
      }
    }
    for (int cube = first; cube <= last; ++cube) {
      for (int i = 0; i < 8; ++i) corners.push_back(4 * (cube - first) + i);
      ends.push_back(static_cast<int>(corners.size()));
      types.push_back(12);
      cells.push_back(50 - cube);
    }
    return "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\"><UnstructuredGrid>"
           "<Piece NumberOfPoints=\"" +
           std::to_string(points.size()) + "\" NumberOfCells=\"" + std::to_string(types.size()) +
           "\"><PointData>" + (point_numbers ? data_array("Int64", "GlobalPointIds", points) : "") +
           data_array("Int32", "T", values) + "</PointData><CellData>" +
           data_array("UInt8", "vtkGhostType", ghosts) +
           (cell_numbers ? data_array("Int64", "GlobalCellIds", cells) : "") + "</CellData><Points>" +
           data_array("Float32", "Points", positions, 3) + "</Points><Cells>" +
           data_array("Int64", "connectivity", corners) + data_array("Int64", "offsets", ends) +
           data_array("UInt8", "types", types) + "</Cells></Piece></UnstructuredGrid></VTKFile>\n";
  }
};

class JoinedParts : public ::testing::Test {
 protected:
  Result<ReadResult> read(const std::vector<Bar>& bars) {
    std::string head = "<VTKFile type=\"PUnstructuredGrid\" version=\"0.1\"><PUnstructuredGrid>";
    for (size_t i = 0; i < bars.size(); ++i) {
      const std::string name = "part" + std::to_string(i) + ".vtu";
      std::ofstream(folder_.path() + "/" + name) << bars[i].text();
      head += "<Piece Source=\"" + name + "\"/>";
    }
    std::ofstream(path()) << head + "</PUnstructuredGrid></VTKFile>";
    return read_mesh(path());
  }
  std::string path() const { return folder_.path() + "/bar.pvtu"; }

  TemporaryFolder folder_;
};

TEST_F(JoinedParts, GhostCellsAreLeftOutAndTheirPointsJoined) {
  const auto result =
      read({{.first = 0, .last = 2, .ghosts = {0, 0, 1}}, {.first = 1, .last = 3, .ghosts = {1, 0, 0}}});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->mesh.cell_count(), 4u);
  EXPECT_EQ(result->mesh.point_count(), 20u);
  EXPECT_TRUE(result->mesh.arrays.empty());
  EXPECT_TRUE(validate(result->mesh));
  EXPECT_THAT(result->notes,
              ElementsAre("2 ghost cells left out", "12 points joined with those of other pieces"));
}

TEST_F(JoinedParts, HiddenCellsStayHidden) {
  const auto result =
      read({{.first = 0, .last = 2, .ghosts = {32, 0, 1}}, {.first = 1, .last = 3, .ghosts = {1, 0, 32}}});
  ASSERT_TRUE(result) << result.error().message;
  const Array* const flags = result->mesh.find("vtkGhostType", Domain::cell);
  ASSERT_NE(flags, nullptr);
  EXPECT_THAT(flags->values<uint8_t>(), ElementsAre(32, 0, 0, 32));
}

TEST_F(JoinedParts, NumbersOfTheWholeMeshJoinPointsAndGiveTheOrder) {
  const auto result = read({{.first = 0, .last = 1, .point_numbers = true, .cell_numbers = true},
                            {.first = 2, .last = 3, .point_numbers = true, .cell_numbers = true}});
  ASSERT_TRUE(result) << result.error().message;
  const Mesh& mesh = result->mesh;
  ASSERT_EQ(mesh.cell_count(), 4u);
  ASSERT_EQ(mesh.point_count(), 20u);
  EXPECT_THAT(mesh.find("GlobalCellIds", Domain::cell)->values<int64_t>(), ElementsAre(47, 48, 49, 50));
  EXPECT_EQ(mesh.find("GlobalPointIds", Domain::point)->values<int64_t>()[0], 81);
  // The cube at the far end, which has the least number.
  EXPECT_EQ(mesh.points.values<float>()[size_t{3} * mesh.blocks[0].cell(0)[0]], 3);
}

TEST_F(JoinedParts, ACellThatTwoPiecesHaveIsThereOnce) {
  const auto result = read({{.first = 0, .last = 2, .point_numbers = true, .cell_numbers = true},
                            {.first = 1, .last = 3, .point_numbers = true, .cell_numbers = true}});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->mesh.cell_count(), 4u);
  EXPECT_EQ(result->mesh.point_count(), 20u);
}

TEST_F(JoinedParts, WithoutNumbersAndGhostsPointsStayApart) {
  const auto result = read({{.first = 0, .last = 1}, {.first = 2, .last = 3}});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->mesh.point_count(), 24u);
  ASSERT_EQ(result->notes.size(), 1u);
  EXPECT_THAT(result->notes[0], HasSubstr("4 places where several pieces have points"));
}

TEST_F(JoinedParts, ThePieceThatOwnsAPointDecidesItsValue) {
  std::vector<int> first(16, 1), second(16, 2);
  const auto result = read({{.first = 0, .last = 2, .ghosts = {0, 0, 1}, .values = first},
                            {.first = 1, .last = 3, .ghosts = {1, 0, 0}, .values = second}});
  ASSERT_TRUE(result) << result.error().message;
  const auto values = result->mesh.find("T", Domain::point)->values<int32_t>();
  for (size_t i = 0; i < values.size(); ++i) {
    const float x = result->mesh.points.values<float>()[3 * i];
    EXPECT_EQ(values[i], x <= 2 ? 1 : 2) << x;
  }
  EXPECT_THAT(result->notes.back(), HasSubstr("12 values of joined points differed"));
}

TEST_F(JoinedParts, AGhostWithoutAnOwnerIsAnError) {
  for (const bool numbers : {false, true}) {
    const auto result =
        read({{.first = 0, .last = 2, .ghosts = {0, 0, 1}, .point_numbers = numbers, .cell_numbers = numbers},
              {.first = 3, .last = 4, .ghosts = {0, 0}, .point_numbers = numbers, .cell_numbers = numbers}});
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().message,
              path() + ": cell 2 of piece 0 is a ghost that no piece owns; is a piece missing?");
  }
}

TEST_F(JoinedParts, OneNumberAtTwoPlacesIsAnError) {
  const auto result = read({{.first = 0, .last = 1, .point_numbers = true},
                            {.first = 2, .last = 3, .point_numbers = true, .number_shift = 4}});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().message,
            path() +
                ": point 11 of piece 0 and point 7 of piece 1 both have number 89 in \"GlobalPointIds\", but "
                "different positions; without this array pieces are joined by position");
}

TEST_F(JoinedParts, PartsThatAreNotAllMayHaveGhostsOfOthers) {
  ASSERT_TRUE(
      read({{.first = 0, .last = 2, .ghosts = {0, 0, 1}}, {.first = 1, .last = 3, .ghosts = {1, 0, 0}}}));
  const auto names = parts_of_mesh(path());
  ASSERT_TRUE(names);
  ASSERT_EQ(names->size(), 2u);
  CellKeys cells;
  const auto part = read_parts(std::span(*names).first(1), {}, &cells);
  ASSERT_TRUE(part) << part.error().message;
  EXPECT_EQ(part->mesh.cell_count(), 2u);
  EXPECT_EQ(part->mesh.point_count(), 12u);
  EXPECT_TRUE(cells.own.empty()) << "there are no numbers to make keys of";
}

TEST_F(JoinedParts, KeysOfCellsAreTheSameInAllParts) {
  ASSERT_TRUE(read({{.first = 0, .last = 2, .ghosts = {0, 0, 1}, .point_numbers = true},
                    {.first = 1, .last = 3, .ghosts = {1, 0, 0}, .point_numbers = true}}));
  const auto names = parts_of_mesh(path());
  ASSERT_TRUE(names);
  CellKeys first, second;
  ASSERT_TRUE(read_parts(std::span(*names).first(1), {}, &first));
  ASSERT_TRUE(read_parts(std::span(*names).last(1), {}, &second));
  ASSERT_EQ(first.own.size(), 2u);
  ASSERT_EQ(second.own.size(), 2u);
  EXPECT_THAT(first.ghosts, ElementsAre(second.own[0]));
  EXPECT_THAT(second.ghosts, ElementsAre(first.own[1]));
}

TEST_F(JoinedParts, SurviveRandomDamage) {
  for (const bool numbers : {false, true}) {
    const Bar first = {
        .first = 0, .last = 2, .ghosts = {0, 0, 1}, .point_numbers = numbers, .cell_numbers = numbers};
    const Bar second = {
        .first = 1, .last = 3, .ghosts = {1, 0, 0}, .point_numbers = numbers, .cell_numbers = numbers};
    ASSERT_TRUE(read({first, second}));
    const std::string whole = second.text();
    for (uint64_t seed = 0; seed < cases(300); ++seed) {
      Random random(seed);
      std::string damaged = whole;
      for (uint64_t i = random.between(1, 3); i > 0; --i)
        damaged[random.below(damaged.size())] = "0123456789- "[random.below(12)];
      folder_.write("part1.vtu", damaged);
      const auto result = read_mesh(path());
      EXPECT_TRUE(!result || validate(result->mesh)) << seed;
    }
  }
}

}  // namespace
}  // namespace maille
