#include "io/base64.h"

#include <gtest/gtest.h>

namespace maille {
namespace {

Bytes bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

std::string decoded(std::string_view text, size_t size) {
  Base64Reader reader(text);
  std::string out(size, '?');
  return reader.read(std::as_writable_bytes(std::span(out.data(), out.size()))) ? out : "failed";
}

TEST(Base64, KnowsTheVectorsOfTheStandard) {
  EXPECT_EQ(to_base64(bytes_of("")), "");
  EXPECT_EQ(to_base64(bytes_of("f")), "Zg==");
  EXPECT_EQ(to_base64(bytes_of("fo")), "Zm8=");
  EXPECT_EQ(to_base64(bytes_of("foobar")), "Zm9vYmFy");
  EXPECT_EQ(decoded("Zg==", 1), "f");
  EXPECT_EQ(decoded(" Zm 9v\nYmFy ", 6), "foobar");
}

TEST(Base64, ReadsPartsThatWereEncodedSeparately) {
  EXPECT_EQ(decoded("Zg==Zm9vYmFy", 7), "ffoobar");
}

TEST(Base64, RejectsForeignCharactersAndMissingBytes) {
  EXPECT_EQ(decoded("Zg=!", 1), "failed");
  EXPECT_EQ(decoded("Zg=a", 1), "failed");
  EXPECT_EQ(decoded("Z===", 1), "failed");
  EXPECT_EQ(decoded("Zm9", 2), "failed");
  EXPECT_EQ(decoded("Zm9v", 4), "failed");
}

TEST(Base64, EveryByteComesBack) {
  for (size_t size = 0; size < 300; ++size) {
    std::string text;
    for (size_t i = 0; i < size; ++i) text += static_cast<char>(i * 7 + size);
    Base64Reader reader("");
    EXPECT_EQ(decoded(to_base64(bytes_of(text)), size), text);
  }
}

}  // namespace
}  // namespace maille
