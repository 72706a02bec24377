#include "surface/fans/valence_rows.h"

#include <algorithm>
#include <cmath>
#include <memory>

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
constexpr uint32_t samples_in_a_row = 64;
constexpr uint32_t fewest_samples = 48;

/// Weighted normal equations for all rows of a group: for each pair of terms a matrix of references.
struct Normals {
  static constexpr unsigned size = terms * references;
  std::array<std::array<double, references * references>, terms * terms> matrix{};
  std::array<double, size> right{};
  uint32_t samples = 0;
};

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
  std::array<std::array<double, components>, references> x;  ///< relative to the last reference
  std::array<double, components> target;
  std::array<double, components> last;
  std::array<double, terms> factors;
  unsigned group;
};

template <unsigned components>
class Fitter {
  using Tuple = std::array<double, components>;

 public:
  Fitter(const FanSurface& fans, std::span<const Tuple> values, const Tuple& units, bool with_valences)
      : fans_(fans),
        values_(values),
        units_(units),
        step_(std::max(1u, fans.vertices / most_samples)),
        used_terms_(with_valences ? unsigned{terms} : 1u) {
    for (unsigned g = 0; g < ValenceRows::groups; ++g) useful_.emplace_back(g);
  }

  FittedRows run() {
    const auto predicted =
        std::make_unique<std::array<std::array<double, Normals::size>, ValenceRows::groups>>();
    for (unsigned g = 0; g < ValenceRows::groups; ++g) {
      const ValenceRows::Row plain = ValenceRows::plain_row(g);
      (*predicted)[g] = {};
      for (unsigned r = 0; r < references; ++r)
        (*predicted)[g][r] = static_cast<double>(plain[r]) / ValenceRows::base_unit;
    }
    for (int round = 0; round < 3; ++round) {
      std::vector<Normals> normals(ValenceRows::groups);
      // The first rounds only say which samples lie far out.
      visit(round < 2 ? 2 : 1, [&](const Sample<components>& sample) {
        add(sample, (*predicted)[sample.group], normals[sample.group]);
      });
      for (unsigned g = 0; g < ValenceRows::groups; ++g) {
        // With the first row alone in the last round, for rows by place.
        if (normals[g].samples < (round < 2 ? fewest_samples / 2 : fewest_samples)) continue;
        solve(normals[g], g, used_terms_, (*predicted)[g]);
        if (round == 2) keep(g, (*predicted)[g], used_terms_);
        std::array<double, Normals::size> alone{};
        if (round == 2 && solve(normals[g], g, 1, alone)) alone_[g] = to_rows(alone, 1);
      }
    }
    return without_useless();
  }

 private:
  /// One of `part` of the samples.
  template <class Visit>
  void visit(uint32_t part, Visit visit) const {
    const uint32_t step = part * step_;
    // Rows of neighbours: what they refer to is near in memory.
    for (uint32_t v = 1; v < fans_.vertices;
         v += v % samples_in_a_row != 0 ? 1 : 1 + (step - 1) * samples_in_a_row) {
      Sample<components> sample;
      sample.group = ValenceRows::group_of(fans_.kinds[v]);
      const unsigned useful = ValenceRows::useful(sample.group);
      if (useful == 0) continue;
      const auto& at = fans_.references[v].at;
      const auto value = [&](uint32_t r) { return r < v ? values_[r] : Tuple{}; };
      sample.last = value(at[R::last]);
      for (unsigned r = 0; r < references; ++r) {
        sample.x[r] = {};
        if ((useful >> r & 1) == 0) continue;
        for (unsigned k = 0; k < components; ++k) sample.x[r][k] = value(at[r])[k] - sample.last[k];
      }
      for (unsigned k = 0; k < components; ++k) sample.target[k] = values_[v][k] - sample.last[k];
      const auto deviation = [&](uint32_t r) { return double{valence_deviations[fans_.valences[r]]}; };
      sample.factors = {1,
                        deviation(at[R::focus]),
                        deviation(at[R::last]),
                        deviation(at[R::before]),
                        deviation(at[R::next]),
                        deviation(v)};
      if (!ValenceRows::is_useful(sample.group, ValenceRows::by_next))
        sample.factors[ValenceRows::by_next] = 0;
      visit(sample);
    }
  }

  Tuple predict(const Sample<components>& sample, const std::array<double, Normals::size>& rows) const {
    Tuple sum{};
    const Useful& useful = useful_[sample.group];
    for (unsigned i = 0; i < useful.count; ++i) {
      const unsigned r = useful.at[i];
      double weight = 0;
      for (unsigned t = 0; t < terms; ++t) weight += sample.factors[t] * rows[t * references + r];
      for (unsigned k = 0; k < components; ++k) sum[k] += weight * sample.x[r][k];
    }
    return sum;
  }

  void add(const Sample<components>& sample, const std::array<double, Normals::size>& rows,
           Normals& normals) const {
    const Tuple predicted = predict(sample, rows);
    const Useful& useful = useful_[sample.group];
    std::array<double, references * references> matrix{};
    std::array<double, references> right{};
    for (unsigned k = 0; k < components; ++k) {
      const double weight = 1 / (std::fabs(sample.target[k] - predicted[k]) / units_[k] + 0.5);
      const double scale = weight / (units_[k] * units_[k]);
      for (unsigned i = 0; i < useful.count; ++i) {
        const double x = sample.x[useful.at[i]][k] * scale;
        for (unsigned j = 0; j <= i; ++j) matrix[i * references + j] += x * sample.x[useful.at[j]][k];
        right[i] += x * sample.target[k];
      }
    }
    for (unsigned a = 0; a < used_terms_; ++a) {
      for (unsigned b = 0; b <= a; ++b) {
        const double factor = sample.factors[a] * sample.factors[b];
        if (factor == 0) continue;
        auto& sum = normals.matrix[a * terms + b];
        for (unsigned i = 0; i < useful.count; ++i) {
          for (unsigned j = 0; j <= i; ++j) sum[i * references + j] += factor * matrix[i * references + j];
        }
      }
      for (unsigned i = 0; i < useful.count; ++i)
        normals.right[a * references + i] += sample.factors[a] * right[i];
    }
    ++normals.samples;
  }

  /// With a little added to the diagonal; false when there is nothing to solve.
  bool solve(const Normals& normals, unsigned group, unsigned used_terms,
             std::array<double, Normals::size>& solution) const {
    const Useful& useful = useful_[group];
    const unsigned m = useful.count, n = used_terms * m;
    std::vector<double> rows(size_t{n} * n), x(n);
    for (unsigned i = 0; i < n; ++i) {
      for (unsigned j = 0; j <= i; ++j) {
        const unsigned p = std::max(i % m, j % m), q = std::min(i % m, j % m);
        rows[i * n + j] = normals.matrix[i / m * terms + j / m][p * references + q];
      }
      double& diagonal = rows[i * n + i];
      diagonal = diagonal > 0 ? diagonal * (i < m ? 1 + 1e-6 : 1 + 1e-3) : 1;
      x[i] = normals.right[i / m * references + i % m];
    }
    bool solved = false;
    solve_symmetric(rows.data(), n, x.data(), 0, solved);
    if (!solved) return false;
    solution = {};
    for (unsigned i = 0; i < n; ++i) solution[i / m * references + useful.at[i % m]] = x[i];
    return true;
  }

  static std::array<ValenceRows::Row, terms> to_rows(const std::array<double, Normals::size>& solution,
                                                     unsigned used_terms) {
    std::array<ValenceRows::Row, terms> rows{};
    for (unsigned t = 0; t < used_terms; ++t) {
      const double unit = t == 0 ? ValenceRows::base_unit : ValenceRows::deviation_unit;
      for (unsigned r = 0; r < references; ++r) {
        const double weight = std::floor(solution[t * references + r] * unit + 0.5);
        rows[t][r] = static_cast<int16_t>(weight > ValenceRows::largest    ? ValenceRows::largest
                                          : weight > -ValenceRows::largest ? weight
                                                                           : -ValenceRows::largest);
      }
    }
    return rows;
  }
  void keep(unsigned group, const std::array<double, Normals::size>& solution, unsigned used_terms) {
    rows_.rows[group] = to_rows(solution, used_terms);
    rows_.level[group] = used_terms > 1 ? 2 : 1;
  }

  static std::array<double, Normals::size> from_rows(const std::array<ValenceRows::Row, terms>& rows) {
    std::array<double, Normals::size> result{};
    for (unsigned t = 0; t < terms; ++t) {
      const double unit = t == 0 ? ValenceRows::base_unit : ValenceRows::deviation_unit;
      for (unsigned r = 0; r < references; ++r) result[t * references + r] = rows[t][r] / unit;
    }
    return result;
  }
  /// About log2 of what is left, in 1/65536 bits.
  uint64_t cost(const Sample<components>& sample, const std::array<double, Normals::size>& rows) const {
    const Tuple predicted = predict(sample, rows);
    uint64_t sum = 0;
    for (unsigned k = 0; k < components; ++k) {
      const double left = std::fabs(sample.target[k] - predicted[k]) / units_[k] + 0.5;
      sum += log2_fixed(static_cast<uint32_t>(left < 4e9 ? left : 4e9) + 1);
    }
    return sum;
  }
  static uint64_t bits_of(const std::array<ValenceRows::Row, terms>& rows, unsigned group) {
    uint64_t bits = 0;
    const ValenceRows::Row plain = ValenceRows::plain_row(group);
    for (unsigned t = 0; t < terms; ++t) {
      for (unsigned r = 0; r < references; ++r) {
        const int offset = rows[t][r] - (t == 0 ? plain[r] : 0);
        if (offset != 0) bits += 3 + bit_length(static_cast<uint32_t>(offset < 0 ? -offset : offset));
      }
    }
    return bits;
  }
  FittedRows without_useless() const {
    using Solutions = std::array<std::array<double, Normals::size>, ValenceRows::groups>;
    std::array<std::array<uint64_t, ValenceRows::groups>, 3> costs{};
    std::array<std::unique_ptr<Solutions>, 3> rows;
    for (auto& one : rows) one = std::make_unique<Solutions>();
    for (unsigned g = 0; g < ValenceRows::groups; ++g) {
      std::array<ValenceRows::Row, terms> plain{};
      plain[0] = ValenceRows::plain_row(g);
      (*rows[0])[g] = from_rows(plain);
      (*rows[1])[g] = from_rows(alone_[g]);
      (*rows[2])[g] = from_rows(rows_.rows[g]);
    }
    const unsigned levels = used_terms_ > 1 ? 3 : 2;
    visit(1, [&](const Sample<components>& sample) {
      if (rows_.level[sample.group] == 0) return;
      for (unsigned l = 0; l < levels; ++l)
        costs[l][sample.group] += step_ * cost(sample, (*rows[l])[sample.group]);
    });
    FittedRows fitted;
    fitted.by_place.polygons = fitted.by_valence.polygons = !fans_.offsets.empty();
    for (unsigned g = 0; g < ValenceRows::groups; ++g) {
      if (rows_.level[g] == 0) continue;
      costs[1][g] += bits_of(alone_[g], g) << 16;
      costs[2][g] += bits_of(rows_.rows[g], g) << 16;
      const unsigned by_place = costs[1][g] < costs[0][g] ? 1 : 0;
      const unsigned by_valence = levels == 3 && costs[2][g] < costs[by_place][g] ? 2 : by_place;
      keep(fitted.by_place, g, by_place);
      keep(fitted.by_valence, g, by_valence);
      fitted.bits_by_place += static_cast<double>(costs[by_place][g]) / 65536;
      fitted.bits_by_valence += static_cast<double>(costs[by_valence][g]) / 65536;
    }
    return fitted;
  }
  void keep(ValenceRows& to, unsigned group, unsigned level) const {
    to.level[group] = static_cast<uint8_t>(level);
    if (level == 1) to.rows[group] = alone_[group];
    if (level == 2) to.rows[group] = rows_.rows[group];
  }

  const FanSurface& fans_;
  std::span<const Tuple> values_;
  Tuple units_;
  uint32_t step_;
  unsigned used_terms_;
  std::vector<Useful> useful_;
  ValenceRows rows_;
  std::array<std::array<ValenceRows::Row, terms>, ValenceRows::groups> alone_{};
};

}  // namespace

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
