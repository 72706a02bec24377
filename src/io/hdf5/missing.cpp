// Stands in for hdf5_reader.cpp where there are no headers of HDF5, so that all else is built alike.
#include "io/hdf5/hdf5_reader.h"

namespace maille {

Result<std::function<ChildProcess::Answer()>> hdf5_reader(const Source& source) {
  return failure(ErrorCode::unsupported,
                 source.name() +
                     ": this maille was built without HDF5; write the mesh as .vtk (legacy), or "
                     "in a classic format of netCDF (nccopy -k cdf5), and read that");
}

}  // namespace maille
