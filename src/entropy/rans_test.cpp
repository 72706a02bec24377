#include "entropy/rans.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <string>

#include "support/random.h"

namespace maille {
namespace {

using testing::Random;

/// One call to a coder, and what must come back.
struct Operation {
  enum Kind { decision, raw, symbol } kind;
  uint32_t value;      ///< decision: the bit; raw: the number; symbol: the start of its interval
  uint32_t parameter;  ///< decision: probability; raw: number of bits; symbol: frequency
  unsigned bits;       ///< symbol: of the distribution
  unsigned lane;
};

uint32_t low_bits(uint64_t value, unsigned count) {
  return static_cast<uint32_t>(value & ((uint64_t{1} << count) - 1));
}

Operation random_operation(Random& random, unsigned lanes) {
  const unsigned lane = random.below(lanes);
  switch (random.below(3)) {
    case 0: {
      static constexpr uint32_t edges[] = {1, 2, 32, 65504, 65534, 65535};
      const uint32_t probability = random.chance(30) ? edges[random.below(6)] : random.between(1, 65535);
      return {Operation::decision, random.below(2), probability, 16, lane};
    }
    case 1: {
      const unsigned count = random.below(33);
      return {Operation::raw, low_bits(random.next(), count), count, count, lane};
    }
    default: {
      const unsigned bits = random.between(1, 16);
      const uint32_t start = random.below((1u << bits) - 1);
      const uint32_t room = std::min((1u << bits) - 1, (1u << bits) - start);
      return {Operation::symbol, start, random.between(1, room), bits, lane};
    }
  }
}

std::vector<Operation> random_operations(Random& random, size_t count, unsigned lanes) {
  std::vector<Operation> operations;
  for (size_t i = 0; i < count; ++i) operations.push_back(random_operation(random, lanes));
  return operations;
}

std::vector<std::byte> encode(const std::vector<Operation>& operations, unsigned lanes) {
  RansEncoder encoder(lanes);
  for (const Operation& o : operations) {
    if (o.kind == Operation::decision) encoder.code(o.value != 0, o.parameter, o.lane);
    if (o.kind == Operation::raw) encoder.code_raw(o.value, o.parameter, o.lane);
    if (o.kind == Operation::symbol) encoder.put(o.value, o.parameter, o.bits, o.lane);
  }
  return encoder.finish();
}

/// Whether the next operation decodes to what was encoded.
bool decodes(RansDecoder& decoder, const Operation& o) {
  if (o.kind == Operation::decision) return decoder.code(false, o.parameter, o.lane) == (o.value != 0);
  if (o.kind == Operation::raw) return decoder.code_raw(0, o.parameter, o.lane) == o.value;
  const uint32_t slot = decoder.peek(o.bits, o.lane);
  decoder.advance(o.value, o.parameter, o.bits, o.lane);
  return slot >= o.value && slot - o.value < o.parameter;
}

/// Number of the first operation that comes back otherwise; the count of all when none does.
size_t first_difference(Bytes bytes, const std::vector<Operation>& operations, unsigned lanes) {
  RansDecoder decoder(bytes, lanes);
  for (size_t i = 0; i < operations.size(); ++i) {
    if (!decodes(decoder, operations[i]) || decoder.exhausted()) return i;
  }
  return operations.size();
}

std::vector<std::byte> bytes_of(std::initializer_list<unsigned> numbers) {
  std::vector<std::byte> bytes;
  for (const unsigned number : numbers) bytes.push_back(static_cast<std::byte>(number));
  return bytes;
}

RC_GTEST_PROP(Rans, BringsBackOperationsOfAllKindsInAllLanes, ()) {
  Random random(*rc::gen::arbitrary<uint64_t>());
  const auto lanes = *rc::gen::inRange(1u, most_lanes + 1);
  const auto operations = random_operations(random, *rc::gen::inRange<size_t>(0, 2000), lanes);
  RC_ASSERT(first_difference(encode(operations, lanes), operations, lanes) == operations.size());
}

TEST(Rans, BringsBackOperationsAcrossBlockBorders) {
  for (const unsigned lanes : {1u, 2u, 3u}) {
    for (const int more : {-1, 0, 1}) {
      Random random(lanes);
      const size_t count = 2 * size_t{operations_per_block} + static_cast<size_t>(1 + more) - 1;
      const auto operations = random_operations(random, count, lanes);
      EXPECT_EQ(first_difference(encode(operations, lanes), operations, lanes), count) << lanes;
    }
  }
}

TEST(Rans, EachBlockBeginsWithAStateOfEachLane) {
  for (const unsigned lanes : {1u, 2u, 3u}) {
    // Operations that hold nothing: the bytes are the states alone.
    const std::vector<Operation> nothing(operations_per_block, {Operation::raw, 0, 0, 0, 0});
    EXPECT_EQ(encode(nothing, lanes).size(), 8 * lanes);
    std::vector<Operation> one_more = nothing;
    one_more.push_back(nothing[0]);
    EXPECT_EQ(encode(one_more, lanes).size(), 16 * lanes);
  }
}

TEST(Rans, WithoutOperationsGivesNoBytes) {
  EXPECT_TRUE(RansEncoder(1).finish().empty());
  EXPECT_TRUE(RansEncoder(3).finish().empty());
  RansDecoder decoder({});
  EXPECT_FALSE(decoder.exhausted());  // nothing was asked for yet
}

TEST(Rans, AnEmptyStreamGivesNumbersAndIsExhausted) {
  RansDecoder decoder({});
  EXPECT_EQ(decoder.code_raw(0, 32), 0u);
  EXPECT_TRUE(decoder.exhausted());
  for (int i = 0; i < 1000; ++i) decoder.code(false, 1);
  EXPECT_TRUE(decoder.exhausted());
}

TEST(Rans, IsNotExhaustedByItsLastOperationButByOneMoreBlock) {
  for (const unsigned lanes : {1u, 3u}) {
    Random random(5);
    const auto operations = random_operations(random, operations_per_block, lanes);
    const auto bytes = encode(operations, lanes);
    RansDecoder decoder(bytes, lanes);
    for (const Operation& o : operations) decodes(decoder, o);
    EXPECT_FALSE(decoder.exhausted());
    decoder.code(false, 32768);
    EXPECT_TRUE(decoder.exhausted());
  }
}

TEST(Rans, NoticesEveryTruncation) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed);
    const unsigned lanes = random.between(1, most_lanes);
    const auto operations = random_operations(random, 300, lanes);
    const auto bytes = encode(operations, lanes);
    for (size_t size = 0; size < bytes.size(); ++size) {
      RansDecoder decoder(Bytes(bytes).first(size), lanes);
      for (const Operation& o : operations) decodes(decoder, o);
      EXPECT_TRUE(decoder.exhausted()) << "seed " << seed << ", " << size << " of " << bytes.size();
    }
  }
}

TEST(Rans, DecodesUpToWhereATruncatedStreamIsExhausted) {
  Random random(3);
  const auto operations = random_operations(random, 2000, 2);
  const auto bytes = encode(operations, 2);
  size_t before = 0;
  for (size_t size = 16; size < bytes.size(); size += 4) {
    const size_t reached = first_difference(Bytes(bytes).first(size), operations, 2);
    RansDecoder decoder(Bytes(bytes).first(size), 2);
    for (size_t i = 0; i <= reached; ++i) decodes(decoder, operations[i]);
    EXPECT_TRUE(decoder.exhausted()) << size;  // the first wrong one is never taken for a right one
    EXPECT_GE(reached, before);
    before = reached;
  }
  EXPECT_GT(before, operations.size() * 9 / 10);
}

TEST(Rans, TakesAsManyBitsAsTheProbabilitiesSay) {
  // 2^17 - 1 decisions that were near certain cost 2^17 * log2(65536/65535) = 2.9 bits.
  RansEncoder certain;
  for (uint32_t i = 1; i < operations_per_block; ++i) certain.code(true, 65535);
  EXPECT_LE(certain.finish().size(), 12u);
  // One surprise costs 16 bits.
  RansEncoder surprises;
  for (int i = 0; i < 1000; ++i) surprises.code(false, 65535);
  EXPECT_NEAR(static_cast<double>(surprises.finish().size()), 2000, 12);
  RansEncoder coins;
  for (uint32_t i = 0; i < 8000; ++i) coins.code(i % 3 == 0, 32768);
  EXPECT_NEAR(static_cast<double>(coins.finish().size()), 1000, 12);
  RansEncoder raw;
  for (uint32_t i = 0; i < 1000; ++i) raw.code_raw(i * 2654435761u, 32);
  EXPECT_NEAR(static_cast<double>(raw.finish().size()), 4000, 12);
}

TEST(Rans, SkewedDecisionsComeBack) {
  for (const uint32_t probability : {1u, 2u, 32u, 65504u, 65534u, 65535u}) {
    std::vector<Operation> operations;
    Random random(probability);
    for (int i = 0; i < 5000; ++i) {
      operations.push_back({Operation::decision, random.below(2), probability, 16, 0});
    }
    EXPECT_EQ(first_difference(encode(operations, 1), operations, 1), operations.size()) << probability;
  }
}

TEST(Rans, WritesTheseBytes) {
  // Backwards from state 2^32. The raw 5 of 3 bits: 2^32 * 8 + 5 = 0x8'0000'0005. The set bit of probability
  // 32768 = 2^15: quotient 2^20, remainder 5: 2^20 * 2^16 + 5 = 0x10'0000'0005. Eight bytes, low first.
  RansEncoder one_state;
  one_state.code(true, 32768);
  one_state.code_raw(5, 3);
  EXPECT_EQ(one_state.finish(), bytes_of({0x05, 0, 0, 0, 0x10, 0, 0, 0}));

  // 32 raw bits do not fit beside 2^32: the state's low half (0) goes out as a word, 1 stays, and
  // 1 * 2^32 + 0xdeadbeef is the state.
  RansEncoder with_word;
  with_word.code_raw(0xdeadbeef, 32);
  EXPECT_EQ(with_word.finish(), bytes_of({0xef, 0xbe, 0xad, 0xde, 1, 0, 0, 0,  // state
                                          0, 0, 0, 0}));                       // word

  // A lane that is not used keeps 2^32. A clear bit of probability 16384 is the interval from 16384 of length
  // 49152: 2^32 / 49152 = 87381 rest 16384; 87381 * 65536 + 16384 + 16384 = 0x1'5555'8000.
  RansEncoder three_lanes(3);
  three_lanes.code(false, 16384, 2);
  three_lanes.code_raw(9, 4, 0);
  EXPECT_EQ(three_lanes.finish(), bytes_of({0x09, 0,    0,    0,    0x10, 0, 0, 0,     // 2^36 + 9
                                            0,    0,    0,    0,    1,    0, 0, 0,     // 2^32
                                            0x00, 0x80, 0x55, 0x55, 1,    0, 0, 0}));  // as above
}

TEST(Rans, AnyBytesAreExhaustedAfterWorkThatTheirNumberBounds) {
  Random random(11);
  for (int trial = 0; trial < 60; ++trial) {
    // Zeros and ones as well: states that no encoder leaves behind.
    std::vector<std::byte> bytes(random.below(200));
    for (std::byte& byte : bytes) {
      byte = static_cast<std::byte>(trial % 3 == 0 ? 0 : trial % 3 == 1 ? 255 : random.below(256));
    }
    const unsigned lanes = random.between(1, most_lanes);
    RansDecoder decoder(bytes, lanes);
    // The surest decision that models make, see BitModel.
    uint64_t decisions = 0;
    const uint64_t most = (8 * bytes.size() + 64 * lanes) * 2048;
    for (unsigned lane = 0; !decoder.exhausted() && decisions <= most; ++decisions, ++lane) {
      decoder.code(false, 65536 - 32, lane % lanes);
    }
    EXPECT_LE(decisions, most) << bytes.size() << " bytes in " << lanes << " lanes";
  }
}

}  // namespace
}  // namespace maille
