// Formats whose writers go over the mesh several times: it is spooled to temporary files, and written when
// all is there.
#include "base/result.h"
#include "io/gmsh.h"
#include "io/mesh_sources.h"
#include "io/scratch_mesh.h"

namespace maille {
namespace {

class SpooledGmshSink final : public MeshSink {
 public:
  SpooledGmshSink(std::string path, std::unique_ptr<ScratchMesh> mesh, bool ascii)
      : path_(std::move(path)), mesh_(std::move(mesh)), ascii_(ascii) {}

  Result<> write_points(uint64_t first, Bytes positions) override {
    return mesh_->write_points(first, positions);
  }
  Result<> write_cells(const CellPiece& cells) override { return mesh_->write_cells(cells); }
  Result<> write_array(size_t array, uint64_t first, Bytes tuples) override {
    return mesh_->write_array(array, first, tuples);
  }
  Result<> commit() override {
    MAILLE_CHECK(mesh_->end());
    const auto sink = MAILLE_TRY(file_sink(path_));
    WriteOptions options;
    options.ascii = ascii_;
    notes_ = MAILLE_TRY(write_gmsh(*mesh_, *sink, options));
    return sink->commit();
  }
  std::vector<std::string> notes() const override { return notes_; }

 private:
  std::string path_;
  std::unique_ptr<ScratchMesh> mesh_;
  bool ascii_;
  std::vector<std::string> notes_;
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

}  // namespace maille
