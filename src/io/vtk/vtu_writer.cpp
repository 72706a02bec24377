#include <algorithm>
#include <functional>

#include "base/result.h"
#include "io/cells.h"
#include "io/vtk/vtk_field_data.h"
#include "io/vtk/vtk_polyhedron.h"
#include "io/vtk/vtk_xml_writer.h"
#include "io/vtk/vtu.h"

namespace maille {
namespace {

/// The arrays of the element Cells, in VTK's form up to 9.3, which newer versions read, too.
struct VtuCells {
  std::vector<uint32_t> connectivity;
  std::vector<uint64_t> ends;
  std::vector<std::byte> types;
  /// Of polyhedra: number of faces, then number of points and points of each face.
  std::vector<uint32_t> faces;
  std::vector<int64_t> face_ends;
  bool polyhedra = false;
};

VtuCells collect_cells(const Mesh& mesh) {
  VtuCells cells;
  const uint64_t count = mesh.cell_count();
  cells.ends.reserve(count);
  cells.types.reserve(count);
  cells.connectivity.reserve(mesh.corner_count());
  std::vector<uint32_t> sorted;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      const CellType type = block.type_of(i);
      const auto nodes = block.cell(i);
      if (type == CellType::polyhedron) {
        // Cells before the first polyhedron have no faces, which VTK writes as -1.
        cells.face_ends.resize(cells.ends.size() + 1, -1);
        append_vtk_polyhedron(nodes, block.faces(i), sorted, cells.connectivity, cells.faces);
        cells.face_ends.back() = static_cast<int64_t>(cells.faces.size());
        cells.polyhedra = true;
      } else {
        cells.connectivity.insert(cells.connectivity.end(), nodes.begin(), nodes.end());
      }
      cells.ends.push_back(cells.connectivity.size());
      cells.types.push_back(static_cast<std::byte>(type));
    }
  }
  if (cells.polyhedra) cells.face_ends.resize(count, -1);
  return cells;
}

VtkXmlSection section_of(VtuCells cells) {
  VtkXmlSection section{"<Cells>", "</Cells>", {}};
  section.arrays.push_back(vtk_xml_numbers("connectivity", std::span<const uint32_t>(cells.connectivity)));
  section.arrays.push_back(vtk_xml_numbers("offsets", std::span<const uint64_t>(cells.ends)));
  VtkXmlData types;
  types.attributes = "type=\"UInt8\" Name=\"types\"";
  types.owned = std::move(cells.types);
  section.arrays.push_back(std::move(types));
  if (cells.polyhedra) {
    section.arrays.push_back(vtk_xml_numbers("faces", std::span<const uint32_t>(cells.faces)));
    section.arrays.push_back(vtk_xml_numbers("faceoffsets", std::span<const int64_t>(cells.face_ends)));
  }
  return section;
}

void add_blocks(const Mesh& mesh, VtkXmlWriter& xml) {
  const VtkBlocks needed = vtk_needed_blocks(mesh);
  if (needed.empty()) return;
  Array sizes = vtk_block_sizes(needed);
  VtkXmlData blocks;
  blocks.type = sizes.type;
  blocks.components = sizes.components;
  blocks.attributes = "type=\"UInt64\" Name=\"" + sizes.name +
                      "\" NumberOfComponents=\"2\" NumberOfTuples=\"" + std::to_string(sizes.count()) + "\"";
  blocks.owned = std::move(sizes.bytes).vector();
  xml.field().arrays.push_back(std::move(blocks));
  if (vtk_has_names(needed))
    xml.field().arrays.push_back(xml.own_texts(vtk_block_names_name, vtk_block_names(needed)));
}

}  // namespace

std::vector<NamedRun> vtk_block_shapes(const Array& sizes, const std::vector<std::string>& names) {
  std::vector<NamedRun> shapes;
  if (is_float(sizes.type) || sizes.components != 2) return shapes;
  if (!names.empty() && sizes.count() != names.size()) return shapes;
  for (size_t b = 0; b < sizes.count(); ++b) {
    const auto type = static_cast<CellType>(std::min<uint64_t>(integer_at(sizes, 2 * b + 1), 255));
    shapes.push_back({integer_at(sizes, 2 * b), type, names.empty() ? "" : names[b]});
  }
  return shapes;
}

void note_pyramids(uint64_t lagrange, std::vector<std::string>& notes) {
  if (lagrange > 0)
    notes.push_back(counted(lagrange, "Lagrange pyramid") + " written that VTK 9.1 reads, but cannot show");
}

uint64_t count_lagrange_pyramids(const Mesh& mesh) {
  uint64_t count = 0;
  for (const CellBlock& block : mesh.blocks) {
    if (block.type == CellType::lagrange_pyramid) count += block.size();
    count += static_cast<uint64_t>(
        std::count(block.types.begin(), block.types.end(), static_cast<uint8_t>(CellType::lagrange_pyramid)));
  }
  return count;
}

Result<std::vector<std::string>> write_vtu(const Mesh& mesh, Sink& sink, const WriteOptions& options) {
  if (sink.name().ends_with(".pvtu")) {
    return failure(
        ErrorCode::usage,
        sink.name() + ": .pvtu files name the pieces of a mesh, which are not written; write .vtu");
  }
  VtkXmlWriter xml(mesh, sink, options, "VTU");
  xml.write_own_texts_as_bytes();
  xml.add_field_data();
  add_blocks(mesh, xml);
  xml.add_points();
  xml.add_arrays(Domain::point, "PointData");
  xml.add_arrays(Domain::cell, "CellData");
  xml.add_block_names(std::string(" ") + vtu_block_mark + "=\"1\"");
  xml.add(section_of(collect_cells(mesh)));
  MAILLE_CHECK(xml.write("UnstructuredGrid", " NumberOfCells=\"" + std::to_string(mesh.cell_count()) + "\""));
  note_pyramids(count_lagrange_pyramids(mesh), xml.notes);
  return std::move(xml.notes);
}

}  // namespace maille
