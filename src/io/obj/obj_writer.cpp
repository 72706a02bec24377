#include <algorithm>
#include <array>
#include <cmath>
#include "base/bytes.h"
#include "io/buffered_writer.h"
#include "io/cells.h"
#include "io/notes.h"
#include "io/obj/obj.h"
#include "io/reading.h"
#include "io/tuple_index.h"
#include "mesh/none.h"

namespace maille {
namespace {

// Cells that OBJ has a keyword for.
bool is_cell(CellType type) {
  return is_face(type) || type == CellType::line || type == CellType::poly_line || type == CellType::vertex ||
         type == CellType::poly_vertex;
}

const char* keyword_of(CellType type) {
  if (is_face(type)) return "f";
  return type == CellType::line || type == CellType::poly_line ? "l" : "p";
}

// NaN stands for "there is none"; OBJ writes nothing then.
bool all_nan(const Array& array, uint64_t tuple) {
  for (uint32_t i = 0; i < array.components; ++i) {
    const std::byte* const from = array.bytes.data() + tuple * array.tuple_size() + i * size_of(array.type);
    const bool nan = array.type == Scalar::f32   ? std::isnan(load<float>(from))
                     : array.type == Scalar::f64 ? std::isnan(load<double>(from))
                                                 : false;
    if (!nan) return false;
  }
  return true;
}

/// Texture coordinates or normals: which array, and the number each corner refers to.
struct Reference {
  const Array* array = nullptr;
  std::vector<uint32_t> of_corner;  // only for arrays on corners
  std::vector<uint64_t> first;      // the first corner with this number

  bool on_points() const { return array != nullptr && array->domain == Domain::point; }
  bool on_corners() const { return array != nullptr && array->domain == Domain::corner; }
};

class ObjWriter {
 public:
  ObjWriter(const Mesh& mesh, Sink& sink, std::vector<std::string>& notes)
      : mesh_(mesh), out_(sink), notes_(notes) {}

  Result<> write() {
    MAILLE_CHECK(choose());
    write_head();
    write_points();
    write_references(texcoords_, "vt ");
    write_references(normals_, "vn ");
    write_cells();
    return out_.finish();
  }

 private:
  // Decides where everything goes and notes what has no place.
  Result<> choose() {
    uint64_t cells = 0;
    uint64_t others = 0;
    for_each_cell(mesh_, [&](CellType type, uint64_t, uint64_t, std::span<const uint32_t> nodes) {
      ++(is_cell(type) && !nodes.empty() ? cells : others);
    });
    if (cells == 0 && others != 0) {
      return failure(ErrorCode::usage,
                     "OBJ holds faces, lines and points, but this mesh has only other cells");
    }
    if (others != 0) notes_.push_back(counted(others, "cell") + " that OBJ cannot hold left out");
    for (const Array& array : mesh_.arrays) {
      if (!take(array)) note_array(array, notes_);
    }
    note_block_names(mesh_, notes_);
    note_nan_payloads(mesh_, notes_);
    if (!is_float(mesh_.points.type)) notes_.push_back("positions are integers; OBJ does not say so");
    for (Reference* reference : {&texcoords_, &normals_}) {
      if (reference->on_corners()) number_corners(*reference);
    }
    return {};
  }

  /// Finds the place of an array; false when there is none.
  bool take(const Array& array) {
    const bool real = is_float(array.type);
    // Takes an array for a place that is still free.
    const auto first = [&](const Array*& place) {
      if (place != nullptr) return false;
      place = &array;
      return true;
    };
    const bool texcoord = array.role == Role::texture_coordinate && real && array.components <= 3;
    const bool normal = array.role == Role::normal && real && array.components == 3;
    if ((texcoord || normal) && array.domain != Domain::cell) {
      // On the mesh are those that no corner refers to. They are told from other arrays by their name.
      if (array.domain == Domain::mesh && array.name != obj_array_names[texcoord ? 1 : 2]) return false;
      return first(texcoord ? texcoords_.array : normals_.array);
    }
    if (array.domain == Domain::point) {
      const bool colour = array.role == Role::colour && (array.components == 3 || array.components == 4) &&
                          (real || array.type == Scalar::u8);
      if (colour) return first(colour_);
      if (array.name == "weight" && array.components == 1 && real) return first(weight_);
    }
    if (array.domain == Domain::cell && array.role == Role::label && array.components == 1 && !real) {
      for (size_t i = 0; i < obj_label_count; ++i) {
        if (array.name == obj_label_names[i]) return first(labels_[i]);
      }
    }
    return false;
  }

  /// Gives equal tuples, bit for bit, one number, in the order of their first use.
  void number_corners(Reference& reference) {
    const Array& array = *reference.array;
    const size_t size = array.tuple_size();
    // The number of points is a guess at how many tuples differ; the table grows if there are more.
    TupleIndex index(size, std::min<uint64_t>(array.count(), mesh_.point_count()));
    reference.of_corner.resize(array.count(), none);
    for (uint64_t corner = 0; corner < array.count(); ++corner) {
      if (all_nan(array, corner)) continue;
      const uint32_t number = index.number_of(array.bytes.data() + corner * size);
      if (number == reference.first.size()) reference.first.push_back(corner);
      reference.of_corner[corner] = number;
    }
  }

  /// Would a reader take this array for one on points, because each corner has its point's number? Then a
  /// comment has to say that it is not.
  bool looks_like_points(const Reference& reference) const {
    // Numbers are given in the order of first use, so as many as there are points is needed for each corner
    // to have its point's.
    if (reference.first.size() != mesh_.point_count()) return false;
    uint64_t corner = 0;
    for (const CellBlock& block : mesh_.blocks) {
      for (const uint32_t node : block.connectivity) {
        if (reference.of_corner[corner++] != node) return false;
      }
    }
    return true;
  }

  void write_head() {
    for (const auto& [key, text] : mesh_.metadata) {
      std::string line = text;
      std::replace(line.begin(), line.end(), '\n', ' ');
      std::replace(line.begin(), line.end(), '\r', ' ');
      if (key == "comment") {
        out_.put(line.empty() ? "#\n" : "# " + line + "\n");
      } else if (key == "mtllib") {
        out_.put("mtllib " + line + "\n");
      } else {
        note_metadata(key, text, notes_);
      }
    }
    const std::array<const Array*, obj_array_count> arrays = {&mesh_.points, texcoords_.array, normals_.array,
                                                              colour_, weight_};
    std::string wide;
    for (size_t i = 0; i < arrays.size(); ++i) {
      if (arrays[i] != nullptr && arrays[i]->type == Scalar::f64)
        wide += std::string(" ") + obj_array_names[i];
      if (i != 0 && arrays[i] != nullptr && arrays[i]->name != obj_array_names[i]) {
        notes_.push_back("array \"" + arrays[i]->name + "\" becomes \"" + obj_array_names[i] + "\"");
      }
    }
    if (!wide.empty()) out_.put("# maille f64" + wide + "\n");
    if (texcoords_.on_corners() && looks_like_points(texcoords_)) out_.put("# maille corners texcoord\n");
    if (normals_.on_corners() && looks_like_points(normals_)) out_.put("# maille corners normal\n");
    if (colour_ != nullptr && colour_->type == Scalar::u8) out_.put("# maille u8 colour\n");
  }

  void write_points() {
    if (mesh_.point_count() == 0) out_.put("o\n");  // a file without any statement is not taken for OBJ
    const size_t size = mesh_.points.tuple_size();
    for (uint64_t point = 0; point < mesh_.point_count(); ++point) {
      out_.put("v ");
      put_scalars(out_, mesh_.points.bytes.data() + point * size, mesh_.points.type, 3);
      if (colour_ != nullptr) {
        write_colour(point);
      } else if (weight_ != nullptr && !all_nan(*weight_, point)) {
        out_.put(' ');
        put_scalar(out_, weight_->bytes.data() + point * weight_->tuple_size(), weight_->type);
      }
      out_.put('\n');
    }
    // A line has room for one of them: four numbers are a weight, six or seven a colour.
    if (colour_ != nullptr && weight_ != nullptr) note_array(*weight_, notes_);
  }

  void write_colour(uint64_t point) {
    if (all_nan(*colour_, point)) return;
    const std::byte* const from = colour_->bytes.data() + point * colour_->tuple_size();
    for (uint32_t i = 0; i < colour_->components; ++i) {
      out_.put(' ');
      if (colour_->type == Scalar::u8) {
        out_.put_number(static_cast<float>(from[i]) / 255.0f);
      } else {
        put_scalar(out_, from + i * size_of(colour_->type), colour_->type);
      }
    }
  }

  void write_references(const Reference& reference, const char* keyword) {
    if (reference.array == nullptr) return;
    const Array& array = *reference.array;
    const uint64_t count = reference.on_corners() ? reference.first.size() : array.count();
    for (uint64_t i = 0; i < count; ++i) {
      const uint64_t tuple = reference.on_corners() ? reference.first[i] : i;
      out_.put(keyword);
      put_scalars(out_, array.bytes.data() + tuple * array.tuple_size(), array.type, array.components);
      out_.put('\n');
    }
  }

  /// The number a corner refers to, counted from 1; 0: none.
  static uint64_t number_of(const Reference& reference, uint64_t corner, uint32_t node) {
    if (reference.on_points()) return uint64_t{node} + 1;
    if (!reference.on_corners() || reference.of_corner[corner] == none) return 0;
    return uint64_t{reference.of_corner[corner]} + 1;
  }

  void write_cells() {
    for_each_cell(mesh_, [&](CellType type, uint64_t cell, uint64_t corner, std::span<const uint32_t> nodes) {
      if (!is_cell(type) || nodes.empty()) return;
      write_labels(cell);
      out_.put(keyword_of(type));
      for (const uint32_t node : nodes) {
        out_.put(' ');
        out_.put_number(uint64_t{node} + 1);
        const uint64_t texcoord = number_of(texcoords_, corner, node);
        const uint64_t normal = number_of(normals_, corner, node);
        ++corner;
        if (texcoord != 0 || normal != 0) out_.put('/');
        if (texcoord != 0) out_.put_number(texcoord);
        if (normal != 0) {
          out_.put('/');
          out_.put_number(normal);
        }
      }
      out_.put('\n');
    });
  }

  void write_labels(uint64_t cell) {
    for (size_t i = 0; i < obj_label_count; ++i) {
      if (labels_[i] == nullptr) continue;
      const Array& array = *labels_[i];
      const uint64_t value = with_type(array.type, [&](auto zero) {
        using T = decltype(zero);
        return static_cast<uint64_t>(load<T>(array.bytes.data() + cell * sizeof(T)));
      });
      // Comparing numbers first saves making the text for each cell.
      if (current_value_[i] == value && started_[i]) continue;
      current_value_[i] = value;
      started_[i] = true;
      std::string label = value < array.labels.size() ? array.labels[value] : std::to_string(value);
      std::replace(label.begin(), label.end(), '\n', ' ');
      std::replace(label.begin(), label.end(), '\r', ' ');
      if (label == current_label_[i]) continue;
      out_.put(obj_label_keywords[i]);
      if (!label.empty()) out_.put(" " + label);
      out_.put('\n');
      current_label_[i] = label;
    }
  }

  const Mesh& mesh_;
  BufferedWriter out_;
  std::vector<std::string>& notes_;
  Reference texcoords_;
  Reference normals_;
  const Array* colour_ = nullptr;
  const Array* weight_ = nullptr;
  std::array<const Array*, obj_label_count> labels_{};
  std::array<uint64_t, obj_label_count> current_value_{};
  // No label was written yet: a reader takes cells before the first one to have the empty label.
  std::array<bool, obj_label_count> started_{};
  std::array<std::string, obj_label_count> current_label_;
};

}  // namespace

Result<std::vector<std::string>> write_obj(const Mesh& mesh, Sink& sink, const WriteOptions&) {
  std::vector<std::string> notes;
  MAILLE_CHECK(ObjWriter(mesh, sink, notes).write());
  return notes;
}

}  // namespace maille
