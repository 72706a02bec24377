#include <maille/http.h>

#include <cctype>

namespace maille {
namespace {

bool begins_with(const std::string& text, const std::string& begin) {
  if (text.size() < begin.size()) return false;
  for (size_t i = 0; i < begin.size(); ++i) {
    if (std::tolower(static_cast<unsigned char>(text[i])) != begin[i]) return false;
  }
  return true;
}

}  // namespace

bool is_url(const std::string& text) {
  return begins_with(text, "http://") || begins_with(text, "https://");
}

// For messages and logs: without a name and password, and without the query, which may hold a signature.
std::string shown_url(const std::string& url) {
  if (!is_url(url)) return url;
  std::string shown = url.substr(0, url.find_first_of("?#"));
  const size_t host = shown.find("//") + 2, path = shown.find('/', host);
  const size_t at = shown.substr(0, path).rfind('@');
  if (at != std::string::npos && at >= host) shown.erase(host, at + 1 - host);
  return shown;
}

}  // namespace maille
