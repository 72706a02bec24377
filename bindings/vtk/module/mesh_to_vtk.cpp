#include "mesh_to_vtk.h"

#include <maille/vtk.h>

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkIdTypeArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkTypeInt32Array.h>
#include <vtkTypeInt64Array.h>
#include <vtkTypeUInt64Array.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <numeric>
#include <optional>

namespace maille_vtk {

using namespace maille;

int vtk_type_of(Scalar type) {
  constexpr int types[] = {VTK_TYPE_INT8,    VTK_TYPE_UINT8,  VTK_TYPE_INT16, VTK_TYPE_UINT16,
                           VTK_TYPE_INT32,   VTK_TYPE_UINT32, VTK_TYPE_INT64, VTK_TYPE_UINT64,
                           VTK_TYPE_FLOAT32, VTK_TYPE_FLOAT64};
  return types[static_cast<size_t>(type)];
}

namespace {

/// The place of fits_poly_data() cells among the four cell arrays of vtkPolyData.
size_t kind_of(CellType type) {
  return static_cast<size_t>(vtk_poly_kind(type).value_or(VtkPolyKind::polys));
}

vtkSmartPointer<vtkDataArray> empty_array(const std::string& name, Scalar type, uint32_t components,
                                          uint64_t tuples) {
  auto array = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(vtk_type_of(type)));
  array->SetName(name.c_str());
  array->SetNumberOfComponents(static_cast<int>(components));
  array->SetNumberOfTuples(static_cast<vtkIdType>(tuples));
  return array;
}

/// VTK owns its arrays and the mesh owns its own, so numbers are copied once, in one piece.
vtkSmartPointer<vtkDataArray> copy_of(const Array& array) {
  auto copy = empty_array(array.name, array.type, array.components, array.count());
  if (array.count() > 0) std::memcpy(copy->GetVoidPointer(0), array.bytes.data(), array.bytes.size());
  return copy;
}

/// Tuples in another order.
vtkSmartPointer<vtkDataArray> copy_of(const Array& array, std::span<const uint64_t> order) {
  if (order.empty()) return copy_of(array);
  auto copy = empty_array(array.name, array.type, array.components, array.count());
  const size_t size = array.tuple_size();
  auto* const out = static_cast<std::byte*>(copy->GetVoidPointer(0));
  for (size_t i = 0; i < order.size(); ++i)
    std::memcpy(out + i * size, array.bytes.data() + order[i] * size, size);
  return copy;
}

void add_strings(vtkFieldData* field, const std::string& name, std::span<const std::string> values) {
  // Keys of metadata may come again; VTK keeps one array of a name.
  auto strings =
      vtkSmartPointer<vtkStringArray>(vtkStringArray::SafeDownCast(field->GetAbstractArray(name.c_str())));
  if (!strings) {
    strings = vtkSmartPointer<vtkStringArray>::New();
    strings->SetName(name.c_str());
    field->AddArray(strings);
  }
  for (const std::string& value : values) strings->InsertNextValue(value);
}

vtkSmartPointer<vtkAbstractArray> texts_of(const Array& array, std::span<const uint64_t> order) {
  const std::vector<std::string> texts = vtk_texts_of(array);
  vtkNew<vtkStringArray> copy;
  copy->SetName(array.name.c_str());
  copy->SetNumberOfComponents(static_cast<int>(array.components));
  for (size_t i = 0; i < texts.size(); ++i) {
    const size_t n = array.components;
    copy->InsertNextValue(order.empty() ? texts[i] : texts[order[i / n] * n + i % n]);
  }
  return copy;
}

/// Numbers, or text again.
vtkSmartPointer<vtkAbstractArray> copy_of(const Mesh& mesh, const Array& array,
                                          std::span<const uint64_t> order) {
  if (is_vtk_text(mesh.metadata, array)) return texts_of(array, order);
  return copy_of(array, order);
}

void add_blocks(const VtkBlocks& blocks, vtkFieldData* field) {
  if (blocks.empty()) return;
  field->AddArray(copy_of(vtk_block_sizes(blocks)));
  if (vtk_has_names(blocks)) add_strings(field, vtk_block_names_name, vtk_block_names(blocks));
}

void add_field_data(const Mesh& mesh, vtkFieldData* field) {
  for (const auto& [key, value] : mesh.metadata) {
    if (key != vtk_text_key) add_strings(field, key, std::span(&value, 1));
  }
  for (const Array& array : mesh.arrays) {
    if (array.role == Role::label && !is_vtk_text(mesh.metadata, array))
      add_strings(field, array.name + vtk_labels_suffix, array.labels);
    if (array.domain == Domain::mesh || array.domain == Domain::corner)
      field->AddArray(copy_of(mesh, array, {}));
  }
}

/// Numbers of blocks on cells, for VTK's users, where blocks have names.
void add_block_array(const Mesh& mesh, vtkDataSet& data, std::span<const uint64_t> order) {
  const auto array = vtk_block_array(mesh);
  if (!array) return;
  data.GetCellData()->AddArray(copy_of(*array, order));
  add_strings(data.GetFieldData(), array->name + vtk_labels_suffix, array->labels);
}

/// What an array means, where VTK takes one of its shape for it, and has none yet.
void make_active(const Array& array, vtkDataSetAttributes* attributes) {
  const char* const name = array.name.c_str();
  const uint32_t n = array.components;
  if (array.role == Role::normal && n == 3 && !attributes->GetNormals()) attributes->SetActiveNormals(name);
  if (array.role == Role::tangent && n == 3 && !attributes->GetTangents())
    attributes->SetActiveTangents(name);
  if (array.role == Role::texture_coordinate && n <= 3 && !attributes->GetTCoords())
    attributes->SetActiveTCoords(name);
  if (array.role == Role::colour && array.type == Scalar::u8 && (n == 3 || n == 4) &&
      !attributes->GetScalars())
    attributes->SetActiveScalars(name);
}

void add_arrays(const Mesh& mesh, vtkDataSet& data, std::span<const uint64_t> order) {
  for (const Array& array : mesh.arrays) {
    if (array.domain != Domain::point && array.domain != Domain::cell) continue;
    const bool points = array.domain == Domain::point;
    vtkDataSetAttributes* const attributes =
        points ? static_cast<vtkDataSetAttributes*>(data.GetPointData()) : data.GetCellData();
    const auto its_order = points ? std::span<const uint64_t>() : order;
    attributes->AddArray(copy_of(mesh, array, its_order));
    make_active(array, attributes);
  }
  add_field_data(mesh, data.GetFieldData());
  // Where poly data have sorted the cells, blocks are no runs of them any more.
  if (order.empty()) add_blocks(vtk_needed_blocks(mesh), data.GetFieldData());
  add_block_array(mesh, data, order);
}

vtkSmartPointer<vtkPoints> points_of(const Mesh& mesh) {
  vtkNew<vtkPoints> points;
  const auto positions = copy_of(mesh.points);
  positions->SetName("Points");
  points->SetData(positions);
  return points;
}

/// Builds a vtkCellArray in arrays of their final size; Index: vtkTypeInt32Array where all numbers fit, which
/// is half the memory, else vtkTypeInt64Array.
template <class Index>
class Cells {
 public:
  using Number = typename Index::ValueType;
  Cells(uint64_t cells, uint64_t most_corners) {
    offsets_->SetNumberOfValues(static_cast<vtkIdType>(cells + 1));
    connectivity_->SetNumberOfValues(static_cast<vtkIdType>(most_corners));
    *offsets_->GetPointer(0) = 0;
  }
  void add(uint32_t point) { connectivity_->SetValue(corners_++, static_cast<Number>(point)); }
  void end_cell() { *offsets_->GetPointer(++cells_) = static_cast<Number>(corners_); }
  void add_cell(std::span<const uint32_t> nodes) {
    copy(nodes);
    end_cell();
  }
  void add_cells(std::span<const uint32_t> nodes, unsigned each) {
    Number* const offset = offsets_->GetPointer(cells_ + 1);
    const uint64_t count = nodes.size() / each;
    for (uint64_t i = 0; i < count; ++i)
      offset[i] = static_cast<Number>(corners_ + static_cast<vtkIdType>((i + 1) * each));
    cells_ += static_cast<vtkIdType>(count);
    copy(nodes);
  }
  /// Cells with other offsets, the first of which is 0.
  void add_cells(std::span<const uint32_t> nodes, std::span<const uint64_t> offsets) {
    Number* const offset = offsets_->GetPointer(cells_);
    for (size_t i = 1; i < offsets.size(); ++i)
      offset[i] = static_cast<Number>(corners_ + static_cast<vtkIdType>(offsets[i]));
    cells_ += static_cast<vtkIdType>(offsets.size() - 1);
    copy(nodes);
  }
  vtkSmartPointer<vtkCellArray> finish() {
    connectivity_->SetNumberOfValues(corners_);
    vtkNew<vtkCellArray> array;
    array->SetData(offsets_.Get(), connectivity_.Get());
    return array;
  }

 private:
  void copy(std::span<const uint32_t> nodes) {
    if (nodes.empty()) return;
    std::copy(nodes.begin(), nodes.end(), connectivity_->GetPointer(corners_));
    corners_ += static_cast<vtkIdType>(nodes.size());
  }
  vtkNew<Index> offsets_, connectivity_;
  vtkIdType cells_ = 0, corners_ = 0;
};

/// VTK's 32-bit cell arrays are signed.
bool fits_32_bits(const Mesh& mesh) {
  constexpr uint64_t most = std::numeric_limits<int32_t>::max();
  return mesh.point_count() <= most && mesh.corner_count() <= most;
}

/// Faces of polyhedra as VTK's streams: number of faces; of each face number of points, points.
class FaceStreams {
 public:
  void add(std::span<const uint32_t> corners, std::span<const uint32_t> sizes, uint64_t cell) {
    fill_up_to(cell);
    locations_->InsertNextValue(faces_->GetNumberOfValues());
    faces_->InsertNextValue(static_cast<vtkIdType>(sizes.size()));
    for (const uint32_t size : sizes) {
      faces_->InsertNextValue(size);
      for (const uint32_t point : corners.first(size)) faces_->InsertNextValue(point);
      corners = corners.subspan(size);
    }
  }
  bool empty() const { return faces_->GetNumberOfValues() == 0; }
  vtkIdTypeArray* locations(uint64_t cells) {
    fill_up_to(cells);
    return locations_;
  }
  vtkIdTypeArray* faces() { return faces_; }

 private:
  /// VTK wants a location for each cell of the grid; -1 stands for a cell that is no polyhedron.
  void fill_up_to(uint64_t cell) {
    while (static_cast<uint64_t>(locations_->GetNumberOfValues()) < cell) locations_->InsertNextValue(-1);
  }
  vtkNew<vtkIdTypeArray> locations_, faces_;
};

template <class Index>
class GridBuilder {
 public:
  explicit GridBuilder(const Mesh& mesh) : mesh_(mesh), cells_(mesh.cell_count(), mesh.corner_count()) {
    types_->SetNumberOfValues(static_cast<vtkIdType>(mesh.cell_count()));
  }
  void build(vtkUnstructuredGrid& grid) {
    for (const CellBlock& block : mesh_.blocks) add(block);
    const auto cells = cells_.finish();
    if (faces_.empty()) {
      grid.SetCells(types_, cells);
    } else {
      grid.SetCells(types_, cells, faces_.locations(done_), faces_.faces());
    }
  }

 private:
  void add(const CellBlock& block) {
    const uint64_t count = block.size();
    const bool polyhedra = !block.face_sizes.empty();
    uint8_t* const types = types_->GetPointer(static_cast<vtkIdType>(done_));
    for (uint64_t i = 0; i < count; ++i) types[i] = static_cast<uint8_t>(block.type_of(i));
    if (polyhedra) {
      for (uint64_t i = 0; i < count; ++i) add_cell(block, i, done_ + i);
    } else if (const unsigned nodes = nodes_of(block.type)) {
      cells_.add_cells(block.connectivity, nodes);
    } else {
      cells_.add_cells(block.connectivity, block.offsets);
    }
    done_ += count;
  }
  void add_cell(const CellBlock& block, uint64_t i, uint64_t number) {
    const auto corners = block.cell(i);
    if (block.type_of(i) != CellType::polyhedron) return cells_.add_cell(corners);
    // Each point once, as the faces name them first.
    last_cell_.resize(mesh_.point_count(), none);
    for (const uint32_t point : corners) {
      if (std::exchange(last_cell_[point], number) != number) cells_.add(point);
    }
    cells_.end_cell();
    faces_.add(corners, block.faces(i), number);
  }

  static constexpr uint64_t none = ~uint64_t{0};
  const Mesh& mesh_;
  Cells<Index> cells_;
  FaceStreams faces_;
  vtkNew<vtkUnsignedCharArray> types_;
  std::vector<uint64_t> last_cell_;  ///< by point
  uint64_t done_ = 0;
};

vtkSmartPointer<vtkDataSet> grid_of(const Mesh& mesh) {
  vtkNew<vtkUnstructuredGrid> grid;
  grid->SetPoints(points_of(mesh));
  if (fits_32_bits(mesh)) {
    GridBuilder<vtkTypeInt32Array>(mesh).build(*grid);
  } else {
    GridBuilder<vtkTypeInt64Array>(mesh).build(*grid);
  }
  add_arrays(mesh, *grid, {});
  return grid;
}

struct Kinds {
  std::array<uint64_t, 4> cells{}, corners{};
  bool sorted = true;
};

/// How many cells and corners each of the four arrays of vtkPolyData takes, and whether the cells come in its
/// order already. A uniform block is counted as a whole.
Kinds count_kinds(const Mesh& mesh) {
  Kinds kinds;
  size_t before = 0;
  for (const CellBlock& block : mesh.blocks) {
    const bool uniform = block.type != CellType::mixed;
    const uint64_t step = uniform ? std::max<uint64_t>(block.size(), 1) : 1;
    for (uint64_t i = 0; i < block.size(); i += step) {
      const size_t kind = kind_of(block.type_of(i));
      kinds.cells[kind] += step;
      kinds.corners[kind] += uniform ? block.connectivity.size() : block.cell(i).size();
      kinds.sorted = kinds.sorted && kind >= before;
      before = kind;
    }
  }
  return kinds;
}

/// vtkPolyData numbers its vertices first, then lines, polygons and strips, and cell arrays must follow.
/// Returns the mesh's number of each of its cells, stable within a kind; empty if the order is the mesh's
/// own.
std::vector<uint64_t> order_of(const Mesh& mesh, const Kinds& kinds) {
  if (kinds.sorted) return {};
  std::vector<uint64_t> order(mesh.cell_count());
  std::array<uint64_t, 4> next{};
  for (size_t k = 1; k < 4; ++k) next[k] = next[k - 1] + kinds.cells[k - 1];
  uint64_t number = 0;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) order[next[kind_of(block.type_of(i))]++] = number++;
  }
  return order;
}

template <class Index>
void fill_poly_data(const Mesh& mesh, const Kinds& kinds, vtkPolyData& data) {
  std::vector<Cells<Index>> cells;
  for (size_t k = 0; k < 4; ++k) cells.emplace_back(kinds.cells[k], kinds.corners[k]);
  for (const CellBlock& block : mesh.blocks) {
    if (block.type != CellType::mixed) {
      Cells<Index>& all = cells[kind_of(block.type)];
      const unsigned nodes = nodes_of(block.type);
      nodes ? all.add_cells(block.connectivity, nodes) : all.add_cells(block.connectivity, block.offsets);
      continue;
    }
    for (uint64_t i = 0; i < block.size(); ++i) cells[kind_of(block.type_of(i))].add_cell(block.cell(i));
  }
  if (kinds.cells[0] > 0) data.SetVerts(cells[0].finish());
  if (kinds.cells[1] > 0) data.SetLines(cells[1].finish());
  if (kinds.cells[2] > 0) data.SetPolys(cells[2].finish());
  if (kinds.cells[3] > 0) data.SetStrips(cells[3].finish());
}

vtkSmartPointer<vtkDataSet> poly_data_of(const Mesh& mesh) {
  vtkNew<vtkPolyData> data;
  data->SetPoints(points_of(mesh));
  const Kinds kinds = count_kinds(mesh);
  if (fits_32_bits(mesh)) {
    fill_poly_data<vtkTypeInt32Array>(mesh, kinds, *data);
  } else {
    fill_poly_data<vtkTypeInt64Array>(mesh, kinds, *data);
  }
  add_arrays(mesh, *data, order_of(mesh, kinds));
  return data;
}

Array rows_of(const Array& array, std::span<const uint64_t> rows) {
  Array part = make_array(array.name, array.domain, array.type, array.components, array.role);
  part.labels = array.labels;
  part.resize(rows.size());
  const size_t size = array.tuple_size();
  for (size_t i = 0; i < rows.size(); ++i)
    std::memcpy(part.bytes.data() + i * size, array.bytes.data() + rows[i] * size, size);
  return part;
}

}  // namespace

bool fits_poly_data(CellType type) {
  return vtk_poly_kind(type).has_value();
}

bool fits_poly_data(std::span<const std::pair<CellType, uint64_t>> types) {
  return std::all_of(types.begin(), types.end(), [](const auto& type) { return fits_poly_data(type.first); });
}

vtkSmartPointer<vtkDataSet> to_vtk(const Mesh& mesh, bool poly_data) {
  return poly_data ? poly_data_of(mesh) : grid_of(mesh);
}

Mesh block_of(const Mesh& mesh, size_t block) {
  constexpr uint32_t none = ~uint32_t{0};
  Mesh part;
  uint64_t first_cell = 0, first_corner = 0;
  for (size_t b = 0; b < block; ++b) {
    first_cell += mesh.blocks[b].size();
    first_corner += mesh.blocks[b].connectivity.size();
  }
  part.blocks = {mesh.blocks[block]};
  part.metadata = mesh.metadata;
  std::vector<uint32_t> number(mesh.point_count(), none);
  for (const uint32_t point : part.blocks[0].connectivity) number[point] = 0;
  std::vector<uint64_t> points;
  for (uint64_t i = 0; i < number.size(); ++i) {
    if (number[i] == none) continue;
    number[i] = static_cast<uint32_t>(points.size());
    points.push_back(i);
  }
  for (uint32_t& point : part.blocks[0].connectivity) point = number[point];
  std::vector<uint64_t> cells(part.blocks[0].size()), corners(part.blocks[0].connectivity.size());
  std::iota(cells.begin(), cells.end(), first_cell);
  std::iota(corners.begin(), corners.end(), first_corner);
  part.points = rows_of(mesh.points, points);
  for (const Array& array : mesh.arrays) {
    part.arrays.push_back(array.domain == Domain::point    ? rows_of(array, points)
                          : array.domain == Domain::cell   ? rows_of(array, cells)
                          : array.domain == Domain::corner ? rows_of(array, corners)
                                                           : array);
  }
  return part;
}

}  // namespace maille_vtk
