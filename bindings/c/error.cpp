#include "guard.h"

#include <maille/version.h>
#include <stdexcept>

namespace maille::c {

int32_t report(maille_error* error, int32_t code, std::string_view message) noexcept {
  if (!error) return code;
  error->code = code;
  try {
    error->message = message;
  } catch (...) {
    error->message.clear();  // no memory even for the sentence; the code tells
  }
  return code;
}

int32_t report_exception(maille_error* error) noexcept {
  try {
    throw;
  } catch (const std::bad_alloc&) {
    return report(error, MAILLE_MEMORY_BOUND, "there is not enough memory");
  } catch (const std::length_error&) {
    return report(error, MAILLE_MEMORY_BOUND, "more than a list in memory can hold");
  } catch (const std::exception& thrown) {
    return report(error, MAILLE_INTERNAL, thrown.what());
  } catch (...) {
    return report(error, MAILLE_INTERNAL, "an exception of an unknown type");
  }
}

Result<> check(std::initializer_list<Needed> needed) {
  for (const Needed& argument : needed) {
    if (!argument.pointer) return wrong(std::string(argument.name) + " is NULL");
  }
  return {};
}

}  // namespace maille::c

using namespace maille::c;

// The number rises by one whenever functions are added (maille.h). None is removed or changed while the
// library is called libmaille.so.0.
uint32_t maille_abi_version(void) {
  return 1;
}
const char* maille_library_version(void) {
  return maille::library_version();
}
void maille_format_version(uint32_t* major, uint32_t* minor) {
  if (major) *major = maille::format_major;
  if (minor) *minor = maille::format_minor;
}

maille_error* maille_error_create(void) {
  // There is no error object yet that could tell why this failed, so NULL must.
  return new (std::nothrow) maille_error;
}
void maille_error_free(maille_error* error) {
  delete error;
}
int32_t maille_error_code(const maille_error* error) {
  return error ? error->code : MAILLE_OK;
}
const char* maille_error_message(const maille_error* error) {
  return error ? error->message.c_str() : "";
}
void maille_error_clear(maille_error* error) {
  if (error) report(error, MAILLE_OK, "");
}
