#pragma once

#include <maille/mesh.h>
#include <maille/source.h>
#include <maille/with_type.h>
#include <charconv>
#include <cstring>
#include <string_view>
#include <vector>
#include "base/result.h"

namespace maille {

/// Collects output and hands it to a sink a megabyte at a time. An error of the sink is remembered and
/// returned by finish(); what is put after it is thrown away. So writers of text need no check at each
/// number, and must not forget finish(): without it the last megabyte is lost.
class BufferedWriter {
 public:
  explicit BufferedWriter(Sink& sink) : sink_(sink), buffer_(capacity) {}

  void put(char c) {
    make_room(1);
    buffer_[used_++] = static_cast<std::byte>(c);
  }
  void put(std::string_view text) { put_bytes(std::as_bytes(std::span(text.data(), text.size()))); }
  void put_bytes(Bytes bytes) {
    // Large arrays go past the buffer: copying them would cost a second pass over memory.
    if (bytes.size() > capacity / 2) {
      flush();
      if (status_) status_ = sink_.write(bytes);
      return;
    }
    make_room(bytes.size());
    if (!bytes.empty()) std::memcpy(buffer_.data() + used_, bytes.data(), bytes.size());
    used_ += bytes.size();
  }
  /// A number in its own bytes, in the order of this machine.
  template <class T>
  void put_raw(T value) {
    make_room(sizeof value);
    std::memcpy(buffer_.data() + used_, &value, sizeof value);
    used_ += sizeof value;
  }
  /// The shortest text that reads back as the same number of the same type, which std::to_chars guarantees.
  /// The locale has no influence.
  template <class T>
  void put_number(T value) {
    constexpr size_t longest = 32;  // -1.7976931348623157e+308
    make_room(longest);
    char* const from = reinterpret_cast<char*>(buffer_.data() + used_);
    used_ += static_cast<size_t>(std::to_chars(from, from + longest, value).ptr - from);
  }

  Result<> finish() {
    flush();
    return status_;
  }

 private:
  // Chosen, not swept: a write to the system for each megabyte costs nothing beside printing it.
  static constexpr size_t capacity = size_t{1} << 20;

  void make_room(size_t size) {
    if (capacity - used_ < size) flush();
  }
  void flush() {
    if (used_ != 0 && status_) status_ = sink_.write(Bytes(buffer_.data(), used_));
    used_ = 0;
  }

  Sink& sink_;
  std::vector<std::byte> buffer_;
  size_t used_ = 0;
  Result<> status_;
};

/// The number at `from`, of the given type, as text.
void put_scalar(BufferedWriter& out, const std::byte* from, Scalar type);
/// `count` numbers, blanks between them.
void put_scalars(BufferedWriter& out, const std::byte* from, Scalar type, uint32_t count);

}  // namespace maille
