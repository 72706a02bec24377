#pragma once

#include <maille/error.h>
#include <maille/source.h>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>
#include "workload.h"

namespace maille::bench {

struct Encoded {
  std::vector<std::byte> bytes;
  std::optional<uint64_t> connectivity;  ///< bytes of it, where the codec can tell
  std::optional<uint64_t> geometry;
};

/// A decoded mesh as the codec gives it; turned into a Surface only after the clock has stopped.
using Decoded = std::function<Surface()>;

class Codec {
 public:
  virtual ~Codec() = default;
  virtual std::string name() const = 0;
  /// False where the codec has nothing for this precision.
  virtual bool takes(int bits) const = 0;
  virtual bool needs_triangles() const { return true; }
  /// False where integers come back only to within half a step.
  virtual bool keeps_lattice() const { return true; }
  virtual Result<Encoded> encode(const Workload& workload) const = 0;
  /// `workload` says what was encoded (counts, precision), for codecs whose bytes do not.
  virtual Result<Decoded> decode(Bytes bytes, const Workload& workload) const = 0;
  /// Bytes of the connectivity found in some other way, not timed.
  virtual std::optional<uint64_t> estimate_connectivity(const Workload&) const { return {}; }
};

std::unique_ptr<Codec> maille_codec(int effort);
/// Speed as draco::Encoder::SetSpeedOptions has it; `draco_encoder -cl N` is speed 10 - N.
std::unique_ptr<Codec> draco_codec(int speed);
std::unique_ptr<Codec> meshoptimizer_codec();
std::unique_ptr<Codec> openctm_codec();
std::unique_ptr<Codec> xz_codec();

}  // namespace maille::bench
