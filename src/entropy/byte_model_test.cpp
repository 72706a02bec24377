#include "entropy/byte_model.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <string>

#include "support/random.h"

namespace maille {
namespace {

using testing::Random;

std::vector<std::byte> bytes_of(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

RC_GTEST_PROP(ByteModel, BringsBackAnyBytes, (const std::string& text)) {
  const auto bytes = bytes_of(text);
  RC_ASSERT(decode_bytes(encode_bytes(bytes), bytes.size()) == bytes);
}

TEST(ByteModel, BringsBackEveryPairOfBytes) {
  std::vector<std::byte> bytes;
  for (unsigned a = 0; a < 256; ++a) {
    for (unsigned b = 0; b < 256; ++b) {
      bytes.push_back(static_cast<std::byte>(a));
      bytes.push_back(static_cast<std::byte>(b));
    }
  }
  EXPECT_TRUE(decode_bytes(encode_bytes(bytes), bytes.size()) == bytes);
}

TEST(ByteModel, NothingTakesNothing) {
  EXPECT_TRUE(encode_bytes({}).empty());
  EXPECT_TRUE(decode_bytes({}, 0).empty());
  EXPECT_TRUE(decode_bytes(encode_bytes(bytes_of("some text")), 0).empty());
}

TEST(ByteModel, TextsBecomeSmaller) {
  std::string text;
  for (int i = 0; i < 200; ++i) text += "material_" + std::to_string(i % 17) + ";";
  EXPECT_LT(encode_bytes(bytes_of(text)).size(), text.size() / 2);
}

TEST(ByteModel, GivesThePartThatIsAskedFor) {
  const auto bytes = bytes_of("a description of a mesh");
  const auto coded = encode_bytes(bytes);
  for (size_t size = 0; size <= bytes.size(); ++size) {
    EXPECT_TRUE(std::ranges::equal(decode_bytes(coded, size), Bytes(bytes).first(size))) << size;
  }
}

TEST(ByteModel, EveryTruncationGivesFewerBytes) {
  const auto bytes = bytes_of("normals, colours, texture coordinates, materials; normals, colours");
  const auto coded = encode_bytes(bytes);
  for (size_t size = 0; size < coded.size(); ++size) {
    const auto back = decode_bytes(Bytes(coded).first(size), bytes.size());
    ASSERT_LT(back.size(), bytes.size()) << size;
    EXPECT_TRUE(std::ranges::equal(back, Bytes(bytes).first(back.size()))) << size;
  }
}

TEST(ByteModel, ClaimedSizesAreNotBelieved) {
  for (const size_t size : {size_t{0}, size_t{1}, size_t{8}, size_t{100}}) {
    for (const unsigned byte : {0u, 0x55u, 0xffu}) {
      const std::vector<std::byte> coded(size, static_cast<std::byte>(byte));
      const uint64_t most = most_bytes_per_coded_byte * (size + 1) - 1;
      EXPECT_LE(decode_bytes(coded, most).size(), most) << size << " bytes " << byte;
      EXPECT_TRUE(decode_bytes(coded, most + 1).empty()) << size << " bytes " << byte;
      EXPECT_TRUE(decode_bytes(coded, UINT64_MAX).empty()) << size << " bytes " << byte;
    }
  }
}

TEST(ByteModel, AMillionTimesTheSameTakesASixtyFourthAndComesBack) {
  const std::vector<std::byte> bytes(1'000'000);
  const auto coded = encode_bytes(bytes);
  EXPECT_EQ(coded.size(), bytes.size() / most_bytes_per_coded_byte);
  EXPECT_TRUE(decode_bytes(coded, bytes.size()) == bytes);
}

}  // namespace
}  // namespace maille
