#pragma once

#include <maille/error.h>

#include <string>
#include <utility>

namespace maille {

/// Errors from inside a file do not know its name: puts it before what is damaged or takes too much memory,
/// unless it stands there already.
template <class Value>
Result<Value> with_name(Result<Value> result, const std::string& name) {
  if (result) return result;
  Error error = std::move(result).error();
  const bool inside = error.code == ErrorCode::corrupt || error.code == ErrorCode::memory_bound;
  if (inside && error.message.compare(0, name.size(), name) != 0) error.message = name + ": " + error.message;
  return tl::unexpected(std::move(error));
}

}  // namespace maille
