#include "code/efforts.h"
#include "container/file_reader.h"
#include "support/codec.h"
#include "support/shapes.h"
#include "volume/testing.h"

#include <gtest/gtest.h>

namespace maille::testing {
namespace {

/// The content of all chunks but descriptions, which name the effort.
std::vector<std::byte> streams_of(const Mesh& mesh, EncodeOptions options, int effort) {
  options.effort = effort;
  const auto encoded = encode_bytes(mesh, options);
  if (!encoded) return {};
  const auto source = memory_source(Bytes(encoded->bytes));
  const auto reader = FileReader::open(*source);
  std::vector<std::byte> streams;
  for (const ChunkRecord& record : reader->records()) {
    if (record.header.type == ChunkType{'D', 'E', 'S', 'C'}) continue;
    const auto content = reader->read_chunk(record);
    streams.insert(streams.end(), content->begin(), content->end());
  }
  return streams;
}

struct Sample {
  Mesh mesh;
  EncodeOptions options;
};

/// A surface and a volume in no good order: what an effort switches on shows in one of them.
std::vector<Sample> samples() {
  return {{sphere(30, 20), {}}, {scattered_grid(12, 1), kept()}};
}

TEST(Efforts, AreRowsFromOneToNine) {
  int next = 1;
  for (const Effort& row : efforts) {
    EXPECT_EQ(row.first, next);
    for (int effort = row.first; effort <= row.last; ++effort) EXPECT_EQ(&effort_of(effort), &row);
    next = row.last + 1;
  }
  EXPECT_EQ(next, 10);
  EXPECT_EQ(&effort_of(0), &efforts.front());
  EXPECT_EQ(&effort_of(100), &efforts.back());
}

TEST(Efforts, OfOneRowWriteTheSameStreams) {
  for (const Sample& sample : samples()) {
    for (const Effort& row : efforts) {
      const auto expected = streams_of(sample.mesh, sample.options, row.first);
      for (int effort = row.first + 1; effort <= row.last; ++effort)
        EXPECT_EQ(streams_of(sample.mesh, sample.options, effort), expected) << effort;
    }
  }
}

TEST(Efforts, OfOtherRowsWriteOtherStreams) {
  for (size_t row = 1; row < efforts.size(); ++row) {
    bool differ = false;
    for (const Sample& sample : samples()) {
      differ = differ || streams_of(sample.mesh, sample.options, efforts[row - 1].first) !=
                             streams_of(sample.mesh, sample.options, efforts[row].first);
    }
    EXPECT_TRUE(differ) << efforts[row].first;
  }
}

// Effort 9 once took a thousand times the bytes of effort 5 for it.
TEST(Efforts, OneFaceManyTimesTakesFewBytesWithEach) {
  Mesh mesh = sphere(3, 2);
  const std::vector<uint32_t> face = {0, 1, 2};
  CellBlock block;
  block.type = CellType::triangle;
  for (unsigned i = 0; i < 20000; ++i)
    block.connectivity.insert(block.connectivity.end(), face.begin(), face.end());
  mesh.blocks = {block};
  for (const Effort& row : efforts) {
    EncodeOptions options;
    options.effort = row.first;
    const auto encoded = encode_bytes(mesh, options);
    ASSERT_TRUE(encoded) << encoded.error().message;
    EXPECT_LT(encoded->bytes.size(), 1000u) << row.first;
  }
}

}  // namespace
}  // namespace maille::testing
