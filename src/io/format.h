#pragma once

#include <maille/io.h>

namespace maille {

/// One foreign format: what `read_mesh` and `write_mesh` choose from. Each lives in its own folder and is
/// listed in formats.cpp, once. What `read` returns is checked by validate() in formats.cpp; on any bytes it
/// must neither crash nor hang nor allocate beyond the limits. `write` gets a valid mesh, returns notes on
/// what the format cannot hold, and does not commit the sink.
struct Format {
  FormatInfo info;
  /// Whether these first bytes (up to 512, unpacked) look like this format. May be null: by extension only.
  bool (*recognise)(Bytes first_bytes);
  Result<ReadResult> (*read)(const Source& source, const ReadOptions& options);
  Result<std::vector<std::string>> (*write)(const Mesh& mesh, Sink& sink, const WriteOptions& options);
};

const Format& ply_format();
const Format& obj_format();
const Format& off_format();
const Format& stl_format();
const Format& glb_format();
const Format& gltf_format();
const Format& vrml_format();
const Format& vtp_format();
const Format& vtu_format();
const Format& vtk_legacy_format();
const Format& medit_format();
const Format& meditb_format();
const Format& gmsh_format();
const Format& su2_format();
const Format& hedra_format();
const Format& polymesh_format();
const Format& exodus_format();
const Format& vtkhdf_format();
const Format& b3dm_format();
const Format& mz3_format();
const Format& threemf_format();
const Format& ensight_format();
const Format& cgns_format();
const Format& xdmf_format();

}  // namespace maille
