#include "entropy/static_rans.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/bytes.h"
#include "entropy/bit_model.h"
#include "entropy/integer_model.h"

namespace maille {
namespace {

// 2^(k/16) * 2^15.
constexpr uint32_t sixteenths[16] = {32768, 34219, 35734, 37316, 38968, 40693, 42495, 44376,
                                     46341, 48393, 50535, 52773, 55109, 57549, 60097, 62757};

/// A distribution as a table stores it: for each symbol its level, 0 for one that does not occur, else 1 +
/// the distance from the most frequent symbol in steps of 1/resolution octaves.
using Levels = std::array<uint8_t, most_static_symbols>;
constexpr unsigned deepest_level(unsigned resolution) {
  return 10 * resolution + 1;
}

/// 2^(-(level - 1) / resolution) * 2^30.
uint64_t weight_of(unsigned level, unsigned resolution) {
  const unsigned below = (level - 1) * (16 / resolution);
  const unsigned octaves = (below + 15) / 16;
  return (uint64_t{sixteenths[octaves * 16 - below]} << 15) >> octaves;
}

Frequencies frequencies_of(const Levels& levels, unsigned symbols, unsigned resolution, unsigned bits) {
  Frequencies result;
  uint64_t sum = 0;
  std::array<uint64_t, most_static_symbols> weights;
  for (unsigned s = 0; s < symbols; ++s) {
    weights[s] = levels[s] == 0 ? 0 : weight_of(levels[s], resolution);
    sum += weights[s];
  }
  const uint32_t slots = 1u << bits;
  if (sum == 0) {
    result.frequency[0] = static_cast<uint16_t>(slots);
    return result;
  }
  uint32_t given = 0;
  for (unsigned s = 0; s < symbols; ++s) {
    if (levels[s] == 0) continue;
    const uint64_t share = weights[s] * slots / sum;
    result.frequency[s] = static_cast<uint16_t>(std::max<uint64_t>(share, 1));
    given += result.frequency[s];
  }
  // What rounding left goes to the first of the most frequent symbols, what it took comes from these.
  const auto most = [&] {
    return std::max_element(result.frequency.begin(), result.frequency.begin() + symbols);
  };
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

Levels levels_of(const Histogram& counts, unsigned symbols, unsigned resolution) {
  Levels levels{};
  const uint32_t most = *std::max_element(counts.begin(), counts.begin() + symbols);
  for (unsigned s = 0; s < symbols; ++s) {
    if (counts[s] == 0) continue;
    const uint32_t below = log2_fixed(most) - log2_fixed(counts[s]);
    const uint32_t steps = (below * resolution + (1 << 15)) >> 16;
    levels[s] = static_cast<uint8_t>(1 + std::min(steps, deepest_level(resolution) - 1));
  }
  return levels;
}

/// Levels lie near those of the table before, or of the symbol before.
class LevelCoder {
 public:
  LevelCoder(unsigned symbols, unsigned resolution) : symbols_(symbols), resolution_(resolution) {}

  template <class Coder>
  void code(Coder& coder, Levels& levels) {
    unsigned last = 0;
    bool first = true;
    for (unsigned s = 0; s < symbols_; ++s) {
      const unsigned seen = before_[s] != 0;
      const unsigned neighbour = s > 0 && levels[s - 1] != 0;
      const bool there = there_[2 * seen + neighbour].code(coder, levels[s] != 0);
      if (!there) {
        levels[s] = 0;
        continue;
      }
      const unsigned expected = seen ? before_[s] : first ? resolution_ : last;
      const int32_t step =
          step_[seen].code(coder, static_cast<int32_t>(levels[s]) - static_cast<int32_t>(expected));
      const int32_t level = static_cast<int32_t>(expected) + step;
      levels[s] =
          static_cast<uint8_t>(std::clamp(level, 1, static_cast<int32_t>(deepest_level(resolution_))));
      last = levels[s];
      first = false;
    }
    for (unsigned s = 0; s < symbols_; ++s) {
      if (levels[s] != 0) before_[s] = levels[s];
    }
  }

 private:
  unsigned symbols_;
  unsigned resolution_;
  Levels before_{};
  std::array<BitModel, 4> there_;
  std::array<OffsetModel, 2> step_;
};

constexpr unsigned resolutions[] = {1, 2, 4, 8, 16};

struct TableCoder {
  uint32_t resolution = 2;  // index into resolutions
  uint32_t count = 1;
  std::vector<uint8_t> table_of;
  std::vector<Levels> levels;

  template <class Coder>
  void code(Coder& coder, unsigned symbols, unsigned most_tables) {
    resolution = coder.code_raw(resolution, 3);
    if (resolution > 4) resolution = 4;
    CountModel number;
    count = std::min(number.code(coder, count - 1), most_tables - 1) + 1;
    code_map(coder);
    levels.resize(count);
    LevelCoder level_coder(symbols, resolutions[resolution]);
    for (Levels& one : levels) level_coder.code(coder, one);
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

uint64_t entropy(const Histogram& counts, unsigned symbols) {
  uint32_t sum = 0;
  for (unsigned s = 0; s < symbols; ++s) sum += counts[s];
  uint64_t bits = 0;
  for (unsigned s = 0; s < symbols; ++s)
    bits += uint64_t{counts[s]} * (log2_fixed(sum) - log2_fixed(counts[s]));
  return bits;
}

/// What a table takes beside its symbols, roughly: a few bits for each symbol that occurs, and the price of
/// reading it and laying it out.
uint64_t table_cost(const Histogram& counts, unsigned symbols, uint64_t price) {
  uint64_t used = 0;
  for (unsigned s = 0; s < symbols; ++s) used += counts[s] != 0;
  return (4 * used + price) << 16;
}

uint64_t total_of(const Histogram& counts) {
  return std::accumulate(counts.begin(), counts.end(), uint64_t{0});
}
void add_to(Histogram& sum, const Histogram& counts) {
  for (unsigned s = 0; s < most_static_symbols; ++s) sum[s] += counts[s];
}

/// What symbols of others would cost with the distribution of a cluster, in 1/65536 bits each. What does not
/// occur there is as likely as an eighth of a symbol.
using SymbolCosts = std::array<uint32_t, most_static_symbols>;
SymbolCosts costs_of(const Histogram& cluster, unsigned symbols) {
  SymbolCosts costs{};
  const auto total = static_cast<uint32_t>(std::min<uint64_t>(8 * total_of(cluster) + symbols, UINT32_MAX));
  for (unsigned s = 0; s < symbols; ++s)
    costs[s] = log2_fixed(total) - log2_fixed(std::min<uint32_t>(cluster[s], UINT32_MAX / 16) * 8 + 1);
  return costs;
}

/// Contexts that share a table. There may be thousands of contexts: the ones that occur most become clusters,
/// the others go with the one that suits them, clusters are merged greedily, and then each context looks
/// again.
class Clustering {
 public:
  Clustering(std::span<const Histogram> counts, unsigned symbols, uint64_t price)
      : counts_(counts), symbols_(symbols), price_(price), cluster_(counts.size(), unused) {
    std::vector<std::pair<uint64_t, uint32_t>> order;
    for (uint32_t i = 0; i < counts.size(); ++i) {
      if (const uint64_t total = total_of(counts[i]); total > 0) order.push_back({total, i});
    }
    std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
      return std::pair(b.first, a.second) < std::pair(a.first, b.second);
    });
    size_t clusters = std::min(order.size(), most_clusters);
    while (clusters > 1 && order[clusters - 1].first < least_count) --clusters;
    order.resize(clusters);
    for (const auto& [total, context] : order)
      nodes_.push_back({counts[context], cost(counts[context]), true});
    join(0);
    for (Node& node : nodes_) node.cost = cost(node.counts);
    gains_.assign(nodes_.size() * nodes_.size(), 0);
    for (size_t a = 0; a < nodes_.size(); ++a) {
      for (size_t b = a + 1; b < nodes_.size(); ++b) update(a, b);
    }
  }

  /// Merges those first that lose least by it.
  void run(unsigned most) {
    for (;;) {
      size_t alive = 0;
      for (const Node& node : nodes_) alive += node.alive;
      int64_t best = alive > most ? INT64_MIN : 0;
      size_t best_a = 0, best_b = 0;
      for (size_t a = 0; a < nodes_.size(); ++a) {
        if (!nodes_[a].alive) continue;
        for (size_t b = a + 1; b < nodes_.size(); ++b) {
          if (!nodes_[b].alive || gain(a, b) <= best) continue;
          best = gain(a, b);
          best_a = a;
          best_b = b;
        }
      }
      if (best_a == best_b) break;
      merge(best_a, best_b);
    }
    std::erase_if(nodes_, [](const Node& node) { return !node.alive; });
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
    uint64_t cost;
    bool alive;
  };
  static constexpr uint32_t unused = 0xffffffff;
  // Twice as many as the most tables that fans have. Merging takes their square.
  static constexpr size_t most_clusters = 64;
  // Contexts that occur less often could not pay for a table of their own.
  static constexpr uint64_t least_count = 16;
  // Another table than that of the context before begins a run of the map: about a byte.
  static constexpr uint64_t run_price = 8 << 16;

  /// Each context goes with the cluster that suits it; `run_price`: for another one than that of the context
  /// before.
  void join(uint64_t run_price) {
    std::vector<SymbolCosts> costs;
    for (const Node& node : nodes_) costs.push_back(costs_of(node.counts, symbols_));
    for (Node& node : nodes_) node.counts = {};
    uint32_t before = unused;
    std::vector<std::pair<unsigned, uint64_t>> occurring;
    for (size_t i = 0; i < counts_.size(); ++i) {
      occurring.clear();
      for (unsigned s = 0; s < symbols_; ++s) {
        if (counts_[i][s] > 0) occurring.push_back({s, counts_[i][s]});
      }
      if (occurring.empty()) continue;
      uint64_t best = UINT64_MAX;
      for (uint32_t n = 0; n < costs.size(); ++n) {
        uint64_t cost = n == before ? 0 : run_price;
        for (const auto& [symbol, count] : occurring) cost += count * costs[n][symbol];
        if (cost >= best) continue;
        best = cost;
        cluster_[i] = n;
      }
      before = cluster_[i];
      add_to(nodes_[before].counts, counts_[i]);
    }
  }

  uint64_t cost(const Histogram& counts) const {
    return entropy(counts, symbols_) + table_cost(counts, symbols_, price_);
  }
  int64_t& gain(size_t a, size_t b) { return gains_[a * nodes_.size() + b]; }
  Histogram sum(size_t a, size_t b) const {
    Histogram result = nodes_[a].counts;
    add_to(result, nodes_[b].counts);
    return result;
  }
  void update(size_t a, size_t b) {
    if (!nodes_[a].alive || !nodes_[b].alive) return;
    gain(a, b) =
        static_cast<int64_t>(nodes_[a].cost + nodes_[b].cost) - static_cast<int64_t>(cost(sum(a, b)));
  }
  void merge(size_t a, size_t b) {
    nodes_[a].counts = sum(a, b);
    nodes_[a].cost = cost(nodes_[a].counts);
    nodes_[b].alive = false;
    for (size_t i = 0; i < nodes_.size(); ++i) {
      if (i != a) update(std::min(i, a), std::max(i, a));
    }
  }

  std::span<const Histogram> counts_;
  unsigned symbols_;
  uint64_t price_;
  std::vector<Node> nodes_;
  std::vector<uint32_t> cluster_;  // by context
  std::vector<int64_t> gains_;
};

StaticTables tables_of(const TableCoder& coded, unsigned symbols, unsigned bits) {
  StaticTables result{bits, symbols, coded.table_of, {}};
  for (const Levels& levels : coded.levels) {
    result.tables.push_back(frequencies_of(levels, symbols, resolutions[coded.resolution], bits));
  }
  return result;
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

std::vector<Histogram> merge_alike(std::span<const Histogram> counts, unsigned symbols, unsigned most_tables,
                                   uint64_t price, std::vector<uint8_t>& table_of) {
  Clustering clustering(counts, symbols, price);
  clustering.run(most_tables);
  return clustering.result(table_of);
}

StaticTables write_tables(std::span<const Histogram> counts, std::vector<uint8_t> table_of, unsigned symbols,
                          unsigned bits, unsigned most_tables, RansEncoder& coder) {
  TableCoder coded;
  coded.table_of = std::move(table_of);
  coded.count = static_cast<uint32_t>(counts.size());
  uint64_t best_cost = UINT64_MAX;
  TableCoder best;
  for (coded.resolution = 0; coded.resolution < 5; ++coded.resolution) {
    coded.levels.clear();
    for (const Histogram& histogram : counts)
      coded.levels.push_back(levels_of(histogram, symbols, resolutions[coded.resolution]));
    RansEncoder trial;
    TableCoder written = coded;
    written.code(trial, symbols, most_tables);
    uint64_t cost = uint64_t{trial.finish().size()} << 19;
    const StaticTables tables = tables_of(written, symbols, bits);
    for (size_t i = 0; i < counts.size(); ++i) cost += cost_of(counts[i], tables.tables[i], bits);
    if (cost >= best_cost) continue;
    best_cost = cost;
    best = coded;
  }
  best.code(coder, symbols, most_tables);
  return tables_of(best, symbols, bits);
}

StaticTables make_tables(std::span<const Histogram> counts, unsigned symbols, unsigned bits,
                         unsigned most_tables, RansEncoder& coder, uint64_t price) {
  std::vector<uint8_t> table_of;
  const auto merged = merge_alike(counts, symbols, most_tables, price, table_of);
  return write_tables(merged, std::move(table_of), symbols, bits, most_tables, coder);
}

StaticTables read_tables(size_t contexts, unsigned symbols, unsigned bits, unsigned most_tables,
                         RansDecoder& coder) {
  TableCoder coded;
  coded.table_of.resize(contexts);
  coded.code(coder, symbols, most_tables);
  return tables_of(coded, symbols, bits);
}

std::vector<std::byte> StaticRansEncoder::finish() {
  uint64_t state = lowest_static_state;
  std::vector<uint32_t> words;
  for (size_t i = operations_.size(); i-- > 0;) {
    const auto [start, frequency, bits] = operations_[i];
    if (state >> (63 - bits) >= frequency) {
      words.push_back(static_cast<uint32_t>(state));
      state >>= 32;
    }
    state = (state / frequency << bits) + state % frequency + start;
  }
  ByteWriter out;
  out.put(state);
  for (size_t i = words.size(); i-- > 0;) out.put(words[i]);
  return out.take();
}

StaticRansDecoder::StaticRansDecoder(Bytes bytes) : words{bytes.data(), bytes.data() + bytes.size()} {
  if (bytes.size() < 8) {
    exhausted_ = true;
    state = lowest_static_state;
    return;
  }
  state = load<uint64_t>(words.next);
  words.next += 8;
}

}  // namespace maille
