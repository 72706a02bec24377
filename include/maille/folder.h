#pragma once

#include <maille/source.h>

#include <memory>
#include <string>

namespace maille {

/// For formats that are a folder of files: what is written stands in the file that was begun last.
class FolderSink : public Sink {
 public:
  /// Of the folder. Error: write_failed.
  [[nodiscard]] virtual Result<> begin_file(const std::string& name) = 0;
  /// A file elsewhere in a case of OpenFOAM, by its path in it: "0.1/p". False: it is not to be written.
  /// Errors: write_failed; usage, where it is there already.
  [[nodiscard]] virtual Result<bool> begin_case_file(const std::string& path) {
    static_cast<void>(path);
    return false;
  }
};

/// Where the format "polymesh" is written: a path that ends in "polyMesh" is that folder, any other one a
/// case, with the mesh in its constant/polyMesh; a file "x.foam" stands for the case it lies in. read_mesh()
/// of the same path finds it.
std::string polymesh_folder(const std::string& path);
/// The sink for write_mesh() of the format "polymesh". The folder appears whole or not at all: it is written
/// to a temporary one beside it, which takes its place at commit(). Of an older one the mesh's files and
/// zones are replaced, what else is in it stays. Fields of times go to a case, not to a folder "polyMesh"
/// alone; they appear behind the mesh, each file whole. `overwrite`: also where there are fields of the same
/// names and times; files in "constant" and "system" are never replaced. Error: write_failed, with the
/// system's reason.
[[nodiscard]] Result<std::unique_ptr<FolderSink>> polymesh_sink(const std::string& path,
                                                                bool overwrite = true);

}  // namespace maille
