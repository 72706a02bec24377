#include "io/notes.h"

#include <algorithm>
#include <cmath>
#include "base/bytes.h"
#include "io/reading.h"

namespace maille {
namespace {

/// NaNs whose bits are not those that reading "nan" or "-nan" gives back. `usual` is the quiet NaN without
/// payload, 0x7fc00000 and 0x7ff8000000000000 of IEEE 754.
template <class T, class Bits>
uint64_t count_payloads(const Array& array, Bits usual) {
  constexpr Bits sign = Bits{1} << (sizeof(Bits) * 8 - 1);
  uint64_t count = 0;
  for (size_t at = 0; at < array.bytes.size(); at += sizeof(T)) {
    const Bits bits = load<Bits>(array.bytes.data() + at);
    if (std::isnan(bits_as<T>(bits)) && (bits & ~sign) != usual) ++count;
  }
  return count;
}

uint64_t count_payloads(const Array& array) {
  if (array.type == Scalar::f32) return count_payloads<float, uint32_t>(array, 0x7fc00000u);
  if (array.type == Scalar::f64) return count_payloads<double, uint64_t>(array, 0x7ff8000000000000u);
  return 0;
}

void note_once(std::string note, std::vector<std::string>& notes) {
  if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(std::move(note));
}

}  // namespace

void note_block_names(const Mesh& mesh, std::vector<std::string>& notes) {
  uint64_t named = 0;
  for (const CellBlock& block : mesh.blocks) named += block.name.empty() ? 0 : 1;
  if (named != 0) notes.push_back("the names of " + counted(named, "block") + " left out");
}

void note_nan_payloads(const Mesh& mesh, std::vector<std::string>& notes) {
  uint64_t count = count_payloads(mesh.points);
  for (const Array& array : mesh.arrays) count += count_payloads(array);
  if (count != 0)
    notes.push_back("text cannot hold the bits of " + counted(count, "NaN") + "; written as nan");
}

void note_array(const Array& array, std::vector<std::string>& notes) {
  const bool whole = array.domain == Domain::mesh;
  const std::string end =
      (whole ? " of the mesh" : std::string(" on ") + name_of(array.domain) + "s") + " left out";
  const std::string name = '"' + array.name + '"';
  for (std::string& note : notes) {
    if (!note.starts_with("array") || !note.ends_with(end)) continue;
    std::string list = note.substr(note.find(' '), note.size() - note.find(' ') - end.size());
    // Chosen, not swept: about ten names; files of scanners have hundreds of arrays.
    if (list.size() < 200) {
      list += ", " + name;
    } else if (!list.ends_with("...")) {
      list += " ...";
    }
    note = "arrays" + list + end;
    return;
  }
  notes.push_back("array " + name + end);
}

void note_metadata(const std::string& key, const std::string& value, std::vector<std::string>& notes) {
  // Programs that print take millimetres where a format does not say.
  if (key == "3mf.unit") {
    if (value != "millimeter") note_once("that lengths are in the unit " + value + " left out", notes);
    return;
  }
  const size_t dot = key.find('.');
  const std::string format = key.substr(0, dot);
  // What readers keep for their own writers (versions, comments, kinds of cells) means nothing to other
  // formats, and a note about it would be noise.
  for (const char* own : {"ply", "obj", "off", "stl", "gltf", "vrml", "vtp", "vtk", "medit", "gmsh", "su2",
                          "exodus", "mz3", "b3dm", "ensight", "cgns"}) {
    if (dot != std::string::npos && format == own) return;
  }
  note_once("metadata \"" + key + "\" left out", notes);
}

}  // namespace maille
