#include "io/http/answer.h"

#include <algorithm>
#include <cctype>
#include <charconv>

#include "io/letters.h"

namespace maille {
namespace {

std::string_view trimmed(std::string_view text) {
  const auto is_space = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

std::optional<uint64_t> number(std::string_view text) {
  uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

// The value of Content-Range, RFC 9110, section 14.4. Servers are as hostile as files: what is not exactly as
// it should be is no range, and the request fails.
std::optional<HttpAnswer::ContentRange> parse_content_range(std::string_view text) {
  text = trimmed(text);
  if (text.size() < 6 || lower_case(text.substr(0, 6)) != "bytes ") return std::nullopt;
  text = trimmed(text.substr(6));
  const size_t slash = text.find('/');
  if (slash == std::string_view::npos) return std::nullopt;
  HttpAnswer::ContentRange range;
  const std::string_view total = text.substr(slash + 1), part = text.substr(0, slash);
  if (total != "*") {
    range.total = number(total);
    if (!range.total) return std::nullopt;
  }
  // first > last stands for "not satisfiable", as the header says.
  if (part == "*") {
    range.first = 1;
    return range;
  }
  const size_t dash = part.find('-');
  if (dash == std::string_view::npos) return std::nullopt;
  const auto first = number(part.substr(0, dash)), last = number(part.substr(dash + 1));
  if (!first || !last || *first > *last || (range.total && *last >= *range.total)) return std::nullopt;
  range.first = *first;
  range.last = *last;
  return range;
}

void HttpAnswer::take(std::string_view line) {
  if (line.substr(0, 5) == "HTTP/") {
    // Of several answers (100, redirections) only the last counts.
    *this = {};
    // Without a blank the rest is empty, and so the status is 0.
    const size_t space = std::min(line.find(' '), line.size() - 1);
    status = static_cast<int>(number(line.substr(space + 1, 3)).value_or(0));
    return;
  }
  const size_t colon = line.find(':');
  if (colon == std::string_view::npos) return;
  const std::string name = lower_case(line.substr(0, colon));
  const std::string_view value = trimmed(line.substr(colon + 1));
  if (name == "content-range") range = parse_content_range(value);
  if (name == "content-length") length = number(value);
  if (name == "content-encoding") encoding = lower_case(value);
  if (name == "content-type") type = lower_case(value);
  if (name == "etag") etag = value;
  if (name == "last-modified") last_modified = value;
}

}  // namespace maille
