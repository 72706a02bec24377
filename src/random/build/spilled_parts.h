#pragma once

#include <algorithm>
#include <vector>

#include "base/result.h"
#include "base/scratch_file.h"

namespace maille {

/// Bytes dealt to parts in any order, and read back a part at a time: a temporary file, and a buffer for each
/// part.
class SpilledParts {
 public:
  /// `memory`: for all buffers together, about.
  static Result<SpilledParts> create(const std::string& folder, size_t parts, uint64_t memory) {
    return SpilledParts(MAILLE_TRY(ScratchFile::create(folder)), parts,
                        static_cast<size_t>(std::clamp<uint64_t>(memory / parts, 1 << 12, 1 << 16)));
  }

  Result<> append(size_t part, Bytes bytes) {
    std::vector<std::byte>& waiting = waiting_[part];
    waiting.insert(waiting.end(), bytes.begin(), bytes.end());
    if (waiting.size() < buffer_bytes_) return {};
    pieces_[part].push_back({file_.size(), waiting.size()});
    MAILLE_CHECK(file_.write_at(file_.size(), waiting));
    waiting.clear();
    return {};
  }
  /// Several times, if need be.
  Result<std::vector<std::byte>> load(size_t part) {
    uint64_t size = waiting_[part].size();
    for (const Piece& piece : pieces_[part]) size += piece.size;
    std::vector<std::byte> bytes(size);
    std::span<std::byte> left(bytes);
    for (const Piece& piece : pieces_[part]) {
      MAILLE_CHECK(file_.read_at(piece.offset, left.first(piece.size)));
      left = left.subspan(piece.size);
    }
    std::copy(waiting_[part].begin(), waiting_[part].end(), left.begin());
    return bytes;
  }

 private:
  struct Piece {
    uint64_t offset, size;
  };
  SpilledParts(ScratchFile file, size_t parts, size_t buffer_bytes)
      : file_(std::move(file)), buffer_bytes_(buffer_bytes), waiting_(parts), pieces_(parts) {}

  ScratchFile file_;
  size_t buffer_bytes_;
  std::vector<std::vector<std::byte>> waiting_;
  std::vector<std::vector<Piece>> pieces_;  ///< by part
};

}  // namespace maille
