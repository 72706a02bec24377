#include <maille/out_of_core.h>

#include <atomic>
#include <thread>

#include "mesh/mesh_as_source.h"
#include "mesh/space_curve.h"
#include "support/temporary_folder.h"
#include "volume/stream/mesh_from_parts.h"
#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

/// So little that points go in ranges, pages are thrown out, and cells are sorted in parts of 64.
const WorkingSpace tiny = {.memory = 1, .limit = ~uint64_t{0}, .folder = {}};

std::vector<std::byte> encoded_in_parts(const Mesh& mesh, const EncodeOptions& options) {
  const auto parts_in_memory = mesh_as_source(mesh);
  MeshSource& parts = *parts_in_memory;
  std::vector<std::byte> bytes;
  const auto report = encode(parts, *memory_sink(bytes), options, tiny);
  EXPECT_TRUE(report) << report.error().message;
  return bytes;
}

/// Out of core the file is that of encode(), or the same mesh where encode() has the order apart.
bool same_in_parts(const Mesh& mesh, int effort = 5) {
  const std::vector<std::byte> whole = encoded(mesh, kept(effort)),
                               parts = encoded_in_parts(mesh, kept(effort));
  if (!is_apart(whole)) return parts == whole;
  const auto source = memory_source(Bytes(parts));
  const auto back = decode(*source);
  CompareOptions strict;
  strict.same_order = true;
  return back && compare(mesh, *back, strict).equal;
}

void expect_same_bytes(const Mesh& mesh, int effort = 5) {
  EXPECT_TRUE(same_in_parts(mesh, effort)) << mesh.cell_count();
}

Mesh decoded_into_parts(const std::vector<std::byte>& bytes, const DecodeOptions& options = {}) {
  const auto source = memory_source(Bytes(bytes));
  const auto description = describe(*source, options);
  EXPECT_TRUE(description) << description.error().message;
  MeshFromParts sink(*description);
  const auto done = decode(*source, sink, options);
  EXPECT_TRUE(done) << done.error().message;
  EXPECT_TRUE(sink.committed);
  return std::move(sink.mesh);
}

Mesh several_blocks() {
  Mesh mesh = grid(17, 16, 15);
  CellBlock sides;
  sides.name = "sides";
  sides.type = CellType::polygon;
  sides.offsets = {0, 4, 7, 12};
  sides.connectivity = {0, 1, 5, 4, 1, 2, 5, 8, 9, 10, 11, 12};
  CellBlock empty;
  empty.name = "empty";
  empty.type = CellType::wedge;
  mesh.blocks = {empty, sides, mesh.blocks[0], empty};
  add_arrays(mesh, 3);
  return mesh;
}

/// The same cells and points in random order.
Mesh shuffled(Mesh mesh, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<uint32_t> points(mesh.point_count()), cells(mesh.blocks[0].size());
  std::iota(points.begin(), points.end(), 0u);
  std::iota(cells.begin(), cells.end(), 0u);
  std::shuffle(points.begin(), points.end(), random);
  std::shuffle(cells.begin(), cells.end(), random);
  const Mesh before = mesh;
  for (uint32_t i = 0; i < points.size(); ++i)
    std::copy_n(before.points.bytes.data() + 12 * i, 12, mesh.points.bytes.data() + 12 * points[i]);
  for (uint32_t i = 0; i < cells.size(); ++i) {
    for (unsigned k = 0; k < 8; ++k)
      mesh.blocks[0].connectivity[8 * cells[i] + k] = points[before.blocks[0].connectivity[8 * i + k]];
  }
  return mesh;
}

TEST(OutOfCore, GivesTheSameBytesAsInMemory) {
  expect_same_bytes(Mesh{});
  expect_same_bytes(grid(1, 1, 1));
  expect_same_bytes(grid(40, 30, 20));
  expect_same_bytes(grid(40, 30, 20), 1);
  expect_same_bytes(several_blocks());
  expect_same_bytes(shuffled(grid(12, 11, 10), 1));
}

/// Each task in a thread of its own.
class ThreadEach final : public Executor {
 public:
  void parallel_for(size_t count, const std::function<void(size_t)>& work) override {
    std::vector<std::thread> threads;
    for (size_t i = 0; i < count; ++i) threads.emplace_back(work, i);
    for (std::thread& thread : threads) thread.join();
  }
};

/// Notices when it is asked while it is being asked, and fails when points were read so often.
class WatchedSource final : public MeshSource {
 public:
  explicit WatchedSource(const Mesh& mesh, unsigned good_reads = ~0u)
      : mesh_(mesh_as_source(mesh)), good_reads_(good_reads) {}
  const MeshDescription& description() const override { return mesh_->description(); }
  Result<> read_points(uint64_t first, uint64_t count, std::span<std::byte> out) override {
    if (good_reads_-- == 0) return failure(ErrorCode::cannot_read, "pulled out");
    return alone([&] { return mesh_->read_points(first, count, out); });
  }
  Result<> read_cells(uint64_t first, uint64_t count, CellPiece& out) override {
    return alone([&] { return mesh_->read_cells(first, count, out); });
  }
  Result<> read_array(size_t array, uint64_t first, uint64_t count, std::span<std::byte> out) override {
    return alone([&] { return mesh_->read_array(array, first, count, out); });
  }
  bool was_alone() const { return was_alone_; }

 private:
  template <class Read>
  Result<> alone(Read read) {
    if (under_way_.exchange(true)) was_alone_ = false;
    std::this_thread::yield();
    const Result<> done = read();
    under_way_ = false;
    return done;
  }
  std::unique_ptr<MeshSource> mesh_;
  unsigned good_reads_;
  std::atomic<bool> under_way_ = false, was_alone_ = true;
};

TEST(OutOfCore, AsksTheSourceOneAtATimeAndGivesTheSameBytesForAnyExecutor) {
  for (const bool fields : {false, true}) {
    Mesh mesh = grid(41, 40, 13);
    if (fields) add_arrays(mesh, 7);
    ThreadEach threads;
    EncodeOptions options = kept();
    options.executor = &threads;
    WatchedSource source(mesh);
    std::vector<std::byte> bytes;
    const auto report = encode(source, *memory_sink(bytes), options);
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_TRUE(source.was_alone());
    EXPECT_TRUE(bytes == encoded(mesh, kept()));
  }
}

TEST(OutOfCore, TellsWhatIsWrongWithASourceThatIsReadByAnotherThread) {
  const Mesh mesh = grid(41, 40, 13);
  ThreadEach threads;
  EncodeOptions options = kept();
  options.executor = &threads;
  for (const unsigned good : {0u, 1u, 40u}) {
    WatchedSource source(mesh, good);
    std::vector<std::byte> bytes;
    const auto report = encode(source, *memory_sink(bytes), options);
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().message, "pulled out");
  }
}

TEST(OutOfCore, KeepsPointsThatNoCellUses) {
  Mesh mesh = grid(3, 3, 3);
  std::vector<float> positions(3 * 200'000, 0.25f);
  for (size_t i = 0; i < positions.size(); ++i) positions[i] = static_cast<float>(i % 977);
  set_positions(mesh, positions);
  expect_same_bytes(mesh);
  const Mesh back = decoded_into_parts(encoded_in_parts(mesh, kept()));
  EXPECT_EQ(back.points.bytes, mesh.points.bytes);
}

RC_GTEST_PROP(OutOfCore, GivesTheSameBytesForAnySoup, ()) {
  Mesh mesh =
      soup(*rc::gen::arbitrary<unsigned>(), *rc::gen::inRange(1u, 300u), *rc::gen::inRange(1u, 2000u));
  add_arrays(mesh, 2);
  mesh.blocks[0].name = "soup";  // else it could have the type of its cells
  const bool same = same_in_parts(mesh);
  RC_ASSERT(same);
}

TEST(OutOfCore, WritesInPartsWhatDecodeGivesWhole) {
  for (const Mesh& mesh : {grid(20, 21, 22), several_blocks(), shuffled(grid(9, 8, 7), 2)}) {
    const std::vector<std::byte> bytes = encoded_in_parts(mesh, kept());
    expect_same(mesh, decoded_into_parts(bytes));
  }
}

TEST(OutOfCore, LeavesFilesWhoseOrderStandsApartToDecode) {
  const std::vector<std::byte> bytes = encoded(scattered_grid(12, 3), kept());
  const auto source = memory_source(Bytes(bytes));
  const auto description = describe(*source);
  ASSERT_FALSE(description);
  EXPECT_EQ(description.error().code, ErrorCode::unsupported);
}

TEST(OutOfCore, WritesOnlyTheArraysWanted) {
  const Mesh mesh = several_blocks();
  const std::string wanted = mesh.arrays[1].name;
  DecodeOptions options;
  options.arrays = std::vector<std::string>{wanted};
  const Mesh back = decoded_into_parts(encoded(mesh, kept()), options);
  for (const Array& array : back.arrays) {
    if (array.domain != Domain::mesh) {
      EXPECT_EQ(array.name, wanted);
    }
  }
  ASSERT_NE(back.find(wanted, mesh.arrays[1].domain), nullptr);
  EXPECT_EQ(back.find(wanted, mesh.arrays[1].domain)->bytes, mesh.arrays[1].bytes);
}

TEST(OutOfCore, KeepsErrorBounds) {
  const Mesh mesh = grid(60, 50, 40);  // more points than are looked at for their kind
  EncodeOptions options = kept();
  options.positions = {Tolerance::Kind::absolute, 0.01};
  const Mesh back = decoded_into_parts(encoded_in_parts(mesh, options));
  for (size_t i = 0; i < mesh.points.values<float>().size(); ++i)
    ASSERT_LE(std::abs(mesh.points.values<float>()[i] - back.points.values<float>()[i]), 0.01f) << i;
}

TEST(OutOfCore, GivesTheSameBytesForBoundsRelativeToEachValue) {
  for (const unsigned layers : {8u, 40u}) {  // of the second a sample is looked at
    Mesh mesh = grid(60, 50, layers);
    Array field = make_array("speed", Domain::point, Scalar::f32, 1);
    field.resize(mesh.point_count());
    const std::span<float> values = field.values<float>();
    for (size_t i = 0; i < values.size(); ++i) values[i] = 2 + std::sin(static_cast<float>(i) / 50);
    values[values.size() / 2 + 1] = -1e-3f;  // the smallest, between the stretches of the sample
    mesh.arrays = {field};
    EncodeOptions options = kept();
    options.arrays["speed"] = {Tolerance::Kind::pointwise, 1e-2};
    EXPECT_EQ(encoded_in_parts(mesh, options), encoded(mesh, options)) << layers;
  }
}

TEST(OutOfCore, RefusesTruncatedFiles) {
  const std::vector<std::byte> bytes = encoded(grid(5, 5, 5), kept());
  for (size_t size = 0; size < bytes.size(); size += 7)
    EXPECT_FALSE(describe(*memory_source(Bytes(bytes).first(size)))) << size;
}

TEST(OutOfCore, ReorderedIsTheSameMesh) {
  Mesh mesh = shuffled(grid(14, 13, 12), 5);
  add_arrays(mesh, 3);
  const auto parts_in_memory = mesh_as_source(mesh);
  MeshSource& parts = *parts_in_memory;
  const auto ordered = reordered(parts, tiny);
  ASSERT_TRUE(ordered) << ordered.error().message;
  EncodeOptions options = kept();
  options.order = Order::canonical;
  std::vector<std::byte> bytes;
  ASSERT_TRUE(encode(**ordered, *memory_sink(bytes), options, tiny));
  const auto back = decode(*memory_source(Bytes(bytes)));
  ASSERT_TRUE(back) << back.error().message;
  const Comparison comparison = compare(mesh, *back);
  EXPECT_TRUE(comparison.equal) << comparison.differences.front();
}

TEST(OutOfCore, ReorderedKeepsBlocksApart) {
  const Mesh mesh = several_blocks();
  const auto parts_in_memory = mesh_as_source(mesh);
  MeshSource& parts = *parts_in_memory;
  const auto ordered = reordered(parts, tiny);
  ASSERT_TRUE(ordered) << ordered.error().message;
  CellPiece piece;
  ASSERT_TRUE((*ordered)->read_cells(0, 4, piece));
  EXPECT_EQ(piece.types, (std::vector<uint8_t>{7, 7, 7, 12}));
  EXPECT_FALSE((*ordered)->read_cells(mesh.cell_count() - 1, 2, piece));
}

TEST(OutOfCore, ReorderingMakesShuffledCellsCheap) {
  const Mesh mesh = shuffled(grid(24, 24, 24), 7);
  const auto parts_in_memory = mesh_as_source(mesh);
  MeshSource& parts = *parts_in_memory;
  const auto ordered = reordered(parts, {.memory = 1 << 20, .limit = ~uint64_t{0}, .folder = {}});
  ASSERT_TRUE(ordered);
  const auto before = incoherence(parts), after = incoherence(**ordered);
  ASSERT_TRUE(before && after);
  EXPECT_GT(*before, 20);
  EXPECT_LT(*after, 8);
}

TEST(OutOfCore, SweepsAreCoherent) {
  const Mesh mesh = grid(30, 30, 30);
  const auto parts_in_memory = mesh_as_source(mesh);
  MeshSource& parts = *parts_in_memory;
  const auto bits = incoherence(parts);
  ASSERT_TRUE(bits);
  EXPECT_LT(*bits, 0.5);
}

TEST(OutOfCore, RefusesWhatTakesMoreMemoryThanAllowed) {
  const Mesh sweep = grid(20, 20, 200), soup = shuffled(sweep, 3);
  for (const Mesh* mesh : {&sweep, &soup}) {
    const auto parts_in_memory = mesh_as_source(*mesh);
    MeshSource& parts = *parts_in_memory;
    std::vector<std::byte> bytes;
    const WorkingSpace space = {.memory = 1, .limit = uint64_t{30} << 20, .folder = {}};
    const auto report = encode(parts, *memory_sink(bytes), kept(), space);
    EXPECT_EQ(report.has_value(), mesh == &sweep);
    if (!report) {
      EXPECT_EQ(report.error().code, ErrorCode::memory_bound);
      EXPECT_TRUE(bytes.empty());
    }
  }
}

TEST(OutOfCore, StopsWhenTold) {
  const Mesh mesh = grid(20, 20, 20);
  const auto parts_in_memory = mesh_as_source(mesh);
  MeshSource& parts = *parts_in_memory;
  EncodeOptions options = kept();
  options.progress = [](const ProgressReport&) { return false; };
  std::vector<std::byte> bytes;
  const auto report = encode(parts, *memory_sink(bytes), options, tiny);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::cancelled);
}

TEST(OutOfCore, LeavesNoFilesBehind) {
  const testing::TemporaryFolder folder;
  const Mesh mesh = shuffled(grid(6, 6, 6), 1);
  const auto parts_in_memory = mesh_as_source(mesh);
  MeshSource& parts = *parts_in_memory;
  const auto ordered = reordered(parts, {.memory = 1, .limit = ~uint64_t{0}, .folder = folder.path()});
  ASSERT_TRUE(ordered);
  EXPECT_TRUE(folder.names().empty()) << "not even while they are in use";
  EXPECT_EQ(
      reordered(parts, {.memory = 1, .limit = ~uint64_t{0}, .folder = folder.path("none")}).error().code,
      ErrorCode::write_failed);
}

TEST(SpaceCurve, GoesFromNeighbourToNeighbour) {
  std::vector<std::pair<uint64_t, std::array<int, 3>>> places;
  for (int x = 0; x < 8; ++x) {
    for (int y = 0; y < 8; ++y) {
      for (int z = 0; z < 8; ++z) {
        const std::array<uint32_t, 3> at = {static_cast<uint32_t>(x), static_cast<uint32_t>(y),
                                            static_cast<uint32_t>(z)};
        places.push_back({place_on_curve(at), {x, y, z}});
      }
    }
  }
  std::sort(places.begin(), places.end());
  for (size_t i = 1; i < places.size(); ++i) {
    EXPECT_EQ(places[i].first, places[i - 1].first + 1);
    int steps = 0;
    for (size_t c = 0; c < 3; ++c) steps += std::abs(places[i].second[c] - places[i - 1].second[c]);
    EXPECT_EQ(steps, 1) << i;
  }
}

}  // namespace
}  // namespace maille
