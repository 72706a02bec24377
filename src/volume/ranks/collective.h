#pragma once

#include <maille/ranks.h>

#include <vector>

#include "base/bytes.h"
#include "base/result.h"

namespace maille {

// What is often done among ranks. All ranks must call these in the same order.

using Buffers = std::vector<std::vector<std::byte>>;

/// Nothing where all ranks are fine, else in all of them the error of the first one that has one: nobody goes
/// on to wait for a rank that has given up. The error names the rank, if `named`.
Result<> agree(Ranks& ranks, const Result<>& mine, bool named = true);
template <class T>
Result<T> agree(Ranks& ranks, Result<T> mine) {
  const Result<> whether = mine ? Result<>() : Result<>(tl::unexpected(mine.error()));
  MAILLE_CHECK(agree(ranks, whether));
  return mine;
}

/// What was written for each rank.
Buffers buffers_of(std::vector<ByteWriter>& to);
/// What each rank has, in all of them.
Buffers to_all(Ranks& ranks, Bytes mine);
/// ... in the first one; none in the others.
Buffers to_first(Ranks& ranks, std::vector<std::byte> mine);
/// What the first rank has, in all.
std::vector<std::byte> from_first(Ranks& ranks, Bytes of_first);
/// The sum over all ranks.
uint64_t sum_of(Ranks& ranks, uint64_t mine);
/// By rank, the sum over those before it; one more: over all.
std::vector<uint64_t> sums_before(Ranks& ranks, uint64_t mine);

}  // namespace maille
