#include "surface/fans/position_choice.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "surface/fans/repeated_values.h"

namespace maille::positions {
namespace {

/// Chooses how positions are coded, by trials, in the order of docs/encoder.md ("Positions over fans"): rows
/// and centre, repeats, spread. Each step starts from the best coding of the step before; what a decoder is
/// slower with must save something. One chooser serves one patch.
class CodingChooser {
 public:
  CodingChooser(const Patch& patch, const CodedNumbers& numbers, const Effort& effort)
      : patch_(patch),
        numbers_(numbers),
        effort_(effort),
        runs_(Runs::make(patch, numbers.bias, numbers.maps, numbers.type, numbers.wide)) {}

  ChosenCoding choose(bool exact) {
    const FittedRows fitted = fit();
    Coding coding;
    coding.components = components();
    // Trials of both kinds of rows take long, so rows by place, which lower efforts have, are tried only
    // where they may be smaller. Placements are compared with them alone.
    const auto saves = [&](double part) {
      return fitted.bits_by_valence < (1 - part) * fitted.bits_by_place;
    };
    const bool with_valences = effort_.valence_rows && saves(effort_.least_gain_of_valences);
    if (!with_valences || !saves(surely_smaller) || patch_.places) {
      coding.rows = fitted.by_place;
      consider_centres(coding);
      // Placements have weights of their own instead of rows, so they are compared with the plainest rows
      // only.
      if (patch_.places && !patch_.places->positions.empty()) consider_placements();
    }
    if (with_valences) {
      end_step();
      coding.rows = fitted.by_valence;
      coding.with_valences = true;
      consider_centres(coding);
    }
    if (effort_.valence_rows) {
      end_step();
      consider_repeats();
    }
    if (effort_.spread) {
      end_step();
      consider_spread();
    }
    if (exact && !runs_->is_small()) take_smallest_step();
    return std::move(best_);
  }

 private:
  unsigned components() const { return patch_.codes.components; }

  struct Tried : ChosenCoding {
    double sampled = 0;  ///< the size that a sample tells, even if that of all points is known
  };

  /// Takes the coding if it needs no more than this part of what the best one so far needs.
  void consider(Tried tried, double part) {
    if (best_.sampled > 0 && tried.sampled > part * best_.sampled) return;
    best_ = std::move(tried);
    is_new_ = true;
  }
  void consider(const Coding& coding, double part) { consider(try_out(coding), part); }
  Tried try_out(const Coding& coding) {
    Tried tried{{coding, 0, {}}, 0};
    if (runs_->is_small()) {
      know_all(tried);
    } else {
      CodedPoints sample;
      const uint32_t count = runs_->sample(coding, sample.writer);
      tried.size = finish(coding, sample, static_cast<double>(patch_.size()) / count);
    }
    tried.sampled = tried.size;
    return tried;
  }
  void know_all(Tried& tried) {
    if (tried.all) return;
    runs_->all(tried.coding, tried.all.emplace().writer);
    tried.size = finish(tried.coding, *tried.all, 1);
  }
  /// Makes tables for what was coded, and returns the size in bytes where there are so many times as many
  /// points: the side is written once, symbols and raw bits grow with the points.
  static double finish(const Coding& coding, CodedPoints& points, double times) {
    RansEncoder side;
    points.tables = write_side(coding, points.writer.events, false, side);
    points.side = side.finish();
    const double bits =
        static_cast<double>(points.writer.raw_bits) + bits_of(coding, points.writer.events, points.tables);
    return static_cast<double>(points.side.size()) + bits / 8 * times;
  }

  /// Remembers the best coding so far, as it is what a lower effort has.
  void end_step() {
    if (is_new_ && !runs_->is_small()) steps_.push_back(best_);
    is_new_ = false;
  }
  /// Of this effort's best coding and those of lower ones, takes the smallest by all points, so that no
  /// effort makes a larger file than a lower one: -4 to -6 lost up to 18 % to -2 before (73416 at 12 bits;
  /// 652d4b7). Steps whose samples are larger by more than `far` are not tried: samples are not that wrong.
  void take_smallest_step() {
    const double sampled = best_.sampled;
    know_all(best_);
    // The last one may be the best one itself.
    if (!is_new_ && !steps_.empty()) steps_.pop_back();
    for (Tried& step : steps_) {
      if (step.sampled > far * sampled) continue;
      know_all(step);
      if (step.size <= best_.size) best_ = std::move(step);
    }
  }

  /// If rows that follow valences save this much of the lengths of residuals, trials of both kinds always
  /// took them (9d88ba9), so rows by place need not be tried.
  static constexpr double surely_smaller = 0.05;

  /// By what is fitted and by the gate; the latter is what repeats go with.
  void consider_centres(const Coding& coding) {
    const Measured measured = runs_->measure(coding);
    by_fitted_ = with_classes(coding, measured);
    by_gate_ = coding;
    by_gate_.centre = Centre::gate;
    by_gate_ = with_classes(by_gate_, measured);
    has_repeated_ = measured.repeated > measured.all / 10;
    const auto fitted = static_cast<double>(measured.of(Centre::fitted).bits()),
               gate = static_cast<double>(measured.of(Centre::gate).bits());
    if (fitted <= far * gate) consider(by_fitted_, 1);
    if (gate <= far * fitted) consider(by_gate_, 1);
  }
  /// Where the lengths of residuals are longer by this factor, no trial was ever smaller (the shared meshes
  /// of 652d4b7). A larger one costs trials, a smaller one misses some.
  static constexpr double far = 1.05;

  void consider_placements() {
    Coding coding;
    coding.components = components();
    for (const Placement placement : {Placement::hinge, Placement::similar, Placement::both}) {
      if (placement > Placement::hinge && !can_turn()) continue;
      coding.placement = placement;
      if (placement > Placement::hinge) coding.turn_ratio = turn_ratio(numbers_.maps, numbers_.type);
      consider(with_classes(coding, runs_->measure(coding)), 1);
    }
  }
  bool can_turn() const { return components() == 2 && turn_ratio(numbers_.maps, numbers_.type) > 0; }

  /// Few vertices pay too much for more tables; and spreads take a fifth of the decoder's time, as a table
  /// then waits for the vertex before. So they must save 0.4 %: armadillo decodes a quarter faster at -5 for
  /// that rule (120ca93).
  void consider_spread() {
    Coding coding = best_.coding;
    coding.with_spread = true;
    consider(coding, 1 / 1.004);
  }

  /// Repeats take longer to decode, so they must save what the effort asks for. Residuals beside dictionaries
  /// are about as long with one centre as with the other; candidates are those of the gate.
  void consider_repeats() {
    Tried listed;
    size_t entries_before = 0;
    for (const DictionaryTrial& found : list_often()) {
      // A dictionary must cover a tenth of all numbers to be tried; chosen, not swept: fewer could hardly pay
      // for their masks.
      if (found.covered < patch_.codes.numbers.size() / 10 ||
          found.bits < least_bits_to_entry * static_cast<double>(found.spread))
        continue;
      // Thresholds that find the same entries need one trial only.
      if (found.entries == std::exchange(entries_before, found.entries)) continue;
      take_smaller(listed, with_repeats(Repeats::listed, by_fitted_, found.dictionaries));
    }
    // With the dictionaries that are best without candidates: others were at most 0.3 % smaller.
    Tried candidates;
    const bool pays = listed.sampled > 0 && listed.sampled < best_.sampled;
    if (has_repeated_)
      candidates =
          with_repeats(Repeats::candidates, by_gate_, pays ? listed.coding.dictionaries : Dictionaries());
    consider_smaller(std::move(listed), std::move(candidates));
  }
  /// Where entries lie closer than this, 10 codes, residuals are no longer than indices: dictionaries were 10
  /// to 80 % larger (build/data/tri, 14 bits; those that were smaller have 3.7 and more).
  static constexpr double least_bits_to_entry = 3.3;
  static void take_smaller(Tried& best, Tried tried) {
    if (best.sampled == 0 || tried.sampled < best.sampled) best = std::move(tried);
  }
  /// What neighbours are, which contexts of candidates tell, is not known around the pieces of a sample: so
  /// all points decide where these say nearly the same (cycloidal at 12 bits: 4 %).
  void consider_smaller(Tried listed, Tried candidates) {
    const double least = std::min(listed.sampled, candidates.sampled);
    const double part = 1 - effort_.least_gain_of_repeats;
    if (least > 0 && least < part * best_.sampled &&
        std::max(listed.sampled, candidates.sampled) < far * least) {
      know_all(listed);
      know_all(candidates);
      return consider(listed.size < candidates.size ? std::move(listed) : std::move(candidates), 1);
    }
    if (listed.sampled > 0) take_smaller(candidates, std::move(listed));
    if (candidates.sampled > 0) consider(std::move(candidates), part);
  }
  Tried with_repeats(Repeats repeats, Coding coding, const Dictionaries& dictionaries) {
    coding.repeats = repeats;
    coding.dictionaries = dictionaries;
    return try_out(coding);
  }
  /// Dictionaries of what is there often, by one threshold or another.
  struct DictionaryTrial {
    Dictionaries dictionaries;
    uint64_t covered = 0;  ///< so many numbers
    size_t entries = 0;
    uint64_t spread = 0;  ///< of these, those of components that are not constant
    double bits = 0;      ///< log2 of the codes to an entry, summed over the spread ones
  };
  std::array<DictionaryTrial, 4> list_often() const {
    // First what stands out twice among its neighbours: at 12 bits the dragon has 2,141 values that occur
    // often, but its voxel lattice only 1,258 planes (5.899 to 5.098 bits a triangle in charts; 8a243f9). The
    // counts 8, 32, 128 are a coarse search, not swept.
    constexpr std::array<Often, 4> thresholds = {Often{8, 2}, Often{8, 0}, Often{32, 0}, Often{128, 0}};
    std::array<DictionaryTrial, thresholds.size()> result;
    std::vector<int64_t> values(patch_.size());
    for (unsigned k = 0; k < components(); ++k) {
      for (size_t v = 0; v < values.size(); ++v) values[v] = patch_.codes[v][k] - numbers_.bias[k];
      const ValueCounts counts = count_values(values);
      for (size_t i = 0; i < thresholds.size(); ++i) {
        DictionaryTrial& to = result[i];
        const uint64_t covered = fill_dictionary(counts, thresholds[i], to.dictionaries[k]);
        if (covered == 0) continue;
        const uint64_t range =
            static_cast<uint64_t>(counts.back().first) - static_cast<uint64_t>(counts.front().first);
        to.covered += covered;
        to.entries += to.dictionaries[k].size();
        // A constant coordinate says nothing of how close entries lie: its log2(0) once judged all of them
        // (ffdad10).
        if (range == 0) continue;
        to.spread += covered;
        to.bits +=
            static_cast<double>(covered) * std::log2(static_cast<double>(range) / to.dictionaries[k].size());
      }
    }
    return result;
  }

  FittedRows fit() const {
    return with_components(components(), [&](auto n) { return fit<n>(); });
  }
  template <unsigned n>
  FittedRows fit() const {
    std::vector<std::array<double, n>> values(patch_.size());
    std::array<double, n> largest{}, units;
    DoublePoints<n> points = wide_points<n>(numbers_.maps, numbers_.type);
    for (unsigned k = 0; k < n; ++k) {
      // Ranks are fitted as ranks. Codes of digits jump by a factor of ten or two where one digit more
      // begins, and few such jumps spoil the fit (ogre: 17 % instead of 5 % more than by numbers).
      if (!numbers_.wide && !numbers_.maps[k].table.empty()) points.curved[k] = {};
    }
    for (size_t v = 0; v < values.size(); ++v) {
      for (unsigned k = 0; k < n; ++k) {
        const int64_t bias = points.curved[k] ? 0 : numbers_.bias[k];
        values[v][k] = points.value_of(patch_.codes[v][k] - bias, k);
        largest[k] = std::max(largest[k], std::fabs(values[v][k]));
      }
    }
    for (unsigned k = 0; k < n; ++k)
      units[k] = points.curved[k] ? largest_step(points.curved[k].map(), std::max(largest[k], 1e-30)) : 1;
    return fit_valence_rows<n>(*patch_.fans, values, units, effort_.valence_rows);
  }
  /// Between the largest numbers; a float has steps of 2^-24 of it at least.
  double largest_step(const NumberMap& map, double largest) const {
    const int64_t code = map.nearest_code(numbers_.type, largest);
    const double below = map.value_of(numbers_.type, code - 1);
    return std::max(largest - below, largest * (size_of(numbers_.type) == 8 ? 0x1p-53 : 0x1p-24));
  }

  /// Bases, so that the lengths of nearly all residuals have symbols, and the first class of sizes and
  /// spreads.
  Coding with_classes(Coding coding, const Measured& measured) const {
    const Measured::OfCentre& found = measured.of(coding.centre);
    unsigned least = 255;
    for (unsigned k = 0; k < components(); ++k) {
      // One length in 4,096 has no symbol and is an escape, whose 8 bits and more hardly count then. The
      // other quantiles below put the few sizes and spreads that are smaller than usual into the first class.
      // None of them was swept.
      const unsigned most = quantile(found.lengths[k], 4095, 4096);
      coding.base[k] = static_cast<uint8_t>(
          std::min(most > longest ? most - longest : 0u, numbers_.wide ? most_wide_base : most_narrow_base));
      const unsigned low = quantile(found.lengths[k], 1, 16);
      least = std::min(least, low > coding.base[k] ? 2 * (low - coding.base[k]) : 0u);
    }
    coding.first_size = static_cast<uint8_t>(least);
    coding.first_spread = static_cast<uint8_t>(quantile(found.octaves, 1, 32));
    return coding;
  }
  template <size_t n>
  static unsigned quantile(const std::array<uint32_t, n>& counts, uint64_t part, uint64_t of) {
    uint64_t sum = 0, below = 0;
    for (const uint32_t count : counts) sum += count;
    unsigned i = 0;
    while (i + 1 < n && (below += counts[i]) * of < sum * part) ++i;
    return i;
  }

  const Patch& patch_;
  const CodedNumbers& numbers_;
  const Effort& effort_;
  std::unique_ptr<Runs> runs_;
  Tried best_;
  bool is_new_ = false;       ///< not that of a lower effort
  std::vector<Tried> steps_;  ///< those of lower efforts, from samples
  Coding by_gate_, by_fitted_;
  bool has_repeated_ = false;  ///< enough for candidates: with fewer they saved 3 % at most
};

}  // namespace

ChosenCoding choose_coding(const Patch& patch, const CodedNumbers& numbers, const Effort& effort,
                           bool exact) {
  return CodingChooser(patch, numbers, effort).choose(exact);
}

}  // namespace maille::positions
