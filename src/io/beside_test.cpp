#include "io/beside.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <maille/io.h>
#include <maille/series.h>
#include <sys/stat.h>
#include <filesystem>

#include "io/foam/foam_dictionary.h"
#include "support/temporary_folder.h"

namespace maille {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
namespace fs = std::filesystem;

/// A folder with something in it that a file in "in" may not reach, by any name.
class Beside : public ::testing::Test {
 protected:
  Beside() {
    fs::create_directory(folder_.path("in"));
    folder_.write("secret", "root:x:0:0\n");
    fs::create_symlink("../secret", folder_.path("in/link"));
    EXPECT_EQ(::mkfifo(folder_.path("in/pipe").c_str(), 0600), 0);
    fs::create_symlink("/dev/zero", folder_.path("in/zero"));
    names_ = {"link", "pipe",       "zero", "../secret", "/dev/zero", folder_.path("secret"),
              "-",    "http://a/b", ""};
  }
  const testing::TemporaryFolder folder_;
  std::vector<std::string> names_;
};

TEST_F(Beside, OpensRegularFilesOnly) {
  const std::string file = folder_.write("in/file", "");
  folder_.write("in/other", "other");
  ASSERT_TRUE(open_beside(file, "other"));
  EXPECT_EQ((*open_beside(file, "other"))->size(), 5u);
  EXPECT_EQ(path_beside(file, "other").value(), folder_.path("in/other"));
  for (const std::string& name : names_) {
    EXPECT_FALSE(open_beside(file, name)) << name;
    EXPECT_FALSE(path_beside(file, name)) << name;
  }
}

TEST_F(Beside, BuffersOfGltfAreThere) {
  for (const std::string& name : names_) {
    if (name.empty()) continue;  // the buffer of a GLB
    const auto read = read_mesh(folder_.write(
        "in/a.gltf", R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":4,"uri":")" + name + R"("}]})"));
    ASSERT_FALSE(read) << name;
    EXPECT_THAT(read.error().message, HasSubstr("buffer 0")) << name;
  }
}

TEST_F(Beside, PartsOfVtkFilesAreThere) {
  for (const std::string& name : names_) {
    const std::string parts = "<VTKFile type=\"PUnstructuredGrid\"><PUnstructuredGrid><Piece Source=\"" +
                              name + "\"/></PUnstructuredGrid></VTKFile>";
    EXPECT_FALSE(read_mesh(folder_.write("in/a.pvtu", parts))) << name;
    const std::string series = "<VTKFile type=\"Collection\"><Collection><DataSet timestep=\"0\" file=\"" +
                               name + "\"/></Collection></VTKFile>";
    EXPECT_FALSE(read_series(folder_.write("in/a.pvd", series))) << name;
  }
}

TEST_F(Beside, IncludedDictionariesAreThere) {
  for (const std::string& name : names_) {
    const auto read = read_foam_file(folder_.write("in/dict", "#include \"" + name + "\"\n"));
    ASSERT_FALSE(read) << name;
    EXPECT_THAT(read.error().message, Not(HasSubstr("root:"))) << "what is in a file that is not ours";
  }
}

TEST_F(Beside, IncludedDictionariesAreSmall) {
  folder_.write("in/large", "");
  fs::resize_file(folder_.path("in/large"), uint64_t{1} << 40);
  const auto read = read_foam_file(folder_.write("in/dict", "#include \"large\"\n"));
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("16 MiB"));
}

TEST_F(Beside, FilesOfAPolyMeshAreThere) {
  fs::create_directory(folder_.path("in/polyMesh"));
  for (const char* target : {"/dev/zero", "../../secret"}) {
    fs::remove(folder_.path("in/polyMesh/points"));
    fs::create_symlink(target, folder_.path("in/polyMesh/points"));
    const auto read = read_mesh(folder_.path("in/polyMesh"));
    ASSERT_FALSE(read);
    EXPECT_THAT(read.error().message, HasSubstr("leads out of the folder"));
  }
}

}  // namespace
}  // namespace maille
