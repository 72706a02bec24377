#include "base/sort_unique.h"
#include "io/threemf/threemf.h"

#include <maille/xml.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/bytes.h"
#include "base/result.h"
#include "io/buffered_writer.h"
#include "io/format.h"
#include "io/notes.h"
#include "io/reading.h"
#include "io/zip.h"

namespace maille {
namespace {

constexpr const char* xml_head = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";

/// Blocks that share points, directly or by others, are one object: cut apart they would no longer be closed.
std::vector<std::vector<size_t>> blocks_by_points(const Mesh& mesh) {
  std::vector<size_t> group(mesh.blocks.size());
  std::iota(group.begin(), group.end(), size_t{0});
  const auto first_of = [&](size_t block) {
    while (group[block] != block) block = group[block] = group[group[block]];
    return block;
  };
  constexpr uint32_t nobody = UINT32_MAX;
  std::vector<uint32_t> owner(mesh.point_count(), nobody);
  for (size_t b = 0; b < mesh.blocks.size(); ++b) {
    for (const uint32_t point : mesh.blocks[b].connectivity) {
      if (owner[point] == nobody) owner[point] = static_cast<uint32_t>(b);
      const size_t one = first_of(owner[point]), other = first_of(b);
      group[std::max(one, other)] = std::min(one, other);
    }
  }
  std::vector<std::vector<size_t>> objects;
  std::vector<size_t> object_of(group.size());
  for (size_t b = 0; b < group.size(); ++b) {
    const size_t first = first_of(b);
    if (first == b) {
      object_of[b] = objects.size();
      objects.emplace_back();
    }
    objects[object_of[first]].push_back(b);
  }
  return objects;
}

class ThreeMfWriter {
 public:
  ThreeMfWriter(const Mesh& mesh, std::vector<std::string>& notes) : mesh_(mesh), notes_(notes) {}

  Result<> plan();
  Result<> write_model(Sink& sink) const;

 private:
  struct Object {
    std::vector<size_t> blocks;
    std::vector<uint32_t> points;  ///< of the mesh, ascending
    uint64_t triangles = 0;
    uint64_t first_cell = 0;  ///< with a triangle
  };
  struct Item {
    size_t object = 0;
    GltfAffine transform;
  };

  Result<> check_cells();
  Result<> check_positions() const;
  void choose_objects();
  void choose_material();
  void note_rest();
  std::string metadata(const char* key) const;
  /// Triangles of a block with the numbers of their cells; polygons become fans.
  template <class Visit>
  void for_each_triangle(size_t block, Visit visit) const;
  void put_materials(BufferedWriter& out) const;
  void put_object(BufferedWriter& out, size_t number) const;
  void put_triangles(BufferedWriter& out, const Object& object, uint32_t usual) const;
  void put_items(BufferedWriter& out) const;

  const Mesh& mesh_;
  std::vector<std::string>& notes_;
  std::vector<uint64_t> first_cell_;  ///< of the blocks
  std::vector<Object> objects_;
  std::vector<Item> items_;
  const Array* material_ = nullptr;
};

template <class Visit>
void ThreeMfWriter::for_each_triangle(size_t b, Visit visit) const {
  const CellBlock& block = mesh_.blocks[b];
  for (uint64_t cell = 0; cell < block.size(); ++cell) {
    const std::span<const uint32_t> nodes = block.cell(cell);
    if (!is_face(block.type_of(cell))) continue;
    for (size_t i = 2; i < nodes.size(); ++i) {
      const std::array<uint32_t, 3> corners = {nodes[0], nodes[i - 1], nodes[i]};
      // The format has no triangles with a point twice, and programs refuse files with one.
      if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0])
        visit(first_cell_[b] + cell, corners);
    }
  }
}

Result<> ThreeMfWriter::check_cells() {
  uint64_t cells = 0, others = 0, polygons = 0, pieces = 0, kept = 0;
  for (size_t b = 0; b < mesh_.blocks.size(); ++b) {
    const CellBlock& block = mesh_.blocks[b];
    first_cell_.push_back(cells);
    cells += block.size();
    for (uint64_t cell = 0; cell < block.size(); ++cell) {
      const size_t size = block.cell(cell).size();
      const bool face = is_face(block.type_of(cell)) && size >= 3;
      others += face ? 0 : 1;
      polygons += face && size > 3 ? 1 : 0;
      pieces += face ? size - 2 : 0;
    }
    for_each_triangle(b, [&](uint64_t, const auto&) { ++kept; });
  }
  if (cells != 0 && others == cells)
    return failure(ErrorCode::usage, "3MF holds triangles, but this mesh has only other cells");
  if (others != 0)
    notes_.push_back(counted(others, "cell") + " that are not faces of 3 corners or more left out");
  if (polygons != 0) notes_.push_back(counted(polygons, "polygon") + " cut into triangles (fans)");
  if (kept != pieces)
    notes_.push_back(counted(pieces - kept, "triangle") +
                     " with a corner twice left out: 3MF does not allow them");
  return {};
}

Result<> ThreeMfWriter::check_positions() const {
  uint64_t bad = 0;
  with_type(mesh_.points.type, [&](auto zero) {
    using T = decltype(zero);
    if constexpr (std::is_floating_point_v<T>) {
      for (const T value : mesh_.points.values<T>()) bad += std::isfinite(value) ? 0 : 1;
    }
  });
  if (bad == 0) return {};
  return failure(ErrorCode::usage, "3MF has no infinite numbers and no NaN, but " +
                                       counted(bad, "coordinate") + " of this mesh is such");
}

void ThreeMfWriter::choose_objects() {
  const auto scene = gltf_scene_of(mesh_);
  for (const std::vector<size_t>& blocks : scene ? scene->meshes : blocks_by_points(mesh_)) {
    Object object;
    object.blocks = blocks;
    for (const size_t b : object.blocks) {
      for_each_triangle(b, [&](uint64_t cell, const auto& corners) {
        if (object.triangles++ == 0) object.first_cell = cell;
        object.points.insert(object.points.end(), corners.begin(), corners.end());
      });
    }
    sort_unique(object.points);
    objects_.push_back(std::move(object));
  }
  if (scene && !scene->instances.empty()) {
    for (const GltfInstance& instance : scene->instances)
      items_.push_back({instance.mesh, instance.transform});
  } else {
    for (size_t i = 0; i < objects_.size(); ++i) items_.push_back({i, {}});
  }
  std::vector<bool> used(mesh_.point_count());
  for (const Object& object : objects_) {
    for (const uint32_t point : object.points) used[point] = true;
  }
  const auto unused = static_cast<uint64_t>(std::count(used.begin(), used.end(), false));
  if (unused != 0) notes_.push_back(counted(unused, "point") + " that no triangle uses left out");
}

void ThreeMfWriter::choose_material() {
  for (const Array& array : mesh_.arrays) {
    bool fits = array.domain == Domain::cell && array.role == Role::label && array.type == Scalar::u32 &&
                array.components == 1 && array.name == "material" && !array.labels.empty();
    if (fits) {
      const auto values = array.values<uint32_t>();
      fits = std::all_of(values.begin(), values.end(), [&](uint32_t v) { return v < array.labels.size(); });
    }
    if (fits && material_ == nullptr) {
      material_ = &array;
    } else {
      note_array(array, notes_);
    }
  }
}

void ThreeMfWriter::note_rest() {
  uint64_t names = 0;
  for (const Object& object : objects_) {
    for (size_t i = 1; i < object.blocks.size(); ++i)
      names += mesh_.blocks[object.blocks[i]].name.empty() ? 0 : 1;
  }
  if (names != 0) notes_.push_back("the names of " + counted(names, "block") + " left out");
  for (const auto& [key, text] : mesh_.metadata) {
    if (!key.starts_with("3mf.")) note_metadata(key, text, notes_);
  }
}

Result<> ThreeMfWriter::plan() {
  MAILLE_CHECK(check_cells());
  MAILLE_CHECK(check_positions());
  choose_objects();
  choose_material();
  note_rest();
  return {};
}

std::string ThreeMfWriter::metadata(const char* key) const {
  for (const auto& [own, text] : mesh_.metadata) {
    if (own == key) return text;
  }
  return {};
}

void ThreeMfWriter::put_materials(BufferedWriter& out) const {
  if (material_ == nullptr) return;
  const std::string colours = metadata("3mf.displaycolor");
  size_t at = 0;
  out.put("  <basematerials id=\"1\">\n");
  for (const std::string& label : material_->labels) {
    const size_t end = std::min(colours.find(' ', at), colours.size());
    std::string colour = from_word(std::string_view(colours).substr(at, end - at));
    if (colour.empty()) colour = "#808080";  // the format wants one
    at = std::min(end + 1, colours.size());
    out.put("   <base name=\"" + xml_escaped(label) + "\" displaycolor=\"" + xml_escaped(colour) + "\"/>\n");
  }
  out.put("  </basematerials>\n");
}

void ThreeMfWriter::put_triangles(BufferedWriter& out, const Object& object, uint32_t usual) const {
  const auto local = [&](uint32_t point) {
    return std::lower_bound(object.points.begin(), object.points.end(), point) - object.points.begin();
  };
  for (const size_t b : object.blocks) {
    for_each_triangle(b, [&](uint64_t cell, const std::array<uint32_t, 3>& corners) {
      out.put("     <triangle");
      for (size_t i = 0; i < 3; ++i) {
        constexpr const char* names[] = {" v1=\"", "\" v2=\"", "\" v3=\""};
        out.put(names[i]);
        out.put_number(local(corners[i]));
      }
      if (material_ != nullptr && material_->values<uint32_t>()[cell] != usual) {
        out.put("\" pid=\"1\" p1=\"");
        out.put_number(material_->values<uint32_t>()[cell]);
      }
      out.put("\"/>\n");
    });
  }
}

void ThreeMfWriter::put_object(BufferedWriter& out, size_t number) const {
  const Object& object = objects_[number];
  out.put("  <object id=\"" + std::to_string(number + 2) + "\" type=\"model\"");
  if (const std::string& name = mesh_.blocks[object.blocks[0]].name; !name.empty())
    out.put(" name=\"" + xml_escaped(name) + "\"");
  uint32_t usual = 0;
  if (material_ != nullptr) {
    usual = material_->values<uint32_t>()[object.first_cell];
    out.put(" pid=\"1\" pindex=\"" + std::to_string(usual) + "\"");
  }
  out.put(">\n   <mesh>\n    <vertices>\n");
  const size_t size = size_of(mesh_.points.type);
  for (const uint32_t point : object.points) {
    for (size_t i = 0; i < 3; ++i) {
      constexpr const char* names[] = {"     <vertex x=\"", "\" y=\"", "\" z=\""};
      out.put(names[i]);
      put_scalar(out, mesh_.points.bytes.data() + (3 * size_t{point} + i) * size, mesh_.points.type);
    }
    out.put("\"/>\n");
  }
  out.put("    </vertices>\n    <triangles>\n");
  put_triangles(out, object, usual);
  out.put("    </triangles>\n   </mesh>\n  </object>\n");
}

void ThreeMfWriter::put_items(BufferedWriter& out) const {
  out.put(" <build>\n");
  for (const Item& item : items_) {
    if (objects_[item.object].triangles == 0) continue;
    out.put("  <item objectid=\"" + std::to_string(item.object + 2) + "\"");
    if (!item.transform.is_identity()) {
      out.put(" transform=\"");
      for (size_t i = 0; i < 12; ++i) {
        if (i != 0) out.put(' ');
        out.put_number(threemf_number(item.transform, i));
      }
      out.put("\"");
    }
    out.put("/>\n");
  }
  out.put(" </build>\n");
}

Result<> ThreeMfWriter::write_model(Sink& sink) const {
  BufferedWriter out(sink);
  const std::string unit = metadata("3mf.unit");
  out.put(std::string(xml_head) + "<model unit=\"" + (unit.empty() ? "millimeter" : xml_escaped(unit)) +
          "\" xml:lang=\"en-US\" xmlns=\"" + threemf_core + "\">\n");
  for (const auto& [key, text] : mesh_.metadata) {
    constexpr std::string_view own = "3mf.metadata.";
    if (!key.starts_with(own)) continue;
    out.put(" <metadata name=\"" + xml_escaped(key.substr(own.size())) + "\">" + xml_escaped(text) +
            "</metadata>\n");
  }
  out.put(" <resources>\n");
  put_materials(out);
  for (size_t i = 0; i < objects_.size(); ++i) {
    if (objects_[i].triangles != 0) put_object(out, i);
  }
  out.put(" </resources>\n");
  put_items(out);
  out.put("</model>\n");
  return out.finish();
}

Result<> put_text(ZipWriter& zip, const char* path, const std::string& text) {
  return zip.add(path, [&](Sink& sink) { return sink.write(std::as_bytes(std::span(text))); });
}

bool recognise_threemf(Bytes bytes) {
  return is_zip(bytes);
}

}  // namespace

Result<std::vector<std::string>> write_threemf(const Mesh& mesh, Sink& sink, const WriteOptions&) {
  std::vector<std::string> notes;
  ThreeMfWriter writer(mesh, notes);
  MAILLE_CHECK(writer.plan());
  ZipWriter zip(sink);
  MAILLE_CHECK(put_text(zip, "[Content_Types].xml",
                        std::string(xml_head) +
                            "<Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">\n"
                            " <Default Extension=\"rels\" "
                            "ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>\n"
                            " <Default Extension=\"model\" "
                            "ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/>\n"
                            "</Types>\n"));
  MAILLE_CHECK(put_text(
      zip, "_rels/.rels",
      std::string(xml_head) +
          "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">\n"
          " <Relationship Target=\"/" +
          threemf_model_path + "\" Id=\"rel0\" Type=\"" + threemf_relation + "\"/>\n</Relationships>\n"));
  MAILLE_CHECK(zip.add(threemf_model_path, [&](Sink& model) { return writer.write_model(model); }));
  MAILLE_CHECK(zip.finish());
  return notes;
}

const Format& threemf_format() {
  static const Format format{{"3mf", {".3mf"}, "3MF, packages for 3D printing", false, true},
                             recognise_threemf,
                             read_threemf,
                             write_threemf};
  return format;
}

}  // namespace maille
