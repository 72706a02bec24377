// The shared real meshes in PLY, OBJ, OFF and STL: counts as the manifest says, and exact round trips.

#include <gtest/gtest.h>
#include <maille/io.h>

#include <fstream>
#include <sstream>

#include "support/data.h"

namespace maille {
namespace {

struct Entry {
  std::string file;
  uint64_t points = 0;
  uint64_t cells = 0;
};

std::vector<Entry> entries() {
  std::vector<Entry> list;
  if (testing::data_folder().empty()) return list;
  std::ifstream manifest(testing::data_folder() + "/manifest.tsv");
  std::string line;
  std::getline(manifest, line);
  while (std::getline(manifest, line)) {
    std::istringstream fields(line);
    Entry entry;
    std::string kind;
    std::getline(fields, entry.file, '\t');
    std::getline(fields, kind, '\t');
    fields >> entry.points >> entry.cells;
    // The sanitizer build is given the small files only.
    if (!std::ifstream(testing::data_folder() + "/" + entry.file)) continue;
    const auto format = format_of(entry.file);
    if (format && (*format == "ply" || *format == "obj" || *format == "off" || *format == "stl"))
      list.push_back(entry);
  }
  return list;
}

TEST(RealFiles, HaveTheCountsOfTheManifest) {
  if (entries().empty()) GTEST_SKIP() << "the shared meshes and their manifest are not on this machine";
  EXPECT_GE(entries().size(), 8u);
  for (const Entry& entry : entries()) {
    const auto result = read_mesh(testing::data_folder() + "/" + entry.file);
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_EQ(result->mesh.point_count(), entry.points) << entry.file;
    EXPECT_EQ(result->mesh.cell_count(), entry.cells) << entry.file;
  }
}

const Array* find(const Mesh& mesh, const Array& array) {
  return mesh.find(array.name, array.domain);
}

/// Read, write in the same format, read again: the same mesh.
TEST(RealFiles, ComeBackFromTheirOwnFormat) {
  if (entries().empty()) GTEST_SKIP() << "the shared meshes and their manifest are not on this machine";
  for (const Entry& entry : entries()) {
    const auto first = read_mesh(testing::data_folder() + "/" + entry.file);
    ASSERT_TRUE(first) << entry.file;
    WriteOptions write;
    write.format = *format_of(entry.file);
    std::vector<std::byte> bytes;
    const auto sink = memory_sink(bytes);
    const auto notes = write_mesh(first->mesh, *sink, write);
    ASSERT_TRUE(notes) << entry.file;
    EXPECT_TRUE(notes->empty()) << entry.file << ": " << notes->front();
    ReadOptions read;
    read.format = write.format;
    const auto second = read_mesh(*memory_source(Bytes(bytes)), read);
    ASSERT_TRUE(second) << entry.file << ": " << second.error().message;
    const Mesh& a = first->mesh;
    const Mesh& b = second->mesh;
    EXPECT_EQ(a.points.type, b.points.type) << entry.file;
    EXPECT_TRUE(a.points.bytes == b.points.bytes) << entry.file;
    ASSERT_EQ(a.blocks.size(), b.blocks.size()) << entry.file;
    for (size_t i = 0; i < a.blocks.size(); ++i) {
      EXPECT_TRUE(a.blocks[i].connectivity == b.blocks[i].connectivity) << entry.file;
      EXPECT_TRUE(a.blocks[i].offsets == b.blocks[i].offsets) << entry.file;
    }
    ASSERT_EQ(a.arrays.size(), b.arrays.size()) << entry.file;
    for (const Array& array : a.arrays) {
      ASSERT_TRUE(find(b, array)) << entry.file << ": " << array.name;
      EXPECT_TRUE(find(b, array)->bytes == array.bytes) << entry.file << ": " << array.name;
      EXPECT_TRUE(find(b, array)->labels == array.labels) << entry.file << ": " << array.name;
    }
    EXPECT_EQ(a.metadata, b.metadata) << entry.file;
  }
}

}  // namespace
}  // namespace maille
