// tests/formats/ensight: all.case has every element, the others three parts (elements, a grid with blanking,
// an even grid) at three times, with ids; what VTK 9.1 reads of them (without ids) is what is read here.
#include <gmock/gmock.h>

#include <maille/series.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "io/same_mesh.h"
#include "support/cases.h"
#include "support/random.h"
#include "support/sample_mesh.h"
#include "support/temporary_folder.h"

namespace maille {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::sample_path;
using testing::values_of;

std::string ensight_path(const std::string& name) {
  return sample_path("ensight/" + name);
}

Mesh step_of(const std::string& name, uint64_t step) {
  auto result = read_series_entry({ensight_path(name), 0, step, true});
  EXPECT_TRUE(result) << result.error().message;
  return result ? std::move(result->mesh) : Mesh{};
}

TEST(EnsightReader, TurnsEveryElementIntoVtksOrder) {
  const auto result = read_mesh(ensight_path("all.case"));
  ASSERT_TRUE(result) << result.error().message;
  const Mesh& mesh = result->mesh;
  ASSERT_EQ(mesh.cell_count(), 18u);
  ASSERT_EQ(mesh.blocks.size(), 1u);
  const CellBlock& block = mesh.blocks[0];
  EXPECT_EQ(block.name, "the part");
  EXPECT_THAT(block.cell(2), ElementsAre(0, 2, 1));
  EXPECT_THAT(block.cell(11), ElementsAre(0, 2, 1, 3, 5, 4));
  EXPECT_THAT(block.cell(12), ElementsAre(0, 2, 1, 3, 5, 4, 8, 7, 6, 11, 10, 9, 12, 14, 13));
  EXPECT_THAT(block.cell(16), ElementsAre(3, 4, 5, 6, 7));
  EXPECT_THAT(block.faces(17), ElementsAre(3, 3, 3, 3));
  EXPECT_EQ(block.type_of(17), CellType::polyhedron);
  const auto tensor = values_of<float>(mesh, "S", Domain::point);
  EXPECT_THAT(std::vector(tensor.begin() + 6, tensor.begin() + 12), ElementsAre(1, 101, 201, 301, 501, 401));
}

TEST(EnsightReader, ReadsTextAndBothOrdersOfBytesAlike) {
  for (uint64_t step = 0; step < 3; ++step) {
    const Mesh text = step_of("ascii_file.case", step);
    ASSERT_EQ(text.point_count(), 24u);
    testing::expect_same_mesh(text, step_of("le_file.case", step));
    testing::expect_same_mesh(text, step_of("be_file.case", step));
    testing::expect_same_mesh(text, step_of("le_stars.case", step));
  }
}

TEST(EnsightReader, ReadsPartsGridsIdsAndValues) {
  const Mesh mesh = step_of("be_file.case", 1);
  ASSERT_EQ(mesh.blocks.size(), 4u);
  EXPECT_EQ(mesh.blocks[1].type, CellType::wedge);
  EXPECT_EQ(mesh.blocks[2].name, "grid of it");
  EXPECT_EQ(mesh.blocks[2].type, CellType::hexahedron);
  EXPECT_THAT(mesh.blocks[2].cell(1), ElementsAre(8, 9, 11, 10, 14, 15, 17, 16));
  EXPECT_EQ(mesh.blocks[3].type, CellType::quad);
  const auto points = mesh.points.values<float>();
  EXPECT_THAT(points.subspan(3 * 3, 3), ElementsAre(0, 0, 2.5));
  EXPECT_THAT(points.subspan(23 * 3, 3), ElementsAre(6, 6.25, 7));
  const auto p = values_of<float>(mesh, "p", Domain::point);
  EXPECT_TRUE(std::isnan(p[2]));   // as undefined in the file
  EXPECT_TRUE(std::isnan(p[20]));  // of a part without values
  EXPECT_EQ(p[5], 6);
  EXPECT_EQ(p[6], 1.5);
  const auto v = values_of<float>(mesh, "v", Domain::cell);
  EXPECT_THAT(std::vector(v.begin(), v.begin() + 6), ElementsAre(4, 5, 6, 1, 2, 4));
  EXPECT_THAT(std::vector(v.end() - 6, v.end()), ElementsAre(1, 3, 5, 2, 4, 6));
  EXPECT_EQ(values_of<int32_t>(mesh, "ensight:node", Domain::point)[1], 20);
  EXPECT_THAT(values_of<int32_t>(mesh, "ensight:element", Domain::cell), ElementsAre(7, 9, 201, 202, 1, 2));
  EXPECT_THAT(values_of<double>(mesh, "gamma", Domain::mesh), ElementsAre(1.4));
}

TEST(EnsightReader, TellsTheTimesAndReadsTheLast) {
  const auto series = read_series(ensight_path("le_stars.case"));
  ASSERT_TRUE(series) << series.error().message;
  ASSERT_EQ(series->size(), 3u);
  EXPECT_EQ(series->back().time, 2.25);
  EXPECT_TRUE(series->back().mesh_may_change);
  const auto last = read_mesh(ensight_path("le_stars.case"));
  ASSERT_TRUE(last);
  testing::expect_same_mesh(last->mesh, step_of("le_stars.case", 2));
  EXPECT_TRUE(testing::has_note(last->notes, "last of 3 time steps"));
  const auto none = read_series_entry({ensight_path("le_stars.case"), 0, 3});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::usage);
}

TEST(EnsightReader, ReadsRectilinearGridsGhostsAndPartialValues) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.write(
      "x.case", "FORMAT\ntype: ensight gold\nGEOMETRY\nmodel: x.geo\nVARIABLE\nscalar per node: p x.p\n");
  folder.write("x.geo",
               "a\nb\nnode id off\nelement id off\npart\n1\ngrid\nblock rectilinear with_ghost\n3 2 1\n"
               "0\n1\n4\n5\n7\n9\nghost_flags\n0\n1\n"
               "part\n2\nface\ncoordinates\n3\n0\n1\n0\n0\n0\n1\n2\n2\n2\ng_tria3\n1\n1 2 3\n");
  folder.write("x.p", "p\npart\n1\ncoordinates partial\n2\n6\n1\n60\n10\n");
  const auto result = read_mesh(path);
  ASSERT_TRUE(result) << result.error().message;
  const auto points = result->mesh.points.values<float>();
  EXPECT_THAT(points.subspan(2 * 3, 6), ElementsAre(4, 5, 9, 0, 7, 9));
  EXPECT_THAT(values_of<uint8_t>(result->mesh, "vtkGhostType", Domain::cell), ElementsAre(0, 1, 1));
  const auto p = values_of<float>(result->mesh, "p", Domain::point);
  EXPECT_EQ(p[0], 10);
  EXPECT_EQ(p[5], 60);
  EXPECT_TRUE(std::isnan(p[1]));
}

TEST(EnsightReader, RefusesFilesOutsideItsFolder) {
  const auto result = testing::error_of_text(
      ensight_format(), "FORMAT\ntype: ensight gold\nGEOMETRY\nmodel: ../secret.geo\n", "x.case");
  EXPECT_THAT(result, HasSubstr("only files in the same folder or below are opened"));
}

void write_file(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

/// An error of the right kind, or a mesh that keeps its rules.
void expect_survives(const std::string& path) {
  ReadOptions options;
  options.limits.mesh_bytes = uint64_t{1} << 26;
  const auto result = read_mesh(path, options);
  if (result) {
    EXPECT_TRUE(validate(result->mesh));
    return;
  }
  const ErrorCode code = result.error().code;
  EXPECT_TRUE(code == ErrorCode::malformed_input || code == ErrorCode::unsupported ||
              code == ErrorCode::memory_bound || code == ErrorCode::cannot_read)
      << result.error().message;
}

TEST(EnsightReader, SurvivesRandomDamageAndCuts) {
  static constexpr char tempting[] = "0123456789-+.eE \n*:\"";
  testing::Random random(7);
  for (const std::string name : {"ascii_file", "le_file", "be_file", "all"}) {
    const testing::TemporaryFolder folder;
    std::vector<std::string> endings = {".case", ".geo", ".p", ".v"};
    if (name == "all") endings = {".case", ".geo", ".sym", ".vec"};
    std::vector<std::string> texts;
    for (const std::string& ending : endings)
      texts.push_back(testing::text_of_file(ensight_path(name + ending)));
    const auto path = [&](size_t i) { return folder.path(name + endings[i]); };
    for (size_t i = 0; i < texts.size(); ++i) write_file(path(i), texts[i]);
    for (uint64_t trial = 0; trial < testing::cases(600); ++trial) {
      const size_t which = random.below(static_cast<uint32_t>(texts.size()));
      std::string damaged = texts[which];
      if (random.chance(20)) damaged.resize(random.below(static_cast<uint32_t>(damaged.size())));
      for (uint32_t i = random.between(0, 4); i > 0 && !damaged.empty(); --i) {
        damaged[random.below(static_cast<uint32_t>(damaged.size()))] =
            random.chance(50) ? tempting[random.below(sizeof tempting - 1)]
                              : static_cast<char>(random.next());
      }
      write_file(path(which), damaged);
      expect_survives(path(0));
      write_file(path(which), texts[which]);
    }
  }
}

}  // namespace
}  // namespace maille
