#include "triangles.h"

#include <maille/io.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "base/result.h"
#include "numbers/number_map.h"

namespace maille::bench {

Result<Triangles> load_triangles(const std::string& path) {
  const ReadResult read = MAILLE_TRY(read_mesh(path));
  Triangles result;
  const std::string file = std::filesystem::path(path).filename().string();
  result.name = file.substr(0, file.find('.'));
  const Array& points = read.mesh.points;
  const size_t size = size_of(points.type);
  result.positions.resize(points.count());
  for (size_t i = 0; i < 3 * points.count(); ++i) {
    const double x = number_as_double(points.type, points.bytes.data() + i * size);
    if (!std::isfinite(x)) return failure(ErrorCode::malformed_input, "has positions that are not finite");
    result.positions[i / 3][i % 3] = x;
  }
  for (const CellBlock& block : read.mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      const auto cell = block.cell(i);
      if (cell.size() > 2) result.polygons.emplace_back(cell.begin(), cell.end());
      for (size_t k = 2; k < cell.size(); ++k) result.faces.push_back({cell[0], cell[k - 1], cell[k]});
    }
  }
  return result;
}

std::vector<Point> Triangles::on_lattice(unsigned bits) const {
  std::vector<Point> points(positions.size());
  if (positions.empty()) return points;
  std::array<double, 3> low = positions[0], high = positions[0];
  for (const auto& p : positions) {
    for (size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  const double side = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  const double scale = side > 0 ? ((1 << bits) - 1) / side : 0;
  for (size_t i = 0; i < points.size(); ++i) {
    for (size_t k = 0; k < 3; ++k) {
      points[i][k] = static_cast<int32_t>(std::floor((positions[i][k] - low[k]) * scale + 0.5));
    }
  }
  return points;
}

EdgeFinder::EdgeFinder(const Triangles& mesh)
    : mesh_(mesh), first_(mesh.positions.size() + 1), faces_(3 * mesh.faces.size()) {
  for (const Triangle& face : mesh.faces) {
    for (const uint32_t v : face) ++first_[v + 1];
  }
  for (size_t v = 1; v < first_.size(); ++v) first_[v] += first_[v - 1];
  std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
  for (uint32_t i = 0; i < mesh.faces.size(); ++i) {
    for (const uint32_t v : mesh.faces[i]) faces_[next[v]++] = i;
  }
}

std::vector<Triangle> EdgeFinder::around(uint32_t vertex) const {
  std::vector<Triangle> result;
  for (uint32_t i = first_[vertex]; i < first_[vertex + 1]; ++i) result.push_back(mesh_.faces[faces_[i]]);
  return result;
}

uint32_t EdgeFinder::tip(uint32_t from, uint32_t to) const {
  uint32_t found = none;
  for (uint32_t i = first_[from]; i < first_[from + 1]; ++i) {
    const Triangle& face = mesh_.faces[faces_[i]];
    for (size_t k = 0; k < 3; ++k) {
      if (face[k] != from || face[(k + 1) % 3] != to) continue;
      if (found != none) return none;
      found = face[(k + 2) % 3];
    }
  }
  return found;
}

}  // namespace maille::bench
