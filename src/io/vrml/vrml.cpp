#include "io/vrml/vrml.h"

#include <string_view>

#include "io/format.h"

namespace maille {
namespace {

// The header may stand behind a byte order mark. Other versions are recognised too, so that the reader can
// say which one it is.
bool recognise_vrml(Bytes first_bytes) {
  const std::string_view text(reinterpret_cast<const char*>(first_bytes.data()), first_bytes.size());
  return text.starts_with("#VRML") || text.starts_with("\xef\xbb\xbf#VRML");
}

}  // namespace

const Format& vrml_format() {
  static const Format format{{"wrl", {".wrl", ".vrml"}, "VRML97 indexed face, line and point sets", true},
                             recognise_vrml,
                             read_vrml,
                             write_vrml};
  return format;
}

}  // namespace maille
