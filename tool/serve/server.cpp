#include <fmt/format.h>
#include <httplib.h>
#include <pthread.h>

#include <atomic>
#include <csignal>
#include <ctime>
#include <thread>

#include "result.h"
#include "serve/served_files.h"
#include "summary.h"
#include "text.h"
#include "verbs.h"

namespace maille::tool {

namespace {

/// Browsers keep six connections each, and every one holds a thread while it is kept.
constexpr size_t server_threads = 32;

struct ByteRange {
  uint64_t first = 0, size = 0;
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

void answer_request(const ServedFiles& files, const httplib::Request& request, httplib::Response& response) {
  if (request.method == "OPTIONS") {
    response.status = 204;
  } else if (request.method != "GET" && request.method != "HEAD") {
    response.status = 405;
    response.set_header("Allow", "GET, HEAD, OPTIONS");
  } else if (auto file = files.file(request.path)) {
    send(request, response, std::move(file));
  } else if (request.path == "/" || (request.path.back() == '/' && files.is_folder(request.path))) {
    if (auto index = files.file(request.path + "index.html"))
      return send(request, response, std::move(index));
    response.status = 200;
    response.set_content(files.page(request.path), "text/html; charset=utf-8");
  } else if (files.is_folder(request.path)) {
    response.status = 301;
    // With one slash: two are the name of a server.
    response.set_header("Location",
                        "/" + url_encoded(request.path.substr(request.path.find_first_not_of('/'))) + "/");
  } else {
    response.status = 404;
    response.set_content("there is no such file\n", "text/plain; charset=utf-8");
  }
}

void set_up(httplib::Server& server, const ServedFiles& files, const ServeOptions& options) {
  server.new_task_queue = [] { return new httplib::ThreadPool(server_threads); };
  server.set_keep_alive_max_count(1000);
  server.set_tcp_nodelay(true);
  // Not SO_REUSEPORT, which would let two servers share one port.
  server.set_socket_options([](socket_t socket) {
    const int yes = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  server.set_default_headers({
      {"Accept-Ranges", "bytes"},
      {"Cache-Control", "no-cache"},  // may be kept, but is asked for again
      {"Access-Control-Allow-Origin", "*"},
      {"Access-Control-Allow-Methods", "GET, HEAD, OPTIONS"},
      {"Access-Control-Allow-Headers", "Range, If-Range, If-None-Match, Cache-Control"},
      {"Access-Control-Expose-Headers", "Accept-Ranges, Content-Length, Content-Range, ETag, Last-Modified"},
      {"Access-Control-Max-Age", "86400"},
      // For pages that use several threads (SharedArrayBuffer).
      {"Cross-Origin-Opener-Policy", "same-origin"},
      {"Cross-Origin-Embedder-Policy", "require-corp"},
      {"Cross-Origin-Resource-Policy", "cross-origin"},
      {"X-Content-Type-Options", "nosniff"},
  });
  server.set_pre_routing_handler([&](const httplib::Request& request, httplib::Response& response) {
    answer_request(files, request, response);
    // Else the library cuts the answer by them again, whatever it is; the request is not const where it is
    // made.
    const_cast<httplib::Request&>(request).ranges.clear();
    return httplib::Server::HandlerResponse::Handled;
  });
  if (!options.common.verbose) return;
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

Result<int> bind(httplib::Server& server, const ServeOptions& options) {
  errno = 0;
  const auto port = static_cast<int>(options.port);
  if (port == 0) {
    if (const int found = server.bind_to_any_port(options.host); found > 0) return found;
  } else if (server.bind_to_port(options.host, port)) {
    return port;
  }
  const std::string reason = errno != 0 ? std::strerror(errno) : "no such address";
  return failure(ErrorCode::network,
                 fmt::format("cannot listen at {}, port {}: {}{}", options.host, port, reason,
                             port == 0 ? "" : "; --port 0 takes any that is free"));
}

}  // namespace

Result<int> run(const ServeOptions& options) {
  const ServedFiles files = TOOL_TRY(ServedFiles::open(options.path));
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, signal);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  httplib::Server server;
  set_up(server, files, options);
  const int port = TOOL_TRY(bind(server, options));
  const bool six = options.host.find(':') != std::string::npos;
  const std::string address = fmt::format("http://{}{}{}:{}/{}", six ? "[" : "", options.host, six ? "]" : "",
                                          port, url_encoded(files.only()));
  TOOL_CHECK(answer(options.common.json ? dump({{"address", address}, {"port", port}}) : address + "\n"));
  if (!options.common.quiet) say(fmt::format("serving {}; Ctrl-C ends", options.path));
  const StopOnSignal stop(server, signals);
  if (server.listen_after_bind()) return 0;
  return failure(ErrorCode::network, fmt::format("{}: the server ended", address));
}

}  // namespace maille::tool
