#include "entropy/symbol_model.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <vector>

#include "entropy/rans.h"
#include "support/random.h"

namespace maille {
namespace {

using testing::Random;

/// The plain loop of SymbolModel, kept here so that the one in registers has something to agree with.
class PlainModel {
 public:
  PlainModel() {
    for (int i = 0; i < 16; ++i) cumulative_[i] = i * 2048;
  }
  int start(unsigned symbol) const { return cumulative_[symbol]; }
  int end(unsigned symbol) const { return symbol == 15 ? 32768 : cumulative_[symbol + 1]; }
  unsigned find(int slot) const {
    unsigned symbol = 15;
    while (cumulative_[symbol] > slot) --symbol;
    return symbol;
  }
  void adapt(unsigned symbol) {
    const int rate = visits_ < 1     ? 1
                     : visits_ < 3   ? 2
                     : visits_ < 7   ? 3
                     : visits_ < 16  ? 4
                     : visits_ < 48  ? 5
                     : visits_ < 191 ? 6
                                     : 7;
    for (int i = 0; i < 16; ++i) {
      const int target = i <= static_cast<int>(symbol) ? i : 32768 - 16 + i;
      cumulative_[i] += (target - cumulative_[i]) >> rate;
    }
    if (visits_ < 191) ++visits_;
  }

 private:
  int cumulative_[16];
  int visits_ = 0;
};

/// Stands in for an encoder, to see what a model asks of it.
struct Recorder {
  static constexpr bool encoding = true;
  uint32_t start = 0, frequency = 0;
  void put(uint32_t from, uint32_t size, unsigned bits, unsigned) {
    EXPECT_EQ(bits, 15u);
    start = from;
    frequency = size;
  }
};

/// Stands in for a decoder whose state shows a given slot.
struct Prompter {
  static constexpr bool encoding = false;
  uint32_t slot = 0;
  uint32_t start = 0, frequency = 0;
  uint32_t peek(unsigned, unsigned) const { return slot; }
  void advance(uint32_t from, uint32_t size, unsigned, unsigned) {
    start = from;
    frequency = size;
  }
};

/// Symbols as different sources give them: one only, uniform, skewed, changing half way.
std::vector<unsigned> symbols_of_source(unsigned source, size_t count) {
  Random random(source);
  std::vector<unsigned> symbols;
  for (size_t i = 0; i < count; ++i) {
    const unsigned skewed = std::min(15u, static_cast<unsigned>(-3 * std::log(1 - random.unit())));
    const unsigned choices[] = {source % 16, random.below(16), skewed, i < count / 2 ? 0u : 15u,
                                i % 2 == 0 ? 0u : 15u};
    symbols.push_back(choices[source % 5]);
  }
  return symbols;
}

TEST(SymbolModel, MovesLikeThePlainLoop) {
  for (unsigned source = 0; source < 80; ++source) {
    SymbolModel model;
    PlainModel plain;
    Recorder recorder;
    for (const unsigned symbol : symbols_of_source(source, 600)) {
      model.code(recorder, symbol);
      ASSERT_EQ(recorder.start, static_cast<uint32_t>(plain.start(symbol)));
      ASSERT_EQ(recorder.frequency, static_cast<uint32_t>(plain.end(symbol) - plain.start(symbol)));
      plain.adapt(symbol);
    }
  }
}

TEST(SymbolModel, FindsTheSymbolOfEverySlot) {
  for (unsigned source = 0; source < 5; ++source) {
    SymbolModel model;
    PlainModel plain;
    Recorder recorder;
    for (const unsigned symbol : symbols_of_source(source, 300)) {
      model.code(recorder, symbol);
      plain.adapt(symbol);
    }
    for (uint32_t slot = 0; slot < 32768; ++slot) {
      SymbolModel copy = model;  // since coding changes it
      Prompter prompter{.slot = slot};
      const unsigned symbol = copy.code(prompter, 0);
      ASSERT_EQ(symbol, plain.find(static_cast<int>(slot))) << slot;
      ASSERT_LE(prompter.start, slot);
      ASSERT_GT(prompter.start + prompter.frequency, slot);
    }
  }
}

TEST(SymbolModel, LeavesEverySymbolARoom) {
  for (unsigned source = 0; source < 80; ++source) {
    SymbolModel model;
    Recorder recorder;
    for (const unsigned symbol : symbols_of_source(source, 3000)) model.code(recorder, symbol);
    uint32_t end = 0;
    for (unsigned symbol = 0; symbol < 16; ++symbol) {
      SymbolModel copy = model;
      copy.code(recorder, symbol);
      EXPECT_EQ(recorder.start, end) << symbol;
      EXPECT_GE(recorder.frequency, 1u) << symbol;
      end = recorder.start + recorder.frequency;
    }
    EXPECT_EQ(end, 32768u);
  }
}

RC_GTEST_PROP(SymbolModel, BringsBackAnySymbolsInAnyLane, ()) {
  Random random(*rc::gen::arbitrary<uint64_t>());
  const size_t lanes = *rc::gen::inRange(1u, most_lanes + 1);
  const auto symbols = *rc::gen::container<std::vector<unsigned>>(rc::gen::inRange(0u, 16u));
  RansEncoder encoder(static_cast<unsigned>(lanes));
  const auto lane_of = [lanes](size_t i) { return static_cast<unsigned>(i % lanes); };
  std::vector<SymbolModel> models(3);
  for (size_t i = 0; i < symbols.size(); ++i) models[i % 3].code(encoder, symbols[i], lane_of(i));
  const auto bytes = encoder.finish();
  RansDecoder decoder(bytes, static_cast<unsigned>(lanes));
  models.assign(3, {});
  for (size_t i = 0; i < symbols.size(); ++i) {
    RC_ASSERT(models[i % 3].code(decoder, 0, lane_of(i)) == symbols[i]);
  }
  RC_ASSERT(!decoder.exhausted());
}

TEST(SymbolModel, LearnsWhatComesOften) {
  const auto bits_per_symbol = [](unsigned source) {
    RansEncoder encoder;
    SymbolModel model;
    const auto symbols = symbols_of_source(source, 20000);
    for (const unsigned symbol : symbols) model.code(encoder, symbol);
    return 8.0 * static_cast<double>(encoder.finish().size()) / static_cast<double>(symbols.size());
  };
  EXPECT_LT(bits_per_symbol(0), 0.02);      // always the same
  EXPECT_NEAR(bits_per_symbol(1), 4, 0.1);  // uniform
  EXPECT_LT(bits_per_symbol(2), 3.2);       // skewed: entropy 3.06
  EXPECT_LT(bits_per_symbol(3), 0.05);      // changes once
}

}  // namespace
}  // namespace maille
