#include "io/foam/polymesh_groups.h"

#include <algorithm>

#include "base/bytes.h"
#include "io/buffered_writer.h"

namespace maille {

// OpenFOAM's words hold no blanks, quotes, brackets or signs that mean something in a dictionary, and must
// not look like numbers. What a word cannot hold becomes "_", so two names may become one; FoamNames tells
// them apart again.
std::string foam_word(const std::string& name) {
  std::string word;
  for (const char c : name) {
    const bool sign = static_cast<unsigned char>(c) <= ' ' || c == 0x7f ||
                      std::string_view("\"'/;{}()[]$#\\").find(c) != std::string_view::npos;
    word += sign ? '_' : c;
  }
  if (word.empty() || std::string_view("0123456789+-.").find(word[0]) != std::string_view::npos)
    word.insert(word.begin(), '_');
  return word;
}

uint64_t FoamNames::number(const std::string& name) {
  const auto [known, is_new] = numbers_.emplace(name, words_.size());
  if (!is_new) return known->second;
  std::string word = foam_word(name);
  // Ends: each round has another number, and there are finitely many words.
  for (int i = 2; std::find(words_.begin(), words_.end(), word) != words_.end(); ++i)
    word = foam_word(name) + "_" + std::to_string(i);
  words_.push_back(word);
  return words_.size() - 1;
}

Result<> FoamLabels::read(MeshSource& mesh, uint64_t first, uint64_t count) {
  values_.resize(count * array_.tuple_size());
  return mesh.read_array(number_, first, count, values_);
}

const std::string& FoamLabels::name(uint64_t i) const {
  static const std::string none;
  return with_type(array_.type, [&](auto zero) -> const std::string& {
    using T = decltype(zero);
    const auto value = static_cast<uint64_t>(load<T>(values_.data() + i * sizeof(T)));
    return value < array_.labels.size() ? array_.labels[value] : none;
  });
}

bool is_foam_label_array(const Array& array) {
  return array.name == foam_label_array && array.domain == Domain::cell && array.role == Role::label &&
         array.components == 1;
}

bool is_foam_zone_array(const Array& array, const FoamZoneKind& kind, Domain domain) {
  const std::string name = kind.type;
  return array.domain == domain && array.role == Role::label && array.components == 1 &&
         (array.name == name || array.name.starts_with(name + ":"));
}

bool is_foam_group_array(const Array& array) {
  return is_foam_label_array(array) || is_foam_zone_array(array, foam_cell_zones, Domain::cell) ||
         is_foam_zone_array(array, foam_point_zones, Domain::point);
}

// Metadata first, blocks second: so a mesh that came from OpenFOAM keeps the order of its patches and zones.
FoamGroups::FoamGroups(const MeshDescription& mesh) {
  const auto name_of = [](const std::string& key, const char* prefix) {
    return key.substr(std::string_view(prefix).size());
  };
  for (const auto& [key, value] : mesh.metadata) {
    if (key.starts_with(foam_patch_prefix)) types_[patch(name_of(key, foam_patch_prefix))] = foam_word(value);
    if (key.starts_with(foam_cell_zones.metadata)) cell_zones.number(name_of(key, foam_cell_zones.metadata));
    if (key.starts_with(foam_face_zones.metadata)) face_zones.number(name_of(key, foam_face_zones.metadata));
    if (key.starts_with(foam_point_zones.metadata))
      point_zones.number(name_of(key, foam_point_zones.metadata));
  }
  for (const auto& [key, value] : mesh.metadata) {
    // Entries are put into a file that OpenFOAM reads, so only plain ones pass.
    if (key.starts_with(foam_entries_prefix) && is_plain_entries(value))
      entries_[patch(name_of(key, foam_entries_prefix))] = value;
  }
  for (const MeshDescription::Block& block : mesh.blocks) {
    if (is_face(block.type) && !block.name.empty()) of_face(block.name, "");
  }
}

uint64_t FoamGroups::patch(const std::string& name) {
  const uint64_t number = names_.number(name);
  if (number == types_.size()) {
    types_.emplace_back("patch");
    entries_.emplace_back();
  }
  return number;
}

FoamGroups::Target FoamGroups::of_face(const std::string& block, const std::string& label) {
  const std::string& name = block.empty() ? label : block;
  constexpr std::string_view prefix = foam_face_zone_prefix;
  if (name.starts_with(prefix)) return {true, face_zones.number(name.substr(prefix.size()))};
  return {false, patch(name.empty() ? "boundary" : name)};
}

void FoamGroups::take_types(const MeshDescription& mesh) {
  for (const auto& [key, value] : mesh.metadata) {
    if (!key.starts_with(foam_type_prefix)) continue;
    const uint64_t known = names_.find(key.substr(sizeof foam_type_prefix - 1));
    if (known < names_.size()) types_[known] = foam_word(value);
  }
}

std::vector<FoamPatch> FoamGroups::patches() const {
  std::vector<FoamPatch> patches;
  for (size_t i = 0; i < types_.size(); ++i)
    patches.push_back({names_.words()[i], types_[i], 0, 0, entries_[i]});
  return patches;
}

}  // namespace maille
