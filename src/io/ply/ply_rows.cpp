#include "io/ply/ply_rows.h"

#include <algorithm>
#include <cstring>

#include "base/bytes.h"
#include "io/cells.h"
#include "io/reading.h"

namespace maille {
namespace {

const std::byte* values_of(const PlyField& field, uint64_t row) {
  return field.array->bytes.data() + row * field.array->tuple_size();
}

}  // namespace

// Little-endian, so unsigned counts of any size are read alike.
uint64_t ply_count_at(const Array& counts, uint64_t row) {
  uint64_t value = 0;
  std::memcpy(&value, counts.bytes.data() + row * counts.tuple_size(), counts.tuple_size());
  return value;
}

// The same row in binary and in text: only numbers(), which all values go through, knows the encoding.
void PlyRowWriter::write(PlyOutElement& element, uint64_t row, uint64_t corner,
                         std::span<const uint32_t> nodes) {
  first_ = true;
  for (size_t i = 0; i < element.fields.size(); ++i) {
    const PlyField& field = element.fields[i];
    const size_t size = size_of(field.type);
    switch (field.kind) {
      case PlyField::Kind::fixed:
        numbers(values_of(field, row), field.type, field.numbers);
        break;
      case PlyField::Kind::fixed_list:
        count(field.numbers, field.count_type);
        numbers(values_of(field, row), field.type, field.numbers);
        break;
      case PlyField::Kind::padded_list: {
        const uint64_t length = ply_count_at(*field.counts, row);
        count(length, field.count_type);
        if (length != 0) numbers(values_of(field, row), field.type, length);
        break;
      }
      case PlyField::Kind::running_list: {
        const uint64_t length = ply_count_at(*field.counts, row);
        count(length, field.count_type);
        numbers(field.array->bytes.data() + running_[&field], field.type, length);
        running_[&field] += length * size;
        break;
      }
      case PlyField::Kind::corners:
        count(nodes.size() * field.numbers, field.count_type);
        numbers(field.array->bytes.data() + corner * field.array->tuple_size(), field.type,
                nodes.size() * field.numbers);
        break;
      case PlyField::Kind::nodes:
        count(nodes.size(), field.count_type);
        indices(nodes, field.type);
        break;
      case PlyField::Kind::ends:
        indices(nodes, field.type);
        break;
    }
  }
  if (encoding_ == PlyEncoding::ascii) out_.put('\n');
}

void PlyRowWriter::numbers(const std::byte* from, Scalar type, uint64_t many) {
  const size_t size = size_of(type);
  if (encoding_ == PlyEncoding::little_endian || (encoding_ == PlyEncoding::big_endian && size == 1)) {
    out_.put_bytes({from, static_cast<size_t>(many) * size});
    return;
  }
  for (uint64_t i = 0; i < many; ++i, from += size) {
    if (encoding_ == PlyEncoding::ascii) {
      separate();
      put_scalar(out_, from, type);
    } else {
      std::byte turned[8];
      std::reverse_copy(from, from + size, turned);
      out_.put_bytes({turned, size});
    }
  }
}

/// One whole number in a type that holds it.
void PlyRowWriter::count(uint64_t value, Scalar type) {
  numbers(reinterpret_cast<const std::byte*>(&value), type, 1);  // little-endian: the low bytes come first
}

void PlyRowWriter::indices(std::span<const uint32_t> nodes, Scalar type) {
  // Points have 32 bits in memory, and rarely others in files: these are written as they lie.
  if (size_of(type) == 4) {
    numbers(std::as_bytes(nodes).data(), type, nodes.size());
  } else {
    for (const uint32_t node : nodes) count(node, type);
  }
}

void PlyRowWriter::separate() {
  if (!first_) out_.put(' ');
  first_ = false;
}

}  // namespace maille
