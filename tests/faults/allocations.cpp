// Every allocation fails in turn, once and from then on: what is asked for then ends as std::bad_alloc, or
// goes well all the same, and nothing is left behind. allocations [STEP]: with a step of 7 every seventh of
// them.

#include <maille/file.h>
#include <maille/io.h>

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <new>

#include "faults/counting_memory.h"
#include "faults/entry_points.h"
#include "support/codec.h"
#include "support/random_mesh.h"
#include "support/random_volume.h"
#include "support/sample_mesh.h"

namespace maille::testing {
namespace {

struct Counts {
  uint64_t failed = 0, thrown = 0, went_well = 0, errors = 0, problems = 0;
};

enum class End { well, error, thrown };

End run_once(const std::function<bool()>& work) {
  try {
    return work() ? End::well : End::error;
  } catch (const std::bad_alloc&) {
    return End::thrown;
  }
}

/// One allocation after another fails, until all of the work needs fewer.
void sweep(const std::string& name, uint64_t step, const std::function<bool()>& work, Counts& counts) {
  // What is made once and kept is made before.
  if (run_once(work) != End::well || run_once(work) != End::well) {
    ++counts.problems;
    std::printf("%s: does not even go well with all memory\n", name.c_str());
    return;
  }
  watch_memory();
  run_once(work);
  const uint64_t allocations = memory().allocations;
  for (uint64_t at = 1; at <= allocations; at += step) {
    const uint64_t blocks = memory().blocks;
    watch_memory();
    fail_allocation(at, (at / step) % 4 == 3);
    const End end = run_once(work);
    fail_allocation(0);
    ++counts.failed;
    ++(end == End::thrown ? counts.thrown : end == End::well ? counts.went_well : counts.errors);
    if (memory().blocks != blocks) {
      ++counts.problems;
      std::printf("%s: allocation %llu of %llu fails, and %lld blocks are lost\n", name.c_str(),
                  static_cast<unsigned long long>(at), static_cast<unsigned long long>(allocations),
                  static_cast<long long>(memory().blocks - blocks));
    }
  }
}

Mesh mesh_for(Mode mode) {
  RandomVolumeOptions without_corners;
  without_corners.corner_arrays = false;
  if (mode == Mode::stream) return random_volume(5, without_corners);
  RandomMeshOptions small;
  small.faces = 40;
  return random_surface(7, small);
}

void sweep_codec(uint64_t step, Counts& counts) {
  static constexpr struct {
    Mode mode;
    const char* name;
  } modes[] = {{Mode::single, "single"}, {Mode::stream, "stream"}, {Mode::random, "random"}};
  for (const auto& [mode, mode_name] : modes) {
    for (const int effort : {1, 5, 9}) {
      const Mesh mesh = mesh_for(mode);
      EncodeOptions options;
      options.mode = mode;
      options.effort = effort;
      const std::string name = std::string(mode_name) + " -" + std::to_string(effort);
      const auto file = encode_bytes(mesh, options);
      if (!file) {
        ++counts.problems;
        std::printf("%s: %s\n", name.c_str(), file.error().message.c_str());
        continue;
      }
      sweep(
          "encode " + name, step * 3, [&] { return encode_bytes(mesh, options).has_value(); }, counts);
      sweep(
          "decode " + name, step, [&] { return decode_bytes(file->bytes).has_value(); }, counts);
      if (effort != 5) continue;
      sweep(
          "all questions to " + name, step * 3, [&] { return !ask_everything(file->bytes, {}).empty(); },
          counts);
    }
  }
}

void sweep_formats(uint64_t step, Counts& counts) {
  for (const FormatInfo& format : formats()) {
    // The library of JSON allocates in its destructors, so that nothing helps there. A folder needs files.
    const bool json = format.name == "gltf" || format.name == "glb";
    if (!format.writable || json || format.name == "polymesh") continue;
    std::vector<std::byte> bytes;
    const auto sink = memory_sink(bytes);
    const Mesh mesh = sample_mesh();
    WriteOptions options;
    options.format = format.name;
    const auto write = [&](Sink& to) { return write_mesh(mesh, to, options).has_value(); };
    if (!write(*sink)) continue;
    sweep(
        "write " + format.name, step * 3,
        [&] {
          std::vector<std::byte> again;
          return write(*memory_sink(again));
        },
        counts);
    sweep(
        "read " + format.name, step,
        [&] { return read_mesh(*memory_source(Bytes(bytes), "x" + format.extensions[0]), {}).has_value(); },
        counts);
  }
}

}  // namespace
}  // namespace maille::testing

int main(int count, char** arguments) {
  using namespace maille::testing;
  const uint64_t step = count > 1 ? std::strtoull(arguments[1], nullptr, 10) : 1;
  Counts counts;
  sweep_codec(step, counts);
  sweep_formats(step, counts);
  std::printf(
      "allocations that failed: %llu; std::bad_alloc %llu, an error %llu, well all the same %llu; problems "
      "%llu\n",
      static_cast<unsigned long long>(counts.failed), static_cast<unsigned long long>(counts.thrown),
      static_cast<unsigned long long>(counts.errors), static_cast<unsigned long long>(counts.went_well),
      static_cast<unsigned long long>(counts.problems));
  return counts.problems == 0 ? 0 : 1;
}
