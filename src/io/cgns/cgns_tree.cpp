// CGNS in files of HDF5. Source: "CGNS/SIDS File Mapping Manual" and "HDF5 Implementation of the CGNS
// database manager".
#include "io/cgns/cgns_tree.h"

#include <maille/with_type.h>

#include <algorithm>

#include "base/result.h"

namespace maille {

Result<std::vector<CgnsNode>> CgnsTree::children(const CgnsNode& node) const {
  std::vector<CgnsNode> nodes;
  for (const std::string& name : file_.members(node.path.empty() ? "/" : node.path)) {
    if (name.starts_with(' ')) continue;  // not nodes: " data", " version" and the like
    MAILLE_CHECK(budget_.take(1, 256));
    CgnsNode child{node.path + "/" + name, name, {}};
    if (file_.text(child.path, "type") == "LK") {
      child.path += "/ link";
      if (!file_.is_group(child.path)) {
        return failure(ErrorCode::unsupported,
                       file_.name() + ": \"" + name +
                           "\" is a link to another file, which is not followed; cgnsconvert -l (Debian: "
                           "cgns-convert) makes one file of both");
      }
    }
    child.label = file_.text(child.path, "label").value_or("");
    nodes.push_back(std::move(child));
  }
  // What was not found may be there in truth, so a mesh without it must not pass for whole.
  if (!file_.is_broken()) return nodes;
  return failure(ErrorCode::malformed_input, file_.name() + ": it is damaged: the library of HDF5 gave up");
}

Result<Array> CgnsTree::values(const CgnsNode& node) const {
  Array array = make_array(node.name, Domain::mesh, Scalar::f64, 1);
  const std::string path = node.path + "/ data";
  if (const auto dataset = file_.find(path))
    array = MAILLE_TRY(file_.rows(path, 0, dataset->rows(), std::move(array), budget_));
  array.components = 1;
  return array;
}

Result<std::vector<int64_t>> CgnsTree::integers(const CgnsNode& node) const {
  const Array array = MAILLE_TRY(values(node));
  std::vector<int64_t> numbers;
  if (array.bytes.empty()) return numbers;
  if (is_float(array.type))
    return failure(ErrorCode::malformed_input, file_.name() + ": \"" + node.path + "\" is not of integers");
  MAILLE_CHECK(budget_.take(array.count(), sizeof(int64_t)));
  numbers.reserve(array.count());
  with_type(array.type, [&](auto zero) {
    for (const auto value : array.values<decltype(zero)>()) numbers.push_back(static_cast<int64_t>(value));
  });
  return numbers;
}

Result<std::string> CgnsTree::text(const CgnsNode& node) const {
  const Array array = MAILLE_TRY(values(node));
  std::string text;
  if (size_of(array.type) == 1)
    text.assign(reinterpret_cast<const char*>(array.bytes.data()), array.bytes.size());
  return text;
}

Result<std::vector<std::string>> CgnsTree::names(const CgnsNode& node) const {
  constexpr size_t width = 32;
  const std::string all = MAILLE_TRY(text(node));
  MAILLE_CHECK(budget_.take(all.size() / width, sizeof(std::string)));
  std::vector<std::string> names;
  for (size_t at = 0; at + width <= all.size(); at += width) {
    const std::string name = all.substr(at, width);
    names.push_back(name.substr(0, name.find_last_not_of(std::string_view(" \0", 2)) + 1));
  }
  return names;
}

const CgnsNode* find_node(const std::vector<CgnsNode>& nodes, std::string_view label, std::string_view name) {
  const auto found = std::find_if(nodes.begin(), nodes.end(), [&](const CgnsNode& node) {
    return node.label == label && (name.empty() || node.name == name);
  });
  return found == nodes.end() ? nullptr : &*found;
}

}  // namespace maille
