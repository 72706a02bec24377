// Writes what the encoder makes of many meshes, and what the decoder makes of that, as files into a folder:
// scripts/check-determinism compares the folders of several compilers.
#include <maille/decode.h>
#include <maille/encode.h>

#include <cstdio>
#include <string>
#include <vector>

#include "support/random_mesh.h"
#include "support/shapes.h"

namespace maille::testing {
namespace {

bool write_file(const std::string& path, const std::vector<std::byte>& bytes) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) return false;
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  return std::fclose(file) == 0 && written;
}

template <class T>
void append_values(std::vector<std::byte>& all, const Buffer<T>& values) {
  const auto bytes = std::as_bytes(std::span(values));
  all.insert(all.end(), bytes.begin(), bytes.end());
}

std::vector<std::byte> contents(const Mesh& mesh) {
  std::vector<std::byte> all = mesh.points.bytes.vector();
  for (const CellBlock& block : mesh.blocks) append_values(all, block.connectivity);
  for (const Array& array : mesh.arrays) append_values(all, array.bytes);
  return all;
}

bool write_pair(const std::string& path, const Mesh& mesh, const EncodeOptions& options) {
  // The input too: when it differs, neither encoder nor decoder is to blame.
  if (!write_file(path + ".input", contents(mesh))) return false;
  std::vector<std::byte> bytes;
  const auto report = encode(mesh, *memory_sink(bytes), options);
  if (!report || !write_file(path + ".maille", bytes)) return false;
  const auto decoded = decode(*memory_source(Bytes(bytes)));
  return decoded && write_file(path + ".decoded", contents(*decoded));
}

std::vector<EncodeOptions> all_options(const Mesh& mesh) {
  using Kind = Tolerance::Kind;
  std::vector<EncodeOptions> all(1);
  for (const Tolerance tolerance :
       {Tolerance{Kind::bits, 12}, Tolerance{Kind::absolute, 0.003}, Tolerance{Kind::relative, 1e-4}}) {
    EncodeOptions& lossy = all.emplace_back();
    lossy.positions = tolerance;
    for (const Array& array : mesh.arrays) {
      if (array.role != Role::label) lossy.arrays[array.name] = tolerance;
    }
  }
  all.emplace_back().order = Order::keep;
  for (const int effort : {1, 2, 7, 9}) all.emplace_back().effort = effort;
  all.emplace_back().most_cells_per_part = 20;
  return all;
}

bool write_all(const std::string& folder) {
  std::vector<Mesh> meshes = {tetrahedron(), cube(),         torus(40, 25),
                              grid(30, 20),  sphere(24, 16), moebius(20, 3)};
  for (uint64_t seed = 0; seed < 150; ++seed)
    meshes.push_back(random_surface(seed, {.other_cells = seed % 3 == 0}));
  for (size_t i = 0; i < meshes.size(); ++i) {
    const auto options = all_options(meshes[i]);
    for (size_t k = 0; k < options.size(); ++k) {
      const std::string name = std::to_string(i) + "-" + std::to_string(k);
      if (write_pair(folder + "/" + name, meshes[i], options[k])) continue;
      std::fprintf(stderr, "mesh %s: failed\n", name.c_str());
      return false;
    }
  }
  return true;
}

}  // namespace
}  // namespace maille::testing

int main(int count, char** arguments) {
  if (count != 2) {
    std::fputs("usage: determinism FOLDER\n", stderr);
    return 2;
  }
  return maille::testing::write_all(arguments[1]) ? 0 : 1;
}
