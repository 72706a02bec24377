#include "volume/ranks/collective.h"

#include <array>

#include "base/bytes.h"

namespace maille {

Result<> agree(Ranks& ranks, const Result<>& mine, bool named) {
  // Only sums and largest numbers are asked of Ranks: the first rank with an error is the one with the
  // largest distance from the end.
  std::array<uint64_t, 1> failing = {mine ? 0 : ranks.size() - ranks.rank()};
  ranks.largest(failing);
  if (failing[0] == 0) return {};
  const auto first = static_cast<unsigned>(ranks.size() - failing[0]);
  ByteWriter told;
  if (ranks.rank() == first) {
    told.put(static_cast<int32_t>(mine.error().code));
    told.put_string(mine.error().message);
  }
  // Only the rank that failed first has anything to say.
  const Buffers all = to_all(ranks, told.bytes());
  ByteReader in(all[first]);
  const auto code = static_cast<ErrorCode>(in.get<int32_t>());
  const std::string message(in.get_string());
  return failure(code,
                 named && ranks.size() > 1 ? "rank " + std::to_string(first) + ": " + message : message);
}

Buffers buffers_of(std::vector<ByteWriter>& to) {
  Buffers buffers;
  for (ByteWriter& out : to) buffers.push_back(out.take());
  return buffers;
}

// A copy for each rank: what is told to all is small.
Buffers to_all(Ranks& ranks, Bytes mine) {
  return ranks.exchange(Buffers(ranks.size(), std::vector<std::byte>(mine.begin(), mine.end())));
}

Buffers to_first(Ranks& ranks, std::vector<std::byte> mine) {
  Buffers to(ranks.size());
  to[0] = std::move(mine);
  return ranks.exchange(std::move(to));
}

std::vector<std::byte> from_first(Ranks& ranks, Bytes of_first) {
  Buffers to(ranks.size());
  if (ranks.rank() == 0) to.assign(to.size(), std::vector<std::byte>(of_first.begin(), of_first.end()));
  return ranks.exchange(std::move(to))[0];
}

uint64_t sum_of(Ranks& ranks, uint64_t mine) {
  std::array<uint64_t, 1> sum = {mine};
  ranks.add(sum);
  return sum[0];
}

// One reduction of a list with a place for each rank.
std::vector<uint64_t> sums_before(Ranks& ranks, uint64_t mine) {
  std::vector<uint64_t> numbers(ranks.size());
  numbers[ranks.rank()] = mine;
  ranks.add(numbers);
  std::vector<uint64_t> sums = {0};
  for (const uint64_t number : numbers) sums.push_back(sums.back() + number);
  return sums;
}

}  // namespace maille
