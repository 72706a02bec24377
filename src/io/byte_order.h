#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/bytes.h"

namespace maille {

template <class T, class Swap>
void swap_all(std::span<std::byte> bytes, Swap swap) {
  for (size_t at = 0; at + sizeof(T) <= bytes.size(); at += sizeof(T)) {
    store(bytes.data() + at, static_cast<T>(swap(load<T>(bytes.data() + at))));
  }
}

/// Turns the byte order of numbers of the given size; of single bytes there is none.
inline void swap_numbers(std::span<std::byte> bytes, size_t size) {
  if (size == 2) swap_all<uint16_t>(bytes, [](uint16_t x) { return __builtin_bswap16(x); });
  if (size == 4) swap_all<uint32_t>(bytes, [](uint32_t x) { return __builtin_bswap32(x); });
  if (size == 8) swap_all<uint64_t>(bytes, [](uint64_t x) { return __builtin_bswap64(x); });
}

}  // namespace maille
