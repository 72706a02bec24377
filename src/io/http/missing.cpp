// Instead of http_source.cpp where there is no libcurl.
#include <maille/http.h>

namespace maille {

Result<std::unique_ptr<HttpSource>> http_source(const std::string& url, const HttpOptions&) {
  return failure(
      ErrorCode::unsupported,
      shown_url(url) + ": this maille was built without libcurl; download the file, and open that");
}

}  // namespace maille
