#include "surface/fans/valence_rows.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "code/symmetric_solver.h"
#include "entropy/static_rans.h"

namespace maille {
namespace {

using R = VertexReferences;
constexpr unsigned references = ValenceRows::references;
constexpr unsigned terms = ValenceRows::terms;

/// Vertices that rows are fitted to: with all of them files are 0.1 to 0.3 % smaller, measured on armadillo
/// and turbineblade, and take three times as long.
constexpr uint32_t most_samples = 1 << 14;
/// Samples with the same rows, at most: most vertices of a mesh are in one or two groups. Without a limit
/// files are as large in the mean (build/data/tri, 14 bits), with 2,048 the dragon is 1.4 % larger.
constexpr uint32_t most_of_group = 3072;
// Samples come in runs of neighbours, whose references are near in memory. The length of runs was not swept.
constexpr uint32_t samples_in_a_run = 64;
// A group with fewer keeps the mean of its parallelograms: there are up to 42 unknowns, seven references
// times six terms.
constexpr uint32_t fewest_samples = 48;

using PairOfDoubles = double __attribute__((vector_size(16)));
/// The lower half of a symmetric matrix of references in pairs, row by row, and behind it the right side.
constexpr unsigned pairs_before(unsigned row) {
  return (row + 1) * (row + 1) / 4;
}
constexpr unsigned all_pairs(unsigned count) {
  return pairs_before(count) + (count + 1) / 2;
}
struct Equations {
  std::array<PairOfDoubles, all_pairs(references)> pairs{};

  double at(unsigned i, unsigned j) const { return pairs[pairs_before(i) + j / 2][j % 2]; }
};
/// Weighted normal equations for all rows of a group: for each pair of terms those of references, likewise.
constexpr unsigned pair_of_terms(unsigned a, unsigned b) {
  return a * (a + 1) / 2 + b;
}
struct Normals {
  static constexpr unsigned size = terms * references;
  std::array<Equations, pair_of_terms(terms, 0)> pairs{};
  uint32_t samples = 0;
};

/// Calls `with` with 0 to n - 1 as constants: compilers leave loops of two levels as they are.
template <unsigned n, class Function>
[[gnu::always_inline]] inline void unrolled(Function with) {
  [&]<unsigned... i>(std::integer_sequence<unsigned, i...>) {
    (with(std::integral_constant<unsigned, i>{}), ...);
  }
  (std::make_integer_sequence<unsigned, n>{});
}

/// The references that are useful in a group.
struct Useful {
  unsigned count = 0;
  std::array<unsigned, references> at{};
  explicit Useful(unsigned group) {
    for (unsigned r = 0; r < references; ++r) {
      if ((ValenceRows::useful(group) >> r & 1) != 0) at[count++] = r;
    }
  }
};

template <unsigned components>
struct Sample {
  /// Of the useful references, relative to the last one; then zeros.
  std::array<std::array<PairOfDoubles, (references + 1) / 2>, components> x;
  std::array<double, components> target;
  std::array<double, terms> factors;
  unsigned group;
};

/// Fits rows of weights by least absolute errors: rounds of weighted least squares, in which a sample weighs
/// 1 over what the round before left of it (iteratively reweighted least squares). Rows by place and rows
/// that follow valences are fitted side by side, from the same samples. The order of all sums is fixed, so
/// every machine finds the same rows.
template <unsigned components>
class Fitter {
  using Tuple = std::array<double, components>;

 public:
  Fitter(const FanSurface& fans, std::span<const Tuple> values, const Tuple& units, bool with_valences)
      : fans_(fans),
        values_(values),
        units_(units),
        runs_of_samples_(std::min(most_samples, fans.vertices) / samples_in_a_run + 1),
        with_valences_(with_valences) {
    for (unsigned g = 0; g < ValenceRows::groups; ++g) useful_.emplace_back(g);
    slot_.fill(-1);
    std::array<uint32_t, ValenceRows::groups> count{};
    visit_vertices(1, [&](uint32_t v) { ++count[group_of(v)]; });
    for (unsigned g = 0; g < ValenceRows::groups; ++g) {
      if (useful_[g].count == 0) continue;
      const uint32_t stride = stride_[g] = std::max(1u, (count[g] + most_of_group - 1) / most_of_group);
      represented_ += uint64_t{(count[g] + stride - 1) / stride} * stride;
      if (count[g] < fewest_samples) continue;
      slot_[g] = static_cast<int>(fitted_groups_.size());
      fitted_groups_.push_back(g);
    }
  }

  FittedRows run() {
    if (fitted_groups_.empty()) return without_rows();
    const auto by_place = std::make_unique<Solutions>(), by_valence = std::make_unique<Solutions>();
    for (const unsigned g : fitted_groups_)
      (*by_place)[g] = (*by_valence)[g] = from_rows(only_plain_row(g), g);
    // Sums of the groups that occur only: those of all take a megabyte, and clearing it in every round was
    // 70 % of the work for a chart of four faces.
    std::vector<Normals> of_place(fitted_groups_.size()), of_valence(fitted_groups_.size());
    // Each round says anew which samples lie far out; few suffice for that at first. With three rounds files
    // were 0.2 to 4 % larger (eleven of fourteen meshes of build/data/tri and poly, 14 bits).
    for (const uint32_t part : {4u, 4u, 4u, 4u, 2u, 2u, 1u}) {
      std::fill(of_place.begin(), of_place.end(), Normals{});
      std::fill(of_valence.begin(), of_valence.end(), Normals{});
      visit(part, [&](const Sample<components>& sample) {
        const unsigned g = sample.group;
        const auto slot = static_cast<size_t>(slot_[g]);
        add<1>(sample, (*by_place)[g], of_place[slot]);
        if (with_valences_) add<terms>(sample, (*by_valence)[g], of_valence[slot]);
      });
      for (size_t slot = 0; slot < fitted_groups_.size(); ++slot) {
        const unsigned g = fitted_groups_[slot];
        // A round on a part of the samples may find as much smaller a part of each group.
        if (of_place[slot].samples < fewest_samples / part) continue;
        found_[g] = solve(of_place[slot], g, 1, (*by_place)[g]) && part == 1;
        if (with_valences_) solve(of_valence[slot], g, terms, (*by_valence)[g]);
      }
    }
    for (const unsigned g : fitted_groups_) {
      rows_by_place_[g] = to_rows((*by_place)[g], g, 1);
      rows_by_valence_[g] = to_rows((*by_valence)[g], g, terms);
    }
    return without_useless();
  }

 private:
  unsigned group_of(uint32_t v) const { return ValenceRows::group_of(fans_.kinds[v]); }
  /// One of `part` of the runs of samples.
  template <class Visit>
  void visit_vertices(uint32_t part, Visit visit) const {
    // Neighbours: what they refer to is near in memory.
    for (uint32_t run = 0; run < runs_of_samples_; run += part) {
      const auto begin = static_cast<uint32_t>(uint64_t{fans_.vertices} * run / runs_of_samples_),
                 end = static_cast<uint32_t>(uint64_t{fans_.vertices} * (run + 1) / runs_of_samples_);
      for (uint32_t v = std::max(begin, 1u); v < std::min(end, begin + samples_in_a_run); ++v) visit(v);
    }
  }
  /// Of the groups that are fitted; of those that have more than enough, only some.
  template <class Visit>
  void visit(uint32_t part, Visit visit) const {
    std::array<uint32_t, ValenceRows::groups> seen{};
    visit_vertices(part, [&](uint32_t v) {
      const unsigned g = group_of(v);
      if (slot_[g] < 0 || seen[g]++ % stride_[g] != 0) return;
      visit(sample_of(v));
    });
  }
  Sample<components> sample_of(uint32_t v) const {
    Sample<components> sample;
    sample.group = group_of(v);
    const auto& at = fans_.references[v].at;
    // As the coder sees them: what is not decoded yet is 0.
    const auto value = [&](uint32_t r) { return r < v ? values_[r] : Tuple{}; };
    const Tuple last = value(at[R::last]);
    for (unsigned k = 0; k < components; ++k) {
      sample.x[k] = {};
      sample.target[k] = values_[v][k] - last[k];
    }
    const Useful& useful = useful_[sample.group];
    for (unsigned i = 0; i < useful.count; ++i) {
      const Tuple of_reference = value(at[useful.at[i]]);
      for (unsigned k = 0; k < components; ++k) sample.x[k][i / 2][i % 2] = of_reference[k] - last[k];
    }
    sample.factors = {1};
    if (!with_valences_) return sample;
    const auto deviation = [&](uint32_t r) { return double{valence_deviations[fans_.valences[r]]}; };
    sample.factors = {1,
                      deviation(at[R::focus]),
                      deviation(at[R::last]),
                      deviation(at[R::before]),
                      deviation(at[R::next]),
                      deviation(v)};
    if (!ValenceRows::is_useful(sample.group, ValenceRows::by_next)) sample.factors[ValenceRows::by_next] = 0;
    return sample;
  }

  /// Weights of the useful references, by term.
  using Solution = std::array<double, Normals::size>;
  using Solutions = std::array<Solution, ValenceRows::groups>;

  template <unsigned used>
  Tuple predict(const Sample<components>& sample, const Solution& rows) const {
    Tuple sum{};
    for (unsigned i = 0; i < useful_[sample.group].count; ++i) {
      double weight = rows[i];
      for (unsigned t = 1; t < used; ++t) weight += sample.factors[t] * rows[t * references + i];
      for (unsigned k = 0; k < components; ++k) sum[k] += weight * sample.x[k][i / 2][i % 2];
    }
    return sum;
  }

  template <unsigned used>
  void add(const Sample<components>& sample, const Solution& rows, Normals& normals) const {
    ++normals.samples;
    switch (rows_for(useful_[sample.group].count)) {
      case 2:
        return add<used, 2>(sample, rows, normals);
      case 4:
        return add<used, 4>(sample, rows, normals);
      default:
        return add<used, references>(sample, rows, normals);
    }
  }
  /// Rows of the matrix for so many useful references; those too many stay 0.
  static constexpr unsigned rows_for(unsigned useful) {
    return useful <= 2 ? 2 : useful <= 4 ? 4 : references;
  }
  /// With as many references, of which the last ones may be zeros: loops that a compiler unrolls.
  template <unsigned used, unsigned count>
  void add(const Sample<components>& sample, const Solution& rows, Normals& normals) const {
    const Tuple predicted = predict<used>(sample, rows);
    Equations one;
    for (unsigned k = 0; k < components; ++k) {
      // Half a code is added, as residuals below it cost the same; it also keeps weights finite.
      const double weight = 1 / (std::fabs(sample.target[k] - predicted[k]) / units_[k] + 0.5);
      const double scale = weight / (units_[k] * units_[k]);
      const auto& x = sample.x[k];
      unrolled<count + 1>([&](auto i) {
        constexpr unsigned row = i, pairs = row < count ? row / 2 + 1 : (count + 1) / 2;
        const double left = (row < count ? x[row / 2][row % 2] : sample.target[k]) * scale;
        unrolled<pairs>([&](auto j) {
          one.pairs[pairs_before(row) + j] += PairOfDoubles{left, left} * x[j];
        });
      });
    }
    for (unsigned a = 0; a < used; ++a) {
      for (unsigned b = 0; b <= a; ++b) {
        const double factor = sample.factors[a] * sample.factors[b];
        // Most vertices have six neighbours, and no deviation.
        if (factor == 0) continue;
        Equations& sum = normals.pairs[pair_of_terms(a, b)];
        unrolled<all_pairs(count)>([&](auto i) {
          sum.pairs[i] += PairOfDoubles{factor, factor} * one.pairs[i];
        });
      }
    }
  }

  /// With a little added to the diagonal; false when there is nothing to solve.
  bool solve(const Normals& normals, unsigned group, unsigned used_terms, Solution& solution) const {
    const unsigned m = useful_[group].count, n = used_terms * m;
    const unsigned right = rows_for(m);
    std::vector<double> rows(size_t{n} * n), x(n);
    for (unsigned i = 0; i < n; ++i) {
      for (unsigned j = 0; j <= i; ++j)
        rows[i * n + j] =
            normals.pairs[pair_of_terms(i / m, j / m)].at(std::max(i % m, j % m), std::min(i % m, j % m));
      double& diagonal = rows[i * n + i];
      // References may depend on each other (flat or regular meshes), and some valences may not occur: a
      // little on the diagonal makes the solution unique, and keeps rows of valences small where nothing
      // speaks for them. Not swept.
      diagonal = diagonal > 0 ? diagonal * (i < m ? 1 + 1e-6 : 1 + 1e-3) : 1;
      x[i] = normals.pairs[pair_of_terms(i / m, 0)].at(right, i % m);
    }
    bool solved = false;
    solve_symmetric(rows.data(), n, x.data(), 0, solved);
    if (!solved) return false;
    solution = {};
    for (unsigned i = 0; i < n; ++i) solution[i / m * references + i % m] = x[i];
    return true;
  }

  std::array<ValenceRows::Row, terms> to_rows(const Solution& solution, unsigned group,
                                              unsigned used_terms) const {
    std::array<ValenceRows::Row, terms> rows{};
    for (unsigned t = 0; t < used_terms; ++t) {
      const double unit = t == 0 ? ValenceRows::base_unit : ValenceRows::deviation_unit;
      for (unsigned i = 0; i < useful_[group].count; ++i) {
        const double weight = std::floor(solution[t * references + i] * unit + 0.5);
        rows[t][useful_[group].at[i]] =
            static_cast<int16_t>(weight > ValenceRows::largest    ? ValenceRows::largest
                                 : weight > -ValenceRows::largest ? weight
                                                                  : -ValenceRows::largest);
      }
    }
    return rows;
  }
  Solution from_rows(const std::array<ValenceRows::Row, terms>& rows, unsigned group) const {
    Solution result{};
    for (unsigned t = 0; t < terms; ++t) {
      const double unit = t == 0 ? ValenceRows::base_unit : ValenceRows::deviation_unit;
      for (unsigned i = 0; i < useful_[group].count; ++i)
        result[t * references + i] = rows[t][useful_[group].at[i]] / unit;
    }
    return result;
  }
  static std::array<ValenceRows::Row, terms> only_plain_row(unsigned group) {
    std::array<ValenceRows::Row, terms> rows{};
    rows[0] = ValenceRows::plain_row(group);
    return rows;
  }
  /// About log2 of what is left, in 1/65536 bits: integers, so that the sum does not depend on the order. The
  /// clamp also catches NaN.
  template <unsigned used>
  uint64_t cost(const Sample<components>& sample, const Solution& rows) const {
    const Tuple predicted = predict<used>(sample, rows);
    uint64_t sum = 0;
    for (unsigned k = 0; k < components; ++k) {
      const double left = std::fabs(sample.target[k] - predicted[k]) / units_[k] + 0.5;
      sum += log2_fixed(static_cast<uint32_t>(left < 4e9 ? left : 4e9) + 1);
    }
    return sum;
  }
  /// About what ValenceRows::code() takes: a length (3 bits with its model), a sign and the bits below the
  /// highest.
  static double bits_of(const std::array<ValenceRows::Row, terms>& rows, unsigned group) {
    uint64_t bits = 0;
    const ValenceRows::Row plain = ValenceRows::plain_row(group);
    for (unsigned t = 0; t < terms; ++t) {
      for (unsigned r = 0; r < references; ++r) {
        const int offset = rows[t][r] - (t == 0 ? plain[r] : 0);
        if (offset != 0) bits += 3 + bit_length(static_cast<uint32_t>(offset < 0 ? -offset : offset));
      }
    }
    return static_cast<double>(bits);
  }
  /// Keeps of each group's rows what saves more than it takes: none, the first one, or all six. `each` scales
  /// from samples to all vertices.
  FittedRows without_useless() const {
    std::array<std::array<uint64_t, ValenceRows::groups>, 3> costs{};
    std::array<std::unique_ptr<Solutions>, 3> rows;
    for (auto& one : rows) one = std::make_unique<Solutions>();
    for (const unsigned g : fitted_groups_) {
      (*rows[0])[g] = from_rows(only_plain_row(g), g);
      (*rows[1])[g] = from_rows(rows_by_place_[g], g);
      (*rows[2])[g] = from_rows(rows_by_valence_[g], g);
    }
    visit(1, [&](const Sample<components>& sample) {
      const unsigned g = sample.group;
      if (!found_[g]) return;
      costs[0][g] += cost<1>(sample, (*rows[0])[g]);
      costs[1][g] += cost<1>(sample, (*rows[1])[g]);
      if (with_valences_) costs[2][g] += cost<terms>(sample, (*rows[2])[g]);
    });
    const double each = static_cast<double>(fans_.vertices) / static_cast<double>(represented_ + 1);
    FittedRows fitted = without_rows();
    for (const unsigned g : fitted_groups_) {
      if (!found_[g]) continue;
      const auto bits = [&](unsigned kept) {
        const double of_rows =
            kept == 0 ? 0 : bits_of(kept == 1 ? rows_by_place_[g] : rows_by_valence_[g], g);
        return each * stride_[g] * static_cast<double>(costs[kept][g]) / 65536 + of_rows;
      };
      const unsigned by_place = bits(1) < bits(0) ? 1 : 0;
      const unsigned by_valence = with_valences_ && bits(2) < bits(by_place) ? 2 : by_place;
      keep(fitted.by_place, g, by_place);
      keep(fitted.by_valence, g, by_valence);
      fitted.bits_by_place += bits(by_place);
      fitted.bits_by_valence += bits(by_valence);
    }
    return fitted;
  }
  FittedRows without_rows() const {
    FittedRows fitted;
    fitted.by_place.polygons = fitted.by_valence.polygons = !fans_.offsets.empty();
    return fitted;
  }
  void keep(ValenceRows& to, unsigned group, unsigned kept) const {
    to.kept[group] = static_cast<uint8_t>(kept);
    if (kept == 1) to.rows[group] = rows_by_place_[group];
    if (kept == 2) to.rows[group] = rows_by_valence_[group];
  }

  const FanSurface& fans_;
  std::span<const Tuple> values_;
  Tuple units_;
  uint32_t runs_of_samples_;
  bool with_valences_;
  std::vector<Useful> useful_;
  std::array<uint32_t, ValenceRows::groups>
      stride_{};              ///< how many vertices of a group there are for a sample
  uint64_t represented_ = 0;  ///< vertices for which the samples stand
  /// Groups with samples enough. All others keep the mean of their parallelograms, whatever a round finds.
  std::vector<unsigned> fitted_groups_;
  std::array<int, ValenceRows::groups> slot_;      ///< index into fitted_groups_, or -1
  std::array<bool, ValenceRows::groups> found_{};  ///< there were samples enough
  std::array<std::array<ValenceRows::Row, terms>, ValenceRows::groups> rows_by_place_{}, rows_by_valence_{};
};

}  // namespace

/// References that are only fillers, the focus again, get no weight of their own: the system would have no
/// unique solution.
unsigned ValenceRows::useful(unsigned group) {
  if (group / 2 == start_place) return 0;
  unsigned mask = 1u << R::focus | 1u << R::before;
  const unsigned place = group / 2;
  if (place >= first_polygon_place) {
    if (place == pentagon_place || place == hexagon_place) mask |= 1u << R::next_opposite;
    if (place == hexagon_place) mask |= 1u << R::next;
    return group % 2 != 0 ? mask | 1u << (R::late + 2) : mask;
  }
  if (is_closed(group)) mask |= 1u << R::next | 1u << R::next_opposite;
  if (group % 2 != 0) mask |= 7u << R::late;
  return mask;
}

namespace {

/// In 128ths. Exact for faces that are affine images of regular ones: alternating sums of all other corners,
/// or by the three before with 1 + 2 cos(360 degrees / degree), which is 1.618 for pentagons and 2 for
/// hexagons.
ValenceRows::Row plain_row_of_polygons(unsigned place) {
  ValenceRows::Row row{};
  row[R::focus] = ValenceRows::base_unit;
  row[R::before] = -ValenceRows::base_unit;
  if (place == pentagon_place) {
    row[R::focus] = 104;
    row[R::next_opposite] = row[R::before] = -40;
  } else if (place == hexagon_place) {
    row[R::next_opposite] = -ValenceRows::base_unit;
    row[R::next] = ValenceRows::base_unit;
  } else if (place == pentagon_row_place) {
    row[R::before] = -207;
  } else if (place == row_place) {
    row[R::before] = -2 * ValenceRows::base_unit;
  }
  return row;
}

}  // namespace

ValenceRows::Row ValenceRows::plain_row(unsigned group) {
  if (group / 2 >= first_polygon_place) return plain_row_of_polygons(group / 2);
  Row row{};
  const unsigned count = parallelograms(group);
  if (count == 0) return row;
  const auto add = [&](unsigned a, unsigned b, unsigned across) {
    for (const auto& [reference, sign] : {std::pair{a, 1}, {b, 1}, {across, -1}}) {
      if (reference < references)
        row[reference] = static_cast<int16_t>(row[reference] + sign * base_unit / static_cast<int>(count));
    }
  };
  add(R::focus, R::last, R::before);
  const unsigned kind = group / 2 * 2 * valence_classes;
  if (kind_is_last(kind)) add(R::focus, R::next, R::next_opposite);
  if (group % 2 != 0) add(R::late, R::late + 1, R::late + 2);
  return row;
}

ValenceRows::ValenceRows() {
  for (unsigned g = 0; g < groups; ++g) {
    rows[g] = {};
    rows[g][base] = plain_row(g);
  }
}

void ValenceRows::forget_valences() {
  for (auto& group : rows) std::fill(group.begin() + 1, group.end(), Row{});
}

template <unsigned components>
FittedRows fit_valence_rows(const FanSurface& fans, std::span<const std::array<double, components>> values,
                            const std::array<double, components>& units, bool with_valences) {
  return Fitter<components>(fans, values, units, with_valences).run();
}
template FittedRows fit_valence_rows<1>(const FanSurface&, std::span<const std::array<double, 1>>,
                                        const std::array<double, 1>&, bool);
template FittedRows fit_valence_rows<2>(const FanSurface&, std::span<const std::array<double, 2>>,
                                        const std::array<double, 2>&, bool);
template FittedRows fit_valence_rows<3>(const FanSurface&, std::span<const std::array<double, 3>>,
                                        const std::array<double, 3>&, bool);
template FittedRows fit_valence_rows<4>(const FanSurface&, std::span<const std::array<double, 4>>,
                                        const std::array<double, 4>&, bool);

ValenceWeights::ValenceWeights(const ValenceRows& from) {
  for (unsigned g = 0; g < ValenceRows::groups; ++g) {
    for (unsigned t = 0; t < terms; ++t) {
      rows[g][t] = {};
      const float unit = t == 0 ? ValenceRows::base_unit : ValenceRows::deviation_unit;
      for (unsigned r = 0; r < references; ++r) rows[g][t][r] = static_cast<float>(from.rows[g][t][r]) / unit;
    }
  }
}

}  // namespace maille
