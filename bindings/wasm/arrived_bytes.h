#pragma once

#include <maille/source.h>

#include <map>
#include <optional>
#include <vector>

namespace maille::wasm {

struct ByteRange {
  uint64_t offset = 0, size = 0;
};

/// A file of which bytes arrive bit by bit. What is asked for too early is an error of kind `network`, and
/// the range is remembered: whoever called fetches it and calls again. WebAssembly cannot wait for a request.
class ArrivedBytes final : public Source {
 public:
  ArrivedBytes(uint64_t size, std::string name) : size_(size), name_(std::move(name)) {}

  uint64_t size() const override { return size_; }
  std::string name() const override { return name_; }
  Result<> read_at(uint64_t offset, std::span<std::byte> out) const override;

  /// Bytes beyond the end of the file are ignored.
  void add(uint64_t offset, Bytes bytes);
  /// Forgets what lies outside of the first `kept` bytes.
  void forget_behind(uint64_t kept);
  uint64_t held() const { return held_; }

  /// The first range that was missing since the last call.
  std::optional<ByteRange> take_wanted();

 private:
  /// Bytes from `offset` on that are here without a gap.
  const std::vector<std::byte>* piece_with(uint64_t offset, uint64_t& begin) const;

  uint64_t size_;
  std::string name_;
  std::map<uint64_t, std::vector<std::byte>> pieces_;  ///< by offset; they may overlap
  uint64_t held_ = 0;
  mutable std::optional<ByteRange> wanted_;
};

}  // namespace maille::wasm
