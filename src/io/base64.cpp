#include "io/base64.h"

#include <array>

namespace maille {
namespace {

constexpr char alphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// The inverse of `alphabet` for every byte, so that hostile bytes index it without a test: -1 marks what is
/// no digit.
constexpr std::array<int8_t, 256> digit_values() {
  std::array<int8_t, 256> values{};
  for (int8_t& value : values) value = -1;
  for (int i = 0; i < 64; ++i) values[static_cast<size_t>(alphabet[i])] = static_cast<int8_t>(i);
  return values;
}
constexpr std::array<int8_t, 256> digits = digit_values();

bool is_space(char c) {
  return c == ' ' || c == '\n' || c == '\r' || c == '\t';
}

}  // namespace

std::string to_base64(Bytes bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t n = bytes.size() - i < 3 ? bytes.size() - i : 3;
    uint32_t group = 0;
    for (size_t k = 0; k < 3; ++k) {
      group = group << 8 | (k < n ? std::to_integer<uint32_t>(bytes[i + k]) : 0u);
    }
    // n bytes make n + 1 digits (8 n bits, six in each); the rest of the group of four is padding.
    for (size_t k = 0; k < 4; ++k) text += k <= n ? alphabet[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

/// Decodes four digits into up to three pending bytes. False at the end of the text, at a foreign character,
/// and where '=' comes before a digit or more than twice. Bits that padding leaves over are not compared with
/// zero.
bool Base64Reader::next_group() {
  uint32_t group = 0;
  // Digits are shifted into place from the left, so that a padded group needs no other shift: 3 - padding
  // bytes of it count.
  unsigned digits_read = 0, padding = 0;
  while (digits_read + padding < 4) {
    if (at_ == text_.size()) return false;
    const char c = text_[at_];
    if (is_space(c)) {
      ++at_;
      continue;
    }
    const int8_t value = digits[static_cast<uint8_t>(c)];
    if (c == '=') {
      ++padding;
    } else if (value >= 0 && padding == 0) {
      group |= static_cast<uint32_t>(value) << (18 - 6 * digits_read);
      ++digits_read;
    } else {
      return false;
    }
    ++at_;
  }
  if (padding > 2) return false;
  for (unsigned k = 0; k < 3; ++k) pending_[k] = static_cast<std::byte>(group >> (16 - 8 * k) & 255);
  pending_at_ = 0;
  pending_size_ = 3 - padding;
  return true;
}

bool Base64Reader::read(std::span<std::byte> out) {
  for (std::byte& byte : out) {
    if (pending_size_ == 0 && !next_group()) return false;
    byte = pending_[pending_at_++];
    --pending_size_;
  }
  return true;
}

bool Base64Reader::at_end() {
  while (at_ < text_.size() && is_space(text_[at_])) ++at_;
  return pending_size_ == 0 && at_ == text_.size();
}

}  // namespace maille
