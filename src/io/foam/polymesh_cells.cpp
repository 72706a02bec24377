// What OpenFOAM's polyMesh means: cells from faces, patches, where the folder is.
#include <maille/path.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "base/result.h"
#include "io/cell_faces.h"
#include "io/foam/foam_case.h"
#include "io/foam/polymesh.h"

namespace maille {
namespace {

// Of a linear cell: a hexahedron.
constexpr size_t most_faces = 6;
using Corners = std::array<uint32_t, 4>;

/// A triangle or a quad from its least corner on, so that equal faces are equal lists; the fourth of a
/// triangle is no point's number.
Corners from_least(std::span<const uint32_t> face) {
  Corners corners = {0, 0, 0, UINT32_MAX};
  std::copy(face.begin(), face.end(), corners.begin());
  const auto end = corners.begin() + static_cast<ptrdiff_t>(face.size());
  std::rotate(corners.begin(), std::min_element(corners.begin(), end), end);
  return corners;
}

CellType type_of(const FoamFaces& faces) {
  size_t triangles = 0, quads = 0;
  for (const uint32_t size : faces.sizes) {
    if (size != 3 && size != 4) return CellType::polyhedron;
    (size == 3 ? triangles : quads) += 1;
  }
  if (triangles == 4 && quads == 0) return CellType::tetrahedron;
  if (triangles == 0 && quads == 6) return CellType::hexahedron;
  if (triangles == 2 && quads == 3) return CellType::wedge;
  if (triangles == 4 && quads == 1) return CellType::pyramid;
  return CellType::polyhedron;
}

using Faces = std::array<std::span<const uint32_t>, most_faces>;

/// Whether these nodes have exactly the faces that the cell has, with their orientation.
bool has_faces(const FoamCell& cell, const Faces& faces, size_t count) {
  std::array<Corners, most_faces> made{}, given{};
  size_t size = 0;
  const FacesOfSolid& expected = faces_of_linear(cell.type);
  for (unsigned i = 0; i < expected.count; ++i) {
    std::array<uint32_t, 4> face{};
    size_t corners = 0;
    for (const uint8_t place : expected.face(i)) face[corners++] = cell.nodes[place];
    made[size++] = from_least(std::span(face).first(corners));
  }
  for (size_t i = 0; i < count; ++i) given[i] = from_least(faces[i]);
  const auto behind = [&](auto& list, size_t n) { return list.begin() + static_cast<ptrdiff_t>(n); };
  std::sort(made.begin(), behind(made, size));
  std::sort(given.begin(), behind(given, count));
  return size == count && std::equal(made.begin(), behind(made, size), given.begin());
}

// Guesses nodes from one face and the edges that leave it, then compares all faces: so whatever the faces
// are, a cell that is not exactly one of the four stays a polyhedron.
bool make_known_cell(const FoamFaces& all, FoamCell& cell) {
  cell.type = type_of(all);
  if (cell.type == CellType::polyhedron) return false;
  Faces faces;
  for (size_t i = 0, at = 0; i < all.sizes.size(); at += all.sizes[i++])
    faces[i] = std::span(all.corners).subspan(at, all.sizes[i]);
  const size_t count = all.sizes.size();
  // The base is a quad of a pyramid, a triangle of a wedge, any face of others; seen from inside.
  const size_t base_size = cell.type == CellType::pyramid || cell.type == CellType::hexahedron ? 4 : 3;
  size_t base = 0;
  while (faces[base].size() != base_size) ++base;
  cell.nodes.assign(1, faces[base][0]);
  for (size_t i = base_size; i > 1; --i) cell.nodes.push_back(faces[base][i - 1]);
  // VTK's wedge is the exception: its triangle 0 1 2 is seen from outside.
  if (cell.type == CellType::wedge) std::reverse(cell.nodes.begin() + 1, cell.nodes.end());
  const auto in_base = [&](uint32_t point) {
    return std::find(faces[base].begin(), faces[base].end(), point) != faces[base].end();
  };
  const size_t above = nodes_of(cell.type) - base_size;
  for (size_t i = 0; i < above; ++i) {
    // The point beyond the edge that leaves the base here; of an apex, any.
    uint32_t found = UINT32_MAX;
    for (size_t f = 0; f < count && found == UINT32_MAX; ++f) {
      for (size_t k = 0; f != base && k < faces[f].size(); ++k) {
        const uint32_t next = faces[f][(k + 1) % faces[f].size()];
        if (faces[f][k] == cell.nodes[i] && !in_base(next)) found = next;
      }
    }
    if (found == UINT32_MAX) return false;
    cell.nodes.push_back(found);
  }
  return has_faces(cell, faces, count);
}

}  // namespace

void FoamFaces::add(std::span<const uint32_t> face, bool turned) {
  corners.insert(corners.end(), face.begin(), face.end());
  sizes.push_back(static_cast<uint32_t>(face.size()));
  if (turned && !face.empty())
    std::reverse(corners.end() - static_cast<ptrdiff_t>(face.size()) + 1, corners.end());
}

void make_foam_cell(const FoamFaces& faces, FoamCell& cell) {
  if (make_known_cell(faces, cell)) return;
  cell.type = CellType::polyhedron;
  cell.nodes.assign(faces.corners.begin(), faces.corners.end());
}

Result<std::vector<FoamPatch>> read_foam_patches(FoamReader& file) {
  std::vector<FoamPatch> patches;
  bool values = false;
  const uint64_t count = MAILLE_TRY(file.begin_list(values));
  for (uint64_t i = 0; i < count; ++i) {
    FoamPatch patch;
    patch.name = std::string(file.word());
    if (!file.take('{')) return file.malformed("there should be \"{\" behind the name of a patch");
    while (!file.take('}')) {
      if (file.at_end()) return file.malformed("the file ends inside a patch");
      const std::string key(file.word());
      int64_t number = 0;
      if (key == "nFaces" || key == "startFace") {
        if (!file.label(number) || number < 0)
          return file.malformed("there should be a number behind " + key);
        (key == "nFaces" ? patch.faces : patch.first) = static_cast<uint64_t>(number);
      }
      if (key == "type") patch.type = std::string(file.word());
      std::string entry = key;
      for (std::string_view word; !file.at_end() && (word = file.word()) != ";";)
        entry += " " + std::string(word);
      const bool known = key == "type" || key == "nFaces" || key == "startFace";
      if (!known && is_plain_entries(entry)) patch.entries += entry + "; ";
    }
    // A group that OpenFOAM adds by itself.
    const std::string own_group = "inGroups 1 ( " + patch.type + " ); ";
    if (const size_t at = patch.entries.find(own_group); at != std::string::npos)
      patch.entries.erase(at, own_group.size());
    patches.push_back(std::move(patch));
  }
  return patches;
}

bool is_plain_entries(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("_.:+-() ;").find(c) != std::string_view::npos;
  });
}

void add_foam_metadata(const FoamPatch& patch, std::vector<std::pair<std::string, std::string>>& metadata) {
  metadata.emplace_back(foam_patch_prefix + patch.name, patch.type);
  if (!patch.entries.empty()) metadata.emplace_back(foam_entries_prefix + patch.name, patch.entries);
}

std::string foam_folder_of(const std::string& name) {
  namespace fs = std::filesystem;
  const fs::path path = to_path(name);
  const fs::path folder = fs::is_directory(path) ? path : path.parent_path();
  // The folder of a time beside "constant".
  const FoamCasePath place = foam_case_of(name);
  if (place.time) return to_utf8(to_path(place.folder) / "constant" / "polyMesh");
  for (const char* inside : {"constant/polyMesh", "polyMesh"}) {
    if (fs::is_directory(folder / inside)) return to_utf8(folder / inside);
  }
  return folder.empty() ? "." : to_utf8(folder);
}

}  // namespace maille
