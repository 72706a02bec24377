#pragma once

#include <maille/folder.h>
#include <maille/mesh_source.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "io/buffered_writer.h"
#include "io/foam/foam_field.h"
#include "io/foam/foam_runs.h"
#include "io/foam/polymesh.h"
#include "io/foam/polymesh_faces.h"

namespace maille {

/// What stands where in a polyMesh that was written: fields follow the order of cells and faces in the files,
/// not that of the mesh.
struct FoamWritten {
  uint64_t points = 0, inner = 0;
  FoamRuns cells;  ///< of a volume cell: its place among all cells of the mesh
  FoamRuns faces;  ///< of the n-th cell that is a face: the same
  std::vector<FoamPatch> patches;
  /// Calls f for every face, in the order of the files.
  std::function<Result<>(const std::function<Result<>(const FoamFaceTable::Face&)>&)> visit;
};

/// Writes fields of times behind a polyMesh: those of which metadata has the text.
class FoamFieldWriter {
 public:
  FoamFieldWriter(const FoamWritten& written, FolderSink& sink, bool ascii)
      : written_(written), sink_(sink), out_(sink), ascii_(ascii) {}

  /// Fields and texts of the time that `values` says it is of; those of the case with the first. Its points
  /// and cells are those of the mesh that was written. Errors: write_failed, those of `values`.
  Result<> write_time(MeshSource& values);
  /// What could not be written, and what has code in it. Empties the lists.
  std::vector<std::string> take_notes();

 private:
  struct Field;
  class Window;

  Result<> write_field(MeshSource& values, const std::string& name, const std::string& text);
  Result<> write_text(const std::string& path, const std::string& text);
  bool has_all_arrays(Field& field) const;
  Result<> put_field(Field& field);
  Result<> put_values(Field& field, const FoamValues& list);
  Result<> put_uniform(Field& field, const FoamValues& value);
  Result<> put_list(Field& field, const FoamValues& list, Window& values, int digits);
  Result<> for_each_value(const Field& field, const FoamValues& list, Window& values,
                          const std::function<Result<>(const std::byte*)>& f);
  Result<> find_patch_cells();
  const FoamPatch* patch(const std::string& name) const;
  uint64_t count_of(const Field& field, const FoamValues& list) const;
  void put_value(const Field& field, const std::byte* value, uint32_t components, int digits);
  void note_code(const std::string& path, const std::string& directive);

  const FoamWritten& written_;
  FolderSink& sink_;
  BufferedWriter out_;
  bool ascii_;
  std::string time_, banner_;
  std::vector<std::string> times_;
  static constexpr uint64_t no_cell = ~uint64_t{0};
  std::vector<uint64_t> patch_cells_;  ///< of each face of a patch, in the order of the files
  bool knows_patches_ = false;
  uint64_t most_owned_ = 0;
  std::vector<std::string> notes_, with_code_, left_;
};

}  // namespace maille
