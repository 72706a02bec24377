#pragma once

// One loop for both directions: what is expected of a vertex, in which contexts, and what follows.

#include "numbers/curved_map.h"
#include "surface/fans/position_model.h"

namespace maille::positions {

/// More of what is not known yet.
template <class T>
void grow_zeros(Scratch<T>& vector, size_t end) {
  const size_t begin = vector.size();
  if (end <= begin) return;
  vector.resize(end);
  __builtin_memset(static_cast<void*>(vector.data() + begin), 0, (end - begin) * sizeof(T));
}

/// Points while they are coded, and sizes of their residuals: codes less a bias, as floats. Components beyond
/// those that an array has are 0. Files that went from doubles to floats decode in 0.3 to 0.85 of the time
/// (e764678).
template <unsigned n>
struct FloatPoints {
  using Point = FloatPoint;
  using Integer = int32_t;
  using Tuple = std::array<int32_t, most_components>;
  static constexpr unsigned components = n;
  static constexpr bool narrow = true;
  static constexpr float most = most_narrow_forecast;

  Scratch<FloatPoint> points;
  /// Of residuals, eight bits for each component. Not in the points, where the next vertex would wait for
  /// codes before it knew its contexts.
  Scratch<uint32_t> sizes;

  void reserve(size_t count) {
    points.reserve(count);
    sizes.reserve(count);
  }
  void grow(size_t end) {
    grow_zeros(points, end);
    grow_zeros(sizes, end);
  }
  void clear() {
    points.clear();
    sizes.clear();
  }
  uint32_t size(uint32_t v) const { return sizes[v]; }
  /// The nearest integers, the even one of two: the last bits of a sum whose unit is 1. |p| is at most 2^21,
  /// so that the sum with 1.5 * 2^23 stays between 2^23 and 2^24.
  [[gnu::always_inline]] static SignedLanes to_lanes(FloatPoint p) {
    p = p.smaller(FloatPoint::of(most)).larger(FloatPoint::of(-most));
    const FloatPoint magic = FloatPoint::of(0x1.8p23f);
    return reinterpret_cast<SignedLanes>((p + magic).v) - reinterpret_cast<SignedLanes>(magic.v);
  }
  [[gnu::always_inline]] static Tuple to_codes(FloatPoint p) {
    // clang 14 does not come to an end where one lane of these alone is wanted, for WebAssembly.
    if constexpr (n == 1) {
      constexpr float magic = 0x1.8p23f;
      const float sum = std::clamp(p.v[0], -most, most) + magic;
      return {bits_as<int32_t>(sum) - bits_as<int32_t>(magic)};
    }
    const SignedLanes codes = to_lanes(p);
    Tuple result;
    __builtin_memcpy(result.data(), &codes, sizeof codes);
    return result;
  }
  [[gnu::always_inline]] void set_lanes(uint32_t v, SignedLanes codes, uint32_t size) {
    points[v].v = __builtin_convertvector(codes, FloatLanes);
    sizes[v] = size;
  }
  [[gnu::always_inline]] void set(uint32_t v, const Tuple& codes, uint32_t size) {
    set_lanes(v, SignedLanes{codes[0], codes[1], codes[2], codes[3]}, size);
  }
  int32_t code(uint32_t v, unsigned k) const { return static_cast<int32_t>(points[v].v[k]); }
  /// Octaves above 1/4, 0 for less.
  [[gnu::always_inline]] static std::array<int32_t, 4> octaves(FloatPoint p, const Tuple&) {
    const auto bits = (reinterpret_cast<SignedLanes>(p.v) >> 23) - 125;
    std::array<int32_t, 4> result;
    __builtin_memcpy(result.data(), &bits, sizeof bits);
    return result;
  }
};

/// Any codes, as doubles; those of curved maps by the numbers that they stand for, as such codes are not
/// proportional to numbers. Codes wrap at 64 bits, so damaged bytes overflow nothing.
template <unsigned n>
struct DoublePoints {
  using Point = DoublePoint;
  using Integer = int64_t;
  using Tuple = std::array<int64_t, most_components>;
  static constexpr unsigned components = n;
  static constexpr bool narrow = false;
  static constexpr double most = 0x1p62, most_number = 1e37;

  Scratch<DoublePoint> points;
  Scratch<std::array<int64_t, n>> codes;
  Scratch<uint32_t> sizes;
  std::array<CurvedMap, n> curved;    ///< maps whose codes are not proportional to numbers
  std::array<bool, n> has_numbers{};  ///< coordinates below `most_number` are the floats themselves

  void reserve(size_t count) {
    points.reserve(count);
    codes.reserve(count);
    sizes.reserve(count);
  }
  void grow(size_t end) {
    grow_zeros(points, end);
    grow_zeros(codes, end);
    grow_zeros(sizes, end);
  }
  void clear() {
    points.clear();
    codes.clear();
    sizes.clear();
  }
  uint32_t size(uint32_t v) const { return sizes[v]; }
  static double coordinate(const DoublePoint& p, unsigned k) { return k < 2 ? p.xy[k] : p.zw[k - 2]; }
  [[gnu::always_inline]] Tuple to_codes(const DoublePoint& p) const {
    Tuple result{};
    for (unsigned k = 0; k < n; ++k) result[k] = to_code(coordinate(p, k), k);
    return result;
  }
  [[gnu::always_inline]] int64_t to_code(double x, unsigned k) const {
    if (curved[k]) return curved[k].nearest_code(x);
    x = std::clamp(x, -most, most);
    // Rounds to the nearest integer, the even one of two, for |x| up to 2^51. Larger numbers may lose low
    // bits to the sum, the same ones on both sides (format, 12.3).
    return static_cast<int64_t>(x + 0x1.8p52 - 0x1.8p52);
  }
  [[gnu::always_inline]] void set(uint32_t v, const Tuple& to, uint32_t size) {
    std::array<double, most_components> values{};
    sizes[v] = size;
    for (unsigned k = 0; k < n; ++k) {
      codes[v][k] = to[k];
      values[k] = value_of(to[k], k);
    }
    points[v] = {DoublePoint::Pair{values[0], values[1]}, DoublePoint::Pair{values[2], values[3]}};
  }
  double value_of(int64_t code, unsigned k) const {
    // Infinities would make NaN, and numbers near the largest overflow.
    return curved[k] ? std::clamp(curved[k].value_of(code), -most_number, most_number)
                     : static_cast<double>(code);
  }
  int64_t code(uint32_t v, unsigned k) const { return codes[v][k]; }
  /// Octaves above a quarter of the step that codes have at `codes`.
  [[gnu::always_inline]] std::array<int32_t, 4> octaves(const DoublePoint& p, const Tuple& at) const {
    std::array<int32_t, 4> result{};
    for (unsigned k = 0; k < n; ++k) result[k] = octave(coordinate(p, k)) - octave_of_step(at[k], k) + 2;
    return result;
  }
  static int32_t octave(double x) {
    uint64_t bits;
    __builtin_memcpy(&bits, &x, sizeof bits);
    return static_cast<int32_t>(bits >> 52 & 2047);
  }
  int32_t octave_of_step(int64_t code, unsigned k) const {
    if (!curved[k]) return 1023;
    const auto above = static_cast<int64_t>(static_cast<uint64_t>(code) + 1);
    return octave(value_of(above, k) - value_of(code, k));
  }
};

/// Calls `with` with each component as a constant.
template <unsigned n, class Function>
[[gnu::always_inline]] inline void for_each_component(Function with) {
  [&]<unsigned... k>(std::integer_sequence<unsigned, k...>) {
    (with(std::integral_constant<unsigned, k>{}), ...);
  }
  (std::make_integer_sequence<unsigned, n>{});
}

inline constexpr auto group_of_kind = [] {
  std::array<uint8_t, vertex_kinds> table{};
  for (unsigned kind = 0; kind < vertex_kinds; ++kind)
    table[kind] = static_cast<uint8_t>(ValenceRows::group_of(kind));
  return table;
}();

/// Where in its dictionary each component is: 16 bits for each, so that one mask says which are kept.
struct Indices {
  static constexpr uint16_t no_index = 0xffff;
  static constexpr uint64_t ones = 0x0001'0001'0001'0001;

  uint64_t all = no_index * ones;

  uint32_t operator[](unsigned k) const { return static_cast<uint16_t>(all >> 16 * k); }
  void set(unsigned k, uint32_t index) {
    all ^= (all ^ uint64_t{index} << 16 * k) & uint64_t{0xffff} << 16 * k;
  }
};

/// What later vertices want to know about the repeats of one. The first state is that of a vertex that is not
/// decoded yet: no index, and `listed` has all bits set, as the format says (7 for three components).
template <unsigned n>
struct Repeat {
  /// Stored as a whole, and loaded one by one, which a processor does without waiting.
  std::array<uint16_t, most_components> index;
  std::array<uint8_t, n> candidate{};
  uint8_t listed = (1 << n) - 1;  ///< of vertices that are not decoded yet

  Repeat() { index.fill(Indices::no_index); }
};

/// By a mask of components: all bits of each, and of its index.
inline constexpr auto component_masks = [] {
  std::array<std::array<int32_t, most_components>, 1 << most_components> table{};
  for (int mask = 0; mask < 1 << most_components; ++mask)
    table[static_cast<size_t>(mask)] = {-(mask & 1), -(mask >> 1 & 1), -(mask >> 2 & 1), -(mask >> 3)};
  return table;
}();
inline constexpr auto index_masks = [] {
  std::array<uint64_t, 1 << most_components> table{};
  for (unsigned mask = 0; mask < 1 << most_components; ++mask) {
    for (unsigned k = 0; k < most_components; ++k)
      table[mask] |= (uint64_t{0xffff} * (mask >> k & 1)) << 16 * k;
  }
  return table;
}();

/// What is known about points while they are coded.
template <class Points>
struct KnownPoints {
  Points points;
  std::vector<Repeat<Points::components>> repeats;
};

// Contexts of all alphabets, one behind the other, with room for any number of components: 15,105 in all, so
// that they fit the 16 bits of Writer::Event.
inline constexpr unsigned first_listed = residual_contexts_of(most_components, true),
                          first_index = first_listed + listed_contexts_of(most_components),
                          first_candidate = first_index + index_contexts,
                          known_context = first_candidate + candidate_contexts_of(most_components),
                          all_contexts = known_context + 1;

/// Codes one vertex after the other, in the order in which fans number them. `Coder` is a reader, or a writer
/// that finds the codes in `wanted`; whatever follows from a code follows after it on both sides. `repeats`
/// is a template parameter: each kind has a loop of its own (08251db).
///
/// The order within a vertex is that of the format (12.3): mask or candidates, symbols of all components, raw
/// bits of all components, then escapes.
template <class Coder, class Points, Repeats repeats>
class PositionCoder {
 public:
  static constexpr bool repeating = repeats != Repeats::none;
  using Point = typename Points::Point;
  using Integer = typename Points::Integer;
  using Tuple = typename Points::Tuple;
  using Own = Repeat<Points::components>;
  static constexpr unsigned components = Points::components;
  static constexpr unsigned listed_lane = positions::listed_lane(components);

  /// `known` has room for all points.
  PositionCoder(const Coding& coding, KnownPoints<Points>& known)
      : coding_(coding),
        points_(known.points),
        repeats_(known.repeats),
        size_class_(make_size_classes(coding.first_size, spread_classes_of(coding.with_spread))) {
    for (unsigned k = 0; k < components; ++k) {
      fields_[k] = make_fields<Integer>(coding.base[k]);
      size_of_[k] = SizesOfKnown(coding.base[k]);
      entries_[k] = coding.dictionaries[k].entries();
      filled_ |= unsigned{!entries_[k].empty()} << k;
    }
  }

  /// Vertex v, once all before it are coded. `wanted`: its codes, for a writer.
  [[gnu::always_inline]] void code(Coder& coder, uint32_t v, const VertexReferences& references,
                                   unsigned kind, const Weights& weights, const Weights& turned,
                                   const Tuple& wanted) {
    const unsigned group = group_of_kind[kind];
    Forecast<Point> expected = forecast(points_.points.data(), references, weights, group);
    if (components == 2 && coding_.placement > Placement::hinge)
      expected.turn(turned_part(points_.points.data(), references, turned, coding_.turn_ratio,
                                kind_is_swapped(kind), mirrored_));
    const bool by_gate = coding_.centre == Centre::gate;
    const Point target = by_gate ? expected.gate : expected.fitted;
    const Point apart = (by_gate ? expected.fitted : expected.mean) - target;
    const Tuple centre = points_.to_codes(target);
    const uint32_t* const sizes = points_.sizes.data();
    const auto size = [&](unsigned r) { return sizes[references.at[r]]; };
    // Sizes of up to four components are added in one register. A size is at most 36, so six of them stay
    // below 256 and never carry into the next component.
    const uint32_t around = 2 * (size(R::last) + size(R::focus)) + size(R::before) + size(R::next);
    std::array<uint32_t, components> context;
    const uint32_t gates = gates_of_group[group].parallelograms * plane_;
    for_each_component<components>(
        [&](auto k) { context[k] = 4 * plane_ * k + gates + size_class_[around >> (8 * k) & 255]; });
    if (coding_.with_spread) {
      const auto octaves = points_.octaves(expected.spread, centre);
      for (unsigned k = 0; k < components; ++k)
        context[k] += static_cast<uint32_t>(
            std::clamp(octaves[k] - int{coding_.first_spread}, 0, int{spread_classes} - 1));
    }
    Found at;
    if constexpr (Coder::encoding) at.codes = wanted;
    if constexpr (repeating) code_repeats(coder, at, references, group, expected, context);
    std::array<unsigned, components> symbol;
    for_each_component<components>(
        [&](auto k) { symbol[k] = code_symbol<k>(coder, at, centre[k], apart, context[k]); });
    if constexpr (repeating) find_values(coder, at, symbol);
    // Only floats are decoded in lanes, and of these not one component alone, which clang 14 does not finish
    // for WebAssembly (0077b8c).
    if constexpr (!Coder::encoding && Points::narrow && components > 1) {
      read_residuals(coder, at, v, target, apart, symbol);
    } else {
      const uint32_t residuals = code_residuals(coder, at, centre, signs(apart), symbol);
      points_.set(v, at.codes, residuals);
    }
    if constexpr (repeating) {
      if (!Coder::encoding && repeats == Repeats::candidates) find_indices(at);
      keep(at, repeats_[v]);
    }
  }

 private:
  using R = VertexReferences;
  using Unsigned = std::make_unsigned_t<Integer>;

  /// What is found out about the vertex at hand: a local of code(), which registers can hold.
  struct Found {
    Tuple codes{};
    Indices indices;
    std::array<uint8_t, components> candidate{};
    unsigned listed = 0;
    unsigned known = 0;          ///< components, as bits
    unsigned in_dictionary = 0;  ///< those of them that have a symbol
    std::array<uint32_t, components> near{};
    unsigned third = 0;
  };

  using Signs = std::array<bool, most_components>;
  [[gnu::always_inline]] static Signs signs(const FloatPoint& p) {
    return {p.v[0] < 0, p.v[1] < 0, p.v[2] < 0, p.v[3] < 0};
  }
  [[gnu::always_inline]] static Signs signs(const DoublePoint& p) {
    return {p.xy[0] < 0, p.xy[1] < 0, p.zw[0] < 0, p.zw[1] < 0};
  }

  /// Raw bits of all components, and with them codes. Returns the sizes of residuals.
  [[gnu::always_inline]] uint32_t code_residuals(Coder& coder, Found& at, const Tuple& centre,
                                                 const Signs& negative,
                                                 const std::array<unsigned, components>& symbol) {
    uint32_t size = 0;
    bool escaped = false;
    for (unsigned k = 0; k < components; ++k) {
      escaped |= symbol[k] == escape;
      if (repeating && (at.known >> k & 1) != 0) {
        size |= uint32_t{size_of_known(at.codes[k], centre[k], k)} << (8 * k);
        continue;
      }
      const ResidualField<Integer>& field = fields_[k][symbol[k]];
      // A shift by 64 would be undefined where a field has all bits, so it is done in two halves.
      const auto mask =
          static_cast<Unsigned>(((Unsigned{1} << (field.bits / 2)) << (field.bits - field.bits / 2)) - 1);
      const bool flip = ((field.other != 0) ^ negative[k]) & (field.is_signed != 0);
      Unsigned low = 0;
      if constexpr (Coder::encoding) {
        const auto residual =
            static_cast<Integer>(static_cast<Unsigned>(at.codes[k]) - static_cast<Unsigned>(centre[k]));
        const Unsigned magnitude =
            flip ? Unsigned{0} - static_cast<Unsigned>(residual) : static_cast<Unsigned>(residual);
        low = (magnitude - static_cast<Unsigned>(field.high)) & mask;
      }
      low = static_cast<Unsigned>(coder.raw(low, field.bits)) & mask;
      const auto magnitude = static_cast<Unsigned>(static_cast<Unsigned>(field.high) + low);
      const auto sign = static_cast<Unsigned>(0 - Unsigned{flip});
      const auto residual = static_cast<Unsigned>((magnitude ^ sign) - sign);
      if constexpr (!Coder::encoding)
        at.codes[k] = static_cast<Integer>(static_cast<Unsigned>(centre[k]) + residual);
      size |= uint32_t{field.size} << (8 * k);
    }
    if (escaped) [[unlikely]]
      code_escapes(coder, at.codes, symbol, centre);
    return size;
  }

  /// The same for a decoder of floats, all components side by side: 7 % less time than
  /// in a loop over them (armadillo and counter at -1).
  [[gnu::always_inline]] void read_residuals(Coder& coder, Found& at, uint32_t v, const Point& target,
                                             const Point& apart,
                                             const std::array<unsigned, components>& symbol) {
    std::array<ResidualField<Integer>, most_components> field{};
    std::array<uint32_t, most_components> low{};
    // Three fields are in what one look gives, four are not.
    uint64_t bits = coder.look();
    unsigned taken = 0;
    uint32_t size = 0, above = 0;
    for_each_component<components>([&](auto k) {
      if (k == 3) {
        coder.take(std::exchange(taken, 0));
        bits = coder.look();
      }
      field[k] = fields_[k][repeating && (at.known >> k & 1) != 0 ? known_symbol : symbol[k]];
      low[k] = static_cast<uint32_t>(bits) & ((1u << field[k].bits) - 1);
      bits >>= field[k].bits;
      taken += field[k].bits;
      size |= uint32_t{field[k].size} << (8 * k);
      // The escape is the only symbol that has this bit then.
      above |= symbol[k] + 1;
    });
    coder.take(taken);
    const auto lanes = [&](auto of) { return SignedLanes{of(0), of(1), of(2), of(3)}; };
    const SignedLanes magnitude = lanes(
        [&](unsigned k) { return static_cast<int32_t>(static_cast<uint32_t>(field[k].high) + low[k]); });
    const SignedLanes other = lanes([&](unsigned k) { return int32_t{field[k].other}; });
    const SignedLanes is_signed = lanes([&](unsigned k) { return int32_t{field[k].is_signed}; });
    const SignedLanes sign = (other ^ (apart.v < 0)) & is_signed;
    const SignedLanes centre = Points::to_lanes(target);
    SignedLanes codes = centre + ((magnitude ^ sign) - sign);
    if constexpr (repeating) {
      if (at.known != 0) size = blend_known(at, centre, codes, size);
    }
    if ((above & (escape + 1)) != 0) [[unlikely]]
      codes = read_escapes(coder, symbol, centre, codes);
    points_.set_lanes(v, codes, size);
    if constexpr (repeating)
      for_each_component<components>([&](auto k) { at.codes[k] = codes[unsigned{k}]; });
  }

  /// Known codes into their lanes; the sizes of all.
  [[gnu::always_inline]] uint32_t blend_known(const Found& at, const SignedLanes& centre, SignedLanes& codes,
                                              uint32_t size) {
    SignedLanes values{};
    for_each_component<components>([&](auto k) { values[unsigned{k}] = at.codes[k]; });
    SignedLanes known;
    __builtin_memcpy(&known, component_masks[at.known].data(), sizeof known);
    codes = (values & known) | (codes & ~known);
    const SignedLanes octaves = SizesOfKnown::octaves_of((values - centre) & known);
    for_each_component<components>(
        [&](auto k) { size |= uint32_t{size_of_[k].of_octave(octaves[unsigned{k}])} << (8 * k); });
    return size;
  }

  [[gnu::noinline]] SignedLanes read_escapes(Coder& coder, const std::array<unsigned, components>& symbol,
                                             SignedLanes centre, SignedLanes codes) {
    Tuple around, to;
    __builtin_memcpy(around.data(), &centre, sizeof centre);
    __builtin_memcpy(to.data(), &codes, sizeof codes);
    code_escapes(coder, to, symbol, around);
    __builtin_memcpy(&codes, to.data(), sizeof codes);
    return codes;
  }

  /// One symbol: of a residual, of an index, or of nothing that is not known.
  template <unsigned k>
  [[gnu::always_inline]] unsigned code_symbol(Coder& coder, const Found& at, Integer centre,
                                              const Point& apart, uint32_t context) {
    unsigned symbol = 0;
    if constexpr (Coder::encoding) {
      if (repeating && (at.known >> k & 1) != 0) {
        if ((at.in_dictionary >> k & 1) == 0) return 0;
        const int offset = static_cast<int>(at.indices[k]) - static_cast<int>(at.near[k]);
        symbol = offset >= -7 && offset <= 7 ? static_cast<unsigned>(offset + 7) : far_index;
      } else {
        const auto residual =
            static_cast<Integer>(static_cast<Unsigned>(at.codes[k]) - static_cast<Unsigned>(centre));
        symbol = symbol_of(magnitude_of(residual), (residual < 0) != signs(apart)[k], coding_.base[k]);
        // Shared tables were made for a sample, and may lack the symbol; every table has the escape.
        if (!coder.is_possible(context, symbol)) symbol = escape;
      }
    }
    return coder.template symbol<k>(context, symbol);
  }
  static uint64_t magnitude_of(Integer residual) {
    return residual < 0 ? Unsigned{0} - static_cast<Unsigned>(residual) : static_cast<Unsigned>(residual);
  }

  /// All bits of a residual that has no symbol. A claimed length is cut to what codes have, so that shifts
  /// stay defined for any bytes.
  [[gnu::noinline]] void code_escapes(Coder& coder, Tuple& codes,
                                      const std::array<unsigned, components>& symbol, const Tuple& centre) {
    for (unsigned k = 0; k < components; ++k) {
      if (symbol[k] != escape) continue;
      const auto residual =
          static_cast<Integer>(static_cast<Unsigned>(codes[k]) - static_cast<Unsigned>(centre[k]));
      const uint64_t magnitude = magnitude_of(residual);
      const auto length = static_cast<unsigned>(
          std::min<uint64_t>(coder.raw(Coder::encoding ? bit_length(magnitude) : 0, escape_length_bits),
                             Points::narrow ? most_narrow_length : 64));
      const bool negative = coder.raw(Coder::encoding && residual < 0, 1) != 0;
      const unsigned low = length / 2;
      uint64_t bits = coder.raw(magnitude & ((uint64_t{1} << low) - 1), low);
      bits |= coder.raw(magnitude >> low, length - low) << low;
      if constexpr (!Coder::encoding)
        codes[k] = static_cast<Integer>(static_cast<Unsigned>(centre[k]) +
                                        static_cast<Unsigned>(negative ? 0 - bits : bits));
    }
  }

  // Repeats.

  uint8_t size_of_known(Integer code, Integer centre, unsigned k) const {
    const auto residual = static_cast<Integer>(static_cast<Unsigned>(code) - static_cast<Unsigned>(centre));
    return size_of_[k].of(magnitude_of(residual));
  }

  [[gnu::always_inline]] void code_repeats(Coder& coder, Found& at, const VertexReferences& references,
                                           unsigned group, const Forecast<Point>& expected,
                                           std::array<uint32_t, components>& context) {
    if constexpr (Coder::encoding) {
      find_indices(at);
      for (unsigned k = 0; k < components; ++k)
        at.listed |= unsigned{at.indices[k] != Indices::no_index} << k;
    }
    at.third = ValenceRows::is_closed(group) ? R::next : R::before;
    if constexpr (repeats == Repeats::listed) {
      const auto listed = [&](unsigned r) -> uint32_t { return repeats_[references.at[r]].listed; };
      constexpr uint32_t count = listed_symbols_of(components);
      const uint32_t around = (listed(R::last) * count + listed(R::focus)) * count + listed(at.third);
      // The mask of the result matters for damaged bytes only, whose symbol may be any.
      at.listed = coder.template symbol<listed_lane>(first_listed + around, at.listed) & (count - 1);
      at.known = at.in_dictionary = at.listed & filled_;
    } else {
      code_candidates(coder, at, references, group, expected, context);
    }
    const Tuple fitted = points_.to_codes(expected.fitted);
    for_each_component<components>([&](auto k) {
      if ((filled_ >> k & 1) == 0) return;
      const uint32_t of_index = index_context<k>(at, references, fitted[k]);
      context[k] = listed_or<k>(at, of_index, context[k]);
    });
  }

  /// `a` where a component is in its dictionary, else `b`. Compilers make branches of conditions, and nobody
  /// can guess which component repeats: masks make charts of the dragon 1.17 times as fast at 14 bits. With
  /// doubles it takes so long to find an index that waiting for it in vain is worse, 0.97 times.
  template <unsigned k, class T>
  [[gnu::always_inline]] static T listed_or(const Found& at, T a, T b) {
    if constexpr (!Points::narrow) return (at.in_dictionary >> k & 1) != 0 ? a : b;
    return b ^ ((a ^ b) & static_cast<T>(component_masks[at.in_dictionary][k]));
  }

  /// Finds where in the dictionaries the coordinates are, also those that were not coded by index: later
  /// vertices want to know.
  [[gnu::always_inline]] void find_indices(Found& at) const {
    for_each_component<components>([&](auto k) {
      if ((filled_ >> k & 1) == 0) return;
      const uint32_t near = coding_.dictionaries[k].near_part(at.codes[k]).first;
      at.indices.set(k, entries_[k][near] == at.codes[k] ? near : uint32_t{Indices::no_index});
    });
  }

  [[gnu::always_inline]] static void keep(const Found& at, Own& to) {
    store(reinterpret_cast<std::byte*>(to.index.data()), at.indices.all);
    for_each_component<components>([&](auto k) { to.candidate[k] = at.candidate[k]; });
    to.listed = static_cast<uint8_t>(at.listed);
  }

  void code_candidates(Coder& coder, Found& at, const VertexReferences& references, unsigned group,
                       const Forecast<Point>& expected, std::array<uint32_t, components>& context) {
    const Tuple gate = points_.to_codes(expected.gate), closing = points_.to_codes(expected.closing),
                late = points_.to_codes(expected.late);
    unsigned before = candidate_symbols;
    for_each_component<components>([&](auto k) {
      context[k] = code_candidate<k>(coder, at, references, group, gate, closing, late, before, context[k]);
    });
  }
  /// Returns the context of what follows: that of a residual, or `of_residual`.
  template <unsigned k>
  uint32_t code_candidate(Coder& coder, Found& at, const VertexReferences& references, unsigned group,
                          const Tuple& gate, const Tuple& closing, const Tuple& late, unsigned& before,
                          uint32_t of_residual) {
    const auto code = [&](unsigned r) { return points_.code(references.at[r], k); };
    const std::array<Integer, 7> values = {
        gate[k],
        code(R::last),
        code(R::focus),
        code(at.third),
        at.third == R::next ? code(R::before) : static_cast<Integer>(closing[k]),
        static_cast<Integer>(closing[k]),
        static_cast<Integer>(late[k])};
    unsigned symbol = 0;
    if constexpr (Coder::encoding) {
      while (symbol < 7 && values[symbol] != at.codes[k]) ++symbol;
      symbol = symbol < 7 ? symbol + 1 : at.indices[k] != Indices::no_index ? candidate_symbols - 1 : 0;
    }
    const uint32_t equal = uint32_t{values[0] == values[1]} | uint32_t{values[0] == values[2]} << 1;
    const uint32_t of_last = repeats_[references.at[R::last]].candidate[k];
    const uint32_t context =
        (((k * 10 + before) * 10 + of_last) * 4 + equal) * 4 + ValenceRows::parallelograms(group);
    symbol = coder.template symbol<k>(first_candidate + context, symbol);
    // An index into an empty dictionary, of damaged bytes, counts as not known.
    if (symbol == candidate_symbols - 1 && (filled_ >> k & 1) == 0) symbol = 0;
    before = symbol;
    at.candidate[k] = static_cast<uint8_t>(symbol);
    if (symbol == 0) return of_residual;
    at.known |= 1u << k;
    if (symbol == candidate_symbols - 1) {
      at.in_dictionary |= 1u << k;
    } else {
      at.codes[k] = values[symbol - 1];
    }
    return known_context;
  }

  /// Of the index in the dictionary, less that of the value nearest to what is expected.
  template <unsigned k>
  [[gnu::always_inline]] uint32_t index_context(Found& at, const VertexReferences& references,
                                                int64_t expected) {
    const auto found = coding_.dictionaries[k].near_part(expected);
    const uint32_t near = found.first, part = found.second;
    at.near[k] = near;
    const auto relation = [&](unsigned r) -> uint32_t {
      const uint32_t above = repeats_[references.at[r]].index[k] + 1 - near;
      // The same, one above, one below, or another one: 0 to 3. With branches, which are guessed wrong,
      // meshes with repeats take 15 % more.
      return 0b11'01'00'10 >> 2 * std::min(above, 3u) & 3;
    };
    return first_index +
           ((part * relations + relation(R::last)) * relations + relation(R::focus)) * relations +
           relation(at.third);
  }

  /// Turns indices into codes. A far index is raw bits, before those of residuals.
  [[gnu::always_inline]] void find_values(Coder& coder, Found& at,
                                          const std::array<unsigned, components>& symbol) {
    Indices found{0};
    unsigned far = 0;
    for_each_component<components>([&](auto k) { far |= unsigned{symbol[k] == far_index} << k; });
    far &= at.in_dictionary;
    for_each_component<components>([&](auto k) {
      if ((filled_ >> k & 1) == 0) return;
      uint32_t index = at.near[k] + symbol[k] - 7;
      if ((far >> k & 1) != 0) [[unlikely]]
        index = static_cast<uint32_t>(coder.raw(at.indices[k], 16));
      // Only damaged bytes lead beyond the end, and symbols of something else.
      index = std::min(index, static_cast<uint32_t>(entries_[k].size()) - 1);
      found.all |= uint64_t{index} << 16 * k;
      at.codes[k] = listed_or<k>(at, static_cast<Integer>(entries_[k][index]), at.codes[k]);
    });
    at.indices.all ^= (at.indices.all ^ found.all) & index_masks[at.in_dictionary];
  }

  const Coding& coding_;
  Points& points_;
  std::vector<Own>& repeats_;
  uint32_t plane_ = size_classes * spread_classes_of(coding_.with_spread);
  std::array<ResidualFields<Integer>, components> fields_;
  std::array<SizesOfKnown, components> size_of_;
  std::array<std::span<const int64_t>, components> entries_;  ///< of dictionaries
  unsigned filled_ = 0;                                       ///< those with something in them, as bits
  std::array<uint8_t, 256> size_class_;
  bool mirrored_ = false;
};

}  // namespace maille::positions
