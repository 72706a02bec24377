// Instead of server.cpp where there is no cpp-httplib.
#include "result.h"
#include "verbs.h"

namespace maille::tool {

Result<int> run(const ServeOptions&) {
  return failure(ErrorCode::unsupported,
                 "this maille was built without `maille serve` (Debian: libcpp-httplib-dev was missing); any "
                 "web server that gives ranges does, see docs/random-access.md");
}

Result<int> run(const ViewOptions&) {
  return failure(ErrorCode::unsupported,
                 "this maille was built without `maille view` (Debian: libcpp-httplib-dev was missing)");
}

}  // namespace maille::tool
