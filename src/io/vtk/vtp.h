#pragma once

#include <maille/io.h>

namespace maille {

// VTK XML PolyData. Cells are in VTK's order verts, lines, polys, strips; cell arrays follow it. What the
// format has no place for is kept so that the reader finds it again and VTK shows it as plain data:
//   metadata                 strings in FieldData
//   arrays of role label     numbers, and a field string array NAME_labels; the attribute maille_role="label"
//   other roles              as active attribute (Normals, TCoords, Tangents, Scalars) or maille_role
//   corner arrays            FieldData with maille_domain="corner"
Result<ReadResult> read_vtp(const Source& source, const ReadOptions& options);
Result<std::vector<std::string>> write_vtp(const Mesh& mesh, Sink& sink, const WriteOptions& options);

}  // namespace maille
