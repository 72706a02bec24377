#include <maille/ranks.h>

#include <barrier>
#include <functional>
#include <thread>

#include "support/files.h"
#include "support/temporary_folder.h"
#include "volume/pieces/sub_mesh.h"
#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

/// Threads that are ranks.
class World {
 public:
  explicit World(unsigned size) : size_(size), barrier_(size), buffers_(size), numbers_(size) {}

  class Rank final : public Ranks {
   public:
    Rank(World& world, unsigned rank) : world_(world), rank_(rank) {}
    unsigned rank() const override { return rank_; }
    unsigned size() const override { return world_.size_; }
    std::vector<std::vector<std::byte>> exchange(std::vector<std::vector<std::byte>> to) override {
      world_.buffers_[rank_] = std::move(to);
      world_.barrier_.arrive_and_wait();
      std::vector<std::vector<std::byte>> from;
      for (auto& buffers : world_.buffers_) from.push_back(buffers[rank_]);
      world_.barrier_.arrive_and_wait();
      return from;
    }
    void add(std::span<uint64_t> numbers) override {
      reduce(numbers, [](uint64_t a, uint64_t b) { return a + b; });
    }
    void largest(std::span<uint64_t> numbers) override {
      reduce(numbers, [](uint64_t a, uint64_t b) { return std::max(a, b); });
    }

   private:
    template <class Join>
    void reduce(std::span<uint64_t> numbers, Join join) {
      world_.numbers_[rank_].assign(numbers.begin(), numbers.end());
      world_.barrier_.arrive_and_wait();
      for (unsigned r = 0; r < world_.size_; ++r) {
        ASSERT_EQ(world_.numbers_[r].size(), numbers.size()) << "ranks have lost one another";
        for (size_t i = 0; r != rank_ && i < numbers.size(); ++i)
          numbers[i] = join(numbers[i], world_.numbers_[r][i]);
      }
      world_.barrier_.arrive_and_wait();
    }

    World& world_;
    unsigned rank_;
  };

 private:
  unsigned size_;
  std::barrier<> barrier_;
  std::vector<std::vector<std::vector<std::byte>>> buffers_;
  std::vector<std::vector<uint64_t>> numbers_;
};

/// A file in memory.
class MemoryFile final : public RanksFile {
 public:
  explicit MemoryFile(Ranks& ranks) : ranks_(ranks) {}
  Result<> write(std::span<const Part> parts, uint64_t size) override {
    std::vector<std::byte> packed;
    const auto put = [&](uint64_t number) {
      const auto* from = reinterpret_cast<const std::byte*>(&number);
      packed.insert(packed.end(), from, from + 8);
    };
    for (const Part& part : parts) {
      put(part.offset);
      put(part.bytes.size());
      packed.insert(packed.end(), part.bytes.begin(), part.bytes.end());
    }
    bytes.resize(size);
    for (const auto& all : ranks_.exchange(std::vector(ranks_.size(), packed))) {
      for (size_t at = 0; at < all.size();) {
        uint64_t head[2];
        std::memcpy(head, &all[at], 16);
        std::copy_n(all.begin() + static_cast<ptrdiff_t>(at + 16), head[1],
                    bytes.begin() + static_cast<ptrdiff_t>(head[0]));
        at += 16 + head[1];
      }
    }
    return {};
  }
  Result<> commit() override {
    committed = true;
    return {};
  }

  std::vector<std::byte> bytes;
  bool committed = false;

 private:
  Ranks& ranks_;
};

/// The part of a rank, with memory of its own.
struct Part {
  Mesh mesh;
  std::vector<uint64_t> points, cells;
};

/// Cells by `rank_of`, with gaps between their numbers; points without cells are the last rank's.
std::vector<Part> divided(const Mesh& mesh, unsigned ranks,
                          const std::function<unsigned(uint32_t)>& rank_of) {
  std::vector<std::vector<uint32_t>> cells(ranks);
  for (uint32_t i = 0; i < mesh.cell_count(); ++i) cells[rank_of(i)].push_back(i);
  std::vector<bool> used(mesh.point_count());
  for (const CellBlock& block : mesh.blocks) {
    for (const uint32_t point : block.connectivity) used[point] = true;
  }
  std::vector<Part> parts;
  for (unsigned r = 0; r < ranks; ++r) {
    SubMesh sub = take_cells(mesh, cells[r]);
    Part& part = parts.emplace_back();
    part.mesh = std::move(sub.mesh);
    for (const uint32_t point : sub.points) part.points.push_back(uint64_t{3} * point + 7);
    for (const uint32_t cell : cells[r]) part.cells.push_back(uint64_t{5} * cell + 1);
    for (const Array& array : mesh.arrays) {
      if (array.domain == Domain::mesh) part.mesh.arrays.push_back(array);
    }
    part.mesh.metadata = mesh.metadata;
    for (uint32_t i = 0; r + 1 == ranks && i < mesh.point_count(); ++i) {
      if (used[i]) continue;
      part.points.push_back(uint64_t{3} * i + 7);
      for (Array* array : {&part.mesh.points}) {
        const size_t size = array->tuple_size();
        const auto from = mesh.points.bytes.begin() + static_cast<ptrdiff_t>(i * size);
        array->bytes.insert(array->bytes.end(), from, from + static_cast<ptrdiff_t>(size));
      }
      size_t next = 0;
      for (const Array& array : mesh.arrays) {
        if (array.domain == Domain::mesh) continue;
        Array& to = part.mesh.arrays[next++];
        if (array.domain != Domain::point) continue;
        const size_t size = array.tuple_size();
        const auto from = array.bytes.begin() + static_cast<ptrdiff_t>(i * size);
        to.bytes.insert(to.bytes.end(), from, from + static_cast<ptrdiff_t>(size));
      }
    }
  }
  return parts;
}

/// What all ranks give, and the file of the first one.
struct Written {
  std::vector<Result<EncodeReport>> reports;
  std::vector<std::byte> bytes;
  bool committed = false;
};

Written write(const std::vector<Part>& parts, const EncodeOptions& options, const RanksOptions& how) {
  const auto ranks = static_cast<unsigned>(parts.size());
  World world(ranks);
  Written written;
  written.reports.resize(ranks);
  std::vector<std::thread> threads;
  for (unsigned r = 0; r < ranks; ++r) {
    threads.emplace_back([&, r] {
      World::Rank rank(world, r);
      MemoryFile file(rank);
      const RankPart part{&parts[r].mesh, parts[r].points, parts[r].cells};
      written.reports[r] = encode(part, rank, file, options, how);
      if (r == 0) written.bytes = std::move(file.bytes);
      if (r == 0) written.committed = file.committed;
    });
  }
  for (std::thread& thread : threads) thread.join();
  return written;
}

EncodeOptions streamed(Order order, int effort = 2) {
  EncodeOptions options = kept(effort);
  options.order = order;
  return options;
}

std::vector<std::byte> serial(const Mesh& mesh, EncodeOptions options, uint64_t cells) {
  options.most_cells_per_part = cells;
  return encoded(mesh, options);
}

void expect_serial_bytes(const Mesh& mesh, unsigned ranks, const std::function<unsigned(uint32_t)>& rank_of,
                         const EncodeOptions& options, uint64_t cells) {
  const Written written = write(divided(mesh, ranks, rank_of), options, {.cells_per_piece = cells});
  for (const auto& report : written.reports) ASSERT_TRUE(report) << report.error().message;
  EXPECT_TRUE(written.committed);
  const std::vector<std::byte> alone = serial(mesh, options, cells);
  ASSERT_EQ(written.bytes.size(), alone.size()) << ranks << " ranks";
  EXPECT_TRUE(written.bytes == alone) << ranks << " ranks";
  EXPECT_EQ(written.reports[0]->file_bytes, alone.size());
}

TEST(Ranks, WriteTheBytesOfOneProcessWhateverTheirNumber) {
  Mesh mesh = grid(14, 11, 9);
  add_arrays(mesh, 3);
  for (const Order order : {Order::keep, Order::canonical}) {
    for (const unsigned ranks : {1u, 2u, 3u, 8u}) {
      expect_serial_bytes(
          mesh, ranks, [&](uint32_t cell) { return cell * ranks / 1386; }, streamed(order), 100);
      expect_serial_bytes(
          mesh, ranks, [&](uint32_t cell) { return cell * 2654435761u / 7 % ranks; }, streamed(order), 100);
    }
  }
}

TEST(Ranks, WriteTheBytesOfOneProcessInPiecesByNumber) {
  Mesh mesh = grid(5, 6, 60);  // slabs of it are the best pieces
  add_arrays(mesh, 3);
  for (const Order order : {Order::keep, Order::canonical}) {
    expect_serial_bytes(
        mesh, 3, [](uint32_t cell) { return cell * 2654435761u / 7 % 3; }, streamed(order), 270);
  }
}

RC_GTEST_PROP(Ranks, WriteTheBytesOfOneProcessForAnyCells, ()) {
  const auto seed = *rc::gen::arbitrary<unsigned>();
  const auto cells = *rc::gen::inRange(1u, 200u), points = *rc::gen::inRange(1u, 150u);
  Mesh mesh = soup(seed, cells, points);
  add_arrays(mesh, seed);
  const auto ranks = *rc::gen::inRange(1u, 5u);
  const auto target = *rc::gen::inRange<uint64_t>(1, 80);
  const Order order = *rc::gen::element(Order::keep, Order::canonical);
  std::mt19937 random(seed);
  std::vector<unsigned> rank_of(mesh.cell_count());
  for (unsigned& rank : rank_of) rank = static_cast<unsigned>(random() % ranks);
  expect_serial_bytes(
      mesh, ranks, [&](uint32_t cell) { return rank_of[cell]; }, streamed(order), target);
}

TEST(Ranks, WriteTheBytesOfOneProcessWithinABound) {
  Mesh mesh = grid(14, 11, 9);
  add_arrays(mesh, 3);
  EncodeOptions options = streamed(Order::keep);
  options.positions = {Tolerance::Kind::absolute, 0.3};  // so that places coincide
  expect_serial_bytes(
      mesh, 3, [&](uint32_t cell) { return cell % 3; }, options, 100);
}

TEST(Ranks, DecideBySamplesWhereArraysAreLarge) {
  Mesh mesh = grid(14, 11, 9);
  add_arrays(mesh, 3);
  EncodeOptions options = streamed(Order::keep);
  options.positions = {Tolerance::Kind::absolute, 1e-3};
  RanksOptions how;
  how.cells_per_piece = 200;
  how.sample_bytes = 4096;
  std::vector<std::byte> before;
  for (const unsigned ranks : {1u, 2u, 5u}) {
    const Written written =
        write(divided(mesh, ranks, [&](uint32_t cell) { return cell % ranks; }), options, how);
    for (const auto& report : written.reports) ASSERT_TRUE(report) << report.error().message;
    EXPECT_LE(written.reports[0]->positions.maximum_error, 1e-3);
    EXPECT_TRUE(before.empty() || written.bytes == before);
    before = written.bytes;
  }
}

TEST(Ranks, KeepTheirPartsAsTheyAre) {
  Mesh mesh = grid(14, 11, 9);
  add_arrays(mesh, 3);
  const auto rank_of = [](uint32_t cell) { return cell / 400; };
  const Written written = write(divided(mesh, 5, rank_of), streamed(Order::keep), {.as_is = true});
  ASSERT_TRUE(written.reports[0]) << written.reports[0].error().message;
  const auto back = decode(*memory_source(Bytes(written.bytes)));
  ASSERT_TRUE(back) << back.error().message;
  expect_same(mesh, *back);
}

TEST(Ranks, WithoutAnyCellsWriteAFileOfNone) {
  const Mesh mesh;
  expect_serial_bytes(
      mesh, 3, [](uint32_t) { return 0u; }, streamed(Order::keep), 100);
}

/// A file that goes on.
Written append(const std::vector<std::byte>& before, double time, const std::vector<Part>& parts) {
  const auto ranks = static_cast<unsigned>(parts.size());
  World world(ranks);
  Written written;
  written.reports.resize(ranks);
  written.bytes = before;
  std::vector<std::thread> threads;
  for (unsigned r = 0; r < ranks; ++r) {
    threads.emplace_back([&, r] {
      World::Rank rank(world, r);
      MemoryFile file(rank);
      file.bytes = before;
      const auto source = memory_source(Bytes(before));
      const RankPart part{&parts[r].mesh, parts[r].points, parts[r].cells};
      const auto report = append_step(*source, time, part, rank, file);
      if (!report) written.reports[r] = tl::unexpected(report.error());
      if (r != 0) return;
      written.committed = file.committed;
      if (file.committed) written.bytes = std::move(file.bytes);
    });
  }
  for (std::thread& thread : threads) thread.join();
  return written;
}

/// With numbers that rise, and others at each time.
Mesh at_time(unsigned time) {
  Mesh mesh = grid(14, 11, 9);
  Array ids = make_array("ids", Domain::cell, Scalar::i64, 1);
  ids.resize(mesh.cell_count());
  std::iota(ids.values<int64_t>().begin(), ids.values<int64_t>().end(), 1);
  mesh.arrays.push_back(ids);
  add_arrays(mesh, 3 + time / 3);  // the same ones again, too
  mesh.metadata = {{"time", std::to_string(time)}};
  return mesh;
}

TEST(Ranks, AppendTheStepsThatOneProcessAppends) {
  const TemporaryFolder folder;
  const std::string path = folder.path("steps.maille");
  std::vector<std::byte> alone = serial(at_time(0), streamed(Order::keep), 100);
  write_bytes(path, alone);
  for (unsigned time = 1; time <= 18; ++time) {  // beyond a group of steps
    const Mesh now = at_time(time);
    const auto serially = append_step(path, time, now);
    ASSERT_TRUE(serially) << serially.error().message;
    const std::vector<std::byte> expected = read_bytes(path);
    for (const unsigned ranks : {1u, 3u, 8u}) {
      if (time != 1 && time < 16) continue;  // a step before, and those around the end of a group
      const Written written =
          append(alone, time, divided(now, ranks, [&](uint32_t cell) { return cell * 7 % ranks; }));
      for (const auto& report : written.reports) ASSERT_TRUE(report) << report.error().message;
      EXPECT_TRUE(written.committed);
      ASSERT_EQ(written.bytes.size(), expected.size()) << time << ": " << ranks << " ranks";
      EXPECT_TRUE(written.bytes == expected) << time << ": " << ranks << " ranks";
    }
    alone = expected;
  }
}

TEST(Ranks, AppendNothingToAFileOfAnotherMeshOrInAnyOrder) {
  Mesh mesh = grid(6, 5, 4);
  add_arrays(mesh, 3);
  const auto refused = [&](const std::vector<std::byte>& before, const Mesh& step) {
    const Written written = append(before, 1, divided(step, 3, [](uint32_t cell) { return cell / 50; }));
    EXPECT_FALSE(written.committed);
    for (const auto& report : written.reports) {
      if (report || report.error().message != written.reports[0].error().message)
        return std::string("differs");
    }
    return written.reports[0].error().message;
  };
  EXPECT_NE(refused(serial(grid(6, 5, 5), streamed(Order::keep), 40), mesh).find("the step has"),
            std::string::npos);
  EXPECT_NE(refused(serial(mesh, streamed(Order::canonical), 40), mesh).find("in any order"),
            std::string::npos);
  EXPECT_NE(refused(encoded(mesh, streamed(Order::keep)), mesh).find("not in pieces"), std::string::npos);
}

/// All ranks must get the same sentence, and there must be no file.
void expect_refused(const std::vector<Part>& parts, const std::string& sentence) {
  const Written written = write(parts, streamed(Order::keep), {.cells_per_piece = 100});
  EXPECT_FALSE(written.committed);
  for (const auto& report : written.reports) {
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().message, sentence);
  }
}

std::vector<Part> good_parts() {
  Mesh mesh = grid(6, 5, 4);
  Array array = make_array("T", Domain::cell, Scalar::f32, 1);
  array.resize(mesh.cell_count());
  mesh.arrays.push_back(array);
  return divided(mesh, 3, [](uint32_t cell) { return cell / 40; });
}

TEST(Ranks, AllRefuseArraysThatDiffer) {
  std::vector<Part> parts = good_parts();
  parts[2].mesh.arrays[0].name = "p";
  expect_refused(
      parts,
      "rank 2: its part has cell array \"p\" of 1 f32 where rank 0 has cell array \"T\" of 1 f32; all "
      "parts need the same arrays in the same order");
  parts = good_parts();
  parts[1].mesh.arrays.clear();
  expect_refused(
      parts,
      "rank 1: its part has nothing more where rank 0 has cell array \"T\" of 1 f32; all parts need "
      "the same arrays in the same order");
}

TEST(Ranks, AllRefuseACellThatTwoHave) {
  std::vector<Part> parts = good_parts();
  parts[2].cells[0] = parts[0].cells[3];
  expect_refused(parts, "cell 16 is there 2 times, in ranks 0 and 2; leave ghost cells out");
}

TEST(Ranks, AllRefuseAPointThatIsAtTwoPlaces) {
  std::vector<Part> parts = good_parts();
  const uint64_t point = parts[1].points[0];
  parts[1].mesh.points.values<float>()[0] += 1;
  expect_refused(parts, "point " + std::to_string(point) +
                            " has other numbers in rank 1 than in rank 0; give both the same position and "
                            "values, or different numbers of points");
}

TEST(Ranks, AllRefuseAPartThatBreaksItsRules) {
  std::vector<Part> parts = good_parts();
  parts[1].mesh.blocks[0].connectivity[0] = 100000;
  const Written written = write(parts, streamed(Order::keep), {.cells_per_piece = 100});
  for (const auto& report : written.reports) {
    ASSERT_FALSE(report);
    EXPECT_TRUE(report.error().message.starts_with("rank 1: ")) << report.error().message;
  }
}

}  // namespace
}  // namespace maille
