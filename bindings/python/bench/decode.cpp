// Decodes a file from memory as often as there are lines on standard input, and prints the processor time of
// each in seconds: what Python is compared with (bench.py).
#include <maille/decode.h>

#include <cstdio>
#include <ctime>
#include <string>

namespace {

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

int main(int count, char** names) {
  if (count != 2) return 2;
  const auto source = maille::file_source(names[1]);
  if (!source) return 3;
  const auto threads = maille::thread_executor(0);
  const maille::DecodeOptions options{.executor = threads.get()};
  for (int byte = std::getchar(); byte != EOF; byte = std::getchar()) {
    const double begin = processor_seconds();
    const auto mesh = maille::decode(**source, options);
    const double seconds = processor_seconds() - begin;
    if (!mesh) return 6;
    std::printf("%.6f\n", seconds);
    std::fflush(stdout);
  }
  return 0;
}
