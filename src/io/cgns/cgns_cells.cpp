// Elements of CGNS as cells of VTK. Source: "CGNS Standard Interface Data Structures", Conventions,
// "Unstructured grid element numbering", whose types and orders of nodes these are.
#include "io/cgns/cgns_cells.h"

#include <algorithm>

#include "base/result.h"
#include "io/reading.h"

namespace maille {
namespace {

// Node i of VTK's cell is node order[i] of the element. CGNS has the upright edges before those on top; VTK
// has faces by pairs, and sees the triangle 0 1 2 of a wedge from outside.
constexpr uint8_t hexa20[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15};
constexpr uint8_t hexa27[] = {0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11, 16, 17,
                              18, 19, 12, 13, 14, 15, 24, 22, 21, 23, 20, 25, 26};
constexpr uint8_t penta6[] = {0, 2, 1, 3, 5, 4};
constexpr uint8_t penta15[] = {0, 2, 1, 3, 5, 4, 8, 7, 6, 14, 13, 12, 9, 11, 10};
constexpr uint8_t penta18[] = {0, 2, 1, 3, 5, 4, 8, 7, 6, 14, 13, 12, 9, 11, 10, 17, 16, 15};

struct ElementType {
  int64_t number;
  CellType type;
  size_t nodes;
  std::span<const uint8_t> order;
};
// Those of third and fourth order are not known: VTK's Lagrange cells number nodes by another rule.
constexpr ElementType element_types[] = {{2, CellType::vertex, 1, {}},
                                         {3, CellType::line, 2, {}},
                                         {4, CellType::quadratic_edge, 3, {}},
                                         {5, CellType::triangle, 3, {}},
                                         {6, CellType::quadratic_triangle, 6, {}},
                                         {7, CellType::quad, 4, {}},
                                         {8, CellType::quadratic_quad, 8, {}},
                                         {9, CellType::biquadratic_quad, 9, {}},
                                         {10, CellType::tetrahedron, 4, {}},
                                         {11, CellType::quadratic_tetrahedron, 10, {}},
                                         {12, CellType::pyramid, 5, {}},
                                         {13, CellType::lagrange_pyramid, 14, {}},
                                         {14, CellType::wedge, 6, penta6},
                                         {15, CellType::quadratic_wedge, 15, penta15},
                                         {16, CellType::biquadratic_quadratic_wedge, 18, penta18},
                                         {17, CellType::hexahedron, 8, {}},
                                         {18, CellType::quadratic_hexahedron, 20, hexa20},
                                         {19, CellType::triquadratic_hexahedron, 27, hexa27},
                                         {21, CellType::quadratic_pyramid, 13, {}}};
constexpr int64_t mixed = 20, polygons = 22, polyhedra = 23;

const ElementType* element_type(int64_t number) {
  const auto known = std::find_if(std::begin(element_types), std::end(element_types),
                                  [&](const ElementType& type) { return type.number == number; });
  return known == std::end(element_types) ? nullptr : known;
}

}  // namespace

tl::unexpected<Error> CgnsCells::unknown_type(const Section& section, int64_t type) const {
  return failure(ErrorCode::unsupported, file_ + ": \"" + section.node.path + "\" has elements of type " +
                                             std::to_string(type) +
                                             ", which cannot be read; those of first and second order, "
                                             "MIXED, NGON_n and NFACE_n can");
}

Result<> CgnsCells::add_grid(std::span<const uint64_t> points, uint64_t first_point,
                             const std::string& name) {
  static constexpr CellType types[] = {CellType::line, CellType::quad, CellType::hexahedron};
  uint64_t size[3] = {1, 1, 1}, step[3] = {1, 1, 1}, cells = 1;
  for (size_t k = 0; k < points.size(); ++k) {
    size[k] = points[k] - 1;
    step[k] = k == 0 ? 1 : step[k - 1] * points[k - 1];
    cells *= size[k];
  }
  const uint64_t corners[] = {0,       step[0],           step[0] + step[1],           step[1],
                              step[2], step[0] + step[2], step[0] + step[1] + step[2], step[1] + step[2]};
  const size_t nodes = size_t{1} << points.size();
  MAILLE_CHECK(budget_.take(cells, nodes * sizeof(uint32_t) + 1));
  sections_.clear();
  zone_cells_ = cells_.count();
  for (uint64_t k = 0; k < size[2]; ++k) {
    for (uint64_t j = 0; j < size[1]; ++j) {
      for (uint64_t i = 0; i < size[0]; ++i) {
        const uint64_t at = first_point + i + j * step[1] + k * step[2];
        for (size_t c = 0; c < nodes; ++c) cells_.nodes.push_back(static_cast<uint32_t>(at + corners[c]));
      }
    }
  }
  const CellType type = types[points.size() - 1];
  cells_.end_cells(cells, type, nodes);
  shapes_.add(cells, type, name);
  return {};
}

Result<CgnsCells::Section> CgnsCells::read_section(const CgnsNode& node) const {
  Section section;
  section.node = node;
  section.children = MAILLE_TRY(tree_.children(node));
  const std::vector<int64_t> kind = MAILLE_TRY(tree_.integers(node));
  section.type = kind.empty() ? 0 : kind[0];
  const CgnsNode* const range_node = find_node(section.children, "IndexRange_t", "ElementRange");
  const std::vector<int64_t> range =
      range_node == nullptr ? std::vector<int64_t>() : MAILLE_TRY(tree_.integers(*range_node));
  if (range.size() != 2 || range[0] < 1 || range[1] < range[0] - 1 || range[1] > INT64_MAX - 1)
    return malformed(section, "there is no ElementRange of two numbers");
  section.first = static_cast<uint64_t>(range[0]);
  section.count = static_cast<uint64_t>(range[1] - range[0]) + 1;
  const CgnsNode* const values = find_node(section.children, "DataArray_t", "ElementConnectivity");
  if (values != nullptr) section.values = MAILLE_TRY(tree_.integers(*values));
  if (section.type == polygons || section.type == polyhedra) MAILLE_CHECK(read_starts(section));
  return section;
}

/// Where elements begin: from version 3.4 on in a list of its own, before with the number of values of each
/// before them, which are taken out here.
Result<> CgnsCells::read_starts(Section& section) const {
  const CgnsNode* const node = find_node(section.children, "DataArray_t", "ElementStartOffset");
  const std::vector<int64_t> offsets =
      node == nullptr ? std::vector<int64_t>() : MAILLE_TRY(tree_.integers(*node));
  // Each element has an offset or a number of values in the file.
  const uint64_t known = node != nullptr ? offsets.size() - (offsets.empty() ? 0 : 1) : section.values.size();
  if (section.count > known || (node != nullptr && section.count != known))
    return malformed(section, "it has not as many lists as elements (" + std::to_string(section.count) + ")");
  MAILLE_CHECK(budget_.take(section.count + 1, sizeof(uint64_t)));
  section.starts.reserve(section.count + 1);
  std::vector<int64_t>& values = section.values;
  const auto size = static_cast<int64_t>(values.size());
  if (node != nullptr) {
    int64_t last = 0;
    for (const int64_t offset : offsets) {
      if (offset < last || offset > size) return malformed(section, "its offsets fall, or pass the end");
      section.starts.push_back(static_cast<uint64_t>(last = offset));
    }
    return {};
  }
  int64_t from = 0, to = 0;
  section.starts.push_back(0);
  for (uint64_t i = 0; i < section.count; ++i) {
    const int64_t length = from < size ? values[static_cast<size_t>(from++)] : -1;
    if (length < 0 || length > size - from) return malformed(section, "its lists pass the end");
    std::copy_n(values.begin() + from, length, values.begin() + to);
    from += length;
    section.starts.push_back(static_cast<uint64_t>(to += length));
  }
  return {};
}

Result<> CgnsCells::add_nodes(const Section& section, std::span<const int64_t> values,
                              std::span<const uint8_t> order) {
  for (size_t k = 0; k < values.size(); ++k) {
    const int64_t point = values[order.empty() ? k : order[k]];
    if (point < 1 || static_cast<uint64_t>(point) > points_)
      return malformed(section, "it uses point " + std::to_string(point) + ", but its zone has " +
                                    std::to_string(points_));
    cells_.nodes.push_back(static_cast<uint32_t>(first_point_ + static_cast<uint64_t>(point) - 1));
  }
  return {};
}

Result<> CgnsCells::add_cells(Section& section, const std::string& name) {
  section.first_cell = cells_.count();
  MAILLE_CHECK(budget_.take(section.values.size(), sizeof(uint32_t)));
  const std::span<const int64_t> values(section.values);
  if (section.type == mixed) return add_mixed(section, name);
  if (section.type == polyhedra) return add_polyhedra(section, name);
  if (section.type == polygons) {
    MAILLE_CHECK(budget_.take(section.count, 1 + sizeof(uint64_t)));
    for (uint64_t i = 0; i < section.count; ++i) {
      const uint64_t begin = section.starts[i];
      MAILLE_CHECK(add_nodes(section, values.subspan(begin, section.starts[i + 1] - begin), {}));
      cells_.end_cell(CellType::polygon);
    }
    shapes_.add(section.count, CellType::polygon, name);
    return {};
  }
  const ElementType* const type = element_type(section.type);
  if (type == nullptr) return unknown_type(section, section.type);
  if (values.size() % type->nodes != 0 || values.size() / type->nodes != section.count)
    return malformed(section, "it has not " + std::to_string(type->nodes) + " points for each of its " +
                                  std::to_string(section.count) + " elements");
  for (uint64_t i = 0; i < section.count; ++i)
    MAILLE_CHECK(add_nodes(section, values.subspan(i * type->nodes, type->nodes), type->order));
  cells_.end_cells(section.count, type->type, type->nodes);
  shapes_.add(section.count, type->type, name);
  return {};
}

/// Each element's type stands before its points, so offsets to them tell nothing new.
Result<> CgnsCells::add_mixed(const Section& section, const std::string& name) {
  const std::span<const int64_t> values(section.values);
  MAILLE_CHECK(budget_.take(std::min<uint64_t>(section.count, values.size()), 1 + sizeof(uint64_t)));
  size_t at = 0;
  for (uint64_t i = 0; i < section.count; ++i) {
    if (at >= values.size()) return malformed(section, "it ends before its last element");
    const ElementType* const type = element_type(values[at]);
    if (type == nullptr) return unknown_type(section, values[at]);
    if (type->nodes > values.size() - ++at) return malformed(section, "it ends inside its last element");
    MAILLE_CHECK(add_nodes(section, values.subspan(at, type->nodes), type->order));
    cells_.end_cells(1, type->type, type->nodes);
    shapes_.add(1, type->type, name);
    at += type->nodes;
  }
  return {};
}

const CgnsCells::Section* CgnsCells::section_of(int64_t element) const {
  const auto number = static_cast<uint64_t>(element);
  const auto after =
      std::upper_bound(sections_.begin(), sections_.end(), number,
                       [](uint64_t value, const Section& section) { return value < section.first; });
  if (element < 1 || after == sections_.begin()) return nullptr;
  const Section& section = *std::prev(after);
  return number - section.first < section.count ? &section : nullptr;
}

/// A face whose number is negative is seen from inside of the cell.
Result<> CgnsCells::add_face(const Section& section, int64_t face) {
  const int64_t number = face < 0 ? -std::max(face, -INT64_MAX) : face;
  const Section* const of = section_of(number);
  if (of == nullptr || of->type != polygons)
    return malformed(section, "it uses face " + std::to_string(face) + ", which is none of NGON_n");
  const uint64_t i = static_cast<uint64_t>(number) - of->first;
  const uint64_t begin = of->starts[i], length = of->starts[i + 1] - begin;
  // A face may be named many times by few bytes.
  MAILLE_CHECK(budget_.take(length + 1, sizeof(uint32_t)));
  const size_t first = cells_.nodes.size();
  MAILLE_CHECK(add_nodes(*of, std::span<const int64_t>(of->values).subspan(begin, length), {}));
  if (face < 0) std::reverse(cells_.nodes.begin() + static_cast<ptrdiff_t>(first), cells_.nodes.end());
  cells_.face_sizes.push_back(static_cast<uint32_t>(length));
  return {};
}

Result<> CgnsCells::add_polyhedra(const Section& section, const std::string& name) {
  MAILLE_CHECK(budget_.take(section.count, 1 + 2 * sizeof(uint64_t)));
  for (uint64_t i = 0; i < section.count; ++i) {
    for (uint64_t k = section.starts[i]; k < section.starts[i + 1]; ++k)
      MAILLE_CHECK(add_face(section, section.values[k]));
    cells_.end_cell(CellType::polyhedron);
  }
  shapes_.add(section.count, CellType::polyhedron, name);
  return {};
}

Result<> CgnsCells::add_sections(const std::vector<CgnsNode>& children, uint64_t first_point, uint64_t points,
                                 const std::string& prefix, const std::string& zone) {
  sections_.clear();
  zone_cells_ = cells_.count();
  first_point_ = first_point;
  points_ = points;
  for (const CgnsNode& node : children) {
    if (node.label == "Elements_t") sections_.push_back(MAILLE_TRY(read_section(node)));
  }
  std::stable_sort(sections_.begin(), sections_.end(),
                   [](const Section& a, const Section& b) { return a.first < b.first; });
  const bool solid = std::any_of(sections_.begin(), sections_.end(),
                                 [](const Section& section) { return section.type == polyhedra; });
  const auto is_face = [&](const Section& section) { return solid && section.type == polygons; };
  const auto faces = std::count_if(sections_.begin(), sections_.end(), is_face);
  const bool alone = sections_.size() == static_cast<size_t>(faces) + 1;
  for (Section& section : sections_) {
    if (is_face(section)) continue;
    if (section.type == polygons && find_node(section.children, "DataArray_t", "ParentElements") != nullptr)
      faces_of_unread_ += section.count;
    MAILLE_CHECK(add_cells(section, alone ? zone : prefix + section.node.name));
    if (section.type != polygons) section.values = {};
  }
  return {};
}

std::vector<ElementRun> CgnsCells::cells_of(int dimension) const {
  std::vector<ElementRun> runs;
  for (uint64_t cell = zone_cells_; cell < cells_.count(); ++cell) {
    if (dimension_of(cells_.type(cell)) != dimension) continue;
    if (runs.empty() || runs.back().first + runs.back().count != cell) runs.push_back({cell, 0});
    ++runs.back().count;
  }
  return runs;
}

Result<std::optional<uint64_t>> CgnsCells::cell_of(int64_t element, const std::string& face_name) {
  const Section* const section = section_of(element);
  if (section == nullptr)
    return failure(ErrorCode::malformed_input, file_ + ": \"" + face_name + "\" uses element " +
                                                   std::to_string(element) + ", which its zone has not");
  const uint64_t i = static_cast<uint64_t>(element) - section->first;
  if (section->first_cell) return *section->first_cell + i;
  const uint64_t begin = section->starts[i], length = section->starts[i + 1] - begin;
  MAILLE_CHECK(budget_.take(length + 4, sizeof(uint32_t)));
  MAILLE_CHECK(add_nodes(*section, std::span<const int64_t>(section->values).subspan(begin, length), {}));
  cells_.end_cell(CellType::polygon);
  shapes_.add(1, CellType::polygon, face_name);
  return std::nullopt;
}

bool CgnsCells::is_section(const std::string& name, int64_t first, int64_t last) const {
  const Section* const section = section_of(first);
  return section != nullptr && section->first_cell && section->node.name == name &&
         section->first == static_cast<uint64_t>(first) &&
         section->first + section->count == static_cast<uint64_t>(last) + 1;
}

}  // namespace maille
