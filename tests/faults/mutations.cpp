#include "faults/mutations.h"

#include <maille/source.h>
#include <maille/version.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>

#include "base/bytes.h"
#include "container/file_reader.h"
#include "container/packed_file.h"

namespace maille::testing {
namespace {

using Content = std::vector<std::byte>;

std::byte odd_byte(Random& random) {
  static constexpr std::array<uint8_t, 8> odd = {0, 1, 2, 0x7f, 0x80, 0x81, 0xfe, 0xff};
  return static_cast<std::byte>(random.chance(50) ? odd[random.below(odd.size())] : random.below(256));
}

void insert(Content& bytes, size_t at, const Content& what) {
  bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), what.begin(), what.end());
}

/// A count of any size: one that a header would claim.
void put_count(Content& bytes, size_t at, Random& random) {
  ByteWriter count;
  count.put_count(random.next() >> random.below(64));
  const Bytes coded = count.bytes();
  for (size_t i = 0; i < coded.size() && at + i < bytes.size(); ++i) bytes[at + i] = coded[i];
}

void cut_run(Content& bytes, size_t at, Random& random) {
  const size_t size = std::min<size_t>(1 + random.below(random.chance(50) ? 4 : 200), bytes.size() - at);
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(at);
  bytes.erase(begin, begin + static_cast<std::ptrdiff_t>(size));
}

void copy_run(Content& bytes, size_t at, const Content& from, Random& random) {
  if (from.empty()) return;
  const size_t begin = random.below(from.size());
  const size_t size = std::min<size_t>(1 + random.below(100), from.size() - begin);
  const Content run(from.begin() + static_cast<std::ptrdiff_t>(begin),
                    from.begin() + static_cast<std::ptrdiff_t>(begin + size));
  if (random.chance(50)) return insert(bytes, at, run);
  for (size_t i = 0; i < size && at + i < bytes.size(); ++i) bytes[at + i] = run[i];
}

void damage(Content& bytes, const Content& other, Random& random) {
  if (bytes.empty()) return bytes.push_back(odd_byte(random));
  // Most of what steers decoding is at the front.
  const size_t at = random.below(random.chance(40) ? std::min<size_t>(bytes.size(), 64) : bytes.size());
  switch (random.below(9)) {
    case 0:
    case 1:
    case 2:
      bytes[at] ^= static_cast<std::byte>(1u << random.below(8));
      break;
    case 3:
      bytes[at] = odd_byte(random);
      break;
    case 4:
      put_count(bytes, at, random);
      break;
    case 5:
      cut_run(bytes, at, random);
      break;
    case 6:
      copy_run(bytes, at, random.chance(50) ? bytes : other, random);
      break;
    case 7:
      insert(bytes, at, Content(1 + random.below(4), odd_byte(random)));
      break;
    default:
      bytes.resize(at);
      break;
  }
}

/// A file taken apart.
struct Streams {
  FileHeader header;
  std::vector<StreamKey> keys;
  std::vector<Content> contents;
};

Streams streams_of(const Content& file) {
  Streams streams;
  const auto source = memory_source(Bytes(file));
  const auto reader = FileReader::open(*source);
  if (!reader) return streams;
  streams.header = reader->header();
  streams.header.required_features &= ~packed_feature;  // which the writer chooses
  for (const ChunkRecord& record : reader->records()) {
    if (record.header.part() != 0) continue;
    StreamKey key{"", record.header.patch, record.header.number};
    std::copy(record.header.type.begin(), record.header.type.end(), key.type);
    auto content = reader->read_stream(key);
    if (!content) continue;
    streams.keys.push_back(key);
    streams.contents.push_back(*std::move(content));
  }
  return streams;
}

Content file_of(const Streams& streams) {
  Content file;
  const auto sink = memory_sink(file);
  std::vector<NamedStream> named;
  for (size_t i = 0; i < streams.keys.size(); ++i) named.push_back({streams.keys[i], streams.contents[i]});
  static_cast<void>(write_file(*sink, streams.header, named));
  return file;
}

void rearrange(Streams& streams, const Streams& others, Random& random) {
  const size_t at = random.below(streams.keys.size());
  const auto place = static_cast<std::ptrdiff_t>(at);
  switch (random.below(6)) {
    case 0:
      streams.keys.erase(streams.keys.begin() + place);
      streams.contents.erase(streams.contents.begin() + place);
      break;
    case 1:
      std::swap(streams.contents[at], streams.contents[random.below(streams.keys.size())]);
      break;
    case 2:
      std::swap(streams.keys[at], streams.keys[random.below(streams.keys.size())]);
      break;
    case 3:
      streams.keys[at].number ^= 1u << random.below(4);
      break;
    case 4:
      streams.keys[at].patch ^= 1u << random.below(4);
      break;
    default:
      if (others.keys.empty()) break;
      const size_t from = random.below(others.keys.size());
      if (random.chance(50)) std::memcpy(streams.keys[at].type, others.keys[from].type, 5);
      streams.contents[at] = others.contents[from];
  }
}

void change_header(FileHeader& header, Random& random) {
  switch (random.below(3)) {
    case 0:
      header.mode = static_cast<Mode>(random.below(4));
      break;
    case 1:
      header.required_features ^= 1u << random.below(3);
      break;
    default:
      header.optional_features ^= 1u << random.below(8);
      break;
  }
}

}  // namespace

Mutation mutated(const Seed& seed, const std::vector<Seed>& others, Random& random) {
  const Seed& other = others[random.below(others.size())];
  const unsigned times = 1 + random.below(3);
  Mutation made;
  if (random.chance(15)) {
    made.bytes = seed.bytes;
    for (unsigned i = 0; i < times; ++i) damage(made.bytes, other.bytes, random);
    return made;
  }
  Streams streams = streams_of(seed.bytes);
  for (unsigned i = 0; i < times && !streams.keys.empty(); ++i) {
    const unsigned kind = random.below(100);
    const size_t at = random.below(streams.keys.size());
    if (kind < 3) {
      change_header(streams.header, random);
    } else if (kind < 12) {
      rearrange(streams, streams_of(other.bytes), random);
    } else {
      damage(streams.contents[at], other.bytes, random);
    }
  }
  made.bytes = file_of(streams);
  made.mended = true;
  return made;
}

std::vector<std::byte> mutated_text(const std::vector<std::byte>& bytes, const std::vector<std::byte>& other,
                                    Random& random) {
  static constexpr std::array<std::string_view, 20> words = {
      "-1",    "0",   "4294967295", "4294967296",   "18446744073709551615",
      "1e999", "nan", "-inf",       "1e-400",       "\n",
      " ",     "\0",  "/",          "\"",           "<",
      ">",     "{",   "}",          "999999999999", "../x"};
  Content made = bytes;
  for (unsigned times = 1 + random.below(3); times > 0; --times) {
    if (made.empty() || random.chance(60)) {
      damage(made, other, random);
      continue;
    }
    const std::string_view word = words[random.below(words.size())];
    const Bytes text = std::as_bytes(std::span(word.data(), word.size()));
    const size_t at = random.below(made.size());
    if (random.chance(50)) {
      insert(made, at, Content(text.begin(), text.end()));
    } else {
      for (size_t i = 0; i < text.size() && at + i < made.size(); ++i) made[at + i] = text[i];
    }
  }
  return made;
}

}  // namespace maille::testing
