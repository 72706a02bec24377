#include <maille/compare.h>

#include "mesh/compare/compare_order.h"
#include "mesh/compare/compare_renaming.h"

#include <map>
#include <utility>

namespace maille {

namespace {

// A person reads these sentences; a dozen fill half a screen.
constexpr size_t max_differences = 12;

std::string describe_description(const Array& array) {
  std::string text = std::string(name_of(array.type)) + " x " + std::to_string(array.components);
  return has_labels(array) ? text + " with labels" : text;
}

/// Whether values can be compared: bits need the same type, texts do not.
bool same_description(const Array& a, const Array& b) {
  if (a.components != b.components || has_labels(a) != has_labels(b)) return false;
  return a.type == b.type || has_labels(a);
}

/// Arrays of the same name and domain belong together, wherever they stand; of several, in their order.
std::vector<ArrayPair> pair_arrays(const Mesh& a, const Mesh& b, std::vector<std::string>& differences) {
  // A map, because its order is that of the messages: they are the same in each run.
  std::map<std::pair<Domain, std::string>, std::vector<const Array*>> of_b;
  for (const Array& array : b.arrays) of_b[{array.domain, array.name}].push_back(&array);
  std::vector<ArrayPair> pairs;
  for (const Array& array : a.arrays) {
    auto& partners = of_b[{array.domain, array.name}];
    if (partners.empty()) {
      differences.push_back(describe_array(array) + " is only in A");
      continue;
    }
    const Array& partner = *partners.front();
    partners.erase(partners.begin());
    if (!same_description(array, partner)) {
      differences.push_back(describe_array(array) + " is " + describe_description(array) + " in A, " +
                            describe_description(partner) + " in B");
    } else {
      pairs.push_back({&array, &partner});
    }
  }
  for (const auto& [key, partners] : of_b) {
    for (const Array* array : partners) differences.push_back(describe_array(*array) + " is only in B");
  }
  return pairs;
}

void compare_count(const char* what, uint64_t a, uint64_t b, std::vector<std::string>& differences) {
  if (a == b) return;
  differences.push_back("A has " + std::to_string(a) + " " + what + ", B " + std::to_string(b));
}

/// Mesh arrays have an order of their own; they leave the list.
void compare_mesh_arrays(std::vector<ArrayPair>& arrays, std::vector<std::string>& differences) {
  for (const ArrayPair& pair : arrays) {
    if (pair.a->domain != Domain::mesh) continue;
    std::string text;
    if (pair.a->count() != pair.b->count()) {
      text = std::to_string(pair.a->count()) + " tuples in A, " + std::to_string(pair.b->count()) + " in B";
    } else {
      text = compare_tuples(*pair.a, *pair.b);
    }
    if (!text.empty()) differences.push_back(describe_array(*pair.a) + ": " + text);
  }
  std::erase_if(arrays, [](const ArrayPair& pair) { return pair.a->domain == Domain::mesh; });
}

void compare_metadata(const Mesh& a, const Mesh& b, const std::vector<ArrayPair>& arrays,
                      std::vector<std::string>& differences) {
  for (const ArrayPair& pair : arrays) {
    if (pair.a->role == pair.b->role) continue;
    differences.push_back(describe_array(*pair.a) + " has the role " + name_of(pair.a->role) + " in A, " +
                          name_of(pair.b->role) + " in B");
  }
  if (a.metadata == b.metadata) return;
  size_t i = 0;
  while (i < a.metadata.size() && i < b.metadata.size() && a.metadata[i] == b.metadata[i]) ++i;
  const auto entry = [i](const Mesh& mesh) {
    return i < mesh.metadata.size()
               ? "\"" + mesh.metadata[i].first + "\": \"" + mesh.metadata[i].second + "\""
               : "missing";
  };
  differences.push_back("metadata: entry " + std::to_string(i) + " is " + entry(a) + " in A, " + entry(b) +
                        " in B");
}

/// Decides whether the meshes are equal in positions and these arrays, up to the names of points and the
/// order of cells.
Decision decide(const Mesh& a, const Mesh& b, const std::vector<ArrayPair>& arrays, bool block_names) {
  std::vector<const Array*> of_a = {&a.points}, of_b = {&b.points};
  for (const ArrayPair& pair : arrays) {
    of_a.push_back(pair.a);
    of_b.push_back(pair.b);
  }
  Decision decision;
  // Another seed moves every collision; two in a row do not happen.
  for (uint64_t seed = 0; seed < 3; ++seed) {
    decision = find_renaming(Elements(a, of_a, block_names, seed), Elements(b, of_b, block_names, seed));
    if (decision.verdict != Verdict::collided) break;
  }
  return decision;
}

/// Which of the things compared make the difference: each is tried on its own.
void explain(const Mesh& a, const Mesh& b, const std::vector<ArrayPair>& arrays, const Decision& all,
             std::vector<std::string>& differences) {
  if (all.verdict != Verdict::different) return differences.push_back(all.difference);
  const size_t before = differences.size();
  if (const Decision shape = decide(a, b, {}, false); shape.verdict == Verdict::different) {
    return differences.push_back(shape.difference);
  }
  if (const Decision names = decide(a, b, {}, true); names.verdict == Verdict::different) {
    differences.push_back("names of blocks: " + names.difference);
  }
  for (const ArrayPair& pair : arrays) {
    if (differences.size() >= max_differences) break;
    const Decision alone = decide(a, b, {pair}, false);
    if (alone.verdict == Verdict::different) {
      differences.push_back(describe_array(*pair.a) + ": " + alone.difference);
    }
  }
  if (differences.size() == before) {
    differences.push_back("the arrays agree one by one, but not together: " + all.difference);
  }
}

void compare_elements(const Mesh& a, const Mesh& b, const std::vector<ArrayPair>& arrays,
                      const CompareOptions& options, std::vector<std::string>& differences) {
  // Most meshes that are compared have kept their order. That takes one pass, and what is equal in order is
  // equal.
  auto in_order = compare_in_order(a, b, arrays, options.tolerance);
  if (in_order.empty()) return;
  if (options.same_order) {
    differences.insert(differences.end(), in_order.begin(), in_order.end());
    return;
  }
  const Decision all = decide(a, b, arrays, true);
  if (all.verdict != Verdict::equal) explain(a, b, arrays, all, differences);
}

/// What this comparison cannot take.
std::string objection(const Mesh& mesh, const char* name) {
  if (const auto valid = validate(mesh); !valid)
    return std::string(name) + " is no valid mesh: " + valid.error().message;
  for (const CellBlock& block : mesh.blocks) {
    // Elements::Cell counts its points in 32 bits.
    for (uint64_t i = 0; block.connectivity.size() > UINT32_MAX && i < block.size(); ++i) {
      if (block.cell(i).size() > UINT32_MAX) return std::string(name) + " has a cell of 2^32 points or more";
    }
  }
  return {};
}

std::vector<std::string> find_differences(const Mesh& a, const Mesh& b, const CompareOptions& options) {
  for (const auto& text : {objection(a, "A"), objection(b, "B")}) {
    if (!text.empty()) return {text};
  }
  if (options.tolerance != 0 && !options.same_order) {
    return {"a tolerance needs both meshes in the same order: points could not be matched otherwise"};
  }
  std::vector<std::string> differences;
  // Meshes of different sizes are not renamings of each other: the counts say all, and no elements are looked
  // at.
  compare_count("points", a.point_count(), b.point_count(), differences);
  compare_count("cells", a.cell_count(), b.cell_count(), differences);
  compare_count("corners", a.corner_count(), b.corner_count(), differences);
  const bool same_counts = differences.empty();
  const bool same_positions = options.tolerance > 0 || a.points.type == b.points.type;
  if (!same_positions) {
    differences.push_back(std::string("positions are ") + name_of(a.points.type) + " in A, " +
                          name_of(b.points.type) + " in B");
  }
  std::vector<ArrayPair> arrays;
  if (options.compare_arrays) arrays = pair_arrays(a, b, differences);
  if (options.compare_metadata) compare_metadata(a, b, arrays, differences);
  compare_mesh_arrays(arrays, differences);
  if (same_counts && same_positions) compare_elements(a, b, arrays, options, differences);
  return differences;
}

}  // namespace

Comparison compare(const Mesh& a, const Mesh& b, const CompareOptions& options) {
  Comparison comparison;
  comparison.differences = find_differences(a, b, options);
  if (comparison.differences.size() > max_differences) comparison.differences.resize(max_differences);
  comparison.equal = comparison.differences.empty();
  return comparison;
}

}  // namespace maille
