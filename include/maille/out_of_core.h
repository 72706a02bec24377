#pragma once

#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/mesh_source.h>
#include <maille/stream.h>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

// Meshes that are larger than memory, from file to file. Volumes: MeshSource -> .maille of mode `stream` ->
// MeshSink. Surfaces: MeshSource -> .maille of mode `random`, of which any part can be extracted.

namespace maille {

/// What a job may use.
struct WorkingSpace {
  /// Bytes, about, besides the points and cells that are in use at once in a stream.
  uint64_t memory = uint64_t{32} << 20;
  /// Mode `stream`: how many bytes the process may take in all, about. A mesh that needs more is refused
  /// before anything is written, and the error says how much would do. Finding that out takes another pass
  /// over the cells, which is made only if the limit may be exceeded.
  uint64_t limit = ~uint64_t{0};
  /// The part of the limit that does not grow with the mesh, about: the program, models and blocks of cells
  /// (14 to 24 MB were measured, efforts 2 to 9).
  static constexpr uint64_t of_process = uint64_t{25} << 20;
  /// Where temporary files are; they have no names, and are gone when the process ends, however that ends.
  /// Empty: $TMPDIR, or /tmp.
  std::string folder;
  /// StreamOptions::delay of what encode() writes; only with Order::canonical.
  uint64_t delay = 0;
};

/// Compresses a mesh that is read in parts, as encode() does a mesh in memory: a first pass, backwards,
/// finds the last use of each point, a second one codes. `options.order` keep: the same bytes as for the mesh
/// in memory, if its numbers are such that some ten thousand tell how all are written, and its cells come in
/// an order that they do not have apart in memory (StreamDescription::order_apart). canonical: cells come as
/// they do, points in the order in which cells meet them; reordered() goes before where cells are in no
/// order. Errors: those of encode(), of the source, write_failed, memory_bound.
///
/// Mode `stream` with `options.most_cells_per_part`: in pieces (VolumeFile). Cells are distributed to pieces
/// of space in temporary files, which take some ten bytes a hexahedron, and a few pieces are in memory at
/// once. The bytes are those of the mesh in memory up to two million cells; cuts of larger ones are found by
/// a sample. `space` as above, and some 250 bytes for each cell of the pieces that are coded at once.
///
/// Mode `random`: one block of triangles, quads or polygons, arrays of points and cells, either order. The
/// levels are built as in memory, but a window at a time; the file is the same for any memory and executor.
/// `space.memory` is for all of it: 96 MB, two bytes a point, and 100 MB for each window that is worked on at
/// once; with less than that for one the error is memory_bound. A few dozen bytes a face go to temporary
/// files.
[[nodiscard]] Result<EncodeReport> encode(MeshSource& mesh, Sink& sink, const EncodeOptions& options,
                                          const WorkingSpace& space = {});

/// A mesh that arrives once, from front to back, as from a pipe or a generator. It goes to temporary files
/// and can be read in parts when it is complete. It takes what StreamWriter takes, in the same calls.
class MeshSpool {
 public:
  /// Of `options` positions, arrays, arrays of the mesh and metadata count; of `space` the folder. Error:
  /// write_failed.
  [[nodiscard]] static Result<MeshSpool> create(const StreamOptions& options, const WorkingSpace& space = {});
  MeshSpool(MeshSpool&&) noexcept;
  ~MeshSpool();

  /// Numbers may come in any order, each once; in the end there must be no gaps.
  [[nodiscard]] Result<> add_points(uint64_t first, Bytes positions, std::span<const Bytes> arrays = {});
  [[nodiscard]] Result<> add_points(std::span<const uint64_t> numbers, Bytes positions,
                                    std::span<const Bytes> arrays = {});
  [[nodiscard]] Result<> begin_block(std::string name, CellType type);
  [[nodiscard]] Result<> add_cells(CellType type, std::span<const uint64_t> connectivity,
                                   std::span<const uint8_t> last_use = {}, std::span<const Bytes> arrays = {},
                                   size_t nodes = 0);
  [[nodiscard]] Result<> add_polyhedron(std::span<const uint32_t> face_sizes,
                                        std::span<const uint64_t> connectivity,
                                        std::span<const uint8_t> last_use = {},
                                        std::span<const Bytes> arrays = {});
  /// Does nothing, since all points stay. It exists for code that writes to either a StreamWriter or a spool.
  [[nodiscard]] Result<> end_points(std::span<const uint64_t>) { return {}; }

  /// The complete mesh. Nothing can be added afterwards. Errors: malformed_input, write_failed.
  [[nodiscard]] Result<std::unique_ptr<MeshSource>> finish();

 private:
  class Implementation;
  explicit MeshSpool(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

/// Estimates how many bits a cell the order of the cells costs, from some ten thousand cells at the
/// beginning. Meshes that were written in sweeps stay below 2.
[[nodiscard]] Result<double> incoherence(MeshSource& mesh);

/// The same mesh with the cells of each block in an order that streams well: in pieces that fit into memory,
/// along a space-filling curve, and within each piece as the front meets them. Points and their values stay
/// as they are and are read from `mesh`, which must outlive the result; cells and their values are in
/// temporary files. Errors: those of the source, write_failed, cancelled.
[[nodiscard]] Result<std::unique_ptr<MeshSource>> reordered(MeshSource& mesh, const WorkingSpace& space = {},
                                                            const Progress& progress = {});

/// What a file of mode `stream` holds: sizes, blocks, arrays (those of `options.arrays`). Error: unsupported
/// for other modes, corrupt when its end is missing.
[[nodiscard]] Result<MeshDescription> describe(const Source& source, const DecodeOptions& options = {});
/// Decompresses a file of mode `stream` into a sink that was made for its description() with the same
/// options, and commits it. Memory holds the points in use and a bit for each point. Of a file in pieces,
/// several pieces are in memory at once, and what does not come in the order of the mesh goes through
/// temporary files in `space.folder`.
[[nodiscard]] Result<> decode(const Source& source, MeshSink& sink, const DecodeOptions& options = {},
                              const WorkingSpace& space = {});

}  // namespace maille
