#pragma once

#include <gtest/gtest.h>
#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/version.h>

#include <algorithm>
#include <string>
#include <vector>

#include "container/file_reader.h"
#include "container/file_writer.h"
#include "support/cases.h"
#include "support/codec.h"
#include "support/random_file.h"
#include "support/random_mesh.h"
#include "support/shapes.h"

namespace maille::testing {

// Files of mode `random` for tests that damage them.

/// Triangles with arrays of all domains, in many charts.
inline Mesh sample_mesh(uint32_t n = 12) {
  Mesh mesh = to_mesh(triangulated(shapes::grid(n, n)));
  const auto add = [&](const char* name, Domain domain, uint64_t tuples) {
    Array array = make_array(name, domain, Scalar::u8, 1);
    array.resize(tuples);
    for (uint64_t i = 0; i < tuples; ++i) array.bytes[i] = static_cast<std::byte>(i * i % 11);
    mesh.arrays.push_back(std::move(array));
  };
  add("height", Domain::point, mesh.point_count());
  add("material", Domain::cell, mesh.cell_count());
  add("uv", Domain::corner, mesh.corner_count());
  add("unit", Domain::mesh, 3);
  return mesh;
}

struct Sample {
  std::string name;
  std::vector<std::byte> bytes;
  Mesh decoded;
};

inline std::vector<Sample> samples() {
  std::vector<Sample> files;
  const auto add = [&](const std::string& name, const Mesh& mesh, const EncodeOptions& options) {
    const RandomFile file = random_file(mesh, options, 24);
    ASSERT_EQ(file.error, "") << name;
    files.push_back({name, file.bytes, decode_bytes(file.bytes).value()});
  };
  add("empty", Mesh{}, {});
  add("grid", sample_mesh(), {});
  EncodeOptions options;
  options.effort = 2;
  options.positions = {Tolerance::Kind::bits, 10};
  options.order = Order::keep;
  add("sphere in order", to_mesh(triangulated(shapes::sphere(12, 9))), options);
  for (uint64_t seed = 0; seed < 200 && files.size() < 6; ++seed) {
    const Mesh mesh = random_surface(seed);
    if (mesh.arrays.size() < 3 || mesh.cell_count() < 20) continue;
    options.positions = {};
    options.effort = 5;
    options.order = seed % 2 == 0 ? Order::keep : Order::canonical;
    add("seed " + std::to_string(seed), mesh, options);
  }
  return files;
}

/// A file as its streams, to be changed and written again with good checksums.
struct Streams {
  struct Stream {
    std::string type;
    uint32_t patch = 0, number = 0;
    std::vector<std::byte> bytes;
  };
  std::vector<Stream> streams;

  explicit Streams(const std::vector<std::byte>& bytes) {
    const auto source = memory_source(Bytes(bytes));
    const FileReader reader = FileReader::open(*source).value();
    for (const ChunkRecord& record : reader.records()) {
      if (record.header.part() > 0) continue;
      Stream& stream = streams.emplace_back();
      stream.type.assign(record.header.type.begin(), record.header.type.end());
      stream.patch = record.header.patch;
      stream.number = record.header.number;
      stream.bytes = reader.read_stream(key(stream)).value();
    }
  }
  static StreamKey key(const Stream& stream) {
    StreamKey key{"", stream.patch, stream.number};
    std::copy_n(stream.type.begin(), 4, key.type);
    return key;
  }
  Stream& of(const std::string& type, uint32_t patch = 0) {
    return *std::find_if(streams.begin(), streams.end(),
                         [&](const Stream& s) { return s.type == type && s.patch == patch; });
  }
  void remove(const std::string& type, uint32_t patch = 0) {
    std::erase_if(streams, [&](const Stream& s) { return s.type == type && s.patch == patch; });
  }
  std::vector<std::byte> written() const {
    std::vector<std::byte> bytes;
    const auto sink = memory_sink(bytes);
    FileWriter writer =
        FileWriter::begin(*sink, {.major = format_major, .minor = format_minor, .mode = Mode::random})
            .value();
    for (const Stream& stream : streams) EXPECT_TRUE(writer.write_stream(key(stream), stream.bytes));
    EXPECT_TRUE(writer.finish());
    return bytes;
  }
};

}  // namespace maille::testing
