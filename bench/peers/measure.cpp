#include "measure.h"

#include <malloc.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#include <csignal>
#include <cstdio>
#include <cstring>

namespace maille::bench {
namespace {

constexpr unsigned child_seconds = 600;

// A line of /proc/self/status in bytes: VmRSS (resident now), VmHWM (most ever).
uint64_t status_bytes(const char* field) {
  std::FILE* file = std::fopen("/proc/self/status", "r");
  if (file == nullptr) return 0;
  char line[256];
  unsigned long long kib = 0;
  while (std::fgets(line, sizeof(line), file) != nullptr) {
    if (std::strncmp(line, field, std::strlen(field)) == 0) {
      std::sscanf(line + std::strlen(field), ": %llu", &kib);
      break;
    }
  }
  std::fclose(file);
  return uint64_t{kib} * 1024;
}

// Memory that malloc kept from earlier work would hide what this work needs, so it is given back first; and
// large blocks come from the system each time.
uint64_t prepare_memory() {
  mallopt(M_MMAP_THRESHOLD, 128 * 1024);
  malloc_trim(0);
  if (std::FILE* file = std::fopen("/proc/self/clear_refs", "w")) {
    std::fputs("5", file);  // the high-water mark starts anew
    std::fclose(file);
  }
  return status_bytes("VmRSS");
}

void report(int pipe_end, const Trial& trial) {
  const uint8_t ok = trial.ok;
  const bool written = write(pipe_end, &ok, 1) == 1 && write(pipe_end, &trial.peak_bytes, 8) == 8 &&
                       write(pipe_end, trial.problem.data(), trial.problem.size()) >= 0;
  _exit(written ? 0 : 1);
}

[[noreturn]] void run_child(int pipe_end, const std::function<std::string()>& work) {
  alarm(child_seconds);
  if (std::freopen("/dev/null", "w", stderr) == nullptr) _exit(1);  // what asserts print is not our output
  const uint64_t before = prepare_memory();
  Trial trial;
  trial.problem = work();
  trial.ok = trial.problem.empty();
  const uint64_t peak = status_bytes("VmHWM");
  trial.peak_bytes = peak > before ? peak - before : 0;
  report(pipe_end, trial);
  _exit(0);
}

std::string read_all(int pipe_end) {
  std::string text;
  char buffer[4096];
  for (ssize_t count; (count = read(pipe_end, buffer, sizeof(buffer))) > 0;) {
    text.append(buffer, static_cast<size_t>(count));
  }
  return text;
}

}  // namespace

double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Trial try_in_child(const std::function<std::string()>& work) {
  int ends[2];
  if (pipe(ends) != 0) return {false, "no pipe", 0};
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child < 0) return {false, "no process", 0};
  if (child == 0) {
    close(ends[0]);
    run_child(ends[1], work);
  }
  close(ends[1]);
  const std::string answer = read_all(ends[0]);
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM)
    return {false, "not done after " + std::to_string(child_seconds) + " s", 0};
  if (WIFSIGNALED(status)) return {false, std::string("crashed: ") + strsignal(WTERMSIG(status)), 0};
  if (answer.size() < 9) return {false, "ended without an answer", 0};
  Trial trial;
  trial.ok = answer[0] != 0;
  std::memcpy(&trial.peak_bytes, &answer[1], 8);
  trial.problem = answer.substr(9);
  return trial;
}

}  // namespace maille::bench
