#include "io/gltf/gltf.h"

#include <cstring>
#include <string_view>

#include "io/format.h"

namespace maille {
namespace {

bool recognise_glb(Bytes first_bytes) {
  return first_bytes.size() >= 4 && std::memcmp(first_bytes.data(), "glTF", 4) == 0;
}

/// Whether it is a JSON object that soon names its asset, which every glTF file has, or its buffers.
bool recognise_gltf(Bytes first_bytes) {
  const std::string_view text(reinterpret_cast<const char*>(first_bytes.data()), first_bytes.size());
  const size_t start = text.find_first_not_of(" \t\r\n");
  return start != std::string_view::npos && text[start] == '{' &&
         (text.find("\"asset\"") != std::string_view::npos ||
          text.find("\"bufferViews\"") != std::string_view::npos ||
          text.find("\"accessors\"") != std::string_view::npos);
}

}  // namespace

// One reader takes both formats: files of either name hold either form in practice.
const Format& glb_format() {
  static const Format format{
      {"glb", {".glb"}, "glTF 2.0, binary", false}, recognise_glb, read_gltf, write_gltf};
  return format;
}

const Format& gltf_format() {
  static const Format format{
      {"gltf", {".gltf"}, "glTF 2.0, text", false}, recognise_gltf, read_gltf, write_gltf};
  return format;
}

}  // namespace maille
