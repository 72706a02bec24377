// Codes a closed surface face by face from its front: the degrees of faces and the valences of vertices,
// everything else follows from them (Touma and Gotsman 1998 for triangles; Khodakovsky, Alliez, Desbrun and
// Schroeder 2002 and Isenburg 2002 for polygons; the choice of the next pivot after Alliez and Desbrun 2001).
// Encoder and decoder are one function, FrontCoder::code_face: where the encoder looks at the surface, the
// decoder reads, and builds.
#include "surface/front/connectivity.h"

#include <algorithm>
#include <array>
#include <string>

#include "base/pages.h"
#include "base/result.h"
#include "entropy/mixing.h"
#include "surface/front/connectivity_models.h"
#include "surface/front/front.h"

namespace maille {
namespace {

// Highest bit of an origin in the encoder: the half-edge's vertex has a number in coded order already.
// Vertices are below first_dummy (2^30), and dummies below 2^31, as each takes three half-edges of 2^31.
// Points are taken to be below 2^31, too.
constexpr uint32_t numbered = 0x80000000;
// Splits up to so many steps from their gate are coded by steps, others by the number of the node. Part of
// the format; chosen, not swept. It also bounds the walk of a decoder for each split.
constexpr uint32_t near_steps = 256;
/// Nodes looked at on either side for the next pivot; part of the format (2e3ac33). No sweep is recorded; a
/// window of 4, which the coder without mixing had, is gone.
constexpr uint32_t pivot_window = 24;

template <class T>
T clamped(T value, T low, T high) {
  return value < low ? low : value > high ? high : value;
}

/// Codes the faces of a closed surface, one component after the other. `surface` is what the encoder looks
/// at, and what the decoder builds; `vertices` are filled on both sides. The decoder's work is bounded: each
/// face takes half-edges, of which there are max_half_edges, and each list and node is made by a face.
template <class Coder>
class FrontCoder {
 public:
  FrontCoder(Coder& coder, const ConnectivityHeader& header, HalfEdges& surface, SurfaceVertices& vertices)
      : coder_(coder), header_(header), surface_(surface), vertices_(vertices) {}

  Result<> code_component(uint32_t seed);

  // Encoder only.
  std::vector<uint32_t> points;
  std::vector<uint32_t> first_half_edges;
  std::vector<bool> coded;  // by half-edge
  uint32_t point_count = 0;
  // Decoder only.
  // The decoder refuses faces beyond so many half-edges, whatever its bytes say.
  uint32_t max_half_edges = 0;
  /// Room for half-edges, of which half_edges() are in use.
  void make_room();
  uint32_t half_edges() const { return half_edges_; }

 private:
  static constexpr bool encoding = Coder::encoding;

  /// Where on the front a vertex was found, which only the encoder fills.
  struct Target {
    uint32_t node = none;
    uint32_t steps = none;  ///< along the front from the gate; none: too many
    bool backward = false;
    uint32_t share =
        0;  ///< free edges of the node before the face; all but one: the face goes on along the front
  };

  Result<> code_list(uint32_t pivot);
  Result<> code_face(uint32_t pivot, uint32_t& first);
  Result<> code_chain(uint32_t first, uint32_t end, uint32_t h, uint32_t left);
  Result<uint32_t> code_degree(uint32_t first, uint32_t known, uint32_t h);
  bool code_on_front(uint32_t first, uint32_t end, bool on_front);
  Result<uint32_t> begin_face(uint32_t h, uint32_t degree);
  Result<uint32_t> code_new_vertex(uint32_t first, uint32_t h);
  Result<uint32_t> code_front_node(uint32_t first, Target target);
  Result<bool> split(uint32_t first, uint32_t node, uint32_t edge, uint32_t share);
  Result<uint32_t> follow_front(uint32_t first, uint32_t node, uint32_t& h, uint32_t& left);
  uint32_t choose_pivot(uint32_t from) const;

  /// Decoder: are there as many real vertices as a closed surface can have? A component of v vertices, e
  /// edges and f >= 2 faces has v <= 2 + e - f <= e. So none gets a number from first_dummy on.
  bool too_many_vertices() const { return !encoding && vertices_.size() >= max_half_edges / 2; }
  uint32_t number_vertex(uint32_t h, bool dummy, uint32_t valence);
  uint32_t valence_at(uint32_t h) const;
  FrontView view(uint32_t first, uint32_t end) const;
  Target find_on_front(uint32_t first, uint32_t h);
  uint32_t node_behind(uint32_t edge);
  void set_edge(uint32_t node, uint32_t edge) {
    front_[node].edge = edge;
    if (encoding && !node_of_edge_.empty()) node_of_edge_[edge] = node;
  }
  bool is_dummy(uint32_t node) const { return front_[node].vertex >= first_dummy; }
  tl::unexpected<Error> corrupt(const char* what) const {
    return failure(ErrorCode::corrupt, std::string("connectivity of a patch: ") + what);
  }

  Coder& coder_;
  const ConnectivityHeader& header_;
  HalfEdges& surface_;
  SurfaceVertices& vertices_;
  Front front_;
  ConnectivityModels models_;
  std::vector<uint32_t> valences_;  // by vertex
  // Encoder: the node of each edge of the front, once searches have cost too much; see node_behind().
  std::vector<uint32_t> node_of_edge_;
  uint64_t searched_ = 0;
  // Searches may look at so many nodes for each half-edge before all nodes are noted by edge: 1.5 million
  // quads with many handles took 5.5 s before and 2.4 s since, encoded and decoded (8f12bfd). The table takes
  // memory that most meshes need not spend. Chosen, not swept.
  static constexpr uint64_t most_searched = 16;
  uint32_t half_edges_ = 0;  // decoder
  uint32_t dummies_ = 0;
};

/// Gives the vertex of half-edge h the next number; dummies count apart. In the encoder all corners around it
/// learn it at once; in the decoder each corner learns it when its face comes.
template <class Coder>
uint32_t FrontCoder<Coder>::number_vertex(uint32_t h, bool dummy, uint32_t valence) {
  const uint32_t vertex = dummy ? first_dummy + dummies_++ : vertices_.size();
  if (!dummy) {
    vertices_.corner.push_back(h);
    valences_.push_back(valence);
    if constexpr (encoding) points.push_back(surface_.origin[h]);
  }
  if constexpr (encoding) {
    uint32_t around = h;
    do {
      surface_.origin[around] = vertex | numbered;
      around = surface_.turn(around);
    } while (around != h);
  } else {
    surface_.origin[h] = vertex;
  }
  return vertex;
}

/// Encoder: the next face to be coded starts at h. Decoder: makes room for it, returns its first half-edge.
template <class Coder>
Result<uint32_t> FrontCoder<Coder>::begin_face(uint32_t h, uint32_t degree) {
  if constexpr (encoding) {
    first_half_edges.push_back(h);
    for (uint32_t e = h, i = 0; i < degree; ++i, e = surface_.next(e)) coded[e] = true;
    return h;
  } else {
    const uint32_t base = half_edges_;
    if (degree > max_degree) return corrupt("a face with too many edges");
    // base is at most max_half_edges, so the difference cannot wrap.
    if (degree > max_half_edges - base) return corrupt("more faces than the patch may have");
    half_edges_ += degree;
    // Room is made only for faces that were really decoded.
    if (half_edges_ > surface_.size()) make_room();
    if (!(header_.uniform_degree && header_.regular_degree == 3)) {
      for (uint32_t i = 1; i < degree; ++i) surface_.following.push_back(base + i);
      surface_.following.push_back(base);
    }
    return base;
  }
}

template <class Coder>
void FrontCoder<Coder>::make_room() {
  // Grows with what has been decoded; the first room was reserved.
  const size_t room =
      std::max<size_t>({half_edges_, surface_.origin.size() * 3 / 2, surface_.origin.capacity()});
  surface_.origin.resize(room, none);
  surface_.opposite.resize(room, none);
}

/// Degree of the face at the gate behind `first`, of which `known` edges are on the front. It costs nothing
/// where it follows: in surfaces of triangles, in uniform ones without border, and of border triangles.
template <class Coder>
Result<uint32_t> FrontCoder<Coder>::code_degree(uint32_t first, uint32_t known, uint32_t h) {
  if (header_.uniform_degree && header_.regular_degree == 3) return 3u;
  if (header_.uniform_degree && !header_.has_border) return header_.regular_degree;
  // A face with a dummy vertex is a border triangle.
  // Both sides walk over the same known edges, so both see the same dummies.
  bool dummy = is_dummy(first);
  uint32_t last = first;
  for (uint32_t i = 0; i < known; ++i) {
    last = front_[last].next;
    dummy |= is_dummy(last);
  }
  if (dummy) return 3u;
  const auto regular = static_cast<int32_t>(header_.regular_degree);
  int32_t offset = 0;
  if constexpr (encoding) offset = static_cast<int32_t>(surface_.degree(h)) - regular;
  models_.look(view(first, last));
  const int32_t degree = regular + models_.code_degree(coder_, offset);
  if (degree < 3) return corrupt("a face of fewer than three edges");
  return static_cast<uint32_t>(degree);
}

/// Is the next vertex of the face, between `first` and `end`, on the front?
template <class Coder>
bool FrontCoder<Coder>::code_on_front(uint32_t first, uint32_t end, bool on_front) {
  models_.look(view(first, end));
  return models_.code_on_front(coder_, on_front);
}

/// What both sides know around the gate, clamped so that sums of it cannot overflow and hashes stay few.
template <class Coder>
FrontView FrontCoder<Coder>::view(uint32_t first, uint32_t end) const {
  const auto regular = static_cast<int32_t>(header_.regular_valence);
  const auto relative = [&](uint32_t vertex) {
    if (vertex >= first_dummy) return FrontView::dummy;
    return clamped(static_cast<int32_t>(std::min(valences_[vertex], 1000u)) - regular, -20, 40);
  };
  const auto look_at = [&](uint32_t node) {
    return FrontView::Node{relative(front_[node].vertex), std::min(front_[node].free, 15u)};
  };
  const uint32_t across = surface_.origin[surface_.previous(front_[first].edge)] & ~numbered;
  return {look_at(front_[first].previous), look_at(first), look_at(end), look_at(front_[end].next),
          FrontView::Node{relative(across), 0}};
}

/// A vertex that the front has not met: is it a dummy, and how many edges has it? Returns its node, which has
/// two edges less free: those of the face that it comes up in.
template <class Coder>
Result<uint32_t> FrontCoder<Coder>::code_new_vertex(uint32_t first, uint32_t h) {
  bool dummy = false;
  uint32_t valence = valence_at(h);
  if constexpr (encoding) dummy = surface_.origin[h] >= point_count;
  const uint32_t last = front_[first].next;
  if (header_.has_border) {
    const unsigned context =
        is_dummy(first) + 2 * is_dummy(last) + 4 * clamped<unsigned>(front_[first].free, 0, 3);
    dummy = models_.dummy[context].code(coder_, dummy);
  }
  if (dummy) {
    valence = models_.dummy_valence.code(coder_, valence - 2) + 2;
  } else {
    const auto regular = static_cast<int32_t>(header_.regular_valence);
    const int32_t offset = static_cast<int32_t>(valence) - regular;
    const int32_t coded_valence = regular + models_.code_valence(coder_, offset);
    if (coded_valence < 2) return corrupt("a vertex of fewer than two edges");
    if (too_many_vertices()) return corrupt("more vertices than the patch may have");
    valence = static_cast<uint32_t>(coded_valence);
  }
  const uint32_t vertex = number_vertex(h, dummy, valence);
  return front_.create(vertex, none, valence - 2);
}

/// Encoder: the node whose gap the corner h lies in, and how the face divides its free edges.
template <class Coder>
auto FrontCoder<Coder>::find_on_front(uint32_t first, uint32_t h) -> Target {
  Target target;
  uint32_t crossed = 0;
  uint32_t e = h;
  for (; !coded[surface_.opposite[e]]; ++crossed) e = surface_.next(surface_.opposite[e]);
  const uint32_t edge = surface_.opposite[e];
  uint32_t ahead = front_[first].next;
  uint32_t behind = first;
  for (uint32_t i = 0; i < near_steps && target.node == none; ++i) {
    ahead = front_[ahead].next;
    behind = front_[behind].previous;
    if (front_[ahead].edge != edge && front_[behind].edge != edge) continue;
    target.steps = i;
    target.backward = front_[ahead].edge != edge;
    target.node = target.backward ? behind : ahead;
  }
  if (target.node == none) target.node = node_behind(edge);
  // Faces that are not coded yet were crossed between this corner and the front: so many free edges lie
  // behind the face.
  target.share = front_[target.node].free - 1 - crossed;
  return target;
}

/// Encoder: the node of an edge of the front, wherever it is. Rare: handles, and splits far from their gate.
template <class Coder>
uint32_t FrontCoder<Coder>::node_behind(uint32_t edge) {
  if (node_of_edge_.empty()) {
    uint32_t node = 0;
    while (!front_.alive(node) || front_[node].edge != edge) ++node;
    searched_ += node;
    if (searched_ <= most_searched * surface_.size()) return node;
    // Not rare in this mesh: from now on, nodes are noted by edge.
    node_of_edge_.assign(surface_.size(), none);
    for (node = 0; node < front_.slots(); ++node) {
      if (front_.alive(node) && front_[node].edge != none) node_of_edge_[front_[node].edge] = node;
    }
  }
  return node_of_edge_[edge];
}

/// A vertex that is on the front: which of its nodes? By steps along the front where it is near, else by
/// number. Only damaged bytes name the gate itself, or a vertex that is finished.
template <class Coder>
Result<uint32_t> FrontCoder<Coder>::code_front_node(uint32_t first, Target target) {
  uint32_t node = target.node;
  if (models_.near.code(coder_, target.steps != none)) {
    const bool backward = models_.backward.code(coder_, target.backward);
    const uint32_t steps = models_.steps[backward].code(coder_, target.steps);
    if (steps >= near_steps) return corrupt("a split too far from its gate");
    node = backward ? first : front_[first].next;
    for (uint32_t i = 0; i <= steps; ++i) node = backward ? front_[node].previous : front_[node].next;
  } else {
    node = coder_.code_raw(node, bit_length(front_.slots()));
    if (node >= front_.slots() || !front_.alive(node))
      return corrupt("a split at a vertex that is not on the front");
  }
  if (node == first || node == front_[first].next) return corrupt("a split at the gate itself");
  if (front_[node].free == 0) return corrupt("a split at a finished vertex");
  return node;
}

/// Splits the gap of `node`, which the chain has just reached over `edge`: the part before the face goes to a
/// new node, which closes the list behind the chain; `node` keeps the part behind. If `node` was on another
/// list, the same links merge both lists (Front). Returns whether the face goes on along the front.
template <class Coder>
Result<bool> FrontCoder<Coder>::split(uint32_t first, uint32_t node, uint32_t edge, uint32_t share) {
  const unsigned context = (is_dummy(node) ? 2u : 0u) + (front_[node].free > 2 ? 1u : 0u);
  share = models_.share[context].code(coder_, share);
  if (share >= front_[node].free) return corrupt("a split with more edges than the vertex has");
  const bool along = share == front_[node].free - 1;
  if (!along) front_[node].free -= 2 + share;
  const uint32_t end = front_[first].next;
  const uint32_t before = front_.create(front_[node].vertex, edge, share);
  set_edge(before, edge);
  front_.link(front_[node].previous, before);
  front_.link(before, end);
  front_.link(first, node);
  front_.remember(before);
  return along;
}

/// The face goes on along the front behind `node`, whose half-edge in the face is h: takes edges of the front
/// into the face as long as the vertices between them are finished. h and `left` (vertices still to come)
/// move along. Returns the node where the face leaves the front. `left` bounds the loop.
template <class Coder>
Result<uint32_t> FrontCoder<Coder>::follow_front(uint32_t first, uint32_t node, uint32_t& h, uint32_t& left) {
  do {
    const uint32_t next = front_[node].next;
    if (left == 0 || next == first) return corrupt("a face with more edges than its degree");
    if constexpr (!encoding) surface_.glue(h, front_[node].edge);
    front_.link(first, next);
    front_.remove(node);
    h = surface_.next(h);
    if constexpr (!encoding) surface_.origin[h] = front_[next].vertex;
    node = next;
    --left;
  } while (front_[node].free == 0);
  --front_[node].free;
  return node;
}

/// The vertices of the face that the gate does not show: `left` of them, from `end` round to `first`. h is
/// the half-edge of the face that leaves `end`.
template <class Coder>
Result<> FrontCoder<Coder>::code_chain(uint32_t first, uint32_t end, uint32_t h, uint32_t left) {
  while (left > 0) {
    --left;
    const uint32_t edge = h;
    h = surface_.next(h);
    bool on_front = false;
    if constexpr (encoding) on_front = (surface_.origin[h] & numbered) != 0;
    if (code_on_front(first, end, on_front)) {
      Target target;
      if constexpr (encoding) target = find_on_front(first, h);
      const uint32_t node = MAILLE_TRY(code_front_node(first, target));
      if constexpr (!encoding) surface_.origin[h] = front_[node].vertex;
      const bool along = MAILLE_TRY(split(first, node, edge, target.share));
      end = along ? MAILLE_TRY(follow_front(first, node, h, left)) : node;
    } else {
      const uint32_t node = MAILLE_TRY(code_new_vertex(first, h));
      set_edge(node, edge);
      front_.link(first, node);
      front_.link(node, end);
      end = node;
    }
    if (coder_.exhausted()) return corrupt("the stream ends early");
  }
  set_edge(first, h);
  return {};
}

/// One face at the gate from `pivot` to its next node. `first` becomes the node where the face leaves the
/// front, none when it was the last of its list. The order is: degree, the edges that are on the front
/// already, then the vertices between.
template <class Coder>
Result<> FrontCoder<Coder>::code_face(uint32_t pivot, uint32_t& first) {
  // Around a vertex with no free edges the face goes on along the front.
  first = pivot;
  uint32_t last = front_[pivot].next;
  uint32_t known = 1;
  for (; front_[last].free == 0 && last != first; ++known) last = front_[last].next;
  for (; front_[first].free == 0 && first != last; ++known) first = front_[first].previous;

  uint32_t h = none;
  if constexpr (encoding) h = surface_.opposite[front_[first].edge];
  const uint32_t degree = MAILLE_TRY(code_degree(first, known, h));
  // Two nodes without free edges would bound a face of two edges: only damage makes such a list.
  if (degree < known || (degree == known) != (first == last))
    return corrupt("a face that does not fit its gate");
  h = MAILLE_TRY(begin_face(h, degree));

  uint32_t node = first;
  for (uint32_t i = 0; i < known; ++i, h = surface_.next(h)) {
    if constexpr (!encoding) {
      surface_.origin[h] = front_[node].vertex;
      surface_.glue(h, front_[node].edge);
    }
    const uint32_t next = front_[node].next;
    if (i > 0 || first == last) front_.remove(node);
    node = next;
  }
  if (first == last) {
    first = none;
    return {};
  }
  if constexpr (!encoding) surface_.origin[h] = front_[last].vertex;
  front_.link(first, last);
  --front_[first].free;
  --front_[last].free;
  return code_chain(first, last, h, degree - known - 1);
}

/// The node with the fewest free edges near `from`, the nearest of them; dummies only when there is nothing
/// else. Vertices that are nearly finished come first (Alliez and Desbrun 2001), so that fewer splits are
/// needed.
template <class Coder>
uint32_t FrontCoder<Coder>::choose_pivot(uint32_t from) const {
  uint32_t best = from;
  uint32_t fewest = is_dummy(from) ? none : front_[from].free;
  uint32_t ahead = from;
  uint32_t behind = from;
  for (uint32_t i = 0; i < pivot_window && fewest > 0; ++i) {
    ahead = front_[ahead].next;
    behind = front_[behind].previous;
    for (const uint32_t node : {ahead, behind}) {
      if (front_[node].free < fewest && !is_dummy(node)) {
        best = node;
        fewest = front_[node].free;
      }
    }
    if (ahead == behind || front_[ahead].next == behind) break;
  }
  return best;
}

/// Codes faces until the list of `pivot` and what splits off it are used up. Each turn codes a face, so
/// half-edges bound it.
template <class Coder>
Result<> FrontCoder<Coder>::code_list(uint32_t pivot) {
  while (pivot != none) {
    uint32_t first = none;
    MAILLE_CHECK(code_face(pivot, first));
    if (coder_.exhausted()) return corrupt("the stream ends early");
    if (first == none) {
      pivot = front_.take_pending();
    } else if (first != pivot) {
      pivot = choose_pivot(first);  // otherwise stay: a pivot is finished before the next is taken
    }
  }
  return {};
}

/// Encoder: the edges of a vertex, by a turn around it; 0 in the decoder, which reads it.
template <class Coder>
uint32_t FrontCoder<Coder>::valence_at(uint32_t h) const {
  uint32_t valence = 0;
  if constexpr (encoding) {
    for (uint32_t e = h; valence == 0 || e != h; e = surface_.turn(e)) ++valence;
  }
  return valence;
}

/// Codes one component, whose first face starts at half-edge `seed` (encoder) and has only new vertices.
template <class Coder>
Result<> FrontCoder<Coder>::code_component(uint32_t seed) {
  auto degree = static_cast<int32_t>(header_.regular_degree);
  if (!header_.uniform_degree) {
    int32_t offset = 0;
    if constexpr (encoding) offset = static_cast<int32_t>(surface_.degree(seed)) - degree;
    degree += models_.first_degree.code(coder_, offset);
  }
  if (degree < 3) return corrupt("a face of fewer than three edges");
  uint32_t h = MAILLE_TRY(begin_face(seed, static_cast<uint32_t>(degree)));
  // Seen from outside, the face runs backwards: the node of each vertex goes before that of the vertex it
  // follows.
  uint32_t first = none;
  uint32_t newest = none;
  for (int32_t i = 0; i < degree; ++i) {
    const auto regular = static_cast<int32_t>(header_.regular_valence);
    const int32_t valence =
        regular + models_.first_valence.code(coder_, static_cast<int32_t>(valence_at(h)) - regular);
    if (valence < 2) return corrupt("a vertex of fewer than two edges");
    if (too_many_vertices()) return corrupt("more vertices than the patch may have");
    if (coder_.exhausted()) return corrupt("the stream ends early");
    const uint32_t vertex = number_vertex(h, false, static_cast<uint32_t>(valence));
    const uint32_t node = front_.create(vertex, newest == none ? none : surface_.previous(h),
                                        static_cast<uint32_t>(valence) - 2);
    if (newest == none) first = node;
    if (newest != none) set_edge(node, surface_.previous(h));
    if (newest != none) front_.link(node, newest);
    newest = node;
    h = surface_.next(h);
  }
  front_.link(first, newest);
  set_edge(first, surface_.previous(h));
  return code_list(first);
}

uint32_t most_frequent(const std::vector<uint32_t>& histogram) {
  return static_cast<uint32_t>(std::max_element(histogram.begin(), histogram.end()) - histogram.begin());
}

ConnectivityHeader describe(const HalfEdges& surface, uint32_t real_half_edges, uint32_t point_count) {
  ConnectivityHeader header;
  header.has_border = surface.size() > real_half_edges;
  // Degrees and valences from 63 on are one class. Whatever is called regular, files are valid; what occurs
  // most makes them small.
  std::vector<uint32_t> degrees(64);
  for (uint32_t h = 0; h < real_half_edges;) {
    const unsigned degree = surface.degree(h);
    ++degrees[std::min(degree, 63u)];
    h += degree;
  }
  header.regular_degree = std::max(most_frequent(degrees), 3u);
  // All classes but one are empty, and the one that is left is no mixture.
  header.uniform_degree = std::count(degrees.begin(), degrees.end(), 0u) == 63 && header.regular_degree < 63;
  std::vector<uint32_t> uses(point_count);
  for (uint32_t h = 0; h < real_half_edges; ++h) ++uses[surface.origin[h]];
  std::vector<uint32_t> valences(64);
  for (const uint32_t count : uses) ++valences[std::min(count, 63u)];
  valences[0] = 0;
  header.regular_valence = std::max(most_frequent(valences), 2u);
  return header;
}

}  // namespace

CodedConnectivity encode_connectivity(HalfEdges& surface, uint32_t real_half_edges, uint32_t point_count) {
  CodedConnectivity result;
  result.header = describe(surface, real_half_edges, point_count);
  RangeEncoder encoder;
  FrontCoder<RangeEncoder> coder(encoder, result.header, surface, result.vertices);
  coder.coded.resize(surface.size());
  coder.point_count = point_count;
  for (uint32_t h = 0; h < real_half_edges; h += surface.degree(h)) {
    if (coder.coded[h]) continue;
    ++result.header.components;
    // Only the decoder finds errors.
    (void)coder.code_component(h);
  }
  result.points = std::move(coder.points);
  result.first_half_edges = std::move(coder.first_half_edges);
  result.bytes = encoder.finish();
  for (uint32_t& origin : surface.origin) origin &= ~numbered;
  return result;
}

Result<DecodedConnectivity> decode_connectivity(const ConnectivityHeader& header, Bytes bytes,
                                                uint32_t max_half_edges, uint32_t expected_half_edges) {
  DecodedConnectivity result;
  // Room for what is expected, but not for more than a stream of this size usually holds.
  const size_t room = std::min<size_t>(expected_half_edges, 64 * bytes.size() + 1024);
  reserve_pages(result.surface.origin, room);
  reserve_pages(result.surface.opposite, room);
  // A vertex has about six half-edges.
  result.vertices.corner.reserve(room / 6);
  RangeDecoder decoder(bytes);
  FrontCoder<RangeDecoder> coder(decoder, header, result.surface, result.vertices);
  // Half-edges have 31 bits (most_patch_corners), so that sums of one and a degree do not overflow.
  coder.max_half_edges = std::min(max_half_edges, numbered - 1);
  for (uint32_t i = 0; i < header.components; ++i) MAILLE_CHECK(coder.code_component(none));
  result.surface.origin.resize(coder.half_edges());
  result.surface.opposite.resize(coder.half_edges());
  return result;
}

}  // namespace maille
