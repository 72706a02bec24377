// The encoder of the positions of fans; its decoder is in fan_positions.cpp.
#include <algorithm>
#include <array>
#include <cmath>

#include "base/bytes.h"
#include "entropy/static_rans.h"
#include "surface/fan_position_model.h"
#include "surface/fan_positions.h"
#include "surface/number_maps.h"

namespace maille {

using namespace fan_positions;

namespace {

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

  void write(ByteWriter& out, uint8_t flags, ByteWriter& maps, bool try_selectors) {
    fit();
    const uint64_t without = measure(false);
    const FittedRows rows_without = fitted_;
    const auto chosen_without = chosen_;
    bool with_selectors = false;
    if (try_selectors && vertices_.count > 64) {
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
    out.put(static_cast<uint8_t>(flags | (with_selectors ? flag_selectors : 0) |
                                 (vertices_.with_late ? flag_late : 0)));
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

  /// What a lane remembers of the vertex before.
  struct Before {
    unsigned size = 0;
    unsigned zeros = 0;
    unsigned selector = 0;

    void follow(const SizeAndShape& classes, unsigned chosen) {
      *this = {classes.size, zeros_of_shape[classes.shape], chosen};
    }
  };

  /// Per vertex the selector that is cheapest with the tables of the last measure().
  void choose_selectors() {
    const ClassCosts costs = class_costs();
    std::array<Before, group_lanes> lanes{};
    for_each_group(vertices_.count, [&](uint32_t v, unsigned lane) {
      Before& before = lanes[lane];
      const unsigned kind = vertices_.kind(v);
      uint64_t least = UINT64_MAX;
      SizeAndShape best{};
      for (unsigned s = 0; s < selectors; ++s) {
        const SizeAndShape classes = size_and_shape(residuals(v, s));
        const uint64_t cost = uint64_t{costs.selector[selector_context(before.selector, kind)][s]} +
                              costs.size[size_context(before.size, quality_of_kind[kind])][classes.size] +
                              costs.shape[shape_context(classes.size, before.zeros)][classes.shape];
        if (cost >= least) continue;
        least = cost;
        best = classes;
        chosen_[v] = static_cast<uint8_t>(s);
      }
      before.follow(best, chosen_[v]);
    });
  }
  struct ClassCosts {
    std::vector<std::array<uint32_t, wide_sizes>> size;
    std::vector<std::array<uint32_t, shapes>> shape;  ///< with the raw bits
    std::array<std::array<uint32_t, selectors>, selector_contexts> selector;
  };
  ClassCosts class_costs() const {
    ClassCosts costs;
    const auto bits_of = [](const Histogram& counts, unsigned symbols, unsigned s) {
      uint32_t sum = symbols;
      for (unsigned i = 0; i < symbols; ++i) sum += 8 * counts[i];
      return log2_fixed(sum) - log2_fixed(8 * counts[s] + 1);
    };
    costs.size.resize(size_counts_.size());
    for (size_t context = 0; context < size_counts_.size(); ++context) {
      for (unsigned s = 0; s < Points::sizes; ++s)
        costs.size[context][s] = bits_of(size_counts_[context], Points::sizes, s);
    }
    costs.shape.resize(shape_counts_.size());
    for (unsigned context = 0; context < shape_counts_.size(); ++context) {
      for (unsigned s = 0; s < shapes; ++s)
        costs.shape[context][s] =
            bits_of(shape_counts_[context], shapes, s) + (all_raw_bits({context / 8, s}) << 16);
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
  static unsigned all_raw_bits(const SizeAndShape& classes) {
    unsigned bits = 0;
    for (unsigned k = 0; k < 3; ++k) bits += field_of_coordinate(classes, k).bits;
    return bits;
  }
  static Field field_of_coordinate(const SizeAndShape& classes, unsigned k) {
    return field_of(classes.size, step_in(steps_of_shape[classes.shape], k));
  }

  /// Classes of all vertices with the selectors chosen; what they cost, roughly.
  uint64_t measure(bool with_selectors) {
    classes_.resize(vertices_.count);
    residuals_.resize(vertices_.count);
    uint64_t cost = 0;
    for (uint32_t v = 0; v < vertices_.count; ++v) {
      residuals_[v] = residuals(v, chosen_[v]);
      classes_[v] = size_and_shape(residuals_[v]);
      cost += all_raw_bits(classes_[v]);
    }
    cost <<= 16;
    size_counts_.assign(size_context(Points::sizes, 0), {});
    shape_counts_.assign(shape_context(Points::sizes, 0), {});
    selector_counts_.assign(selector_contexts, {});
    visit_symbols([&](unsigned context, unsigned symbol) { ++size_counts_[context][symbol]; },
                  [&](unsigned context, unsigned symbol) { ++shape_counts_[context][symbol]; },
                  [&](unsigned context, unsigned symbol) { ++selector_counts_[context][symbol]; },
                  [](unsigned) {});
    have_selectors_ = with_selectors;
    for (const Histogram& counts : size_counts_) cost += entropy_of(counts);
    for (const Histogram& counts : shape_counts_) cost += entropy_of(counts);
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

  template <class SizeVisit, class ShapeVisit, class SelectorVisit, class GroupEnd>
  void visit_symbols(SizeVisit size_visit, ShapeVisit shape_visit, SelectorVisit selector_visit,
                     GroupEnd group_end) {
    std::array<Before, group_lanes> lanes{};
    for_each_group(vertices_.count, [&](uint32_t v, unsigned lane) {
      Before& before = lanes[lane];
      const unsigned kind = vertices_.kind(v);
      const SizeAndShape& classes = classes_[v];
      selector_visit(selector_context(before.selector, kind), chosen_[v]);
      size_visit(size_context(before.size, quality_of_kind[kind]), classes.size);
      shape_visit(shape_context(classes.size, before.zeros), classes.shape);
      before.follow(classes, chosen_[v]);
      group_end(lane);
    });
  }

  void write_sections(ByteWriter& out, bool with_selectors) {
    RansEncoder side;
    fitted_.code(side);
    // The fastest level has fewer tables, which small meshes feel.
    const uint64_t price = vertices_.with_late ? price_of_table : 6 * price_of_table;
    const StaticTables size_tables =
        make_tables(size_counts_, Points::sizes, class_bits, most_size_tables, side, price);
    const StaticTables shape_tables =
        make_tables(shape_counts_, shapes, class_bits, most_shape_tables, side, price);
    StaticTables selector_tables;
    if (with_selectors)
      selector_tables = make_tables(selector_counts_, selectors, selector_bits, selector_contexts, side);
    const auto side_bytes = side.finish();

    std::vector<std::byte> raw;
    uint64_t waiting = 0;
    unsigned bits = 0;
    for (uint32_t v = 0; v < vertices_.count; ++v) {
      for (unsigned k = 0; k < 3; ++k) {
        const Field field = field_of_coordinate(classes_[v], k);
        waiting |= raw_bits(residuals_[v][k], field) << bits;
        for (bits += field.bits; bits >= 8; bits -= 8, waiting >>= 8)
          raw.push_back(static_cast<std::byte>(waiting & 255));
      }
    }
    if (bits > 0) raw.push_back(static_cast<std::byte>(waiting & 255));

    GroupRansEncoder encoder;
    visit_symbols(
        [&](unsigned context, unsigned symbol) { encoder.put(size_tables.of(context), class_bits, symbol); },
        [&](unsigned context, unsigned symbol) { encoder.put(shape_tables.of(context), class_bits, symbol); },
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
  std::vector<SizeAndShape> classes_;
  std::vector<Codes> residuals_;
  std::vector<Histogram> size_counts_;
  std::vector<Histogram> shape_counts_;
  std::vector<Histogram> selector_counts_;
  bool have_selectors_ = false;
  static constexpr double floor_ = 0.5;
};

}  // namespace

std::vector<std::byte> encode_fan_positions(const FanSurface& fans, const Array& array, const ArrayMaps& maps,
                                            std::span<const uint32_t> source, bool small) {
  const Vertices vertices{fans, static_cast<uint32_t>(source.size()), small};
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
  for (unsigned k = 0; k < 3; ++k) {
    narrow = narrow && int64_t{high[k]} - low[k] <= 65535 && !maps.maps[k].is_curved();
  }
  ByteWriter out, header;
  for (const NumberMap& map : maps.maps) write_map(header, map);
  const auto write = [&](auto& points, uint8_t flags) {
    for (uint32_t v = 0; v < codes.size(); ++v) points.set(v, codes[v]);
    PositionEncoder<std::decay_t<decltype(points)>>(vertices, points).write(out, flags, header, small);
  };
  if (narrow) {
    NarrowPoints points(codes.size());
    points.grow(codes.size());
    for (unsigned k = 0; k < 3; ++k) {
      points.bias[k] = static_cast<int32_t>((int64_t{low[k]} + high[k] + 1) >> 1);
      header.put(points.bias[k]);
    }
    write(points, 0);
  } else {
    WidePoints points(codes.size());
    for (unsigned k = 0; k < 3; ++k) points.curved[k] = maps.maps[k].is_curved() ? &maps.maps[k] : nullptr;
    write(points, flag_wide);
  }
  return out.take();
}

}  // namespace maille
