#include "surface/fan_positions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include "base/bytes.h"
#include "base/large_pages.h"
#include "base/result.h"
#include "entropy/integer_model.h"
#include "entropy/static_rans.h"
#include "surface/number_maps.h"

namespace maille {
namespace {

using R = VertexReferences;

// Predictions are sums of weights times references, divided by this.
constexpr int weight_bits = 6;
constexpr int weight_sum = 1 << weight_bits;
constexpr int largest_weight = 511;

constexpr unsigned selectors = 4;
constexpr unsigned fitted_selector = 1;
constexpr unsigned groups = 8;  ///< of residual classes, as contexts
constexpr unsigned qualities = 4;
constexpr unsigned class_contexts = groups * qualities + 2 * groups;
constexpr unsigned y_contexts = groups * qualities;
constexpr unsigned z_contexts = y_contexts + groups;
constexpr unsigned selector_contexts = selectors * 4;
constexpr unsigned most_class_tables = 24;
constexpr unsigned class_bits = 9;
constexpr unsigned selector_bits = 8;
constexpr unsigned narrow_classes = 17;
constexpr unsigned wide_classes = 33;
/// Classes of a block are decoded before its positions: four lanes, a quarter of the block each.
constexpr uint32_t block_vertices = FanDecoder::window;

constexpr uint8_t flag_wide = 1;
constexpr uint8_t flag_selectors = 2;

constexpr unsigned start_kind = start_place * valence_classes * 2;

/// What the fans promise about a prediction: the context of the first residual class.
constexpr auto quality_of_kind = [] {
  std::array<uint8_t, vertex_kinds> table{};
  for (unsigned kind = 0; kind < vertex_kinds; ++kind) {
    const bool late = kind_has_late(kind);
    table[kind] = static_cast<uint8_t>(place_of_kind(kind) >= first_open_place ? (late ? 1 : 0)
                                       : kind_is_last(kind)                    ? (late ? 3 : 2)
                                                                               : (late ? 2 : 1));
  }
  return table;
}();
constexpr unsigned selector_context(unsigned before, unsigned kind) {
  return before * 4 + kind_is_last(kind) * 2u + kind_has_late(kind);
}

struct alignas(16) Row : std::array<int16_t, 8> {};
using Rows = std::array<Row, vertex_kinds * selectors>;

Row row_of(std::initializer_list<std::pair<unsigned, int>> weights) {
  Row row{};
  for (const auto& [reference, weight] : weights) row[reference] = static_cast<int16_t>(weight);
  return row;
}
Row mean_of(const Row& a, const Row& b) {
  Row row{};
  for (unsigned k = 0; k < 8; ++k) row[k] = static_cast<int16_t>((a[k] + b[k]) / 2);
  return row;
}

const Row gate_row = row_of({{R::focus, 64}, {R::last, 64}, {R::before, -64}});
const Row closing_row = row_of({{R::focus, 64}, {R::next, 64}, {R::next_opposite, -64}});
const Row late_row = row_of({{R::late, 64}, {R::late + 1, 64}, {R::late + 2, -64}});
const Row last_row = row_of({{R::last, 64}});

/// The rows before any is fitted.
Row plain_row(unsigned kind, unsigned selector) {
  if (place_of_kind(kind) == start_place) return last_row;
  const bool late = kind_has_late(kind);
  const bool closing = kind_is_last(kind);
  const Row second = closing ? closing_row : late ? late_row : last_row;
  switch (selector) {
    case 0:
      return gate_row;
    case 1:
      return closing || late ? mean_of(gate_row, second) : gate_row;
    case 2:
      return second;
    default:
      return closing && late ? late_row : mean_of(gate_row, second);
  }
}

const Rows& plain_rows() {
  static const Rows all = [] {
    Rows rows;
    for (unsigned kind = 0; kind < vertex_kinds; ++kind) {
      for (unsigned s = 0; s < selectors; ++s) rows[kind * selectors + s] = plain_row(kind, s);
    }
    return rows;
  }();
  return all;
}

/// References that say something at this kind; the others repeat the focus.
unsigned useful_references(unsigned kind) {
  const unsigned place = place_of_kind(kind);
  if (place == start_place) return 0;
  unsigned mask = 1u << R::focus | 1u << R::before | 1u << R::last;
  if (place < first_open_place) mask |= 1u << R::next | 1u << R::next_opposite;
  if (kind_has_late(kind)) mask |= 7u << R::late;
  return mask;
}

/// Fitted rows: for a place in the fan, and where it pays for single valences too.
struct FittedRows {
  // By place and late, and by kind.
  std::array<bool, fan_places * 2> has_place{};
  std::array<Row, fan_places * 2> of_place{};
  std::array<bool, vertex_kinds> has_kind{};
  std::array<Row, vertex_kinds> of_kind{};

  static unsigned place(unsigned kind) { return place_of_kind(kind) * 2 + kind_has_late(kind); }
  static unsigned kind(unsigned place, unsigned valence) {
    return (place / 2 * valence_classes + valence) * 2 + place % 2;
  }

  template <class Coder>
  void code(Coder& coder) {
    std::array<BitModel, 2> there;
    std::array<OffsetModel, 2> step;
    for (unsigned p = 0; p < fan_places * 2; ++p) {
      if (place_of_kind(kind(p, 0)) == start_place) continue;
      has_place[p] = there[0].code(coder, has_place[p]);
      if (!has_place[p]) continue;
      code_row(coder, step[0], of_place[p], plain_row(kind(p, 0), fitted_selector), kind(p, 0));
      for (unsigned v = 0; v < valence_classes; ++v) {
        const unsigned k = kind(p, v);
        has_kind[k] = there[1].code(coder, has_kind[k]);
        if (has_kind[k]) code_row(coder, step[1], of_kind[k], of_place[p], k);
      }
    }
  }
  void apply(Rows& rows) const {
    for (unsigned k = 0; k < vertex_kinds; ++k) {
      if (!has_place[place(k)]) continue;
      rows[k * selectors + fitted_selector] = has_kind[k] ? of_kind[k] : of_place[place(k)];
    }
  }

 private:
  template <class Coder>
  static void code_row(Coder& coder, OffsetModel& model, Row& row, const Row& expected, unsigned kind) {
    int sum = 0;
    for (unsigned k = 0; k < R::last; ++k) {
      if ((useful_references(kind) >> k & 1) == 0) {
        row[k] = 0;
        continue;
      }
      // Steps are a multiple of two weights in most cases that matter; both directions share the rounding.
      const int value = expected[k] + model.code(coder, row[k] - expected[k]);
      row[k] = static_cast<int16_t>(std::clamp(value, -largest_weight, largest_weight));
      sum += row[k];
    }
    row[R::last] = static_cast<int16_t>(weight_sum - sum);
  }
};

unsigned class_of(int32_t residual) {
  const uint32_t size = residual < 0 ? 0 - static_cast<uint32_t>(residual) : static_cast<uint32_t>(residual);
  return bit_length(size);
}
/// The raw bits of a residual of this class: the number itself if it is positive, so that the highest bit is
/// set, else the number plus 2^class - 1.
uint32_t raw_bits(int32_t residual, unsigned size) {
  if (residual >= 0) return static_cast<uint32_t>(residual);
  return static_cast<uint32_t>(int64_t{residual} + (int64_t{1} << size) - 1);
}

/// Positions whose codes span 16 bits: two references at once in one multiply-add.
struct NarrowPoints {
  using Point = std::array<int16_t, 4>;
  static constexpr unsigned classes = narrow_classes;

  std::vector<Point> points;
  std::array<int32_t, 3> bias{};

  explicit NarrowPoints(size_t count) {
    reserve_on_large_pages(points, count);
    points.resize(count);
  }

  using Codes = std::array<int32_t, 3>;
  void set(uint32_t v, const Codes& codes) {
    for (unsigned k = 0; k < 3; ++k)
      points[v][k] = static_cast<int16_t>(static_cast<uint32_t>(codes[k]) - static_cast<uint32_t>(bias[k]));
  }
  int32_t code(uint32_t v, unsigned k) const {
    return static_cast<int32_t>(static_cast<uint32_t>(bias[k]) +
                                static_cast<uint32_t>(int32_t{points[v][k]}));
  }
  double value(uint32_t v, unsigned k) const { return points[v][k]; }

  Codes predict(const VertexReferences& references, const Row& row) const {
    Codes sum{};
    for (unsigned r = 0; r < 8; ++r) {
      for (unsigned k = 0; k < 3; ++k) sum[k] += int32_t{row[r]} * points[references.at[r]][k];
    }
    for (unsigned k = 0; k < 3; ++k)
      sum[k] = std::clamp((sum[k] + weight_sum / 2) >> weight_bits, -32768, 32767);
    return sum;
  }
  int32_t residual(uint32_t v, unsigned k, int32_t predicted) const {
    return static_cast<int16_t>(points[v][k] - predicted);
  }
  void reconstruct(uint32_t v, const Codes& predicted, const Codes& residuals) {
    for (unsigned k = 0; k < 3; ++k) points[v][k] = static_cast<int16_t>(predicted[k] + residuals[k]);
  }
};

/// Any codes of 32 bits: predicted in doubles, floats by their values.
struct WidePoints {
  static constexpr unsigned classes = wide_classes;

  std::vector<std::array<int32_t, 3>> codes;
  std::vector<std::array<double, 3>> values;
  std::array<bool, 3> ordered{};

  explicit WidePoints(size_t count) : codes(count), values(count) {}

  using Codes = std::array<int32_t, 3>;
  void set(uint32_t v, const Codes& to) {
    codes[v] = to;
    for (unsigned k = 0; k < 3; ++k) {
      // Infinities would make NaN, and numbers near the largest overflow.
      values[v][k] =
          ordered[k] ? std::clamp(NumberMap::ordered_value(Scalar::f32, to[k]), -1e37, 1e37) : to[k];
    }
  }
  int32_t code(uint32_t v, unsigned k) const { return codes[v][k]; }
  double value(uint32_t v, unsigned k) const { return values[v][k]; }

  Codes predict(const VertexReferences& references, const Row& row) const {
    std::array<double, 3> sum{};
    for (unsigned r = 0; r < 8; ++r) {
      for (unsigned k = 0; k < 3; ++k) sum[k] += row[r] * values[references.at[r]][k];
    }
    Codes result;
    for (unsigned k = 0; k < 3; ++k) {
      const double mean = sum[k] * (1.0 / weight_sum);
      if (ordered[k]) {
        result[k] = static_cast<int32_t>(NumberMap::nearest_ordered(Scalar::f32, mean));
      } else {
        result[k] = static_cast<int32_t>(std::clamp(std::floor(mean + 0.5), -2147483648.0, 2147483647.0));
      }
    }
    return result;
  }
  int32_t residual(uint32_t v, unsigned k, int32_t predicted) const {
    return static_cast<int32_t>(static_cast<uint32_t>(codes[v][k]) - static_cast<uint32_t>(predicted));
  }
  void reconstruct(uint32_t v, const Codes& predicted, const Codes& residuals) {
    Codes sum;
    for (unsigned k = 0; k < 3; ++k)
      sum[k] =
          static_cast<int32_t>(static_cast<uint32_t>(predicted[k]) + static_cast<uint32_t>(residuals[k]));
    set(v, sum);
  }
};

/// Points that are not vertices of fans are predicted by the one before.
VertexReferences references_beside(uint32_t v) {
  VertexReferences references;
  references.at.fill(v == 0 ? 0 : v - 1);
  return references;
}

/// Vertices of the fans, then the other points.
struct Vertices {
  const FanSurface& fans;
  uint32_t count;

  unsigned kind(uint32_t v) const { return v < fans.vertices ? fans.kinds[v] : start_kind; }
  VertexReferences references(uint32_t v) const {
    return v < fans.vertices ? fans.references[v] : references_beside(v);
  }
};

/// How a block of classes is dealt to the lanes.
struct Deal {
  uint32_t begin;
  uint32_t end;
  uint32_t share() const { return (end - begin + group_lanes - 1) / group_lanes; }
};

template <class Visit>
void for_each_group(uint32_t count, Visit visit) {
  for (uint32_t begin = 0; begin < count; begin += block_vertices) {
    const Deal deal{begin, std::min(count, begin + block_vertices)};
    for (uint32_t i = 0; i < deal.share(); ++i) {
      for (unsigned lane = 0; lane < group_lanes; ++lane) {
        const uint32_t v = begin + lane * deal.share() + i;
        if (v < deal.end) visit(v, lane);
      }
    }
  }
}

// ---- Encoder ---------------------------------------------------------------------------------------------

/// Weighted least squares for the rows of selector 1.
struct Normals {
  std::array<double, 49> matrix{};
  std::array<double, 7> right{};
  uint32_t samples = 0;

  void add(const std::array<double, 7>& terms, double target, double weight) {
    for (unsigned i = 0; i < 7; ++i) {
      const double term = terms[i] * weight;
      for (unsigned j = 0; j <= i; ++j) matrix[i * 7 + j] += term * terms[j];
      right[i] += term * target;
    }
  }
  /// Weights of all references but the last, by Cholesky; false when there is nothing to solve.
  bool solve(unsigned mask, std::array<double, 7>& solution) const {
    std::array<double, 49> l{};
    std::array<double, 7> y{};
    double trace = 0;
    for (unsigned i = 0; i < 7; ++i) trace += matrix[i * 7 + i];
    if (!(trace > 0)) return false;
    for (unsigned i = 0; i < 7; ++i) {
      const bool used = (mask >> i & 1) != 0;
      for (unsigned j = 0; j <= i; ++j) {
        double sum = used && (mask >> j & 1) != 0 ? matrix[i * 7 + j] : 0;
        if (i == j) sum = used ? sum + 1e-7 * trace : 1;
        for (unsigned k = 0; k < j; ++k) sum -= l[i * 7 + k] * l[j * 7 + k];
        if (i == j) {
          if (!(sum > 0)) return false;
          l[i * 7 + i] = std::sqrt(sum);
        } else {
          l[i * 7 + j] = sum / l[j * 7 + j];
        }
      }
      double sum = used ? right[i] : 0;
      for (unsigned k = 0; k < i; ++k) sum -= l[i * 7 + k] * y[k];
      y[i] = sum / l[i * 7 + i];
    }
    for (unsigned i = 7; i-- > 0;) {
      double sum = y[i];
      for (unsigned k = i + 1; k < 7; ++k) sum -= l[k * 7 + i] * solution[k];
      solution[i] = sum / l[i * 7 + i];
    }
    return true;
  }
};

template <class Points>
class PositionEncoder {
 public:
  PositionEncoder(const Vertices& vertices, Points& points)
      : vertices_(vertices), points_(points), chosen_(vertices.count, fitted_selector) {}

  struct Coding {
    bool with_selectors = false;
    FittedRows fitted;
    std::vector<uint8_t> chosen;
    uint64_t cost = UINT64_MAX;
  };

  void write(ByteWriter& out, uint8_t flags, ByteWriter& maps) {
    fit();
    const uint64_t without = measure(false);
    const FittedRows rows_without = fitted_;
    const auto chosen_without = chosen_;
    bool with_selectors = false;
    if (vertices_.count > 64) {
      uint64_t with = UINT64_MAX;
      FittedRows best_rows;
      std::vector<uint8_t> best;
      for (int round = 0; round < 4; ++round) {
        choose_selectors();
        fit();
        const uint64_t cost = measure(true);
        if (cost >= with) break;
        with = cost;
        best_rows = fitted_;
        best = chosen_;
      }
      // Selectors take time to decode; they must be worth it.
      with_selectors = with < without - without / 100;
      fitted_ = with_selectors ? best_rows : rows_without;
      chosen_ = with_selectors ? best : chosen_without;
    }
    set_rows();
    measure(with_selectors);
    out.put(static_cast<uint8_t>(flags | (with_selectors ? flag_selectors : 0)));
    out.put_bytes(maps.bytes());
    write_sections(out, with_selectors);
  }

 private:
  using Codes = typename Points::Codes;

  void set_rows() {
    rows_ = plain_rows();
    fitted_.apply(rows_);
  }
  const Row& row(uint32_t v, unsigned selector) const {
    return rows_[vertices_.kind(v) * selectors + selector];
  }
  /// References to a vertex itself count as 0, as its position is not known yet.
  Codes predict(uint32_t v, const Row& row) {
    const VertexReferences references = vertices_.references(v);
    const auto is_itself = [&](uint32_t r) { return r >= v; };
    if (std::any_of(references.at.begin(), references.at.end(), is_itself)) {
      Row without = row;
      for (unsigned k = 0; k < 8; ++k) {
        if (is_itself(references.at[k])) without[k] = 0;
      }
      return points_.predict(references, without);
    }
    return points_.predict(references, row);
  }
  Codes residuals(uint32_t v, unsigned selector) {
    const Codes predicted = predict(v, row(v, selector));
    Codes result;
    for (unsigned k = 0; k < 3; ++k) result[k] = points_.residual(v, k, predicted[k]);
    return result;
  }

  /// Rows of selector 1 for the vertices that use it, by least absolute errors: squares weighted by what was
  /// left the round before.
  void fit() {
    fitted_ = {};
    set_rows();
    for (int round = 0; round < 3; ++round) {
      std::vector<Normals> by_kind(vertex_kinds);
      for (uint32_t v = 1; v < vertices_.fans.vertices; ++v) {
        if (chosen_[v] != fitted_selector) continue;
        add_sample(v, by_kind[vertices_.kind(v)]);
      }
      solve(by_kind);
      set_rows();
    }
    drop_useless();
    set_rows();
  }
  void add_sample(uint32_t v, Normals& normals) {
    const VertexReferences references = vertices_.references(v);
    const unsigned mask = useful_references(vertices_.kind(v));
    if (mask == 0) return;
    ++normals.samples;
    for (unsigned k = 0; k < 3; ++k) {
      const double base = points_.value(references.at[R::last], k);
      std::array<double, 7> terms{};
      double predicted = 0;
      for (unsigned r = 0; r < 7; ++r) {
        if ((mask >> r & 1) == 0) continue;
        terms[r] = points_.value(references.at[r], k) - base;
        predicted += terms[r] * row(v, fitted_selector)[r] / weight_sum;
      }
      const double target = points_.value(v, k) - base;
      const double left = std::fabs(target - predicted);
      normals.add(terms, target, 1 / (left + floor_));
    }
  }
  void solve(const std::vector<Normals>& by_kind) {
    for (unsigned p = 0; p < fan_places * 2; ++p) {
      Normals all;
      for (unsigned valence = 0; valence < valence_classes; ++valence) {
        const Normals& one = by_kind[FittedRows::kind(p, valence)];
        for (unsigned i = 0; i < 49; ++i) all.matrix[i] += one.matrix[i];
        for (unsigned i = 0; i < 7; ++i) all.right[i] += one.right[i];
        all.samples += one.samples;
      }
      fitted_.has_place[p] = all.samples >= 32 && to_row(all, FittedRows::kind(p, 0), fitted_.of_place[p]);
      for (unsigned valence = 0; valence < valence_classes; ++valence) {
        const unsigned kind = FittedRows::kind(p, valence);
        fitted_.has_kind[kind] = fitted_.has_place[p] && by_kind[kind].samples >= 128 &&
                                 to_row(by_kind[kind], kind, fitted_.of_kind[kind]);
      }
    }
  }
  static bool to_row(const Normals& normals, unsigned kind, Row& row) {
    std::array<double, 7> solution{};
    const unsigned mask = useful_references(kind);
    if (!normals.solve(mask, solution)) return false;
    int sum = 0;
    for (unsigned k = 0; k < R::last; ++k) {
      if (!(std::fabs(solution[k]) < 4)) return false;
      row[k] = (mask >> k & 1) != 0 ? static_cast<int16_t>(std::floor(solution[k] * weight_sum + 0.5))
                                    : int16_t{0};
      sum += row[k];
    }
    row[R::last] = static_cast<int16_t>(weight_sum - sum);
    return true;
  }
  /// Rows that do not save what they take.
  void drop_useless() {
    std::vector<uint64_t> plain(vertex_kinds), place(vertex_kinds), kind_cost(vertex_kinds);
    for (uint32_t v = 1; v < vertices_.fans.vertices; ++v) {
      if (chosen_[v] != fitted_selector) continue;
      const unsigned kind = vertices_.kind(v);
      const unsigned p = FittedRows::place(kind);
      if (!fitted_.has_place[p]) continue;
      plain[kind] += size_of_residual(v, plain_row(kind, fitted_selector));
      place[kind] += size_of_residual(v, fitted_.of_place[p]);
      if (fitted_.has_kind[kind]) kind_cost[kind] += size_of_residual(v, fitted_.of_kind[kind]);
    }
    constexpr uint64_t row_cost = uint64_t{48} << 16;
    for (unsigned p = 0; p < fan_places * 2; ++p) {
      uint64_t without = 0, with = row_cost;
      for (unsigned valence = 0; valence < valence_classes; ++valence) {
        const unsigned kind = FittedRows::kind(p, valence);
        if (fitted_.has_kind[kind] && kind_cost[kind] + row_cost >= place[kind])
          fitted_.has_kind[kind] = false;
        without += plain[kind];
        with += fitted_.has_kind[kind] ? kind_cost[kind] + row_cost : place[kind];
      }
      if (with < without) continue;
      fitted_.has_place[p] = false;
      for (unsigned valence = 0; valence < valence_classes; ++valence)
        fitted_.has_kind[FittedRows::kind(p, valence)] = false;
    }
  }
  /// About log2 of the residuals, in 1/65536 bits.
  uint64_t size_of_residual(uint32_t v, const Row& row) {
    const Codes predicted = predict(v, row);
    uint64_t size = 0;
    for (unsigned k = 0; k < 3; ++k) {
      const int32_t residual = points_.residual(v, k, predicted[k]);
      const uint32_t magnitude =
          residual < 0 ? 0 - static_cast<uint32_t>(residual) : static_cast<uint32_t>(residual);
      size += log2_fixed(magnitude | 1) + (magnitude != 0 ? 1u << 16 : 0);
    }
    return size;
  }

  /// Per vertex the selector that is cheapest with the tables of the last measure().
  void choose_selectors() {
    const ClassCosts costs = class_costs();
    std::array<unsigned, group_lanes> group{}, before{};
    for_each_group(vertices_.count, [&](uint32_t v, unsigned lane) {
      const unsigned kind = vertices_.kind(v);
      uint64_t best = UINT64_MAX;
      unsigned best_selector = 0, best_group = 0;
      for (unsigned s = 0; s < selectors; ++s) {
        const Codes left = residuals(v, s);
        unsigned highest = 0;
        uint64_t cost = costs.selector[selector_context(before[lane], kind)][s];
        unsigned context = group[lane] * qualities + quality_of_kind[kind];
        for (unsigned k = 0; k < 3; ++k) {
          const unsigned c = class_of(left[k]);
          cost += costs.size[context][c];
          highest = std::max<unsigned>(highest, group_of_[c]);
          context = (k == 0 ? y_contexts : z_contexts) + highest;
        }
        if (cost >= best) continue;
        best = cost;
        best_selector = s;
        best_group = highest;
      }
      chosen_[v] = static_cast<uint8_t>(best_selector);
      group[lane] = best_group;
      before[lane] = best_selector;
    });
  }
  struct ClassCosts {
    std::array<std::array<uint32_t, wide_classes>, class_contexts> size;
    std::array<std::array<uint32_t, selectors>, selector_contexts> selector;
  };
  ClassCosts class_costs() const {
    ClassCosts costs;
    const auto bits_of = [](const Histogram& counts, unsigned symbols, unsigned s) {
      uint32_t sum = symbols;
      for (unsigned i = 0; i < symbols; ++i) sum += 8 * counts[i];
      return log2_fixed(sum) - log2_fixed(8 * counts[s] + 1);
    };
    for (unsigned context = 0; context < class_contexts; ++context) {
      for (unsigned c = 0; c < Points::classes; ++c)
        costs.size[context][c] = bits_of(counts_[context], Points::classes, c) + (c << 16);
    }
    for (unsigned context = 0; context < selector_contexts; ++context) {
      for (unsigned s = 0; s < selectors; ++s) {
        // Before any selector was chosen, all are welcome.
        costs.selector[context][s] =
            have_selectors_ ? bits_of(selector_counts_[context], selectors, s) : 1u << 16;
      }
    }
    return costs;
  }

  /// Classes of all vertices with the selectors chosen; what they cost, roughly.
  uint64_t measure(bool with_selectors) {
    classes_.resize(vertices_.count);
    residuals_.resize(vertices_.count);
    for (uint32_t v = 0; v < vertices_.count; ++v) {
      residuals_[v] = residuals(v, chosen_[v]);
      for (unsigned k = 0; k < 3; ++k) classes_[v][k] = static_cast<uint8_t>(class_of(residuals_[v][k]));
    }
    choose_groups();
    counts_.assign(class_contexts, {});
    selector_counts_.assign(selector_contexts, {});
    visit_symbols([&](unsigned context, unsigned symbol) { ++counts_[context][symbol]; },
                  [&](unsigned context, unsigned symbol) { ++selector_counts_[context][symbol]; },
                  [](unsigned) {});
    have_selectors_ = with_selectors;
    uint64_t cost = 0;
    for (const auto& classes : classes_) cost += uint64_t{classes[0]} + classes[1] + classes[2];
    cost <<= 16;
    for (const Histogram& counts : counts_) cost += entropy_of(counts);
    if (with_selectors) {
      for (const Histogram& counts : selector_counts_) cost += entropy_of(counts);
    }
    return cost;
  }
  static uint64_t entropy_of(const Histogram& counts) {
    uint32_t sum = 0;
    for (const uint32_t count : counts) sum += count;
    uint64_t cost = 0;
    for (const uint32_t count : counts) cost += uint64_t{count} * (log2_fixed(sum) - log2_fixed(count));
    return cost;
  }

  template <class ClassVisit, class SelectorVisit, class GroupEnd>
  void visit_symbols(ClassVisit class_visit, SelectorVisit selector_visit, GroupEnd group_end) {
    std::array<unsigned, group_lanes> group{}, before{};
    for_each_group(vertices_.count, [&](uint32_t v, unsigned lane) {
      const unsigned kind = vertices_.kind(v);
      selector_visit(selector_context(before[lane], kind), chosen_[v]);
      before[lane] = chosen_[v];
      unsigned highest = 0;
      unsigned context = group[lane] * qualities + quality_of_kind[kind];
      for (unsigned k = 0; k < 3; ++k) {
        const unsigned c = classes_[v][k];
        class_visit(context, c);
        highest = std::max<unsigned>(highest, group_of_[c]);
        context = (k == 0 ? y_contexts : z_contexts) + highest;
      }
      group[lane] = highest;
      group_end(lane);
    });
  }

  /// Joins neighbouring classes to groups, those first that tell least about the class that follows.
  void choose_groups() {
    std::vector<std::array<Histogram, 3>> parts(Points::classes);
    std::array<unsigned, group_lanes> highest{};
    for_each_group(vertices_.count, [&](uint32_t v, unsigned lane) {
      const auto& c = classes_[v];
      ++parts[highest[lane]][0][c[0]];
      ++parts[c[0]][1][c[1]];
      ++parts[std::max(c[0], c[1])][2][c[2]];
      highest[lane] = std::max({c[0], c[1], c[2]});
    });
    const auto cost = [](const std::array<Histogram, 3>& part) {
      return entropy_of(part[0]) + entropy_of(part[1]) + entropy_of(part[2]);
    };
    const auto joined = [](std::array<Histogram, 3> a, const std::array<Histogram, 3>& b) {
      for (unsigned k = 0; k < 3; ++k) {
        for (unsigned s = 0; s < most_static_symbols; ++s) a[k][s] += b[k][s];
      }
      return a;
    };
    std::vector<unsigned> sizes(parts.size(), 1);
    while (parts.size() > groups) {
      size_t best = 0;
      uint64_t least = UINT64_MAX;
      for (size_t i = 0; i + 1 < parts.size(); ++i) {
        const uint64_t loss = cost(joined(parts[i], parts[i + 1])) - cost(parts[i]) - cost(parts[i + 1]);
        if (loss >= least) continue;
        least = loss;
        best = i;
      }
      parts[best] = joined(parts[best], parts[best + 1]);
      sizes[best] += sizes[best + 1];
      parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(best) + 1);
      sizes.erase(sizes.begin() + static_cast<std::ptrdiff_t>(best) + 1);
    }
    unsigned c = 0;
    for (size_t g = 0; g < sizes.size(); ++g) {
      for (unsigned i = 0; i < sizes[g]; ++i) group_of_[c++] = static_cast<uint8_t>(g);
    }
  }

  void write_sections(ByteWriter& out, bool with_selectors) {
    RansEncoder side;
    for (unsigned c = 1; c < Points::classes; ++c) side.code_raw(group_of_[c] - group_of_[c - 1], 1);
    fitted_.code(side);
    const StaticTables tables = make_tables(counts_, Points::classes, class_bits, most_class_tables, side);
    StaticTables selector_tables;
    if (with_selectors)
      selector_tables = make_tables(selector_counts_, selectors, selector_bits, selector_contexts, side);
    const auto side_bytes = side.finish();

    std::vector<std::byte> raw;
    uint64_t waiting = 0;
    unsigned bits = 0;
    for (uint32_t v = 0; v < vertices_.count; ++v) {
      for (unsigned k = 0; k < 3; ++k) {
        waiting |= uint64_t{raw_bits(residuals_[v][k], classes_[v][k])} << bits;
        for (bits += classes_[v][k]; bits >= 8; bits -= 8, waiting >>= 8)
          raw.push_back(static_cast<std::byte>(waiting & 255));
      }
    }
    if (bits > 0) raw.push_back(static_cast<std::byte>(waiting & 255));

    GroupRansEncoder encoder;
    visit_symbols(
        [&](unsigned context, unsigned symbol) { encoder.put(tables.of(context), class_bits, symbol); },
        [&](unsigned context, unsigned symbol) {
          if (with_selectors) encoder.put(selector_tables.of(context), selector_bits, symbol);
        },
        [&](unsigned lane) { encoder.end_group(lane); });
    out.put_count(side_bytes.size());
    out.put_bytes(side_bytes);
    out.put_count(raw.size());
    out.put_bytes(raw);
    out.put_bytes(encoder.finish());
  }

  const Vertices& vertices_;
  Points& points_;
  std::vector<uint8_t> chosen_;
  FittedRows fitted_;
  Rows rows_{};
  std::vector<std::array<uint8_t, 3>> classes_;
  std::vector<Codes> residuals_;
  std::array<uint8_t, wide_classes> group_of_{};
  std::vector<Histogram> counts_;
  std::vector<Histogram> selector_counts_;
  bool have_selectors_ = false;
  static constexpr double floor_ = 0.5;
};

// ---- Decoder ---------------------------------------------------------------------------------------------

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

std::vector<std::byte> encode_fan_positions(const FanSurface& fans, const Array& array, const ArrayMaps& maps,
                                            std::span<const uint32_t> source) {
  const Vertices vertices{fans, static_cast<uint32_t>(source.size())};
  const size_t size = size_of(array.type);
  std::vector<std::array<int32_t, 3>> codes(source.size());
  std::array<int32_t, 3> low{}, high{};
  for (size_t v = 0; v < codes.size(); ++v) {
    for (unsigned k = 0; k < 3; ++k) {
      const std::byte* number = array.bytes.data() + (size_t{source[v]} * 3 + k) * size;
      codes[v][k] = static_cast<int32_t>(maps.maps[k].code_of(array.type, number));
      low[k] = v == 0 ? codes[v][k] : std::min(low[k], codes[v][k]);
      high[k] = v == 0 ? codes[v][k] : std::max(high[k], codes[v][k]);
    }
  }
  bool narrow = true;
  for (unsigned k = 0; k < 3; ++k) narrow = narrow && int64_t{high[k]} - low[k] <= 65535;
  ByteWriter out, header;
  for (const NumberMap& map : maps.maps) write_map(header, map);
  const auto write = [&](auto& points, uint8_t flags) {
    for (uint32_t v = 0; v < codes.size(); ++v) points.set(v, codes[v]);
    PositionEncoder<std::decay_t<decltype(points)>>(vertices, points).write(out, flags, header);
  };
  if (narrow) {
    NarrowPoints points(codes.size());
    for (unsigned k = 0; k < 3; ++k) {
      points.bias[k] = static_cast<int32_t>((int64_t{low[k]} + high[k] + 1) >> 1);
      header.put(points.bias[k]);
    }
    write(points, 0);
  } else {
    WidePoints points(codes.size());
    for (unsigned k = 0; k < 3; ++k) points.ordered[k] = maps.maps[k].kind == NumberMap::Kind::ordered;
    write(points, flag_wide);
  }
  return out.take();
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
  reserve_on_large_pages(array.bytes, size_t{points} * array.tuple_size());
  array.bytes.resize(size_t{points} * array.tuple_size());
  const bool with_selectors = (flags & flag_selectors) != 0;
  if (wide) {
    WidePoints wide_points(points);
    for (unsigned k = 0; k < 3; ++k) wide_points.ordered[k] = maps[k].kind == NumberMap::Kind::ordered;
    return decode_with(fans, sections, with_selectors, wide_points, points, maps, array);
  }
  NarrowPoints narrow_points(points);
  narrow_points.bias = bias;
  return decode_with(fans, sections, with_selectors, narrow_points, points, maps, array);
}

}  // namespace maille
