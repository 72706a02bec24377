#include <maille/source.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <initializer_list>
#include <new>

#include "command_line.h"
#include "text.h"
#include "verbs.h"

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

void install_signal_handlers() {
  // SIGXCPU: batch systems, and `ulimit -t`.
  handle({SIGINT, SIGTERM, SIGHUP, SIGXCPU}, clean_up_and_exit, 0);
  handle({SIGQUIT, SIGABRT}, clean_up_and_crash, static_cast<int>(SA_RESETHAND));
  // A closed pipe and the limit on file sizes are errors of write() then, with a message and an exit code.
  for (const int signal : {SIGPIPE, SIGXFSZ}) std::signal(signal, SIG_IGN);
}

// Each verb has its own type of options and its own overload of run() (verbs.h).
maille::Result<int> run(int argc, char** argv) {
  const auto command = maille::tool::parse_command_line(argc, argv);
  if (!command) return tl::unexpected(command.error());
  return std::visit([](const auto& options) { return maille::tool::run(options); }, *command);
}

}  // namespace

// The exit code is the verb's answer or the code of its error. The library throws no exceptions of its own,
// so only a refused allocation is caught here.
int main(int argc, char** argv) {
  install_signal_handlers();
  try {
    const auto result = run(argc, argv);
    if (result) return *result;
    // A reader that has seen enough, as in `| head`, needs no message; the exit code is for scripts.
    const bool is_closed_pipe = result.error().message.ends_with(std::strerror(EPIPE));
    if (!is_closed_pipe) maille::tool::complain(result.error().message);
    return static_cast<int>(result.error().code);
  } catch (const std::bad_alloc&) {
    maille::remove_unfinished_files();
    maille::tool::complain("out of memory; the mesh needs more than this machine gives");
    return static_cast<int>(maille::ErrorCode::memory_bound);
  }
}
