#pragma once

#include <maille/io.h>
#include <utility>

// What reading and writing of MEDIT's two forms have in common.
namespace maille {

inline constexpr char medit_reference_name[] = "medit:ref";

/// Keywords and their codes in binary files, as libMeshb numbers them. Code 0 stands for a kind that is not
/// read or written in binary files. The writer takes the first kind of a type: "Pentahedra" is another word
/// for prisms that is only read.
struct MeditCellKind {
  const char* name;
  int32_t code;
  CellType type;
};
inline constexpr MeditCellKind medit_cell_kinds[] = {{"Edges", 5, CellType::line},
                                                     {"Triangles", 6, CellType::triangle},
                                                     {"Quadrilaterals", 7, CellType::quad},
                                                     {"Tetrahedra", 8, CellType::tetrahedron},
                                                     {"Prisms", 9, CellType::wedge},
                                                     {"Hexahedra", 10, CellType::hexahedron},
                                                     {"Pyramids", 49, CellType::pyramid},
                                                     {"Pentahedra", 0, CellType::wedge},
                                                     {"EdgesP2", 0, CellType::quadratic_edge},
                                                     {"TrianglesP2", 0, CellType::quadratic_triangle},
                                                     {"TetrahedraP2", 0, CellType::quadratic_tetrahedron}};

/// Lists of numbers of elements that are special: they become arrays of 0 and 1, as these stay right when
/// cells are sorted or taken away.
struct MeditFlagKind {
  const char* name;
  int32_t code;
  CellType type;  ///< vertex: of points
  const char* array;
};
inline constexpr MeditFlagKind medit_flag_kinds[] = {
    {"Corners", 13, CellType::vertex, "medit:corner"},
    {"RequiredVertices", 15, CellType::vertex, "medit:required"},
    {"Ridges", 14, CellType::line, "medit:ridge"},
    {"RequiredEdges", 16, CellType::line, "medit:required"},
    {"RequiredTriangles", 17, CellType::triangle, "medit:required"},
    {"RequiredQuadrilaterals", 18, CellType::quad, "medit:required"},
};
inline constexpr int32_t medit_dimension = 3, medit_vertices = 4, medit_end = 54;

/// Goes between MEDIT's order of the nodes of a wedge and VTK's, in both directions.
inline void swap_medit_wedge(uint32_t* nodes) {
  std::swap(nodes[1], nodes[2]);
  std::swap(nodes[4], nodes[5]);
}

Result<std::vector<std::string>> write_medit_text(const Mesh& mesh, Sink& sink, const WriteOptions& options);
Result<std::vector<std::string>> write_medit_binary(const Mesh& mesh, Sink& sink,
                                                    const WriteOptions& options);

}  // namespace maille
