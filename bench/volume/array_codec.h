#pragma once

#include <maille/error.h>
#include <memory>
#include <string>
#include <vector>
#include "parts.h"

namespace maille::bench {

/// Something that packs arrays, one by one: what users have for volume meshes today.
class ArrayCodec {
 public:
  virtual ~ArrayCodec() = default;
  virtual std::string name() const = 0;
  /// The layout it is used with.
  virtual bool as_vtk() const { return false; }
  virtual bool takes(const Part&) const { return true; }
  virtual Result<std::vector<std::byte>> pack(const Part& part) const = 0;
  /// `like`: the part that was packed, for type and size only.
  virtual Result<std::vector<std::byte>> unpack(Bytes packed, const Part& like) const = 0;
};

using ArrayCodecs = std::vector<std::unique_ptr<ArrayCodec>>;
void add_general_codecs(ArrayCodecs& codecs);  ///< VTU's zlib and lz4, zstd, xz
void add_float_codecs(ArrayCodecs& codecs);    ///< zfp, fpzip
void add_file_codecs(ArrayCodecs& codecs);     ///< HDF5, netCDF
void add_index_codec(ArrayCodecs& codecs);     ///< indices from indices

}  // namespace maille::bench
