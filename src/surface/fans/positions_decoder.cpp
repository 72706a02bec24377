// The decoder of positions of fans; its encoder is in positions_encoder.cpp.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "base/bytes.h"
#include "base/pages.h"
#include "base/result.h"
#include "entropy/lane_rans.h"
#include "entropy/rans.h"
#include "numbers/number_maps.h"
#include "numbers/refined_numbers.h"
#include "numbers/shear.h"
#include "surface/fans/position_coder.h"
#include "surface/fans/position_streams.h"
#include "surface/fans/positions.h"

namespace maille {

using namespace positions;

namespace positions {
/// The tables as the loop looks them up: by context.
struct SymbolTables {
  using Table = StaticDecoderTable<table_bits, symbols>;
  Unfilled<Table> tables;
  /// Where in `tables`, in bytes, so that the loop needs no multiplication.
  std::array<uint32_t, all_contexts> table_at{};

  /// A table whose symbols change no state, for components that are known: so the loop decodes a symbol of
  /// each component without a branch.
  void add_known() {
    table_at[known_context] = place_of(tables.size());
    tables.emplace_back().fill(0);
  }
  void add(const StaticTables& from, unsigned first) {
    const size_t base = tables.size();
    for (const Frequencies& table : from.tables) tables.emplace_back().fill(table);
    for (size_t c = 0; c < from.table_of.size(); ++c) table_at[first + c] = place_of(base + from.table_of[c]);
  }
  static uint32_t place_of(size_t table) { return static_cast<uint32_t>(table * sizeof(Table)); }
};

}  // namespace positions

/// What stands before points.
struct PositionTables {
  Coding coding;
  bool wide = false;
  std::vector<NumberMap> maps;
  RefinedMaps refined;  ///< none are where it is empty
  Shear shear;
  std::array<int64_t, most_components> bias{};
  SymbolTables tables;
};

namespace {

tl::unexpected<Error> corrupt(const char* what) {
  return failure(ErrorCode::corrupt, std::string("positions: ") + what);
}

constexpr uint32_t window = FanDecoder::window;
/// Vertices between two looks at whether the bytes end, and what they read at most: a mask of what is listed
/// and two symbols a component, and 20 bytes of raw bits a component, which are enough for an escape (72
/// bits), a field (54) or an index (16). Chosen, not swept: within a batch nothing is checked, so that the
/// copied tail is longer for larger ones.
constexpr uint32_t batch = 256;
constexpr size_t most_batch_words =
    batch * 9 * sizeof(uint16_t) + 8;  // a mask of what is listed, two symbols a component
constexpr size_t most_batch_raw = batch * most_components * 20 + 8;  // an escape of 72 bits, an index of 16

/// Bytes that are read without a look at their end. When fewer than a batch may need are left, reading goes
/// on in a copy with zeros behind it; a copy of everything would take a tenth of the time of small meshes.
class OpenBytes {
 public:
  explicit OpenBytes(Bytes bytes) : end_(bytes.data() + bytes.size()) {}

  /// Where what is at `at` is, so that `more` bytes can be read from there: the same number each time.
  const std::byte* open(const std::byte* at, size_t more) {
    const auto left = static_cast<size_t>(end_ - at);
    if (!tail_.empty() || left >= more) return at;
    tail_.resize(left + more);
    std::copy(at, end_, tail_.begin());
    end_ = tail_.data() + left;
    return tail_.data();
  }
  const std::byte* end() const { return end_; }

 private:
  const std::byte* end_;
  std::vector<std::byte> tail_;
};

class Reader {
 public:
  static constexpr bool encoding = false;

  Reader(Bytes raw, Bytes words, unsigned lanes, const SymbolTables& tables)
      : raw_(raw),
        words_(words),
        from_(raw.data()),
        rans_(words.data(), lanes),
        tables_(reinterpret_cast<const std::byte*>(tables.tables.data())),
        table_at_(tables.table_at.data()) {}

  /// Before each batch of vertices. False: the bytes ended in the one before.
  bool open_batch() {
    if (exhausted()) return false;
    from_ = raw_.open(from_ + (at_ >> 3), most_batch_raw);
    at_ &= 7;
    rans_.words = words_.open(rans_.words, most_batch_words);
    return true;
  }
  template <unsigned lane>
  [[gnu::always_inline]] unsigned symbol(uint32_t context, unsigned) {
    return rans_.get<lane>(*reinterpret_cast<const SymbolTables::Table*>(tables_ + table_at_[context]));
  }
  /// At most 57 bits.
  [[gnu::always_inline]] uint64_t raw(uint64_t, unsigned count) {
    const uint64_t bits = look();
    take(count);
    return bits & ((uint64_t{1} << count) - 1);
  }
  /// The next 57 bits, and more that are not to be used.
  [[gnu::always_inline]] uint64_t look() const { return load<uint64_t>(from_ + (at_ >> 3)) >> (at_ & 7); }
  [[gnu::always_inline]] void take(unsigned count) { at_ += count; }
  bool exhausted() const {
    return rans_.words > words_.end() || at_ > 8 * static_cast<uint64_t>(raw_.end() - from_);
  }

 private:
  OpenBytes raw_, words_;
  const std::byte* from_;  ///< raw bits begin here
  uint64_t at_ = 0;
  LaneRansDecoder rans_;
  const std::byte* tables_;  ///< of SymbolTables
  const uint32_t* table_at_;
};

/// What stands in a patch itself.
struct Beside {
  Bytes details;
  Bytes exceptions;
};

bool is_narrow(const Dictionary& dictionary) {
  const uint32_t size = dictionary.size();
  return size == 0 || (dictionary[0] >= -most_narrow_code && dictionary[size - 1] <= most_narrow_code);
}

/// What stands before points, in the order of the format (12.3). `beside` gets what belongs to one patch
/// alone; nullptr: these are tables of many. Everything is checked here, so that the loop need not: bases,
/// dictionaries of narrow codes, placements.
Result<std::shared_ptr<PositionTables>> read_head(ByteReader& in, Scalar type, unsigned components,
                                                  Beside* beside, bool placed = false) {
  auto head = std::make_shared<PositionTables>();
  head->coding.components = components;
  const auto placement = placed ? in.get<uint8_t>() : uint8_t{0};
  if (placement >= placement_count) return corrupt("coded in an unknown way");
  head->coding.placement = static_cast<Placement>(placement);
  const uint64_t flags = in.get_count();
  if (!in.ok() || !read_flags(flags, head->coding)) return corrupt("coded in an unknown way");
  head->wide = (flags & flag_wide) != 0;
  for (unsigned k = 0; k < components; ++k) head->maps.push_back(MAILLE_TRY(read_map(in, type)));
  if ((flags & flag_refined) != 0) {
    head->refined = MAILLE_TRY(read_exact_maps(in, head->maps));
    if (type != Scalar::f64 || !head->refined.any()) return corrupt("coded in an impossible way");
    if (beside != nullptr) beside->details = in.get_bytes(in.get_count());
  }
  if (beside != nullptr) beside->exceptions = in.get_bytes(in.get_count());
  if ((flags & flag_sheared) != 0) head->shear = MAILLE_TRY(Shear::read(in, components));
  for (unsigned k = 0; k < components && !head->wide; ++k) head->bias[k] = in.get_zigzag();
  Coding& coding = head->coding;
  for (unsigned k = 0; k < components; ++k) coding.base[k] = in.get<uint8_t>();
  coding.first_size = in.get<uint8_t>();
  coding.first_spread = in.get<uint8_t>();
  const unsigned most = head->wide ? most_wide_base : most_narrow_base;
  if (!in.ok() || *std::max_element(coding.base.begin(), coding.base.end()) > most)
    return corrupt("coded in an impossible way");
  const Bytes side_bytes = in.get_bytes(in.get_count());
  if (!in.ok()) return corrupt("the stream is too short");
  RansDecoder side(side_bytes);
  coding.rows.code(side);
  if (!coding.with_valences) coding.rows.forget_valences();
  for (unsigned k = 0; k < components && coding.repeats != Repeats::none; ++k) {
    // Floats of hostile entries beyond 2^20 would not fit an integer (ffdad10).
    if (!coding.dictionaries[k].code(side) || (!head->wide && !is_narrow(coding.dictionaries[k])))
      return corrupt("the dictionaries are damaged");
    if (!head->wide) coding.dictionaries[k].tabulate();
  }
  for_each_alphabet(coding, [&](const Alphabet& alphabet) {
    const StaticTables tables =
        read_tables(alphabet.contexts, alphabet.symbols, table_bits, alphabet.most_tables, side);
    head->tables.add(tables, alphabet.first);
  });
  head->tables.add_known();
  if (side.exhausted()) return corrupt("the tables end early");
  return head;
}

/// The window of vertices that are decoded together, and the points behind the vertices, which have no fans.
/// Fans are decoded only as far as the window needs them.
class Windows {
 public:
  Windows(FanDecoder& fans, std::span<const uint8_t> valences, const Coding& coding,
          const ElementPlaces& places)
      : fans_(fans), weights_(coding, valences, places) {}

  Result<> decode(uint32_t begin, uint32_t end) {
    const uint32_t fan_end = std::max(begin, std::min(end, fans_.vertices()));
    references_ = beside_.data();
    kinds_ = no_kinds_.data();
    if (fan_end > begin) {
      MAILLE_CHECK(fans_.decode_until(fan_end));
      references_ = fans_.references(begin);
      kinds_ = fans_.kinds(begin);
    }
    if (fan_end < end) add_points_beside(begin, fan_end, end);
    weights_.compute(references_, kinds_, begin, end);
    return {};
  }
  const VertexReferences* references() const { return references_; }
  const uint8_t* kinds() const { return kinds_; }
  const WindowWeights& weights() const { return weights_; }
  void release(uint32_t begin, uint32_t end) {
    const uint32_t fan_end = std::min(end, fans_.vertices());
    if (fan_end > begin) fans_.release(fan_end);
  }

 private:
  void add_points_beside(uint32_t begin, uint32_t fan_end, uint32_t end) {
    beside_.resize(end - begin);
    no_kinds_.assign(end - begin, loose_kind);
    std::copy_n(references_, fan_end - begin, beside_.begin());
    std::copy_n(kinds_, fan_end - begin, no_kinds_.begin());
    for (uint32_t v = fan_end; v < end; ++v) beside_[v - begin] = references_beside(v);
    references_ = beside_.data();
    kinds_ = no_kinds_.data();
  }

  FanDecoder& fans_;
  WindowWeights weights_;
  std::vector<VertexReferences> beside_;
  std::vector<uint8_t> no_kinds_;
  const VertexReferences* references_ = nullptr;
  const uint8_t* kinds_ = nullptr;
};

template <unsigned n>
int64_t code_of(const FloatPoints<n>& points, const PositionTables& head, uint32_t v, unsigned k) {
  return head.bias[k] + points.code(v, k);
}
template <unsigned n>
int64_t code_of(const DoublePoints<n>& points, const PositionTables&, uint32_t v, unsigned k) {
  return points.code(v, k);
}
/// Numbers that points have anyway, without a way through their codes (an eighth of the time of dragon's
/// decimals). False: there are none.
template <unsigned n>
bool store_coordinates(const FloatPoints<n>&, unsigned, uint32_t, uint32_t, Array&) {
  return false;
}
template <unsigned n>
bool store_coordinates(const DoublePoints<n>& points, unsigned k, uint32_t begin, uint32_t end,
                       Array& array) {
  if (!points.has_numbers[k]) return false;
  for (uint32_t v = begin; v < end; ++v) {
    const double number = points.coordinate(points.points[v], k);
    const int64_t code = points.code(v, k);
    // Numbers that coordinates were clamped for, and codes that are cut to 32 bits, are those of no file that
    // an encoder writes.
    if (std::fabs(number) >= points.most_number || code != static_cast<int32_t>(code)) return false;
    maille::store(array.bytes.data() + (size_t{n} * v + k) * sizeof(float), static_cast<float>(number));
  }
  return true;
}

bool is_plain_lattice(const NumberMap& map) {
  return map.kind == NumberMap::Kind::lattice && map.factor == 0 && map.table.empty();
}

/// Numbers of plain lattices, as NumberMap::store_numbers() finds them, but without codes in between. False:
/// they are others.
template <unsigned n>
bool store_lattice(const FloatPoints<n>& points, const PositionTables& head, uint32_t begin, uint32_t end,
                   Array& array) {
  constexpr int64_t most_bias = 1 << 30;  // so that no code needs more than 32 bits
  constexpr double largest = std::numeric_limits<float>::max();
  std::array<double, n> bias, origin, step;
  for (unsigned k = 0; k < n; ++k) {
    const NumberMap& map = head.maps[k];
    if (!is_plain_lattice(map) || head.bias[k] > most_bias || head.bias[k] < -most_bias) return false;
    bias[k] = static_cast<double>(head.bias[k]);
    origin[k] = map.origin;
    step[k] = map.step;
  }
  std::byte* out = array.bytes.data() + size_t{n} * begin * sizeof(float);
  for (uint32_t v = begin; v < end; ++v) {
    for_each_component<n>([&](auto k) {
      const double code = bias[k] + double{points.points[v].v[unsigned{k}]};
      const double number = origin[k] + code * step[k];
      // Of std::clamp() gcc 12 makes branches.
      const double above = -largest > number ? -largest : number;
      maille::store(out, static_cast<float>(largest < above ? largest : above));
      out += sizeof(float);
    });
  }
  return true;
}
template <unsigned n>
bool store_lattice(const DoublePoints<n>&, const PositionTables&, uint32_t, uint32_t, Array&) {
  return false;
}

template <class Code, class Points>
void store_codes(const Points& points, const PositionTables& head, uint32_t begin, uint32_t end,
                 Array& array) {
  constexpr size_t n = Points::components;
  // A window at a time, on the stack: the codes of all points would be as much memory again.
  std::array<Code, n * window> codes;
  for (uint32_t v = begin; v < end; ++v) {
    for (unsigned k = 0; k < n; ++k)
      codes[n * (v - begin) + k] = static_cast<Code>(code_of(points, head, v, k));
  }
  for (uint32_t v = begin; v < end && head.shear.any(); ++v) head.shear.undo(codes.data() + n * (v - begin));
  const size_t size = size_of(array.type);
  for (unsigned k = 0; k < n; ++k) {
    if (!head.shear.any() && store_coordinates(points, k, begin, end, array)) continue;
    head.maps[k].store_numbers(array.type, reinterpret_cast<const std::byte*>(codes.data() + k),
                               array.bytes.data() + (n * begin + k) * size, n, end - begin);
  }
}
template <class Points>
void store_window(const Points& points, const PositionTables& head, uint32_t begin, uint32_t end,
                  Array& array) {
  if (array.type == Scalar::f32 && !head.shear.any() && store_lattice(points, head, begin, end, array))
    return;
  if (size_of(array.type) == 8) return store_codes<int64_t>(points, head, begin, end, array);
  store_codes<int32_t>(points, head, begin, end, array);
}

/// The numbers of refined components, whose details can be decoded only once all codes are known.
template <class Points>
Result<> store_details(const Points& points, const PositionTables& head, Bytes details, uint32_t count,
                       Array& array) {
  constexpr size_t n = Points::components;
  std::vector<int64_t> codes(n * count);
  for (uint32_t v = 0; v < count; ++v) {
    for (unsigned k = 0; k < n; ++k) codes[n * v + k] = code_of(points, head, v, k);
    head.shear.undo(codes.data() + n * v);
  }
  MAILLE_CHECK(store_refined(head.refined, details, codes));
  for (size_t i = 0; i < codes.size(); ++i) {
    if (head.refined.refined[i % n]) maille::store(array.bytes.data() + 8 * i, codes[i]);
  }
  return {};
}

template <Repeats repeats, class Points>
Result<> decode_points(Windows& windows, Reader reader, const PositionTables& head, const Beside& beside,
                       Points there, uint32_t count, Array& array) {
  constexpr bool repeating = repeats != Repeats::none;
  KnownPoints<Points> known{std::move(there), {}};
  const size_t room = size_t{count} + FanDecoder::most_ahead;
  if (repeating) known.repeats.reserve(room);
  Points& points = known.points;
  points.reserve(room);
  PositionCoder<Reader, Points, repeats> coder(head.coding, known);
  for (uint32_t begin = 0; begin < count; begin += window) {
    const uint32_t end = std::min(count, begin + window);
    points.grow(size_t{end} + FanDecoder::most_ahead);
    if (repeating) known.repeats.resize(size_t{end} + FanDecoder::most_ahead);
    MAILLE_CHECK(windows.decode(begin, end));
    const VertexReferences* const references = windows.references();
    const uint8_t* const kinds = windows.kinds();
    const WindowWeights& weights = windows.weights();
    for (uint32_t v = begin; v < end;) {
      if (!reader.open_batch()) return corrupt("the stream ends early");
      for (const uint32_t batch_end = std::min(end, v + batch); v < batch_end; ++v)
        coder.code(reader, v, references[v - begin], kinds[v - begin], weights[v - begin],
                   weights.turned(v - begin), {});
    }
    if (reader.exhausted()) return corrupt("the stream ends early");
    // Memory grows with what was decoded, window by window.
    array.bytes.resize(end * array.tuple_size());
    store_window(points, head, begin, end, array);
    windows.release(begin, end);
  }
  if (head.refined.any()) MAILLE_CHECK(store_details(points, head, beside.details, count, array));
  return read_exceptions(beside.exceptions, array);
}

Result<> decode_with(FanDecoder& fans, ByteReader& in, const PositionTables& head, const Beside& beside,
                     const ElementPlaces& places, uint32_t points, Array& array) {
  const size_t size = in.remaining();
  const Bytes raw = in.get_bytes(in.get_count());
  const Bytes words = in.get_bytes(in.remaining());
  const unsigned lanes = lanes_of(head.coding);
  if (!in.ok() || words.size() < lane_state_bytes * lanes) return corrupt("the stream is too short");
  // Before anything is reserved: writers fill short streams up.
  if (!can_hold(size, points)) return corrupt("there are more than the stream can hold");
  if (points < fans.vertices()) return corrupt("there are fewer than vertices");
  // Rather than once for valences and once more beside positions, as memory is cheaper: 10 % of all time.
  if (head.coding.with_valences) MAILLE_CHECK(fans.decode_all());
  const std::span<const uint8_t> valences = fans.known_valences();
  if (head.coding.with_valences && valences.size() < fans.vertices()) return corrupt("valences are missing");
  Reader reader(raw, words, lanes, head.tables);
  Windows windows(fans, valences, head.coding, places);
  reserve_pages(array.bytes, size_t{points} * array.tuple_size());
  const auto decode = [&](auto there) {
    return with_repeats(head.coding.repeats, [&](auto repeats) {
      return decode_points<repeats>(windows, std::move(reader), head, beside, std::move(there), points,
                                    array);
    });
  };
  return with_components(head.coding.components, [&](auto n) {
    return head.wide ? decode(wide_points<n>(head.maps, array.type)) : decode(FloatPoints<n>());
  });
}

}  // namespace

Result<> read_exceptions(Bytes bytes, Array& array) {
  const size_t size = size_of(array.type);
  ByteReader in(bytes);
  uint64_t place = 0;
  const uint64_t count = in.get_count();
  for (uint64_t i = 0; i < count && in.ok(); ++i) {
    const uint64_t gap = in.get_count();
    const Bytes number = in.get_bytes(size);
    if (!in.ok() || (i > 0 && gap == 0) || gap >= array.bytes.size() / size - place)
      return corrupt("a damaged list of exceptions");
    place += gap;
    std::copy(number.begin(), number.end(), array.bytes.begin() + static_cast<ptrdiff_t>(place * size));
  }
  if (!in.ok() || in.remaining() > 0) return corrupt("a damaged list of exceptions");
  return {};
}

bool fits_positions(const Array& array, const ArrayMaps& maps) {
  return !maps.maps.empty() && maps.maps.size() <= most_components && !maps.octahedral &&
         array.domain == Domain::point;
}

Result<> decode_positions(FanDecoder& fans, Bytes bytes, uint32_t points, Array& array) {
  ByteReader in(bytes);
  Beside beside;
  const auto head = MAILLE_TRY(read_head(in, array.type, array.components, &beside));
  return decode_with(fans, in, *head, beside, {}, points, array);
}

Result<> decode_numbers(FanDecoder& around, Bytes bytes, const ElementPlaces& places, uint32_t elements,
                        Array& array) {
  ByteReader in(bytes);
  Beside beside;
  const auto head = MAILLE_TRY(read_head(in, array.type, array.components, &beside, true));
  const Placement placement = head->coding.placement;
  if (placement != Placement::none && places.positions.empty()) return corrupt("there are no places");
  if (placement > Placement::hinge) {
    if (array.components == 2) head->coding.turn_ratio = turn_ratio(head->maps, array.type);
    if (array.components != 2 || head->coding.turn_ratio == 0) return corrupt("coded in an impossible way");
  }
  return decode_with(around, in, *head, beside, places, elements, array);
}

Result<std::shared_ptr<const PositionTables>> read_position_tables(Bytes bytes, Scalar type) {
  ByteReader in(bytes);
  auto head = MAILLE_TRY(read_head(in, type, 3, nullptr));
  if (in.remaining() > 0) return corrupt("something behind the tables");
  return std::shared_ptr<const PositionTables>(std::move(head));
}

bool are_of_polygons(const PositionTables& tables) {
  return tables.coding.rows.polygons;
}

Result<> decode_shared_positions(FanDecoder& fans, Bytes bytes, const PositionTables& tables, uint32_t points,
                                 Array& array) {
  ByteReader in(bytes);
  Beside beside;
  if (tables.refined.any()) beside.details = in.get_bytes(in.get_count());
  beside.exceptions = in.get_bytes(in.get_count());
  return decode_with(fans, in, tables, beside, {}, points, array);
}

}  // namespace maille
