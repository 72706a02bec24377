// Lists of files with their times: what may be named, and when.
#include <gmock/gmock.h>
#include <maille/series.h>

#include "support/temporary_folder.h"

namespace maille {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;

std::string list_of(const std::string& entries) {
  return "<VTKFile type=\"Collection\"><Collection>" + entries + "</Collection></VTKFile>";
}

Result<std::vector<SeriesEntry>> read_list(const TemporaryFolder& folder, const std::string& entries) {
  return read_series(folder.write("run.pvd", list_of(entries)));
}

TEST(Series, FilesOfAListAreInItsFolder) {
  const TemporaryFolder folder;
  const auto series = read_list(folder,
                                "<DataSet file='a.vtu'/><DataSet timestep=' 1e-3 ' "
                                "file='steps/b.vtu'/><DataSet timestep='2' file='c.vtu'/>");
  ASSERT_TRUE(series) << series.error().message;
  ASSERT_EQ(series->size(), 3u);
  EXPECT_EQ((*series)[0].path, folder.path("a.vtu"));
  EXPECT_EQ((*series)[0].time, 0);
  EXPECT_EQ((*series)[1].path, folder.path("steps/b.vtu"));
  EXPECT_EQ((*series)[1].time, 1e-3);
  EXPECT_EQ((*series)[2].time, 2);
}

TEST(Series, AListNamesNoFilesElsewhere) {
  const TemporaryFolder folder;
  for (const std::string name :
       {"../x.vtu", "steps/../../x.vtu", "/etc/passwd", "http://127.0.0.1/x.vtu", "-", ""}) {
    const auto series = read_list(folder, "<DataSet timestep='0' file='" + name + "'/>");
    ASSERT_FALSE(series) << name;
    EXPECT_EQ(series.error().code, ErrorCode::malformed_input);
    EXPECT_THAT(series.error().message,
                HasSubstr("\"" + name + "\"; only files in the same folder or below"));
  }
}

TEST(Series, TimesAreFiniteNumbers) {
  const TemporaryFolder folder;
  for (const std::string time : {"nan", "inf", "-inf", "1e999", "soon", "1 2", ""}) {
    const auto series = read_list(folder, "<DataSet timestep='" + time + "' file='a.vtu'/>");
    ASSERT_FALSE(series) << time;
    EXPECT_EQ(series.error().code, ErrorCode::malformed_input);
    EXPECT_THAT(series.error().message, HasSubstr("timestep \"" + time + "\" is no finite number"));
  }
}

TEST(Series, AStepIsOneFile) {
  const TemporaryFolder folder;
  const auto series =
      read_list(folder, "<DataSet timestep='1' file='a.vtu'/><DataSet timestep='1' file='b.vtu'/>");
  ASSERT_FALSE(series);
  EXPECT_EQ(series.error().code, ErrorCode::unsupported);
}

}  // namespace
}  // namespace maille
