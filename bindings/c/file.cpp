// Surfaces of mode random.
#include "bytes.h"
#include "guard.h"
#include "mesh.h"
#include "options.h"
#include "query.h"

#include <cstddef>
#include <cstring>

struct maille_file {
  maille::File file;
};
struct maille_selection {
  maille::Selection selection;
};

namespace maille::c {
namespace {

void store(const Vector3& from, double to[3]) {
  std::copy(from.x.begin(), from.x.end(), to);
}

/// Copies a result into the caller's struct. A caller that was compiled with an older header has a shorter
/// struct, and struct_size says how much of it may be written.
Result<> give(const std::optional<SurfacePoint>& found, maille_place& place) {
  maille_place result{};
  if (found) {
    result.found = 1;
    result.group = found->chart.group;
    result.chart = found->chart.chart;
    result.face = found->face;
    std::copy(found->corners.begin(), found->corners.end(), result.corners);
    std::copy(found->weights.begin(), found->weights.end(), result.weights);
    store(found->position, result.position);
    result.distance = found->distance;
  }
  result.struct_size = place.struct_size;
  std::memcpy(&place, &result, std::min<size_t>(place.struct_size, sizeof result));
  return {};
}

/// A struct that was not set up has any size; one smaller than that of the first version is a mistake of the
/// caller.
Result<> check_room(const maille_place& place) {
  // As it was in the first version.
  if (place.struct_size >= offsetof(maille_place, distance) + sizeof(double)) return {};
  return wrong("set struct_size of maille_place to sizeof(maille_place) first");
}

/// Without a query: everything, in full detail.
Result<Selection> select(File& file, const maille_query* query) {
  const Region region = query ? query->volume.region : Region();
  if (query && query->most_faces) {
    return file.select(region, *query->most_faces, query->detail ? query->detail->view : std::nullopt);
  }
  return file.select(region, query && query->detail ? *query->detail : Detail::full());
}

}  // namespace
}  // namespace maille::c

using namespace maille;
using namespace maille::c;

maille_file* maille_file_open(const maille_source* source, const maille_decode_options* options,
                              maille_error* error) {
  return make(error, {{source, "source"}}, [&]() -> Result<std::unique_ptr<maille_file>> {
    auto file = File::open(*source->source, options_of(options));
    if (!file) return passed_on(std::move(file));
    return std::make_unique<maille_file>(maille_file{std::move(*file)});
  });
}
void maille_file_free(maille_file* file) {
  delete file;
}

uint32_t maille_file_levels(const maille_file* file) {
  return file ? file->file.levels() : 0;
}
uint64_t maille_file_faces(const maille_file* file, uint32_t level) {
  return level < maille_file_levels(file) ? file->file.faces(level) : 0;
}
uint32_t maille_file_charts(const maille_file* file, uint32_t level) {
  return level < maille_file_levels(file) ? file->file.charts(level) : 0;
}

int32_t maille_file_sphere(const maille_file* file, double sphere[4], maille_error* error) {
  return run(error, {{file, "file"}, {sphere, "sphere"}}, [&]() -> Result<> {
    const Sphere around = file->file.sphere();
    store(around.centre, sphere);
    sphere[3] = around.radius;
    return {};
  });
}

maille_selection* maille_file_select(maille_file* file, const maille_query* query, maille_error* error) {
  return make(error, {{file, "file"}}, [&]() -> Result<std::unique_ptr<maille_selection>> {
    auto selection = select(file->file, query);
    if (!selection) return passed_on(std::move(selection));
    return std::make_unique<maille_selection>(maille_selection{std::move(*selection)});
  });
}
void maille_selection_free(maille_selection* selection) {
  delete selection;
}
uint64_t maille_selection_charts(const maille_selection* selection) {
  return selection ? selection->selection.charts.size() : 0;
}
uint64_t maille_selection_faces(const maille_selection* selection) {
  return selection ? selection->selection.faces : 0;
}
int32_t maille_selection_chart(const maille_selection* selection, uint64_t i, uint32_t* group,
                               uint32_t* chart, maille_error* error) {
  return run(error, {{selection, "selection"}}, [&]() -> Result<> {
    const ChartPlace* const place = at(selection->selection.charts, i);
    if (!place) return wrong("the selection has no chart " + std::to_string(i));
    if (group) *group = place->group;
    if (chart) *chart = place->chart;
    return {};
  });
}

int32_t maille_file_chart(maille_file* file, uint32_t group, uint32_t chart, uint32_t* level, uint64_t* faces,
                          uint64_t* bytes, double box[6], maille_error* error) {
  return run(error, {{file, "file"}}, [&]() -> Result<> {
    const auto info = file->file.info({group, chart});
    if (!info) return tl::unexpected(info.error());
    if (level) *level = info->level;
    if (faces) *faces = info->faces;
    if (bytes) *bytes = info->bytes;
    if (box) {
      store(info->box.low, box);
      store(info->box.high, box + 3);
    }
    return {};
  });
}

maille_mesh* maille_file_read(maille_file* file, uint32_t group, uint32_t chart, maille_error* error) {
  return make(error, {{file, "file"}}, [&] { return handle(file->file.read({group, chart})); });
}

maille_mesh* maille_file_extract(maille_file* file, const maille_selection* selection, int32_t salvage,
                                 maille_error* error) {
  return make(error, {{file, "file"}, {selection, "selection"}},
              [&]() -> Result<std::unique_ptr<maille_mesh>> {
                if (salvage == 0) return handle(file->file.extract(selection->selection));
                std::vector<std::string> problems;
                auto made = handle(file->file.salvage(selection->selection, problems));
                if (made) (*made)->notes = std::move(problems);
                return made;
              });
}

int32_t maille_file_hit(maille_file* file, const double origin[3], const double direction[3],
                        maille_place* place, maille_error* error) {
  return run(error, {{file, "file"}, {origin, "origin"}, {direction, "direction"}, {place, "place"}},
             [&]() -> Result<> {
               if (auto fits = check_room(*place); !fits) return fits;
               const auto hit = file->file.hit(vector(origin), vector(direction));
               return hit ? give(*hit, *place) : Result<>(tl::unexpected(hit.error()));
             });
}

int32_t maille_file_nearest(maille_file* file, const double point[3], maille_place* place,
                            maille_error* error) {
  return run(error, {{file, "file"}, {point, "point"}, {place, "place"}}, [&]() -> Result<> {
    if (auto fits = check_room(*place); !fits) return fits;
    const auto nearest = file->file.nearest(vector(point));
    return nearest ? give(*nearest, *place) : Result<>(tl::unexpected(nearest.error()));
  });
}

int32_t maille_file_nearest_points(maille_file* file, const double point[3], uint64_t count,
                                   double* positions, double* distances, uint64_t* found,
                                   maille_error* error) {
  return run(error, {{file, "file"}, {point, "point"}, {positions, "positions"}, {found, "found"}},
             [&]() -> Result<> {
               const auto near = file->file.nearest_points(vector(point), count);
               if (!near) return tl::unexpected(near.error());
               *found = near->size();
               for (size_t i = 0; i < near->size(); ++i) {
                 store((*near)[i].position, positions + 3 * i);
                 if (distances) distances[i] = (*near)[i].distance;
               }
               return {};
             });
}

maille_mesh* maille_clip(const maille_mesh* mesh, const maille_query* query, maille_error* error) {
  return make(error, {{mesh, "mesh"}, {query, "query"}}, [&]() -> Result<std::unique_ptr<maille_mesh>> {
    if (auto valid = validate(mesh->mesh); !valid) return passed_on(std::move(valid));
    return handle(clip(mesh->mesh, query->volume.region));
  });
}
