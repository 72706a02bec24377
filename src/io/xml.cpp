#include <maille/xml.h>

#include <algorithm>

namespace maille {
namespace {

/// XML 1.0, 2.2: of the control characters below the blank only these three are characters.
bool is_in_xml(char c) {
  return static_cast<unsigned char>(c) >= ' ' || c == '\t' || c == '\n' || c == '\r';
}

}  // namespace

std::string xml_escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    // Tabs and line ends as numbers, too: parsers turn bare ones into blanks. '>' only matters behind "]]".
    if (!is_in_xml(c)) {
      out += "\xe2\x90";
      out += static_cast<char>(0x80 | c);
    } else if (c == '&' || c == '<' || c == '>' || c == '"' || (c >= 0 && c < ' ')) {
      out += "&#" + std::to_string(static_cast<int>(c)) + ";";
    } else {
      out += c;
    }
  }
  return out;
}

bool is_xml_text(std::string_view text) {
  return std::all_of(text.begin(), text.end(), is_in_xml);
}

}  // namespace maille
