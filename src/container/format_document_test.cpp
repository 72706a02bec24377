// docs/format.md against the code: its example is a file, its tables name the fields that are written.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "container/testing.h"

namespace maille {
namespace {

using namespace maille::testing;

std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

std::string document() {
  return read_file(MAILLE_TESTS_DIR "/../docs/format.md");
}

/// The lines between ```KIND and ```.
std::string block(const std::string& kind) {
  const std::string text = document(), start = "```" + kind + "\n";
  const size_t begin = text.find(start);
  if (begin == std::string::npos) return "";
  return text.substr(begin + start.size(), text.find("```", begin + 3) - begin - start.size());
}

/// Pairs of hex digits up to the first two spaces of each line; the rest is explanation.
std::vector<std::byte> parse_hex(const std::string& text) {
  std::vector<std::byte> bytes;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream pairs(line.substr(0, line.find("  ")));
    for (std::string pair; pairs >> pair;)
      bytes.push_back(static_cast<std::byte>(std::stoi(pair, nullptr, 16)));
  }
  return bytes;
}

/// The names in the first column of the first table behind a heading, those in backticks.
std::string table_fields(const std::string& heading) {
  const std::string text = document();
  std::istringstream lines(text.substr(text.find(heading)));
  std::string fields, line;
  while (std::getline(lines, line) && line.rfind("|", 0) != 0) {
  }
  for (; line.rfind("|", 0) == 0; std::getline(lines, line)) {
    if (line.rfind("| `", 0) == 0) fields += line.substr(3, line.find('`', 3) - 3) + '\n';
  }
  return fields;
}

template <class Header>
std::string field_names() {
  std::istringstream lines(print_fields(Header()));
  std::string names;
  for (std::string line; std::getline(lines, line);) names += line.substr(0, line.find(' ')) + '\n';
  return names;
}

const std::vector<TestStream>& example_streams() {
  static const std::vector<TestStream> streams = {{{"DATA"}, bytes_of("hello")},
                                                  {{"note", 0, 300}, bytes_of("world!")}};
  return streams;
}

TEST(FormatDocument, ExampleIsAFileWithTheseStreams) {
  const std::vector<std::byte> file = parse_hex(block("hex"));
  ASSERT_GT(file.size(), 90u);
  expect_streams(file, example_streams());
  EXPECT_EQ(damage_report(file, example_streams()), "");
}

TEST(FormatDocument, ExampleIsWhatTheWriterWrites) {
  EXPECT_TRUE(parse_hex(block("hex")) == write_file(example_streams()));
}

TEST(FormatDocument, ExampleHasTheFieldsListed) {
  const std::vector<std::byte> file = parse_hex(block("hex"));
  const auto source = memory_source(file);
  const auto reader = FileReader::open(*source);
  ASSERT_TRUE(reader);
  std::string fields = print_fields(reader->header());
  for (const ChunkRecord& record : reader->records()) fields += print_fields(record.header);
  fields += print_fields(*read_footer(Bytes(file).last(footer_bytes)));
  EXPECT_EQ(block("fields"), fields);
}

TEST(FormatDocument, TablesNameTheFieldsInTheirOrder) {
  EXPECT_EQ(table_fields("\n## 3. Header"), field_names<FileHeader>());
  EXPECT_EQ(table_fields("\n## 4. Chunks"), field_names<ChunkHeader>());
  EXPECT_EQ(table_fields("\n## 5. Footer"), field_names<Footer>());
}

TEST(FormatDocument, StatesTheSizesOfTheCode) {
  const std::string text = document();
  for (const std::string claim :
       {"25 bytes at the front", "The last 20 bytes", "1,048,576", "before byte 65,536"}) {
    EXPECT_THAT(text, ::testing::HasSubstr(claim));
  }
  EXPECT_EQ(file_header_bytes, 25u);
  EXPECT_EQ(footer_bytes, 20u);
  EXPECT_EQ(max_chunk_bytes, 1048576u);
  EXPECT_EQ(indexed_file_bytes, 65536u);
  EXPECT_EQ(chunk_total_bytes({}), 20u);
  EXPECT_EQ(chunk_total_bytes({{}, UINT32_MAX, UINT32_MAX, UINT32_MAX, max_chunk_bytes}),
            max_chunk_bytes + 34u);
  EXPECT_EQ(max_chunk_total_bytes, max_chunk_bytes + 34u);
}

TEST(GoldenFiles, OfTheContainerAreRead) {
  const auto golden = [](const std::string& name) {
    return bytes_of(read_file(MAILLE_TESTS_DIR "/golden/container/" + name));
  };
  const std::vector<TestStream> small = {{{"MESH"}, bytes_of("description")},
                                         {{"CONN"}, bytes_of("triangles")},
                                         {{"CONN", 1}, bytes_of("more triangles")},
                                         {{"POSN"}, bytes_of("points")},
                                         {{"note", 0, 300}, {}}};
  expect_streams(golden("small.maille"), small);
  EXPECT_EQ(damage_report(golden("small.maille"), small), "");
  EXPECT_TRUE(golden("small.maille") == write_file(small));

  const std::vector<TestStream> indexed = {{{"MESH"}, bytes_of("description")},
                                           {{"POSN", UINT32_MAX, 128}, bytes_of("first half, second half")}};
  expect_streams(golden("indexed.maille"), indexed);
  EXPECT_EQ(damage_report(golden("indexed.maille"), indexed), "");
}

TEST(GoldenFiles, WithAnIndexShowEveryBitFlipOrKeepTheirStreams) {
  std::vector<std::byte> file = bytes_of(read_file(MAILLE_TESTS_DIR "/golden/container/indexed.maille"));
  const std::vector<TestStream> streams = {{{"MESH"}, bytes_of("description")},
                                           {{"POSN", UINT32_MAX, 128}, bytes_of("first half, second half")}};
  size_t unharmed = 0;
  for (size_t bit = 0; bit < 8 * file.size(); ++bit) {
    file[bit / 8] ^= std::byte{1} << bit % 8;
    const std::string report = damage_report(file, streams);
    EXPECT_NE(report, "wrong") << bit;
    unharmed += report.empty() ? 1 : 0;
    const auto damage = verify_checksums(*memory_source(file));
    EXPECT_TRUE(!damage || !damage->empty()) << bit;
    file[bit / 8] ^= std::byte{1} << bit % 8;
  }
  const uint64_t index_bytes =
      file.size() - footer_bytes - read_footer(Bytes(file).last(footer_bytes))->index_offset;
  EXPECT_EQ(unharmed, 8 * index_bytes);  // the index is all that can be done without
}

}  // namespace
}  // namespace maille
