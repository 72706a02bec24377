#pragma once

#include <maille/source.h>

#include <memory>
#include <string>

namespace maille {

/// For formats that are a folder of files: what is written stands in the file that was begun last.
class FolderSink : public Sink {
 public:
  /// Error: write_failed.
  virtual Result<> begin_file(const std::string& name) = 0;
};

/// Where the format "polymesh" is written: a path that ends in "polyMesh" is that folder, any other one a
/// case, with the mesh in its constant/polyMesh; a file "x.foam" stands for the case it lies in. read_mesh()
/// of the same path finds it.
std::string polymesh_folder(const std::string& path);
/// The sink for write_mesh() of the format "polymesh". The folder appears whole or not at all: it is written
/// to a temporary one beside it, which takes its place at commit(). Of an older one the mesh's files and
/// zones are replaced, what else is in it stays. Error: write_failed, with the system's reason.
Result<std::unique_ptr<FolderSink>> polymesh_sink(const std::string& path);

}  // namespace maille
