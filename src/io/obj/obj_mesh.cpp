#include <algorithm>

#include "io/obj/obj_pass.h"

namespace maille {

// The arrays always come in this order, so that a file read again gives the same mesh.
Mesh ObjPass::take_mesh(std::vector<std::string>& notes) {
  Mesh mesh;
  mesh.metadata = std::move(metadata_);
  note_libraries(mesh, notes);
  take_point_arrays(mesh, notes);
  for (const size_t kind : {size_t{0}, size_t{1}}) take_references(mesh, kind, notes);
  take_labels(mesh);
  take_blocks(mesh);
  if (unknown_lines_ != 0) {
    notes.push_back(counted(unknown_lines_, "line") +
                    " left out that maille does not know, the first is line " +
                    std::to_string(first_unknown_line_) + " (\"" + first_unknown_ + "\")");
  }
  return mesh;
}

void ObjPass::note_libraries(const Mesh& mesh, std::vector<std::string>& notes) {
  const auto names_library = [](const auto& pair) { return pair.first == "mtllib"; };
  const auto first = std::find_if(mesh.metadata.begin(), mesh.metadata.end(), names_library);
  if (first == mesh.metadata.end()) return;
  const auto others = std::count_if(first + 1, mesh.metadata.end(), names_library);
  notes.push_back("not part of the mesh, left out: all of materials but their names; the rest stays in " +
                  first->second +
                  (others == 0 ? "" : " and " + counted(static_cast<uint64_t>(others), "other")));
}

void ObjPass::take_point_arrays(Mesh& mesh, std::vector<std::string>& notes) {
  const uint64_t points = column(ObjArray::position).count();
  mesh.points = column(ObjArray::position).take("position", Domain::point, Role::none);
  for (const ObjArray which : {ObjArray::weight, ObjArray::colour}) {
    NumberColumn& values = column(which);
    if (values.count() == 0) continue;
    const auto i = static_cast<size_t>(which);
    if (values.count() != points)
      notes.push_back(std::string("some vertices have no ") + obj_array_names[i] + "; NaN");
    // Vertices behind the last one with a value have none either.
    values.pad(points);
    mesh.arrays.push_back(values.take(obj_array_names[i], Domain::point, obj_array_roles[i]));
    if (which != ObjArray::colour || !known_.byte_colours || mesh.arrays.back().type != Scalar::f32) continue;
    // The comment "u8" says that these were bytes before they were written as 0 to 1.
    Array bytes = make_array("colour", Domain::point, Scalar::u8, values.components(), Role::colour);
    for (const float value : mesh.arrays.back().values<float>()) {
      const float scaled = std::isfinite(value) ? std::round(value * 255.0f) : 0.0f;
      bytes.bytes.push_back(static_cast<std::byte>(std::clamp(scaled, 0.0f, 255.0f)));
    }
    mesh.arrays.back() = std::move(bytes);
  }
}

/// Texture coordinates (kind 0) or normals (1): on points, corners or the mesh.
void ObjPass::take_references(Mesh& mesh, size_t kind, std::vector<std::string>& notes) {
  const auto array = static_cast<ObjArray>(kind + 1);
  NumberColumn& values = columns_[kind + 1];
  if (values.count() == 0) return;
  bool used = false;
  bool same = values.count() == mesh.point_count();
  for (ObjCells& cells : cells_) {
    used |= !cells.refs[kind].empty();
  }
  for (ObjCells& cells : cells_) {
    if (!used) break;
    // Corners behind the last reference have none; until here the list may be short.
    cells.refs[kind].resize(cells.cells.nodes.size(), no_obj_number);
    same = same && cells.refs[kind] == cells.cells.nodes;
  }
  const char* const name = obj_array_names[kind + 1];
  const bool on_corners = used && (!same || known_.on_corners[static_cast<size_t>(array)]);
  if (on_corners) {
    mesh.arrays.push_back(gather(kind, notes));
  } else {
    if (!used && same && cells_[0].cells.count() != 0) {
      notes.push_back(std::string("no face refers to the ") + name +
                      "s, but there is one per vertex: taken as these");
    }
    mesh.arrays.push_back(values.take(name, same ? Domain::point : Domain::mesh, obj_array_roles[kind + 1]));
    if (!same)
      notes.push_back(std::string("no face refers to the ") + name + "s; kept as an array on the mesh");
  }
}

Array ObjPass::gather(size_t kind, std::vector<std::string>& notes) const {
  const NumberColumn& values = columns_[kind + 1];
  // One tuple of NaN, for the corners without a reference.
  NumberColumn empty(values.components(), values.type() == Scalar::f64);
  empty.pad(1);
  const size_t size = values.tuple_size();
  Array array = make_array(obj_array_names[kind + 1], Domain::corner, values.type(), values.components(),
                           obj_array_roles[kind + 1]);
  // Only for the note: values that no corner refers to are lost.
  std::vector<bool> seen(values.count());
  uint64_t corners = 0;
  for (const ObjCells& cells : cells_) corners += cells.cells.nodes.size();
  array.resize(corners);
  std::byte* to = array.bytes.data();
  uint64_t missing = 0;
  for (const ObjCells& cells : cells_) {
    for (const uint32_t ref : cells.refs[kind]) {
      const bool there = ref != no_obj_number;
      std::memcpy(to, there ? values.bytes().data() + ref * size : empty.bytes().data(), size);
      to += size;
      missing += there ? 0 : 1;
      if (there) seen[ref] = true;
    }
  }
  const auto unused = static_cast<uint64_t>(std::count(seen.begin(), seen.end(), false));
  if (missing != 0) notes.push_back(counted(missing, "corner") + " without " + array.name + "; NaN");
  if (unused != 0) notes.push_back(counted(unused, array.name) + " left out that no corner refers to");
  return array;
}

// Labels were kept as runs, one for each change; here each cell gets its number.
void ObjPass::take_labels(Mesh& mesh) {
  for (size_t kind = 0; kind < obj_label_count; ++kind) {
    if (labels_[kind].names.empty()) continue;
    Array array = make_array(obj_label_names[kind], Domain::cell, Scalar::u32, 1, Role::label);
    uint64_t total = 0;
    for (const ObjCells& cells : cells_) total += cells.cells.count();
    array.resize(total);
    const std::span<uint32_t> values = array.values<uint32_t>();
    uint64_t first = 0;
    for (const ObjCells& cells : cells_) {
      const auto& runs = cells.labels[kind];
      for (size_t i = 0; i < runs.size(); ++i) {
        const uint64_t end = i + 1 < runs.size() ? runs[i + 1].first_cell : cells.cells.count();
        for (uint64_t cell = runs[i].first_cell; cell < end; ++cell) values[first + cell] = runs[i].label;
      }
      first += cells.cells.count();
    }
    array.labels = std::move(labels_[kind].names);
    mesh.arrays.push_back(std::move(array));
  }
}

// Three kinds of statements, "f", "l" and "p", are three lists of cells and so three blocks, whatever order
// they have in the file.
void ObjPass::take_blocks(Mesh& mesh) {
  if (cells_[0].cells.count() != 0) mesh.blocks.push_back(cells_[0].cells.take_faces());
  if (cells_[1].cells.count() != 0)
    mesh.blocks.push_back(cells_[1].cells.take(CellType::line, CellType::poly_line));
  if (cells_[2].cells.count() != 0) {
    mesh.blocks.push_back(cells_[2].cells.take(CellType::vertex, CellType::poly_vertex));
  }
}

}  // namespace maille
