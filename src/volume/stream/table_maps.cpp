#include "volume/stream/table_maps.h"

#include <algorithm>
#include <cstring>
#include <numeric>

#include "base/result.h"
#include "entropy/rans.h"
#include "numbers/number_maps.h"
#include "volume/stream/stream_layout.h"
#include "volume/values/array_stage.h"

namespace maille {
namespace {

Array column_of(const Array& array, uint32_t component) {
  Array column = make_array(array.name, array.domain, array.type, 1);
  column.resize(array.count());
  const size_t size = size_of(array.type);
  for (size_t i = 0; i < array.count(); ++i)
    std::copy_n(array.bytes.data() + (i * array.components + component) * size, size,
                column.bytes.data() + i * size);
  return column;
}

/// May a table pay? Floats must come again, a sixteenth of them at least; of doubles several may also be
/// within some roundings. Sorted bits count them exactly.
bool may_have_table(const Array& column) {
  const size_t size = size_of(column.type);
  std::vector<uint64_t> bits(column.count());
  for (size_t i = 0; i < bits.size(); ++i) std::memcpy(&bits[i], column.bytes.data() + i * size, size);
  std::sort(bits.begin(), bits.end());
  const auto numbers = static_cast<size_t>(std::unique(bits.begin(), bits.end()) - bits.begin());
  if (numbers < 2 || numbers > most_streamed_numbers) return false;
  return column.type == Scalar::f64 || numbers * 16 <= bits.size() * 15;
}

/// A map with a table of all numbers of a column; none where numbers hardly come again.
NumberMap table_of(const Array& column) {
  const std::optional<Array> floats = as_floats(column);
  const Array& numbers = floats ? *floats : column;
  if (!may_have_table(numbers)) return {};
  std::vector<uint32_t> source(numbers.count());
  std::iota(source.begin(), source.end(), 0u);
  NumberMap map = with_tables(numbers, {choose_lossless_map(numbers, 0)}, source)[0];
  map.factor = floats ? 1 : 0;
  return map;
}

/// What all numbers of a column take with a map, if the others take as many bytes as those of some cells;
/// with the table itself. It runs the coder of the file on the first cells.
uint64_t bytes_with(const NumberMap& map, const Array& column, bool mixed, const FirstCells& trial) {
  ArrayStage<RansEncoder> stage({column.type, 1, {map}, 0, mixed}, column.domain);
  const bool points = column.domain == Domain::point;
  const size_t size = column.tuple_size(),
               count = points ? trial.cells().points.size() : trial.cells().size();
  if (count == 0) return 0;
  std::vector<std::byte> numbers(count * size);
  for (size_t i = 0; i < count; ++i) {
    const uint64_t number = points ? trial.cells().points[i].number : trial.numbers()[i];
    std::copy_n(column.bytes.data() + number * size, size, numbers.data() + i * size);
  }
  stage.begin_batch(RansEncoder(stage.lanes()));
  stage.code(trial.cells(), {}, numbers.data());
  ByteWriter table;
  if (!map.table.empty()) write_map(table, map);
  return stage.coder().finish().size() * column.count() / count + table.size();
}

}  // namespace

FirstCells::FirstCells(const std::vector<uint8_t>* borders) : coder_(Mixing::none, false) {
  if (borders) coder_.use_gates(borders);
}

/// No point is used for the last time here, which would not change what is expected of others.
void FirstCells::code(uint64_t number) {
  coder_.code(topology_, point_numbers_, cell_, cells_);
  numbers_.push_back(number);
}

Result<> TableSearch::add_tables(const Array& array, std::vector<NumberMap>& maps) {
  if (!is_float(array.type) || array.count() > most_tuples) return {};
  const bool mixed = mixes_values_ && array.components <= most_mixed_components;
  for (uint32_t c = 0; c < array.components; ++c) {
    const Array column = column_of(array, c);
    NumberMap tabled = table_of(column);
    // All tables together have a bound in the format.
    if (tabled.table.empty() || numbers_ + tabled.table.size() > most_table_numbers) continue;
    if (!cells_) cells_.emplace(MAILLE_TRY(first_cells_()));
    const uint64_t bytes = bytes_with(tabled, column, mixed, *cells_);
    // A saving of 2 % on the first cells; the rest of the mesh may be less regular.
    if (bytes * 50 >= bytes_with(maps[c], column, mixed, *cells_) * 49) continue;
    numbers_ += tabled.table.size();
    maps[c] = std::move(tabled);
  }
  return {};
}

}  // namespace maille
