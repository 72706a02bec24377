#pragma once

#include <hdf5.h>

namespace maille {

/// The library of The HDF Group, which is loaded when the first file is opened: with the libraries behind it
/// (Debian's asks for libcurl and all of its own) it would cost every command some megabytes. The headers
/// give the types only, so macros that call the library (H5F_ACC_RDONLY, H5T_NATIVE_INT, ...) must not be
/// used.
struct Hdf5Library {
  decltype(&::H5open) open = nullptr;
  decltype(&::H5PLset_loading_state) pl_set_loading_state = nullptr;
  decltype(&::H5free_memory) free_memory = nullptr;
  decltype(&::H5Eset_auto2) e_set_auto = nullptr;
  decltype(&::H5FDregister) fd_register = nullptr;
  decltype(&::H5Pcreate) p_create = nullptr;
  decltype(&::H5Pclose) p_close = nullptr;
  decltype(&::H5Pset_driver) p_set_driver = nullptr;
  decltype(&::H5Pget_driver_info) p_get_driver_info = nullptr;
  decltype(&::H5Pget_layout) p_get_layout = nullptr;
  decltype(&::H5Pget_chunk) p_get_chunk = nullptr;
  decltype(&::H5Pget_nfilters) p_get_nfilters = nullptr;
  decltype(&::H5Pget_external_count) p_get_external_count = nullptr;
  decltype(&::H5Fopen) f_open = nullptr;
  decltype(&::H5Oopen) o_open = nullptr;
  decltype(&::H5Oclose) o_close = nullptr;
  decltype(&::H5Iget_type) i_get_type = nullptr;
  decltype(&::H5Gget_info) g_get_info = nullptr;
  decltype(&::H5Lget_name_by_idx) l_get_name_by_idx = nullptr;
  decltype(&::H5Aexists) a_exists = nullptr;
  decltype(&::H5Aopen) a_open = nullptr;
  decltype(&::H5Aclose) a_close = nullptr;
  decltype(&::H5Aget_type) a_get_type = nullptr;
  decltype(&::H5Aget_space) a_get_space = nullptr;
  decltype(&::H5Aread) a_read = nullptr;
  decltype(&::H5Dget_type) d_get_type = nullptr;
  decltype(&::H5Dget_space) d_get_space = nullptr;
  decltype(&::H5Dget_create_plist) d_get_create_plist = nullptr;
  decltype(&::H5Dget_storage_size) d_get_storage_size = nullptr;
  decltype(&::H5Dread) d_read = nullptr;
  decltype(&::H5Screate_simple) s_create_simple = nullptr;
  decltype(&::H5Sclose) s_close = nullptr;
  decltype(&::H5Sget_simple_extent_ndims) s_get_ndims = nullptr;
  decltype(&::H5Sget_simple_extent_dims) s_get_dims = nullptr;
  decltype(&::H5Sget_simple_extent_npoints) s_get_npoints = nullptr;
  decltype(&::H5Sselect_hyperslab) s_select_hyperslab = nullptr;
  decltype(&::H5Tget_class) t_get_class = nullptr;
  decltype(&::H5Tget_size) t_get_size = nullptr;
  decltype(&::H5Tget_sign) t_get_sign = nullptr;
  decltype(&::H5Tget_native_type) t_get_native_type = nullptr;
  decltype(&::H5Tis_variable_str) t_is_variable_str = nullptr;
  decltype(&::H5Tclose) t_close = nullptr;
  /// Of property lists for opening files; has a value once open() was called.
  const hid_t* file_access = nullptr;
};

/// The loaded library, the same for all threads; null where this machine has none. It was not begun (H5open):
/// that is for the process that uses it.
const Hdf5Library* loaded_hdf5();

}  // namespace maille
