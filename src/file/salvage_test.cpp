// salvage() of modes `single` and `random`; of mode `stream` there is more in src/volume.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/random_access.h>
#include <numeric>

#include <algorithm>
#include <numeric>

#include "container/file_reader.h"
#include "description/description.h"
#include "random/keep_cells.h"
#include "support/cases.h"
#include "support/random.h"
#include "support/random_streams.h"

namespace maille::testing {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;

Result<Salvaged> salvage_bytes(const std::vector<std::byte>& bytes) {
  return salvage(*memory_source(Bytes(bytes), "x.maille"));
}

/// A bit in the middle of the content of a stream's first chunk.
std::vector<std::byte> flipped(std::vector<std::byte> bytes, const std::string& type, uint32_t patch = 0) {
  const auto source = memory_source(Bytes(bytes));
  const FileReader reader = FileReader::open(*source).value();
  for (const ChunkRecord& record : reader.records()) {
    const ChunkHeader& header = record.header;
    if (std::string(header.type.begin(), header.type.end()) != type || header.patch != patch) continue;
    // In the middle; of an empty stream the check in front of it.
    const uint64_t end = reader.content_offset(record) + header.size;
    bytes[static_cast<size_t>(end - header.size / 2 - 1)] ^= std::byte{8};
    return bytes;
  }
  ADD_FAILURE() << "no chunk " << type << " of patch " << patch;
  return bytes;
}

std::vector<std::byte> in_parts(const Mesh& mesh, Order order = Order::canonical) {
  EncodeOptions options;
  options.most_cells_per_part = 60;
  options.order = order;
  options.effort = 3;
  return encode_bytes(mesh, options).value().bytes;
}

uint32_t parts_of(const std::vector<std::byte>& bytes) {
  return static_cast<uint32_t>(inspect(*memory_source(Bytes(bytes))).value().parts);
}

/// Faces of a decoded mesh that are not of this part; each has one of a block's ranges.
Mesh without_part(const Mesh& decoded, const std::vector<std::byte>& bytes, uint32_t part) {
  std::vector<bool> keep;
  const auto source = memory_source(Bytes(bytes));
  const FileReader reader = FileReader::open(*source).value();
  const Description description = decode_description(reader.read_stream({"DESC"}).value(), {}).value();
  for (size_t block = 0; block < description.blocks.size(); ++block) {
    for (uint32_t p = 0; p < description.parts.size(); ++p) {
      for (const BlockCells& here : description.parts[p].cells)
        keep.insert(keep.end(), here.block == block ? here.cells : 0, p != part);
    }
  }
  return keep_cells(decoded, keep);
}

/// Faces with points of their own.
Mesh seams_everywhere() {
  const Mesh smooth = to_mesh(shapes::grid(20, 20));
  Surface surface;
  for (uint64_t i = 0; i < smooth.cell_count(); ++i) {
    std::vector<uint32_t>& face = surface.faces.emplace_back();
    for (const uint32_t point : smooth.blocks[0].cell(i)) {
      face.push_back(static_cast<uint32_t>(surface.points.size()));
      std::array<double, 3>& place = surface.points.emplace_back();
      for (size_t k = 0; k < 3; ++k) place[k] = smooth.points.values<float>()[3 * point + k];
    }
  }
  Mesh mesh = to_mesh(surface);
  Array array = make_array("colour", Domain::point, Scalar::u8, 1);
  array.resize(mesh.point_count());
  for (uint64_t i = 0; i < array.count(); ++i) array.bytes[i] = static_cast<std::byte>(i / 4 % 7);
  mesh.arrays.push_back(std::move(array));
  return mesh;
}

TEST(Salvage, OfAWholeFileIsItsMesh) {
  const Mesh mesh = sample_mesh();
  for (const std::vector<std::byte>& bytes : {in_parts(mesh), random_file(mesh, {}, 24).bytes}) {
    const auto salvaged = salvage_bytes(bytes);
    ASSERT_TRUE(salvaged) << salvaged.error().message;
    EXPECT_FALSE(salvaged->damage);
    EXPECT_EQ(differences_between(mesh, salvaged->mesh), "");
  }
}

TEST(Salvage, LosesOnlyThePartThatIsDamaged) {
  const Mesh mesh = sample_mesh();
  const std::vector<std::byte> bytes = in_parts(mesh);
  const Mesh decoded = decode_bytes(bytes).value();
  const uint32_t parts = parts_of(bytes);
  ASSERT_GE(parts, 4u);
  for (uint32_t part = 0; part < parts; ++part) {
    for (const char* type : {"TOPO", "POSI"}) {
      const auto salvaged = salvage_bytes(flipped(bytes, type, part));
      ASSERT_TRUE(salvaged) << salvaged.error().message;
      ASSERT_TRUE(salvaged->damage);
      EXPECT_THAT(salvaged->damage->message, HasSubstr("lost: 1 of " + std::to_string(parts) + " parts"));
      EXPECT_EQ(differences_between(without_part(decoded, bytes, part), salvaged->mesh), "") << part << type;
    }
  }
}

TEST(Salvage, LosesOnlyTheArrayThatIsDamaged) {
  const Mesh mesh = sample_mesh();
  for (const std::vector<std::byte>& bytes : {in_parts(mesh), encode_bytes(mesh).value().bytes}) {
    Mesh rest = mesh;
    rest.arrays.erase(rest.arrays.begin());
    const uint32_t last = parts_of(bytes) - 1;
    const auto salvaged = salvage_bytes(flipped(bytes, "ARRY", last));
    ASSERT_TRUE(salvaged) << salvaged.error().message;
    ASSERT_TRUE(salvaged->damage);
    EXPECT_THAT(salvaged->damage->message, HasSubstr("lost: the array \"height\""));
    EXPECT_EQ(differences_between(rest, salvaged->mesh), "");
  }
}

TEST(Salvage, TellsArraysOfOneNameApart) {
  Mesh mesh = sample_mesh();
  for (Array& array : mesh.arrays) array.name = "a";
  Mesh rest = mesh;
  rest.arrays.erase(rest.arrays.begin());
  for (const std::vector<std::byte>& bytes : {in_parts(mesh), encode_bytes(mesh).value().bytes}) {
    const auto salvaged = salvage_bytes(flipped(bytes, "ARRY"));
    ASSERT_TRUE(salvaged) << salvaged.error().message;
    ASSERT_TRUE(salvaged->damage);
    EXPECT_THAT(salvaged->damage->message, EndsWith("lost: the array \"a\" (point)"));
    EXPECT_EQ(differences_between(rest, salvaged->mesh), "");
  }
}

/// A disk that fails once, in one read.
class FailingSource final : public Source {
 public:
  FailingSource(Bytes bytes, int64_t read) : bytes_(memory_source(bytes)), left_(read) {}
  uint64_t size() const override { return bytes_->size(); }
  std::string name() const override { return "x.maille"; }
  bool has_failed() const { return failed_; }
  Result<> read_at(uint64_t offset, std::span<std::byte> out) const override {
    if (left_-- > 0) return bytes_->read_at(offset, out);
    failed_ = true;
    return tl::unexpected(Error{ErrorCode::cannot_read, "x.maille: the disk fails"});
  }

 private:
  std::unique_ptr<Source> bytes_;
  mutable int64_t left_;
  mutable bool failed_ = false;
};

TEST(Salvage, EndsAtErrorsThatAreNotDamage) {
  const Mesh mesh = sample_mesh();
  EncodeOptions kept;
  kept.order = Order::keep;
  const std::vector<std::vector<std::byte>> files = {
      flipped(in_parts(mesh, Order::keep), "ORDR"), flipped(in_parts(mesh), "POSI", 0),
      flipped(encode_bytes(mesh).value().bytes, "ARRY"),
      flipped(encode_bytes(seams_everywhere()).value().bytes, "TWIN"),
      flipped(random_file(mesh, kept, 24).bytes, "ARRY")};
  for (size_t i = 0; i < files.size(); ++i) {
    for (int64_t read = 0;; ++read) {
      const FailingSource source(files[i], read);
      const auto salvaged = salvage(source);
      if (!source.has_failed()) {
        EXPECT_TRUE(salvaged) << i;
        break;
      }
      ASSERT_FALSE(salvaged) << i << ' ' << read;
      ASSERT_EQ(salvaged.error().code, ErrorCode::cannot_read) << salvaged.error().message;
    }
  }
}

TEST(Salvage, OfAnEmptyMeshWithoutItsOrderIsEmpty) {
  EncodeOptions kept;
  kept.order = Order::keep;
  for (const std::vector<std::byte>& bytes :
       {encode_bytes(Mesh{}, kept).value().bytes, random_file(Mesh{}, kept).bytes}) {
    const auto salvaged = salvage_bytes(flipped(bytes, "ORDR"));
    ASSERT_TRUE(salvaged) << salvaged.error().message;
    ASSERT_TRUE(salvaged->damage);
    EXPECT_THAT(salvaged->damage->message, EndsWith("lost: the input's order"));
    EXPECT_EQ(salvaged->mesh.point_count(), 0u);
  }
}

TEST(Salvage, WithoutJoinsHasPointsAtOnePlaceAsOne) {
  const Mesh mesh = sample_mesh();
  for (const Order order : {Order::canonical, Order::keep}) {
    const auto salvaged = salvage_bytes(flipped(in_parts(mesh, order), "JOIN"));
    ASSERT_TRUE(salvaged) << salvaged.error().message;
    ASSERT_TRUE(salvaged->damage);
    EXPECT_THAT(salvaged->damage->message, HasSubstr("lost: which points the parts share"));
    EXPECT_EQ(differences_between(mesh, salvaged->mesh), "");
  }
}

TEST(Salvage, WithoutTheOrderHasTheMeshInAnother) {
  const Mesh mesh = sample_mesh();
  EncodeOptions kept;
  kept.order = Order::keep;
  const RandomFile random = random_file(mesh, kept, 24);
  for (const std::vector<std::byte>& bytes : {in_parts(mesh, Order::keep), random.bytes}) {
    const auto salvaged = salvage_bytes(flipped(bytes, "ORDR"));
    ASSERT_TRUE(salvaged) << salvaged.error().message;
    ASSERT_TRUE(salvaged->damage);
    EXPECT_THAT(salvaged->damage->message, HasSubstr("lost: the input's order"));
    EXPECT_EQ(differences_between(mesh, salvaged->mesh), "");
  }
}

TEST(Salvage, OfAStreamWithoutTheOrderHasAllOfTheMesh) {
  Mesh mesh = to_mesh(shapes::grid(64, 64));
  mesh.blocks[0].type = CellType::quad;
  mesh.blocks[0].offsets.clear();
  Random random(1);
  const auto quad = [&](uint64_t k) {
    return mesh.blocks[0].connectivity.begin() + static_cast<ptrdiff_t>(4 * k);
  };
  for (uint32_t i = static_cast<uint32_t>(mesh.cell_count()); i-- > 1;) {
    const uint32_t k = random.below(i);
    std::swap_ranges(quad(i), quad(i) + 4, quad(k));
  }
  // Numbers that rise along the input's order are in no other place of the file.
  Mesh numbered = mesh;
  Array ids = make_array("id", Domain::cell, Scalar::i64, 1);
  ids.resize(mesh.cell_count());
  std::iota(ids.values<int64_t>().begin(), ids.values<int64_t>().end(), 1);
  numbered.arrays.push_back(std::move(ids));
  EncodeOptions options;
  options.mode = Mode::stream;
  options.order = Order::keep;
  const auto salvaged = salvage_bytes(flipped(encode_bytes(numbered, options).value().bytes, "ordr"));
  ASSERT_TRUE(salvaged) << salvaged.error().message;
  ASSERT_TRUE(salvaged->damage);
  EXPECT_THAT(salvaged->damage->message, HasSubstr("lost: the input's order, the array \"id\""));
  EXPECT_EQ(differences_between(mesh, salvaged->mesh), "");
}

TEST(Salvage, WithoutTwinsHasPointsAtOnePlaceAsOne) {
  const Mesh mesh = seams_everywhere();
  const auto salvaged = salvage_bytes(flipped(encode_bytes(mesh).value().bytes, "TWIN"));
  ASSERT_TRUE(salvaged) << salvaged.error().message;
  ASSERT_TRUE(salvaged->damage);
  EXPECT_THAT(salvaged->damage->message,
              HasSubstr("which points are several at one place, the array \"colour\""));
  EXPECT_EQ(differences_between(to_mesh(shapes::grid(20, 20)), salvaged->mesh), "");
}

TEST(Salvage, OfAMeshInOnePartWhosePositionsAreDamagedIsAnError) {
  const auto salvaged = salvage_bytes(flipped(encode_bytes(sample_mesh()).value().bytes, "POSI"));
  ASSERT_FALSE(salvaged);
  EXPECT_EQ(salvaged.error().code, ErrorCode::corrupt);
  EXPECT_THAT(salvaged.error().message, HasSubstr("nothing of it can be salvaged"));
}

TEST(Salvage, LosesOnlyTheChartsThatAreDamaged) {
  const Mesh mesh = sample_mesh();
  const std::vector<std::byte> bytes = random_file(mesh, {}, 24).bytes;
  const auto source = memory_source(Bytes(bytes));
  const FileReader reader = FileReader::open(*source).value();
  uint32_t groups = 0;
  for (const ChunkRecord& record : reader.records())
    groups += std::string(record.header.type.begin(), record.header.type.end()) == "CHRT";
  uint64_t most = 0;
  for (uint32_t group = 0; group < groups; ++group) {
    const auto salvaged = salvage_bytes(flipped(bytes, "CHRT", group));
    ASSERT_TRUE(salvaged) << salvaged.error().message;
    const uint64_t lost = mesh.cell_count() - salvaged->mesh.cell_count();
    ASSERT_LT(lost, 60u);
    EXPECT_EQ(salvaged->damage.has_value(), lost > 0);  // charts of coarser levels are not wanted
    if (lost > 0) {
      EXPECT_THAT(salvaged->damage->message, HasSubstr("lost: 1 of "));
    }
    most = std::max(most, lost);
  }
  EXPECT_GT(most, 0u);
}

TEST(Salvage, FindsChartsWithoutTheIndex) {
  const Mesh mesh = sample_mesh();
  std::vector<std::byte> bytes = random_file(mesh, {}, 24).bytes;
  const auto source = memory_source(Bytes(bytes));
  const uint64_t groups = File::open(*source).value().groups();
  bytes = flipped(flipped(std::move(bytes), "CIDX"), "CDIR");
  auto salvaged = salvage_bytes(bytes);
  ASSERT_TRUE(salvaged) << salvaged.error().message;
  EXPECT_FALSE(salvaged->damage);  // nothing is lost
  EXPECT_EQ(differences_between(mesh, salvaged->mesh), "");
  salvaged = salvage_bytes(flipped(bytes, "CHRT", static_cast<uint32_t>(groups - 1)));
  ASSERT_TRUE(salvaged) << salvaged.error().message;
  ASSERT_TRUE(salvaged->damage);
  EXPECT_THAT(salvaged->damage->message, HasSubstr("lost: charts, and with the index how many"));
  EXPECT_GT(salvaged->mesh.cell_count(), mesh.cell_count() / 2);
}

TEST(Salvage, OfACutFileIsAPartOfTheMesh) {
  const Mesh mesh = sample_mesh();
  for (const std::vector<std::byte>& bytes : {in_parts(mesh, Order::keep), random_file(mesh, {}, 24).bytes}) {
    uint64_t before = 0;
    for (size_t size = 0; size < bytes.size(); size += every(5)) {
      const auto part = bytes.begin() + static_cast<ptrdiff_t>(size);
      const auto salvaged = salvage_bytes({bytes.begin(), part});
      if (!salvaged) {
        ASSERT_EQ(salvaged.error().code, ErrorCode::corrupt) << size;
        ASSERT_EQ(before, 0u) << size;
        continue;
      }
      ASSERT_TRUE(validate(salvaged->mesh)) << size;
      ASSERT_TRUE(salvaged->damage || salvaged->mesh.cell_count() == mesh.cell_count()) << size;
      ASSERT_GE(salvaged->mesh.cell_count(), before) << size;
      before = salvaged->mesh.cell_count();
    }
    EXPECT_EQ(before, mesh.cell_count());
  }
}

}  // namespace
}  // namespace maille::testing
