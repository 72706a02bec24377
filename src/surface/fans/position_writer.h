#pragma once

// What the encoder of positions says: symbols and raw bits, and what they take with tables of their own.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/bytes.h"
#include "entropy/rans.h"
#include "surface/fans/position_streams.h"

namespace maille::positions {

/// Tuples of codes, one behind the other.
struct Codes {
  unsigned components = 3;
  std::vector<int64_t> numbers;

  Codes() = default;
  Codes(unsigned n, size_t tuples) : components(n), numbers(n * tuples) {}
  size_t size() const { return numbers.size() / components; }
  int64_t* operator[](size_t tuple) { return numbers.data() + tuple * components; }
  const int64_t* operator[](size_t tuple) const { return numbers.data() + tuple * components; }
};
using Bias = std::array<int64_t, most_components>;

/// Remembers symbols, and writes raw bits: tables can be made only when all symbols are known, and raw bits
/// need none. It has the calls of the decoder's Reader.
class Writer {
 public:
  static constexpr bool encoding = true;

  /// `tables`: none yet: all symbols are possible.
  explicit Writer(const std::vector<StaticTables>* tables = nullptr) : tables_(tables) {}

  struct Event {
    uint16_t context;
    uint8_t symbol, lane;
  };

  template <unsigned lane>
  unsigned symbol(uint32_t context, unsigned symbol) {
    events.push_back({static_cast<uint16_t>(context), static_cast<uint8_t>(symbol), lane});
    return symbol;
  }
  uint64_t raw(uint64_t value, unsigned count) {
    raw_bits += count;
    // Values have no bits beyond `count`, and waiting_bits_ is at most 63 here.
    waiting_ |= value << waiting_bits_;
    const unsigned room = 64 - waiting_bits_;
    if (count < room) {
      waiting_bits_ += count;
      return value;
    }
    bytes_.put(waiting_);
    // A shift by 64 is undefined; then nothing of the value is left.
    waiting_ = room < 64 ? value >> room : 0;
    waiting_bits_ = count - room;
    return value;
  }
  bool is_possible(uint32_t context, unsigned symbol) const {
    return tables_ == nullptr || (*tables_)[0].of(context).frequency[symbol] != 0;
  }

  std::vector<std::byte> take_raw() {
    for (; waiting_bits_ > 0; waiting_bits_ -= std::min(waiting_bits_, 8u), waiting_ >>= 8)
      bytes_.put(static_cast<uint8_t>(waiting_));
    return bytes_.take();
  }
  std::vector<Event> events;
  uint64_t raw_bits = 0;

 private:
  const std::vector<StaticTables>* tables_;
  ByteWriter bytes_;
  uint64_t waiting_ = 0;
  unsigned waiting_bits_ = 0;
};

/// Writes rows, dictionaries and tables for what a writer was told, to `side`, and returns the tables.
/// `shared`: they are for other patches, too, so that escapes have a place in every table.
std::vector<StaticTables> write_side(Coding coding, const std::vector<Writer::Event>& events, bool shared,
                                     RansEncoder& side);
std::vector<std::byte> write_symbols(const Coding& coding, const std::vector<Writer::Event>& events,
                                     const std::vector<StaticTables>& tables);
/// The bits that the events take with these tables, without states: frequencies as prices, counted in 1/65536
/// bits.
double bits_of(const Coding& coding, const std::vector<Writer::Event>& events,
               const std::vector<StaticTables>& tables);

}  // namespace maille::positions
