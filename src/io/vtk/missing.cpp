// Stands in for the readers of XML where there is no pugixml, so that all else is built alike.
#include "base/result.h"
#include "io/mesh_sources.h"
#include "io/threemf/threemf.h"
#include "io/vtk/pvd.h"
#include "io/vtk/vtp.h"
#include "io/vtk/vtu.h"
#include "io/xdmf/xdmf.h"

namespace maille {
namespace {

tl::unexpected<Error> no_xml(const std::string& name, const std::string& instead) {
  return failure(ErrorCode::unsupported, name + ": this maille was built without pugixml, which reads XML; " +
                                             instead + ", and read that");
}

tl::unexpected<Error> no_vtk_xml(const std::string& name) {
  return no_xml(name, "write the mesh as .vtk (legacy)");
}

}  // namespace

Result<ReadResult> read_vtp(const Source& source, const ReadOptions&) {
  return no_vtk_xml(source.name());
}
Result<ReadResult> read_vtu(const Source& source, const ReadOptions&) {
  return no_vtk_xml(source.name());
}
Result<std::unique_ptr<MeshSource>> open_vtu_source(const Source& source, const Limits&) {
  return no_vtk_xml(source.name());
}
Result<std::vector<SeriesEntry>> read_pvd(const std::string& path, const Source&) {
  return no_xml(path, "write each step as .vtk (legacy)");
}

Result<ReadResult> read_xdmf(const Source& source, const ReadOptions&) {
  return no_vtk_xml(source.name());
}
Result<ReadResult> read_xdmf_step(const Source& source, const ReadOptions&, uint64_t) {
  return no_vtk_xml(source.name());
}
Result<std::vector<double>> xdmf_times(const Source& source) {
  return no_vtk_xml(source.name());
}

Result<ReadResult> read_threemf(const Source& source, const ReadOptions&) {
  return no_xml(source.name(), "save the model as .obj or .stl");
}

}  // namespace maille
