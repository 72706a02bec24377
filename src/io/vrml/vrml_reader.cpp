#include <algorithm>
#include <map>

#include "base/bytes.h"
#include "base/result.h"
#include "io/budget.h"
#include "io/reading.h"
#include "io/vrml/vrml.h"
#include "io/vrml/vrml_scene.h"

namespace maille {
namespace {

constexpr VrmlKind attribute_kinds[] = {VrmlKind::normal, VrmlKind::colour, VrmlKind::texture_coordinate};
constexpr const char* index_fields[vrml_kinds] = {"coordIndex", "normalIndex", "colorIndex", "texCoordIndex"};

Array array_for(VrmlKind kind, Domain domain, Scalar type) {
  static constexpr const char* names[vrml_kinds] = {"position", "normal", "colour", "texcoord"};
  static constexpr Role roles[vrml_kinds] = {Role::none, Role::normal, Role::colour,
                                             Role::texture_coordinate};
  const auto k = static_cast<size_t>(kind);
  return make_array(names[k], domain, type, components_of(kind), roles[k]);
}

/// Makes a mesh of the geometries, one block for each. Arrays are made when the first geometry has values for
/// them, and are zero where others have none.
class Builder {
 public:
  Builder(VrmlScene scene, const std::string& file, uint64_t file_bytes, const Limits& limits)
      : scene_(std::move(scene)), file_(file), budget_(file, file_bytes, limits) {}

  Result<ReadResult> build();

 private:
  Result<uint64_t> add_points(const VrmlGeometry& geometry);
  Result<> add_block(VrmlGeometry& geometry, uint64_t first_point, uint64_t points);
  Result<> add_attribute(const VrmlGeometry& geometry, VrmlKind kind);
  Result<> put_on_points(const VrmlGeometry& geometry, VrmlKind kind);
  Result<> put_on_corners(const VrmlGeometry& geometry, VrmlKind kind, const std::vector<int32_t>& index);
  Result<> put_on_cells(const VrmlGeometry& geometry, VrmlKind kind);
  Result<std::byte*> tuples(VrmlKind kind, Domain domain, Scalar type, uint64_t first, uint64_t count);
  Result<> copy(const VrmlValues& values, VrmlKind kind, int64_t from, const VrmlGeometry& geometry,
                std::byte*& to) const;
  void add_notes();
  tl::unexpected<Error> malformed(const VrmlGeometry& geometry, const std::string& what) const {
    return malformed_line(file_, geometry.line, "the geometry that begins here: " + what);
  }

  VrmlScene scene_;
  const std::string& file_;
  Budget budget_;
  Mesh mesh_;
  std::map<const VrmlValues*, uint64_t> first_points_;
  std::map<std::pair<VrmlKind, Domain>, Array> arrays_;
  std::map<std::pair<VrmlKind, Domain>, uint64_t> filled_;                ///< tuples
  std::map<std::pair<VrmlKind, uint64_t>, const VrmlValues*> on_points_;  ///< by first point
  /// Of the current geometry.
  uint64_t first_point_ = 0, points_ = 0, first_corner_ = 0, first_cell_ = 0;
  uint64_t next_cell_ = 0, next_corner_ = 0;
  std::vector<std::string> notes_;
};

// The number of the first point of a geometry. Geometries that share a Coordinate node share its points.
Result<uint64_t> Builder::add_points(const VrmlGeometry& geometry) {
  const VrmlValues* values = geometry.values[0].get();
  const auto [known, is_new] = first_points_.emplace(values, mesh_.point_count());
  if (!is_new) return known->second;
  if (values->numbers() / 3 > max_points - mesh_.point_count())
    return malformed(geometry, "2^32 points or more");
  MAILLE_CHECK(budget_.take(values->bytes.size(), 1));
  // The parser reads all nodes of a kind in the same type, so this never changes half-way.
  mesh_.points.type = values->type;
  mesh_.points.bytes.insert(mesh_.points.bytes.end(), values->bytes.begin(), values->bytes.end());
  return known->second;
}

Result<> Builder::add_block(VrmlGeometry& geometry, uint64_t first_point, uint64_t points) {
  CellBlock block;
  block.name = geometry.name;
  if (geometry.type == VrmlGeometry::Type::points) {
    block.type = CellType::vertex;
    for (uint64_t i = 0; i < points; ++i)
      block.connectivity.push_back(static_cast<uint32_t>(first_point + i));
  } else {
    const bool faces = geometry.type == VrmlGeometry::Type::faces;
    std::vector<int32_t>& index = geometry.indices[0];
    if (!index.empty() && index.back() >= 0) index.push_back(-1);  // the last separator may be missing
    block.type = faces ? CellType::polygon : CellType::poly_line;
    block.offsets.push_back(0);
    for (const int32_t i : index) {
      if (i < -1 || i >= static_cast<int64_t>(points)) {
        return malformed(geometry, "coordIndex has " + std::to_string(i) + ", but there are " +
                                       std::to_string(points) + " points");
      }
      if (i < 0) {
        block.offsets.push_back(block.connectivity.size());
      } else {
        block.connectivity.push_back(static_cast<uint32_t>(first_point + static_cast<uint64_t>(i)));
      }
    }
    const uint64_t cells = block.size();
    const auto all = [&](uint64_t n) {
      for (uint64_t i = 0; i <= cells; ++i) {
        if (block.offsets[i] != i * n) return false;
      }
      return cells != 0;
    };
    const CellType uniform = faces ? (all(3)   ? CellType::triangle
                                      : all(4) ? CellType::quad
                                               : block.type)
                                   : (all(2) ? CellType::line : block.type);
    // Blocks of one type with a fixed number of nodes have no offsets.
    if (uniform != block.type) block.offsets.clear();
    block.type = uniform;
  }
  mesh_.blocks.push_back(std::move(block));
  return {};
}

/// Makes room for tuples of an array. What lies before and was never set is zero. The pointer holds until the
/// next call.
Result<std::byte*> Builder::tuples(VrmlKind kind, Domain domain, Scalar type, uint64_t first,
                                   uint64_t count) {
  auto [found, is_new] = arrays_.try_emplace({kind, domain}, array_for(kind, domain, type));
  filled_[{kind, domain}] += count;
  Array& array = found->second;
  if (first + count > array.count()) {
    MAILLE_CHECK(budget_.take(first + count - array.count(), array.tuple_size()));
    array.resize(first + count);
  }
  return array.bytes.data() + first * array.tuple_size();
}

Result<> Builder::copy(const VrmlValues& values, VrmlKind kind, int64_t from, const VrmlGeometry& geometry,
                       std::byte*& to) const {
  const uint64_t components = components_of(kind);
  if (from < 0 || static_cast<uint64_t>(from) >= values.numbers() / components) {
    return malformed(geometry, std::string(index_fields[static_cast<size_t>(kind)]) +
                                   " or the order of elements needs entry " + std::to_string(from) + " of " +
                                   std::to_string(values.numbers() / components));
  }
  const size_t size = components * size_of(values.type);
  std::memcpy(to, values.bytes.data() + static_cast<size_t>(from) * size, size);
  to += size;
  return {};
}

Result<> Builder::put_on_points(const VrmlGeometry& geometry, VrmlKind kind) {
  const VrmlValues& values = *geometry.values[static_cast<size_t>(kind)];
  // Remembered, so that another geometry on the same points with other values puts them on corners instead.
  // One with the same values has nothing to add.
  if (!on_points_.try_emplace({kind, first_point_}, &values).second) return {};
  std::byte* to = MAILLE_TRY(tuples(kind, Domain::point, values.type, first_point_, points_));
  const uint64_t count = std::min(points_, values.numbers() / components_of(kind));
  std::memcpy(to, values.bytes.data(), count * components_of(kind) * size_of(values.type));
  return {};
}

Result<> Builder::put_on_corners(const VrmlGeometry& geometry, VrmlKind kind,
                                 const std::vector<int32_t>& index) {
  const VrmlValues& values = *geometry.values[static_cast<size_t>(kind)];
  const std::vector<int32_t>& points = geometry.indices[0];
  // As in coordIndex, the last separator may be missing.
  const size_t separators = index.size() + 1 == points.size() && index.back() >= 0 ? 1 : 0;
  const auto same_shape = [&] {
    if (index.size() + separators != points.size()) return false;
    for (size_t i = 0; i < index.size(); ++i) {
      if ((index[i] < 0) != (points[i] < 0)) return false;
    }
    return true;
  };
  if (!same_shape()) {
    return malformed(geometry, std::string(index_fields[static_cast<size_t>(kind)]) +
                                   " does not have the same faces as coordIndex");
  }
  std::byte* to =
      MAILLE_TRY(tuples(kind, Domain::corner, values.type, first_corner_, next_corner_ - first_corner_));
  for (const int32_t i : index) {
    if (i >= 0) MAILLE_CHECK(copy(values, kind, i, geometry, to));
  }
  return {};
}

Result<> Builder::put_on_cells(const VrmlGeometry& geometry, VrmlKind kind) {
  const VrmlValues& values = *geometry.values[static_cast<size_t>(kind)];
  const std::vector<int32_t>& index = geometry.indices[static_cast<size_t>(kind)];
  const uint64_t cells = next_cell_ - first_cell_;
  if (!index.empty() && index.size() < cells) {
    return malformed(geometry, std::string(index_fields[static_cast<size_t>(kind)]) + " has " +
                                   std::to_string(index.size()) + " entries for " + std::to_string(cells) +
                                   " faces");
  }
  std::byte* to = MAILLE_TRY(tuples(kind, Domain::cell, values.type, first_cell_, cells));
  for (uint64_t i = 0; i < cells; ++i) {
    MAILLE_CHECK(copy(values, kind, index.empty() ? static_cast<int64_t>(i) : index[i], geometry, to));
  }
  return {};
}

/// Puts values where they belong: on cells where they are per face, on points where they follow the points'
/// numbers, otherwise on corners.
Result<> Builder::add_attribute(const VrmlGeometry& geometry, VrmlKind kind) {
  const auto k = static_cast<size_t>(kind);
  const VrmlValues* values = geometry.values[k].get();
  if (!values) return {};
  if (!geometry.per_vertex[k] && geometry.type != VrmlGeometry::Type::points)
    return put_on_cells(geometry, kind);
  const std::vector<int32_t>& points = geometry.indices[0];
  std::vector<int32_t> index = geometry.indices[k];
  // Only as long as the points say that the last separator is missing: then both may be compared entry by
  // entry.
  if (!index.empty() && index.back() >= 0 && index.size() + 1 == points.size()) index.push_back(-1);
  const bool follows = index.empty() || index == points;
  const uint64_t count = values->numbers() / components_of(kind);
  const auto before = on_points_.find({kind, first_point_});
  // Geometries may share points, and have other values on them.
  const bool free = before == on_points_.end() || before->second == values;
  if (follows && free && count == points_) return put_on_points(geometry, kind);
  if (geometry.type == VrmlGeometry::Type::points) {
    return malformed(geometry, std::to_string(count) + " colours for " + std::to_string(points_) + " points");
  }
  return put_on_corners(geometry, kind, index.empty() ? points : index);
}

void Builder::add_notes() {
  for (const auto& [type, count] : scene_.left_out) {
    if (count != 0)
      notes_.push_back(counted(count, type + " node") +
                       " left out: only indexed sets and point sets are read");
  }
  if (scene_.reused != 0)
    notes_.push_back(counted(scene_.reused, "repetition") + " of geometry (USE) left out: it is read once");
  if (scene_.clockwise != 0) {
    notes_.push_back(counted(scene_.clockwise, "geometry", "geometries") +
                     " with ccw FALSE: corners are kept in the order stored, clockwise");
  }
  if (scene_.transforms)
    notes_.push_back("transforms are not applied: positions are kept as stored, the transforms as metadata");
  if (scene_.materials || !scene_.textures.empty())
    notes_.push_back("not part of the mesh, left out: materials, textures");
}

Result<ReadResult> Builder::build() {
  for (VrmlGeometry& geometry : scene_.geometries) {
    if (!geometry.values[0]) {
      if (!geometry.indices[0].empty()) return malformed(geometry, "it has a coordIndex, but no coordinates");
      notes_.push_back("line " + std::to_string(geometry.line) + ": a geometry without coordinates left out");
      continue;
    }
    first_point_ = MAILLE_TRY(add_points(geometry));
    points_ = geometry.values[0]->numbers() / 3;
    first_cell_ = next_cell_;
    first_corner_ = next_corner_;
    MAILLE_CHECK(add_block(geometry, first_point_, points_));
    next_cell_ += mesh_.blocks.back().size();
    next_corner_ += mesh_.blocks.back().connectivity.size();
    for (const VrmlKind kind : attribute_kinds) MAILLE_CHECK(add_attribute(geometry, kind));
    if (geometry.transform.empty()) continue;
    mesh_.metadata.emplace_back("vrml.transform." + std::to_string(mesh_.blocks.size() - 1),
                                geometry.transform);
  }
  for (const std::string& texture : scene_.textures) mesh_.metadata.emplace_back("vrml.texture", texture);
  // Arrays end where the last geometry with values ended; they are filled up to the end of the mesh.
  for (auto& [key, array] : arrays_) {
    MAILLE_CHECK(budget_.take(mesh_.count_of(array.domain) - array.count(), array.tuple_size()));
    array.resize(mesh_.count_of(array.domain));
    if (filled_[key] < array.count()) {
      notes_.push_back("array \"" + array.name + "\" on " + name_of(array.domain) +
                       "s belongs to some of the geometries only; it is zero for the others");
    }
    mesh_.arrays.push_back(std::move(array));
  }
  if (mesh_.blocks.empty()) notes_.push_back("there is no IndexedFaceSet, IndexedLineSet or PointSet");
  add_notes();
  return ReadResult{std::move(mesh_), std::move(notes_)};
}

}  // namespace

Result<ReadResult> read_vrml(const Source& source, const ReadOptions& options) {
  const InputBytes input = MAILLE_TRY(InputBytes::load(source));
  const std::string file = source.name();
  VrmlScene scene = MAILLE_TRY(parse_vrml(input.text(), file, options));
  return Builder(std::move(scene), file, input.bytes().size(), options.limits).build();
}

}  // namespace maille
