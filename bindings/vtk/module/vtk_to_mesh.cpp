#include "vtk_to_mesh.h"

#include <maille/vtk.h>

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkCellTypes.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPointSet.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkStringArray.h>
#include <vtkUnstructuredGrid.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <memory>
#include <optional>
#include <string_view>

#include "mesh_to_vtk.h"

namespace maille_vtk {

using namespace maille;

namespace {

/// The Scalar of VTK's array, by size and sign: types such as long and vtkIdType are of another size on other
/// machines. Bits have none.
std::optional<Scalar> scalar_of_vtk(vtkDataArray& array) {
  const int type = array.GetDataType();
  if (type == VTK_FLOAT) return Scalar::f32;
  if (type == VTK_DOUBLE) return Scalar::f64;
  if (type == VTK_BIT) return {};
  const bool is_signed = array.GetDataTypeMin() < 0;
  switch (array.GetDataTypeSize()) {
    case 1:
      return is_signed ? Scalar::i8 : Scalar::u8;
    case 2:
      return is_signed ? Scalar::i16 : Scalar::u16;
    case 4:
      return is_signed ? Scalar::i32 : Scalar::u32;
    case 8:
      return is_signed ? Scalar::i64 : Scalar::u64;
    default:
      return {};
  }
}

/// The values of an array. They are borrowed where VTK stores them tuple after tuple, as maille does, and
/// copied otherwise; either way the mesh keeps the VTK array alive.
Array view_of(vtkDataArray& array, std::string name, Domain domain, Scalar type) {
  vtkSmartPointer<vtkDataArray> plain = &array;
  if (!array.HasStandardMemoryLayout()) {
    plain.TakeReference(vtkDataArray::CreateDataArray(array.GetDataType()));
    plain->DeepCopy(&array);
  }
  Array view =
      make_array(std::move(name), domain, type, static_cast<uint32_t>(array.GetNumberOfComponents()));
  const size_t size = static_cast<size_t>(array.GetNumberOfTuples()) * view.tuple_size();
  const auto* const bytes = static_cast<const std::byte*>(plain->GetVoidPointer(0));
  const auto owner = std::make_shared<vtkSmartPointer<vtkDataArray>>(plain);
  if (size > 0) view.bytes = Buffer<std::byte>::borrow({bytes, size}, owner);
  return view;
}

/// The points of data that have none of their own (images, rectilinear grids) are doubles.
Array points_of(vtkDataSet& data) {
  auto* const set = vtkPointSet::SafeDownCast(&data);
  if (set && set->GetPoints()) {
    vtkDataArray& points = *set->GetPoints()->GetData();
    if (const auto type = scalar_of_vtk(points)) return view_of(points, "position", Domain::point, *type);
  }
  Array points = make_array("position", Domain::point, Scalar::f64, 3);
  points.resize(static_cast<uint64_t>(data.GetNumberOfPoints()));
  for (vtkIdType i = 0; i < data.GetNumberOfPoints(); ++i)
    data.GetPoint(i, points.values<double>().data() + 3 * i);
  return points;
}

/// A mesh of a data set of VTK. Numbers of arrays are borrowed where they lie; cells are copied, as VTK's are
/// in other arrays, of other types. What a mesh has no place for is named in the notes.
class Converter {
 public:
  explicit Converter(vtkDataSet& data) : data_(data) {}

  Result<FromVtk> convert() {
    if (static_cast<uint64_t>(data_.GetNumberOfPoints()) > max_points)
      return failure(ErrorCode::unsupported,
                     "the data set has more points than a mesh in memory can have, 2^32 - 2");
    result_.mesh.points = points_of(data_);
    add_cells();
    add_arrays(*data_.GetPointData(), Domain::point);
    add_arrays(*data_.GetCellData(), Domain::cell);
    add_field_data();
    if (!texts_.empty()) mesh().metadata.emplace_back(vtk_text_key, texts_);
    return std::move(result_);
  }

 private:
  Mesh& mesh() { return result_.mesh; }

  /// The blocks that the field data tell, if they have as many cells and fit their types, else one.
  void add_cells() {
    const auto count = static_cast<uint64_t>(data_.GetNumberOfCells());
    if (!add_known_blocks(count)) add_block("", type_of_all(0, count), 0, count);
    for (const CellBlock& block : mesh().blocks) has_blocks_ = has_blocks_ || !block.name.empty();
  }

  CellType type_at(uint64_t cell) const {
    return static_cast<CellType>(data_.GetCellType(static_cast<vtkIdType>(cell)));
  }
  /// Faces of poly data are polygons where they are not all alike: it does not tell them apart otherwise.
  CellType type_of_all(uint64_t begin, uint64_t end) const {
    if (begin == end) return CellType::polygon;
    bool same = true, faces = data_.IsA("vtkPolyData");
    for (uint64_t i = begin; i < end && (same || faces); ++i) {
      same = same && type_at(i) == type_at(begin);
      faces = faces && is_face(type_at(i));
    }
    return same ? type_at(begin) : faces ? CellType::polygon : CellType::mixed;
  }
  bool fits(CellType type, uint64_t begin, uint64_t end) const {
    for (uint64_t i = begin; i < end && type != CellType::mixed; ++i) {
      if (type_at(i) != type && !(type == CellType::polygon && is_face(type_at(i)))) return false;
    }
    return true;
  }
  /// Takes the blocks from the field data, where to_vtk() puts them. Filters may have removed cells since, so
  /// the data are believed only if the numbers of cells add up and all types fit; false otherwise.
  bool add_known_blocks(uint64_t count) {
    auto* const sizes = data_.GetFieldData()->GetArray(vtk_blocks_name);
    auto* const names =
        vtkStringArray::SafeDownCast(data_.GetFieldData()->GetAbstractArray(vtk_block_names_name));
    if (!sizes || sizes->GetNumberOfComponents() != 2) return false;
    if (names && sizes->GetNumberOfTuples() != names->GetNumberOfValues()) return false;
    std::vector<std::pair<uint64_t, CellType>> blocks;
    uint64_t cells = 0;
    for (vtkIdType b = 0; b < sizes->GetNumberOfTuples(); ++b) {
      // GetComponent() gives doubles of any type; anybody may have written them, so they are held against the
      // cells that are left before they become integers.
      const double size = sizes->GetComponent(b, 0), type = sizes->GetComponent(b, 1);
      if (!(size >= 0 && size <= static_cast<double>(count - cells) && type >= 1 && type <= 255))
        return false;
      blocks.emplace_back(static_cast<uint64_t>(size), static_cast<CellType>(static_cast<int>(type)));
      if (!fits(blocks.back().second, cells, cells + blocks.back().first)) return false;
      cells += blocks.back().first;
    }
    if (cells != count) return false;
    cells = 0;
    for (size_t b = 0; b < blocks.size(); ++b) {
      const std::string name =
          names ? std::string(names->GetValue(static_cast<vtkIdType>(b))) : std::string();
      add_block(name, blocks[b].second, cells, cells + blocks[b].first);
      cells += blocks[b].first;
    }
    return true;
  }

  void add_block(std::string name, CellType type, uint64_t begin, uint64_t end) {
    CellBlock& block = mesh().blocks.emplace_back();
    block.name = std::move(name);
    block.type = type;
    const bool varies = nodes_of(type) == 0;
    if (varies) block.offsets.push_back(0);
    for (uint64_t i = begin; i < end; ++i) {
      if (type == CellType::mixed) block.types.push_back(static_cast<uint8_t>(type_at(i)));
      if (type_at(i) == CellType::polyhedron) {
        add_polyhedron(block, i, i - begin);
      } else {
        data_.GetCellPoints(static_cast<vtkIdType>(i), ids_);
        for (vtkIdType k = 0; k < ids_->GetNumberOfIds(); ++k)
          block.connectivity.push_back(static_cast<uint32_t>(ids_->GetId(k)));
      }
      if (varies) block.offsets.push_back(block.connectivity.size());
    }
    if (!block.face_sizes.empty()) block.cell_faces.resize(end - begin + 1, block.face_sizes.size());
  }
  /// VTK lists the points of a polyhedron once and its faces apart; a mesh has the corners of the faces
  /// instead.
  void add_polyhedron(CellBlock& block, uint64_t cell, uint64_t place) {
    auto* const grid = vtkUnstructuredGrid::SafeDownCast(&data_);
    if (!grid) return;
    grid->GetFaceStream(static_cast<vtkIdType>(cell), ids_);
    block.cell_faces.resize(place + 1, block.face_sizes.size());
    const vtkIdType faces = ids_->GetNumberOfIds() > 0 ? ids_->GetId(0) : 0;
    vtkIdType at = 1;
    for (vtkIdType face = 0; face < faces; ++face) {
      const vtkIdType corners = ids_->GetId(at++);
      block.face_sizes.push_back(static_cast<uint32_t>(corners));
      for (vtkIdType k = 0; k < corners; ++k)
        block.connectivity.push_back(static_cast<uint32_t>(ids_->GetId(at++)));
    }
  }

  /// VTK says what an array means by making it an active attribute.
  Role role_of(vtkDataSetAttributes& attributes, vtkDataArray& array, Scalar type) const {
    if (&array == attributes.GetNormals()) return Role::normal;
    if (&array == attributes.GetTCoords()) return Role::texture_coordinate;
    if (&array == attributes.GetTangents()) return Role::tangent;
    const int n = array.GetNumberOfComponents();
    const bool colour = &array == attributes.GetScalars() && type == Scalar::u8 && (n == 3 || n == 4);
    return colour ? Role::colour : Role::none;
  }
  vtkStringArray* labels_of(const std::string& name) const {
    return vtkStringArray::SafeDownCast(
        data_.GetFieldData()->GetAbstractArray((name + vtk_labels_suffix).c_str()));
  }
  void leave_out(const std::string& name, const char* why) {
    result_.notes.push_back("the array \"" + name + "\" " + why + ", and is left out");
  }

  void add_arrays(vtkDataSetAttributes& attributes, Domain domain) {
    for (int i = 0; i < attributes.GetNumberOfArrays(); ++i) {
      vtkAbstractArray* const any = attributes.GetAbstractArray(i);
      const std::string name = any->GetName() ? any->GetName() : "array " + std::to_string(i);
      if (auto* const texts = vtkStringArray::SafeDownCast(any)) {
        add_texts(*texts, name, domain);
        continue;
      }
      vtkDataArray* const array = vtkDataArray::SafeDownCast(any);
      const auto type = array ? scalar_of_vtk(*array) : std::nullopt;
      if (!type) {
        leave_out(name, "is neither of numbers nor of text");
        continue;
      }
      // Made of the names of the blocks, which are there.
      if (domain == Domain::cell && has_blocks_ && name == vtk_block_array_name && labels_of(name)) continue;
      if (mesh().find(name, domain)) {
        leave_out(name, "has the name of another one");
        continue;
      }
      Array view = view_of(*array, name, domain, *type);
      view.role = role_of(attributes, *array, *type);
      if (auto* const labels = labels_of(name);
          labels && view.role == Role::none && !is_float(*type) && view.components == 1)
        add_labels(*labels, view);
      mesh().arrays.push_back(std::move(view));
    }
  }
  /// Each text gets a number, in the order in which they come.
  void add_texts(vtkStringArray& texts, const std::string& name, Domain domain) {
    Array array = make_array(name, domain, Scalar::u32, static_cast<uint32_t>(texts.GetNumberOfComponents()),
                             Role::label);
    array.resize(static_cast<uint64_t>(texts.GetNumberOfTuples()));
    std::map<std::string, uint32_t> numbers;
    for (size_t i = 0; i < array.values<uint32_t>().size(); ++i) {
      const std::string text = texts.GetValue(static_cast<vtkIdType>(i));
      const auto [known, is_new] = numbers.emplace(text, static_cast<uint32_t>(array.labels.size()));
      if (is_new) array.labels.push_back(text);
      array.values<uint32_t>()[i] = known->second;
    }
    mesh().arrays.push_back(std::move(array));
    texts_ += std::string(texts_.empty() ? "" : "\n") + name_of(domain) + " " + name;
  }
  void add_labels(vtkStringArray& labels, Array& array) {
    array.role = Role::label;
    for (vtkIdType k = 0; k < labels.GetNumberOfValues(); ++k) array.labels.push_back(labels.GetValue(k));
    used_.push_back(array.name + vtk_labels_suffix);
  }

  void add_field_data() {
    vtkFieldData& field = *data_.GetFieldData();
    for (int i = 0; i < field.GetNumberOfArrays(); ++i) {
      vtkAbstractArray* const any = field.GetAbstractArray(i);
      const std::string name = any->GetName() ? any->GetName() : "field " + std::to_string(i);
      const bool of_blocks = name == vtk_blocks_name || name == vtk_block_names_name ||
                             (has_blocks_ && name == std::string(vtk_block_array_name) + vtk_labels_suffix);
      if (of_blocks || std::find(used_.begin(), used_.end(), name) != used_.end()) continue;
      if (auto* const strings = vtkStringArray::SafeDownCast(any)) {
        for (vtkIdType k = 0; k < strings->GetNumberOfValues(); ++k)
          mesh().metadata.emplace_back(name, strings->GetValue(k));
        continue;
      }
      vtkDataArray* const array = vtkDataArray::SafeDownCast(any);
      const auto type = array ? scalar_of_vtk(*array) : std::nullopt;
      if (type && !mesh().find(name, Domain::mesh)) {
        mesh().arrays.push_back(view_of(*array, name, Domain::mesh, *type));
      } else {
        leave_out(name, type ? "has the name of another one" : "is neither of numbers nor of text");
      }
    }
  }

  vtkDataSet& data_;
  FromVtk result_;
  vtkNew<vtkIdList> ids_;
  std::vector<std::string> used_;  ///< arrays of field data that are labels
  std::string texts_;              ///< what was text, as vtk_text_key has it
  bool has_blocks_ = false;        ///< with names
};

}  // namespace

Result<FromVtk> from_vtk(vtkDataSet& data) {
  return Converter(data).convert();
}

}  // namespace maille_vtk
