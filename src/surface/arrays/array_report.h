#pragma once

#include <maille/encode.h>

namespace maille {

/// What can be said of an array before it is coded.
inline ArrayReport report_of(const Array& array) {
  ArrayReport report;
  report.name = array.name;
  report.domain = array.domain;
  report.type = array.type;
  report.components = array.components;
  report.elements = array.count();
  report.raw_bytes = array.bytes.size();
  return report;
}

/// The same of a mesh: its size, and what connectivity takes.
inline EncodeReport report_of(const Mesh& mesh) {
  EncodeReport report;
  report.points = mesh.point_count();
  report.cells = mesh.cell_count();
  report.connectivity.name = "connectivity";
  report.connectivity.domain = Domain::cell;
  report.connectivity.type = Scalar::u32;
  report.connectivity.elements = mesh.cell_count();
  for (const CellBlock& block : mesh.blocks) {
    report.connectivity.raw_bytes +=
        block.connectivity.size() * 4 + block.offsets.size() * 8 + block.types.size();
  }
  return report;
}

/// What is left of the file when all else is told.
inline void set_other_bytes(EncodeReport& report) {
  report.other_bytes =
      report.file_bytes - report.connectivity.coded_bytes - report.order_bytes - report.positions.coded_bytes;
  for (const ArrayReport& array : report.arrays) report.other_bytes -= array.coded_bytes;
}

}  // namespace maille
