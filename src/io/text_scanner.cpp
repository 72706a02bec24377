#include "io/text_scanner.h"

namespace maille {

std::string found_at(const TextScanner& scanner) {
  if (scanner.at_end()) return "the end of the file";
  if (scanner.at_line_end()) return "the end of the line";
  std::string text = "\"";
  for (const char c : scanner.look()) text += c >= ' ' && c < 127 ? c : '?';
  return text + "\"";
}

std::string no_number_at(const TextScanner& scanner) {
  const bool too_large = is_beyond_double(scanner.here(), scanner.end());
  return found_at(scanner) + (too_large ? ", which is too large for a double" : " where a number belongs");
}

std::string_view trim(std::string_view text) {
  while (!text.empty() && TextScanner::is_white(text.front())) text.remove_prefix(1);
  while (!text.empty() && TextScanner::is_white(text.back())) text.remove_suffix(1);
  return text;
}

}  // namespace maille
