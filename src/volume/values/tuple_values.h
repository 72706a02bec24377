#pragma once

#include <maille/mesh.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <vector>

#include "code/exceptions.h"
#include "entropy/rans.h"
#include "numbers/number_space.h"
#include "volume/values/lane_least_squares.h"
#include "volume/values/point_stencil.h"
#include "volume/values/value_residuals.h"

namespace maille {

/// One array of a stream: what its numbers are, and how far they may be off.
struct StreamedArray {
  Scalar type = Scalar::f32;
  uint32_t components = 1;
  std::vector<NumberMap> maps;  ///< one per component
  double bound = 0;      ///< largest error allowed, of logarithms relative to the number; 0: the same bits
  bool mixed = false;    ///< coded by MixedValueCoder
  bool placed = false;   ///< and expected from where points are, too (PlaneFit)
  bool follows = false;  ///< and from the numbers of the step before

  size_t tuple_size() const { return size_of(type) * components; }
  /// Are codes of 64 bits? Not those of doubles that all are floats.
  bool is_wide() const {
    const auto is_float = [](const NumberMap& map) { return map.factor != 0; };
    return size_of(type) == 8 && !std::all_of(maps.begin(), maps.end(), is_float);
  }
};

/// Is what a number is read back as the number itself, or within the bound? Then the largest error is `error`
/// at least. `logarithm`: errors are relative to the number.
bool is_kept(const StreamedArray& array, bool logarithm, const std::byte* number, const std::byte* back,
             double& error);
/// The same of the number of a code.
bool keeps(const StreamedArray& array, const NumberSpace& space, const std::byte* number, int64_t code,
           double& error);

/// About what a coder of the array takes before it has met any number: a description could ask for thousands.
uint64_t tuple_coder_bytes(const StreamedArray& array);

/// The numbers of one array, tuple after tuple, each predicted from those of points or cells in memory. Both
/// directions; the values in memory are in slots, as those of the hull are. `Bits`: 32, or 64 for wide
/// arrays. Components go in groups of three, side by side in `Width` lanes: 4, or 1 if there is one
/// component.
template <class Coder, unsigned Bits, unsigned Width>
class TupleValueCoder {
 public:
  static constexpr bool encoding = Coder::encoding;
  static constexpr bool has_plain = Width == 4;
  static constexpr bool takes_planes = false;

  explicit TupleValueCoder(const StreamedArray& array);

  /// One tuple: what the stencil suggests, then the difference. It goes to `slot`.
  void code(Coder& coder, const PointStencil& stencil, uint32_t slot, std::byte* tuple);
  /// Whether tuples are three floats, or doubles, that keep their bits: nearly all positions are.
  bool is_plain() const { return plain_; }
  /// The same as code() for the last corner of a hexahedron, if is_plain(); `nodes`: slots of all corners.
  void code_full(Coder& coder, const uint32_t* nodes, unsigned corner, uint32_t slot,
                 std::byte* tuple) requires(Width == 4);
  /// Encoder: the largest error of numbers with a bound, so far.
  double largest_error() const { return largest_error_; }
  /// A hint that the value in a slot is wanted soon: those of the last layer are far away.
  void prefetch(uint32_t slot) const {
    for (const Group& group : groups_) {
      if (slot < group.values.size()) __builtin_prefetch(&group.values[slot]);
    }
  }

 private:
  using Doubles = typename ValueLanes<Width>::Doubles;
  using Longs = typename ValueLanes<Width>::Longs;
  using Floats = typename ValueLanes<Width>::Floats;
  using Ints = typename ValueLanes<Width>::Ints;
  using Uints = typename ValueLanes<Width>::Uints;
  using Fit = LaneLeastSquares<Width, 7>;
  static constexpr unsigned group_size = Width < 3 ? Width : 3;
  static constexpr unsigned most_candidates = 3;

  struct Value {
    Doubles place;
    Floats twist;  ///< what the first sum missed
    Ints size;     ///< half octaves of the residual, in units of the place
  };
  /// How well each candidate has done lately in a situation: 64 times a mean of half octaves.
  using Record = std::array<Ints, most_candidates>;
  struct Group {
    unsigned first = 0, count = 0;  ///< components
    bool floats = false;            ///< floats that keep their bits
    std::vector<Value> values;
    Doubles last = {};
    Ints last_size = {};
    std::array<Record, PointStencil::situations> records;
    std::unique_ptr<std::array<Fit, most_corners>> fits;  ///< by corner
  };
  struct Expectation {
    std::array<Doubles, most_candidates> candidate;
    unsigned count = 0;
    typename Fit::Features twists;  ///< if the stencil is full
  };
  using Code = std::conditional_t<Bits == 32, int32_t, int64_t>;
  using Unsigned = std::make_unsigned_t<Code>;
  static Code sum(Code a, Code b) {
    return static_cast<Code>(static_cast<Unsigned>(a) + static_cast<Unsigned>(b));
  }
  static Code difference(Code a, Code b) {
    return static_cast<Code>(static_cast<Unsigned>(a) - static_cast<Unsigned>(b));
  }
  /// In registers: a vector that is stored number by number would have to wait for each.
  template <class Number>
  [[gnu::always_inline]] static Ints pack(const std::array<Number, group_size>& numbers) {
    if constexpr (Width == 1) return Ints{static_cast<int32_t>(numbers[0])};
    if constexpr (Width == 4) {
      return Ints{static_cast<int32_t>(numbers[0]), static_cast<int32_t>(numbers[1]),
                  static_cast<int32_t>(numbers[2]), 0};
    }
  }
  /// What is known of the numbers of a group before any of them is coded.
  struct Guess {
    std::array<Code, group_size> code{};
    std::array<Code, group_size> residual{};
    std::array<unsigned, group_size> first;  ///< of the two stages of a residual
    std::array<ResidualContext, group_size> context;
    unsigned exceptions;  ///< a bit for each component
  };

  using Others = std::array<const Value*, 7>;
  static void full_sum(const Others& other, Doubles& place);
  static void near_floats(const Doubles& expected, Ints& code, Ints& unit);
  static void near_plain(const Doubles& expected, Guess& guess, Ints& unit);
  static Ints size_class(const Floats& residual) {
    // Half octaves of 2 |residual| + 1: 0 for 0.
    const Floats size = (residual < 0 ? -residual : residual) * 2.0F + 1.0F;
    return ((same_bits<Ints>(size) >> 22) & 0x1ff) - 254;
  }
  static Ints mean_size(const Ints& sum, unsigned count);
  static Ints spread_class(const Ints& range) { return -(range >= 3) - (range >= 8); }
  static Ints expected_class(const Ints& mean, const Ints& unit);
  void find_plain_residuals(const std::byte* numbers, Guess& guess) const;
  void place_plain(const Guess& guess, std::byte* numbers, Doubles& place) const;
  static void learn_fit(Fit& fit, const typename Fit::Features& twists, const Floats& target);

  void code_group(Coder& coder, const PointStencil& stencil, Group& group, uint32_t slot, std::byte* numbers);
  void expect(const PointStencil& stencil, const Group& group, Expectation& expectation) const;
  void find_codes(const Group& group, const Doubles& expected, Guess& guess, Ints& unit) const;
  void find_contexts(const PointStencil& stencil, const Group& group, const Ints& unit, Guess& guess) const;
  void find_residuals(Coder& coder, const PointStencil& stencil, const Group& group, uint32_t slot,
                      const std::byte* numbers, Guess& guess);
  void code_residuals(Coder& coder, const Group& group, Guess& guess, std::byte* numbers);
  void find_value(const Group& group, const Doubles& expected, const Guess& guess, const Ints& unit,
                  std::byte* numbers, Value& value) const;
  void learn(const PointStencil& stencil, Group& group, const Expectation& expectation, const Value& value);
  void code_bits(Coder& coder, std::byte* bytes);

  StreamedArray array_;
  size_t number_size_;
  std::vector<NumberSpace> spaces_;
  std::vector<Group> groups_;
  ValueResiduals<Bits> residuals_;
  Exceptions exceptions_;
  double largest_error_ = 0;
  bool exact_ = true;  ///< no map needs exceptions
  bool plain_ = false;
  uint32_t samples_ = 0;
};

}  // namespace maille
