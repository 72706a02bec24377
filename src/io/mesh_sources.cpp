#include "io/mesh_sources.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "base/result.h"
#include "io/gmsh/gmsh.h"

namespace maille {

namespace {

bool came_in_version_2(const MeshDescription& mesh) {
  return std::any_of(mesh.metadata.begin(), mesh.metadata.end(), [](const auto& entry) {
    return entry.first == gmsh_version_key && entry.second.starts_with("2");
  });
}

}  // namespace

Result<std::unique_ptr<MeshSource>> open_mesh_source(const Source& source, const Limits& limits) {
  // PLY by its first line, Gmsh by its section; what is neither is taken for VTU, whose reader says so if it
  // is not.
  constexpr std::string_view gmsh = "$MeshFormat";
  std::array<char, gmsh.size()> first{};
  if (source.size() >= first.size())
    MAILLE_CHECK(source.read_at(0, std::as_writable_bytes(std::span(first))));
  const bool is_gmsh = std::equal(gmsh.begin(), gmsh.end(), first.begin());
  if (first[0] == 'p' && first[1] == 'l' && first[2] == 'y' && (first[3] == '\n' || first[3] == '\r'))
    return open_ply_source(source, limits);
  return is_gmsh ? open_gmsh_source(source, limits) : open_vtu_source(source, limits);
}

Result<std::unique_ptr<MeshSink>> mesh_sink(const std::string& path, const std::string& format,
                                            const MeshDescription& description,
                                            const MeshSinkOptions& options) {
  if (format == "vtu" && !options.ascii) return vtu_sink(path, description);
  if (format == "msh" && !options.ascii && came_in_version_2(description)) {
    // The sink without temporary files writes version 2.2 only. A mesh that came in another version goes back
    // to it through the spooled sink, as does what needs all to be known first.
    auto sink = gmsh_sink(path, description);
    if (sink || sink.error().code != ErrorCode::unsupported) return sink;
  }
  if (format == "polymesh") return spooled_polymesh_sink(path, description, options);
  if (format == "msh") return spooled_gmsh_sink(path, description, options);
  return failure(ErrorCode::usage, path + ": files of format " + format + " cannot be written in parts");
}

}  // namespace maille
