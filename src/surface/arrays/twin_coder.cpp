#include "surface/arrays/twin_coder.h"

#include <algorithm>
#include <utility>

#include "base/result.h"
#include "entropy/bit_model.h"
#include "entropy/rans.h"
#include "surface/arrays/surface_normals.h"
#include "surface/front/element_walk.h"

namespace maille {
namespace {

/// Codes the twin of each corner, in both directions, wedge by wedge. `known_` says what the encoder knows.
template <class Coder>
class TwinCoder {
 public:
  TwinCoder(Coder& coder, const PatchTopology& topology, std::span<const Vector3> positions)
      : coder_(coder),
        topology_(topology),
        elements_(elements_of(topology, positions)),
        face_of_(faces_of_half_edges(topology.surface, Domain::corner)),
        normals_(elements_, face_of_, NormalWeight::area),
        count_(topology.points) {}

  /// `known`: by corner, any number that corners of one twin share; the decoder has none. The result has gaps
  /// 0. `more` returns false to stop.
  template <class More>
  std::vector<uint32_t> run(std::span<const uint32_t> known, More more) {
    known_ = known;
    numbers_.assign(elements_.corners(), 0);
    ElementWalk walk(elements_, face_of_);
    const auto never = [](uint32_t, uint32_t) { return false; };
    walk.run_wedges(
        never, [&](const CornerPair& pair) { return code_joint(pair); },
        [&](uint32_t corner, const ElementStencil&, const Wedge& wedge) {
          if (!more()) return false;
          const uint32_t number = code_number(point_of(corner), corner);
          numbers_[corner] = number;
          for (const uint32_t other : wedge.corners) numbers_[other] = number;
          return true;
        });
    number_by_point();
    return std::move(numbers_);
  }

 private:
  static PatchElements elements_of(const PatchTopology& topology, std::span<const Vector3> positions) {
    PatchElements elements = topology.elements();
    elements.positions = positions;
    return elements;
  }

  /// Twins have counted from 0 at each point; now all of them are numbered, point by point.
  void number_by_point() {
    uint32_t first = 0;
    for (uint32_t& count : count_) first += std::exchange(count, first);
    for (uint32_t corner = 0; corner < numbers_.size(); ++corner) {
      if (is_real(corner)) numbers_[corner] += count_[point_of(corner)];
    }
  }
  bool is_real(uint32_t corner) const { return corner >= face_of_.size() || face_of_[corner] != none; }

  uint32_t point_of(uint32_t corner) const {
    const HalfEdges& edges = topology_.surface.half_edges;
    if (corner < edges.size()) return topology_.surface.point(edges.origin[corner]);
    return topology_.loose.nodes[corner - edges.size()];
  }

  /// 0: not known yet; 1: joined at the edge's other end; 2: cut there.
  unsigned far_end(const CornerPair& pair) const {
    if (pair.far_corner == none) return 0;
    return numbers_[pair.far_corner] == numbers_[pair.far_next] ? 1 : 2;
  }
  unsigned sharpness(const CornerPair& pair) const {
    const double turn = 1 - normals_.cosine(pair.corner, pair.next);
    return unsigned{turn > 1e-6} + unsigned{turn > 0.01} + unsigned{turn > 0.1} + unsigned{turn > 0.5};
  }
  /// Seams run on, lie at sharp edges, and between blocks: these are the contexts.
  bool code_joint(const CornerPair& pair) {
    const bool other_block =
        topology_.block_of_face(face_of_[pair.corner]) != topology_.block_of_face(face_of_[pair.next]);
    bool joined = false;
    if constexpr (Coder::encoding) joined = known_[pair.corner] == known_[pair.next];
    joined = joined_[other_block][far_end(pair)][sharpness(pair)][history_].code(coder_, joined);
    history_ = (history_ << 1 | unsigned{joined}) & 3;
    return joined;
  }

  /// The number of a twin: the next of its point, or that of one which came up before.
  uint32_t code_number(uint32_t point, uint32_t corner) {
    const uint32_t count = count_[point];
    uint32_t number = count;
    if constexpr (Coder::encoding) number = known_number(known_[corner], count);
    if (count > 0 && !new_[std::min(count, 4U) - 1].code(coder_, number == count)) {
      number = code_old(count, number);
    } else {
      number = count;
      ++count_[point];
    }
    return number;
  }
  /// The encoder's numbers of twins are any; here they become those in which twins come up at their point.
  uint32_t known_number(uint32_t twin, uint32_t next) {
    if (twin >= number_of_.size()) number_of_.resize(size_t{twin} + 1, none);
    if (number_of_[twin] == none) number_of_[twin] = next;
    return number_of_[twin];
  }
  /// A number below `count`, from its highest bit on, with a model for each bit; damaged bytes may give one
  /// beyond, which counts as the last.
  uint32_t code_old(uint32_t count, uint32_t number) {
    uint32_t coded = 0;
    for (unsigned bit = bit_length(count - 1); bit-- > 0;)
      coded |= uint32_t{old_[bit].code(coder_, (number >> bit & 1) != 0)} << bit;
    return std::min(coded, count - 1);
  }

  Coder& coder_;
  const PatchTopology& topology_;
  PatchElements elements_;
  std::vector<uint32_t> face_of_;
  SurfaceNormals normals_;
  std::vector<uint32_t> count_;  ///< by point: twins that came up
  std::span<const uint32_t> known_;
  std::vector<uint32_t> numbers_;
  std::vector<uint32_t> number_of_;  ///< by known number
  BitModel joined_[2][3][5][4];
  BitModel new_[4];
  BitModel old_[32];
  unsigned history_ = 0;
};

}  // namespace

std::vector<std::byte> encode_twins(const PatchTopology& topology, std::span<const Vector3> positions,
                                    std::vector<uint32_t>& twin_of) {
  RansEncoder encoder(1);
  TwinCoder<RansEncoder> coder(encoder, topology, positions);
  twin_of = coder.run(twin_of, [] { return true; });
  return encoder.finish();
}

Result<std::vector<uint32_t>> decode_twins(const PatchTopology& topology, std::span<const Vector3> positions,
                                           Bytes bytes) {
  RansDecoder decoder(bytes, 1);
  TwinCoder<RansDecoder> coder(decoder, topology, positions);
  std::vector<uint32_t> numbers = coder.run({}, [&] { return !decoder.exhausted(); });
  if (decoder.exhausted()) return failure(ErrorCode::corrupt, "the numbers of twins end early");
  return numbers;
}

}  // namespace maille
