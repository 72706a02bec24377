#pragma once

#include <maille/io.h>

// What reader and writer of OBJ share.
//
// v    positions; a fourth number "weight", three or four more "colour"
// vt   "texcoord", vn "normal": on points where every corner uses the number of its point, otherwise on
// corners, where
//      NaN stands for a corner without one; on the mesh where no corner uses them
// o g usemtl s   labels "object", "group", "material", "smoothing" on cells
// mtllib, #      metadata "mtllib", "comment"
//
// Numbers are f32 unless the text of one of them says more than a float does, see numbers.h. What this cannot
// tell is said in a comment "# maille WORD NAME...", where WORD is "f64" (these arrays are doubles whatever
// their text), "corners" (these are on corners although points would do) or "u8" (stored as 0..1, were
// 0..255).

namespace maille {

// Positions, texture coordinates and normals come first and in this order: ObjPass counts on it.
enum class ObjArray : uint8_t { position, texcoord, normal, colour, weight };
inline constexpr size_t obj_array_count = 5;
inline constexpr const char* obj_array_names[obj_array_count] = {"position", "texcoord", "normal", "colour",
                                                                 "weight"};
inline constexpr Role obj_array_roles[obj_array_count] = {Role::none, Role::texture_coordinate, Role::normal,
                                                          Role::colour, Role::none};

/// The kinds of labels on cells, and the keywords that set them.
inline constexpr size_t obj_label_count = 4;
inline constexpr const char* obj_label_names[obj_label_count] = {"object", "group", "material", "smoothing"};
inline constexpr const char* obj_label_keywords[obj_label_count] = {"o", "g", "usemtl", "s"};

/// Format::read and Format::write of OBJ.
Result<ReadResult> read_obj(const Source& source, const ReadOptions& options);
Result<std::vector<std::string>> write_obj(const Mesh& mesh, Sink& sink, const WriteOptions& options);

}  // namespace maille
