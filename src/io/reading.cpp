#include "io/reading.h"

#include <algorithm>

namespace maille {

Array time_array(double time) {
  Array array = make_array("TimeValue", Domain::mesh, Scalar::f64, 1);
  array.resize(1);
  array.values<double>()[0] = time;
  return array;
}

Result<InputBytes> InputBytes::load(const Source& source) {
  InputBytes input;
  input.view_ = source.view();
  if (!input.view_.empty()) return input;
  // Chosen, not swept: what a source whose size is wrong can cost at most beyond what it really gives.
  constexpr uint64_t piece = uint64_t{16} << 20;
  const uint64_t size = source.size();
  // Reserved room is not memory yet, and growing would copy all that was read, with twice as much held at
  // once. 1 GiB of address space is the most that a wrong size reserves.
  input.owned_.reserve(static_cast<size_t>(std::min(size, 64 * piece)));
  for (uint64_t at = 0; at < size;) {
    const uint64_t length = std::min(piece, size - at);
    input.owned_.resize(static_cast<size_t>(at + length));
    MAILLE_CHECK(source.read_at(at, std::span(input.owned_).subspan(static_cast<size_t>(at))));
    at += length;
  }
  return input;
}

Result<> Watch::at(uint64_t position, uint64_t mesh_bytes) {
  next_ = position + interval;
  if (mesh_bytes > options_.limits.mesh_bytes) {
    return failure(ErrorCode::memory_bound,
                   name_ + ": the mesh takes more than the " + std::to_string(options_.limits.mesh_bytes) +
                       " bytes allowed; raise the memory limit if you trust the file");
  }
  const double fraction =
      total_ == 0 ? 1 : std::min(1.0, static_cast<double>(position) / static_cast<double>(total_));
  if (options_.progress && !options_.progress({"reading", fraction})) {
    return failure(ErrorCode::cancelled, name_ + ": reading was cancelled");
  }
  return {};
}

Result<> CommentRoom::check(const std::string& file) const {
  if (taken_ <= most) return {};
  return failure(ErrorCode::unsupported,
                 file +
                     ": its comments take more than the 16 MiB that there is room for; "
                     "remove some of them");
}

tl::unexpected<Error> malformed_line(const std::string& file, uint64_t line, const std::string& what) {
  return failure(ErrorCode::malformed_input, file + ": line " + std::to_string(line) + ": " + what);
}

tl::unexpected<Error> malformed_byte(const std::string& file, uint64_t byte, const std::string& what) {
  return failure(ErrorCode::malformed_input, file + ": byte " + std::to_string(byte) + ": " + what);
}

std::string counted(uint64_t count, const std::string& singular, const std::string& plural) {
  return std::to_string(count) + " " + (count == 1 ? singular : plural);
}

// Percent signs as in addresses (RFC 3986, 2.1): a name becomes one word of printable ASCII, which a line of
// text can hold. A name of no letters is "%", which nothing else becomes.
std::string to_word(std::string_view name) {
  static constexpr char digits[] = "0123456789ABCDEF";
  if (name.empty()) return "%";
  std::string word;
  for (const char c : name) {
    if (c > ' ' && c < 127 && c != '%') {
      word += c;
    } else {
      word += '%';
      word += digits[(static_cast<unsigned>(c) >> 4) & 15];
      word += digits[static_cast<unsigned>(c) & 15];
    }
  }
  return word;
}

std::string from_word(std::string_view word) {
  const auto digit = [](char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
  };
  if (word == "%") return {};
  std::string name;
  for (size_t i = 0; i < word.size(); ++i) {
    if (word[i] == '%' && i + 2 < word.size() && digit(word[i + 1]) >= 0 && digit(word[i + 2]) >= 0) {
      name += static_cast<char>(digit(word[i + 1]) * 16 + digit(word[i + 2]));
      i += 2;
    } else {
      name += word[i];
    }
  }
  return name;
}

}  // namespace maille
