#pragma once

#include <string>
#include <vector>

#include "io/hdf5/hdf5_file.h"

namespace maille {

/// A node of the tree that a CGNS file is. In HDF5 it is a group with attributes "label" (what it is) and
/// "type"; its value is the dataset " data" in it.
struct CgnsNode {
  std::string path, name, label;
};

/// Every node is paid for by the budget, as a hostile file can link to one group many times.
class CgnsTree {
 public:
  CgnsTree(const Hdf5File& file, Budget& budget) : file_(file), budget_(budget) {}

  /// By their names. Errors: unsupported, for a link to another file; malformed_input.
  Result<std::vector<CgnsNode>> children(const CgnsNode& node) const;
  /// The numbers or characters of a node in the order of the file, each a tuple; none where it has no value.
  Result<Array> values(const CgnsNode& node) const;
  /// Error: malformed_input, for floats, too.
  Result<std::vector<int64_t>> integers(const CgnsNode& node) const;
  Result<std::string> text(const CgnsNode& node) const;
  /// Text in pieces of 32 characters, as CGNS keeps lists of names.
  Result<std::vector<std::string>> names(const CgnsNode& node) const;

 private:
  const Hdf5File& file_;
  Budget& budget_;
};

/// The first of this label, and where a name is given, of this name; null where there is none.
const CgnsNode* find_node(const std::vector<CgnsNode>& nodes, std::string_view label,
                          std::string_view name = {});

}  // namespace maille
