#include "io/format.h"
#include "io/xdmf/xdmf.h"

namespace maille {
namespace {

Result<std::vector<std::string>> write_xdmf(const Mesh&, Sink& sink, const WriteOptions&) {
  return failure(ErrorCode::usage, sink.name() + ": XDMF files cannot be written; write .vtu");
}

bool recognise_xdmf(Bytes bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return text.find("<Xdmf") != std::string_view::npos;
}

}  // namespace

const Format& xdmf_format() {
  static const Format format{{"xdmf",
                              {".xdmf", ".xmf"},
                              "XDMF with values in XML or HDF5: uniform grids; reading only",
                              true,
                              false},
                             recognise_xdmf,
                             read_xdmf,
                             write_xdmf};
  return format;
}

}  // namespace maille
