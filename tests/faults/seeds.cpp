#include "faults/seeds.h"

#include <maille/file.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "support/codec.h"
#include "support/data.h"
#include "support/random_mesh.h"
#include "support/random_volume.h"

namespace maille::testing {
namespace {

void add_seed(std::vector<Seed>& seeds, const std::string& name, std::vector<std::byte> bytes) {
  Seed seed{name, std::move(bytes), Mode::single, {}};
  const auto source = memory_source(Bytes(seed.bytes), name);
  const auto mode = mode_of(*source);
  auto mesh = decode(*source);
  if (!mode || !mesh) return;
  seed.mode = *mode;
  seed.mesh = *std::move(mesh);
  seeds.push_back(std::move(seed));
}

}  // namespace

std::vector<std::byte> content(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(in), {});
  const Bytes bytes = std::as_bytes(std::span(text.data(), text.size()));
  return {bytes.begin(), bytes.end()};
}

std::vector<Seed> maille_seeds() {
  std::vector<Seed> seeds;
  for (const char* folder : {"single", "stream", "random"}) {
    const std::filesystem::path place = std::filesystem::path(tests_folder()) / "golden" / folder;
    std::vector<std::filesystem::path> paths;
    for (const auto& entry : std::filesystem::directory_iterator(place)) paths.push_back(entry.path());
    std::sort(paths.begin(), paths.end());
    for (const auto& path : paths) add_seed(seeds, path.filename().string(), content(path));
  }
  for (uint64_t number = 0; number < 30; ++number) {
    EncodeOptions options;
    options.mode = static_cast<Mode>(number % 3);
    options.effort = static_cast<int>(1 + number % 9);
    if (number % 4 == 1) options.order = Order::keep;
    if (number % 5 == 2) options.positions = {Tolerance::Kind::bits, 9};
    RandomVolumeOptions volume;
    volume.corner_arrays = false;
    RandomMeshOptions surface;
    surface.faces = 40;
    const Mesh mesh =
        options.mode == Mode::stream ? random_volume(number, volume) : random_surface(number, surface);
    if (auto file = encode_bytes(mesh, options))
      add_seed(seeds, "mesh " + std::to_string(number), file->bytes);
  }
  return seeds;
}

}  // namespace maille::testing
