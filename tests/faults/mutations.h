#pragma once

#include <maille/encode.h>
#include <maille/mesh.h>

#include <string>
#include <vector>

#include "support/random.h"

namespace maille::testing {

/// A file to be damaged.
struct Seed {
  std::string name;
  std::vector<std::byte> bytes;
  Mode mode = Mode::single;
  Mesh mesh;  ///< what it decodes to
};

/// A .maille file with damage; `mended`: its checksums fit all the same, as those of somebody do who wants
/// them to. Bits, bytes, counts, cut and copied runs, streams left out, doubled, exchanged, or of another
/// file.
struct Mutation {
  std::vector<std::byte> bytes;
  bool mended = false;
};
Mutation mutated(const Seed& seed, const std::vector<Seed>& others, Random& random);

/// The same for files of other formats: besides, numbers and words that are odd.
std::vector<std::byte> mutated_text(const std::vector<std::byte>& bytes, const std::vector<std::byte>& other,
                                    Random& random);

}  // namespace maille::testing
