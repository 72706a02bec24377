#pragma once

#include <maille/mesh.h>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>
#include "io/text_scanner.h"

// What reader and writer of PLY share: the header, and which properties make which array.
//
// A property is an array of its own name, except:
//   x y z                                  positions
//   nx ny nz                               "normal"
//   red green blue [alpha]                 "colour"
//   s t | u v | texture_u texture_v        "texcoord"
//   list texcoord of 2 numbers per corner  "texcoord" on corners
//   other lists, all of one length k       k components
// other lists                            components padded with zeros, and "name.count"; where padding would
//                                        waste memory: "name.count", and "name" on the mesh
// Elements other than vertex, face, edge and tristrips become arrays "element.property" on the mesh. Whatever
// these rules cannot say is said by comments "maille array ..." (see PlyHint) and by metadata whose key
// starts with "ply.".

namespace maille {

/// One property of an element, as its line in the header says. 64-bit integers have no name in PLY:
/// ply_name_of().
struct PlyProperty {
  std::string name;
  Scalar type = Scalar::f32;
  bool list = false;
  Scalar count_type = Scalar::u8;
};

/// The most properties of one element. No mesh has more, and going through them must not take long: names are
/// looked up one by one, so the planner's time grows with the square.
inline constexpr size_t most_ply_properties = 4096;

/// An element: a table of `count` rows. The count is what the header claims, not what the file holds.
struct PlyElement {
  std::string name;
  uint64_t count = 0;
  std::vector<PlyProperty> properties;

  std::optional<size_t> find(std::string_view property) const;
};

enum class PlyEncoding : uint8_t { ascii, little_endian, big_endian };

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::ascii;
  std::vector<PlyElement> elements;
  /// "comment" or "obj_info", and its text.
  std::vector<std::pair<std::string, std::string>> comments;
};

/// Reads a header up to and including the line "end_header", from the front of the text; the scanner stands
/// at the first byte of data afterwards. Error: malformed_input, naming the line; unsupported, for more than
/// 16 MiB of comments.
Result<PlyHeader> parse_ply_header(TextScanner& scanner, const std::string& file);
/// The header as text, with all its lines, as parse_ply_header() reads it.
std::string format_ply_header(const PlyHeader& header);

/// How an array was made from properties where the rules above do not say so. Written as the comment
/// "maille array ELEMENT NAME TYPE COMPONENTS ROLE PROPERTY...", names as words (to_word()). ELEMENT "corner"
/// means a list property of the faces; in elements other than vertex, face and edge NAME is the array's whole
/// name. A TYPE of 64-bit integers takes two uint properties per component, low half first.
struct PlyHint {
  std::string element;
  std::string name;
  Scalar type = Scalar::f32;
  uint32_t components = 1;
  Role role = Role::none;
  std::vector<std::string> properties;
};
// None where the comment is not a hint, or not a whole one.
std::optional<PlyHint> parse_ply_hint(std::string_view comment);
std::string format_ply_hint(const PlyHint& hint);

/// One label of an array, "maille label DOMAIN NAME TEXT"; an array's labels are numbered in the order of the
/// file.
struct PlyLabel {
  Domain domain = Domain::cell;
  std::string array;
  std::string text;
};
std::optional<PlyLabel> parse_ply_label(std::string_view comment);
std::string format_ply_label(const PlyLabel& label);

/// Metadata other than comments, "maille metadata KEY TEXT".
std::optional<std::pair<std::string, std::string>> parse_ply_metadata(std::string_view comment);
std::string format_ply_metadata(const std::string& key, const std::string& text);

/// The words of a text.
std::vector<std::string_view> split_words(std::string_view text);
/// The scalar type a header's word stands for.
std::optional<Scalar> ply_type_named(std::string_view name);

/// An array and the properties of one element that make it.
struct PlyColumn {
  std::string name;
  Scalar type = Scalar::f32;
  uint32_t components = 1;
  Role role = Role::none;
  bool list = false;               ///< the values of one list property, any number per row
  std::vector<size_t> properties;  ///< their numbers in the element
  bool hinted = false;             ///< made by a hint
};
/// The arrays made from an element's properties, in the order of the properties. `taken` names properties
/// that have another use (x, vertex_indices, ...).
std::vector<PlyColumn> plan_ply_columns(const PlyElement& element, const std::vector<PlyHint>& hints,
                                        const std::vector<std::string_view>& taken);

/// The name of a scalar type in a header ("uchar"), the older one of two; nullptr for 64-bit integers, which
/// are written as two halves (PlyHint).
const char* ply_name_of(Scalar type);

/// The first of vertex_indices and vertex_index the element has as a list.
std::optional<size_t> find_vertex_indices(const PlyElement& element);

}  // namespace maille
