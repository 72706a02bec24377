#pragma once

#include <cstdint>
#include <span>

namespace maille {

/// XXH3, 64 bits, seed 0: the checksum of the file format. It finds damage, not forgery.
uint64_t hash64(std::span<const std::byte> bytes);

/// Mixes two words; for hash tables, never in the format.
inline uint64_t hash_mix(uint64_t a, uint64_t b) {
  uint64_t x = (a ^ (b + 0x9e3779b97f4a7c15u + (a << 6) + (a >> 2))) * 0xbf58476d1ce4e5b9u;
  return x ^ (x >> 29);
}

/// The finalizer of SplitMix64 (Steele, Lea, Flood 2014): any bit of the input changes half of those of the
/// output. Samples are drawn by it, so it has to stay as it is.
inline uint64_t split_mix(uint64_t x) {
  x += 0x9e3779b97f4a7c15;
  x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9;
  x = (x ^ x >> 27) * 0x94d049bb133111eb;
  return x ^ x >> 31;
}

}  // namespace maille
