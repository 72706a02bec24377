// Indices predicted from indices alone, after HexZip (Lindstrom and Isenburg, 2008) as its papers describe
// it: what one pass with a few hundred kilobytes of memory can do without looking at the mesh.
#include <array>
#include "array_codec.h"
#include "entropy/bit_model.h"
#include "entropy/mixing.h"
#include "volume/cells/decisions.h"

namespace maille::bench {
namespace {

using Buffer = std::vector<std::byte>;

/// For each corner a table: what the two steps before at this corner, and the step just made at the corner
/// before, led to last time. An entry that fails twice is replaced.
template <class Coder>
class IndexCoder {
 public:
  explicit IndexCoder(size_t corners)
      : corners_(corners),
        tables_(corners * table_size),
        flags_(corners * 256),
        before_(corners),
        earlier_(corners) {}

  void code(Coder& coder, std::vector<uint32_t>& cell) {
    for (size_t i = 0; i < corners_; ++i) {
      const uint32_t along = before_[i] - earlier_[i];
      const uint32_t across = i == 0 ? last_step_ : cell[i - 1] - before_[i - 1];
      Entry& entry = tables_[i * table_size + ((across << table_bits / 2) + along) % table_size];
      const uint32_t expected = before_[i] + along + entry.correction;
      const bool hit = flags_[i * 256 + history_].code(coder, cell[i] == expected);
      history_ = (history_ * 2 + (hit ? 0u : 1u)) & 255;
      if (hit) {
        cell[i] = expected;
      } else {
        code_miss(coder, cell, i);
      }
      learn(entry, hit, cell[i] - before_[i] - along);
      last_step_ = cell[i] - before_[i];
    }
    earlier_ = before_;
    before_ = cell;
  }

 private:
  struct Entry {
    uint32_t correction = 0;
    bool sure = false;
  };
  static constexpr unsigned table_bits = 12;
  static constexpr uint32_t table_size = 1u << table_bits;

  static void learn(Entry& entry, bool hit, uint32_t correction) {
    if (!hit && !entry.sure) entry.correction = correction;
    entry.sure = hit;
  }
  /// The difference to what came closest of late: the same corner of the cell before, or the corner one, two,
  /// ... places before.
  void code_miss(Coder& coder, std::vector<uint32_t>& cell, size_t i) {
    size_t best = 0;
    for (size_t k = 1; k <= std::min<size_t>(i, 4); ++k) {
      if (cost_[k] < cost_[best]) best = k;
    }
    const auto reference = [&](size_t k) { return k == 0 ? before_[i] : cell[i - k]; };
    const auto difference = static_cast<int32_t>(cell[i] - reference(best));
    cell[i] = reference(best) + static_cast<uint32_t>(differences_[best].code(coder, difference));
    for (size_t k = 0; k <= std::min<size_t>(i, 4); ++k) {
      const auto apart = static_cast<int32_t>(cell[i] - reference(k));
      const uint64_t size = apart < 0 ? ~static_cast<uint32_t>(apart) : static_cast<uint32_t>(apart);
      cost_[k] = (cost_[k] * 7 + size * 16) / 8;
    }
  }

  size_t corners_;
  std::vector<Entry> tables_;
  std::vector<RunModel> flags_;
  std::vector<uint32_t> before_, earlier_;
  std::array<DifferenceModel, 5> differences_;
  std::array<uint64_t, 5> cost_{};
  uint32_t history_ = 0, last_step_ = 0;
};

template <class Coder>
void code_cells(Coder& coder, const Part& part, Buffer& bytes) {
  IndexCoder<Coder> indices(part.components);
  std::vector<uint32_t> cell(part.components);
  for (size_t at = 0; at < part.bytes.size(); at += part.components * 4) {
    if constexpr (Coder::encoding) std::memcpy(cell.data(), part.bytes.data() + at, part.components * 4);
    indices.code(coder, cell);
    if constexpr (!Coder::encoding) std::memcpy(bytes.data() + at, cell.data(), part.components * 4);
  }
}

class IndexPrediction final : public ArrayCodec {
 public:
  std::string name() const override { return "index prediction"; }
  bool takes(const Part& part) const override {
    return part.holds == Part::Holds::connectivity && part.type == Scalar::i32;
  }
  Result<Buffer> pack(const Part& part) const override {
    RangeEncoder coder;
    Buffer none;
    code_cells(coder, part, none);
    return coder.finish();
  }
  Result<Buffer> unpack(Bytes packed, const Part& like) const override {
    RangeDecoder coder(packed);
    Buffer bytes(like.bytes.size());
    code_cells(coder, like, bytes);
    return bytes;
  }
};

}  // namespace

void add_index_codec(ArrayCodecs& codecs) {
  codecs.push_back(std::make_unique<IndexPrediction>());
}

}  // namespace maille::bench
