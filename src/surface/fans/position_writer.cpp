#include "surface/fans/position_writer.h"

#include "entropy/lane_rans.h"

namespace maille::positions {
namespace {

/// Unsigned differences below the first context are large, so one comparison tells an alphabet's own.
std::vector<Histogram> count_events(const Alphabet& alphabet, const std::vector<Writer::Event>& events) {
  std::vector<Histogram> counts(alphabet.contexts);
  for (const Writer::Event& event : events) {
    const uint32_t context = event.context - alphabet.first;
    if (context < alphabet.contexts) ++counts[context][event.symbol];
  }
  return counts;
}

}  // namespace

std::vector<StaticTables> write_side(Coding coding, const std::vector<Writer::Event>& events, bool shared,
                                     RansEncoder& side) {
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

std::vector<std::byte> write_symbols(const Coding& coding, const std::vector<Writer::Event>& events,
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

double bits_of(const Coding& coding, const std::vector<Writer::Event>& events,
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

}  // namespace maille::positions
