#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "surface/arrays/facet_normal_coder.h"
#include "surface/arrays/normal_coder.h"
#include "surface/front/element_walk.h"

namespace maille {

// The elements of an array of normals, one after the other, with what is expected of each. One walk for
// encoder, decoder and measures.

/// How an array is coded: as normals of the surface or of its faces.
struct ArrayCoding {
  std::optional<NormalCoding> normal;
  std::optional<FacetCoding> facet;
};

/// Which normals are expected, where the array has some. Made once for an array; all lookups are by decoded
/// positions, so both sides have the same.
class ExpectedNormals {
 public:
  ExpectedNormals(const PatchElements& elements, const std::vector<uint32_t>& face_of, Domain domain,
                  const ArrayCoding& coding) {
    if (!coding.normal || coding.normal->weight == NormalCoding::own) return;
    surface_.emplace(elements, face_of, static_cast<NormalWeight>(coding.normal->weight));
    faces_ = elements.surface->face_count;
    if (domain == Domain::point) points_ = surface_->of_points(coding.normal->welded);
    if (domain != Domain::corner || !coding.normal->welded || elements.twins.empty()) return;
    points_ = surface_->of_points(false);
    latest_.assign(points_.size(), none);
  }
  ExpectedNormal of_point(uint32_t point) const {
    return point < points_.size() ? points_[point] : ExpectedNormal{};
  }
  ExpectedNormal of_face(uint32_t face) const {
    return surface_ && face < faces_ ? surface_->of_face(face) : ExpectedNormal{};
  }
  /// A wedge expects the sum of its own faces; in a welded mesh all wedges of a point expect that of the
  /// whole point, and the one before is the twin.
  ExpectedNormal of(const Wedge& wedge, const PatchSurface& surface) {
    if (!surface_ || wedge.corners.empty()) return {};
    if (latest_.empty()) return surface_->of_wedge(wedge.corners);
    const uint32_t point = surface.point(surface.half_edges.origin[wedge.corners.front()]);
    ExpectedNormal expected = points_[point];
    expected.twin = std::exchange(latest_[point], wedge.corners.front());
    return expected;
  }
  /// How sharp the edge between two corners is, 0 to 5: 0 if no surface is asked, else classes of 1 - cosine.
  /// The bounds are those of the format; chosen, not swept.
  unsigned sharpness(const CornerPair& pair) const {
    if (!surface_) return 0;
    const double turn = 1 - surface_->cosine(pair.corner, pair.next);
    return 1u + (turn > 1e-6) + (turn > 0.01) + (turn > 0.1) + (turn > 0.5);
  }

 private:
  std::optional<SurfaceNormals> surface_;
  std::vector<ExpectedNormal> points_;
  std::vector<uint32_t> latest_;  ///< of welded points: the corner that was coded last
  uint32_t faces_ = 0;
};

/// Tuples of points on the corners of a welded mesh: those of one twin are one tuple, so each is coded once.
class KnownTwins {
 public:
  explicit KnownTwins(std::span<const uint32_t> twins)
      : twins_(twins),
        first_(twins.empty() ? 0 : *std::max_element(twins.begin(), twins.end()) + size_t{1}, none) {}

  bool are_one(uint32_t a, uint32_t b) const { return !twins_.empty() && twins_[a] == twins_[b]; }
  /// The corner with which the twin of this one came up; none before that.
  uint32_t known(uint32_t corner) const { return twins_.empty() ? none : first_[twins_[corner]]; }
  /// The same for the first of these of which it is known.
  uint32_t first_known(std::span<const uint32_t> corners) const {
    for (const uint32_t corner : corners) {
      if (known(corner) != none) return known(corner);
    }
    return none;
  }
  void know(uint32_t corner) {
    if (known(corner) == none && !twins_.empty()) first_[twins_[corner]] = corner;
  }

 private:
  std::span<const uint32_t> twins_;
  std::vector<uint32_t> first_;  ///< by twin
};

/// Codes which corners of a vertex hold the same tuple. What the edge's other end did, how sharp it is and
/// the last two decisions are the context: seams run on, and lie at sharp edges.
template <class Coder, class Code>
class CornerJoints {
 public:
  CornerJoints(Coder& coder, const KnownTwins& twins, std::span<const Code> codes, size_t components)
      : coder_(coder), twins_(twins), codes_(codes), components_(components) {}

  bool same(uint32_t a, uint32_t b) const {
    const auto of = [&](uint32_t corner) {
      return codes_.begin() + static_cast<ptrdiff_t>(corner * components_);
    };
    return std::equal(of(a), of(a) + static_cast<ptrdiff_t>(components_), of(b));
  }
  bool code(const CornerPair& pair, unsigned sharpness) {
    if (twins_.are_one(pair.corner, pair.next)) return true;
    const uint32_t a = twins_.known(pair.corner), b = twins_.known(pair.next);
    // Both tuples are known by their twins, so nothing needs to be said.
    if (a != none && b != none) return same(a, b);
    const unsigned far = pair.far_corner == none ? 0 : same(pair.far_corner, pair.far_next) ? 1 : 2;
    bool joined = false;
    if constexpr (Coder::encoding) joined = same(pair.corner, pair.next);
    joined = joined_[far][sharpness][history_].code(coder_, joined);
    history_ = (history_ << 1 | static_cast<unsigned>(joined)) & 3;
    return joined;
  }

 private:
  Coder& coder_;
  const KnownTwins& twins_;
  std::span<const Code> codes_;
  size_t components_;
  BitModel joined_[3][6][4];
  unsigned history_ = 0;
};

/// Arrays of corners: wedge by wedge, each of which has one tuple; twins that came up have theirs already, so
/// nothing is coded for them.
template <class Rans, class Code, class ElementCoder, class More>
void code_wedges(const PatchElements& elements, ElementWalk& walk, ExpectedNormals& normals, Rans& rans,
                 std::span<const Code> codes, size_t components, ElementCoder& coder, More more) {
  KnownTwins twins(elements.twins);
  CornerJoints<Rans, Code> joints(rans, twins, codes, components);
  walk.run_wedges([&](uint32_t a, uint32_t b) { return joints.same(a, b); },
                  [&](const CornerPair& pair) { return joints.code(pair, normals.sharpness(pair)); },
                  [&](uint32_t element, const ElementStencil& stencil, const Wedge& wedge) {
                    if (!more()) return false;
                    const std::span<const uint32_t> corners =
                        wedge.corners.empty() ? std::span(&element, 1) : std::span(wedge.corners);
                    uint32_t source = twins.first_known(corners);
                    if (source == none) {
                      source = element;
                      coder.code(element, stencil, normals.of(wedge, *elements.surface));
                    }
                    for (const uint32_t corner : corners) {
                      if (corner != source) coder.copy(corner, source);
                      twins.know(corner);
                    }
                    return true;
                  });
}

/// Codes all elements of an array with `coder`, a NormalCoder or what stands in its place. `more` returns
/// false to stop.
template <class Rans, class Code, class ElementCoder, class More>
void code_elements(const PatchElements& elements, const std::vector<uint32_t>& face_of, Domain domain,
                   uint64_t tuples, ExpectedNormals& normals, Rans& rans, std::span<const Code> codes,
                   size_t components, ElementCoder& coder, More more) {
  ElementWalk walk(elements, face_of);
  if (domain == Domain::corner)
    return code_wedges(elements, walk, normals, rans, codes, components, coder, more);
  walk.run(domain, tuples, [&](uint32_t element, const ElementStencil& stencil) {
    if (!more()) return false;
    coder.code(element, stencil,
               domain == Domain::point ? normals.of_point(element) : normals.of_face(element));
    return true;
  });
}

/// The same for whichever coder the array has. `tuple_of`, if given: NormalCoder::take_tuple_numbers(), or
/// nothing where each element has a tuple of its own.
template <class Rans, class Code, class More>
void code_array(Rans& rans, const PatchElements& elements, const std::vector<uint32_t>& face_of,
                const Array& array, uint64_t tuples, const ArrayMaps& maps, const ArrayCoding& coding,
                std::span<Code> codes, More more, std::vector<uint32_t>* tuple_of = nullptr) {
  if (coding.facet) {
    FacetNormalCoder<Rans, Code> coder(rans, *coding.facet, array.type, maps, elements, face_of, codes);
    for (uint32_t cell = 0; cell < elements.cells() && more(); ++cell) coder.code(cell);
    return;
  }
  ExpectedNormals normals(elements, face_of, array.domain, coding);
  const size_t components = maps.maps.size();
  const auto run = [&](auto& coder) {
    code_elements<Rans, Code>(elements, face_of, array.domain, tuples, normals, rans, codes, components,
                              coder, more);
  };
  NormalCoder<Rans, Code> coder(rans, *coding.normal, array.type, maps, codes);
  run(coder);
  if (tuple_of != nullptr) *tuple_of = coder.take_tuple_numbers();
}

}  // namespace maille
