#include "query.h"

#include "guard.h"

#include <cmath>

namespace maille::c {

/// Scales normal and offset so that the normal has length 1, which the library's planes have. Error: usage.
Result<Region::Plane> plane_of(const double normal[3], double offset) {
  const double length = std::sqrt(dot(vector(normal), vector(normal)));
  if (!(length > 0) || !std::isfinite(length) || !std::isfinite(offset))
    return failure(ErrorCode::usage,
                   "a plane needs a normal and an offset that are finite, and a normal that is not 0");
  return Region::Plane{vector(normal) * (1 / length), offset / length};
}

namespace {

bool finite(const double x[3]) {
  return std::isfinite(x[0]) && std::isfinite(x[1]) && std::isfinite(x[2]);
}

/// What limits the detail of a query; without limits it is the mesh itself.
Detail& detail_of(maille_query& query) {
  if (!query.detail) query.detail = Detail();
  return *query.detail;
}

}  // namespace
}  // namespace maille::c

using namespace maille;
using namespace maille::c;

maille_query* maille_query_create(maille_error* error) {
  return make(error, {},
              []() -> Result<std::unique_ptr<maille_query>> { return std::make_unique<maille_query>(); });
}
void maille_query_free(maille_query* query) {
  delete query;
}

int32_t maille_query_set_box(maille_query* query, const double low[3], const double high[3],
                             maille_error* error) {
  return run(error, {{query, "query"}, {low, "low"}, {high, "high"}}, [&]() -> Result<> {
    for (unsigned k = 0; k < 3; ++k) {
      // Written so that NaN fails, too. Infinite sides are fine.
      if (!(low[k] <= high[k])) return wrong("a box needs numbers, the low ones not above the high ones");
    }
    query->volume.region.box = Box{vector(low), vector(high)};
    return {};
  });
}

int32_t maille_query_set_sphere(maille_query* query, const double centre[3], double radius,
                                maille_error* error) {
  return run(error, {{query, "query"}, {centre, "centre"}}, [&]() -> Result<> {
    if (!finite(centre) || !(radius >= 0))
      return wrong("a sphere needs a finite centre and a radius of 0 or more");
    query->volume.region.sphere = Sphere{vector(centre), radius};
    return {};
  });
}

int32_t maille_query_add_plane(maille_query* query, const double normal[3], double offset,
                               maille_error* error) {
  return run(error, {{query, "query"}, {normal, "normal"}}, [&]() -> Result<> {
    const auto plane = plane_of(normal, offset);
    if (!plane) return tl::unexpected(plane.error());
    query->volume.region.planes.push_back(*plane);
    return {};
  });
}

int32_t maille_query_set_level(maille_query* query, uint32_t level, maille_error* error) {
  return run(error, {{query, "query"}}, [&]() -> Result<> {
    detail_of(*query).level = level;
    return {};
  });
}

int32_t maille_query_set_error(maille_query* query, double bound, maille_error* error) {
  return run(error, {{query, "query"}}, [&]() -> Result<> {
    if (!(bound >= 0)) return wrong("an error is 0 or more");
    detail_of(*query).bound = bound;
    return {};
  });
}

int32_t maille_query_set_view(maille_query* query, const double eye[3], double pixels_per_radian,
                              double pixels, maille_error* error) {
  return run(error, {{query, "query"}, {eye, "eye"}}, [&]() -> Result<> {
    if (!finite(eye) || !(pixels_per_radian > 0) || !(pixels >= 0))
      return wrong("a view needs a finite eye, pixels_per_radian above 0, and pixels of 0 or more");
    detail_of(*query).view = View{vector(eye), pixels_per_radian, pixels};
    return {};
  });
}

int32_t maille_query_set_most_faces(maille_query* query, uint64_t faces, maille_error* error) {
  return run(error, {{query, "query"}}, [&]() -> Result<> {
    query->most_faces = faces;
    return {};
  });
}

int32_t maille_query_set_cut(maille_query* query, const double normal[3], double offset,
                             maille_error* error) {
  return run(error, {{query, "query"}, {normal, "normal"}}, [&]() -> Result<> {
    const auto plane = plane_of(normal, offset);
    if (!plane) return tl::unexpected(plane.error());
    query->volume.plane = *plane;
    return {};
  });
}

int32_t maille_query_add_condition(maille_query* query, const char* array, int32_t component, double low,
                                   double high, maille_error* error) {
  return run(error, {{query, "query"}, {array, "array"}}, [&]() -> Result<> {
    if (!(low <= high)) return wrong("a condition needs numbers, `low` not above `high`");
    ValueCondition condition;
    condition.array = array;
    condition.low = low;
    condition.high = high;
    if (component >= 0) condition.component = static_cast<uint32_t>(component);
    query->volume.conditions.push_back(std::move(condition));
    return {};
  });
}

int32_t maille_query_set_pieces(maille_query* query, const uint32_t* pieces, uint64_t count,
                                maille_error* error) {
  return run(error, {{query, "query"}}, [&]() -> Result<> {
    if (!pieces && count > 0) return wrong("pieces is NULL");
    query->volume.pieces = std::vector<uint32_t>(pieces, pieces + count);
    return {};
  });
}

int32_t maille_query_set_cells(maille_query* query, uint64_t first, uint64_t last, maille_error* error) {
  return run(error, {{query, "query"}}, [&]() -> Result<> {
    if (first > last) return wrong("cells end before they begin");
    query->volume.cells = std::pair(first, last);
    return {};
  });
}
