#pragma once

#include <string>
#include <string_view>

namespace maille {

/// A text as the value of an attribute, or between tags. Control characters that XML 1.0 has no way to write
/// are replaced by their pictures, U+2400 and on, as no reader of XML would take the file with them, not even
/// as numbers. Each has its own, so that different names stay different.
std::string xml_escaped(std::string_view text);
/// Does XML have all characters of the text, so that none is replaced?
bool is_xml_text(std::string_view text);

}  // namespace maille
