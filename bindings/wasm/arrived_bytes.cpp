#include "arrived_bytes.h"

#include <algorithm>
#include <utility>

namespace maille::wasm {

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
  bool all = true;
  for (const Part& part : parts) {
    if (part.offset > size_ || part.out.size() > size_ - part.offset)
      return tl::unexpected(out_of_reach(part.offset + part.out.size()));
    all = take(part.offset, part.out) && all;
  }
  if (all) return {};
  return tl::unexpected(Error{ErrorCode::network, name_ + ": bytes have not arrived yet"});
}

void ArrivedBytes::add(uint64_t offset, std::byte* bytes, size_t size) {
  Piece piece = {std::unique_ptr<std::byte, Free>(bytes), size};
  if (offset >= size_) return;
  piece.size = static_cast<size_t>(std::min<uint64_t>(size, size_ - offset));
  Piece& known = pieces_[offset];
  if (known.size < piece.size) known = std::move(piece);
}

void ArrivedBytes::forget_behind(uint64_t kept) {
  pieces_.erase(pieces_.lower_bound(kept), pieces_.end());
}

std::vector<ByteRange> ArrivedBytes::take_wanted() {
  return std::exchange(wanted_, {});
}

}  // namespace maille::wasm
