#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "surface/arrays/facet_normal_coder.h"

namespace maille {

/// Looks at some faces of an array of normals to see how they may be coded. For encoders only: what it finds
/// is written.
template <class Code>
class FacetSample {
 public:
  FacetSample(const PatchElements& elements, const std::vector<uint32_t>& face_of, Scalar type,
              const ArrayMaps& maps, std::span<Code> codes)
      : elements_(elements), codes_(type, maps, codes), face_(elements, face_of) {
    // 512 faces are enough to tell formulas apart, whose normals are mostly the same, and few enough to try
    // all 128 of them. Chosen, not swept.
    constexpr uint32_t most = 1 << 9;
    const uint32_t faces = elements.surface->face_count;
    for (uint32_t i = 0; i < std::min(faces, most); ++i)
      sample_.push_back(static_cast<uint32_t>(uint64_t{faces} * i / std::min(faces, most)));
  }

  /// What is worth a trial: the formula is chosen here, how corners were rounded is not, as only coding all
  /// of it tells.
  std::vector<FacetCoding> candidates() {
    FacetCoding coding;
    coding.unit = are_unit();
    for (uint32_t cell = 0; cell < elements_.cells(); ++cell)
      coding.signed_zeros |= codes_.zero_signs(cell) != 0;
    coding.formula = choose_formula();
    // Where nearly all (63 of 64) are computed, nothing else counts, and one candidate is enough.
    coding.learns = count_computed(coding.formula) * 64 < sample_.size() * 63;
    std::vector<FacetCoding> candidates;
    for (unsigned step = 0; step < Rounding::step_count; ++step) {
      coding.rounding = {static_cast<Rounding::Step>(step), 0};
      coding.rounding.scale = fitting_scale(coding);
      candidates.push_back(coding);
      if (!coding.learns) return candidates;
    }
    coding = candidates.front();
    coding.learns = false;
    candidates.push_back(coding);
    return candidates;
  }

 private:
  /// Vectors whose length is 1 to a percent: normals of floats, of few digits, or of a coarse lattice are
  /// that near.
  static bool is_unit(const Vector3& v) { return std::fabs(dot(v, v) - 1) < 0.02; }
  bool are_unit() const {
    size_t units = 0;
    for (const uint32_t face : sample_) units += is_unit(codes_.numbers(codes_.at(face)));
    return units * 64 >= sample_.size() * 63;
  }

  /// How a formula agrees with the normal of a face.
  struct Agreement {
    unsigned same = 0;   ///< from how many corners it gives the normal, but for signs of zeros
    bool signs = false;  ///< zeros have these signs, from one corner at least
    bool side = false;
  };
  Agreement agreement(const FacetFormula& formula, uint32_t element) {
    face_.find(element);
    std::array<Vector3, 3> normals = {};
    const unsigned count = computed_normals(face_, formula, normals);
    const auto tuple = codes_.at(element);
    const unsigned negative = codes_.zero_signs(element);
    Agreement agreement;
    for (unsigned i = 0; i < count; ++i) {
      agreement.same += codes_.nearest(normals[i]) == tuple;
      bool signs = true;
      for (unsigned k = 0; k < 3; ++k)
        signs &= !codes_.is_zero(k, tuple) || std::signbit(normals[i][k]) == ((negative >> k & 1) != 0);
      agreement.signs |= signs;
    }
    agreement.side = dot(normals[0], codes_.numbers(tuple)) > 0;
    return agreement;
  }

  /// The formula that gives most normals from any corner; among equals signs of zeros count, then few
  /// different corners, then the side.
  FacetFormula choose_formula() {
    FacetFormula best;
    int64_t highest = -1;
    for (unsigned bits = 0; bits < FacetFormula::count; ++bits) {
      const FacetFormula formula{static_cast<uint8_t>(bits)};
      int64_t score = 0;
      for (const uint32_t element : sample_) {
        const Agreement found = agreement(formula, element);
        // In thirds of a bit, roughly: a normal is worth some 40 bits, a choice between corners or signs one
        // or two.
        score += (found.same > 0 ? 120 + found.same : 0u) + (found.signs ? 4 : 0) + (found.side ? 1 : 0);
      }
      if (score <= highest) continue;
      highest = score;
      best = formula;
    }
    return best;
  }
  size_t count_computed(const FacetFormula& formula) {
    size_t count = 0;
    for (const uint32_t element : sample_) count += agreement(formula, element).same > 0;
    return count;
  }

  /// The scale with which half of the normals that are not computed lie within what half of all should:
  /// distances are squared and in variances of a step of 1, so their median over 1.39 is the step's square.
  int16_t fitting_scale(const FacetCoding& coding) {
    const RoundedCorners corners(elements_.positions, coding.rounding, codes_.unit(0, 0.6));
    const double side = coding.formula.inward() ? -1 : 1;
    std::vector<double> squares;
    for (const uint32_t element : sample_) {
      if (agreement(coding.formula, element).same > 0) continue;
      const NormalEstimate estimate = corners.estimate(face_.points(), {});
      const double square = squared_distance(codes_.numbers(codes_.at(element)) * side, estimate, 0);
      if (square > 1e-60 && square < 1e60) squares.push_back(square);
    }
    if (squares.empty()) return 0;
    const auto middle = squares.begin() + static_cast<ptrdiff_t>(squares.size() / 2);
    std::nth_element(squares.begin(), middle, squares.end());
    // Half of what is normally distributed in two dimensions is within 1.39 variances.
    return static_cast<int16_t>(half_octaves_of(std::sqrt(*middle / 1.39)));
  }

  const PatchElements& elements_;
  VectorCodes<Code> codes_;
  FaceCorners face_;
  std::vector<uint32_t> sample_;
};

}  // namespace maille
