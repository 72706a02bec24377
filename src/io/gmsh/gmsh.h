#pragma once

#include <maille/io.h>
#include <maille/mesh_source.h>
#include <span>
#include <string>

namespace maille {

/// Reads a .msh file of version 2.x or 4.1, text or binary, whole. Errors: malformed_input with the line or
/// byte, unsupported for other versions.
Result<ReadResult> read_gmsh(const Source& source, const ReadOptions& options);
/// Version 2.2 where the mesh came from a file of version 2, otherwise 4.1.
Result<std::vector<std::string>> write_gmsh(const Mesh& mesh, Sink& sink, const WriteOptions& options);

/// The same of a mesh that is read in parts. Memory: numbers of nodes and elements where they are not 1 to n,
/// and some bytes for each time the type or the group changes.
Result<std::vector<std::string>> write_gmsh(MeshSource& mesh, Sink& sink, const WriteOptions& options);

/// An element type of Gmsh. Node i of the cell is node order[i] of the element; the two are the same where
/// `order` is empty. `order` is therefore the direction of reading: writers place node k of the cell at
/// order[k].
struct GmshType {
  int32_t number;
  CellType type;
  unsigned nodes;
  std::span<const uint8_t> order;
};
/// Null for cells that Gmsh has no element for, and for numbers of elements that are not known here.
const GmshType* gmsh_type(CellType type, size_t nodes);
const GmshType* gmsh_type(int64_t number);

/// The way in which a file with this number in its header is read: 2 or 4. 0 means not at all: versions 1, 3
/// and 4.0 have other sections. The bounds of 4.1 are loose because the number comes from text as a double.
inline int gmsh_version(double number) {
  return number >= 2 && number < 3 ? 2 : number > 4.05 && number < 4.2 ? 4 : 0;
}

// Arrays and metadata that hold what Gmsh knows of elements, so that a file read and written again keeps its
// tags and numbers.
inline constexpr char gmsh_physical_name[] = "gmsh:physical";
inline constexpr char gmsh_geometrical_name[] = "gmsh:geometrical";
inline constexpr char gmsh_node_name[] = "gmsh:node";
inline constexpr char gmsh_element_name[] = "gmsh:element";
inline constexpr char gmsh_version_key[] = "gmsh.version";
inline constexpr char gmsh_periodic_key[] = "gmsh.periodic";
/// "gmsh.physical.DIMENSION.TAG": the name of a physical group.
inline constexpr char gmsh_names_prefix[] = "gmsh.physical.";

/// A name for a line of its own in a file: line ends inside it become blanks.
std::string gmsh_name(std::string text);

}  // namespace maille
