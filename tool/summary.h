#pragma once

#include <maille/encode.h>
#include <maille/file.h>
#include <maille/random_access.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

// Arrays as rows of a table and as JSON, the same for compress, info and verify.
namespace maille::tool {

using Json = nlohmann::ordered_json;

/// What compress prints. `seconds` of reading and encoding together. Lossless single values of the mesh share
/// one row, unless `every_array`. `word` is that of cell_word().
std::string summary_text(const EncodeReport& report, const std::string& input, const std::string& output,
                         uint64_t input_bytes, double seconds, bool every_array, const char* word);
Json summary_json(const EncodeReport& report, const std::string& input, const std::string& output,
                  uint64_t input_bytes, double seconds);

/// `sphere`: around the mesh, where it is known.
std::string info_text(const FileInfo& info, const std::string& name, const std::optional<Sphere>& sphere,
                      bool tree, bool chunks);
Json info_json(const FileInfo& info, const std::string& name, const std::optional<Sphere>& sphere);

/// Whether parts of a volume can be read alone (compress --pieces).
bool in_pieces(const FileInfo& info);

/// Of a file that is read as one mesh: that its steps of time are left out, and how to keep them.
std::vector<std::string> notes_of_steps(const FileInfo& info);

/// A JSON text with a newline at its end; names that are not UTF-8 do not make it fail.
std::string dump(const Json& json);

/// What its cells are called: "cell" if there are solids among them, else "face".
const char* cell_word(const Mesh& mesh);

}  // namespace maille::tool
