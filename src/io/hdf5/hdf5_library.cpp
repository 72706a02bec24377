#include "io/hdf5/hdf5_library.h"

#include <dlfcn.h>

namespace maille {
namespace {

template <class Symbol>
bool find(void* library, const char* name, Symbol& symbol) {
  symbol = reinterpret_cast<Symbol>(dlsym(library, name));
  return symbol != nullptr;
}

/// All or none: a library that lacks one of these is another one than the headers describe.
bool find_all(void* library, Hdf5Library& h5) {
  return find(library, "H5open", h5.open) && find(library, "H5free_memory", h5.free_memory) &&
         find(library, "H5PLset_loading_state", h5.pl_set_loading_state) &&
         find(library, "H5Eset_auto2", h5.e_set_auto) && find(library, "H5FDregister", h5.fd_register) &&
         find(library, "H5Pcreate", h5.p_create) && find(library, "H5Pclose", h5.p_close) &&
         find(library, "H5Pset_driver", h5.p_set_driver) &&
         find(library, "H5Pget_driver_info", h5.p_get_driver_info) &&
         find(library, "H5Pget_layout", h5.p_get_layout) && find(library, "H5Pget_chunk", h5.p_get_chunk) &&
         find(library, "H5Pget_nfilters", h5.p_get_nfilters) &&
         find(library, "H5Pget_external_count", h5.p_get_external_count) &&
         find(library, "H5Fopen", h5.f_open) && find(library, "H5Oopen", h5.o_open) &&
         find(library, "H5Oclose", h5.o_close) && find(library, "H5Iget_type", h5.i_get_type) &&
         find(library, "H5Gget_info", h5.g_get_info) &&
         find(library, "H5Lget_name_by_idx", h5.l_get_name_by_idx) &&
         find(library, "H5Aexists", h5.a_exists) && find(library, "H5Aopen", h5.a_open) &&
         find(library, "H5Aclose", h5.a_close) && find(library, "H5Aget_type", h5.a_get_type) &&
         find(library, "H5Aget_space", h5.a_get_space) && find(library, "H5Aread", h5.a_read) &&
         find(library, "H5Dget_type", h5.d_get_type) && find(library, "H5Dget_space", h5.d_get_space) &&
         find(library, "H5Dget_create_plist", h5.d_get_create_plist) &&
         find(library, "H5Dget_storage_size", h5.d_get_storage_size) && find(library, "H5Dread", h5.d_read) &&
         find(library, "H5Screate_simple", h5.s_create_simple) && find(library, "H5Sclose", h5.s_close) &&
         find(library, "H5Sget_simple_extent_ndims", h5.s_get_ndims) &&
         find(library, "H5Sget_simple_extent_dims", h5.s_get_dims) &&
         find(library, "H5Sget_simple_extent_npoints", h5.s_get_npoints) &&
         find(library, "H5Sselect_hyperslab", h5.s_select_hyperslab) &&
         find(library, "H5Tget_class", h5.t_get_class) && find(library, "H5Tget_size", h5.t_get_size) &&
         find(library, "H5Tget_sign", h5.t_get_sign) &&
         find(library, "H5Tget_native_type", h5.t_get_native_type) &&
         find(library, "H5Tis_variable_str", h5.t_is_variable_str) && find(library, "H5Tclose", h5.t_close) &&
         find(library, "H5P_CLS_FILE_ACCESS_ID_g", h5.file_access);
}

const Hdf5Library* load() {
  static Hdf5Library h5;
  // The version whose headers these are: its numbers and structures change with the version in its name.
  // Local symbols: another HDF5 in the program (VTK has one) must not be mixed with this one.
  void* library = dlopen(MAILLE_HDF5_LIBRARY, RTLD_NOW | RTLD_LOCAL);
  return library != nullptr && find_all(library, h5) ? &h5 : nullptr;
}

}  // namespace

const Hdf5Library* loaded_hdf5() {
  static const Hdf5Library* const h5 = load();
  return h5;
}

}  // namespace maille
