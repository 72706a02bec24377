#pragma once

#include <maille/executor.h>
#include <maille/stream.h>

#include <array>

#include "base/result.h"

namespace maille {

/// Calls add(piece) for each piece of a stream, which does its work while the next one is decoded, then
/// done(piece), both Result<>. The first error of either ends it.
template <class Add, class Done>
Result<> for_each_piece(StreamReader& reader, Executor* executor, Add add, Done done) {
  Executor& threads = executor != nullptr ? *executor : serial_executor();
  std::array<StreamPiece, 2> pieces;
  bool more = MAILLE_TRY(reader.next(pieces[0]));
  for (unsigned k = 0; more; k = 1 - k) {
    Result<bool> following = false;
    Result<> added;
    threads.parallel_for(2, [&](size_t task) {
      if (task == 0) {
        following = reader.next(pieces[1 - k]);
      } else {
        added = add(pieces[k]);
      }
    });
    MAILLE_CHECK(added);
    more = MAILLE_TRY(following);
    MAILLE_CHECK(done(pieces[k]));
  }
  return {};
}

}  // namespace maille
