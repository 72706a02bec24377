#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "entropy/bit_model.h"
#include "surface/arrays/corner_faces.h"

namespace maille {

/// Codes which corners of a point hold the same tuple: first which points have a cut, then, for the edges at
/// these, whether the corners on both sides are joined. Most points have none, so most edges cost nothing.
/// Sets are kept by union and find. docs/format.md, 13.2.
template <class Coder>
class JointCoder {
 public:
  /// `around`: the references of points. `twins` by corner: those with one number are known to be joined;
  /// empty: nothing is known.
  JointCoder(Coder& coder, const CornerFaces& faces, const FanSurface& around,
             std::span<const uint32_t> twins)
      : coder_(coder), faces_(faces), around_(around), twins_(twins), parent_(faces.corners()) {
    for (uint32_t c = 0; c < faces.corners(); ++c) parent_[c] = c;
    join_twins();
  }

  /// Returns for each corner the first one that holds the same tuple. `same(a, b)` tells an encoder whether
  /// two corners do.
  template <class Same>
  std::vector<uint32_t> code(Same same) {
    // Two passes over the edges instead of a list of joints, which would have to be kept (3581143).
    std::vector<uint8_t> cut(faces_.point_count), joints(faces_.point_count);
    for_each_joint([&](const Joint& joint) {
      const uint32_t point = faces_.points[joint.a];
      // Counts of joints saturate: only small ones are contexts.
      joints[point] = static_cast<uint8_t>(joints[point] + (joints[point] < 255));
      if constexpr (Coder::encoding) cut[point] |= !same(joint.a, joint.b);
    });
    code_cuts(joints, cut);
    code_joints(cut, std::move(joints), same);
    std::vector<uint32_t> first(faces_.corners());
    for (uint32_t c = 0; c < faces_.corners(); ++c) first[c] = root(c);
    return first;
  }

 private:
  /// Two corners of one point beside each other, on both sides of the edge that starts at corner `edge`.
  struct Joint {
    uint32_t a, b;
    uint32_t edge;  ///< the lower one of its two
    bool at_end;    ///< of that edge
  };

  /// The lowest corner of a set stands for it, the same on both sides. Paths are halved on the way, so this
  /// stays short.
  uint32_t root(uint32_t c) {
    while (parent_[c] != c) c = parent_[c] = parent_[parent_[c]];
    return c;
  }
  void join(uint32_t a, uint32_t b) {
    a = root(a);
    b = root(b);
    parent_[a < b ? b : a] = a < b ? a : b;
  }
  void join_twins() {
    std::vector<uint32_t> first;
    for (uint32_t c = 0; c < twins_.size(); ++c) {
      if (twins_[c] >= first.size()) first.resize(twins_[c] + size_t{1}, none);
      if (first[twins_[c]] == none) first[twins_[c]] = c;
      join(first[twins_[c]], c);
    }
  }
  bool are_twins(uint32_t a, uint32_t b) const { return !twins_.empty() && twins_[a] == twins_[b]; }

  /// Visits the joints that twins do not tell, in the order of their edges: an edge by its lower corner, its
  /// start before its end.
  template <class Visit>
  void for_each_joint(Visit visit) const {
    for (uint32_t c = 0; c < faces_.corners(); ++c) {
      const uint32_t over = faces_.opposite[c];
      if (over == none || over < c) continue;
      const uint32_t next = faces_.next(c), next_over = faces_.next(over);
      if (!are_twins(c, next_over)) visit(Joint{c, next_over, c, false});
      if (!are_twins(next, over)) visit(Joint{next, over, c, true});
    }
  }

  void code_cuts(const std::vector<uint8_t>& joints, std::vector<uint8_t>& cut) {
    using R = VertexReferences;
    for (uint32_t p = 0; p < faces_.point_count; ++p) {
      if (joints[p] == 0) continue;
      const auto& at = around_.references[p].at;
      const auto state = [&](unsigned r) { return at[r] < p ? unsigned{cut[at[r]]} : 0u; };
      // Cuts run along seams, from neighbour to neighbour. Points that come later count as uncut.
      BitModel& model = cut_[4 * state(R::last) + 2 * state(R::focus) + state(R::before)];
      cut[p] = model.code(coder_, cut[p] != 0);
    }
  }

  /// Codes the joints of points with a cut. A cut runs on to the other end of its edge, and a point has none
  /// or two and more: these are the contexts. `left`: how many joints each point has, counted down.
  template <class Same>
  void code_joints(const std::vector<uint8_t>& cut, std::vector<uint8_t> left, Same same) {
    std::vector<uint8_t> cuts(faces_.point_count);
    uint32_t edge = none;
    unsigned before = 0;  // at the start of the same edge: 1 cut, 2 joined
    for_each_joint([&](const Joint& joint) {
      const uint32_t point = faces_.points[joint.a];
      if (edge != joint.edge) before = 0;
      edge = joint.edge;
      bool joined = true;
      if (cut[point]) {
        const uint32_t end = faces_.points[joint.at_end ? joint.edge : faces_.next(joint.edge)];
        if constexpr (Coder::encoding) joined = same(joint.a, joint.b);
        const unsigned rest = left[point] < 4 ? left[point] - 1u : 3u;
        // What the edge's first end did, whether its other end has a cut at all, how many cuts the point has
        // had (two are enough for a seam), and how many joints are left to it.
        const unsigned context = ((before * 2 + cut[end]) * 3 + cuts[point]) * 4 + rest;
        joined = joint_[context].code(coder_, joined);
        cuts[point] = static_cast<uint8_t>(cuts[point] + (!joined && cuts[point] < 2));
        left[point] = static_cast<uint8_t>(left[point] - (left[point] < 255));
      }
      before = joined ? 2 : 1;
      if (joined) join(joint.a, joint.b);
    });
  }

  Coder& coder_;
  const CornerFaces& faces_;
  const FanSurface& around_;
  std::span<const uint32_t> twins_;
  std::vector<uint32_t> parent_;
  BitModel cut_[8];
  BitModel joint_[3 * 2 * 3 * 4];
};

}  // namespace maille
