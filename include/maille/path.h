#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>

namespace maille {

/// Paths of this library are UTF-8 on all systems. std::filesystem::path takes and gives a std::string in
/// another encoding on Windows, where it throws for names that have no place in that one.
inline std::filesystem::path to_path(std::string_view utf8) {
  return std::u8string_view(reinterpret_cast<const char8_t*>(utf8.data()), utf8.size());
}
/// With "/" between folders, which Windows takes, too. (generic_u8string() of libstdc++ would make "/server"
/// of "//server".)
inline std::string to_utf8(const std::filesystem::path& path) {
  const std::u8string utf8 = path.u8string();
  std::string text(reinterpret_cast<const char*>(utf8.data()), utf8.size());
  if constexpr (std::filesystem::path::preferred_separator == '\\')
    std::replace(text.begin(), text.end(), '\\', '/');
  return text;
}

}  // namespace maille
