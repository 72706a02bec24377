#include "io/format.h"
#include "io/vtk/vtp.h"
#include "io/vtk/vtu.h"

namespace maille {
namespace {

bool recognise_vtp(Bytes first_bytes) {
  const std::string_view text(reinterpret_cast<const char*>(first_bytes.data()), first_bytes.size());
  return text.find("<VTKFile") != std::string_view::npos && text.find("PolyData") != std::string_view::npos;
}

bool recognise_vtu(Bytes first_bytes) {
  const std::string_view text(reinterpret_cast<const char*>(first_bytes.data()), first_bytes.size());
  return text.find("<VTKFile") != std::string_view::npos &&
         text.find("UnstructuredGrid") != std::string_view::npos;
}

}  // namespace

const Format& vtp_format() {
  static const Format format{
      {"vtp", {".vtp"}, "VTK XML PolyData", false}, recognise_vtp, read_vtp, write_vtp};
  return format;
}

const Format& vtu_format() {
  static const Format format{
      {"vtu", {".vtu", ".pvtu"}, "VTK XML UnstructuredGrid, also in parallel (pvtu)", false},
      recognise_vtu,
      read_vtu,
      write_vtu};
  return format;
}

}  // namespace maille
