#include "surface/mixed_array.h"

#include <algorithm>
#include <cmath>

#include "base/bytes.h"
#include "base/result.h"
#include "entropy/mixing.h"
#include "surface/anchors.h"
#include "surface/mixed_position_coder.h"

namespace maille {
namespace {

// Points that settings are tried on.
constexpr uint32_t most_trial_points = 4096;

/// Points of the surface near those outside of it.
template <class Code>
std::vector<uint32_t> anchors_of(const PatchElements& elements, Scalar type, std::span<const NumberMap> maps,
                                 std::span<const Code> codes) {
  std::vector<Vector3> known, places;
  for (uint32_t point = 0; point < elements.points; ++point) {
    Vector3 place;
    for (unsigned k = 0; k < 3; ++k) {
      const Code code = codes[size_t{point} * 3 + k];
      const bool curved = maps[k].is_curved();
      place[k] = curved ? maps[k].value_of(type, code) : static_cast<double>(code) * step_of(maps[k]);
      if (!(std::fabs(place[k]) < 1e100)) place[k] = 0;
    }
    (point < elements.surface->point_count ? known : places).push_back(place);
  }
  return find_anchors(known, places);
}

/// Codes all points, the first `most` of them, or those until the stream ends.
template <class Coder, class Code, MixedCoding::Models models>
void code_points(Coder& coder, const PatchElements& elements, Scalar type, std::span<const NumberMap> maps,
                 const MixedCoding& coding, std::span<Code> codes, uint32_t most, Pace* pace) {
  const PatchSurface& surface = *elements.surface;
  MixedPositionCoder<Coder, Code, models> mixed(coder, coding, type, maps, surface, elements.points, codes);
  most = std::min(most, elements.points);
  const auto go_on = [&] { return !coder.exhausted() && (!pace || pace->step()); };
  uint32_t next = 0;
  for (uint32_t vertex = 0; vertex < surface.vertices.size() && next < most; ++vertex) {
    if (surface.point(vertex) != next) continue;  // another fan of a point before
    mixed.code(vertex, next++);
    if (!go_on()) return;
  }
  std::vector<uint32_t> anchors;
  if constexpr (Coder::encoding) {
    if (coding.anchors && next < most)
      anchors = anchors_of(elements, type, maps, std::span<const Code>(codes));
  }
  for (; next < most; ++next) {
    const uint32_t anchor = anchors.empty() ? 0 : anchors[next - surface.point_count];
    mixed.code_other(next, anchor, surface.point_count);
    if (!go_on()) return;
  }
}

/// The same with as many models as the coding says.
template <class Coder, class Code>
void code_with(Coder& coder, const PatchElements& elements, Scalar type, std::span<const NumberMap> maps,
               const MixedCoding& coding, std::span<Code> codes, uint32_t most, Pace* pace) {
  using Models = MixedCoding::Models;
  const auto code = coding.models == Models::experts    ? code_points<Coder, Code, Models::experts>
                    : coding.models == Models::contexts ? code_points<Coder, Code, Models::contexts>
                    : coding.models == Models::matches  ? code_points<Coder, Code, Models::matches>
                                                        : code_points<Coder, Code, Models::dictionary>;
  code(coder, elements, type, maps, coding, codes, most, pace);
}

template <class Code>
std::vector<std::byte> try_coding(const PatchElements& elements, Scalar type, std::span<const NumberMap> maps,
                                  const MixedCoding& coding, std::span<Code> codes, uint32_t most,
                                  Pace* pace) {
  RangeEncoder encoder;
  code_with(encoder, elements, type, maps, coding, codes, most, pace);
  return encoder.finish();
}

/// A unit near the smallest difference of numbers: the smallest step of any map; for floats in order, that of
/// the largest of them.
template <class Code>
double choose_unit(Scalar type, std::span<const NumberMap> maps, std::span<const Code> codes) {
  double unit = INFINITY;
  for (const NumberMap& map : maps) {
    if (!map.is_curved()) unit = std::min(unit, step_of(map));
  }
  if (unit < INFINITY) return unit;
  double largest = 0;
  for (size_t i = 0; i < codes.size(); ++i) {
    const double value = std::fabs(maps[i % 3].value_of(type, codes[i]));
    if (value < 1e30) largest = std::max(largest, value);
  }
  int exponent = 0;
  (void)std::frexp(largest, &exponent);
  return std::ldexp(1.0, std::clamp(exponent, -90, 100) - (type == Scalar::f32 ? 24 : 53));
}

/// Are steps and unit near enough that all arithmetic stays finite?
bool is_sane(std::span<const NumberMap> maps, double unit) {
  if (!(unit > 1e-60 && unit < 1e60)) return false;
  for (const NumberMap& map : maps) {
    if (map.is_curved()) continue;
    const double ratio = step_of(map) / unit;
    if (!(ratio > 1e-12 && ratio < 1e12)) return false;
  }
  return true;
}

/// The coding whose trial is smallest, where what takes longer must save something. Dictionaries pay where
/// the same floats come again, but not where a lattice has made all codes short.
template <class Code>
MixedCoding choose_coding(const PatchElements& elements, Scalar type, std::span<const NumberMap> maps,
                          std::span<Code> codes, int effort) {
  using Models = MixedCoding::Models;
  MixedCoding best;
  best.unit = choose_unit<Code>(type, maps, codes);
  // Those that lines or volumes use have neighbours of their own, in the order of the mesh.
  best.anchors = elements.loose_cells == 0 && elements.surface->point_count > 0;
  double smallest = INFINITY;
  const uint32_t most = std::clamp(elements.points / 8, 1000u, most_trial_points);
  const auto consider = [&](MixedCoding::Centre centre, Models models) {
    MixedCoding trial = best;
    trial.centre = centre;
    trial.models = models;
    const auto bytes = try_coding(elements, type, maps, trial, codes, most, nullptr);
    if (static_cast<double>(bytes.size()) >= smallest) return;
    // What takes longer must save something.
    smallest = static_cast<double>(bytes.size()) * 0.997;
    best = trial;
  };
  // Contexts see nothing where the centre hides the structure, and where there is none, nothing is to be
  // seen.
  consider(MixedCoding::Centre::expected, Models::experts);
  consider(MixedCoding::Centre::best_gate, effort >= 8 ? Models::matches : Models::contexts);
  const bool floats = std::any_of(maps.begin(), maps.end(), [&](const NumberMap& map) {
    return is_float(type) && map.kind != NumberMap::Kind::lattice;
  });
  if (effort >= 9 && floats && best.models == Models::matches) {
    consider(MixedCoding::Centre::best_gate, Models::dictionary);
  }
  return best;
}

}  // namespace

template <class Code>
bool can_mix(Scalar type, std::span<const NumberMap> maps, std::span<const Code> codes) {
  return is_sane(maps, choose_unit<Code>(type, maps, codes));
}

template <class Code>
std::vector<std::byte> encode_mixed(const PatchElements& elements, Scalar type,
                                    std::span<const NumberMap> maps, std::span<Code> codes, int effort,
                                    Pace* pace) {
  const MixedCoding best = choose_coding<Code>(elements, type, maps, codes, effort);
  ByteWriter out;
  out.put(best.centre);
  out.put(best.models);
  out.put(static_cast<uint8_t>(best.anchors));
  out.put(best.unit);
  out.put_bytes(try_coding(elements, type, maps, best, codes, none, pace));
  return out.take();
}

template <class Code>
Result<> decode_mixed(const PatchElements& elements, Scalar type, std::span<const NumberMap> maps,
                      Bytes bytes, std::span<Code> codes, Pace* pace) {
  ByteReader in(bytes);
  MixedCoding coding;
  const auto centre = in.get<uint8_t>();
  coding.centre = static_cast<MixedCoding::Centre>(centre);
  const auto models = in.get<uint8_t>();
  coding.models = static_cast<MixedCoding::Models>(models);
  const auto anchors = in.get<uint8_t>();
  coding.anchors = anchors == 1;
  coding.unit = in.get<double>();
  if (!in.ok() || centre >= MixedCoding::centre_count || models >= MixedCoding::models_count || anchors > 1 ||
      (coding.anchors && elements.surface->point_count == 0) || !is_sane(maps, coding.unit)) {
    return failure(ErrorCode::corrupt, "an array is mixed in an impossible way");
  }
  RangeDecoder decoder(in.get_bytes(in.remaining()));
  code_with(decoder, elements, type, maps, coding, codes, none, pace);
  if (pace && pace->stopped()) return cancelled();
  if (decoder.exhausted()) return failure(ErrorCode::corrupt, "the stream of an array ends early");
  return {};
}

template bool can_mix<int32_t>(Scalar, std::span<const NumberMap>, std::span<const int32_t>);
template bool can_mix<int64_t>(Scalar, std::span<const NumberMap>, std::span<const int64_t>);
template std::vector<std::byte> encode_mixed<int32_t>(const PatchElements&, Scalar,
                                                      std::span<const NumberMap>, std::span<int32_t>, int,
                                                      Pace*);
template std::vector<std::byte> encode_mixed<int64_t>(const PatchElements&, Scalar,
                                                      std::span<const NumberMap>, std::span<int64_t>, int,
                                                      Pace*);
template Result<> decode_mixed<int32_t>(const PatchElements&, Scalar, std::span<const NumberMap>, Bytes,
                                        std::span<int32_t>, Pace*);
template Result<> decode_mixed<int64_t>(const PatchElements&, Scalar, std::span<const NumberMap>, Bytes,
                                        std::span<int64_t>, Pace*);

}  // namespace maille
