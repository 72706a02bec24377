#pragma once

#include <maille/mesh_source.h>

#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "base/scratch_file.h"
#include "io/line_blocks.h"
#include "io/ply/ply.h"

namespace maille {

/// A surface on its way from another format: a binary PLY file in temporary files, of rows as they come. Text
/// in the header stays in memory.
struct ConvertedSurface {
  static Result<ConvertedSurface> create(const std::string& folder) {
    ScratchFile points = MAILLE_TRY(ScratchFile::create(folder));
    ScratchFile faces = MAILLE_TRY(ScratchFile::create(folder));
    return ConvertedSurface{{}, std::move(points), std::move(faces), {}};
  }

  PlyHeader header;  ///< vertex, then face; counts as they are in the end
  ScratchFile points, faces;
  std::vector<std::string> notes;
};

/// As MeshSource has it. `name`: of the file that it comes from.
Result<std::unique_ptr<MeshSource>> open_converted(ConvertedSurface surface, const std::string& name);

// Conversions by format. Error: unsupported, for what only read_mesh() knows.
Result<ConvertedSurface> convert_ply_text(const Source& source, const PartsOptions& options);
Result<ConvertedSurface> convert_stl(const Source& source, const PartsOptions& options);
Result<ConvertedSurface> convert_obj(const Source& source, const PartsOptions& options);

inline tl::unexpected<Error> not_in_parts(const Source& source, const std::string& what) {
  return failure(ErrorCode::unsupported, source.name() + ": " + what + " cannot be read in parts");
}

/// A number as it is in memory, at the end of a row.
template <class T>
void put_number(std::vector<std::byte>& row, T number) {
  row.resize(row.size() + sizeof number);
  std::memcpy(row.data() + row.size() - sizeof number, &number, sizeof number);
}

}  // namespace maille
