#include "serve/served_files.h"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>

#include "text.h"

namespace maille::tool {

namespace {

struct ContentType {
  const char* extension;
  const char* type;
};
constexpr ContentType content_types[] = {
    {".maille", "model/vnd.maille"},
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".mjs", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".txt", "text/plain; charset=utf-8"},
    {".md", "text/plain; charset=utf-8"},
    {".json", "application/json"},
    {".map", "application/json"},
    {".wasm", "application/wasm"},
    {".svg", "image/svg+xml"},
    {".png", "image/png"},
    {".jpg", "image/jpeg"},
    {".jpeg", "image/jpeg"},
    {".webp", "image/webp"},
    {".ico", "image/x-icon"},
    {".glb", "model/gltf-binary"},
    {".gltf", "model/gltf+json"},
    {".obj", "model/obj"},
    {".stl", "model/stl"},
};

std::string type_of(const std::string& path) {
  for (const ContentType& known : content_types) {
    const std::string end = known.extension;
    if (path.size() > end.size() && path.compare(path.size() - end.size(), end.size(), end) == 0)
      return known.type;
  }
  return "application/octet-stream";
}

/// What the viewer shows: scenes of glTF, too.
bool can_be_viewed(const std::string& path) {
  const std::string type = type_of(path);
  return type == "model/vnd.maille" || type == "model/gltf-binary" || type == "model/gltf+json";
}

/// "/a/.b", "/../a"; and what no name holds.
bool is_hidden(const std::string& path) {
  return path.find("/.") != std::string::npos || path.find('\0') != std::string::npos;
}

std::optional<std::string> without_links(const std::string& path) {
  char* const found = ::realpath(path.c_str(), nullptr);
  if (found == nullptr) return std::nullopt;
  std::string result = found;
  std::free(found);
  return result;
}

/// Anybody may choose the name of a file, so one that contains "<script>" must not run in a page of this
/// server.
std::string html(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '<') {
      result += "&lt;";
    } else if (c == '&') {
      result += "&amp;";
    } else if (c == '"') {
      result += "&quot;";
    } else {
      result += c;
    }
  }
  return result;
}

}  // namespace

ServedFile::~ServedFile() {
  if (descriptor >= 0) ::close(descriptor);
}

ssize_t ServedFile::read(uint64_t offset, char* out, size_t size) const {
  for (;;) {
    const ssize_t count = ::pread(descriptor, out, size, static_cast<off_t>(offset));
    if (count >= 0 || errno != EINTR) return count;
  }
}

std::string url_encoded(const std::string& text) {
  std::string result;
  for (const char c : text) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       std::strchr("-._~/", c) != nullptr;
    result += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return result;
}

Result<ServedFiles> ServedFiles::open(const std::string& path) {
  const auto real = without_links(path);
  struct stat status = {};
  if (!real || ::stat(real->c_str(), &status) != 0)
    return failure(ErrorCode::cannot_read, fmt::format("cannot read {}: {}", path, std::strerror(errno)));
  ServedFiles files;
  files.root_ = *real == "/" ? "" : *real;
  if (S_ISDIR(status.st_mode)) return files;
  if (!S_ISREG(status.st_mode))
    return failure(ErrorCode::cannot_read, fmt::format("{}: is neither a folder nor a file", path));
  const size_t slash = real->rfind('/');
  files.root_ = real->substr(0, slash);
  files.only_ = real->substr(slash + 1);
  return files;
}

std::optional<std::string> ServedFiles::find(const std::string& path, bool folder) const {
  // The one file may have any name; it was named.
  if (!only_.empty() && path != "/" + only_) return std::nullopt;
  if (path.empty() || path[0] != '/' || (only_.empty() && is_hidden(path))) return std::nullopt;
  // Links are resolved first and the result is compared with the root, so no spelling (a "..", a link, a link
  // to a link) leads out.
  const auto real = without_links(root_ + path);
  if (!real) return std::nullopt;
  const bool below = *real == root_ || (real->size() > root_.size() && (*real)[root_.size()] == '/' &&
                                        real->compare(0, root_.size(), root_) == 0);
  if (!below || (only_.empty() && is_hidden(real->substr(root_.size())))) return std::nullopt;
  struct stat status = {};
  if (::stat(real->c_str(), &status) != 0) return std::nullopt;
  return (folder ? S_ISDIR(status.st_mode) : S_ISREG(status.st_mode)) ? real : std::nullopt;
}

std::shared_ptr<ServedFile> ServedFiles::file(const std::string& path) const {
  const auto real = find(path, false);
  if (!real) return nullptr;
  auto file = std::make_shared<ServedFile>();
  // What somebody puts there in this moment may be a link, or a pipe that nobody writes to.
  file->descriptor = ::open(real->c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  struct stat status = {};
  if (file->descriptor < 0 || ::fstat(file->descriptor, &status) != 0 || !S_ISREG(status.st_mode))
    return nullptr;
  file->size = static_cast<uint64_t>(status.st_size);
  file->type = type_of(*real);
  file->etag = fmt::format("\"{:x}-{:x}.{:x}-{:x}\"", file->size, status.st_mtim.tv_sec,
                           status.st_mtim.tv_nsec, status.st_ino);
  file->last_modified = fmt::format("{:%a, %d %b %Y %H:%M:%S} GMT", fmt::gmtime(status.st_mtim.tv_sec));
  return file;
}

std::vector<std::string> ServedFiles::names_in(const std::string& path) const {
  if (!only_.empty()) return {only_};
  std::vector<std::string> names;
  const auto real = find(path, true);
  DIR* const folder = real ? ::opendir(real->c_str()) : nullptr;
  if (folder == nullptr) return names;
  while (const dirent* const entry = ::readdir(folder)) {
    const std::string name = entry->d_name;
    if (find(path + name, false)) names.push_back(name);
    if (find(path + name, true)) names.push_back(name + "/");
  }
  ::closedir(folder);
  std::sort(names.begin(), names.end());
  return names;
}

namespace {

/// As plain as it was, but for eyes: dark where the reader has it so, and rows that fingers hit.
constexpr const char* page_style =
    "<meta name=viewport content=\"width=device-width\">\n"
    "<style>:root{color-scheme:light dark;font:15px/1.4 system-ui,sans-serif}"
    "body{max-width:46em;margin:2em auto;padding:0 1em}h1{font-size:1.3em;overflow-wrap:anywhere}"
    "ul{list-style:none;padding:0}li{display:flex;gap:1em;padding:.45em 0;border-top:1px solid #8884}"
    "li "
    ":first-child{flex:1;overflow-wrap:anywhere}small{opacity:.7;min-width:5.5em;text-align:right}</style>\n";

}  // namespace

std::string ServedFiles::page(const std::string& path, const std::string& viewer) const {
  std::string text = fmt::format("<!doctype html>\n<meta charset=utf-8>\n<title>{}</title>\n", html(path));
  text += page_style + fmt::format("<h1>{}</h1>\n<ul>\n", html(path));
  for (const std::string& name : names_in(path)) {
    text += fmt::format("<li><a href=\"{}\">{}</a>", "./" + url_encoded(name), html(name));
    if (!viewer.empty() && can_be_viewed(name))
      text += fmt::format(" <a href=\"{}/?file={}\">view</a>", viewer, url_encoded(path + name));
    if (const auto served = name.ends_with('/') ? nullptr : file(path + name))
      text += fmt::format(" <small>{}</small>", human_bytes(static_cast<double>(served->size)));
    text += "\n";
  }
  return text + "</ul>\n";
}

}  // namespace maille::tool
