#include "io/ply/ply_table.h"

#include <algorithm>
#include "base/bytes.h"
#include "io/buffered_writer.h"

namespace maille {
namespace {

/// Reads a whole number, also one written with a point or exponent ("255.0"), as some exporters do. 9e15 is
/// below 2^53, where every whole number is exact in a double.
bool read_whole(TextScanner& scanner, int64_t& value) {
  if (scanner.integer(value)) return true;
  const char* const from = scanner.here();
  Number number;
  if (!scanner.number(number)) return false;
  if (number.value == std::floor(number.value) && std::fabs(number.value) < 9e15) {
    value = static_cast<int64_t>(number.value);
    return true;
  }
  scanner.jump(from);
  return false;
}

/// Whether a float holds less than the text says, because the number is among the smallest or below them. It
/// is read nevertheless and counted for a note; one that is too large is an error, since infinity would be
/// another mesh.
bool underflows(const Number& number) {
  return number.value != 0 && !number.fits_single &&
         std::fabs(number.single) < std::numeric_limits<float>::min();
}

bool overflows(const Number& number) {
  return std::isinf(number.single) && !std::isinf(number.value);
}

// Called where reading failed, with the scanner still in front of the number.
std::string value_error(const PlyProperty& property, const TextScanner& scanner) {
  const std::string has = "property \"" + property.name + "\" has ";
  if (!is_float(property.type)) {
    return has + found_at(scanner) + " where a number of type " + ply_name_of(property.type) + " belongs";
  }
  TextScanner ahead = scanner;
  Number number;
  if (property.type == Scalar::f32 && ahead.number(number)) {
    return has + found_at(scanner) + ", which is too large for a float; declare the property as double";
  }
  return has + no_number_at(scanner);
}

}  // namespace

bool read_ply_number(TextScanner& scanner, Scalar type, std::byte* to, uint64_t& too_small) {
  const char* const from = scanner.here();
  if (is_float(type)) {
    Number number;
    if (!scanner.number(number)) return false;
    if (type == Scalar::f64) {
      store(to, number.value);
      return true;
    }
    if (overflows(number)) {
      scanner.jump(from);
      return false;
    }
    too_small += underflows(number) ? 1 : 0;
    store(to, number.single);
    return true;
  }
  int64_t value = 0;
  if (!read_whole(scanner, value)) return false;
  return with_type(type, [&](auto zero) {
    using T = decltype(zero);
    // PLY has no integers of 64 bits.
    if constexpr (std::is_integral_v<T> && sizeof(T) < 8) {
      if (value >= std::numeric_limits<T>::min() && value <= std::numeric_limits<T>::max()) {
        store(to, static_cast<T>(value));
        return true;
      }
    }
    scanner.jump(from);
    return false;
  });
}

PlyTable::PlyTable(const PlyElement& element, std::vector<PlyColumn> columns, std::optional<size_t> indices,
                   uint64_t point_count)
    : element_(element), indices_(indices), point_count_(point_count), places_(element.properties.size()) {
  for (PlyColumn& column : columns) {
    size_t offset = 0;
    for (const size_t property : column.properties) {
      places_[property] = {values.size(), offset};
      offset += size_of(element.properties[property].type);
    }
    values.push_back({std::move(column), {}, {}});
  }
  if (indices) places_[*indices].column = values.size();
}

std::string PlyTable::row_name(uint64_t row) const {
  return element_.name + " " + std::to_string(row);
}

std::string PlyTable::bad_index(uint64_t row, int64_t index) const {
  return row_name(row) + ": vertex " + std::to_string(index) + " does not exist, there are " +
         std::to_string(point_count_);
}

uint64_t PlyTable::bytes() const {
  uint64_t size = cells.bytes();
  for (const PlyValues& column : values) size += column.bytes.size() + column.lengths.bytes();
  return size;
}

Result<> PlyTable::read_text(TextScanner& scanner, Watch& watch, uint64_t mesh_bytes) {
  if (element_.properties.empty()) return {};
  for (uint64_t row = 0; row < element_.count; ++row) {
    MAILLE_CHECK(read_text_row(scanner, watch.name(), row));
    if (watch.due(scanner.position())) MAILLE_CHECK(watch.at(scanner.position(), mesh_bytes + bytes()));
  }
  return {};
}

Result<> PlyTable::read_text_row(TextScanner& scanner, const std::string& file, uint64_t row) {
  // Tuples are made whole first, as their properties may stand anywhere in the row.
  for (PlyValues& column : values) {
    if (!column.column.list) {
      column.bytes.resize(column.bytes.size() + column.column.components * size_of(column.column.type));
    }
  }
  // Rows may be broken over lines, and there may be empty lines between them; only the end of a row must be
  // that of a line.
  scanner.skip_white();
  for (size_t i = 0; i < element_.properties.size(); ++i) {
    const PlyProperty& property = element_.properties[i];
    scanner.skip_white();
    if (scanner.at_end()) {
      return malformed_line(file, scanner.line(),
                            "the file ends at " + row_name(row) + " of " + std::to_string(element_.count));
    }
    if (property.list) {
      MAILLE_CHECK(read_text_list(scanner, file, row, i));
      continue;
    }
    PlyValues& column = values[places_[i].column];
    const size_t tuple = column.column.components * size_of(column.column.type);
    std::byte* const to = column.bytes.data() + column.bytes.size() - tuple + places_[i].offset;
    if (!read_ply_number(scanner, property.type, to, too_small)) {
      return malformed_line(file, scanner.line(), row_name(row) + ": " + value_error(property, scanner));
    }
  }
  scanner.skip_blanks();
  if (!scanner.at_line_end()) {
    return malformed_line(file, scanner.line(),
                          row_name(row) + ": " + found_at(scanner) + " stands behind the " +
                              counted(element_.properties.size(), "property", "properties") +
                              " the header declares");
  }
  return {};
}

Result<> PlyTable::read_text_list(TextScanner& scanner, const std::string& file, uint64_t row, size_t at) {
  const PlyProperty& property = element_.properties[at];
  const auto bad = [&](const std::string& what) {
    return malformed_line(file, scanner.line(), row_name(row) + ": " + what);
  };
  uint64_t count = 0;
  if (!scanner.integer(count)) {
    return bad("list \"" + property.name + "\" has " + found_at(scanner) + " where its length belongs");
  }
  const bool nodes = at == indices_;
  // Ends with the text, whatever the count says: at its end no number is found.
  for (uint64_t i = 0; i < count; ++i) {
    scanner.skip_white();
    if (nodes) {
      int64_t index = 0;
      if (!read_whole(scanner, index)) return bad(value_error(property, scanner));
      if (index < 0 || static_cast<uint64_t>(index) >= point_count_) {
        return malformed_line(file, scanner.line(), bad_index(row, index));
      }
      cells.nodes.push_back(static_cast<uint32_t>(index));
    } else {
      std::byte number[8];
      if (!read_ply_number(scanner, property.type, number, too_small))
        return bad(value_error(property, scanner));
      auto& bytes = values[places_[at].column].bytes;
      bytes.insert(bytes.end(), number, number + size_of(property.type));
    }
  }
  if (nodes) {
    cells.end_cell();
  } else {
    values[places_[at].column].lengths.add(count);
  }
  return {};
}

}  // namespace maille
