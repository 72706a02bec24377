#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "entropy/mixing.h"
#include "volume/cells/cell_coder.h"
#include "volume/stream/mesh_stream.h"

namespace maille {

/// The first cells of a mesh as coders of values get them, for trials. They are coded without ends of points,
/// as slots must stay those of one point over all of them.
class FirstCells {
 public:
  /// They tell enough, and are fewer than those of a block (cells_per_block), so that no slot is used twice.
  static constexpr uint64_t most = 4000;

  /// `borders`: as Ordering has them; nullptr: cells do not come at gates.
  explicit FirstCells(const std::vector<uint8_t>* borders = nullptr);

  /// Cell `number` of the mesh; cells without shape are passed over.
  template <class Number>
  void add(CellType type, std::span<const Number> points, uint64_t number) {
    cell_.kind = kind_of(type);
    if (cell_.kind >= shape_count) return;
    for (size_t k = 0; k < points.size(); ++k) cell_.number[k] = points[cell_shapes[cell_.kind].place[k]];
    code(number);
  }

  const CodedCells& cells() const { return cells_; }
  /// Of the mesh, by cell.
  const std::vector<uint64_t>& numbers() const { return numbers_; }

 private:
  void code(uint64_t number);

  CellCoder<RangeEncoder> coder_;
  RangeEncoder topology_, point_numbers_;
  StreamedCell cell_;
  CodedCells cells_;
  std::vector<uint64_t> numbers_;
};

/// Gives tables of numbers (NumberMap::table) to components that are kept bit for bit, if they take a
/// fiftieth less so as far as the first cells tell. Tables are a large part of files whose numbers come
/// again: 68 % of sphere_r9 as f32 (docs/history.md, "Tables of numbers"), so that each must pay for itself.
class TableSearch {
 public:
  /// Arrays of more tuples have no tables: streams do not hold all numbers of a mesh.
  static constexpr uint64_t most_tuples = 1 << 16;

  /// `mixes_values`: as the values of arrays with few components will be. `first_cells` is called once at
  /// most, where a table may pay.
  TableSearch(bool mixes_values, std::function<Result<FirstCells>()> first_cells)
      : mixes_values_(mixes_values), first_cells_(std::move(first_cells)) {}

  /// `array`: with all its tuples. Errors: those of `first_cells`.
  Result<> add_tables(const Array& array, std::vector<NumberMap>& maps);

 private:
  bool mixes_values_;
  std::function<Result<FirstCells>()> first_cells_;
  std::optional<FirstCells> cells_;
  uint64_t numbers_ = 0;  ///< of all tables
};

}  // namespace maille
