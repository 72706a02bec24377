#pragma once

#include <maille/compare.h>
#include <maille/decode.h>
#include <maille/encode.h>

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace maille::testing {

struct RandomMeshOptions;

struct Encoded {
  std::vector<std::byte> bytes;
  EncodeReport report;
};

/// encode() into memory.
Result<Encoded> encode_bytes(const Mesh& mesh, const EncodeOptions& options = {});
/// decode() from memory.
Result<Mesh> decode_bytes(const std::vector<std::byte>& bytes, const DecodeOptions& options = {});

/// What compare() says, roles and metadata included, as one text; empty when equal.
std::string differences_between(const Mesh& a, const Mesh& b, bool same_order = false);

/// Does some edge have more than two faces, or two that cannot agree which way round they are? Which of them
/// fans glue depends on the order of the faces, so that encoding the decoded mesh may give another file.
bool is_glued_by_choice(const Mesh& mesh);
/// Do points lie at one place? Mode single may code them as one (format.md, 13.7), and whether that is
/// smaller depends on their order, too, so that encoding the decoded mesh may give another file.
bool has_twins(const Mesh& decoded);

/// A small mesh as text for a failed test: points, blocks, faces, arrays; sizes only when it is large.
std::string describe(const Mesh& mesh);

/// Says what is wrong with a mesh; empty when all is well.
using Property = std::function<std::string(const Mesh&)>;

/// Checks random surfaces of cases(`count`) seeds from `first` on. At the first failure the message has the
/// seed, what is wrong and the smallest failing mesh that a search over small ones finds. Empty when all
/// hold.
std::string check_random_surfaces(uint64_t first, uint64_t count, const RandomMeshOptions& options,
                                  const Property& property);

}  // namespace maille::testing
