#pragma once

#include <maille/gltf.h>

#include <optional>
#include <string>
#include <vector>

#include "files.h"
#include "options.h"

// glTF files that hold .maille files: model.maille.glb, model.maille.gltf.
namespace maille::tool {

/// Whether compress is to keep the rest of the asset: "model.maille.glb". A plain "model.glb" is more likely
/// a second input.
bool names_compressed_gltf(const std::string& path);
Result<uint64_t> compress_to_gltf(const CompressOptions& options);

/// The .maille files of a glTF file. Nothing where it is no glTF file, or one without them.
Result<std::vector<GltfPart>> parts_of_gltf(const Input& input);
/// Opens a file that may be one; nothing where it is not, so that the usual way is to be gone.
Result<std::optional<Input>> open_compressed_gltf(const std::string& path);

Result<int> decompress_gltf_file(const DecompressOptions& options, const Input& input);
Result<int> info_of_gltf(const InfoOptions& options, const Input& input);
Result<int> verify_gltf(const VerifyOptions& options, const Input& input);

/// A mesh from glTF as its scene shows it, unless it is written as glTF again or wanted as it was stored.
Result<> show_scene(Mesh& mesh, const std::string& format, bool as_stored, std::vector<std::string>& notes);

}  // namespace maille::tool
