#include "base/bytes.h"

#include <gtest/gtest.h>

#include <initializer_list>

namespace maille {
namespace {

std::vector<std::byte> bytes_of(std::initializer_list<unsigned> values) {
  std::vector<std::byte> bytes;
  for (const unsigned value : values) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

bool is_refused(std::initializer_list<unsigned> values) {
  const auto bytes = bytes_of(values);
  ByteReader in(bytes);
  const uint64_t value = in.get_count();
  return !in.ok() && value == 0;
}

TEST(ByteReader, BringsBackCountsOfEveryLength) {
  for (unsigned bits = 0; bits < 64; ++bits) {
    const uint64_t power = uint64_t{1} << bits;
    for (const uint64_t value : {power - 1, power, power + 1, ~power, ~(power - 1)}) {
      ByteWriter out;
      out.put_count(value);
      ByteReader in(out.bytes());
      EXPECT_EQ(in.get_count(), value);
      EXPECT_TRUE(in.ok() && in.remaining() == 0) << value;
    }
  }
}

TEST(ByteReader, RefusesCountsThatAreNotSpelledTheShortestWay) {
  EXPECT_FALSE(is_refused({0x80, 0x01}));
  EXPECT_TRUE(is_refused({0x80, 0x00}));
  EXPECT_TRUE(is_refused({0x85, 0x00}));
  EXPECT_TRUE(is_refused({0x85, 0x80, 0x00}));
  EXPECT_TRUE(is_refused({0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x00}));
}

TEST(ByteReader, RefusesCountsOfMoreThan64Bits) {
  EXPECT_FALSE(is_refused({0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x01}));
  EXPECT_TRUE(is_refused({0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x02}));
  EXPECT_TRUE(is_refused({0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x81, 0x01}));
}

TEST(ByteReader, RefusesCountsThatAreCutOff) {
  EXPECT_TRUE(is_refused({}));
  EXPECT_TRUE(is_refused({0x80}));
  EXPECT_TRUE(is_refused({0xff, 0xff}));
}

}  // namespace
}  // namespace maille
