#include "io/ensight/ensight_stream.h"

#include <algorithm>

namespace maille {
namespace {

/// A line of a binary file: up to the zero, where there is one, without blanks at either end.
std::string text_of(std::string_view record) {
  return std::string(trim(record.substr(0, record.find('\0'))));
}

}  // namespace

// Steps of one file follow each other, and only "BEGIN TIME STEP" tells where. Searching text finds it in
// binary files, too; that numbers spell these letters is not expected.
Result<> EnsightStream::enter_step(uint64_t steps_before) {
  constexpr std::string_view begin = "BEGIN TIME STEP";
  size_t at = 0;
  for (uint64_t step = 0;; ++step) {
    at = text_.find(begin, at);
    if (at == std::string_view::npos)
      return malformed("it has " + counted(step, "step") + ", not " + std::to_string(steps_before + 1));
    if (step == steps_before) break;
    at += begin.size();
  }
  at_ = std::min(at + line_bytes, text_.size());
  // So that messages of text files name the right line.
  const auto lines = std::count(text_.begin(), text_.begin() + static_cast<ptrdiff_t>(at), '\n');
  tokens_.scanner = TextScanner(text_.substr(at), static_cast<uint64_t>(lines) + 1);
  tokens_.scanner.skip_line();
  return {};
}

Result<std::string> EnsightStream::line() {
  if (!binary_) {
    if (tokens_.scanner.at_end()) return malformed("it ends too early");
    const std::string_view text = tokens_.scanner.rest_of_line();
    tokens_.scanner.skip_line_end();
    return std::string(trim(text.substr(0, line_bytes)));
  }
  if (text_.size() - at_ < line_bytes) return malformed("it ends inside a line of 80 bytes");
  at_ += line_bytes;
  return text_of(text_.substr(at_ - line_bytes, line_bytes));
}

Result<std::string> EnsightStream::keyword() {
  if (!binary_) tokens_.skip_white();
  return line();
}

std::string EnsightStream::peek() {
  if (at_end()) return {};
  if (!binary_) {
    TextScanner ahead = tokens_.scanner;
    return std::string(trim(ahead.rest_of_line().substr(0, line_bytes)));
  }
  return text_of(text_.substr(at_, line_bytes));
}

uint32_t EnsightStream::raw(size_t at) const {
  const auto value = load<uint32_t>(reinterpret_cast<const std::byte*>(text_.data()) + at);
  return swapped_ ? __builtin_bswap32(value) : value;
}

Result<> EnsightStream::check(uint64_t count, const std::string& what) const {
  // A number of a text has a character, and one between it and the next. This bounds what any claimed count
  // can make the loops below append.
  const uint64_t most =
      binary_ ? (text_.size() - at_) / sizeof(uint32_t) : (text_.size() - tokens_.scanner.position()) / 2 + 1;
  if (count <= most) return {};
  return malformed("it ends inside the " + what + ", of which there should be " + std::to_string(count));
}

Result<int32_t> EnsightStream::part_number() {
  if (binary_ && !order_known_ && text_.size() - at_ >= sizeof(uint32_t)) {
    const uint32_t number = raw(at_);
    // Files do not tell their byte order. Parts have small numbers, so the smaller of both readings is the
    // right one.
    swapped_ = number > __builtin_bswap32(number);
    order_known_ = true;
  }
  std::vector<int32_t> number;
  MAILLE_CHECK(integers(1, "number of a part", number));
  if (!binary_) tokens_.scanner.skip_line();
  return number[0];
}

Result<uint64_t> EnsightStream::count(const std::string& what) {
  std::vector<int32_t> number;
  MAILLE_CHECK(integers(1, "number of " + what, number));
  if (number[0] < 0) return malformed("the number of " + what + " is " + std::to_string(number[0]));
  return static_cast<uint64_t>(number[0]);
}

Result<> EnsightStream::integers(uint64_t count, const std::string& what, std::vector<int32_t>& out) {
  MAILLE_CHECK(check(count, what));
  for (uint64_t i = 0; i < count; ++i) {
    if (binary_) {
      out.push_back(static_cast<int32_t>(raw(at_)));
      at_ += sizeof(uint32_t);
      continue;
    }
    int64_t value = 0;
    if (!tokens_.integer(value) || value != static_cast<int32_t>(value))
      return tokens_.expected("a whole number (" + what + ")");
    out.push_back(static_cast<int32_t>(value));
  }
  return {};
}

Result<> EnsightStream::floats(uint64_t count, const std::string& what, std::vector<float>& out) {
  MAILLE_CHECK(check(count, what));
  for (uint64_t i = 0; i < count; ++i) {
    if (binary_) {
      out.push_back(bits_as<float>(raw(at_)));
      at_ += sizeof(uint32_t);
      continue;
    }
    Number value;
    if (!tokens_.number(value)) return tokens_.expected("a number (" + what + ")");
    out.push_back(value.single);
  }
  return {};
}

tl::unexpected<Error> EnsightStream::malformed(const std::string& what) const {
  return binary_ ? malformed_byte(name_, at_, what) : tokens_.malformed(what);
}

}  // namespace maille
