#include <algorithm>
#include "base/bytes.h"
#include "io/buffered_writer.h"
#include "io/cells.h"
#include "io/notes.h"
#include "io/reading.h"
#include "io/stl/stl.h"

namespace maille {
namespace {

/// Writes numbers as T: float in binary files and in text from floats, otherwise double.
template <class T>
class StlWriter {
 public:
  StlWriter(const Mesh& mesh, Sink& sink, bool ascii, std::vector<std::string>& notes)
      : mesh_(mesh), out_(sink), ascii_(ascii), notes_(notes) {}

  Result<> write() {
    MAILLE_CHECK(count());
    choose_arrays();
    take_metadata();
    write_head();
    for_each_cell(mesh_, [&](CellType type, uint64_t cell, uint64_t, std::span<const uint32_t> nodes) {
      if (!is_face(type) || nodes.size() < 3) return;
      if (ascii_) write_solid(cell);
      // Polygons become fans around their first corner.
      for (size_t i = 2; i < nodes.size(); ++i) write_facet(cell, {nodes[0], nodes[i - 1], nodes[i]});
    });
    if (ascii_) end_solid();
    return out_.finish();
  }

 private:
  // The first pass: a binary file has the number of facets in front, and the notes need to know what is lost.
  Result<> count() {
    uint64_t others = 0;
    uint64_t polygons = 0;
    uint64_t pieces = 0;
    std::vector<bool> used(mesh_.point_count());
    for_each_cell(mesh_, [&](CellType type, uint64_t, uint64_t, std::span<const uint32_t> nodes) {
      if (!is_face(type) || nodes.size() < 3) {
        ++others;
        return;
      }
      facets_ += nodes.size() - 2;
      polygons += nodes.size() > 3 ? 1 : 0;
      pieces += nodes.size() > 3 ? nodes.size() - 2 : 0;
      for (const uint32_t node : nodes) used[node] = true;
    });
    if (facets_ == 0 && others != 0) {
      return failure(ErrorCode::usage, "STL holds triangles, but this mesh has only other cells");
    }
    if (!ascii_ && facets_ > 0xffffffffu) {
      return failure(ErrorCode::usage,
                     "binary STL holds at most 2^32 - 1 triangles; this mesh has " + std::to_string(facets_));
    }
    const auto unused = static_cast<uint64_t>(std::count(used.begin(), used.end(), false));
    if (others != 0)
      notes_.push_back(counted(others, "cell") + " that are not faces of 3 corners or more left out");
    if (polygons != 0) {
      notes_.push_back(counted(polygons, "polygon") + " cut into " + counted(pieces, "triangle") + " (fans)");
    }
    if (unused != 0) notes_.push_back(counted(unused, "point") + " that no triangle uses left out");
    const bool same_type = mesh_.points.type == (sizeof(T) == 4 ? Scalar::f32 : Scalar::f64);
    if (!same_type)
      notes_.push_back(std::string("positions were rounded from ") + name_of(mesh_.points.type));
    return {};
  }

  void choose_arrays() {
    for (const Array& array : mesh_.arrays) {
      const bool on_cells = array.domain == Domain::cell;
      if (on_cells && array.role == Role::normal && array.components == 3 && is_float(array.type) &&
          !normals_) {
        normals_ = &array;
      } else if (on_cells && array.name == "attribute" && array.type == Scalar::u16 &&
                 array.components == 1 && !ascii_) {
        attributes_ = &array;
      } else if (on_cells && array.name == "solid" && array.role == Role::label &&
                 array.type == Scalar::u32 && array.components == 1 && ascii_) {
        solids_ = &array;
      } else {
        note_array(array, notes_);
      }
    }
    note_block_names(mesh_, notes_);
    if (ascii_) note_nan_payloads(mesh_, notes_);
  }

  void take_metadata() {
    for (const auto& [key, text] : mesh_.metadata) {
      if (key == "stl.header") {
        header_ = from_word(text).substr(0, 80);
      } else if (key == "stl.solid") {
        name_ = text;
      } else if (key == "stl.normals") {
        zero_normals_ = text == "zero";
      } else {
        note_metadata(key, text, notes_);
      }
    }
  }

  void write_head() {
    if (ascii_) return;
    // The format's own size. What is remembered may begin with "solid", as many binary files do; programs
    // that go by this word alone take such a file for text.
    header_.resize(80);
    out_.put(header_);
    out_.put_raw(static_cast<uint32_t>(facets_));
  }

  /// Text: begins a solid where the label changes.
  void write_solid(uint64_t cell) {
    const uint32_t value = solids_ == nullptr ? 0 : solids_->values<uint32_t>()[cell];
    if (begun_ && value == solid_) return;
    end_solid(begun_);
    solid_ = value;
    if (solids_ != nullptr)
      name_ = value < solids_->labels.size() ? solids_->labels[value] : std::to_string(value);
    // A line end in a name would begin another statement.
    std::replace(name_.begin(), name_.end(), '\n', ' ');
    std::replace(name_.begin(), name_.end(), '\r', ' ');
    out_.put(name_.empty() ? "solid\n" : "solid " + name_ + "\n");
    begun_ = true;
  }
  void end_solid(bool begun) {
    if (begun) out_.put(name_.empty() ? "endsolid\n" : "endsolid " + name_ + "\n");
  }
  /// The last one; a mesh without triangles is one empty solid.
  void end_solid() {
    if (!begun_) out_.put(name_.empty() ? "solid\n" : "solid " + name_ + "\n");
    end_solid(true);
  }

  std::array<T, 3> tuple_of(const Array& array, uint64_t tuple) const {
    std::array<T, 3> numbers;
    with_type(array.type, [&](auto zero) {
      using From = decltype(zero);
      const std::byte* const from = array.bytes.data() + tuple * 3 * sizeof(From);
      for (size_t i = 0; i < 3; ++i) numbers[i] = static_cast<T>(load<From>(from + i * sizeof(From)));
    });
    return numbers;
  }

  void write_facet(uint64_t cell, std::array<uint32_t, 3> nodes) {
    std::array<std::array<T, 3>, 3> corners;
    for (size_t i = 0; i < 3; ++i) corners[i] = tuple_of(mesh_.points, nodes[i]);
    std::array<T, 3> normal{};
    if (normals_ != nullptr) {
      normal = tuple_of(*normals_, cell);
      // Computed where the mesh has none, unless it came from a file whose normals were all zero, as some
      // programs write them.
    } else if (!zero_normals_) {
      normal = facet_normal<T>(corners);
    }
    if (ascii_) {
      write_text(normal, corners);
      return;
    }
    // Binary files are written by StlWriter<float> only.
    if constexpr (sizeof(T) == 4) {
      out_.put_raw(normal);
      out_.put_raw(corners);
      out_.put_raw(attributes_ == nullptr ? uint16_t{0} : attributes_->values<uint16_t>()[cell]);
    }
  }

  void write_text(const std::array<T, 3>& normal, const std::array<std::array<T, 3>, 3>& corners) {
    out_.put("  facet normal");
    put_numbers(normal);
    out_.put("\n    outer loop\n");
    for (const std::array<T, 3>& corner : corners) {
      out_.put("      vertex");
      put_numbers(corner);
      out_.put('\n');
    }
    out_.put("    endloop\n  endfacet\n");
  }
  void put_numbers(const std::array<T, 3>& numbers) {
    for (const T number : numbers) {
      out_.put(' ');
      out_.put_number(number);
    }
  }

  const Mesh& mesh_;
  BufferedWriter out_;
  bool ascii_;
  std::vector<std::string>& notes_;
  uint64_t facets_ = 0;
  const Array* normals_ = nullptr;
  const Array* attributes_ = nullptr;
  const Array* solids_ = nullptr;
  std::string header_;
  std::string name_;
  bool zero_normals_ = false;
  bool begun_ = false;
  uint32_t solid_ = 0;
};

}  // namespace

Result<std::vector<std::string>> write_stl(const Mesh& mesh, Sink& sink, const WriteOptions& options) {
  std::vector<std::string> notes;
  const bool single = !options.ascii || mesh.points.type == Scalar::f32;
  if (single) {
    MAILLE_CHECK(StlWriter<float>(mesh, sink, options.ascii, notes).write());
  } else {
    MAILLE_CHECK(StlWriter<double>(mesh, sink, true, notes).write());
  }
  return notes;
}

}  // namespace maille
