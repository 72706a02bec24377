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
/// in the header stays in memory. Formats that are not read in parts by themselves (text, welded points) are
/// converted once, front to back, and are read like any PLY afterwards: one reader in parts serves them all.
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

/// The surface as a MeshSource that owns the temporary files. `name`: of the file that it comes from, for
/// messages.
Result<std::unique_ptr<MeshSource>> open_converted(ConvertedSurface surface, const std::string& name);

// Conversions by format, front to back, with memory for the header and for what `options` allows. Error:
// unsupported, for what only read_mesh() knows, so that callers can try that.
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
