#pragma once

#include <maille/decode.h>
#include <maille/geometry.h>
#include <maille/mesh.h>
#include <maille/source.h>
#include <maille/stream.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace maille {

/// Volumes of mode `stream`. Of those in pieces (EncodeOptions::most_cells_per_part) cells in a box, on a
/// plane, or with certain values are read without the rest of the file; others are one piece.
/// docs/streaming.md shows it in use.

/// Values of an array that are wanted: from `low` to `high`, both included; NaN never is. Of an array with
/// several components that of `component`, or the length of the tuple.
struct ValueCondition {
  std::string array;
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  std::optional<uint32_t> component;
};

/// Which cells are wanted: those that meet all of this.
struct VolumeQuery {
  /// Cells whose box (around their points) meets it.
  Region region;
  /// Cells with points on both sides of it, or on it.
  std::optional<Region::Plane> plane;
  /// Cells with such a value, or with a point that has it.
  std::vector<ValueCondition> conditions;
  /// Cells by their number in the input, the first and the one behind the last. Only where the order is kept.
  std::optional<std::pair<uint64_t, uint64_t>> cells;
  /// Cells of these pieces alone, in any order: for programs that ask for one after another.
  std::optional<std::vector<uint32_t>> pieces;
};

/// What is known of a piece without reading it.
struct PieceInfo {
  struct Field {
    std::string name;
    Domain domain = Domain::point;
    /// Least, largest and mean value of each component; one for all where there are more than 16; least >
    /// largest where no component is a number.
    struct Component {
      double low = 0, high = 0, mean = 0;
    };
    std::vector<Component> components;
    uint64_t nans = 0;
  };
  uint64_t cells = 0;
  uint64_t points = 0;
  uint64_t bytes = 0;      ///< in the file
  std::optional<Box> box;  ///< around its points; none where no point has numbers
  std::vector<Field> fields;
};

/// Cells of a volume, and where they come from.
struct ExtractedVolume {
  Mesh mesh;
  /// Where the order is kept: by cell and by point of `mesh`, its number in the input, rising.
  std::vector<uint32_t> cell_numbers, point_numbers;
  uint32_t pieces = 0;      ///< that were read
  uint64_t cells_read = 0;  ///< of these
  /// What is damaged, one sentence each.
  std::vector<std::string> problems;
};

/// An open volume. For one thread at a time. Errors of reading, where nothing else is said: cannot_read,
/// network, corrupt, memory_bound (DecodeOptions::limits).
class VolumeFile {
 public:
  /// Reads description and index. `source` must outlive it. DecodeOptions::arrays says which arrays come with
  /// cells; those that conditions name are read, too, but do not come. Error: unsupported, for a file of
  /// another mode.
  [[nodiscard]] static Result<VolumeFile> open(const Source& source, const DecodeOptions& options = {});
  VolumeFile(VolumeFile&&) noexcept;
  VolumeFile& operator=(VolumeFile&&) noexcept;
  ~VolumeFile();

  const StreamDescription& description() const;
  uint64_t cells() const;
  uint64_t points() const;
  uint32_t pieces() const;
  /// Error: usage, for a piece that is not there.
  [[nodiscard]] Result<PieceInfo> info(uint32_t piece) const;
  /// The pieces that may have such cells, in the order of the file: by the index alone. Error: usage, for an
  /// array, a component or a piece that is not there, and for numbers of cells where the order is not kept.
  [[nodiscard]] Result<std::vector<uint32_t>> select(const VolumeQuery& query) const;
  /// The cells of a query as one mesh with all blocks that have such cells: exactly those of the original,
  /// bit for bit where nothing was asked to be lossy. Damaged pieces are left out and named. Errors: as
  /// select().
  [[nodiscard]] Result<ExtractedVolume> extract(const VolumeQuery& query) const;
  /// The whole volume for a first picture: some thousand vertices, each the middle of some thousand cells
  /// near each other, with the means of their values, as floats within a 250th of their range in a piece;
  /// arrays of labels are left out. Nothing more is read. Error: unsupported, where the file is not in
  /// pieces.
  [[nodiscard]] Result<Mesh> coarse() const;

 private:
  struct State;
  explicit VolumeFile(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace maille
