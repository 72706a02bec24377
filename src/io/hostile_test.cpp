// What nobody means well by: files kept in tests/corrupt/io, and valid files with bytes changed.

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <iterator>

#include "io/same_mesh.h"
#include "support/cases.h"
#include "support/data.h"
#include "support/files.h"
#include "support/random.h"
#include "support/random_mesh.h"
#include "support/random_volume.h"

namespace maille {
namespace {

using ::testing::HasSubstr;

/// Every file beside its sentence: x.ply and x.ply.error.
TEST(CorruptFiles, AreNamedInOneSentence) {
  unsigned files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(testing::tests_folder() + "/corrupt/io")) {
    const std::string path = entry.path().string();
    if (!std::filesystem::exists(path + ".error")) continue;
    const std::string text = testing::read_text(path);
    const std::string name = entry.path().filename().string();
    const auto source = memory_source(std::as_bytes(std::span(text.data(), text.size())), name);
    ReadOptions options;
    options.limits.mesh_bytes = uint64_t{1} << 24;  // a claimed count is never believed
    const auto result = read_mesh(*source, options);
    ASSERT_FALSE(result) << name;
    if (result.error().message.find("built without HDF5") != std::string::npos) continue;
    std::string expected = testing::read_text(path + ".error");
    expected.pop_back();
    EXPECT_EQ(std::to_string(static_cast<int>(result.error().code)) + " " + result.error().message, expected);
    ++files;
  }
  EXPECT_GE(files, 20u);
}

struct Sample {
  std::string format;
  std::string text;
};

/// Small files of all formats and encodings.
std::vector<Sample> samples(uint64_t seed) {
  testing::RandomMeshOptions random;
  random.faces = 12;
  random.several_blocks = false;
  const Mesh mesh = testing::random_surface(seed, random);
  std::vector<Sample> list;
  const Mesh volume = testing::random_volume(seed);
  for (const char* format :
       {"ply", "obj", "off", "stl", "3mf", "vtu", "vtk", "mesh", "meshb", "msh", "su2", "hedra"}) {
    static constexpr std::string_view of_surfaces[] = {"ply", "obj", "off", "stl", "3mf"};
    const bool surface =
        std::find(std::begin(of_surfaces), std::end(of_surfaces), format) != std::end(of_surfaces);
    for (const bool ascii : {false, true}) {
      for (const bool big_endian : {false, true}) {
        WriteOptions options;
        options.format = format;
        options.ascii = ascii;
        options.big_endian = big_endian;
        std::vector<std::byte> bytes;
        const auto sink = memory_sink(bytes);
        if (!write_mesh(surface ? mesh : volume, *sink, options)) continue;
        list.push_back({format, std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size())});
      }
    }
  }
  return list;
}

/// An error of the right kind, or a mesh that keeps its rules and can be written again.
void expect_survives(const Sample& sample) {
  const auto source = memory_source(std::as_bytes(std::span(sample.text.data(), sample.text.size())), "x");
  ReadOptions options;
  options.format = sample.format;
  options.limits.mesh_bytes = uint64_t{1} << 26;
  const auto result = read_mesh(*source, options);
  if (!result) {
    const ErrorCode code = result.error().code;
    EXPECT_TRUE(code == ErrorCode::malformed_input || code == ErrorCode::unsupported ||
                code == ErrorCode::memory_bound)
        << result.error().message;
    EXPECT_THAT(result.error().message, HasSubstr("x: "));
    return;
  }
  EXPECT_TRUE(validate(result->mesh));
  WriteOptions write;
  write.format = sample.format;
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  const auto written = write_mesh(result->mesh, *sink, write);
  EXPECT_TRUE(written || written.error().code == ErrorCode::usage);
  if (!written) return;
  // What we write, we read.
  options.limits = {};
  const auto again = read_mesh(*memory_source(Bytes(bytes), "y"), options);
  EXPECT_TRUE(again) << sample.format << ": " << again.error().message;
}

TEST(HostileInput, ReadersSurviveChangedBytes) {
  static constexpr char tempting[] = "0123456789-+.eE \n\r\t/#\\";
  for (uint64_t seed = 0; seed < testing::cases(25); ++seed) {
    testing::Random random(seed);
    for (const Sample& sample : samples(seed)) {
      for (int i = 0; i < 25 && !sample.text.empty(); ++i) {
        Sample changed = sample;
        for (uint32_t change = random.between(1, 4); change > 0; --change) {
          const size_t at = random.below(random.chance(50) ? changed.text.size()
                                                           : std::min<size_t>(600, changed.text.size()));
          changed.text[at] = random.chance(50) ? tempting[random.below(sizeof tempting - 1)]
                                               : static_cast<char>(random.next());
        }
        expect_survives(changed);
      }
    }
  }
}

TEST(HostileInput, ReadersSurviveCutAndRepeatedParts) {
  for (uint64_t seed = 0; seed < testing::cases(25); ++seed) {
    testing::Random random(seed + 1000);
    for (const Sample& sample : samples(seed)) {
      for (int i = 0; i < 12; ++i) {
        const size_t size = sample.text.size();
        const size_t from = random.below(size + 1);
        const size_t length = random.below(std::min<size_t>(size - from, 64) + 1);
        Sample changed = sample;
        if (random.chance(50)) {
          changed.text.erase(from, length);
        } else {
          changed.text.insert(random.below(size + 1), sample.text.substr(from, length));
        }
        expect_survives(changed);
      }
    }
  }
}

TEST(HostileInput, ReadersSurviveEveryTruncation) {
  const size_t step = testing::every(1);
  for (const Sample& sample : samples(3)) {
    for (size_t length = 0; length < std::min<size_t>(sample.text.size(), 3000); length += step) {
      expect_survives({sample.format, sample.text.substr(0, length)});
    }
  }
}

/// Properties few faces have, times many edges: the zeros in between must not grow without bound.
TEST(HostileInput, PaddingIsBounded) {
  std::string text =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty "
      "float z\n"
      "element face 1\nproperty list uchar int vertex_indices\n";
  for (int i = 0; i < 4000; ++i) text += "property double p" + std::to_string(i) + "\n";
  text += "element edge 100000\nproperty uchar vertex1\nproperty uchar vertex2\nend_header\n";
  text += std::string(12 + 1 + 4000 * 8 + 200000, '\0');
  const auto source = memory_source(std::as_bytes(std::span(text.data(), text.size())), "wide.ply");
  const auto result = read_mesh(*source, {});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::malformed_input);
}

}  // namespace
}  // namespace maille
