#pragma once

#include <maille/executor.h>
#include <maille/limits.h>
#include <maille/mesh.h>
#include <maille/source.h>
#include <string>
#include <vector>

namespace maille {

/// File formats that can be read and written, by name: "ply", "obj", "off", "stl", "glb", "gltf", "wrl",
/// "vtp" for surfaces; "vtu", "vtk", "msh", "mesh", "meshb", "su2", "hedra", "polymesh", "exodus",
/// "vtkhdf", "cgns", "xdmf", "ensight" for volumes, too.
struct FormatInfo {
  std::string name;                     ///< as in --input-format
  std::vector<std::string> extensions;  ///< ".ply", ...; a ".gz" behind them is handled where `gzip` says so
  std::string description;              ///< one line for help texts
  bool gzip = false;
  bool writable = true;
};
const std::vector<FormatInfo>& formats();

/// Name of the format of a path by its extension ("dragon.ply.gz" -> "ply"), or of a file by its first bytes
/// where the extension says nothing. Error: usage, listing what is known.
[[nodiscard]] Result<std::string> format_of(const std::string& path);
/// The same of what is open already, such as a pipe, by its name and bytes.
[[nodiscard]] Result<std::string> format_of(const Source& source);

struct ReadOptions {
  std::string format;  ///< empty: by extension, then by first bytes
  Limits limits;
  Progress progress;
};

struct ReadResult {
  Mesh mesh;
  /// What a user should know: points welded, an element skipped, indices out of date. Not errors.
  std::vector<std::string> notes;
  /// Paths of the other files that it names and whose values were read: buffers of a .gltf, values of XDMF
  /// and EnSight, pieces of a .pvtu. Those of a folder (polyMesh) are not among them.
  std::vector<std::string> files_beside = {};
};

/// Reads a mesh from a foreign format. Safe on any input: a mesh for which validate() holds, or
/// malformed_input naming file, line or byte, element, what was found. Memory is bounded by what the file
/// really holds, never by what a header claims.
[[nodiscard]] Result<ReadResult> read_mesh(const std::string& path, const ReadOptions& options = {});
[[nodiscard]] Result<ReadResult> read_mesh(const Source& source, const ReadOptions& options);

struct WriteOptions {
  std::string format;  ///< empty: by the sink's name
  bool ascii = false;  ///< text instead of binary, where the format has both
  bool big_endian = false;
};

/// Writes a mesh in a foreign format. What the format cannot hold is named in the notes returned, never
/// dropped silently. Does not commit the sink. Errors: usage, where nothing sensible can be written;
/// malformed_input (the mesh); unsupported; write_failed.
[[nodiscard]] Result<std::vector<std::string>> write_mesh(const Mesh& mesh, Sink& sink,
                                                          const WriteOptions& options);
/// The same into a file, or a folder of the format "polymesh", which appears whole or not at all. Also
/// cannot_read and write_failed, with the system's reason.
[[nodiscard]] Result<std::vector<std::string>> write_mesh(const Mesh& mesh, const std::string& path,
                                                          const WriteOptions& options = {});

}  // namespace maille
