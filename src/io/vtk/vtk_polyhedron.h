#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "base/sort_unique.h"
#include "mesh/cell_faces.h"

namespace maille {

/// Appends a polyhedron as VTK has it up to 9.3: to `points` each of its points once, in the order in which
/// its faces name them; to `faces` their number, then of each the number of corners and the corners.
/// `sorted`: room that is used again.
template <class Number>
void append_vtk_polyhedron(std::span<const Number> corners, std::span<const uint32_t> face_sizes,
                           std::vector<Number>& sorted, std::vector<Number>& points,
                           std::vector<Number>& faces) {
  sorted.assign(corners.begin(), corners.end());
  sort_unique(sorted);
  std::vector<bool> seen(sorted.size());
  for (const Number point : corners) {
    const auto at =
        static_cast<size_t>(std::lower_bound(sorted.begin(), sorted.end(), point) - sorted.begin());
    if (!seen[at]) points.push_back(point);
    seen[at] = true;
  }
  faces.push_back(static_cast<Number>(face_sizes.size()));
  for_each_face(corners, face_sizes, [&](std::span<const Number> face) {
    faces.push_back(static_cast<Number>(face.size()));
    faces.insert(faces.end(), face.begin(), face.end());
  });
}

}  // namespace maille
