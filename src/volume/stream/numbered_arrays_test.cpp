#include "volume/stream/numbered_arrays.h"

#include <maille/file.h>

#include <filesystem>

#include "support/files.h"
#include "support/temporary_folder.h"
#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

/// From `first` on, and from a million on in the second half.
template <class T>
Array numbers(const char* name, Domain domain, Scalar type, size_t count, T first) {
  Array array = make_array(name, domain, type, 1);
  array.resize(count);
  const auto values = array.values<T>();
  for (size_t i = 0; i < count; ++i)
    values[i] = static_cast<T>((i < count / 2 ? first : T{1'000'000}) + static_cast<T>(i));
  return array;
}

void add_numbers(Mesh& mesh, bool of_cells) {
  mesh.arrays.insert(mesh.arrays.begin(),
                     numbers<int32_t>("nodes", Domain::point, Scalar::i32, mesh.point_count(), -5));
  if (of_cells)
    mesh.arrays.push_back(numbers<uint64_t>("elements", Domain::cell, Scalar::u64, mesh.cell_count(), 1));
}

EncodeOptions in_any_order(int effort = 5) {
  EncodeOptions options = kept(effort);
  options.order = Order::canonical;
  return options;
}

Result<Mesh> decoded(const std::vector<std::byte>& bytes) {
  return decode(*memory_source(Bytes(bytes)));
}

TEST(NumberedArrays, CostNothingWhereTheOrderIsKept) {
  for (const int effort : {1, 5}) {
    for (Mesh mesh : {grid(12, 12, 12), scattered_grid(12, 3)}) {
      const size_t without = encoded(mesh, kept(effort)).size();
      add_numbers(mesh, true);
      EXPECT_LT(encoded(mesh, kept(effort)).size(), without + 200);
      expect_round_trip(mesh, effort);
    }
  }
}

TEST(NumberedArrays, CostInAnyOrderWhatTheOrderDoes) {
  for (const int effort : {1, 5}) {
    Mesh mesh = scattered_grid(12, 3);
    const size_t without = encoded(mesh, kept(effort)).size();
    add_numbers(mesh, true);
    const std::vector<std::byte> bytes = encoded(mesh, in_any_order(effort));
    EXPECT_LT(bytes.size(), without + 200);
    const auto back = decoded(bytes);
    ASSERT_TRUE(back);
    EXPECT_TRUE(compare(mesh, *back).equal);
    EXPECT_EQ(back->arrays.front().bytes, mesh.arrays.front().bytes);
    const Array* const elements = back->find("elements", Domain::cell);
    ASSERT_NE(elements, nullptr);
    EXPECT_EQ(elements->bytes, mesh.arrays.back().bytes);
  }
}

TEST(NumberedArrays, OfPointsLeaveTheCellsInAnyOrder) {
  for (const int effort : {1, 5}) {
    Mesh mesh = scattered_grid(12, 3);
    const size_t in_order = encoded(mesh, kept(effort)).size();
    add_numbers(mesh, false);
    const std::vector<std::byte> bytes = encoded(mesh, in_any_order(effort));
    EXPECT_LT(bytes.size() + mesh.cell_count(), in_order);
    const auto back = decoded(bytes);
    ASSERT_TRUE(back);
    EXPECT_TRUE(compare(mesh, *back).equal);
    EXPECT_EQ(back->points.bytes, mesh.points.bytes);
  }
}

TEST(NumberedArrays, AreInPiecesOfStreamsInOrder) {
  Mesh mesh = grid(20, 20, 20);
  add_numbers(mesh, true);
  const std::vector<std::byte> bytes = encoded(mesh, kept());
  const auto source = memory_source(Bytes(bytes));
  auto reader = StreamReader::open(source_stream(*source));
  ASSERT_TRUE(reader);
  EXPECT_EQ(reader->description().numbered.size(), 2u);
  StreamPortion piece;
  for (Result<bool> more = reader->next(piece); more && *more; more = reader->next(piece)) {
    for (size_t i = 0; i < piece.points.size(); ++i)
      EXPECT_EQ(0, std::memcmp(&piece.point_arrays[0][4 * i], &mesh.arrays[0].bytes[4 * piece.points[i]], 4));
    EXPECT_EQ(0, std::memcmp(piece.cell_arrays[0].data(), &mesh.arrays[1].bytes[8 * piece.first_cell],
                             8 * piece.cell_count()));
  }
}

TEST(NumberedArrays, AreNotCodedAgainInSteps) {
  const testing::TemporaryFolder folder;
  for (Mesh mesh : {grid(12, 12, 12), scattered_grid(12, 3)}) {
    mesh.arrays.clear();
    add_numbers(mesh, true);
    const std::string path = folder.path("steps.maille");
    const std::vector<std::byte> bytes = encoded(mesh, kept());
    write_bytes(path, bytes);
    Mesh later = mesh;
    later.arrays.back().values<uint64_t>()[7] = 3;
    ASSERT_TRUE(append_step(path, 1, mesh));
    EXPECT_LT(std::filesystem::file_size(path), bytes.size() + 300);
    ASSERT_TRUE(append_step(path, 2, later));
    for (uint64_t step = 0; step <= 2; ++step) {
      DecodeOptions options;
      options.step = step;
      const auto source = file_source(path);
      const auto back = decode(**source, options);
      ASSERT_TRUE(back);
      expect_same(step == 2 ? later : mesh, *back);
    }
  }
}

TEST(NumberedArrays, HaveTheirRangeInTheFile) {
  Mesh mesh = grid(12, 12, 12);
  add_numbers(mesh, true);
  const std::vector<std::byte> bytes = encoded(mesh, kept());
  const auto info = inspect(*memory_source(Bytes(bytes)));
  ASSERT_TRUE(info);
  const std::vector<std::pair<double, double>> expected = {{1, 1'000'000.0 + 1727}};
  EXPECT_EQ(info->arrays.back().ranges, expected);
}

TEST(NumberedArrays, RiseByOneInLongRuns) {
  Array array = numbers<int32_t>("a", Domain::cell, Scalar::i32, 256, 7);
  EXPECT_EQ(find_numbered(array, 3)->runs.size(), 2u);
  EXPECT_EQ(find_numbered(array, 3)->array, 3u);
  for (size_t i = 0; i < 256; i += 32) array.values<int32_t>()[i] = 0;
  EXPECT_FALSE(find_numbered(array, 0));
  array.values<int32_t>()[0] = 0;
  Array bytes = make_array("b", Domain::cell, Scalar::u16, 1);
  bytes.resize(65536 * 2);
  for (size_t i = 0; i < bytes.count(); ++i) bytes.values<uint16_t>()[i] = static_cast<uint16_t>(i);
  EXPECT_EQ(find_numbered(bytes, 0)->runs.size(), 2u);
}

}  // namespace
}  // namespace maille
