// Arrays as files of HDF5 and netCDF-4 have them, with the filters that users switch on. The files stay in
// memory.
#include <hdf5.h>
#include <netcdf.h>
#include <netcdf_mem.h>
#include <unistd.h>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include "array_codec.h"

namespace maille::bench {
namespace {

using Buffer = std::vector<std::byte>;
constexpr int deflate_level = 6;
constexpr hsize_t chunk_numbers = 1 << 16;

hid_t hdf5_type(Scalar type) {
  switch (type) {
    case Scalar::i8:
      return H5T_NATIVE_INT8;
    case Scalar::u8:
      return H5T_NATIVE_UINT8;
    case Scalar::i16:
      return H5T_NATIVE_INT16;
    case Scalar::u16:
      return H5T_NATIVE_UINT16;
    case Scalar::i32:
      return H5T_NATIVE_INT32;
    case Scalar::u32:
      return H5T_NATIVE_UINT32;
    case Scalar::i64:
      return H5T_NATIVE_INT64;
    case Scalar::u64:
      return H5T_NATIVE_UINT64;
    case Scalar::f32:
      return H5T_NATIVE_FLOAT;
    case Scalar::f64:
      return H5T_NATIVE_DOUBLE;
  }
  return H5T_NATIVE_UINT8;
}

/// VTKHDF with shuffle and gzip.
class Hdf5 final : public ArrayCodec {
 public:
  std::string name() const override { return "VTKHDF shuffle+gzip"; }
  bool as_vtk() const override { return true; }

  Result<Buffer> pack(const Part& part) const override {
    const hid_t access = in_memory();
    const hid_t file = H5Fcreate("part", H5F_ACC_TRUNC, H5P_DEFAULT, access);
    const hsize_t dims[2] = {part.tuples(), part.components};
    const hsize_t chunk[2] = {
        std::clamp<hsize_t>(chunk_numbers / part.components, 1, std::max<hsize_t>(dims[0], 1)),
        part.components};
    const hid_t space = H5Screate_simple(2, dims, nullptr), create = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(create, 2, chunk);
    H5Pset_shuffle(create);
    H5Pset_deflate(create, deflate_level);
    const hid_t set = H5Dcreate2(file, "part", hdf5_type(part.type), space, H5P_DEFAULT, create, H5P_DEFAULT);
    const herr_t wrote =
        H5Dwrite(set, hdf5_type(part.type), H5S_ALL, H5S_ALL, H5P_DEFAULT, part.bytes.data());
    H5Dclose(set);
    H5Pclose(create);
    H5Sclose(space);
    H5Fflush(file, H5F_SCOPE_GLOBAL);
    const ssize_t size = H5Fget_file_image(file, nullptr, 0);
    Buffer out(static_cast<size_t>(std::max<ssize_t>(size, 0)));
    H5Fget_file_image(file, out.data(), out.size());
    H5Fclose(file);
    H5Pclose(access);
    if (wrote < 0 || size <= 0) return failure(ErrorCode::write_failed, "HDF5");
    return out;
  }
  Result<Buffer> unpack(Bytes packed, const Part& like) const override {
    const hid_t access = in_memory();
    H5Pset_file_image(access, const_cast<std::byte*>(packed.data()), packed.size());
    const hid_t file = H5Fopen("part", H5F_ACC_RDONLY, access), set = H5Dopen2(file, "part", H5P_DEFAULT);
    Buffer out(like.bytes.size());
    const herr_t read = H5Dread(set, hdf5_type(like.type), H5S_ALL, H5S_ALL, H5P_DEFAULT, out.data());
    H5Dclose(set);
    H5Fclose(file);
    H5Pclose(access);
    if (read < 0) return failure(ErrorCode::corrupt, "HDF5");
    return out;
  }

 private:
  static hid_t in_memory() {
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_fapl_core(access, 1 << 20, 0);
    return access;
  }
};

nc_type netcdf_type(Scalar type) {
  constexpr nc_type types[] = {NC_BYTE, NC_UBYTE, NC_SHORT,  NC_USHORT, NC_INT,
                               NC_UINT, NC_INT64, NC_UINT64, NC_FLOAT,  NC_DOUBLE};
  return types[static_cast<size_t>(type)];
}

/// The layout of Exodus in netCDF-4: indices as rows of cells, values by component, deflate with shuffle.
class NetCdf final : public ArrayCodec {
 public:
  std::string name() const override { return "netCDF-4 shuffle+deflate"; }
  bool takes(const Part& part) const override { return part.tuples() > 0; }

  Result<Buffer> pack(const Part& part) const override {
    int file = 0, rows = 0, columns = 0;
    if (nc_create_mem("part", NC_NETCDF4, 1 << 20, &file) != NC_NOERR) return wrong();
    nc_def_dim(file, "rows", part.tuples(), &rows);
    nc_def_dim(file, "columns", part.components, &columns);
    const size_t size = size_of(part.type);
    const bool split = part.holds != Part::Holds::connectivity;
    Buffer row(part.tuples() * size);
    bool ok = true;
    for (size_t c = 0; c < (split ? part.components : 1); ++c) {
      int variable = 0;
      const int dims[2] = {rows, columns};
      const size_t chunk[2] = {
          std::clamp<size_t>(chunk_numbers / (split ? 1 : part.components), 1, part.tuples()),
          part.components};
      nc_def_var(file, ("v" + std::to_string(c)).c_str(), netcdf_type(part.type), split ? 1 : 2, dims,
                 &variable);
      nc_def_var_chunking(file, variable, NC_CHUNKED, chunk);
      nc_def_var_deflate(file, variable, 1, 1, deflate_level);
      for (size_t i = 0; split && i < part.tuples(); ++i)
        std::memcpy(row.data() + i * size, part.bytes.data() + (i * part.components + c) * size, size);
      ok = ok && nc_put_var(file, variable, split ? row.data() : part.bytes.data()) == NC_NOERR;
    }
    NC_memio memory{};
    ok = nc_close_memio(file, &memory) == NC_NOERR && ok;
    const auto* bytes = static_cast<const std::byte*>(memory.memory);
    Buffer out(bytes, bytes + memory.size);
    std::free(memory.memory);
    if (!ok) return wrong();
    return out;
  }
  Result<Buffer> unpack(Bytes packed, const Part& like) const override {
    int file = 0;
    if (nc_open_mem("part", NC_NOWRITE, packed.size(), const_cast<std::byte*>(packed.data()), &file) !=
        NC_NOERR)
      return wrong();
    const size_t size = size_of(like.type);
    const bool split = like.holds != Part::Holds::connectivity;
    Buffer out(like.bytes.size()), row(like.tuples() * size);
    bool ok = true;
    for (size_t c = 0; c < (split ? like.components : 1); ++c) {
      int variable = 0;
      ok = ok && nc_inq_varid(file, ("v" + std::to_string(c)).c_str(), &variable) == NC_NOERR &&
           nc_get_var(file, variable, split ? row.data() : out.data()) == NC_NOERR;
      for (size_t i = 0; split && i < like.tuples(); ++i)
        std::memcpy(out.data() + (i * like.components + c) * size, row.data() + i * size, size);
    }
    nc_close(file);
    if (!ok) return wrong();
    return out;
  }

 private:
  static tl::unexpected<Error> wrong() { return failure(ErrorCode::corrupt, "netCDF"); }
};

}  // namespace

void add_file_codecs(ArrayCodecs& codecs) {
  codecs.push_back(std::make_unique<Hdf5>());
  codecs.push_back(std::make_unique<NetCdf>());
}

}  // namespace maille::bench
