#pragma once

#include <maille/mesh.h>

#include <string>
#include <string_view>

// How glTF's attributes are called in a mesh: TEXCOORD_0 <-> "texcoord", TEXCOORD_1 <-> "texcoord_1",
// _OWN <-> "OWN".

namespace maille {

/// Attributes that the standard names. `numbered`: sets _0, _1, ... of which the first has the plain name
/// here.
struct GltfSemantic {
  const char* semantic;
  const char* name;
  Role role;
  bool numbered;
};

inline constexpr GltfSemantic gltf_semantics[] = {
    {"NORMAL", "normal", Role::normal, false},
    {"TANGENT", "tangent", Role::tangent, false},
    {"TEXCOORD", "texcoord", Role::texture_coordinate, true},
    {"COLOR", "colour", Role::colour, true},
    {"JOINTS", "joints", Role::none, true},
    {"WEIGHTS", "weights", Role::none, true},
};

/// The name and role of an attribute in a mesh. Different attributes may get one name ("_normal" and
/// "NORMAL"): callers make it unique.
inline std::pair<std::string, Role> name_of_gltf(const std::string& attribute) {
  for (const GltfSemantic& known : gltf_semantics) {
    if (!known.numbered && attribute == known.semantic) return {known.name, known.role};
    const std::string prefix = std::string(known.semantic) + "_";
    if (!known.numbered || !attribute.starts_with(prefix)) continue;
    const std::string number = attribute.substr(prefix.size());
    return {number == "0" ? known.name : known.name + ("_" + number), known.role};
  }
  const bool own = attribute.size() > 1 && attribute[0] == '_';
  return {own ? attribute.substr(1) : attribute, Role::none};
}

}  // namespace maille
