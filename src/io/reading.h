#pragma once

#include <maille/io.h>
#include <string>
#include <string_view>
#include <vector>
#include "base/result.h"
#include "mesh/mesh_size.h"

namespace maille {

/// The time of the step that was read, as an array of the mesh named as VTK has it.
Array time_array(double time);

/// All bytes of a source: its own view where it has one (a mapped file), otherwise read into memory piece by
/// piece, so that a wrong size costs no more than what is really there. A view lasts as long as the source.
class InputBytes {
 public:
  static Result<InputBytes> load(const Source& source);

  Bytes bytes() const { return owned_.empty() ? view_ : Bytes(owned_); }
  std::string_view text() const { return {reinterpret_cast<const char*>(bytes().data()), bytes().size()}; }

 private:
  Bytes view_;
  std::vector<std::byte> owned_;
};

/// Watches over a reader: tells the user how far it is, and stops it when asked to or when the mesh grows
/// beyond the limit. Call due() often (it is one comparison), and at() when it says so.
class Watch {
 public:
  Watch(const Source& source, uint64_t total, const ReadOptions& options)
      : name_(source.name()), total_(total), options_(options) {}

  bool due(uint64_t position) const { return position >= next_; }
  /// `position`: bytes read; `mesh_bytes`: bytes the mesh takes so far. Errors: cancelled, memory_bound.
  Result<> at(uint64_t position, uint64_t mesh_bytes);
  /// Reading starts again from the front.
  void restart() { next_ = interval; }
  const std::string& name() const { return name_; }

 private:
  // Chosen, not swept: some milliseconds of reading. The limit of memory may be passed by what 4 MiB of text
  // become.
  static constexpr uint64_t interval = uint64_t{4} << 20;

  std::string name_;
  uint64_t total_;
  const ReadOptions& options_;
  uint64_t next_ = interval;
};

/// Room for comments: as much as a .maille file has for them and all names (16 MiB), with 16 bytes more for
/// each. What is beyond is not to be kept: in memory a comment takes many times what it takes in a file (40
/// MB of lines with "#" alone took 2.9 GB, aea4802).
class CommentRoom {
 public:
  // False when there is no room left; the caller drops the text and goes on, and check() refuses the file at
  // the end.
  bool take(std::string_view text) {
    taken_ += text.size() + 16;
    return taken_ <= most;
  }
  /// Of a file whose comments were not all kept: unsupported.
  Result<> check(const std::string& file) const;

 private:
  static constexpr uint64_t most = uint64_t{16} << 20;
  uint64_t taken_ = 0;
};

/// malformed_input: "file.obj: line 17: what".
tl::unexpected<Error> malformed_line(const std::string& file, uint64_t line, const std::string& what);
/// malformed_input: "file.ply: byte 1234: what".
tl::unexpected<Error> malformed_byte(const std::string& file, uint64_t byte, const std::string& what);

/// "1 face", "2 faces".
std::string counted(uint64_t count, const std::string& singular, const std::string& plural);
inline std::string counted(uint64_t count, const std::string& singular) {
  return counted(count, singular, singular + "s");
}

/// A name as one word, for formats that separate by blanks: blanks, control characters, '%' and bytes beyond
/// ASCII as %XX. An empty name is "%". Reversible: from_word(to_word(x)) is x for any bytes.
std::string to_word(std::string_view name);
/// The inverse of to_word(). A '%' that no two upper-case digits follow stands for itself, so that words from
/// other programs stay as they are.
std::string from_word(std::string_view word);

}  // namespace maille
