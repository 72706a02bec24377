#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "base/bytes.h"
#include "base/result.h"
#include "io/buffered_writer.h"
#include "io/notes.h"
#include "io/reading.h"
#include "io/vrml/vrml.h"

namespace maille {
namespace {

/// Cells of one block that go into one geometry.
struct Shape {
  enum Type : size_t { faces, lines, points };
  std::vector<int64_t> corners;  ///< numbers of corners in the mesh, -1 behind each cell
  std::vector<uint64_t> cells;
};

/// An array with its place in VRML: "FIELD NODE { LIST [ numbers ] }".
struct Values {
  const char* field;  ///< of the geometry
  const char* node;
  const char* list;  ///< field of the node
  uint32_t components;
  const Array* array = nullptr;
};

class VrmlWriter {
 public:
  VrmlWriter(const Mesh& mesh, Sink& sink) : mesh_(mesh), out_(sink), file_(sink.name()) {}

  Result<std::vector<std::string>> write();

 private:
  void choose_arrays();
  void choose(Values& values, Role role);
  void put_block(size_t block);
  void add_cell(CellType type, std::span<const uint32_t> nodes, uint64_t cell, uint64_t corner);
  void put_shape(const Shape& shape, Shape::Type type, size_t block);
  void put_values(const Values& values, const Shape& shape, Shape::Type type);
  void put_tuple(const Values& values, uint64_t i);
  void put_coordinates(const Shape* only);
  void put_indices(const char* field, const Shape& shape, bool count_up);
  std::string transform_of(size_t block) const;
  std::string identifier(const std::string& name);
  void note_rest();

  const Mesh& mesh_;
  BufferedWriter out_;
  std::string file_;
  std::array<Values, 3> values_ = {Values{"normal", "Normal", "vector", 3},
                                   Values{"color", "Color", "color", 3},
                                   Values{"texCoord", "TextureCoordinate", "point", 2}};
  std::vector<uint32_t> points_;  ///< of each corner
  std::array<Shape, 3> shapes_;   ///< of the current block, by type
  // The cell and the corner that come next, counted over all blocks.
  uint64_t cell_ = 0, corner_ = 0;
  std::array<bool, 3> points_written_ = {};  ///< arrays on points whose node can be used again
  bool coordinates_written_ = false;
  uint64_t dropped_ = 0, copied_ = 0, renamed_ = 0, strips_ = 0, written_ = 0;
  std::vector<std::string> notes_;
};

/// Takes the first array that fits. Corners know most, then points, then cells.
void VrmlWriter::choose(Values& values, Role role) {
  for (const Domain domain : {Domain::corner, Domain::point, Domain::cell}) {
    for (const Array& array : mesh_.arrays) {
      const bool fits =
          array.components == values.components || (role == Role::colour && array.components == 4);
      const bool place = domain != Domain::cell || role != Role::texture_coordinate;
      // Without cells their arrays and those of corners say nothing, and VRML has no empty lists of colours.
      const bool holds_any = array.count() != 0;
      if (!values.array && array.role == role && array.domain == domain && fits && place && holds_any)
        values.array = &array;
    }
  }
}

void VrmlWriter::choose_arrays() {
  choose(values_[0], Role::normal);
  choose(values_[1], Role::colour);
  choose(values_[2], Role::texture_coordinate);
  const Array* colour = values_[1].array;
  if (colour && !is_float(colour->type)) {
    notes_.push_back("VRML colours are fractions: \"" + colour->name + "\" is divided by the largest " +
                     name_of(colour->type));
  }
  if (colour && colour->components == 4) notes_.push_back("VRML colours have no alpha: left out");
}

void VrmlWriter::note_rest() {
  for (const Array& array : mesh_.arrays) {
    const bool used = std::any_of(values_.begin(), values_.end(),
                                  [&](const Values& values) { return values.array == &array; });
    if (!used) note_array(array, notes_);
  }
  for (const auto& [key, value] : mesh_.metadata) note_metadata(key, value, notes_);
  note_nan_payloads(mesh_, notes_);
  const auto has_double = [](const Array& array) { return array.type == Scalar::f64; };
  if (has_double(mesh_.points) || std::any_of(values_.begin(), values_.end(), [&](const Values& v) {
        return v.array && has_double(*v.array);
      })) {
    notes_.push_back(
        "VRML numbers are single precision: all digits are written, other programs may round them");
  }
  if (dropped_ != 0)
    notes_.push_back(counted(dropped_, "volume or quadratic cell") + " left out: VRML has none");
  if (strips_ != 0) notes_.push_back(counted(strips_, "triangle strip") + " split into triangles");
  if (copied_ != 0)
    notes_.push_back(counted(copied_, "point") + " written again for point sets, which have no indices");
  if (renamed_ != 0)
    notes_.push_back(counted(renamed_, "block name") + " changed where VRML allows no such character");
}

// The fields of the transforms around a block, as the reader kept them. Metadata may come from a hostile file
// and is written as it is, so text with brackets, quotes or comments is left out: it could not be told from
// nodes.
std::string VrmlWriter::transform_of(size_t block) const {
  const std::string key = "vrml.transform." + std::to_string(block);
  for (const auto& [name, value] : mesh_.metadata) {
    const bool harmless = std::all_of(value.begin(), value.end(), [](char c) {
      return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
             std::string_view("+-. /").find(c) != std::string_view::npos;
    });
    if (name == key && harmless) return value;
  }
  return "";
}

/// A name as VRML allows it: names hold no blanks or brackets and do not start with a digit or sign.
std::string VrmlWriter::identifier(const std::string& name) {
  std::string id;
  for (const char c : name) {
    const bool bad = (c >= 0 && c <= ' ') || c == 127 || std::strchr("\"#',.[]\\{}", c) != nullptr;
    id += bad ? '_' : c;
  }
  if (!id.empty() && ((id[0] >= '0' && id[0] <= '9') || id[0] == '+' || id[0] == '-')) id = "_" + id;
  if (id != name) ++renamed_;
  return id;
}

// Adds a cell to the shape of its kind; corners are numbers in the whole mesh, so that arrays on corners can
// be looked up by them.
void VrmlWriter::add_cell(CellType type, std::span<const uint32_t> nodes, uint64_t cell, uint64_t corner) {
  const auto add = [&](Shape::Type shape, std::initializer_list<size_t> which) {
    for (const size_t k : which) shapes_[shape].corners.push_back(static_cast<int64_t>(corner + k));
    shapes_[shape].corners.push_back(-1);
    shapes_[shape].cells.push_back(cell);
  };
  const auto add_all = [&](Shape::Type shape) {
    for (size_t k = 0; k < nodes.size(); ++k)
      shapes_[shape].corners.push_back(static_cast<int64_t>(corner + k));
    shapes_[shape].corners.push_back(-1);
    shapes_[shape].cells.push_back(cell);
  };
  switch (type) {
    case CellType::triangle:
    case CellType::quad:
    case CellType::polygon:
      return add_all(Shape::faces);
    case CellType::line:
    case CellType::poly_line:
      return add_all(Shape::lines);
    case CellType::vertex:
    case CellType::poly_vertex:
      for (size_t k = 0; k < nodes.size(); ++k) add(Shape::points, {k});
      return;
    case CellType::pixel:
      // A pixel numbers its corners by rows; a face goes around.
      return add(Shape::faces, {0, 1, 3, 2});
    case CellType::triangle_strip:
      ++strips_;
      // Every second triangle of a strip is turned over, so that all are seen from the same side.
      for (size_t i = 0; i + 2 < nodes.size(); ++i) add(Shape::faces, {i, i + 1 + i % 2, i + 2 - i % 2});
      return;
    default:
      ++dropped_;
  }
}

void VrmlWriter::put_tuple(const Values& values, uint64_t i) {
  const Array& array = *values.array;
  const std::byte* from = array.bytes.data() + i * array.tuple_size();
  const size_t size = size_of(array.type);
  for (uint32_t k = 0; k < values.components; ++k) {
    if (k != 0) out_.put(' ');
    const bool fraction = array.role == Role::colour && !is_float(array.type);
    if (!fraction) {
      put_scalar(out_, from + k * size, array.type);
      continue;
    }
    with_type(array.type, [&](auto zero) {
      using T = decltype(zero);
      if constexpr (std::is_integral_v<T>) {
        const double most = static_cast<double>(std::numeric_limits<T>::max());
        out_.put_number(static_cast<float>(static_cast<double>(load<T>(from + k * size)) / most));
      }
    });
  }
  out_.put('\n');
}

/// Writes all points, or those of a point set. All points are written once, and other geometries refer to
/// them, so that the reader finds shared points again.
void VrmlWriter::put_coordinates(const Shape* only) {
  if (!only && coordinates_written_) {
    out_.put("coord USE maille_points\n");
    return;
  }
  out_.put(only ? "coord Coordinate { point [\n" : "coord DEF maille_points Coordinate { point [\n");
  Values positions{"coord", "Coordinate", "point", 3, &mesh_.points};
  if (only) {
    for (const int64_t corner : only->corners) {
      if (corner >= 0) put_tuple(positions, points_[static_cast<size_t>(corner)]);
    }
    copied_ += only->cells.size();
  } else {
    for (uint64_t i = 0; i < mesh_.point_count(); ++i) put_tuple(positions, i);
    coordinates_written_ = true;
  }
  out_.put("] }\n");
}

// Writes the points' numbers, or 0, 1, 2, ... for values that stand in the order of the corners.
void VrmlWriter::put_indices(const char* field, const Shape& shape, bool count_up) {
  out_.put(field);
  out_.put(" [\n");
  uint64_t next = 0;
  for (const int64_t corner : shape.corners) {
    if (corner < 0) {
      out_.put("-1\n");
      continue;
    }
    out_.put_number(count_up ? next++ : uint64_t{points_[static_cast<size_t>(corner)]});
    out_.put(' ');
  }
  out_.put("]\n");
}

void VrmlWriter::put_values(const Values& values, const Shape& shape, Shape::Type type) {
  const Array& array = *values.array;
  const bool normal = array.role == Role::normal;
  if (type != Shape::faces && array.role != Role::colour) return;  // VRML gives them to faces only
  const auto k = static_cast<size_t>(&values - values_.data());
  out_.put(values.field);
  // A PointSet has coordinates of its own, except the one of a mesh without cells.
  const bool whole = array.domain == Domain::point && (type != Shape::points || shape.corners.empty());
  const std::string name = std::string("maille_") + values.field;
  if (whole && points_written_[k]) {
    out_.put(" USE " + name + "\n");
    return;
  }
  out_.put(" " + (whole ? "DEF " + name + " " : std::string()) + values.node + " { " + values.list + " [\n");
  if (whole) {
    points_written_[k] = true;
    for (uint64_t i = 0; i < mesh_.point_count(); ++i) put_tuple(values, i);
  } else if (array.domain == Domain::cell) {
    for (const uint64_t cell : shape.cells) put_tuple(values, cell);
  } else {
    for (const int64_t corner : shape.corners) {
      if (corner < 0) continue;
      const auto c = static_cast<size_t>(corner);
      put_tuple(values, array.domain == Domain::corner ? c : points_[c]);
    }
  }
  out_.put("] }\n");
  if (type == Shape::points) return;
  if (array.domain == Domain::cell) out_.put(normal ? "normalPerVertex FALSE\n" : "colorPerVertex FALSE\n");
  if (array.domain == Domain::corner) put_indices((std::string(values.field) + "Index").c_str(), shape, true);
}

// Writes one geometry with the transforms of its block around it. A block past the last one stands for a mesh
// without cells.
void VrmlWriter::put_shape(const Shape& shape, Shape::Type type, size_t block) {
  static constexpr const char* nodes[3] = {"IndexedFaceSet", "IndexedLineSet", "PointSet"};
  std::string transform = block < mesh_.blocks.size() ? transform_of(block) : "";
  std::string close;
  while (!transform.empty()) {
    const size_t end = transform.find(" / ");
    out_.put("Transform { " + transform.substr(0, end) + " children [\n");
    close += "] }\n";
    transform = end == std::string::npos ? "" : transform.substr(end + 3);
  }
  const std::string name = block < mesh_.blocks.size() ? identifier(mesh_.blocks[block].name) : "";
  out_.put((name.empty() ? "" : "DEF " + name + " ") + "Shape {\ngeometry " + nodes[type] + " {\n");
  put_coordinates(type == Shape::points && !shape.corners.empty() ? &shape : nullptr);
  for (const Values& values : values_) {
    if (values.array) put_values(values, shape, type);
  }
  if (type != Shape::points) put_indices("coordIndex", shape, false);
  out_.put("} }\n" + close);
  ++written_;
}

// A block of several kinds of cells becomes several geometries: faces, then lines, then points.
void VrmlWriter::put_block(size_t b) {
  const CellBlock& block = mesh_.blocks[b];
  shapes_ = {};
  for (uint64_t i = 0; i < block.size(); ++i) {
    const std::span<const uint32_t> nodes = block.cell(i);
    add_cell(block.type == CellType::mixed ? static_cast<CellType>(block.types[i]) : block.type, nodes,
             cell_++, corner_);
    corner_ += nodes.size();
  }
  for (const Shape::Type type : {Shape::faces, Shape::lines, Shape::points}) {
    if (!shapes_[type].cells.empty()) put_shape(shapes_[type], type, b);
  }
}

Result<std::vector<std::string>> VrmlWriter::write() {
  choose_arrays();
  for (const CellBlock& block : mesh_.blocks) {
    points_.insert(points_.end(), block.connectivity.begin(), block.connectivity.end());
  }
  out_.put("#VRML V2.0 utf8\n");
  for (size_t b = 0; b < mesh_.blocks.size(); ++b) put_block(b);
  if (written_ == 0 && mesh_.cell_count() != 0) {
    return failure(ErrorCode::usage, file_ + ": VRML holds faces, lines and points, but the mesh has none");
  }
  if (written_ == 0 && mesh_.point_count() != 0) {
    put_shape({}, Shape::points, mesh_.blocks.size());
    notes_.push_back("there are no cells: the points are written as a PointSet");
  }
  note_rest();
  MAILLE_CHECK(out_.finish());
  return std::move(notes_);
}

}  // namespace

Result<std::vector<std::string>> write_vrml(const Mesh& mesh, Sink& sink, const WriteOptions&) {
  return VrmlWriter(mesh, sink).write();
}

}  // namespace maille
