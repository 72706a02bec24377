#pragma once

#include <maille/encode.h>
#include <maille/limits.h>
#include <maille/mesh.h>
#include <maille/source.h>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace maille {

/// One chunk of a .maille file, as listed by its index or found by scanning.
struct ChunkInfo {
  std::string type;  ///< four letters: docs/format.md, 11, 16 and 17
  uint64_t id = 0;
  uint64_t offset = 0;  ///< of the chunk's header
  uint64_t size = 0;    ///< of its content
};

/// One array as described by the file, without its values.
struct ArrayInfo {
  std::string name;
  Domain domain = Domain::point;
  Scalar type = Scalar::f32;
  uint32_t components = 1;
  Role role = Role::none;
  uint64_t count = 0;
  uint64_t coded_bytes = 0;
  bool lossless = true;
  Tolerance asked;  ///< what the encoder was asked for; lossless also where the bound was finer than the type
  double bound = 0;          ///< largest error promised; 0 when lossless
  double maximum_error = 0;  ///< mode stream: the largest one there is, measured by the encoder
  double step = 0;           ///< lattice step; 0 when there is none
  /// Mode stream: least and largest value of each component as they were compressed, as doubles; one pair for
  /// all components where there are more than 16; least > largest where no component is a number.
  std::vector<std::pair<double, double>> ranges;
  uint64_t nans = 0;  ///< values that are NaN, which `ranges` leave out
};

/// Values of a later time, behind the mesh (append_step()).
struct StepInfo {
  double time = 0;
  std::vector<std::string> arrays;
  std::vector<double> maximum_errors;  ///< by array, measured by the encoder
  uint64_t coded_bytes = 0;
  bool repeats_mesh = false;  ///< as StreamStep has it
};

/// What a .maille file says about itself.
struct FileInfo {
  unsigned format_major = 0;
  unsigned format_minor = 0;
  Mode mode = Mode::single;
  int effort = 0;
  Order order = Order::canonical;
  uint64_t file_bytes = 0;
  uint64_t points = 0;
  uint64_t cells = 0;
  uint64_t corners = 0;
  uint64_t parts = 1;                                    ///< coded by themselves
  std::vector<std::pair<std::string, uint64_t>> blocks;  ///< "name (type)" and number of cells
  /// Cells by type, also of mixed blocks; rising.
  std::vector<std::pair<CellType, uint64_t>> types;
  uint64_t most_points_in_use = 0;  ///< at once, in a stream; 0: not known
  uint64_t decode_bytes = 0;        ///< of memory that decoding a stream in pieces takes, about
  /// Mode random: of each level of detail, the mesh itself first.
  std::vector<uint64_t> faces_of_level;
  std::vector<uint32_t> charts_of_level;
  std::vector<double> view_error_of_level;  ///< the largest quadric error, in units of the mesh
  std::vector<double> bound_of_level;       ///< no point of the mesh is farther from this level
  ArrayInfo connectivity;                   ///< count: corners
  ArrayInfo positions;
  std::vector<ArrayInfo> arrays;
  std::optional<double> time;   ///< of step 0, if the file tells
  std::vector<StepInfo> steps;  ///< the first one is step 1
  std::vector<std::pair<std::string, std::string>> metadata;
  std::string provenance;
  std::vector<ChunkInfo> chunks;
  /// What is missing or damaged as far as the chunks' headers show, one sentence each; see verify_checksums()
  /// for the rest.
  std::vector<std::string> problems;
};

/// Of which mode a file is, by its first bytes. Errors: cannot_read, unsupported, corrupt.
[[nodiscard]] Result<Mode> mode_of(const Source& source);
/// Whether the source begins as .maille files do. False also where it cannot be read.
[[nodiscard]] bool is_maille(const Source& source);

/// Reads header, index and description; decodes no values. `limits`: what names, labels and metadata may
/// take. Errors as decode().
[[nodiscard]] Result<FileInfo> inspect(const Source& source, const Limits& limits = {});

/// A time of a file: that of a step, 0 for what the mesh came with.
struct FileTime {
  uint64_t step = 0;
  double time = 0;
};
/// A file as a series of times, in the order of its steps. What the mesh came with is a time of its own
/// unless a step has the same time; where its time is not told, it is 0 if the steps come later and the first
/// one does not repeat it, and otherwise of no time, as that of a mesh without values is. Empty: one mesh of
/// no known time.
std::vector<FileTime> times_of(const FileInfo& info);

/// Checks every checksum of the file. The result lists what is damaged, one sentence each; empty: all is
/// well. Error: cannot_read, or corrupt when not even the header can be made out.
[[nodiscard]] Result<std::vector<std::string>> verify_checksums(const Source& source);

}  // namespace maille
