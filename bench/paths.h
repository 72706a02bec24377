#pragma once

#include <string>
#include <vector>

namespace maille::bench {

/// The meshes among these files and in these folders, those of a folder by name.
std::vector<std::string> meshes_in(const std::vector<std::string>& paths);
/// "tri" of build/data/tri/dragon.ply: what means are taken over.
std::string folder_of(const std::string& path);
/// "dragon" of build/data/tri/dragon.ply.gz.
std::string mesh_name(const std::string& path);

}  // namespace maille::bench
