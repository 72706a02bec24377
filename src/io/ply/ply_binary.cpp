#include <algorithm>
#include "base/bytes.h"
#include "io/byte_order.h"
#include "io/ply/ply_table.h"

namespace maille {
namespace {

/// A memcpy of a constant size becomes one or two moves instead of a call.
template <size_t size>
void copy_fixed(std::byte* to, size_t to_stride, const std::byte* from, size_t from_stride, uint64_t rows) {
  for (uint64_t row = 0; row < rows; ++row, to += to_stride, from += from_stride) std::memcpy(to, from, size);
}

/// Copies `size` bytes of every row, from rows `from_stride` apart to rows `to_stride` apart. The sizes of
/// the usual tuples are known to the compiler, which is what makes this run at the speed of memory.
void copy_strided(std::byte* to, size_t to_stride, const std::byte* from, size_t from_stride, size_t size,
                  uint64_t rows) {
  if (size == 0 || rows == 0) return;
  if (size == to_stride && size == from_stride) {
    std::memcpy(to, from, size * rows);
    return;
  }
  switch (size) {
    case 1:
      return copy_fixed<1>(to, to_stride, from, from_stride, rows);
    case 2:
      return copy_fixed<2>(to, to_stride, from, from_stride, rows);
    case 3:
      return copy_fixed<3>(to, to_stride, from, from_stride, rows);
    case 4:
      return copy_fixed<4>(to, to_stride, from, from_stride, rows);
    case 8:
      return copy_fixed<8>(to, to_stride, from, from_stride, rows);
    case 12:
      return copy_fixed<12>(to, to_stride, from, from_stride, rows);
    case 16:
      return copy_fixed<16>(to, to_stride, from, from_stride, rows);
    case 24:
      return copy_fixed<24>(to, to_stride, from, from_stride, rows);
    default:
      for (uint64_t row = 0; row < rows; ++row, to += to_stride, from += from_stride)
        std::memcpy(to, from, size);
  }
}

/// A whole number of at most 32 bits, in the file's byte order. Not for floats; headers with lists counted by
/// floats were refused.
int64_t load_whole(const std::byte* from, Scalar type, bool big_endian) {
  std::byte bytes[4] = {};
  const size_t size = size_of(type);
  std::memcpy(bytes, from, size);
  if (big_endian) std::reverse(bytes, bytes + size);
  switch (type) {
    case Scalar::i8:
      return load<int8_t>(bytes);
    case Scalar::u8:
      return load<uint8_t>(bytes);
    case Scalar::i16:
      return load<int16_t>(bytes);
    case Scalar::u16:
      return load<uint16_t>(bytes);
    case Scalar::i32:
      return load<int32_t>(bytes);
    default:
      return load<uint32_t>(bytes);
  }
}

}  // namespace

// Rows are taken in *runs*: as many rows as have the same lengths of lists as the first one, so that all have
// the same stride and whole columns can be copied. Meshes of triangles are a few large runs; where each row
// has other lengths, a run is one row.
Result<> PlyTable::read_binary(Bytes file, uint64_t& at, bool big_endian, Watch& watch, uint64_t mesh_bytes) {
  // Rows without properties take no bytes: any count of them is true, and there is nothing to loop over.
  if (element_.properties.empty()) return {};
  run_.starts.resize(element_.properties.size());
  run_.lengths.resize(element_.properties.size());
  for (uint64_t row = 0; row < element_.count; row += run_.rows) {
    MAILLE_CHECK(find_run(file, at, big_endian, row, watch.name()));
    if (row == 0) reserve(file.size() - at);
    const std::byte* const from = file.data() + at;
    for (size_t column = 0; column < values.size(); ++column) copy_values(column, from, big_endian);
    if (indices_) MAILLE_CHECK(copy_indices(from, big_endian, row, at, watch.name()));
    at += run_.rows * run_.stride;
    if (watch.due(at)) MAILLE_CHECK(watch.at(at, mesh_bytes + bytes()));
  }
  return {};
}

Result<> PlyTable::find_run(Bytes file, uint64_t at, bool big_endian, uint64_t row, const std::string& name) {
  // In bytes. Several columns are copied from one run while it is in cache; chosen, not swept.
  constexpr uint64_t largest_run = uint64_t{1}
                                   << 20;  // bytes; several columns are copied from it while in cache
  const std::byte* const from = file.data() + at;
  const uint64_t left = file.size() - at;
  const auto ends_early = [&] {
    return malformed_byte(name, file.size(),
                          "the file ends inside " + row_name(row) + " of " + std::to_string(element_.count) +
                              ", which begins at byte " + std::to_string(at));
  };
  uint64_t offset = 0;
  for (size_t i = 0; i < element_.properties.size(); ++i) {
    const PlyProperty& property = element_.properties[i];
    run_.lengths[i] = 1;
    if (property.list) {
      const uint64_t count_size = size_of(property.count_type);
      if (left - offset < count_size) return ends_early();
      const int64_t length = load_whole(from + offset, property.count_type, big_endian);
      if (length < 0) {
        return malformed_byte(
            name, at + offset,
            row_name(row) + ": list \"" + property.name + "\" has the length " + std::to_string(length));
      }
      run_.lengths[i] = static_cast<uint64_t>(length);
      offset += count_size;
    }
    // Dividing what is left instead of multiplying the length: no hostile length can overflow.
    if ((left - offset) / size_of(property.type) < run_.lengths[i]) return ends_early();
    run_.starts[i] = static_cast<size_t>(offset);
    offset += run_.lengths[i] * size_of(property.type);
  }
  run_.stride = static_cast<size_t>(offset);
  // `offset` is not 0 here, as there is a property and each takes a byte or more: a list takes its count at
  // least. left / offset is 1 or more, as this row was found to be whole, so every run makes progress.
  const uint64_t limit = std::min({element_.count - row, left / offset, largest_run / offset + 1});
  run_.rows = count_equal_rows(from, limit);
  return {};
}

// Compares only the counts, at the stride of the first row: as long as all counts of a row are equal, the
// next row begins where the stride says. A row whose count differs ends the run before it is looked at
// further.
uint64_t PlyTable::count_equal_rows(const std::byte* from, uint64_t limit) const {
  uint64_t rows = limit;
  for (size_t i = 0; i < element_.properties.size(); ++i) {
    if (!element_.properties[i].list) continue;
    const size_t count_size = size_of(element_.properties[i].count_type);
    const std::byte* const first = from + run_.starts[i] - count_size;
    const std::byte* next = first + run_.stride;
    uint64_t equal = 1;
    if (count_size == 1) {
      for (; equal < rows && *next == *first; ++equal) next += run_.stride;
    } else {
      for (; equal < rows && std::memcmp(next, first, count_size) == 0; ++equal) next += run_.stride;
    }
    rows = std::min(rows, equal);
  }
  return rows;
}

void PlyTable::copy_values(size_t number, const std::byte* from, bool big_endian) {
  PlyValues& column = values[number];
  const std::vector<size_t>& properties = column.column.properties;
  const size_t size = size_of(element_.properties[properties.front()].type);
  const size_t first = column.bytes.size();
  if (column.column.list) {
    const uint64_t length = run_.lengths[properties.front()];
    const size_t tuple = static_cast<size_t>(length) * size;
    column.lengths.add_run(run_.rows, length);
    column.bytes.resize(first + tuple * run_.rows);
    copy_strided(column.bytes.data() + first, tuple, from + run_.starts[properties.front()], run_.stride,
                 tuple, run_.rows);
  } else {
    const size_t tuple = size * properties.size();
    column.bytes.resize(first + tuple * run_.rows);
    for (size_t i = 0; i < properties.size();) {
      size_t end = i + 1;  // properties that follow one another are copied as one
      while (end < properties.size() &&
             run_.starts[properties[end]] == run_.starts[properties[i]] + (end - i) * size) {
        ++end;
      }
      copy_strided(column.bytes.data() + first + i * size, tuple, from + run_.starts[properties[i]],
                   run_.stride, (end - i) * size, run_.rows);
      i = end;
    }
  }
  if (big_endian) swap_numbers(std::span(column.bytes).subspan(first), size);
}

Result<> PlyTable::copy_indices(const std::byte* from, bool big_endian, uint64_t row, uint64_t at,
                                const std::string& name) {
  const uint64_t degree = run_.lengths[*indices_];
  const Scalar type = element_.properties[*indices_].type;
  const size_t size = size_of(type);
  // degree * rows is bounded by the bytes of the run, which were checked.
  const size_t first = cells.nodes.size();
  const uint64_t count = degree * run_.rows;
  cells.nodes.resize(first + count);
  const std::span<uint32_t> nodes = std::span(cells.nodes).subspan(first);
  const std::byte* const source = from + run_.starts[*indices_];
  if (size == 4) {
    const auto bytes = std::as_writable_bytes(nodes);
    const size_t tuple = static_cast<size_t>(degree) * size;
    copy_strided(bytes.data(), tuple, source, run_.stride, tuple, run_.rows);
    if (big_endian) swap_numbers(bytes, size);
  } else {
    for (uint64_t i = 0; i < count; ++i) {
      const std::byte* const number = source + i / degree * run_.stride + i % degree * size;
      nodes[i] = static_cast<uint32_t>(load_whole(number, type, big_endian));
    }
  }
  cells.lengths.add_run(run_.rows, degree);
  // The maximum of all, without a branch for each, and the culprit is looked for only if there is one.
  // Negative indices are large here.
  uint32_t largest = 0;
  for (const uint32_t node : nodes) largest = std::max(largest, node);
  if (nodes.empty() || largest < point_count_) return {};
  const auto bad = static_cast<uint64_t>(
      std::find_if(nodes.begin(), nodes.end(), [&](uint32_t node) { return node >= point_count_; }) -
      nodes.begin());
  const bool negative = type == Scalar::i8 || type == Scalar::i16 || type == Scalar::i32;
  const int64_t index = negative ? static_cast<int32_t>(nodes[bad]) : int64_t{nodes[bad]};
  return malformed_byte(name, at + bad / degree * run_.stride + run_.starts[*indices_] + bad % degree * size,
                        bad_index(row + bad / degree, index));
}

/// Grows the columns once: as large as the header says, but no more than the rest of the file could hold if
/// all rows were like the first.
void PlyTable::reserve(uint64_t bytes_left) {
  for (PlyValues& column : values) {
    const PlyColumn& plan = column.column;
    const uint64_t per_row = plan.list ? run_.lengths[plan.properties.front()] * size_of(plan.type)
                                       : plan.components * size_of(plan.type);
    const uint64_t rows = std::min(element_.count, bytes_left / run_.stride);
    column.bytes.reserve(static_cast<size_t>(rows * per_row));
  }
  if (indices_) {
    const uint64_t rows = std::min(element_.count, bytes_left / run_.stride);
    cells.nodes.reserve(static_cast<size_t>(rows * run_.lengths[*indices_]));
  }
}

}  // namespace maille
