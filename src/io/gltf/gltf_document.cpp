#include "io/gltf/gltf_document.h"

#include <algorithm>

#include "base/bytes.h"
#include "io/base64.h"
#include "io/buffered_writer.h"

namespace maille {

const GltfJson* gltf_member(const GltfJson& object, const char* key) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(key);
  return found == object.end() ? nullptr : &*found;
}

const GltfJson& gltf_list(const GltfJson& object, const char* key) {
  static const GltfJson empty = GltfJson::array();
  const GltfJson* value = gltf_member(object, key);
  return value && value->is_array() ? *value : empty;
}

// Only whole numbers without sign: 1.0 and -1 are none, as the schema says of indices and sizes.
std::optional<uint64_t> gltf_number(const GltfJson& object, const char* key) {
  const GltfJson* value = gltf_member(object, key);
  if (!value || !value->is_number_unsigned()) return std::nullopt;
  return value->get<uint64_t>();
}

bool gltf_lists(const GltfJson& names, const std::string& name) {
  return std::any_of(names.begin(), names.end(),
                     [&](const GltfJson& one) { return one.is_string() && one == name; });
}

Result<GltfDocument> GltfDocument::open(const Source& source) {
  GltfDocument document;
  document.file = MAILLE_TRY(open_gltf(source, gltf_extension));
  try {
    document.json = GltfJson::parse(document.file.text);
  } catch (const GltfJson::exception&) {  // open_gltf() has parsed it before
    return failure(ErrorCode::malformed_input, document.file.name + ": its JSON cannot be parsed");
  }
  MAILLE_CHECK(document.open_views());
  return document;
}

Result<> GltfDocument::open_views() {
  const GltfJson& list = gltf_list(json, "bufferViews");
  for (size_t i = 0; i < list.size(); ++i) {
    const uint64_t buffer = gltf_number(list[i], "buffer").value_or(UINT64_MAX);
    const uint64_t offset =
        gltf_member(list[i], "byteOffset") ? gltf_number(list[i], "byteOffset").value_or(UINT64_MAX) : 0;
    const uint64_t size = gltf_number(list[i], "byteLength").value_or(UINT64_MAX);
    const std::string where = file.name + ": buffer view " + std::to_string(i);
    if (buffer >= file.buffers.size())
      return failure(ErrorCode::malformed_input, where + " names a buffer that does not exist");
    const Bytes all = file.buffers[buffer];
    if (offset > all.size() || size > all.size() - offset) {
      return failure(ErrorCode::malformed_input,
                     where + " goes beyond the " + std::to_string(all.size()) + " bytes of its buffer");
    }
    views_.push_back({all.subspan(offset, size), {}, static_cast<size_t>(buffer), offset});
  }
  return {};
}

Bytes GltfDocument::content(size_t view) const {
  return views_[view].is_new ? Bytes(views_[view].owned) : views_[view].bytes;
}

namespace {

/// Marks every view that some member "bufferView" names, in known extensions and others. The depth of the
/// JSON was bounded by open_gltf(), so the recursion ends.
void mark_views(const GltfJson& value, std::vector<bool>& used) {
  if (value.is_object()) {
    const auto view = gltf_number(value, "bufferView");
    if (view && *view < used.size()) used[*view] = true;
  }
  if (value.is_structured()) {
    for (const GltfJson& member : value) mark_views(member, used);
  }
}

}  // namespace

// What nothing names any more is free: an extension that maille does not know may still use a view, and keeps
// it.
void GltfDocument::free_views(const std::vector<size_t>& before) {
  std::vector<bool> used(views_.size());
  mark_views(json, used);
  for (const size_t view : before) {
    if (!used[view]) views_[view].is_free = true;
  }
  first_free_ = 0;
}

// Free views are used first, so that the numbers of all others stay.
size_t GltfDocument::add_view(std::vector<std::byte> bytes, const GltfJson& more) {
  while (first_free_ < views_.size() && !views_[first_free_].is_free) ++first_free_;
  const size_t number = first_free_;
  GltfJson& list = json["bufferViews"];
  if (number == views_.size()) {
    views_.emplace_back();
    if (!list.is_array()) list = GltfJson::array();
    list.push_back(GltfJson::object());
  }
  views_[number] = {};
  views_[number].owned = std::move(bytes);
  views_[number].is_new = true;
  list[number] = {{"buffer", 0}};
  list[number].update(more);
  return number;
}

void GltfDocument::use_extension(const char* name) {
  for (const char* key : {"extensionsUsed", "extensionsRequired"}) {
    if (!json[key].is_array()) json[key] = GltfJson::array();
    if (!gltf_lists(json[key], name)) json[key].push_back(name);
  }
}

/// Removes the extension's name; an empty list is not allowed by the schema.
void GltfDocument::drop_extension(const char* name) {
  for (const char* key : {"extensionsUsed", "extensionsRequired"}) {
    if (!json.contains(key) || !json[key].is_array()) continue;
    GltfJson rest = GltfJson::array();
    for (const GltfJson& one : json[key]) {
      if (one != name) rest.push_back(one);
    }
    json[key] = std::move(rest);
    if (json[key].empty()) json.erase(key);
  }
}

// Only at the end of the list: others would change the numbers of those behind.
void GltfDocument::drop_free_views() {
  while (!views_.empty() && views_.back().is_free) {
    views_.pop_back();
    json["bufferViews"].erase(views_.size());
  }
  if (views_.empty()) json.erase("bufferViews");
}

/// Gives each view its place in the one buffer there will be. What was there comes first, in the order it
/// had, overlapping views once; new bytes follow. Starts keep their remainders modulo 4, as accessors rely on
/// them.
std::vector<Bytes> GltfDocument::place_views() {
  std::vector<size_t> old;
  for (size_t i = 0; i < views_.size(); ++i) {
    if (!views_[i].is_new && !views_[i].is_free) old.push_back(i);
  }
  std::stable_sort(old.begin(), old.end(), [&](size_t a, size_t b) {
    return std::pair(views_[a].buffer, views_[a].offset) < std::pair(views_[b].buffer, views_[b].offset);
  });
  GltfJson& list = json["bufferViews"];
  std::vector<Bytes> pieces;
  static constexpr std::byte zeros[8] = {};
  uint64_t size = 0;
  const auto start = [&](uint64_t remainder) {
    // remainder < 4 and size % 4 < 4, so the difference is positive before the modulus.
    const uint64_t padding = (remainder + 8 - size % 4) % 4;
    pieces.push_back(Bytes(zeros).first(static_cast<size_t>(padding)));
    size += padding;
  };
  const auto put = [&](size_t i, uint64_t at) {
    list[i]["buffer"] = 0;
    if (at != 0 || list[i].contains("byteOffset")) list[i]["byteOffset"] = at;
    list[i]["byteLength"] = content(i).size();
  };
  for (size_t first = 0; first < old.size();) {
    const View& front = views_[old[first]];
    uint64_t end = front.offset + front.bytes.size();
    start(front.offset % 4);
    size_t next = first;
    for (; next < old.size(); ++next) {
      // Views that overlap the run so far extend it; the first one behind it begins another.
      const View& view = views_[old[next]];
      if (view.buffer != front.buffer || (next != first && view.offset >= end)) break;
      end = std::max(end, view.offset + view.bytes.size());
      put(old[next], size + view.offset - front.offset);
    }
    pieces.push_back(file.buffers[front.buffer].subspan(front.offset, end - front.offset));
    size += end - front.offset;
    first = next;
  }
  for (size_t i = 0; i < views_.size(); ++i) {
    if (views_[i].is_free) list[i] = {{"buffer", 0}, {"byteLength", 4}};  // the first bytes: any will do
    if (!views_[i].is_new) continue;
    start(0);
    put(i, size);
    pieces.push_back(views_[i].owned);
    size += views_[i].owned.size();
  }
  start(0);
  return pieces;
}

void GltfDocument::set_buffer(uint64_t size, const std::string& uri) {
  GltfJson buffer = GltfJson::object();
  if (const GltfJson& list = gltf_list(json, "buffers"); !list.empty() && list[0].is_object())
    buffer = list[0];
  buffer.erase("uri");
  if (!uri.empty()) buffer["uri"] = uri;
  buffer["byteLength"] = size;
  json["buffers"] = GltfJson::array({std::move(buffer)});
}

Result<uint64_t> GltfDocument::write(Sink& sink, bool text) {
  drop_free_views();
  std::vector<Bytes> pieces;
  if (!views_.empty()) pieces = place_views();
  std::vector<std::byte> binary;
  for (const Bytes piece : pieces) binary.insert(binary.end(), piece.begin(), piece.end());
  if (!binary.empty())
    set_buffer(binary.size(), text ? "data:application/octet-stream;base64," + to_base64(binary) : "");
  std::string document = json.dump(text ? 1 : -1, ' ', false, GltfJson::error_handler_t::replace);
  while (!text && document.size() % 4 != 0) document += ' ';
  const uint64_t size = 12 + 8 + document.size() + (binary.empty() ? 0 : 8 + binary.size());
  if (!text && size > UINT32_MAX)
    return failure(ErrorCode::usage, sink.name() + ": it would be larger than the 4 GiB of a GLB file");
  BufferedWriter out(sink);
  if (!text) {
    out.put("glTF");
    for (const uint64_t number : {uint64_t{2}, size, uint64_t{document.size()}})
      out.put_raw(static_cast<uint32_t>(number));
    out.put("JSON");
  }
  out.put(document);
  if (!text && !binary.empty()) {
    out.put_raw(static_cast<uint32_t>(binary.size()));
    out.put(std::string_view("BIN\0", 4));
    out.put_bytes(binary);
  }
  if (text) out.put('\n');
  MAILLE_CHECK(out.finish());
  MAILLE_CHECK(sink.commit());
  return text ? document.size() + 1 : size;
}

}  // namespace maille
