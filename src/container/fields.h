#pragma once

#include <array>
#include <cstdint>

#include "base/bytes.h"

// A header has one list of fields, its visit() in layout.h. These visitors write, measure and read it.

namespace maille {

using ChunkType = std::array<char, 4>;

class FieldWriter {
 public:
  explicit FieldWriter(ByteWriter& out) : out_(out) {}

  /// A number of fixed width, little-endian.
  template <class T>
  void fixed(const char*, const T& value) {
    out_.put(value);
  }
  /// A number of variable width (LEB128), at most `max`.
  void count(const char*, const uint32_t& value, uint32_t) { out_.put_count(value); }
  void letters(const char*, const ChunkType& type) {
    for (const char letter : type) out_.put(letter);
  }

 private:
  ByteWriter& out_;
};

/// Bytes that FieldWriter would write.
class FieldSizer {
 public:
  template <class T>
  void fixed(const char*, const T& value) {
    bytes_ += sizeof value;
  }
  void count(const char*, const uint32_t& value, uint32_t) {
    for (uint32_t rest = value; rest >= 0x80; rest >>= 7) ++bytes_;
    ++bytes_;
  }
  void letters(const char*, const ChunkType& type) { bytes_ += type.size(); }

  size_t bytes() const { return bytes_; }

 private:
  size_t bytes_ = 0;
};

class FieldReader {
 public:
  explicit FieldReader(ByteReader& in) : in_(in) {}

  template <class T>
  void fixed(const char*, T& value) {
    value = in_.get<T>();
  }
  void count(const char*, uint32_t& value, uint32_t max) {
    const uint64_t found = in_.get_count();
    in_range_ = in_range_ && found <= max;
    value = static_cast<uint32_t>(found);
  }
  void letters(const char*, ChunkType& type) {
    for (char& letter : type) letter = in_.get<char>();
  }

  bool ok() const { return in_range_ && in_.ok(); }

 private:
  ByteReader& in_;
  bool in_range_ = true;
};

}  // namespace maille
