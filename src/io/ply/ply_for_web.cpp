// What the full decoder for the web has of the file formats: binary PLY, for regions that a page saves. It
// stands before ply_writer.cpp and what that uses: bindings/wasm/CMakeLists.txt.
#ifdef MAILLE_PLY_ONLY

#include "io/buffered_writer.h"
#include "io/numbers.h"
#include "io/ply/ply_writer.h"

namespace maille {

Result<std::vector<std::string>> write_mesh(const Mesh& mesh, Sink& sink, const WriteOptions&) {
  return write_ply(mesh, sink, {});
}

// Of text nothing is written, and no numbers are read but counts.
void put_scalar(BufferedWriter&, const std::byte*, Scalar) {}
const char* parse_number_slow(const char*, const char*, Number&) {
  return nullptr;
}
bool is_beyond_double(const char*, const char*) {
  return false;
}

}  // namespace maille

#endif
