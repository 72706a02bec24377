#include "io/gltf/gltf_file.h"

#include <maille/path.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string_view>

#include "base/bytes.h"
#include "io/base64.h"
#include "io/beside.h"

namespace maille {
namespace {

using nlohmann::json;

/// Deeper than any real file; keeps recursive parsers off the stack's end. Chosen, not swept.
constexpr int max_depth = 200;

std::string_view text_of(Bytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

tl::unexpected<Error> malformed(const std::string& file, const std::string& what) {
  return failure(ErrorCode::malformed_input, file + ": " + what);
}

struct Chunks {
  std::string_view json;
  size_t json_at = 0;
  Bytes binary;
  bool is_binary_file = false;
};

Result<Chunks> split_glb(const std::string& file, Bytes bytes) {
  if (bytes.size() < 12) return malformed(file, "it ends inside the 12 bytes of the GLB header");
  const auto version = load<uint32_t>(bytes.data() + 4);
  const auto length = load<uint32_t>(bytes.data() + 8);
  if (version != 2) {
    return failure(ErrorCode::unsupported,
                   file + ": it is GLB version " + std::to_string(version) + "; only version 2 can be read");
  }
  if (length > bytes.size()) {
    return malformed(file, "its header says " + std::to_string(length) + " bytes, but it has " +
                               std::to_string(bytes.size()) + "; it is cut off");
  }
  Chunks chunks;
  chunks.is_binary_file = true;
  bool have_binary = false;
  // Each chunk takes 8 bytes at least, so the loop ends with the file.
  for (size_t at = 12; at < length;) {
    if (length - at < 8) return malformed_byte(file, at, "it ends inside a chunk header");
    const auto size = load<uint32_t>(bytes.data() + at);
    const auto type = load<uint32_t>(bytes.data() + at + 4);
    if (size > length - at - 8) {
      return malformed_byte(file, at,
                            "a chunk of " + std::to_string(size) + " bytes goes beyond the file's end");
    }
    const Bytes content = bytes.subspan(at + 8, size);
    // "JSON" and "BIN\0" as little-endian numbers (glTF 2.0, 4.4.3).
    constexpr uint32_t json_type = 0x4e4f534a, binary_type = 0x004e4942;
    if (at == 12) {
      if (type != json_type) return malformed_byte(file, at, "the first chunk is not JSON");
      chunks.json = text_of(content);
      chunks.json_at = at + 8;
      // Other chunks are of extensions, and passed over as the standard demands.
    } else if (type == binary_type && !have_binary) {
      chunks.binary = content;
      have_binary = true;
    }
    at += 8 + size_t{size};
  }
  if (chunks.json.empty()) return malformed(file, "there is no JSON chunk");
  return chunks;
}

Result<json> parse_json(const std::string& file, const Chunks& chunks) {
  if (const auto at = json_too_deep(chunks.json))
    return malformed_byte(file, chunks.json_at + *at, "JSON nested more than 200 levels deep");
  json document;
  try {
    document = json::parse(chunks.json);
  } catch (const json::exception& error) {
    const auto* where = dynamic_cast<const json::parse_error*>(&error);
    return malformed_byte(file, chunks.json_at + (where ? std::max<size_t>(where->byte, 1) - 1 : 0),
                          "neither binary glTF nor well-formed JSON");
  }
  if (!document.is_object()) return malformed(file, "its JSON is not an object");
  return document;
}

const json* member(const json& object, const char* key) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(key);
  return found == object.end() ? nullptr : &*found;
}

std::string string_of(const json& object, const char* key) {
  const json* value = member(object, key);
  return value && value->is_string() ? value->get<std::string>() : "";
}

const json& array_of(const json& object, const char* key) {
  static const json empty = json::array();
  const json* value = member(object, key);
  return value && value->is_array() ? *value : empty;
}

/// Whether an extension says how materials, lights and the like look; meshes are the same without them.
/// Quantised attributes are read as they are, in integers.
bool leaves_geometry_alone(const std::string& extension) {
  static constexpr std::string_view prefixes[] = {"KHR_materials_",
                                                  "KHR_texture_",
                                                  "EXT_texture_",
                                                  "MSFT_texture_",
                                                  "KHR_lights_",
                                                  "EXT_lights_",
                                                  "KHR_animation_",
                                                  "KHR_xmp",
                                                  "KHR_node_",
                                                  "MSFT_lod",
                                                  "AGI_",
                                                  "KHR_mesh_quantization",
                                                  "EXT_mesh_gpu_instancing",
                                                  "EXT_mesh_features",
                                                  "EXT_structural_metadata",
                                                  "EXT_instance_features",
                                                  "KHR_techniques_webgl"};
  return std::any_of(std::begin(prefixes), std::end(prefixes),
                     [&](std::string_view prefix) { return extension.starts_with(prefix); });
}

std::string advice_for(const std::string& extension) {
  if (extension == "KHR_draco_mesh_compression")
    return "decompress it first, e.g. with \"gltf-transform copy\"";
  if (extension.ends_with("_meshopt_compression"))
    return "decompress it first, e.g. with \"gltf-transform copy\"";
  return "export it again without this extension";
}

Result<> check_version_and_extensions(const std::string& file, const json& document,
                                      std::string_view allowed) {
  const json* asset = member(document, "asset");
  const std::string version = asset ? string_of(*asset, "version") : "";
  if (version.empty()) return malformed(file, "there is no asset.version, so this is not a glTF file");
  if (!version.starts_with("2.")) {
    return failure(ErrorCode::unsupported,
                   file + ": it is glTF " + version + "; only version 2 can be read, convert it first");
  }
  for (const json& extension : array_of(document, "extensionsRequired")) {
    const std::string name = extension.is_string() ? extension.get<std::string>() : extension.dump();
    if (leaves_geometry_alone(name) || name == allowed) continue;
    return failure(ErrorCode::unsupported, file + ": it requires the extension " + name +
                                               ", which cannot be read here; " + advice_for(name));
  }
  return {};
}

/// A relative URI as a path, %XX decoded. Empty when it is none, or leads out of the folder. Only the text is
/// looked at here: open_beside() then guards against links.
std::string safe_path(const std::string& uri) {
  std::string path;
  const auto digit = [](char c) {
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
  };
  for (size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] == '%' && i + 2 < uri.size() && digit(uri[i + 1]) >= 0 && digit(uri[i + 2]) >= 0) {
      path += static_cast<char>(digit(uri[i + 1]) * 16 + digit(uri[i + 2]));
      i += 2;
    } else {
      path += uri[i];
    }
  }
  const std::filesystem::path parts = to_path(path);
  const bool leaves = std::any_of(parts.begin(), parts.end(), [](const auto& part) { return part == ".."; });
  // Backslashes and colons mean something on other systems; nothing that a mesh needs has them.
  const bool odd = path.find_first_of(std::string_view("\\:\0", 3)) != std::string::npos;
  return parts.is_absolute() || leaves || odd ? "" : path;
}

/// Finds the bytes of the buffers, in their order: in data URIs, the binary chunk or files beside. They stay
/// in `file`.
class BufferLoader {
 public:
  BufferLoader(GltfFile& file, const Chunks& chunks) : file_(file), chunks_(chunks) {}

  Result<> load(const json& buffer) {
    const size_t number = file_.buffers.size();
    where_ = "buffer " + std::to_string(number);
    const json* length = member(buffer, "byteLength");
    if (!length || !length->is_number_unsigned()) return malformed(file_.name, where_ + " has no byteLength");
    const auto size = length->get<uint64_t>();
    const std::string uri = string_of(buffer, "uri");
    Bytes bytes;
    if (!uri.empty()) {
      bytes = MAILLE_TRY(uri.starts_with("data:") ? decode(uri, size) : open(uri));
    } else if (number == 0 && chunks_.is_binary_file) {
      bytes = chunks_.binary;
    } else {
      file_.buffers.emplace_back();  // a fallback of some extension: an error only when something uses it
      return {};
    }
    if (bytes.size() < size) {
      return malformed(file_.name, where_ + " should have " + std::to_string(size) +
                                       " bytes, but there are " + std::to_string(bytes.size()));
    }
    // The binary chunk may be longer by padding.
    file_.buffers.push_back(bytes.first(static_cast<size_t>(size)));
    return {};
  }

 private:
  Result<Bytes> decode(const std::string& uri, uint64_t size) {
    const size_t comma = uri.find(',');
    if (comma == std::string::npos ||
        std::string_view(uri).substr(0, comma).find(";base64") == std::string_view::npos) {
      return malformed(file_.name, where_ + " is a data URI, but not in base64");
    }
    Base64Reader reader(std::string_view(uri).substr(comma + 1));
    // Bounded by the text, whatever byteLength says.
    std::vector<std::byte> bytes(static_cast<size_t>(std::min(size, reader.most_left())));
    if (!reader.read(bytes)) {
      return malformed(file_.name, where_ + ": its base64 data have foreign characters or fewer than " +
                                       std::to_string(size) + " bytes");
    }
    file_.embedded.push_back(std::move(bytes));
    file_.total_bytes += file_.embedded.back().size();
    return Bytes(file_.embedded.back());
  }

  Result<Bytes> open(const std::string& uri) {
    const std::string path = safe_path(uri);
    if (path.empty()) {
      return failure(ErrorCode::unsupported, file_.name + ": " + where_ + " is at \"" + uri.substr(0, 200) +
                                                 "\"; only files in the same folder or below are opened");
    }
    // Standard input has no folder.
    if (file_.name.starts_with("<")) {
      return failure(ErrorCode::cannot_read, file_.name + ": " + where_ + " is in the file \"" + path +
                                                 "\" beside it, which needs the glTF file's own path");
    }
    auto source = open_beside(file_.name, path);
    if (!source) {
      return failure(ErrorCode::cannot_read,
                     file_.name + ": " + where_ + " cannot be read: " + source.error().message);
    }
    file_.files.push_back(std::move(*source));
    file_.file_bytes.push_back(MAILLE_TRY(InputBytes::load(*file_.files.back())));
    file_.total_bytes += file_.files.back()->size();
    return file_.file_bytes.back().bytes();
  }

  GltfFile& file_;
  const Chunks& chunks_;
  std::string where_;
};

std::string list_left_out(const json& document) {
  static constexpr struct {
    const char* key;
    const char* singular;
  } parts[] = {
      {"textures", "texture"}, {"animations", "animation"}, {"skins", "skin"}, {"cameras", "camera"}};
  std::string list;
  for (const auto& part : parts) {
    const uint64_t count = array_of(document, part.key).size();
    if (count != 0) list += (list.empty() ? "" : ", ") + counted(count, part.singular);
  }
  return list;
}

/// Leaves only what the reader of meshes looks at, so that nothing else can fail or cost anything in the
/// library.
std::string reduce(const json& document) {
  json scene = {{"asset", {{"version", "2.0"}}}};
  for (const char* key : {"accessors", "bufferViews", "meshes", "nodes", "scenes", "scene"}) {
    if (const json* value = member(document, key)) scene[key] = *value;
  }
  return scene.dump();
}

void take_metadata(GltfFile& file, json asset) {
  if (const json* extras = member(asset, "extras"); extras && extras->is_object()) {
    for (const json& pair : array_of(*extras, "maille_metadata")) {
      if (pair.is_array() && pair.size() == 2 && pair[0].is_string() && pair[1].is_string()) {
        file.metadata.emplace_back(pair[0].get<std::string>(), pair[1].get<std::string>());
      }
    }
    asset["extras"].erase("maille_metadata");
    if (asset["extras"].empty()) asset.erase("extras");
  }
  // What our writer puts there by itself says nothing.
  if (string_of(asset, "generator") != "maille" || asset.size() > 2) file.asset = asset.dump();
}

}  // namespace

/// Brackets in strings do not count; a text that is not well-formed is refused later.
std::optional<size_t> json_too_deep(std::string_view json) {
  int depth = 0;
  bool in_string = false;
  for (size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      if (++depth > max_depth) return i;
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return std::nullopt;
}

Result<GltfFile> open_gltf(const Source& source, std::string_view allowed) {
  GltfFile file;
  file.name = source.name();
  file.input = MAILLE_TRY(InputBytes::load(source));
  const Bytes bytes = file.input.bytes();
  file.total_bytes = bytes.size();
  Chunks chunks;
  if (text_of(bytes).starts_with("glTF")) {
    chunks = MAILLE_TRY(split_glb(file.name, bytes));
  } else {
    chunks.json = text_of(bytes);
  }
  const json document = MAILLE_TRY(parse_json(file.name, chunks));
  MAILLE_CHECK(check_version_and_extensions(file.name, document, allowed));
  file.text = chunks.json;
  for (const char* key : {"extensionsUsed", "extensionsRequired"}) {
    for (const json& name : array_of(document, key))
      file.compressed = file.compressed || (name.is_string() && name == allowed);
  }
  BufferLoader loader(file, chunks);
  for (const json& buffer : array_of(document, "buffers")) MAILLE_CHECK(loader.load(buffer));
  for (const json& material : array_of(document, "materials")) {
    file.materials.push_back(string_of(material, "name"));
  }
  file.nodes = array_of(document, "nodes").dump();
  take_metadata(file, document["asset"]);
  file.left_out = list_left_out(document);
  file.scene = reduce(document);
  if (file.scene.size() > UINT32_MAX) {
    return failure(ErrorCode::unsupported, file.name + ": its JSON is larger than 4 GiB");
  }
  return file;
}

}  // namespace maille
