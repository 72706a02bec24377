#pragma once

#include <maille/executor.h>
#include <maille/stream.h>

#include <array>

#include "base/result.h"

namespace maille {

/// Calls add(portion) for each portion of a stream, which does its work while the next one is decoded, then
/// done(portion), both Result<>. The first error of either ends it; an error of add() goes before one of the
/// portion behind it. add() may not keep the portion: there are two, which take turns.
template <class Add, class Done>
Result<> for_each_portion(StreamReader& reader, Executor* executor, Add add, Done done) {
  Executor& threads = executor != nullptr ? *executor : serial_executor();
  std::array<StreamPortion, 2> portions;
  bool more = MAILLE_TRY(reader.next(portions[0]));
  for (unsigned k = 0; more; k = 1 - k) {
    Result<bool> following = false;
    Result<> added;
    threads.parallel_for(2, [&](size_t task) {
      if (task == 0) {
        following = reader.next(portions[1 - k]);
      } else {
        added = add(portions[k]);
      }
    });
    MAILLE_CHECK(added);
    more = MAILLE_TRY(following);
    MAILLE_CHECK(done(portions[k]));
  }
  return {};
}

}  // namespace maille
