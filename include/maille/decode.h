#pragma once

#include <maille/executor.h>
#include <maille/limits.h>
#include <maille/mesh.h>
#include <maille/source.h>
#include <optional>
#include <string>
#include <vector>

namespace maille {

struct DecodeOptions {
  Limits limits;
  /// Names of the arrays wanted; without a value: all. Positions and connectivity always come.
  std::optional<std::vector<std::string>> arrays;
  uint64_t step = 0;             ///< of time, in files of mode stream: 0 for what the mesh came with
  Executor* executor = nullptr;  ///< nullptr: serial
  Progress progress;
};

/// Decompresses a whole .maille file. Safe on any input: an error or a valid mesh (validate() holds), in
/// memory bounded by options.limits. Damage is found by checksums before decoding and reported with the
/// chunk's name and place. Errors: cannot_read, unsupported (another version), corrupt, memory_bound,
/// cancelled.
[[nodiscard]] Result<Mesh> decode(const Source& source, const DecodeOptions& options = {});

/// What could be had of a damaged file.
struct Salvaged {
  Mesh mesh;
  /// What is damaged; without a value the file is whole, and so is the mesh.
  std::optional<Error> damage;
};

/// Decompresses what is whole: of mode stream all cells before the first damage, of mode single the parts, of
/// mode random the charts, and the arrays that are whole in all of these. Values that are given are exact.
/// The mesh may differ in three more ways where mode single lost a stream (docs/format.md, 15.3): without
/// ORDR, or where parts are missing, the order is the file's; without JOIN, points of several parts at one
/// place become one; without TWIN, points that the encoder welded stay welded. `damage` also says what is
/// lost. Errors are those of decode(), but corrupt only if nothing is left.
[[nodiscard]] Result<Salvaged> salvage(const Source& source, const DecodeOptions& options = {});

}  // namespace maille
