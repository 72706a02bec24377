#include "surface/gluing.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "base/sort_few.h"

namespace maille {

/// Triangles are compared without a copy; larger faces are sorted, as they may have 65,535 corners.
bool is_simple(std::span<const uint32_t> corners) {
  if (corners.size() < 3 || corners.size() > max_degree) return false;
  if (corners.size() == 3)
    return corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0];
  std::vector<uint32_t> sorted(corners.begin(), corners.end());
  std::sort(sorted.begin(), sorted.end());
  return std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end();
}

namespace {

/// Half-edges by their undirected edge: those whose smaller point is p lie in [starts[p], starts[p + 1]),
/// ordered by the larger point, then by number. Sorting by counting, then short lists, is linear for meshes
/// whose points have few edges.
struct EdgeTable {
  std::vector<uint32_t> starts;
  std::vector<uint32_t> half_edges;
};

struct Edge {
  uint32_t low;
  uint32_t high;
  bool forward;  ///< from low to high
};

[[gnu::always_inline]] inline Edge edge_of(const HalfEdges& surface, uint32_t h) {
  const uint32_t from = surface.origin[h];
  const uint32_t to = surface.origin[surface.next(h)];
  return from < to ? Edge{from, to, true} : Edge{to, from, false};
}

/// Not ordered yet by the larger point.
EdgeTable make_edge_table(const HalfEdges& surface, uint32_t point_count) {
  EdgeTable table;
  table.starts.assign(size_t{point_count} + 1, 0);
  for (uint32_t h = 0; h < surface.size(); ++h) ++table.starts[edge_of(surface, h).low + 1];
  std::partial_sum(table.starts.begin(), table.starts.end(), table.starts.begin());
  table.half_edges.resize(surface.size());
  for (uint32_t h = surface.size(); h-- > 0;) {
    // Filled from the back, so that numbers ascend; starts end up shifted by one place, as wanted.
    table.half_edges[--table.starts[edge_of(surface, h).low + 1]] = h;
  }
  table.starts.erase(table.starts.begin());
  table.starts.push_back(surface.size());
  return table;
}

/// Half-edges of the same undirected edge as h.
std::span<const uint32_t> same_edge(const EdgeTable& table, const HalfEdges& surface, uint32_t h) {
  const Edge edge = edge_of(surface, h);
  const auto begin = table.half_edges.begin() + table.starts[edge.low];
  const auto end = table.half_edges.begin() + table.starts[edge.low + 1];
  const auto less = [&](uint32_t a, uint32_t high) { return edge_of(surface, a).high < high; };
  const auto from = std::lower_bound(begin, end, edge.high, less);
  auto to = from;
  while (to != end && edge_of(surface, *to).high == edge.high) ++to;
  return std::span(table.half_edges)
      .subspan(static_cast<size_t>(from - table.half_edges.begin()), static_cast<size_t>(to - from));
}

/// Orders the table, and glues every edge that has exactly one face on either side. Returns whether that was
/// all: no other edge has two faces or more. Most meshes need nothing else.
bool glue_plain_edges(HalfEdges& surface, EdgeTable& table, uint32_t point_count) {
  bool all = true;
  std::vector<uint64_t> edges;  // the larger point, then the half-edge: all that is looked at, side by side
  for (uint32_t point = 0; point < point_count; ++point) {
    const std::span half_edges(table.half_edges.data() + table.starts[point],
                               table.starts[point + 1] - table.starts[point]);
    edges.clear();
    for (const uint32_t h : half_edges) edges.push_back(uint64_t{edge_of(surface, h).high} << 32 | h);
    // Lists are short: insertion is faster than std::sort() (88b3f0e).
    sort_few(edges);
    for (size_t i = 0; i < edges.size(); ++i) half_edges[i] = static_cast<uint32_t>(edges[i]);
    for (size_t i = 0; i < edges.size();) {
      size_t end = i + 1;
      while (end < edges.size() && edges[end] >> 32 == edges[i] >> 32) ++end;
      const uint32_t a = half_edges[i];
      const uint32_t b = half_edges[end - 1];
      if (end - i == 2 && (surface.origin[a] == point) != (surface.origin[b] == point)) {
        surface.glue(a, b);
      } else if (end - i > 1) {
        all = false;
      }
      i = end;
    }
  }
  return all;
}

/// Orients the faces and glues them, walking breadth first from face to face. Where there is a choice it
/// takes the face visited first, then a face that need not be flipped, then the one with the lowest number:
/// in an order of faces made by the same walk, each of these rules chooses the same face again. That is what
/// lets a decoder glue decoded faces by itself, and a decoded mesh give the same file again.
class GluingWalk {
 public:
  /// `plain`: by half-edge the other one of a plain edge.
  GluingWalk(HalfEdges& surface, const Faces& faces, const EdgeTable& table,
             const std::vector<uint32_t>& plain)
      : surface_(surface),
        faces_(faces),
        table_(table),
        plain_(plain),
        rank_(faces.size(), none),
        flipped_(faces.size()) {
    find_crowds();
    if (!surface.all_triangles()) {
      face_of_.resize(surface.size());
      for (uint32_t face = 0; face < faces.size(); ++face) {
        std::fill(face_of_.begin() + faces.first(face), face_of_.begin() + faces.first(face + 1), face);
      }
    }
  }

  void run() {
    for (uint32_t seed = 0; seed < faces_.size(); ++seed) {
      if (rank_[seed] != none) continue;
      reach(faces_.first(seed), false);
      while (next_ < queue_.size()) leave(queue_[next_++]);
    }
  }
  const std::vector<bool>& flipped() const { return flipped_; }
  bool chosen() const { return chosen_; }

 private:
  uint32_t face_of(uint32_t h) const { return face_of_.empty() ? h / 3 : face_of_[h]; }
  /// Does h run from its lower to its higher point once its face is oriented?
  bool runs_forward(uint32_t h) const { return edge_of(surface_, h).forward != flipped_[face_of(h)]; }

  /// A face is reached once, by one half-edge, which decides whether it is flipped.
  void reach(uint32_t h, bool flipped) {
    rank_[face_of(h)] = static_cast<uint32_t>(queue_.size());
    flipped_[face_of(h)] = flipped;
    queue_.push_back(h);
    if (crowd_of_.empty()) return;
    uint32_t e = h;
    do {
      if (crowd_of_[e] != none) crowds_[crowd_of_[e]].visited[runs_forward(e)].add(e);
      e = surface_.next(e);
    } while (e != h);
  }

  void leave(uint32_t entry) {
    uint32_t h = entry;
    do {
      if (surface_.opposite[h] == none) glue_one(h);
      h = flipped_[face_of(h)] ? surface_.previous(h) : surface_.next(h);
    } while (h != entry);
  }

  void glue_one(uint32_t h) {
    const bool crowded = !crowd_of_.empty() && crowd_of_[h] != none;
    const uint32_t best = crowded ? best_of_crowd(crowds_[crowd_of_[h]], h) : best_of_few(h);
    if (best == none) return;
    surface_.glue(h, best);
    if (rank_[face_of(best)] == none) reach(best, edge_of(surface_, best).forward == runs_forward(h));
  }

  /// The three rules as ranks: of visited faces the first, else one that need not be flipped, else the lowest
  /// number.
  uint32_t best_of_few(uint32_t h) {
    uint32_t best = none;
    std::pair<uint32_t, uint32_t> best_rank;
    const auto edge = plain_[h] != none ? std::span(&plain_[h], 1) : same_edge(table_, surface_, h);
    for (const uint32_t k : edge) {
      if (surface_.opposite[k] != none || face_of(k) == face_of(h)) continue;
      const uint32_t visited = rank_[face_of(k)];
      if (visited != none && runs_forward(k) == runs_forward(h)) {
        chosen_ = true;  // two faces that cannot agree: a Moebius strip was cut here
        continue;
      }
      const bool must_flip = edge_of(surface_, k).forward == runs_forward(h);
      const std::pair rank = visited != none ? std::pair(0u, visited) : std::pair(must_flip ? 2u : 1u, k);
      if (best == none || rank < best_rank) {
        best = k;
        best_rank = rank;
      }
    }
    chosen_ |= edge.size() > 2;
    return best;
  }

  /// Half-edges of an edge with many faces, by the three rules in turn, so that none is looked at twice.
  struct Crowd {
    /// Half-edges of one direction once oriented, in the order of visits: from `next` on, before `end`.
    struct Visited {
      uint32_t* next = nullptr;
      uint32_t* end = nullptr;
      void add(uint32_t h) { *end++ = h; }
    };
    std::span<const uint32_t> all;              ///< in the order of their numbers
    std::array<size_t, 2> next_unvisited = {};  ///< in `all`, by direction; none before it is unvisited
    std::array<Visited, 2> visited = {};        ///< by direction
  };
  // Edges of more half-edges are crowds, with lists of their own: without these 20,000 triangles on one edge
  // took 10 s, with them 0.13 s (90b0035). The bound between both was not swept.
  static constexpr size_t few = 8;

  void find_crowds() {
    const std::span<const uint32_t> table(table_.half_edges);
    for (size_t i = 0, end = 0; i < table.size(); i = end) {
      end = i + 2;
      if (plain_[table[i]] != none) continue;
      const Edge edge = edge_of(surface_, table[i]);
      for (end = i + 1; end < table.size(); ++end) {
        const Edge other = edge_of(surface_, table[end]);
        if (other.low != edge.low || other.high != edge.high) break;
      }
      if (end - i <= few) continue;
      if (crowd_of_.empty()) {
        crowd_of_.resize(surface_.size(), none);
        // Each half-edge of a crowd is visited once, in one direction or the other.
        visited_.resize(2 * table.size());
      }
      for (size_t k = i; k < end; ++k) crowd_of_[table[k]] = static_cast<uint32_t>(crowds_.size());
      Crowd& crowd = crowds_.emplace_back();
      crowd.all = table.subspan(i, end - i);
      for (size_t direction = 0; direction < 2; ++direction) {
        uint32_t* const place = visited_.data() + direction * table.size() + i;
        crowd.visited[direction] = {place, place};
      }
    }
  }

  uint32_t best_of_crowd(Crowd& crowd, uint32_t h) {
    chosen_ = true;
    const bool forward = runs_forward(h);
    Crowd::Visited& visited = crowd.visited[!forward];
    while (visited.next != visited.end && surface_.opposite[*visited.next] != none) ++visited.next;
    if (visited.next != visited.end) return *visited.next;
    // Those that need not be flipped first; each pointer only moves on, so all visits of a crowd are linear
    // together.
    for (const bool direction : {!forward, forward}) {
      size_t& i = crowd.next_unvisited[direction];
      while (i < crowd.all.size() &&
             (edge_of(surface_, crowd.all[i]).forward != direction || rank_[face_of(crowd.all[i])] != none)) {
        ++i;
      }
      if (i < crowd.all.size()) return crowd.all[i];
    }
    return none;
  }

  HalfEdges& surface_;
  const Faces& faces_;
  const EdgeTable& table_;
  const std::vector<uint32_t>& plain_;
  std::vector<uint32_t> rank_;  // by face: when it was reached
  std::vector<bool> flipped_;
  std::vector<uint32_t> face_of_;
  std::vector<Crowd> crowds_;
  std::vector<uint32_t> crowd_of_;  // by half-edge; empty where there is no crowd
  std::vector<uint32_t> visited_;   // of all crowds, by direction
  std::vector<uint32_t> queue_;     // half-edges by which faces were reached
  size_t next_ = 0;
  bool chosen_ = false;
};

/// Turns flipped faces over: corner 0 stays, the others and the edges change places. Half-edge h is numbered
/// by its origin's corner, so the edges shift by one against the corners.
void turn_over(HalfEdges& surface, const Faces& faces, const std::vector<bool>& flipped) {
  const auto turned = [&](uint32_t face, uint32_t h) {
    const uint32_t first = faces.first(face);
    return flipped[face] ? first + faces.first(face + 1) - 1 - h : h;
  };
  std::vector<uint32_t> new_number(surface.size());
  for (uint32_t face = 0; face < faces.size(); ++face) {
    for (uint32_t h = faces.first(face); h < faces.first(face + 1); ++h) new_number[h] = turned(face, h);
    if (flipped[face]) {
      std::reverse(surface.origin.begin() + faces.first(face) + 1,
                   surface.origin.begin() + faces.first(face + 1));
    }
  }
  std::vector<uint32_t> opposite(surface.size(), none);
  for (uint32_t h = 0; h < surface.size(); ++h) {
    if (surface.opposite[h] != none) opposite[new_number[h]] = new_number[surface.opposite[h]];
  }
  surface.opposite = std::move(opposite);
}

/// The border half-edge that follows b round the border: the next one out of b's end, within the fan of faces
/// there. It ends, as a fan that has a border on one side has one on the other.
uint32_t next_on_border(const HalfEdges& surface, uint32_t b) {
  uint32_t h = surface.next(b);
  while (surface.opposite[h] != none) h = surface.next(surface.opposite[h]);
  return h;
}

/// Closes every border loop with triangles to a dummy vertex, so that everything after knows closed surfaces
/// only. Loops come in the order of their lowest half-edge, triangles in that of the loop: format 12.4.
void close_borders(HalfEdges& surface, uint32_t point_count) {
  const uint32_t real = surface.size();
  const auto triangles =
      static_cast<size_t>(std::count(surface.opposite.begin(), surface.opposite.end(), none));
  // Doubled by the first triangle, these would be the most that an encoder holds.
  surface.origin.reserve(real + 3 * triangles);
  surface.opposite.reserve(real + 3 * triangles);
  uint32_t dummy = point_count;
  const auto add_triangle = [&](uint32_t border) {
    const uint32_t t = surface.size();
    const uint32_t to = surface.origin[surface.next(border)];
    for (const uint32_t origin : {to, surface.origin[border], dummy}) surface.origin.push_back(origin);
    surface.opposite.resize(t + 3, none);
    if (!surface.all_triangles()) {
      for (const uint32_t next : {t + 1, t + 2, t}) surface.following.push_back(next);
    }
    return t;
  };
  std::vector<uint32_t> loop;
  for (uint32_t start = 0; start < real; ++start) {
    if (surface.opposite[start] != none) continue;
    // The loop first: gluing its triangles changes what next_on_border() sees.
    loop.clear();
    for (uint32_t b = start; loop.empty() || b != start; b = next_on_border(surface, b)) loop.push_back(b);
    uint32_t before = none;
    const uint32_t first = surface.size();
    for (const uint32_t b : loop) {
      const uint32_t t = add_triangle(b);
      surface.glue(t, b);
      if (before != none) surface.glue(before + 2, t + 1);
      before = t;
    }
    surface.glue(before + 2, first + 1);
    ++dummy;
  }
}

}  // namespace

GluedSurface glue(const Faces& faces) {
  GluedSurface result;
  HalfEdges& surface = result.half_edges;
  surface.origin.assign(faces.corners.begin(), faces.corners.end());
  surface.opposite.assign(surface.origin.size(), none);
  if (!faces.offsets.empty()) {
    surface.following.resize(surface.origin.size());
    for (uint32_t face = 0; face < faces.size(); ++face) {
      for (uint32_t h = faces.first(face); h < faces.first(face + 1); ++h) surface.following[h] = h + 1;
      surface.following[faces.first(face + 1) - 1] = faces.first(face);
    }
  }
  {
    EdgeTable table = make_edge_table(surface, faces.point_count);
    if (!glue_plain_edges(surface, table, faces.point_count)) {
      // What was glued counts no more: the walk decides about all edges, but need not look up those that are
      // plain (06ec5c6).
      const std::vector<uint32_t> plain =
          std::exchange(surface.opposite, std::vector<uint32_t>(surface.size(), none));
      GluingWalk walk(surface, faces, table, plain);
      walk.run();
      result.plain = false;
      result.chosen = walk.chosen();
      result.flipped = walk.flipped();
    }
  }
  if (std::find(result.flipped.begin(), result.flipped.end(), true) == result.flipped.end())
    result.flipped.clear();
  if (!result.flipped.empty()) turn_over(surface, faces, result.flipped);
  result.real_half_edges = surface.size();
  close_borders(surface, faces.point_count);
  return result;
}

std::vector<uint32_t> breadth_first_faces(const HalfEdges& surface, std::span<const uint32_t> seeds,
                                          const std::vector<bool>& is_real) {
  std::vector<uint32_t> queue;
  std::vector<bool> reached(surface.size());  // by half-edge; all of a face at once
  const auto reach = [&](uint32_t entry) {
    uint32_t h = entry;
    do {
      reached[h] = true;
      h = surface.next(h);
    } while (h != entry);
    queue.push_back(entry);
  };
  size_t next = 0;
  for (const uint32_t seed : seeds) {
    if (reached[seed]) continue;
    reach(seed);
    for (; next < queue.size(); ++next) {
      uint32_t h = queue[next];
      do {
        const uint32_t k = surface.opposite[h];
        if (is_real[k] && !reached[k]) reach(k);
        h = surface.next(h);
      } while (h != queue[next]);
    }
  }
  return queue;
}

}  // namespace maille
