#pragma once

#include <maille/error.h>
#include <maille/io.h>
#include <maille/mesh.h>
#include <maille/source.h>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace maille {

/// One file of a series in time, or one step of a file that has several.
struct SeriesEntry {
  std::string path;
  double time = 0;
  /// In the file or case, from 0 on; without a value: of a file that may be of another mesh.
  std::optional<uint64_t> step = {};
  /// Each step of such a file (VTKHDF, CGNS, XDMF, EnSight) has points and cells of its own, maybe others.
  bool mesh_may_change = false;
};
/// Whether the name is that of a file that lists a series (.pvd), or may hold one (Exodus, VTKHDF, CGNS,
/// XDMF, EnSight), or of a case of OpenFOAM with folders of times.
bool may_be_series(const std::string& path);
/// The files that a .pvd of ParaView lists, in its order, with their times, which are finite; or the steps of
/// an Exodus, VTKHDF, CGNS, XDMF or EnSight file; or the folders of times of a case of OpenFOAM, by their
/// times. The files are in the list's folder or below: one that names others is refused. Error: cannot_read;
/// malformed_input; unsupported, when one time has several files.
[[nodiscard]] Result<std::vector<SeriesEntry>> read_series(const std::string& path);
/// read_mesh() of the file, with the variables of the step.
[[nodiscard]] Result<ReadResult> read_series_entry(const SeriesEntry& entry, const ReadOptions& options = {});

/// Writes a case of OpenFOAM: a mesh, and its fields at one time after the other.
class CaseWriter {
 public:
  /// Writes the mesh and the fields of its time, as write_mesh() does. `sink`: polymesh_sink(), which the
  /// caller commits; it must outlive the writer. The mesh need not. Errors: those of write_mesh().
  [[nodiscard]] static Result<CaseWriter> begin(const Mesh& mesh, Sink& sink, bool ascii = false);
  CaseWriter(CaseWriter&&) noexcept;
  ~CaseWriter();

  /// The fields of another time: of a mesh with the same points and cells, whose metadata tell the time and
  /// the texts around values, as reading a case gives them. A time that was written is passed over.
  [[nodiscard]] Result<> add(const Mesh& mesh);
  /// What could not be written, as of write_mesh(). Once, behind the last time.
  std::vector<std::string> notes();

 private:
  struct Implementation;
  explicit CaseWriter(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace maille
