#include "io/foam/foam_surface.h"

#include <maille/io.h>
#include <maille/path.h>
#include <filesystem>
#include <system_error>

#include "base/result.h"
#include "generate/transfinite_vector.h"
#include "io/cells.h"
#include "numbers/number_map.h"

namespace maille {
namespace {

// Reads one surface of a dictionary into a BlockSurface. Types and entries are known by their old and their
// new names.
class SurfaceReader {
 public:
  SurfaceReader(const FoamFile& file, const FoamDictionary::Entry& entry, const Limits& limits)
      : file_(file), entry_(entry), limits_(limits), dictionary_(*entry.dictionary) {}

  Result<BlockSurface> read(const std::string& name) {
    surface_.name = name;
    const std::string type = MAILLE_TRY(type_of());
    if (type == "sphere") {
      MAILLE_CHECK(with_radius(BlockSurface::Kind::sphere));
      surface_.a = MAILLE_TRY(position(find("origin") != nullptr ? "origin" : "centre"));
    } else if (type == "cylinder") {
      MAILLE_CHECK(with_radius(BlockSurface::Kind::cylinder));
      surface_.a = MAILLE_TRY(position("point1"));
      surface_.b = MAILLE_TRY(position("point2"));
    } else if (type == "plane") {
      MAILLE_CHECK(plane());
    } else if (type == "box") {
      surface_.kind = BlockSurface::Kind::box;
      surface_.a = MAILLE_TRY(position("min"));
      surface_.b = MAILLE_TRY(position("max"));
    } else if (type == "plate") {
      surface_.kind = BlockSurface::Kind::box;
      // A plate is a box without thickness in one direction.
      surface_.a = MAILLE_TRY(position("origin"));
      surface_.b = surface_.a + MAILLE_TRY(position("span"));
    } else if (type == "triSurfaceMesh") {
      MAILLE_CHECK(triangles());
    } else {
      return file_.unsupported(
          entry_.at, "surfaces of type '" + type +
                         "' are not supported; known: sphere, cylinder, plane, box, plate, triSurfaceMesh");
    }
    return std::move(surface_);
  }

 private:
  using Entry = FoamDictionary::Entry;

  const Entry* find(const char* keyword) const { return dictionary_.find(keyword); }
  Result<const Entry*> needed(const char* keyword) const {
    const Entry* entry = find(keyword);
    if (entry != nullptr && entry->dictionary == nullptr) return entry;
    return file_.bad(entry_.at, "surface '" + surface_.name + "' has no entry '" + keyword + "'");
  }

  /// The type of the surface; "searchableSphere" is a "sphere".
  Result<std::string> type_of() const {
    FoamCursor at(file_, *MAILLE_TRY(needed("type")));
    std::string type = MAILLE_TRY(at.word());
    constexpr std::string_view prefix = "searchable";
    if (type.starts_with(prefix) && type.size() > prefix.size()) {
      type = type.substr(prefix.size());
      // Makes the first letter small.
      type[0] = static_cast<char>(type[0] | 0x20);
    }
    return type;
  }
  Result<double> number(const char* keyword) const {
    FoamCursor at(file_, *MAILLE_TRY(needed(keyword)));
    return at.number();
  }
  Result<Position> position(const char* keyword) const {
    FoamCursor at(file_, *MAILLE_TRY(needed(keyword)));
    return read_foam_position(at);
  }
  Result<> with_radius(BlockSurface::Kind kind) {
    surface_.kind = kind;
    surface_.radius = MAILLE_TRY(number("radius"));
    return {};
  }

  /// Reads a plane. The numbers stand in the dictionary itself or in one of their own.
  Result<> plane() {
    surface_.kind = BlockSurface::Kind::plane;
    if (find("planeType") != nullptr) {
      FoamCursor at(file_, *find("planeType"));
      const std::string type = MAILLE_TRY(at.word());
      if (type != "pointAndNormal")
        return file_.unsupported(entry_.at,
                                 "planes of type '" + type + "' are not supported; known: pointAndNormal");
    }
    const Entry* inner = find("pointAndNormalDict");
    if (inner != nullptr && inner->dictionary != nullptr) dictionary_ = inner->dictionary->copy();
    surface_.a = MAILLE_TRY(position(find("point") != nullptr ? "point" : "basePoint"));
    surface_.b = MAILLE_TRY(position(find("normal") != nullptr ? "normal" : "normalVector"));
    return {};
  }

  // The file is read by read_mesh(), in any format it knows; polygons become fans of triangles.
  Result<> triangles() {
    surface_.kind = BlockSurface::Kind::triangles;
    std::string name = entry_.keyword;
    if (find("file") != nullptr) {
      FoamCursor at(file_, *find("file"));
      name = at.peek().text;
    }
    ReadOptions options;
    options.limits = limits_;
    const ReadResult read = MAILLE_TRY(read_mesh(MAILLE_TRY(path_of(name)), options));
    const double scale = find("scale") != nullptr ? MAILLE_TRY(number("scale")) : 1;
    const Array& points = read.mesh.points;
    for (uint64_t i = 0; i < points.count(); ++i) {
      Position p{};
      for (size_t k = 0; k < 3; ++k)
        p[k] =
            scale * number_as_double(points.type, points.bytes.data() + (3 * i + k) * size_of(points.type));
      surface_.points.push_back(p);
    }
    for_each_cell(read.mesh, [&](CellType type, uint64_t, uint64_t, std::span<const uint32_t> nodes) {
      if (!is_face(type)) return;
      for (size_t i = 2; i < nodes.size(); ++i)
        surface_.triangles.push_back({nodes[0], nodes[i - 1], nodes[i]});
    });
    return {};
  }

  /// The file of a surface. Names lead nowhere but into the folders of surfaces of the case, which lie beside
  /// the dictionary or up to two folders above.
  Result<std::string> path_of(const std::string& name) const {
    namespace fs = std::filesystem;
    if (name.empty() || name.find('/') != std::string::npos || name.find('\\') != std::string::npos ||
        name[0] == '.')
      return file_.unsupported(entry_.at,
                               "the file '" + name + "' of a surface outside of the case is not supported");
    fs::path folder = to_path(file_.files[0]).parent_path();
    std::error_code ignored;
    for (const char* up : {".", "..", "../.."}) {
      for (const char* of_surfaces : {"constant/triSurface", "constant/geometry"}) {
        for (const char* packed : {"", ".gz"}) {
          const fs::path path = folder / up / of_surfaces / to_path(name + packed);
          if (fs::is_regular_file(path, ignored)) return to_utf8(path);
        }
      }
    }
    return failure(ErrorCode::cannot_read, file_.place(entry_.at) + ": there is no '" + name +
                                               "' in constant/triSurface or constant/geometry of the case");
  }

  const FoamFile& file_;
  const Entry& entry_;
  const Limits& limits_;
  FoamDictionary dictionary_;
  BlockSurface surface_;
};

}  // namespace

Result<Position> read_foam_position(FoamCursor& at) {
  Position p{};
  MAILLE_CHECK(at.expect('('));
  for (double& x : p) x = MAILLE_TRY(at.number());
  MAILLE_CHECK(at.expect(')'));
  return p;
}

Result<BlockSurface> read_foam_surface(const FoamFile& file, const FoamDictionary::Entry& entry,
                                       const std::string& name, const Limits& limits) {
  return SurfaceReader(file, entry, limits).read(name);
}

}  // namespace maille
