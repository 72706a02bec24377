#include "generate/transfinite_topology.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/result.h"
#include "generate/transfinite_grading.h"
#include "generate/transfinite_vector.h"

namespace maille {

std::string block_text(const BlockDescription& description, size_t block) {
  const std::string& name = description.blocks[block].name;
  return "block " + std::to_string(block) + (name.empty() ? "" : " (" + name + ")");
}

bool BlockTopology::repeats_points(size_t block) const {
  std::array<uint32_t, nodes_per_block> entity;
  for (size_t i = 0; i < entity.size(); ++i) entity[i] = nodes[nodes_per_block * block + i].entity;
  std::sort(entity.begin(), entity.end());
  return std::adjacent_find(entity.begin(), entity.end()) != entity.end();
}

namespace {

constexpr uint32_t per_block = BlockTopology::nodes_per_block;
constexpr unsigned weight[3] = {1, 3, 9};

unsigned place(uint32_t node, unsigned axis) {
  return node / weight[axis] % 3;
}

// Checks a description and finds out which points of blocks are one: blocks are joined by faces with the same
// four vertices, then nodes that meet are gathered to entities.
class Joiner {
 public:
  Joiner(const BlockDescription& description, uint32_t refine) : of_(description), refine_(refine) {}

  Result<BlockTopology> join() {
    MAILLE_CHECK(check_vertices());
    for (size_t i = 0; i < of_.blocks.size(); ++i) MAILLE_CHECK(add_block(i));
    MAILLE_CHECK(join_faces());
    MAILLE_CHECK(add_patches());
    MAILLE_CHECK(make_entities());
    return std::move(t_);
  }

 private:
  using Corners = std::array<uint32_t, 4>;
  struct Link {
    uint32_t node;
    BlockTopology::Node map;
  };

  tl::unexpected<Error> bad(size_t block, const std::string& what) const {
    return failure(ErrorCode::malformed_input, block_text(of_, block) + ": " + what);
  }

  Result<> check_vertices() {
    if (of_.blocks.empty()) return failure(ErrorCode::malformed_input, "there are no blocks");
    for (size_t i = 0; i < of_.curves.size(); ++i) {
      const BlockCurve& curve = of_.curves[i];
      if (std::max(curve.from, curve.to) >= of_.vertices.size()) {
        return failure(ErrorCode::malformed_input, "a curve ends at a vertex that does not exist");
      }
      // The first one counts, as with blockMesh.
      if (curve.kind == CurveKind::line) continue;
      curves_.insert(
          {{std::min(curve.from, curve.to), std::max(curve.from, curve.to)}, static_cast<int32_t>(i)});
    }
    for (const Position& p : of_.vertices) {
      for (const double x : p) {
        if (!std::isfinite(x)) return failure(ErrorCode::malformed_input, "a vertex is not finite");
        largest_ = std::max(largest_, std::fabs(x));
      }
    }
    return {};
  }

  Result<> add_block(size_t i) {
    const HexBlock& block = of_.blocks[i];
    for (const uint32_t corner : block.corners) {
      if (corner >= of_.vertices.size())
        return bad(i, "vertex " + std::to_string(corner) + " does not exist");
    }
    std::array<uint32_t, 3> divisions{};
    for (unsigned a = 0; a < 3; ++a) {
      const uint64_t cells = uint64_t{block.divisions[a]} * refine_;
      if (cells == 0) return bad(i, "no cells along " + std::string(1, "xyz"[a]));
      if (cells > max_block_divisions) {
        return bad(i, std::to_string(cells) + " cells along an edge; at most " +
                          std::to_string(max_block_divisions) + " are possible");
      }
      divisions[a] = static_cast<uint32_t>(cells);
    }
    for (const Grading& grading : block.gradings) MAILLE_CHECK(check_grading(i, grading));
    t_.divisions.push_back(divisions);
    // NaN fails, too.
    if (!(volume(block) >= 0)) {
      return bad(i, "is inside out; its first four corners must go around seen from outside clockwise");
    }
    return add_collapsed(i);
  }

  // Six times the volume within its faces, each of four triangles around its middle. Relative to a vertex, so
  // that blocks far from the origin lose no digits.
  double volume(const HexBlock& block) const {
    static constexpr unsigned faces[6][4] = {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4},
                                             {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}};
    const Position origin = of_.vertices[block.corners[0]];
    double sum = 0;
    for (const auto& face : faces) {
      Position p[4];
      for (unsigned i = 0; i < 4; ++i) p[i] = of_.vertices[block.corners[face[i]]] - origin;
      const Position middle = 0.25 * (p[0] + p[1] + p[2] + p[3]);
      for (unsigned i = 0; i < 4; ++i) sum += dot(middle, cross(p[i], p[(i + 1) % 4]));
    }
    return sum;
  }

  Result<> check_grading(size_t i, const Grading& grading) const {
    double length = 0;
    double cells = 0;
    for (const GradingSection& s : grading) {
      if (!(s.length >= 0 && s.cells >= 0 && s.expansion > 0 && std::isfinite(s.expansion))) {
        return bad(i, "a grading that is not positive");
      }
      length += s.length;
      cells += s.cells;
    }
    if (!(length > 0 && cells > 0 && std::isfinite(length) && std::isfinite(cells))) {
      return bad(i, "a grading without length");
    }
    return {};
  }

  int32_t curve_between(uint32_t a, uint32_t b) const {
    const auto found = curves_.find({std::min(a, b), std::max(a, b)});
    return found == curves_.end() || a == b ? -1 : found->second;
  }

  // Two vertices at one place are one point where they are ends of an edge. 1e-10 of the largest coordinate
  // is how far they may be apart; chosen, not swept.
  bool is_collapsed(uint32_t a, uint32_t b) const {
    if (a == b) return true;
    return length(of_.vertices[a] - of_.vertices[b]) <= 1e-10 * largest_ && curve_between(a, b) < 0;
  }

  Result<> add_collapsed(size_t i) {
    const auto& corners = of_.blocks[i].corners;
    std::array<bool, 12> collapsed{};
    std::array<int32_t, 12> curve{};
    for (unsigned axis = 0; axis < 3; ++axis) {
      bool all = true;
      for (unsigned uv = 0; uv < 4; ++uv) {
        std::array<unsigned, 3> at{};
        at[axis == 0 ? 1 : 0] = uv & 1;
        at[axis == 2 ? 1 : 2] = uv >> 1;
        const uint32_t a = corners[corner_at(at[0], at[1], at[2])];
        at[axis] = 1;
        const uint32_t b = corners[corner_at(at[0], at[1], at[2])];
        const bool one = is_collapsed(a, b);
        collapsed[edge_at(axis, uv & 1, uv >> 1)] = one;
        curve[edge_at(axis, uv & 1, uv >> 1)] = curve_between(a, b);
        all = all && one;
      }
      if (all) return bad(i, "has no thickness along " + std::string(1, "xyz"[axis]));
    }
    t_.collapsed.push_back(collapsed);
    t_.curve.push_back(curve);
    return {};
  }

  static unsigned face_axis(unsigned face, unsigned which) { return which + (which >= face / 2 ? 1 : 0); }

  /// Corners of a face at (0,0), (1,0), (0,1), (1,1) along its two axes.
  Corners face_corners(size_t block, unsigned face) const {
    Corners corners{};
    for (unsigned uv = 0; uv < 4; ++uv) {
      std::array<unsigned, 3> at{};
      at[face / 2] = face & 1;
      at[face_axis(face, 0)] = uv & 1;
      at[face_axis(face, 1)] = uv >> 1;
      corners[uv] = of_.blocks[block].corners[corner_at(at[0], at[1], at[2])];
    }
    return corners;
  }

  static Corners sorted(Corners corners) {
    std::sort(corners.begin(), corners.end());
    return corners;
  }

  static bool is_flat(const Corners& sorted) {
    return 1 + (sorted[0] != sorted[1]) + (sorted[1] != sorted[2]) + (sorted[2] != sorted[3]) < 3;
  }

  Result<> join_faces() {
    t_.neighbours.resize(of_.blocks.size());
    for (uint32_t b = 0; b < of_.blocks.size(); ++b) {
      for (unsigned f = 0; f < 6; ++f) faces_[sorted(face_corners(b, f))].push_back(6 * b + f);
    }
    // In the order of vertices, so that messages name the same blocks everywhere.
    for (const auto& [corners, at] : faces_) {
      if (is_flat(corners)) continue;
      if (at.size() > 2) {
        return failure(ErrorCode::unsupported, block_text(of_, at[0] / 6) + ", " +
                                                   block_text(of_, at[1] / 6) + " and " +
                                                   block_text(of_, at[2] / 6) + " share one face");
      }
      if (at.size() == 2) MAILLE_CHECK(join_pair(at[0] / 6, at[0] % 6, at[1] / 6, at[1] % 6));
    }
    return {};
  }

  Result<> join_pair(uint32_t a, unsigned fa, uint32_t b, unsigned fb) {
    const Corners ca = face_corners(a, fa);
    const Corners cb = face_corners(b, fb);
    // Four turns and their mirrors are all ways in which the corners of two faces can meet.
    for (unsigned turn = 0; turn < 8; ++turn) {
      // Axis 0 of a's face is axis (turn & 1) of b's; bits 1 and 2 turn over the axes of b's face.
      const auto other = [&](unsigned uv) {
        const unsigned swapped = (turn & 1) != 0 ? ((uv & 1) << 1 | uv >> 1) : uv;
        return swapped ^ (turn >> 1);
      };
      bool same = true;
      for (unsigned uv = 0; uv < 4; ++uv) same = same && ca[uv] == cb[other(uv)];
      if (!same) continue;
      BlockTopology::Neighbour n;
      n.block = static_cast<int32_t>(b);
      n.face = static_cast<uint8_t>(fb);
      n.axis[fa / 2] = static_cast<uint8_t>(fb / 2);
      n.flipped[fa / 2] = (fa & 1) == (fb & 1);
      for (unsigned k = 0; k < 2; ++k) {
        const unsigned to = k ^ (turn & 1);
        n.axis[face_axis(fa, k)] = static_cast<uint8_t>(face_axis(fb, to));
        n.flipped[face_axis(fa, k)] = (turn >> 1 >> to & 1) != 0;
      }
      MAILLE_CHECK(check_pair(a, fa, n));
      t_.neighbours[a][fa] = n;
      t_.neighbours[b][fb] = inverse(n, a, fa);
      return {};
    }
    return bad(a, "has the vertices of a face of " + block_text(of_, b) + ", but in another order around it");
  }

  static BlockTopology::Neighbour inverse(const BlockTopology::Neighbour& n, uint32_t block, unsigned face) {
    BlockTopology::Neighbour back;
    back.block = static_cast<int32_t>(block);
    back.face = static_cast<uint8_t>(face);
    for (unsigned a = 0; a < 3; ++a) {
      back.axis[n.axis[a]] = static_cast<uint8_t>(a);
      back.flipped[n.axis[a]] = n.flipped[a];
    }
    return back;
  }

  static unsigned edge_of_face(unsigned face, unsigned axis, unsigned side) {
    // The edge along `axis` of a face, at the first or last place along the face's other axis.
    std::array<unsigned, 3> at{};
    at[face / 2] = face & 1;
    at[3 - axis - face / 2] = side;
    return edge_at(axis, at[axis == 0 ? 1 : 0], at[axis == 2 ? 1 : 2]);
  }

  // Both blocks must put the same points on the face they share: as many cells, equally spaced.
  Result<> check_pair(uint32_t a, unsigned fa, const BlockTopology::Neighbour& n) const {
    const auto b = static_cast<uint32_t>(n.block);
    for (unsigned k = 0; k < 2; ++k) {
      const unsigned axis = face_axis(fa, k);
      const uint32_t cells = t_.divisions[a][axis];
      const uint32_t theirs = t_.divisions[b][n.axis[axis]];
      if (cells != theirs) {
        return bad(a, "has " + std::to_string(cells) + " cells along an edge where " + block_text(of_, b) +
                          " has " + std::to_string(theirs));
      }
      const unsigned other = face_axis(fa, 1 - k);
      for (unsigned side = 0; side < 2; ++side) {
        const unsigned ea = edge_of_face(fa, axis, side);
        const unsigned eb = edge_of_face(n.face, n.axis[axis], side ^ (n.flipped[other] ? 1u : 0u));
        if (t_.collapsed[a][ea]) continue;
        if (!same_spacing(of_.blocks[a].gradings[ea], of_.blocks[b].gradings[eb], n.flipped[axis], cells)) {
          return bad(a,
                     "spaces the cells of an edge it shares with " + block_text(of_, b) + " in another way");
        }
      }
    }
    return {};
  }

  static bool same_spacing(const Grading& a, const Grading& b, bool flipped, uint32_t cells) {
    const auto same = [](const GradingSection& x, const GradingSection& y) {
      return x.length == y.length && x.cells == y.cells && x.expansion == y.expansion;
    };
    if (!flipped && std::equal(a.begin(), a.end(), b.begin(), b.end(), same)) return true;
    const std::vector<double> x = edge_parameters(a, cells);
    const std::vector<double> y = edge_parameters(b, cells);
    for (uint32_t i = 1; i < cells; ++i) {
      const double other = flipped ? 1 - y[cells - i] : y[i];
      // Grading is written with few digits (0.333 against 1/3), so points may differ by half a cell: then
      // they are still the nearest ones.
      const double step = std::min(x[i + 1] - x[i], x[i] - x[i - 1]);
      if (!(std::fabs(x[i] - other) <= 0.5 * std::fabs(step))) return false;
    }
    return true;
  }

  Result<> add_patches() {
    t_.patch.assign(of_.blocks.size(), {-1, -1, -1, -1, -1, -1});
    for (const BlockPatch& patch : of_.patches) {
      t_.patches.push_back({patch.name, patch.type, {}});
      for (const auto& face : patch.faces) {
        const auto at = faces_.find(sorted(face));
        if (at == faces_.end() || (at->second.size() != 1 && !is_flat(at->first))) {
          return failure(ErrorCode::malformed_input,
                         "patch " + patch.name + ": " + face_text(face) +
                             (at == faces_.end() ? " is no face of a block" : " is inside of the mesh"));
        }
        for (const uint32_t f : at->second) {
          t_.patch[f / 6][f % 6] = static_cast<int32_t>(t_.patches.size()) - 1;
        }
      }
    }
    // Faces that no patch names make the default one, as with blockMesh.
    bool rest = false;
    for (size_t b = 0; b < of_.blocks.size(); ++b) {
      for (unsigned f = 0; f < 6; ++f) {
        if (t_.patch[b][f] >= 0 || t_.neighbours[b][f].block >= 0 || is_flat(sorted(face_corners(b, f)))) {
          continue;
        }
        t_.patch[b][f] = static_cast<int32_t>(of_.patches.size());
        rest = true;
      }
    }
    if (rest) t_.patches.push_back({of_.default_patch.name, of_.default_patch.type, {}});
    return {};
  }

  static std::string face_text(const Corners& face) {
    std::string text = "(";
    for (const uint32_t v : face) text += std::to_string(v) + " ";
    text.back() = ')';
    return text;
  }

  /// Whether all points of the node along this axis are one: every edge along it that the node touches is
  /// collapsed.
  bool is_dropped(uint32_t node, unsigned axis) const {
    const size_t block = node / per_block;
    const unsigned u = place(node % per_block, axis == 0 ? 1 : 0);
    const unsigned v = place(node % per_block, axis == 2 ? 1 : 2);
    for (unsigned i = (u == 2 ? 1 : 0); i <= (u == 0 ? 0 : 1); ++i) {
      for (unsigned j = (v == 2 ? 1 : 0); j <= (v == 0 ? 0 : 1); ++j) {
        if (!t_.collapsed[block][edge_at(axis, i, j)]) return false;
      }
    }
    return true;
  }

  /// The node's place on another block's entity, through a face they share.
  static Link across(uint32_t node, const BlockTopology::Node& map, const BlockTopology::Neighbour& n) {
    Link link{static_cast<uint32_t>(n.block) * per_block, {map.entity}};
    for (unsigned a = 0; a < 3; ++a) {
      const unsigned there = n.axis[a];
      const unsigned at = place(node % per_block, a);
      link.node += weight[there] * (n.flipped[a] ? 2 - at : at);
      link.map.parameter[there] = map.parameter[a];
      link.map.flipped[there] = map.parameter[a] >= 0 && map.flipped[a] != n.flipped[a];
    }
    // Across the face both blocks are at an end, which need not be the same.
    link.node +=
        weight[n.face / 2] * 2 * (n.face & 1) - weight[n.face / 2] * place(link.node % per_block, n.face / 2);
    return link;
  }

  void links_of(uint32_t node, std::vector<Link>& links) const {
    const BlockTopology::Node& map = t_.nodes[node];
    const uint32_t block = node / per_block;
    links.clear();
    for (unsigned axis = 0; axis < 3; ++axis) {
      const unsigned at = place(node % per_block, axis);
      if (at != 1) {
        const auto& n = t_.neighbours[block][2 * axis + at / 2];
        if (n.block >= 0) links.push_back(across(node, map, n));
        // Inwards, to a node of which this one is all there is.
        const uint32_t inner = node + weight[axis] * (1 - at);
        if (is_dropped(inner, axis)) links.push_back({inner, map});
      } else if (is_dropped(node, axis)) {
        links.push_back({node - weight[axis], map});
        links.push_back({node + weight[axis], map});
      }
    }
  }

  Result<> make_entities() {
    t_.nodes.resize(of_.blocks.size() * per_block);
    std::vector<bool> seen(t_.nodes.size(), false);
    // Small ones first: what is collapsed belongs to what is left of it, so an edge of one point joins its
    // corner's entity.
    for (unsigned dimension = 0; dimension <= 3; ++dimension) {
      for (uint32_t node = 0; node < t_.nodes.size(); ++node) {
        unsigned free = 0;
        for (unsigned a = 0; a < 3; ++a) free += place(node % per_block, a) == 1 ? 1 : 0;
        if (free == dimension && !seen[node]) MAILLE_CHECK(make_entity(node, seen));
      }
    }
    return {};
  }

  // Gathers all nodes that can be reached, breadth first, with the way in which parameters run on each. A
  // node that is reached twice must agree with itself; a twist does not.
  Result<> make_entity(uint32_t first, std::vector<bool>& seen) {
    const auto entity = static_cast<uint32_t>(t_.entities.size());
    BlockTopology::Node& map = t_.nodes[first];
    map.entity = entity;
    int8_t parameters = 0;
    for (unsigned a = 0; a < 3; ++a) {
      if (place(first % per_block, a) == 1) map.parameter[a] = parameters++;
    }
    std::vector<uint32_t> found{first};
    seen[first] = true;
    std::vector<Link> links;
    for (size_t i = 0; i < found.size(); ++i) {
      links_of(found[i], links);
      for (const Link& link : links) {
        BlockTopology::Node& other = t_.nodes[link.node];
        if (!seen[link.node]) {
          other = link.map;
          seen[link.node] = true;
          found.push_back(link.node);
        } else if (other.entity != entity || other.parameter != link.map.parameter ||
                   other.flipped != link.map.flipped) {
          return failure(ErrorCode::unsupported,
                         block_text(of_, link.node / per_block) + " is joined to itself by a twist");
        }
      }
    }
    t_.entities.push_back(std::move(found));
    return {};
  }

  const BlockDescription& of_;
  const uint32_t refine_;
  double largest_ = 0;
  std::map<std::pair<uint32_t, uint32_t>, int32_t> curves_;
  BlockTopology t_;
  std::map<Corners, std::vector<uint32_t>> faces_;  // six times the block, and the face
};

}  // namespace

Result<BlockTopology> join_blocks(const BlockDescription& description, uint32_t refine) {
  return Joiner(description, refine).join();
}

}  // namespace maille
