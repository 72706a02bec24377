#include "mesh.h"

#include "guard.h"

#include <maille/compare.h>
#include <limits>

namespace maille::c {

Result<std::unique_ptr<maille_mesh>> handle(Result<Mesh> mesh) {
  if (!mesh) return passed_on(std::move(mesh));
  auto made = std::make_unique<maille_mesh>();
  made->mesh = std::move(*mesh);
  return made;
}

namespace {

/// Takes `count` numbers at `data`, copied or borrowed. NULL is fine for none. The count is compared with
/// PTRDIFF_MAX first, because std::vector and pointer differences are undefined or throw beyond it.
template <class T>
Result<> take(Buffer<T>& to, const T* data, uint64_t count, int32_t how, const char* name) {
  if (how != MAILLE_COPY && how != MAILLE_BORROW)
    return wrong(std::string(name) + ": say MAILLE_COPY or MAILLE_BORROW, not " + std::to_string(how));
  if (count == 0) {
    to = {};
    return {};
  }
  if (!data) return wrong(std::string(name) + " is NULL, but there are to be " + std::to_string(count));
  if (count > std::numeric_limits<ptrdiff_t>::max() / sizeof(T))
    return wrong(std::string(name) + ": " + std::to_string(count) + " are more than memory can hold");
  const std::span<const T> numbers(data, static_cast<size_t>(count));
  to = how == MAILLE_BORROW ? Buffer<T>::borrow(numbers) : Buffer<T>(numbers.begin(), numbers.end());
  return {};
}

/// Takes tuples of numbers of any type. Dividing the limit, instead of multiplying the count, avoids an
/// overflow.
Result<> take_tuples(Array& array, uint64_t tuples, const void* values, int32_t how, const char* name) {
  const uint64_t most = static_cast<uint64_t>(std::numeric_limits<ptrdiff_t>::max());
  if (array.components == 0) return wrong(std::string(name) + ": at least one component is needed");
  if (tuples > most / array.tuple_size())
    return wrong(std::string(name) + ": " + std::to_string(tuples) + " tuples are more than memory can hold");
  return take(array.bytes, static_cast<const std::byte*>(values), tuples * array.tuple_size(), how, name);
}

/// Numbers of blocks and arrays come from callers: beyond the last one there is none, and functions of
/// reading answer with nothing instead of an error, so that a loop needs no error object.
const CellBlock* block_of(const maille_mesh* mesh, uint64_t block) {
  return mesh ? at(mesh->mesh.blocks, block) : nullptr;
}
const Array* array_of(const maille_mesh* mesh, uint64_t array) {
  return mesh ? at(mesh->mesh.arrays, array) : nullptr;
}

Result<> set_points(Mesh& mesh, int32_t type, uint64_t count, const void* positions, int32_t how) {
  const auto scalar = chosen<Scalar>(type, scalar_count, "the type of number");
  if (!scalar) return tl::unexpected(scalar.error());
  if (count > max_points) return wrong("a mesh in memory has at most 2^32 - 2 points");
  Array points = make_array("position", Domain::point, *scalar, 3);
  if (auto taken = take_tuples(points, count, positions, how, "positions"); !taken) return taken;
  mesh.points = std::move(points);
  return {};
}

// Arrays are found by name and domain, so a second one of the same name could never be found.
Result<> add_array(Mesh& mesh, Array array, uint64_t tuples, const void* values, int32_t how) {
  if (mesh.find(array.name, array.domain))
    return wrong("there is an array \"" + array.name + "\" on " + name_of(array.domain) + "s already");
  if (auto taken = take_tuples(array, tuples, values, how, "values"); !taken) return taken;
  mesh.arrays.push_back(std::move(array));
  return {};
}

}  // namespace
}  // namespace maille::c

using namespace maille;
using namespace maille::c;

maille_mesh* maille_mesh_create(maille_error* error) {
  return make(error, {}, [] { return handle(Mesh()); });
}
void maille_mesh_free(maille_mesh* mesh) {
  delete mesh;
}

int32_t maille_mesh_set_points(maille_mesh* mesh, int32_t type, uint64_t count, const void* positions,
                               int32_t how, maille_error* error) {
  return run(error, {{mesh, "mesh"}}, [&] { return set_points(mesh->mesh, type, count, positions, how); });
}

int32_t maille_mesh_add_block(maille_mesh* mesh, const char* name, int32_t cell_type, uint64_t cells,
                              const uint64_t* offsets, const uint32_t* connectivity, uint64_t entries,
                              const uint8_t* types, int32_t how, maille_error* error) {
  return run(error, {{mesh, "mesh"}}, [&]() -> Result<> {
    const auto type = chosen<CellType>(cell_type, 256, "the cell type");
    if (!type) return tl::unexpected(type.error());
    CellBlock block{text(name), *type, {}, {}, {}};
    const unsigned nodes = nodes_of(*type);
    if (nodes != 0 && (entries % nodes != 0 || entries / nodes != cells))
      return wrong(std::to_string(cells) + " cells of type " + name_of(*type) + " have " +
                   std::to_string(nodes) + " entries each, not " + std::to_string(entries) + " in all");
    if (nodes != 0 && offsets) return wrong("cells with a fixed number of nodes take no offsets");
    // There is one offset more than there are cells.
    if (cells == std::numeric_limits<uint64_t>::max()) return wrong("cells: more than memory can hold");
    if (auto taken = take(block.connectivity, connectivity, entries, how, "connectivity"); !taken)
      return taken;
    // No cells and no offsets is a block without cells; offsets that are given are taken even then.
    const uint64_t places = nodes == 0 && (cells > 0 || offsets) ? cells + 1 : 0;
    if (auto taken = take(block.offsets, offsets, places, how, "offsets"); !taken) return taken;
    const uint64_t typed = *type == CellType::mixed ? cells : 0;
    if (auto taken = take(block.types, types, typed, how, "types"); !taken) return taken;
    mesh->mesh.blocks.push_back(std::move(block));
    return {};
  });
}

int32_t maille_mesh_set_faces(maille_mesh* mesh, uint64_t block, const uint32_t* face_sizes, uint64_t faces,
                              const uint64_t* cell_faces, int32_t how, maille_error* error) {
  return run(error, {{mesh, "mesh"}}, [&]() -> Result<> {
    if (block >= mesh->mesh.blocks.size()) return wrong("there is no block " + std::to_string(block));
    CellBlock& to = mesh->mesh.blocks[static_cast<size_t>(block)];
    if (auto taken = take(to.face_sizes, face_sizes, faces, how, "face_sizes"); !taken) return taken;
    return take(to.cell_faces, cell_faces, to.size() + 1, how, "cell_faces");
  });
}

int32_t maille_mesh_add_array(maille_mesh* mesh, const char* name, int32_t domain, int32_t type,
                              uint32_t components, uint64_t tuples, const void* values, int32_t role,
                              int32_t how, maille_error* error) {
  return run(error, {{mesh, "mesh"}, {name, "name"}}, [&]() -> Result<> {
    const auto on = chosen<Domain>(domain, domain_count, "the domain");
    if (!on) return tl::unexpected(on.error());
    const auto scalar = chosen<Scalar>(type, scalar_count, "the type of number");
    if (!scalar) return tl::unexpected(scalar.error());
    const auto meaning = chosen<Role>(role, role_count, "the role");
    if (!meaning) return tl::unexpected(meaning.error());
    return add_array(mesh->mesh, make_array(name, *on, *scalar, components, *meaning), tuples, values, how);
  });
}

int32_t maille_mesh_add_label(maille_mesh* mesh, uint64_t array, const char* label, maille_error* error) {
  return run(error, {{mesh, "mesh"}, {label, "label"}}, [&]() -> Result<> {
    if (array >= mesh->mesh.arrays.size()) return wrong("there is no array " + std::to_string(array));
    mesh->mesh.arrays[static_cast<size_t>(array)].labels.emplace_back(label);
    return {};
  });
}

int32_t maille_mesh_add_metadata(maille_mesh* mesh, const char* key, const char* value, maille_error* error) {
  return run(error, {{mesh, "mesh"}, {key, "key"}, {value, "value"}}, [&]() -> Result<> {
    mesh->mesh.metadata.emplace_back(key, value);
    return {};
  });
}

// What is built piece by piece is checked here, or by maille_encode(); the functions before check only what
// could not be put right later.
int32_t maille_mesh_validate(const maille_mesh* mesh, maille_error* error) {
  return run(error, {{mesh, "mesh"}}, [&] { return validate(mesh->mesh); });
}

uint64_t maille_mesh_points(const maille_mesh* mesh) {
  return mesh ? mesh->mesh.point_count() : 0;
}
uint64_t maille_mesh_cells(const maille_mesh* mesh) {
  return mesh ? mesh->mesh.cell_count() : 0;
}
uint64_t maille_mesh_corners(const maille_mesh* mesh) {
  return mesh ? mesh->mesh.corner_count() : 0;
}
int32_t maille_mesh_position_type(const maille_mesh* mesh) {
  return mesh ? static_cast<int32_t>(mesh->mesh.points.type) : -1;
}
const void* maille_mesh_positions(const maille_mesh* mesh) {
  return mesh ? listed(mesh->mesh.points.bytes, nullptr) : nullptr;
}

uint64_t maille_mesh_blocks(const maille_mesh* mesh) {
  return mesh ? mesh->mesh.blocks.size() : 0;
}
const char* maille_block_name(const maille_mesh* mesh, uint64_t block) {
  const CellBlock* const found = block_of(mesh, block);
  return found ? found->name.c_str() : nullptr;
}
int32_t maille_block_type(const maille_mesh* mesh, uint64_t block) {
  const CellBlock* const found = block_of(mesh, block);
  return found ? static_cast<int32_t>(found->type) : -1;
}
uint64_t maille_block_cells(const maille_mesh* mesh, uint64_t block) {
  const CellBlock* const found = block_of(mesh, block);
  return found ? found->size() : 0;
}
const uint32_t* maille_block_connectivity(const maille_mesh* mesh, uint64_t block, uint64_t* count) {
  const CellBlock* const found = block_of(mesh, block);
  return found ? listed(found->connectivity, count) : none<uint32_t>(count);
}
const uint64_t* maille_block_offsets(const maille_mesh* mesh, uint64_t block, uint64_t* count) {
  const CellBlock* const found = block_of(mesh, block);
  return found ? listed(found->offsets, count) : none<uint64_t>(count);
}
const uint8_t* maille_block_types(const maille_mesh* mesh, uint64_t block, uint64_t* count) {
  const CellBlock* const found = block_of(mesh, block);
  return found ? listed(found->types, count) : none<uint8_t>(count);
}
const uint32_t* maille_block_face_sizes(const maille_mesh* mesh, uint64_t block, uint64_t* count) {
  const CellBlock* const found = block_of(mesh, block);
  return found ? listed(found->face_sizes, count) : none<uint32_t>(count);
}
const uint64_t* maille_block_cell_faces(const maille_mesh* mesh, uint64_t block, uint64_t* count) {
  const CellBlock* const found = block_of(mesh, block);
  return found ? listed(found->cell_faces, count) : none<uint64_t>(count);
}

uint64_t maille_mesh_arrays(const maille_mesh* mesh) {
  return mesh ? mesh->mesh.arrays.size() : 0;
}
uint64_t maille_mesh_find(const maille_mesh* mesh, const char* name, int32_t domain) {
  const uint64_t count = maille_mesh_arrays(mesh);
  for (uint64_t i = 0; name && i < count; ++i) {
    const Array& array = mesh->mesh.arrays[static_cast<size_t>(i)];
    if (static_cast<int32_t>(array.domain) == domain && array.name == name) return i;
  }
  return count;
}
const char* maille_array_name(const maille_mesh* mesh, uint64_t array) {
  const Array* const found = array_of(mesh, array);
  return found ? found->name.c_str() : nullptr;
}
int32_t maille_array_domain(const maille_mesh* mesh, uint64_t array) {
  const Array* const found = array_of(mesh, array);
  return found ? static_cast<int32_t>(found->domain) : -1;
}
int32_t maille_array_type(const maille_mesh* mesh, uint64_t array) {
  const Array* const found = array_of(mesh, array);
  return found ? static_cast<int32_t>(found->type) : -1;
}
int32_t maille_array_role(const maille_mesh* mesh, uint64_t array) {
  const Array* const found = array_of(mesh, array);
  return found ? static_cast<int32_t>(found->role) : -1;
}
uint32_t maille_array_components(const maille_mesh* mesh, uint64_t array) {
  const Array* const found = array_of(mesh, array);
  return found ? found->components : 0;
}
uint64_t maille_array_tuples(const maille_mesh* mesh, uint64_t array) {
  const Array* const found = array_of(mesh, array);
  return found ? found->count() : 0;
}
const void* maille_array_values(const maille_mesh* mesh, uint64_t array) {
  const Array* const found = array_of(mesh, array);
  return found ? listed(found->bytes, nullptr) : nullptr;
}
uint64_t maille_array_labels(const maille_mesh* mesh, uint64_t array) {
  const Array* const found = array_of(mesh, array);
  return found ? found->labels.size() : 0;
}
const char* maille_array_label(const maille_mesh* mesh, uint64_t array, uint64_t label) {
  const Array* const found = array_of(mesh, array);
  const std::string* const text = found ? at(found->labels, label) : nullptr;
  return text ? text->c_str() : nullptr;
}

uint64_t maille_mesh_metadata(const maille_mesh* mesh) {
  return mesh ? mesh->mesh.metadata.size() : 0;
}
const char* maille_mesh_metadata_key(const maille_mesh* mesh, uint64_t i) {
  const auto* const entry = mesh ? at(mesh->mesh.metadata, i) : nullptr;
  return entry ? entry->first.c_str() : nullptr;
}
const char* maille_mesh_metadata_value(const maille_mesh* mesh, uint64_t i) {
  const auto* const entry = mesh ? at(mesh->mesh.metadata, i) : nullptr;
  return entry ? entry->second.c_str() : nullptr;
}
uint64_t maille_mesh_notes(const maille_mesh* mesh) {
  return mesh ? mesh->notes.size() : 0;
}
const char* maille_mesh_note(const maille_mesh* mesh, uint64_t i) {
  const std::string* const note = mesh ? at(mesh->notes, i) : nullptr;
  return note ? note->c_str() : nullptr;
}
const uint32_t* maille_mesh_cell_numbers(const maille_mesh* mesh, uint64_t* count) {
  return mesh ? listed(mesh->cell_numbers, count) : none<uint32_t>(count);
}
const uint32_t* maille_mesh_point_numbers(const maille_mesh* mesh, uint64_t* count) {
  return mesh ? listed(mesh->point_numbers, count) : none<uint32_t>(count);
}

int32_t maille_compare(const maille_mesh* a, const maille_mesh* b, int32_t same_order, maille_error* error) {
  return run(error, {{a, "a"}, {b, "b"}}, [&]() -> Result<> {
    // Meshes of C callers are built piece by piece and may be incomplete, but compare() needs valid ones.
    for (const maille_mesh* mesh : {a, b}) {
      if (auto valid = validate(mesh->mesh); !valid) return valid;
    }
    CompareOptions options;
    options.same_order = same_order != 0;
    const Comparison comparison = compare(a->mesh, b->mesh, options);
    if (comparison.equal) return {};
    return failure(ErrorCode::differs,
                   comparison.differences.empty() ? "the meshes differ" : comparison.differences.front());
  });
}
