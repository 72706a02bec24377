#include <algorithm>

#include "base/bytes.h"
#include "base/result.h"
#include "io/buffered_writer.h"
#include "io/cells.h"
#include "io/notes.h"
#include "io/reading.h"
#include "io/vtk/vtk_legacy.h"
#include "io/vtk/vtk_text.h"
#include "io/vtk/vtu.h"
#include "mesh/cell_faces.h"

namespace maille {
namespace {

/// Writes version 4.2, from before OFFSETS, which all programs read, as an unstructured grid whatever the
/// mesh is.
class VtkWriter {
 public:
  VtkWriter(const Mesh& mesh, Sink& sink, const WriteOptions& options)
      : mesh_(mesh), out_(sink), ascii_(options.ascii) {}

  Result<std::vector<std::string>> write();

 private:
  void put_field_data();
  void put_points();
  void put_cells();
  void put_data(Domain domain, const char* keyword);
  void put(const Array& array, const std::string& name);
  void put_array(const Array& array, const std::string& name);
  void put_values(const std::byte* from, uint64_t count, Scalar type, uint32_t per_line);
  void put_strings(const std::string& name, const std::vector<std::string>& values, uint32_t components = 1);
  bool is_text(const Array& array) const;
  template <class T>
  void put_value(T value, bool last);
  std::vector<std::string> roles() const;
  std::vector<std::pair<std::string, std::vector<std::string>>> own_texts() const;

  const Mesh& mesh_;
  BufferedWriter out_;
  bool ascii_;
};

template <class T>
void VtkWriter::put_value(T value, bool last) {
  if (ascii_) {
    if constexpr (sizeof(T) == 1) {
      out_.put_number(static_cast<int>(value));
    } else {
      out_.put_number(value);
    }
    out_.put(last ? '\n' : ' ');
    return;
  }
  std::byte bytes[sizeof(T)];
  store(bytes, value);
  // Big-endian, as binary files are.
  std::reverse(bytes, bytes + sizeof(T));
  out_.put_bytes(bytes);
}

void VtkWriter::put_values(const std::byte* from, uint64_t count, Scalar type, uint32_t per_line) {
  with_type(type, [&](auto zero) {
    using T = decltype(zero);
    for (uint64_t i = 0; i < count; ++i) {
      put_value(load<T>(from + i * sizeof(T)), (i + 1) % per_line == 0 || i + 1 == count);
    }
  });
  if (!ascii_) out_.put('\n');
}

void VtkWriter::put_array(const Array& array, const std::string& name) {
  out_.put(to_word(name) + " " + std::to_string(array.components) + " " + std::to_string(array.count()) +
           " " + vtk_legacy_name_of(array.type) + "\n");
  put_values(array.bytes.data(), array.count() * array.components, array.type, array.components);
}

/// Writes texts. In ascii: one a line, with %XX; binary: the length in 8 bytes, high first (its two highest
/// bits 0 say so), and the bytes.
void VtkWriter::put_strings(const std::string& name, const std::vector<std::string>& values,
                            uint32_t components) {
  out_.put(to_word(name) + " " + std::to_string(components) + " " +
           std::to_string(values.size() / components) + " string\n");
  for (const std::string& value : values) {
    if (ascii_) {
      out_.put(to_word(value) + "\n");
    } else {
      put_value(static_cast<uint64_t>(value.size()), false);
      out_.put(value);
    }
  }
  if (!ascii_) out_.put('\n');
}

bool VtkWriter::is_text(const Array& array) const {
  return array.domain != Domain::corner && is_vtk_text(mesh_.metadata, array);
}

std::vector<std::string> VtkWriter::roles() const {
  std::vector<std::string> list;
  for (const Array& array : mesh_.arrays) {
    if (array.role == Role::none || is_text(array)) continue;
    list.push_back(std::string(name_of(array.domain)) + " " + name_of(array.role) + " " + array.name);
  }
  return list;
}

/// The texts that were none in a VTK file.
std::vector<std::pair<std::string, std::vector<std::string>>> VtkWriter::own_texts() const {
  std::vector<std::pair<std::string, std::vector<std::string>>> list;
  const std::vector<std::string> meanings = roles();
  if (!meanings.empty()) list.emplace_back(vtk_roles_name, meanings);
  for (const Array& array : mesh_.arrays) {
    if (array.role == Role::label && !is_text(array)) list.emplace_back(array.name + "_labels", array.labels);
  }
  if (const VtkBlocks blocks = vtk_needed_blocks(mesh_); vtk_has_names(blocks))
    list.emplace_back(vtk_block_names_name, vtk_block_names(blocks));
  for (const auto& [key, value] : mesh_.metadata) {
    if (key != vtk_text_key && !was_vtk_text(mesh_.metadata, Domain::mesh, key))
      list.push_back({key, {value}});
  }
  return list;
}

void VtkWriter::put(const Array& array, const std::string& name) {
  if (!is_text(array)) return put_array(array, name);
  put_strings(name, vtk_texts_of(array), array.components);
}

/// The sizes in 32 bits: cells are numbered in 31, and not every program reads VTK's integers of 64.
Array narrow(const Array& sizes) {
  Array array = make_array(sizes.name, Domain::mesh, Scalar::i32, sizes.components);
  array.resize(sizes.count());
  for (size_t i = 0; i < sizes.count() * sizes.components; ++i)
    array.values<int32_t>()[i] = static_cast<int32_t>(sizes.values<uint64_t>()[i]);
  return array;
}

/// Texts as bytes, each ended by a zero: meshio refuses files with arrays of text.
Array bytes_of(const std::string& name, const std::vector<std::string>& texts) {
  Array array = make_array(name, Domain::mesh, Scalar::u8, 1);
  for (const std::string& text : texts) {
    const Bytes bytes = std::as_bytes(std::span(text.data(), text.size()));
    array.bytes.insert(array.bytes.end(), bytes.begin(), bytes.end());
    array.bytes.push_back(std::byte{0});
  }
  return array;
}

void VtkWriter::put_field_data() {
  std::vector<Array> own;
  if (const VtkBlocks blocks = vtk_needed_blocks(mesh_); !blocks.empty())
    own.push_back(narrow(vtk_block_sizes(blocks)));
  for (const auto& [name, values] : own_texts()) own.push_back(bytes_of(vtk_text_prefix + name, values));
  std::vector<std::pair<std::string, std::vector<std::string>>> texts;
  for (const auto& [key, value] : mesh_.metadata) {
    if (was_vtk_text(mesh_.metadata, Domain::mesh, key)) texts.push_back({key, {value}});
  }
  std::vector<std::pair<std::string, const Array*>> arrays;
  for (const Array& array : own) arrays.emplace_back(array.name, &array);
  for (const Array& array : mesh_.arrays) {
    if (array.domain == Domain::mesh) arrays.emplace_back(array.name, &array);
    if (array.domain == Domain::corner) arrays.emplace_back(vtk_corner_prefix + array.name, &array);
  }
  if (arrays.empty() && texts.empty()) return;
  out_.put("FIELD FieldData " + std::to_string(arrays.size() + texts.size()) + "\n");
  for (const auto& [name, array] : arrays) put(*array, name);
  for (const auto& [name, values] : texts) put_strings(name, values);
}

void VtkWriter::put_points() {
  out_.put("POINTS " + std::to_string(mesh_.point_count()) + " " + vtk_legacy_name_of(mesh_.points.type) +
           "\n");
  put_values(mesh_.points.bytes.data(), mesh_.point_count() * 3, mesh_.points.type, 3);
}

/// A cell as a list: its points; of a polyhedron the number of its faces, and for each face its number of
/// points and its points.
template <class Put>
void for_each_entry(const CellBlock& block, uint64_t i, Put put) {
  const auto put_all = [&](std::span<const uint32_t> nodes) {
    for (const uint32_t node : nodes) put(node);
  };
  if (block.type_of(i) != CellType::polyhedron) return put_all(block.cell(i));
  put(static_cast<uint32_t>(block.faces(i).size()));
  for_each_face(block.cell(i), block.faces(i), [&](std::span<const uint32_t> face) {
    put(static_cast<uint32_t>(face.size()));
    put_all(face);
  });
}

void VtkWriter::put_cells() {
  const uint64_t cells = mesh_.cell_count();
  // The entries of all lists: a length and the nodes for each cell; for polyhedra also the number of faces,
  // and that of the points of each.
  uint64_t size = cells + mesh_.corner_count();
  for (const CellBlock& block : mesh_.blocks) {
    size += block.face_sizes.size();
    for (uint64_t i = 0; i < block.size(); ++i) size += block.type_of(i) == CellType::polyhedron ? 1 : 0;
  }
  out_.put("CELLS " + std::to_string(cells) + " " + std::to_string(size) + "\n");
  for (const CellBlock& block : mesh_.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      uint64_t left = block.cell(i).size() + block.faces(i).size();
      if (block.type_of(i) == CellType::polyhedron) ++left;
      put_value(static_cast<int32_t>(left), left == 0);
      for_each_entry(block, i, [&](uint32_t entry) { put_value(static_cast<int32_t>(entry), --left == 0); });
    }
  }
  out_.put(ascii_ ? "" : "\n");
  out_.put("CELL_TYPES " + std::to_string(cells) + "\n");
  for (const CellBlock& block : mesh_.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) put_value(static_cast<int32_t>(block.type_of(i)), true);
  }
  out_.put(ascii_ ? "" : "\n");
}

void VtkWriter::put_data(Domain domain, const char* keyword) {
  const auto of_domain = [&](const Array& array) { return array.domain == domain; };
  const auto count = std::count_if(mesh_.arrays.begin(), mesh_.arrays.end(), of_domain);
  if (count == 0) return;
  out_.put(std::string(keyword) + " " + std::to_string(mesh_.count_of(domain)) + "\nFIELD FieldData " +
           std::to_string(count) + "\n");
  for (const Array& array : mesh_.arrays) {
    if (of_domain(array)) put(array, array.name);
  }
}

Result<std::vector<std::string>> VtkWriter::write() {
  if (mesh_.point_count() > INT32_MAX) {
    return failure(ErrorCode::usage, "legacy VTK files number points in 31 bits, and the mesh has " +
                                         std::to_string(mesh_.point_count()) + "; write .vtu");
  }
  out_.put("# vtk DataFile Version 4.2\nwritten by maille\n");
  out_.put(ascii_ ? "ASCII\n" : "BINARY\n");
  out_.put("DATASET UNSTRUCTURED_GRID\n");
  put_field_data();
  put_points();
  put_cells();
  put_data(Domain::cell, "CELL_DATA");
  put_data(Domain::point, "POINT_DATA");
  MAILLE_CHECK(out_.finish());
  std::vector<std::string> notes;
  if (ascii_) note_nan_payloads(mesh_, notes);
  const auto on_corners = [](const Array& array) { return array.domain == Domain::corner; };
  if (std::any_of(mesh_.arrays.begin(), mesh_.arrays.end(), on_corners)) {
    notes.push_back("VTK has no arrays on corners: they are in field data, where only maille knows them");
  }
  note_pyramids(count_lagrange_pyramids(mesh_), notes);
  return notes;
}

}  // namespace

Result<std::vector<std::string>> write_vtk_legacy(const Mesh& mesh, Sink& sink, const WriteOptions& options) {
  return VtkWriter(mesh, sink, options).write();
}

}  // namespace maille
