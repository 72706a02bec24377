// Fields of OpenFOAM into a mesh. docs/formats.md, "Cases of OpenFOAM".
#include "io/foam/foam_field_reader.h"

#include <maille/path.h>

#include <algorithm>
#include <cstring>
#include <filesystem>

#include "io/base64.h"
#include "io/beside.h"
#include "io/foam/foam_dictionary.h"
#include "io/foam/foam_file.h"
#include "io/gzip.h"
#include "io/reading.h"

namespace maille {
namespace {

namespace fs = std::filesystem;

/// Text that is parsed as a dictionary. Lists that are no values of cells or faces stay in the text, which is
/// metadata then. Chosen, not swept.
constexpr uint64_t most_text_bytes = uint64_t{1} << 20;
/// The most faces inside that one cell may own, as each is a component of an array over all cells: polyhedra
/// have some dozens, half of them their own. Chosen, not swept.
constexpr uint64_t most_owned_faces_kept = 128;

/// A file of a time, unpacked, with what it is a view of.
struct FieldFile {
  std::string path;
  std::unique_ptr<Source> source;
  InputBytes bytes;
  std::vector<std::byte> unpacked;

  std::string_view text() const {
    if (unpacked.empty()) return bytes.text();
    return {reinterpret_cast<const char*>(unpacked.data()), unpacked.size()};
  }
};

Result<FieldFile> open_field(const std::string& folder, const std::string& name, const Limits& limits) {
  FieldFile file;
  file.path = folder + "/" + name;
  file.source = MAILLE_TRY(open_beside(folder + "/", name));
  file.bytes = MAILLE_TRY(InputBytes::load(*file.source));
  if (is_gzip(file.bytes.bytes()))
    file.unpacked = MAILLE_TRY(gunzip(file.bytes.bytes(), limits.mesh_bytes, file.path));
  return file;
}

bool is_text(std::string_view text) {
  return text.find('\0') == std::string_view::npos;
}

/// The value of a text such as "uniform $pressure;", put in by the reader of dictionaries: "uniform 5".
std::string expanded_value(const FoamField& field) {
  const auto file = parse_foam_text(field.text, field.name);
  const FoamDictionary::Entry* const entry = file ? file->dictionary.find("internalField") : nullptr;
  if (entry == nullptr) return {};
  std::string value;
  for (const FoamToken& token : entry->tokens) value += (value.empty() ? "" : " ") + token.text;
  return value;
}

bool is_literal(const FoamField& field, const FoamValues& values) {
  const std::string_view text = field.text.substr(values.begin, values.end - values.begin);
  return !values.uniform || text.find_first_of("$#") == std::string_view::npos;
}

}  // namespace

/// The text without the comment that all fields of a time mostly begin with: it is kept once, and a mark
/// stands for it.
std::string FoamFieldReader::without_banner(std::string_view text) {
  const size_t end = text.starts_with("/*") ? text.find("*/\n") : std::string_view::npos;
  if (end == std::string_view::npos) return std::string(text);
  const std::string_view comment = text.substr(0, end + 3);
  if (!banner_) {
    banner_ = comment;
    mesh_.metadata.emplace_back(foam_banner_key, comment);
  }
  if (*banner_ != comment) return std::string(text);
  return foam_list_mark + std::string(text.substr(end + 3));
}

void FoamFieldReader::add_text(const std::string& name, std::string_view text) {
  mesh_.metadata.emplace_back(name, without_banner(text));
}

Result<size_t> FoamFieldReader::new_array(const std::string& name, Domain domain, Scalar type,
                                          uint64_t components, const FoamField& field) {
  const uint64_t count = domain == Domain::point ? places_.points : places_.all_cells;
  MAILLE_CHECK(budget_.take(count, components * size_of(type)));
  if (mesh_.find(name, domain) != nullptr)
    return failure(ErrorCode::malformed_input,
                   field.name + ": the mesh has an array \"" + name + "\" already; rename one of the two");
  Array array = make_array(name, domain, type, static_cast<uint32_t>(components));
  array.resize(count);
  mesh_.arrays.push_back(std::move(array));
  return mesh_.arrays.size() - 1;
}

Result<> FoamFieldReader::fill(const FoamField& field, const FoamValues& values, Array& array, uint64_t first,
                               uint64_t count, int& digits) const {
  FoamValueReader reader(field, values);
  for (uint64_t i = 0; i < count; ++i)
    MAILLE_CHECK(reader.next(array.bytes.data() + (first + i) * array.tuple_size()));
  digits = std::max(digits, reader.digits());
  return reader.end();
}

/// Fills in values of faces inside: the first, second ... face that a cell owns are its first, second ...
/// components. The order of faces (by owner) makes this reversible without a list of faces.
Result<> FoamFieldReader::fill_owned(const FoamField& field, const FoamValues& values, Array& array,
                                     int& digits) const {
  FoamValueReader reader(field, values);
  const size_t size = reader.components() * size_of(array.type);
  uint64_t owned = 0;
  for (size_t i = 0; i < places_.owners.size(); ++i) {
    owned = i > 0 && places_.owners[i] == places_.owners[i - 1] ? owned + 1 : 0;
    MAILLE_CHECK(reader.next(array.bytes.data() + places_.owners[i] * array.tuple_size() + owned * size));
  }
  digits = std::max(digits, reader.digits());
  return reader.end();
}

/// Gives faces of patches the values of their cells, where a patch says none: so fields are seen on the
/// surface of a mesh as ParaView sees them in a case, and cost little. Patches of type empty are as large as
/// all cells, and are left alone.
void FoamFieldReader::put_at_patches(Array& array) const {
  const size_t size = array.tuple_size();
  for (const FoamPlaces::Patch& patch : places_.patches) {
    if (patch.type == "empty") continue;
    for (uint64_t i = 0; i < patch.faces; ++i)
      std::memcpy(array.bytes.data() + (patch.first + i) * size, array.bytes.data() + patch.owners[i] * size,
                  size);
  }
}

Result<> FoamFieldReader::add_internal(const FoamField& field, const FoamValues& values,
                                       const FoamFieldKind& kind, Array& array) {
  using Place = FoamFieldKind::Place;
  const uint64_t there = kind.place == Place::cells    ? places_.cells
                         : kind.place == Place::points ? places_.points
                                                       : places_.owners.size();
  const char* const what = kind.place == Place::cells    ? "cells"
                           : kind.place == Place::points ? "points"
                                                         : "faces inside";
  if (foam_components(values.type) != kind.components && !values.type.empty())
    return field.bad(values.begin, "a list of " + values.type + " in a " + field.type);
  if (!values.uniform && values.count != there)
    return field.bad(values.begin, "a field of " + std::to_string(values.count) + " values, but " +
                                       places_.mesh + " has " + std::to_string(there) + " " + what);
  int digits = 0;
  MAILLE_CHECK(kind.place == Place::faces ? fill_owned(field, values, array, digits)
                                          : fill(field, values, array, 0, there, digits));
  if (kind.place == Place::cells) put_at_patches(array);
  // The digits with which the numbers were written, so that they come back with as many; 6 is OpenFOAM's
  // default.
  internal_digits_ = field.binary ? "" : std::to_string(std::max(digits, 6));
  return {};
}

/// Puts the values of a patch into an array; false: the list stays in the text.
Result<bool> FoamFieldReader::add_patch(const FoamField& field, const FoamValues& values,
                                        const FoamFieldKind& kind, size_t first_array, int& digits) {
  const FoamPlaces::Patch* const patch = places_.find(values.patch);
  if (patch == nullptr || kind.place == FoamFieldKind::Place::points || !is_literal(field, values))
    return false;
  const bool main = values.entry == "value";
  const uint32_t components = values.type.empty() ? kind.components : foam_components(values.type);
  if (main && !values.uniform && (values.count != patch->faces || components != kind.components)) {
    return field.bad(values.begin, "a list of " + std::to_string(values.count) + " values, but patch " +
                                       values.patch + " of " + places_.mesh + " has " +
                                       counted(patch->faces, "face"));
  }
  if (main) {
    MAILLE_CHECK(fill(field, values, mesh_.arrays[first_array], patch->first, patch->faces, digits));
    return true;
  }
  if (values.uniform || values.count != patch->faces || components == 0 || values.type == "label" ||
      values.type == "bool")
    return false;
  const std::string name = mesh_.arrays[first_array].name + ":" + values.entry;
  size_t k = first_array + 1;
  while (k < mesh_.arrays.size() && mesh_.arrays[k].name != name) ++k;
  if (k == mesh_.arrays.size())
    k = MAILLE_TRY(new_array(name, Domain::cell, field.scalar(), components, field));
  if (mesh_.arrays[k].components != components) return false;
  MAILLE_CHECK(fill(field, values, mesh_.arrays[k], patch->first, patch->faces, digits));
  return true;
}

Result<> FoamFieldReader::add(const FoamField& field, const FoamFieldKind& kind, const std::string& name,
                              const std::string& time) {
  using Place = FoamFieldKind::Place;
  // Of several entries the last one counts.
  auto internal = field.values.end();
  for (auto values = field.values.begin(); values != field.values.end(); ++values) {
    if (!values->is_internal()) continue;
    const bool again = internal != field.values.end();
    if (again && !(values->uniform && internal->uniform))
      return field.bad(values->begin, "there is a list for internalField already");
    internal = values;
  }
  // Without lists, a text may say its value by way of variables and other files.
  FoamField expanded = field;
  std::string value;
  const bool spelt = internal != field.values.end() && is_literal(field, *internal);
  if (!spelt) {
    const bool only_text = !field.binary && field.text.size() <= most_text_bytes;
    value = only_text ? "internalField " + expanded_value(field) + ";" : "";
    auto scanned = scan_foam_field(value, field.name);
    if (!scanned || scanned->values.size() != 1 || !is_literal(*scanned, scanned->values[0])) {
      if (!only_text) return field.bad(0, "there should be an internalField with values");
      notes_.push_back(time + "/" + name + ": its internalField is no value or list; kept as text only");
      add_text(foam_field_prefix + name, field.text);
      return {};
    }
    expanded.text = value;
    expanded.values = std::move(scanned->values);
  }
  const FoamValues& values = spelt ? *internal : expanded.values[0];
  const bool on_faces = kind.place == Place::faces;
  if (on_faces &&
      (places_.most_owned > most_owned_faces_kept || (places_.most_owned == 0 && !places_.owners.empty()))) {
    notes_.push_back(time + "/" + name + ": left out; " +
                     (places_.most_owned == 0 ? "the faces of the mesh are not in OpenFOAM's order"
                                              : "a cell of the mesh has too many faces"));
    return {};
  }
  const uint64_t components = kind.components * (on_faces ? std::max<uint64_t>(places_.most_owned, 1) : 1);
  const size_t first = MAILLE_TRY(new_array(name, kind.place == Place::points ? Domain::point : Domain::cell,
                                            field.scalar(), components, field));
  MAILLE_CHECK(add_internal(spelt ? field : expanded, values, kind, mesh_.arrays[first]));
  std::string text;
  size_t done = 0;
  const auto copy_to = [&](size_t end) {
    text += field.text.substr(done, end - done);
    done = end;
  };
  // The header names the folder of the time; a mark keeps it right when the field is written at another one.
  if (field.location == time && field.location_begin > 0) {
    copy_to(field.location_begin);
    text += foam_list_mark;
    done = field.location_end;
  }
  for (const FoamValues& list : field.values) {
    int digits = 0;
    const bool taken = list.is_internal() || MAILLE_TRY(add_patch(field, list, kind, first, digits));
    if (list.uniform) continue;
    if (!taken && !field.binary) continue;
    copy_to(list.begin);
    done = list.end;
    text += std::string(" ") + foam_list_mark;
    if (!taken) {
      // A list that is not taken: nothing of a binary file can be text but in base64.
      text += "base64:" +
              to_base64(std::as_bytes(std::span(field.text.substr(list.begin, list.end - list.begin))));
    } else if (!field.binary) {
      text += list.is_internal() ? internal_digits_ : std::to_string(std::max(digits, 6));
    }
  }
  copy_to(field.text.size());
  if (!is_text(text)) return field.bad(0, "there are bytes in it that are neither text nor a list");
  add_text(foam_field_prefix + name, text);
  return {};
}

Result<> FoamFieldReader::read_file(const std::string& folder, const std::string& name,
                                    const std::string& time) {
  const FieldFile file = MAILLE_TRY(open_field(folder, name, limits_));
  const std::string plain = name.ends_with(".gz") ? name.substr(0, name.size() - 3) : name;
  std::string_view text = file.text();
  // The header stands behind a banner; 4096 bytes hold both.
  const bool is_foam = text.substr(0, 4096).find("FoamFile") != std::string_view::npos;
  FoamFieldJoiner::Joined joined;
  if (is_foam && joiner_ != nullptr) {
    joined = MAILLE_TRY(joiner_->join(time, plain));
    text = joined.text;
  }
  if (!joined.left_out.empty()) {
    notes_.push_back(time + "/" + plain + ": left out; " + joined.left_out);
    return {};
  }
  const auto field = is_foam ? scan_foam_field(text, file.path) : Result<FoamField>(FoamField());
  const auto kind = field ? foam_field_kind(field->type) : std::nullopt;
  // A template that is copied to the field's place has the field's name in it, and is kept as text.
  const bool is_template = field && field->object != plain && plain.ends_with(".orig");
  if (!field) return tl::unexpected(field.error());
  if (kind && !is_template) return add(*field, *kind, plain, time);
  if (is_text(text) && text.size() <= most_text_bytes / 16 && is_plain_foam_path(plain)) {
    add_text(foam_text_prefix + plain, text);
    return {};
  }
  notes_.push_back(
      time + "/" + plain + ": left out; " +
      (field->type.empty() ? "it is no field" : "fields of class " + field->type + " are not read"));
  return {};
}

Result<> FoamFieldReader::read(const std::string& case_folder, const FoamTime& time) {
  const std::string folder =
      joiner_ != nullptr ? joiner_->first_folder(time.name) : case_folder + "/" + time.name;
  mesh_.metadata.emplace_back(foam_time_key, time.name);
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(to_path(folder), error), end; entry != end; entry.increment(error)) {
    const std::string name = to_utf8(entry->path().filename());
    if (name.starts_with(".") || name.ends_with("~")) continue;
    names.push_back(name);
  }
  if (error) return failure(ErrorCode::cannot_read, "cannot read " + folder + ": " + error.message());
  std::sort(names.begin(), names.end());
  for (const std::string& name : names) {
    const fs::path path = to_path(folder) / to_path(name);
    // decomposePar links the folder uniform to that of the whole case.
    if (fs::is_symlink(path, error) && !fs::exists(path, error)) {
      notes_.push_back(time.name + "/" + name + ": left out; it is a link that leads nowhere");
      continue;
    }
    if (!fs::is_directory(path, error)) {
      const bool twice = name.ends_with(".gz") &&
                         std::binary_search(names.begin(), names.end(), name.substr(0, name.size() - 3));
      if (!twice) MAILLE_CHECK(read_file(folder, name, time.name));
      continue;
    }
    const std::string mesh = to_utf8(path);
    if (name == "polyMesh" && (has_foam_file(mesh + "/points") || has_foam_file(mesh + "/faces"))) {
      return failure(ErrorCode::unsupported,
                     mesh +
                         ": the mesh is another one at this time, but all times of a file have one; this "
                         "folder is a mesh without fields");
    }
    if (name != "uniform" && name != "include") {
      notes_.push_back(time.name + "/" + name +
                       ": left out; of a time, files and the folder uniform are kept");
      continue;
    }
    for (const FoamText& text : read_foam_texts(folder, name, notes_))
      add_text(foam_text_prefix + text.path, text.text);
  }
  return {};
}

}  // namespace maille
