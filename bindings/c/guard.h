#pragma once

#include <maille.h>

#include <maille/error.h>
#include <exception>
#include <initializer_list>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

// No exception may cross the border to C, since unwinding through frames of C is undefined. Therefore each
// function of the library does its work inside run() or make(), which turn errors and exceptions into a code
// and a sentence.

struct maille_error {
  int32_t code = MAILLE_OK;
  std::string message;
};

namespace maille::c {

/// Stores the code and the message if `error` is not NULL, and returns the code.
int32_t report(maille_error* error, int32_t code, std::string_view message) noexcept;
/// Does the same for the exception that is being handled; call it inside of a catch block only.
int32_t report_exception(maille_error* error) noexcept;

/// An argument that must not be NULL, and what the message calls it.
struct Needed {
  const void* pointer;
  const char* name;
};
/// The first that is NULL.
Result<> check(std::initializer_list<Needed> needed);

/// Does `work`, which gives a Result<>, and gives its code.
template <class Work>
int32_t run(maille_error* error, std::initializer_list<Needed> needed, const Work& work) noexcept {
  try {
    Result<> done = check(needed);
    if (done) done = work();
    return done ? MAILLE_OK : report(error, static_cast<int32_t>(done.error().code), done.error().message);
  } catch (...) {
    return report_exception(error);
  }
}

/// Does `work`, which gives a Result<std::unique_ptr<T>>, and hands the object over; NULL where there is
/// none.
template <class Work>
auto make(maille_error* error, std::initializer_list<Needed> needed, const Work& work) noexcept {
  using Made = typename std::invoke_result_t<Work>::value_type;
  using Pointer = typename Made::pointer;
  try {
    if (const auto all = check(needed); !all) {
      report(error, static_cast<int32_t>(all.error().code), all.error().message);
      return Pointer{};
    }
    Result<Made> made = work();
    if (made) return made->release();
    report(error, static_cast<int32_t>(made.error().code), made.error().message);
  } catch (...) {
    report_exception(error);
  }
  return Pointer{};
}

inline Result<> wrong(std::string message) {
  return failure(ErrorCode::usage, std::move(message));
}
/// For results of any type.
template <class T>
tl::unexpected<Error> passed_on(Result<T>&& failed) {
  return tl::unexpected(std::move(failed).error());
}
inline std::string text(const char* text) {
  return text ? text : "";
}

/// Turns a number from outside into one of `count` values. A C caller may pass any int, and casting it to an
/// enumeration unchecked would make every later switch unsafe. Error: usage.
template <class Enum>
Result<Enum> chosen(int32_t value, unsigned count, const char* what) {
  if (value >= 0 && static_cast<unsigned>(value) < count) return static_cast<Enum>(value);
  return failure(ErrorCode::usage, std::string(what) + " " + std::to_string(value) + " is not known: 0 to " +
                                       std::to_string(count - 1) + " are (maille.h)");
}

}  // namespace maille::c
