#pragma once

#include <maille/executor.h>
#include <maille/limits.h>
#include <maille/mesh.h>
#include <maille/source.h>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace maille {

/// A mesh without its large parts: what a file says of itself.
struct MeshDescription {
  struct Block {
    std::string name;
    CellType type = CellType::mixed;  ///< mixed also where the file does not tell
    uint64_t cells = 0;
  };
  uint64_t points = 0;
  uint64_t cells = 0;
  uint64_t corners = 0;  ///< entries of the connectivity
  Scalar point_type = Scalar::f32;
  std::vector<Block> blocks;       ///< one after the other; their cells add up
  std::vector<Array> arrays;       ///< on points and cells, without values
  std::vector<Array> mesh_arrays;  ///< on the mesh, with values
  /// Of all polyhedra together; for sinks.
  struct Polyhedra {
    uint64_t cells = 0;
    uint64_t faces = 0;
    uint64_t corners = 0;  ///< of the faces
    uint64_t points = 0;   ///< each point once for each polyhedron
  };
  Polyhedra polyhedra;
  /// Cells by type, ascending; empty where it is not known. For sinks.
  std::vector<std::pair<CellType, uint64_t>> types;
  std::vector<std::pair<std::string, std::string>> metadata;

  uint64_t count_of(const Array& array) const { return array.domain == Domain::point ? points : cells; }
};

/// Cells that follow each other.
struct CellPiece {
  std::vector<uint8_t> types;
  std::vector<uint64_t> offsets;       ///< one more than cells, first 0
  std::vector<uint64_t> connectivity;  ///< of polyhedra the corners of their faces
  /// If there are polyhedra, as CellBlock has them; otherwise both empty.
  std::vector<uint32_t> face_sizes;
  std::vector<uint64_t> cell_faces;

  uint64_t size() const { return types.size(); }
};

/// A mesh in a file of any size, read a part at a time; memory is that of the part, of a block of compressed
/// data for each array, and of the file's description. Asked by one thread at a time. Errors: those of
/// reading the file; usage, for more than description() says there is, or room of another size.
class MeshSource {
 public:
  virtual ~MeshSource() = default;
  virtual const MeshDescription& description() const = 0;
  /// Positions of points first ... first + count - 1 into `out`, which has room for exactly these.
  [[nodiscard]] virtual Result<> read_points(uint64_t first, uint64_t count, std::span<std::byte> out) = 0;
  /// Cells first ... first + count - 1; what was in `out` is replaced.
  [[nodiscard]] virtual Result<> read_cells(uint64_t first, uint64_t count, CellPiece& out) = 0;
  /// Tuples of description().arrays[array].
  [[nodiscard]] virtual Result<> read_array(size_t array, uint64_t first, uint64_t count,
                                            std::span<std::byte> out) = 0;
  /// As ReadResult has them.
  virtual std::vector<std::string> notes() const { return {}; }
};

/// Opens a file for reading in parts. Today: VTU with raw appended data, plain or compressed, without
/// polyhedra; binary Gmsh files (2.x, 4.1) whose nodes are numbered from 1 on, without periodic or partial
/// data; binary PLY files of points without lists, then faces with no other list than their corners. Other
/// files are unsupported, see read_mesh(). `source` must outlive the result.
[[nodiscard]] Result<std::unique_ptr<MeshSource>> open_mesh_source(const Source& source,
                                                                   const Limits& limits = {});

/// What opening a mesh in parts may use.
struct PartsOptions {
  uint64_t memory = uint64_t{32} << 20;  ///< bytes, about
  /// Where temporary files are; they have no names. Empty: $TMPDIR, or /tmp.
  std::string folder;
  Progress progress;
};
/// OpenFOAM's polyMesh: its folder, a file in it, or a case. Faces are sorted by cell in temporary files
/// while it is opened; they take about as much room as the mesh. Error: unsupported for packed files.
[[nodiscard]] Result<std::unique_ptr<MeshSource>> open_polymesh_source(const std::string& path,
                                                                       const PartsOptions& options = {});

/// A mesh written a part at a time, in any order except that cells follow each other (see mesh_sink()).
/// Errors: write_failed; usage, for more than was described.
class MeshSink {
 public:
  virtual ~MeshSink() = default;
  [[nodiscard]] virtual Result<> write_points(uint64_t first, Bytes positions) = 0;
  /// The cells behind those written before.
  [[nodiscard]] virtual Result<> write_cells(const CellPiece& cells) = 0;
  [[nodiscard]] virtual Result<> write_array(size_t array, uint64_t first, Bytes tuples) = 0;
  /// Makes the file durable and visible; an error when points, cells or corners are not as many as described.
  /// Without it, nothing appears under the final name.
  [[nodiscard]] virtual Result<> commit() = 0;
  /// After commit(): what the format could not hold, as of write_mesh().
  virtual std::vector<std::string> notes() const { return {}; }
};

struct MeshSinkOptions {
  bool ascii = false;  ///< text instead of binary
  /// Where temporary files are, for formats that need them. Empty: $TMPDIR, or /tmp.
  std::string folder;
  uint64_t memory = uint64_t{32} << 20;  ///< bytes, about, for formats that have to sort
};

/// A VTU file with raw appended data, each array in its place from the beginning.
[[nodiscard]] Result<std::unique_ptr<MeshSink>> vtu_sink(const std::string& path,
                                                         const MeshDescription& description);
/// The sink of a format by its name: "vtu", "msh" or "polymesh" (`path` as polymesh_sink() has it; through
/// temporary files, its faces sorted there; the files are those of write_mesh()). Binary Gmsh files of
/// version 2.2 are written in place (values of cells before their cells), where the mesh came in one and all
/// its types of cells are known; others go through temporary files as large as the mesh. Errors: usage for
/// other formats; unsupported where only write_mesh() can write it.
[[nodiscard]] Result<std::unique_ptr<MeshSink>> mesh_sink(const std::string& path, const std::string& format,
                                                          const MeshDescription& description,
                                                          const MeshSinkOptions& options = {});

}  // namespace maille
