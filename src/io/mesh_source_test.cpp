#include <maille/mesh_source.h>

#include <gmock/gmock.h>

#include <filesystem>

#include "io/format.h"
#include "io/mesh_sources.h"
#include "io/same_mesh.h"
#include "mesh/mesh_as_source.h"
#include "support/random.h"
#include "support/random_volume.h"
#include "support/sample_mesh.h"
#include "support/temporary_folder.h"

namespace maille {
namespace {

using namespace maille::testing;
using ::testing::HasSubstr;

MeshDescription description_of(const Mesh& mesh) {
  MeshDescription description;
  description.points = mesh.point_count();
  description.cells = mesh.cell_count();
  description.corners = mesh.corner_count();
  description.point_type = mesh.points.type;
  for (const CellBlock& block : mesh.blocks)
    description.blocks.push_back({block.name, block.type, block.size()});
  for (const Array& array : mesh.arrays) {
    Array copy = array;
    if (array.domain != Domain::mesh) copy.bytes.clear();
    (array.domain == Domain::mesh ? description.mesh_arrays : description.arrays).push_back(std::move(copy));
  }
  description.metadata = mesh.metadata;
  return description;
}

/// All of it, `step` elements at a time.
Result<Mesh> read_in_parts(const Source& source, uint64_t step) {
  const auto opened = open_mesh_source(source);
  if (!opened) return tl::unexpected(opened.error());
  MeshSource& parts = **opened;
  const MeshDescription& description = parts.description();
  Mesh mesh;
  mesh.metadata = description.metadata;
  mesh.points.type = description.point_type;
  const auto in_steps = [&](Array& array, uint64_t count, auto read) -> Result<> {
    for (uint64_t first = 0; first < count; first += step) {
      const uint64_t part = std::min(step, count - first);
      array.resize(first + part);
      const auto room = std::span(array.bytes).last(part * array.tuple_size());
      if (auto ok = read(first, part, room); !ok) return ok;
    }
    return {};
  };
  if (auto ok = in_steps(mesh.points, description.points, [&](auto... a) { return parts.read_points(a...); });
      !ok)
    return tl::unexpected(ok.error());
  CellBlock block;
  block.type = CellType::mixed;
  block.offsets = {0};
  for (uint64_t first = 0; first < description.cells; first += step) {
    CellPiece cells;
    if (auto ok = parts.read_cells(first, std::min(step, description.cells - first), cells); !ok)
      return tl::unexpected(ok.error());
    for (size_t i = 0; i < cells.size(); ++i)
      block.offsets.push_back(block.connectivity.size() + cells.offsets[i + 1]);
    block.types.insert(block.types.end(), cells.types.begin(), cells.types.end());
    for (const uint64_t point : cells.connectivity)
      block.connectivity.push_back(static_cast<uint32_t>(point));
  }
  if (description.cells != 0) mesh.blocks.push_back(block);
  for (size_t i = 0; i < description.arrays.size(); ++i) {
    mesh.arrays.push_back(description.arrays[i]);
    Array& array = mesh.arrays.back();
    if (auto ok = in_steps(array, description.count_of(array),
                           [&](auto... a) { return parts.read_array(i, a...); });
        !ok)
      return tl::unexpected(ok.error());
  }
  for (const Array& array : description.mesh_arrays) mesh.arrays.push_back(array);
  return mesh;
}

RandomVolumeOptions without_polyhedra() {
  RandomVolumeOptions options;
  std::erase(options.types, CellType::polyhedron);
  options.corner_arrays = false;
  return options;
}

/// The blocks as one mixed block.
Mesh joined(Mesh mesh) {
  CellBlock all;
  all.type = CellType::mixed;
  all.offsets = {0};
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      const auto nodes = block.cell(i);
      all.connectivity.insert(all.connectivity.end(), nodes.begin(), nodes.end());
      all.offsets.push_back(all.connectivity.size());
      all.types.push_back(static_cast<uint8_t>(block.type_of(i)));
    }
  }
  mesh.blocks.assign(1, all);
  return mesh;
}

TEST(MeshSource, GivesInPartsWhatIsReadWhole) {
  for (const char* name : {"appended_raw.vtu", "appended_lz4.vtu", "appended_lzma.vtu"}) {
    for (const uint64_t step : {1u, 3u, 100u}) {
      const auto source = file_source(sample_path(name));
      ASSERT_TRUE(source);
      const auto mesh = read_in_parts(**source, step);
      ASSERT_TRUE(mesh) << mesh.error().message;
      expect_same_mesh(*mesh, sample_mesh());
    }
  }
}

TEST(MeshSource, GivesBackWhatTheWriterWrote) {
  for (uint64_t seed = 0; seed < 60; ++seed) {
    const Mesh mesh = random_volume(seed, without_polyhedra());
    WriteOptions options;
    options.big_endian = seed % 2 == 1;
    const std::string text = write_text(vtu_format(), mesh, options).text;
    const auto source = memory_source(std::as_bytes(std::span(text.data(), text.size())));
    const auto back = read_in_parts(*source, 1 + seed % 9);
    ASSERT_TRUE(back) << back.error().message;
    expect_same_mesh(*back, joined(mesh));
    const auto opened = open_mesh_source(*source);
    ASSERT_TRUE(opened);
    ASSERT_FALSE((*opened)->description().blocks.empty());
    EXPECT_EQ((*opened)->description().blocks[0].name, mesh.blocks[0].name);
    EXPECT_EQ((*opened)->description().corners, mesh.corner_count());
  }
}

/// A mesh as Gmsh has it: all nodes are numbered in their order.
Result<Mesh> gmsh_file(uint64_t seed, const char* version, std::string& text) {
  RandomVolumeOptions some = without_polyhedra();
  Mesh mesh = random_volume(seed, some);
  mesh.metadata.emplace_back("gmsh.version", version);
  text = write_text(gmsh_format(), mesh, {}).text;
  const auto whole =
      read_mesh(*memory_source(std::as_bytes(std::span(text.data(), text.size())), "a.msh"), {});
  if (!whole) return tl::unexpected(whole.error());
  return whole->mesh;
}

TEST(MeshSource, GivesOfBinaryGmshFilesWhatIsReadWhole) {
  unsigned in_parts = 0, elements = 0;
  for (const char* version : {"2.2", "4.1"}) {
    for (uint64_t seed = 0; seed < 60; ++seed) {
      std::string text;
      const auto whole = gmsh_file(seed, version, text);
      ASSERT_TRUE(whole) << whole.error().message;
      const auto source = memory_source(std::as_bytes(std::span(text.data(), text.size())), "a.msh");
      const auto back = read_in_parts(*source, 1 + seed % 9);
      if (!back) {
        EXPECT_EQ(back.error().code, ErrorCode::unsupported) << back.error().message;
        continue;
      }
      ++in_parts;
      elements += whole->cell_count() > 0;
      Mesh expected = joined(*whole);
      if (expected.cell_count() == 0) expected.blocks.clear();
      expect_same_mesh(*back, expected);
      const auto opened = open_mesh_source(*source);
      ASSERT_EQ((*opened)->description().blocks.size(), whole->blocks.size());
      for (size_t b = 0; b < whole->blocks.size(); ++b) {
        EXPECT_EQ((*opened)->description().blocks[b].name, whole->blocks[b].name);
        EXPECT_EQ((*opened)->description().blocks[b].type, whole->blocks[b].type);
        EXPECT_EQ((*opened)->description().blocks[b].cells, whole->blocks[b].size());
      }
    }
  }
  EXPECT_GT(in_parts, 60u);
  EXPECT_GT(elements, 30u);
}

TEST(MeshSource, SurvivesDamagedGmshFiles) {
  for (const char* version : {"2.2", "4.1"}) {
    std::string text;
    ASSERT_TRUE(gmsh_file(3, version, text));
    Random random(2);
    for (int trial = 0; trial < 2000; ++trial) {
      std::string damaged = text.substr(0, random.chance(20) ? random.below(text.size()) : text.size());
      for (uint32_t i = random.between(1, 4); i > 0 && !damaged.empty(); --i)
        damaged[random.below(damaged.size())] = static_cast<char>(random.below(256));
      const auto source = memory_source(std::as_bytes(std::span(damaged.data(), damaged.size())), "x.msh");
      const auto mesh = read_in_parts(*source, 5);
      EXPECT_TRUE(!mesh || mesh->count_of(Domain::point) <= text.size());
    }
  }
}

TEST(MeshSource, SaysWhatItCannotReadInParts) {
  for (const auto& [name, message] : {std::pair("ascii.vtu", "no appended data"),
                                      {"appended_base64.vtu", "base64"},
                                      {"polyhedra.vtu", "no appended data"}}) {
    const auto source = file_source(sample_path(name));
    ASSERT_TRUE(source);
    const auto opened = open_mesh_source(**source);
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.error().code, ErrorCode::unsupported);
    EXPECT_THAT(opened.error().message, HasSubstr(message));
  }
}

TEST(MeshSource, RefusesMoreThanThereIs) {
  const auto source = file_source(sample_path("appended_raw.vtu"));
  ASSERT_TRUE(source);
  const auto opened = open_mesh_source(**source);
  ASSERT_TRUE(opened);
  std::vector<std::byte> room(24 * 17);
  EXPECT_FALSE((*opened)->read_points(0, 17, room));
  EXPECT_FALSE((*opened)->read_points(16, 1, std::span(room).first(24)));
  EXPECT_FALSE((*opened)->read_points(0, 2, std::span(room).first(24)));
  CellPiece cells;
  EXPECT_FALSE((*opened)->read_cells(7, 2, cells));
}

TEST(MeshSource, SurvivesDamage) {
  for (const char* name : {"appended_raw.vtu", "appended_lz4.vtu", "appended_lzma.vtu"}) {
    const std::string text = text_of_file(sample_path(name));
    Random random(1);
    for (int trial = 0; trial < 500; ++trial) {
      std::string damaged = text.substr(0, random.chance(20) ? random.below(text.size()) : text.size());
      for (uint32_t i = random.between(1, 4); i > 0 && !damaged.empty(); --i) {
        damaged[random.below(damaged.size())] =
            static_cast<char>(random.chance(50) ? '0' + static_cast<int>(random.below(10))
                                                : static_cast<int>(random.below(256)));
      }
      const auto source = memory_source(std::as_bytes(std::span(damaged.data(), damaged.size())), "x");
      const auto mesh = read_in_parts(*source, 5);
      EXPECT_TRUE(!mesh || mesh->count_of(Domain::point) <= text.size());
    }
  }
}

TEST(MeshSink, WritesInPartsWhatIsReadWhole) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path("parts.vtu");
  for (uint64_t seed = 0; seed < 30; ++seed) {
    const Mesh mesh = random_volume(seed, without_polyhedra());
    const auto opened = vtu_sink(path, description_of(mesh));
    ASSERT_TRUE(opened) << opened.error().message;
    MeshSink& sink = **opened;
    // Arrays in halves, the second first.
    const auto halves = [](const Array& array, auto write) {
      const uint64_t half = array.count() / 2;
      ASSERT_TRUE(write(half, Bytes(array.bytes).subspan(half * array.tuple_size())));
      ASSERT_TRUE(write(0, Bytes(array.bytes).first(half * array.tuple_size())));
    };
    size_t number = 0;
    for (const Array& array : mesh.arrays) {
      if (array.domain == Domain::mesh) continue;
      halves(array, [&](uint64_t first, Bytes bytes) { return sink.write_array(number, first, bytes); });
      ++number;
    }
    const CellBlock all = joined(mesh).blocks[0];
    for (uint64_t i = 0; i < all.size(); ++i) {
      const auto nodes = all.cell(i);
      ASSERT_TRUE(
          sink.write_cells({{all.types[i]}, {0, nodes.size()}, {nodes.begin(), nodes.end()}, {}, {}}));
    }
    halves(mesh.points, [&](uint64_t first, Bytes bytes) { return sink.write_points(first, bytes); });
    EXPECT_FALSE(std::filesystem::exists(path));
    ASSERT_TRUE(sink.commit());
    const auto back = read_mesh(path);
    ASSERT_TRUE(back) << back.error().message;
    expect_same_mesh(back->mesh, mesh);
    std::filesystem::remove(path);
  }
}

TEST(MeshSink, WritesGmshFilesInParts) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path("parts.msh");
  unsigned written = 0;
  for (uint64_t seed = 0; seed < 80; ++seed) {
    std::string text;
    const auto whole = gmsh_file(seed, "2.2", text);
    ASSERT_TRUE(whole) << whole.error().message;
    const auto opened = mesh_sink(path, "msh", description_of(*whole));
    if (!opened) {
      EXPECT_EQ(opened.error().code, ErrorCode::unsupported);
      continue;
    }
    ++written;
    MeshSink& sink = **opened;
    const CellBlock all = joined(*whole).blocks[0];
    for (uint64_t i = 0; i < all.size(); ++i) {
      for (size_t k = 0; k < whole->arrays.size(); ++k) {
        const Array& array = whole->arrays[k];
        if (array.domain != Domain::cell) continue;
        ASSERT_TRUE(
            sink.write_array(k, i, Bytes(array.bytes).subspan(i * array.tuple_size(), array.tuple_size())));
      }
      const auto nodes = all.cell(i);
      ASSERT_TRUE(
          sink.write_cells({{all.types[i]}, {0, nodes.size()}, {nodes.begin(), nodes.end()}, {}, {}}));
    }
    for (size_t k = 0; k < whole->arrays.size(); ++k) {
      if (whole->arrays[k].domain == Domain::point) {
        ASSERT_TRUE(sink.write_array(k, 0, whole->arrays[k].bytes));
      }
    }
    ASSERT_TRUE(sink.write_points(0, whole->points.bytes));
    ASSERT_TRUE(sink.commit());
    const auto back = read_mesh(path);
    ASSERT_TRUE(back) << back.error().message;
    expect_same_mesh(back->mesh, *whole);
    std::filesystem::remove(path);
  }
  EXPECT_GT(written, 10u);
}

/// Cells `step` at a time, values before their cells.
void pour(MeshSource& from, MeshSink& sink, uint64_t step) {
  const MeshDescription& mesh = from.description();
  std::vector<std::byte> bytes(mesh.points * 3 * size_of(mesh.point_type));
  ASSERT_TRUE(from.read_points(0, mesh.points, bytes));
  ASSERT_TRUE(sink.write_points(0, bytes));
  for (size_t k = 0; k < mesh.arrays.size(); ++k) {
    const uint64_t count = mesh.count_of(mesh.arrays[k]);
    bytes.resize(count * mesh.arrays[k].tuple_size());
    ASSERT_TRUE(from.read_array(k, 0, count, bytes));
    ASSERT_TRUE(sink.write_array(k, 0, bytes));
  }
  CellPiece piece;
  for (uint64_t first = 0; first < mesh.cells; first += step) {
    ASSERT_TRUE(from.read_cells(first, std::min(step, mesh.cells - first), piece));
    ASSERT_TRUE(sink.write_cells(piece));
  }
  ASSERT_TRUE(sink.commit());
}

TEST(MeshSink, SpoolsGmshFilesAsTheyAreWrittenWhole) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path("spooled.msh");
  for (uint64_t seed = 0; seed < 40; ++seed) {
    RandomVolumeOptions some;
    some.corner_arrays = false;
    Mesh mesh = random_volume(seed, some);
    if (seed % 2 == 0) mesh.metadata.emplace_back("gmsh.version", "2.2");
    WriteOptions options;
    options.ascii = seed % 4 < 2;
    const Written whole = write_text(gmsh_format(), mesh, options);
    const auto source = mesh_as_source(mesh);
    MeshSinkOptions sink_options;
    sink_options.ascii = options.ascii;
    const auto sink = spooled_gmsh_sink(path, source->description(), sink_options);
    ASSERT_TRUE(sink) << sink.error().message;
    pour(*source, **sink, 1 + seed % 5);
    EXPECT_TRUE(text_of_file(path) == whole.text);
    std::filesystem::remove(path);
  }
}

TEST(MeshSink, NamesOfSeveralLinesStandInOneInGmshFiles) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path("lines.msh");
  Mesh mesh;
  mesh.points = make_array("position", Domain::point, Scalar::f64, 3);
  mesh.points.resize(3);
  mesh.blocks.push_back({"in\nlet", CellType::triangle, {}, {}, {0, 1, 2}});
  mesh.arrays.push_back(make_array("heat\r\nflux", Domain::point, Scalar::f64, 1));
  mesh.arrays[0].resize(3);
  mesh.metadata.emplace_back("gmsh.version", "2.2");
  const auto source = mesh_as_source(mesh);
  const auto sink = mesh_sink(path, "msh", source->description());
  ASSERT_TRUE(sink) << sink.error().message;
  pour(*source, **sink, 1);
  const auto back = read_mesh(path);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_NE(back->mesh.find("heat  flux", Domain::point), nullptr);
  EXPECT_NE(text_of_file(path).find("\"in let\"\n"), std::string::npos);
}

TEST(MeshSink, LeavesNothingWithoutCommit) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path("unfinished.vtu");
  {
    const auto opened = vtu_sink(path, description_of(sample_mesh()));
    ASSERT_TRUE(opened);
    EXPECT_FALSE((*opened)->commit()) << "no cells were written";
    const std::vector<std::byte> many(17 * 24);
    EXPECT_FALSE((*opened)->write_points(0, many));
  }
  EXPECT_TRUE(folder.names().empty());
}

}  // namespace
}  // namespace maille
