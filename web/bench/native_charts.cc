// maille_native_charts FILE ROUNDS: millions of triangles a second of CPU time at which the native library decodes
// the charts of a file of mode random one by one, for bench/decode.js to stand beside WebAssembly.
#include <maille/random_access.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>

int main(int count, char** arguments) {
  if (count != 3) return 2;
  const auto source = maille::file_source(arguments[1]);
  if (!source) return 3;
  auto file = maille::File::open(**source);
  if (!file) return 6;
  const auto all = file->select({}, maille::Detail::full());
  if (!all) return 6;
  double best = 0;
  for (int round = std::atoi(arguments[2]); round > 0; --round) {
    const std::clock_t begin = std::clock();
    uint64_t faces = 0;
    for (const maille::ChartPlace& place : all->charts) {
      const auto mesh = file->read(place);
      if (!mesh) return 6;
      faces += mesh->cell_count();
    }
    const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    best = std::max(best, static_cast<double>(faces) / seconds * 1e-6);
  }
  std::printf("%.2f\n", best);
}
