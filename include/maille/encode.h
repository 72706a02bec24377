#pragma once

#include <maille/executor.h>
#include <maille/mesh.h>
#include <maille/source.h>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace maille {

enum class Mode : uint8_t { single = 0, stream = 1, random = 2 };

/// How far decoded values may be from the original ones.
struct Tolerance {
  enum class Kind : uint8_t {
    lossless,   ///< bit for bit, NaN payloads and negative zeros included
    absolute,   ///< |decoded - original| <= value for every component, measured on the decoded type
    relative,   ///< absolute with value x diagonal of the bounding box (positions) or x range of the finite
                ///< values
    bits,       ///< a lattice of 2^value points along the longest side (positions) or range (arrays)
    norm,       ///< the length of (decoded - original), all components of a tuple together, <= value
    psnr,       ///< 20 log10(range / root of the mean squared error) >= value, in decibels; the range is that
                ///< of `relative`
    pointwise,  ///< |decoded - original| <= value x |original| for every number, which keeps signs and zeros;
                ///< value < 1, mode stream only
  };
  static constexpr unsigned kind_count = 7;
  Kind kind = Kind::lossless;
  double value = 0;
};

/// Which order the elements have in the decoded mesh.
enum class Order : uint8_t {
  canonical,  ///< the order the codec finds cheapest; arrays follow their elements
  keep,       ///< the input's order of points and cells, and the first corner of each cell
};

/// Cells of a piece of a volume that suit most uses: boxes and threads gain, extra bytes stay at some percent
/// (docs/benchmarks.md, "Volumes in pieces").
inline constexpr uint64_t cells_of_volume_piece = uint64_t{1} << 18;

/// The mode of a file where none is asked for: stream for meshes with solids, else single; that also where
/// arrays are on corners, which streams do not have.
Mode usual_mode(const Mesh& mesh);

struct EncodeOptions {
  /// None: usual_mode(); of a mesh that is read in parts stream, or random where all cells are faces.
  std::optional<Mode> mode;
  int effort = 5;  ///< 1 (fast) to 9 (small); see effort_ranges()
  Order order = Order::canonical;
  Tolerance positions;
  /// By array name; an array not named here is lossless. A name no array has is an error (usage).
  std::map<std::string, Tolerance> arrays;
  /// A mesh of more cells is cut into parts of at most so many, which are coded, and decoded, at once where
  /// an executor allows it. Smaller parts make larger files. At least 1. Without a value: up to effort 6
  /// meshes of more than 400,000 are cut, into parts of at most 600,000; from 7 on, as models learn, none is.
  ///
  /// Mode stream: cells are divided into pieces of space of about so many, which can be read alone
  /// (VolumeFile); without a value there is one stream.
  ///
  /// Mode random: triangles of a chart of the finest level, about, from 128 to 2^20; 4096 without a value.
  /// Small regions of a mesh with smaller charts read less, for a larger file (docs/random-access.md).
  std::optional<uint64_t> most_cells_per_part;
  Executor* executor = nullptr;  ///< nullptr: serial
  Progress progress;
  /// Mode stream: the time of the mesh's own values, finite. Steps that are appended have times of their own.
  std::optional<double> time = {};
  /// Recorded in the file for `info`; empty for files that must be equal byte for byte.
  std::string provenance;
};

/// Efforts that write the same, and what sets them apart from those before.
struct EffortRange {
  int first = 0, last = 0;
  std::string summary;  ///< for users
};
/// All efforts, from 1 to 9.
std::vector<EffortRange> effort_ranges();

/// What became of one array, or of the connectivity.
struct ArrayReport {
  std::string name;
  Domain domain = Domain::point;
  Scalar type = Scalar::f32;
  uint32_t components = 1;
  uint64_t elements = 0;     ///< tuples; faces for the connectivity
  uint64_t raw_bytes = 0;    ///< in memory, as given
  uint64_t coded_bytes = 0;  ///< in the file, without chunk headers
  bool lossless = true;
  double bound = 0;          ///< largest error promised; 0 when lossless
  Tolerance asked;           ///< what the bound was made from
  double extent = 0;         ///< what a relative bound is a part of: the diagonal, or the widest range
  double maximum_error = 0;  ///< measured on the decoded values
  double step = 0;           ///< lattice step; 0 when there is none
};

struct EncodeReport {
  uint64_t points = 0;
  uint64_t cells = 0;
  uint64_t file_bytes = 0;
  ArrayReport connectivity;
  ArrayReport positions;
  std::vector<ArrayReport> arrays;  ///< in the mesh's order
  uint64_t order_bytes = 0;         ///< what Order::keep costs
  uint64_t other_bytes = 0;         ///< headers, index, metadata
};

/// Compresses a mesh into `sink` as one .maille file and commits it. The mesh is checked first (validate()).
/// The same mesh and options give the same bytes on every machine and for any executor.
/// Errors: malformed_input (the mesh), usage (the options), unsupported, write_failed, cancelled.
[[nodiscard]] Result<EncodeReport> encode(const Mesh& mesh, Sink& sink, const EncodeOptions& options = {});

}  // namespace maille
