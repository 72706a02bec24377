#pragma once

#include <maille/decode.h>
#include <maille/encode.h>

#include <span>
#include <vector>

#include "surface/joins.h"
#include "surface/patch_streams.h"

namespace maille {

/// The mesh as one patch, or cut into parts of which each is one. docs/format.md, "Parts".
struct EncodedParts {
  std::vector<PartDescription> descriptions;  ///< empty: the mesh is one patch
  std::vector<EncodedPatch> patches;
  std::vector<std::byte> joins;
  JoinedPoints joined;
};

/// The same for any executor. Errors: those of encode_patch().
Result<EncodedParts> encode_parts(const Mesh& mesh, std::span<const ArrayToCode> arrays,
                                  const EncodeOptions& options);

/// Inverse of what encode_parts() does to a mesh of several parts; `joins` are its bytes.
Result<DecodedPatch> decode_parts(const FileReader& reader, const Description& description, Bytes joins,
                                  const DecodeOptions& options);

}  // namespace maille
