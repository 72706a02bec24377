// Verbs of the program `maille-full`, which is this command with other codecs and the server linked to it:
// loaded in every process these would take 6 MB, as much as a stream with a small front does.
#include "system.h"
#include "verbs.h"

namespace maille::tool {

Result<int> run(const BenchOptions&) {
  return become_full_program();
}
Result<int> run(const ServeOptions&) {
  return become_full_program();
}
Result<int> run(const ViewOptions&) {
  return become_full_program();
}

}  // namespace maille::tool
