#pragma once

#include <maille/standard.h>

#if !__has_include(<tl/expected.hpp>)
#error "maille needs tl/expected.hpp: libexpected-dev of Debian, tl-expected of vcpkg and Conan"
#endif

#include <cstdint>
#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace maille {

/// What went wrong, in kind. The values are the exit codes of the command.
enum class ErrorCode : int32_t {
  differs = 1,          ///< a comparison found a difference
  usage = 2,            ///< options or arguments that contradict each other or make no sense
  cannot_read = 3,      ///< the input is missing or unreadable
  malformed_input = 4,  ///< a foreign file (PLY, OBJ, ...) or a Mesh breaks its own rules
  unsupported = 5,      ///< needs another maille, or a feature that does not exist
  corrupt = 6,          ///< a .maille file is damaged
  memory_bound = 7,     ///< cannot be done within the memory allowed
  error_bound = 8,      ///< not given by this version: a bound finer than the type is kept lossless
  write_failed = 9,     ///< the output could not be written
  network = 10,         ///< a remote source failed
  cancelled = 130,      ///< the caller's progress function asked to stop
};

/// An error: its kind, and one sentence a user can act on: which file, chunk, line or element; what was
/// found; what to do about it.
struct Error {
  ErrorCode code;
  std::string message;
};

/// A value, or an Error. The library never throws on purpose; std::bad_alloc is the only exception that can
/// pass.
template <class T = void>
using Result = tl::expected<T, Error>;

inline tl::unexpected<Error> failure(ErrorCode code, std::string message) {
  return tl::unexpected<Error>(Error{code, std::move(message)});
}

}  // namespace maille
