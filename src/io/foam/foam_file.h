#pragma once

#include <maille/io.h>
#include <maille/limits.h>

#include <charconv>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/bytes.h"
#include "io/budget.h"
#include "io/reading.h"

namespace maille {

/// One file of OpenFOAM: its header, and the lists behind it; text or binary. In memory, or through a window,
/// by the same calls: before each the window holds a whole word, so no reading straddles its end. Reading
/// functions return false where there is something else, and do not move then, but for blanks.
class FoamReader {
 public:
  /// Mapped into memory, unpacked if it is packed with gzip. `block`: of a file of several processors
  /// (OpenFOAM's file handler "collated"), what this one of them wrote.
  static Result<FoamReader> open(const std::string& folder, const std::string& name, const Limits& limits,
                                 std::optional<uint64_t> block = {});
  /// Through a window of 64 KiB. Error: unsupported for a packed file.
  static Result<FoamReader> open_in_parts(const std::string& folder, const std::string& name);

  uint64_t size() const { return size_; }
  /// All of it, where it is in memory.
  std::string_view text() const { return {begin_, static_cast<size_t>(end_ - begin_)}; }
  bool binary() const { return binary_; }
  bool is_single() const { return binary_ && !wide_scalar_; }
  unsigned label_bytes() const { return wide_label_ ? 8 : 4; }
  const std::string& kind() const { return class_; }
  const Source& source() const { return *source_; }
  uint64_t position() const { return window_at_ + static_cast<uint64_t>(at_ - begin_); }
  void jump(uint64_t to);
  tl::unexpected<Error> malformed(const std::string& what) const;

  bool at_end() {
    skip();
    return at_ == end_;
  }
  /// A name, a number, or one of the characters that stand for themselves.
  std::string_view word();
  bool take(char sign) {
    skip();
    if (at_ == end_ || *at_ != sign) return false;
    ++at_;
    return true;
  }
  bool label(int64_t& value) {
    skip();
    const auto [behind, error] = std::from_chars(at_, end_, value);
    if (error != std::errc()) return false;
    at_ = behind;
    return true;
  }
  /// One of a list of labels, in the form of the file.
  bool next_label(int64_t& value) {
    return !binary_ ? label(value) : wide_label_ ? raw<int64_t>(value) : raw<int32_t>(value);
  }
  /// One of a list of truth values.
  bool next_flag(bool& value) {
    int64_t number = 0;
    if (!(binary_ ? raw<uint8_t>(number) : label(number))) return false;
    value = number != 0;
    return true;
  }
  bool coordinate(double& value) {
    return !binary_ ? scalar(value) : wide_scalar_ ? raw<double>(value) : raw<float>(value);
  }
  /// The count of a list, and whether "(" follows; otherwise the list is "count{value}".
  Result<uint64_t> begin_list(bool& values);
  Result<> end_list(bool values);
  /// A list of labels, appended to `out`.
  Result<> labels(std::vector<int64_t>& out, Budget& budget);

 private:
  static constexpr size_t window_bytes = size_t{64} << 10;
  /// What the window holds behind any place: no number is longer, nor a name that means something.
  static constexpr size_t most_word = 4096;

  static bool is_sign(char c) { return c == '(' || c == ')' || c == '{' || c == '}' || c == ';'; }
  /// So many bytes from here on, or all there are; false: there are fewer.
  bool more(size_t bytes) {
    return static_cast<size_t>(end_ - at_) >= bytes || (windowed_ && move_window(bytes));
  }
  bool move_window(size_t bytes);
  void skip();
  bool skip_comment();
  bool scalar(double& value);
  template <class T, class To>
  bool raw(To& value) {
    if (!more(sizeof(T))) return false;
    value = static_cast<To>(load<T>(at_));
    at_ += sizeof(T);
    return true;
  }
  Result<> read_header();
  Result<> enter_block(uint64_t block);

  std::unique_ptr<Source> source_;
  InputBytes bytes_;
  std::vector<std::byte> unpacked_;
  bool windowed_ = false;
  std::vector<char> window_;
  uint64_t window_at_ = 0;  ///< of begin_, in the file
  std::optional<Error> unread_;
  std::string name_, class_;
  uint64_t size_ = 0;
  const char* begin_ = nullptr;
  const char* at_ = nullptr;
  const char* end_ = nullptr;
  bool binary_ = false, wide_label_ = false, wide_scalar_ = true;
};

/// Is a file of a case there, as it is or packed, with ".gz" behind its name?
bool has_foam_file(const std::string& path);

}  // namespace maille
