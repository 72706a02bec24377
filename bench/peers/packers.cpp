#include "packers.h"

#ifdef MAILLE_HAS_LZMA
#include <lzma.h>
#endif
#ifdef MAILLE_HAS_ZSTD
#include <zstd.h>
#endif

namespace maille::bench {
namespace {

#ifdef MAILLE_HAS_ZSTD
Result<uint64_t> zstd_size(Bytes bytes) {
  std::vector<std::byte> out(ZSTD_compressBound(bytes.size()));
  const size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 19);
  if (ZSTD_isError(size) != 0) return failure(ErrorCode::unsupported, ZSTD_getErrorName(size));
  return size;
}
#endif

#ifdef MAILLE_HAS_LZMA
Result<uint64_t> xz_size(Bytes bytes) {
  std::vector<uint8_t> out(lzma_stream_buffer_bound(bytes.size()));
  size_t size = 0;
  if (lzma_easy_buffer_encode(9, LZMA_CHECK_CRC32, nullptr, reinterpret_cast<const uint8_t*>(bytes.data()),
                              bytes.size(), out.data(), &size, out.size()) != LZMA_OK) {
    return failure(ErrorCode::unsupported, "liblzma");
  }
  return size;
}
#endif

}  // namespace

std::vector<Packer> packers() {
  return {
#ifdef MAILLE_HAS_ZSTD
      {"zstd -19", zstd_size},
#endif
#ifdef MAILLE_HAS_LZMA
      {"xz -9", xz_size},
#endif
  };
}

}  // namespace maille::bench
