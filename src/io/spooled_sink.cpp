// Formats whose writers go over the mesh several times: it is spooled to temporary files, and written when
// all is there.
#include <algorithm>

#include "base/result.h"
#include "io/foam/foam_case.h"
#include "io/foam/polymesh.h"
#include "io/foam/polymesh_groups.h"
#include "io/gmsh/gmsh.h"
#include "io/mesh_sources.h"
#include "io/scratch_mesh.h"

namespace maille {
namespace {

/// All that is written goes to a ScratchMesh; commit() writes the file from it. So the target is touched only
/// when the mesh is complete, and an incomplete one is an error of usage.
class SpooledSink : public MeshSink {
 public:
  explicit SpooledSink(std::unique_ptr<ScratchMesh> mesh) : mesh_(std::move(mesh)) {}

  Result<> write_points(uint64_t first, Bytes positions) override {
    return mesh_->write_points(first, positions);
  }
  Result<> write_cells(const CellPiece& cells) override { return mesh_->write_cells(cells); }
  Result<> write_array(size_t array, uint64_t first, Bytes tuples) override {
    return mesh_->write_array(array, first, tuples);
  }
  Result<> commit() final {
    MAILLE_CHECK(mesh_->end());
    notes_ = MAILLE_TRY(write(*mesh_));
    return {};
  }
  std::vector<std::string> notes() const override { return notes_; }

 private:
  /// The file, when all is there; gives the notes.
  virtual Result<std::vector<std::string>> write(MeshSource& mesh) = 0;

  std::unique_ptr<ScratchMesh> mesh_;
  std::vector<std::string> notes_;
};

class SpooledGmshSink final : public SpooledSink {
 public:
  SpooledGmshSink(std::string path, std::unique_ptr<ScratchMesh> mesh, bool ascii)
      : SpooledSink(std::move(mesh)), path_(std::move(path)), ascii_(ascii) {}

 private:
  Result<std::vector<std::string>> write(MeshSource& mesh) override {
    const auto sink = MAILLE_TRY(file_sink(path_));
    WriteOptions options;
    options.ascii = ascii_;
    std::vector<std::string> notes = MAILLE_TRY(write_gmsh(mesh, *sink, options));
    MAILLE_CHECK(sink->commit());
    return notes;
  }

  std::string path_;
  bool ascii_;
};

/// Without the values that a case of OpenFOAM does not hold: unless the mesh came with fields of OpenFOAM,
/// only the arrays that say what patch or zone an element is in are spooled.
class PolyMeshSink final : public SpooledSink {
 public:
  PolyMeshSink(std::unique_ptr<FolderSink> sink, std::unique_ptr<ScratchMesh> mesh,
               const MeshDescription& description, const MeshSinkOptions& options)
      : SpooledSink(std::move(mesh)), sink_(std::move(sink)), description_(description), options_(options) {}

  Result<> write_array(size_t array, uint64_t first, Bytes tuples) override {
    const auto& metadata = description_.metadata;
    const bool has_fields = std::any_of(metadata.begin(), metadata.end(), [](const auto& entry) {
      return entry.first.starts_with(foam_field_prefix);
    });
    return has_fields || is_foam_group_array(description_.arrays[array])
               ? SpooledSink::write_array(array, first, tuples)
               : Result<>();
  }

 private:
  Result<std::vector<std::string>> write(MeshSource& mesh) override {
    std::vector<std::string> notes =
        MAILLE_TRY(write_polymesh(mesh, *sink_, options_.ascii, options_.memory, options_.folder));
    MAILLE_CHECK(sink_->commit());
    return notes;
  }

  std::unique_ptr<FolderSink> sink_;
  MeshDescription description_;
  MeshSinkOptions options_;
};

}  // namespace

Result<std::unique_ptr<MeshSink>> spooled_gmsh_sink(const std::string& path,
                                                    const MeshDescription& description,
                                                    const MeshSinkOptions& options) {
  for (const Array& array : description.arrays) {
    if (array.name == gmsh_node_name || array.name == gmsh_element_name)
      return failure(ErrorCode::unsupported,
                     path + ": numbers of nodes and elements cannot be written in parts");
  }
  if (description.points > max_points)
    return failure(ErrorCode::unsupported, path + ": more than 2^32 points cannot be written in this format");
  auto mesh = MAILLE_TRY(ScratchMesh::create(description, options.folder));
  return std::unique_ptr<MeshSink>(std::make_unique<SpooledGmshSink>(path, std::move(mesh), options.ascii));
}

Result<std::unique_ptr<MeshSink>> spooled_polymesh_sink(const std::string& path,
                                                        const MeshDescription& description,
                                                        const MeshSinkOptions& options) {
  if (description.points > max_points)
    return failure(ErrorCode::unsupported, path + ": more than 2^32 points cannot be written in this format");
  auto sink = MAILLE_TRY(polymesh_sink(path));
  auto mesh = MAILLE_TRY(ScratchMesh::create(description, options.folder));
  return std::unique_ptr<MeshSink>(
      std::make_unique<PolyMeshSink>(std::move(sink), std::move(mesh), description, options));
}

}  // namespace maille
