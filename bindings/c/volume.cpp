// Volumes of mode stream, any part of them.
#include "bytes.h"
#include "guard.h"
#include "mesh.h"
#include "options.h"
#include "query.h"

#include <maille/slice.h>
#include <algorithm>
#include <limits>

struct maille_volume {
  maille::VolumeFile file;
};

namespace maille::c {
namespace {

VolumeQuery volume_query(const maille_query* query) {
  return query ? query->volume : VolumeQuery();
}

/// A piece without any finite position has no box, which C sees as NaN.
void store(const std::optional<Box>& box, double to[6]) {
  std::fill(to, to + 6, std::numeric_limits<double>::quiet_NaN());
  for (unsigned k = 0; box && k < 3; ++k) {
    to[k] = box->low[k];
    to[k + 3] = box->high[k];
  }
}

}  // namespace
}  // namespace maille::c

using namespace maille;
using namespace maille::c;

maille_volume* maille_volume_open(const maille_source* source, const maille_decode_options* options,
                                  maille_error* error) {
  return make(error, {{source, "source"}}, [&]() -> Result<std::unique_ptr<maille_volume>> {
    auto file = VolumeFile::open(*source->source, options_of(options));
    if (!file) return passed_on(std::move(file));
    return std::make_unique<maille_volume>(maille_volume{std::move(*file)});
  });
}
void maille_volume_free(maille_volume* volume) {
  delete volume;
}
uint64_t maille_volume_cells(const maille_volume* volume) {
  return volume ? volume->file.cells() : 0;
}
uint64_t maille_volume_points(const maille_volume* volume) {
  return volume ? volume->file.points() : 0;
}
uint32_t maille_volume_pieces(const maille_volume* volume) {
  return volume ? volume->file.pieces() : 0;
}

int32_t maille_volume_piece(const maille_volume* volume, uint32_t piece, uint64_t* cells, uint64_t* points,
                            uint64_t* bytes, double box[6], maille_error* error) {
  return run(error, {{volume, "volume"}}, [&]() -> Result<> {
    const auto info = volume->file.info(piece);
    if (!info) return tl::unexpected(info.error());
    if (cells) *cells = info->cells;
    if (points) *points = info->points;
    if (bytes) *bytes = info->bytes;
    if (box) store(info->box, box);
    return {};
  });
}

int32_t maille_volume_select(const maille_volume* volume, const maille_query* query, uint32_t* pieces,
                             uint64_t room, uint64_t* count, maille_error* error) {
  return run(error, {{volume, "volume"}, {count, "count"}}, [&]() -> Result<> {
    if (!pieces && room > 0) return wrong("pieces is NULL");
    const auto selected = volume->file.select(volume_query(query));
    if (!selected) return tl::unexpected(selected.error());
    // The count is that of all pieces, so a caller can ask with no room first and then allocate.
    *count = selected->size();
    std::copy_n(selected->begin(), std::min<uint64_t>(room, selected->size()), pieces);
    return {};
  });
}

maille_mesh* maille_volume_extract(const maille_volume* volume, const maille_query* query,
                                   maille_error* error) {
  return make(error, {{volume, "volume"}}, [&]() -> Result<std::unique_ptr<maille_mesh>> {
    auto extracted = volume->file.extract(volume_query(query));
    if (!extracted) return passed_on(std::move(extracted));
    auto made = std::make_unique<maille_mesh>();
    made->mesh = std::move(extracted->mesh);
    made->notes = std::move(extracted->problems);
    made->cell_numbers = std::move(extracted->cell_numbers);
    made->point_numbers = std::move(extracted->point_numbers);
    return made;
  });
}

maille_mesh* maille_volume_coarse(const maille_volume* volume, maille_error* error) {
  return make(error, {{volume, "volume"}}, [&] { return handle(volume->file.coarse()); });
}

maille_mesh* maille_slice(const maille_mesh* mesh, const double normal[3], double offset,
                          maille_error* error) {
  return make(error, {{mesh, "mesh"}, {normal, "normal"}}, [&]() -> Result<std::unique_ptr<maille_mesh>> {
    const auto plane = plane_of(normal, offset);
    if (!plane) return tl::unexpected(plane.error());
    if (auto valid = validate(mesh->mesh); !valid) return passed_on(std::move(valid));
    return handle(slice(mesh->mesh, *plane));
  });
}
