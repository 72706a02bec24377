#pragma once

#include <maille/error.h>
#include <maille/source.h>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace maille {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__,
              "files are little-endian; a big-endian port needs byte swaps here and in Array");

/// Reads one number without alignment: bytes of files lie anywhere, and memcpy() of a constant size is one
/// instruction.
template <class T>
T load(const void* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}
template <class T>
void store(void* to, T value) {
  std::memcpy(to, &value, sizeof value);
}

/// The bits of one number as another type of the same size (std::bit_cast is missing in emscripten 3.1.6).
template <class To, class From>
To bits_as(From from) {
  static_assert(sizeof(To) == sizeof(From));
  To to;
  std::memcpy(&to, &from, sizeof to);
  return to;
}

/// Appends little-endian numbers, LEB128 counts and strings to a vector. ByteReader has a get for each put,
/// and headers are written and read by one list of fields where they can be.
class ByteWriter {
 public:
  template <class T>
  void put(T value) {
    const size_t at = bytes_.size();
    bytes_.resize(at + sizeof value);
    store(bytes_.data() + at, value);
  }
  /// Seven bits a byte, low first: at most 10 bytes.
  void put_count(uint64_t value) {
    for (; value >= 0x80; value >>= 7) put(static_cast<uint8_t>(value | 0x80));
    put(static_cast<uint8_t>(value));
  }
  void put_bytes(Bytes bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  void put_string(std::string_view text) {
    put_count(text.size());
    put_bytes(std::as_bytes(std::span(text.data(), text.size())));
  }

  size_t size() const { return bytes_.size(); }
  const std::vector<std::byte>& bytes() const { return bytes_; }
  /// 0, -1, 1, -2, ... as counts.
  void put_zigzag(int64_t value) {
    put_count(static_cast<uint64_t>(value) << 1 ^ (value < 0 ? ~uint64_t{0} : 0));
  }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

/// Reads what ByteWriter wrote. Past the end it gives zeros and remembers: check ok() once after a group of
/// reads, and before any count read is used. Bytes that get_bytes() gives are those of the file, not a copy,
/// so a size that a damaged file claims costs nothing.
class ByteReader {
 public:
  explicit ByteReader(Bytes bytes) : bytes_(bytes) {}

  template <class T>
  T get() {
    if (!has(sizeof(T))) return T{};
    const T value = load<T>(bytes_.data() + at_);
    at_ += sizeof(T);
    return value;
  }
  /// Reads a count, and accepts only its shortest spelling: then lengths follow from values, and a file that
  /// is read and written again has the same bytes. The tenth byte may only hold the last of the 64 bits.
  uint64_t get_count() {
    uint64_t value = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      const auto byte = get<uint8_t>();
      const bool too_long = byte == 0 && shift > 0;
      const bool too_large = byte > 1 && shift == 63;
      if (too_long || too_large) break;
      value |= uint64_t{byte & 0x7fu} << shift;
      if (byte < 0x80) return value;
    }
    ok_ = false;
    return 0;
  }
  int64_t get_zigzag() {
    const uint64_t count = get_count();
    return static_cast<int64_t>(count >> 1 ^ (0 - (count & 1)));
  }
  Bytes get_bytes(uint64_t size) {
    if (!has(size)) return {};
    const Bytes part = bytes_.subspan(at_, static_cast<size_t>(size));
    at_ += static_cast<size_t>(size);
    return part;
  }
  std::string get_string() {
    const Bytes part = get_bytes(get_count());
    return std::string(reinterpret_cast<const char*>(part.data()), part.size());
  }

  bool ok() const { return ok_; }
  size_t position() const { return at_; }
  size_t remaining() const { return bytes_.size() - at_; }

 private:
  /// Once a read has failed, all later ones fail, too: they would return bytes that belong to another field.
  bool has(uint64_t size) {
    if (ok_ && size <= remaining()) return true;
    ok_ = false;
    return false;
  }

  Bytes bytes_;
  size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace maille
