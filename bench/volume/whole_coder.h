#pragma once

#include <maille/mesh.h>
#include <cstdint>
#include <string>
#include <vector>

namespace maille::bench {

/// A mesh through the whole coder and back, with so many threads; the best of some rounds. Other rows are CPU
/// time of one thread: this one is wall time, so it says something on an idle machine only.
struct WholeCoder {
  std::string from;  ///< "memory"; "memory, pieces": of 65,536 cells; or "VTU": from file to file
  unsigned threads = 1;
  double encode_seconds = 0, decode_seconds = 0;          ///< wall time
  double encode_cpu_seconds = 0, decode_cpu_seconds = 0;  ///< of all threads
  std::string verdict = "exact";
};

/// In memory with one thread and with two, as one stream and in pieces; then with two from a VTU to a .maille
/// and to a VTU, in $TMPDIR or /tmp.
std::vector<WholeCoder> measure_whole_coder(const Mesh& mesh, unsigned rounds);

}  // namespace maille::bench
