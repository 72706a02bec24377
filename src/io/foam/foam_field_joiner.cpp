#include "io/foam/foam_field_joiner.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <optional>

#include "base/bytes.h"

namespace maille {
namespace {

using Part = FoamProcessors::Part;
constexpr uint64_t nobody = ~uint64_t{0};

/// The values of a part, and the place of each in the whole list; nobody: in none.
struct Piece {
  const FoamField* field = nullptr;
  const FoamValues* values = nullptr;
  std::vector<uint64_t> to;

  std::string_view text() const { return field->text.substr(values->begin, values->end - values->begin); }
};

/// A stretch of a text and what replaces it.
struct Edit {
  size_t begin = 0, end = 0;
  std::string text;
};

/// A stretch of a text with some of it replaced; edits come in their order and do not overlap. Those outside
/// are passed over.
std::string edited(std::string_view text, size_t begin, size_t end, const std::vector<Edit>& edits) {
  std::string out;
  for (const Edit& edit : edits) {
    if (edit.begin < begin || edit.end > end) continue;
    out += text.substr(begin, edit.begin - begin);
    out += edit.text;
    begin = edit.end;
  }
  return out += text.substr(begin, end - begin);
}

/// The values of an entry. Where it is there more than once the last one counts, as with OpenFOAM.
const FoamValues* find_values(const std::vector<FoamValues>& values, const std::string& patch,
                              const std::string& entry) {
  const auto at = std::find_if(values.rbegin(), values.rend(),
                               [&](const FoamValues& v) { return v.patch == patch && v.entry == entry; });
  return at == values.rend() ? nullptr : &*at;
}

const FoamPatchText* find_text(const FoamField& field, const std::string& patch) {
  const auto at = std::find_if(field.patches.begin(), field.patches.end(),
                               [&](const FoamPatchText& text) { return text.patch == patch; });
  return at == field.patches.end() ? nullptr : &*at;
}

const FoamPatch* find_patch(std::span<const FoamPatch> patches, const std::string& name) {
  const auto at =
      std::find_if(patches.begin(), patches.end(), [&](const FoamPatch& p) { return p.name == name; });
  return at == patches.end() ? nullptr : &*at;
}

/// Whether a patch's dictionary has lists in dictionaries of its own: which elements they are of is not
/// known.
bool has_inner_lists(const FoamField& field, const FoamPatchText& text) {
  return std::any_of(field.values.begin(), field.values.end(), [&](const FoamValues& v) {
    return v.patch.empty() && !v.uniform && v.begin >= text.begin && v.end <= text.end;
  });
}

/// The type of values: "scalar" of a list, or by the numbers of a uniform value.
std::string type_of(const std::vector<Piece>& pieces) {
  for (const Piece& piece : pieces) {
    if (!piece.values->type.empty()) return piece.values->type;
  }
  const FoamField& field = *pieces[0].field;
  const std::string_view value =
      field.text.substr(pieces[0].values->values, pieces[0].values->end - pieces[0].values->values);
  const auto numbers = 1 + std::count(value.begin(), value.end(), ' ');
  if (!value.starts_with('(')) return "scalar";
  if (numbers == 3) return "vector";
  if (numbers == 6) return "symmTensor";
  return numbers == 9 ? "tensor" : std::string(foam_list_type(field.type));
}

template <class T>
void append_numbers(std::span<const std::byte> value, std::string& out) {
  const size_t count = value.size() / sizeof(T);
  if (count > 1) out += '(';
  for (size_t i = 0; i < count; ++i) {
    std::array<char, 32> digits;
    const auto end =
        std::to_chars(digits.data(), digits.data() + digits.size(), load<T>(value.data() + i * sizeof(T)));
    if (i > 0) out += ' ';
    out.append(digits.data(), end.ptr);
  }
  if (count > 1) out += ')';
}

/// Joins one field. The text of one processor is taken as it is, and only values are replaced; what cannot be
/// joined leaves the field out, with the first reason.
class Join {
 public:
  Join(std::span<const Part> parts, const FoamFieldJoiner::Whole& whole, std::span<const FoamField> fields,
       const FoamFieldKind& kind)
      : parts_(parts), whole_(whole), fields_(fields), kind_(kind) {}

  Result<FoamFieldJoiner::Joined> join();

 private:
  uint64_t elements_of(const Part& part) const;
  Result<> collect_inside(size_t part, std::vector<Piece>& pieces);
  Result<> collect_between(size_t part, std::vector<Piece>& pieces);
  Result<Piece> of_patch(size_t part, const FoamPatch& patch, const FoamValues& values,
                         const FoamPatch& whole) const;
  Result<std::vector<Piece>> collect_patch(const FoamPatch& whole, const std::string& entry);
  Result<> replace(const FoamValues& chosen, const std::vector<Piece>& pieces, uint64_t count,
                   std::vector<Edit>& edits);
  Result<std::string> list_of(const std::vector<Piece>& pieces, uint64_t count, const std::string& type);
  Result<std::string> patch_text(const FoamField& base, size_t base_part, const FoamPatchText& text);
  void leave_out(const std::string& why) {
    if (left_out_.empty()) left_out_ = why;
  }

  std::span<const Part> parts_;
  const FoamFieldJoiner::Whole& whole_;
  std::span<const FoamField> fields_;
  FoamFieldKind kind_;
  std::string left_out_;
};

uint64_t Join::elements_of(const Part& part) const {
  using Place = FoamFieldKind::Place;
  return kind_.place == Place::cells    ? part.numbers.cells.size()
         : kind_.place == Place::points ? part.numbers.points.size()
                                        : part.inner_faces;
}

Result<> Join::collect_inside(size_t part, std::vector<Piece>& pieces) {
  using Place = FoamFieldKind::Place;
  const FoamProcessors::Numbers& numbers = parts_[part].numbers;
  const std::vector<uint64_t>& all = kind_.place == Place::cells    ? numbers.cells
                                     : kind_.place == Place::points ? numbers.points
                                                                    : numbers.faces;
  const uint64_t count = elements_of(parts_[part]);
  const FoamField& field = fields_[part];
  const FoamValues* const values = find_values(field.values, "", "");
  if (values == nullptr && count > 0) leave_out(field.name + " has no internalField with values");
  if (values == nullptr || count == 0) return {};
  pieces.push_back({&field, values, {all.begin(), all.begin() + static_cast<ptrdiff_t>(count)}});
  return {};
}

/// Collects the values of faces between processors, of the processor for which they are not turned: the other
/// one has the same face with the other sign.
Result<> Join::collect_between(size_t part, std::vector<Piece>& pieces) {
  const FoamProcessors::Numbers& numbers = parts_[part].numbers;
  for (const FoamPatch& patch : parts_[part].patches) {
    if (!is_between_processors(patch)) continue;
    Piece piece{&fields_[part], find_values(fields_[part].values, patch.name, "value"), {}};
    bool some = false;
    for (uint64_t i = patch.first; i < patch.first + patch.faces; ++i) {
      const bool own = !numbers.turned[i] && numbers.faces[i] < whole_.inner_faces;
      piece.to.push_back(own ? numbers.faces[i] : nobody);
      some = some || own;
    }
    if (some && piece.values == nullptr)
      leave_out(fields_[part].name + " has no values of patch " + patch.name.substr(0, 40));
    if (some && piece.values != nullptr) pieces.push_back(std::move(piece));
  }
  return {};
}

Result<Piece> Join::of_patch(size_t part, const FoamPatch& patch, const FoamValues& values,
                             const FoamPatch& whole) const {
  Piece piece{&fields_[part], &values, {}};
  for (uint64_t i = patch.first; i < patch.first + patch.faces; ++i) {
    const uint64_t number = parts_[part].numbers.faces[i];
    const bool inside = number >= whole.first && number - whole.first < whole.faces;
    piece.to.push_back(inside ? number - whole.first : nobody);
  }
  return piece;
}

/// Collects the values of a patch of the whole mesh. Faces of a cyclic patch whose sides two processors have
/// are in patches of their own, which refer to it.
Result<std::vector<Piece>> Join::collect_patch(const FoamPatch& whole, const std::string& entry) {
  std::vector<Piece> pieces;
  for (size_t p = 0; p < parts_.size(); ++p) {
    for (const FoamPatch& patch : parts_[p].patches) {
      const bool referred = entry == "value" && is_between_processors(patch);
      const bool is = referred ? referred_patch(patch) == whole.name : patch.name == whole.name;
      if (!is || patch.faces == 0) continue;
      const FoamValues* const values = find_values(fields_[p].values, patch.name, entry);
      if (values != nullptr) {
        pieces.push_back(MAILLE_TRY(of_patch(p, patch, *values, whole)));
      } else if (find_values(fields_[p].empty_lists, patch.name, entry) == nullptr) {
        leave_out(fields_[p].name + " has no entry " + entry.substr(0, 40) + " of patch " +
                  patch.name.substr(0, 40));
      }
    }
  }
  return pieces;
}

Result<std::string> Join::list_of(const std::vector<Piece>& pieces, uint64_t count, const std::string& type) {
  const FoamField& base = fields_[0];
  const uint32_t components = foam_components(type);
  if (components == 0 || type == "label" || type == "bool") {
    leave_out("lists of " + type + " are not joined");
    return std::string();
  }
  const size_t size = components * size_of(base.scalar());
  std::vector<std::byte> all(count * size), one(size);
  std::vector<bool> has(count);
  for (const Piece& piece : pieces) {
    FoamValues values = *piece.values;
    if (!values.uniform && (values.count != piece.to.size() || values.type != type)) {
      return piece.field->bad(values.begin, "a list of " + std::to_string(values.count) +
                                                " values, but there are " + std::to_string(piece.to.size()) +
                                                " elements");
    }
    values.type = type;
    FoamValueReader reader(*piece.field, values);
    for (const uint64_t to : piece.to) {
      MAILLE_CHECK(reader.next(one.data()));
      if (to == nobody) continue;
      std::copy(one.begin(), one.end(), all.begin() + static_cast<ptrdiff_t>(to * size));
      has[to] = true;
    }
    MAILLE_CHECK(reader.end());
  }
  if (std::find(has.begin(), has.end(), false) != has.end())
    leave_out("processors do not have all its values");
  std::string text = " " + std::to_string(count) + "(";
  for (uint64_t i = 0; i < count && !base.binary; ++i) {
    const auto value = std::span(std::as_const(all)).subspan(i * size, size);
    text += '\n';
    base.single ? append_numbers<float>(value, text) : append_numbers<double>(value, text);
  }
  if (base.binary) text.append(reinterpret_cast<const char*>(all.data()), all.size());
  return text + ")";
}

/// Replaces values by those of all processors. Where one uniform value stays, the text says it.
Result<> Join::replace(const FoamValues& chosen, const std::vector<Piece>& pieces, uint64_t count,
                       std::vector<Edit>& edits) {
  const bool same = chosen.uniform && std::all_of(pieces.begin(), pieces.end(), [&](const Piece& piece) {
                      return piece.values->uniform && piece.text() == pieces[0].text();
                    });
  if (same) return {};
  const std::string type = type_of(pieces);
  std::string list = MAILLE_TRY(list_of(pieces, count, type));
  const char* const before = chosen.uniform ? "nonuniform List<" : " List<";
  const bool typed = !chosen.uniform && !chosen.type.empty();
  edits.push_back({chosen.begin, chosen.end, typed ? std::move(list) : before + type + ">" + list});
  return {};
}

/// The text of a patch: that of the first processor with faces of it, with the values of all. Empty: faces
/// between processors.
Result<std::string> Join::patch_text(const FoamField& base, size_t base_part, const FoamPatchText& text) {
  const FoamPatch* const own = find_patch(parts_[base_part].patches, text.patch);
  if (own != nullptr && is_between_processors(*own)) return std::string();
  const FoamPatch* const whole = find_patch(whole_.patches, text.patch);
  const FoamField* chosen = nullptr;
  for (size_t p = 0; p < parts_.size(); ++p) {
    const FoamPatch* const patch = find_patch(parts_[p].patches, text.patch);
    if (patch == nullptr || patch->faces == 0 || whole == nullptr) continue;
    const FoamPatchText* const there = find_text(fields_[p], text.patch);
    if (there == nullptr || has_inner_lists(fields_[p], *there))
      leave_out(fields_[p].name + ": no values of patch " + text.patch.substr(0, 40) + " that can be joined");
    if (chosen == nullptr && there != nullptr) chosen = &fields_[p];
  }
  if (chosen == nullptr) chosen = &base;
  const FoamPatchText& found = *find_text(*chosen, text.patch);
  std::vector<FoamValues> entries = chosen->values;
  entries.insert(entries.end(), chosen->empty_lists.begin(), chosen->empty_lists.end());
  std::erase_if(entries, [&](const FoamValues& v) {
    return v.patch != text.patch || v.begin < found.begin || v.end > found.end;
  });
  std::sort(entries.begin(), entries.end(),
            [](const FoamValues& a, const FoamValues& b) { return a.begin < b.begin; });
  std::vector<Edit> edits;
  for (const FoamValues& values : entries) {
    const auto pieces =
        whole == nullptr ? std::vector<Piece>() : MAILLE_TRY(collect_patch(*whole, values.entry));
    const bool lists = !values.uniform && values.count > 0;
    const bool on_points = kind_.place == FoamFieldKind::Place::points;
    if (lists && (on_points || pieces.empty()))
      leave_out("its values at patch " + text.patch.substr(0, 40) + " are of no known elements");
    if (!pieces.empty() && !on_points) MAILLE_CHECK(replace(values, pieces, whole->faces, edits));
  }
  return edited(chosen->text, found.begin, found.end, edits);
}

Result<FoamFieldJoiner::Joined> Join::join() {
  using Place = FoamFieldKind::Place;
  std::vector<Piece> pieces;
  for (size_t p = 0; p < parts_.size(); ++p) {
    MAILLE_CHECK(collect_inside(p, pieces));
    if (kind_.place == Place::faces) MAILLE_CHECK(collect_between(p, pieces));
  }
  // The text is that of the first processor with values inside; of a field of no values, that of the first
  // one.
  size_t base_part = 0;
  while (base_part + 1 < fields_.size() && find_values(fields_[base_part].values, "", "") == nullptr)
    ++base_part;
  const FoamField& base = fields_[base_part];
  const FoamValues* const inside = find_values(base.values, "", "");
  if (inside == nullptr) leave_out("there is no internalField with values");
  std::vector<Edit> edits;
  const uint64_t count = kind_.place == Place::cells    ? whole_.cells
                         : kind_.place == Place::points ? whole_.points
                                                        : whole_.inner_faces;
  if (inside != nullptr && !pieces.empty()) MAILLE_CHECK(replace(*inside, pieces, count, edits));
  FoamFieldJoiner::Joined joined;
  size_t done = 0;
  for (const FoamPatchText& text : base.patches) {
    joined.text += edited(base.text, done, text.begin, edits);
    joined.text += MAILLE_TRY(patch_text(base, base_part, text));
    done = text.end;
  }
  joined.text += edited(base.text, done, base.text.size(), edits);
  joined.left_out = std::move(left_out_);
  return joined;
}

}  // namespace

Result<FoamFieldJoiner::Joined> FoamFieldJoiner::join(const std::string& time,
                                                      const std::string& name) const {
  std::vector<FoamReader> files;
  std::vector<FoamField> fields;
  for (const Part& part : parts_) {
    const std::string folder = part.place.folder + "/" + time;
    files.push_back(MAILLE_TRY(FoamReader::open(folder, name, limits_, part.place.block)));
    fields.push_back(MAILLE_TRY(scan_foam_field(files.back().text(), folder + "/" + name)));
    const FoamField &first = fields[0], &field = fields.back();
    if (!foam_field_kind(first.type)) return Joined{std::string(first.text), ""};
    if (field.type != first.type || field.binary != first.binary || field.single != first.single) {
      return failure(ErrorCode::malformed_input,
                     field.name + ": it is of another class or format than that of the first processor");
    }
  }
  return Join(parts_, whole_, fields, *foam_field_kind(fields[0].type)).join();
}

}  // namespace maille
