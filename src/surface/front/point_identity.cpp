#include "surface/front/point_identity.h"

#include <algorithm>
#include <array>

#include "entropy/integer_model.h"
#include "entropy/rans.h"

namespace maille {
namespace {

/// Points and how often each was met. A point's slot is checked against the list, so that the slots need no
/// clearing between vertices (Briggs and Torczon 1993).
class Candidates {
 public:
  // Slots are bytes, and the search for the most frequent one goes through all.
  static constexpr size_t most = 64;

  explicit Candidates(size_t points) : slot_of_(points) {}
  void clear() { list_.clear(); }
  void add(uint32_t point) {
    if (Candidate* candidate = find(point)) {
      ++candidate->count;
    } else if (list_.size() < most) {
      slot_of_[point] = static_cast<uint8_t>(list_.size());
      list_.push_back({point, 1});
    }
  }
  void exclude(uint32_t point) {
    if (Candidate* candidate = find(point)) candidate->count = 0;
  }
  /// The first met of those with the highest count, which is then taken out; none when there is none left.
  uint32_t take_most_frequent() {
    Candidate* best = nullptr;
    for (Candidate& candidate : list_) {
      if (candidate.count > (best == nullptr ? 0 : best->count)) best = &candidate;
    }
    if (best == nullptr) return none;
    best->count = 0;
    return best->point;
  }

 private:
  struct Candidate {
    uint32_t point;
    uint32_t count;
  };
  Candidate* find(uint32_t point) {
    const size_t slot = slot_of_[point];
    return slot < list_.size() && list_[slot].point == point ? &list_[slot] : nullptr;
  }

  std::vector<Candidate> list_;
  std::vector<uint8_t> slot_of_;  // by point
};

/// Codes for each vertex whether it is a copy, and of which point. A copy lies next to copies: where a known
/// neighbour's point has other vertices, the points around those are candidates (where faces lie twice, the
/// second sheet follows the first this way).
template <class Coder>
class IdentityCoder {
 public:
  IdentityCoder(Coder& coder, const HalfEdges& surface, const SurfaceVertices& vertices)
      : coder_(coder),
        surface_(surface),
        vertices_(vertices),
        next_twin_(vertices.size(), none),
        candidates_(vertices.size()) {}

  /// Codes the point of the next vertex; `point` is it, or at least the count of points when it is new
  /// (encoder).
  Result<uint32_t> code(uint32_t vertex, uint32_t point) {
    was_copy_ = copy_[context_of(vertex)].code(coder_, point < point_count());
    if (!was_copy_) return add_point(vertex);
    find_candidates(vertex);
    uint32_t found = none;
    for (unsigned i = 0; i < candidate_limit && found == none; ++i) {
      const uint32_t candidate = candidates_.take_most_frequent();
      if (candidate == none) break;
      if (hit_[std::min<unsigned>(i, 5)].code(coder_, candidate == point)) found = candidate;
    }
    if (found == none) {
      found = coder_.code_raw(point, bit_length(point_count()));
      if (found >= point_count())
        return failure(ErrorCode::corrupt, "a vertex is a copy of a point that is not there");
    }
    add_vertex(vertex, found);
    return found;
  }
  /// Points so far; the next new one has this number.
  uint32_t point_count() const { return static_cast<uint32_t>(newest_vertex_.size()); }
  std::vector<uint32_t> take_points() { return std::move(point_of_); }

 private:
  // So many candidates are asked for, then the number is raw. Chosen, not swept.
  static constexpr unsigned candidate_limit = 6;
  // They bound the work at vertices of many edges and points of many vertices. With 6 and 24 before, decoding
  // took longer: abominevole went from 0.45 to 1.15 of draco's speed with this and faster loops (717aa87).
  static constexpr unsigned most_twins = 2;
  static constexpr unsigned most_turns = 8;

  uint32_t add_point(uint32_t vertex) {
    newest_vertex_.push_back(none);
    add_vertex(vertex, point_count() - 1);
    return point_count() - 1;
  }
  void add_vertex(uint32_t vertex, uint32_t point) {
    next_twin_[vertex] = newest_vertex_[point];
    newest_vertex_[point] = vertex;
    point_of_.push_back(point);
  }
  /// The point of a vertex, when it came before `limit` and is none of the dummies.
  uint32_t known_point(uint32_t vertex, uint32_t limit) const {
    return vertex < limit ? point_of_[vertex] : none;
  }

  bool is_copy(uint32_t vertex, uint32_t limit) const { return vertex < limit && next_twin_[vertex] != none; }

  /// Are the neighbours in the vertex's first face copies, was the vertex before?
  unsigned context_of(uint32_t vertex) const {
    const uint32_t h = vertices_.corner[vertex];
    const unsigned next = is_copy(surface_.origin[surface_.next(h)], vertex);
    const unsigned previous = is_copy(surface_.origin[surface_.previous(h)], vertex);
    return 2 * (next + previous) + static_cast<unsigned>(was_copy_);
  }

  /// Points that the vertex's faces have already are none.
  void find_candidates(uint32_t vertex) {
    candidates_.clear();
    known_.clear();
    const uint32_t first = vertices_.corner[vertex];
    uint32_t h = first;
    for (unsigned turns = 0; turns < most_turns; ++turns) {
      const uint32_t next = surface_.next(h);
      const uint32_t neighbour = surface_.origin[next];
      const uint32_t point = known_point(neighbour, vertex);
      if (point != none) {
        known_.push_back(point);
        const uint32_t across =
            known_point(surface_.origin[surface_.previous(surface_.opposite[next])], vertex);
        if (across != none) known_.push_back(across);
        collect_around_twins(neighbour, point, vertex);
      }
      h = surface_.turn(h);
      if (h == first) break;
    }
    for (const uint32_t point_of_face : known_) candidates_.exclude(point_of_face);
  }

  void collect_around_twins(uint32_t neighbour, uint32_t point, uint32_t limit) {
    uint32_t twin = newest_vertex_[point];
    for (unsigned twins = 0; twin != none && twins < most_twins; twin = next_twin_[twin]) {
      if (twin == neighbour) continue;
      ++twins;
      const uint32_t first = vertices_.corner[twin];
      uint32_t h = first;
      for (unsigned turns = 0; turns < most_turns; ++turns) {
        const uint32_t candidate = known_point(surface_.origin[surface_.next(h)], limit);
        if (candidate != none) candidates_.add(candidate);
        h = surface_.turn(h);
        if (h == first) break;
      }
    }
  }

  Coder& coder_;
  const HalfEdges& surface_;
  const SurfaceVertices& vertices_;
  std::vector<uint32_t> point_of_;       // by vertex
  std::vector<uint32_t> newest_vertex_;  // by point
  std::vector<uint32_t> next_twin_;      // by vertex
  Candidates candidates_;
  std::vector<uint32_t> known_;
  bool was_copy_ = false;
  std::array<BitModel, 6> copy_;
  std::array<BitModel, 6> hit_;
};

/// Points in the order of their first vertices.
uint32_t number_points(const SurfaceVertices& vertices, std::span<const uint32_t> original,
                       std::vector<uint32_t>& point_of) {
  uint32_t highest = 0;
  for (uint32_t vertex = 0; vertex < vertices.size(); ++vertex) {
    highest = std::max(highest, original[vertex] + 1);
  }
  std::vector<uint32_t> number(highest, none);
  uint32_t count = 0;
  point_of.assign(vertices.size(), none);
  for (uint32_t vertex = 0; vertex < vertices.size(); ++vertex) {
    uint32_t& point = number[original[vertex]];
    if (point == none) point = count++;
    point_of[vertex] = point;
  }
  return count;
}

}  // namespace

std::vector<std::byte> encode_point_identity(const HalfEdges& surface, const SurfaceVertices& vertices,
                                             std::span<const uint32_t> original,
                                             std::vector<uint32_t>& point_of, uint32_t& point_count) {
  point_count = number_points(vertices, original, point_of);
  if (point_count == vertices.size()) {
    point_of.clear();
    return {};
  }
  RansEncoder encoder;
  IdentityCoder<RansEncoder> coder(encoder, surface, vertices);
  for (uint32_t vertex = 0; vertex < vertices.size(); ++vertex) {
    (void)coder.code(vertex, point_of[vertex]);
  }
  std::vector<std::byte> bytes = encoder.finish();
  bytes.push_back(std::byte{1});  // never empty
  return bytes;
}

Result<> decode_point_identity(const HalfEdges& surface, const SurfaceVertices& vertices, Bytes bytes,
                               std::vector<uint32_t>& point_of, uint32_t& point_count) {
  if (bytes.empty()) {
    point_count = vertices.size();
    return {};
  }
  RansDecoder decoder(bytes.first(bytes.size() - 1));
  IdentityCoder<RansDecoder> coder(decoder, surface, vertices);
  for (uint32_t vertex = 0; vertex < vertices.size(); ++vertex) {
    if (auto point = coder.code(vertex, 0); !point) return tl::unexpected(std::move(point).error());
    if (decoder.exhausted()) return failure(ErrorCode::corrupt, "the stream of point copies ends early");
  }
  point_of = coder.take_points();
  point_count = coder.point_count();
  return {};
}

}  // namespace maille
