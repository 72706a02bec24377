#pragma once

// What encoder and decoder of positions of fans share. docs/format.md, 12.3.

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/bytes.h"
#include "base/pages.h"
#include "entropy/lane_rans.h"
#include "entropy/static_rans.h"
#include "numbers/number_map.h"
#include "surface/fans/dictionary.h"
#include "surface/fans/placed_weights.h"
#include "surface/left_out.h"

namespace maille::positions {

/// Of the tuples that the coder takes; positions have three.
inline constexpr unsigned most_components = 4;

/// A residual is one symbol and raw bits. Symbol 0 stands for at most `base` bits, with sign. Then each
/// length more has four symbols: the sign relative to that of `apart`, and the bit below the highest. The
/// last symbol stands for any number, which follows in raw bits. So a table tells the length, and what is
/// left is nearly evenly distributed.
inline constexpr unsigned symbols = 64;
inline constexpr unsigned escape = 63;
inline constexpr unsigned known_symbol = symbols;  ///< of components that have no residual
inline constexpr unsigned longest = 16;            ///< bits beyond `base` that have symbols
inline constexpr unsigned escape_length_bits = 7;
/// Narrow codes count from the bias and are floats, which are exact up to 2^24, so up to sums of three
/// forecasts. A residual is a code less a clamped forecast, so it has most_narrow_length bits at most. Both
/// bounds are checked below.
inline constexpr int32_t most_narrow_code = 1 << 20, most_narrow_forecast = 1 << 21;
inline constexpr unsigned most_narrow_length = 22;
static_assert(3 * most_narrow_forecast < 1 << 24);
static_assert(most_narrow_code + most_narrow_forecast < 1 << most_narrow_length);
inline constexpr unsigned most_narrow_base = 4;  // so that three fields are at most 57 bits
inline constexpr unsigned most_wide_base = 40;

/// Sizes of residuals are two to an octave beyond `base`; these are what the size of an escape counts as.
inline constexpr unsigned escape_size = 2 * longest + 4;

template <class Integer>
struct ResidualField {
  Integer high = 0;      ///< the magnitude without its raw bits
  uint8_t bits = 0;      ///< raw
  int8_t other = 0;      ///< -1: the sign is not that of `apart`
  int8_t is_signed = 0;  ///< -1; 0: `high` has the sign, and apart does not matter
  uint8_t size = 0;      ///< in half octaves, as context of others
};
template <class Integer>
using ResidualFields = std::array<ResidualField<Integer>, symbols + 1>;

template <class Integer>
ResidualFields<Integer> make_fields(unsigned base) {
  ResidualFields<Integer> fields;
  if (base > 0)
    fields[0] = {static_cast<Integer>(-(Integer{1} << base)), static_cast<uint8_t>(base + 1), 0, 0, 0};
  for (uint8_t s = 1; s < escape; ++s) {
    const unsigned i = s < 3 ? 1 : (s + 5) / 4;
    const unsigned length = base + i;
    const auto other = static_cast<int8_t>(-(s < 3 ? s == 2 : (s - 3) % 4 / 2));
    if (i == 1) {
      fields[s] = {Integer{1} << base, static_cast<uint8_t>(base), other, -1, 2};
      continue;
    }
    const unsigned top = (s - 3) % 2;
    fields[s] = {static_cast<Integer>(static_cast<Integer>(2 + top) << (length - 2)),
                 static_cast<uint8_t>(length - 2), other, -1, static_cast<uint8_t>(2 * i + top)};
  }
  fields[escape] = {0, 0, 0, 0, escape_size};
  return fields;
}

/// The symbol of a residual of so many bits; longer ones than any have the escape.
inline unsigned symbol_of(uint64_t magnitude, bool other, unsigned base) {
  const unsigned length = bit_length(magnitude);
  if (length <= base) return 0;
  const unsigned i = length - base;
  if (i > longest) return escape;
  if (i == 1) return 1 + other;
  return 3 + 4 * (i - 2) + 2 * other + (magnitude >> (length - 2) & 1);
}

/// The sizes of residuals that have no symbol as their numbers are known: by length, without a branch.
class SizesOfKnown {
 public:
  explicit SizesOfKnown(unsigned base = 0) {
    for (unsigned length = 0; length <= 64; ++length) {
      const unsigned i = length > base ? length - base : 0;
      const bool has_half = i > 1 && i <= longest;
      by_length_[length] = {static_cast<uint8_t>(i > longest ? escape_size : 2 * i), uint8_t{has_half},
                            static_cast<uint8_t>(has_half ? length - 2 : 0)};
      for (unsigned half = 0; half < 2 && length > 0 && length <= 32; ++half)
        by_octave_[2 * (126 + length) + half] =
            static_cast<uint8_t>(by_length_[length].size + (has_half ? half : 0));
    }
  }
  [[gnu::always_inline]] uint8_t of(uint64_t magnitude) const {
    const OfLength& at = by_length_[bit_length(magnitude)];
    return static_cast<uint8_t>(at.size + (magnitude >> at.shift & at.half));
  }
  /// The same of narrow residuals, by the upper bits of their magnitude as a float: 126 more than the length,
  /// and the bit below the highest.
  static SignedLanes octaves_of(SignedLanes residuals) {
    const auto floats = reinterpret_cast<SignedLanes>(__builtin_convertvector(residuals, FloatLanes));
    return (floats & 0x7fffffff) >> 22;
  }
  [[gnu::always_inline]] uint8_t of_octave(int32_t octave) const {
    return by_octave_[static_cast<size_t>(octave)];
  }

 private:
  struct OfLength {
    uint8_t size, half, shift;
  };
  std::array<OfLength, 65> by_length_;
  std::array<uint8_t, 2 * (126 + 32) + 2> by_octave_{};
};

// Contexts of residuals: a plane for each component and number of parallelograms, in it 16 classes of the
// sizes of the neighbours' residuals times 16 of how far predictions lie apart. Sizes go in half octaves,
// spreads in octaves; no sweep of the numbers of classes is recorded. Contexts share tables, so more of them
// cost only a longer map.
inline constexpr unsigned size_classes = 16, spread_classes = 16;
/// Without spreads there is one class of them, so that small meshes do not pay for the map.
inline constexpr unsigned spread_classes_of(bool with_spread) {
  return with_spread ? spread_classes : 1;
}
inline constexpr unsigned residual_contexts_of(unsigned components, bool with_spread) {
  return components * 4 * size_classes * spread_classes_of(with_spread);
}
// Tables have 2^10 slots, of one byte each beside the symbols, so that 24 of them stay in the first cache
// (dbfaf93). The largest numbers of tables, here and below, are chosen; no sweep is recorded.
inline constexpr unsigned table_bits = 10, most_residual_tables = 24;

// Repeats: which components are in dictionaries, and where.
inline constexpr unsigned listed_symbols_of(unsigned components) {
  return 1u << components;
}
inline constexpr unsigned listed_contexts_of(unsigned components) {
  return 1u << 3 * components;
}
inline constexpr unsigned most_listed_tables = 16;
/// Behind those of the components; the last one of four.
inline constexpr unsigned listed_lane(unsigned components) {
  return components < symbol_lanes ? components : symbol_lanes - 1;
}
inline constexpr unsigned relations = 4;
inline constexpr unsigned far_index = 15;  ///< the symbol of an index far from the nearest one
inline constexpr unsigned index_contexts = 8 * relations * relations * relations, index_symbols = 16,
                          most_index_tables = 24;
inline constexpr unsigned candidate_contexts_of(unsigned components) {
  return components * 10 * 10 * 4 * 4;
}
inline constexpr unsigned candidate_symbols = 9, most_candidate_tables = 16;

/// Calls `with` with a number of components as a constant, 1 to 4.
template <class Function>
auto with_components(unsigned components, Function with) {
  // The decoder of charts has positions only, which keeps it small (94 KB; 0fc8bf9).
  if constexpr (charts_alone) return with(std::integral_constant<unsigned, 3>{});
  switch (components) {
    case 1:
      return with(std::integral_constant<unsigned, 1>{});
    case 2:
      return with(std::integral_constant<unsigned, 2>{});
    case 3:
      return with(std::integral_constant<unsigned, 3>{});
    default:
      return with(std::integral_constant<unsigned, 4>{});
  }
}

/// Which prediction residuals are counted from; the other one says on which side they probably lie.
enum class Centre : uint8_t { fitted, gate };
enum class Repeats : uint8_t {
  none,
  listed,      ///< which components are in a dictionary comes first, as a mask
  candidates,  ///< each component may be that of a neighbour or of a parallelogram, or in a dictionary
};

/// Calls `with` with the kind of repeats as a constant.
template <class Function>
auto with_repeats(Repeats repeats, Function with) {
  switch (repeats) {
    case Repeats::none:
      return with(std::integral_constant<Repeats, Repeats::none>{});
    case Repeats::listed:
      return with(std::integral_constant<Repeats, Repeats::listed>{});
    default:
      return with(std::integral_constant<Repeats, Repeats::candidates>{});
  }
}

using Dictionaries = std::array<Dictionary, most_components>;

/// How tuples are coded, chosen by the encoder.
struct Coding {
  unsigned components = 3;
  Centre centre = Centre::fitted;
  Repeats repeats = Repeats::none;
  Placement placement = Placement::none;
  double turn_ratio = 1;  ///< of placements that turn
  bool with_spread = false;
  bool with_valences = false;
  std::array<uint8_t, most_components> base{};
  /// The lowest sizes and spreads that have a class of their own.
  uint8_t first_size = 0, first_spread = 0;
  ValenceRows rows;
  Dictionaries dictionaries;
};

/// By the sum of six sizes around: its class, times `spreads`.
inline std::array<uint8_t, 256> make_size_classes(unsigned first, unsigned spreads) {
  std::array<uint8_t, 256> table{};
  for (int around = 0; around < 256; ++around)
    table[static_cast<size_t>(around)] = static_cast<uint8_t>(
        spreads * static_cast<unsigned>(
                      std::clamp((around + 3) / 6 - static_cast<int>(first), 0, int{size_classes} - 1)));
  return table;
}

}  // namespace maille::positions
