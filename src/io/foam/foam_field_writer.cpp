#include "io/foam/foam_field_writer.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <optional>
#include <set>
#include <utility>

#include "base/result.h"
#include "io/base64.h"
#include "io/foam/foam_case.h"
#include "io/notes.h"
#include "io/reading.h"

namespace maille {
namespace {

/// Writes a number as OpenFOAM does with so many digits: the fewest that say the same, and an exponent where
/// C's %g has one. Values are exact whatever `digits` is: it only decides on the form.
template <class T>
void put_general(BufferedWriter& out, T value, int digits) {
  char text[64];
  const char* const end = std::to_chars(text, text + sizeof text, value, std::chars_format::scientific).ptr;
  const char* const mark = std::find(static_cast<const char*>(text), end, 'e');
  int exponent = 0;
  std::from_chars(mark + (mark + 1 < end && mark[1] == '+' ? 2 : 1), end, exponent);
  if (mark == end || exponent < -4 || exponent >= digits) {
    out.put(std::string_view(text, static_cast<size_t>(end - text)));
    return;
  }
  char plain[64];
  const char* const behind = std::to_chars(plain, plain + sizeof plain, value, std::chars_format::fixed).ptr;
  out.put(std::string_view(plain, static_cast<size_t>(behind - plain)));
}

/// The most values of a list that OpenFOAM writes on one line.
constexpr uint64_t short_list = 10;

}  // namespace

/// Tuples of an array, read some thousand at a time: asked for in nearly rising order, so each is read about
/// once.
class FoamFieldWriter::Window {
 public:
  Window(MeshSource& mesh, size_t number)
      : mesh_(mesh),
        number_(number),
        size_(mesh.description().arrays[number].tuple_size()),
        count_(mesh.description().count_of(mesh.description().arrays[number])) {}
  size_t tuple_size() const { return size_; }
  /// element < the number of tuples.
  Result<const std::byte*> at(uint64_t element) {
    if (element < first_ || element - first_ >= bytes_.size() / size_) {
      constexpr uint64_t at_once = 4096;
      first_ = element;
      bytes_.resize(static_cast<size_t>(std::min(at_once, count_ - element)) * size_);
      MAILLE_CHECK(mesh_.read_array(number_, first_, bytes_.size() / size_, bytes_));
    }
    return bytes_.data() + (element - first_) * size_;
  }

 private:
  MeshSource& mesh_;
  size_t number_, size_;
  uint64_t count_, first_ = 0;
  std::vector<std::byte> bytes_;
};

/// A field while it is written: its text, and where its values are.
struct FoamFieldWriter::Field {
  FoamField text;
  FoamFieldKind kind;
  MeshSource& values;
  std::string name;
  std::optional<size_t> array = {};  ///< with the values of cells, faces or points
  bool ascii = true;                 ///< as it is written
  Scalar type = Scalar::f64;
  /// Of uniform values: a text may repeat them without end, and each is held against all values.
  std::set<std::pair<std::string, std::string>> done = {};

  /// Whether the values of these are in `array`: those of points say nothing about faces of patches.
  bool has_values_at(const FoamValues& list) const {
    return list.is_internal() || (list.entry == "value" && kind.place != FoamFieldKind::Place::points);
  }
  std::optional<size_t> find(const std::string& array_name, Domain domain) const {
    const auto& arrays = values.description().arrays;
    for (size_t i = 0; i < arrays.size(); ++i) {
      if (arrays[i].name == array_name && arrays[i].domain == domain && is_float(arrays[i].type)) return i;
    }
    return {};
  }
};

const FoamPatch* FoamFieldWriter::patch(const std::string& name) const {
  for (const FoamPatch& patch : written_.patches) {
    if (patch.name == name) return &patch;
  }
  return nullptr;
}

/// Finds the cells of the mesh that are faces of patches, and the most faces inside that a cell owns. Once.
Result<> FoamFieldWriter::find_patch_cells() {
  if (std::exchange(knows_patches_, true)) return {};
  uint64_t before = no_cell, owned = 0;
  return written_.visit([&](const FoamFaceTable::Face& face) -> Result<> {
    if (face.neighbour == FoamFaceTable::no_cell) {
      patch_cells_.push_back(face.side < written_.faces.size() ? written_.faces[face.side] : no_cell);
      return {};
    }
    owned = face.owner == before ? owned + 1 : 1;
    before = face.owner;
    most_owned_ = std::max(most_owned_, owned);
    return {};
  });
}

uint64_t FoamFieldWriter::count_of(const Field& field, const FoamValues& list) const {
  if (!list.is_internal()) {
    const FoamPatch* const found = patch(list.patch);
    return found == nullptr ? 0 : found->faces;
  }
  switch (field.kind.place) {
    case FoamFieldKind::Place::points:
      return written_.points;
    case FoamFieldKind::Place::cells:
      return written_.cells.size();
    case FoamFieldKind::Place::faces:
      break;
  }
  return written_.inner;
}

/// Calls f with the values of a list one after the other, wherever they are in the arrays of the mesh.
Result<> FoamFieldWriter::for_each_value(const Field& field, const FoamValues& list, Window& values,
                                         const std::function<Result<>(const std::byte*)>& f) {
  const uint64_t count = count_of(field, list);
  if (!list.is_internal()) {
    const uint64_t first = count == 0 ? 0 : patch(list.patch)->first - written_.inner;
    const std::vector<std::byte> none(values.tuple_size());
    for (uint64_t i = first; i < first + count; ++i)
      MAILLE_CHECK(f(patch_cells_[i] == no_cell ? none.data() : MAILLE_TRY(values.at(patch_cells_[i]))));
    return {};
  }
  if (field.kind.place != FoamFieldKind::Place::faces) {
    const bool points = field.kind.place == FoamFieldKind::Place::points;
    for (uint64_t i = 0; i < count; ++i)
      MAILLE_CHECK(f(MAILLE_TRY(values.at(points ? i : written_.cells[i]))));
    return {};
  }
  const size_t size = field.kind.components * size_of(field.type);
  uint64_t before = no_cell, owned = 0;
  return written_.visit([&](const FoamFaceTable::Face& face) -> Result<> {
    if (face.neighbour == FoamFaceTable::no_cell) return {};
    owned = face.owner == before ? owned + 1 : 0;
    before = face.owner;
    return f(MAILLE_TRY(values.at(written_.cells[face.owner])) + owned * size);
  });
}

void FoamFieldWriter::put_value(const Field& field, const std::byte* value, uint32_t components, int digits) {
  if (!field.ascii) {
    out_.put_bytes(Bytes(value, components * size_of(field.type)));
    return;
  }
  if (components > 1) out_.put('(');
  for (uint32_t i = 0; i < components; ++i) {
    if (i > 0) out_.put(' ');
    if (field.type == Scalar::f32) {
      put_general(out_, load<float>(value + i * sizeof(float)), digits);
    } else {
      put_general(out_, load<double>(value + i * sizeof(double)), digits);
    }
  }
  if (components > 1) out_.put(')');
}

Result<> FoamFieldWriter::put_list(Field& field, const FoamValues& list, Window& values, int digits) {
  const uint32_t components = list.type.empty() ? field.kind.components : foam_components(list.type);
  const uint64_t count = count_of(field, list);
  const bool one_line = field.ascii && count <= short_list;
  out_.put(one_line ? " " : " \n");
  out_.put_number(count);
  out_.put(one_line ? "(" : field.ascii ? "\n(\n" : "\n(");
  bool first = true;
  MAILLE_CHECK(for_each_value(field, list, values, [&](const std::byte* value) -> Result<> {
    if (one_line && !std::exchange(first, false)) out_.put(' ');
    put_value(field, value, components, digits);
    if (field.ascii && !one_line) out_.put('\n');
    return {};
  }));
  out_.put(')');
  return {};
}

/// Writes a uniform value. It may be the same still, as the text says or another one; otherwise it is a list
/// now.
Result<> FoamFieldWriter::put_uniform(Field& field, const FoamValues& value) {
  const std::string_view text = field.text.text.substr(value.begin, value.end - value.begin);
  const bool repeats = !field.done.emplace(value.patch, value.entry).second;
  const bool is_other = repeats || !field.array || !field.has_values_at(value) ||
                        (!value.is_internal() && patch(value.patch) == nullptr);
  if (is_other || count_of(field, value) == 0 || text.find_first_of("$#") != std::string_view::npos) {
    out_.put(text);
    return {};
  }
  FoamField of_type = field.text;
  of_type.single = field.type == Scalar::f32;
  std::vector<std::byte> said(field.kind.components * size_of(field.type)), found;
  MAILLE_CHECK(FoamValueReader(of_type, value).next(said.data()));
  bool same = true;
  Window values(field.values, *field.array);
  MAILLE_CHECK(for_each_value(field, value, values, [&](const std::byte* tuple) -> Result<> {
    if (found.empty()) found.assign(tuple, tuple + said.size());
    same = same && std::equal(found.begin(), found.end(), tuple);
    return {};
  }));
  if (same && found == said) {
    out_.put(text);
  } else if (same) {
    out_.put("uniform ");
    const bool ascii = std::exchange(field.ascii, true);
    put_value(field, found.data(), field.kind.components, 6);
    field.ascii = ascii;
  } else {
    out_.put("nonuniform List<" + std::string(foam_list_type(field.text.type)) + ">");
    return put_list(field, value, values, 6);
  }
  return {};
}

Result<> FoamFieldWriter::put_values(Field& field, const FoamValues& list) {
  const bool of_field = list.is_internal() || list.entry == "value";
  const std::string mark(field.text.text.substr(list.values, list.end - list.values));
  if (mark.starts_with("base64:")) {
    Base64Reader reader(std::string_view(mark).substr(7));
    std::vector<std::byte> bytes(static_cast<size_t>(reader.most_left()));
    size_t size = 0;
    while (size < bytes.size() && reader.read(std::span(bytes).subspan(size, 1))) ++size;
    out_.put_bytes(Bytes(bytes).first(size));
    return {};
  }
  const auto array = of_field ? field.array : field.find(field.name + ":" + list.entry, Domain::cell);
  Window values(field.values, *array);
  int digits = 6;
  std::from_chars(mark.data(), mark.data() + mark.size(), digits);
  return put_list(field, list, values, std::clamp(digits, 1, 17));
}

/// Writes the text as it was, with the values in place of the marks.
Result<> FoamFieldWriter::put_field(Field& field) {
  const FoamField& text = field.text;
  size_t done = 0;
  const auto copy_to = [&](size_t end) {
    if (end > done) out_.put(text.text.substr(done, end - done));
    done = std::max(done, end);
  };
  const auto replace = [&](size_t begin, size_t end, std::string_view by) {
    copy_to(begin);
    out_.put(by);
    done = end;
  };
  std::vector<std::pair<size_t, int>> header = {{text.location_begin, 0}, {text.format_begin, 1}};
  std::sort(header.begin(), header.end());
  for (const auto& [begin, what] : header) {
    if (begin == 0) continue;
    if (what == 0 && text.location == std::string(1, foam_list_mark))
      replace(begin, text.location_end, time_);
    if (what == 1 && text.binary && field.ascii) replace(begin, text.format_end, "ascii");
  }
  for (const FoamValues& list : text.values) {
    if (!list.uniform && !list.marked) continue;
    copy_to(list.begin);
    MAILLE_CHECK(list.uniform ? put_uniform(field, list) : put_values(field, list));
    done = list.end;
  }
  copy_to(text.text.size());
  return {};
}

/// Remembers code in a text that OpenFOAM would run: a .maille file from anybody must not bring it unnoticed.
void FoamFieldWriter::note_code(const std::string& path, const std::string& directive) {
  if (!directive.empty() && with_code_.size() < 8) with_code_.push_back(path + " (" + directive + ")");
}

Result<> FoamFieldWriter::write_text(const std::string& path, const std::string& text) {
  if (!is_plain_foam_path(path) || !MAILLE_TRY(sink_.begin_case_file(path))) {
    left_.push_back(path);
    return {};
  }
  for (const char* const code :
       {"#calc", "#codeStream", "#eval", "#system", "codeStream", "coded", "systemCall", "libs", "#{"}) {
    if (text.find(code) == std::string::npos) continue;
    note_code(path, code);
    break;
  }
  out_.put(text);
  return out_.finish();
}

/// Whether there is an array for every list, of numbers of the same type and with as many components. Texts
/// come from files, which may say anything; without this check values would be read beyond their tuples.
bool FoamFieldWriter::has_all_arrays(Field& field) const {
  const auto& arrays = field.values.description().arrays;
  const bool faces = field.kind.place == FoamFieldKind::Place::faces;
  if (field.array) {
    const Array& main = arrays[*field.array];
    const uint32_t values = main.components / field.kind.components;
    field.type = main.type;
    if (main.components % field.kind.components != 0 || values < (faces ? most_owned_ : 1) ||
        (!faces && values != 1))
      return false;
  }
  std::set<std::pair<std::string, std::string>> marked;
  return std::all_of(field.text.values.begin(), field.text.values.end(), [&](const FoamValues& list) {
    if (!list.marked || field.text.text.substr(list.values).starts_with("base64:")) return true;
    if (!marked.emplace(list.patch, list.entry).second) return false;  // as large as the mesh, each of them
    if (field.has_values_at(list))
      return field.array && (list.type.empty() || list.type == foam_list_type(field.text.type));
    const auto other = field.find(field.name + ":" + list.entry, Domain::cell);
    return !list.patch.empty() && field.array && other && arrays[*other].type == field.type &&
           arrays[*other].components == foam_components(list.type);
  });
}

Result<> FoamFieldWriter::write_field(MeshSource& values, const std::string& name, const std::string& text) {
  const auto scanned = scan_foam_field(text, "openfoam.field." + name);
  const auto kind = scanned ? foam_field_kind(scanned->type) : std::nullopt;
  const std::string path = time_ + "/" + name;
  if (!is_plain_foam_path(path)) {
    left_.push_back(path);
    return {};
  }
  if (!kind) {
    notes_.push_back(path + ": left out; " +
                     (scanned ? "its text is not that of a field" : scanned.error().message));
    return {};
  }
  Field field{*scanned, *kind, values, name};
  field.array = field.find(name, kind->place == FoamFieldKind::Place::points ? Domain::point : Domain::cell);
  if (field.array) MAILLE_CHECK(find_patch_cells());
  const bool whole = has_all_arrays(field);
  if (!whole) {
    notes_.push_back(path + ": left out; its arrays are not there, or not those of this mesh");
    return {};
  }
  // Lists kept byte by byte are binary, and so must the file be; numbers of another width become text.
  const bool kept_bytes = text.find("base64:") != std::string::npos;
  const bool same_width = field.type == (scanned->single ? Scalar::f32 : Scalar::f64);
  field.ascii = !scanned->binary || (!kept_bytes && (ascii_ || (field.array && !same_width)));
  if (!MAILLE_TRY(sink_.begin_case_file(path))) {
    left_.push_back(path);
    return {};
  }
  note_code(path, scanned->directive);
  MAILLE_CHECK(put_field(field));
  return out_.finish();
}

Result<> FoamFieldWriter::write_time(MeshSource& values) {
  const auto& metadata = values.description().metadata;
  const auto value_of = [&](const char* key) {
    const auto found =
        std::find_if(metadata.begin(), metadata.end(), [&](const auto& e) { return e.first == key; });
    return found == metadata.end() ? std::string() : found->second;
  };
  time_ = value_of(foam_time_key);
  banner_ = value_of(foam_banner_key);
  if (time_.empty()) return {};
  if (!foam_time_of(time_) || !is_plain_foam_path(time_)) {
    notes_.push_back("the fields of time \"" + time_.substr(0, 40) + "\" left out: it is no number");
    return {};
  }
  if (std::find(times_.begin(), times_.end(), time_) != times_.end()) return {};
  const bool first = times_.empty();
  times_.push_back(time_);
  for (const auto& [key, value] : metadata) {
    const auto rest_of = [&key = key](const char* prefix) {
      return key.starts_with(prefix) ? key.substr(std::string_view(prefix).size()) : std::string();
    };
    const std::string text = value.starts_with(foam_list_mark) ? banner_ + value.substr(1) : value;
    if (const std::string name = rest_of(foam_field_prefix); !name.empty())
      MAILLE_CHECK(write_field(values, name, text));
    if (const std::string path = rest_of(foam_text_prefix); !path.empty())
      MAILLE_CHECK(write_text(time_ + "/" + path, text));
    const std::string path = rest_of(foam_case_prefix);
    const bool in_case = path.starts_with("constant/") || path.starts_with("system/");
    if (first && in_case && !path.starts_with("constant/polyMesh")) MAILLE_CHECK(write_text(path, value));
  }
  return {};
}

std::vector<std::string> FoamFieldWriter::take_notes() {
  const auto list = [](const std::vector<std::string>& names) {
    std::string text;
    for (size_t i = 0; i < names.size() && i < 8; ++i) text += (i > 0 ? ", " : "") + names[i];
    return names.size() > 8 ? text + " and " + std::to_string(names.size() - 8) + " more" : text;
  };
  if (!with_code_.empty())
    notes_.push_back(
        "there is code that OpenFOAM runs or loads, so look at it first where you do not trust the file: " +
        list(with_code_));
  if (!left_.empty())
    notes_.push_back(
        "not written, as they are there already, only the mesh is asked for, or the name is none for a "
        "file: " +
        list(left_));
  with_code_.clear();
  left_.clear();
  return std::exchange(notes_, {});
}

}  // namespace maille
