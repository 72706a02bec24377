// Values of later times behind a mesh, and what is left of files that were cut.
#include <maille/file.h>

#include <cmath>
#include <filesystem>
#include <limits>

#include "support/cases.h"
#include "support/files.h"
#include "support/temporary_folder.h"
#include "volume/stream/stream_layout.h"
#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

/// Pressure on points, temperature on cells, material the same at all times.
Mesh at_time(unsigned time) {
  Mesh mesh = grid(20, 20, 20);
  Array pressure = make_array("pressure", Domain::point, Scalar::f32, 1);
  pressure.resize(mesh.point_count());
  for (size_t i = 0; i < mesh.point_count(); ++i)
    pressure.values<float>()[i] = static_cast<float>(i % 21) * 0.5f + static_cast<float>(time);
  Array temperature = make_array("temperature", Domain::cell, Scalar::f64, 2);
  temperature.resize(mesh.cell_count());
  for (size_t i = 0; i < 2 * mesh.cell_count(); ++i)
    temperature.values<double>()[i] = 300 + static_cast<double>(i % 37) / (time + 3);
  Array material = make_array("material", Domain::cell, Scalar::i32, 1);
  material.resize(mesh.cell_count());
  for (size_t i = 0; i < mesh.cell_count(); ++i)
    material.values<int32_t>()[i] = static_cast<int32_t>(i * 7 % 11);
  mesh.arrays = {pressure, temperature, material};
  return mesh;
}

class TimeSteps : public ::testing::Test {
 protected:
  void SetUp() override { write(encoded(at_time(0), kept())); }

  void write(const std::vector<std::byte>& bytes) const { EXPECT_TRUE(write_bytes(path_, bytes)); }
  std::vector<std::byte> bytes() const {
    const auto source = file_source(path_);
    std::vector<std::byte> all((*source)->size());
    EXPECT_TRUE((*source)->read_at(0, all));
    return all;
  }
  Result<Mesh> read(uint64_t step) const {
    const auto source = file_source(path_);
    DecodeOptions options;
    options.step = step;
    return decode(**source, options);
  }
  void append(unsigned time) const {
    const auto report = append_step(path_, 0.5 * time, at_time(time));
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->number, time);
    EXPECT_EQ(report->file_bytes, std::filesystem::file_size(path_));
  }

  testing::TemporaryFolder folder_;
  const std::string path_ = folder_.path("steps.maille");
};

TEST_F(TimeSteps, EachComesBackByItself) {
  for (unsigned time = 1; time < 4; ++time) append(time);
  for (const unsigned time : {3u, 0u, 2u, 1u}) {
    const auto mesh = read(time);
    ASSERT_TRUE(mesh) << mesh.error().message;
    expect_same(at_time(time), *mesh);
  }
  const auto source = file_source(path_);
  const auto info = inspect(**source);
  ASSERT_TRUE(info);
  EXPECT_TRUE(info->problems.empty());
  ASSERT_EQ(info->steps.size(), 3u);
  EXPECT_EQ(info->steps[2].time, 1.5);
  EXPECT_EQ(info->steps[1].arrays, (std::vector<std::string>{"pressure", "temperature", "material"}));
  EXPECT_TRUE(verify_checksums(**source)->empty());
}

TEST_F(TimeSteps, AreInTheMeshesOrderWhereTheStreamHasAnother) {
  Mesh mesh = scattered_grid(12, 3);
  ASSERT_TRUE(is_apart(encoded(mesh, kept())));
  write(encoded(mesh, kept()));
  std::erase_if(mesh.arrays, [](const Array& array) { return array.domain == Domain::mesh; });
  for (Array& array : mesh.arrays) std::reverse(array.bytes.begin(), array.bytes.end());
  const auto report = append_step(path_, 1, mesh);
  ASSERT_TRUE(report) << report.error().message;
  const auto back = read(1);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->blocks[0].connectivity, mesh.blocks[0].connectivity);
  for (const Array& array : mesh.arrays) {
    const Array* found = back->find(array.name, array.domain);
    ASSERT_NE(found, nullptr) << array.name;
    EXPECT_EQ(found->bytes, array.bytes) << array.name;
  }
}

TEST_F(TimeSteps, ArraysThatDoNotChangeTakeNoRoom) {
  const auto report = append_step(path_, 1, at_time(1));
  ASSERT_TRUE(report);
  EXPECT_GT(report->array_bytes[0], 0u);
  EXPECT_GT(report->array_bytes[1], 0u);
  EXPECT_EQ(report->array_bytes[2], 0u);
}

TEST_F(TimeSteps, MayHaveOtherArraysThanTheMesh) {
  Mesh mesh = at_time(1);
  mesh.arrays.erase(mesh.arrays.begin());
  mesh.arrays[0].name = "heat";
  ASSERT_TRUE(append_step(path_, 1, mesh));
  expect_same(mesh, *read(1));
  mesh.arrays.clear();
  ASSERT_TRUE(append_step(path_, 2, mesh));
  expect_same(mesh, *read(2));
}

TEST_F(TimeSteps, KeepTheirBounds) {
  EncodeOptions options;
  options.arrays["pressure"] = {Tolerance::Kind::absolute, 0.01};
  Mesh mesh = at_time(1);
  ASSERT_TRUE(append_step(path_, 1, mesh, options));
  const auto back = read(1);
  ASSERT_TRUE(back);
  const Mesh& found = *back;
  const std::span<const float> a = mesh.arrays[0].values<float>(), b = found.arrays[0].values<float>();
  for (size_t i = 0; i < a.size(); ++i) ASSERT_LE(std::abs(double{a[i]} - double{b[i]}), 0.01);
  EXPECT_EQ(mesh.arrays[1].bytes, back->arrays[1].bytes);
}

/// A wave that goes on a little with each step, and an array that stays as it is.
Mesh wave_at(unsigned time) {
  Mesh mesh = grid(9, 9, 9);
  Array wave = make_array("wave", Domain::point, Scalar::f64, 1), still = wave;
  wave.resize(mesh.point_count());
  still.name = "still";
  still.resize(mesh.point_count());
  for (size_t i = 0; i < mesh.point_count(); ++i) {
    const auto x = static_cast<double>(i);
    still.values<double>()[i] = std::sin(x * 0.7);
    wave.values<double>()[i] = std::sin(x * x) + 1e-3 * time * std::cos(x * 0.01);
  }
  mesh.arrays = {wave, still};
  return mesh;
}
EncodeOptions of_waves() {
  EncodeOptions options = kept();
  options.arrays["wave"] = {Tolerance::Kind::absolute, 1e-4};
  options.arrays["still"] = {Tolerance::Kind::relative, 1e-3};
  return options;
}
void expect_wave(const Result<Mesh>& found, unsigned time) {
  ASSERT_TRUE(found) << found.error().message;
  const Mesh mesh = wave_at(time);
  for (size_t a = 0; a < 2; ++a) {
    const auto before = mesh.arrays[a].values<double>();
    for (size_t i = 0; i < before.size(); ++i)
      ASSERT_LE(std::fabs(before[i] - found->arrays[a].values<double>()[i]), a == 0 ? 1e-4 : 2e-3) << time;
  }
}

TEST_F(TimeSteps, ArraysWithinTheirBoundTakeNoRoom) {
  write(encoded(wave_at(0), of_waves()));
  for (unsigned time = 0; time < 3; ++time) {
    const auto report = append_step(path_, time, wave_at(time), of_waves());
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->array_bytes[0] == 0, time == 0) << "the first step is the mesh";
    EXPECT_EQ(report->array_bytes[1], 0u);
    EXPECT_GT(report->errors[1], 0);
    expect_wave(read(time + 1), time);
  }
}

TEST_F(TimeSteps, DifferencesAreSmallerAndKeepTheBoundInAChain) {
  write(encoded(wave_at(0), of_waves()));
  uint64_t alone = 0;
  for (unsigned time = 1; time <= 20; ++time) {
    const auto report = append_step(path_, time, wave_at(time), of_waves());
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_LE(report->errors[0], 1e-4);
    if (time == 16) alone = report->array_bytes[0];
    if (time == 17) {
      EXPECT_LT(report->array_bytes[0] * 2, alone) << "of noise that stays";
    }
  }
  for (const unsigned time : {20u, 15u, 1u, 16u}) expect_wave(read(time), time);
}

/// Noise that grows and shrinks from step to step: of no use as it stands, nor are differences to it.
Mesh pulsing_at(unsigned time) {
  Mesh mesh = grid(15, 15, 15);
  const double size = 1 + 0.5 * std::sin(2.0 * time);
  Array exact = make_array("exact", Domain::point, Scalar::f64, 1);
  Array bounded = make_array("bounded", Domain::cell, Scalar::f32, 2);
  Array whole = make_array("whole", Domain::point, Scalar::i32, 1);
  for (Array* array : {&exact, &whole}) array->resize(mesh.point_count());
  bounded.resize(mesh.cell_count());
  for (size_t i = 0; i < mesh.point_count(); ++i) {
    const double noise = std::sin(static_cast<double>(i * i));
    exact.values<double>()[i] = i == 100 + time ? std::nan("1") : noise * size;
    whole.values<int32_t>()[i] = static_cast<int32_t>(noise * size * 1e5);
  }
  for (size_t i = 0; i < 2 * mesh.cell_count(); ++i)
    bounded.values<float>()[i] = static_cast<float>(size * std::cos(static_cast<double>(i * i)));
  bounded.values<float>()[time] = std::numeric_limits<float>::infinity();
  mesh.arrays = {exact, bounded, whole};
  return mesh;
}
EncodeOptions of_pulses() {
  EncodeOptions options = kept();
  options.arrays["bounded"] = {Tolerance::Kind::absolute, 1e-4};
  return options;
}
void expect_pulse(const Result<Mesh>& found, unsigned time) {
  ASSERT_TRUE(found) << found.error().message;
  const Mesh mesh = pulsing_at(time);
  for (const size_t a : {0u, 2u}) EXPECT_EQ(found->arrays[a].bytes, mesh.arrays[a].bytes) << time;
  const auto before = mesh.arrays[1].values<float>(), after = found->arrays[1].values<float>();
  for (size_t i = 0; i < before.size(); ++i) {
    ASSERT_TRUE(before[i] == after[i] || std::fabs(double{before[i]} - double{after[i]}) <= 1e-4)
        << time << " " << i;
  }
}

TEST_F(TimeSteps, FollowTheStepBeforeWhereDifferencesAreNoSmaller) {
  write(encoded(pulsing_at(0), of_pulses()));
  std::vector<uint64_t> following;
  for (unsigned time = 1; time <= 17; ++time) {
    const auto report = append_step(path_, time, pulsing_at(time), of_pulses());
    ASSERT_TRUE(report) << report.error().message;
    if (time == 15) following = report->array_bytes;
    if (time != 16) continue;
    for (size_t i = 0; i < 3; ++i)
      EXPECT_LT(following[i] * 20, report->array_bytes[i] * 19) << i << ": the sixteenth is alone";
  }
  for (const unsigned time : {17u, 15u, 1u, 16u}) expect_pulse(read(time), time);
}

TEST_F(TimeSteps, AStepWithoutTheOneBeforeIsRefusedButKeyStepsAreNot) {
  write(encoded(wave_at(0), of_waves()));
  uint64_t before = 0;
  for (unsigned time = 1; time <= 17; ++time) {
    if (time == 14) before = bytes().size();
    ASSERT_TRUE(append_step(path_, time, wave_at(time), of_waves()));
  }
  std::vector<std::byte> damaged = bytes();
  damaged[before + 40] ^= std::byte{4};
  write(damaged);
  EXPECT_FALSE(read(14));
  EXPECT_FALSE(read(15));
  for (const unsigned time : {13u, 16u, 17u}) expect_wave(read(time), time);
}

TEST_F(TimeSteps, AreRefusedWhereTheyDoNotFit) {
  Mesh other = grid(3, 3, 3);
  const auto report = append_step(path_, 1, other);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::usage);
  EXPECT_EQ(read(1).error().code, ErrorCode::usage);
  for (const double no_time : {std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_EQ(append_step(path_, no_time, at_time(1)).error().code, ErrorCode::usage);
  EncodeOptions any = kept();
  any.order = Order::canonical;
  write(encoded(at_time(0), any));
  EXPECT_EQ(append_step(path_, 1, at_time(1)).error().code, ErrorCode::usage);
}

// Whatever was written of a step when the machine stopped: the file reads as before, and the next step takes
// the place of the one that was cut.
TEST_F(TimeSteps, AppendingThatStopsAnywhereLeavesTheFileAsItWas) {
  append(1);
  const std::vector<std::byte> before = bytes();
  append(2);
  const std::vector<std::byte> after = bytes();
  const Mesh first = at_time(1);
  for (size_t size = before.size() + 1; size < after.size();
       size += every(size - before.size() < 64 ? 1 : 2003)) {
    write({after.begin(), after.begin() + static_cast<ptrdiff_t>(size)});
    const auto old_step = read(1);
    ASSERT_TRUE(old_step) << size << ": " << old_step.error().message;
    ASSERT_EQ(old_step->arrays[0].bytes, first.arrays[0].bytes);
    ASSERT_FALSE(read(2));
    ASSERT_TRUE(read(0));
  }
  append(2);
  EXPECT_EQ(bytes(), after);
}

TEST_F(TimeSteps, RemovingTheLastGivesTheFileBeforeIt) {
  std::vector<std::vector<std::byte>> files = {bytes()};
  for (const unsigned time : {1u, 2u, 3u}) {
    append(time);
    files.push_back(bytes());
  }
  for (uint64_t number = 3; number > 0; --number) {
    const auto left = remove_last_step(path_);
    ASSERT_TRUE(left) << left.error().message;
    EXPECT_EQ(left->number, number);
    EXPECT_EQ(left->file_bytes, files[number - 1].size());
    EXPECT_EQ(bytes(), files[number - 1]);
  }
  EXPECT_EQ(remove_last_step(path_).error().code, ErrorCode::usage);
  EXPECT_EQ(bytes(), files[0]);
}

TEST_F(TimeSteps, RemovingTheLastAlsoCutsOffWhatWasNotFinished) {
  append(1);
  const std::vector<std::byte> one = bytes();
  append(2);
  std::vector<std::byte> cut = bytes();
  cut.resize(cut.size() - 7);
  write(cut);
  EXPECT_EQ(remove_last_step(path_).value().number, 1u);
  EXPECT_LT(bytes().size(), one.size());
  EXPECT_TRUE(read(0));
}

TEST_F(TimeSteps, WhileSomebodyAppendsNoneIsRemoved) {
  append(1);
  const std::vector<std::byte> before = bytes();
  const auto sink = append_sink(path_, before.size());
  ASSERT_TRUE(sink);
  EXPECT_EQ(remove_last_step(path_).error().code, ErrorCode::write_failed);
  EXPECT_EQ(bytes(), before);
}

TEST_F(TimeSteps, DamageOfOneStepLeavesTheMeshReadable) {
  append(1);
  std::vector<std::byte> damaged = bytes();
  const size_t base = encoded(at_time(0), kept()).size();
  damaged[base + (damaged.size() - base) / 3] ^= std::byte{4};
  write(damaged);
  EXPECT_TRUE(read(0));
  EXPECT_FALSE(read(1));
  const std::string_view all(reinterpret_cast<const char*>(damaged.data()), damaged.size());
  const size_t description = all.find("STEP", base);
  ASSERT_NE(description, std::string_view::npos);
  damaged[description + 20] ^= std::byte{4};
  write(damaged);
  EXPECT_TRUE(read(0));
  EXPECT_FALSE(read(1));
  const auto source = file_source(path_);
  const auto info = inspect(**source);
  ASSERT_TRUE(info);
  EXPECT_FALSE(info->problems.empty());
  ASSERT_TRUE(append_step(path_, 2, at_time(2)));  // the others do not need it
  EXPECT_TRUE(read(2));
}

/// Texts of a solver at one time: some stay, some change, some are there at some times only.
Mesh with_texts(Mesh mesh, unsigned step) {
  mesh.metadata = {{"made by", "a solver"}, {"time", std::to_string(step)}};
  if (step % 3 != 0) mesh.metadata.insert(mesh.metadata.begin() + 1, {"boundary", "fixedValue"});
  if (step % 5 == 0) mesh.metadata.emplace_back("note " + std::to_string(step), "restarted");
  return mesh;
}

TEST_F(TimeSteps, EachHasMetadataOfItsOwn) {
  constexpr unsigned steps = 20;  // beyond one that does without those before
  const auto at_time = [](unsigned) { return grid(2, 2, 2); };
  write(encoded(at_time(0), kept()));
  for (unsigned step = 1; step <= steps; ++step)
    ASSERT_TRUE(append_step(path_, step, with_texts(at_time(step), step)));
  ASSERT_TRUE(append_step(path_, steps + 1, at_time(0)));  // says nothing
  ASSERT_TRUE(append_step(path_, steps + 2, with_texts(at_time(3), 3)));
  for (const unsigned step : {20u, 1u, 17u, 16u, 15u, 3u, 22u})
    EXPECT_EQ(read(step)->metadata, with_texts(at_time(0), step == steps + 2 ? 3 : step).metadata) << step;
  EXPECT_EQ(read(steps + 1)->metadata, read(0)->metadata);
}

TEST(StepMetadata, NoEntryIsTakenTwice) {
  const Metadata before = {{"a", std::string(1 << 20, 'x')}, {"b", "2"}};
  std::vector<StepEntry> entries = entries_of({{"a", before[0].second}, {"b", "3"}, {"c", "4"}}, before);
  ASSERT_EQ(entries.size(), 3u);
  EXPECT_EQ(entries[0].method, StepEntry::same);
  EXPECT_EQ(entries[1].method, StepEntry::same_key);
  EXPECT_EQ(entries[2].method, StepEntry::whole);
  ASSERT_TRUE(metadata_of(entries, before));
  entries[1].of = 0;
  EXPECT_FALSE(metadata_of(entries, before));
  entries[1].of = 2;
  EXPECT_FALSE(metadata_of(entries, before));
  const std::vector<StepEntry> swapped = entries_of({before[1], before[0]}, before);
  EXPECT_EQ(swapped[1].method, StepEntry::whole);
  EXPECT_EQ(*metadata_of(swapped, before), (Metadata{before[1], before[0]}));
}

TEST_F(TimeSteps, StreamsGiveThemPieceByPiece) {
  struct Values final : StepSource {
    Result<> read(size_t, uint64_t number, std::byte* out) override {
      const float value = static_cast<float>(number) * 2;
      std::memcpy(out, &value, sizeof value);
      return {};
    }
  } values;
  StepOptions options;
  options.time = 7;
  options.arrays.push_back({"twice", Domain::point, Scalar::f32, 1, Role::none, {}, {}, {}});
  ASSERT_TRUE(append_step(path_, options, values));
  const auto source = file_source(path_);
  StreamReader reader = *StreamReader::open(**source, 1);
  StreamPortion piece;
  uint64_t points = 0;
  while (*reader.next(piece)) {
    ASSERT_EQ(piece.point_arrays.size(), 1u);
    for (size_t i = 0; i < piece.points.size(); ++i, ++points) {
      float value = 0;
      std::memcpy(&value, piece.point_arrays[0].data() + 4 * i, 4);
      ASSERT_EQ(value, static_cast<float>(piece.points[i]) * 2);
    }
  }
  EXPECT_EQ(points, at_time(0).point_count());
}

/// Ten batches of a grid.
std::vector<std::byte> in_batches(const Mesh& mesh) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  StreamOptions options;
  options.arrays.push_back({"number", Domain::cell, Scalar::u32, 1, Role::none, {}, {}, {}});
  StreamWriter writer = *StreamWriter::begin(*sink, options);
  EXPECT_TRUE(writer.add_points(0, mesh.points.bytes));
  const Buffer<uint32_t>& all = mesh.blocks[0].connectivity;
  for (uint32_t cell = 0; cell * 8 < all.size(); ++cell) {
    const std::vector<uint64_t> points(all.begin() + cell * 8, all.begin() + cell * 8 + 8);
    const std::array<Bytes, 1> arrays{std::as_bytes(std::span(&cell, 1))};
    EXPECT_TRUE(writer.add_cells(CellType::hexahedron, points, {}, arrays));
    const bool full = cell % 10 == 9;
    EXPECT_TRUE(!full || writer.flush());
  }
  EXPECT_TRUE(writer.finish());
  return bytes;
}

TEST(Salvage, GivesWholeBatchesBeforeAnyCut) {
  const Mesh mesh = grid(5, 5, 4);
  const std::vector<std::byte> whole = in_batches(mesh);
  uint64_t most = 0;
  unsigned steps = 0;
  for (size_t size = 0; size < whole.size(); size += every(1)) {
    const auto found = salvage(*memory_source(Bytes(whole).first(size)));
    if (!found) {
      EXPECT_EQ(most, 0u) << size;
      EXPECT_EQ(found.error().code, ErrorCode::corrupt);
      continue;
    }
    ASSERT_TRUE(found->damage) << size;
    EXPECT_EQ(found->damage->code, ErrorCode::corrupt);
    const uint64_t cells = found->mesh.cell_count();
    ASSERT_EQ(cells % 10, 0u);
    ASSERT_GE(cells, most);
    steps += cells > most;
    most = cells;
    for (uint64_t i = 0; i < cells; ++i) ASSERT_EQ(found->mesh.arrays[0].values<uint32_t>()[i], i);
    // The same places in space, whatever the numbers are now.
    const std::span<const float> there = found->mesh.points.values<float>(),
                                 here = mesh.points.values<float>();
    for (size_t k = 0; k < cells * 8; ++k) {
      const uint32_t a = found->mesh.blocks[0].connectivity[k], b = mesh.blocks[0].connectivity[k];
      ASSERT_EQ(there[3 * a], here[3 * b]);
      ASSERT_EQ(there[3 * a + 2], here[3 * b + 2]);
    }
  }
  EXPECT_EQ(most, mesh.cell_count());
  EXPECT_EQ(steps, 10u);
}

TEST(Salvage, OfAWholeFileIsTheMesh) {
  const Mesh mesh = at_time(1);
  const auto found = salvage(*memory_source(Bytes(encoded(mesh, kept()))));
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->damage);
  expect_same(mesh, found->mesh);
}

TEST(Salvage, StopsAtTheFirstDamagedChunk) {
  std::vector<std::byte> bytes = in_batches(grid(5, 5, 4));
  bytes[bytes.size() / 2] ^= std::byte{16};
  const auto found = salvage(*memory_source(Bytes(bytes)));
  ASSERT_TRUE(found);
  ASSERT_TRUE(found->damage);
  EXPECT_GT(found->mesh.cell_count(), 0u);
  EXPECT_LT(found->mesh.cell_count(), 100u);
}

}  // namespace
}  // namespace maille
