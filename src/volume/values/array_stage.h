#pragma once

#include <optional>
#include <variant>

#include "volume/values/cell_stencil.h"
#include "volume/values/mixed_values.h"
#include "volume/values/plane_fit.h"
#include "volume/values/tuple_values.h"

namespace maille {

/// One array of the stream, block after block, behind the cells: its own coder and models, so that arrays can
/// be coded at once, and while the next cells are. It reads CodedCells only, never the hull, which is why the
/// next block's cells can be coded meanwhile; the price is that slots name points until their block ends.
template <class Coder>
class ArrayStage {
 public:
  static constexpr bool encoding = Coder::encoding;

  ArrayStage(const StreamedArray& array, Domain domain) : array_(array), domain_(domain) {
    if (array.placed) planes_.emplace(array.components);
  }

  Domain domain() const { return domain_; }
  size_t tuple_size() const { return array_.tuple_size(); }
  /// Encoder: of what was coded so far.
  double largest_error() const {
    if (!tuples_) return 0;
    return std::visit([](const auto& coder) { return coder.largest_error(); }, *tuples_);
  }
  /// What came to tuple_coder_bytes(), while numbers of so many slots are kept: of points or of cells, as the
  /// domain has them.
  uint64_t grown_bytes(uint64_t points, uint64_t cells) const {
    const size_t slots = rows_for(static_cast<uint32_t>(domain_ == Domain::point ? points : cells));
    uint64_t bytes = stencils_.bytes() + (planes_ ? planes_->bytes() : 0);
    if (tuples_) bytes += std::visit([&](const auto& coder) { return coder.grown_bytes(slots); }, *tuples_);
    return bytes;
  }
  /// A coder begins with each batch; models go on, so that a batch cannot be decoded without those before it.
  void begin_batch(Coder coder) { coder_.emplace(std::move(coder)); }
  Coder& coder() { return *coder_; }
  // Mixed arrays have one: each decision needs what the one before it taught.
  unsigned lanes() const { return array_.mixed ? 1 : array_.components < 3 ? array_.components : 3; }

  bool is_placed() const { return array_.placed; }

  /// Codes the tuples of the points that came up, or of the cells, in their order in the block. `places`: of
  /// these points, if is_placed(). `before`: their tuples in the step before, if the array follows one; may
  /// be where `tuples` are. `tuples` has size of the domain times tuple_size() bytes. False: the stream is
  /// damaged.
  bool code(const CodedCells& cells, std::span<const Vector3> places, std::byte* tuples,
            const std::byte* before = nullptr) {
    if (planes_) planes_->begin_block(cells, places);
    // Models are made with the first number: a description can name thousands of arrays that have none.
    const size_t numbers = domain_ == Domain::point ? cells.points.size() : cells.size();
    if (!tuples_ && numbers == 0) return encoding || !coder_->exhausted();
    if (!tuples_) make_coder();
    return std::visit([&](auto& coder) { return code_with(coder, cells, tuples, before); }, *tuples_);
  }

 private:
  using TupleCoder = std::variant<TupleValueCoder<Coder, 32, 1>, TupleValueCoder<Coder, 32, 4>,
                                  TupleValueCoder<Coder, 64, 1>, TupleValueCoder<Coder, 64, 4>,
                                  MixedValueCoder<Coder, 32>, MixedValueCoder<Coder, 64>>;
  static TupleCoder coder_for(const StreamedArray& array) {
    const bool wide = array.is_wide();
    if (array.mixed && wide) return TupleCoder(std::in_place_index<5>, array);
    if (array.mixed) return TupleCoder(std::in_place_index<4>, array);
    if (array.components > 1) {
      if (wide) return TupleCoder(std::in_place_index<3>, array);
      return TupleCoder(std::in_place_index<1>, array);
    }
    if (wide) return TupleCoder(std::in_place_index<2>, array);
    return TupleCoder(std::in_place_index<0>, array);
  }

  void make_coder() {
    tuples_ = coder_for(array_);
    array_.maps.clear();  // with their tables
  }

  // Points: chosen with the first version (9c3132e), no sweep is on record. It changes no byte.
  static constexpr size_t ahead = 6;
  template <class Tuples>
  static void prefetch(const Tuples& coder, const CodedCells& cells, const NewPoint& point) {
    if (point.cell == no_slot) return;
    const uint32_t begin = cells.begin[point.cell];
    for (uint32_t k = begin; k < begin + most_corners && k < cells.nodes.size(); ++k)
      coder.prefetch(cells.nodes[k]);
  }

  template <class Tuples>
  void learn_place(const Tuples& coder) {
    if constexpr (Tuples::takes_planes) {
      if (planes_) planes_->learn(coder.places().data());
    }
  }

  /// The step before, which comes tuple by tuple as this one does.
  template <class Tuples>
  void look_back(Tuples& coder, const std::byte*& before) {
    if constexpr (Tuples::takes_planes) {
      if (!array_.follows) return;
      stencil_.before = coder.places_before(before);
      before += array_.tuple_size();
    }
  }

  template <class Tuples>
  bool code_with(Tuples& coder, const CodedCells& cells, std::byte* tuples, const std::byte* before) {
    if (domain_ == Domain::point) {
      for (size_t i = 0; i < cells.points.size(); ++i) {
        if constexpr (Tuples::has_plain) {
          const NewPoint& point = cells.points[i];
          if (coder.is_plain() && is_full(point, cells)) {
            const uint32_t* nodes = cells.nodes.data() + cells.begin[point.cell];
            coder.code_full(*coder_, nodes, point.node, point.slot, tuples);
            tuples += array_.tuple_size();
            continue;
          }
        }
        if (i + ahead < cells.points.size()) prefetch(coder, cells, cells.points[i + ahead]);
        find_stencil(cells.points[i], cells, stencil_);
        if (planes_) stencil_.plane = planes_->expect_point(cells.points[i], cells);
        look_back(coder, before);
        coder.code(*coder_, stencil_, cells.points[i].slot, tuples);
        learn_place(coder);
        tuples += array_.tuple_size();
      }
    } else {
      for (size_t i = 0; i < cells.size(); ++i) {
        // The value of slot s is at s + 1 (cell_stencil.h). Loose cells, which have no slot, share place 0:
        // nobody asks for it.
        const uint32_t slot = cells.cell_slots[i];
        stencils_.find(cells, i, stencil_);
        if (planes_) stencil_.plane = planes_->expect_cell(cells, i);
        look_back(coder, before);
        coder.code(*coder_, stencil_, slot == no_slot ? 0 : slot + 1, tuples);
        learn_place(coder);
        tuples += array_.tuple_size();
      }
    }
    return encoding || !coder_->exhausted();
  }

  StreamedArray array_;
  Domain domain_;
  CellStencils stencils_;
  PointStencil stencil_;
  std::optional<PlaneFit> planes_;
  std::optional<TupleCoder> tuples_;
  std::optional<Coder> coder_;
};

}  // namespace maille
