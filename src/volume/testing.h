#pragma once

#include <maille/compare.h>
#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/stream.h>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <numeric>
#include <random>
#include <span>

#include "volume/cells/cell_shape.h"

// Volume meshes made for the tests of this folder.

namespace maille::testing {

inline void set_positions(Mesh& mesh, const std::vector<float>& positions) {
  mesh.points = make_array("position", Domain::point, Scalar::f32, 3);
  const auto bytes = std::as_bytes(std::span(positions));  // there may be none, which memcpy() does not take
  mesh.points.bytes.assign(bytes.begin(), bytes.end());
}

/// nx x ny x nz hexahedra, points numbered x first.
inline Mesh grid(unsigned nx, unsigned ny, unsigned nz) {
  Mesh mesh;
  std::vector<float> positions;
  for (unsigned z = 0; z <= nz; ++z) {
    for (unsigned y = 0; y <= ny; ++y) {
      for (unsigned x = 0; x <= nx; ++x) {
        const auto a = static_cast<float>(x), b = static_cast<float>(y), c = static_cast<float>(z);
        positions.insert(positions.end(), {a * 0.1f + b * b * 0.001f, b * 0.2f, c + a * b * 0.01f});
      }
    }
  }
  set_positions(mesh, positions);
  CellBlock block;
  block.name = "grid";
  block.type = CellType::hexahedron;
  const auto id = [&](unsigned x, unsigned y, unsigned z) { return (z * (ny + 1) + y) * (nx + 1) + x; };
  for (unsigned z = 0; z < nz; ++z) {
    for (unsigned y = 0; y < ny; ++y) {
      for (unsigned x = 0; x < nx; ++x) {
        for (const unsigned top : {0u, 1u}) {
          block.connectivity.insert(
              block.connectivity.end(),
              {id(x, y, z + top), id(x + 1, y, z + top), id(x + 1, y + 1, z + top), id(x, y + 1, z + top)});
        }
      }
    }
  }
  mesh.blocks.push_back(std::move(block));
  return mesh;
}

/// Any cells over any points: corners repeat, faces are used three times, cells are mirrored and doubled,
/// points are left over.
inline Mesh soup(unsigned seed, unsigned cells, unsigned points) {
  std::mt19937 random(seed);
  const auto below = [&](uint32_t n) { return static_cast<uint32_t>(random() % n); };
  Mesh mesh;
  std::vector<float> positions(size_t{points} * 3);
  for (float& value : positions) value = static_cast<float>(below(1000)) * 0.01f;
  set_positions(mesh, positions);
  CellBlock block;
  block.type = CellType::mixed;
  block.offsets.push_back(0);
  const CellType loose[] = {CellType::polygon, CellType::poly_line, CellType::pentagonal_prism,
                            CellType::hexagonal_prism};
  for (unsigned i = 0; i < cells; ++i) {
    const unsigned kind = below(shape_count + 4);
    const CellType type = kind < shape_count ? cell_shapes[kind].type : loose[kind - shape_count];
    const unsigned nodes = nodes_of(type) != 0 ? nodes_of(type) : below(7);
    block.types.push_back(static_cast<uint8_t>(type));
    const size_t begin = block.connectivity.size();
    for (unsigned n = 0; n < nodes; ++n) {
      // Mostly near one another, so that cells meet in faces; some cells repeat an earlier one.
      const uint32_t near = (i / 3 + below(12)) % points;
      const bool again = begin >= nodes && below(3) == 0;
      block.connectivity.push_back(again ? block.connectivity[begin - nodes + n] : near);
    }
    block.offsets.push_back(block.connectivity.size());
  }
  mesh.blocks.push_back(std::move(block));
  return mesh;
}

/// Values that have nothing to do with the mesh, of every type.
inline void add_arrays(Mesh& mesh, unsigned seed) {
  std::mt19937 random(seed);
  for (unsigned type = 0; type < scalar_count; ++type) {
    for (const Domain domain : {Domain::point, Domain::cell}) {
      Array array = make_array(std::string(name_of(domain)) + "_" + name_of(static_cast<Scalar>(type)),
                               domain, static_cast<Scalar>(type), 1 + type % 4);
      array.resize(mesh.count_of(domain));
      for (std::byte& byte : array.bytes) byte = static_cast<std::byte>(random());
      mesh.arrays.push_back(std::move(array));
    }
  }
  Array whole = make_array("time", Domain::mesh, Scalar::f64, 2);
  whole.resize(3);
  mesh.arrays.push_back(std::move(whole));
  mesh.metadata.emplace_back("made", "by a test");
}

inline std::vector<std::byte> encoded(const Mesh& mesh, const EncodeOptions& options) {
  std::vector<std::byte> bytes;
  const auto report = encode(mesh, *memory_sink(bytes), options);
  EXPECT_TRUE(report) << report.error().message;
  return bytes;
}

inline EncodeOptions kept(int effort = 5) {
  EncodeOptions options;
  options.mode = Mode::stream;
  options.order = Order::keep;
  options.effort = effort;
  return options;
}

/// Every number of every cell and array is where it was, and blocks have their names and types.
inline void expect_same(const Mesh& mesh, const Mesh& back) {
  CompareOptions strict;
  strict.same_order = true;
  strict.compare_metadata = true;
  const Comparison comparison = compare(mesh, back, strict);
  EXPECT_TRUE(comparison.equal) << (comparison.differences.empty() ? "" : comparison.differences.front());
  ASSERT_EQ(mesh.blocks.size(), back.blocks.size());
  for (size_t i = 0; i < mesh.blocks.size(); ++i) {
    EXPECT_EQ(mesh.blocks[i].name, back.blocks[i].name);
    EXPECT_EQ(mesh.blocks[i].type, back.blocks[i].type);
    EXPECT_EQ(mesh.blocks[i].connectivity, back.blocks[i].connectivity);
    EXPECT_EQ(mesh.blocks[i].types, back.blocks[i].types);
  }
}

inline void expect_round_trip(const Mesh& mesh, int effort = 5) {
  const std::vector<std::byte> bytes = encoded(mesh, kept(effort));
  const auto back = decode(*memory_source(Bytes(bytes)));
  ASSERT_TRUE(back) << back.error().message;
  expect_same(mesh, *back);
}

inline std::vector<uint32_t> shuffled(size_t count, unsigned seed) {
  std::vector<uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  std::mt19937 random(seed);
  for (size_t i = count; i > 1; --i) std::swap(order[i - 1], order[random() % i]);
  return order;
}

/// The cells and points of a grid in no order, with arrays, and points that no cell has.
inline Mesh scattered_grid(unsigned n, unsigned seed) {
  Mesh mesh = grid(n, n, n);
  const auto first = mesh.points.values<float>();
  std::vector<float> positions(first.begin(), first.end());
  positions.resize(positions.size() + 300, 0.25f);
  const std::vector<uint32_t> points = shuffled(positions.size() / 3, seed);
  std::vector<float> moved(positions.size());
  for (size_t i = 0; i < points.size(); ++i) std::copy_n(&positions[3 * i], 3, &moved[size_t{3} * points[i]]);
  set_positions(mesh, moved);
  CellBlock& block = mesh.blocks[0];
  const std::vector<uint32_t> cells = shuffled(block.size(), seed + 1);
  std::vector<uint32_t> connectivity(block.connectivity.size());
  for (size_t i = 0; i < connectivity.size(); ++i)
    connectivity[size_t{8} * cells[i / 8] + i % 8] = points[block.connectivity[i]];
  block.connectivity = connectivity;
  add_arrays(mesh, seed);
  return mesh;
}

/// Does the file have the input's order beside the cells?
inline bool is_apart(const std::vector<std::byte>& bytes) {
  const auto source = memory_source(Bytes(bytes));
  StreamReadOptions options;
  options.any_order = true;
  const auto reader = StreamReader::open(source_stream(*source), options);
  return reader && reader->description().order_apart;
}

}  // namespace maille::testing
