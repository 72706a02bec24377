// The functions that web/maille.js calls. Each returns `done`, `wants_bytes` (then numbers() says which: give
// them and call again), `goes_on` (call again; numbers() says how far it is), or an ErrorCode, whose sentence
// message() gives. Numbers above 32 bits pass as doubles, exact up to 2^53. Pointers are valid until the next
// call with the same reader.
#include "reader.h"

#include <maille/file.h>

#include <algorithm>
#include <cstdlib>

namespace maille::wasm {
namespace {

/// A region and how fine, as web/maille.js packs them: box (low, high) or NaN, sphere (centre, radius) or
/// NaN, bound, level (negative: any), eye, pixels per radian (0: no view), pixels; then planes of four
/// numbers.
struct Request {
  Region region;
  Detail detail;
};
constexpr size_t plain_numbers = 17;

Request request_of(const double* n, uint32_t count) {
  Request request;
  const auto vector = [&](size_t i) { return Vector3{{n[i], n[i + 1], n[i + 2]}}; };
  if (count < plain_numbers) return request;
  if (n[0] == n[0]) request.region.box = Box{vector(0), vector(3)};
  if (n[6] == n[6]) request.region.sphere = Sphere{vector(6), n[9]};
  request.detail.bound = n[10];
  if (n[11] >= 0) request.detail.level = static_cast<uint32_t>(n[11]);
  if (n[15] > 0) request.detail.view = View{vector(12), n[15], n[16]};
  for (size_t i = plain_numbers; i + 4 <= count; i += 4) {
    request.region.planes.push_back({vector(i), n[i + 3]});
  }
  return request;
}

}  // namespace

MAILLE_EXPORT void* maille_allocate(uint32_t size) {
  return malloc(size);
}
MAILLE_EXPORT void maille_release(void* bytes) {
  free(bytes);
}

/// A file of `size` bytes, of which none are here; `name` (released here) is how messages call it; a decoded
/// mesh may take `mesh_bytes`.
MAILLE_EXPORT Reader* maille_new_reader(double size, char* name, uint32_t name_size, double mesh_bytes) {
  auto* reader = new Reader(static_cast<uint64_t>(size), std::string(name, name_size),
                            static_cast<uint64_t>(mesh_bytes));
  free(name);
  return reader;
}
MAILLE_EXPORT void maille_delete_reader(Reader* reader) {
  delete reader;
}

/// Bytes from `offset` on, which are the reader's from now on.
MAILLE_EXPORT void maille_give(Reader* reader, double offset, std::byte* bytes, uint32_t size) {
  reader->bytes.add(static_cast<uint64_t>(offset), bytes, size);
}
MAILLE_EXPORT void maille_forget_behind(Reader* reader, double kept) {
  reader->bytes.forget_behind(static_cast<uint64_t>(kept));
}
/// After wants_bytes: offset and size of each range.
MAILLE_EXPORT const double* maille_numbers(Reader* reader) {
  return reader->numbers.data();
}
MAILLE_EXPORT uint32_t maille_number_count(Reader* reader) {
  return static_cast<uint32_t>(reader->numbers.size());
}
MAILLE_EXPORT const char* maille_message(Reader* reader) {
  return reader->message.data();
}
MAILLE_EXPORT uint32_t maille_message_size(Reader* reader) {
  return static_cast<uint32_t>(reader->message.size());
}

/// Opens a file of mode random. numbers: sphere (4), number of levels, then faces and charts of each.
MAILLE_EXPORT int32_t maille_open(Reader* reader) {
  auto file = File::open(reader->bytes, reader->options());
  if (!file) return reader->outcome(file.error());
  reader->bytes.take_wanted();
  reader->file.emplace(std::move(*file));
  const Sphere sphere = reader->file->sphere();
  reader->numbers.assign(sphere.centre.x.begin(), sphere.centre.x.end());
  reader->numbers.push_back(sphere.radius);
  reader->numbers.push_back(reader->file->levels());
  for (uint32_t level = 0; level < reader->file->levels(); ++level) {
    reader->numbers.push_back(static_cast<double>(reader->file->faces(level)));
    reader->numbers.push_back(reader->file->charts(level));
  }
  return done;
}

/// numbers: of each chart its group, place in it, level, faces, bytes, and sphere (4).
MAILLE_EXPORT int32_t maille_select(Reader* reader, const double* packed, uint32_t count, double most_faces) {
  if (!reader->file) return no_file(*reader);
  const Request request = request_of(packed, count);
  auto selected = most_faces > 0 ? reader->file->select(request.region, static_cast<uint64_t>(most_faces),
                                                        request.detail.view)
                                 : reader->file->select(request.region, request.detail);
  if (const int32_t outcome = reader->keep(std::move(selected), reader->selection); outcome != done)
    return outcome;
  std::vector<double> numbers;
  for (const ChartPlace& place : reader->selection.charts) {
    const auto info = reader->file->info(place);
    if (!info) return reader->outcome(info.error());
    const Vector3& centre = info->sphere.centre;
    for (const double number :
         {double(place.group), double(place.chart), double(info->level), double(info->faces),
          double(info->bytes), centre[0], centre[1], centre[2], info->sphere.radius})
      numbers.push_back(number);
  }
  reader->numbers = std::move(numbers);
  return done;
}

/// numbers: how many groups there are; then of each group from `first` on, `count` of them or as many as
/// there are: level, view error, sphere (4), how many charts it replaces, number of charts; of each chart the
/// group that refines it (-1: none), faces, bytes, sphere (4).
MAILLE_EXPORT int32_t maille_groups(Reader* reader, uint32_t first, uint32_t count) {
  if (!reader->file) return no_file(*reader);
  const uint32_t all = reader->file->groups();
  std::vector<double> numbers = {double(all)};
  const auto add_sphere = [&](const Sphere& sphere) {
    for (const double x : sphere.centre.x) numbers.push_back(x);
    numbers.push_back(sphere.radius);
  };
  for (uint32_t g = first; g < all && g - first < count; ++g) {
    const auto group = reader->file->group(g);
    if (!group) return reader->outcome(group.error());
    numbers.push_back(group->level);
    numbers.push_back(group->view_error);
    add_sphere(group->sphere);
    numbers.push_back(group->replaces);
    numbers.push_back(double(group->charts.size()));
    for (const GroupInfo::Chart& chart : group->charts) {
      numbers.push_back(chart.refined_by == GroupInfo::none ? -1.0 : double(chart.refined_by));
      numbers.push_back(double(chart.faces));
      numbers.push_back(double(chart.bytes));
      add_sphere(chart.sphere);
    }
  }
  reader->bytes.take_wanted();
  reader->numbers = std::move(numbers);
  return done;
}

MAILLE_EXPORT int32_t maille_read_chart(Reader* reader, uint32_t group, uint32_t chart) {
  if (!reader->file) return no_file(*reader);
  // Its memory, still in the cache, is for this one.
  reader->mesh = {};
  const int32_t outcome = reader->keep(reader->file->read({group, chart}), reader->mesh);
  return charts_alone && outcome == done && !is_plain(reader->mesh) ? not_in_charts : outcome;
}

/// The charts that were selected last, as one mesh.
MAILLE_EXPORT int32_t maille_extract(Reader* reader) {
  if (charts_alone) return not_in_charts;
  if (!reader->file) return no_file(*reader);
  return reader->keep(reader->file->extract(reader->selection), reader->mesh);
}

/// Faces of the mesh at hand that touch a region.
MAILLE_EXPORT int32_t maille_clip(Reader* reader, const double* packed, uint32_t count) {
  if (charts_alone) return not_in_charts;
  reader->mesh = maille::clip(reader->mesh, request_of(packed, count).region);
  return done;
}

/// numbers: none, or group, chart, face, three corners, three weights, position (3), distance.
MAILLE_EXPORT int32_t maille_hit(Reader* reader, const double* ray) {
  if (!reader->file) return no_file(*reader);
  std::optional<SurfacePoint> found;
  const int32_t outcome =
      reader->keep(reader->file->hit({{ray[0], ray[1], ray[2]}}, {{ray[3], ray[4], ray[5]}}), found);
  if (outcome != done) return outcome;
  reader->numbers.clear();
  if (!found) return done;
  reader->numbers = {double(found->chart.group), double(found->chart.chart), double(found->face)};
  for (const uint32_t corner : found->corners) reader->numbers.push_back(corner);
  for (const double weight : found->weights) reader->numbers.push_back(weight);
  for (const double x : found->position.x) reader->numbers.push_back(x);
  reader->numbers.push_back(found->distance);
  return done;
}

/// The whole mesh, of a file of any mode.
MAILLE_EXPORT int32_t maille_decode(Reader* reader) {
  if (charts_alone) return not_in_charts;
  return reader->keep(maille::decode(reader->bytes, reader->options()), reader->mesh);
}

void list_drawn(Reader& reader) {
  std::vector<Buffer>& list = reader.buffers;
  const Drawable& drawable = reader.drawable;
  reader.numbers.assign(drawable.origin.x.begin(), drawable.origin.x.end());
  list.push_back(numbers_of(BufferKind::drawn_positions, Scalar::f32, drawable.positions, 3));
  list.push_back(numbers_of(BufferKind::drawn_points, Scalar::u32, drawable.points));
  list.push_back(numbers_of(BufferKind::drawn_triangles, Scalar::u32, drawable.triangles, 3));
  list.push_back(numbers_of(BufferKind::drawn_cells, Scalar::u32, drawable.cells));
  for (const Array& array : drawable.arrays) add_array(list, BufferKind::drawn_array, array);
  for (const Array& array : drawable.of_triangles) add_array(list, BufferKind::triangle_array, array);
}

void list_exact(Reader& reader) {
  std::vector<Buffer>& list = reader.buffers;
  add_array(list, BufferKind::points, reader.mesh.points);
  for (uint32_t b = 0; b < reader.mesh.blocks.size(); ++b) {
    const CellBlock& block = reader.mesh.blocks[b];
    for (Buffer buffer : {numbers_of(BufferKind::block_types, Scalar::u8, block.types),
                          wide_numbers(reader, BufferKind::block_offsets, block.offsets),
                          numbers_of(BufferKind::block_connectivity, Scalar::u32, block.connectivity),
                          numbers_of(BufferKind::piece_face_sizes, Scalar::u32, block.face_sizes),
                          wide_numbers(reader, BufferKind::piece_cell_faces, block.cell_faces)}) {
      buffer.block = b;
      buffer.cell_type = static_cast<uint32_t>(block.type);
      buffer.name = block.name.data();
      buffer.name_size = static_cast<uint32_t>(block.name.size());
      list.push_back(buffer);
    }
  }
  for (const Array& array : reader.mesh.arrays) add_array(list, BufferKind::array, array);
}

namespace {

/// Vertices are the points of the mesh, triangles its cells, in their order: JavaScript counts them itself.
void list_plain(Reader& reader, const std::optional<Vector3>& origin) {
  std::vector<Buffer>& list = reader.buffers;
  const Mesh& mesh = reader.mesh;
  PackedChart& packed = reader.packed;
  packed.pack(mesh, origin);
  reader.numbers.assign(packed.origin.x.begin(), packed.origin.x.end());
  list.push_back(numbers_of(BufferKind::drawn_positions, Scalar::f32, packed.positions, 3));
  const std::span<const uint32_t> corners = mesh.blocks[0].connectivity;
  list.push_back(packed.triangles.size() == corners.size()
                     ? numbers_of(BufferKind::drawn_triangles, Scalar::u16, packed.triangles, 3)
                     : numbers_of(BufferKind::drawn_triangles, Scalar::u32, corners, 3));
  for (const Array& array : mesh.arrays) {
    if (array.domain == Domain::point) add_array(list, BufferKind::drawn_array, array);
    if (array.domain == Domain::cell) add_array(list, BufferKind::array, array);
  }
}

/// What maille_buffers() lists.
enum class Wanted : uint32_t { exact, drawn, surface, surface_of_pieces };

void list_mesh(Reader& reader, Wanted wanted) {
  // Charts fit at their borders, bit for bit, where all are drawn from one origin.
  std::optional<Vector3> origin;
  if (reader.file) origin = reader.file->sphere().centre;
  if (charts_alone || (wanted == Wanted::drawn && is_plain(reader.mesh))) return list_plain(reader, origin);
  reader.drawable = draw(reader.mesh, origin);
  if (wanted == Wanted::surface) spread_cell_arrays(reader.mesh, reader.drawable);
  list_drawn(reader);
  const std::vector<CellBlock>& blocks = reader.mesh.blocks;
  for (size_t b = 0; b < blocks.size() && blocks.size() > 1; ++b)
    reader.numbers.push_back(double(blocks[b].size()));
  for (const Array& array : reader.mesh.arrays) {
    if (wanted == Wanted::drawn && array.domain == Domain::cell)
      add_array(reader.buffers, BufferKind::array, array);
  }
}

}  // namespace

/// Lists the mesh at hand: exactly, as it is drawn (numbers: origin, 3; cells of each of several blocks), the
/// same with values of cells on triangles, or the surface that maille_surface_of_pieces() has made.
MAILLE_EXPORT const Buffer* maille_buffers(Reader* reader, uint32_t number) {
  const auto wanted = static_cast<Wanted>(number);
  reader->buffers.clear();
  reader->wide.clear();
  if (wanted == Wanted::exact && !charts_alone) {
    list_exact(*reader);
  } else if (wanted == Wanted::surface_of_pieces && !charts_alone) {
    list_drawn(*reader);
  } else {
    list_mesh(*reader, wanted);
  }
  return reader->buffers.data();
}
MAILLE_EXPORT uint32_t maille_buffer_count(Reader* reader) {
  return static_cast<uint32_t>(reader->buffers.size());
}
/// message: the names of what a buffer with labels counts, each ended by a zero.
MAILLE_EXPORT void maille_labels(Reader* reader, uint32_t buffer) {
  reader->message.clear();
  for (const std::string& label : *reader->buffers[buffer].labels) reader->message.append(label) += '\0';
}
/// message: keys and values of the metadata in turn, each ended by a zero.
MAILLE_EXPORT int32_t maille_metadata(Reader* reader) {
  if (charts_alone) return not_in_charts;
  FileInfo info;
  if (const int32_t outcome = reader->keep(inspect(reader->bytes, reader->options().limits), info);
      outcome != done)
    return outcome;
  reader->message.clear();
  for (const auto& [key, value] : info.metadata) {
    reader->message.append(key) += '\0';
    reader->message.append(value) += '\0';
  }
  return done;
}
/// The mesh at hand is no longer wanted.
MAILLE_EXPORT void maille_clear(Reader* reader) {
  reader->mesh = {};
  reader->drawable = {};
  reader->packed.release();
  reader->buffers.clear();
  reader->wide.clear();
  reader->written = {};
}

}  // namespace maille::wasm
