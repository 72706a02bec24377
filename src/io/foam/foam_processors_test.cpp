#include "io/foam/foam_processors.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "io/same_mesh.h"
#include "support/cases.h"
#include "support/random.h"
#include "support/sample_mesh.h"
#include "support/temporary_folder.h"

namespace maille {
namespace {

namespace fs = std::filesystem;
using namespace maille::testing;
using ::testing::HasSubstr;

/// blockMesh's 24 cells with cyclic patches and zones, and what decomposePar made of them for three
/// processors.
class FoamProcessorFolders : public ::testing::Test {
 protected:
  void SetUp() override { fs::copy(sample_path("polymesh_divided"), divided(), fs::copy_options::recursive); }
  std::string divided() const { return folder_.path("case"); }
  std::string file(int processor, const std::string& name) const {
    return divided() + "/processor" + std::to_string(processor) + "/constant/polyMesh/" + name;
  }
  std::string error() const {
    const auto result = read_mesh(divided());
    return result ? "" : result.error().message;
  }

  TemporaryFolder folder_;
};

TEST_F(FoamProcessorFolders, GiveTheMeshThatWasDivided) {
  const auto whole = read_mesh(sample_path("polymesh_whole"));
  ASSERT_TRUE(whole) << whole.error().message;
  const auto joined = read_mesh(divided());
  ASSERT_TRUE(joined) << joined.error().message;
  expect_same_mesh(joined->mesh, whole->mesh);
}

TEST_F(FoamProcessorFolders, AreMeshesOfTheirOwnWhenNamed) {
  const auto part = read_mesh(divided() + "/processor1");
  ASSERT_TRUE(part) << part.error().message;
  EXPECT_GT(part->mesh.cell_count(), 0u);
}

TEST_F(FoamProcessorFolders, CollatedFilesAreNamedWithWhatMakesAMeshOfThem) {
  const std::string folder = folder_.path("collated");
  fs::create_directories(folder + "/processors4_0-1/constant/polyMesh");
  fs::create_directories(folder + "/processors4_2-3/constant/polyMesh");
  const auto result = read_mesh(folder);
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, HasSubstr("(processors4_0-1), which are not read; reconstructParMesh"));
}

TEST_F(FoamProcessorFolders, FieldsThatOnlyProcessorsHaveAreNotLeftOutSilently) {
  const std::string folder = folder_.path("whole");
  fs::create_directories(folder + "/constant");
  fs::copy(sample_path("polymesh_whole"), folder + "/constant/polyMesh", fs::copy_options::recursive);
  for (const char* const processors : {"processor0", "processors2"}) {
    fs::create_directories(folder + "/" + processors + "/constant/polyMesh");
    fs::create_directories(folder + "/" + processors + "/0.5");
    std::ofstream(folder + "/" + processors + "/0.5/p") << "FoamFile {}";
    const auto result = read_mesh(folder);
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_THAT(result->notes, ::testing::Contains(HasSubstr("reconstructPar"))) << processors;
    fs::remove_all(folder + "/" + processors);
  }
}

TEST_F(FoamProcessorFolders, AProcessorThatIsMissingIsNamed) {
  fs::remove_all(divided() + "/processor1");
  EXPECT_EQ(error(), divided() + ": processor1 is missing, but there is processor2");
}

TEST_F(FoamProcessorFolders, ALastOneThatIsMissingIsNoticed) {
  fs::remove_all(divided() + "/processor2");
  EXPECT_THAT(error(), HasSubstr("processor0/constant/polyMesh: "));
  EXPECT_THAT(error(), HasSubstr("missing?"));
}

TEST_F(FoamProcessorFolders, NumbersThatAreMissingAreNamed) {
  fs::remove(file(1, "faceProcAddressing"));
  EXPECT_THAT(error(), HasSubstr("processor1/constant/polyMesh/faceProcAddressing"));
  EXPECT_THAT(error(), HasSubstr("decomposePar writes it"));
}

TEST_F(FoamProcessorFolders, OfDifferentMeshesAreRefused) {
  fs::copy_file(file(0, "cellProcAddressing"), file(2, "cellProcAddressing"),
                fs::copy_options::overwrite_existing);
  EXPECT_NE(error(), "");
  fs::remove_all(divided() + "/processor2");
  fs::copy(divided() + "/processor0", divided() + "/processor2", fs::copy_options::recursive);
  EXPECT_THAT(error(), HasSubstr("in another processor, too"));
}

TEST_F(FoamProcessorFolders, NumbersBeyondAnyMeshTakeNoMemory) {
  for (const char* name : {"cellProcAddressing", "faceProcAddressing", "pointProcAddressing"}) {
    std::ifstream in(file(1, name));
    std::string text(std::istreambuf_iterator<char>(in), {});
    const std::string before = text;
    const size_t first = text.find("\n", text.find("(\n") + 2);
    text.insert(first, "00000000");
    std::ofstream(file(1, name)) << text;
    EXPECT_NE(error(), "") << name;
    std::ofstream(file(1, name)) << before;
  }
  EXPECT_EQ(error(), "");
}

TEST_F(FoamProcessorFolders, SurviveRandomDamage) {
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(divided())) {
    if (entry.is_regular_file()) files.push_back(entry.path().string());
  }
  std::sort(files.begin(), files.end());
  for (uint64_t seed = 0; seed < cases(400); ++seed) {
    Random random(seed);
    const std::string& path = files[random.below(files.size())];
    std::ifstream in(path);
    const std::string whole(std::istreambuf_iterator<char>(in), {});
    std::string damaged = whole;
    for (uint64_t i = random.between(1, 3); i > 0; --i)
      damaged[random.below(damaged.size())] = "0123456789-() ;{}"[random.below(17)];
    std::ofstream(path) << damaged;
    const auto result = read_mesh(divided());
    EXPECT_TRUE(!result || validate(result->mesh)) << seed;
    std::ofstream(path) << whole;
  }
}

}  // namespace
}  // namespace maille
