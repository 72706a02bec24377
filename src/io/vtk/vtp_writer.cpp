#include <maille/vtk.h>

#include <algorithm>
#include <array>

#include "base/bytes.h"
#include "base/result.h"
#include "io/cells.h"
#include "io/reading.h"
#include "io/vtk/vtk_xml_writer.h"
#include "io/vtk/vtp.h"

namespace maille {
namespace {

enum Kind : size_t { verts, lines, polys, kinds, unknown = kinds };
constexpr const char* kind_elements[kinds] = {"Verts", "Lines", "Polys"};

/// The kind under which cells are written: strips are split into triangles, and pixels turned into quads.
Kind kind_of(CellType type) {
  if (type == CellType::pixel || type == CellType::triangle_strip) return polys;
  const auto kind = vtk_poly_kind(type);
  return kind ? static_cast<Kind>(*kind) : unknown;
}

/// Cells of one kind, in the order written, with their numbers in the mesh, by which arrays follow them.
struct Cells {
  std::vector<uint32_t> connectivity;
  std::vector<uint64_t> ends;
  std::vector<uint64_t> cells;         ///< numbers in the mesh
  std::vector<uint64_t> corner_order;  ///< corners in the mesh
};

class VtpWriter {
 public:
  VtpWriter(const Mesh& mesh, Sink& sink, const WriteOptions& options)
      : mesh_(mesh), xml_(mesh, sink, options, "VTP"), sink_name_(sink.name()) {}

  Result<std::vector<std::string>> write();

 private:
  void collect_cells();
  void add_cell(Kind kind, CellType type, uint64_t cell, uint64_t corner, std::span<const uint32_t> nodes);
  void set_order();
  void add_cells(Kind kind);

  const Mesh& mesh_;
  VtkXmlWriter xml_;
  std::string sink_name_;
  std::array<Cells, kinds> cells_;
  std::vector<uint64_t> cell_order_, corner_order_;
  uint64_t dropped_ = 0;
  bool in_order_ = true;
};

void VtpWriter::add_cell(Kind kind, CellType type, uint64_t cell, uint64_t corner,
                         std::span<const uint32_t> nodes) {
  Cells& cells = cells_[kind];
  // A pixel's third and fourth nodes are swapped against a quad's: it counts along the axes, a quad around.
  static constexpr size_t pixel_order[4] = {0, 1, 3, 2};
  for (size_t i = 0; i < nodes.size(); ++i) {
    const size_t k = type == CellType::pixel ? pixel_order[i] : i;
    cells.connectivity.push_back(nodes[k]);
    cells.corner_order.push_back(corner + k);
  }
  cells.ends.push_back(cells.connectivity.size());
  cells.cells.push_back(cell);
}

void VtpWriter::collect_cells() {
  Kind last = verts;
  uint64_t strips = 0;
  for_each_cell(mesh_, [&](CellType type, uint64_t cell, uint64_t corner, std::span<const uint32_t> nodes) {
    const Kind kind = kind_of(type);
    if (kind == unknown) {
      ++dropped_;
      return;
    }
    // While this holds, arrays are written as they are in memory, without a copy.
    in_order_ = in_order_ && kind >= last && type != CellType::pixel && type != CellType::triangle_strip;
    last = kind;
    if (type != CellType::triangle_strip) {
      add_cell(kind, type, cell, corner, nodes);
      return;
    }
    ++strips;
    // Every second triangle of a strip is turned over, so that all are seen from the same side. Each keeps
    // the number of the strip, so values of cells follow.
    for (size_t i = 0; i + 2 < nodes.size(); ++i) {
      const size_t odd = i & 1;
      for (const size_t k : {i, i + 1 + odd, i + 2 - odd}) {
        cells_[polys].connectivity.push_back(nodes[k]);
        cells_[polys].corner_order.push_back(corner + k);
      }
      cells_[polys].ends.push_back(cells_[polys].connectivity.size());
      cells_[polys].cells.push_back(cell);
    }
  });
  if (strips != 0) xml_.notes.push_back(counted(strips, "triangle strip") + " split into triangles");
  if (dropped_ != 0) {
    xml_.notes.push_back(counted(dropped_, "volume or quadratic cell") +
                         " left out: VTP holds vertices, lines and polygons only");
  } else if (!in_order_) {
    xml_.notes.push_back("cells were reordered: VTP has vertices first, then lines, then polygons");
  }
}

// Left empty when nothing moved and nothing was dropped; the arrays are then written without a copy.
void VtpWriter::set_order() {
  if (in_order_ && dropped_ == 0) return;
  for (const Cells& cells : cells_) {
    cell_order_.insert(cell_order_.end(), cells.cells.begin(), cells.cells.end());
    corner_order_.insert(corner_order_.end(), cells.corner_order.begin(), cells.corner_order.end());
  }
  xml_.set_order(cell_order_, corner_order_);
}

void VtpWriter::add_cells(Kind kind) {
  VtkXmlSection section{
      std::string("<") + kind_elements[kind] + ">", std::string("</") + kind_elements[kind] + ">", {}};
  section.arrays.push_back(
      vtk_xml_numbers("connectivity", std::span<const uint32_t>(cells_[kind].connectivity)));
  section.arrays.push_back(vtk_xml_numbers("offsets", std::span<const uint64_t>(cells_[kind].ends)));
  xml_.add(std::move(section));
}

Result<std::vector<std::string>> VtpWriter::write() {
  collect_cells();
  if (dropped_ != 0 && dropped_ == mesh_.cell_count()) {
    return failure(ErrorCode::usage,
                   sink_name_ + ": VTP holds vertices, lines and polygons, but the mesh has none");
  }
  set_order();
  xml_.add_field_data();
  xml_.add_points();
  xml_.add_arrays(Domain::point, "PointData");
  xml_.add_arrays(Domain::cell, "CellData");
  xml_.add_block_names("");
  std::string counts;
  for (const Kind kind : {verts, lines, polys}) {
    add_cells(kind);
    counts += std::string(" NumberOf") + kind_elements[kind] + "=\"" +
              std::to_string(cells_[kind].ends.size()) + "\"";
  }
  MAILLE_CHECK(xml_.write("PolyData", counts + " NumberOfStrips=\"0\""));
  return std::move(xml_.notes);
}

}  // namespace

Result<std::vector<std::string>> write_vtp(const Mesh& mesh, Sink& sink, const WriteOptions& options) {
  return VtpWriter(mesh, sink, options).write();
}

}  // namespace maille
