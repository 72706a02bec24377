#include "io/foam/foam_writer.h"

namespace maille {

Result<> FoamWriter::begin(const std::string& name, const std::string& kind, const std::string& note) {
  MAILLE_CHECK(sink_.begin_file(name));
  std::string text = "FoamFile\n{\n    version     2.0;\n    format      ";
  text += binary_ ? "binary" : "ascii";
  text += ";\n    class       " + kind + ";\n";
  if (binary_) {
    text += std::string("    arch        \"LSB;label=") + (wide_labels_ ? "64" : "32") +
            ";scalar=" + (single_ ? "32" : "64") + "\";\n";
  }
  if (!note.empty()) text += "    note        \"" + note + "\";\n";
  text += "    location    \"constant/polyMesh\";\n    object      " + name + ";\n}\n\n";
  out_.put(text);
  return {};
}

Result<> FoamWriter::end() {
  out_.put('\n');
  return out_.finish();
}

void FoamWriter::begin_list(uint64_t count) {
  out_.put_number(count);
  out_.put(binary_ ? "\n(" : "\n(\n");
}

void FoamWriter::put_label(uint64_t label) {
  if (!binary_) {
    out_.put_number(label);
    out_.put('\n');
  } else if (wide_labels_) {
    out_.put_raw(static_cast<int64_t>(label));
  } else {
    out_.put_raw(static_cast<int32_t>(label));
  }
}

void FoamWriter::put_flag(bool flag) {
  out_.put(binary_ ? static_cast<char>(flag) : flag ? '1' : '0');
  if (!binary_) out_.put('\n');
}

}  // namespace maille
