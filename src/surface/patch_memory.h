#pragma once

#include <maille/limits.h>

#include <cstddef>
#include <cstdint>

#include "base/result.h"
#include "description/description.h"

namespace maille {

/// What decoding takes, held against the limits before anything is allocated by a claimed count. All in
/// bytes, and in doubles, as sums of claimed counts must not wrap around. The bounds below are of peaks that
/// were measured (docs/reliability.md); with 8 MiB more, which is what large pages waste, none was higher.

/// What one patch takes besides its mesh while it is decoded. `front`: its cells are coded by the front.
double working_memory(const Description& patch, bool front);

/// What joining patches takes besides their meshes: the largest array of the whole is there twice.
double joining_memory(const Description& whole);

/// What bringing a mesh into its kept order takes besides the mesh.
double ordering_memory(const Description& whole);

/// Patches that are decoded one by one or several at once, and what is made of them.
struct PatchesMemory {
  double meshes = 0;   ///< of all patches, with the bytes they are decoded from
  double working = 0;  ///< the most that one takes besides
  double after = 0;    ///< what joining and ordering take besides the meshes
  double points = 0;   ///< of all patches, shared ones once for each patch that has them

  /// `copies` of what the whole mesh is described by.
  void add_description(const Description& whole, unsigned copies);
  /// `bytes`: from which it is decoded.
  void add_patch(const Description& patch, double bytes, bool front);
  /// Where patches have more points together than the whole, lists say which of them are the same.
  void add_shared_points(double points_of_whole);
  void add_after(double bytes);
  /// Whether it is too much already. A few bytes may claim millions of patches: nobody has to look at the
  /// others then.
  bool is_over(const Limits& limits) const { return meshes > static_cast<double>(limits.mesh_bytes); }
  /// How many patches may be decoded at once; one at least. Error: memory_bound.
  Result<size_t> at_once(const Limits& limits) const;
};

}  // namespace maille
