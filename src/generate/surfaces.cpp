#include "generate/surfaces.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/result.h"
#include "generate/transfinite_vector.h"
#include "random/read/triangle_tree.h"

namespace maille {
namespace {

using Kind = BlockSurface::Kind;

bool is_finite(const Position& p) {
  return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
}

/// Some direction of length 1 across another one: across its smallest component, where the product is
/// longest.
Position across(const Position& direction) {
  const unsigned least = std::fabs(direction[0]) <= std::fabs(direction[1])
                             ? (std::fabs(direction[0]) <= std::fabs(direction[2]) ? 0u : 2u)
                             : (std::fabs(direction[1]) <= std::fabs(direction[2]) ? 1u : 2u);
  Position axis{};
  axis[least] = 1;
  const Position found = cross(direction, axis);
  return (1 / length(found)) * found;
}

Position nearest_on_segment(const Position& p, const Position& a, const Position& b) {
  const Position ab = b - a;
  const double square = dot(ab, ab);
  const double t = square > 0 ? std::clamp(dot(p - a, ab) / square, 0.0, 1.0) : 0;
  return a + t * ab;
}

Position nearest_on_triangle(const Position& p, const Position& a, const Position& b, const Position& c) {
  const Position n = cross(b - a, c - a);
  const double area = dot(n, n);
  // Inside of the three edges the foot of the perpendicular is nearest, otherwise a point of an edge.
  if (area > 0 && dot(cross(b - a, p - a), n) >= 0 && dot(cross(c - b, p - b), n) >= 0 &&
      dot(cross(a - c, p - c), n) >= 0)
    return p - (dot(p - a, n) / area) * n;
  Position best = nearest_on_segment(p, a, b);
  for (const Position& other : {nearest_on_segment(p, b, c), nearest_on_segment(p, c, a)}) {
    if (length(p - other) < length(p - best)) best = other;
  }
  return best;
}

}  // namespace

/// One surface of a description. Triangles are found by a tree over floats in the unit box; the point itself
/// is computed in doubles.
class Surfaces::Surface {
 public:
  static Result<std::unique_ptr<Surface>> make(const BlockSurface& given) {
    const auto bad = [&](const char* what) {
      return failure(ErrorCode::malformed_input, "surface '" + given.name + "': " + what);
    };
    if (!is_finite(given.a) || !is_finite(given.b) ||
        !std::all_of(given.points.begin(), given.points.end(), is_finite))
      return bad("a number is not finite");
    const bool round = given.kind == Kind::sphere || given.kind == Kind::cylinder;
    if (round && !(given.radius > 0 && std::isfinite(given.radius))) return bad("its radius is not positive");
    if (given.kind == Kind::cylinder && !(length(given.b - given.a) > 0))
      return bad("its axis has no length");
    if (given.kind == Kind::plane && !(length(given.b) > 0)) return bad("its normal has no direction");
    if (given.kind == Kind::triangles) {
      if (given.triangles.empty()) return bad("it has no triangles");
      for (const auto& triangle : given.triangles) {
        if (*std::max_element(triangle.begin(), triangle.end()) >= given.points.size())
          return bad("a triangle has a point that does not exist");
      }
    }
    return std::make_unique<Surface>(given);
  }

  explicit Surface(const BlockSurface& given) : given_(given) {
    find_box();
    reach_ = given.kind == Kind::plane ? INFINITY : length(high_ - low_);
    if (given.kind != Kind::triangles) return;
    for (const auto& triangle : given.triangles)
      corners_.insert(corners_.end(), triangle.begin(), triangle.end());
    for (const Position& point : given.points) {
      for (const double x : in_box(point)) positions_.push_back(static_cast<float>(x));
    }
    tree_.emplace(corners_, positions_);
  }
  Surface(const Surface&) = delete;
  Surface& operator=(const Surface&) = delete;

  /// Projects a point. Points farther away than the surface's box is long stay where they are, as blockMesh
  /// has it (found by moving a vertex away from a square and a sphere, 4c37560): dictionaries project whole
  /// rows of vertices of which some lie elsewhere.
  Position project(const Position& p) const {
    const Position found = nearest(p);
    return length(found - p) < reach_ ? found : p;
  }
  double reach() const { return reach_; }

 private:
  Position nearest(const Position& p) const {
    switch (given_.kind) {
      case Kind::sphere:
        return on_sphere(p);
      case Kind::cylinder:
        return on_cylinder(p);
      case Kind::plane:
        return p - (dot(p - given_.a, given_.b) / dot(given_.b, given_.b)) * given_.b;
      case Kind::box:
        return on_box(p);
      case Kind::triangles:
        break;
    }
    const Position at = in_box(p);
    const auto& corner = given_.triangles[tree_->nearest(Vector3{at[0], at[1], at[2]})];
    return nearest_on_triangle(p, given_.points[corner[0]], given_.points[corner[1]],
                               given_.points[corner[2]]);
  }
  /// The point relative to the surface's box, for the tree. Floats only say which triangle is the nearest
  /// one, and there they are fine enough wherever the surface is.
  Position in_box(const Position& p) const {
    return (reach_ > 0 ? 1 / reach_ : 1) * (p - 0.5 * (low_ + high_));
  }
  void enclose(const Position& p, const Position& around = {}) {
    for (unsigned k = 0; k < 3; ++k) {
      low_[k] = std::min(low_[k], p[k] - around[k]);
      high_[k] = std::max(high_[k], p[k] + around[k]);
    }
  }
  void find_box() {
    const double r = given_.radius;
    if (given_.kind == Kind::triangles) {
      for (const Position& point : given_.points) enclose(point);
      return;
    }
    Position around{};
    if (given_.kind == Kind::sphere) around = {r, r, r};
    if (given_.kind == Kind::cylinder) {
      const Position axis = given_.b - given_.a;
      for (unsigned k = 0; k < 3; ++k)
        // A disc across the axis reaches r sqrt(1 - a_k^2) along axis k, a being the axis of length 1.
        around[k] = r * std::sqrt(std::max(0.0, 1 - axis[k] * axis[k] / dot(axis, axis)));
    }
    enclose(given_.a, around);
    if (given_.kind != Kind::sphere) enclose(given_.b, around);
  }

  Position on_sphere(const Position& p) const {
    const Position from = p - given_.a;
    const double far = length(from);
    // The centre is as near to all points: any will do, and always the same one.
    if (!(far > 0)) return given_.a + Position{given_.radius, 0, 0};
    return given_.a + (given_.radius / far) * from;
  }
  // A closed cylinder: its side or, where these are nearer, the discs at its ends.
  Position on_cylinder(const Position& p) const {
    const Position axis = given_.b - given_.a;
    const double whole = length(axis);
    const Position along = (1 / whole) * axis;
    const double up = dot(p - given_.a, along), height = std::clamp(up, 0.0, whole);
    Position out = p - given_.a - up * along;
    const double far = length(out);
    out = far > 0 ? (1 / far) * out : across(along);
    const bool inside = far <= given_.radius && up == height;
    const double cap = up < whole - up ? 0 : whole;
    if (inside && std::fabs(up - cap) < given_.radius - far) return given_.a + cap * along + far * out;
    if (inside || up == height) return given_.a + height * along + given_.radius * out;
    return given_.a + height * along + std::min(far, given_.radius) * out;
  }
  // Outside the nearest point by clamping; inside the nearest of the six sides, the first of several.
  Position on_box(const Position& p) const {
    Position at{};
    for (unsigned k = 0; k < 3; ++k) at[k] = std::clamp(p[k], low_[k], high_[k]);
    if (at != p) return at;
    unsigned axis = 0;
    double least = INFINITY, side = 0;
    for (unsigned k = 0; k < 3; ++k) {
      for (const double x : {low_[k], high_[k]}) {
        if (!(std::fabs(p[k] - x) < least)) continue;
        least = std::fabs(p[k] - x);
        axis = k;
        side = x;
      }
    }
    at[axis] = side;
    return at;
  }

  BlockSurface given_;
  Position low_{INFINITY, INFINITY, INFINITY}, high_{-INFINITY, -INFINITY, -INFINITY};
  double reach_ = 0;
  std::vector<uint32_t> corners_;
  std::vector<float> positions_;
  std::optional<TriangleTree> tree_;
};

Surfaces::Surfaces() = default;
Surfaces::Surfaces(Surfaces&&) noexcept = default;
Surfaces::~Surfaces() = default;

Result<Surfaces> Surfaces::make(const BlockDescription& description) {
  Surfaces made;
  for (const BlockSurface& surface : description.surfaces)
    made.surfaces_.push_back(MAILLE_TRY(Surface::make(surface)));
  const auto check = [&](const std::vector<uint32_t>& on, const char* what) -> Result<> {
    if (on.empty())
      return failure(ErrorCode::malformed_input, std::string(what) + " is projected to nothing");
    if (*std::max_element(on.begin(), on.end()) < made.surfaces_.size()) return {};
    return failure(ErrorCode::malformed_input,
                   std::string(what) + " is projected to a surface that does not exist");
  };
  for (const BlockCurve& curve : description.curves) {
    if (curve.kind == CurveKind::projected) MAILLE_CHECK(check(curve.surfaces, "an edge"));
  }
  for (const ProjectedVertex& vertex : description.projected_vertices) {
    MAILLE_CHECK(check(vertex.surfaces, "a vertex"));
    if (vertex.vertex >= description.vertices.size())
      return failure(ErrorCode::malformed_input, "a vertex that is projected does not exist");
  }
  for (const ProjectedFace& face : description.projected_faces) MAILLE_CHECK(check(face.surfaces, "a face"));
  return made;
}

Position Surfaces::project(Position at, std::span<const uint32_t> surfaces) const {
  if (surfaces.size() == 1) return surfaces_[surfaces[0]]->project(at);
  // The way left halves with each round at 45 degrees, and takes 0.97 of what it was at 10; surfaces that do
  // not meet have no end. So 1000 rounds do for angles down to 10 degrees (0.97^1000 is 6e-14).
  constexpr unsigned most_rounds = 1000;
  constexpr double near_enough = 1e-14;  // of the smallest surface
  double size = INFINITY;
  for (const uint32_t surface : surfaces) size = std::min(size, surfaces_[surface]->reach());
  if (size == INFINITY) size = length(at);
  for (unsigned round = 0; round < most_rounds; ++round) {
    const Position before = at;
    for (const uint32_t surface : surfaces) at = surfaces_[surface]->project(at);
    if (!(length(at - before) > near_enough * size)) break;
  }
  return at;
}

}  // namespace maille
