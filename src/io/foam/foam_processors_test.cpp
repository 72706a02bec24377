#include "io/foam/foam_processors.h"

#include <gmock/gmock.h>
#include <maille/series.h>

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

  /// Of time 0.01, beside the meshes.
  void add_fields() {
    for (const std::string processor : {"processor0", "processor1", "processor2"}) {
      fs::copy(sample_path("foam_divided_fields/" + processor), divided() + "/" + processor,
               fs::copy_options::recursive | fs::copy_options::overwrite_existing);
    }
  }
  /// With the fields of a time.
  std::string whole_case(const std::string& time) {
    std::string folder = folder_.path("whole");
    fs::create_directories(folder + "/constant");
    fs::copy(sample_path("polymesh_whole"), folder + "/constant/polyMesh", fs::copy_options::recursive);
    if (!time.empty())
      fs::copy(sample_path("foam_divided_fields/whole"), folder, fs::copy_options::recursive);
    return folder;
  }
  static std::string bytes_of(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  /// As OpenFOAM's file handler "collated" writes it; three processors, the last folder has one.
  void collate(const std::string& folder, const std::vector<std::string>& groups) {
    for (int processor = 0; processor < 3; ++processor) {
      const bool second = groups.size() > 1 && processor == 2;
      const fs::path from = divided() + "/processor" + std::to_string(processor);
      for (const auto& entry : fs::recursive_directory_iterator(from)) {
        if (!entry.is_regular_file()) continue;
        const fs::path to = fs::path(folder) / groups[second ? 1 : 0] / fs::relative(entry.path(), from);
        fs::create_directories(to.parent_path());
        const bool first = processor == 0 || second;
        std::string bytes = bytes_of(entry.path());
        if (!first) bytes = bytes.substr(bytes.find('}') + 1);
        std::ofstream out(to, first ? std::ios::trunc : std::ios::app);
        if (first) out << "FoamFile { version 2.0; format binary; class decomposedBlockData; object x; }\n";
        out << "\n// Processor" << processor << "\n" << bytes.size() << "\n(" << bytes << ")\n";
      }
    }
  }
  /// The text of a field without blanks.
  static std::string text_of(const Mesh& mesh, const std::string& field) {
    std::string text;
    for (const auto& [key, value] : mesh.metadata) {
      if (key == "openfoam.field." + field) text = value;
    }
    std::erase_if(text, [](char c) { return c == ' ' || c == '\n'; });
    return text;
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

TEST_F(FoamProcessorFolders, FieldsComeTogetherAsTheyWereBeforeTheCaseWasDivided) {
  add_fields();
  const auto whole = read_mesh(whole_case("0.01"));
  ASSERT_TRUE(whole) << whole.error().message;
  const auto joined = read_mesh(divided());
  ASSERT_TRUE(joined) << joined.error().message;
  EXPECT_TRUE(joined->notes.empty()) << joined->notes[0];
  for (const char* const name : {"U", "phi", "pd"}) {
    const Domain domain = name == std::string("pd") ? Domain::point : Domain::cell;
    ASSERT_NE(joined->mesh.find(name, domain), nullptr) << name;
    expect_same_array(*joined->mesh.find(name, domain), *whole->mesh.find(name, domain));
  }
  EXPECT_EQ(text_of(joined->mesh, "phi"), text_of(whole->mesh, "phi"));
  EXPECT_EQ(text_of(joined->mesh, "U"), text_of(whole->mesh, "U"));
}

TEST_F(FoamProcessorFolders, CollatedFilesGiveTheSameMeshAndFields) {
  add_fields();
  const auto apart = read_mesh(divided());
  ASSERT_TRUE(apart) << apart.error().message;
  for (const auto& groups :
       {std::vector<std::string>{"processors3"}, {"processors3_0-1", "processors3_2-2"}}) {
    const std::string folder = folder_.path(groups[0]);
    collate(folder, groups);
    const auto together = read_mesh(folder);
    ASSERT_TRUE(together) << together.error().message;
    expect_same_mesh(together->mesh, apart->mesh);
  }
}

TEST_F(FoamProcessorFolders, CollatedFoldersThatDoNotFitAreRefused) {
  const std::string folder = folder_.path("case2");
  const auto error_of = [&] {
    const auto result = read_mesh(folder);
    return result ? "" : result.error().message;
  };
  fs::create_directories(folder + "/processors4_2-3");
  EXPECT_EQ(error_of(), folder + ": processor 0 is not in processors4_2-3, or twice");
  fs::create_directories(folder + "/processors4_0-1");
  fs::create_directories(folder + "/processors2");
  EXPECT_THAT(error_of(), HasSubstr("are of different numbers of processors"));
  fs::remove_all(folder + "/processors2");
  fs::remove_all(folder + "/processors4_2-3");
  EXPECT_THAT(error_of(), HasSubstr("processor 2 of 4 is in no folder"));
  fs::remove_all(folder + "/processors4_0-1");
  fs::create_directories(folder + "/processors99999999999");
  EXPECT_THAT(error_of(), HasSubstr("more processors than there may be"));
}

TEST_F(FoamProcessorFolders, TimesThatOnlyProcessorsHaveAreStepsOfTheCase) {
  add_fields();
  const std::string folder = whole_case("");
  fs::create_directories(folder + "/0");
  fs::copy(sample_path("foam_divided_fields/whole/0.01/U"), folder + "/0/U");
  for (const std::string processor : {"processor0", "processor1", "processor2"})
    fs::copy(divided() + "/" + processor, folder + "/" + processor, fs::copy_options::recursive);
  const auto series = read_series(folder);
  ASSERT_TRUE(series) << series.error().message;
  ASSERT_EQ(series->size(), 2u);
  const auto first = read_series_entry((*series)[0]), second = read_series_entry((*series)[1]);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->mesh.find("phi", Domain::cell), nullptr);
  EXPECT_NE(second->mesh.find("phi", Domain::cell), nullptr);
  EXPECT_TRUE(first->mesh.points.bytes == second->mesh.points.bytes);
}

TEST_F(FoamProcessorFolders, FieldsOfOtherMeshesAreNotLeftOutSilently) {
  add_fields();
  const std::string folder = whole_case("");
  fs::copy(divided() + "/processor0", folder + "/processor0", fs::copy_options::recursive);
  fs::remove(folder + "/processor0/constant/polyMesh/pointProcAddressing");
  const auto result = read_mesh(folder);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_THAT(result->notes, ::testing::Contains(HasSubstr("pointProcAddressing")));
}

TEST_F(FoamProcessorFolders, AFieldThatAProcessorLacksIsNamed) {
  add_fields();
  fs::remove(divided() + "/processor1/0.01/phi");
  EXPECT_THAT(error(), HasSubstr("processor1/0.01/phi"));
}

TEST_F(FoamProcessorFolders, AListOfAnotherLengthIsNamed) {
  add_fields();
  fs::copy_file(divided() + "/processor0/0.01/U", divided() + "/processor1/0.01/U",
                fs::copy_options::overwrite_existing);
  EXPECT_THAT(error(), HasSubstr("processor1/0.01/U"));
  EXPECT_THAT(error(), HasSubstr("elements"));
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
  add_fields();
  const std::string collated = folder_.path("collated");
  collate(collated, {"processors3"});
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder_.path(""))) {
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
    std::ofstream(path, std::ios::binary) << damaged;
    const auto result = read_mesh(path.starts_with(collated) ? collated : divided());
    EXPECT_TRUE(!result || validate(result->mesh)) << seed;
    std::ofstream(path) << whole;
  }
}

}  // namespace
}  // namespace maille
