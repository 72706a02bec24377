#pragma once

#include <maille/error.h>

#include <utility>

// The value of a Result, or return its error from the enclosing function. A statement expression: GCC, clang,
// emscripten.
#define MAILLE_TRY(expression)                                                       \
  ({                                                                                 \
    auto&& maille_result_ = (expression);                                            \
    if (!maille_result_) return ::tl::unexpected(std::move(maille_result_).error()); \
    *std::move(maille_result_);                                                      \
  })

// The same for results without a value.
#define MAILLE_CHECK(expression)                                                     \
  do {                                                                               \
    auto&& maille_result_ = (expression);                                            \
    if (!maille_result_) return ::tl::unexpected(std::move(maille_result_).error()); \
  } while (false)
