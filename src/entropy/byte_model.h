#pragma once

#include <maille/source.h>

#include <cstddef>
#include <vector>

namespace maille {

/// Coded bytes bring back at most as many times their number, so that a file of a kilobyte cannot ask for a
/// second of work: a million empty labels took 1,045 us for each byte of their file, 100 times as long as the
/// dearest mesh (tests/faults/mutate.cpp). Texts that people wrote shrink to a tenth at best.
inline constexpr uint64_t most_bytes_per_coded_byte = 64;

/// Texts and other bytes of no known structure: each byte is coded bit by bit in the context of the byte
/// before. The number of bytes is not in the result. What would be shorter than the bound above allows is
/// followed by zeros. docs/format.md, 10.2, byte(M), and 11.1.
std::vector<std::byte> encode_bytes(Bytes bytes);

/// Inverse: at most `size` bytes, fewer when the coded bytes end early, and none when `size` breaks the bound
/// above. Memory grows as bytes come, so `size` may be what a damaged file claims.
std::vector<std::byte> decode_bytes(Bytes coded, uint64_t size);

}  // namespace maille
