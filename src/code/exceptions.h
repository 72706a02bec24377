#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/held_bytes.h"
#include "entropy/bit_model.h"

namespace maille {

/// Numbers of an array that its map does not hold (NaN, infinities, outliers): a mask, and the bits of each.
/// They mostly stand side by side (a region without values) and are mostly alike (one NaN, one fill value),
/// so that the neighbours tell most of the mask, and the exception before tells the bits. A block of 10 % NaN
/// makes an array 1.05 times as large at most; it was 2.4 times (52df2eb).
///
/// For values of volumes, whose tuples stand in slots that are used again: memory is what slots take, not the
/// mesh.
class Exceptions {
 public:
  explicit Exceptions(unsigned components) : components_(components), last_(components) {}

  /// Components come in order, tuple by tuple; some may be left out. `near`: slots of the neighbours; the
  /// state goes to `slot`.
  template <class Coder>
  bool code(Coder& coder, bool exception, unsigned component, std::span<const uint32_t> near, uint32_t slot) {
    // Components come in rising order, so a lower one begins a new tuple.
    if (component <= component_) before_ = 0;
    component_ = component;
    exception = mask_[context_of(component, near)].code(coder, exception);
    before_ = exception ? 2 : 1;
    last_[component] = exception;
    met_ = met_ || exception;
    if (!met_) return false;
    const size_t place = size_t{slot} * components_ + component;
    // Slots are numbers that the decoder gave out itself, so a file cannot make this large.
    if (place >= states_.size()) states_.resize(place + place / 8 + 64);
    states_[place] = exception;
    return exception;
  }

  /// The number itself, of 1, 2, 4 or 8 bytes.
  template <class Coder>
  uint64_t code_bits(Coder& coder, uint64_t bits, size_t size) {
    again_before_ = again_[again_before_].code(coder, bits == known_) ? 1 : 0;
    if (again_before_ != 0) return known_;
    uint64_t read = 0;
    // The bits are written raw, since nothing is known about the distribution of numbers that no map holds.
    for (unsigned at = 0; at < 8 * size; at += 16) {
      const unsigned width = size == 1 ? 8 : 16;
      const auto part = static_cast<uint32_t>(bits >> at & ((1u << width) - 1));
      read |= uint64_t{coder.code_raw(part, width)} << at;
    }
    known_ = read;
    return read;
  }

  uint64_t bytes() const { return bytes_held(states_); }

 private:
  bool state_of(size_t place) const { return place < states_.size() && states_[place] != 0; }
  unsigned context_of(unsigned component, std::span<const uint32_t> near) const {
    if (!met_) return 0;
    size_t count = 0;
    for (const uint32_t slot : near) count += state_of(size_t{slot} * components_ + component);
    const unsigned last = last_[component];
    const unsigned around = near.empty() ? 2 * last : count == 0 ? 0 : count < near.size() ? 1 : 2;
    // 0 before any exception; else 3 * 2 * 3 contexts from 1 on.
    return 1 + (around * 2 + last) * 3 + before_;
  }

  unsigned components_;
  bool met_ = false;  ///< an exception; until then there is one context, and no slot has a state
  unsigned component_ = 0;
  unsigned before_ = 0;          ///< the component before: 0 none, 1 no exception, 2 an exception
  std::vector<uint8_t> last_;    ///< of the tuple before, by component
  std::vector<uint8_t> states_;  ///< by slot and component
  std::array<BitModel, 19> mask_;
  std::array<BitModel, 2> again_;
  unsigned again_before_ = 0;
  uint64_t known_ = 0;  ///< bits of the exception before
};

}  // namespace maille
