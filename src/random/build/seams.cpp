#include "random/build/seams.h"

#include <algorithm>
#include <cstring>
#include <numeric>

#include "base/hash.h"
#include "mesh/none.h"

namespace maille {
namespace {

/// A seam is where the surface goes on and values of arrays do not, as between two charts of a texture.
/// Points at one place with the same values become one; corners get a hash of their values, so that a
/// simplifier sees where these part. Two different values with one hash would only merge what a seam should
/// divide.
class SeamFinder {
 public:
  SeamFinder(const Mesh& mesh, const FaceLists& faces, std::span<const Place> places)
      : mesh_(mesh), faces_(faces), places_(places) {}

  Seams run() {
    sort_points();
    const auto follows_faces = [](const Array& array) {
      return array.domain == Domain::cell || array.domain == Domain::corner;
    };
    if (!differs_ && std::none_of(mesh_.arrays.begin(), mesh_.arrays.end(), follows_faces)) return {};
    seams_.values.assign(faces_.corners.size(), 0);
    for (const Array& array : mesh_.arrays) {
      if (array.domain == Domain::mesh || jumps_everywhere(array)) continue;
      for_each_corner(
          [&](uint32_t corner, uint32_t tuple) {
            const uint64_t both = uint64_t{seams_.values[corner]} << 32 | value(array, tuple);
            seams_.values[corner] = static_cast<uint32_t>(hash64(std::as_bytes(std::span(&both, 1))));
          },
          array.domain);
    }
    return std::move(seams_);
  }

 private:
  static size_t size_of_tuple(const Array& array) { return array.tuple_size(); }
  static Bytes tuple_of(const Array& array, uint32_t tuple) {
    return Bytes(array.bytes).subspan(tuple * size_of_tuple(array), size_of_tuple(array));
  }
  static uint32_t value(const Array& array, uint32_t tuple) {
    return static_cast<uint32_t>(hash64(tuple_of(array, tuple)));
  }

  int compare_values(uint32_t a, uint32_t b) const {
    for (const Array& array : mesh_.arrays) {
      if (array.domain != Domain::point) continue;
      const int order =
          std::memcmp(tuple_of(array, a).data(), tuple_of(array, b).data(), size_of_tuple(array));
      if (order != 0) return order;
    }
    return 0;
  }
  /// By place, then by values, then by number.
  void sort_points() {
    std::vector<uint32_t> order(places_.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
      if (places_[a] != places_[b]) return places_[a] < places_[b];
      const int values = compare_values(a, b);
      return values != 0 ? values < 0 : a < b;
    });
    seams_.point_of.resize(order.size());
    place_of_.resize(order.size());
    for (size_t i = 0; i < order.size(); ++i) {
      const bool same_place = i > 0 && places_[order[i]] == places_[order[i - 1]];
      const bool same = same_place && compare_values(order[i], order[i - 1]) == 0;
      seams_.point_of[order[i]] = same ? seams_.point_of[order[i - 1]] : order[i];
      place_of_[order[i]] = same_place ? place_of_[order[i - 1]] : order[i];
      differs_ = differs_ || (same_place && !same);
    }
  }

  /// Calls f(corner, tuple) for an array of this domain.
  template <class F>
  void for_each_corner(F f, Domain domain) const {
    uint32_t corner = 0;
    for (uint32_t face = 0; face < faces_.size(); ++face) {
      for (const uint32_t point : faces_.face(face)) {
        f(corner, domain == Domain::point ? point : domain == Domain::cell ? face : corner);
        ++corner;
      }
    }
  }
  /// An array that has several values around more than half of all places (numbers of faces, flat normals)
  /// would make every edge a seam, and nothing could be simplified. "Half" was chosen, not swept.
  bool jumps_everywhere(const Array& array) const {
    std::vector<uint32_t> first(places_.size(), none);
    std::vector<uint8_t> state(places_.size());  // 1: one value, 2: several
    for_each_corner(
        [&](uint32_t corner, uint32_t tuple) {
          const uint32_t place = place_of_[faces_.corners[corner]], found = value(array, tuple);
          if (state[place] == 0) first[place] = found;
          state[place] = state[place] < 2 && first[place] == found ? 1 : 2;
        },
        array.domain);
    const auto used = std::count_if(state.begin(), state.end(), [](uint8_t s) { return s > 0; });
    return 2 * std::count(state.begin(), state.end(), 2) > used;
  }

  const Mesh& mesh_;
  const FaceLists& faces_;
  std::span<const Place> places_;
  Seams seams_;
  std::vector<uint32_t> place_of_;  ///< by point: the first one at its place
  bool differs_ = false;
};

}  // namespace

Seams find_seams(const Mesh& mesh, const FaceLists& faces, std::span<const Place> places) {
  return SeamFinder(mesh, faces, places).run();
}

}  // namespace maille
