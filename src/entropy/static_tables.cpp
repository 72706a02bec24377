#include "entropy/static_tables.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <utility>

#include "base/lanes.h"
#include "entropy/bit_model.h"
#include "entropy/integer_model.h"

namespace maille {
namespace {

// 2^(k/16) * 2^15.
constexpr uint32_t sixteenths[16] = {32768, 34219, 35734, 37316, 38968, 40693, 42495, 44376,
                                     46341, 48393, 50535, 52773, 55109, 57549, 60097, 62757};

/// A distribution as a table stores it: for each symbol its depth, 0 for one that does not occur, else 1 +
/// the distance from the most frequent symbol in steps of 1/resolution octaves.
using Depths = std::array<uint8_t, most_static_symbols>;
/// Ten octaves below the most frequent: tables have 2^10 slots at most, so that rarer symbols get one slot
/// anyway.
constexpr unsigned deepest(unsigned resolution) {
  return 10 * resolution + 1;
}

/// 2^(-(depth - 1) / resolution) * 2^30. Integers only: both sides derive frequencies from depths, and must
/// agree.
uint64_t weight_of(unsigned depth, unsigned resolution) {
  const unsigned below = (depth - 1) * (16 / resolution);
  const unsigned octaves = (below + 15) / 16;
  return (uint64_t{sixteenths[octaves * 16 - below]} << 15) >> octaves;
}

/// Frequencies that sum up to 2^bits, at least 1 for each symbol that occurs, whatever the depths are.
Frequencies frequencies_of(const Depths& depths, unsigned symbols, unsigned resolution, unsigned bits) {
  Frequencies result;
  uint64_t sum = 0;
  std::array<uint64_t, most_static_symbols> weights;
  for (unsigned s = 0; s < symbols; ++s) {
    weights[s] = depths[s] == 0 ? 0 : weight_of(depths[s], resolution);
    sum += weights[s];
  }
  const uint32_t slots = 1u << bits;
  if (sum == 0) {
    result.frequency[0] = static_cast<uint16_t>(slots);
    return result;
  }
  uint32_t given = 0;
  for (unsigned s = 0; s < symbols; ++s) {
    if (depths[s] == 0) continue;
    const uint64_t share = weights[s] * slots / sum;
    result.frequency[s] = static_cast<uint16_t>(std::max<uint64_t>(share, 1));
    given += result.frequency[s];
  }
  // What rounding left goes to the first of the most frequent symbols, what it took comes from these.
  const auto most = [&] {
    return std::max_element(result.frequency.begin(), result.frequency.begin() + symbols);
  };
  // Ends with all at least 1, as there are no more symbols than slots.
  for (; given > slots; --given) --*most();
  const auto first = most();
  *first = static_cast<uint16_t>(*first + slots - given);
  uint32_t start = 0;
  for (unsigned s = 0; s < symbols; ++s) {
    result.start[s] = static_cast<uint16_t>(start);
    start += result.frequency[s];
  }
  return result;
}

Depths depths_of(const Histogram& counts, unsigned symbols, unsigned resolution) {
  Depths depths{};
  const uint32_t most = *std::max_element(counts.begin(), counts.begin() + symbols);
  for (unsigned s = 0; s < symbols; ++s) {
    if (counts[s] == 0) continue;
    const uint32_t below = log2_fixed(most) - log2_fixed(counts[s]);
    const uint32_t steps = (below * resolution + (1 << 15)) >> 16;
    depths[s] = static_cast<uint8_t>(1 + std::min(steps, deepest(resolution) - 1));
  }
  return depths;
}

/// Depths lie near those of the table before, or of the symbol before.
class DepthCoder {
 public:
  DepthCoder(unsigned symbols, unsigned resolution) : symbols_(symbols), resolution_(resolution) {}

  template <class Coder>
  void code(Coder& coder, Depths& depths) {
    unsigned last = 0;
    bool first = true;
    for (unsigned s = 0; s < symbols_; ++s) {
      const unsigned seen = before_[s] != 0;
      const unsigned neighbour = s > 0 && depths[s - 1] != 0;
      const bool there = there_[2 * seen + neighbour].code(coder, depths[s] != 0);
      if (!there) {
        depths[s] = 0;
        continue;
      }
      const unsigned expected = seen ? before_[s] : first ? resolution_ : last;
      const int32_t step =
          step_[seen].code(coder, static_cast<int32_t>(depths[s]) - static_cast<int32_t>(expected));
      const int32_t depth = static_cast<int32_t>(expected) + step;
      depths[s] = static_cast<uint8_t>(std::clamp(depth, 1, static_cast<int32_t>(deepest(resolution_))));
      last = depths[s];
      first = false;
    }
    for (unsigned s = 0; s < symbols_; ++s) {
      if (depths[s] != 0) before_[s] = depths[s];
    }
  }

 private:
  unsigned symbols_;
  unsigned resolution_;
  Depths before_{};
  std::array<BitModel, 4> there_;
  std::array<OffsetModel, 2> step_;
};

constexpr unsigned resolutions[] = {1, 2, 4, 8, 16};

/// Tables and their contexts as a file has them: one list of steps for both directions. What is read is
/// clamped to what can be, so that any bytes give tables.
struct TableCoder {
  uint32_t resolution = 2;  // index into resolutions
  uint32_t count = 1;
  std::vector<uint8_t> table_of;
  std::vector<Depths> depths;

  template <class Coder>
  void code(Coder& coder, unsigned symbols, unsigned most_tables) {
    resolution = coder.code_raw(resolution, 3);
    if (resolution > 4) resolution = 4;
    CountModel number;
    count = std::min(number.code(coder, count - 1), most_tables - 1) + 1;
    code_map(coder);
    depths.resize(count);
    DepthCoder depth_coder(symbols, resolutions[resolution]);
    for (Depths& one : depths) depth_coder.code(coder, one);
  }

  /// Runs of contexts with one table: there may be thousands of contexts, and tens of runs. Tables are
  /// numbered in the order of their first contexts.
  template <class Coder>
  void code_map(Coder& coder) {
    if (count == 1) {
      std::fill(table_of.begin(), table_of.end(), uint8_t{0});
      return;
    }
    BitModel is_new;
    CountModel which, length;
    uint32_t known = 0;
    for (size_t begin = 0, end = 0; begin < table_of.size(); begin = end) {
      uint32_t table = table_of[begin];
      if (known == 0 || (known < count && is_new.code(coder, table == known))) {
        table = known++;
      } else {
        table = std::min(which.code(coder, table), known - 1);
      }
      while (end < table_of.size() && table_of[end] == table) ++end;
      const uint64_t more = length.code(coder, static_cast<uint32_t>(end - begin - 1));
      end = static_cast<size_t>(std::min<uint64_t>(begin + 1 + more, table_of.size()));
      std::fill(table_of.begin() + static_cast<std::ptrdiff_t>(begin),
                table_of.begin() + static_cast<std::ptrdiff_t>(end), static_cast<uint8_t>(table));
    }
  }
};

/// What a table takes for each symbol that occurs, in bits, roughly; and what one more must save beyond that:
/// a microsecond of a decoder's time, which fills its slots. Chosen, not swept; with six times the price the
/// smallest meshes decoded 8 to 14 % faster and were 0.1 to 1.8 % larger (230f8d1, effort 1 of then).
constexpr uint64_t bits_of_symbol = 4, price_of_table = 80;

uint64_t total_of(const Histogram& counts) {
  return std::accumulate(counts.begin(), counts.end(), uint64_t{0});
}
void add_to(Histogram& sum, const Histogram& counts) {
  for (unsigned s = 0; s < most_static_symbols; ++s) sum[s] += counts[s];
}

/// Contexts that share a table. There may be thousands of contexts: the ones that occur most become clusters,
/// the others go with the one that suits them, clusters are merged greedily, and then each context looks
/// again. Over 29 meshes this was 0.6 % (-2) and 0.4 % (-5) smaller than k-means over a grid of contexts
/// (d79ea1e).
class Clustering {
 public:
  Clustering(std::span<const Histogram> counts, unsigned symbols)
      : counts_(counts), symbols_(symbols), cluster_(counts.size(), unused) {
    std::vector<std::pair<uint64_t, uint32_t>> order;
    for (uint32_t i = 0; i < counts.size(); ++i) {
      const uint64_t total = total_of(counts[i]);
      if (total == 0) continue;
      order.push_back({total, i});
      for (uint32_t s = 0; s < symbols; ++s) {
        if (counts[i][s] > 0) occurring_.push_back({i, s, counts[i][s]});
      }
    }
    // The most frequent first, of equal ones the first context: a total order.
    std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
      return std::pair(b.first, a.second) < std::pair(a.first, b.second);
    });
    size_t clusters = std::min(order.size(), most_clusters);
    while (clusters > 1 && order[clusters - 1].first < least_count) --clusters;
    order.resize(clusters);
    for (const auto& [total, context] : order) nodes_.push_back({counts[context], {}, 0, 0});
    join(0);
    for (Node& node : nodes_) weigh(node);
    gains_.assign(most_clusters * most_clusters, 0);
    for (size_t a = 0; a < nodes_.size(); ++a) {
      for (size_t b = a + 1; b < nodes_.size(); ++b) update(a, b);
    }
  }

  /// Merges those first that lose least by it.
  void run(unsigned most) {
    for (;;) {
      int64_t best = nodes_.size() > most ? INT64_MIN : 0;
      size_t best_a = 0, best_b = 0;
      for (size_t a = 0; a < nodes_.size(); ++a) {
        for (size_t b = a + 1; b < nodes_.size(); ++b) {
          if (gain(a, b) <= best) continue;
          best = gain(a, b);
          best_a = a;
          best_b = b;
        }
      }
      if (best_a == best_b) break;
      merge(best_a, best_b);
    }
    // Two rounds, as in k-means: the first goes by the merged clusters, the second by what the first made of
    // them.
    for (int round = 0; round < 2; ++round) join(run_price);
  }

  /// Clusters numbered by their first contexts; contexts that never occur go with the one before.
  std::vector<Histogram> result(std::vector<uint8_t>& table_of) const {
    std::vector<Histogram> merged;
    std::vector<uint32_t> number(nodes_.size(), unused);
    uint8_t before = 0;
    for (const uint32_t cluster : cluster_) {
      if (cluster != unused) {
        if (number[cluster] == unused) {
          number[cluster] = static_cast<uint32_t>(merged.size());
          merged.push_back(nodes_[cluster].counts);
        }
        before = static_cast<uint8_t>(number[cluster]);
      }
      table_of.push_back(before);
    }
    if (merged.empty()) merged.emplace_back();
    return merged;
  }

 private:
  struct Node {
    Histogram counts;
    std::array<uint64_t, most_static_symbols> weights;  ///< n log2(n) of each count
    uint64_t there;                                     ///< which symbols, as bits
    uint32_t total;
  };
  struct Occurring {
    uint32_t context, symbol, count;
  };
  static constexpr uint32_t unused = 0xffffffff;
  // Twice as many as the most tables that fans have. Merging takes their square: 2,016 pairs.
  static constexpr size_t most_clusters = 64;
  // Contexts that occur less often could not pay for a table of their own.
  static constexpr uint64_t least_count = 32;
  // Another table than that of the context before begins a run of the map: about a byte.
  static constexpr float run_price = 8;

  /// Each context goes with the cluster that suits it; `run_price`: for another one than that of the context
  /// before.
  void join(float run_price) {
    // By symbol, then cluster: a context has few symbols, and asks all clusters about each.
    using Costs = std::array<FloatLanes, most_clusters / 4>;
    std::vector<Costs> costs(symbols_);
    for (size_t n = 0; n < nodes_.size(); ++n) set_costs(nodes_[n].counts, n, costs);
    for (Node& node : nodes_) node.counts = {};
    const size_t lanes = (nodes_.size() + 3) / 4;
    uint32_t before = unused;
    for (size_t i = 0; i < occurring_.size();) {
      const uint32_t context = occurring_[i].context;
      Costs cost;
      cost.fill(FloatLanes{} + run_price);
      if (before != unused) cost[before / 4][before % 4] = 0;
      for (; i < occurring_.size() && occurring_[i].context == context; ++i) {
        const auto& [at, symbol, count] = occurring_[i];
        const FloatLanes times = FloatLanes{} + static_cast<float>(count);
        for (size_t l = 0; l < lanes; ++l) cost[l] += times * costs[symbol][l];
      }
      uint32_t least = 0;
      for (uint32_t n = 1; n < nodes_.size(); ++n)
        if (cost[n / 4][n % 4] < cost[least / 4][least % 4]) least = n;
      before = cluster_[context] = least;
      add_to(nodes_[least].counts, counts_[context]);
    }
  }
  /// What symbols of others would cost with the distribution of a cluster, in bits each. What does not occur
  /// there is as likely as an eighth of a symbol.
  template <class Costs>
  void set_costs(const Histogram& counts, size_t n, std::vector<Costs>& costs) {
    const auto total = static_cast<uint32_t>(std::min<uint64_t>(8 * total_of(counts) + symbols_, UINT32_MAX));
    const uint32_t of_all = log2_fixed(total);
    for (unsigned s = 0; s < symbols_; ++s) {
      const uint32_t bits = of_all - log2_fixed(std::min<uint32_t>(counts[s], UINT32_MAX / 16) * 8 + 1);
      costs[s][n / 4][n % 4] = static_cast<float>(static_cast<int32_t>(bits)) / 65536;
    }
  }

  static uint64_t log_weight(uint32_t count) {
    static const auto of_small = [] {
      std::array<uint32_t, 4096> table{};
      for (uint32_t n = 0; n < table.size(); ++n) table[n] = n * log2_fixed(n);
      return table;
    }();
    return count < of_small.size() ? of_small[count] : uint64_t{count} * log2_fixed(count);
  }
  void weigh(Node& node) const {
    node.total = 0;
    node.there = 0;
    for (unsigned s = 0; s < symbols_; ++s) {
      node.there |= uint64_t{node.counts[s] > 0} << s;
      node.total += node.counts[s];
      node.weights[s] = log_weight(node.counts[s]);
    }
  }
  int64_t& gain(size_t a, size_t b) { return gains_[a * most_clusters + b]; }
  /// What one table in place of two saves: its price and its symbols, less what all symbols cost more. Only
  /// symbols that both have change the sum of n log2(n).
  void update(size_t a, size_t b) {
    const Node &one = nodes_[a], &other = nodes_[b];
    // A table costs its symbols N log2(N) - sum of n log2(n), in 1/65536 bits; the difference is negative and
    // wraps around until it is read as signed.
    uint64_t saved = log_weight(one.total) + log_weight(other.total) - log_weight(one.total + other.total);
    saved += price_of_table << 16;
    for (uint64_t both = one.there & other.there; both != 0; both &= both - 1) {
      const auto s = static_cast<unsigned>(std::countr_zero(both));
      saved += log_weight(one.counts[s] + other.counts[s]) - one.weights[s] - other.weights[s];
      saved += bits_of_symbol << 16;
    }
    gain(a, b) = static_cast<int64_t>(saved);
  }
  void merge(size_t a, size_t b) {
    add_to(nodes_[a].counts, nodes_[b].counts);
    weigh(nodes_[a]);
    // The last one takes the place of the other.
    nodes_[b] = nodes_.back();
    nodes_.pop_back();
    for (size_t i = 0; i < nodes_.size() && b < nodes_.size(); ++i) {
      if (i != b) gain(std::min(i, b), std::max(i, b)) = gain(i, nodes_.size());
    }
    for (size_t i = 0; i < nodes_.size(); ++i) {
      if (i != a) update(std::min(i, a), std::max(i, a));
    }
  }

  std::span<const Histogram> counts_;
  unsigned symbols_;
  std::vector<Occurring> occurring_;  // by context, then symbol
  std::vector<Node> nodes_;
  std::vector<uint32_t> cluster_;  // by context
  std::vector<int64_t> gains_;
};

StaticTables tables_of(const TableCoder& coded, unsigned symbols, unsigned bits) {
  StaticTables result{bits, symbols, coded.table_of, {}};
  for (const Depths& depths : coded.depths) {
    result.tables.push_back(frequencies_of(depths, symbols, resolutions[coded.resolution], bits));
  }
  return result;
}

/// Finer depths make symbols smaller and tables larger.
TableCoder best_resolution(TableCoder coded, std::span<const Histogram> counts, unsigned symbols,
                           unsigned bits, unsigned most_tables) {
  uint64_t best_cost = UINT64_MAX;
  TableCoder best;
  for (coded.resolution = 0; coded.resolution < std::size(resolutions); ++coded.resolution) {
    coded.depths.clear();
    for (const Histogram& histogram : counts)
      coded.depths.push_back(depths_of(histogram, symbols, resolutions[coded.resolution]));
    RansEncoder trial;
    TableCoder written = coded;
    written.code(trial, symbols, most_tables);
    // Bytes as 1/65536 bits.
    uint64_t cost = uint64_t{trial.finish().size()} << 19;
    const StaticTables tables = tables_of(written, symbols, bits);
    for (size_t i = 0; i < counts.size(); ++i) cost += cost_of(counts[i], tables.tables[i], bits);
    // Costs fall and then rise with the resolution, nearly always, so the first rise ends the search
    // (9d88ba9).
    if (cost >= best_cost) break;
    best_cost = cost;
    best = coded;
  }
  return best;
}

void make_possible(std::vector<Histogram>& counts, unsigned symbols) {
  for (unsigned s = 0; s < symbols; ++s) {
    // Of small alphabets all, of large ones the last, which stands for any.
    const bool occurs = symbols <= 16 || s + 1 == symbols ||
                        std::any_of(counts.begin(), counts.end(), [s](auto& one) { return one[s] != 0; });
    for (Histogram& one : counts) one[s] = std::max(one[s], uint32_t{occurs});
  }
}

}  // namespace

uint32_t log2_fixed(uint32_t n) {
  // The fraction of 12 leading bits, by squaring.
  static const auto fractions = [] {
    std::array<uint16_t, 4096> table{};
    for (uint32_t i = 0; i < 4096; ++i) {
      uint64_t x = uint64_t{4096 + i} << 19;  // 1.0 is 2^31
      uint32_t bits = 0;
      for (int b = 0; b < 16; ++b) {
        x = (x * x) >> 31;
        bits = bits << 1 | static_cast<uint32_t>(x >> 32);
        if ((x >> 32) != 0) x >>= 1;
      }
      table[i] = static_cast<uint16_t>(bits);
    }
    return table;
  }();
  if (n == 0) return 0;
  const unsigned exponent = bit_length(n) - 1;
  const uint32_t mantissa = exponent >= 12 ? n >> (exponent - 12) : n << (12 - exponent);
  return exponent << 16 | fractions[mantissa & 4095];
}

void spread_symbols(std::span<Histogram> counts, unsigned symbols, bool rising) {
  std::array<bool, most_static_symbols> occurs{};
  unsigned end = 0;
  for (const Histogram& histogram : counts) {
    for (unsigned s = 0; s < symbols; ++s) {
      if (histogram[s] == 0) continue;
      occurs[s] = true;
      end = std::max(end, s + 1);
    }
  }
  for (Histogram& histogram : counts) {
    const auto seen = [](uint32_t count) { return count != 0; };
    if (std::none_of(histogram.begin(), histogram.end(), seen)) continue;
    for (unsigned s = 0; s < symbols; ++s) {
      if (histogram[s] == 0 && (occurs[s] || (rising && s <= end))) histogram[s] = 1;
    }
  }
}

uint64_t cost_of(const Histogram& counts, const Frequencies& table, unsigned bits) {
  uint64_t cost = 0;
  for (unsigned s = 0; s < most_static_symbols; ++s) {
    if (counts[s] != 0) cost += uint64_t{counts[s]} * ((bits << 16) - log2_fixed(table.frequency[s]));
  }
  return cost;
}

StaticTables make_tables(std::span<const Histogram> counts, unsigned symbols, unsigned bits,
                         unsigned most_tables, RansEncoder& coder, bool shared) {
  Clustering clustering(counts, symbols);
  clustering.run(most_tables);
  TableCoder coded;
  std::vector<Histogram> merged = clustering.result(coded.table_of);
  if (shared) make_possible(merged, symbols);
  coded.count = static_cast<uint32_t>(merged.size());
  coded = best_resolution(std::move(coded), merged, symbols, bits, most_tables);
  coded.code(coder, symbols, most_tables);
  return tables_of(coded, symbols, bits);
}

StaticTables read_tables(size_t contexts, unsigned symbols, unsigned bits, unsigned most_tables,
                         RansDecoder& coder) {
  TableCoder coded;
  coded.table_of.resize(contexts);
  coded.code(coder, symbols, most_tables);
  return tables_of(coded, symbols, bits);
}

}  // namespace maille
