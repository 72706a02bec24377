#pragma once

#include <maille/io.h>

namespace maille {

/// Format::write of PLY. Everything a Mesh with faces and edges holds is written; see ply.h for how. Other
/// cells, names of blocks and (in text) payloads of NaN are left out with a note. Errors: usage, for meshes
/// without faces and edges and for too many properties; those of the sink, which is not committed.
Result<std::vector<std::string>> write_ply(const Mesh& mesh, Sink& sink, const WriteOptions& options);

}  // namespace maille
