#include "entropy/static_rans.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <numeric>

#include "support/random.h"

namespace maille::testing {
namespace {

struct Symbol {
  unsigned context;
  unsigned symbol;
};

/// Symbols around a middle that depends on the context.
std::vector<Symbol> random_symbols(Random& random, unsigned contexts, unsigned symbols, size_t count) {
  std::vector<Symbol> result;
  for (size_t i = 0; i < count; ++i) {
    const unsigned context = random.below(contexts);
    unsigned symbol = context % symbols;
    while (random.chance(60)) symbol = (symbol + 1 + random.below(2)) % symbols;
    result.push_back({context, symbol});
  }
  return result;
}

std::vector<Histogram> counts_of(const std::vector<Symbol>& symbols, unsigned contexts) {
  std::vector<Histogram> counts(contexts);
  for (const auto& [context, symbol] : symbols) ++counts[context][symbol];
  return counts;
}

void expect_valid(const StaticTables& tables, size_t contexts) {
  ASSERT_EQ(tables.table_of.size(), contexts);
  for (const uint8_t table : tables.table_of) ASSERT_LT(table, tables.tables.size());
  for (const Frequencies& table : tables.tables) {
    uint32_t sum = 0;
    for (unsigned s = 0; s < most_static_symbols; ++s) {
      if (table.frequency[s] != 0) {
        ASSERT_EQ(table.start[s], sum);
      }
      sum += table.frequency[s];
    }
    ASSERT_EQ(sum, 1u << tables.bits);
  }
}

template <unsigned bits>
unsigned get(StaticRansDecoder& decoder, const Frequencies& from) {
  StaticDecoderTable<bits, most_static_symbols> table;
  table.fill(from);
  return decoder.get(table);
}

TEST(StaticRans, SymbolsAndTablesComeBack) {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    Random random(seed);
    const unsigned contexts = 1 + random.below(40);
    const unsigned alphabet = 1 + random.below(most_static_symbols);
    const unsigned bits = random.chance(50) ? 10 : 8;
    const auto symbols = random_symbols(random, contexts, alphabet, random.below(3000));
    RansEncoder side;
    const StaticTables tables = make_tables(counts_of(symbols, contexts), alphabet, bits, 16, side);
    expect_valid(tables, contexts);
    StaticRansEncoder encoder;
    for (const auto& [context, symbol] : symbols) {
      encoder.put(tables.of(context), bits, symbol);
      encoder.put_raw(symbol & 7, 3);
    }

    const auto side_bytes = side.finish();
    RansDecoder side_decoder(side_bytes);
    const StaticTables read = read_tables(contexts, alphabet, bits, 16, side_decoder);
    EXPECT_FALSE(side_decoder.exhausted());
    expect_valid(read, contexts);
    EXPECT_EQ(read.table_of, tables.table_of);
    const auto bytes = encoder.finish();
    StaticRansDecoder decoder(bytes);
    for (const auto& [context, symbol] : symbols) {
      ASSERT_EQ(bits == 10 ? get<10>(decoder, read.of(context)) : get<8>(decoder, read.of(context)), symbol);
      ASSERT_EQ(decoder.get_raw(3), symbol & 7);
    }
    EXPECT_FALSE(decoder.exhausted());
    EXPECT_EQ(decoder.words.next, decoder.words.end);
  }
}

TEST(StaticRans, CostsLittleMoreThanTheEntropy) {
  Random random(1);
  const auto symbols = random_symbols(random, 1, 16, 100000);
  const std::vector<Histogram> counts = counts_of(symbols, 1);
  double entropy = 0;
  for (const uint32_t count : counts[0]) {
    if (count > 0) entropy -= count * std::log2(count / 100000.0);
  }
  RansEncoder side;
  const StaticTables tables = make_tables(counts, 16, 10, 1, side);
  StaticRansEncoder encoder;
  for (const auto& [context, symbol] : symbols) encoder.put(tables.of(context), 10, symbol);
  EXPECT_LT(8.0 * static_cast<double>(encoder.finish().size() + side.finish().size()), 1.01 * entropy);
}

TEST(StaticRans, ContextsThatAreAlikeShareATable) {
  std::vector<Histogram> counts(30);
  for (unsigned context = 0; context < 30; ++context) {
    for (unsigned s = 0; s < 8; ++s) counts[context][context % 2 == 0 ? s : 7 - s] = 1000u >> s;
  }
  RansEncoder side;
  EXPECT_EQ(make_tables(counts, 8, 10, 16, side).tables.size(), 2u);
}

TEST(StaticRans, SharedTablesHaveWhatOccursAnywhereAndTheLastSymbol) {
  std::vector<Histogram> counts(2);
  for (unsigned s = 0; s < 8; ++s) counts[0][s] = counts[1][20 + s] = 1000u;
  RansEncoder side;
  const StaticTables tables = make_tables(counts, 40, 10, 16, side, true);
  ASSERT_EQ(tables.tables.size(), 2u);
  for (const Frequencies& table : tables.tables) {
    for (unsigned s = 0; s < 40; ++s) {
      const bool possible = s < 8 || (s >= 20 && s < 28) || s == 39;
      EXPECT_EQ(table.frequency[s] > 0, possible) << s;
    }
  }
}

TEST(StaticRans, AnyBytesGiveValidTables) {
  for (uint64_t seed = 0; seed < 2000; ++seed) {
    Random random(seed);
    std::vector<std::byte> bytes(random.below(200));
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(random.below(256));
    RansDecoder decoder(bytes);
    const unsigned contexts = 1 + random.below(120);
    expect_valid(
        read_tables(contexts, 1 + random.below(most_static_symbols), random.chance(50) ? 10 : 8, 16, decoder),
        contexts);
    if (HasFailure()) return;
  }
}

TEST(StaticRans, AnEmptyStreamIsExhausted) {
  EXPECT_TRUE(StaticRansDecoder({}).exhausted());
  StaticRansEncoder encoder;
  const auto bytes = encoder.finish();
  StaticRansDecoder decoder(bytes);
  EXPECT_FALSE(decoder.exhausted());
  for (int i = 0; i < 10; ++i) decoder.get_raw(16);
  EXPECT_TRUE(decoder.exhausted());
}

TEST(Log2Fixed, IsCloseToTheLogarithm) {
  for (uint32_t n = 1; n < 100000; n = n * 9 / 8 + 1)
    EXPECT_NEAR(log2_fixed(n) / 65536.0, std::log2(n), 0.0005);
  EXPECT_EQ(log2_fixed(0), 0u);
  EXPECT_EQ(log2_fixed(1u << 31), 31u << 16);
}

}  // namespace
}  // namespace maille::testing
