#pragma once

#include <memory>
#include <string>
#include <vector>
#include "codec.h"

namespace maille::bench {

/// A codec beside which maille is measured.
struct Peer {
  std::string name;
  std::string packages;          ///< of Debian, that bring what it needs
  std::unique_ptr<Codec> codec;  ///< none: it was not there when this was built
};

/// All of them, in the order of tables: those that know meshes best come first.
std::vector<Peer> peers();

}  // namespace maille::bench
