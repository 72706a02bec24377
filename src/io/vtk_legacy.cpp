// Legacy VTK files, versions 1.0 to 5.1: a header of five lines, then sections that begin with a keyword.
// Binary numbers are big-endian and begin behind the line of their keyword.
#include "io/vtk_legacy.h"

#include <fast_float/fast_float.h>
#include <algorithm>
#include <cctype>

#include "io/buffered_writer.h"
#include "io/cell_store.h"
#include "io/format.h"
#include "io/token_reader.h"
#include "io/vtk_xml_reader.h"
#include "io/vtu.h"

namespace maille {
namespace {

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

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
}

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

class VtkReader {
 public:
  VtkReader(std::string_view text, const std::string& name, const ReadOptions& options)
      : in_(text, name), text_(text), options_(options), budget_(name, text.size(), options.limits) {}

  Result<ReadResult> read();

 private:
  enum class Shape { unstructured, poly_data, structured, rectilinear, image };
  /// A list of cells as the sections hold them.
  struct Cells {
    std::vector<int64_t> connectivity;
    std::vector<int64_t> offsets;  ///< one more than cells

    uint64_t count() const { return offsets.empty() ? 0 : offsets.size() - 1; }
    std::span<const int64_t> cell(uint64_t i) const {
      return std::span(connectivity)
          .subspan(static_cast<size_t>(offsets[i]), static_cast<size_t>(offsets[i + 1] - offsets[i]));
    }
  };

  Result<> read_header();
  Result<> read_section(const std::string& keyword);
  Result<> read_geometry(const std::string& keyword);
  Result<> read_attribute(const std::string& keyword);
  Result<> read_field();
  Result<> read_strings(const std::string& name, uint64_t count);
  Result<Cells> read_cells();
  Result<Cells> read_offsets(uint64_t offsets, uint64_t size);
  Result<> read_list(Array& array, uint64_t count, uint32_t components, const std::string& type);
  Result<> read_ascii(Array& array, uint64_t values);
  Result<> read_binary(Array& array, uint64_t values);
  Result<> read_bits(Array& array, uint64_t values);
  Result<Array> read_array(const std::string& name, uint64_t count, uint32_t components,
                           Role role = Role::none);
  Result<std::vector<int64_t>> read_integers(uint64_t count, Scalar type);
  Result<> add_array(Array array);
  void skip_metadata();
  std::string next_word() { return std::string(in_.word()); }

  Result<> finish_cells();
  Result<> finish_unstructured();
  Result<> add_poly_data(const Cells& cells, CellType single, CellType varying);
  Result<> add_nodes(std::span<const int64_t> nodes);
  Result<> finish_grid();
  Result<> make_grid_points();
  void finish_fields();

  TokenReader in_;
  std::string_view text_;
  const ReadOptions& options_;
  Budget budget_;
  bool binary_ = false;
  Shape shape_ = Shape::unstructured;
  Mesh mesh_;
  std::vector<std::string> notes_;
  Cells cells_, verts_, lines_, polys_, strips_;
  std::vector<int64_t> types_;
  CellStore store_;
  int64_t dimensions_[3] = {0, 0, 0};
  double origin_[3] = {0, 0, 0}, spacing_[3] = {1, 1, 1};
  Array coordinates_[3];
  Domain domain_ = Domain::mesh;
  uint64_t domain_count_ = 0;
  std::vector<Array> point_arrays_, cell_arrays_;
  VtkFieldData field_;
};

Result<> VtkReader::read_header() {
  TextScanner& scanner = in_.scanner;
  scanner.skip_byte_order_mark();
  const std::string first = lower_case(scanner.rest_of_line());
  if (!first.starts_with("# vtk datafile"))
    return in_.malformed("it does not begin with \"# vtk DataFile Version\"");
  scanner.skip_line_end();
  const std::string title(trim(scanner.rest_of_line()));
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

/// Skips the rest of the keyword's line and reads the values.
Result<> VtkReader::read_list(Array& array, uint64_t count, uint32_t components, const std::string& type) {
  if (components == 0 || components > 0xffff) return in_.malformed("an array has 1 to 65535 components");
  const auto scalar = scalar_of_vtk_legacy(type);
  if (!scalar) return in_.malformed("\"" + type.substr(0, 40) + "\" is no type of numbers");
  array.type = *scalar;
  array.components = components;
  if (count > text_.size() * 8 / components)
    return in_.malformed("\"" + array.name + "\" has more values than the file can hold");
  const uint64_t values = count * components;
  if (!binary_) return read_ascii(array, values);
  in_.scanner.skip_line();
  return type == "bit" ? read_bits(array, values) : read_binary(array, values);
}

Result<> VtkReader::read_ascii(Array& array, uint64_t values) {
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

Result<> VtkReader::read_binary(Array& array, uint64_t values) {
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

/// Eight to a byte, the first one highest.
Result<> VtkReader::read_bits(Array& array, uint64_t values) {
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

Result<Array> VtkReader::read_array(const std::string& name, uint64_t count, uint32_t components, Role role) {
  Array array = make_array(name, domain_, Scalar::f32, components, role);
  const std::string type = lower_case(in_.word());
  MAILLE_CHECK(read_list(array, count, components, type));
  return array;
}

Result<std::vector<int64_t>> VtkReader::read_integers(uint64_t count, Scalar type) {
  Array array = make_array("cells", Domain::mesh, type, 1);
  if (count > text_.size()) return in_.malformed("there are more cells announced than the file can hold");
  if (binary_) in_.scanner.skip_line();
  MAILLE_CHECK(binary_ ? read_binary(array, count) : read_ascii(array, count));
  MAILLE_CHECK(budget_.take(count, sizeof(int64_t)));
  std::vector<int64_t> values(count);
  for (uint64_t i = 0; i < count; ++i) values[i] = static_cast<int64_t>(integer_at(array, i));
  return values;
}

Result<VtkReader::Cells> VtkReader::read_offsets(uint64_t offsets, uint64_t size) {
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
  const auto inside = [&](int64_t offset) { return offset >= 0 && static_cast<uint64_t>(offset) <= size; };
  if (!std::all_of(cells.offsets.begin(), cells.offsets.end(), inside) ||
      !std::is_sorted(cells.offsets.begin(), cells.offsets.end())) {
    return in_.malformed("the offsets of the cells decrease or lie behind the end of the connectivity");
  }
  return cells;
}

/// "n size", then n lists, each led by its length; or from version 5.0 on offsets and connectivity.
Result<VtkReader::Cells> VtkReader::read_cells() {
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
    // Moves towards the front, so nothing is overwritten before it is read.
    const auto length = static_cast<uint64_t>(entries[at++]);
    for (uint64_t k = 0; k < length; ++k) entries[to++] = entries[at++];
    cells.offsets.push_back(static_cast<int64_t>(to));
  }
  entries.resize(to);
  cells.connectivity = std::move(entries);
  return cells;
}

/// Up to an empty line.
void VtkReader::skip_metadata() {
  const TextScanner before = in_.scanner;
  if (lower_case(in_.word()) != "metadata") {
    in_.scanner = before;
    return;
  }
  in_.scanner.skip_line();
  while (!in_.scanner.at_end() && !trim(in_.scanner.rest_of_line()).empty()) in_.scanner.skip_line_end();
  skip_metadata();
}

Result<> VtkReader::add_array(Array array) {
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

Result<> VtkReader::read_strings(const std::string& name, uint64_t count) {
  std::vector<std::string> strings;
  if (count > text_.size()) return in_.malformed("there are more texts announced than the file can hold");
  in_.scanner.skip_line();
  for (uint64_t i = 0; i < count; ++i) {
    if (in_.scanner.at_end()) return in_.malformed("the file ends inside the texts of \"" + name + "\"");
    if (!binary_) {
      strings.push_back(from_word(trim(in_.scanner.rest_of_line())));
      in_.scanner.skip_line_end();
      continue;
    }
    // The two highest bits tell the size of the length.
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
  if (domain_ == Domain::mesh) {
    field_.strings.emplace_back(name, std::move(strings));
  } else {
    notes_.push_back("array \"" + name + "\" on " + name_of(domain_) + "s holds text and was left out");
  }
  return {};
}

Result<> VtkReader::read_field() {
  next_word();  // its name
  const uint64_t arrays = MAILLE_TRY(in_.count("arrays"));
  for (uint64_t i = 0; i < arrays; ++i) {
    skip_metadata();
    if (in_.at_end()) return in_.malformed("the file ends before array " + std::to_string(i) + " of a field");
    const std::string name = from_word(next_word());
    const uint64_t components = MAILLE_TRY(in_.count("components"));
    const uint64_t count = MAILLE_TRY(in_.count("tuples"));
    const TextScanner before = in_.scanner;
    if (lower_case(in_.word()) == "string") {
      MAILLE_CHECK(read_strings(name, count));
      continue;
    }
    in_.scanner = before;
    if (components == 0 && count == 0) {
      next_word();
      continue;
    }
    Array array = MAILLE_TRY(
        read_array(name, count, static_cast<uint32_t>(std::min<uint64_t>(components, UINT32_MAX))));
    if (domain_ == Domain::mesh && name.starts_with(vtk_corner_prefix)) {
      array.name = name.substr(std::string_view(vtk_corner_prefix).size());
      array.domain = Domain::corner;
    }
    MAILLE_CHECK(add_array(std::move(array)));
  }
  return {};
}

Result<> VtkReader::read_attribute(const std::string& keyword) {
  const std::string name = from_word(next_word());
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

Result<> VtkReader::read_geometry(const std::string& keyword) {
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

Result<> VtkReader::read_section(const std::string& keyword) {
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

Result<> VtkReader::add_nodes(std::span<const int64_t> nodes) {
  for (const int64_t node : nodes) {
    if (node < 0 || static_cast<uint64_t>(node) >= mesh_.point_count()) {
      return failure(ErrorCode::malformed_input, in_.name() + ": cell " + std::to_string(store_.count()) +
                                                     " uses point " + std::to_string(node) +
                                                     ", but there are " +
                                                     std::to_string(mesh_.point_count()) + " points");
    }
    store_.nodes.push_back(static_cast<uint32_t>(node));
  }
  return {};
}

Result<> VtkReader::finish_unstructured() {
  if (types_.size() != cells_.count()) {
    return in_.malformed("there are " + std::to_string(cells_.count()) + " cells but types of " +
                         std::to_string(types_.size()));
  }
  for (uint64_t i = 0; i < cells_.count(); ++i) {
    const auto type = static_cast<CellType>(types_[i] < 0 || types_[i] > 254 ? 255 : types_[i]);
    std::span<const int64_t> list = cells_.cell(i);
    if (type == CellType::polyhedron) {
      const auto bad = [&] {
        return in_.malformed("the faces of cell " + std::to_string(i) +
                             ", a polyhedron, end too early or too late");
      };
      if (list.empty()) return bad();
      int64_t faces = list[0];
      for (list = list.subspan(1); faces > 0; --faces) {
        if (list.empty() || list[0] < 0 || static_cast<uint64_t>(list[0]) > list.size() - 1) return bad();
        const auto size = static_cast<size_t>(list[0]);
        MAILLE_CHECK(add_nodes(list.subspan(1, size)));
        store_.face_sizes.push_back(static_cast<uint32_t>(size));
        list = list.subspan(size + 1);
      }
      if (!list.empty()) return bad();
    } else {
      MAILLE_CHECK(add_nodes(list));
    }
    store_.end_cell(type);
  }
  return {};
}

/// Cells of `single` number of nodes each, or of any.
Result<> VtkReader::add_poly_data(const Cells& cells, CellType single, CellType varying) {
  const auto all = [&](unsigned nodes) {
    for (uint64_t i = 0; i < cells.count(); ++i) {
      if (cells.cell(i).size() != nodes) return false;
    }
    return true;
  };
  CellType type = all(nodes_of(single)) ? single : varying;
  if (type == CellType::polygon && all(4)) type = CellType::quad;
  for (uint64_t i = 0; i < cells.count(); ++i) {
    MAILLE_CHECK(add_nodes(cells.cell(i)));
    store_.end_cell(type);
  }
  return {};
}

Result<> VtkReader::make_grid_points() {
  const uint64_t points = static_cast<uint64_t>(dimensions_[0]) * static_cast<uint64_t>(dimensions_[1]);
  if (points > max_points || points * static_cast<uint64_t>(dimensions_[2]) > max_points) {
    return in_.malformed("the grid has 2^32 points or more");
  }
  MAILLE_CHECK(budget_.take(points * static_cast<uint64_t>(dimensions_[2]), 3 * sizeof(double)));
  mesh_.points.type = Scalar::f64;
  mesh_.points.resize(points * static_cast<uint64_t>(dimensions_[2]));
  const auto coordinate = [&](size_t axis, int64_t i) {
    if (shape_ == Shape::image) return origin_[axis] + spacing_[axis] * static_cast<double>(i);
    const Array& values = coordinates_[axis];
    return with_type(values.type, [&](auto zero) {
      return static_cast<double>(values.values<decltype(zero)>()[static_cast<size_t>(i)]);
    });
  };
  double* to = mesh_.points.values<double>().data();
  for (int64_t k = 0; k < dimensions_[2]; ++k) {
    for (int64_t j = 0; j < dimensions_[1]; ++j) {
      for (int64_t i = 0; i < dimensions_[0]; ++i, to += 3) {
        to[0] = coordinate(0, i);
        to[1] = coordinate(1, j);
        to[2] = coordinate(2, k);
      }
    }
  }
  return {};
}

/// Hexahedra, or quads, lines or a vertex where the grid is thin.
Result<> VtkReader::finish_grid() {
  if (dimensions_[0] == 0) return in_.malformed("there are no DIMENSIONS");
  for (size_t axis = 0; shape_ == Shape::rectilinear && axis < 3; ++axis) {
    if (coordinates_[axis].components != 1 ||
        coordinates_[axis].count() != static_cast<uint64_t>(dimensions_[axis])) {
      return in_.malformed("there are not as many coordinates as DIMENSIONS say");
    }
  }
  if (shape_ != Shape::structured) MAILLE_CHECK(make_grid_points());
  const auto nx = static_cast<uint64_t>(dimensions_[0]), ny = static_cast<uint64_t>(dimensions_[1]),
             nz = static_cast<uint64_t>(dimensions_[2]);
  if (nx > max_points || nx * ny > max_points || nx * ny * nz != mesh_.point_count()) {
    return in_.malformed("there are " + std::to_string(mesh_.point_count()) +
                         " points, not as many as DIMENSIONS say");
  }
  // Steps along the axes that have cells; the cells are then the same in every number of dimensions.
  std::vector<std::pair<uint64_t, uint64_t>> axes;
  const uint64_t strides[] = {1, nx, nx * ny};
  for (size_t axis = 0; axis < 3; ++axis) {
    if (dimensions_[axis] > 1) axes.emplace_back(static_cast<uint64_t>(dimensions_[axis]) - 1, strides[axis]);
  }
  const size_t thick = axes.size();
  axes.resize(3, {1, 0});
  static constexpr CellType types[] = {CellType::vertex, CellType::line, CellType::quad,
                                       CellType::hexahedron};
  const size_t nodes = size_t{1} << thick;
  const uint64_t cells = axes[0].first * axes[1].first * axes[2].first;
  MAILLE_CHECK(budget_.take(cells, nodes * sizeof(uint32_t) + 1));
  const uint64_t a = axes[0].second, b = axes[1].second, c = axes[2].second;
  const uint64_t steps[8] = {0, a, a + b, b, c, a + c, a + b + c, b + c};
  for (uint64_t k = 0; k < axes[2].first; ++k) {
    for (uint64_t j = 0; j < axes[1].first; ++j) {
      for (uint64_t i = 0; i < axes[0].first; ++i) {
        const uint64_t first = i * a + j * b + k * c;
        for (size_t n = 0; n < nodes; ++n) store_.nodes.push_back(static_cast<uint32_t>(first + steps[n]));
      }
    }
  }
  store_.end_cells(cells, types[thick], nodes);
  return {};
}

Result<> VtkReader::finish_cells() {
  if (mesh_.point_count() > max_points) return in_.malformed("there are 2^32 points or more");
  if (shape_ == Shape::unstructured) return finish_unstructured();
  if (shape_ != Shape::poly_data) return finish_grid();
  MAILLE_CHECK(add_poly_data(verts_, CellType::vertex, CellType::poly_vertex));
  MAILLE_CHECK(add_poly_data(lines_, CellType::line, CellType::poly_line));
  MAILLE_CHECK(add_poly_data(polys_, CellType::triangle, CellType::polygon));
  return add_poly_data(strips_, CellType::triangle_strip, CellType::triangle_strip);
}

void VtkReader::finish_fields() {
  const Array sizes = field_.take_array(vtu_blocks_name).value_or(Array());
  const std::vector<NamedRun> shapes = vtk_block_shapes(sizes, field_.take_strings(vtu_block_names_name));
  mesh_.blocks = !shapes.empty() && store_.fits(shapes) ? store_.take(shapes) : store_.take();
  for (auto* arrays : {&point_arrays_, &cell_arrays_, &field_.arrays}) {
    for (Array& array : *arrays) mesh_.arrays.push_back(std::move(array));
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
  for (auto& entry : field_.metadata()) mesh_.metadata.push_back(std::move(entry));
  check_vtk_corner_arrays(mesh_, notes_);
}

Result<ReadResult> VtkReader::read() {
  MAILLE_CHECK(read_header());
  for (skip_metadata(); !in_.at_end(); skip_metadata()) MAILLE_CHECK(read_section(lower_case(in_.word())));
  MAILLE_CHECK(finish_cells());
  finish_fields();
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
  return VtkReader(input.text(), source.name(), options).read();
}

const Format& vtk_legacy_format() {
  static const Format format{{"vtk", {".vtk"}, "legacy VTK: grids and polygons, in ascii or binary", true},
                             recognise_vtk,
                             read_vtk_legacy,
                             write_vtk_legacy};
  return format;
}

}  // namespace maille
