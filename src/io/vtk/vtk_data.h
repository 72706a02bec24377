#pragma once

#include <maille/mesh.h>
#include <maille/source.h>

#include <initializer_list>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "io/budget.h"

namespace maille {

enum class VtkCompressor : uint8_t { none, zlib, lz4, lzma };

/// Unpacks one block of compressed data into exactly `out`; false when it is damaged or has another size.
/// Writes nowhere else, whatever the bytes are.
bool unpack_vtk_block(VtkCompressor compressor, Bytes packed, std::span<std::byte> out);

/// A VTK XML file, taken apart: the XML proper, and the appended data cut out before parsing. `appended` is a
/// view of the bytes that were parsed, which must outlive it.
struct VtkXml {
  enum class Encoding : uint8_t { none, raw, base64 };

  std::string file;
  pugi::xml_document document;
  bool swapped = false;      ///< numbers are in the other byte order
  unsigned header_size = 4;  ///< bytes of one number in the headers of binary data: 4 or 8
  VtkCompressor compressor = VtkCompressor::none;
  Encoding appended_encoding = Encoding::none;
  Bytes appended;  ///< behind the underscore
};

/// Parses the XML of a file whose VTKFile element has one of these types. Errors: malformed_input with the
/// line; unsupported for another type or compressor.
Result<VtkXml> parse_vtk_xml(Bytes bytes, std::string file, std::initializer_list<std::string_view> types);

/// The size in memory beyond which a file of so many bytes is not believed, for Budget.
uint64_t plausible_bytes(const VtkXml& xml, uint64_t file_bytes);

/// Reads one numeric DataArray: name, type, components and all its values, whose number must be a whole
/// number of tuples. Values come in native byte order. The domain is left to the caller. `where` says which
/// element it is, for messages. Errors: malformed_input, memory_bound.
Result<Array> read_data_array(const VtkXml& xml, pugi::xml_node node, const std::string& where,
                              Budget& budget);

/// The strings of a DataArray of type String, or of bytes. Errors as above.
Result<std::vector<std::string>> read_string_array(const VtkXml& xml, pugi::xml_node node,
                                                   const std::string& where, Budget& budget);

}  // namespace maille
