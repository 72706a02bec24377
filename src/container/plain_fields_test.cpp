#include "container/plain_fields.h"

#include <gtest/gtest.h>

namespace maille {
namespace {

using Texts = std::vector<std::string>;

std::vector<std::byte> written(const Texts& texts) {
  PlainWriter writer;
  writer.list(texts, [&](const std::string& text) { writer.text(text); });
  return writer.out().take();
}
PlainReader reader_of(Bytes bytes, uint64_t most_memory, Texts& texts) {
  PlainReader reader(bytes, most_memory);
  reader.list(texts, [&](std::string& text) { reader.text(text); });
  return reader;
}

TEST(PlainReader, GivesWhatWasWrittenAndCountsIt) {
  const Texts texts = {"", "short", std::string(100, 'x')};
  const auto bytes = written(texts);
  Texts found;
  const PlainReader reader = reader_of(bytes, 10000, found);
  EXPECT_TRUE(reader.ok() && reader.at_end());
  EXPECT_EQ(found, texts);
  EXPECT_EQ(reader.memory(), 4 * sizeof(std::string) + 101);
}

/// A list grows from 512 texts to 1,024, and has both while it does.
TEST(PlainReader, EndsBeforeAListTakesMoreThanIsAllowed) {
  const auto bytes = written(Texts(1000));
  Texts all, some;
  const uint64_t needed = 1536 * sizeof(std::string);
  EXPECT_TRUE(reader_of(bytes, needed, all).ok());
  EXPECT_EQ(all.size(), 1000u);
  const PlainReader reader = reader_of(bytes, needed - 1, some);
  EXPECT_FALSE(reader.ok());
  EXPECT_TRUE(reader.is_over());
  EXPECT_EQ(some.capacity(), 512u);
}

TEST(PlainReader, EndsBehindATextThatIsTooLong) {
  const auto bytes = written({std::string(1000, 'x'), "never read"});
  Texts found;
  const PlainReader reader = reader_of(bytes, 1000, found);
  EXPECT_TRUE(reader.is_over());
  EXPECT_EQ(found.size(), 1u);
}

TEST(PlainReader, HasFourMebibytesForSmallLimits) {
  EXPECT_EQ(plain_memory({.mesh_bytes = 0}), uint64_t{4} << 20);
  EXPECT_EQ(plain_memory({.mesh_bytes = ~uint64_t{0}}), ~uint64_t{0});
}

}  // namespace
}  // namespace maille
