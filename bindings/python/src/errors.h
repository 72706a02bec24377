#pragma once

#include <maille/error.h>
#include <pybind11/pybind11.h>

#include <utility>

namespace maille::python {

namespace py = pybind11;

/// Raises what an Error is in Python: OSError, MemoryError, KeyboardInterrupt or maille.Error, with the
/// library's sentence and its code (maille/_errors.py chooses).
[[noreturn]] void raise(const Error& error);

/// The value, or an exception.
template <class T>
T take(Result<T> result) {
  if (!result) raise(result.error());
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

}  // namespace maille::python
