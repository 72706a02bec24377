#pragma once

#include <maille/executor.h>

#include <algorithm>
#include <vector>

#include "base/result.h"

namespace maille {

/// Does `count` jobs, `at_once` side by side: load(i) -> Result<Loaded> and done(i, Made) -> Result<> by one
/// thread, one job after the other in order, while work(i, Loaded) -> Result<Made> of jobs between them is
/// done by any. The first error ends all.
/// Three rounds are in work at a time: one is loaded, one worked on, one finished. So at most 2 * at_once
/// Loaded and 2 * at_once Made are in memory, and files are read and written by one thread only.
template <class Loaded, class Made, class Load, class Work, class Done>
Result<> in_rounds(Executor& executor, size_t count, size_t at_once, Load load, Work work, Done done) {
  std::vector<Result<Loaded>> now, next;
  std::vector<Result<Made>> made, before;
  Result<> finished;
  const auto finish = [&](size_t first) {
    for (size_t i = 0; i < before.size() && finished; ++i)
      finished =
          before[i] ? done(first + i, *std::move(before[i])) : Result<>(tl::unexpected(before[i].error()));
  };
  const auto load_from = [&](size_t first) {
    next.clear();
    for (size_t i = first; i < std::min(first + at_once, count); ++i) {
      next.push_back(load(i));
      if (!next.back()) return;
    }
  };
  load_from(0);
  for (size_t first = 0; first < count; first += at_once) {
    // What was loaded is worked on, and what was made is finished, while the next is loaded.
    std::swap(now, next);
    std::swap(before, made);
    made.clear();
    made.resize(now.size());
    // Task 0 first: it is the one that waits for disks.
    executor.parallel_for(now.size() + 1, [&](size_t task) {
      if (task == 0) {
        if (first > 0) finish(first - at_once);
        if (finished) load_from(first + at_once);
        return;
      }
      // A job whose loading failed passes its error on, so that errors come in the order of jobs.
      Result<Loaded>& loaded = now[task - 1];
      made[task - 1] = loaded ? work(first + task - 1, *std::move(loaded))
                              : Result<Made>(tl::unexpected(std::move(loaded).error()));
    });
    MAILLE_CHECK(finished);
  }
  std::swap(before, made);
  finish(count == 0 ? 0 : (count - 1) / at_once * at_once);
  return finished;
}

}  // namespace maille
