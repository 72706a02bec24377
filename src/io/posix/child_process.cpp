#include "io/hdf5/child_process.h"

#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

#ifdef __linux__
#include <sys/prctl.h>
#endif

namespace maille {
namespace {

/// Sends or receives all of it; false where the other side is gone. MSG_NOSIGNAL: a child that died must not
/// end this process by SIGPIPE.
bool send_all(int socket, const void* bytes, size_t size) {
  const auto* at = static_cast<const char*>(bytes);
  while (size > 0) {
    const ssize_t sent = ::send(socket, at, std::min<size_t>(size, 1u << 30), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return false;
    at += sent;
    size -= static_cast<size_t>(sent);
  }
  return true;
}

bool receive_all(int socket, void* bytes, size_t size) {
  auto* at = static_cast<char*>(bytes);
  while (size > 0) {
    const ssize_t got = ::recv(socket, at, std::min<size_t>(size, 1u << 30), 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    at += got;
    size -= static_cast<size_t>(got);
  }
  return true;
}

bool send_message(int socket, Bytes bytes) {
  const uint64_t size = bytes.size();
  return send_all(socket, &size, sizeof(size)) && send_all(socket, bytes.data(), bytes.size());
}

std::optional<std::vector<std::byte>> receive_message(int socket) {
  uint64_t size = 0;
  if (!receive_all(socket, &size, sizeof(size))) return std::nullopt;
  std::vector<std::byte> bytes;
  // The bytes are taken as they arrive: a child that went mad may send any size. A step of 64 MiB was chosen,
  // not swept; it bounds what a false size can cost.
  constexpr uint64_t step = uint64_t{64} << 20;
  while (bytes.size() < size) {
    const size_t before = bytes.size();
    bytes.resize(before + std::min(step, size - before));
    if (!receive_all(socket, bytes.data() + before, bytes.size() - before)) return std::nullopt;
  }
  return bytes;
}

/// What this process has mapped, sanitizers' terabytes included: the child begins with a copy of these
/// mappings, and RLIMIT_AS counts all of them.
uint64_t mapped_bytes() {
  unsigned long pages = 0;
  if (FILE* const file = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(file, "%lu", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  return uint64_t{pages} * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

void limit(decltype(RLIMIT_AS) what, uint64_t most) {
  rlimit bound{};
  if (getrlimit(what, &bound) != 0) return;
  bound.rlim_cur = std::min<rlim_t>(bound.rlim_cur, most);
  setrlimit(what, &bound);
}

/// Answers questions until the parent is gone. Never returns, and leaves nothing behind: no core, and no
/// handlers or destructors of the parent run, which would remove the parent's unfinished files.
[[noreturn]] void serve(int socket, pid_t parent, const std::function<ChildProcess::Answer()>& make) {
#ifdef __linux__
  // Should the parent be killed, the child ends, too. It may have been killed before the call, hence the
  // comparison.
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(0);
#endif
  static_cast<void>(parent);
  for (const int signal : {SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGXCPU, SIGTERM, SIGINT})
    std::signal(signal, SIG_DFL);
  limit(RLIMIT_CORE, 0);
  // What a library or the allocator says of its last moments is of no use to anybody.
  std::fclose(stderr);
  ::close(STDERR_FILENO);
  const ChildProcess::Answer answer = make();
  while (const auto question = receive_message(socket)) {
    if (!send_message(socket, answer(*question))) break;
  }
  _exit(0);
}

}  // namespace

Result<std::unique_ptr<ChildProcess>> ChildProcess::start(const std::function<Answer()>& make, uint64_t bytes,
                                                          uint64_t seconds) {
  int sockets[2] = {-1, -1};
  const pid_t parent = getpid();
  // Read before fork(): a child of a process with threads should do as little as it can before its limits
  // hold.
  const uint64_t mapped = mapped_bytes();
  const pid_t id = ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets) == 0 ? ::fork() : -1;
  if (id == 0) {
    ::close(sockets[0]);
    // Limits are set in the child only. CPU time that is used up ends it by SIGXCPU, whose handler is the
    // system's own.
    limit(RLIMIT_AS, mapped + std::min(bytes, UINT64_MAX - mapped));
    limit(RLIMIT_CPU, seconds);
    serve(sockets[1], parent, make);
  }
  const std::string reason = std::strerror(errno);
  if (sockets[1] >= 0) ::close(sockets[1]);
  if (id > 0) return std::unique_ptr<ChildProcess>(new ChildProcess(id, sockets[0]));
  if (sockets[0] >= 0) ::close(sockets[0]);
  return failure(ErrorCode::cannot_read, "cannot start a process that reads the file: " + reason);
}

ChildProcess::~ChildProcess() {
  ::close(socket_);
  // It may hang in the library and never read the closed socket. waitpid() follows so that no zombie stays.
  ::kill(id_, SIGKILL);
  while (::waitpid(id_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

std::optional<std::vector<std::byte>> ChildProcess::ask(Bytes question) {
  std::optional<std::vector<std::byte>> answer;
  if (alive_ && send_message(socket_, question)) answer = receive_message(socket_);
  alive_ = answer.has_value();
  return answer;
}

}  // namespace maille
