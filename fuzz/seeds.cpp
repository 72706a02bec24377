// Writes first inputs for the fuzzers: seeds FOLDER [EVERY]. Small meshes of all kinds, in all forms; every
// EVERY-th of them.

#include <maille/io.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "fuzzing.h"
#include "io/gzip.h"
#include "packed_streams.h"
#include "random/random_file.h"
#include "support/random.h"
#include "support/random_mesh.h"
#include "support/random_volume.h"
#include "surface/fans/fan_patch.h"
#include "surface/fans/positions.h"
#include "surface/patch_topology.h"

namespace maille::fuzzing {
namespace {

void save(const std::filesystem::path& path, uint8_t first, Bytes bytes) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream out(path, std::ios::binary);
  out.put(static_cast<char>(first));
  out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

EncodeOptions options_for(uint64_t seed, const Mesh& mesh) {
  EncodeOptions options;
  if (seed % 3 == 1) options.order = Order::keep;
  if (seed % 7 == 3) options.most_cells_per_part = 10;
  if (seed % 5 == 4) options.mode = Mode::stream;
  if (seed % 4 != 0) options.effort = seed % 4 == 3 ? 9 : seed % 4 == 2 ? 2 : 5;
  if (seed % 5 == 2) {
    options.positions = {Tolerance::Kind::bits, 8};
    for (const Array& array : mesh.arrays) options.arrays[array.name] = options.positions;
  }
  return options;
}

void save_file(const std::filesystem::path& folder, uint64_t seed, const Mesh& mesh) {
  auto file = encoded(mesh, options_for(seed, mesh));
  if (!file) file = encoded(mesh, {});
  if (!file) return;
  const std::string name = std::to_string(seed);
  save(folder / "decode_fuzz" / (name + ".file"), 0, *file);
  save(folder / "decode_fuzz" / (name + ".streams"), 1, streams_of_file(*file, Mode::single));
}

/// What a description would say of the mesh; `first` is the number of points, with what a fuzzer has there
/// besides.
void put_shape(ByteWriter& out, const Mesh& mesh, uint64_t first) {
  out.put_count(first);
  out.put_count(mesh.corner_count());
  out.put(static_cast<uint8_t>(mesh.blocks.size()));
  for (const CellBlock& block : mesh.blocks) {
    out.put(block.type);
    out.put_count(block.size());
  }
}

void save_topology(const std::filesystem::path& folder, uint64_t seed, const Mesh& mesh) {
  const auto topology = encode_topology(mesh);
  if (!topology) return;
  ByteWriter out;
  put_shape(out, mesh, mesh.point_count());
  out.put_bytes(topology->bytes);
  const std::vector<std::byte> bytes = out.take();
  const auto first = std::to_integer<uint8_t>(bytes[0]);
  save(folder / "connectivity_fuzz" / std::to_string(seed), first, Bytes(bytes).subspan(1));
}

void save_fans(const std::filesystem::path& folder, uint64_t seed, const Mesh& mesh) {
  const bool smaller = seed % 2 == 1;
  const auto patch = encode_fan_patch(mesh);
  if (!patch || !*patch) return;
  ByteWriter out;
  put_shape(out, mesh, mesh.point_count());
  out.put_count((*patch)->bytes.size());
  out.put_bytes((*patch)->bytes);
  const auto maps = choose_maps(mesh.points, {}, true);
  if (maps && fits_positions(mesh.points, *maps)) {
    const FanSurface& fans = (*patch)->patch.fans;
    const std::vector<uint32_t>& sources = (*patch)->sources.points;
    out.put_bytes(encode_positions(fans, mesh.points, *maps, sources, effort_of(smaller ? 6 : 1)));
  }
  const std::vector<std::byte> bytes = out.take();
  const auto first = std::to_integer<uint8_t>(bytes[0]);
  save(folder / "fan_fuzz" / std::to_string(seed), first, Bytes(bytes).subspan(1));
}

void save_foreign(const std::filesystem::path& folder, uint64_t seed, const Mesh& mesh) {
  for (size_t format = 0; format < formats().size(); ++format) {
    for (const bool ascii : {false, true}) {
      WriteOptions options;
      options.format = formats()[format].name;
      options.ascii = ascii;
      options.big_endian = seed % 2 == 0;
      std::vector<std::byte> bytes;
      const auto sink = memory_sink(bytes);
      if (!write_mesh(mesh, *sink, options)) continue;
      const std::string name = std::to_string(seed) + (ascii ? "a." : ".") + options.format;
      save(folder / "read_fuzz" / name, static_cast<uint8_t>(format), bytes);
      if (seed % 8 != 0) continue;
      std::vector<std::byte> packed;
      const auto below = memory_sink(packed);
      const auto packing = gzip_sink(*below);
      if (packing->write(bytes) && packing->commit())
        save(folder / "read_fuzz" / (name + ".gz"), static_cast<uint8_t>(format), packed);
    }
  }
}

void save_stream(const std::filesystem::path& folder, uint64_t seed, const Mesh& mesh) {
  EncodeOptions options;
  options.mode = Mode::stream;
  options.effort = seed % 2 == 0 ? 5 : 1;
  options.order = seed % 3 == 0 ? Order::canonical : Order::keep;
  const auto file = encoded(mesh, options);
  if (!file) return;
  const std::string name = std::to_string(seed);
  for (const auto& [ending, bytes] :
       {std::pair(".file", *file), {".streams", streams_of_file(*file, Mode::stream)}}) {
    save(folder / "stream_fuzz" / (name + ending), std::to_integer<uint8_t>(bytes[0]),
         Bytes(bytes).subspan(1));
  }
}

/// Charts so small that there are many, and levels.
void save_charts(const std::filesystem::path& folder, uint64_t seed, const Mesh& mesh) {
  EncodeOptions options = options_for(seed, mesh);
  options.mode = Mode::random;
  std::vector<std::byte> file;
  const auto sink = memory_sink(file);
  HierarchyOptions small;
  small.sizes = {12, 12};
  if (!encode_random(mesh, *sink, options, small)) return;
  const std::string name = std::to_string(seed);
  save(folder / "random_fuzz" / (name + ".file"), static_cast<uint8_t>(2 * seed), file);
  save(folder / "random_fuzz" / (name + ".streams"), static_cast<uint8_t>(2 * seed + 1),
       streams_of_file(file, Mode::random));
}

/// Any bytes are a mesh there; small ones are blocks, arrays and numbers near one another.
void save_round_trip(const std::filesystem::path& folder, uint64_t seed) {
  testing::Random random(seed);
  std::vector<std::byte> bytes(100 + random.below(1500));
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random.below(seed % 2 == 0 ? 256 : 8));
  save(folder / "round_trip_fuzz" / std::to_string(seed), static_cast<uint8_t>(random.below(256)), bytes);
}

}  // namespace
}  // namespace maille::fuzzing

int main(int count, char** arguments) {
  using namespace maille;
  if (count != 2 && count != 3) return 2;
  const uint64_t every = count == 3 ? std::max(1ul, std::strtoul(arguments[2], nullptr, 10)) : 1;
  for (uint64_t seed = 0; seed < 300; seed += every) {
    testing::RandomMeshOptions options;
    options.faces = seed % 4 == 0 ? 60 : 15;
    options.arrays = seed % 2 == 0;
    options.other_cells = seed % 3 == 0;
    const Mesh mesh = testing::random_surface(seed, options);
    fuzzing::save_file(arguments[1], seed, mesh);
    fuzzing::save_topology(arguments[1], seed, mesh);
    fuzzing::save_fans(arguments[1], seed, mesh);
    fuzzing::save_round_trip(arguments[1], seed);
    if (seed < 100) fuzzing::save_charts(arguments[1], seed, mesh);
    if (seed < 80) fuzzing::save_stream(arguments[1], seed, testing::random_volume(seed));
    if (seed < 60) fuzzing::save_foreign(arguments[1], seed, mesh);
    if (seed < 20) fuzzing::save_foreign(arguments[1], 1000 + seed, testing::random_volume(seed));
  }
  return 0;
}
