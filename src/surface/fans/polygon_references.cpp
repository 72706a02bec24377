// What predicts the positions of vertices in meshes of polygons: the face in which a vertex comes up.
#include <algorithm>

#include "surface/fans/fan_connectivity.h"

namespace maille {
namespace {

using R = VertexReferences;

constexpr unsigned kind_of(unsigned place, bool straight) {
  return place * 2 * valence_classes + static_cast<unsigned>(straight);
}

/// A face in which vertices come up. Known are those below the vertex in question.
struct NewFace {
  std::span<const uint32_t> corners;
  uint32_t across;

  uint32_t degree() const { return static_cast<uint32_t>(corners.size()); }
  bool knows_all_behind(uint32_t k) const {
    return std::all_of(corners.begin() + k + 1, corners.end(), [&](uint32_t c) { return c < corners[k]; });
  }
};

/// The gate focus + last - before; what else there is is the same as the focus.
R gate_of(uint32_t focus, uint32_t last, uint32_t before) {
  R references;
  references.at.fill(focus);
  references.at[R::last] = last;
  references.at[R::before] = before;
  return references;
}

/// References and kind of corner k, from 2 on, with k as the first corner of its vertex. The kind of
/// start_place says that nothing predicts it. The order of the cases is that of the format (12.3,
/// "Polygons"): the first that holds counts, from those that know most of the face.
std::pair<R, unsigned> describe(const NewFace& face, uint32_t k) {
  const auto& c = face.corners;
  const uint32_t degree = face.degree(), v = c[k], last = c[k - 1];
  const bool straight = k == 2 && face.across < v;
  const auto with = [&](R references, unsigned place) {
    if (straight) {
      references.at[R::late] = references.at[R::late + 1] = last;
      references.at[R::late + 2] = face.across;
    }
    return std::pair(references, kind_of(place, straight));
  };
  if (degree == 3 && straight) return {gate_of(c[0], last, face.across), kind_of(first_open_place, false)};
  if (degree == 4 && k == 3) return with(gate_of(c[0], last, c[1]), quad_last_place);
  if (degree == 4 && c[3] < v) return with(gate_of(c[3], last, c[0]), quad_place);
  if ((degree == 5 || degree == 6) && face.knows_all_behind(k)) {
    // By the corner behind, k + 1, and so on round.
    const auto behind = [&](uint32_t j) { return c[(k + j) % degree]; };
    R references = gate_of(behind(1), last, behind(degree - 2));
    references.at[R::next_opposite] = behind(2);
    if (degree == 6) references.at[R::next] = behind(3);
    return with(references, degree == 5 ? pentagon_place : hexagon_place);
  }
  if (degree >= 5 && (k > 2 || c[degree - 1] < v)) {
    const uint32_t first = k > 2 ? c[k - 3] : c[degree - 1];
    return with(gate_of(first, last, c[k - 2]), degree == 5 ? pentagon_row_place : row_place);
  }
  if (straight) return {gate_of(last, last, face.across), kind_of(straight_place, false)};
  return {gate_of(last, last, last), kind_of(start_place, false)};
}

}  // namespace

void FanSurface::find_polygon_references() {
  first = 0;
  references.resize(vertices);
  kinds.resize(vertices);
  uint32_t next = 0;
  for (uint32_t f = 0; f < across.size(); ++f) {  // duplicates have no new vertices
    const NewFace in{face(f), across[f]};
    for (uint32_t k = 0; k < in.degree(); ++k) {
      if (in.corners[k] != next) continue;
      if (k < 2) {
        const uint32_t near = k > 0 ? in.corners[k - 1] : next > 0 ? next - 1 : 0;
        references[next] = gate_of(near, near, near);
        kinds[next] = static_cast<uint8_t>(kind_of(start_place, false));
      } else {
        const auto [found, kind] = describe(in, k);
        references[next] = found;
        kinds[next] = static_cast<uint8_t>(kind);
      }
      ++next;
    }
  }
}

}  // namespace maille
