// Legacy VTK files, versions 1.0 to 5.1: a header of five lines, then sections that begin with a keyword.
// Binary numbers are big-endian and begin behind the line of their keyword. Source: "VTK File Formats", and
// for what it leaves out (METADATA, binary strings, OFFSETS) what VTK's own reader does.
#include "io/vtk/vtk_legacy.h"

#include <fast_float/fast_float.h>
#include <algorithm>
#include <cctype>

#include "io/buffered_writer.h"
#include "io/format.h"
#include "io/letters.h"
#include "io/vtk/vtk_legacy_reader.h"
#include "io/vtk/vtu.h"

namespace maille {
namespace {

/// The format's names of types of numbers. The first name of a type is the one written: "long" has 64 bits
/// with some writers only, "vtktypeint64" always.
constexpr struct {
  const char* name;
  Scalar type;
} legacy_scalars[] = {{"char", Scalar::i8},
                      {"unsigned_char", Scalar::u8},
                      {"short", Scalar::i16},
                      {"unsigned_short", Scalar::u16},
                      {"int", Scalar::i32},
                      {"unsigned_int", Scalar::u32},
                      {"vtktypeint64", Scalar::i64},
                      {"vtktypeuint64", Scalar::u64},
                      {"float", Scalar::f32},
                      {"double", Scalar::f64},
                      {"long", Scalar::i64},
                      {"unsigned_long", Scalar::u64},
                      {"vtkidtype", Scalar::i32},
                      {"signed_char", Scalar::i8},
                      {"bit", Scalar::u8}};

template <class T>
bool parse_token(std::string_view token, T& value) {
  if (token.starts_with('+')) token.remove_prefix(1);
  const char* const end = token.data() + token.size();
  if constexpr (std::is_floating_point_v<T>) {
    const auto result = fast_float::from_chars(token.data(), end, value);
    return (result.ec == std::errc() || result.ec == std::errc::result_out_of_range) && result.ptr == end;
  } else {
    const auto result = std::from_chars(token.data(), end, value);
    return result.ec == std::errc() && result.ptr == end;
  }
}

}  // namespace

Result<> VtkLegacyReader::read_header() {
  TextScanner& scanner = in_.scanner;
  scanner.skip_byte_order_mark();
  const std::string first = lower_case(scanner.rest_of_line());
  if (!first.starts_with("# vtk datafile"))
    return in_.malformed("it does not begin with \"# vtk DataFile Version\"");
  scanner.skip_line_end();
  const std::string title(trim(scanner.rest_of_line()));
  // Titles that programs write by themselves say nothing.
  if (title != "vtk output" && title != "written by maille" && !title.empty()) {
    mesh_.metadata.emplace_back("vtk.title", title);
  }
  scanner.skip_line_end();
  const std::string kind = lower_case(in_.word());
  if (kind != "ascii" && kind != "binary")
    return in_.malformed("there should be ASCII or BINARY, but it is \"" + kind.substr(0, 40) + "\"");
  binary_ = kind == "binary";
  return {};
}

/// Reads the values of an array behind its type. Skips the rest of the keyword's line first, where they are
/// binary.
Result<> VtkLegacyReader::read_list(Array& array, uint64_t count, uint32_t components,
                                    const std::string& type) {
  if (components == 0 || components > 0xffff) return in_.malformed("an array has 1 to 65535 components");
  const auto scalar = scalar_of_vtk_legacy(type);
  if (!scalar) return in_.malformed("\"" + type.substr(0, 40) + "\" is no type of numbers");
  array.type = *scalar;
  array.components = components;
  // Bits are the smallest values: eight to a byte. No array has more of them, so the product below cannot
  // overflow.
  if (count > text_.size() * 8 / components)
    return in_.malformed("\"" + array.name + "\" has more values than the file can hold");
  const uint64_t values = count * components;
  if (!binary_) return read_ascii(array, values);
  in_.scanner.skip_line();
  return type == "bit" ? read_bits(array, values) : read_binary(array, values);
}

Result<> VtkLegacyReader::read_ascii(Array& array, uint64_t values) {
  return with_type(array.type, [&](auto zero) -> Result<> {
    using T = decltype(zero);
    ReadingPace pace(budget_, options_.progress, text_.size());
    for (uint64_t i = 0; i < values; ++i) {
      MAILLE_CHECK(pace.step(i, values, sizeof(T), in_.scanner.position()));
      in_.skip_white();
      const TextScanner before = in_.scanner;
      T value{};
      if (!parse_token(in_.scanner.word(), value)) {
        in_.scanner = before;
        return in_.expected("value " + std::to_string(i) + " of " + std::to_string(values) + " of \"" +
                            array.name + "\"");
      }
      const size_t at = array.bytes.size();
      array.bytes.resize(at + sizeof value);
      store(array.bytes.data() + at, value);
    }
    return {};
  });
}

Result<> VtkLegacyReader::read_binary(Array& array, uint64_t values) {
  const uint64_t size = values * size_of(array.type);
  const char* const from = in_.scanner.here();
  if (size > static_cast<uint64_t>(in_.scanner.end() - from)) {
    return malformed_byte(in_.name(), in_.scanner.position(), "the file ends inside \"" + array.name + "\"");
  }
  MAILLE_CHECK(budget_.take(size, 1));
  array.bytes.resize(size);
  with_type(array.type, [&](auto zero) {
    using T = decltype(zero);
    for (uint64_t i = 0; i < values; ++i) {
      std::byte* const to = array.bytes.data() + i * sizeof(T);
      std::memcpy(to, from + i * sizeof(T), sizeof(T));
      std::reverse(to, to + sizeof(T));
    }
  });
  in_.scanner.jump(from + size);
  return {};
}

/// Reads bits, eight to a byte, the first one highest, into bytes of 0 and 1.
Result<> VtkLegacyReader::read_bits(Array& array, uint64_t values) {
  const uint64_t size = (values + 7) / 8;
  const char* const from = in_.scanner.here();
  if (size > static_cast<uint64_t>(in_.scanner.end() - from)) {
    return malformed_byte(in_.name(), in_.scanner.position(), "the file ends inside \"" + array.name + "\"");
  }
  MAILLE_CHECK(budget_.take(values, 1));
  for (uint64_t i = 0; i < values; ++i) {
    const auto byte = static_cast<unsigned char>(from[i / 8]);
    array.bytes.push_back(static_cast<std::byte>((byte >> (7 - i % 8)) & 1));
  }
  in_.scanner.jump(from + size);
  return {};
}

Result<Array> VtkLegacyReader::read_array(const std::string& name, uint64_t count, uint32_t components,
                                          Role role) {
  Array array = make_array(name, domain_, Scalar::f32, components, role);
  const std::string type = lower_case(in_.word());
  MAILLE_CHECK(read_list(array, count, components, type));
  return array;
}

Result<std::vector<int64_t>> VtkLegacyReader::read_integers(uint64_t count, Scalar type) {
  Array array = make_array("cells", Domain::mesh, type, 1);
  if (count > text_.size()) return in_.malformed("there are more cells announced than the file can hold");
  if (binary_) in_.scanner.skip_line();
  MAILLE_CHECK(binary_ ? read_binary(array, count) : read_ascii(array, count));
  MAILLE_CHECK(budget_.take(count, sizeof(int64_t)));
  std::vector<int64_t> values(count);
  for (uint64_t i = 0; i < count; ++i) values[i] = static_cast<int64_t>(integer_at(array, i));
  return values;
}

Result<VtkLegacyReader::Cells> VtkLegacyReader::read_offsets(uint64_t offsets, uint64_t size) {
  Cells cells;
  const auto scalar_here = [&]() -> Result<Scalar> {
    const std::string type = lower_case(in_.word());
    const auto scalar = scalar_of_vtk_legacy(type);
    if (!scalar || is_float(*scalar))
      return in_.malformed("\"" + type.substr(0, 40) + "\" is no type of integers");
    return *scalar;
  };
  const Scalar type = MAILLE_TRY(scalar_here());
  cells.offsets = MAILLE_TRY(read_integers(offsets, type));
  skip_metadata();
  if (lower_case(in_.word()) != "connectivity")
    return in_.malformed("there should be CONNECTIVITY behind OFFSETS");
  const Scalar other = MAILLE_TRY(scalar_here());
  cells.connectivity = MAILLE_TRY(read_integers(size, other));
  // Checked here once, so that Cells::cell() needs no test.
  const auto inside = [&](int64_t offset) { return offset >= 0 && static_cast<uint64_t>(offset) <= size; };
  if (!std::all_of(cells.offsets.begin(), cells.offsets.end(), inside) ||
      !std::is_sorted(cells.offsets.begin(), cells.offsets.end())) {
    return in_.malformed("the offsets of the cells decrease or lie behind the end of the connectivity");
  }
  return cells;
}

/// Reads cells: "n size", then n lists, each led by its length; or from version 5.0 on offsets and
/// connectivity.
Result<VtkLegacyReader::Cells> VtkLegacyReader::read_cells() {
  const uint64_t count = MAILLE_TRY(in_.count("cells"));
  const uint64_t size = MAILLE_TRY(in_.count("entries of the cells"));
  const TextScanner before = in_.scanner;
  if (lower_case(in_.word()) == "offsets") return read_offsets(count, size);
  in_.scanner = before;
  std::vector<int64_t> entries = MAILLE_TRY(read_integers(size, Scalar::i32));
  Cells cells;
  MAILLE_CHECK(budget_.take(std::min(count, size) + 1, sizeof(int64_t)));
  cells.offsets.push_back(0);
  uint64_t at = 0, to = 0;
  for (uint64_t i = 0; i < count; ++i) {
    if (at >= size || entries[at] < 0 || static_cast<uint64_t>(entries[at]) > size - at - 1) {
      return in_.malformed("cell " + std::to_string(i) + " goes beyond the " + std::to_string(size) +
                           " entries of the cells");
    }
    // Lists move towards the front, by one entry more for each cell, so nothing is overwritten before it is
    // read.
    const auto length = static_cast<uint64_t>(entries[at++]);
    for (uint64_t k = 0; k < length; ++k) entries[to++] = entries[at++];
    cells.offsets.push_back(static_cast<int64_t>(to));
  }
  entries.resize(to);
  cells.connectivity = std::move(entries);
  return cells;
}

/// Skips sections METADATA, which end with an empty line; several may follow each other.
void VtkLegacyReader::skip_metadata() {
  TextScanner before = in_.scanner;
  for (; lower_case(in_.word()) == "metadata"; before = in_.scanner) {
    in_.scanner.skip_line();
    while (!in_.scanner.at_end() && !trim(in_.scanner.rest_of_line()).empty()) in_.scanner.skip_line_end();
  }
  in_.scanner = before;
}

Result<> VtkLegacyReader::add_array(Array array) {
  if (domain_ == Domain::mesh) {
    field_.arrays.push_back(std::move(array));
    return {};
  }
  if (array.count() != domain_count_) {
    notes_.push_back("array \"" + array.name + "\" has " + std::to_string(array.count()) + " tuples for " +
                     std::to_string(domain_count_) + " " + name_of(domain_) + "s; it is kept on the mesh");
    array.domain = Domain::mesh;
    field_.arrays.push_back(std::move(array));
    return {};
  }
  (domain_ == Domain::point ? point_arrays_ : cell_arrays_).push_back(std::move(array));
  return {};
}

/// Reads an array of texts; `count`: of tuples. Binary texts are led by their length, in 1, 2, 4 or 8 bytes.
Result<> VtkLegacyReader::read_strings(const std::string& name, uint32_t components, uint64_t count) {
  std::vector<std::string> strings;
  if (components == 0 || count > text_.size() / components)
    return in_.malformed("there are more texts announced than the file can hold");
  count *= components;
  in_.scanner.skip_line();
  for (uint64_t i = 0; i < count; ++i) {
    if (in_.scanner.at_end()) return in_.malformed("the file ends inside the texts of \"" + name + "\"");
    MAILLE_CHECK(budget_.take(1, sizeof(std::string)));
    if (!binary_) {
      strings.push_back(from_word(trim(in_.scanner.rest_of_line())));
      in_.scanner.skip_line_end();
      continue;
    }
    // The two highest bits tell how many bytes the length has.
    const auto left = [&] { return static_cast<uint64_t>(in_.scanner.end() - in_.scanner.here()); };
    const size_t sizes[] = {8, 4, 2, 1};
    const size_t size = sizes[static_cast<unsigned char>(in_.scanner.peek()) >> 6];
    if (size > left()) return in_.malformed("the file ends inside the texts of \"" + name + "\"");
    uint64_t length = static_cast<unsigned char>(*in_.scanner.here()) & 0x3f;
    for (size_t k = 1; k < size; ++k)
      length = length << 8 | static_cast<unsigned char>(in_.scanner.here()[k]);
    in_.scanner.jump(in_.scanner.here() + size);
    if (length > left()) return in_.malformed("the file ends inside the texts of \"" + name + "\"");
    strings.emplace_back(in_.scanner.here(), length);
    in_.scanner.jump(in_.scanner.here() + length);
  }
  if (domain_ != Domain::mesh) return add_array(texts_.numbers(name, domain_, components, strings));
  field_.strings.push_back({name, std::move(strings), false});
  return {};
}

/// Adds an array of a field, which may be one of our own.
Result<> VtkLegacyReader::add_field(Array array) {
  const std::string_view name = array.name;
  const std::string_view corner = vtk_corner_prefix, text = vtk_text_prefix;
  if (domain_ == Domain::mesh && name.starts_with(corner)) {
    array.name = std::string(name.substr(corner.size()));
    array.domain = Domain::corner;
  } else if (domain_ == Domain::mesh && array.type == Scalar::u8 && name.starts_with(text)) {
    field_.strings.push_back({std::string(name.substr(text.size())), split_texts(array.bytes), true});
    return {};
  }
  return add_array(std::move(array));
}

Result<> VtkLegacyReader::read_field() {
  next_word();  // its name
  const uint64_t arrays = MAILLE_TRY(in_.count("arrays"));
  for (uint64_t i = 0; i < arrays; ++i) {
    skip_metadata();
    // Ends the loop on a claimed number of arrays.
    if (in_.at_end()) return in_.malformed("the file ends before array " + std::to_string(i) + " of a field");
    const std::string name = from_word(next_word());
    const uint64_t components = MAILLE_TRY(in_.count("components"));
    const uint64_t count = MAILLE_TRY(in_.count("tuples"));
    const TextScanner before = in_.scanner;
    const auto width = static_cast<uint32_t>(std::min<uint64_t>(components, UINT32_MAX));
    if (lower_case(in_.word()) == "string") {
      MAILLE_CHECK(read_strings(name, width, count));
      continue;
    }
    in_.scanner = before;
    // VTK writes empty arrays so; they have no values but a type.
    if (components == 0 && count == 0) {
      next_word();
      continue;
    }
    Array array = MAILLE_TRY(read_array(name, count, width));
    MAILLE_CHECK(add_field(std::move(array)));
  }
  return {};
}

Result<> VtkLegacyReader::read_attribute(const std::string& keyword) {
  const std::string name = from_word(next_word());
  // In text, colours are floats of 0 to 1, else bytes.
  if (keyword == "lookup_table") {
    const uint64_t count = MAILLE_TRY(in_.count("colours"));
    Array table = make_array("lookup_table " + name, Domain::mesh, Scalar::u8, 4);
    MAILLE_CHECK(read_list(table, count, 4, binary_ ? "unsigned_char" : "float"));
    field_.arrays.push_back(std::move(table));
    return {};
  }
  if (keyword == "color_scalars") {
    const uint64_t components = MAILLE_TRY(in_.count("components"));
    Array colours = make_array(name, domain_, Scalar::u8, 1, Role::colour);
    const auto number = static_cast<uint32_t>(std::min<uint64_t>(components, UINT32_MAX));
    MAILLE_CHECK(read_list(colours, domain_count_, number, binary_ ? "unsigned_char" : "float"));
    return add_array(std::move(colours));
  }
  uint32_t components = keyword == "tensors"                           ? 9
                        : keyword == "tensors6"                        ? 6
                        : keyword == "vectors" || keyword == "normals" ? 3
                                                                       : 1;
  if (keyword == "texture_coordinates") {
    components = static_cast<uint32_t>(std::min<uint64_t>(MAILLE_TRY(in_.count("components")), UINT32_MAX));
  }
  const Role role = keyword == "normals"               ? Role::normal
                    : keyword == "texture_coordinates" ? Role::texture_coordinate
                                                       : Role::none;
  if (keyword != "scalars") {
    Array array = MAILLE_TRY(read_array(name, domain_count_, components, role));
    return add_array(std::move(array));
  }
  const std::string type = lower_case(in_.word());
  in_.scanner.skip_blanks();
  if (!in_.scanner.at_line_end())
    components = static_cast<uint32_t>(std::min<uint64_t>(MAILLE_TRY(in_.count("components")), UINT32_MAX));
  const TextScanner before = in_.scanner;
  if (lower_case(in_.word()) == "lookup_table") {
    next_word();
  } else {
    in_.scanner = before;
  }
  Array array = make_array(name, domain_, Scalar::f32, components);
  MAILLE_CHECK(read_list(array, domain_count_, components, type));
  return add_array(std::move(array));
}

Result<> VtkLegacyReader::read_geometry(const std::string& keyword) {
  if (keyword == "points") {
    const uint64_t count = MAILLE_TRY(in_.count("points"));
    const std::string type = lower_case(in_.word());
    return read_list(mesh_.points, count, 3, type);
  }
  if (keyword == "dimensions") {
    for (int64_t& dimension : dimensions_) {
      if (!in_.integer(dimension) || dimension < 1 || dimension > UINT32_MAX)
        return in_.expected("three numbers of points");
    }
    return {};
  }
  if (keyword == "origin" || keyword == "spacing" || keyword == "aspect_ratio") {
    for (double& value : keyword == "origin" ? origin_ : spacing_) {
      Number number;
      if (!in_.number(number)) return in_.expected("three numbers");
      value = number.value;
    }
    return {};
  }
  for (size_t axis = 0; axis < 3; ++axis) {
    static constexpr const char* names[] = {"x_coordinates", "y_coordinates", "z_coordinates"};
    if (keyword != names[axis]) continue;
    const uint64_t count = MAILLE_TRY(in_.count("coordinates"));
    coordinates_[axis] = MAILLE_TRY(read_array(keyword, count, 1));
    return {};
  }
  if (keyword == "cell_types") {
    const uint64_t count = MAILLE_TRY(in_.count("cells"));
    types_ = MAILLE_TRY(read_integers(count, Scalar::i32));
    return {};
  }
  Cells& cells = keyword == "cells"      ? cells_
                 : keyword == "vertices" ? verts_
                 : keyword == "lines"    ? lines_
                 : keyword == "polygons" ? polys_
                                         : strips_;
  cells = MAILLE_TRY(read_cells());
  return {};
}

Result<> VtkLegacyReader::read_section(const std::string& keyword) {
  static constexpr std::string_view geometry[] = {
      "points",        "dimensions",    "origin",        "spacing",        "aspect_ratio",
      "x_coordinates", "y_coordinates", "z_coordinates", "cells",          "cell_types",
      "vertices",      "lines",         "polygons",      "triangle_strips"};
  static constexpr std::string_view attributes[] = {
      "scalars", "color_scalars", "lookup_table", "vectors",      "normals",   "texture_coordinates",
      "tensors", "tensors6",      "global_ids",   "pedigree_ids", "edge_flags"};
  if (keyword == "dataset") {
    const std::string kind = lower_case(in_.word());
    if (kind == "unstructured_grid")
      shape_ = Shape::unstructured;
    else if (kind == "polydata")
      shape_ = Shape::poly_data;
    else if (kind == "structured_grid")
      shape_ = Shape::structured;
    else if (kind == "rectilinear_grid")
      shape_ = Shape::rectilinear;
    else if (kind == "structured_points" || kind == "image_data")
      shape_ = Shape::image;
    else
      return failure(ErrorCode::unsupported, in_.name() + ": it holds a VTK data set of type \"" +
                                                 kind.substr(0, 40) + "\", which cannot be read");
    return {};
  }
  if (keyword == "field") return read_field();
  if (keyword == "point_data" || keyword == "cell_data") {
    domain_ = keyword == "point_data" ? Domain::point : Domain::cell;
    domain_count_ = MAILLE_TRY(in_.count("tuples"));
    return {};
  }
  if (std::find(std::begin(geometry), std::end(geometry), keyword) != std::end(geometry))
    return read_geometry(keyword);
  if (std::find(std::begin(attributes), std::end(attributes), keyword) != std::end(attributes))
    return read_attribute(keyword);
  return in_.malformed("\"" + keyword.substr(0, 40) + "\" is no keyword of VTK files");
}

// Blocks come first, as arrays on cells refer to the order of cells, which no block changes. A block that our
// writer told of is used only if it fits the cells.
void VtkLegacyReader::finish_fields() {
  const Array sizes = field_.take_array(vtk_blocks_name).value_or(Array());
  const std::vector<NamedRun> shapes = vtk_block_shapes(sizes, field_.take_strings(vtk_block_names_name));
  mesh_.blocks = !shapes.empty() && store_.fits(shapes) ? store_.take(shapes) : store_.take();
  for (auto* arrays : {&point_arrays_, &cell_arrays_, &field_.arrays}) {
    for (Array& array : *arrays) mesh_.arrays.push_back(std::move(array));
    arrays->clear();
  }
  const std::vector<std::string> roles = field_.take_strings(vtk_roles_name);
  for (Array& array : mesh_.arrays) {
    for (const Role role :
         {Role::normal, Role::colour, Role::texture_coordinate, Role::tangent, Role::label}) {
      const std::string line = std::string(name_of(array.domain)) + " " + name_of(role) + " " + array.name;
      if (std::find(roles.begin(), roles.end(), line) != roles.end()) array.role = role;
    }
    field_.give_labels(array);
  }
  field_.move_to(mesh_, texts_);
  texts_.finish(mesh_);
  check_vtk_corner_arrays(mesh_, notes_);
}

Result<ReadResult> VtkLegacyReader::read() {
  MAILLE_CHECK(read_header());
  for (skip_metadata(); !in_.at_end(); skip_metadata()) MAILLE_CHECK(read_section(lower_case(in_.word())));
  MAILLE_CHECK(finish_cells());
  finish_fields();
  // Sizes are checked at the end: POINT_DATA may stand before the points.
  for (const Array& array : mesh_.arrays) {
    if (array.domain == Domain::mesh || array.count() == mesh_.count_of(array.domain)) continue;
    return in_.malformed("array \"" + array.name + "\" has " + std::to_string(array.count()) +
                         " tuples for " + std::to_string(mesh_.count_of(array.domain)) + " " +
                         name_of(array.domain) + "s");
  }
  if (auto ok = validate(mesh_); !ok) {
    return failure(ErrorCode::malformed_input, in_.name() + ": " + ok.error().message);
  }
  return ReadResult{std::move(mesh_), std::move(notes_)};
}

namespace {

bool recognise_vtk(Bytes first_bytes) {
  const std::string_view text(reinterpret_cast<const char*>(first_bytes.data()), first_bytes.size());
  return lower_case(text.substr(0, 14)) == "# vtk datafile";
}

}  // namespace

std::optional<Scalar> scalar_of_vtk_legacy(std::string_view name) {
  for (const auto& known : legacy_scalars) {
    if (name == known.name) return known.type;
  }
  return std::nullopt;
}

const char* vtk_legacy_name_of(Scalar type) {
  for (const auto& known : legacy_scalars) {
    if (type == known.type) return known.name;
  }
  return "";
}

Result<ReadResult> read_vtk_legacy(const Source& source, const ReadOptions& options) {
  const InputBytes input = MAILLE_TRY(InputBytes::load(source));
  return VtkLegacyReader(input.text(), source.name(), options).read();
}

const Format& vtk_legacy_format() {
  static const Format format{{"vtk", {".vtk"}, "legacy VTK: grids and polygons, in ascii or binary", true},
                             recognise_vtk,
                             read_vtk_legacy,
                             write_vtk_legacy};
  return format;
}

}  // namespace maille
