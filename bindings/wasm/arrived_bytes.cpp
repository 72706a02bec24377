#include "arrived_bytes.h"

#include <algorithm>
#include <utility>

namespace maille::wasm {

// Pieces may overlap, as the page fetches ranges as it likes. The one that begins last is looked at first; an
// earlier one may still reach farther.
Bytes ArrivedBytes::here(uint64_t offset) const {
#ifndef MAILLE_CHART_DECODER
  if (empty_) return {};
#endif
  for (auto at = pieces_.upper_bound(offset); at != pieces_.begin();) {
    --at;
    const uint64_t within = offset - at->first;
    if (within < at->second.size)
      return Bytes(at->second.bytes.get(), at->second.size).subspan(static_cast<size_t>(within));
  }
  return {};
}

// What is missing is noted in whole, not only its first byte: the page fetches it all before the next try.
bool ArrivedBytes::take(uint64_t offset, std::span<std::byte> out) const {
  while (!out.empty()) {
    const Bytes found = here(offset);
    if (found.empty()) {
      wanted_.push_back({offset, out.size()});
      return false;
    }
    const size_t count = std::min(found.size(), out.size());
    std::copy_n(found.data(), count, out.data());
    out = out.subspan(count);
    offset += count;
  }
  return true;
}

Error ArrivedBytes::out_of_reach(uint64_t end) const {
  return {ErrorCode::cannot_read, name_ + ": ends before byte " + std::to_string(end)};
}

Result<> ArrivedBytes::read_at(uint64_t offset, std::span<std::byte> out) const {
  const Part part = {offset, out};
  return read_many({&part, 1});
}

Result<> ArrivedBytes::read_many(std::span<const Part> parts) const {
  // All parts are asked for even when the first has not arrived, so that one round trip brings what is
  // missing of all.
  bool all = true;
  for (const Part& part : parts) {
    if (part.offset > size_ || part.out.size() > size_ - part.offset)
      return tl::unexpected(out_of_reach(part.offset + part.out.size()));
    all = take(part.offset, part.out) && all;
  }
  if (all) return {};
  return tl::unexpected(Error{ErrorCode::network, name_ + ": bytes have not arrived yet"});
}

// Takes over the memory that the page has filled, also if it is not needed: then it is freed here.
void ArrivedBytes::add(uint64_t offset, std::byte* bytes, size_t size) {
  Piece piece = {std::unique_ptr<std::byte, Free>(bytes), size};
  if (offset >= size_) return;
  piece.size = static_cast<size_t>(std::min<uint64_t>(size, size_ - offset));
  Piece& known = pieces_[offset];
  // Of two pieces that begin at one place the longer one has all of the other.
  if (known.size < piece.size) known = std::move(piece);
}

void ArrivedBytes::forget_behind(uint64_t kept) {
  pieces_.erase(pieces_.lower_bound(kept), pieces_.end());
}

std::vector<ByteRange> ArrivedBytes::take_wanted() {
  return std::exchange(wanted_, {});
}

}  // namespace maille::wasm
