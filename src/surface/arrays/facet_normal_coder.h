#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "code/parallelogram.h"
#include "entropy/bit_model.h"
#include "entropy/integer_model.h"
#include "numbers/float_bits.h"
#include "surface/arrays/facet_vectors.h"
#include "surface/arrays/rounded_corners.h"

namespace maille {

/// How normals of faces are coded, chosen by the encoder. docs/format.md, 13.6.
struct FacetCoding {
  FacetFormula formula;
  Rounding rounding;
  bool learns = false;        ///< corners are moved to where normals say that they were
  bool unit = true;           ///< of length 1: the last component follows from the others
  bool signed_zeros = false;  ///< there are negative ones
};

/// Codes the normals of faces: as computed by the file's formula, or as a neighbour has it, or as it was met
/// before in this direction, or apart from what corners before rounding give. One class serves both
/// directions; a decoder's `codes` are filled as it goes. Candidates that were refused are not asked for
/// again. Bits a facet, -5: 73416 13.2 to 5.3, featuretype 21.1 to 2.9 (a6ba7ce). docs/format.md, 13.6.
template <class Coder, class Code>
class FacetNormalCoder {
 public:
  FacetNormalCoder(Coder& coder, const FacetCoding& coding, Scalar type, const ArrayMaps& maps,
                   const PatchElements& elements, const std::vector<uint32_t>& face_of, std::span<Code> codes)
      : coder_(coder),
        coding_(coding),
        codes_(type, maps, codes),
        face_(elements, face_of),
        unit_(codes_.unit(0, 0.6)),
        corners_(elements.positions, coding.rounding, unit_),
        memory_(elements.cells()),
        kept_(elements.cells()) {}

  void code(uint32_t element) {
    face_.find(element);
    tuple_ = codes_.at(element);
    zero_signs_ = codes_.zero_signs(element);
    estimate();
    find_context(element);
    Kept& kept = kept_[element];
    kept.way = code_computed()    ? Way::computed
               : code_neighbour() ? Way::repeated
               : code_recalled()  ? Way::repeated
                                  : Way::other;
    if (kept.way == Way::other) code_components();
    if (coding_.signed_zeros) code_zero_signs(kept.way);
    codes_.put(element, tuple_, zero_signs_);
    keep(element);
  }

 private:
  using Tuple = typename VectorCodes<Code>::Tuple;
  enum class Way : uint8_t { none, computed, repeated, other };

  /// What later faces ask of one, 32 bytes for each cell of the array.
  struct Kept {
    Vector3 normal;
    uint32_t base = none;  ///< the half-edge that its normal was computed from, where that is certain
    int16_t error = 0;     ///< half octaves of its squared error over the one expected
    uint8_t signs = 0;     ///< of the direction of its face
    Way way = Way::none;
  };

  /// Everything that is computed from the file's numbers goes through this before it becomes an integer.
  static double between(double value, double low, double high) {
    return value > low ? value < high ? value : high : low;  // NaN is low
  }
  static unsigned class_of(int half, int from, int per_class, unsigned classes) {
    return static_cast<unsigned>(std::clamp((half - from) / per_class, 0, static_cast<int>(classes) - 1));
  }

  /// What the normal should be by its corners before rounding and by known neighbours, and what the formula
  /// gives.
  void estimate() {
    known_.clear();
    for (const FaceCorners::Neighbour& neighbour : face_.neighbours()) {
      const Vector3& normal = kept_[neighbour.face].normal;
      if (coding_.learns && is_unit(normal)) known_.push_back({neighbour.edge, normal * side()});
    }
    estimate_ = corners_.estimate(face_.points(), known_);
    computed_count_ = computed_normals(face_, coding_.formula, computed_);
    if (dot(estimate_.normal, estimate_.normal) > 0) {
      estimate_.normal = estimate_.normal * side();
      return;
    }
    // A face without area, or with many corners, or none: as one before.
    // (Below, 1e-4 is a variance of a hundredth in each direction: next to nothing is known.)
    estimate_.normal = computed_count_ > 0 && is_unit(computed_[0]) ? computed_[0] : last_;
    for (unsigned a = 0; a < 3; ++a) {
      for (unsigned b = 0; b < 3; ++b) estimate_.covariance[a][b] = a == b ? 1e-4 : 0;
    }
  }
  double side() const { return coding_.formula.inward() ? -1 : 1; }
  static bool is_unit(const Vector3& v) { return std::fabs(dot(v, v) - 1) < 0.02; }

  /// Were the neighbours computed, how far were they off, and how exact is the estimate: these are contexts
  /// of all that follows.
  void find_context(uint32_t element) {
    const auto neighbours = face_.neighbours();
    around_ = 0;
    int errors = 0;
    for (const auto& neighbour : neighbours) {
      const Kept& kept = kept_[neighbour.face];
      around_ |= kept.way == Way::computed ? 1u : 2u;
      errors += kept.error;
    }
    if (neighbours.empty() && element > 0) around_ = kept_[element - 1].way == Way::computed ? 1 : 2;
    const auto count = static_cast<int>(neighbours.size());
    // In half octaves of the error, from 1/4 to 4 of the one expected; 9: nothing is known.
    error_class_ = count == 0 ? 9 : class_of(errors / count, -9, 2, 9);
    const double variance =
        estimate_.covariance[0][0] + estimate_.covariance[1][1] + estimate_.covariance[2][2];
    spread_class_ = class_of(
        half_octaves_of(between(std::sqrt(between(variance, 0, 1e60)) / unit_, 1e-9, 1e30)), -20, 4, 16);
  }

  /// Codes whether the normal is this one. Refused ones are remembered, as asking twice would cost bits.
  bool code_same(const Tuple& other, BitModel& model) {
    const bool same = model.code(coder_, Coder::encoding && tuple_ == other);
    if (same) {
      tuple_ = other;
    } else {
      refused_.push_back(other);
    }
    return same;
  }
  bool is_refused(const Tuple& tuple) const {
    return std::find(refused_.begin(), refused_.end(), tuple) != refused_.end();
  }

  /// A normal that some corners of the face give: what several give is one candidate. They stand in the order
  /// of corners from the entry on.
  struct Candidate {
    Tuple tuple;
    unsigned zero_signs = 0;
    unsigned corner = 0;
    unsigned corners = 0;
  };
  struct Candidates {
    std::array<Candidate, 3> list;
    unsigned count = 0;

    void add(const Candidate& candidate) {
      unsigned at = 0;
      while (at < count && (list[at].tuple != candidate.tuple || list[at].zero_signs != candidate.zero_signs))
        ++at;
      if (at == count) list[count++] = candidate;
      ++list[at].corners;
    }
  };

  /// Codes whether the normal is one that the formula gives, and if so, which.
  bool code_computed() {
    refused_.clear();
    base_ = none;
    entry_ = find_entry();
    Candidates candidates;
    for (unsigned i = 0; i < computed_count_; ++i) {
      const unsigned corner = (entry_ + i) % computed_count_;
      computed_tuples_[corner] = codes_.nearest(computed_[corner]);
      candidates.add({computed_tuples_[corner], 0, corner});
    }
    if (candidates.count == 0) return false;
    unsigned found = candidates.count;
    if constexpr (Coder::encoding) {
      for (found = 0; found < candidates.count && candidates.list[found].tuple != tuple_;) ++found;
    }
    if (!computed_model_[spread_class_][around_].code(coder_, found < candidates.count)) {
      for (unsigned i = 0; i < candidates.count; ++i) refused_.push_back(candidates.list[i].tuple);
      return false;
    }
    tuple_ = choose(candidates, found).tuple;
    return true;
  }

  /// One of several candidates; which corner it comes from, if that is certain, is kept for later faces.
  const Candidate& choose(const Candidates& candidates, unsigned found) {
    unsigned i = 0;
    while (i + 1 < candidates.count && !base_model(candidates, i).code(coder_, Coder::encoding && i == found))
      ++i;
    const Candidate& candidate = candidates.list[i];
    if (candidate.corners == 1 && candidates.count > 1) base_ = face_.half_edge(candidate.corner);
    return candidate;
  }
  /// Programs begin triangles at corners that have something in common: where the neighbour's base lies, and
  /// how long the side opposite is.
  BitModel& base_model(const Candidates& candidates, unsigned i) {
    const Candidate& candidate = candidates.list[i];
    return base_model_[entry_state_][longer_sides(candidate.corner)][i][candidate.corners > 1]
                      [candidates.count > 2];
  }
  /// How many of a triangle's sides are longer than the one opposite a corner: programs often begin at the
  /// longest or the shortest side.
  unsigned longer_sides(unsigned corner) const {
    const auto square_opposite = [&](unsigned c) {
      const Vector3 side = face_.position((c + 1) % 3) - face_.position((c + 2) % 3);
      return dot(side, side);
    };
    const double own = square_opposite(corner);
    return unsigned{square_opposite((corner + 1) % 3) > own} +
           unsigned{square_opposite((corner + 2) % 3) > own};
  }

  /// Zeros have the signs that they are computed with, from one of the corners that agree with the rest.
  void code_zero_signs(Way way) {
    unsigned zeros = 0;
    for (unsigned k = 0; k < 3; ++k) zeros |= unsigned{codes_.is_zero(k, tuple_)} << k;
    if (zeros == 0) return;
    Candidates candidates;
    for (unsigned i = 0; i < computed_count_; ++i) {
      const unsigned corner = (entry_ + i) % computed_count_;
      if (way == Way::computed && computed_tuples_[corner] != tuple_) continue;
      candidates.add({{}, sign_bits(computed_[corner]) & zeros, corner});
    }
    unsigned found = candidates.count;
    if constexpr (Coder::encoding) {
      for (found = 0; found < candidates.count && candidates.list[found].zero_signs != zero_signs_;) ++found;
    }
    if (candidates.count > 0 && signs_model_[way == Way::computed].code(coder_, found < candidates.count)) {
      zero_signs_ = choose(candidates, found).zero_signs;
      return;
    }
    for (unsigned k = 0; k < 3; ++k) {
      const bool negative = (zeros >> k & 1) != 0 && sign_model_.code(coder_, (zero_signs_ >> k & 1) != 0);
      zero_signs_ = (zero_signs_ & ~(1u << k)) | unsigned{negative} << k;
    }
  }
  static unsigned sign_bits(const Vector3& v) {
    return unsigned{std::signbit(v[0])} | unsigned{std::signbit(v[1])} << 1 |
           unsigned{std::signbit(v[2])} << 2;
  }

  /// The corner where the edge to the face that came last before begins, of those whose base is known if
  /// there are any. Sets entry_state_: where on that face, seen from there, its base is, 1 to 3; 0 where
  /// nobody knows.
  unsigned find_entry() {
    entry_state_ = 0;
    const FaceCorners::Neighbour* last = nullptr;
    for (const auto& neighbour : face_.neighbours()) {
      const bool known = kept_[neighbour.face].base != none;
      const bool last_known = last && kept_[last->face].base != none;
      if (!last || known > last_known || (known == last_known && neighbour.face > last->face))
        last = &neighbour;
    }
    if (!last) return 0;
    const uint32_t base = kept_[last->face].base;
    if (base != none) {
      const uint32_t after = face_.after(last->opposite);
      entry_state_ = base == last->opposite ? 1 : base == after ? 2 : 3;
    }
    return last->edge;
  }

  double distance(const Vector3& v) const { return between(squared_distance(v, estimate_, unit_), 0, 1e30); }

  /// Asks for the normals of neighbours, those nearest to the estimate first; at most four, as faces have few
  /// neighbours.
  bool code_neighbour() {
    std::array<std::pair<double, Tuple>, 4> candidates;
    unsigned count = 0;
    for (const auto& neighbour : face_.neighbours()) {
      const Tuple tuple = codes_.at(neighbour.face);
      bool known = is_refused(tuple);
      for (unsigned i = 0; i < count; ++i) known |= candidates[i].second == tuple;
      if (known || count == candidates.size()) continue;
      const double apart = distance(kept_[neighbour.face].normal);
      unsigned at = count++;
      for (; at > 0 && candidates[at - 1].first > apart; --at) candidates[at] = candidates[at - 1];
      candidates[at] = {apart, tuple};
    }
    for (unsigned i = 0; i < count; ++i) {
      const unsigned near = class_of(half_octaves_of(candidates[i].first + 1e-3), -20, 4, 16);
      if (code_same(candidates[i].second, neighbour_model_[near][i])) return true;
    }
    return false;
  }

  /// Asks for normals that faces of the same direction had, or their mirror images: machine parts repeat
  /// shapes.
  bool code_recalled() {
    if (computed_count_ == 0 || !is_unit(computed_[0])) return false;
    const NormalMemory::Bucket& bucket = memory_.at(computed_[0]);
    const uint8_t signs = signs_of(computed_[0]);
    unsigned asked = 0;
    for (const uint32_t element : bucket.elements) {
      if (element == none) break;
      const Tuple tuple = mirrored(element, signs);
      if (is_refused(tuple)) continue;
      const unsigned near = class_of(half_octaves_of(distance(codes_.numbers(tuple)) + 1e-3), -20, 8, 8);
      const bool same = code_same(tuple, recall_model_[asked][near][recalled_]);
      ++asked;
      if (same) {
        recalled_ = (recalled_ << 1 | 1) & 3;
        return true;
      }
    }
    if (asked > 0) recalled_ = recalled_ << 1 & 3;
    return false;
  }
  /// The normal of an element, in the direction that has these signs.
  Tuple mirrored(uint32_t element, uint8_t signs) const {
    return codes_.turned(codes_.at(element), unsigned{kept_[element].signs} ^ signs);
  }
  static uint8_t signs_of(const Vector3& v) {
    return static_cast<uint8_t>((v[0] < 0) | (v[1] < 0) << 1 | (v[2] < 0) << 2);
  }

  /// Three numbers near the estimate. With unit length the largest component comes last and follows from the
  /// others but for its sign and rounding. What the first component was off moves the mean of the second, by
  /// their covariance.
  void code_components() {
    const Vector3& mean = estimate_.normal;
    const auto& covariance = estimate_.covariance;
    const unsigned last = coding_.unit ? largest_component(mean) : 2;
    const unsigned a = (last + 1) % 3;
    const unsigned b = (last + 2) % 3;
    const double variance_a = code_number(a, mean[a], covariance[a][a], first_model_[error_class_]);
    // What the first component tells of the second.
    const double found = value_[a] - mean[a];
    // variance_a has the unit's own variance in it, so it is not 0.
    const double part = covariance[a][b] / variance_a;
    const unsigned apart =
        class_of(half_octaves_of(between(std::fabs(found) / std::sqrt(variance_a), 0.05, 100)), -9, 3, 7);
    const unsigned around = error_class_ == 9 ? 1 : error_class_ < 3 ? 0 : error_class_ < 6 ? 1 : 2;
    code_number(b, mean[b] + part * found, covariance[b][b] - part * covariance[a][b],
                second_model_[apart][around]);
    if (coding_.unit) return complete(a, b, last);
    code_number(last, mean[last], covariance[last][last], third_model_);
  }
  /// The variance of rounding to the unit there.
  double noise(unsigned k, double value) const {
    const double unit = codes_.unit(k, value);
    return unit * unit / 12;
  }

  /// The last component of a unit vector, as exactly as the steps of the others say.
  void complete(unsigned a, unsigned b, unsigned last) {
    const double x = value_[a];
    const double y = value_[b];
    const bool negative = estimate_.normal[last] < 0;
    const bool turned =
        side_model_.code(coder_, Coder::encoding && (codes_.number(last, tuple_[last]) < 0) != negative);
    const double left = std::sqrt(std::max(1 - x * x - y * y, 0.0));
    const double along = between(left, 1e-6, 1);
    const double variance = (x * x * noise(a, x) + y * y * noise(b, y)) / (along * along);
    code_number(last, turned != negative ? -left : left, variance, third_model_);
  }

  /// Classes of how many units the spread has. Numbers are told apart by bins of half the spread where that
  /// is wide, else one by one.
  static constexpr unsigned widths = 8;
  using BinModels = std::array<OffsetModel, widths>;
  // Offsets beyond are escapes with raw bits. Chosen, not swept: normals that far from the estimate have
  // nothing to do with it.
  static constexpr int32_t most_bins = 1 << 12;

  /// Returns the variance, which is that given and that of rounding to the unit there.
  double code_number(unsigned k, double mean, double variance, BinModels& models) {
    mean = between(mean, -1e30, 1e30);
    const double unit = codes_.unit(k, mean);
    // The variance of rounding to the unit is added here, once for estimate and number.
    variance = between(variance, 0, 1e60) + unit * unit / 12;
    const double spread = std::sqrt(variance);
    if (code_zero(k, mean, spread)) return variance;
    const int ratio = half_octaves_of(between(spread / unit, 1e-9, 1e30));
    OffsetModel& model = models[class_of(ratio, -4, 1, widths)];
    // From two units on; below, bins would be empty.
    if (ratio > 2) {
      code_in_bins(k, mean, spread / 2, model);
    } else {
      code_one_by_one(k, codes_.nearest(k, mean), model);
    }
    value_[k] = codes_.number(k, tuple_[k]);
    return variance;
  }

  /// Differences wrap, so that any two codes have one.
  void code_one_by_one(unsigned k, Code middle, OffsetModel& model) {
    int32_t offset = 0;
    if constexpr (Coder::encoding) {
      const Code difference = wrapped_difference(tuple_[k], middle);
      offset = difference >= -most_bins && difference <= most_bins ? static_cast<int32_t>(difference)
                                                                   : most_bins + 1;
    }
    offset = model.code(coder_, offset);
    if (offset > most_bins || offset < -most_bins) return code_escaped(k);
    tuple_[k] = wrapped_sum(middle, static_cast<Code>(offset));
  }

  /// The bin, then the place in it, which is as good as evenly distributed.
  void code_in_bins(unsigned k, double mean, double width, OffsetModel& model) {
    const auto bound = [&](int32_t bin) {
      return codes_.nearest(k, mean + (static_cast<double>(bin) - 0.5) * width);
    };
    int32_t bin = 0;
    if constexpr (Coder::encoding) {
      const double value = codes_.number(k, tuple_[k]);
      bin = static_cast<int32_t>(between((value - mean) / width, -most_bins, most_bins));
      // The bin of the quotient may be off by rounding; bounds, which both sides compute alike, decide.
      while (bin >= -most_bins && tuple_[k] < bound(bin)) --bin;
      while (bin <= most_bins && tuple_[k] >= bound(bin + 1)) ++bin;
      if (tuple_[k] < bound(bin) || tuple_[k] >= bound(bin + 1)) bin = most_bins + 1;
    }
    bin = model.code(coder_, bin);
    if (bin > most_bins || bin < -most_bins) return code_escaped(k);
    const Code low = bound(bin);
    const Code high = bound(bin + 1);
    using Bits = std::make_unsigned_t<Code>;
    const auto size =
        high > low ? static_cast<Bits>(static_cast<Bits>(high) - static_cast<Bits>(low)) : Bits{1};
    const auto place = static_cast<Bits>(static_cast<Bits>(tuple_[k]) - static_cast<Bits>(low));
    tuple_[k] = static_cast<Code>(static_cast<Bits>(low) + static_cast<Bits>(code_uniform(place, size)));
  }

  /// All bits of the code, for what no bin holds; any bits are a code.
  void code_escaped(unsigned k) {
    auto bits = static_cast<std::make_unsigned_t<Code>>(tuple_[k]);
    if constexpr (sizeof(Code) == 8) {
      const uint64_t high = coder_.code_raw(static_cast<uint32_t>(bits >> 32), 32);
      bits = high << 32 | coder_.code_raw(static_cast<uint32_t>(bits), 32);
    } else {
      bits = coder_.code_raw(bits, 32);
    }
    tuple_[k] = static_cast<Code>(bits);
  }

  /// One of `size` values that are equally likely: ten bits of it without loss (their intervals are as equal
  /// as 2^15 allows), the rest raw. Damaged bytes may give a value beyond `size`, which is cut.
  uint64_t code_uniform(uint64_t value, uint64_t size) {
    if (size <= 1) return 0;
    const unsigned length = bit_length(size - 1);
    const unsigned low = length > 10 ? length - 10 : 0;
    const auto tops = static_cast<uint32_t>(((size - 1) >> low) + 1);
    const auto start = [tops](uint32_t top) { return (top << 15) / tops; };
    auto top = static_cast<uint32_t>(value >> low);
    if constexpr (!Coder::encoding) top = ((coder_.peek(15, 0) + 1) * tops - 1) >> 15;
    if constexpr (Coder::encoding) {
      coder_.put(start(top), start(top + 1) - start(top), 15, 0);
    } else {
      coder_.advance(start(top), start(top + 1) - start(top), 15, 0);
    }
    uint64_t result = top;
    unsigned left = low;
    if (left > 32) {
      left -= 32;
      result = result << 32 | coder_.code_raw(static_cast<uint32_t>(value >> left), 32);
    }
    const auto rest = static_cast<uint32_t>(value & ((uint64_t{1} << left) - 1));
    result = result << left | coder_.code_raw(rest, left);
    return std::min(result, size - 1);
  }

  /// Many faces are parallel to an axis: numbers that are computed as 0, or lie near it, are often 0.
  bool code_zero(unsigned k, double mean, double spread) {
    const bool computed = computed_count_ > 0 && computed_[0][k] == 0;
    const double apart = between(std::fabs(mean) / spread, 1e-3, 1e3);
    if (!computed && apart > 8) return false;
    unsigned around = 0;
    for (const auto& neighbour : face_.neighbours()) around |= kept_[neighbour.face].normal[k] == 0 ? 2u : 1u;
    const unsigned near = class_of(half_octaves_of(apart), -8, 2, 8);
    const bool zero =
        zero_model_[computed][near][around].code(coder_, Coder::encoding && codes_.is_zero(k, tuple_));
    if (!zero) return false;
    tuple_[k] = codes_.zero(k);
    value_[k] = codes_.number(k, tuple_[k]);
    return true;
  }

  /// What later faces ask of this one, and what its normal tells of its corners.
  void keep(uint32_t element) {
    Kept& kept = kept_[element];
    kept.normal = codes_.numbers(tuple_);
    kept.base = base_;
    last_ = is_unit(kept.normal) ? kept.normal : Vector3{{0, 0, 1}};
    kept.error = static_cast<int16_t>(half_octaves_of(distance(kept.normal) + 1e-3));
    if (computed_count_ > 0 && is_unit(computed_[0])) {
      kept.signs = signs_of(computed_[0]);
      remember(element);
    }
    if (!coding_.learns || !is_unit(kept.normal)) return;
    Vector3 units;
    // Numbers near 0 have fine units, which say nothing of how exact they are.
    for (unsigned k = 0; k < 3; ++k) units[k] = std::max(codes_.unit(k, kept.normal[k]), 0.1 * unit_);
    corners_.learn(face_.points(), kept.normal * side(), units);
  }

  /// First among those of its direction; the last of others falls out.
  void remember(uint32_t element) {
    auto& elements = memory_.at(computed_[0]).elements;
    uint32_t carried = element;
    for (uint32_t& other : elements) {
      std::swap(carried, other);
      if (carried == none || mirrored(carried, kept_[element].signs) == tuple_) break;
    }
  }

  Coder& coder_;
  FacetCoding coding_;
  VectorCodes<Code> codes_;
  FaceCorners face_;
  double unit_;
  RoundedCorners corners_;
  NormalMemory memory_;
  std::vector<Kept> kept_;
  /// Contexts of all models are those of docs/format.md, 13.6, by the same names; their classes were chosen,
  /// and no sweep is recorded.
  BitModel computed_model_[16][4];
  BitModel base_model_[4][3][3][2][2];
  BitModel neighbour_model_[16][4];
  BitModel recall_model_[NormalMemory::ways][8][4];
  BitModel zero_model_[2][8][4];
  BitModel signs_model_[2];
  BitModel sign_model_;
  BitModel side_model_;
  BinModels first_model_[10];
  BinModels second_model_[7][3];
  BinModels third_model_;
  unsigned recalled_ = 0;
  Vector3 last_{{0, 0, 1}};
  // Of the element at hand.
  Tuple tuple_;  ///< with positive zeros
  unsigned zero_signs_ = 0;
  uint32_t base_ = none;
  unsigned entry_ = 0;
  NormalEstimate estimate_;
  std::array<Vector3, 3> computed_;
  std::array<Tuple, 3> computed_tuples_;
  unsigned computed_count_ = 0;
  std::vector<RoundedCorners::Neighbour> known_;
  std::vector<Tuple> refused_;
  unsigned around_ = 0;
  unsigned error_class_ = 0;
  unsigned spread_class_ = 0;
  unsigned entry_state_ = 0;
  Vector3 value_;
};

}  // namespace maille
