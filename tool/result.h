#pragma once

#include <maille/error.h>

#include <utility>

// The value of a Result, or return its error from the enclosing function. The library has the same for
// itself; the command uses public headers only.
#define TOOL_TRY(expression)                                                     \
  ({                                                                             \
    auto&& tool_result_ = (expression);                                          \
    if (!tool_result_) return ::tl::unexpected(std::move(tool_result_).error()); \
    *std::move(tool_result_);                                                    \
  })

// The same for results without a value.
#define TOOL_CHECK(expression)                                                   \
  do {                                                                           \
    auto&& tool_result_ = (expression);                                          \
    if (!tool_result_) return ::tl::unexpected(std::move(tool_result_).error()); \
  } while (false)
