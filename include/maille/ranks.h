#pragma once

#include <maille/encode.h>
#include <maille/mesh.h>
#include <maille/source.h>
#include <maille/stream.h>

#include <cstdint>
#include <span>
#include <vector>

namespace maille {

/// A mesh that several processes hold together becomes one file in pieces. The library knows no MPI:
/// whoever has it implements Ranks and RanksFile (bindings/mpi does). docs/mpi.md shows it in use.

/// Processes that work together. All must make the same calls in the same order.
class Ranks {
 public:
  virtual ~Ranks() = default;
  /// From 0 to size() - 1.
  virtual unsigned rank() const = 0;
  virtual unsigned size() const = 0;
  /// Sends `to[r]` to rank r, for all size() ranks, and returns what each rank sent here.
  virtual std::vector<std::vector<std::byte>> exchange(std::vector<std::vector<std::byte>> to) = 0;
  /// Adds the numbers of all ranks at each place, mod 2^64; all ranks get the sums.
  virtual void add(std::span<uint64_t> numbers) = 0;
  /// The largest number of all ranks at each place.
  virtual void largest(std::span<uint64_t> numbers) = 0;
};

/// A file that all ranks write together. All ranks make the same calls in the same order, and all get an
/// error if one of them fails.
class RanksFile {
 public:
  virtual ~RanksFile() = default;
  struct Part {
    uint64_t offset = 0;
    Bytes bytes;
  };
  /// Writes the parts of all ranks of a file of `size` bytes, durably. Called once for a new file. For a step
  /// that is appended it is called twice: what stands in the file stays, and the end comes last.
  [[nodiscard]] virtual Result<> write(std::span<const Part> parts, uint64_t size) = 0;
  /// Makes the file durable and gives it its name; without it there is none.
  [[nodiscard]] virtual Result<> commit() = 0;
};

/// The part of a mesh that one rank has. It may be empty.
struct RankPart {
  /// Cells that are this rank's alone (no ghosts) and the points they use. All ranks have the same arrays of
  /// points and cells, in the same order; arrays of the mesh and metadata are those of the first rank that
  /// has points. Blocks of one name and type are one block; where no rank has more than one and their names
  /// are equal, all are.
  const Mesh* mesh = nullptr;
  /// By point, its number in the whole mesh. A point that several ranks have has one number, and the same
  /// values in all of them. Numbers may have gaps.
  std::span<const uint64_t> point_ids;
  /// By cell, through all blocks of the part: no two cells of all ranks have the same.
  std::span<const uint64_t> cell_ids;
};

struct RanksOptions {
  /// Pieces of about so many cells, cut from the whole mesh, whoever has its cells: the file is the one that
  /// encode() makes of the whole mesh in the order of the numbers, byte for byte, for any number of ranks.
  /// (Of arrays beyond `sample_bytes` samples decide how numbers are written; then the file depends on the
  /// mesh alone, too, but encode() may write others.)
  uint64_t cells_per_piece = cells_of_volume_piece;
  /// The part of each rank becomes a piece as it is, and only the numbers of points are exchanged. The file
  /// then depends on how the mesh is divided.
  bool as_is = false;
  uint64_t sample_bytes = uint64_t{256} << 20;
};

/// Compresses the mesh of all ranks into one file of mode stream and commits it. `options` and `how` must be
/// the same in all ranks. All ranks get the report, or the same error: that of the first rank that has one,
/// naming it. Errors: as encode(); malformed_input for numbers that do not fit, and for parts with different
/// arrays.
///
/// Memory of a rank: some 100 bytes for each of its points and cells beside the mesh; of the first one 40
/// bytes for each time that a piece has a point in common with others.
[[nodiscard]] Result<EncodeReport> encode(const RankPart& part, Ranks& ranks, RanksFile& file,
                                          const EncodeOptions& options = {}, const RanksOptions& how = {});

/// Appends a step of time to a file in pieces that keeps the order: each rank codes its share of the pieces,
/// and all write at once. The bytes are those of append_step() for the whole mesh, for any number of ranks
/// (but for arrays beyond `sample_bytes`, as above). The part is that of encode(), with the arrays of this
/// time; the numbers of points and cells must be those that the file was written with, or rise in the same
/// order. `before` is the file so far, read by all ranks; `file` writes to it. Of `options`, bounds of arrays
/// and the executor count. All ranks get the report, or the same error. Errors: as append_step() and
/// encode().
[[nodiscard]] Result<StepReport> append_step(const Source& before, double time, const RankPart& part,
                                             Ranks& ranks, RanksFile& file, const EncodeOptions& options = {},
                                             const RanksOptions& how = {});

}  // namespace maille
