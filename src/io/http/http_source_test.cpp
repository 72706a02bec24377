// Sources over HTTP on servers that do as they should.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <maille/file.h>
#include <maille/http.h>

#include <algorithm>
#include <cstring>

#include "io/http/answer.h"
#include "io/http/testing.h"
#include "support/http_content.h"

namespace maille::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(HttpSource, ReadsFilesSmallerThanTheFirstRequest) {
  for (const size_t size : {0u, 1u, 4095u, 4096u, 4097u, 65535u, 65536u, 65537u}) {
    const std::string content = test_content().substr(0, size);
    const TestServer server([&](const TestRequest& request, TestConnection& connection) {
      connection.send(good_answer(request, content));
    });
    const auto source = http_source(server.url(), impatient());
    ASSERT_TRUE(source) << source.error().message;
    std::vector<std::byte> bytes(size);
    ASSERT_TRUE((*source)->read_at(0, bytes));
    EXPECT_TRUE(size == 0 || std::memcmp(bytes.data(), content.data(), size) == 0) << size;
    EXPECT_EQ(server.requests(), size > 65536 ? 2u : 1u);
    EXPECT_FALSE((*source)->read_at(size, std::span(bytes.data(), 1)));
  }
}

TEST(HttpSource, AsksForManyPartsAtOnceAndForNearOnesTogether) {
  const std::string content = test_content();
  const TestServer server([&](const TestRequest& request, TestConnection& connection) {
    connection.send(good_answer(request, content));
  });
  const auto source = http_source(server.url(), impatient());
  ASSERT_TRUE(source) << source.error().message;
  std::vector<std::vector<std::byte>> bytes(4, std::vector<std::byte>(100));
  const std::vector<uint64_t> offsets = {200'000, 100'000, 110'000, 3};
  std::vector<Source::Part> parts;
  for (size_t i = 0; i < bytes.size(); ++i) parts.push_back({offsets[i], bytes[i]});
  ASSERT_TRUE((*source)->read_many(parts));
  for (size_t i = 0; i < bytes.size(); ++i)
    EXPECT_EQ(std::memcmp(bytes[i].data(), content.data() + offsets[i], 100), 0) << i;
  EXPECT_EQ((*source)->statistics().requests, 3u);
  EXPECT_EQ((*source)->statistics().round_trips, 2u);
  ASSERT_TRUE((*source)->read_many(parts));
  EXPECT_EQ(server.requests(), 3u) << "they are kept";
}

TEST(HttpSource, FetchesAheadWhenReadInOrder) {
  const std::string content = test_content();
  const TestServer server([&](const TestRequest& request, TestConnection& connection) {
    connection.send(good_answer(request, content));
  });
  const auto source = http_source(server.url(), impatient());
  ASSERT_TRUE(source) << source.error().message;
  std::vector<std::byte> bytes(1000);
  for (size_t offset = 0; offset + 1000 <= content.size(); offset += 1000) {
    ASSERT_TRUE((*source)->read_at(offset, bytes));
    ASSERT_EQ(std::memcmp(bytes.data(), content.data() + offset, 1000), 0) << offset;
  }
  EXPECT_LE(server.requests(), 4u);
}

TEST(HttpSource, ReadsMoreThanItKeeps) {
  Random random(3);
  std::string content(5'000'000, ' ');
  for (char& c : content) c = static_cast<char>(random.next());
  const TestServer server([&](const TestRequest& request, TestConnection& connection) {
    connection.send(good_answer(request, content));
  });
  HttpOptions options = impatient();
  options.cache_bytes = 1;
  const auto source = http_source(server.url(), options);
  ASSERT_TRUE(source) << source.error().message;
  std::vector<std::byte> whole(content.size());
  for (int times = 0; times < 2; ++times) {
    ASSERT_TRUE((*source)->read_at(0, whole));
    EXPECT_EQ(std::memcmp(whole.data(), content.data(), content.size()), 0);
  }
  for (int i = 0; i < 50; ++i) {
    std::vector<std::vector<std::byte>> bytes(random.between(1, 20));
    std::vector<Source::Part> parts;
    for (auto& part : bytes) {
      part.resize(random.below(100'000));
      parts.push_back({random.below(content.size() - part.size()), part});
    }
    ASSERT_TRUE((*source)->read_many(parts));
    for (const Source::Part& part : parts)
      ASSERT_EQ(std::memcmp(part.out.data(), content.data() + part.offset, part.out.size()), 0);
  }
}

TEST(HttpSource, FetchesNoMoreThanIsAllowed) {
  const std::string content = test_content();
  const TestServer server([&](const TestRequest& request, TestConnection& connection) {
    connection.send(good_answer(request, content));
  });
  HttpOptions options = impatient();
  options.most_bytes = 100'000;
  const auto source = http_source(server.url(), options);
  ASSERT_TRUE(source) << source.error().message;
  std::vector<std::byte> whole(content.size());
  const auto read = (*source)->read_at(0, whole);
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, AllOf(HasSubstr(server.url()), HasSubstr("would be fetched")));
  EXPECT_EQ(server.requests(), 1u);
  (*source)->allow(content.size());
  EXPECT_TRUE((*source)->read_at(0, whole));
}

TEST(HttpSource, NamesAreWithoutSecrets) {
  EXPECT_EQ(shown_url("https://me:secret@host:8/a/b.maille?X-Signature=1#x"), "https://host:8/a/b.maille");
  EXPECT_EQ(shown_url("http://host/a@b"), "http://host/a@b");
  EXPECT_EQ(shown_url("http://a@b@host"), "http://host");
  EXPECT_EQ(shown_url("a?b"), "a?b");
  EXPECT_TRUE(is_url("HTTPS://x"));
  EXPECT_FALSE(is_url("http:/x"));
  EXPECT_FALSE(is_url("ftp://x"));
  EXPECT_FALSE(is_url(""));
  EXPECT_FALSE(http_source("file:///etc/passwd"));
}

TEST(HttpAnswer, ReadsContentRangesAsTheyAre) {
  const auto range = parse_content_range(" Bytes 3-9/100\r\n");
  ASSERT_TRUE(range);
  EXPECT_EQ(range->first, 3u);
  EXPECT_EQ(range->last, 9u);
  EXPECT_EQ(range->total, 100u);
  EXPECT_FALSE(parse_content_range("bytes 3-9/*")->total);
  EXPECT_GT(parse_content_range("bytes */7")->first, parse_content_range("bytes */7")->last);
  for (const char* text : {"", "bytes", "bytes ", "bytes 3-9", "bytes 9-3/100", "bytes 3-100/100",
                           "bytes -9/100", "bytes 3-/100", "bytes 3-9/", "bytes 3-9/1x", "pages 3-9/100",
                           "bytes 3-9/-100", "bytes 0-18446744073709551616/18446744073709551617"}) {
    EXPECT_FALSE(parse_content_range(text)) << text;
  }
}

}  // namespace
}  // namespace maille::testing
