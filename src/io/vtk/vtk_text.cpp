#include "io/vtk/vtk_text.h"

#include "base/bytes.h"
#include "io/vtk/vtk_field_data.h"

namespace maille {

bool was_vtk_text(const std::vector<std::pair<std::string, std::string>>& metadata, Domain domain,
                  const std::string& name) {
  // Line ends on both sides, so that the name of one array is not found within that of another.
  const std::string line = "\n" + std::string(name_of(domain)) + " " + name + "\n";
  for (const auto& [key, value] : metadata) {
    if (key == vtk_text_key && ("\n" + value + "\n").find(line) != std::string::npos) return true;
  }
  return false;
}

bool is_vtk_text(const std::vector<std::pair<std::string, std::string>>& metadata, const Array& array) {
  if (array.role != Role::label || !was_vtk_text(metadata, array.domain, array.name)) return false;
  const size_t count = array.count() * array.components;
  for (size_t i = 0; i < count; ++i) {
    if (integer_at(array, i) >= array.labels.size()) return false;
  }
  return true;
}

std::vector<std::string> vtk_texts_of(const Array& array) {
  std::vector<std::string> texts;
  const size_t count = array.count() * array.components;
  for (size_t i = 0; i < count; ++i) {
    const uint64_t number = integer_at(array, i);
    // Somebody has changed numbers or labels since: then it is written as numbers.
    if (number >= array.labels.size()) return {};
    texts.push_back(array.labels[number]);
  }
  return texts;
}

// Texts become labels: each text gets the next number when it comes up first. The numbers go on from piece to
// piece of a file, so that pieces can be joined.
Array VtkTexts::numbers(const std::string& name, Domain domain, uint32_t components,
                        const std::vector<std::string>& texts) {
  Labels& labels = arrays_[{domain, name}];
  Array array = make_array(name, domain, Scalar::u32, components, Role::label);
  array.bytes.resize(texts.size() * sizeof(uint32_t));
  for (size_t i = 0; i < texts.size(); ++i) {
    const auto next = static_cast<uint32_t>(labels.texts.size());
    const auto [found, is_new] = labels.numbers.emplace(texts[i], next);
    if (is_new) labels.texts.push_back(texts[i]);
    store(array.bytes.data() + i * sizeof(uint32_t), found->second);
  }
  return array;
}

// Labels are given at the end, when the texts of all pieces are known.
void VtkTexts::finish(Mesh& mesh) {
  for (Array& array : mesh.arrays) {
    const auto found = arrays_.find({array.domain, array.name});
    if (found == arrays_.end() || array.role != Role::label) continue;
    array.labels = found->second.texts;
    lines_ += std::string(name_of(array.domain)) + " " + array.name + "\n";
  }
  if (lines_.empty()) return;
  lines_.pop_back();
  mesh.metadata.emplace_back(vtk_text_key, std::move(lines_));
}

}  // namespace maille
