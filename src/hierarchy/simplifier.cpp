#include "hierarchy/simplifier.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "hierarchy/mesh_geometry.h"

namespace maille {
namespace {

constexpr uint32_t none = 0xffffffff;
constexpr double border_weight = 10;
constexpr double seam_weight = 2;
constexpr double flip_limit = 0.2;
constexpr unsigned most_passes = 40;

enum class Kind : uint8_t { interior, border, fixed };

/// A vertex to be merged into another, or (to == none) a component, named by its first triangle, to be
/// removed.
struct Candidate {
  float cost;
  uint32_t from, to;
  bool operator<(const Candidate& o) const {
    if (cost != o.cost) return cost < o.cost;
    return from != o.from ? from < o.from : to < o.to;
  }
};

struct Neighbour {
  uint32_t vertex;
  uint32_t faces;
  uint32_t value = 0;  ///< of the first face
  bool seam = false;

  /// Its ends may only slide along it.
  bool is_feature() const { return faces % 2 == 1 || seam; }
};

/// A corner that takes the place of those that have a value.
struct Replacement {
  uint32_t value, corner;
};

class Simplifier {
 public:
  explicit Simplifier(const SimplifierInput& input)
      : input_(input),
        triangles_(input.triangles.begin(), input.triangles.end()),
        vertices_(static_cast<uint32_t>(input.locked.size())) {
    place_vertices();
    root_.resize(vertices_);
    std::iota(root_.begin(), root_.end(), 0u);
    if (!input.values.empty()) {
      corners_.resize(triangles_.size());
      std::iota(corners_.begin(), corners_.end(), 0u);
      face_of_.resize(count());
      std::iota(face_of_.begin(), face_of_.end(), 0u);
      with_seams_ = true;
    }
    drop_degenerate();
    add_quadrics();
  }

  Simplified run() {
    unsigned idle = 0;
    double widening = 1.5;
    for (unsigned pass = 0; pass < most_passes && count() > input_.target && idle < 2; ++pass) {
      const uint32_t goal = count() - input_.target;
      if (stale_) list_rings();
      find_candidates();
      if (candidates_.empty()) {
        if (!give_up_seams()) break;
        pass = 0;
        continue;
      }
      const uint32_t removed = apply(goal, widening);
      rebuild();
      stale_ = true;
      // Candidates that are refused gather in front: without a wider limit everything stalls.
      const bool little = removed < (goal + 19) / 20;
      idle = std::isinf(widening) && removed < (goal + 199) / 200 ? idle + 1 : 0;
      if (little && widening > 1e12) widening = std::numeric_limits<double>::infinity();
      widening = little ? widening * 16 : 1.5;
      if (idle == 2 && give_up_seams()) {
        idle = pass = 0;
        widening = 1.5;
      }
    }
    result_.triangles = std::move(triangles_);
    result_.corners = std::move(corners_);
    result_.faces = std::move(face_of_);
    result_.root = std::move(root_);
    result_.view_error = std::sqrt(worst_);
    return std::move(result_);
  }

 private:
  uint32_t count() const { return static_cast<uint32_t>(triangles_.size() / 3); }
  /// Where nothing is left to slide, levels must become small all the same.
  bool give_up_seams() {
    if (!with_seams_ || count() <= input_.target + input_.target / 2) return false;
    with_seams_ = false;
    stale_ = true;
    seam_quadric_.clear();
    return true;
  }
  uint32_t value_at(size_t slot) const { return with_seams_ ? input_.values[corners_[slot]] : 0; }
  void keep_triangle(size_t from, const uint32_t* vertices, size_t to) {
    for (unsigned k = 0; k < 3 && !corners_.empty(); ++k) corners_[to + k] = corner_after(from + k);
    for (unsigned k = 0; k < 3; ++k) triangles_[to + k] = vertices[k];
    if (!face_of_.empty()) face_of_[to / 3] = face_of_[from / 3];
  }
  void resize_triangles(size_t size) {
    triangles_.resize(size);
    if (corners_.empty()) return;
    corners_.resize(size);
    face_of_.resize(size / 3);
  }
  /// That has the values of a corner when its vertex has been merged into another.
  uint32_t corner_after(size_t slot) const {
    const uint32_t corner = corners_[slot];
    if (replaced_.empty() || to_[triangles_[slot]] == triangles_[slot]) return corner;
    const auto [begin, end] = replaced_[triangles_[slot]];
    for (uint32_t i = begin; i < end; ++i) {
      if (replacements_[i].value == input_.values[corner]) return replacements_[i].corner;
    }
    return begin < end ? replacements_[begin].corner : corner;
  }

  /// Relative to the middle of the box: a quadric of large coordinates loses digits.
  void place_vertices() {
    Box box;
    for (size_t i = 0; i < triangles_.size(); ++i)
      enclose(box, finite_position(input_.positions, triangles_[i]), i == 0);
    position_.resize(vertices_);
    for (uint32_t v = 0; v < vertices_; ++v) {
      const Vector3 p = finite_position(input_.positions, v);
      for (unsigned k = 0; k < 3; ++k) position_[v][k] = p[k] - (box.low[k] + box.high[k]) / 2;
    }
  }

  static bool is_degenerate(const uint32_t* t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }
  void drop_degenerate() {
    size_t kept = 0;
    for (size_t t = 0; t < triangles_.size(); t += 3) {
      if (is_degenerate(&triangles_[t])) continue;
      const uint32_t same[3] = {triangles_[t], triangles_[t + 1], triangles_[t + 2]};
      keep_triangle(t, same, kept);
      kept += 3;
    }
    resize_triangles(kept);
  }

  Vector3 normal(uint32_t a, uint32_t b, uint32_t c) const {
    return cross(position_[b] - position_[a], position_[c] - position_[a]);
  }

  /// A plane for each face, and for each face at a border edge one that stands on it.
  void add_quadrics() {
    quadric_.assign(vertices_, {});
    if (with_seams_) seam_quadric_.assign(vertices_, {});
    double area_sum = 0;
    for (size_t t = 0; t < triangles_.size(); t += 3) {
      const uint32_t* v = &triangles_[t];
      Vector3 n = normal(v[0], v[1], v[2]);
      const double length = std::sqrt(dot(n, n));
      const double area = length / 2;
      area_sum += area;
      if (length == 0) continue;
      n = n * (1 / length);
      Quadric q;
      q.add_plane(n, position_[v[0]], area);
      q.weight = area;
      for (unsigned k = 0; k < 3; ++k) quadric_[v[k]] += q;
    }
    const double cap = 0.5 * std::sqrt(area_sum / std::max(input_.target, 1u));
    cap_ = input_.to_the_end ? std::numeric_limits<double>::infinity() : cap * cap;
    list_rings();
    for (uint32_t v = 0; v < vertices_; ++v) add_border_planes(v);
  }
  void add_border_planes(uint32_t v) {
    for (const Neighbour& other : ring(v)) {
      if (!other.is_feature() || other.vertex < v) continue;
      const bool border = other.faces % 2 == 1;
      std::vector<Quadric>& quadrics = border ? quadric_ : seam_quadric_;
      for_each_face(v, [&](const uint32_t* t) {
        const uint32_t w = other.vertex;
        if (t[0] != w && t[1] != w && t[2] != w) return;
        const Vector3 edge = position_[w] - position_[v];
        Vector3 n = cross(normal(t[0], t[1], t[2]), edge);
        const double length = std::sqrt(dot(n, n));
        if (length == 0) return;
        n = n * (1 / length);
        Quadric q;
        q.add_plane(n, position_[v], (border ? border_weight : seam_weight) * dot(edge, edge));
        quadrics[v] += q;
        quadrics[w] += q;
      });
    }
  }

  /// Faces and neighbours of every vertex.
  void list_rings() {
    stale_ = false;
    first_face_.assign(size_t{vertices_} + 1, 0);
    for (const uint32_t v : triangles_) ++first_face_[v + 1];
    for (uint32_t v = 0; v < vertices_; ++v) first_face_[v + 1] += first_face_[v];
    faces_.resize(triangles_.size());
    std::vector<uint32_t>& next = scratch_;
    next.assign(first_face_.begin(), first_face_.end() - 1);
    for (uint32_t i = 0; i < triangles_.size(); ++i) faces_[next[triangles_[i]]++] = i / 3;
    first_neighbour_.assign(1, 0);
    neighbours_.clear();
    std::vector<uint32_t>& seen = scratch_;
    seen.assign(vertices_, none);
    for (uint32_t v = 0; v < vertices_; ++v) {
      const auto begin = static_cast<uint32_t>(neighbours_.size());
      for_each_face(v, [&](const uint32_t* t) {
        const auto slot = static_cast<size_t>(t - triangles_.data());
        const uint32_t value = value_at(slot + (t[0] == v ? 0 : t[1] == v ? 1 : 2));
        for (unsigned k = 0; k < 3; ++k) {
          const uint32_t w = t[k];
          if (w == v) continue;
          if (seen[w] == none || seen[w] < begin) {
            seen[w] = static_cast<uint32_t>(neighbours_.size());
            neighbours_.push_back({w, 0, value});
          }
          Neighbour& neighbour = neighbours_[seen[w]];
          ++neighbour.faces;
          neighbour.seam = neighbour.seam || neighbour.value != value;
        }
      });
      first_neighbour_.push_back(static_cast<uint32_t>(neighbours_.size()));
    }
  }
  std::span<const Neighbour> ring(uint32_t v) const {
    return std::span(neighbours_).subspan(first_neighbour_[v], first_neighbour_[v + 1] - first_neighbour_[v]);
  }
  template <class F>
  void for_each_face(uint32_t v, F f) const {
    for (uint32_t i = first_face_[v]; i < first_face_[v + 1]; ++i) f(&triangles_[size_t{3} * faces_[i]]);
  }

  Kind kind_of(uint32_t v) const {
    if (input_.locked[v]) return Kind::fixed;
    unsigned features = 0;
    for (const Neighbour& other : ring(v)) features += other.is_feature();
    return features == 0 ? Kind::interior : features == 2 ? Kind::border : Kind::fixed;
  }

  double cost(uint32_t from, uint32_t to) const {
    const Quadric &a = quadric_[from], &b = quadric_[to];
    const Vector3 step = position_[to] - position_[from];
    const double weight = a.weight + b.weight;
    double error = std::max(0.0, a.at(position_[to]) + at_home_[to]);
    if (with_seams_) error += std::max(0.0, seam_quadric_[from].at(position_[to]) + seam_at_home_[to]);
    // Among equal ones the shortest; without area, the distance is all there is.
    return (weight > 0 ? error / weight : dot(step, step)) + 1e-9 * dot(step, step);
  }

  /// The error that a vertex has where it is: each of its neighbours asks for it.
  void find_errors_at_home(const std::vector<Quadric>& quadrics, std::vector<double>& errors) const {
    errors.resize(quadrics.size());
    for (uint32_t v = 0; v < quadrics.size(); ++v) {
      if (first_face_[v] != first_face_[v + 1]) errors[v] = quadrics[v].at(position_[v]);
    }
  }

  void find_candidates() {
    candidates_.clear();
    find_errors_at_home(quadric_, at_home_);
    find_errors_at_home(seam_quadric_, seam_at_home_);
    for (uint32_t v = 0; v < vertices_; ++v) {
      if (first_face_[v] == first_face_[v + 1]) continue;
      const Kind kind = kind_of(v);
      if (kind == Kind::fixed) continue;
      Candidate best{std::numeric_limits<float>::infinity(), v, none};
      for (const Neighbour& other : ring(v)) {
        if (kind == Kind::border && !other.is_feature()) continue;
        const auto c = static_cast<float>(cost(v, other.vertex));
        if (c < best.cost || (c == best.cost && other.vertex < best.to)) best = {c, v, other.vertex};
      }
      if (best.to != none) candidates_.push_back(best);
    }
    add_components();
  }

  uint32_t component(uint32_t v) {
    while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
    return v;
  }
  /// Components without locked vertices: what is lost is half their size.
  void add_components() {
    parent_.resize(vertices_);
    std::iota(parent_.begin(), parent_.end(), 0u);
    for (size_t t = 0; t < triangles_.size(); t += 3) {
      for (unsigned k = 1; k < 3; ++k) {
        const uint32_t a = component(triangles_[t]), b = component(triangles_[t + k]);
        parent_[std::max(a, b)] = std::min(a, b);
      }
    }
    for (uint32_t v = 0; v < vertices_; ++v) parent_[v] = component(v);
    is_locked_.assign(vertices_, 0);
    low_.assign(vertices_, {});
    high_.assign(vertices_, {});
    faces_of_component_.assign(vertices_, 0);
    for (uint32_t v = 0; v < vertices_; ++v) {
      const uint32_t c = parent_[v];
      is_locked_[c] |= input_.locked[v];
      for (unsigned k = 0; k < 3; ++k) {
        low_[c][k] = v == c ? position_[v][k] : std::min(low_[c][k], position_[v][k]);
        high_[c][k] = v == c ? position_[v][k] : std::max(high_[c][k], position_[v][k]);
      }
    }
    for (size_t t = 0; t < triangles_.size(); t += 3) ++faces_of_component_[parent_[triangles_[t]]];
    for (uint32_t v = 0; v < vertices_; ++v) {
      if (parent_[v] != v || is_locked_[v] || faces_of_component_[v] == 0) continue;
      const Vector3 box = high_[v] - low_[v];
      candidates_.push_back({static_cast<float>(dot(box, box) / 4), v, none});
    }
  }

  float pass_limit(uint32_t goal, double widening) {
    const size_t n = std::min<size_t>(candidates_.size() - 1, goal / 2);
    const auto nth = candidates_.begin() + static_cast<ptrdiff_t>(n);
    std::nth_element(candidates_.begin(), nth, candidates_.end());
    return static_cast<float>(std::min(static_cast<double>(nth->cost) * widening, cap_));
  }

  /// Collapses in the order of their costs. Returns how many triangles that removes.
  uint32_t apply(uint32_t goal, double widening) {
    const float limit = pass_limit(goal, widening);
    std::erase_if(candidates_, [limit](const Candidate& c) { return !(c.cost <= limit); });
    std::sort(candidates_.begin(), candidates_.end());
    touched_.assign(vertices_, 0);
    to_.resize(vertices_);
    std::iota(to_.begin(), to_.end(), 0u);
    gone_.assign(vertices_, 0);
    replacements_.clear();
    if (!corners_.empty()) replaced_.assign(vertices_, {0, 0});
    uint32_t removed = 0;
    for (const Candidate& candidate : candidates_) {
      if (removed >= goal) break;
      const uint32_t faces =
          candidate.to == none ? remove_component(candidate, goal - removed) : collapse(candidate);
      if (faces > 0) worst_ = std::max(worst_, static_cast<double>(candidate.cost));
      removed += faces;
    }
    return removed;
  }

  uint32_t remove_component(const Candidate& candidate, uint32_t goal) {
    const uint32_t faces = faces_of_component_[candidate.from];
    if (faces > goal && faces - goal > input_.target / 2) return 0;
    gone_[candidate.from] = 1;
    result_.lost_component = std::max(result_.lost_component, std::sqrt(static_cast<double>(candidate.cost)));
    return faces;
  }

  uint32_t collapse(const Candidate& candidate) {
    const uint32_t u = candidate.from, v = candidate.to;
    if (touched_[u] || touched_[v] || gone_[parent_[u]]) return 0;
    uint32_t vanishing = 0, surviving = 0;
    bool turned = false;
    for_each_face(u, [&](const uint32_t* t) {
      uint32_t before[3], after[3];
      for (unsigned k = 0; k < 3; ++k) {
        before[k] = to_[t[k]];
        after[k] = before[k] == u ? v : before[k];
      }
      if (is_degenerate(before)) return;
      if (is_degenerate(after)) {
        ++vanishing;
        return;
      }
      ++surviving;
      turned = turned || turns(before, after);
    });
    // A vertex whose faces all vanish would take a component with it at the price of a collapse.
    if (turned || surviving == 0) return 0;
    if (!corners_.empty() && !replace_corners(u, v)) return 0;
    to_[u] = v;
    touched_[u] = touched_[v] = 1;
    quadric_[v] += quadric_[u];
    if (with_seams_) seam_quadric_[v] += seam_quadric_[u];
    faces_of_component_[parent_[u]] -= vanishing;
    return vanishing;
  }
  /// Corners of u take the values that v has in the faces between both. False: some have no such face, or
  /// two that differ: the collapse would cross a seam.
  bool replace_corners(uint32_t u, uint32_t v) {
    const auto begin = static_cast<uint32_t>(replacements_.size());
    bool fits = true;
    const auto find = [&](uint32_t value) {
      return std::find_if(replacements_.begin() + begin, replacements_.end(),
                          [value](const Replacement& r) { return r.value == value; });
    };
    const auto for_each_corner = [&](auto f) {
      for_each_face(u, [&](const uint32_t* t) {
        const auto slot = static_cast<size_t>(t - triangles_.data());
        size_t at_u = slot, at_v = none;
        for (unsigned k = 0; k < 3; ++k) {
          if (t[k] == u) at_u = slot + k;
          if (t[k] == v) at_v = slot + k;
        }
        f(input_.values[corners_[at_u]], at_v);
      });
    };
    for_each_corner([&](uint32_t value, size_t at_v) {
      if (at_v == none) return;
      const auto known = find(value);
      if (known == replacements_.end()) {
        replacements_.push_back({value, corners_[at_v]});
      } else {
        fits = fits && input_.values[known->corner] == input_.values[corners_[at_v]];
      }
    });
    for_each_corner([&](uint32_t value, size_t at_v) {
      fits = fits && (at_v != none || find(value) != replacements_.end());
    });
    if (with_seams_ && !fits) {
      replacements_.resize(begin);
      return false;
    }
    replaced_[u] = {begin, static_cast<uint32_t>(replacements_.size())};
    return true;
  }
  bool turns(const uint32_t* before, const uint32_t* after) const {
    const Vector3 a = normal(before[0], before[1], before[2]), b = normal(after[0], after[1], after[2]);
    const double length = std::sqrt(dot(a, a) * dot(b, b));
    if (dot(b, b) == 0) return dot(a, a) != 0;
    return dot(a, b) < flip_limit * length;
  }

  void rebuild() {
    size_t kept = 0;
    for (size_t t = 0; t < triangles_.size(); t += 3) {
      uint32_t after[3];
      for (unsigned k = 0; k < 3; ++k) after[k] = to_[triangles_[t + k]];
      if (gone_[parent_[triangles_[t]]] || is_degenerate(after)) continue;
      keep_triangle(t, after, kept);
      kept += 3;
    }
    resize_triangles(kept);
    for (uint32_t& r : root_) r = to_[r];
  }

  const SimplifierInput& input_;
  Simplified result_;
  std::vector<uint32_t> triangles_;
  std::vector<uint32_t> corners_;  ///< by corner of these: that of the input whose values it has
  std::vector<uint32_t> face_of_;  ///< by triangle: that of the input
  bool with_seams_ = false;
  bool stale_ = true;  ///< the rings are not those of the triangles
  uint32_t vertices_;
  std::vector<Vector3> position_;
  std::vector<Quadric> quadric_;
  std::vector<Quadric> seam_quadric_;  ///< planes on seams, as long as these are kept
  std::vector<double> at_home_, seam_at_home_;
  std::vector<uint32_t> root_;
  double cap_ = 0, worst_ = 0;

  std::vector<uint32_t> first_face_, faces_, first_neighbour_, scratch_;
  std::vector<Neighbour> neighbours_;
  std::vector<Candidate> candidates_;
  std::vector<uint32_t> parent_, faces_of_component_;
  std::vector<Vector3> low_, high_;
  std::vector<uint8_t> is_locked_, touched_, gone_;
  std::vector<uint32_t> to_;
  std::vector<Replacement> replacements_;
  std::vector<std::pair<uint32_t, uint32_t>> replaced_;  ///< by vertex of a pass: from, to in these
};

}  // namespace

Simplified simplify(const SimplifierInput& input) {
  return Simplifier(input).run();
}

}  // namespace maille
