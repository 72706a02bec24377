#pragma once

#include <maille/mesh.h>

#include <map>
#include <string>
#include <vector>

#include "io/budget.h"

namespace maille {

/// Points or cells that follow each other in the mesh.
struct ElementRun {
  uint64_t first, count;
};

/// Arrays of a mesh that comes in zones, each of which has arrays of its own and types of its own. They are
/// put together at the end, when all are known.
class ZoneFields {
 public:
  /// `runs`: as many elements as the array has tuples.
  void add(std::vector<ElementRun> runs, Array values);
  /// In the order in which names came first. Where a zone has no values there is NaN, or 0 of integers;
  /// floats of both types become doubles. Arrays of other types or components in another zone are left out
  /// with a note. `mesh` has its points; `cells`: the number of its cells. Errors: those of the budget.
  Result<> finish(uint64_t cells, Budget& budget, Mesh& mesh, std::vector<std::string>& notes);

 private:
  struct Field {
    std::string name;
    Domain domain = Domain::point;
    std::vector<std::pair<std::vector<ElementRun>, Array>> parts;
  };

  std::vector<Field> fields_;
  std::map<std::pair<Domain, std::string>, size_t> numbers_;
};

}  // namespace maille
