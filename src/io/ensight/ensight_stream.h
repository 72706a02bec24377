#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "io/token_reader.h"

namespace maille {

/// Lines and numbers of a file of EnSight Gold, which are the same in text and in C binary: there a line has
/// 80 bytes, a number four, in the byte order that the number of the first part tells. Every read is checked
/// against what is left.
class EnsightStream {
 public:
  EnsightStream(std::string_view text, std::string name, bool binary)
      : name_(std::move(name)), text_(text), tokens_(text, name_), binary_(binary) {}

  static constexpr size_t line_bytes = 80;

  bool binary() const { return binary_; }
  const std::string& name() const { return name_; }
  bool at_end() { return binary_ ? at_ >= text_.size() : tokens_.at_end(); }
  /// Passes over this many steps, and over the line with which the next one begins.
  Result<> enter_step(uint64_t steps_before);
  /// A line that may be empty.
  Result<std::string> line();
  /// The next line that has something in it, without blanks at either end.
  Result<std::string> keyword();
  /// The same without moving; empty at the end.
  std::string peek();
  /// The number of a part; the first one tells the order of bytes.
  Result<int32_t> part_number();
  // Reads a count, at most 2^31 - 1; `what` is for messages: "number of WHAT".
  Result<uint64_t> count(const std::string& what);
  // Appends `count` numbers to `out`. Nothing is appended if the rest of the file is too short for them.
  Result<> integers(uint64_t count, const std::string& what, std::vector<int32_t>& out);
  Result<> floats(uint64_t count, const std::string& what, std::vector<float>& out);
  tl::unexpected<Error> malformed(const std::string& what) const;

 private:
  Result<> check(uint64_t count, const std::string& what) const;
  uint32_t raw(size_t at) const;

  std::string name_;
  std::string_view text_;
  TokenReader tokens_;
  size_t at_ = 0;  // binary only
  bool binary_;
  bool swapped_ = false, order_known_ = false;
};

}  // namespace maille
