#include "arrived_bytes.h"

#include <algorithm>
#include <iterator>

namespace maille::wasm {

const std::vector<std::byte>* ArrivedBytes::piece_with(uint64_t offset, uint64_t& begin) const {
  for (auto at = pieces_.upper_bound(offset); at != pieces_.begin();) {
    --at;
    if (offset - at->first < at->second.size()) {
      begin = at->first;
      return &at->second;
    }
  }
  return nullptr;
}

Result<> ArrivedBytes::read_at(uint64_t offset, std::span<std::byte> out) const {
  if (offset > size_ || out.size() > size_ - offset)
    return failure(ErrorCode::cannot_read,
                   name_ + ": ends before byte " + std::to_string(offset + out.size()));
  for (size_t done = 0; done < out.size();) {
    uint64_t begin = 0;
    const std::vector<std::byte>* piece = piece_with(offset + done, begin);
    if (piece == nullptr) {
      if (!wanted_) wanted_ = {offset + done, out.size() - done};
      return failure(ErrorCode::network,
                     name_ + ": bytes from " + std::to_string(offset + done) + " on have not arrived yet");
    }
    const auto from = static_cast<size_t>(offset + done - begin);
    const size_t count = std::min(piece->size() - from, out.size() - done);
    std::copy_n(piece->data() + from, count, out.data() + done);
    done += count;
  }
  return {};
}

void ArrivedBytes::add(uint64_t offset, Bytes bytes) {
  if (offset >= size_) return;
  bytes = bytes.first(static_cast<size_t>(std::min<uint64_t>(bytes.size(), size_ - offset)));
  std::vector<std::byte>& piece = pieces_[offset];
  if (piece.size() >= bytes.size()) return;
  held_ += bytes.size() - piece.size();
  piece.assign(bytes.begin(), bytes.end());
}

void ArrivedBytes::forget_behind(uint64_t kept) {
  for (auto at = pieces_.lower_bound(kept); at != pieces_.end();) {
    held_ -= at->second.size();
    at = pieces_.erase(at);
  }
}

std::optional<ByteRange> ArrivedBytes::take_wanted() {
  return std::exchange(wanted_, std::nullopt);
}

}  // namespace maille::wasm
