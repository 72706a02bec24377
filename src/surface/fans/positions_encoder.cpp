// The encoder of positions of fans; its decoder is in positions_decoder.cpp.
#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>

#include "base/bytes.h"
#include "code/efforts.h"
#include "entropy/lane_rans.h"
#include "entropy/rans.h"
#include "numbers/number_maps.h"
#include "numbers/refined_numbers.h"
#include "surface/fans/position_coder.h"
#include "surface/fans/position_streams.h"
#include "surface/fans/positions.h"
#include "surface/patch_topology.h"

namespace maille {

using namespace positions;

namespace {

/// Tuples of codes, one behind the other.
struct Codes {
  unsigned components = 3;
  std::vector<int64_t> numbers;

  Codes() = default;
  Codes(unsigned n, size_t tuples) : components(n), numbers(n * tuples) {}
  size_t size() const { return numbers.size() / components; }
  int64_t* operator[](size_t tuple) { return numbers.data() + tuple * components; }
  const int64_t* operator[](size_t tuple) const { return numbers.data() + tuple * components; }
};
using Bias = std::array<int64_t, most_components>;

/// Of residuals.
struct Statistics {
  std::array<std::array<uint32_t, 66>, most_components> lengths{};  ///< by component
  std::array<uint32_t, 128> octaves{};                              ///< of how far predictions lie apart
};

/// Remembers symbols and raw bits: tables are made when all are known.
class Writer {
 public:
  static constexpr bool encoding = true;

  /// `tables`: none yet: all symbols are possible.
  explicit Writer(const std::vector<StaticTables>* tables = nullptr, Statistics* statistics = nullptr)
      : tables_(tables), statistics_(statistics) {}

  struct Event {
    uint16_t context;
    uint8_t symbol, lane;
  };

  template <unsigned lane>
  unsigned symbol(uint32_t context, unsigned symbol) {
    events.push_back({static_cast<uint16_t>(context), static_cast<uint8_t>(symbol), lane});
    return symbol;
  }
  uint64_t raw(uint64_t value, unsigned count) {
    raw_bits += count;
    waiting_ |= value << waiting_bits_;
    const unsigned room = 64 - waiting_bits_;
    if (count < room) {
      waiting_bits_ += count;
      return value;
    }
    bytes_.put(waiting_);
    waiting_ = room < 64 ? value >> room : 0;
    waiting_bits_ = count - room;
    return value;
  }
  bool is_possible(uint32_t context, unsigned symbol) const {
    return tables_ == nullptr || (*tables_)[0].of(context).frequency[symbol] != 0;
  }

  void note(unsigned k, uint64_t magnitude, int octave) {
    if (statistics_ == nullptr) return;
    ++statistics_->lengths[k][bit_length(magnitude)];
    ++statistics_->octaves[static_cast<size_t>(std::clamp(octave, 0, 127))];
  }

  std::vector<std::byte> take_raw() {
    for (; waiting_bits_ > 0; waiting_bits_ -= std::min(waiting_bits_, 8u), waiting_ >>= 8)
      bytes_.put(static_cast<uint8_t>(waiting_));
    return bytes_.take();
  }
  std::vector<Event> events;
  uint64_t raw_bits = 0;

 private:
  const std::vector<StaticTables>* tables_;
  Statistics* statistics_;
  ByteWriter bytes_;
  uint64_t waiting_ = 0;
  unsigned waiting_bits_ = 0;
};

/// One patch while its positions are coded.
struct Patch {
  const FanSurface* fans;
  Codes codes;
  std::optional<ElementPlaces> places = {};  ///< not of positions
};

constexpr uint32_t window = FanDecoder::window;

/// Points of a patch through the coder: all of them, or a sample for a trial.
class Runs {
 public:
  virtual ~Runs() = default;
  virtual void all(const Coding& coding, Writer& writer) = 0;
  /// Those that choices are made by, in pieces that are evenly spread. Returns how many there were.
  virtual uint32_t sample(const Coding& coding, Writer& writer) = 0;
};

template <class Points>
class RunsOf final : public Runs {
 public:
  RunsOf(const Patch& patch, const Bias& bias, Points points) : patch_(patch), bias_(bias) {
    known_.points = std::move(points);
  }

  void all(const Coding& coding, Writer& writer) override {
    // As the decoder begins: what is not known yet is 0.
    known_.points.clear();
    known_.points.grow(room());
    known_.sizes.assign(room(), 0);
    known_.repeats.assign(coding.repeats == Repeats::none ? 0 : room(), {});
    points_are_known_ = false;
    run(coding, writer, [&](auto code) { code(0, count()); });
  }

  uint32_t sample(const Coding& coding, Writer& writer) override {
    know_points();
    known_.resize(room(), coding.repeats != Repeats::none);
    if (count() <= pieces * piece) {
      run(coding, writer, [&](auto code) { code(0, count()); });
      return count();
    }
    run(coding, writer, [&](auto code) {
      for (uint32_t i = 0; i < pieces; ++i) {
        const auto begin = static_cast<uint32_t>(uint64_t{count() - piece} * i / (pieces - 1));
        code(begin, begin + piece);
      }
    });
    return pieces * piece;
  }

 private:
  /// Each piece begins without residuals around. Trials on four times as many vertices, in pieces of 4,096,
  /// took two to three times as long, for sizes that were the same within 0.2 % (twelve meshes of
  /// build/data/tri, 14 bits).
  static constexpr uint32_t piece = 512, pieces = 8;

  uint32_t count() const { return static_cast<uint32_t>(patch_.codes.size()); }
  size_t room() const { return size_t{count()} + FanDecoder::most_ahead; }
  typename Points::Tuple codes(uint32_t v) const {
    typename Points::Tuple result{};
    for (unsigned k = 0; k < Points::components; ++k)
      result[k] = static_cast<typename Points::Integer>(patch_.codes[v][k] - bias_[k]);
    return result;
  }
  /// Pieces refer to points that no piece has.
  void know_points() {
    if (points_are_known_) return;
    known_.points.grow(room());
    for (uint32_t v = 0; v < count(); ++v) known_.points.set(v, codes(v));
    points_are_known_ = true;
  }

  template <class Ranges>
  void run(const Coding& coding, Writer& writer, Ranges ranges) {
    if (coding.repeats == Repeats::none) {
      run<false>(coding, writer, ranges);
    } else {
      run<true>(coding, writer, ranges);
    }
  }
  template <bool repeating, class Ranges>
  void run(const Coding& coding, Writer& writer, Ranges ranges) {
    PositionCoder<Writer, Points, repeating> coder(writer, coding, known_);
    const FanSurface& fans = *patch_.fans;
    WindowWeights weights(coding, fans.valences, patch_.places.value_or(ElementPlaces{}));
    const auto code = [&](const VertexReferences* references, const uint8_t* kinds, uint32_t begin,
                          uint32_t end) {
      weights.compute(references, kinds, begin, end);
      for (uint32_t v = begin; v < end; ++v)
        coder.code(v, references[v - begin], kinds[v - begin], weights[v - begin], weights.turned(v - begin),
                   codes(v));
    };
    std::vector<VertexReferences> beside;
    const std::vector<uint8_t> loose(window, loose_kind);
    ranges([&](uint32_t first, uint32_t last) {
      for (uint32_t begin = first; begin < last; begin += window) {
        const uint32_t end = std::min(last, begin + window),
                       fan_end = std::max(begin, std::min(end, fans.vertices));
        if (begin < fan_end) code(fans.references.data() + begin, fans.kinds.data() + begin, begin, fan_end);
        beside.clear();
        for (uint32_t v = fan_end; v < end; ++v) beside.push_back(references_beside(v));
        if (fan_end < end) code(beside.data(), loose.data(), fan_end, end);
      }
    });
  }

  const Patch& patch_;
  const Bias& bias_;
  KnownPoints<Points> known_;
  bool points_are_known_ = false;
};

/// Chooses how a patch is coded, and codes it.
class PositionEncoder {
 public:
  /// `more_range`: how far codes of other patches may lie from those of this one.
  PositionEncoder(Patch patch, Scalar type, std::vector<NumberMap> maps, const PositionChoices& choices,
                  uint64_t more_range = 0)
      : patch_(std::move(patch)), type_(type), maps_(std::move(maps)), choices_(choices) {
    find_range(more_range);
    choose();
  }

  /// In bytes, as far as trials tell.
  double size() const {
    ByteWriter maps;
    for (const NumberMap& map : maps_) write_map(maps, map);
    return size_ + static_cast<double>(maps.size());
  }

  /// `beside`: what stands behind the maps.
  std::vector<std::byte> write(uint8_t flags, Bytes beside) {
    Writer writer;
    code_all(patch_, writer);
    ByteWriter out;
    const std::vector<StaticTables> tables = write_head(flags, beside, writer.events, false, out);
    write_points(writer, tables, all(), out);
    return out.take();
  }

  /// What stands before points, for many patches of which this one is a sample.
  std::vector<std::byte> write_shared() {
    Writer writer;
    code_all(patch_, writer);
    ByteWriter out;
    shared_ = write_head(0, {}, writer.events, true, out);
    const size_t symbols = write_symbols(coding_, writer.events, shared_).size();
    bytes_of_point_ = (static_cast<double>(writer.raw_bits) / 8 + static_cast<double>(symbols)) / all();
    patch_.codes = {};
    return out.take();
  }
  /// Another patch, after that. Its codes span no more than those of the sample were said to.
  void write_with_shared(const Patch& patch, ByteWriter& out) const {
    Writer writer(&shared_);
    code_all(patch, writer);
    write_points(writer, shared_, patch.codes.size(), out);
  }
  bool takes(const Codes& codes) const {
    if (wide_) return true;
    for (size_t v = 0; v < codes.size(); ++v) {
      const int64_t* const code = codes[v];
      for (unsigned k = 0; k < codes.components; ++k) {
        const auto number =
            static_cast<int64_t>(static_cast<uint64_t>(code[k]) - static_cast<uint64_t>(bias_[k]));
        if (number <= -most_narrow || number >= most_narrow) return false;
      }
    }
    return true;
  }
  const std::vector<NumberMap>& maps() const { return maps_; }
  /// Symbols and raw bits of one, as far as trials tell.
  double bytes_of_point() const { return bytes_of_point_; }

 private:
  uint32_t all() const { return static_cast<uint32_t>(patch_.codes.size()); }
  unsigned components() const { return patch_.codes.components; }

  std::vector<StaticTables> write_head(uint8_t flags, Bytes beside, const std::vector<Writer::Event>& events,
                                       bool shared, ByteWriter& out) const {
    if (patch_.places) out.put(static_cast<uint8_t>(coding_.placement));
    out.put(static_cast<uint8_t>(flags | flags_of(coding_, wide_)));
    for (const NumberMap& map : maps_) write_map(out, map);
    out.put_bytes(beside);
    for (unsigned k = 0; k < components() && !wide_; ++k) put_signed(out, bias_[k]);
    for (unsigned k = 0; k < components(); ++k) out.put(coding_.base[k]);
    out.put(coding_.first_size);
    out.put(coding_.first_spread);
    RansEncoder side;
    std::vector<StaticTables> tables = write_side(coding_, events, shared, side);
    put_section(out, side.finish());
    return tables;
  }
  void write_points(Writer& writer, const std::vector<StaticTables>& tables, uint64_t points,
                    ByteWriter& out) const {
    std::vector<std::byte> symbols = write_symbols(coding_, writer.events, tables);
    fill_up(symbols, points);
    put_section(out, writer.take_raw());
    out.put_bytes(symbols);
  }

  void find_range(uint64_t more) {
    Bias low{}, high{};
    for (size_t v = 0; v < all(); ++v) {
      const int64_t* const code = patch_.codes[v];
      for (unsigned k = 0; k < components(); ++k) {
        low[k] = v > 0 ? std::min(low[k], code[k]) : code[k];
        high[k] = v > 0 ? std::max(high[k], code[k]) : code[k];
      }
    }
    for (unsigned k = 0; k < components(); ++k) {
      const uint64_t range = static_cast<uint64_t>(high[k]) - static_cast<uint64_t>(low[k]);
      wide_ = wide_ || range >= 2 * most_narrow - 1 || more >= uint64_t{most_narrow} || maps_[k].is_curved();
      bias_[k] = static_cast<int64_t>(static_cast<uint64_t>(low[k]) + (range + 1) / 2);
    }
    if (wide_) bias_ = {};
  }
  static constexpr int64_t most_narrow = 1 << 19;

  std::unique_ptr<Runs> runs_of(const Patch& patch) const {
    return with_components(components(), [&](auto n) -> std::unique_ptr<Runs> {
      const size_t room = patch.codes.size() + FanDecoder::most_ahead;
      if (wide_)
        return std::make_unique<RunsOf<DoublePoints<n>>>(patch, bias_, wide_points<n>(maps_, type_, room));
      return std::make_unique<RunsOf<FloatPoints<n>>>(patch, bias_, FloatPoints<n>());
    });
  }
  void code_all(const Patch& patch, Writer& writer) const {
    writer.events.reserve(patch.codes.size() * components() * (coding_.repeats == Repeats::none ? 1 : 2));
    runs_of(patch)->all(coding_, writer);
  }

  static std::vector<Histogram> count_events(const Alphabet& alphabet,
                                             const std::vector<Writer::Event>& events) {
    std::vector<Histogram> counts(alphabet.contexts);
    for (const Writer::Event& event : events) {
      const uint32_t context = event.context - alphabet.first;
      if (context < alphabet.contexts) ++counts[context][event.symbol];
    }
    return counts;
  }
  static std::vector<StaticTables> write_side(Coding coding, const std::vector<Writer::Event>& events,
                                              bool shared, RansEncoder& side) {
    coding.rows.code(side);
    for (unsigned k = 0; k < coding.components && coding.repeats != Repeats::none; ++k)
      coding.dictionaries[k].code(side);
    std::vector<StaticTables> tables;
    for_each_alphabet(coding, [&](const Alphabet& alphabet) {
      tables.push_back(make_tables(count_events(alphabet, events), alphabet.symbols, table_bits,
                                   alphabet.most_tables, side, shared));
    });
    return tables;
  }
  static std::vector<std::byte> write_symbols(const Coding& coding, const std::vector<Writer::Event>& events,
                                              const std::vector<StaticTables>& tables) {
    LaneRansEncoder encoder;
    std::vector<Alphabet> alphabets;
    for_each_alphabet(coding, [&](const Alphabet& alphabet) { alphabets.push_back(alphabet); });
    for (const Writer::Event& event : events) {
      size_t a = 0;
      while (event.context - alphabets[a].first >= alphabets[a].contexts) ++a;
      encoder.put(tables[a].of(event.context - alphabets[a].first), event.symbol, event.lane);
    }
    return encoder.finish(lanes_of(coding));
  }

  // Choices.

  void choose() {
    runs_ = runs_of(patch_);
    coding_.components = components();
    coding_.with_spread = choices_.spread;
    set_rows(coding_);
    by_fitted_ = by_gate_ = coding_ = with_classes(coding_);
    by_gate_.centre = Centre::gate;
    by_gate_ = with_classes(by_gate_);
    size_ = trial(coding_);
    consider(by_gate_, 1);
    // Few vertices pay too much for more tables; and spreads take a fifth of the decoder's time, as a table
    // then waits for the vertex before. So they must save something.
    Coding without = coding_;
    without.with_spread = false;
    if (choices_.spread) consider(without, 1.004);
    if (patch_.places && !patch_.places->positions.empty()) choose_placement();
    if (choices_.repeats) choose_repeats();
    runs_.reset();
  }
  void choose_placement() {
    Coding coding;
    coding.components = components();
    coding.with_spread = coding_.with_spread;
    for (const Placement placement : {Placement::hinge, Placement::similar, Placement::both}) {
      if (placement > Placement::hinge && !can_turn()) continue;
      coding.placement = placement;
      if (placement > Placement::hinge) coding.turn_ratio = turn_ratio(maps_, type_);
      consider(with_classes(coding), 1);
    }
  }
  bool can_turn() const { return components() == 2 && turn_ratio(maps_, type_) > 0; }
  void set_rows(Coding& coding) const {
    const FittedRows fitted = fit();
    // All connectivity is decoded twice for them. Where less was saved (bunny, the MRI surface), files were
    // not smaller.
    coding.with_valences = choices_.valences && fitted.bits_by_valence < 0.99 * fitted.bits_by_place;
    coding.rows = coding.with_valences ? fitted.by_valence : fitted.by_place;
  }
  /// Takes a coding that needs no more than this part of what the best one so far does. Returns its size.
  double consider(const Coding& coding, double part) {
    const double size = trial(coding);
    if (size <= part * size_) {
      size_ = size;
      coding_ = coding;
    }
    return size;
  }

  void choose_repeats() {
    const double before = size_;
    const bool by_gate = coding_.centre == Centre::gate;
    const bool candidates = consider_repeats(Repeats::candidates, Centre::gate, {}) < 1.1 * before;
    const auto counts = count_values();
    size_t entries_before = 0;
    for (const Often& often : {Often{8, 2}, Often{8, 0}, Often{32, 0}, Often{128, 0}}) {
      Dictionaries dictionaries;
      double share = 0;
      size_t entries = 0;
      for (unsigned k = 0; k < components(); ++k) {
        share += fill(counts[k], often, dictionaries[k]) / components();
        entries += dictionaries[k].size();
      }
      if (share < 0.1 || entries == std::exchange(entries_before, entries)) continue;
      // Where dictionaries are far from paying in one way, they are in the others.
      const double levels = consider_repeats(Repeats::levels, Centre::fitted, dictionaries);
      if (levels > 1.3 * before) continue;
      if (by_gate) consider_repeats(Repeats::levels, Centre::gate, dictionaries);
      if (candidates || levels < before) consider_repeats(Repeats::candidates, Centre::gate, dictionaries);
    }
  }
  /// Returns its size.
  double consider_repeats(Repeats repeats, Centre centre, const Dictionaries& dictionaries) {
    Coding coding = centre == Centre::gate ? by_gate_ : by_fitted_;
    coding.with_spread = coding_.with_spread;
    coding.repeats = repeats;
    coding.dictionaries = dictionaries;
    // They take longer to decode, so they must save something.
    return consider(coding, 0.98);
  }

  FittedRows fit() const {
    return with_components(components(), [&](auto n) { return fit<n>(); });
  }
  template <unsigned n>
  FittedRows fit() const {
    std::vector<std::array<double, n>> values(all());
    std::array<double, n> largest{}, units;
    const DoublePoints<n> points = wide_points<n>(maps_, type_, 0);
    for (size_t v = 0; v < values.size(); ++v) {
      for (unsigned k = 0; k < n; ++k) {
        values[v][k] = points.value_of(patch_.codes[v][k] - bias_[k], k);
        largest[k] = std::max(largest[k], std::fabs(values[v][k]));
      }
    }
    for (unsigned k = 0; k < n; ++k)
      units[k] = points.curved[k] ? largest_step(*points.curved[k], std::max(largest[k], 1e-30)) : 1;
    return fit_valence_rows<n>(*patch_.fans, values, units, choices_.valences);
  }
  /// Between the largest numbers; a float has steps of 2^-24 of it at least.
  double largest_step(const NumberMap& map, double largest) const {
    const int64_t code = map.nearest_code(type_, largest);
    const double below = map.value_of(type_, code - 1);
    return std::max(largest - below, largest * (size_of(type_) == 8 ? 0x1p-53 : 0x1p-24));
  }

  /// Bases, so that the lengths of nearly all residuals have symbols, and the first class of sizes and
  /// spreads.
  Coding with_classes(Coding coding) {
    Statistics found;
    Writer writer(nullptr, &found);
    runs_->sample(coding, writer);
    set_classes(coding, found);
    return coding;
  }
  void set_classes(Coding& coding, const Statistics& found) const {
    unsigned least = 255;
    for (unsigned k = 0; k < components(); ++k) {
      // One length in 4096 has no symbol.
      const unsigned most = quantile(found.lengths[k], 4095, 4096);
      coding.base[k] = static_cast<uint8_t>(
          std::min(most > longest ? most - longest : 0u, wide_ ? most_wide_base : most_narrow_base));
      const unsigned low = quantile(found.lengths[k], 1, 16);
      least = std::min(least, low > coding.base[k] ? 2 * (low - coding.base[k]) : 0u);
    }
    coding.first_size = static_cast<uint8_t>(least);
    coding.first_spread = static_cast<uint8_t>(quantile(found.octaves, 1, 32));
  }
  template <size_t n>
  static unsigned quantile(const std::array<uint32_t, n>& counts, uint64_t part, uint64_t of) {
    uint64_t sum = 0, below = 0;
    for (const uint32_t count : counts) sum += count;
    unsigned i = 0;
    while (i + 1 < n && (below += counts[i]) * of < sum * part) ++i;
    return i;
  }

  using Counts = std::vector<std::pair<int64_t, uint32_t>>;
  std::array<Counts, most_components> count_values() const {
    std::array<Counts, most_components> result;
    std::vector<int64_t> values(all());
    for (unsigned k = 0; k < components(); ++k) {
      for (size_t v = 0; v < values.size(); ++v) values[v] = patch_.codes[v][k] - bias_[k];
      result[k] = count_each(values);
    }
    return result;
  }
  static Counts count_each(std::vector<int64_t>& values) {
    Counts result;
    if (values.empty()) return result;
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    const uint64_t range = static_cast<uint64_t>(*high) - static_cast<uint64_t>(*low);
    if (range < 8 * values.size()) return count_near(values, *low, range + 1);
    std::sort(values.begin(), values.end());
    for (size_t i = 0; i < values.size();) {
      size_t end = i;
      while (end < values.size() && values[end] == values[i]) ++end;
      result.push_back({values[i], static_cast<uint32_t>(end - i)});
      i = end;
    }
    return result;
  }
  /// Without sorting, which takes a tenth of the encoder's time.
  static Counts count_near(std::span<const int64_t> values, int64_t low, uint64_t range) {
    std::vector<uint32_t> count(range);
    for (const int64_t value : values) ++count[static_cast<size_t>(value - low)];
    Counts result;
    for (size_t i = 0; i < count.size(); ++i) {
      if (count[i] > 0) result.push_back({low + static_cast<int64_t>(i), count[i]});
    }
    return result;
  }
  /// How often values are in a dictionary at least, and how many times as often as those near them. On a
  /// coarse lattice all values come again, in a mesh of many points more often than any number says; those of
  /// a voxel lattice are seen among them.
  struct Often {
    uint64_t least;
    uint64_t times;
  };
  /// Those that are there so often; returns the share of all numbers that they are.
  double fill(const Counts& counts, const Often& often, Dictionary& dictionary) const {
    constexpr size_t near = 16;
    std::vector<uint64_t> below{0};
    for (const auto& [value, count] : counts) below.push_back(below.back() + count);
    std::vector<int64_t> values;
    uint64_t covered = 0;
    for (size_t i = 0; i < counts.size(); ++i) {
      const auto& [value, count] = counts[i];
      const size_t first = i - std::min(i, near), end = std::min(i + near + 1, counts.size());
      const bool stands_out = count * (end - first) >= often.times * (below[end] - below[first]);
      if (count < often.least || !stands_out || values.size() == Dictionary::most) continue;
      values.push_back(value);
      covered += count;
    }
    // Farther apart than a dictionary goes are only numbers without any order.
    if (!values.empty() &&
        static_cast<uint64_t>(values.back()) - static_cast<uint64_t>(values.front()) > Dictionary::most_range)
      return 0;
    dictionary.set(std::move(values));
    return static_cast<double>(covered) / static_cast<double>(all() + 1);
  }

  /// About the size of all, from a sample.
  double trial(const Coding& coding) {
    Writer writer;
    const uint32_t vertices = runs_->sample(coding, writer);
    RansEncoder side;
    const auto tables = write_side(coding, writer.events, false, side);
    const auto side_bytes = static_cast<double>(side.finish().size());
    const double bits = static_cast<double>(writer.raw_bits) + bits_of(coding, writer.events, tables);
    return side_bytes + bits / 8 * all() / std::max(vertices, 1u);
  }
  static double bits_of(const Coding& coding, const std::vector<Writer::Event>& events,
                        const std::vector<StaticTables>& tables) {
    uint64_t sum = 0;
    size_t a = 0;
    for_each_alphabet(coding, [&](const Alphabet& alphabet) {
      const StaticTables& of = tables[a++];
      std::vector<Histogram> price(of.tables.size());
      for (size_t t = 0; t < price.size(); ++t) {
        for (unsigned s = 0; s < of.symbols; ++s)
          price[t][s] = (of.bits << 16) - log2_fixed(of.tables[t].frequency[s]);
      }
      for (const Writer::Event& event : events) {
        const uint32_t context = event.context - alphabet.first;
        if (context < alphabet.contexts) sum += price[of.table_of[context]][event.symbol];
      }
    });
    return static_cast<double>(sum) / 65536;
  }

  Patch patch_;
  Scalar type_;
  std::vector<NumberMap> maps_;
  PositionChoices choices_;
  std::vector<StaticTables> shared_;
  double bytes_of_point_ = 0;
  bool wide_ = false;
  Bias bias_{};
  Coding coding_;  ///< the best one so far
  double size_ = 0;
  Coding by_gate_, by_fitted_;
  std::unique_ptr<Runs> runs_;  ///< while choosing
};

/// Places of numbers in an array, rising: components * tuple + component.
using Places = std::vector<uint64_t>;
bool has(const Places& places, uint64_t stored) {
  return std::binary_search(places.begin(), places.end(), stored);
}

/// Exceptions count as the number before: they have no code.
Codes codes_of(const Array& array, const Places& exceptions, std::span<const NumberMap> maps,
               std::span<const uint32_t> source) {
  const size_t size = size_of(array.type);
  const unsigned n = array.components;
  Codes codes(n, source.size());
  for (size_t v = 0; v < source.size(); ++v) {
    for (unsigned k = 0; k < n; ++k) {
      const uint64_t stored = uint64_t{source[v]} * n + k;
      if (!exceptions.empty() && has(exceptions, stored)) {
        codes[v][k] = v > 0 ? codes[v - 1][k] : 0;
      } else {
        codes[v][k] = maps[k].code_of(array.type, array.bytes.data() + stored * size);
      }
    }
  }
  return codes;
}

}  // namespace

std::vector<std::byte> write_exceptions(const Array& array, const std::vector<uint64_t>& exceptions,
                                        std::span<const uint32_t> source) {
  ByteWriter numbers;
  uint64_t count = 0, before = 0;
  const unsigned n = array.components;
  for (uint64_t place = 0; place < n * source.size() && !exceptions.empty(); ++place) {
    const uint64_t stored = uint64_t{source[place / n]} * n + place % n;
    if (!has(exceptions, stored)) continue;
    numbers.put_count(place - before);
    numbers.put_bytes(Bytes(array.bytes).subspan(stored * size_of(array.type), size_of(array.type)));
    before = place;
    ++count;
  }
  ByteWriter out;
  out.put_count(count);
  out.put_bytes(numbers.bytes());
  return out.take();
}

namespace {

std::vector<std::byte> encode_with(const FanSurface& fans, const Array& array, const ArrayMaps& maps,
                                   std::span<const uint32_t> source, const PositionChoices& choices,
                                   const std::optional<ElementPlaces>& places) {
  ByteWriter exceptions;
  put_section(exceptions, write_exceptions(array, maps.exceptions, source));
  PositionEncoder plain({&fans, codes_of(array, maps.exceptions, maps.maps, source), places}, array.type,
                        maps.maps, choices);
  if (maps.lossless) {
    const RefinedMaps refined = refine_maps(array, maps.maps, source);
    const auto has_table = [](const NumberMap& map) { return !map.table.empty(); };
    if (refined.any() || std::any_of(refined.coarse.begin(), refined.coarse.end(), has_table)) {
      PositionEncoder coarse({&fans, codes_of(array, maps.exceptions, refined.coarse, source), places},
                             array.type, refined.coarse, choices);
      ByteWriter beside;
      if (refined.any()) write_details(beside, refined, array, source);
      beside.put_bytes(exceptions.bytes());
      if (coarse.size() + static_cast<double>(beside.size()) < plain.size())
        return coarse.write(refined.any() ? flag_refined : 0, beside.bytes());
    }
  }
  return plain.write(0, exceptions.bytes());
}

}  // namespace

std::vector<std::byte> encode_positions(const FanSurface& fans, const Array& array, const ArrayMaps& maps,
                                        std::span<const uint32_t> source, const PositionChoices& choices) {
  return encode_with(fans, array, maps, source, choices, std::nullopt);
}

std::vector<std::byte> encode_numbers(const FanSurface& around, const Array& array, const ArrayMaps& maps,
                                      std::span<const uint32_t> source, const ElementPlaces& places) {
  return encode_with(around, array, maps, source, {}, places);
}

PositionChoices position_choices(int effort) {
  const Effort& row = effort_of(effort);
  return {row.valence_rows, row.spread, row.valence_rows};
}

struct SharedPositions::State {
  PositionEncoder encoder;
};

SharedPositions::SharedPositions(const FanSurface& sample, const Array& array, const ArrayMaps& maps,
                                 const PositionChoices& choices, uint64_t most_range) {
  std::vector<uint32_t> source(sample.vertices);
  std::iota(source.begin(), source.end(), 0u);
  PositionEncoder encoder({&sample, codes_of(array, maps.exceptions, maps.maps, source)}, array.type,
                          maps.maps, choices, most_range);
  state_ = std::make_unique<State>(State{std::move(encoder)});
  tables_ = state_->encoder.write_shared();
}
SharedPositions::SharedPositions(SharedPositions&&) noexcept = default;
SharedPositions& SharedPositions::operator=(SharedPositions&&) noexcept = default;
SharedPositions::~SharedPositions() = default;

double SharedPositions::size_of(uint64_t points) const {
  return static_cast<double>(tables_.size()) + state_->encoder.bytes_of_point() * static_cast<double>(points);
}

std::optional<std::vector<std::byte>> SharedPositions::encode(const FanSurface& fans, const Array& array,
                                                              const std::vector<uint64_t>& exceptions,
                                                              std::span<const uint32_t> source) const {
  const Patch patch{&fans, codes_of(array, exceptions, state_->encoder.maps(), source)};
  if (!state_->encoder.takes(patch.codes)) return std::nullopt;
  ByteWriter out;
  put_section(out, write_exceptions(array, exceptions, source));
  state_->encoder.write_with_shared(patch, out);
  return out.take();
}

}  // namespace maille
