#pragma once

#include <maille/mesh.h>
#include <string>
#include <vector>

// Sentences writers tell the user when a format cannot hold something.

namespace maille {

/// Blocks that have a name lose it.
void note_block_names(const Mesh& mesh, std::vector<std::string>& notes);
/// Text holds "nan" and "-nan", no other NaN bits.
void note_nan_payloads(const Mesh& mesh, std::vector<std::string>& notes);
/// 'array "x" on points left out', or one more name in the note that says so of others.
void note_array(const Array& array, std::vector<std::string>& notes);
/// Metadata that is not written; keys of readers' own ("ply.", "stl.", ...) are passed over in silence.
void note_metadata(const std::string& key, const std::string& value, std::vector<std::string>& notes);

}  // namespace maille
