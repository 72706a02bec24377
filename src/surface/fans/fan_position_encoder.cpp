// The encoder of the positions of fans; its decoder is in fan_positions.cpp.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <type_traits>

#include "base/bytes.h"
#include "entropy/static_rans.h"
#include "numbers/number_maps.h"
#include "surface/fans/fan_position_model.h"
#include "surface/fans/fan_positions.h"

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

/// One patch while its positions are coded.
template <class Points>
struct CodedPatch {
  using Codes = typename Points::Codes;
  Vertices vertices;
  Points points;
  std::vector<uint8_t> chosen;  ///< by vertex: its selector
  std::vector<SizeAndShape> classes;
  std::vector<Codes> residuals;

  CodedPatch(const Vertices& of, Points at)
      : vertices(of), points(std::move(at)), chosen(of.count, fitted_selector) {}

  /// With each of the rows; references to a vertex itself count as 0, as its position is not known yet.
  template <size_t count>
  [[gnu::always_inline]] std::array<Codes, count> residuals_of(uint32_t v, const Row* rows) const {
    const VertexReferences references = vertices.references(v);
    const auto is_itself = [&](uint32_t r) { return r >= v; };
    if (std::none_of(references.at.begin(), references.at.end(), is_itself)) [[likely]]
      return points.template residuals<count>(v, references, rows);
    std::array<Row, count> without;
    for (size_t s = 0; s < count; ++s) {
      without[s] = rows[s];
      for (unsigned k = 0; k < 8; ++k) {
        if (is_itself(references.at[k])) without[s][k] = 0;
      }
    }
    return points.template residuals<count>(v, references, without.data());
  }
  Codes residuals_of(uint32_t v, const Row& row) const { return residuals_of<1>(v, &row)[0]; }
};

/// How often everything occurs, by context.
struct ClassCounts {
  std::vector<Histogram> sizes, shapes, selectors;

  explicit ClassCounts(unsigned most_sizes)
      : sizes(size_context(most_sizes, 0)),
        shapes(shape_context(most_sizes, 0)),
        selectors(selector_contexts) {}
  void add(const ClassCounts& more) {
    const auto sum = [](std::vector<Histogram>& to, const std::vector<Histogram>& from) {
      for (size_t i = 0; i < to.size(); ++i) {
        for (unsigned s = 0; s < most_static_symbols; ++s) to[i][s] += from[i][s];
      }
    };
    sum(sizes, more.sizes);
    sum(shapes, more.shapes);
    sum(selectors, more.selectors);
  }
};

struct ClassTables {
  StaticTables sizes, shapes, selectors;
};

/// Rows and tables for patches that share them; for one patch, its own.
template <class Points>
class PositionEncoder {
 public:
  using Patch = CodedPatch<Points>;
  using Codes = typename Points::Codes;

  PositionEncoder(std::vector<Patch>& patches, bool with_late, Executor& executor)
      : patches_(patches), with_late_(with_late), executor_(executor), counts_(Points::sizes) {
    // Rows and selectors are learnt from some, for the sake of time.
    const size_t count = std::min(patches.size(), most_samples);
    for (size_t i = 0; i < count; ++i) sample_.push_back(&patches[i * patches.size() / count]);
  }

  /// Finds rows, selectors and classes, and writes the tables; with what stands before them, see
  /// docs/format.md.
  /// `are_sample`: the tables are for other patches, too.
  void write_tables(ByteWriter& out, uint8_t flags, ByteWriter& maps, bool try_selectors,
                    bool are_sample = false) {
    train(try_selectors);
    if (sample_.size() < patches_.size()) code_all();
    if (are_sample) {
      spread_symbols(counts_.sizes, Points::sizes, true);
      spread_symbols(counts_.shapes, shapes, false);
      spread_symbols(counts_.selectors, selectors, false);
    }
    out.put(
        static_cast<uint8_t>(flags | (with_selectors_ ? flag_selectors : 0) | (with_late_ ? flag_late : 0)));
    out.put_bytes(maps.bytes());
    RansEncoder side;
    fitted_.code(side);
    // The fastest level has fewer tables, which small meshes feel.
    const uint64_t price = with_late_ ? price_of_table : 6 * price_of_table;
    tables_.sizes = make_tables(counts_.sizes, Points::sizes, class_bits, most_size_tables, side, price);
    tables_.shapes = make_tables(counts_.shapes, shapes, class_bits, most_shape_tables, side, price);
    if (with_selectors_)
      tables_.selectors = make_tables(counts_.selectors, selectors, selector_bits, selector_contexts, side);
    const auto side_bytes = side.finish();
    out.put_count(side_bytes.size());
    out.put_bytes(side_bytes);
  }

  /// The tables are done with their patches, of which no more is needed than this.
  void keep_costs() {
    costs_ = class_costs();
    sample_.clear();
  }
  /// A patch that the tables were not made with, coded with them. False: they have no place for it.
  bool code_another(Patch& patch) const {
    if (with_selectors_) {
      choose_selectors(patch, costs_);
    } else {
      classify(patch);
    }
    ClassCounts counts(Points::sizes);
    count_classes(patch, counts);
    const auto has_all = [](const std::vector<Histogram>& found, const StaticTables& tables) {
      for (unsigned context = 0; context < found.size(); ++context) {
        for (unsigned s = 0; s < tables.symbols; ++s) {
          if (found[context][s] != 0 && tables.of(context).frequency[s] == 0) return false;
        }
      }
      return true;
    };
    return has_all(counts.sizes, tables_.sizes) && has_all(counts.shapes, tables_.shapes) &&
           (!with_selectors_ || has_all(counts.selectors, tables_.selectors));
  }

  /// `in_states`: the last raw bits stand in the states of the classes.
  void write_patch(const Patch& patch, bool in_states, ByteWriter& out) const {
    std::vector<std::byte> raw;
    uint64_t waiting = 0;
    unsigned bits = 0;
    // Bytes of the last block alone: those before are needed before the states are known.
    const uint32_t last_block = (std::max(patch.vertices.count, 1u) - 1) / block_vertices * block_vertices;
    size_t before_last = 0;
    for (uint32_t v = 0; v < patch.vertices.count; ++v) {
      if (v == last_block) before_last = raw.size() + (bits > 0);
      for (unsigned k = 0; k < 3; ++k) {
        const Field field = field_of_coordinate(patch.classes[v], k);
        waiting |= raw_bits(patch.residuals[v][k], field) << bits;
        for (bits += field.bits; bits >= 8; bits -= 8, waiting >>= 8)
          raw.push_back(static_cast<std::byte>(waiting & 255));
      }
    }
    if (bits > 0) raw.push_back(static_cast<std::byte>(waiting & 255));

    GroupRansEncoder encoder;
    visit_symbols(
        patch,
        [&](unsigned context, unsigned symbol) {
          encoder.put(tables_.sizes.of(context), class_bits, symbol);
        },
        [&](unsigned context, unsigned symbol) {
          encoder.put(tables_.shapes.of(context), class_bits, symbol);
        },
        [&](unsigned context, unsigned symbol) {
          if (with_selectors_) encoder.put(tables_.selectors.of(context), selector_bits, symbol);
        },
        [&](unsigned lane) { encoder.end_group(lane); });
    size_t apart = 0;
    if (in_states) {
      apart = std::min(raw.size() - std::min(raw.size(), before_last), group_payload_bytes);
      out.put_count(apart);
    }
    out.put_count(raw.size() - apart);
    out.put_bytes(Bytes(raw).first(raw.size() - apart));
    std::vector<std::byte> classes = encoder.finish(Bytes(raw).last(apart));
    fill_up(classes, patch.classes.size());
    out.put_bytes(classes);
  }

 private:
  static constexpr size_t most_samples = 12;

  void train(bool try_selectors) {
    fit();
    const uint64_t without = measure(false);
    const FittedRows rows_without = fitted_;
    const auto chosen_without = chosen();
    uint64_t vertices = 0;
    for (const Patch* patch : sample_) vertices += patch->vertices.count;
    if (try_selectors && vertices > 64) {
      uint64_t with = UINT64_MAX;
      FittedRows best_rows;
      std::vector<std::vector<uint8_t>> best;
      for (int round = 0; round < 3; ++round) {
        const ClassCosts costs = class_costs();
        executor_.parallel_for(sample_.size(), [&](size_t i) { choose_selectors(*sample_[i], costs); });
        fit();
        const uint64_t cost = measure(true);
        if (cost >= with) break;
        with = cost;
        best_rows = fitted_;
        best = chosen();
      }
      // Selectors take time to decode; they must be worth it.
      with_selectors_ = with < without - without / 100;
      fitted_ = with_selectors_ ? best_rows : rows_without;
      set_chosen(with_selectors_ ? best : chosen_without);
    }
    set_rows();
    measure(with_selectors_);
  }
  std::vector<std::vector<uint8_t>> chosen() const {
    std::vector<std::vector<uint8_t>> all;
    for (const Patch* patch : sample_) all.push_back(patch->chosen);
    return all;
  }
  void set_chosen(const std::vector<std::vector<uint8_t>>& all) {
    for (size_t i = 0; i < all.size(); ++i) sample_[i]->chosen = all[i];
  }

  /// The others as the sample has it.
  void code_all() {
    const ClassCosts costs = class_costs();
    executor_.parallel_for(patches_.size(), [&](size_t i) {
      if (with_selectors_) {
        choose_selectors(patches_[i], costs);
      } else {
        classify(patches_[i]);
      }
    });
    std::vector<Patch*> all;
    for (Patch& patch : patches_) all.push_back(&patch);
    count_classes(all);
  }

  void set_rows() {
    rows_ = plain_rows();
    fitted_.apply(rows_);
  }
  const Row& row(const Patch& patch, uint32_t v, unsigned selector) const {
    return rows_[patch.vertices.kind(v) * selectors + selector];
  }

  /// Rows of selector 1 for the vertices that use it, by least absolute errors: squares weighted by what was
  /// left the round before.
  void fit() {
    fitted_ = {};
    set_rows();
    for (int round = 0; round < 3; ++round) {
      std::vector<Normals> by_kind(vertex_kinds);
      for (const Patch* patch : sample_) {
        for (uint32_t v = 1; v < patch->vertices.fans.vertices; ++v) {
          if (patch->chosen[v] != fitted_selector) continue;
          add_sample(*patch, v, by_kind[patch->vertices.kind(v)]);
        }
      }
      solve(by_kind);
      set_rows();
    }
    drop_useless();
    set_rows();
  }
  void add_sample(const Patch& patch, uint32_t v, Normals& normals) const {
    const VertexReferences references = patch.vertices.references(v);
    const unsigned mask = useful_references(patch.vertices.kind(v));
    if (mask == 0) return;
    ++normals.samples;
    for (unsigned k = 0; k < 3; ++k) {
      const double base = patch.points.value(references.at[R::last], k);
      std::array<double, 7> terms{};
      double predicted = 0;
      for (unsigned r = 0; r < 7; ++r) {
        if ((mask >> r & 1) == 0) continue;
        terms[r] = patch.points.value(references.at[r], k) - base;
        predicted += terms[r] * row(patch, v, fitted_selector)[r] / weight_sum;
      }
      const double target = patch.points.value(v, k) - base;
      const double left = std::fabs(target - predicted);
      normals.add(terms, target, 1 / (left + floor_));
    }
  }
  void solve(const std::vector<Normals>& by_kind) {
    for (unsigned p = 0; p < first_polygon_place * 2; ++p) {
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
    for (const Patch* patch : sample_) {
      for (uint32_t v = 1; v < patch->vertices.fans.vertices; ++v) {
        if (patch->chosen[v] != fitted_selector) continue;
        const unsigned kind = patch->vertices.kind(v);
        const unsigned p = FittedRows::place(kind);
        if (!fitted_.has_place[p]) continue;
        plain[kind] += size_of_residual(*patch, v, plain_row(kind, fitted_selector));
        place[kind] += size_of_residual(*patch, v, fitted_.of_place[p]);
        if (fitted_.has_kind[kind]) kind_cost[kind] += size_of_residual(*patch, v, fitted_.of_kind[kind]);
      }
    }
    constexpr uint64_t row_cost = uint64_t{48} << 16;
    for (unsigned p = 0; p < first_polygon_place * 2; ++p) {
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
  static uint64_t size_of_residual(const Patch& patch, uint32_t v, const Row& row) {
    const Codes residuals = patch.residuals_of(v, row);
    uint64_t size = 0;
    for (const int32_t residual : residuals) {
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

  struct ClassCosts {
    std::vector<std::array<uint32_t, wide_sizes>> size;
    std::vector<std::array<uint32_t, shapes>> shape;  ///< with the raw bits
    std::array<std::array<uint32_t, selectors>, selector_contexts> selector;
  };
  /// Per vertex the selector that is cheapest with the tables of the last counts, and what it leaves.
  void choose_selectors(Patch& patch, const ClassCosts& costs) const {
    patch.classes.resize(patch.vertices.count);
    patch.residuals.resize(patch.vertices.count);
    std::array<Before, group_lanes> lanes{};
    for_each_group(patch.vertices.count, [&](uint32_t v, unsigned lane) {
      Before& before = lanes[lane];
      const unsigned kind = patch.vertices.kind(v);
      uint64_t least = UINT64_MAX;
      SizeAndShape best{};
      unsigned chosen = 0;
      const auto residuals = patch.template residuals_of<selectors>(v, &rows_[kind * selectors]);
      for (unsigned s = 0; s < selectors; ++s) {
        const SizeAndShape classes = size_and_shape(residuals[s]);
        const uint64_t cost = uint64_t{costs.selector[selector_context(before.selector, kind)][s]} +
                              costs.size[size_context(before.size, quality_of_kind[kind])][classes.size] +
                              costs.shape[shape_context(classes.size, before.zeros)][classes.shape];
        if (cost >= least) continue;
        least = cost;
        best = classes;
        chosen = s;
      }
      patch.chosen[v] = static_cast<uint8_t>(chosen);
      patch.classes[v] = best;
      patch.residuals[v] = residuals[chosen];
      before.follow(best, chosen);
    });
  }
  ClassCosts class_costs() const {
    ClassCosts costs;
    const auto bits_of = [](const Histogram& counts, unsigned symbols, unsigned s) {
      uint32_t sum = symbols;
      for (unsigned i = 0; i < symbols; ++i) sum += 8 * counts[i];
      return log2_fixed(sum) - log2_fixed(8 * counts[s] + 1);
    };
    costs.size.resize(counts_.sizes.size());
    for (size_t context = 0; context < counts_.sizes.size(); ++context) {
      for (unsigned s = 0; s < Points::sizes; ++s)
        costs.size[context][s] = bits_of(counts_.sizes[context], Points::sizes, s);
    }
    costs.shape.resize(counts_.shapes.size());
    for (unsigned context = 0; context < counts_.shapes.size(); ++context) {
      for (unsigned s = 0; s < shapes; ++s)
        costs.shape[context][s] =
            bits_of(counts_.shapes[context], shapes, s) + (all_raw_bits({context / 8, s}) << 16);
    }
    for (unsigned context = 0; context < selector_contexts; ++context) {
      for (unsigned s = 0; s < selectors; ++s) {
        // Before any selector was chosen, all are welcome.
        costs.selector[context][s] =
            have_selectors_ ? bits_of(counts_.selectors[context], selectors, s) : 1u << 16;
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

  /// Classes of the sample with the selectors chosen, and what they cost, roughly.
  uint64_t measure(bool with_selectors) {
    for (Patch* patch : sample_) classify(*patch);
    uint64_t cost = count_classes(sample_) << 16;
    have_selectors_ = with_selectors;
    for (const Histogram& counts : counts_.sizes) cost += entropy_of(counts);
    for (const Histogram& counts : counts_.shapes) cost += entropy_of(counts);
    if (with_selectors) {
      for (const Histogram& counts : counts_.selectors) cost += entropy_of(counts);
    }
    return cost;
  }
  /// Counts over all of these. Returns the number of raw bits.
  uint64_t count_classes(const std::vector<Patch*>& patches) {
    // Sums over pieces of work: counts of each patch would take too much memory.
    const size_t pieces = std::min<size_t>(patches.size(), 16);
    std::vector<uint64_t> bits(pieces);
    std::vector<ClassCounts> counts(pieces, ClassCounts(Points::sizes));
    executor_.parallel_for(pieces, [&](size_t piece) {
      for (size_t i = piece; i < patches.size(); i += pieces)
        bits[piece] += count_classes(*patches[i], counts[piece]);
    });
    counts_ = ClassCounts(Points::sizes);
    for (const ClassCounts& one : counts) counts_.add(one);
    uint64_t sum = 0;
    for (const uint64_t one : bits) sum += one;
    return sum;
  }
  /// What the selectors chosen leave.
  void classify(Patch& patch) const {
    patch.classes.resize(patch.vertices.count);
    patch.residuals.resize(patch.vertices.count);
    for (uint32_t v = 0; v < patch.vertices.count; ++v) {
      patch.residuals[v] = patch.residuals_of(v, row(patch, v, patch.chosen[v]));
      patch.classes[v] = size_and_shape(patch.residuals[v]);
    }
  }
  uint64_t count_classes(const Patch& patch, ClassCounts& counts) const {
    uint64_t bits = 0;
    for (const SizeAndShape& classes : patch.classes) bits += all_raw_bits(classes);
    visit_symbols(
        patch, [&](unsigned context, unsigned symbol) { ++counts.sizes[context][symbol]; },
        [&](unsigned context, unsigned symbol) { ++counts.shapes[context][symbol]; },
        [&](unsigned context, unsigned symbol) { ++counts.selectors[context][symbol]; }, [](unsigned) {});
    return bits;
  }
  static uint64_t entropy_of(const Histogram& counts) {
    uint32_t sum = 0;
    for (const uint32_t count : counts) sum += count;
    uint64_t cost = 0;
    for (const uint32_t count : counts) cost += uint64_t{count} * (log2_fixed(sum) - log2_fixed(count));
    return cost;
  }

  template <class SizeVisit, class ShapeVisit, class SelectorVisit, class GroupEnd>
  static void visit_symbols(const Patch& patch, SizeVisit size_visit, ShapeVisit shape_visit,
                            SelectorVisit selector_visit, GroupEnd group_end) {
    std::array<Before, group_lanes> lanes{};
    for_each_group(patch.vertices.count, [&](uint32_t v, unsigned lane) {
      Before& before = lanes[lane];
      const unsigned kind = patch.vertices.kind(v);
      const SizeAndShape& classes = patch.classes[v];
      selector_visit(selector_context(before.selector, kind), patch.chosen[v]);
      size_visit(size_context(before.size, quality_of_kind[kind]), classes.size);
      shape_visit(shape_context(classes.size, before.zeros), classes.shape);
      before.follow(classes, patch.chosen[v]);
      group_end(lane);
    });
  }

  std::vector<Patch>& patches_;
  std::vector<Patch*> sample_;
  bool with_late_;
  Executor& executor_;
  bool with_selectors_ = false;
  FittedRows fitted_;
  Rows rows_{};
  ClassCounts counts_;
  bool have_selectors_ = false;
  ClassTables tables_;
  ClassCosts costs_;
  static constexpr double floor_ = 0.5;
};

/// The codes of a patch's positions.
std::vector<std::array<int32_t, 3>> codes_of(const Array& array, const ArrayMaps& maps,
                                             std::span<const uint32_t> source) {
  const size_t size = size_of(array.type);
  std::vector<std::array<int32_t, 3>> codes(source.size());
  for (size_t v = 0; v < codes.size(); ++v) {
    for (unsigned k = 0; k < 3; ++k) {
      const std::byte* number = array.bytes.data() + (size_t{source[v]} * 3 + k) * size;
      codes[v][k] = static_cast<int32_t>(maps.maps[k].code_of(array.type, number));
    }
  }
  return codes;
}

struct Range {
  std::array<int32_t, 3> low{}, high{};

  explicit Range(const std::vector<std::array<int32_t, 3>>& codes) {
    if (!codes.empty()) low = high = codes[0];
    for (const auto& code : codes) {
      for (unsigned k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], code[k]);
        high[k] = std::max(high[k], code[k]);
      }
    }
  }
  bool is_narrow() const {
    bool narrow = true;
    for (unsigned k = 0; k < 3; ++k) narrow = narrow && int64_t{high[k]} - low[k] <= 65535;
    return narrow;
  }
  std::array<int32_t, 3> middle() const {
    std::array<int32_t, 3> middle;
    for (unsigned k = 0; k < 3; ++k) middle[k] = static_cast<int32_t>((int64_t{low[k]} + high[k] + 1) >> 1);
    return middle;
  }
};

template <class Points>
CodedPatch<Points> patch_of(const Vertices& vertices, Points points,
                            const std::vector<std::array<int32_t, 3>>& codes) {
  points.grow(codes.size());
  for (uint32_t v = 0; v < codes.size(); ++v) points.set(v, codes[v]);
  return {vertices, std::move(points)};
}

NarrowPoints narrow_points(size_t count, const std::array<int32_t, 3>& bias) {
  NarrowPoints points(count);
  points.bias = bias;
  return points;
}
WidePoints wide_points(size_t count, const ArrayMaps& maps) {
  WidePoints points(count);
  for (unsigned k = 0; k < 3; ++k) points.curved[k] = maps.maps[k].is_curved() ? &maps.maps[k] : nullptr;
  return points;
}
bool any_curved(const ArrayMaps& maps) {
  return maps.maps[0].is_curved() || maps.maps[1].is_curved() || maps.maps[2].is_curved();
}

}  // namespace

std::vector<std::byte> encode_fan_positions(const FanSurface& fans, const Array& array, const ArrayMaps& maps,
                                            std::span<const uint32_t> source, bool small) {
  const Vertices vertices{fans, static_cast<uint32_t>(source.size()), small};
  const std::vector<std::array<int32_t, 3>> codes = codes_of(array, maps, source);
  const Range range(codes);
  ByteWriter out, header;
  for (const NumberMap& map : maps.maps) write_map(header, map);
  const auto write = [&](auto points, uint8_t flags) {
    using Points = decltype(points);
    std::vector<CodedPatch<Points>> patches;
    patches.push_back(patch_of(vertices, std::move(points), codes));
    PositionEncoder<Points> encoder(patches, small, serial_executor());
    encoder.write_tables(out, flags, header, small);
    encoder.write_patch(patches[0], false, out);
  };
  if (range.is_narrow() && !any_curved(maps)) {
    for (const int32_t bias : range.middle()) header.put(bias);
    write(narrow_points(codes.size(), range.middle()), 0);
  } else {
    write(wide_points(codes.size(), maps), flag_wide);
  }
  return out.take();
}

}  // namespace maille
