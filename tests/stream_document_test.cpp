// docs/format.md, section 16: its example is decoded and written, its limits are those of the code.
#include <maille/decode.h>
#include <maille/encode.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "support/format_document.h"
#include "volume/cells/face_coder.h"
#include "volume/stream/stream_layout.h"

namespace maille::testing {
namespace {

/// A tetrahedron and, on one of its faces, another one given by its faces.
Mesh example() {
  Mesh mesh;
  const float points[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1};
  const Bytes bytes = std::as_bytes(std::span(points));
  mesh.points.bytes.assign(bytes.begin(), bytes.end());
  CellBlock& cells = mesh.blocks.emplace_back();
  cells.type = CellType::mixed;
  cells.types = {10, 42};
  cells.offsets = {0, 4, 16};
  cells.connectivity = {0, 1, 2, 3, 1, 3, 2, 1, 2, 4, 2, 3, 4, 3, 1, 4};
  cells.face_sizes = {3, 3, 3, 3};
  cells.cell_faces = {0, 0, 4};
  return mesh;
}

std::string print(const Mesh& mesh) {
  std::ostringstream text;
  const auto numbers = mesh.points.values<float>();
  for (size_t i = 0; i < numbers.size(); i += 3)
    text << "point " << numbers[i] << ' ' << numbers[i + 1] << ' ' << numbers[i + 2] << '\n';
  for (const CellBlock& cells : mesh.blocks) {
    for (uint64_t i = 0; i < cells.size(); ++i) {
      text << name_of(cells.type_of(i));
      size_t in_face = 0, face = 0;
      for (const uint32_t point : cells.cell(i)) {
        text << ' ' << point;
        if (cells.faces(i).empty() || ++in_face < cells.faces(i)[face]) continue;
        if (++face < cells.faces(i).size()) text << ',';
        in_face = 0;
      }
      text << '\n';
    }
  }
  return text.str();
}

TEST(StreamDocument, ExampleIsTheMeshListed) {
  const std::vector<std::byte> file = example_of_document("stream");
  const auto mesh = decode(*memory_source(Bytes(file)));
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(print(*mesh), block_of_document("mesh stream"));
}

TEST(StreamDocument, ExampleIsWhatTheEncoderWrites) {
  std::vector<std::byte> file;
  EncodeOptions options;
  options.mode = Mode::stream;
  options.order = Order::keep;
  options.effort = 1;
  const auto report = encode(example(), *memory_sink(file), options);
  ASSERT_TRUE(report) << report.error().message;
  std::ostringstream hex;
  for (const std::byte byte : file) hex << ' ' << std::hex << static_cast<unsigned>(byte);
  EXPECT_TRUE(file == example_of_document("stream")) << "now:" << hex.str();
  EXPECT_EQ(print(example()), block_of_document("mesh stream"));
}

TEST(StreamDocument, StatesTheLimitsOfModeStream) {
  std::string text = format_document();
  std::replace(text.begin(), text.end(), '\n', ' ');
  for (const std::string claim :
       {"records (count, at most 2^26)", "*blocks* of 4096", "more than 2^22 corners",
        "0 to 2^24; for each point", "hash(base, valence + 196608)"}) {
    EXPECT_THAT(text, ::testing::HasSubstr(claim));
  }
  EXPECT_THAT(document("encoder.md"), ::testing::HasSubstr("524,288 records or 192 KiB"));
  EXPECT_EQ(most_records_per_batch, uint64_t{1} << 26);
  EXPECT_EQ(cells_per_block, 4096u);
  EXPECT_EQ(most_face_corners, 1u << 22);
  EXPECT_EQ(most_loose_nodes, 1u << 24);
  EXPECT_EQ(StreamOptions{}.most_cells_per_batch, 524288u);
  EXPECT_EQ(StreamOptions{}.bytes_per_batch, 192u * 1024);
  EXPECT_EQ(face_cell, 21u);
}

}  // namespace
}  // namespace maille::testing
