#include "io/format.h"
#include "io/obj/obj_pass.h"

namespace maille {
namespace {

/// Recognises text whose lines begin with OBJ's keywords, up to a vertex with a number behind it or a
/// reference to a material library. Labels alone are not enough, as other texts have such words.
bool recognise(Bytes first) {
  TextScanner scanner(std::string_view(reinterpret_cast<const char*>(first.data()), first.size()));
  while (!scanner.at_end()) {
    scanner.skip_white('#');
    const std::string_view word = scanner.word();
    if (word == "mtllib") return true;
    if (word == "v" || word == "vn" || word == "vt") {
      scanner.skip_blanks();
      Number number;
      return scanner.number(number);
    }
    if (word != "o" && word != "g" && word != "usemtl" && word != "s") return false;
    scanner.skip_line();
  }
  return false;
}

}  // namespace

Result<ReadResult> read_obj(const Source& source, const ReadOptions& options) {
  const InputBytes input = MAILLE_TRY(InputBytes::load(source));
  Watch watch(source, input.bytes().size(), options);
  ObjKnowledge known;
  // Every pass but the last adds to what is known, and there are at most a dozen things to know: five arrays
  // that may need doubles, the components of two, and the counts.
  for (;;) {
    ObjPass pass(input.text(), known, watch);
    if (MAILLE_TRY(pass.run()) == ObjPass::Outcome::again) {
      watch.restart();
      continue;
    }
    ReadResult result;
    result.mesh = pass.take_mesh(result.notes);
    MAILLE_CHECK(watch.at(input.bytes().size(), size_in_memory(result.mesh)));
    return result;
  }
}

const Format& obj_format() {
  static const Format format{{"obj", {".obj"}, "Wavefront OBJ", true}, recognise, read_obj, write_obj};
  return format;
}

}  // namespace maille
