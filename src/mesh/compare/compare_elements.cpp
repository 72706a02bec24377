#include "mesh/compare/compare_elements.h"

#include "base/bytes.h"

#include <cinttypes>
#include <cstdio>
#include <cstring>

namespace maille {

namespace {

/// An integer of any type, sign-extended, so that equal numbers give equal results.
uint64_t integer_at(const Array& array, uint64_t number) {
  const std::byte* at = array.bytes.data() + number * size_of(array.type);
  switch (array.type) {
    case Scalar::i8:
      return static_cast<uint64_t>(int64_t{load<int8_t>(at)});
    case Scalar::u8:
      return load<uint8_t>(at);
    case Scalar::i16:
      return static_cast<uint64_t>(int64_t{load<int16_t>(at)});
    case Scalar::u16:
      return load<uint16_t>(at);
    case Scalar::i32:
      return static_cast<uint64_t>(int64_t{load<int32_t>(at)});
    case Scalar::u32:
      return load<uint32_t>(at);
    default:
      return load<uint64_t>(at);
  }
}

/// Eight bytes at a time; the rest is filled up with zeros. Arrays that are compared have tuples of one size,
/// so zeros at the end cannot make different tuples alike.
uint64_t bytes_hash(uint64_t hash, const std::byte* bytes, size_t size) {
  for (; size >= 8; bytes += 8, size -= 8) hash = hash_mix(hash, load<uint64_t>(bytes));
  if (size == 0) return hash;
  uint64_t rest = 0;
  std::memcpy(&rest, bytes, size);
  return hash_mix(hash, rest);
}

/// A number no label stands for is compared as a number. Otherwise by text, so that label arrays whose texts
/// stand in another order are equal.
uint64_t label_hash(const std::vector<uint64_t>& label_hashes, uint64_t number) {
  return number < label_hashes.size() ? label_hashes[number] : scrambled(number);
}

bool equal_labels(const Array& a, uint64_t i, const Array& b, uint64_t j) {
  const uint64_t x = integer_at(a, i), y = integer_at(b, j);
  if (x < a.labels.size() && y < b.labels.size()) return a.labels[x] == b.labels[y];
  return x == y && x >= a.labels.size() && y >= b.labels.size();
}

uint64_t text_hash(uint64_t seed, const std::string& text) {
  return hash_mix(seed, hash64(std::as_bytes(std::span(text.data(), text.size()))));
}

/// 9 and 17 digits tell any two floats and doubles apart.
std::string describe_number(const Array& array, uint64_t number) {
  char text[40];
  const std::byte* at = array.bytes.data() + number * size_of(array.type);
  if (array.type == Scalar::f32) {
    std::snprintf(text, sizeof text, "%.9g", double(load<float>(at)));
  } else if (array.type == Scalar::f64) {
    std::snprintf(text, sizeof text, "%.17g", load<double>(at));
  } else if (array.type == Scalar::u64) {
    std::snprintf(text, sizeof text, "%" PRIu64, load<uint64_t>(at));
  } else {
    std::snprintf(text, sizeof text, "%" PRId64, static_cast<int64_t>(integer_at(array, number)));
  }
  return text;
}

}  // namespace

// One hash of each text is made beforehand, because an array of labels has few texts and many numbers.
Elements::Elements(const Mesh& mesh, const std::vector<const Array*>& arrays, bool block_names, uint64_t seed)
    : mesh_(&mesh), block_names_(block_names), seed_(scrambled(seed + 1)) {
  for (const Array* array : arrays) {
    Attribute attribute{array, {}};
    if (has_labels(*array)) {
      for (const std::string& label : array->labels)
        attribute.label_hashes.push_back(text_hash(seed_, label));
    }
    attributes_[static_cast<size_t>(array->domain)].push_back(std::move(attribute));
  }
  cells_.reserve(mesh.cell_count());
  uint64_t corners = 0;
  for (size_t b = 0; b < mesh.blocks.size(); ++b) {
    add_block(b, corners);
    corners += mesh.blocks[b].connectivity.size();
  }
}

void Elements::add_block(size_t block, uint64_t first_corner) {
  const CellBlock& cells = mesh_->blocks[block];
  kind_of_type_.fill(no_kind);
  kind_of_faces_.clear();
  for (uint64_t i = 0; i < cells.size(); ++i) {
    const auto nodes = cells.cell(i);
    CellType type = cells.type_of(i);
    // Formats differ in how they call these; the same corners in the same order are the same cell.
    if (type == CellType::polygon && nodes.size() == 3) type = CellType::triangle;
    if (type == CellType::polygon && nodes.size() == 4) type = CellType::quad;
    const uint32_t kind = kind_of(block, type, cells.faces(i), first_corner);
    cells_.push_back({nodes.data(), static_cast<uint32_t>(nodes.size()), kind});
  }
}

uint32_t Elements::kind_of(size_t block, CellType type, std::span<const uint32_t> faces,
                           uint64_t first_corner) {
  // Polyhedra differ in kind when their faces have other numbers of corners.
  uint32_t& known = type == CellType::polyhedron
                        ? kind_of_faces_.try_emplace({faces.begin(), faces.end()}, no_kind).first->second
                        : kind_of_type_[static_cast<uint8_t>(type)];
  if (known != no_kind) return known;
  uint64_t hash = hash_mix(seed_, static_cast<uint64_t>(type));
  for (const uint32_t corners : faces) hash = hash_mix(hash, corners);
  if (block_names_) hash = text_hash(hash, mesh_->blocks[block].name);
  kinds_.push_back({type, block, first_corner, scrambled(hash), {faces.begin(), faces.end()}});
  return known = static_cast<uint32_t>(kinds_.size() - 1);
}

// Cells point into the connectivity of their block, so the place of the first node there is the corner's
// number.
uint64_t Elements::first_corner(const Cell& cell) const {
  const Kind& kind = kinds_[cell.kind];
  return kind.first_corner +
         static_cast<uint64_t>(cell.nodes - mesh_->blocks[kind.block].connectivity.data());
}

std::string Elements::describe_cell(uint64_t number) const {
  const Cell& cell = cells_[number];
  const Kind& kind = kinds_[cell.kind];
  std::string text = std::string(name_of(kind.type)) + " " + std::to_string(number) + " (points";
  for (size_t i = 0; i < cell.degree && i < 12; ++i) text += " " + std::to_string(cell.nodes[i]);
  text += cell.degree > 12 ? " ...)" : ")";
  if (block_names_ && !mesh_->blocks[kind.block].name.empty())
    text += " of block \"" + mesh_->blocks[kind.block].name + "\"";
  return text + describe_values(Domain::cell, number) +
         describe_values(Domain::corner, first_corner(cell), cell.degree);
}

std::string Elements::describe_values(Domain domain, uint64_t element, uint64_t count) const {
  std::string text;
  const auto& attributes = attributes_[static_cast<size_t>(domain)];
  // The values of more arrays would bury the sentence under numbers.
  if (attributes.size() > 2) return text;
  for (const Attribute& attribute : attributes) {
    if (attribute.array == &mesh_->points) continue;
    text += (text.empty() ? " with " : ", ") + attribute.array->name;
    for (uint64_t i = 0; i < count && i < 6; ++i) text += " " + describe_tuple(*attribute.array, element + i);
    if (count > 6) text += " ...";
  }
  return text;
}

// Values of all arrays compared go into one hash, in the order of the arrays, which is the same for both
// meshes.
uint64_t Elements::values_hash(Domain domain, uint64_t element) const {
  uint64_t hash = seed_;
  for (const Attribute& attribute : attributes_[static_cast<size_t>(domain)]) {
    const Array& array = *attribute.array;
    if (attribute.label_hashes.empty()) {
      const size_t size = array.tuple_size();
      hash = bytes_hash(hash, array.bytes.data() + element * size, size);
      continue;
    }
    for (uint32_t c = 0; c < array.components; ++c) {
      hash = hash_mix(hash,
                      label_hash(attribute.label_hashes, integer_at(array, element * array.components + c)));
    }
  }
  return scrambled(hash);
}

bool equal_values(const Elements& a, Domain domain, uint64_t i, const Elements& b, uint64_t j) {
  const auto& in_a = a.attributes_[static_cast<size_t>(domain)];
  const auto& in_b = b.attributes_[static_cast<size_t>(domain)];
  for (size_t k = 0; k < in_a.size(); ++k) {
    if (!equal_tuples(*in_a[k].array, i, *in_b[k].array, j)) return false;
  }
  return true;
}

bool equal_kinds(const Elements& a, const Elements::Cell& i, const Elements& b, const Elements::Cell& j) {
  const Elements::Kind& in_a = a.kinds_[i.kind];
  const Elements::Kind& in_b = b.kinds_[j.kind];
  return in_a.type == in_b.type && in_a.face_sizes == in_b.face_sizes &&
         (!a.block_names_ || a.mesh_->blocks[in_a.block].name == b.mesh_->blocks[in_b.block].name);
}

bool equal_tuples(const Array& a, uint64_t i, const Array& b, uint64_t j) {
  if (!has_labels(a) || !has_labels(b)) {
    const size_t size = a.tuple_size();
    return std::memcmp(a.bytes.data() + i * size, b.bytes.data() + j * size, size) == 0;
  }
  for (uint32_t c = 0; c < a.components; ++c) {
    if (!equal_labels(a, i * a.components + c, b, j * b.components + c)) return false;
  }
  return true;
}

std::string describe_tuple(const Array& array, uint64_t i) {
  std::string text = "(";
  for (uint32_t c = 0; c < array.components && c < 12; ++c) {
    if (c > 0) text += " ";
    const uint64_t number = i * array.components + c;
    const uint64_t label = has_labels(array) ? integer_at(array, number) : 0;
    text += has_labels(array) && label < array.labels.size() ? "\"" + array.labels[label] + "\""
                                                             : describe_number(array, number);
  }
  return text + (array.components > 12 ? " ...)" : ")");
}

}  // namespace maille
