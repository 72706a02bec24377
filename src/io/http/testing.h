#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <charconv>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace maille::testing {

/// A request as it came.
struct TestRequest {
  std::string method, path;
  std::map<std::string, std::string> headers;  ///< names in small letters
  unsigned number = 0;                         ///< of this server, from 0 on
  bool has_range = false;
  uint64_t first = 0, last = 0;
};

/// Where an answer goes, byte by byte as the test wants it.
class TestConnection {
 public:
  explicit TestConnection(int socket) : socket_(socket) {}
  void send(const std::string& bytes) {
    for (size_t sent = 0; sent < bytes.size();) {
      const ssize_t count = ::send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (count <= 0) return close();
      sent += static_cast<size_t>(count);
    }
  }
  /// Ends the connection in good order.
  void close() { open_ = false; }
  /// Ends it as a crash does.
  void reset() {
    const linger at_once{1, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    open_ = false;
  }
  /// Says nothing until the other side goes away.
  void stall() {
    char byte = 0;
    while (::recv(socket_, &byte, 1, 0) > 0) continue;
    open_ = false;
  }
  bool is_open() const { return open_; }

 private:
  int socket_;
  bool open_ = true;
};

/// A web server on the loopback that answers as badly as a test wants.
class TestServer {
 public:
  using Handler = std::function<void(const TestRequest&, TestConnection&)>;

  explicit TestServer(Handler handler) : handler_(std::move(handler)) {
    ::setenv("no_proxy", "127.0.0.1", 1);
    listening_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    if (::bind(listening_, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
        ::listen(listening_, 64) != 0 ||
        ::getsockname(listening_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
      std::abort();
    }
    port_ = ntohs(address.sin_port);
    accepting_ = std::thread([this] { accept_all(); });
  }
  ~TestServer() {
    stopping_ = true;
    ::shutdown(listening_, SHUT_RDWR);
    accepting_.join();
    {
      const std::lock_guard lock(mutex_);
      for (const int socket : sockets_) ::shutdown(socket, SHUT_RDWR);
    }
    for (std::thread& thread : threads_) thread.join();
    ::close(listening_);
  }

  std::string url(const std::string& path = "/mesh.maille", const std::string& scheme = "http") const {
    return scheme + "://127.0.0.1:" + std::to_string(port_) + path;
  }
  unsigned requests() const { return requests_; }
  /// All that came, in order.
  std::vector<TestRequest> seen() const {
    const std::lock_guard lock(mutex_);
    return seen_;
  }

 private:
  void accept_all() {
    while (!stopping_) {
      const int socket = ::accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC);
      if (socket < 0) continue;
      const std::lock_guard lock(mutex_);
      sockets_.push_back(socket);
      threads_.emplace_back([this, socket] {
        serve(socket);
        const std::lock_guard closing(mutex_);
        std::erase(sockets_, socket);
        ::close(socket);
      });
    }
  }

  void serve(int socket) {
    TestConnection connection(socket);
    std::string bytes;
    while (connection.is_open()) {
      size_t end = 0;
      while ((end = bytes.find("\r\n\r\n")) == std::string::npos) {
        char buffer[4096];
        const ssize_t count = ::recv(socket, buffer, sizeof buffer, 0);
        if (count <= 0) return;
        bytes.append(buffer, static_cast<size_t>(count));
      }
      TestRequest request = parse(bytes.substr(0, end + 2));
      bytes.erase(0, end + 4);
      {
        const std::lock_guard lock(mutex_);
        request.number = requests_++;
        seen_.push_back(request);
      }
      handler_(request, connection);
    }
  }

  static TestRequest parse(const std::string& head) {
    TestRequest request;
    const size_t first = head.find(' '), second = head.find(' ', first + 1);
    request.method = head.substr(0, first);
    request.path = head.substr(first + 1, second - first - 1);
    for (size_t line = head.find("\r\n") + 2; line < head.size();) {
      const size_t end = head.find("\r\n", line), colon = head.find(':', line);
      std::string name = head.substr(line, colon - line);
      for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      request.headers[name] = head.substr(colon + 2, end - colon - 2);
      line = end + 2;
    }
    if (const auto range = request.headers.find("range"); range != request.headers.end()) {
      const std::string& text = range->second;  // bytes=1-2
      const char* const stop = text.data() + text.size();
      const auto [dash, error] = std::from_chars(text.data() + 6, stop, request.first);
      request.has_range = error == std::errc() && std::from_chars(dash + 1, stop, request.last).ptr == stop;
    }
    return request;
  }

  Handler handler_;
  int listening_ = -1;
  uint16_t port_ = 0;
  std::atomic<bool> stopping_ = false;
  std::atomic<unsigned> requests_ = 0;
  mutable std::mutex mutex_;
  std::vector<int> sockets_;
  std::vector<std::thread> threads_;
  std::vector<TestRequest> seen_;
  std::thread accepting_;
};

/// "HTTP/1.1 206 x", the header lines, the length, the content.
inline std::string answer(const std::string& status, const std::string& headers, const std::string& content) {
  return "HTTP/1.1 " + status + "\r\n" + headers + "Content-Length: " + std::to_string(content.size()) +
         "\r\n\r\n" + content;
}

inline std::string content_range(uint64_t first, uint64_t last, uint64_t total) {
  return "Content-Range: bytes " + std::to_string(first) + "-" + std::to_string(last) + "/" +
         std::to_string(total) + "\r\n";
}

/// What a good server answers.
inline std::string good_answer(const TestRequest& request, const std::string& content,
                               const std::string& headers = {}) {
  if (!request.has_range) return answer("200 OK", headers, content);
  if (request.first >= content.size()) {
    return answer("416 Range Not Satisfiable",
                  headers + "Content-Range: bytes */" + std::to_string(content.size()) + "\r\n", "");
  }
  const uint64_t last = std::min<uint64_t>(request.last, content.size() - 1);
  return answer("206 Partial Content", headers + content_range(request.first, last, content.size()),
                content.substr(request.first, last - request.first + 1));
}

}  // namespace maille::testing
