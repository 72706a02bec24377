#pragma once

#include <maille/encode.h>
#include <maille/file.h>

#include <nlohmann/json.hpp>
#include <string>

// Arrays as rows of a table and as JSON, the same for compress, info and verify.
namespace maille::tool {

using Json = nlohmann::ordered_json;

/// What compress prints. `seconds` of reading and encoding together. Lossless single values of the mesh share
/// one row, unless `every_array`.
std::string summary_text(const EncodeReport& report, const std::string& input, const std::string& output,
                         uint64_t input_bytes, double seconds, bool every_array, const char* cell_word);
Json summary_json(const EncodeReport& report, const std::string& input, const std::string& output,
                  uint64_t input_bytes, double seconds);

std::string info_text(const FileInfo& info, const std::string& name, bool chunks);
Json info_json(const FileInfo& info, const std::string& name);

/// A JSON text with a newline at its end; names that are not UTF-8 do not make it fail.
std::string dump(const Json& json);

/// Is a VTK cell type a tetrahedron, a hexahedron or the like?
bool is_solid(uint8_t type);
/// Has it tetrahedra, hexahedra or the like? Its cells are called cells then, else faces.
bool has_solids(const Mesh& mesh);
/// Number of cells.
std::string cells_text(uint64_t count, const char* word);

}  // namespace maille::tool
