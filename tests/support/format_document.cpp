#include "support/format_document.h"
#include "support/data.h"
#include "support/files.h"

#include <sstream>

namespace maille::testing {

std::string document(const std::string& name) {
  return read_text(tests_folder() + "/../docs/" + name);
}

std::string format_document() {
  return document("format.md");
}

std::string block_of_document(const std::string& kind) {
  const std::string text = format_document(), start = "```" + kind + "\n";
  const size_t found = text.find(start);
  if (found == std::string::npos) return "";
  const size_t begin = found + start.size();
  return text.substr(begin, text.find("```", begin) - begin);
}

std::vector<std::byte> parse_hex(const std::string& text) {
  std::vector<std::byte> bytes;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream pairs(line.substr(0, line.find("  ")));
    for (std::string pair; pairs >> pair;)
      bytes.push_back(static_cast<std::byte>(std::stoi(pair, nullptr, 16)));
  }
  return bytes;
}

std::vector<std::byte> example_of_document(const std::string& name) {
  return parse_hex(block_of_document(name.empty() ? "hex" : "hex " + name));
}

}  // namespace maille::testing
