#include <fmt/format.h>
#include <httplib.h>
#include <pthread.h>

#include <atomic>
#include <csignal>
#include <ctime>
#include <thread>

#include "result.h"
#include "serve/bounded_server.h"
#include "serve/browser.h"
#include "serve/served_files.h"
#include "serve/viewer_files.h"
#include "summary.h"
#include "text.h"
#include "verbs.h"

namespace maille::tool {

namespace {

// Each connection has a thread, and most of these wait. A browser opens six, so this serves about forty
// viewers at once.
constexpr size_t most_connections = 256;

struct ByteRange {
  uint64_t first = 0, size = 0;
};

/// What is served: files, and the viewer below viewer_path, where it was built.
struct Site {
  std::optional<ServedFiles> files, viewer;
  bool own_page_only = false;  ///< for nobody but the viewer
};

/// What of a file is asked for; nothing: a range that is not there.
std::optional<ByteRange> wanted(const httplib::Ranges& ranges, const ServedFile& file) {
  const auto [first, last] = ranges.front();
  const auto size = static_cast<int64_t>(file.size);
  const int64_t begin = first >= 0 ? int64_t{first} : size - std::min<int64_t>(last, size);
  const int64_t end = first < 0 || last < 0 || last >= size ? size : int64_t{last} + 1;
  if (begin >= end) return std::nullopt;
  return ByteRange{static_cast<uint64_t>(begin), static_cast<uint64_t>(end - begin)};
}

/// Several ranges at once are answered with the whole, as is allowed; and those of an older file.
bool is_partial(const httplib::Request& request, const ServedFile& file) {
  if (request.ranges.size() != 1) return false;
  const std::string condition = request.get_header_value("If-Range");
  return condition.empty() || condition == file.etag || condition == file.last_modified;
}

void send(const httplib::Request& request, httplib::Response& response, std::shared_ptr<ServedFile> file) {
  response.set_header("ETag", file->etag);
  response.set_header("Last-Modified", file->last_modified);
  const std::string known = request.get_header_value("If-None-Match");
  if (known == "*" || (!known.empty() && known.find(file->etag) != std::string::npos)) {
    response.status = 304;
    return;
  }
  response.status = 200;
  ByteRange part{0, file->size};
  if (is_partial(request, *file)) {
    const auto range = wanted(request.ranges, *file);
    if (!range) {
      response.status = 416;
      response.set_header("Content-Range", fmt::format("bytes */{}", file->size));
      return;
    }
    part = *range;
    response.status = 206;
    response.set_header("Content-Range",
                        fmt::format("bytes {}-{}/{}", part.first, part.first + part.size - 1, file->size));
  }
  if (part.size == 0) return response.set_content("", file->type);
  const std::string type = file->type;
  response.set_content_provider(
      part.size, type, [file, part](size_t offset, size_t length, httplib::DataSink& sink) {
        std::vector<char> buffer(std::min<size_t>(length, 256 << 10));
        const ssize_t count = file->read(part.first + offset, buffer.data(), buffer.size());
        return count > 0 && sink.write(buffer.data(), static_cast<size_t>(count));
      });
}

void redirect(httplib::Response& response, const std::string& path) {
  response.status = 301;
  // With one slash: two are the name of a server.
  response.set_header("Location", "/" + url_encoded(path.substr(path.find_first_not_of('/'))) + "/");
}

void say_missing(httplib::Response& response, const std::string& what) {
  response.status = 404;
  response.set_content(what + "\n", "text/plain; charset=utf-8");
}

void answer_viewer(const Site& site, const httplib::Request& request, httplib::Response& response) {
  if (!site.viewer) return say_missing(response, viewer_is_missing);
  const std::string path = request.path.substr(std::strlen(viewer_path));
  if (path.empty()) return redirect(response, request.path);
  auto file = site.viewer->file(path == "/" ? "/index.html" : path);
  if (!file) return say_missing(response, "there is no such file");
  send(request, response, std::move(file));
}

bool is_of_viewer(const std::string& path) {
  const std::string_view name = viewer_path;
  return path == name || (path.compare(0, name.size(), name) == 0 && path[name.size()] == '/');
}

void answer_files(const Site& site, const httplib::Request& request, httplib::Response& response) {
  const ServedFiles& files = *site.files;
  if (auto file = files.file(request.path)) {
    send(request, response, std::move(file));
  } else if (request.path.empty()) {  // "GET ?query"
    say_missing(response, "there is no such file");
  } else if (request.path == "/" || (request.path.back() == '/' && files.is_folder(request.path))) {
    if (auto index = files.file(request.path + "index.html"))
      return send(request, response, std::move(index));
    response.status = 200;
    response.set_content(files.page(request.path, site.viewer ? viewer_path : ""),
                         "text/html; charset=utf-8");
  } else if (files.is_folder(request.path)) {
    redirect(response, request.path);
  } else {
    say_missing(response, "there is no such file");
  }
}

/// A page elsewhere can have its own name lead to this machine (DNS rebinding), and then counts as ours; what
/// it cannot do is ask under our name.
bool is_own_host(const httplib::Request& request) {
  const std::string host = request.get_header_value("Host");
  const std::string name = host.substr(0, host.rfind(':'));
  return name == "127.0.0.1" || name == "localhost";
}

void answer_request(const Site& site, const httplib::Request& request, httplib::Response& response) {
  if (site.own_page_only && !is_own_host(request)) {
    response.status = 403;
    response.set_content("this is for the page that maille view has opened\n", "text/plain; charset=utf-8");
  } else if (request.method == "OPTIONS") {
    response.status = 204;
  } else if (request.method != "GET" && request.method != "HEAD") {
    response.status = 405;
    response.set_header("Allow", "GET, HEAD, OPTIONS");
  } else if (is_of_viewer(request.path)) {
    answer_viewer(site, request, response);
  } else if (site.files) {
    answer_files(site, request, response);
  } else {
    say_missing(response, "there is no such file");
  }
}

/// Pages of other servers may read what `maille serve` gives: that is what it is for. What `maille view`
/// shows is for its own page.
httplib::Headers headers_of(const Site& site) {
  httplib::Headers headers = {
      {"Accept-Ranges", "bytes"},
      {"Cache-Control", "no-cache"},  // may be kept, but is asked for again
      // For pages that use several threads (SharedArrayBuffer).
      {"Cross-Origin-Opener-Policy", "same-origin"},
      {"Cross-Origin-Embedder-Policy", "require-corp"},
      {"Cross-Origin-Resource-Policy", site.own_page_only ? "same-origin" : "cross-origin"},
      {"X-Content-Type-Options", "nosniff"},
  };
  if (site.own_page_only) return headers;
  headers.insert({
      {"Access-Control-Allow-Origin", "*"},
      {"Access-Control-Allow-Methods", "GET, HEAD, OPTIONS"},
      {"Access-Control-Allow-Headers", "Range, If-Range, If-None-Match, Cache-Control"},
      {"Access-Control-Expose-Headers", "Accept-Ranges, Content-Length, Content-Range, ETag, Last-Modified"},
      {"Access-Control-Max-Age", "86400"},
  });
  return headers;
}

void set_up(httplib::Server& server, const Site& site, bool verbose) {
  server.new_task_queue = [] { return new ConnectionThreads(most_connections); };
  server.set_tcp_nodelay(true);
  // Not SO_REUSEPORT, which would let two servers share one port.
  server.set_socket_options([](socket_t socket) {
    const int yes = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  server.set_default_headers(headers_of(site));
  server.set_pre_routing_handler([&](const httplib::Request& request, httplib::Response& response) {
    answer_request(site, request, response);
    // Else the library cuts the answer by them again, whatever it is; the request is not const where it is
    // made.
    const_cast<httplib::Request&>(request).ranges.clear();
    return httplib::Server::HandlerResponse::Handled;
  });
  if (!verbose) return;
  server.set_logger([](const httplib::Request& request, const httplib::Response& response) {
    const std::string range = request.get_header_value("Range");
    say(fmt::format("{} {} {}{}{}", response.status, request.method, request.path, range.empty() ? "" : " ",
                    range));
  });
}

/// Ends the server when a signal asks for it. Signals have to be blocked in all threads.
class StopOnSignal {
 public:
  explicit StopOnSignal(httplib::Server& server, const sigset_t& signals)
      : waiting_([this, &server, signals] {
          const timespec now_and_then{0, 100'000'000};
          bool asked = false;
          while (!done_) {
            asked = ::sigtimedwait(&signals, nullptr, &now_and_then) > 0 || asked;
            if (asked && server.is_running()) return server.stop();
          }
        }) {}
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;
  ~StopOnSignal() {
    done_ = true;
    waiting_.join();
  }

 private:
  std::atomic<bool> done_ = false;
  std::thread waiting_;
};

Result<int> listen_at(httplib::Server& server, const std::string& host, int wanted) {
  errno = 0;
  if (wanted == 0) {
    if (const int found = server.bind_to_any_port(host); found > 0) return found;
  } else if (server.bind_to_port(host, wanted)) {
    return wanted;
  }
  const std::string reason = errno != 0 ? std::strerror(errno) : "no such address";
  return failure(ErrorCode::network, fmt::format("cannot listen at {}, port {}: {}{}", host, wanted, reason,
                                                 wanted == 0 ? "" : "; --port 0 takes any that is free"));
}

std::string address_of(const std::string& host, int port) {
  const bool six = host.find(':') != std::string::npos;
  return fmt::format("http://{}{}{}:{}/", six ? "[" : "", host, six ? "]" : "", port);
}

/// Answers until a signal ends it. `ready(address, port)` is called when it does.
template <class Ready>
Result<int> serve(const Site& site, const ServeOptions& options, Ready ready) {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, signal);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  BoundedServer server;
  set_up(server, site, options.common.verbose);
  const int port = TOOL_TRY(listen_at(server, options.host, static_cast<int>(options.port)));
  const std::string address = address_of(options.host, port);
  TOOL_CHECK(ready(address, port));
  const StopOnSignal stop(server, signals);
  if (server.listen_after_bind()) return 0;
  return failure(ErrorCode::network, fmt::format("{}: the server ended", address));
}

Result<> tell_address(const CommonOptions& common, const std::string& address, int port) {
  return answer(common.json ? dump({{"address", address}, {"port", port}}) : address + "\n");
}

bool is_address(const std::string& input) {
  return input.compare(0, 7, "http://") == 0 || input.compare(0, 8, "https://") == 0;
}

/// What a browser would tell only later. Scenes of glTF, compressed or not, it reads by itself.
Result<> check_shown(const std::string& name) {
  if (is_maille(*TOOL_TRY(file_source(name))) || name.ends_with(".glb") || name.ends_with(".gltf")) return {};
  return failure(ErrorCode::corrupt,
                 fmt::format("{}: is not a .maille file; make one of a mesh: maille compress MESH", name));
}

}  // namespace

Result<int> run(const ServeOptions& options) {
  Site site;
  site.files = TOOL_TRY(ServedFiles::open(options.path));
  site.viewer = viewer_files();
  return serve(site, options, [&](const std::string& address, int port) -> Result<> {
    TOOL_CHECK(tell_address(options.common, address + url_encoded(site.files->only()), port));
    if (options.common.quiet) return {};
    say(fmt::format("serving {}; Ctrl-C ends", options.path));
    if (site.viewer) say(fmt::format("viewer: {}{}/", address, viewer_path + 1));
    return {};
  });
}

Result<int> run(const ViewOptions& options) {
  Site site;
  site.own_page_only = true;
  site.viewer = viewer_files();
  if (!site.viewer) return failure(ErrorCode::unsupported, viewer_is_missing);
  std::string shown = options.input;
  if (!is_address(options.input)) {
    site.files = TOOL_TRY(ServedFiles::open(options.input));
    if (site.files->only().empty())
      return failure(ErrorCode::usage, fmt::format("{}: is a folder; see 'maille serve'", options.input));
    TOOL_CHECK(check_shown(options.input));
    shown = "/" + site.files->only();
  }
  ServeOptions server;
  server.common = options.common;
  server.port = options.port;
  return serve(site, server, [&](const std::string& address, int port) -> Result<> {
    const std::string page = fmt::format("{}{}/?file={}", address, viewer_path + 1, url_encoded(shown));
    TOOL_CHECK(tell_address(options.common, page, port));
    const bool opened = options.browser && open_in_browser(page);
    if (!options.common.quiet)
      say(opened ? "opened in the browser; Ctrl-C ends" : "open this address in a browser; Ctrl-C ends");
    return {};
  });
}

}  // namespace maille::tool
