#include "io/gltf.h"

#include <string_view>

#include "io/format.h"

namespace maille {
namespace {

/// The magic of .glb; for .gltf a JSON object that soon names its asset, which every glTF file has.
bool recognise_gltf(Bytes first_bytes) {
  const std::string_view text(reinterpret_cast<const char*>(first_bytes.data()), first_bytes.size());
  if (text.substr(0, 4) == "glTF") return true;
  const size_t start = text.find_first_not_of(" \t\r\n");
  return start != std::string_view::npos && text[start] == '{' &&
         (text.find("\"asset\"") != std::string_view::npos ||
          text.find("\"bufferViews\"") != std::string_view::npos ||
          text.find("\"accessors\"") != std::string_view::npos);
}

}  // namespace

const Format& gltf_format() {
  static const Format format{{"gltf", {".glb", ".gltf"}, "glTF 2.0, binary (.glb) or text (.gltf)", false},
                             recognise_gltf,
                             read_gltf,
                             write_gltf};
  return format;
}

}  // namespace maille
