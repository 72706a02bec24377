#include <maille/decode.h>
#include <maille/faces.h>
#include <maille/file.h>
#include <maille/out_of_core.h>
#include <maille/volume_file.h>

#include <cmath>
#include <random>

#include "container/file_reader.h"
#include "container/file_writer.h"
#include "support/temporary_folder.h"
#include "volume/pieces/border_points.h"
#include "volume/pieces/cut_cells.h"
#include "volume/pieces/sub_mesh.h"
#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

EncodeOptions in_pieces(uint64_t cells, Order order, int effort = 5) {
  EncodeOptions options = kept(effort);
  options.order = order;
  options.most_cells_per_part = cells;
  return options;
}

/// Does the last first, so that an order in time would show.
class Backwards final : public Executor {
 public:
  void parallel_for(size_t count, const std::function<void(size_t)>& work) override {
    for (size_t i = count; i-- > 0;) work(i);
  }
};

Mesh decoded(const std::vector<std::byte>& bytes) {
  auto mesh = decode(*memory_source(Bytes(bytes)));
  EXPECT_TRUE(mesh) << mesh.error().message;
  return mesh ? *std::move(mesh) : Mesh();
}

void expect_equal_in_any_order(const Mesh& mesh, const Mesh& back) {
  const Comparison comparison = compare(mesh, back, {});
  EXPECT_TRUE(comparison.equal) << (comparison.differences.empty() ? "" : comparison.differences.front());
}

TEST(Pieces, AMeshInPiecesComesBackInItsOrder) {
  Mesh mesh = grid(12, 9, 7);
  add_arrays(mesh, 1);
  expect_same(mesh, decoded(encoded(mesh, in_pieces(100, Order::keep))));
}

TEST(Pieces, AMeshInPiecesComesBackInAnyOrder) {
  Mesh mesh = grid(12, 9, 7);
  add_arrays(mesh, 2);
  expect_equal_in_any_order(mesh, decoded(encoded(mesh, in_pieces(100, Order::canonical))));
}

RC_GTEST_PROP(Pieces, AnyCellsOverAnyPointsComeBack, ()) {
  const auto seed = *rc::gen::arbitrary<unsigned>();
  const auto cells = *rc::gen::inRange(0u, 200u), points = *rc::gen::inRange(1u, 150u);
  Mesh mesh = soup(seed, cells, points);
  add_arrays(mesh, seed);
  const auto target = *rc::gen::inRange<uint64_t>(1, 80);
  const int effort = *rc::gen::element(1, 2, 5, 9);
  expect_same(mesh, decoded(encoded(mesh, in_pieces(target, Order::keep, effort))));
  expect_equal_in_any_order(mesh, decoded(encoded(mesh, in_pieces(target, Order::canonical, effort))));
}

/// Floats that vary over space, on points and cells.
Mesh field_on_grid(unsigned nx, unsigned ny, unsigned nz) {
  Mesh mesh = grid(nx, ny, nz);
  Array point = make_array("T", Domain::point, Scalar::f32, 1),
        cell = make_array("v", Domain::cell, Scalar::f64, 3);
  point.resize(mesh.point_count());
  cell.resize(mesh.cell_count());
  const auto positions = mesh.points.values<float>();
  for (size_t i = 0; i < mesh.point_count(); ++i)
    point.values<float>()[i] = positions[3 * i] * positions[3 * i + 2] - positions[3 * i + 1];
  for (size_t i = 0; i < cell.values<double>().size(); ++i)
    cell.values<double>()[i] = std::sin(0.01 * double(i));
  mesh.arrays = {point, cell};
  return mesh;
}

struct Opened {
  std::vector<std::byte> bytes;
  std::unique_ptr<Source> source;
  std::optional<VolumeFile> file;

  explicit Opened(std::vector<std::byte> file_bytes) : bytes(std::move(file_bytes)) {
    source = memory_source(Bytes(bytes));
    auto opened = VolumeFile::open(*source);
    EXPECT_TRUE(opened) << opened.error().message;
    if (opened) file.emplace(*std::move(opened));
  }
};

/// The cells of a mesh that have numbers as these, all arrays with them: what a query must give.
void expect_cells(const Mesh& mesh, const std::vector<uint32_t>& cells,
                  const Result<ExtractedVolume>& found) {
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->cell_numbers, cells);
  EXPECT_TRUE(found->problems.empty());
  SubMesh expected = take_cells(mesh, cells);
  EXPECT_EQ(found->point_numbers, expected.points);
  for (const Array& array : mesh.arrays) {
    if (array.domain == Domain::mesh) expected.mesh.arrays.push_back(array);
  }
  expected.mesh.metadata = mesh.metadata;
  expect_same(expected.mesh, found->mesh);
}

template <class Wanted>
std::vector<uint32_t> cells_where(const Mesh& mesh, Wanted wanted) {
  std::vector<uint32_t> cells;
  uint32_t number = 0;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i, ++number) {
      if (wanted(number, block.cell(i))) cells.push_back(number);
    }
  }
  return cells;
}

TEST(VolumeFile, ABoxGivesTheCellsThatMeetItAndReadsFewOthers) {
  const Mesh mesh = field_on_grid(20, 18, 16);
  const Opened opened(encoded(mesh, in_pieces(300, Order::keep)));
  VolumeQuery query;
  query.region.box = Box{{{0.35, 0.5, 3.2}}, {{0.6, 1.1, 5.1}}};
  const auto positions = mesh.points.values<float>();
  const auto cells = cells_where(mesh, [&](uint32_t, std::span<const uint32_t> points) {
    bool meets = true;
    for (unsigned k = 0; k < 3; ++k) {
      double low = 1e9, high = -1e9;
      for (const uint32_t point : points) {
        low = std::min(low, static_cast<double>(positions[3 * point + k]));
        high = std::max(high, static_cast<double>(positions[3 * point + k]));
      }
      meets = meets && low <= query.region.box->high[k] && high >= query.region.box->low[k];
    }
    return meets;
  });
  ASSERT_GT(cells.size(), 10u);
  const auto found = opened.file->extract(query);
  expect_cells(mesh, cells, found);
  EXPECT_LT(found->cells_read, mesh.cell_count() / 2);
}

TEST(VolumeFile, ConditionsGiveTheCellsWithSuchValuesAndSkipPiecesThatHaveNone) {
  const Mesh mesh = field_on_grid(20, 18, 16);
  const Opened opened(encoded(mesh, in_pieces(300, Order::keep)));
  VolumeQuery query;
  query.conditions.push_back({"T", 20, 25, {}});
  const auto values = mesh.arrays[0].values<float>();
  const auto hot = cells_where(mesh, [&](uint32_t, std::span<const uint32_t> points) {
    return std::any_of(points.begin(), points.end(),
                       [&](uint32_t point) { return values[point] >= 20 && values[point] <= 25; });
  });
  ASSERT_GT(hot.size(), 10u);
  const auto found = opened.file->extract(query);
  expect_cells(mesh, hot, found);
  EXPECT_LT(found->pieces, opened.file->pieces());

  query.conditions.push_back({"v", 0.99, 1.5, 1u});
  const auto v = mesh.arrays[1].values<double>();
  const auto both = cells_where(mesh, [&](uint32_t cell, std::span<const uint32_t>) {
    return std::binary_search(hot.begin(), hot.end(), cell) && v[3 * cell + 1] >= 0.99;
  });
  expect_cells(mesh, both, opened.file->extract(query));
}

TEST(VolumeFile, AConditionOnTheLengthOfManyComponentsFindsCellsInAllPieces) {
  // More than 16 components share one range in the index, which is that of numbers, not of lengths.
  Mesh mesh = field_on_grid(12, 9, 10);
  Array many = make_array("many", Domain::point, Scalar::f32, 20);
  many.resize(mesh.point_count());
  std::fill_n(many.values<float>().begin(), 20 * mesh.point_count(), 1.0f);
  mesh.arrays.push_back(std::move(many));
  const Opened opened(encoded(mesh, in_pieces(100, Order::keep)));
  VolumeQuery query;
  query.conditions.push_back({"many", 4.4, 4.5, {}});  // the square root of 20
  const auto found = opened.file->extract(query);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->mesh.cell_count(), mesh.cell_count());
  query.conditions[0] = {"many", 4.5, 5, {}};
  EXPECT_EQ(opened.file->select(query)->size(), 0u);
}

TEST(VolumeFile, APlaneGivesTheCellsItPasses) {
  const Mesh mesh = field_on_grid(12, 9, 10);
  const Opened opened(encoded(mesh, in_pieces(100, Order::keep)));
  VolumeQuery query;
  query.plane = Region::Plane{{{0.6, 0, 0.8}}, -4.2};
  const auto positions = mesh.points.values<float>();
  const auto cells = cells_where(mesh, [&](uint32_t, std::span<const uint32_t> points) {
    unsigned below = 0;
    for (const uint32_t point : points) {
      const double side = 0.6 * static_cast<double>(positions[3 * point]) +
                          0.8 * static_cast<double>(positions[3 * point + 2]) - 4.2;
      below += side <= 0;
    }
    return below > 0 && below < points.size();
  });
  ASSERT_GT(cells.size(), 10u);
  expect_cells(mesh, cells, opened.file->extract(query));
}

TEST(VolumeFile, CellsComeByTheirNumbers) {
  const Mesh mesh = field_on_grid(12, 9, 10);
  const Opened opened(encoded(mesh, in_pieces(100, Order::keep)));
  VolumeQuery query;
  query.cells = {200, 333};
  const auto cells = cells_where(mesh, [](uint32_t cell, auto) { return cell >= 200 && cell < 333; });
  expect_cells(mesh, cells, opened.file->extract(query));

  const Opened any(encoded(mesh, in_pieces(100, Order::canonical)));
  const auto refused = any.file->extract(query);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::usage);
}

TEST(VolumeFile, PiecesAskedForOneByOneAreTheMesh) {
  Mesh mesh = grid(10, 8, 6);
  add_arrays(mesh, 2);
  const std::vector<std::byte> bytes = encoded(mesh, in_pieces(50, Order::keep));
  const auto source = memory_source(Bytes(bytes));
  const VolumeFile file = *VolumeFile::open(*source);
  uint64_t cells = 0;
  for (uint32_t piece = 0; piece < file.pieces(); ++piece) {
    VolumeQuery query;
    query.pieces = std::vector<uint32_t>{piece};
    EXPECT_EQ(*file.select(query), *query.pieces);
    const ExtractedVolume found = *file.extract(query);
    EXPECT_EQ(found.mesh.cell_count(), file.info(piece)->cells);
    EXPECT_EQ(found.pieces, 1u);
    cells += found.mesh.cell_count();
  }
  EXPECT_EQ(cells, mesh.cell_count());
  VolumeQuery none;
  none.pieces = std::vector<uint32_t>{file.pieces()};
  EXPECT_EQ(file.select(none).error().code, ErrorCode::usage);
}

TEST(VolumeFile, AStreamThatIsNotInPiecesIsOnePiece) {
  const Mesh mesh = field_on_grid(6, 5, 4);
  const Opened opened(encoded(mesh, kept()));
  EXPECT_EQ(opened.file->pieces(), 1u);
  VolumeQuery query;
  query.cells = {20, 33};
  const auto cells = cells_where(mesh, [](uint32_t cell, auto) { return cell >= 20 && cell < 33; });
  expect_cells(mesh, cells, opened.file->extract(query));
}

TEST(VolumeFile, StatisticsOfAPieceHoldItsDecodedValues) {
  Mesh mesh = field_on_grid(12, 9, 10);
  mesh.arrays[0].values<float>()[7] = std::numeric_limits<float>::quiet_NaN();
  mesh.arrays[0].values<float>()[9] = std::numeric_limits<float>::infinity();
  EncodeOptions options = in_pieces(100, Order::keep);
  options.positions = {Tolerance::Kind::absolute, 0.01};
  options.arrays["T"] = {Tolerance::Kind::absolute, 0.5};
  options.arrays["v"] = {Tolerance::Kind::pointwise, 0.1};
  const Opened opened(encoded(mesh, options));
  const Mesh back = decoded(opened.bytes);
  for (uint32_t p = 0; p < opened.file->pieces(); ++p) {
    const auto info = opened.file->info(p);
    ASSERT_TRUE(info && info->box);
    VolumeQuery query;  // the box of a piece has all cells of it
    query.region.box = info->box;
    const auto found = opened.file->extract(query);
    ASSERT_TRUE(found);
    EXPECT_GE(found->mesh.cell_count(), info->cells);
  }
  const auto selected = [&](ValueCondition condition) {
    VolumeQuery query;
    query.conditions.push_back(std::move(condition));
    const auto found = opened.file->extract(query);
    EXPECT_TRUE(found);
    return found ? found->cell_numbers : std::vector<uint32_t>();
  };
  const auto values = back.arrays[0].values<float>();
  for (const float value : {values[100], values[555], values[9]}) {
    const auto number = static_cast<double>(value);
    const auto cells = cells_where(back, [&](uint32_t, std::span<const uint32_t> points) {
      return std::any_of(points.begin(), points.end(),
                         [&](uint32_t point) { return values[point] == value; });
    });
    EXPECT_EQ(selected({"T", number, number, {}}), cells) << value;
  }
  const auto v = back.arrays[1].values<double>();
  const auto longest = cells_where(back, [&](uint32_t cell, auto) {
    const double square =
        v[3 * cell] * v[3 * cell] + v[3 * cell + 1] * v[3 * cell + 1] + v[3 * cell + 2] * v[3 * cell + 2];
    return std::sqrt(square) >= 1.7;
  });
  EXPECT_EQ(selected({"v", 1.7, 10, {}}), longest);
}

TEST(Pieces, LossyPointsAreJoinedAlsoWhereTheyFallTogether) {
  Mesh mesh = grid(12, 9, 7);
  EncodeOptions options = in_pieces(50, Order::canonical);
  options.positions = {Tolerance::Kind::absolute, 0.3};  // coarser than cells are wide
  const Mesh back = decoded(encoded(mesh, options));
  EXPECT_EQ(back.point_count(), mesh.point_count());
  EXPECT_EQ(back.cell_count(), mesh.cell_count());
  EncodeOptions whole = options;
  whole.most_cells_per_part.reset();
  expect_equal_in_any_order(decoded(encoded(mesh, whole)), back);
}

TEST(Pieces, FilesDoNotDependOnThreads) {
  Mesh mesh = scattered_grid(9, 3);
  for (const Order order : {Order::keep, Order::canonical}) {
    EncodeOptions options = in_pieces(60, order);
    const auto serial = encoded(mesh, options);
    Backwards backwards;
    options.executor = &backwards;
    EXPECT_EQ(serial, encoded(mesh, options));
  }
}

TEST(Pieces, PointsOfPolyhedraAndCurvedCellsAreJoined) {
  const Mesh cubes = grid(6, 5, 4);
  Mesh mesh = cubes;
  CellBlock& block = mesh.blocks[0];
  block = {};
  block.type = CellType::polyhedron;
  block.offsets = {0};
  block.cell_faces = {0};
  const FacesOfSolid& faces = faces_of(CellType::hexahedron);
  for (uint64_t i = 0; i < cubes.blocks[0].size(); ++i) {
    for (unsigned f = 0; f < faces.count; ++f) {
      for (const uint8_t node : faces.face(f)) block.connectivity.push_back(cubes.blocks[0].cell(i)[node]);
      block.face_sizes.push_back(4);
    }
    block.offsets.push_back(block.connectivity.size());
    block.cell_faces.push_back(block.face_sizes.size());
  }
  ASSERT_TRUE(validate(mesh));
  expect_equal_in_any_order(mesh, decoded(encoded(mesh, in_pieces(20, Order::canonical))));
  expect_same(mesh, decoded(encoded(mesh, in_pieces(20, Order::keep))));
}

TEST(Pieces, ADamagedPieceCostsThatPiece) {
  const Mesh mesh = field_on_grid(12, 9, 10);
  const std::vector<std::byte> whole = encoded(mesh, in_pieces(100, Order::keep));
  const auto info = inspect(*memory_source(Bytes(whole)));
  ASSERT_TRUE(info);
  EXPECT_EQ(info->parts, 11u);
  unsigned damaged = 0;
  for (const ChunkInfo& chunk : info->chunks) {
    if (chunk.type != "PIEC") continue;
    std::vector<std::byte> bytes = whole;
    bytes[chunk.offset + 40] ^= std::byte{16};
    const auto source = memory_source(Bytes(bytes));
    EXPECT_FALSE(decode(*source));
    const auto left = salvage(*source);
    ASSERT_TRUE(left) << left.error().message;
    EXPECT_TRUE(left->damage);
    const auto file = VolumeFile::open(*source);
    ASSERT_TRUE(file);
    const auto found = file->extract({});
    ASSERT_TRUE(found);
    EXPECT_EQ(found->problems.size(), 1u);
    EXPECT_EQ(left->mesh.cell_count(), found->mesh.cell_count());
    const auto cells = file->info(static_cast<uint32_t>(chunk.id >> 32))->cells;
    EXPECT_EQ(left->mesh.cell_count(), mesh.cell_count() - cells);
    ++damaged;
  }
  EXPECT_EQ(damaged, 11u);
}

/// The same file with some bytes of one stream changed, or cut off, and good checksums.
std::vector<std::byte> with_damage(const std::vector<std::byte>& file, std::mt19937& random) {
  const auto source = memory_source(Bytes(file));
  const FileReader reader = *FileReader::open(*source);
  const size_t damaged = random() % reader.chunks().size();
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  FileWriter writer = *FileWriter::begin(*sink, reader.header());
  for (size_t i = 0; i < reader.records().size(); ++i) {
    const ChunkHeader& header = reader.records()[i].header;
    StreamKey key = {"", header.patch, header.number};
    std::copy(header.type.begin(), header.type.end(), key.type);
    std::vector<std::byte> stream = *reader.read_stream(key);
    if (i == damaged && !stream.empty()) {
      // The first bytes hold the counts.
      const size_t most = random() % 2 == 0 ? std::min<size_t>(stream.size(), 64) : stream.size();
      for (unsigned k = 0; k < 1 + random() % 4; ++k)
        stream[random() % most] = static_cast<std::byte>(random());
      if (random() % 8 == 0) stream.resize(random() % stream.size());
    }
    EXPECT_TRUE(writer.write_stream(key, stream));
  }
  EXPECT_TRUE(writer.finish());
  return bytes;
}

/// Looks at what comes, and keeps nothing.
class CheckingSink final : public MeshSink {
 public:
  explicit CheckingSink(const MeshDescription& mesh) : mesh_(mesh) {}
  Result<> write_points(uint64_t first, Bytes positions) override {
    EXPECT_LE(first + positions.size() / (3 * size_of(mesh_.point_type)), mesh_.points);
    return {};
  }
  Result<> write_cells(const CellPiece& cells) override {
    for (const uint64_t point : cells.connectivity) EXPECT_LT(point, mesh_.points);
    cells_ += cells.size();
    EXPECT_LE(cells_, mesh_.cells);
    return {};
  }
  Result<> write_array(size_t array, uint64_t first, Bytes tuples) override {
    EXPECT_LE(first + tuples.size() / mesh_.arrays[array].tuple_size(), mesh_.count_of(mesh_.arrays[array]));
    return {};
  }
  Result<> commit() override { return {}; }

 private:
  const MeshDescription& mesh_;
  uint64_t cells_ = 0;
};

TEST(Pieces, DamageWithGoodChecksumsGivesErrorsOrMeshesInParts) {
  std::mt19937 random(8);
  testing::TemporaryFolder folder;
  const std::string path = folder.path("steps.maille");
  for (const Order order : {Order::keep, Order::canonical}) {
    const Mesh mesh = field_on_grid(6, 5, 4);
    ASSERT_TRUE(encode(mesh, **file_sink(path), in_pieces(30, order)));
    uint64_t steps = 0;
    if (order == Order::keep) {
      ASSERT_TRUE(append_step(path, 1, mesh));
      steps = 1;
    }
    const auto file = *file_source(path);
    std::vector<std::byte> whole(file->size());
    ASSERT_TRUE(file->read_at(0, whole));
    for (unsigned round = 0; round < 120; ++round) {
      const std::vector<std::byte> bytes = with_damage(whole, random);
      const auto source = memory_source(Bytes(bytes));
      DecodeOptions options;
      options.limits.mesh_bytes = 16 << 20;
      for (options.step = 0; options.step <= steps; ++options.step) {
        const auto description = describe(*source, options);
        if (!description) continue;
        CheckingSink sink(*description);
        (void)decode(*source, sink, options);
      }
    }
  }
}

TEST(Pieces, DamageWithGoodChecksumsGivesErrorsOrValidMeshes) {
  std::mt19937 random(7);
  for (const Order order : {Order::keep, Order::canonical}) {
    const std::vector<std::byte> whole = encoded(field_on_grid(6, 5, 4), in_pieces(30, order));
    for (unsigned round = 0; round < 120; ++round) {
      const std::vector<std::byte> bytes = with_damage(whole, random);
      const auto source = memory_source(Bytes(bytes));
      DecodeOptions options;
      options.limits.mesh_bytes = 16 << 20;
      const auto mesh = decode(*source, options);
      ASSERT_TRUE(!mesh || validate(*mesh)) << round;
      const auto left = salvage(*source, options);
      ASSERT_TRUE(!left || validate(left->mesh)) << round;
      static_cast<void>(inspect(*source));
      const auto file = VolumeFile::open(*source, options);
      if (!file) continue;
      VolumeQuery query;
      query.region.box = Box{{{0.1, 0.1, 0.1}}, {{0.4, 0.5, 2}}};
      query.conditions.push_back({"T", -1, 1, {}});
      const auto found = file->extract(query);
      ASSERT_TRUE(!found || validate(found->mesh)) << round;
    }
  }
}

TEST(Pieces, AFileThatWasCutGivesThePiecesBeforeTheCut) {
  const Mesh mesh = field_on_grid(12, 9, 10);
  for (const Order order : {Order::keep, Order::canonical}) {
    std::vector<std::byte> bytes = encoded(mesh, in_pieces(100, order));
    bytes.resize(bytes.size() * 2 / 3);
    const auto source = memory_source(Bytes(bytes));
    EXPECT_FALSE(decode(*source));
    const auto left = salvage(*source);
    ASSERT_TRUE(left) << left.error().message;
    EXPECT_TRUE(left->damage);
    ASSERT_TRUE(validate(left->mesh));
    EXPECT_GT(left->mesh.cell_count(), mesh.cell_count() / 3);
    EXPECT_LT(left->mesh.cell_count(), mesh.cell_count());
    EXPECT_EQ(left->mesh.blocks[0].name, "grid");
    // Points of neighbours are joined.
    EXPECT_LT(left->mesh.point_count(), left->mesh.cell_count() * 3 / 2);
  }
}

TEST(Pieces, ChunksOfPiecesAreNotTakenForThoseOfTheFile) {
  std::vector<std::byte> bytes = encoded(field_on_grid(12, 9, 10), in_pieces(100, Order::keep));
  const size_t chunks = inspect(*memory_source(Bytes(bytes)))->chunks.size();
  bytes.resize(bytes.size() - 1);  // no footer: chunks are looked for, also in a piece that is damaged
  const auto source = memory_source(Bytes(bytes));
  EXPECT_EQ(FileReader::open(*source)->chunks().size(), chunks);
  bytes[200] ^= std::byte{1};
  const auto damaged = memory_source(Bytes(bytes));
  EXPECT_LE(FileReader::open(*damaged)->chunks().size(), chunks);
}

TEST(Pieces, MeshesWithoutCellsOrPointsComeBack) {
  Mesh mesh;
  expect_same(mesh, decoded(encoded(mesh, in_pieces(10, Order::keep))));
  set_positions(mesh, {1, 2, 3, 4, 5, 6});
  expect_same(mesh, decoded(encoded(mesh, in_pieces(10, Order::keep))));
  expect_equal_in_any_order(mesh, decoded(encoded(mesh, in_pieces(10, Order::canonical))));
}

TEST(CutCells, ALatticeIsCutBetweenItsLayers) {
  Mesh mesh = grid(16, 16, 16);
  for (uint32_t i = 0; i < mesh.point_count(); ++i) {
    const auto at = mesh.points.values<float>().subspan(size_t{3} * i, 3);
    at[0] = static_cast<float>(i % 17), at[1] = static_cast<float>(i / 17 % 17),
    at[2] = static_cast<float>(i / 289);
  }
  const auto pieces = cut_cells(mesh, 512, serial_executor());
  EXPECT_EQ(pieces.size(), 8u);
  size_t cells = 0;
  for (const auto& piece : pieces) {
    // Boxes of 512 cells of a lattice have 9^3 points.
    EXPECT_LE(take_cells(mesh, piece).points.size(), 820u);
    cells += piece.size();
  }
  EXPECT_EQ(cells, mesh.cell_count());
}

}  // namespace
}  // namespace maille
