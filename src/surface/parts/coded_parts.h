#pragma once

#include <maille/decode.h>
#include <maille/encode.h>

#include <span>
#include <vector>

#include "description/remains.h"
#include "surface/parts/shared_points.h"
#include "surface/patch_streams.h"

namespace maille {

/// How many cells a part of a mesh of so many may have: what the options say, or else what suits the effort,
/// which may leave the mesh whole. At least 1.
uint64_t most_cells_per_part(const EncodeOptions& options, uint64_t cells);

/// Positions as the decoder will have them, as floats: what is not finite lies at 0, and what is beyond
/// floats at their ends. For cutting.
std::vector<float> decoded_floats(const ArrayToCode& positions, Executor& executor);
/// The same, bit for bit.
Place decoded_place(const ArrayToCode& positions, uint64_t point);
std::vector<Place> decoded_places(const ArrayToCode& positions);

/// The mesh as one patch, or cut into parts of which each is one. docs/format.md, 15.1. The bytes do not
/// depend on the executor.
struct EncodedParts {
  std::vector<PartDescription> descriptions;  ///< empty: the mesh is one patch
  std::vector<EncodedPatch> patches;
  std::vector<std::byte> joins;
  JoinedPoints joined;
};

/// The same for any executor. `corner_twin`: of a WeldedMesh, which is not cut. Errors: those of
/// encode_patch().
Result<EncodedParts> encode_parts(const Mesh& mesh, std::span<const ArrayToCode> arrays,
                                  const EncodeOptions& options, std::span<const uint32_t> corner_twin = {});

/// Inverse of what encode_parts() does to a mesh of several parts, of which so many at once; `joins` are its
/// bytes. The result is valid. Safe on any bytes. Errors: corrupt, cancelled.
Result<DecodedPatch> decode_parts(const FileReader& reader, const Description& description, Bytes joins,
                                  size_t at_once, const DecodeOptions& options);

/// What is left of them: the parts whose cells and positions are whole, and the arrays that are whole in all
/// of these. Without `joins` points on borders that lie at one place are one. Error: corrupt, if no part is
/// left.
Result<Remains> salvage_parts(const FileReader& reader, const Description& description,
                              const Result<std::vector<std::byte>>& joins, size_t at_once,
                              const DecodeOptions& options);

}  // namespace maille
