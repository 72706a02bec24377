#pragma once

#include <maille/io.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/reading.h"

namespace maille {

/// A glTF file taken apart: what describes the meshes, and the bytes they consist of. Buffers are views of
/// `input`, `embedded` and `file_bytes`, so these stay as long as they do.
struct GltfFile {
  std::string name;
  /// JSON with accessors, buffer views, meshes, nodes and scenes only: what a mesh needs, nothing else.
  std::string scene;
  /// One per buffer, of its stated length; shorter only where there is nothing (see fallback).
  std::vector<Bytes> buffers;
  /// JSON of the nodes and of the asset, for metadata.
  std::string nodes, asset;
  std::vector<std::pair<std::string, std::string>> metadata;  ///< as our writer keeps it
  std::vector<std::string> materials;                         ///< names, "" where a material has none
  std::string left_out;                                       ///< "2 textures, 1 animation", or empty
  uint64_t total_bytes = 0;
  std::string_view text;    ///< the whole JSON, in `input`
  bool compressed = false;  ///< extensionsRequired or extensionsUsed has the extension that was allowed

  InputBytes input;
  std::vector<std::vector<std::byte>> embedded;
  std::vector<std::unique_ptr<Source>> files;
  std::vector<InputBytes> file_bytes;
};

/// Where JSON is nested deeper than any real file, if it is. Ask before it is parsed: what copies or writes
/// it calls itself for each level, which would overflow the stack.
std::optional<size_t> json_too_deep(std::string_view json);

/// Takes a .glb or .gltf apart; buffers are data URIs, the binary chunk, or files in the same folder or
/// below. Errors: malformed_input with the byte; unsupported for other versions and for required extensions
/// that change how geometry is stored, but for the one `allowed`; cannot_read for missing files.
Result<GltfFile> open_gltf(const Source& source, std::string_view allowed = {});

}  // namespace maille
