#include "io/vtk/vtk_field_data.h"

#include <maille/with_type.h>

#include <utility>

#include "base/bytes.h"

namespace maille {
namespace {

/// VTK's names of types of numbers, and those of older files behind; the first name of a type is the one
/// written.
constexpr struct {
  const char* name;
  Scalar type;
} vtk_scalars[] = {{"Int8", Scalar::i8},     {"UInt8", Scalar::u8},   {"Int16", Scalar::i16},
                   {"UInt16", Scalar::u16},  {"Int32", Scalar::i32},  {"UInt32", Scalar::u32},
                   {"Int64", Scalar::i64},   {"UInt64", Scalar::u64}, {"Float32", Scalar::f32},
                   {"Float64", Scalar::f64}, {"Char", Scalar::i8},    {"char", Scalar::i8}};

}  // namespace

std::optional<Scalar> scalar_of_vtk(std::string_view name) {
  for (const auto& known : vtk_scalars) {
    if (name == known.name) return known.type;
  }
  return std::nullopt;
}

const char* vtk_name_of(Scalar type) {
  for (const auto& known : vtk_scalars) {
    if (type == known.type) return known.name;
  }
  return "";
}

std::vector<std::string> split_texts(Bytes bytes) {
  std::vector<std::string> texts;
  std::string current;
  for (const std::byte byte : bytes) {
    if (byte == std::byte{0}) {
      texts.push_back(std::exchange(current, {}));
    } else {
      current += static_cast<char>(byte);
    }
  }
  if (!current.empty()) texts.push_back(std::move(current));
  return texts;
}

// Negative numbers wrap to large ones, which are above the number of any label.
uint64_t integer_at(const Array& array, size_t i) {
  const std::byte* at = array.bytes.data() + i * size_of(array.type);
  return with_type(array.type, [&](auto zero) { return static_cast<uint64_t>(load<decltype(zero)>(at)); });
}

void VtkFieldData::give_labels(Array& array) {
  if (array.role == Role::label) array.labels = take_strings(array.name + "_labels");
}

// What is taken is gone: the rest becomes arrays and metadata of the mesh (move_to()).
std::vector<std::string> VtkFieldData::take_strings(const std::string& name) {
  for (auto found = strings.begin(); found != strings.end(); ++found) {
    if (found->name != name) continue;
    std::vector<std::string> values = std::move(found->values);
    strings.erase(found);
    return values;
  }
  return {};
}

std::optional<Array> VtkFieldData::take_array(const std::string& name) {
  for (auto found = arrays.begin(); found != arrays.end(); ++found) {
    if (found->name != name) continue;
    Array array = std::move(*found);
    arrays.erase(found);
    return array;
  }
  return std::nullopt;
}

void VtkFieldData::move_to(Mesh& mesh, VtkTexts& texts) {
  for (Array& array : arrays) mesh.arrays.push_back(std::move(array));
  for (Strings& text : strings) {
    if (text.values.size() != 1) {
      mesh.arrays.push_back(texts.numbers(text.name, Domain::mesh, 1, text.values));
      continue;
    }
    if (!text.own) texts.add_metadata(text.name);
    mesh.metadata.emplace_back(std::move(text.name), std::move(text.values[0]));
  }
  arrays.clear();
  strings.clear();
}

void check_vtk_corner_arrays(Mesh& mesh, std::vector<std::string>& notes) {
  for (Array& array : mesh.arrays) {
    if (array.domain == Domain::corner && array.count() != mesh.corner_count()) {
      notes.push_back("array \"" + array.name +
                      "\" says it is on corners, but has another size; it is kept on the mesh");
      array.domain = Domain::mesh;
    }
  }
}

}  // namespace maille
