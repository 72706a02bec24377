#pragma once

#include <maille/mesh.h>
#include <cstdint>
#include <string>
#include <vector>
#include "io/cells.h"
#include "io/ply/ply.h"
#include "io/reading.h"

namespace maille {

/// Reads one number of a text into `to` (as many bytes as the type has). False, without moving, when there is
/// none or it does not fit the type. Numbers that are too small for theirs are counted.
bool read_ply_number(TextScanner& scanner, Scalar type, std::byte* to, uint64_t& too_small);

/// The values of one column of an element while they are read.
struct PlyValues {
  PlyColumn column;
  std::vector<std::byte> bytes;  ///< in native order; 64-bit integers as they are in memory
  Lengths lengths;               ///< of lists
};

/// Reads the rows of one element: its columns, and where it has them the point numbers of one list property.
/// Point numbers are checked here, so `cells` only has points of the mesh. Memory grows as rows are read,
/// never by the count that the header claims.
class PlyTable {
 public:
  /// `indices`: the number of the property that holds point numbers, below `point_count`; or none.
  PlyTable(const PlyElement& element, std::vector<PlyColumn> columns, std::optional<size_t> indices,
           uint64_t point_count);

  /// Reads all rows from text. Errors: malformed_input with the line, cancelled, memory_bound.
  Result<> read_text(TextScanner& scanner, Watch& watch, uint64_t mesh_bytes);
  /// Reads all rows from `file`, which is the whole file, beginning at byte `at`, which moves behind them.
  /// Errors: malformed_input with the byte, cancelled, memory_bound. `mesh_bytes`: what stands in memory
  /// beside this table.
  Result<> read_binary(Bytes file, uint64_t& at, bool big_endian, Watch& watch, uint64_t mesh_bytes);

  /// Bytes taken by what was read.
  uint64_t bytes() const;

  std::vector<PlyValues> values;
  CellCollector cells;
  uint64_t too_small = 0;  ///< numbers in text that became zero or lost digits in a float

 private:
  /// Where a property's values go: a column (values.size() for the point numbers) and a place in its tuples.
  struct Place {
    size_t column = 0;
    size_t offset = 0;
  };
  /// Consecutive rows whose lists have the same lengths, so that everything lies at a fixed distance.
  struct Run {
    uint64_t rows = 0;
    size_t stride = 0;
    std::vector<size_t> starts;     // of every property's values within a row
    std::vector<uint64_t> lengths;  // number of its values
  };

  std::string row_name(uint64_t row) const;
  std::string bad_index(uint64_t row, int64_t index) const;
  Result<> read_text_row(TextScanner& scanner, const std::string& file, uint64_t row);
  Result<> read_text_list(TextScanner& scanner, const std::string& file, uint64_t row, size_t property);

  Result<> find_run(Bytes file, uint64_t at, bool big_endian, uint64_t row, const std::string& name);
  uint64_t count_equal_rows(const std::byte* from, uint64_t limit) const;
  void copy_values(size_t column, const std::byte* from, bool big_endian);
  Result<> copy_indices(const std::byte* from, bool big_endian, uint64_t row, uint64_t at,
                        const std::string& name);
  void reserve(uint64_t bytes_left);

  const PlyElement& element_;
  std::optional<size_t> indices_;
  uint64_t point_count_;
  std::vector<Place> places_;  // one per property
  Run run_;
};

}  // namespace maille
