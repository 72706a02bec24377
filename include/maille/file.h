#pragma once

#include <maille/encode.h>
#include <maille/mesh.h>
#include <maille/source.h>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace maille {

/// One chunk of a .maille file, as listed by its index or found by scanning.
struct ChunkInfo {
  std::string type;  ///< four letters, see docs/format.md
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
  double bound = 0;  ///< largest error promised; 0 when lossless
  double step = 0;   ///< lattice step; 0 when there is none
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
  /// Mode random: of each level of detail, the mesh itself first.
  std::vector<uint64_t> faces_of_level;
  std::vector<uint32_t> charts_of_level;
  std::vector<double> view_error_of_level;  ///< the largest quadric error, in units of the mesh
  std::vector<double> bound_of_level;       ///< no point of the mesh is farther from this level
  ArrayInfo connectivity;                   ///< count: corners
  ArrayInfo positions;
  std::vector<ArrayInfo> arrays;
  std::vector<std::pair<std::string, std::string>> metadata;
  std::string provenance;
  std::vector<ChunkInfo> chunks;
  /// What is missing or damaged as far as the chunks' headers show, one sentence each; see verify_checksums()
  /// for the rest.
  std::vector<std::string> problems;
};

/// Reads header, index and description; decodes no values. Errors as decode().
Result<FileInfo> inspect(const Source& source);

/// Checks every checksum of the file. The result lists what is damaged, one sentence each; empty: all is
/// well. Error: cannot_read, or corrupt when not even the header can be made out.
Result<std::vector<std::string>> verify_checksums(const Source& source);

}  // namespace maille
