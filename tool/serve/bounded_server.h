#pragma once

#include <httplib.h>

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <vector>

namespace maille::tool {

/// A server that no client can hold: who sends a request slowly or without end, or does not take the answer,
/// loses the connection. httplib alone waits for each read by itself, for as many headers as come.
class BoundedServer final : public httplib::Server {
 private:
  bool process_and_close_socket(socket_t socket) override;
};

/// A thread for each connection as long as it is kept: browsers keep six each, and others stand idle. More
/// than `most` wait until one ends.
class ConnectionThreads final : public httplib::TaskQueue {
 public:
  explicit ConnectionThreads(size_t most) : most_(most) {}
  void enqueue(std::function<void()> connection) override;
  void shutdown() override;

 private:
  void work();

  const size_t most_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> waiting_;
  std::vector<std::thread> threads_;
  size_t idle_ = 0;
  bool ended_ = false;
};

}  // namespace maille::tool
