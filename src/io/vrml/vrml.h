#pragma once

#include <maille/io.h>

namespace maille {

// VRML97 (VRML 2.0). IndexedFaceSet, IndexedLineSet and PointSet at any depth become blocks; a Coordinate
// node that is used again shares its points. Transforms are not applied: metadata "vrml.transform.B" holds
// those around block B, outermost first, separated by " / ", and the writer puts them back.
Result<ReadResult> read_vrml(const Source& source, const ReadOptions& options);
Result<std::vector<std::string>> write_vrml(const Mesh& mesh, Sink& sink, const WriteOptions& options);

}  // namespace maille
