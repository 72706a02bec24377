#include "io/http/curl.h"

#include <dlfcn.h>

namespace maille {
namespace {

/// As Debian names what is built with GnuTLS, and as everybody names the rest. The ABI has the number 4 in
/// both.
constexpr const char* library_names[] = {"libcurl-gnutls.so.4", "libcurl.so.4"};

template <class Function>
bool find(void* library, const char* name, Function& function) {
  function = reinterpret_cast<Function>(dlsym(library, name));
  return function != nullptr;
}

bool find_all(void* library, Curl& curl) {
  return find(library, "curl_global_init", curl.global_init) &&
         find(library, "curl_easy_init", curl.easy_init) &&
         find(library, "curl_easy_setopt", curl.easy_setopt) &&
         find(library, "curl_easy_getinfo", curl.easy_getinfo) &&
         find(library, "curl_easy_strerror", curl.easy_strerror) &&
         find(library, "curl_easy_cleanup", curl.easy_cleanup) &&
         find(library, "curl_multi_init", curl.multi_init) &&
         find(library, "curl_multi_add_handle", curl.multi_add_handle) &&
         find(library, "curl_multi_remove_handle", curl.multi_remove_handle) &&
         find(library, "curl_multi_perform", curl.multi_perform) &&
         find(library, "curl_multi_info_read", curl.multi_info_read) &&
         find(library, "curl_multi_poll", curl.multi_poll) &&
         find(library, "curl_multi_cleanup", curl.multi_cleanup) &&
         find(library, "curl_slist_append", curl.slist_append) &&
         find(library, "curl_slist_free_all", curl.slist_free_all);
}

const Curl* load() {
  static Curl curl;
  for (const char* name : library_names) {
    void* library = dlopen(name, RTLD_NOW | RTLD_LOCAL);
    // It stays: other threads may be in it until the process ends.
    if (library != nullptr && find_all(library, curl))
      return curl.global_init(CURL_GLOBAL_DEFAULT) == CURLE_OK ? &curl : nullptr;
  }
  return nullptr;
}

}  // namespace

const Curl* loaded_curl() {
  static const Curl* const curl = load();
  return curl;
}

}  // namespace maille
