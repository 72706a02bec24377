// The decoder of the positions of fans; its encoder is in fan_position_encoder.cpp.
#include "surface/fans/fan_positions.h"

#include <algorithm>
#include <array>
#include <memory>
#include <string>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include "base/bytes.h"
#include "base/cold.h"
#include "base/pages.h"
#include "base/result.h"
#include "base/unfilled.h"
#include "entropy/static_rans.h"
#include "numbers/number_maps.h"
#include "surface/fans/fan_position_model.h"

namespace maille {

using namespace fan_positions;

namespace {

tl::unexpected<Error> corrupt(const char* what) {
  return failure(ErrorCode::corrupt, std::string("positions: ") + what);
}

/// What comes before the raw bits of a vertex: the shape (6 bits), the size above it, the selector from
/// bit 16.
using Classes = uint32_t;
constexpr unsigned size_in(Classes classes) {
  return classes >> 6 & 63;
}
constexpr unsigned shape_in(Classes classes) {
  return classes & 63;
}

/// What the contexts of a vertex take from its kind: looked up, as kinds come without order, and branches on
/// them would be guessed wrong.
struct KindContexts {
  uint8_t selector, quality;
};
constexpr auto contexts_of_kind = [] {
  std::array<KindContexts, vertex_kinds> table{};
  for (unsigned kind = 0; kind < vertex_kinds; ++kind)
    table[kind] = {static_cast<uint8_t>(selector_context(0, kind)), quality_of_kind[kind]};
  return table;
}();

/// The tables of some symbols, and by context the one it uses.
template <size_t contexts, unsigned bits, unsigned symbols>
class ContextTables {
 public:
  using Table = StaticDecoderTable<bits, symbols>;
  explicit ContextTables(const StaticTables& from) : tables_(from.tables.size()) {
    for (size_t i = 0; i < from.tables.size(); ++i) tables_[i].fill(from.tables[i]);
    for (size_t c = 0; c < from.table_of.size(); ++c) of[c] = &tables_[from.table_of[c]];
  }
  // The vector keeps its memory.
  ContextTables(ContextTables&&) = default;
  bool any() const { return !tables_.empty(); }
  std::array<const Table*, contexts> of{};

 private:
  Unfilled<Table> tables_;
};

struct ClassTables {
  ContextTables<size_context(wide_sizes, 0), class_bits, wide_sizes> of_size;
  ContextTables<shape_context(wide_sizes, 0), class_bits, shapes> of_shape;
  ContextTables<selector_contexts, selector_bits, selectors> of_selector;  ///< none: all have the fitted one
};

/// Selectors and classes of one block after the other.
class ClassDecoder {
 public:
  ClassDecoder(Bytes bytes, const ClassTables& tables)
      : words_(bytes.data()), end_(bytes.data() + bytes.size()), tables_(tables) {
    for (Lane& lane : lanes_) {
      lane.state = load<uint64_t>(words_);
      words_ += 8;
    }
  }

  void decode(const uint8_t* kinds, uint32_t count, Classes* classes) {
    if (tables_.of_selector.any()) {
      decode_block<true>(kinds, count, classes);
    } else {
      decode_block<false>(kinds, count, classes);
    }
  }
  bool exhausted() const { return exhausted_; }
  /// When all blocks are decoded.
  std::array<std::byte, group_payload_bytes> payload() const {
    return payload_of({lanes_[0].state, lanes_[1].state, lanes_[2].state, lanes_[3].state});
  }

 private:
  struct Lane {
    uint64_t state = 0;
    uint32_t size = 0;  ///< of the vertex before, times the number of qualities
    uint32_t zeros = 0;
    uint32_t selector = 0;  ///< times 4
  };

  template <bool with_selectors>
  [[gnu::always_inline]] static void decode_group(const ClassTables& tables, Lane& lane, unsigned kind,
                                                  Classes& out) {
    uint64_t x = lane.state;
    uint32_t selector = fitted_selector;
    const KindContexts contexts = contexts_of_kind[kind];
    if constexpr (with_selectors) {
      const auto& table = *tables.of_selector.of[lane.selector + contexts.selector];
      selector = table.symbol(x);
      x = table.next(x, selector);
      lane.selector = selector * 4;
    }
    const auto& size_table = *tables.of_size.of[lane.size + contexts.quality];
    const uint32_t size = size_table.symbol(x);
    x = size_table.next(x, size);
    lane.size = size_context(size, 0);
    const auto& shape_table = *tables.of_shape.of[shape_context(size, lane.zeros)];
    const uint32_t shape = shape_table.symbol(x);
    lane.state = shape_table.next(x, shape);
    lane.zeros = zeros_of_shape[shape];
    out = shape | size << 6 | selector << 16;
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
    const ClassTables& tables = tables_;
    std::array<Lane, group_lanes> lanes = lanes_;
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
        decode_group<with_selectors>(tables, a, kinds[i], classes[i]);
        decode_group<with_selectors>(tables, b, kinds[share + i], classes[share + i]);
        decode_group<with_selectors>(tables, c, kinds[2 * share + i], classes[2 * share + i]);
        decode_group<with_selectors>(tables, d, kinds[3 * share + i], classes[3 * share + i]);
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
        decode_group<with_selectors>(tables, lanes[l], kinds[v], classes[v]);
        while (lanes[l].state < lowest_group_state) refill_slowly(lanes[l]);
      }
    }
    lanes_ = lanes;
  }

  const std::byte* words_;
  const std::byte* end_;
  bool exhausted_ = false;
  std::array<Lane, group_lanes> lanes_;
  const ClassTables& tables_;
};

/// Raw bits of residuals, lowest first. Eight bytes behind the last must be readable.
class RawBits {
 public:
  explicit RawBits(Bytes bytes) : bytes_(bytes.data()), end_(uint64_t{bytes.size()} * 8) {}

  /// The next 57 bits or more.
  [[gnu::always_inline]] uint64_t peek() const { return load<uint64_t>(bytes_ + (at_ >> 3)) >> (at_ & 7); }
  [[gnu::always_inline]] void skip(unsigned count) { at_ += count; }
  uint64_t left() const { return end_ - at_; }
  bool has(uint64_t count) const { return count <= left(); }

 private:
  const std::byte* bytes_;
  uint64_t end_;
  uint64_t at_ = 0;
};

template <class Points>
bool reconstruct(Points& points, const VertexReferences& references, const Rows& rows, unsigned kind,
                 Classes classes, RawBits& raw, uint32_t v) {
  const Row& row = rows[kind * selectors + (classes >> 16)];
  typename Points::Codes residuals;
  for (unsigned k = 0; k < 3; ++k) {
    const Field field = field_of(size_in(classes), step_in(steps_of_shape[shape_in(classes)], k));
    if (!raw.has(field.bits)) return false;
    residuals[k] = residual_of(raw.peek() & ((uint64_t{1} << field.bits) - 1), field);
    raw.skip(field.bits);
  }
  points.reconstruct(v, points.predict(references, row), residuals);
  return true;
}

#ifdef __SSE2__
/// The fields of a size and shape, side by side in lanes of 16 bits.
struct alignas(32) PackedFields {
  std::array<uint16_t, 4> mask;
  std::array<uint16_t, 4> half;
  std::array<uint16_t, 4> back;
  uint8_t shift_y, shift_z, bits;
};
MAILLE_TABLE packed_fields = [] {
  MAILLE_LATER;
  std::array<PackedFields, narrow_sizes * 64> table{};
  for (unsigned size = 0; size < narrow_sizes; ++size) {
    for (unsigned shape = 0; shape < shapes; ++shape) {
      PackedFields& packed = table[size * 64 + shape];
      unsigned bits = 0;
      for (unsigned k = 0; k < 3; ++k) {
        const Field field = field_of(size, step_in(steps_of_shape[shape], k));
        packed.mask[k] = static_cast<uint16_t>((1u << field.bits) - 1);
        packed.half[k] = static_cast<uint16_t>(field.half);
        packed.back[k] = static_cast<uint16_t>(field.back);
        if (k == 1) packed.shift_y = static_cast<uint8_t>(bits);
        if (k == 2) packed.shift_z = static_cast<uint8_t>(bits);
        bits += field.bits;
      }
      packed.bits = static_cast<uint8_t>(bits);
    }
  }
  return table;
}();
#endif

#ifdef __SSE2__
constexpr uint64_t most_vertex_bits = 48;
/// The same for many vertices with 16-bit codes. Returns how many were done: it stops near the end of the raw
/// bits.
template <bool with_late>
uint32_t reconstruct_many(NarrowPoints& points, const VertexReferences* reference, const uint8_t* kinds,
                          const Rows& rows, const Classes* classes, RawBits& raw, uint32_t begin,
                          uint32_t end) {
  auto* const out = points.points.data();
  const auto at = [out](uint32_t v) { return _mm_loadl_epi64(reinterpret_cast<const __m128i*>(out + v)); };
  const __m128i half = _mm_set1_epi32(weight_sum / 2);
  RawBits bits = raw;
  uint32_t v = begin;
  // As many as there are bits for in any case, then again.
  for (uint32_t stop = v; v < end; ++v) {
    if (v == stop) {
      stop = static_cast<uint32_t>(std::min<uint64_t>(end, v + bits.left() / most_vertex_bits));
      if (v == stop) break;
    }
    const Classes c = classes[v - begin];
    const VertexReferences& references = reference[v - begin];
    const Row& row = rows[kinds[v - begin] * size_t{selectors} + (c >> 16)];
    const __m128i weights = _mm_load_si128(reinterpret_cast<const __m128i*>(row.data()));
    const auto pair = [&](unsigned k) {
      return _mm_unpacklo_epi16(at(references.at[k]), at(references.at[k + 1]));
    };
    __m128i sum = _mm_madd_epi16(pair(0), _mm_shuffle_epi32(weights, 0x00));
    sum = _mm_add_epi32(sum, _mm_madd_epi16(pair(2), _mm_shuffle_epi32(weights, 0x55)));
    if constexpr (with_late)
      sum = _mm_add_epi32(sum, _mm_madd_epi16(pair(4), _mm_shuffle_epi32(weights, 0xaa)));
    sum = _mm_add_epi32(sum, half);
    sum = _mm_add_epi32(sum, _mm_madd_epi16(pair(6), _mm_shuffle_epi32(weights, 0xff)));
    sum = _mm_srai_epi32(sum, weight_bits);
    const PackedFields& fields = packed_fields[c & 0xffff];
    const auto field = [](const std::array<uint16_t, 4>& of) {
      return _mm_loadl_epi64(reinterpret_cast<const __m128i*>(of.data()));
    };
    const auto word = [](uint64_t number) { return _mm_cvtsi64_si128(static_cast<int64_t>(number)); };
    const uint64_t raw_word = bits.peek();
    bits.skip(fields.bits);
    const __m128i xy = _mm_unpacklo_epi16(word(raw_word), word(raw_word >> fields.shift_y));
    __m128i residuals = _mm_unpacklo_epi32(xy, word(raw_word >> fields.shift_z));
    residuals = _mm_and_si128(residuals, field(fields.mask));
    const __m128i low = _mm_cmpeq_epi16(_mm_and_si128(residuals, field(fields.half)), _mm_setzero_si128());
    residuals = _mm_sub_epi16(residuals, _mm_and_si128(low, field(fields.back)));
    const __m128i result = _mm_add_epi16(_mm_packs_epi32(sum, sum), residuals);
    _mm_storel_epi64(reinterpret_cast<__m128i*>(out + v), result);
  }
  raw = bits;
  return v - begin;
}
#else
template <bool>
uint32_t reconstruct_many(NarrowPoints&, const VertexReferences*, const uint8_t*, const Rows&, const Classes*,
                          RawBits&, uint32_t, uint32_t) {
  return 0;
}
#endif
template <bool>
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
inline __m128i* next_tuple(__m128i* at) {
  return reinterpret_cast<__m128i*>(reinterpret_cast<std::byte*>(at) + 12);
}
/// Has no code a number beyond the finite ones?
bool lattice_fits(const NarrowPoints& points, std::span<const NumberMap> maps) {
  const auto fits = [&](unsigned k) {
    const double code = std::abs(static_cast<double>(points.bias[k])) + 32768;
    return std::abs(maps[k].origin) + std::abs(maps[k].step) * code < most_f32;
  };
  return fits(0) && fits(1) && fits(2);
}
template <bool clamped>
uint32_t store_lattice(const NarrowPoints& points, __m128i bias, uint32_t begin, uint32_t end,
                       std::span<const NumberMap> maps, __m128i* out) {
  const __m128d origin = _mm_set_pd(maps[1].origin, maps[0].origin),
                step = _mm_set_pd(maps[1].step, maps[0].step);
  const __m128d origin_z = _mm_set1_pd(maps[2].origin), step_z = _mm_set1_pd(maps[2].step);
  const auto rounded = [](__m128d value) {
    if constexpr (clamped) {
      // With the limit in front NaN stays, as in std::clamp().
      value = _mm_max_pd(_mm_set1_pd(-most_f32), value);
      value = _mm_min_pd(_mm_set1_pd(most_f32), value);
    }
#ifdef __EMSCRIPTEN__
    // Which its clang makes of the intrinsic lane by lane.
    __m128 result;
    asm("local.get %1\n f32x4.demote_zero_f64x2\n local.set %0" : "=r"(result) : "r"(value));
    return result;
#else
    return _mm_cvtpd_ps(value);
#endif
  };
  for (uint32_t v = begin; v + 1 < end; ++v, out = next_tuple(out)) {
    const __m128i codes = codes_of(points, bias, v);
    const __m128 xy = rounded(_mm_add_pd(origin, _mm_mul_pd(_mm_cvtepi32_pd(codes), step)));
    const __m128i upper = _mm_shuffle_epi32(codes, 0xee);
    const __m128 z = rounded(_mm_add_pd(origin_z, _mm_mul_pd(_mm_cvtepi32_pd(upper), step_z)));
    _mm_storeu_si128(out, _mm_castps_si128(_mm_movelh_ps(xy, z)));
  }
  return end - begin - 1;
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
  if (all(NumberMap::Kind::integer) && size_of(array.type) == 4) {
    for (uint32_t v = begin; v + 1 < end; ++v, out = next_tuple(out))
      _mm_storeu_si128(out, codes_of(points, bias, v));
    return end - begin - 1;
  }
  if (all(NumberMap::Kind::lattice) && array.type == Scalar::f32) {
    if (lattice_fits(points, maps)) return store_lattice<false>(points, bias, begin, end, maps, out);
    return store_lattice<true>(points, bias, begin, end, maps, out);
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

/// What stands in a patch itself.
struct Sections {
  Bytes raw;
  Bytes classes;
  size_t in_states = 0;  ///< bytes of raw bits that stand in the states of the classes, the last ones
};

MAILLE_COLD Result<Sections> read_sections(ByteReader& in, uint32_t points, bool in_states) {
  Sections sections;
  const size_t size = in.remaining();
  if (in_states) {
    const uint64_t count = in.get_count();
    if (count > group_payload_bytes) return corrupt("more raw bits in the states than they hold");
    sections.in_states = static_cast<size_t>(count);
  }
  sections.raw = in.get_bytes(in.get_count());
  sections.classes = in.get_bytes(in.remaining());
  // The states also keep a reader of raw bits from reading past the end.
  if (!in.ok() || sections.classes.size() < 8 * group_lanes) return corrupt("the stream is too short");
  if (!can_hold(size, points)) return corrupt("there are more than the stream can hold");
  return sections;
}

MAILLE_COLD Result<ClassTables> read_class_tables(RansDecoder& side, unsigned sizes, uint8_t flags) {
  const StaticTables of_size = read_tables(size_context(sizes, 0), sizes, class_bits, most_size_tables, side);
  const StaticTables of_shape =
      read_tables(shape_context(sizes, 0), shapes, class_bits, most_shape_tables, side);
  StaticTables of_selector;
  if ((flags & flag_selectors) != 0)
    of_selector = read_tables(selector_contexts, selectors, selector_bits, selector_contexts, side);
  if (side.exhausted()) return corrupt("the tables end early");
  return ClassTables{decltype(ClassTables::of_size)(of_size), decltype(ClassTables::of_shape)(of_shape),
                     decltype(ClassTables::of_selector)(of_selector)};
}

struct HeadOfPositions {
  uint8_t flags;
  std::vector<NumberMap> maps;
  std::array<int32_t, 3> bias;
  std::unique_ptr<const Rows> rows;
  ClassTables classes;

  bool is_wide() const { return (flags & flag_wide) != 0; }
};

MAILLE_COLD Result<std::shared_ptr<const HeadOfPositions>> read_tables_of(ByteReader& in, Scalar type) {
  const auto flags = in.get<uint8_t>();
  if (!in.ok() || flags > (flag_wide | flag_selectors | flag_late)) return corrupt("coded in an unknown way");
  if (size_of(type) > 4) return corrupt("the type is too wide");
  std::vector<NumberMap> maps;
  for (unsigned k = 0; k < 3; ++k) maps.push_back(MAILLE_TRY(read_map(in, type)));
  std::array<int32_t, 3> bias{};
  const bool wide = (flags & flag_wide) != 0;
  for (unsigned k = 0; k < 3 && !wide; ++k) bias[k] = in.get<int32_t>();
  const Bytes side_bytes = in.get_bytes(in.get_count());
  if (!in.ok()) return corrupt("the stream is too short");
  RansDecoder side(side_bytes);
  FittedRows fitted;
  fitted.code(side);
  ClassTables classes = MAILLE_TRY(read_class_tables(side, wide ? wide_sizes : narrow_sizes, flags));
  auto rows = std::make_unique<Rows>(plain_rows());
  fitted.apply(*rows);
  return std::make_shared<const HeadOfPositions>(
      HeadOfPositions{flags, std::move(maps), bias, std::move(rows), std::move(classes)});
}

template <class Points>
Result<> decode_with(FanDecoder& fans, const Sections& sections, const HeadOfPositions& tables,
                     Points& points, uint32_t count, Array& array) {
  const uint8_t flags = tables.flags;
  const Rows* const rows = tables.rows.get();
  const std::span<const NumberMap> maps = tables.maps;
  const bool with_late = (flags & flag_late) != 0;
  if (!with_late) fans.leave_late_out();
  const auto decoder = std::make_unique<ClassDecoder>(sections.classes, tables.classes);
  std::vector<std::byte> whole_raw;
  if (sections.in_states > 0) {
    whole_raw.reserve(sections.raw.size() + sections.in_states + sizeof(uint64_t));
    whole_raw.assign(sections.raw.begin(), sections.raw.end());
    // Read from in words of 64 bits.
    whole_raw.resize(sections.raw.size() + sections.in_states + sizeof(uint64_t));
  }
  RawBits raw(sections.in_states > 0 ? Bytes(whole_raw).first(whole_raw.size() - sizeof(uint64_t))
                                     : sections.raw);
  std::vector<Classes> classes(std::min(count, block_vertices));
  std::vector<uint8_t> kinds;
  for (uint32_t begin = 0; begin < count; begin += block_vertices) {
    const uint32_t end = std::min(count, begin + block_vertices);
    const uint32_t fan_end = std::max(begin, std::min(end, fans.vertices()));
    points.grow(size_t{end} + FanDecoder::most_ahead);
    array.bytes.resize(end * array.tuple_size());
    if (fan_end > begin) MAILLE_CHECK(fans.decode_until(fan_end));
    const uint8_t* kind = fan_end > begin ? fans.kinds(begin) : nullptr;
    if (fan_end < end) {
      kinds.assign(end - begin, start_kind);
      std::copy(kind, kind + (fan_end - begin), kinds.begin());
      kind = kinds.data();
    }
    decoder->decode(kind, end - begin, classes.data());
    if (decoder->exhausted()) return corrupt("the classes end early");
    if (end == count && sections.in_states > 0)
      std::copy_n(decoder->payload().begin(), sections.in_states,
                  whole_raw.begin() + static_cast<ptrdiff_t>(sections.raw.size()));
    const VertexReferences* references = fan_end > begin ? fans.references(begin) : nullptr;
    uint32_t v = begin;
    v += with_late
             ? reconstruct_many<true>(points, references, kind, *rows, classes.data(), raw, begin, fan_end)
             : reconstruct_many<false>(points, references, kind, *rows, classes.data(), raw, begin, fan_end);
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

Result<> decode_sections(FanDecoder& fans, const Sections& sections, const HeadOfPositions& tables,
                         const std::array<int32_t, 3>& bias, uint32_t points, Array& array) {
  if (points < fans.vertices()) return corrupt("there are fewer than vertices");
  reserve_pages(array.bytes, size_t{points} * array.tuple_size());
  if (tables.is_wide()) {
    WidePoints wide_points(points);
    for (unsigned k = 0; k < 3; ++k)
      wide_points.curved[k] = tables.maps[k].is_curved() ? &tables.maps[k] : nullptr;
    return decode_with(fans, sections, tables, wide_points, points, array);
  }
  NarrowPoints narrow_points(points);
  narrow_points.bias = bias;
  return decode_with(fans, sections, tables, narrow_points, points, array);
}

}  // namespace

bool fits_fan_positions(const Array& array, const ArrayMaps& maps) {
  return maps.maps.size() == 3 && !maps.octahedral && maps.exceptions.empty() && size_of(array.type) <= 4;
}

Result<> decode_fan_positions(FanDecoder& fans, Bytes bytes, uint32_t points, Array& array) {
  ByteReader in(bytes);
  const auto tables = MAILLE_TRY(read_tables_of(in, array.type));
  const Sections sections = MAILLE_TRY(read_sections(in, points, false));
  return decode_sections(fans, sections, *tables, tables->bias, points, array);
}

}  // namespace maille
