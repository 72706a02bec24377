#include "numbers/refined_numbers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "entropy/bit_model.h"
#include "entropy/rans.h"
#include "mesh/none.h"
#include "numbers/coarse_maps.h"
#include "numbers/number_maps.h"

namespace maille {
namespace {

// Models of one component take 400 KB: a damaged file must not ask for thousands.
constexpr size_t most_components = 16;
// Refining a map that is not curved spares the price that a table has to pay there: this is the difference of
// the two prices in make_table(), in 1/1024 bits.
constexpr int64_t bits_of_steps = 448;

/// The exact code from which details count.
int64_t base_of(const NumberMap& coarse, const NumberMap& exact, int64_t code) {
  return exact.nearest_code(Scalar::f64, coarse.value_of(Scalar::f64, code));
}

/// Details of one component. What was behind a code the last time is likely to be there again; else the
/// trailing zeros say what the number comes from, and the rest how far. Places are kept by a hash of the
/// code: one that another code took is forgotten, on both sides alike.
class DetailModel {
 public:
  explicit DetailModel(size_t tuples)
      : seen_bits_(std::clamp(bit_length(tuples) + 1, least_seen_bits, most_seen_bits)),
        seen_(size_t{1} << seen_bits_) {}

  /// `others`: which other details of the tuple are zero.
  template <class Coder>
  int64_t code(Coder& coder, int64_t base, unsigned others, int64_t detail) {
    Seen& seen = seen_[static_cast<uint64_t>(base) * 0x9e3779b97f4a7c15u >> (64 - seen_bits_)];
    const bool known = seen.met && seen.base == base;
    if (known && same_[seen.detail == 0].code(coder, detail == seen.detail)) return seen.detail;
    detail = code_new(coder, others, detail);
    seen = {base, detail, true};
    return detail;
  }

 private:
  struct Seen {
    int64_t base = 0;
    int64_t detail = 0;
    bool met = false;
  };
  // Twice as many as there are tuples: with 2^14 for each chart clearing them took half of a chart's time.
  static constexpr unsigned least_seen_bits = 6, most_seen_bits = 14;

  template <class Coder>
  int64_t code_new(Coder& coder, unsigned others, int64_t detail) {
    const bool zero = zero_[others][history_].code(coder, detail == 0);
    history_ = (history_ << 1 | (zero ? 1u : 0u)) & 7;
    if (zero) return 0;
    const bool negative = sign_.code(coder, detail < 0);
    const uint64_t size =
        negative ? uint64_t{0} - static_cast<uint64_t>(detail) : static_cast<uint64_t>(detail);
    zeros_ =
        code_six(coder, zero_bits_[zeros_], size == 0 ? 0 : static_cast<unsigned>(__builtin_ctzll(size)));
    const unsigned length =
        1 + code_six(coder, length_[std::min(zeros_, 7u)], bit_length(size >> zeros_) - (size == 0 ? 0 : 1));
    const uint64_t found = code_odd(coder, length, size >> zeros_) << zeros_;
    return static_cast<int64_t>(negative ? uint64_t{0} - found : found);
  }

  using Tree = std::array<BitModel, 64>;
  template <class Coder>
  static unsigned code_six(Coder& coder, Tree& tree, unsigned value) {
    unsigned prefix = 1;
    for (unsigned i = 6; i-- > 0;)
      prefix = prefix << 1 | (tree[prefix].code(coder, (value >> i & 1) != 0) ? 1u : 0u);
    return prefix - 64;
  }
  /// An odd number of so many bits: the first and the last are known, the second is modelled.
  template <class Coder>
  uint64_t code_odd(Coder& coder, unsigned length, uint64_t odd) {
    if (length == 1) return 1;
    uint64_t value = 1;
    unsigned left = length - 1;
    if (left > 1) {
      --left;
      value = 2 | (second_[length].code(coder, (odd >> left & 1) != 0) ? 1u : 0u);
    }
    while (left > 1) {
      const unsigned count = std::min(left - 1, 16u);
      left -= count;
      value =
          value << count | coder.code_raw(static_cast<uint32_t>(odd >> left & ((1u << count) - 1)), count);
    }
    return value << 1 | 1;
  }

  unsigned seen_bits_;
  std::vector<Seen> seen_;
  BitModel same_[2];
  BitModel zero_[4][8];
  BitModel sign_;
  // Chosen by the zeros of the detail before, since numbers from one kind of computation come in runs.
  std::array<Tree, 64> zero_bits_;
  std::array<Tree, 8> length_;
  std::array<BitModel, 65> second_;
  unsigned history_ = 0;
  unsigned zeros_ = 0;
};

/// Codes the details of tuples in coded order. `detail` gives one when encoding, and takes what was decoded.
class DetailCoder {
 public:
  DetailCoder(const RefinedMaps& maps, size_t tuples) : maps_(maps) {
    for (const bool refined : maps.refined)
      models_.push_back(refined ? std::make_unique<DetailModel>(tuples) : nullptr);
  }
  template <class Coder, class CodeAt, class ExactAt, class Store>
  void code_tuple(Coder& coder, CodeAt code_at, ExactAt exact_at, Store store) {
    // A tuple whose first numbers are on the coarse map is likely to be so as a whole.
    unsigned others = 0;
    for (size_t k = 0; k < models_.size(); ++k) {
      if (!models_[k]) continue;
      const auto base = static_cast<uint64_t>(base_of(maps_.coarse[k], maps_.exact[k], code_at(k)));
      auto detail = static_cast<int64_t>(static_cast<uint64_t>(exact_at(k)) - base);
      detail = models_[k]->code(coder, static_cast<int64_t>(base), others, detail);
      others = (others << 1 | (detail == 0 ? 1u : 0u)) & 3;
      store(k, static_cast<int64_t>(base + static_cast<uint64_t>(detail)));
    }
  }

 private:
  const RefinedMaps& maps_;
  std::vector<std::unique_ptr<DetailModel>> models_;
};

}  // namespace

bool RefinedMaps::any() const {
  return std::find(refined.begin(), refined.end(), true) != refined.end();
}

RefinedMaps refine_maps(const Array& array, std::span<const NumberMap> maps,
                        std::span<const uint32_t> source) {
  RefinedMaps result;
  result.exact.assign(maps.begin(), maps.end());
  result.refined.assign(maps.size(), false);
  std::vector<int64_t> savings;
  result.coarse = with_tables(array, result.exact, source, &savings);
  const bool can_refine = array.type == Scalar::f64 && maps.size() <= most_components;
  for (uint32_t k = 0; can_refine && k < maps.size(); ++k) {
    const auto found = find_coarse_map(array, k, maps[k], source);
    if (!found) continue;
    // Codes in steps are predicted more exactly than ranks.
    const int64_t steps = found->map.is_curved() ? 0 : bits_of_steps * static_cast<int64_t>(source.size());
    if (found->saving + steps <= savings[k]) continue;
    result.coarse[k] = found->map;
    result.refined[k] = true;
  }
  return result;
}

void write_exact_maps(ByteWriter& out, const RefinedMaps& maps) {
  for (size_t k = 0; k < maps.refined.size(); ++k) {
    out.put(static_cast<uint8_t>(maps.refined[k] ? 1 : 0));
    if (maps.refined[k]) write_map(out, maps.exact[k]);
  }
}

Result<RefinedMaps> read_exact_maps(ByteReader& in, std::vector<NumberMap> coarse) {
  const auto corrupt = [] { return failure(ErrorCode::corrupt, "an array has damaged details of numbers"); };
  if (coarse.size() > most_components) return corrupt();
  RefinedMaps read;
  for (const NumberMap& map : coarse) {
    const auto refined = in.get<uint8_t>();
    if (!in.ok() || refined > 1) return corrupt();
    read.refined.push_back(refined == 1);
    read.exact.push_back(map);
    if (refined == 1) read.exact.back() = MAILLE_TRY(read_map(in, Scalar::f64));
  }
  read.coarse = std::move(coarse);
  return read;
}

std::vector<std::byte> encode_details(const RefinedMaps& maps, const Array& array,
                                      std::span<const uint32_t> source) {
  RansEncoder encoder(1);
  DetailCoder details(maps, source.size());
  for (const uint32_t tuple : source) {
    const auto number = [&](size_t k) {
      return array.bytes.data() + (size_t{tuple} * array.components + k) * sizeof(double);
    };
    // Gaps have code 0 and no detail.
    details.code_tuple(
        encoder, [&](size_t k) { return tuple == none ? 0 : maps.coarse[k].code_of(Scalar::f64, number(k)); },
        [&](size_t k) {
          return tuple == none ? base_of(maps.coarse[k], maps.exact[k], 0)
                               : maps.exact[k].code_of(Scalar::f64, number(k));
        },
        [](size_t, int64_t) {});
  }
  return encoder.finish();
}

Result<> store_refined(const RefinedMaps& maps, Bytes details, std::span<int64_t> codes) {
  RansDecoder decoder(details, 1);
  const size_t components = maps.refined.size();
  DetailCoder coder(maps, codes.size() / components);
  for (size_t first = 0; first + components <= codes.size(); first += components) {
    coder.code_tuple(
        decoder, [&](size_t k) { return codes[first + k]; }, [](size_t) { return int64_t{0}; },
        [&](size_t k, int64_t exact) {
          std::byte number[8];
          maps.exact[k].store_number(Scalar::f64, exact, number);
          codes[first + k] = load<int64_t>(number);
        });
    if (decoder.exhausted())
      return failure(ErrorCode::corrupt, "the details of an array's numbers end early");
  }
  return {};
}

}  // namespace maille
