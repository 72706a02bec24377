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

/// One array of a stream: what its numbers are, and how far they may be off. It follows from the headers of
/// the file alone, so that encoder and decoder make the same models of it.
struct StreamedArray {
  Scalar type = Scalar::f32;
  uint32_t components = 1;
  std::vector<NumberMap> maps;  ///< one per component
  double bound = 0;      ///< largest error allowed, of logarithms relative to the number; 0: the same bits
  bool mixed = false;    ///< coded by MixedValueCoder
  bool placed = false;   ///< and expected from where points are, too (PlaneFit)
  bool follows = false;  ///< and from the numbers of the step before

  size_t tuple_size() const { return size_of(type) * components; }
  /// Whether codes have 64 bits. Those of doubles that all are floats have 32.
  bool is_wide() const {
    const auto is_float = [](const NumberMap& map) { return map.factor != 0; };
    return size_of(type) == 8 && !std::all_of(maps.begin(), maps.end(), is_float);
  }
};

/// Whether what a number is read back as is the number itself, bit for bit, or within the bound. Then the
/// largest error is `error` at least. `logarithm`: errors are relative to the number. A NaN that changed its
/// bits is never kept, as its distance is no number.
bool is_kept(const StreamedArray& array, bool logarithm, const std::byte* number, const std::byte* back,
             double& error);
/// The same of the number of a code.
bool keeps(const StreamedArray& array, const NumberSpace& space, const std::byte* number, int64_t code,
           double& error);

/// What a coder of the array takes at most before it has met any number, in bytes. A description can ask for
/// thousands of arrays, so readers add this up against the limit before they make any coder.
uint64_t tuple_coder_bytes(const StreamedArray& array);

/// The numbers of one array, tuple after tuple, each predicted from those of points or cells in memory;
/// docs/format.md, 16.7. Both directions use it; the values in memory are in slots, as those of the hull are.
/// `Bits`: 32, or 64 for wide arrays. Components go in groups of three, side by side in `Width` lanes: 4, or
/// 1 if there is one component.
/// It steers decoding by doubles, with + - * / in a fixed order and no contraction, so that all machines
/// predict the same. Memory: a row for each slot, about 64 bytes a group of floats.
template <class Coder, unsigned Bits, unsigned Width>
class TupleValueCoder {
 public:
  static constexpr bool encoding = Coder::encoding;
  static constexpr bool has_plain = Width == 4;
  static constexpr bool takes_planes = false;

  explicit TupleValueCoder(const StreamedArray& array);

  /// Codes one tuple: what the stencil suggests, then the difference. Its values go to `slot`, where later
  /// stencils find them.
  void code(Coder& coder, const PointStencil& stencil, uint32_t slot, std::byte* tuple);
  /// Whether tuples are three floats, or doubles, that keep their bits: nearly all positions are.
  bool is_plain() const { return plain_; }
  /// The same bytes as code() for the last corner of a hexahedron, if is_plain(), at about 0.6 of the
  /// instructions (a698a28); `nodes`: slots of all corners.
  void code_full(Coder& coder, const uint32_t* nodes, unsigned corner, uint32_t slot,
                 std::byte* tuple) requires(Width == 4);
  /// Encoder: the largest error of numbers with a bound, so far.
  double largest_error() const { return largest_error_; }
  /// What came to tuple_coder_bytes(), while numbers of so many slots are kept.
  uint64_t grown_bytes(size_t slots) const {
    uint64_t bytes = residuals_.grown_bytes() + exceptions_.bytes();
    for (const Group& group : groups_) bytes += bytes_to_hold(group.values, slots);
    return bytes;
  }
  /// A hint that the value in a slot is wanted soon: those of the last layer are far away in memory.
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
  // Three components fill three of four lanes: a sample of three costs what one does (3b57236: 3.3 to 5.3 M
  // points a second encoding, 3.7 to 6.1 decoding).
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
  // Codes wrap: a difference of any two codes is a code, and gives the second one back. Unsigned, as signed
  // overflow is undefined.
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
  /// What is known of the numbers of a group before any of them is coded. The three are found together, as
  /// their residuals are coded in two stages across the lanes.
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
  /// In half octaves of 2 |residual| + 1: exponent and the top bit of the fraction of a float, less those of
  /// 1, so that 0 has 0.
  static Ints size_class(const Floats& residual) {
    // Half octaves of 2 |residual| + 1: 0 for 0.
    const Floats size = (residual < 0 ? -residual : residual) * 2.0F + 1.0F;
    return ((same_bits<Ints>(size) >> 22) & 0x1ff) - 254;
  }
  static Ints mean_size(const Ints& sum, unsigned count);
  // 0 for ranges up to 2, 1 up to 7, 2 beyond: comparisons of lanes are -1 where they hold.
  static Ints spread_class(const Ints& range) { return -(range >= 3) - (range >= 8); }
  static Ints expected_class(const Ints& mean, const Ints& unit);
  void find_plain_residuals(const std::byte* numbers, Guess& guess) const;
  void place_plain(const Guess& guess, std::byte* numbers, Doubles& place) const;
  static void learn_fit(Fit& fit, const typename Fit::Features& twists, const Floats& target);

  // The steps of code(), each for the three components of a group at once.
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
  // Whether any flag of exceptions is coded at all.
  bool exact_ = true;  ///< no map needs exceptions
  bool plain_ = false;
  uint32_t samples_ = 0;
};

}  // namespace maille
