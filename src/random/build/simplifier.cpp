#include "random/build/simplifier.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "mesh/none.h"
#include "random/build/loose_components.h"
#include "random/mesh_geometry.h"

namespace maille {
namespace {

// Chosen, not swept. Planes that stand on a border or a seam keep it in place: with a smaller weight borders
// shrink, with a larger one more triangles are spent on them.
constexpr double border_weight = 10;
constexpr double seam_weight = 2;
// A triangle may turn by the angle with this cosine, 78 degrees. Chosen, not swept: a stricter limit gets
// curved surfaces stuck, a looser one lets folds through.
constexpr double flip_limit = 0.2;
// This only bounds the loop, together with `idle`: a level loses three quarters of its
// triangles in a few passes.
constexpr unsigned most_passes = 40;

enum class Kind : uint8_t { interior, border, fixed };

/// A vertex to be merged into another, or a component to be removed, named by its lowest vertex. One number
/// orders them by cost, then by vertex: the bits of floats that are not negative rise with the float. It also
/// makes the order total, so that the result does not depend on the sort.
using Candidate = uint64_t;
constexpr uint32_t whole_component = 1u << 31;
Candidate candidate_of(float cost, uint32_t from) {
  uint32_t bits;
  std::memcpy(&bits, &cost, sizeof bits);
  return uint64_t{bits} << 32 | from;
}
float cost_of(Candidate candidate) {
  const auto bits = static_cast<uint32_t>(candidate >> 32);
  float cost;
  std::memcpy(&cost, &bits, sizeof cost);
  return cost;
}

/// What the neighbours of a vertex ask for.
struct Vertex {
  Vector3 position;
  double at_home = 0;  ///< the error of its quadric where it is
  double weight = 0;   ///< of its quadric
};

/// The other corners of a triangle at a vertex.
struct Others {
  uint32_t next, previous;
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
    to_.resize(vertices_);
    std::iota(to_.begin(), to_.end(), 0u);
    alive_ = to_;
    best_.resize(vertices_);
    least_.resize(vertices_);
    changed_.assign(vertices_, 1);
    touched_.resize(vertices_);
    first_.resize(vertices_);
    end_.resize(vertices_);
    place_in_ring_.resize(vertices_);
    if (!input.values.empty()) {
      corners_.resize(triangles_.size());
      std::iota(corners_.begin(), corners_.end(), 0u);
      face_of_.resize(count());
      std::iota(face_of_.begin(), face_of_.end(), 0u);
      with_seams_ = true;
    }
    drop_degenerate();
    list_faces();
    components_.find(triangles_, alive_, input.locked, [this](uint32_t v) { return position(v); });
    add_quadrics();
  }

  Simplified run() {
    unsigned idle = 0;
    double widening = 1.5;
    for (unsigned pass = 0; pass < most_passes && count() > input_.target && idle < 2; ++pass) {
      const uint32_t goal = count() - input_.target;
      if (stale_) list_faces();
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
    result_.root = find_roots();
    result_.view_error = std::sqrt(worst_);
    return std::move(result_);
  }

 private:
  uint32_t count() const { return static_cast<uint32_t>(triangles_.size() / 3); }
  /// Where nothing is left to slide, levels must become small all the same.
  bool give_up_seams() {
    if (!with_seams_ || count() <= input_.target + input_.target / 2) return false;
    with_seams_ = false;
    seam_quadric_.clear();
    changed_.assign(vertices_, 1);
    return true;
  }
  std::vector<uint32_t> find_roots() const {
    std::vector<uint32_t> roots(vertices_);
    for (uint32_t v = 0; v < vertices_; ++v) {
      uint32_t& root = roots[v] = v;
      while (to_[root] != root) root = to_[root];
    }
    return roots;
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
    vertex_.resize(vertices_);
    for (uint32_t v = 0; v < vertices_; ++v) {
      const Vector3 p = finite_position(input_.positions, v);
      for (unsigned k = 0; k < 3; ++k) vertex_[v].position[k] = p[k] - (box.low[k] + box.high[k]) / 2;
    }
  }
  const Vector3& position(uint32_t v) const { return vertex_[v].position; }

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
    return cross(position(b) - position(a), position(c) - position(a));
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
      q.add_plane(n, position(v[0]), area);
      q.weight = area;
      for (unsigned k = 0; k < 3; ++k) quadric_[v[k]] += q;
    }
    const double cap = 0.5 * std::sqrt(area_sum / std::max(input_.target, 1u));
    cap_ = input_.to_the_end ? std::numeric_limits<double>::infinity() : cap * cap;
    for (const uint32_t v : alive_) add_border_planes(v);
    seam_at_home_.resize(seam_quadric_.size());
    for (const uint32_t v : alive_) look_at_home(v);
  }
  /// Remembers the error of a vertex where it is, which cost() needs for every neighbour.
  void look_at_home(uint32_t v) {
    vertex_[v].weight = quadric_[v].weight;
    vertex_[v].at_home = quadric_[v].at(position(v));
    if (with_seams_) seam_at_home_[v] = seam_quadric_[v].at(position(v));
  }
  void add_border_planes(uint32_t v) {
    find_ring(v);
    for (const Neighbour& other : ring_) {
      if (!other.is_feature() || other.vertex < v) continue;
      const bool border = other.faces % 2 == 1;
      const uint32_t w = other.vertex;
      std::vector<Quadric>& quadrics = border ? quadric_ : seam_quadric_;
      for (const Others& t : others(v)) {
        if (t.next != w && t.previous != w) continue;
        const Vector3 edge = position(w) - position(v);
        Vector3 n = cross(normal(v, t.next, t.previous), edge);
        const double length = std::sqrt(dot(n, n));
        if (length == 0) continue;
        n = n * (1 / length);
        Quadric q;
        q.add_plane(n, position(v), (border ? border_weight : seam_weight) * dot(edge, edge));
        quadrics[v] += q;
        quadrics[w] += q;
      }
    }
  }

  /// The faces of every vertex. Those without any are left out from now on.
  void list_faces() {
    stale_ = false;
    std::vector<uint32_t>& counts = end_;
    for (const uint32_t v : alive_) counts[v] = 0;
    for (const uint32_t v : triangles_) ++counts[v];
    uint32_t sum = 0;
    size_t kept = 0;
    for (const uint32_t v : alive_) {
      const uint32_t count = counts[v];
      first_[v] = end_[v] = sum;
      sum += count;
      if (count > 0) alive_[kept++] = v;
    }
    alive_.resize(kept);
    others_.resize(sum);
    if (!corners_.empty()) slots_.resize(sum);
    for (uint32_t t = 0; t < triangles_.size(); t += 3) {
      const uint32_t a = triangles_[t], b = triangles_[t + 1], c = triangles_[t + 2];
      if (!corners_.empty()) {
        for (unsigned k = 0; k < 3; ++k) slots_[end_[triangles_[t + k]]] = t + k;
      }
      others_[end_[a]++] = {b, c};
      others_[end_[b]++] = {c, a};
      others_[end_[c]++] = {a, b};
    }
  }
  std::span<const Others> others(uint32_t v) const {
    return std::span(others_).subspan(first_[v], end_[v] - first_[v]);
  }

  /// Finds the neighbours of a vertex and counts the faces at the edge to each. place_in_ring_ is never
  /// cleared: an entry counts only if the ring has the vertex there, which makes a set without hashing and
  /// without clearing.
  void find_ring(uint32_t v) {
    ring_.clear();
    for (uint32_t i = first_[v]; i < end_[v]; ++i) {
      const uint32_t value = with_seams_ ? value_at(slots_[i]) : 0;
      for (const uint32_t w : {others_[i].next, others_[i].previous}) {
        // The place of a vertex that is not in the ring is any.
        uint32_t& place = place_in_ring_[w];
        if (place >= ring_.size() || ring_[place].vertex != w) {
          place = static_cast<uint32_t>(ring_.size());
          ring_.push_back({w, 0, value});
        }
        Neighbour& neighbour = ring_[place];
        ++neighbour.faces;
        neighbour.seam = neighbour.seam || neighbour.value != value;
      }
    }
  }
  /// Two features make a curve along which the vertex may slide; one, or three and more, are its end or a
  /// crossing.
  Kind kind_of_ring() const {
    unsigned features = 0;
    for (const Neighbour& other : ring_) features += other.is_feature();
    return features == 0 ? Kind::interior : features == 2 ? Kind::border : Kind::fixed;
  }

  /// The mean squared distance that merging `from` into `to` leaves: the sum of both quadrics at `to`, over
  /// their areas.
  double cost(uint32_t from, const Quadric& quadric, uint32_t to) const {
    const Vertex &a = vertex_[from], &b = vertex_[to];
    const Vector3 step = b.position - a.position;
    const double weight = a.weight + b.weight;
    double error = std::max(0.0, quadric.at(b.position) + b.at_home);
    if (with_seams_) error += std::max(0.0, seam_quadric_[from].at(b.position) + seam_at_home_[to]);
    // Among equal ones the shortest; without area, the distance is all there is.
    return (weight > 0 ? error / weight : dot(step, step)) + 1e-9 * dot(step, step);
  }

  /// What a vertex would be merged into, at which cost; the same as before where nothing around it changed.
  void find_best(uint32_t v) {
    changed_[v] = 0;
    best_[v] = none;
    find_ring(v);
    const Kind kind = kind_of_ring();
    if (kind == Kind::fixed) return;
    const Quadric quadric = quadric_[v];
    float least = std::numeric_limits<float>::infinity();
    uint32_t best = none;
    for (const Neighbour& other : ring_) {
      if (kind == Kind::border && !other.is_feature()) continue;
      const auto c = static_cast<float>(cost(v, quadric, other.vertex));
      if (!(c < least || (c == least && other.vertex < best))) continue;
      least = c;
      best = other.vertex;
    }
    best_[v] = best;
    least_[v] = least;
  }

  void find_candidates() {
    candidates_.clear();
    for (const uint32_t v : alive_) {
      if (input_.locked[v]) continue;
      if (changed_[v]) find_best(v);
      if (best_[v] != none) candidates_.push_back(candidate_of(least_[v], v));
    }
    for (const LooseComponents::Component& one : components_.all()) {
      if (components_.is_left(one.name))
        candidates_.push_back(candidate_of(one.cost, one.name | whole_component));
    }
  }

  /// The largest cost that this pass accepts. A collapse removes two triangles, so the cheapest goal / 2
  /// candidates would do if none were refused; `widening` makes up for those that are. Without a limit, a
  /// pass would accept bad collapses where cheap ones have just been blocked by their neighbours.
  float pass_limit(uint32_t goal, double widening) {
    const size_t n = std::min<size_t>(candidates_.size() - 1, goal / 2);
    const auto nth = candidates_.begin() + static_cast<ptrdiff_t>(n);
    std::nth_element(candidates_.begin(), nth, candidates_.end());
    return static_cast<float>(std::min(static_cast<double>(cost_of(*nth)) * widening, cap_));
  }

  /// Collapses in the order of their costs. Returns how many triangles that removes.
  uint32_t apply(uint32_t goal, double widening) {
    const float limit = pass_limit(goal, widening);
    std::erase_if(candidates_, [limit](Candidate c) { return !(cost_of(c) <= limit); });
    std::sort(candidates_.begin(), candidates_.end());
    merged_.clear();
    replacements_.clear();
    if (!corners_.empty()) replaced_.assign(vertices_, {0, 0});
    uint32_t removed = 0;
    for (const Candidate candidate : candidates_) {
      if (removed >= goal) break;
      const auto from = static_cast<uint32_t>(candidate);
      const float cost = cost_of(candidate);
      const uint32_t faces = (from & whole_component) != 0
                                 ? remove_component(from & ~whole_component, cost, goal - removed)
                                 : collapse(from, best_[from]);
      if (faces > 0) worst_ = std::max(worst_, static_cast<double>(cost));
      removed += faces;
    }
    for (const uint32_t v : merged_) {
      touched_[v] = 0;
      look_at_home(v);
    }
    return removed;
  }

  /// Refuses a component that would take far more triangles than are to go: the level would fall below half
  /// its target.
  uint32_t remove_component(uint32_t component, float cost, uint32_t goal) {
    const uint32_t faces = components_.faces(component);
    if (faces > goal && faces - goal > input_.target / 2) return 0;
    components_.remove(component);
    result_.lost_component = std::max(result_.lost_component, std::sqrt(static_cast<double>(cost)));
    return faces;
  }

  /// Merges u into v, if neither was touched in this pass and no face turns over. Returns how many triangles
  /// vanish; 0 if the collapse is refused. Triangles are rebuilt after the pass, so those around are seen
  /// through to_.
  uint32_t collapse(uint32_t u, uint32_t v) {
    if (touched_[u] || touched_[v] || components_.is_gone_with(u)) return 0;
    uint32_t vanishing = 0, surviving = 0;
    for (const Others& t : others(u)) {
      const uint32_t a = to_[t.next], b = to_[t.previous];
      if (a == b) continue;
      if (a == v || b == v) {
        ++vanishing;
        continue;
      }
      ++surviving;
      if (turns(u, v, a, b)) return 0;
    }
    // A vertex whose faces all vanish would take a component with it at the price of a collapse.
    if (surviving == 0) return 0;
    if (!corners_.empty() && !replace_corners(u, v)) return 0;
    to_[u] = v;
    touched_[u] = touched_[v] = 1;
    merged_.push_back(v);
    note_changes(u);
    note_changes(v);
    quadric_[v] += quadric_[u];
    if (with_seams_) seam_quadric_[v] += seam_quadric_[u];
    components_.lose_faces(u, vanishing);
    return vanishing;
  }
  /// Only what is around a collapse has to be looked at again in the next pass.
  void note_changes(uint32_t v) {
    changed_[v] = 1;
    for (const Others& t : others(v)) changed_[t.next] = changed_[t.previous] = 1;
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
      for (uint32_t i = first_[u]; i < end_[u]; ++i) {
        const size_t at_u = slots_[i], first = at_u - at_u % 3;
        size_t at_v = none;
        for (unsigned k = 0; k < 3; ++k) {
          if (triangles_[first + k] == v) at_v = first + k;
        }
        f(input_.values[corners_[at_u]], at_v);
      }
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
  /// Does the triangle with a and b turn when its third corner goes from u to v?
  bool turns(uint32_t u, uint32_t v, uint32_t a, uint32_t b) const {
    const Vector3 before = normal(u, a, b), after = normal(v, a, b);
    const double left = dot(after, after);
    if (left == 0) return dot(before, before) != 0;
    const double same = dot(before, after);
    return same < 0 || same * same < flip_limit * flip_limit * (dot(before, before) * left);
  }

  void rebuild() {
    size_t kept = 0;
    for (size_t t = 0; t < triangles_.size(); t += 3) {
      uint32_t after[3];
      for (unsigned k = 0; k < 3; ++k) after[k] = to_[triangles_[t + k]];
      if (components_.is_gone_with(triangles_[t]) || is_degenerate(after)) continue;
      keep_triangle(t, after, kept);
      kept += 3;
    }
    resize_triangles(kept);
  }

  const SimplifierInput& input_;
  Simplified result_;
  std::vector<uint32_t> triangles_;
  std::vector<uint32_t> corners_;  ///< by corner of these: that of the input whose values it has
  std::vector<uint32_t> face_of_;  ///< by triangle: that of the input
  bool with_seams_ = false;
  bool stale_ = true;  ///< the lists of faces are not those of the triangles
  uint32_t vertices_;
  std::vector<Vertex> vertex_;
  std::vector<Quadric> quadric_;
  std::vector<Quadric> seam_quadric_;  ///< planes on seams, as long as these are kept
  std::vector<double> seam_at_home_;
  std::vector<uint32_t> to_;  ///< by vertex: what it was merged into; itself, if it is there
  double cap_ = 0, worst_ = 0;

  std::vector<uint32_t> alive_;          ///< vertices that have faces, rising
  std::vector<uint32_t> first_, end_;    ///< by vertex: in others_
  std::vector<Others> others_;           ///< by vertex and face
  std::vector<uint32_t> slots_;          ///< likewise the corner in triangles_; with values only
  std::vector<Neighbour> ring_;          ///< of the vertex at hand
  std::vector<uint32_t> place_in_ring_;  ///< by vertex
  std::vector<Candidate> candidates_;
  std::vector<uint32_t> best_;    ///< by vertex: what it would be merged into
  std::vector<float> least_;      ///< at this cost
  std::vector<uint8_t> changed_;  ///< by vertex: that may be another one now
  std::vector<uint8_t> touched_;
  std::vector<uint32_t> merged_;  ///< into these others were, in this pass
  LooseComponents components_;

  std::vector<Replacement> replacements_;
  std::vector<std::pair<uint32_t, uint32_t>> replaced_;  ///< by vertex of a pass: from, to in these
};

}  // namespace

Simplified simplify(const SimplifierInput& input) {
  return Simplifier(input).run();
}

}  // namespace maille
