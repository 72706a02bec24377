#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "entropy/mixing.h"
#include "surface/front/position_experts.h"

namespace maille {

/// What was decided before where things looked the same. Two tables without hashing, of few contexts, learn
/// soon, and serve points whose hashed contexts are new. Hashed contexts see numbers as they are: whether the
/// same shape came before, bit for bit. Without `with_hashes` there are none. docs/format.md, 14.7.
template <class Code, bool with_hashes>
class PositionContexts {
 public:
  static constexpr unsigned count = with_hashes ? 4 : 0;  ///< of those with hashes
  static constexpr unsigned most_hashes = 5;
  using Hashes = std::array<uint32_t, most_hashes>;

  /// The models of one decision.
  struct Cells {
    std::array<WideCell*, 2> wide;
    std::array<NarrowCell*, most_hashes> narrow;
    std::array<int32_t, most_hashes> narrow_logits = {};
  };

  /// Of so many points; `numbers`: three for each.
  PositionContexts(uint32_t points, size_t numbers)
      : few_{std::vector<WideCell>(few_contexts * nodes), std::vector<WideCell>(few_contexts * nodes)},
        table_(with_hashes ? table_bits_for(points) : 1),
        residuals_(with_hashes ? numbers : 0) {}

  void begin_point() { residuals_of_point_ = 0; }
  void begin_number(const PositionNumber& number, const PositionExperts& experts,
                    const PositionCodes<Code>& codes, const PositionPredictor& predictor) {
    const unsigned side = experts.mean(0) > experts.mean(1) ? 1 : 0;
    const unsigned scale = experts.scale_bin();
    few_base_ = {&few_[0][(scale * 16 + experts.spread_bin() * 2 + side) * nodes],
                 &few_[1][((experts.edge_bin() >> 1) * PositionExperts::scale_bins + scale) * nodes]};
    bucket_ = ~0u;
    if constexpr (with_hashes) set_up_hashes(number, codes, predictor);
  }
  /// Which of the buckets of this number's hashed contexts holds the next decisions.
  void begin_buckets(unsigned bucket) {
    if (bucket == bucket_) return;
    bucket_ = bucket;
    std::array<uint32_t, most_hashes> hashes;
#pragma GCC unroll 8
    for (unsigned i = 0; i < count; ++i) {
      hashes[i] = bucket == 0 ? hash_[i] : hashed(hash_[i], bucket * 0x85ebca6bu);
      table_.prefetch(hashes[i]);
    }
#pragma GCC unroll 8
    for (unsigned i = 0; i < count; ++i) buckets_[i] = &table_.find(hashes[i]);
  }
  /// `few`: which decision of the number it is, 0: of none that the small tables know; `slot`: which of its
  /// buckets.
  [[gnu::always_inline]] Cells cells(unsigned few, unsigned slot, bool hashed_too) const {
    Cells cells{{few_base_[0] + few, few_base_[1] + few}, {}};
    if (!hashed_too) return cells;
#pragma GCC unroll 8
    for (unsigned i = 0; i < count; ++i) {
      cells.narrow[i] = &buckets_[i]->cells[slot];
      cells.narrow_logits[i] = cells.narrow[i]->logit();
    }
    return cells;
  }
  [[gnu::always_inline]] void learn(const Cells& cells, unsigned few, bool hashed_too, bool bit) const {
    if (few != 0) {
      cells.wide[0]->update(bit);
      cells.wide[1]->update(bit);
    }
    if (!hashed_too) return;
#pragma GCC unroll 8
    for (unsigned i = 0; i < count; ++i) cells.narrow[i]->update(bit);
  }
  /// `residual`: the code less the centre.
  void end_number(const PositionNumber& number, int32_t residual) {
    if constexpr (with_hashes) {
      residuals_[PositionCodes<Code>::at(number.point, number.axis)] = residual;
      residuals_of_point_ = residuals_of_point_ * 0x9e3779b1u + static_cast<uint32_t>(residual) + 1;
    }
  }

  const Hashes& hashes() const {
    return hash_;
  }

 private:
  static constexpr unsigned few_contexts = 48 * 16;
  static constexpr unsigned nodes = 132;

  /// About five buckets for each point, in 2^12 to 2^20: the larger bound keeps the table at 16 MB. The
  /// format's rule; not swept.
  static unsigned table_bits_for(uint32_t points) {
    unsigned bits = 12;
    while (bits < 20 && (uint64_t{1} << bits) < uint64_t{points} * 5) ++bits;
    return bits;
  }
  /// What hashed contexts see, part of the format (14.7, "Contexts").
  void set_up_hashes(const PositionNumber& number, const PositionCodes<Code>& codes,
                     const PositionPredictor& predictor) {
    const unsigned axis = number.axis;
    const PositionPrediction& p = *number.prediction;
    const auto along = [&](uint32_t point) { return predictor.position(point)[axis]; };
    const auto seed = [&](uint32_t kind) { return hashed(kind * 4 + axis, 0x1234567u); };
    // Residuals of this point so far, or those of the one before.
    uint32_t h = hashed(seed(1), number.place);
    if (number.place == 0) {
      for (unsigned k = 0; k < 3; ++k)
        h = hashed(h, number.newest == none ? 0 : residual_code(number.newest, k));
    } else {
      h = hashed(h, residuals_of_point_);
    }
    hash_[0] = h;
    // How the first two parallelograms differ.
    const Neighbourhood& around = predictor.neighbourhood();
    h = hashed(seed(2), around.parallelogram_count);
    for (unsigned i = 0; i < 2 && i < around.parallelogram_count; ++i) {
      const WideParallelogram& parallelogram = around.parallelograms[i];
      const double tip = along(parallelogram.a) + along(parallelogram.b) - along(parallelogram.across);
      h = hashed(h, exact(tip - p.mean_parallelogram[axis]));
    }
    hash_[1] = h;
    // The place itself; the edges of the best parallelogram; what the residuals at its corners were.
    hash_[2] = hashed(seed(3), static_cast<uint32_t>(codes.nearest_code(p.mean_parallelogram[axis], axis)));
    hash_[3] = seed(4);
    hash_[4] = seed(5);
    if (p.best_a != none) {
      hash_[3] = hashed(hashed(hash_[3], exact(along(p.best_a) - along(p.best_across))),
                        exact(along(p.best_b) - along(p.best_across)));
      hash_[4] =
          hashed(hashed(hashed(hash_[4], residual_code(p.best_a, axis)), residual_code(p.best_b, axis)),
                 residual_code(p.best_across, axis));
    }
    for (unsigned i = 0; i < count; ++i) table_.prefetch(hash_[i]);
  }
  /// Of a point against its own centre, cut to 32 bits: enough for a context.
  uint32_t residual_code(uint32_t point, unsigned axis) const {
    return static_cast<uint32_t>(residuals_[PositionCodes<Code>::at(point, axis)]);
  }
  /// A difference of numbers as bits; as a float, so that noise of the last bits of doubles does not make a
  /// context of its own. -0 is 0.
  static uint32_t exact(double difference) {
    const auto narrow = static_cast<float>(difference);
    uint32_t bits;
    __builtin_memcpy(&bits, &narrow, 4);
    return narrow == 0 ? 0 : bits;
  }

  std::array<std::vector<WideCell>, 2> few_;
  BucketTable table_;
  std::vector<int32_t> residuals_;  // against the centres, by number
  uint32_t residuals_of_point_ = 0;
  // Of the number at hand.
  std::array<WideCell*, 2> few_base_;
  Hashes hash_;
  unsigned bucket_ = 0;
  std::array<CellBucket*, most_hashes> buckets_;
};

}  // namespace maille
