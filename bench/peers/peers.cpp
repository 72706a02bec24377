#include "peers.h"

namespace maille::bench {

std::vector<Peer> peers() {
  std::vector<Peer> all;
  const auto add = [&all](const char* name, const char* packages, std::unique_ptr<Codec> codec = {}) {
    all.push_back({name, packages, std::move(codec)});
  };
#ifdef MAILLE_HAS_DRACO
  add("draco -cl 10", "libdraco-dev", draco_codec(0));
  add("draco -cl 7", "libdraco-dev", draco_codec(3));
#else
  add("draco -cl 10", "libdraco-dev");
  add("draco -cl 7", "libdraco-dev");
#endif
#ifdef MAILLE_HAS_MESHOPTIMIZER
  add("meshopt + zstd -19", "libmeshoptimizer-dev libzstd-dev", meshoptimizer_codec());
#else
  add("meshopt + zstd -19", "libmeshoptimizer-dev libzstd-dev");
#endif
#ifdef MAILLE_HAS_OPENCTM
  add("openctm", "libopenctm-dev", openctm_codec());
#else
  add("openctm", "libopenctm-dev");
#endif
#ifdef MAILLE_HAS_LZMA
  add("xz -9", "liblzma-dev", xz_codec());
#else
  add("xz -9", "liblzma-dev");
#endif
  return all;
}

}  // namespace maille::bench
