// docs/format.md against the code: its examples are files, its tables name the fields that are written.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <maille/decode.h>
#include <maille/encode.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>

#include "container/packed_file.h"
#include "container/testing.h"
#include "entropy/byte_model.h"
#include "entropy/integer_model.h"
#include "entropy/rans.h"
#include "support/data.h"
#include "support/format_document.h"
#include "surface/half_edges.h"

namespace maille {
namespace {

using namespace maille::testing;

std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// The document as one line: its lines are wrapped anywhere.
std::string prose() {
  std::string text = format_document();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

/// The names in the first column of the first table behind a heading, those in backticks.
std::string table_fields(const std::string& heading) {
  const std::string text = format_document();
  std::istringstream lines(text.substr(text.find(heading)));
  std::string fields, line;
  while (std::getline(lines, line) && line.rfind("|", 0) != 0) {
  }
  for (; line.rfind("|", 0) == 0; std::getline(lines, line)) {
    if (line.rfind("| `", 0) == 0) fields += line.substr(3, line.find('`', 3) - 3) + '\n';
  }
  return fields;
}

/// One line a field: name, space, value.
class FieldPrinter {
 public:
  template <class T>
  void fixed(const char* name, const T& value) {
    line(name, std::to_string(static_cast<uint64_t>(value)));
  }
  void count(const char* name, const uint32_t& value, uint32_t) { line(name, std::to_string(value)); }
  void letters(const char* name, const ChunkType& type) { line(name, std::string(type.begin(), type.end())); }

  const std::string& text() const { return text_; }

 private:
  void line(const char* name, const std::string& value) { text_ += std::string(name) + ' ' + value + '\n'; }

  std::string text_;
};

template <class Header>
std::string print_fields(const Header& header) {
  FieldPrinter printer;
  Header::visit(header, printer);
  return printer.text();
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
  const std::vector<std::byte> file = example_of_document();
  ASSERT_GT(file.size(), 90u);
  expect_streams(file, example_streams());
  EXPECT_EQ(damage_report(file, example_streams()), "");
}

TEST(FormatDocument, ExampleIsWhatTheWriterWrites) {
  EXPECT_TRUE(example_of_document() == write_file(example_streams()));
}

TEST(FormatDocument, ExampleHasTheFieldsListed) {
  const std::vector<std::byte> file = example_of_document();
  const auto source = memory_source(file);
  const auto reader = FileReader::open(*source);
  ASSERT_TRUE(reader);
  std::string fields = print_fields(reader->header());
  for (const ChunkRecord& record : reader->records()) fields += print_fields(record.header);
  fields += print_fields(*read_footer(Bytes(file).last(footer_bytes)));
  EXPECT_EQ(block_of_document("fields"), fields);
}

TEST(FormatDocument, TablesNameTheFieldsInTheirOrder) {
  EXPECT_EQ(table_fields("\n## 3. Header"), field_names<FileHeader>());
  EXPECT_EQ(table_fields("\n## 4. Chunks"), field_names<ChunkHeader>());
  EXPECT_EQ(table_fields("\n## 5. Footer"), field_names<Footer>());
  EXPECT_EQ(table_fields("\n### Packed files"), field_names<PackedEntry>());
}

TEST(FormatDocument, StatesTheSizesOfTheCode) {
  const std::string text = prose();
  for (const std::string claim :
       {"25 bytes at the front", "The last 20 bytes", "1,048,576", "before byte 65,536"}) {
    EXPECT_THAT(text, ::testing::HasSubstr(claim));
  }
  EXPECT_EQ(file_header_bytes, 25u);
  EXPECT_EQ(footer_bytes, 20u);
  EXPECT_EQ(max_chunk_bytes, 1048576u);
  EXPECT_EQ(indexed_file_bytes, 65536u);
  EXPECT_EQ(most_packed_bytes, 65536u);
  EXPECT_EQ(chunk_total_bytes({}), 20u);
  EXPECT_EQ(chunk_total_bytes({{}, UINT32_MAX, UINT32_MAX, UINT32_MAX, max_chunk_bytes}),
            max_chunk_bytes + 34u);
}

/// One line of the worked example of the entropy coder.
struct CoderStep {
  std::string operation;  ///< "bit(A) = 1"
  uint64_t start, frequency, slot, state;
  unsigned width;
  std::string word;  ///< in hexadecimal digits; "-": none
};

std::vector<CoderStep> coder_steps() {
  std::vector<CoderStep> steps;
  std::istringstream lines(block_of_document("rans"));
  std::string line;
  std::getline(lines, line);  // headings
  while (std::getline(lines, line)) {
    CoderStep& step = steps.emplace_back();
    std::string equals, value;
    std::istringstream fields(line);
    fields >> step.operation >> equals >> value >> step.start >> step.frequency >> step.width >> step.slot;
    fields >> std::hex >> step.state >> step.word;
    step.operation += " = " + value;
  }
  return steps;
}

TEST(FormatDocument, CoderExampleFollowsItsFormulas) {
  const std::vector<std::byte> bytes = example_of_document("rans");
  ASSERT_EQ(bytes.size(), 12u);
  auto state = load<uint64_t>(bytes.data());
  for (const CoderStep& step : coder_steps()) {
    const uint64_t slots = uint64_t{1} << step.width;
    EXPECT_EQ(state % slots, step.slot) << step.operation;
    EXPECT_TRUE(step.start <= step.slot && step.slot < step.start + step.frequency) << step.operation;
    state = step.frequency * (state >> step.width) + step.slot - step.start;
    EXPECT_EQ(step.word != "-", state < uint64_t{1} << 32) << step.operation;
    if (step.word != "-") state = state << 32 | std::stoul(step.word, nullptr, 16);
    EXPECT_EQ(state, step.state) << step.operation;
  }
  EXPECT_EQ(state, uint64_t{1} << 32);
}

/// The operations of the example, in the order of its lines.
template <class Coder>
std::vector<std::string> code_example(Coder& coder) {
  BitModel a, b;
  SymbolModel s;
  std::vector<std::string> done;
  const auto note = [&](const std::string& operation, uint32_t value) {
    done.push_back(operation + " = " + std::to_string(value));
  };
  note("bit(A)", a.code(coder, true));
  note("bit(A)", a.code(coder, true));
  note("bit(B)", b.code(coder, false));
  note("raw(32)", coder.code_raw(305419896, 32));
  note("symbol(S)", s.code(coder, 7));
  note("symbol(S)", s.code(coder, 7));
  note("raw(0)", coder.code_raw(0, 0));
  note("raw(5)", coder.code_raw(19, 5));
  EXPECT_THAT(format_document(), ::testing::HasSubstr("A has p = " + std::to_string(a.probability())));
  EXPECT_THAT(format_document(), ::testing::HasSubstr("B has p = " + std::to_string(b.probability())));
  return done;
}

TEST(FormatDocument, CoderExampleIsDecodedAndWritten) {
  std::vector<std::string> listed;
  for (const CoderStep& step : coder_steps()) listed.push_back(step.operation);
  const std::vector<std::byte> bytes = example_of_document("rans");
  RansDecoder decoder(bytes);
  EXPECT_EQ(code_example(decoder), listed);
  EXPECT_FALSE(decoder.exhausted());
  RansEncoder encoder;
  EXPECT_EQ(code_example(encoder), listed);
  EXPECT_TRUE(encoder.finish() == bytes);
}

/// The mesh as the document lists it.
std::string print(const Mesh& mesh) {
  std::ostringstream text;
  const auto numbers = mesh.points.values<float>();
  for (size_t i = 0; i < numbers.size(); i += 3) {
    text << "point " << numbers[i] << ' ' << numbers[i + 1] << ' ' << numbers[i + 2] << '\n';
  }
  for (const CellBlock& cells : mesh.blocks) {
    for (uint64_t i = 0; i < cells.size(); ++i) {
      text << name_of(cells.type);
      for (const uint32_t point : cells.cell(i)) text << ' ' << point;
      text << '\n';
    }
  }
  return text.str();
}

TEST(FormatDocument, TetrahedronIsTheMeshListed) {
  const std::vector<std::byte> file = example_of_document("default tetrahedron");
  const auto source = memory_source(file);
  const auto mesh = decode(*source);
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->points.type, Scalar::f32);
  EXPECT_EQ(print(*mesh), block_of_document("mesh"));
  const auto description = FileReader::open(*source)->read_stream({"DESC"});
  ASSERT_TRUE(description);
  const std::vector<std::byte> plain = example_of_document("description");
  EXPECT_EQ(static_cast<uint8_t>(description->front()), plain.size());
  EXPECT_TRUE(std::equal(description->begin() + 1, description->end(), plain.begin(), plain.end()));
}

TEST(FormatDocument, TetrahedronIsWhatTheEncoderWrites) {
  Mesh mesh;
  const float points[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const Bytes bytes = std::as_bytes(std::span(points));
  mesh.points.bytes.assign(bytes.begin(), bytes.end());
  CellBlock& faces = mesh.blocks.emplace_back();
  faces.type = CellType::triangle;
  faces.connectivity = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
  std::vector<std::byte> file;
  const auto sink = memory_sink(file);
  const auto report = encode(mesh, *sink, {});
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_TRUE(file == example_of_document("default tetrahedron"));
}

TEST(FormatDocument, StatesTheLimitsOfModeSingle) {
  const std::string text = prose();
  for (const std::string claim :
       {"exactly 131,072 operations", "v = min(v + 1, 126)", "3 to 65,535 corners"}) {
    EXPECT_THAT(text, ::testing::HasSubstr(claim));
  }
  EXPECT_EQ(operations_per_block, 131072u);
  EXPECT_EQ(adaptation_limit, 126u);
  EXPECT_EQ(max_degree, 65535u);
}

TEST(FormatDocument, ListsTheCellTypes) {
  const std::string text = format_document();
  std::istringstream lines(text.substr(text.find("\n| type | | nodes |")));
  std::array<std::string, 256> listed;
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line) && line.rfind("|", 0) == 0) {
    std::istringstream cells(line.substr(1));
    for (std::string number, name, nodes; std::getline(cells, number, '|');) {
      std::getline(cells, name, '|');
      std::getline(cells, nodes, '|');
      const unsigned type = static_cast<unsigned>(std::strtoul(number.c_str(), nullptr, 10));
      if (type > 0 && type < 256) listed[type] = nodes.substr(1, nodes.size() - 2);
    }
  }
  for (unsigned i = 0; i < 256; ++i) {
    const auto type = static_cast<CellType>(i);
    const unsigned nodes = nodes_of(type);
    const bool known = std::string(name_of(type)) != "unknown";
    EXPECT_EQ(listed[i], !known ? "" : nodes == 0 ? "any" : std::to_string(nodes)) << i;
  }
}

TEST(GoldenFiles, OfTheContainerAreRead) {
  const auto golden = [](const std::string& name) {
    return bytes_of(read_file(tests_folder() + "/golden/container/" + name));
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
  std::vector<std::byte> file = bytes_of(read_file(tests_folder() + "/golden/container/indexed.maille"));
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
