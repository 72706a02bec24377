#pragma once

#include <string>
#include <vector>

#include "io/cell_store.h"
#include "io/token_reader.h"
#include "io/vtk/vtk_field_data.h"
#include "io/vtk/vtk_legacy.h"

namespace maille {

/// Reads one file: vtk_legacy.cpp its sections, vtk_legacy_cells.cpp what they say of points and cells.
/// Sections may come in any order, so cells are only made when all were read.
class VtkLegacyReader {
 public:
  VtkLegacyReader(std::string_view text, const std::string& name, const ReadOptions& options)
      : in_(text, name), text_(text), options_(options), budget_(name, text.size(), options.limits) {}

  Result<ReadResult> read();

 private:
  enum class Shape { unstructured, poly_data, structured, rectilinear, image };
  /// A list of cells as the sections hold them.
  struct Cells {
    std::vector<int64_t> connectivity;
    std::vector<int64_t> offsets;  ///< one more than cells

    uint64_t count() const { return offsets.empty() ? 0 : offsets.size() - 1; }
    std::span<const int64_t> cell(uint64_t i) const {
      return std::span(connectivity)
          .subspan(static_cast<size_t>(offsets[i]), static_cast<size_t>(offsets[i + 1] - offsets[i]));
    }
  };

  Result<> read_header();
  Result<> read_section(const std::string& keyword);
  Result<> read_geometry(const std::string& keyword);
  Result<> read_attribute(const std::string& keyword);
  Result<> read_field();
  Result<> read_strings(const std::string& name, uint32_t components, uint64_t count);
  Result<> add_field(Array array);
  Result<Cells> read_cells();
  Result<Cells> read_offsets(uint64_t offsets, uint64_t size);
  Result<> read_list(Array& array, uint64_t count, uint32_t components, const std::string& type);
  Result<> read_ascii(Array& array, uint64_t values);
  Result<> read_binary(Array& array, uint64_t values);
  Result<> read_bits(Array& array, uint64_t values);
  Result<Array> read_array(const std::string& name, uint64_t count, uint32_t components,
                           Role role = Role::none);
  Result<std::vector<int64_t>> read_integers(uint64_t count, Scalar type);
  Result<> add_array(Array array);
  void skip_metadata();
  std::string next_word() { return std::string(in_.word()); }

  Result<> finish_cells();
  Result<> finish_unstructured();
  Result<> add_poly_data(const Cells& cells, CellType single, CellType varying);
  Result<> add_nodes(std::span<const int64_t> nodes);
  Result<> finish_grid();
  Result<> make_grid_points();
  void finish_fields();

  TokenReader in_;
  std::string_view text_;
  const ReadOptions& options_;
  Budget budget_;
  bool binary_ = false;
  Shape shape_ = Shape::unstructured;
  Mesh mesh_;
  std::vector<std::string> notes_;
  Cells cells_, verts_, lines_, polys_, strips_;
  std::vector<int64_t> types_;
  CellStore store_;
  // Points along each axis of structured, rectilinear and uniform grids: 1 to 2^32 - 1 once they are read.
  int64_t dimensions_[3] = {0, 0, 0};
  double origin_[3] = {0, 0, 0}, spacing_[3] = {1, 1, 1};
  Array coordinates_[3];
  // What POINT_DATA or CELL_DATA said last: attributes behind it belong there.
  Domain domain_ = Domain::mesh;
  uint64_t domain_count_ = 0;
  // Kept apart until all is read, as cells may still be reordered or left out.
  std::vector<Array> point_arrays_, cell_arrays_;
  VtkFieldData field_;
  VtkTexts texts_;
};

}  // namespace maille
