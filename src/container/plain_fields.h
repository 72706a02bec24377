#pragma once

#include <maille/limits.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "base/bytes.h"

// Descriptions of what a file holds have one list of fields each, which serves writing and reading:
// PlainWriter and PlainReader have the same calls. (Headers of the container, whose fields have names, too:
// fields.h.)

namespace maille {

/// What a description may take before it is packed.
inline constexpr uint64_t most_plain_bytes = uint64_t{16} << 20;

class PlainWriter {
 public:
  void byte(const uint8_t& value, unsigned) { out_.put(value); }
  template <class Enum>
  void choice(const Enum& value, unsigned) {
    out_.put(static_cast<uint8_t>(value));
  }
  template <class Number>
  void count(const Number& value, uint64_t) {
    out_.put_count(static_cast<uint64_t>(value));
  }
  void real(const double& value) { out_.put(value); }
  /// A number of fixed width.
  template <class Number>
  void fixed(const Number& value) {
    out_.put(value);
  }
  void flag(const bool& value) { out_.put(static_cast<uint8_t>(value)); }
  void text(const std::string& value) { out_.put_string(value); }
  void bytes(Bytes value) {
    out_.put_count(value.size());
    out_.put_bytes(value);
  }
  template <class Item, class Each>
  void list(const std::vector<Item>& items, Each each) {
    out_.put_count(items.size());
    for (const Item& item : items) each(item);
  }
  ByteWriter& out() { return out_; }

 private:
  ByteWriter out_;
};

/// Where they take more than is allowed.
inline constexpr const char* texts_too_large = "names, labels and metadata take more memory than allowed";

/// What the descriptions of a file may take in memory, in bytes: 4 MiB besides the limit, so that small
/// limits still open small files.
inline uint64_t plain_memory(const Limits& limits) {
  constexpr uint64_t besides = uint64_t{4} << 20;
  return limits.mesh_bytes + std::min(besides, ~limits.mesh_bytes);
}

/// Reads what a PlainWriter wrote; safe on any bytes. A few packed bytes can stand for millions of empty
/// texts, so what lists and texts take in memory is counted, and reading ends before it is more than allowed.
class PlainReader {
 public:
  /// `most_memory`: what all that is read may take, in bytes.
  PlainReader(Bytes bytes, uint64_t most_memory) : in_(bytes), most_memory_(most_memory) {}
  void byte(uint8_t& value, unsigned count) {
    value = in_.get<uint8_t>();
    require(value < count);
  }
  template <class Enum>
  void choice(Enum& value, unsigned count) {
    uint8_t number = 0;
    byte(number, count);
    value = static_cast<Enum>(number);
  }
  template <class Number>
  void count(Number& value, uint64_t most) {
    const uint64_t found = in_.get_count();
    require(found <= most);
    value = static_cast<Number>(found);
  }
  void real(double& value) { value = in_.get<double>(); }
  template <class Number>
  void fixed(Number& value) {
    value = in_.get<Number>();
  }
  void flag(bool& value) { value = in_.get<uint8_t>() != 0; }
  void text(std::string& value) {
    value = in_.get_string();
    // Shorter ones need no memory of their own.
    if (value.size() > std::string().capacity()) take(value.size() + 1);
  }
  template <class Storage>
  void bytes(Storage& value) {
    const Bytes found = in_.get_bytes(in_.get_count());
    take(found.size());
    if (!is_over_) value.assign(found.begin(), found.end());
  }
  template <class Item, class Each>
  void list(std::vector<Item>& items, Each each) {
    // Every item takes a byte or more, so the list ends with the bytes at the latest.
    for (uint64_t left = in_.get_count(); left > 0 && ok(); --left) {
      Item* const item = add(items);
      if (item == nullptr) return;
      each(*item);
    }
  }
  /// Another item of a list; nothing if that takes more memory than is allowed.
  template <class Item>
  Item* add(std::vector<Item>& items) {
    if (items.size() == items.capacity() && !make_room(items)) return nullptr;
    return &items.emplace_back();
  }
  /// What is false makes ok() false from now on.
  void require(bool sensible) { sensible_ = sensible_ && sensible; }
  bool ok() const { return sensible_ && !is_over_ && in_.ok(); }
  /// Whether more memory would have been needed than is allowed.
  bool is_over() const { return is_over_; }
  /// What has been read takes so many bytes, besides the objects that were handed over.
  uint64_t memory() const { return memory_; }
  size_t remaining() const { return in_.remaining(); }
  bool at_end() const { return remaining() == 0; }

 protected:
  void take(uint64_t bytes) {
    memory_ += bytes;
    is_over_ = is_over_ || memory_ > most_memory_;
  }
  ByteReader& in() { return in_; }

 private:
  /// Twice the room for a list; while it moves, the old one is there, too.
  template <class Item>
  bool make_room(std::vector<Item>& items) {
    const uint64_t before = items.capacity(), room = before == 0 ? 1 : 2 * before;
    is_over_ = is_over_ || memory_ + room * sizeof(Item) > most_memory_;
    if (is_over_) return false;
    items.reserve(room);
    memory_ += (room - before) * sizeof(Item);
    return true;
  }

  ByteReader in_;
  uint64_t most_memory_, memory_ = 0;
  bool sensible_ = true, is_over_ = false;
};

}  // namespace maille
