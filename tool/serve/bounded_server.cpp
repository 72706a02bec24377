#include "serve/bounded_server.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <system_error>

namespace maille::tool {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;
using std::chrono::seconds;

/// Of a request, with its headers and what it may have behind them: only GET has an answer.
constexpr size_t most_request_bytes = size_t{64} << 10;
constexpr seconds most_request_time{10};
/// How long a connection is kept for another request, and how many requests it may bring. A viewer asks for
/// charts all the time, so connections are worth keeping, but an idle one holds a thread.
constexpr seconds kept_time{5};
constexpr int most_requests = 1000;
/// How much of an answer a client must take in which time: 800 bytes a second. A client that takes nothing
/// holds its thread for 20 seconds at most.
constexpr seconds answer_window{20};
constexpr size_t least_taken = size_t{16} << 10;
/// How often to see whether the server ends.
constexpr milliseconds glance{200};

class Connection final : public httplib::Stream {
 public:
  Connection(const httplib::Server& server, socket_t socket) : server_(server), socket_(socket) {}

  bool wait_for_request() { return next_ < end_ || wait(POLLIN, Clock::now() + kept_time); }
  void begin_request() {
    deadline_ = Clock::now() + most_request_time;
    request_bytes_ = answer_bytes_ = 0;
    spent_ = false;
  }

  ssize_t read(char* out, size_t size) override {
    spent_ =
        request_bytes_ >= most_request_bytes || Clock::now() > deadline_ || (next_ == end_ && !receive());
    if (spent_) return -1;
    const size_t count = std::min(size, end_ - next_);
    std::copy_n(buffer_.data() + next_, count, out);
    next_ += count;
    request_bytes_ += count;
    return static_cast<ssize_t>(count);
  }
  /// The request took too much, came too slowly, or ended within.
  bool is_spent() const { return spent_; }
  /// All of it: httplib does not look whether a head went out whole.
  ssize_t write(const char* data, size_t size) override {
    for (size_t done = 0; done < size;) {
      const ssize_t count = send_some(data + done, size - done);
      if (count < 0) return -1;
      done += static_cast<size_t>(count);
    }
    return static_cast<ssize_t>(size);
  }
  bool is_readable() const override { return next_ < end_ || wait(POLLIN, deadline_); }
  bool is_writable() const override { return wait(POLLOUT, Clock::now() + answer_window); }
  void get_remote_ip_and_port(std::string&, int&) const override {}
  void get_local_ip_and_port(std::string&, int&) const override {}
  socket_t socket() const override { return socket_; }

 private:
  bool receive() {
    if (!wait(POLLIN, deadline_)) return false;
    const ssize_t count = ::recv(socket_, buffer_.data(), buffer_.size(), MSG_DONTWAIT);
    next_ = 0;
    end_ = count > 0 ? static_cast<size_t>(count) : 0;
    return count > 0;
  }
  ssize_t send_some(const char* data, size_t size) {
    if (answer_bytes_ == 0) window_end_ = Clock::now() + answer_window;
    if (!wait(POLLOUT, window_end_)) return -1;
    const ssize_t count = ::send(socket_, data, size, MSG_NOSIGNAL | MSG_DONTWAIT);
    // poll() said that there is room, but the buffer may be full again by now. The window ends the wait in
    // any case.
    if (count < 0) return errno == EAGAIN || errno == EINTR ? 0 : -1;
    answer_bytes_ += static_cast<size_t>(count);
    if (answer_bytes_ >= least_taken) answer_bytes_ = 0;  // the next window
    return count;
  }
  bool wait(short what, Clock::time_point until) const {
    while (server_.is_running()) {
      const auto left = std::chrono::duration_cast<milliseconds>(until - Clock::now());
      if (left.count() < 0) return false;
      pollfd asked{socket_, what, 0};
      const int found = ::poll(&asked, 1, static_cast<int>(std::min(left, glance).count()));
      if (found > 0) return (asked.revents & what) != 0;
      if (found < 0 && errno != EINTR) return false;
    }
    return false;
  }

  const httplib::Server& server_;
  const socket_t socket_;
  Clock::time_point deadline_{}, window_end_{};
  size_t request_bytes_ = 0;
  size_t answer_bytes_ = 0;  ///< in this window
  std::array<char, 4096> buffer_;
  size_t next_ = 0, end_ = 0;
  bool spent_ = false;
};

}  // namespace

bool BoundedServer::process_and_close_socket(socket_t socket) {
  Connection connection(*this, socket);
  for (int left = most_requests; left > 0 && connection.wait_for_request(); --left) {
    connection.begin_request();
    bool closed = false, understood = false;
    const auto after_head = [&](httplib::Request&) { understood = true; };
    if (!process_request(connection, left == 1, closed, after_head) || closed) break;
    // What follows something that is no request, or half of one, is none either.
    if (!understood || connection.is_spent()) break;
  }
  ::shutdown(socket, SHUT_RDWR);
  ::close(socket);
  return true;
}

void ConnectionThreads::enqueue(std::function<void()> connection) {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(std::move(connection));
  wake_.notify_one();
  if (waiting_.size() <= idle_ || threads_.size() == most_) return;
  try {
    threads_.emplace_back([this] { work(); });
  } catch (const std::system_error&) {
    // The machine has no thread more: connections wait for one that ends, or, if there is none, for a thread
    // that the next connection may start. Dropping the connection would leave its socket open.
  }
}

void ConnectionThreads::shutdown() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  wake_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void ConnectionThreads::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    ++idle_;
    wake_.wait(lock, [&] { return ended_ || !waiting_.empty(); });
    --idle_;
    if (waiting_.empty()) return;
    const std::function<void()> connection = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    connection();
    lock.lock();
  }
}

}  // namespace maille::tool
