#pragma once

#include <maille/source.h>

#include <cstdlib>
#include <map>
#include <memory>
#include <vector>

namespace maille::wasm {

struct ByteRange {
  uint64_t offset = 0, size = 0;
};

/// A file of which bytes arrive bit by bit. What is asked for too early is an error of kind `network`, and
/// the ranges are remembered: whoever called fetches them and calls again. WebAssembly cannot wait for a
/// request.
class ArrivedBytes final : public Source {
 public:
  ArrivedBytes(uint64_t size, std::string name) : size_(size), name_(std::move(name)) {}

  uint64_t size() const override { return size_; }
  std::string name() const override { return name_; }
  Result<> read_at(uint64_t offset, std::span<std::byte> out) const override;
  /// Whatever of all parts is missing is wanted, not only the first.
  Result<> read_many(std::span<const Part> parts) const override;

  /// Takes `bytes`, which malloc() gave. Bytes beyond the end of the file are ignored.
  void add(uint64_t offset, std::byte* bytes, size_t size);
  /// Forgets what lies outside of the first `kept` bytes.
  void forget_behind(uint64_t kept);

  /// The ranges that were missing since the last call.
  std::vector<ByteRange> take_wanted();
  /// From now on nothing is here: what a call asks for first is learnt without doing its work.
  void pretend_empty(bool on) { empty_ = on; }

 private:
  struct Free {
    void operator()(std::byte* bytes) const { std::free(bytes); }
  };
  struct Piece {
    std::unique_ptr<std::byte, Free> bytes;
    size_t size = 0;
  };
  Error out_of_reach(uint64_t end) const;
  /// Fills `out` as far as it can, and notes what is missing; false: something is.
  bool take(uint64_t offset, std::span<std::byte> out) const;
  /// Bytes from `offset` on that are here without a gap.
  Bytes here(uint64_t offset) const;

  uint64_t size_;
  std::string name_;
  std::map<uint64_t, Piece> pieces_;  ///< by offset; they may overlap
  mutable std::vector<ByteRange> wanted_;
  bool empty_ = false;
};

}  // namespace maille::wasm
