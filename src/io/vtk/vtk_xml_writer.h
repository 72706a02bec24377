#pragma once

#include <functional>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/buffered_writer.h"
#include "io/reading.h"

// What the writers of VTK's XML formats have in common: arrays with their tags, and the document around them.

namespace maille {

/// One DataArray: the attributes of its tag and its bytes, borrowed (from the mesh, which must outlive it) or
/// owned.
struct VtkXmlData {
  std::string attributes;
  Scalar type = Scalar::u8;
  uint32_t components = 1;
  Bytes borrowed;
  std::vector<std::byte> owned;

  Bytes bytes() const { return owned.empty() ? borrowed : Bytes(owned); }
};

/// A group of arrays within an element ("PointData"), as they appear.
struct VtkXmlSection {
  std::string open, close;
  std::vector<VtkXmlData> arrays;
};

/// Says how many of the names xml_escaped() has to change, if there are any.
std::optional<std::string> vtk_xml_note(std::initializer_list<std::span<const Array>> arrays,
                                        const std::vector<std::pair<std::string, std::string>>& metadata);

/// Arrays of the field data up to this size stand in their tags as base64, others behind the tags. meshio
/// (5.0) numbers the latter anew, and may take one for another: mostly short ones, which stand first. Chosen,
/// not swept.
inline constexpr size_t most_inline_bytes = 1 << 16;
/// The attribute, the text and the end of such a tag: the number of bytes in 8 bytes (header_type UInt64),
/// then the values. `big_endian`: of the file; then both are turned, values as numbers of `number_size`.
std::string vtk_xml_inline(Bytes values, size_t number_size = 1, bool big_endian = false);

/// Integers as an array, in 32 bits where they fit: VTK reads either, and the file is half the size. Values
/// must be below 2^63.
VtkXmlData vtk_xml_numbers(const char* name, std::span<const uint32_t> values);
VtkXmlData vtk_xml_numbers(const char* name, std::span<const uint64_t> values);
VtkXmlData vtk_xml_numbers(const char* name, std::span<const int64_t> values);

/// The document around a mesh: sections are added in the order of the format, then write() puts all of it.
/// Appended data are raw, or values stand in the tags as text (options.ascii). `mesh` and `options` must
/// outlive the writer.
class VtkXmlWriter {
 public:
  /// `format`: how notes call it ("VTP").
  VtkXmlWriter(const Mesh& mesh, Sink& sink, const WriteOptions& options, std::string format)
      : mesh_(mesh), out_(sink), options_(options), format_(std::move(format)) {}

  /// Cells and corners are written in this order, not in the mesh's. Both must outlive the writer.
  void set_order(const std::vector<uint64_t>& cells, const std::vector<uint64_t>& corners) {
    cell_order_ = &cells;
    corner_order_ = &corners;
  }
  /// Arrays on the mesh and on corners, metadata, labels. First of all.
  void add_field_data();
  VtkXmlSection& field() { return field_.back(); }
  void add_points();
  void add_arrays(Domain domain, const char* element);
  /// An array "block" to the section of cell arrays, added last; `mark` is an attribute more for it. Nothing
  /// where no block has a name.
  void add_block_names(const std::string& mark);
  void add(VtkXmlSection section) { piece_.push_back(std::move(section)); }
  /// Texts that are no text array of a VTK file (names of blocks, labels) are written as bytes. Only VTK
  /// itself reads strings, so this is for files others read.
  void write_own_texts_as_bytes() { own_texts_as_bytes_ = true; }
  VtkXmlData own_texts(const std::string& name, std::span<const std::string> values) const;

  /// Writes the whole document and finishes the sink's buffer; `data_set`: the element ("PolyData"),
  /// `counts`: attributes of the element Piece. Error: that of the sink.
  Result<> write(const char* data_set, const std::string& counts);

 private:
  VtkXmlData strings(const std::string& name, std::span<const std::string> values, uint32_t components = 1,
                     const char* type = "String") const;
  VtkXmlData describe(const Array& array, const std::string& more) const;
  VtkXmlData describe_texts(const Array& array) const;
  std::vector<std::byte> permuted(const Array& array, const std::vector<uint64_t>& order) const;
  std::string active_attributes(Domain domain) const;
  std::string role_mark(const Array& array) const;
  const Array* first_of(Domain domain, Role role) const;
  void for_each_data(const std::function<void(const VtkXmlData&)>& act) const;
  void put_sections(const std::vector<VtkXmlSection>& sections, uint64_t& offset);
  /// Whether an array stands in its tag: a short one of the field data.
  bool is_inline(const std::vector<VtkXmlSection>& of, const VtkXmlData& data) const;
  void put_array(const VtkXmlData& data, bool in_tag, uint64_t& offset);
  void put_ascii(const VtkXmlData& data);
  void put_appended(const VtkXmlData& data);

  const Mesh& mesh_;
  BufferedWriter out_;
  const WriteOptions& options_;
  std::string format_;
  const std::vector<uint64_t>* cell_order_ = nullptr;
  const std::vector<uint64_t>* corner_order_ = nullptr;
  bool own_texts_as_bytes_ = false;
  std::vector<VtkXmlSection> field_, piece_;

 public:
  std::vector<std::string> notes;
};

}  // namespace maille
