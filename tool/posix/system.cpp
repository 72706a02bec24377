#include "system.h"

#include <maille/source.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <cerrno>
#include <csignal>
#include <cstring>
#include <initializer_list>

namespace maille::tool {
namespace {

// Only calls that are safe in a signal handler.
void clean_up_and_exit(int signal) {
  maille::remove_unfinished_files();
  _exit(128 + signal);
}

// For signals that may leave a core: its handler is the system's again, and gets the signal afterwards.
void clean_up_and_crash(int signal) {
  maille::remove_unfinished_files();
  raise(signal);
}

void handle(std::initializer_list<int> signals, void (*handler)(int), int flags) {
  struct sigaction action = {};
  action.sa_handler = handler;
  action.sa_flags = flags;
  sigfillset(&action.sa_mask);
  for (const int signal : signals) {
    struct sigaction before = {};
    sigaction(signal, nullptr, &before);
    // Under nohup and in pipelines of scripts a signal may be ignored on purpose.
    if (before.sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);
  }
}

}  // namespace

char** utf8_arguments(int&, char** arguments) {
  return arguments;
}

void install_signal_handlers() {
  // SIGXCPU: batch systems, and `ulimit -t`.
  handle({SIGINT, SIGTERM, SIGHUP, SIGXCPU}, clean_up_and_exit, 0);
  handle({SIGQUIT, SIGABRT}, clean_up_and_crash, static_cast<int>(SA_RESETHAND));
  // A closed pipe and the limit on file sizes are errors of write() then, with a message and an exit code.
  for (const int signal : {SIGPIPE, SIGXFSZ}) std::signal(signal, SIG_IGN);
}

bool is_of_closed_pipe(const std::string& message) {
  return message.ends_with(std::strerror(EPIPE));
}

// One file has one device and one inode.
bool is_same_file(const std::string& a, const std::string& b) {
  struct stat first = {}, second = {};
  return stat(a.c_str(), &first) == 0 && stat(b.c_str(), &second) == 0 && first.st_dev == second.st_dev &&
         first.st_ino == second.st_ino && !S_ISCHR(first.st_mode);
}

Result<std::string> make_empty_file(const std::string& prefix, const std::string& suffix) {
  std::string path = prefix + "XXXXXX" + suffix;
  const int file = ::mkstemps(path.data(), static_cast<int>(suffix.size()));
  if (file < 0) return failure(ErrorCode::write_failed, path + ": " + std::strerror(errno));
  ::close(file);
  return path;
}

// By default, glibc raises the size from which it takes memory directly from the system whenever such memory
// is freed. Setting the threshold ends that.
void keep_memory_small() {
#ifdef __GLIBC__
  constexpr int large = 64 << 10;
  mallopt(M_MMAP_THRESHOLD, large);
  mallopt(M_TRIM_THRESHOLD, 2 * large);
#endif
}

}  // namespace maille::tool
