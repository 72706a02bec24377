// PLY files read in parts.
#include <maille/mesh_source.h>

#include <gmock/gmock.h>

#include "io/format.h"
#include "io/same_mesh.h"
#include "support/random.h"
#include "support/random_mesh.h"

namespace maille {
namespace {

using namespace maille::testing;
using ::testing::HasSubstr;

RandomMeshOptions what_has_no_lists() {
  RandomMeshOptions options;
  options.faces = 100;
  options.several_blocks = false;
  options.degenerate_faces = false;
  return options;
}

std::string ply_of(uint64_t seed, const WriteOptions& options) {
  Mesh mesh = random_surface(seed, what_has_no_lists());
  std::erase_if(mesh.arrays, [](const Array& array) {
    return array.domain == Domain::corner || array.domain == Domain::mesh;
  });
  return write_text(ply_format(), mesh, options).text;
}

std::unique_ptr<Source> source_of(const std::string& text) {
  return memory_source(std::as_bytes(std::span(text.data(), text.size())));
}

/// Reads everything, `step` rows at a time, and compares with what the reader of whole files gives.
void expect_same_in_parts(const std::string& text, uint64_t step) {
  const auto source = source_of(text);
  const auto whole = read_mesh(*source, {.format = "ply", .limits = {}, .progress = {}});
  ASSERT_TRUE(whole) << whole.error().message;
  const Mesh& mesh = whole->mesh;
  const auto opened = open_mesh_source(*source);
  ASSERT_TRUE(opened) << opened.error().message;
  MeshSource& parts = **opened;
  const MeshDescription& description = parts.description();
  ASSERT_EQ(description.points, mesh.point_count());
  ASSERT_EQ(description.cells, mesh.cell_count());
  ASSERT_EQ(description.corners, mesh.corner_count());
  ASSERT_EQ(description.point_type, mesh.points.type);
  EXPECT_EQ(description.metadata, mesh.metadata);
  ASSERT_EQ(description.blocks.size(), mesh.blocks.size());
  ASSERT_EQ(description.arrays.size(), mesh.arrays.size());
  Array points = make_array("position", Domain::point, description.point_type, 3);
  for (uint64_t first = 0; first < description.points; first += step) {
    const uint64_t count = std::min(step, description.points - first);
    points.resize(first + count);
    ASSERT_TRUE(parts.read_points(first, count, std::span(points.bytes).last(count * points.tuple_size())));
  }
  EXPECT_TRUE(points.bytes == mesh.points.bytes);
  for (size_t i = 0; i < mesh.arrays.size(); ++i) {
    Array array = description.arrays[i];
    const uint64_t all = description.count_of(array);
    for (uint64_t first = 0; first < all; first += step) {
      const uint64_t count = std::min(step, all - first);
      array.resize(first + count);
      ASSERT_TRUE(parts.read_array(i, first, count, std::span(array.bytes).last(count * array.tuple_size())));
    }
    expect_same_array(array, mesh.arrays[i]);
  }
  for (uint64_t first = 0; first < description.cells; first += step) {
    CellPiece cells;
    ASSERT_TRUE(parts.read_cells(first, std::min(step, description.cells - first), cells));
    for (uint64_t i = 0; i < cells.size(); ++i) {
      const auto nodes = mesh.blocks[0].cell(first + i);
      ASSERT_EQ(cells.offsets[i + 1] - cells.offsets[i], nodes.size());
      EXPECT_TRUE(std::equal(nodes.begin(), nodes.end(),
                             cells.connectivity.begin() + static_cast<ptrdiff_t>(cells.offsets[i])));
    }
  }
  if (!mesh.blocks.empty()) {
    EXPECT_EQ(description.blocks[0].type, mesh.blocks[0].type);
  }
}

TEST(PlySource, GivesInPartsWhatIsReadWhole) {
  for (uint64_t seed = 0; seed < 80; ++seed) {
    WriteOptions options;
    options.big_endian = seed % 2 == 1;
    SCOPED_TRACE(seed);
    expect_same_in_parts(ply_of(seed, options), 1 + seed % 30);
  }
}

std::string header(const char* faces, const char* encoding = "binary_little_endian") {
  return std::string("ply\nformat ") + encoding +
         " 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face " +
         faces + "\nproperty list uchar int vertex_indices\nend_header\n";
}
template <class T>
void put(std::string& text, T number) {
  text.append(reinterpret_cast<const char*>(&number), sizeof number);
}
std::string triangle(int32_t last, const char* faces = "1") {
  std::string text = header(faces);
  for (int i = 0; i < 9; ++i) put(text, static_cast<float>(i));
  put(text, uint8_t{3});
  for (const int32_t v : {0, 1, last}) put(text, v);
  return text;
}

TEST(PlySource, NamesTheFaceWithAPointThatIsNotThere) {
  for (const int32_t last : {3, -1, 0x7fffffff}) {
    const std::string text = triangle(last);
    const auto source = source_of(text);
    const auto opened = open_mesh_source(*source);
    ASSERT_TRUE(opened) << opened.error().message;
    CellPiece cells;
    const auto read = (*opened)->read_cells(0, 1, cells);
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, ErrorCode::malformed_input);
    EXPECT_THAT(read.error().message, HasSubstr("face 0: vertex " + std::to_string(last)));
  }
}

TEST(PlySource, SaysWhereAFileEnds) {
  const std::string text = triangle(2);
  const size_t front = header("1").size();
  for (size_t size = front; size < text.size(); ++size) {
    const std::string cut = text.substr(0, size);
    const auto source = source_of(cut);
    const auto opened = open_mesh_source(*source);
    ASSERT_FALSE(opened) << size;
    EXPECT_EQ(opened.error().code, ErrorCode::malformed_input);
    EXPECT_THAT(opened.error().message, HasSubstr("ends inside"));
  }
  const std::string claim = triangle(2, "1000000000000");
  const auto source = source_of(claim);
  EXPECT_THAT(open_mesh_source(*source).error().message, HasSubstr("ends inside face 1 of"));
}

TEST(PlySource, LeavesOtherFilesToTheReaderOfWholeOnes) {
  std::string long_header = triangle(2);
  long_header.insert(long_header.find("element"), "comment " + std::string(1 << 20, '-') + "\n");
  for (const std::string& text : {header("0", "ascii") + "0 0 0\n1 0 0\n0 1 0\n", long_header}) {
    const auto source = source_of(text);
    EXPECT_EQ(open_mesh_source(*source).error().code, ErrorCode::unsupported);
    EXPECT_TRUE(read_mesh(*source, {.format = "ply", .limits = {}, .progress = {}}));
  }
}

/// A text and zeros behind it, which notes the most that was read at once.
class LongFile final : public Source {
 public:
  LongFile(std::string text, uint64_t size) : text_(std::move(text)), size_(size) {}
  uint64_t size() const override { return size_; }
  Result<> read_at(uint64_t offset, std::span<std::byte> out) const override {
    most_ = std::max(most_, out.size());
    for (std::byte& byte : out) {
      byte = offset < text_.size() ? static_cast<std::byte>(text_[offset]) : std::byte{0};
      ++offset;
    }
    return {};
  }
  std::string name() const override { return "long"; }
  size_t most() const { return most_; }

 private:
  std::string text_;
  uint64_t size_;
  mutable size_t most_ = 0;
};

TEST(PlySource, PassesOverAHugeFaceWithoutReadingIt) {
  std::string text = header("2");
  text.replace(text.find("uchar"), 5, "uint");
  for (int i = 0; i < 9; ++i) put(text, static_cast<float>(i));
  constexpr uint32_t corners = 4'000'000'000;
  put(text, corners);
  // The face behind it has no corners: the rest is zeros.
  const LongFile file(text, text.size() + 4 * uint64_t{corners} + 4);
  const auto opened = open_mesh_source(file);
  ASSERT_TRUE(opened) << opened.error().message;
  EXPECT_EQ((*opened)->description().corners, corners);
  CellPiece cells;
  ASSERT_TRUE((*opened)->read_cells(1, 1, cells));
  EXPECT_EQ(cells.offsets, (std::vector<uint64_t>{0, 0}));
  EXPECT_LE(file.most(), size_t{1} << 20);
}

TEST(PlySource, SurvivesDamage) {
  Random random(1);
  for (uint64_t seed = 0; seed < 300; ++seed) {
    std::string text = ply_of(seed % 10, {});
    for (uint32_t n = 1 + random.below(4); n > 0; --n)
      text[random.below(static_cast<uint32_t>(text.size()))] = static_cast<char>(random.below(256));
    const auto source = source_of(text);
    const auto opened = open_mesh_source(*source, {uint64_t{1} << 20});
    if (!opened) continue;
    MeshSource& parts = **opened;
    const MeshDescription& description = parts.description();
    std::vector<std::byte> room(description.points * 3 * size_of(description.point_type));
    (void)parts.read_points(0, description.points, room);
    for (size_t i = 0; i < description.arrays.size(); ++i) {
      const uint64_t count = description.count_of(description.arrays[i]);
      room.resize(count * description.arrays[i].tuple_size());
      (void)parts.read_array(i, 0, count, room);
    }
    CellPiece cells;
    if (!parts.read_cells(0, description.cells, cells)) continue;
    for (const uint64_t node : cells.connectivity) ASSERT_LT(node, description.points);
  }
}

}  // namespace
}  // namespace maille
