#include "surface/front/mixed_array.h"

#include <algorithm>
#include <cmath>

#include "base/bytes.h"
#include "base/result.h"
#include "entropy/mixing.h"
#include "surface/front/mixed_position_coder.h"

namespace maille {
namespace {

// Settings are tried on a sixteenth of the points, as each trial takes as long as the coding of these. Up to
// 4,096 points: with fewer invesalius at 12 bits was 14.32 instead of 13.84 bits a vertex, ogre 7.16 instead
// of 7.03 (9073d2d).
constexpr uint32_t least_trial_points = 512;
constexpr uint32_t most_trial_points = 4096;

/// Codes all points, the first `most` of them, or those until the stream ends or `pace` stops. Points come at
/// their first vertices.
template <class Coder, class Code, bool with_repeats>
void code_points(Coder& coder, const PatchElements& elements, const VertexRings& rings, Scalar type,
                 std::span<const NumberMap> maps, const MixedCoding& coding, std::span<Code> codes,
                 uint32_t most, Pace* pace) {
  const PatchSurface& surface = *elements.surface;
  MixedPositionCoder<Coder, Code, with_repeats> mixed(coder, coding, type, maps, surface, rings,
                                                      elements.points, most, codes);
  most = std::min(most, elements.points);
  const auto go_on = [&] { return !coder.exhausted() && (!pace || pace->step()); };
  uint32_t next = 0;
  for (uint32_t vertex = 0; vertex < surface.vertices.size() && next < most; ++vertex) {
    if (surface.point(vertex) != next) continue;  // another fan of a point before
    mixed.code(vertex, next++);
    if (!go_on()) return;
  }
  for (; next < most; ++next) {
    mixed.code_other(next);
    if (!go_on()) return;
  }
}

/// False: what damaged bytes say cannot be.
template <class Coder>
bool code_dictionaries(Coder& coder, MixedCoding& coding) {
  for (Dictionary& dictionary : coding.dictionaries) {
    if (coding.with_dictionaries && !dictionary.code(coder)) return false;
  }
  return true;
}

/// The same with as many models as the coding says.
template <class Coder, class Code>
void code_with(Coder& coder, const PatchElements& elements, const VertexRings& rings, Scalar type,
               std::span<const NumberMap> maps, const MixedCoding& coding, std::span<Code> codes,
               uint32_t most, Pace* pace) {
  const auto code = coding.with_repeats ? code_points<Coder, Code, true> : code_points<Coder, Code, false>;
  code(coder, elements, rings, type, maps, coding, codes, most, pace);
}

template <class Code>
std::vector<std::byte> try_coding(const PatchElements& elements, const VertexRings& rings, Scalar type,
                                  std::span<const NumberMap> maps, MixedCoding& coding, std::span<Code> codes,
                                  uint32_t most, Pace* pace) {
  RangeEncoder encoder;
  code_dictionaries(encoder, coding);
  code_with(encoder, elements, rings, type, maps, coding, codes, most, pace);
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

/// Are steps and unit near enough that all arithmetic stays finite? Both come from the file, so the decoder
/// asks, too; the bounds leave room for squares of codes of 64 bits.
bool is_sane(std::span<const NumberMap> maps, double unit) {
  if (!(unit > 1e-60 && unit < 1e60)) return false;
  for (const NumberMap& map : maps) {
    if (map.is_curved()) continue;
    const double ratio = step_of(map) / unit;
    if (!(ratio > 1e-12 && ratio < 1e12)) return false;
  }
  return true;
}

/// How often there is each code of one axis, ascending.
using Counts = std::vector<std::pair<int64_t, uint32_t>>;
template <class Code>
Counts count_codes(std::span<const Code> codes, unsigned axis) {
  std::vector<Code> all;
  all.reserve(codes.size() / 3);
  for (size_t i = axis; i < codes.size(); i += 3) all.push_back(codes[i]);
  std::sort(all.begin(), all.end());
  Counts counts;
  for (const Code code : all) {
    if (counts.empty() || counts.back().first != code) counts.push_back({code, 0});
    ++counts.back().second;
  }
  return counts;
}

/// Codes that an axis has so often that to know them saves more than it takes: the planes of a voxel lattice
/// or of a machine part. `all`: how many numbers the axis has. Thresholds are tried by powers of two, and the
/// best one is taken: docs/encoder.md has the formula. Its prices, 16 bits an entry and 4 s (1 - s) bits a
/// number, are estimates, not swept.
std::vector<int64_t> find_entries(const Counts& counts, double all) {
  const auto logarithm = [](double x) { return 0.5 * half_octave(x); };
  uint32_t least = 0;
  // A quarter of a bit for each number must be saved, as more repeats take longer to decode.
  double best = 0.25 * all;
  for (uint32_t trial = 4; trial < all; trial *= 2) {
    double covered = 0, entries = 0;
    for (const auto& [code, count] : counts) {
      covered += count < trial ? 0 : count;
      entries += count < trial ? 0 : 1;
    }
    if (entries == 0 || entries > Dictionary::most) continue;
    const double share = covered / all;
    // Entries are told from among fewer codes, but each number must say whether it is one.
    const double saved = covered * logarithm(static_cast<double>(counts.size()) / entries) -
                         all * 4 * share * (1 - share) - 16 * entries;
    if (saved <= best) continue;
    best = saved;
    least = trial;
  }
  std::vector<int64_t> entries;
  for (const auto& [code, count] : counts) {
    if (least > 0 && count >= least) entries.push_back(code);
  }
  const bool fits =
      entries.empty() || static_cast<uint64_t>(entries.back()) - static_cast<uint64_t>(entries.front()) <=
                             Dictionary::most_range;
  return fits ? entries : std::vector<int64_t>();
}

/// Of all axes; false where there are none.
template <class Code>
bool find_dictionaries(std::span<const Code> codes, MixedCoding& coding) {
  for (unsigned k = 0; k < 3; ++k) {
    coding.dictionaries[k].set(find_entries(count_codes(codes, k), static_cast<double>(codes.size()) / 3));
    coding.with_dictionaries = coding.with_dictionaries || coding.dictionaries[k].size() > 0;
  }
  return coding.with_dictionaries;
}

/// The coding whose trial is smallest: centre expected without repeats, best parallelogram with repeats, and
/// the latter with dictionaries.
template <class Code>
MixedCoding choose_coding(const PatchElements& elements, const VertexRings& rings, Scalar type,
                          std::span<const NumberMap> maps, std::span<Code> codes) {
  MixedCoding best;
  best.unit = choose_unit<Code>(type, maps, codes);
  double smallest = INFINITY;
  const uint32_t most = std::clamp(elements.points / 16, least_trial_points, most_trial_points);
  const auto consider = [&](MixedCoding trial) {
    RangeEncoder side;
    code_dictionaries(side, trial);
    const size_t beside = side.finish().size();
    const auto bytes = try_coding(elements, rings, type, maps, trial, codes, most, nullptr);
    const double share = static_cast<double>(most) / std::max(elements.points, 1u);
    const double size = static_cast<double>(bytes.size() - beside) + static_cast<double>(beside) * share;
    if (size >= smallest) return;
    // What takes longer must save .3 %, and comes later here. Chosen, not swept.
    smallest = size * 0.997;
    best = std::move(trial);
  };
  // Trials would not tell: the first points have no image yet.
  best.mirror = find_mirror_plane(std::span<const Code>(codes));
  // Repeats are not seen where the centre hides the structure; where there is none, nothing is to be seen.
  MixedCoding other = best;
  best.centre = MixedCoding::Centre::expected;
  best.with_repeats = false;
  consider(best);
  consider(other);
  if (find_dictionaries<Code>(codes, other)) consider(other);
  return best;
}

}  // namespace

template <class Code>
bool can_mix(Scalar type, std::span<const NumberMap> maps, std::span<const Code> codes) {
  return is_sane(maps, choose_unit<Code>(type, maps, codes));
}

template <class Code>
std::vector<std::byte> encode_mixed(const PatchElements& elements, Scalar type,
                                    std::span<const NumberMap> maps, std::span<Code> codes, Pace* pace) {
  const VertexRings rings(*elements.surface);
  MixedCoding best = choose_coding<Code>(elements, rings, type, maps, codes);
  ByteWriter out;
  out.put(best.centre);
  out.put(static_cast<uint8_t>(best.with_repeats | best.with_dictionaries << 1));
  out.put(static_cast<uint8_t>(best.mirror ? best.mirror->axis + 1 : 0));
  if (best.mirror) out.put(static_cast<uint64_t>(best.mirror->sum));
  out.put(best.unit);
  out.put_bytes(try_coding(elements, rings, type, maps, best, codes, none, pace));
  return out.take();
}

template <class Code>
Result<> decode_mixed(const PatchElements& elements, Scalar type, std::span<const NumberMap> maps,
                      Bytes bytes, std::span<Code> codes, Pace* pace) {
  ByteReader in(bytes);
  MixedCoding coding;
  const auto centre = in.get<uint8_t>();
  coding.centre = static_cast<MixedCoding::Centre>(centre);
  const auto flags = in.get<uint8_t>();
  coding.with_repeats = (flags & 1) != 0;
  coding.with_dictionaries = (flags & 2) != 0;
  const auto mirror = in.get<uint8_t>();
  if (mirror > 0)
    coding.mirror = MirrorPlane{static_cast<uint8_t>(mirror - 1), static_cast<int64_t>(in.get<uint64_t>())};
  coding.unit = in.get<double>();
  // Everything that the loops rely on is refused here: what follows can only be wrong numbers.
  if (!in.ok() || centre >= MixedCoding::centre_count || flags > 3 || mirror > 3 ||
      (coding.mirror && !MirrorImages<Code>::is_sane(*coding.mirror)) ||
      (coding.with_dictionaries && !coding.with_repeats) || !is_sane(maps, coding.unit)) {
    return failure(ErrorCode::corrupt, "an array is mixed in an impossible way");
  }
  RangeDecoder decoder(in.get_bytes(in.remaining()));
  if (!code_dictionaries(decoder, coding))
    return failure(ErrorCode::corrupt, "an array has impossible dictionaries");
  code_with(decoder, elements, VertexRings(*elements.surface), type, maps, coding, codes, none, pace);
  if (pace && pace->stopped()) return cancelled();
  if (decoder.exhausted()) return failure(ErrorCode::corrupt, "the stream of an array ends early");
  return {};
}

template bool can_mix<int32_t>(Scalar, std::span<const NumberMap>, std::span<const int32_t>);
template bool can_mix<int64_t>(Scalar, std::span<const NumberMap>, std::span<const int64_t>);
template std::vector<std::byte> encode_mixed<int32_t>(const PatchElements&, Scalar,
                                                      std::span<const NumberMap>, std::span<int32_t>, Pace*);
template std::vector<std::byte> encode_mixed<int64_t>(const PatchElements&, Scalar,
                                                      std::span<const NumberMap>, std::span<int64_t>, Pace*);
template Result<> decode_mixed<int32_t>(const PatchElements&, Scalar, std::span<const NumberMap>, Bytes,
                                        std::span<int32_t>, Pace*);
template Result<> decode_mixed<int64_t>(const PatchElements&, Scalar, std::span<const NumberMap>, Bytes,
                                        std::span<int64_t>, Pace*);

}  // namespace maille
