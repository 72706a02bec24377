#pragma once

#include <maille/encode.h>
#include <maille/executor.h>
#include <maille/limits.h>
#include <maille/mesh.h>
#include <maille/source.h>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

// Meshes of any size in one pass, with memory for the front of the sweep only: what a solver or a mesher
// writes, and a reader takes in portions, also from a pipe. Points and cells have numbers of 64 bits.
// docs/streaming.md shows it in use.

namespace maille {

/// One array of a stream, declared before the first point.
struct StreamArray {
  std::string name;
  Domain domain = Domain::point;  ///< point or cell
  Scalar type = Scalar::f32;
  uint32_t components = 1;
  Role role = Role::none;
  std::vector<std::string> labels;
  Tolerance tolerance;
  /// Least and largest value to come; bounds of kind `relative` and `bits` need it. Values outside are kept
  /// all the same, and cost more.
  std::optional<std::pair<double, double>> range;

  size_t tuple_size() const { return size_of(type) * components; }
};

/// Gives the values of points by their numbers: an input that can be read at any place, such as a file. One
/// thread asks at a time, but not always the same one, while calls of the writer are under way.
class PointSource {
 public:
  virtual ~PointSource() = default;
  /// Writes the position of a point, then its tuple of each point array as declared, one after the other.
  [[nodiscard]] virtual Result<> read(uint64_t number, std::byte* out) = 0;
};

struct StreamOptions {
  StreamArray positions{"position", Domain::point, Scalar::f32, 3, Role::none, {}, {}, {}};
  std::vector<StreamArray> arrays;  ///< their names differ within a domain
  std::vector<Array> mesh_arrays;   ///< arrays of the mesh as a whole (Domain::mesh), with their values
  std::vector<std::pair<std::string, std::string>> metadata;
  std::string provenance;
  int effort = 5;  ///< 1 (fast) to 9 (small)
  /// Points are numbered in the order in which cells meet them. Cells keep their order.
  bool any_order = false;
  /// So many cells are held back and written in an order in which they cost less. This is for input in a poor
  /// order, such as an unstructured mesh along a curve; it needs any_order, and some hundred bytes a cell.
  uint64_t delay = 0;
  /// Where values of points come from, if not from add_points(). Must outlive the writer.
  PointSource* points = nullptr;
  /// A batch ends and goes to the sink after so many cells or about so many bytes.
  uint32_t most_cells_per_batch = 1u << 19;
  uint32_t bytes_per_batch = 192u << 10;
  Executor* executor = nullptr;     ///< nullptr: serial
  std::optional<double> time = {};  ///< of the values, finite; that of step 0
};

/// What was written; bytes by what they hold.
struct StreamReport {
  uint64_t points = 0;
  uint64_t cells = 0;
  uint64_t corners = 0;
  uint64_t file_bytes = 0;
  uint64_t cell_bytes = 0;    ///< how cells are joined, and which points end
  uint64_t number_bytes = 0;  ///< the input's numbers of points
  uint64_t position_bytes = 0;
  std::vector<uint64_t> array_bytes;  ///< by array, as declared
  std::vector<double> errors;         ///< the largest error of positions, then of each array, after decoding
  uint32_t most_live_points = 0;      ///< in memory at once: what decides a reader's memory
  uint32_t most_live_cells = 0;
};

struct ArrayMapsList;  // the library's own

/// Compresses a mesh while it arrives.
///
/// Points come before the first cell that uses them. A point leaves memory after the last cell that uses it,
/// if the writer is told which cell that is; otherwise the result is the same, but memory grows with the
/// mesh. The sink must outlive the writer.
class StreamWriter {
 public:
  /// Error: usage (the options), write_failed.
  [[nodiscard]] static Result<StreamWriter> begin(Sink& sink, StreamOptions options);
  StreamWriter(StreamWriter&&) noexcept;
  ~StreamWriter();

  /// Points with the numbers first, first + 1, ...: `positions` and, array by array in the order of their
  /// declaration, the tuples of all arrays on points. Error: usage, for sizes that do not fit or a number
  /// that is there already.
  [[nodiscard]] Result<> add_points(uint64_t first, Bytes positions, std::span<const Bytes> arrays = {});
  /// The same with any numbers.
  [[nodiscard]] Result<> add_points(std::span<const uint64_t> numbers, Bytes positions,
                                    std::span<const Bytes> arrays = {});

  /// Cells from here on belong to a new block. `type` is a cell type, `polygon`, or `mixed` for any. Without
  /// it there is one block without a name, of type mixed.
  [[nodiscard]] Result<> begin_block(std::string name, CellType type);

  /// Cells of one type, `nodes` numbers of points each (0: as the type has), and array by array the tuples of
  /// all arrays on cells. `last_use`: one flag for each entry of `connectivity`, not 0 where the point is not
  /// used again by any cell; may be empty. Errors: malformed_input (a point that was not given, or used after
  /// its last use; number of nodes), usage.
  [[nodiscard]] Result<> add_cells(CellType type, std::span<const uint64_t> connectivity,
                                   std::span<const uint8_t> last_use = {}, std::span<const Bytes> arrays = {},
                                   size_t nodes = 0);
  /// One polyhedron: the number of corners of each face, and the points of these corners, face after face.
  [[nodiscard]] Result<> add_polyhedron(std::span<const uint32_t> face_sizes,
                                        std::span<const uint64_t> connectivity,
                                        std::span<const uint8_t> last_use = {},
                                        std::span<const Bytes> arrays = {});
  /// Points that no further cell uses, told after the fact.
  [[nodiscard]] Result<> end_points(std::span<const uint64_t> numbers);

  /// Writes what was given so far, so that a reader at the other end of a pipe gets it.
  [[nodiscard]] Result<> flush();
  /// Writes points that no cell used, the index, and commits the sink.
  [[nodiscard]] Result<StreamReport> finish();

 private:
  class Implementation;
  friend Result<StreamWriter> begin_with_maps(Sink& sink, StreamOptions options, const ArrayMapsList& maps);
  explicit StreamWriter(std::unique_ptr<Implementation> implementation);
  [[nodiscard]] static Result<StreamWriter> begin(Sink& sink, StreamOptions options,
                                                  const ArrayMapsList& maps);
  std::unique_ptr<Implementation> implementation_;
};

/// One step of time: values on the points and cells of the mesh that a file holds.
struct StreamStep {
  double time = 0;
  std::vector<StreamArray> arrays;
  std::vector<double> errors;  ///< the largest of each array, measured by the encoder
  uint64_t coded_bytes = 0;
  /// All arrays of the mesh are those of step 0. Not known, and false, of a file in pieces.
  bool repeats_mesh = false;
};

/// Gives the values of a step.
class StepSource {
 public:
  virtual ~StepSource() = default;
  /// Writes the tuple of an array, as declared, for a point by its number or a cell by its place.
  [[nodiscard]] virtual Result<> read(size_t array, uint64_t number, std::byte* out) = 0;
};

struct StepOptions {
  double time = 0;  ///< finite
  std::vector<StreamArray> arrays;
  /// What is to be the metadata of the mesh at this time; without a value: what it came with.
  std::optional<std::vector<std::pair<std::string, std::string>>> metadata = {};
  Limits limits;  ///< of what is held at once
  Executor* executor = nullptr;
};

struct StepReport {
  uint64_t number = 0;  ///< of the step
  uint64_t file_bytes = 0;
  std::vector<uint64_t> array_bytes;
  std::vector<double> errors;  ///< the largest of each array, after decoding
};

/// Appends a step to a file of mode stream that keeps the order of its points. Steps are counted from 1; what
/// the mesh was compressed with is step 0. Arrays that keep their bound with the values of step 0 or of the
/// step before take no room. Others may be coded as differences to the step before, except in every sixteenth
/// step, so that no step needs more than the fifteen before it. The existing bytes are not touched: until the
/// whole step is written, and also after a crash, the file reads as it did before. Errors: usage,
/// cannot_read, corrupt, write_failed.
[[nodiscard]] Result<StepReport> append_step(const std::string& path, const StepOptions& options,
                                             StepSource& values);
/// The arrays on points and cells of a mesh in memory, which must have as many points and cells, in the order
/// in which the file has them, and its metadata, if it has any. Of `options`, bounds of arrays and the
/// executor count.
[[nodiscard]] Result<StepReport> append_step(const std::string& path, double time, const Mesh& mesh,
                                             const EncodeOptions& options = {});
/// Takes away the last step by cutting the file back to where it ended before. Nothing else of it changes,
/// and after a crash the step is there or not. The value: its number, and the bytes that are left. Errors:
/// usage (there is no step), unsupported (of a file by another program), cannot_read, corrupt, write_failed.
[[nodiscard]] Result<StepReport> remove_last_step(const std::string& path);
/// The steps behind a mesh, beginning with step 1; empty for other modes. `search`: if the end of a large
/// file is damaged, the whole file is searched; otherwise that is an error. `limits`: what their names and
/// metadata may take. Errors: cannot_read; memory_bound; corrupt, also if anything else of the file is
/// missing, since it may be a step.
[[nodiscard]] Result<std::vector<StreamStep>> list_steps(const Source& source, bool search = true,
                                                         const Limits& limits = {});

/// Some thousand cells, and the points that appear with them.
///
/// Every point has its global number and a slot. A slot is a small number that no other point of the portion
/// has; it is free for another point after the portion in which the point ends. All slots are below
/// slot_count, so a reader that needs values of points of earlier portions keeps them in a table of that
/// size.
struct StreamPortion {
  struct Block {
    uint64_t first_cell = 0;  ///< counted from the begin of the stream
    std::string name;
    CellType type = CellType::mixed;
  };
  std::vector<Block> blocks;  ///< that begin in this portion

  uint64_t first_cell = 0;
  std::vector<CellType> types;         ///< by cell
  std::vector<uint64_t> offsets;       ///< size of types + 1
  std::vector<uint64_t> connectivity;  ///< numbers of points
  std::vector<uint32_t> slots;         ///< the same as slots
  /// If there are polyhedra, as CellBlock has them; otherwise both empty.
  std::vector<uint32_t> face_sizes;
  std::vector<uint64_t> cell_faces;
  std::vector<std::vector<std::byte>> cell_arrays;  ///< in the order of declaration, arrays on cells only

  std::vector<uint64_t> points;       ///< numbers of points that come up here
  std::vector<uint32_t> point_slots;  ///< by point
  std::vector<std::byte> positions;
  std::vector<std::vector<std::byte>> point_arrays;  ///< in the order of declaration, arrays on points only

  std::vector<uint32_t> ended_slots;  ///< points that no later portion uses
  uint32_t slot_count = 0;            ///< so far

  size_t cell_count() const { return types.size(); }
};

/// Bytes that can be read once, from front to back: a pipe or a socket.
class ByteStream {
 public:
  virtual ~ByteStream() = default;
  /// Reads at most out.size() bytes and returns how many; 0 only at the end. May wait.
  [[nodiscard]] virtual Result<size_t> read(std::span<std::byte> out) = 0;
  virtual std::string name() const = 0;
};
/// Standard input, or any open file descriptor; it is not closed.
std::unique_ptr<ByteStream> descriptor_stream(int descriptor, std::string name);
/// A Source from its begin; it must outlive the stream.
std::unique_ptr<ByteStream> source_stream(const Source& source);

/// An array whose values rise by one from element to element in the mesh's order, as numbers of points and
/// cells do. A run may begin with any value.
struct NumberedArray {
  struct Run {
    uint64_t count = 0;
    uint64_t first = 0;  ///< negative ones mod 2^64
  };
  size_t array = 0;  ///< its place in StreamDescription::arrays
  std::vector<Run> runs;
};

/// What is known before the first portion.
struct StreamDescription {
  StreamArray positions;
  std::vector<StreamArray> arrays;
  std::vector<NumberedArray> numbered;  ///< portions have 0 there if the order stands apart
  std::vector<Array> mesh_arrays;
  std::vector<std::pair<std::string, std::string>> metadata;
  std::string provenance;
  int effort = 5;
  bool any_order = false;
  /// The file holds the input's order apart from the cells, which are stored in another one. decode()
  /// restores it, portions cannot.
  bool order_apart = false;
  std::optional<double> time = {};  ///< of step 0, if the file tells
};

struct StreamReadOptions {
  Limits limits;  ///< of what the reader holds at once
  /// Take files whose order stands apart (StreamDescription::order_apart), too, in the order of their
  /// portions.
  bool any_order = false;
  Executor* executor = nullptr;
};

/// Decompresses a stream portion by portion. Safe on any input.
class StreamReader {
 public:
  /// Error: corrupt, unsupported, cannot_read.
  [[nodiscard]] static Result<StreamReader> open(std::unique_ptr<ByteStream> bytes,
                                                 const StreamReadOptions& options = {});
  /// The mesh with the arrays of one step, 0 for those it came with; the source must outlive the reader.
  /// Error: usage, too (there is no such step).
  [[nodiscard]] static Result<StreamReader> open(const Source& source, uint64_t step,
                                                 const StreamReadOptions& options = {});
  StreamReader(StreamReader&&) noexcept;
  ~StreamReader();

  const StreamDescription& description() const;
  /// The next portion, in `portion`. False: that was all, and every checksum was right. Error: corrupt; what
  /// came before it is whole, and nothing comes after it. After an error of kind `network`, which only a
  /// ByteStream gives, the same portion can be asked for again.
  [[nodiscard]] Result<bool> next(StreamPortion& portion);
  /// What the reader keeps in memory now, in bytes: the points that are used again, with their values, and
  /// models. Reaching limits.mesh_bytes is the error memory_bound.
  uint64_t memory() const;

 private:
  class Implementation;
  explicit StreamReader(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace maille
