#pragma once

#include <maille/executor.h>

#include <algorithm>
#include <cstddef>

namespace maille {

/// How many numbers, cells or points are worth a call of an executor (chosen, not swept). Chunks begin at the
/// same places for any number of threads, so results that are joined in order do not depend on it.
inline constexpr size_t chunk_size = size_t{1} << 15;

inline constexpr size_t chunks_of(size_t count) {
  return (count + chunk_size - 1) / chunk_size;
}

/// Calls work(chunk, begin, end) for the chunks of [0, count), possibly at once: what a chunk finds out goes
/// to a place of its own.
template <class Work>
void for_each_chunk(Executor& executor, size_t count, Work work) {
  executor.parallel_for(chunks_of(count), [&](size_t chunk) {
    work(chunk, chunk * chunk_size, std::min(count, (chunk + 1) * chunk_size));
  });
}

}  // namespace maille
