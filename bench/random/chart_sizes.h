#pragma once

#include <maille/error.h>

#include <string>

namespace maille {

/// Writes a mesh with charts of 128, 256, ... 32768 faces (effort 2, 14 bits), and prints a row of a table
/// for each: bits of a face, charts' faces and bytes read for boxes, bytes read for one face, speed of
/// decoding.
Result<> study_chart_sizes(const std::string& path);

}  // namespace maille
