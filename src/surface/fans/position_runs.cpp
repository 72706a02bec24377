#include "surface/fans/position_runs.h"

#include <algorithm>
#include <utility>

namespace maille::positions {
namespace {

/// Points in floats or doubles, of so many components. Virtual calls stand outside of the loops over
/// vertices.
template <class Points>
class RunsOf final : public Runs {
 public:
  RunsOf(const Patch& patch, const Bias& bias, Points points) : patch_(patch), bias_(bias) {
    known_.points = std::move(points);
  }

  void all(const Coding& coding, Writer& writer) override {
    // As the decoder begins: what is not known yet is 0.
    known_.points.clear();
    known_.points.grow(room());
    known_.repeats.assign(coding.repeats == Repeats::none ? 0 : room(), {});
    points_are_known_ = false;
    writer.events.reserve(size_t{patch_.size()} * Points::components *
                          (coding.repeats == Repeats::none ? 1 : 2));
    run(coding, writer, {{0, patch_.size()}});
  }

  uint32_t sample(const Coding& coding, Writer& writer) override {
    if (is_small()) {
      all(coding, writer);
      return patch_.size();
    }
    know_points();
    if (coding.repeats != Repeats::none) known_.repeats.resize(room());
    run(coding, writer, sample_ranges());
    return pieces * piece;
  }

  Measured measure(const Coding& coding) override {
    know_points();
    Measured found;
    visit(coding, sample_ranges(),
          [&](uint32_t v, const auto&... of_vertex) { measure_one(coding, v, of_vertex..., found); });
    return found;
  }

  bool is_small() const override { return patch_.size() <= pieces * piece; }

 private:
  static constexpr uint32_t window = FanDecoder::window;
  /// A sample is eight pieces, evenly spread from the first vertex to the last; each begins without residuals
  /// around. Trials on four times as many vertices, in pieces of 4,096, took two to three times as long, for
  /// sizes that were the same within 0.2 % (twelve meshes of build/data/tri, 14 bits).
  static constexpr uint32_t piece = 512, pieces = 8;
  using Ranges = std::vector<std::pair<uint32_t, uint32_t>>;

  Ranges sample_ranges() const {
    if (is_small()) return {{0, patch_.size()}};
    Ranges ranges;
    for (uint32_t i = 0; i < pieces; ++i) {
      const auto begin = static_cast<uint32_t>(uint64_t{patch_.size() - piece} * i / (pieces - 1));
      ranges.push_back({begin, begin + piece});
    }
    return ranges;
  }
  size_t room() const { return size_t{patch_.size()} + FanDecoder::most_ahead; }
  typename Points::Tuple codes(uint32_t v) const {
    typename Points::Tuple result{};
    for (unsigned k = 0; k < Points::components; ++k)
      result[k] = static_cast<typename Points::Integer>(patch_.codes[v][k] - bias_[k]);
    return result;
  }
  /// Sets all points before a sample is coded: pieces refer to points that no piece has. What is not decoded
  /// in time counts as known here, so samples see slightly too much; all() does not.
  void know_points() {
    if (points_are_known_) return;
    known_.points.grow(room());
    for (uint32_t v = 0; v < patch_.size(); ++v) known_.points.set(v, codes(v), known_.points.size(v));
    points_are_known_ = true;
  }

  void run(const Coding& coding, Writer& writer, const Ranges& ranges) {
    with_repeats(coding.repeats, [&](auto repeats) { run<repeats>(coding, writer, ranges); });
  }
  template <Repeats repeats>
  void run(const Coding& coding, Writer& writer, const Ranges& ranges) {
    PositionCoder<Writer, Points, repeats> coder(coding, known_);
    visit(coding, ranges,
          [&](uint32_t v, const auto&... of_vertex) { coder.code(writer, v, of_vertex..., codes(v)); });
  }
  /// Calls see(v, references, kind, weights, turned weights).
  template <class See>
  void visit(const Coding& coding, const Ranges& ranges, See see) const {
    const FanSurface& fans = *patch_.fans;
    WindowWeights weights(coding, fans.valences, patch_.places.value_or(ElementPlaces{}));
    const auto see_all = [&](const VertexReferences* references, const uint8_t* kinds, uint32_t begin,
                             uint32_t end) {
      weights.compute(references, kinds, begin, end);
      for (uint32_t v = begin; v < end; ++v)
        see(v, references[v - begin], kinds[v - begin], weights[v - begin], weights.turned(v - begin));
    };
    std::vector<VertexReferences> beside;
    const std::vector<uint8_t> loose(window, loose_kind);
    for (const auto& [first, last] : ranges) {
      for (uint32_t begin = first; begin < last; begin += window) {
        const uint32_t end = std::min(last, begin + window),
                       fan_end = std::max(begin, std::min(end, fans.vertices));
        if (begin < fan_end)
          see_all(fans.references.data() + begin, fans.kinds.data() + begin, begin, fan_end);
        beside.clear();
        for (uint32_t v = fan_end; v < end; ++v) beside.push_back(references_beside(v));
        if (fan_end < end) see_all(beside.data(), loose.data(), fan_end, end);
      }
    }
  }

  void measure_one(const Coding& coding, uint32_t v, const VertexReferences& references, unsigned kind,
                   const Weights& weights, const Weights& turned, Measured& found) {
    const Points& points = known_.points;
    auto expected = forecast(points.points.data(), references, weights, group_of_kind[kind]);
    if (Points::components == 2 && coding.placement > Placement::hinge)
      expected.turn(turned_part(points.points.data(), references, turned, coding.turn_ratio,
                                kind_is_swapped(kind), mirrored_));
    const auto wanted = codes(v);
    for (const Centre centre : {Centre::fitted, Centre::gate}) {
      auto& of = found.by_centre[static_cast<size_t>(centre)];
      const auto target = points.to_codes(centre == Centre::gate ? expected.gate : expected.fitted);
      const auto octaves = points.octaves(expected.spread, target);
      for (unsigned k = 0; k < Points::components; ++k) {
        ++of.lengths[k][bit_length(magnitude_of(wanted[k], target[k]))];
        ++of.octaves[static_cast<size_t>(std::clamp(octaves[k], 0, 127))];
        if (centre == Centre::gate) found.repeated += is_repeated(v, k, references, wanted[k], target[k]);
      }
    }
    found.all += Points::components;
  }
  template <class Integer>
  static uint64_t magnitude_of(Integer a, Integer b) {
    using Unsigned = std::make_unsigned_t<Integer>;
    const auto difference = static_cast<Integer>(static_cast<Unsigned>(a) - static_cast<Unsigned>(b));
    return difference < 0 ? uint64_t{Unsigned{0} - static_cast<Unsigned>(difference)}
                          : static_cast<uint64_t>(difference);
  }
  template <class Integer>
  bool is_repeated(uint32_t v, unsigned k, const VertexReferences& references, Integer code,
                   Integer gate) const {
    using R = VertexReferences;
    const auto is_code_of = [&](unsigned r) {
      return references.at[r] < v && known_.points.code(references.at[r], k) == code;
    };
    // The three candidates that are taken most; it only decides whether candidates are worth a trial.
    return code == gate || is_code_of(R::last) || is_code_of(R::focus);
  }

  const Patch& patch_;
  const Bias& bias_;
  KnownPoints<Points> known_;
  bool points_are_known_ = false;
  bool mirrored_ = false;
};

}  // namespace

uint64_t Measured::OfCentre::bits() const {
  uint64_t sum = 0;
  for (const auto& of_component : lengths) {
    for (size_t length = 0; length < of_component.size(); ++length) sum += length * of_component[length];
  }
  return sum;
}

std::unique_ptr<Runs> Runs::make(const Patch& patch, const Bias& bias, std::span<const NumberMap> maps,
                                 Scalar type, bool wide) {
  return with_components(patch.codes.components, [&](auto n) -> std::unique_ptr<Runs> {
    if (wide) return std::make_unique<RunsOf<DoublePoints<n>>>(patch, bias, wide_points<n>(maps, type));
    return std::make_unique<RunsOf<FloatPoints<n>>>(patch, bias, FloatPoints<n>());
  });
}

}  // namespace maille::positions
