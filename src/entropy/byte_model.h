#pragma once

#include <maille/source.h>

#include <cstddef>
#include <vector>

namespace maille {

/// Texts and other bytes of no known structure: each byte is coded bit by bit in the context of the byte
/// before. The number of bytes is not in the result. docs/format.md, 10.2, byte(M).
std::vector<std::byte> encode_bytes(Bytes bytes);

/// Inverse: at most `size` bytes, fewer when the coded bytes end early. Memory grows as bytes come, so `size`
/// may be what a damaged file claims.
std::vector<std::byte> decode_bytes(Bytes coded, uint64_t size);

}  // namespace maille
