// The decoder of adaptive fans; their encoder is in fan_connectivity.cpp, what symbols do in fan_machine.h.
#include <memory>
#include <string>

#include "base/bytes.h"
#include "base/pages.h"
#include "base/result.h"
#include "entropy/rans.h"
#include "surface/fans/adaptive_fan_model.h"
#include "surface/fans/adaptive_start.h"

namespace maille {
namespace {

tl::unexpected<Error> corrupt(const char* what) {
  return failure(ErrorCode::corrupt, std::string("topology: ") + what);
}

/// The decoder's side of a FanMachine.
class AdaptiveFanReader {
 public:
  static constexpr bool encoding = false;

  AdaptiveFanReader(Bytes bytes, const AdaptiveFanModel* start)
      : rans(bytes),
        model(start == nullptr ? std::make_unique<AdaptiveFanModel>()
                               : std::make_unique<AdaptiveFanModel>(*start)) {}

  uint32_t number(FanNumber kind, uint32_t, uint32_t = 0) { return model->code_number(rans, kind, 0); }
  unsigned symbol(unsigned context) { return model->code_symbol(rans, context, 0); }

  RansDecoder rans;
  std::unique_ptr<AdaptiveFanModel> model;
};

}  // namespace

Result<FanSurface> decode_adaptive_fans(Bytes bytes, uint32_t triangles, uint32_t most_vertices,
                                        const AdaptiveFanModel* start, AdaptiveFanModel* end) {
  ByteReader in(bytes);
  const uint64_t vertices = in.get_count();
  const Bytes symbols = in.get_bytes(in.remaining());
  // A symbol costs 2^-8 bit at least, and is twelve triangles at most.
  if (!in.ok() || vertices > std::min(most_vertices, most_fan_points) || vertices > 3 * uint64_t{triangles} ||
      triangles / 32768 > bytes.size() + 16) {
    return corrupt("the fans are more than their bytes can hold");
  }
  FanSurface surface;
  const auto count = static_cast<uint32_t>(vertices);
  reserve_pages(surface.corners, size_t{3} * triangles);
  surface.corners.resize(size_t{3} * triangles);
  reserve_pages(surface.references, count);
  surface.references.resize(count);
  surface.kinds.resize(count);
  AdaptiveFanReader reader(symbols, start);
  FanMachine<AdaptiveFanReader> machine(reader, surface, triangles, count);
  while (!machine.done()) {
    if (!machine.prepare()) {
      if (!machine.start()) return corrupt("a component begins with a vertex that is not there");
    } else if (!machine.apply(triangle_patterns[reader.symbol(machine.context())])) {
      return corrupt("a fan that cannot be completed");
    }
    if (reader.rans.exhausted()) return corrupt("the fans end early");
  }
  if (machine.vertices != count) return corrupt("the fans have another number of vertices");
  surface.vertices = count;
  surface.count_valences();
  if (end != nullptr) *end = *reader.model;
  return surface;
}

}  // namespace maille
