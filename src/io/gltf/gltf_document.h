#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/gltf/gltf_file.h"

namespace maille {

/// Members keep their order.
using GltfJson = nlohmann::ordered_json;

inline constexpr const char* gltf_extension = "MAILLE_mesh_compression";

/// A member of an object; nullptr where there is none, or `object` is none.
const GltfJson* gltf_member(const GltfJson& object, const char* key);
/// An array of the document; an empty one where there is none.
const GltfJson& gltf_list(const GltfJson& object, const char* key);
/// A member that is a whole number of 0 or more.
std::optional<uint64_t> gltf_number(const GltfJson& object, const char* key);
bool gltf_lists(const GltfJson& names, const std::string& name);

/// A glTF file to be edited and written again. Extensions that maille does not know may name buffer views and
/// accessors by their numbers, so that none is ever numbered anew: views that are free are taken again, or
/// shrink to nothing.
class GltfDocument {
 public:
  static Result<GltfDocument> open(const Source& source);

  GltfJson json;
  GltfFile file;

  /// What stands in a view.
  Bytes content(size_t view) const;
  size_t view_count() const { return views_.size(); }
  /// Views that `before` lists and nothing mentions any longer are free.
  void free_views(const std::vector<size_t>& before);
  /// New bytes in a view that is free, or behind all others; `more`: its members besides place and size.
  size_t add_view(std::vector<std::byte> bytes, const GltfJson& more = GltfJson::object());
  void use_extension(const char* name);
  void drop_extension(const char* name);

  /// Commits the sink. Gives the bytes written.
  Result<uint64_t> write(Sink& sink, bool text);

 private:
  struct View {
    Bytes bytes;
    std::vector<std::byte> owned;
    size_t buffer = 0;
    uint64_t offset = 0;  ///< in the buffer; of new bytes: none
    bool is_new = false, is_free = false;
  };
  Result<> open_views();
  void drop_free_views();
  std::vector<Bytes> place_views();
  void set_buffer(uint64_t size, const std::string& uri);

  std::vector<View> views_;
  size_t first_free_ = 0;  ///< no view before it is free
};

}  // namespace maille
