#include <algorithm>
#include <array>
#include "base/bytes.h"
#include "io/buffered_writer.h"
#include "io/cells.h"
#include "io/notes.h"
#include "io/off/off.h"
#include "io/reading.h"

namespace maille {
namespace {

class OffWriter {
 public:
  OffWriter(const Mesh& mesh, Sink& sink, std::vector<std::string>& notes)
      : mesh_(mesh), out_(sink), notes_(notes) {}

  Result<> write() {
    MAILLE_CHECK(choose());
    write_head();
    write_points();
    for_each_cell(mesh_, [&](CellType type, uint64_t cell, uint64_t, std::span<const uint32_t> nodes) {
      if (is_face(type)) write_face(cell, nodes);
    });
    return out_.finish();
  }

 private:
  const Array*& chosen(OffArray array) { return arrays_[static_cast<size_t>(array)]; }

  Result<> choose() {
    uint64_t others = 0;
    for_each_cell(mesh_, [&](CellType type, uint64_t, uint64_t, std::span<const uint32_t>) {
      ++(is_face(type) ? faces_ : others);
    });
    if (faces_ == 0 && others != 0)
      return failure(ErrorCode::usage, "OFF holds faces, but this mesh has only other cells");
    if (others != 0) notes_.push_back(counted(others, "cell") + " that are not faces left out");
    chosen(OffArray::position) = &mesh_.points;
    // Counts belong to an array of colours that may come behind them, so they are looked at last.
    std::vector<const Array*> rest;
    for (const Array& array : mesh_.arrays) {
      if (!take(array)) rest.push_back(&array);
    }
    for (const Array* array : rest) {
      if (counts_fit(*array)) {
        counts_ = array;
      } else {
        note_array(*array, notes_);
      }
    }
    note_block_names(mesh_, notes_);
    note_nan_payloads(mesh_, notes_);
    if (!is_float(mesh_.points.type)) notes_.push_back("positions are integers; OFF does not say so");
    return {};
  }

  bool take(const Array& array) {
    const bool real = is_float(array.type);
    const bool colour = array.role == Role::colour && (array.components == 3 || array.components == 4) &&
                        (real || array.type == Scalar::u8);
    const auto first = [&](OffArray which) {
      if (chosen(which) != nullptr) return false;
      chosen(which) = &array;
      const char* const name =
          which == OffArray::face_colour ? array.name.c_str() : off_array_names[static_cast<size_t>(which)];
      if (array.name != name) notes_.push_back("array \"" + array.name + "\" becomes \"" + name + "\"");
      return true;
    };
    if (array.domain == Domain::point) {
      if (array.name == "weight" && array.components == 1 && real) return first(OffArray::weight);
      if (array.role == Role::normal && array.components == 3 && real) return first(OffArray::normal);
      if (colour) return first(OffArray::colour);
      if (array.role == Role::texture_coordinate && array.components == 2 && real)
        return first(OffArray::texcoord);
    }
    if (array.domain == Domain::cell) {
      const bool index = array.name == "colour_index" && array.components == 1 && array.type == Scalar::i32;
      if (colour || index) return first(OffArray::face_colour);
    }
    return false;
  }

  /// Are these the counts of numbers in the faces' colours, as the reader keeps them? None may be more than
  /// there are components.
  bool counts_fit(const Array& counts) {
    const Array* const colours = chosen(OffArray::face_colour);
    if (colours == nullptr || counts.name != colours->name + ".count" || counts.domain != Domain::cell ||
        counts.type != Scalar::u8 || counts.components != 1) {
      return false;
    }
    return std::all_of(counts.bytes.begin(), counts.bytes.end(),
                       [&](std::byte count) { return static_cast<uint32_t>(count) <= colours->components; });
  }

  void write_head() {
    const auto has = [&](OffArray array) { return chosen(array) != nullptr; };
    out_.put(std::string(has(OffArray::texcoord) ? "ST" : "") + (has(OffArray::colour) ? "C" : "") +
             (has(OffArray::normal) ? "N" : "") + (has(OffArray::weight) ? "4" : "") + "OFF\n");
    for (const auto& [key, text] : mesh_.metadata) {
      if (key == "comment" && text.find_first_of("\r\n") == std::string::npos) {
        out_.put(text.empty() ? "#\n" : "# " + text + "\n");
      } else {
        note_metadata(key, text, notes_);
      }
    }
    std::string wide;
    for (size_t i = 0; i < arrays_.size(); ++i) {
      if (arrays_[i] != nullptr && arrays_[i]->type == Scalar::f64)
        wide += std::string(" ") + off_array_names[i];
    }
    if (!wide.empty()) out_.put("# maille f64" + wide + "\n");
    out_.put_number(mesh_.point_count());
    out_.put(' ');
    out_.put_number(faces_);
    // The number of edges is given as 0: the reader never uses it.
    out_.put(" 0\n");
  }

  void write_points() {
    for (uint64_t point = 0; point < mesh_.point_count(); ++point) {
      const size_t size = mesh_.points.tuple_size();
      put_scalars(out_, mesh_.points.bytes.data() + point * size, mesh_.points.type, 3);
      for (const OffArray which :
           {OffArray::weight, OffArray::normal, OffArray::colour, OffArray::texcoord}) {
        if (const Array* const array = chosen(which)) {
          put_tuple(*array, point, array->components, which == OffArray::colour);
        }
      }
      out_.put('\n');
    }
  }

  void write_face(uint64_t cell, std::span<const uint32_t> nodes) {
    out_.put_number(nodes.size());
    for (const uint32_t node : nodes) {
      out_.put(' ');
      out_.put_number(node);
    }
    if (const Array* const colours = chosen(OffArray::face_colour)) {
      const uint32_t count =
          counts_ == nullptr ? colours->components : static_cast<uint32_t>(counts_->bytes[cell]);
      put_tuple(*colours, cell, count, is_float(colours->type));
    }
    out_.put('\n');
  }

  /// A blank before each number. Colours that are no whole numbers are always written with a point, because
  /// whole ones mean 0..255.
  void put_tuple(const Array& array, uint64_t tuple, uint32_t count, bool colour) {
    const std::byte* from = array.bytes.data() + tuple * array.tuple_size();
    for (uint32_t i = 0; i < count; ++i, from += size_of(array.type)) {
      out_.put(' ');
      if (colour && is_float(array.type)) {
        with_point(from, array.type);
      } else {
        put_scalar(out_, from, array.type);
      }
    }
  }
  // Writes the shortest text that reads as the same number; "e", "i" and "n" mark exponents, inf and nan,
  // which are no whole numbers to a reader.
  void with_point(const std::byte* from, Scalar type) {
    char text[40];
    const std::to_chars_result end = type == Scalar::f32 ? std::to_chars(text, text + 32, load<float>(from))
                                                         : std::to_chars(text, text + 32, load<double>(from));
    const std::string_view number(text, static_cast<size_t>(end.ptr - text));
    out_.put(number);
    if (number.find_first_of(".ein") == std::string_view::npos) out_.put(".0");
  }

  const Mesh& mesh_;
  BufferedWriter out_;
  std::vector<std::string>& notes_;
  uint64_t faces_ = 0;
  std::array<const Array*, off_array_count> arrays_{};
  const Array* counts_ = nullptr;
};

}  // namespace

Result<std::vector<std::string>> write_off(const Mesh& mesh, Sink& sink, const WriteOptions&) {
  std::vector<std::string> notes;
  MAILLE_CHECK(OffWriter(mesh, sink, notes).write());
  return notes;
}

}  // namespace maille
