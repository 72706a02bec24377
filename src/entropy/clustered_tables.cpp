#include "entropy/clustered_tables.h"

#include <algorithm>
#include <numeric>

#include "entropy/integer_model.h"

namespace maille {
namespace {

/// The table of each context, in rows of a grid: mostly that of the context to the left or above.
template <class Coder>
void code_map(Coder& coder, std::vector<uint8_t>& table_of, unsigned columns, unsigned tables) {
  if (tables == 1) {
    std::fill(table_of.begin(), table_of.end(), uint8_t{0});
    return;
  }
  std::array<BitModel, 4> as_left;
  BitModel as_above;
  OffsetModel step;
  bool same = true;
  for (size_t i = 0; i < table_of.size(); ++i) {
    const uint8_t left = i == 0 ? uint8_t{0} : table_of[i - 1];
    const uint8_t above = i < columns ? left : table_of[i - columns];
    same = as_left[2 * (left == above) + same].code(coder, table_of[i] == left);
    if (same) {
      table_of[i] = left;
    } else if (left != above && as_above.code(coder, table_of[i] == above)) {
      table_of[i] = above;
    } else {
      const int32_t table = left + step.code(coder, int32_t{table_of[i]} - left);
      table_of[i] = static_cast<uint8_t>(std::clamp(table, 0, static_cast<int32_t>(tables) - 1));
    }
  }
}

/// What a context has, without the symbols that it has not.
struct SparseCounts {
  uint32_t context;
  uint32_t sum = 0;
  uint32_t mean = 0;  ///< of the symbols, times 256
  std::vector<std::pair<uint8_t, uint32_t>> counts;
};

std::vector<SparseCounts> used_contexts(std::span<const Histogram> counts, unsigned symbols) {
  std::vector<SparseCounts> used;
  for (uint32_t c = 0; c < counts.size(); ++c) {
    SparseCounts one{c, 0, 0, {}};
    uint64_t weighted = 0;
    for (unsigned s = 0; s < symbols; ++s) {
      if (counts[c][s] == 0) continue;
      one.counts.push_back({static_cast<uint8_t>(s), counts[c][s]});
      one.sum += counts[c][s];
      weighted += uint64_t{s} * counts[c][s];
    }
    if (one.sum == 0) continue;
    one.mean = static_cast<uint32_t>(256 * weighted / one.sum);
    used.push_back(std::move(one));
  }
  return used;
}

// A cluster is worth its table where it has so many symbols: with a quarter of them small meshes took twice
// the time, and were larger by up to 1.6 % (featuretype, cheese).
constexpr uint64_t symbols_of_cluster = 1024;
constexpr int rounds = 4;  // more change less than 0.1 % of the symbols' bits

/// k-means, where the distance to a cluster is what the symbols cost with its distribution. Begins with
/// contexts in the order of their mean symbols.
class Clusters {
 public:
  Clusters(std::vector<SparseCounts> used, unsigned symbols, unsigned most)
      : used_(std::move(used)), symbols_(symbols), cluster_(used_.size()) {
    uint64_t sum = 0;
    for (const SparseCounts& one : used_) sum += one.sum;
    count_ = std::min<size_t>({most, used_.size(), static_cast<size_t>(sum / symbols_of_cluster + 1)});
    std::vector<uint32_t> order(used_.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
      return std::pair(used_[a].mean, a) < std::pair(used_[b].mean, b);
    });
    uint64_t before = 0;
    for (const uint32_t i : order) {
      cluster_[i] = static_cast<uint8_t>(before * count_ / std::max<uint64_t>(sum, 1));
      before += used_[i].sum;
    }
    for (int round = 0; round < rounds && count_ > 1; ++round) assign();
  }

  std::vector<Histogram> counts() const {
    std::vector<Histogram> result(std::max<size_t>(count_, 1));
    for (size_t i = 0; i < used_.size(); ++i) {
      for (const auto& [s, n] : used_[i].counts) result[cluster_[i]][s] += n;
    }
    return result;
  }
  /// The map by context: unused ones go with the one before, which costs least.
  std::vector<uint8_t> map(size_t contexts, std::span<const uint8_t> table_of_cluster) const {
    std::vector<uint8_t> result(contexts);
    size_t next = 0;
    uint8_t before = 0;
    for (uint32_t c = 0; c < contexts; ++c) {
      if (next < used_.size() && used_[next].context == c) before = table_of_cluster[cluster_[next++]];
      result[c] = before;
    }
    return result;
  }

 private:
  void assign() {
    std::vector<Histogram> price = counts();
    for (Histogram& one : price) {
      uint32_t sum = symbols_;
      for (unsigned s = 0; s < symbols_; ++s) sum += 8 * one[s];
      for (unsigned s = 0; s < symbols_; ++s) one[s] = log2_fixed(sum) - log2_fixed(8 * one[s] + 1);
    }
    for (size_t i = 0; i < used_.size(); ++i) {
      uint64_t least = UINT64_MAX;
      for (size_t c = 0; c < count_; ++c) {
        uint64_t cost = 0;
        for (const auto& [s, n] : used_[i].counts) cost += uint64_t{n} * price[c][s];
        if (cost >= least) continue;
        least = cost;
        cluster_[i] = static_cast<uint8_t>(c);
      }
    }
  }

  std::vector<SparseCounts> used_;
  unsigned symbols_;
  size_t count_ = 0;
  std::vector<uint8_t> cluster_;  ///< by used context
};

void make_possible(std::vector<Histogram>& counts, unsigned symbols) {
  for (unsigned s = 0; s < symbols; ++s) {
    // Of small alphabets all, of large ones the last, which stands for any.
    const bool occurs = symbols <= 16 || s + 1 == symbols ||
                        std::any_of(counts.begin(), counts.end(), [s](auto& one) { return one[s] != 0; });
    for (Histogram& one : counts) one[s] = std::max(one[s], uint32_t{occurs});
  }
}

}  // namespace

StaticTables make_clustered_tables(std::span<const Histogram> counts, unsigned symbols, unsigned columns,
                                   unsigned most_tables, bool shared, RansEncoder& side) {
  const Clusters clusters(used_contexts(counts, symbols), symbols, most_tables);
  std::vector<Histogram> merged = clusters.counts();
  if (shared) make_possible(merged, symbols);
  std::vector<uint8_t> table_of_cluster;
  merged = merge_alike(merged, symbols, most_tables, price_of_table, table_of_cluster);
  StaticTables tables = write_tables(merged, {}, symbols, clustered_bits, most_tables, side);
  tables.table_of = clusters.map(counts.size(), table_of_cluster);
  code_map(side, tables.table_of, columns, static_cast<unsigned>(tables.tables.size()));
  return tables;
}

StaticTables read_clustered_tables(size_t contexts, unsigned symbols, unsigned columns, unsigned most_tables,
                                   RansDecoder& side) {
  StaticTables tables = read_tables(0, symbols, clustered_bits, most_tables, side);
  tables.table_of.resize(contexts);
  code_map(side, tables.table_of, columns, static_cast<unsigned>(tables.tables.size()));
  return tables;
}

}  // namespace maille
