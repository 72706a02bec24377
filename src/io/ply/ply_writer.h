#pragma once

#include <maille/io.h>

namespace maille {

/// Format::write of PLY. Everything a Mesh with faces and edges holds is written; see ply.h for how.
Result<std::vector<std::string>> write_ply(const Mesh& mesh, Sink& sink, const WriteOptions& options);

}  // namespace maille
