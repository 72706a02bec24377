#pragma once

#include <maille/ranks.h>

#include <vector>

#include "base/bytes.h"
#include "base/result.h"

namespace maille {

// What is often done among ranks. All ranks must call these in the same order, also those that have nothing
// to say: a rank that skips one makes all others wait for ever. So every decision on which the next call
// depends is made from what all ranks know.

using Buffers = std::vector<std::vector<std::byte>>;

/// Nothing where all ranks are fine, else in all of them the error of the first one that has one: nobody goes
/// on to wait for a rank that has given up. The error names the rank, if `named`: not where every rank would
/// find the same. It is what each step that can fail in some ranks only must end with.
Result<> agree(Ranks& ranks, const Result<>& mine, bool named = true);
template <class T>
Result<T> agree(Ranks& ranks, Result<T> mine) {
  const Result<> whether = mine ? Result<>() : Result<>(tl::unexpected(mine.error()));
  MAILLE_CHECK(agree(ranks, whether));
  return mine;
}

/// What was written for each rank, as exchange() takes it; `to` is empty afterwards.
Buffers buffers_of(std::vector<ByteWriter>& to);
/// What each rank has, in all of them, by rank. Memory: as much as all have together, in each.
Buffers to_all(Ranks& ranks, Bytes mine);
/// ... in the first one; none in the others.
Buffers to_first(Ranks& ranks, std::vector<std::byte> mine);
/// What the first rank has, in all.
std::vector<std::byte> from_first(Ranks& ranks, Bytes of_first);
/// The sum over all ranks.
uint64_t sum_of(Ranks& ranks, uint64_t mine);
/// By rank, the sum over those before it; one more, the sum over all. Where each rank's part begins in a
/// common list.
std::vector<uint64_t> sums_before(Ranks& ranks, uint64_t mine);

}  // namespace maille
