#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/gltf/gltf_file.h"

namespace maille {

/// JSON whose members keep their order, so that what is not touched is written as it was.
using GltfJson = nlohmann::ordered_json;

inline constexpr const char* gltf_extension = "MAILLE_mesh_compression";

/// A member of an object; nullptr where there is none, or where `object` is no object.
const GltfJson* gltf_member(const GltfJson& object, const char* key);
/// An array of the document; an empty one where there is none.
const GltfJson& gltf_list(const GltfJson& object, const char* key);
/// A member that is a whole number of 0 or more.
std::optional<uint64_t> gltf_number(const GltfJson& object, const char* key);
// Whether a list holds this name; other things than names in it are passed over.
bool gltf_lists(const GltfJson& names, const std::string& name);

/// A glTF file to be edited and written again. Extensions that maille does not know may name buffer views and
/// accessors by their numbers, so none is ever numbered anew: views that are free are taken again, or shrink
/// to nothing. Views point into `file`, which must stay.
class GltfDocument {
 public:
  // Errors: those of open_gltf(); malformed_input, for views outside of their buffers.
  static Result<GltfDocument> open(const Source& source);

  GltfJson json;
  GltfFile file;

  /// What stands in a view; valid until it is freed and taken again.
  Bytes content(size_t view) const;
  size_t view_count() const { return views_.size(); }
  /// Views that `before` lists and nothing mentions any longer are free.
  void free_views(const std::vector<size_t>& before);
  /// New bytes in a view that is free, or behind all others; `more`: its members besides place and size.
  size_t add_view(std::vector<std::byte> bytes, const GltfJson& more = GltfJson::object());
  void use_extension(const char* name);
  void drop_extension(const char* name);

  /// Writes the document with one buffer, and commits the sink. Gives the bytes written. Error: usage, for 4
  /// GiB and more of binary glTF, whose header has 32 bits.
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
