#include "surface/patch_memory.h"

#include <algorithm>
#include <string>

#include "surface/parts/shared_points.h"

namespace maille {
namespace {

// Fitted to the peaks of 50 odd meshes (maille_scaling) of 51,200 to 204,800 elements at efforts 1, 5 and 9,
// and of the shared meshes at efforts 1 to 9: the least sums for usual triangles and quads that bound all of
// them with 8 MiB more. Usual meshes take a third to a half: fans without neighbours, whose points are as
// many as their corners, take most.
constexpr double fan_bytes_per_point = 97, fan_bytes_per_cell = 40, fan_bytes_per_corner = 1;
// Borders are closed by triangles: three half-edges for a corner that has no neighbour (14.1).
constexpr double front_bytes_per_point = 640;
// Names, shapes and lists of a block.
constexpr double bytes_per_block = 800;
// A number of an array is there as its bits, and as codes of up to 8 bytes, before it is in the mesh.
constexpr double bytes_per_number = 8;
constexpr double bytes_per_twin = 8;    // by corner
constexpr double bytes_per_place = 24;  // of points and cells in an order that is kept

double numbers_of(const Description& description, const ArrayDescription& array) {
  return static_cast<double>(description.tuples(array)) * array.components;
}

}  // namespace

double working_memory(const Description& patch, bool front) {
  const double points = patch.points, cells = static_cast<double>(patch.cells());
  const double corners = static_cast<double>(patch.corners);
  const double surface =
      front ? front_bytes_per_point * points
            : fan_bytes_per_point * points + fan_bytes_per_cell * cells + fan_bytes_per_corner * corners;
  double numbers = 0;
  for (const ArrayDescription& array : patch.arrays) numbers = std::max(numbers, numbers_of(patch, array));
  return surface + bytes_per_number * numbers + (patch.welded ? bytes_per_twin * corners : 0) +
         bytes_per_block * static_cast<double>(patch.blocks.size());
}

double joining_memory(const Description& whole) {
  double largest = 4 * static_cast<double>(whole.corners) + 8 * static_cast<double>(whole.cells());
  const auto add = [&](const ArrayDescription& array) {
    largest = std::max(largest, numbers_of(whole, array) * static_cast<double>(size_of(array.type)));
  };
  add(whole.positions);
  for (const ArrayDescription& array : whole.arrays) add(array);
  return largest + 8 * static_cast<double>(whole.points) +
         sizeof(CellBlock) * static_cast<double>(whole.blocks.size());
}

double ordering_memory(const Description& whole) {
  const double elements = static_cast<double>(whole.points) + static_cast<double>(whole.cells());
  return memory_of(whole) + bytes_per_place * elements;
}

void PatchesMemory::add_description(const Description& whole, unsigned copies) {
  meshes += copies * static_cast<double>(whole.memory + whole.block_memory());
}

// A patch has a description of its own while it is decoded, and the names and labels of its arrays
// afterwards.
void PatchesMemory::add_patch(const Description& patch, double bytes, bool front) {
  const auto described = static_cast<double>(patch.memory + patch.block_memory());
  meshes +=
      memory_of(patch) + bytes + described + sizeof(CellBlock) * static_cast<double>(patch.blocks.size());
  working = std::max(working, working_memory(patch, front) + described);
  points += patch.points;
}

// A point that k patches have is there k - 1 times too often, and in k lists, which are 2 (k - 1) at most.
void PatchesMemory::add_shared_points(double points_of_whole) {
  meshes += bytes_to_join * 2 * std::max(points - points_of_whole, 0.0);
}

void PatchesMemory::add_after(double bytes) {
  after = std::max(after, bytes);
}

Result<size_t> PatchesMemory::at_once(const Limits& limits) const {
  const auto allowed = static_cast<double>(limits.mesh_bytes);
  const double most = meshes + std::max(working, after);
  if (most > allowed) {
    return failure(ErrorCode::memory_bound,
                   "decoding takes up to " + std::to_string(static_cast<uint64_t>(most / 1048576) + 1) +
                       " MiB, more than the " + std::to_string(limits.mesh_bytes / 1048576) + " MiB allowed");
  }
  // More than any machine has threads; the division by nothing is none.
  constexpr double enough = 65536;
  return static_cast<size_t>(std::clamp((allowed - meshes) / std::max(working, 1.0), 1.0, enough));
}

}  // namespace maille
