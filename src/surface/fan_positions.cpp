// The decoder of the positions of fans; its encoder is in fan_position_encoder.cpp.
#include "surface/fan_positions.h"

#include <algorithm>
#include <array>
#include <memory>
#include <string>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include "base/bytes.h"
#include "base/pages.h"
#include "base/result.h"
#include "entropy/static_rans.h"
#include "surface/fan_position_model.h"
#include "surface/number_maps.h"

namespace maille {

using namespace fan_positions;

namespace {

tl::unexpected<Error> corrupt(const char* what) {
  return failure(ErrorCode::corrupt, std::string("positions: ") + what);
}

/// Residual classes of a vertex and its selector, a byte each; of the first three only 6 bits count.
using Classes = std::array<uint8_t, 4>;

/// Selectors and classes of one block after the other.
class ClassDecoder {
 public:
  ClassDecoder(Bytes bytes, const StaticTables& tables, const StaticTables& selector_tables,
               std::span<const uint8_t> group_of)
      : words_(bytes.data()),
        end_(bytes.data() + bytes.size()),
        with_selectors_(!selector_tables.tables.empty()) {
    for (uint64_t& state : states_) {
      state = load<uint64_t>(words_);
      words_ += 8;
    }
    constexpr size_t slots = 1 << class_bits;
    slots_.resize(tables.tables.size() * slots);
    for (size_t i = 0; i < tables.tables.size(); ++i)
      fill_slots(tables.tables[i], class_bits, group_of, &slots_[i * slots]);
    const auto place = [&](unsigned context) {
      return static_cast<uint32_t>(tables.table_of[context] * slots);
    };
    for (unsigned g = 0; g < groups; ++g) {
      for (unsigned q = 0; q < qualities; ++q) x_at_[g * stride + q] = place(g * qualities + q);
      y_at_[g * stride] = place(y_contexts + g);
      z_at_[g * stride] = place(z_contexts + g);
    }
    constexpr size_t few = 1 << selector_bits;
    selector_slots_.resize(selector_tables.tables.size() * few);
    for (size_t i = 0; i < selector_tables.tables.size(); ++i)
      fill_slots(selector_tables.tables[i], selector_bits, {}, &selector_slots_[i * few]);
    for (unsigned c = 0; c < selector_contexts && with_selectors_; ++c)
      selector_at_[c] = static_cast<uint32_t>(selector_tables.table_of[c] * few);
  }

  void decode(const uint8_t* kinds, uint32_t count, Classes* classes) {
    if (with_selectors_) {
      decode_block<true>(kinds, count, classes);
    } else {
      decode_block<false>(kinds, count, classes);
    }
  }
  bool exhausted() const { return exhausted_; }

 private:
  struct Lane {
    uint64_t state;
    uint32_t group;     ///< as in slots
    uint32_t selector;  ///< times 4
  };

  /// Where they are: stores of bytes make a compiler look at its members again.
  struct Slots {
    const StaticSlot* classes;
    const StaticSlot* selectors;
  };

  template <bool with_selectors>
  [[gnu::always_inline]] void decode_group(const Slots& slots, Lane& lane, unsigned kind,
                                           Classes& out) const {
    uint64_t x = lane.state;
    constexpr uint64_t mask = (1 << class_bits) - 1;
    uint32_t selector = fitted_selector;
    if constexpr (with_selectors) {
      const uint32_t context = lane.selector + selector_context(0, kind);
      const StaticSlot slot = slots.selectors[selector_at_[context] + (x & ((1 << selector_bits) - 1))];
      x = slot_frequency(slot) * (x >> selector_bits) + slot_offset(slot);
      selector = slot_symbol(slot);
      lane.selector = selector * 4;
    }
    const StaticSlot a = slots.classes[x_at_[lane.group / 4 + quality_of_kind[kind]] + (x & mask)];
    x = slot_frequency(a) * (x >> class_bits) + slot_offset(a);
    uint32_t group = a & group_mask;
    const StaticSlot b = slots.classes[y_at_[group / 4] + (x & mask)];
    x = slot_frequency(b) * (x >> class_bits) + slot_offset(b);
    group = std::max(group, b & group_mask);
    const StaticSlot c = slots.classes[z_at_[group / 4] + (x & mask)];
    x = slot_frequency(c) * (x >> class_bits) + slot_offset(c);
    lane.group = std::max(group, c & group_mask);
    lane.state = x;
    out = {static_cast<uint8_t>(a), static_cast<uint8_t>(b), static_cast<uint8_t>(c),
           static_cast<uint8_t>(selector)};
  }
  /// For where three words are there, which is the most that a group takes. (Damaged states may stay below
  /// their bound.)
  [[gnu::always_inline]] static void refill(Lane& lane, const std::byte*& words) {
    // Without a branch, which would be taken every second time.
    const uint64_t more = lane.state << 16 | load<uint16_t>(words);
    const uint64_t low = lane.state < lowest_group_state;
    lane.state ^= (lane.state ^ more) & (0 - low);
    words += 2 * low;
    for (int i = 0; i < 2 && lane.state < lowest_group_state; ++i) {
      lane.state = lane.state << 16 | load<uint16_t>(words);
      words += 2;
    }
  }
  [[gnu::noinline]] void refill_slowly(Lane& lane) {
    uint16_t word = 0;
    if (end_ - words_ >= 2) {
      word = load<uint16_t>(words_);
      words_ += 2;
    } else {
      exhausted_ = true;
    }
    // A state of 0 would never grow; it comes only from damaged bytes.
    lane.state = (lane.state | (lane.state == 0)) << 16 | word;
  }

  template <bool with_selectors>
  void decode_block(const uint8_t* kinds, uint32_t count, Classes* classes) {
    const Slots slots{slots_.data(), selector_slots_.data()};
    std::array<Lane, group_lanes> lanes;
    for (unsigned l = 0; l < group_lanes; ++l) lanes[l] = {states_[l], groups_[l], selectors_[l]};
    const uint32_t share = (count + group_lanes - 1) / group_lanes;
    // A group takes at most three words.
    uint32_t i = 0;
    const uint32_t full = count >= 3 * share ? std::min(share, count - 3 * share) : 0;
    while (i < full) {
      const auto left = static_cast<uint64_t>(end_ - words_) / (2 * 3 * group_lanes);
      if (left == 0) break;
      const auto stop = static_cast<uint32_t>(std::min<uint64_t>(full, i + left));
      // In locals, so that they stay in registers.
      Lane a = lanes[0], b = lanes[1], c = lanes[2], d = lanes[3];
      const std::byte* words = words_;
      for (; i < stop; ++i) {
        decode_group<with_selectors>(slots, a, kinds[i], classes[i]);
        decode_group<with_selectors>(slots, b, kinds[share + i], classes[share + i]);
        decode_group<with_selectors>(slots, c, kinds[2 * share + i], classes[2 * share + i]);
        decode_group<with_selectors>(slots, d, kinds[3 * share + i], classes[3 * share + i]);
        refill(a, words);
        refill(b, words);
        refill(c, words);
        refill(d, words);
      }
      lanes = {a, b, c, d};
      words_ = words;
    }
    for (; i < share; ++i) {
      for (unsigned l = 0; l < group_lanes; ++l) {
        const uint32_t v = l * share + i;
        if (v >= count) continue;
        decode_group<with_selectors>(slots, lanes[l], kinds[v], classes[v]);
        while (lanes[l].state < lowest_group_state) refill_slowly(lanes[l]);
      }
    }
    for (unsigned l = 0; l < group_lanes; ++l) {
      states_[l] = lanes[l].state;
      groups_[l] = lanes[l].group;
      selectors_[l] = lanes[l].selector;
    }
  }

  const std::byte* words_;
  const std::byte* end_;
  bool with_selectors_;
  bool exhausted_ = false;
  std::array<uint64_t, group_lanes> states_;
  std::array<uint32_t, group_lanes> groups_{};
  std::array<uint32_t, group_lanes> selectors_{};
  // A group in its place in a slot is the distance of its tables here, in bytes.
  static constexpr uint32_t group_mask = 7 << 6;
  static constexpr size_t stride = 64 / sizeof(uint32_t);
  std::array<uint32_t, groups * stride> x_at_{}, y_at_{}, z_at_{};
  std::array<uint32_t, selector_contexts> selector_at_{};
  std::vector<StaticSlot> slots_;
  std::vector<StaticSlot> selector_slots_;
};

/// Raw bits of residuals, lowest first. Eight bytes behind the last must be readable.
class RawBits {
 public:
  explicit RawBits(Bytes bytes) : bytes_(bytes.data()), end_(uint64_t{bytes.size()} * 8) {}

  /// The next 57 bits or more.
  [[gnu::always_inline]] uint64_t peek() const { return load<uint64_t>(bytes_ + (at_ >> 3)) >> (at_ & 7); }
  [[gnu::always_inline]] void skip(unsigned count) { at_ += count; }
  bool has(uint64_t count) const { return count <= end_ - at_; }

 private:
  const std::byte* bytes_;
  uint64_t end_;
  uint64_t at_ = 0;
};

[[gnu::always_inline]] inline int32_t residual_of(uint32_t bits, unsigned size) {
  // Class 0 has no bits. Below half of the range a residual is negative.
  const uint64_t range = uint64_t{1} << size;
  return static_cast<int32_t>(static_cast<int64_t>(bits) -
                              (uint64_t{2} * bits < range ? static_cast<int64_t>(range) - 1 : 0));
}

template <class Points>
bool reconstruct(Points& points, const VertexReferences& references, const Rows& rows, unsigned kind,
                 const Classes& classes, RawBits& raw, uint32_t v) {
  const Row& row = rows[kind * selectors + classes[3]];
  typename Points::Codes residuals;
  for (unsigned k = 0; k < 3; ++k) {
    const unsigned size = classes[k] & 63;
    if (!raw.has(size)) return false;
    residuals[k] = residual_of(static_cast<uint32_t>(raw.peek() & ((uint64_t{1} << size) - 1)), size);
    raw.skip(size);
  }
  points.reconstruct(v, points.predict(references, row), residuals);
  return true;
}

constexpr auto residual_masks = [] {
  std::array<uint32_t, 64> masks{};
  for (unsigned size = 0; size < 32; ++size) masks[size] = (1u << size) - 1;
  return masks;
}();

#ifdef __SSE2__
/// The same for many vertices with 16-bit codes. Returns how many were done: it stops near the end of the raw
/// bits.
uint32_t reconstruct_many(NarrowPoints& points, const VertexReferences* reference, const uint8_t* kinds,
                          const Rows& rows, const Classes* classes, RawBits& raw, uint32_t begin,
                          uint32_t end) {
  auto* const out = points.points.data();
  const auto at = [out](uint32_t v) { return _mm_loadl_epi64(reinterpret_cast<const __m128i*>(out + v)); };
  const __m128i half = _mm_set1_epi32(weight_sum / 2);
  RawBits bits = raw;
  uint32_t v = begin;
  for (; v < end && bits.has(48); ++v) {
    const auto c = load<uint32_t>(&classes[v - begin]);
    const VertexReferences& references = reference[v - begin];
    const Row& row = rows[kinds[v - begin] * size_t{selectors} + (c >> 24)];
    const __m128i weights = _mm_load_si128(reinterpret_cast<const __m128i*>(row.data()));
    const auto pair = [&](unsigned k) {
      return _mm_unpacklo_epi16(at(references.at[k]), at(references.at[k + 1]));
    };
    __m128i sum = _mm_madd_epi16(pair(0), _mm_shuffle_epi32(weights, 0x00));
    sum = _mm_add_epi32(sum, _mm_madd_epi16(pair(2), _mm_shuffle_epi32(weights, 0x55)));
    sum = _mm_add_epi32(sum, _mm_madd_epi16(pair(4), _mm_shuffle_epi32(weights, 0xaa)));
    sum = _mm_add_epi32(sum, half);
    sum = _mm_add_epi32(sum, _mm_madd_epi16(pair(6), _mm_shuffle_epi32(weights, 0xff)));
    sum = _mm_srai_epi32(sum, weight_bits);
    uint64_t word = bits.peek();
    const unsigned a = c & 63, b = c >> 8 & 63, d = c >> 16 & 63;
    bits.skip(a + b + d);
    const auto take = [&word](unsigned size) {
      const uint32_t mask = residual_masks[size];
      const auto value = static_cast<uint32_t>(word) & mask;
      word >>= size;
      // Below half of the range (2 * value <= mask, but for size 0) a residual is negative.
      return value - (mask & (0 - static_cast<uint32_t>(2 * value <= mask)));
    };
    const uint32_t x = take(a), y = take(b), z = take(d);
    const __m128i residuals = _mm_cvtsi64_si128(
        static_cast<int64_t>((x & 0xffff) | (y & 0xffff) << 16 | uint64_t{z & 0xffff} << 32));
    const __m128i result = _mm_add_epi16(_mm_packs_epi32(sum, sum), residuals);
    _mm_storel_epi64(reinterpret_cast<__m128i*>(out + v), result);
  }
  raw = bits;
  return v - begin;
}
#else
uint32_t reconstruct_many(NarrowPoints&, const VertexReferences*, const uint8_t*, const Rows&, const Classes*,
                          RawBits&, uint32_t, uint32_t) {
  return 0;
}
#endif
uint32_t reconstruct_many(WidePoints&, const VertexReferences*, const uint8_t*, const Rows&, const Classes*,
                          RawBits&, uint32_t, uint32_t) {
  return 0;
}

// The largest finite f32.
constexpr double most_f32 = 3.40282346638528859811704183484516925e+38;

#ifdef __SSE2__
[[gnu::always_inline]] inline __m128i codes_of(const NarrowPoints& points, __m128i bias, uint32_t v) {
  const __m128i codes = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(points.points.data() + v));
  return _mm_add_epi32(_mm_srai_epi32(_mm_unpacklo_epi16(codes, codes), 16), bias);
}
/// The frequent kinds of maps, as NumberMap::store_number() does them. Each store writes a number too many:
/// all but the last vertex. Returns how many were done.
uint32_t store_many(const NarrowPoints& points, uint32_t begin, uint32_t end, std::span<const NumberMap> maps,
                    Array& array) {
  const auto all = [&maps](NumberMap::Kind kind) {
    return maps[0].kind == kind && maps[1].kind == kind && maps[2].kind == kind;
  };
  if (end == begin) return 0;
  const __m128i bias = _mm_set_epi32(0, points.bias[2], points.bias[1], points.bias[0]);
  auto* out = reinterpret_cast<__m128i*>(array.bytes.data() + size_t{12} * begin);
  const auto next = [](__m128i* at) {
    return reinterpret_cast<__m128i*>(reinterpret_cast<std::byte*>(at) + 12);
  };
  if (all(NumberMap::Kind::integer) && size_of(array.type) == 4) {
    for (uint32_t v = begin; v + 1 < end; ++v, out = next(out))
      _mm_storeu_si128(out, codes_of(points, bias, v));
    return end - begin - 1;
  }
  if (all(NumberMap::Kind::lattice) && array.type == Scalar::f32) {
    const __m128d origin = _mm_set_pd(maps[1].origin, maps[0].origin),
                  step = _mm_set_pd(maps[1].step, maps[0].step);
    const __m128d origin_z = _mm_set1_pd(maps[2].origin), step_z = _mm_set1_pd(maps[2].step);
    // With the limit in front NaN stays, as in std::clamp().
    const auto rounded = [](__m128d value) {
      value = _mm_max_pd(_mm_set1_pd(-most_f32), value);
      return _mm_cvtpd_ps(_mm_min_pd(_mm_set1_pd(most_f32), value));
    };
    for (uint32_t v = begin; v + 1 < end; ++v, out = next(out)) {
      const __m128i codes = codes_of(points, bias, v);
      const __m128 xy = rounded(_mm_add_pd(origin, _mm_mul_pd(_mm_cvtepi32_pd(codes), step)));
      const __m128i upper = _mm_shuffle_epi32(codes, 0xee);
      const __m128 z = rounded(_mm_add_pd(origin_z, _mm_mul_pd(_mm_cvtepi32_pd(upper), step_z)));
      _mm_storeu_si128(out, _mm_castps_si128(_mm_movelh_ps(xy, z)));
    }
    return end - begin - 1;
  }
  return 0;
}
#else
uint32_t store_many(const NarrowPoints&, uint32_t, uint32_t, std::span<const NumberMap>, Array&) {
  return 0;
}
#endif
uint32_t store_many(const WidePoints&, uint32_t, uint32_t, std::span<const NumberMap>, Array&) {
  return 0;
}

template <class Points>
void store(const Points& points, uint32_t begin, uint32_t end, std::span<const NumberMap> maps,
           Array& array) {
  const size_t size = size_of(array.type);
  for (uint32_t v = begin + store_many(points, begin, end, maps, array); v < end; ++v) {
    for (unsigned k = 0; k < 3; ++k)
      maps[k].store_number(array.type, points.code(v, k), array.bytes.data() + (size_t{3} * v + k) * size);
  }
}

struct Sections {
  Bytes side;
  Bytes raw;
  Bytes classes;
};

template <class Points>
Result<> decode_with(FanDecoder& fans, const Sections& sections, bool with_selectors, Points& points,
                     uint32_t count, std::span<const NumberMap> maps, Array& array) {
  RansDecoder side(sections.side);
  std::array<uint8_t, wide_classes> group_of{};
  for (unsigned c = 1; c < Points::classes; ++c) {
    const uint32_t step = side.code_raw(0, 1);
    group_of[c] = static_cast<uint8_t>(std::min(group_of[c - 1] + step, groups - 1));
  }
  FittedRows fitted;
  fitted.code(side);
  const StaticTables tables =
      read_tables(class_contexts, Points::classes, class_bits, most_class_tables, side);
  StaticTables selector_tables;
  if (with_selectors)
    selector_tables = read_tables(selector_contexts, selectors, selector_bits, selector_contexts, side);
  if (side.exhausted()) return corrupt("the tables end early");
  const auto rows = std::make_unique<Rows>(plain_rows());
  fitted.apply(*rows);

  const auto decoder = std::make_unique<ClassDecoder>(sections.classes, tables, selector_tables, group_of);
  RawBits raw(sections.raw);
  std::vector<Classes> classes(std::min(count, block_vertices));
  std::vector<uint8_t> kinds;
  for (uint32_t begin = 0; begin < count; begin += block_vertices) {
    const uint32_t end = std::min(count, begin + block_vertices);
    const uint32_t fan_end = std::max(begin, std::min(end, fans.vertices()));
    if (fan_end > begin) MAILLE_CHECK(fans.decode_until(fan_end));
    const uint8_t* kind = fan_end > begin ? fans.kinds(begin) : nullptr;
    if (fan_end < end) {
      kinds.assign(end - begin, start_kind);
      std::copy(kind, kind + (fan_end - begin), kinds.begin());
      kind = kinds.data();
    }
    decoder->decode(kind, end - begin, classes.data());
    if (decoder->exhausted()) return corrupt("the classes end early");
    const VertexReferences* references = fan_end > begin ? fans.references(begin) : nullptr;
    uint32_t v = begin;
    v += reconstruct_many(points, references, kind, *rows, classes.data(), raw, begin, fan_end);
    for (; v < end; ++v) {
      const VertexReferences one = v < fan_end ? references[v - begin] : references_beside(v);
      if (!reconstruct(points, one, *rows, kind[v - begin], classes[v - begin], raw, v))
        return corrupt("the raw bits end early");
    }
    store(points, begin, end, maps, array);
    if (fan_end > begin) fans.release(fan_end);
  }
  return {};
}

}  // namespace

bool fits_fan_positions(const Array& array, const ArrayMaps& maps) {
  return maps.maps.size() == 3 && !maps.octahedral && maps.exceptions.empty() && size_of(array.type) <= 4;
}

Result<> decode_fan_positions(FanDecoder& fans, Bytes bytes, uint32_t points, Array& array) {
  ByteReader in(bytes);
  const auto flags = in.get<uint8_t>();
  if (!in.ok() || flags > (flag_wide | flag_selectors)) return corrupt("coded in an unknown way");
  if (size_of(array.type) > 4) return corrupt("the type is too wide");
  std::vector<NumberMap> maps;
  for (unsigned k = 0; k < 3; ++k) maps.push_back(MAILLE_TRY(read_map(in, array.type)));
  std::array<int32_t, 3> bias{};
  const bool wide = (flags & flag_wide) != 0;
  for (unsigned k = 0; k < 3 && !wide; ++k) bias[k] = in.get<int32_t>();
  Sections sections;
  sections.side = in.get_bytes(in.get_count());
  sections.raw = in.get_bytes(in.get_count());
  sections.classes = in.get_bytes(in.remaining());
  // The states also keep a reader of raw bits from reading past the end.
  if (!in.ok() || sections.classes.size() < 8 * group_lanes) return corrupt("the stream is too short");
  // A symbol has 1/1024 bit at least, unless its table has no other.
  if (points / 16384 > bytes.size() + 16) return corrupt("there are more than the stream can hold");

  if (points < fans.vertices()) return corrupt("there are fewer than vertices");
  reserve_pages(array.bytes, size_t{points} * array.tuple_size());
  array.bytes.resize(size_t{points} * array.tuple_size());
  const bool with_selectors = (flags & flag_selectors) != 0;
  if (wide) {
    WidePoints wide_points(points);
    for (unsigned k = 0; k < 3; ++k) wide_points.curved[k] = maps[k].is_curved() ? &maps[k] : nullptr;
    return decode_with(fans, sections, with_selectors, wide_points, points, maps, array);
  }
  NarrowPoints narrow_points(points);
  narrow_points.bias = bias;
  return decode_with(fans, sections, with_selectors, narrow_points, points, maps, array);
}

}  // namespace maille
