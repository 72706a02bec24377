#include "boundary.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "cell_faces.h"
#include "placement.h"

namespace maille::wasm {
namespace {

constexpr uint32_t none = std::numeric_limits<uint32_t>::max();
// Chosen, not swept: half of what addresses of 32 bits reach.
constexpr uint64_t most_bytes = uint64_t{2} << 30;

size_t tuple_size_of(std::span<const StreamArray> arrays) {
  size_t size = 0;
  for (const StreamArray& array : arrays) size += array.tuple_size();
  return size;
}

/// Tuple i of each array, one behind the other.
void put_tuples(std::span<const StreamArray> arrays, std::span<const std::vector<std::byte>> values, size_t i,
                std::byte* out) {
  for (size_t a = 0; a < arrays.size(); ++a) {
    const size_t size = arrays[a].tuple_size();
    std::memcpy(out, values[a].data() + i * size, size);
    out += size;
  }
}

Array drawn_array(const StreamArray& array, Domain domain, size_t tuples) {
  Array drawn = make_array(array.name, domain, array.type, array.components, array.role);
  drawn.labels = array.labels;
  drawn.resize(tuples);
  return drawn;
}

/// Tuples out of a pool, as arrays.
void take_arrays(std::span<const StreamArray> arrays, Domain domain, const TuplePool& pool, size_t before,
                 const std::vector<uint32_t>& numbers, std::vector<Array>& out) {
  for (const StreamArray& array : arrays) {
    Array drawn = drawn_array(array, domain, numbers.size());
    const size_t size = array.tuple_size();
    for (size_t i = 0; i < numbers.size(); ++i)
      std::memcpy(drawn.bytes.data() + i * size, pool.at(numbers[i]) + before, size);
    before += size;
    out.push_back(std::move(drawn));
  }
}

}  // namespace

uint32_t TuplePool::add() {
  if (!free_.empty()) {
    const uint32_t number = free_.back();
    free_.pop_back();
    return number;
  }
  bytes_.resize(bytes_.size() + size_);
  return count_++;
}

Boundary::Boundary(const StreamDescription& description)
    : position_array_(description.positions), vertex_values_(0), cell_values_(0), faces_(1), table_(1024) {
  for (const StreamArray& array : description.arrays)
    (array.domain == Domain::point ? point_arrays_ : cell_arrays_).push_back(array);
  vertex_values_ = TuplePool(position_array_.tuple_size() + tuple_size_of(point_arrays_));
  cell_values_ = TuplePool(tuple_size_of(cell_arrays_));
}

Result<> Boundary::add(const StreamPortion& piece) {
  add_points(piece);
  for (size_t i = 0; i < piece.cell_count(); ++i) add_cell(piece, i);
  end_points(piece);
  // Held against the limit after each portion, whose size the reader bounds.
  const uint64_t held = vertex_values_.held() + cell_values_.held() + faces_.size() * sizeof(Face) +
                        nodes_.size() * sizeof(uint32_t);
  if (held <= most_bytes && cells_ < none) return {};
  return failure(ErrorCode::memory_bound, "the surface is larger than a page can hold");
}

void Boundary::add_points(const StreamPortion& piece) {
  vertex_of_slot_.resize(piece.slot_count, none);
  const size_t size = position_array_.tuple_size();
  for (size_t i = 0; i < piece.points.size(); ++i) {
    const uint32_t vertex = vertex_values_.add();
    if (vertex == vertices_.size()) vertices_.emplace_back();
    // The point itself is one use, up to end_points(); each face that is kept is another. At 0 its tuples are
    // free for the next vertex.
    vertices_[vertex] = {static_cast<uint32_t>(piece.points[i]), 1};
    std::byte* values = vertex_values_.at(vertex);
    std::memcpy(values, piece.positions.data() + i * size, size);
    put_tuples(point_arrays_, piece.point_arrays, i, values + size);
    vertex_of_slot_[piece.point_slots[i]] = vertex;
  }
}

void Boundary::end_points(const StreamPortion& piece) {
  for (const uint32_t slot : piece.ended_slots) release(vertex_of_slot_[slot]);
}

void Boundary::release(uint32_t vertex) {
  if (--vertices_[vertex].uses == 0) vertex_values_.remove(vertex);
}

void Boundary::add_cell(const StreamPortion& piece, size_t i) {
  const auto slots =
      std::span(piece.slots).subspan(piece.offsets[i], piece.offsets[i + 1] - piece.offsets[i]);
  cell_nodes_.clear();
  for (const uint32_t slot : slots) cell_nodes_.push_back(vertex_of_slot_[slot]);
  std::span<const uint32_t> sizes;
  if (!piece.cell_faces.empty())
    sizes = std::span(piece.face_sizes)
                .subspan(piece.cell_faces[i], piece.cell_faces[i + 1] - piece.cell_faces[i]);
  cell_ = cell_values_.add();
  if (cell_ == cell_list_.size()) cell_list_.emplace_back();
  cell_list_[cell_] = {static_cast<uint32_t>(piece.first_cell + i), 1};
  put_tuples(cell_arrays_, piece.cell_arrays, i, cell_values_.at(cell_));
  for_each_face(
      piece.types[i], cell_nodes_, sizes, [&](std::span<const uint32_t> face) { meet(face); },
      [&](std::span<const uint32_t> face, bool) { keep(face, false); });
  if (--cell_list_[cell_].uses == 0) cell_values_.remove(cell_);
  ++cells_;
}

// A multiplier of Fibonacci hashing (Knuth, The Art of Computer Programming, vol. 3, 6.4). Collisions only
// cost a comparison: find_open() compares all corners.
uint32_t& Boundary::bucket_of(std::span<const uint32_t> sorted) {
  uint64_t hash = sorted.size();
  for (const uint32_t node : sorted) hash = (hash ^ node) * 0x9e3779b97f4a7c15u;
  return table_[(hash >> 32) & (table_.size() - 1)];
}

/// Where the number of the open face with these corners stands, in any order; where 0 stands: it is not
/// there.
uint32_t* Boundary::find_open(std::span<const uint32_t> nodes) {
  sorted_.assign(nodes.begin(), nodes.end());
  std::sort(sorted_.begin(), sorted_.end());
  uint32_t* at = &bucket_of(sorted_);
  for (; *at != 0; at = &faces_[*at].next) {
    if (faces_[*at].size != nodes.size()) continue;
    const auto known = nodes_of(faces_[*at]);
    known_.assign(known.begin(), known.end());
    std::sort(known_.begin(), known_.end());
    if (known_ == sorted_) break;
  }
  return at;
}

/// A face of a solid: one that is there goes, and one that is not comes.
void Boundary::meet(std::span<const uint32_t> nodes) {
  uint32_t* const found = find_open(nodes);
  if (*found == 0) return keep(nodes, true);
  const uint32_t number = std::exchange(*found, faces_[*found].next);
  --open_;
  remove(number);
}

void Boundary::keep(std::span<const uint32_t> nodes, bool open) {
  if (nodes.size() >= free_faces_.size()) free_faces_.resize(nodes.size() + 1);
  uint32_t& free = free_faces_[nodes.size()];
  uint32_t number = free;
  if (number != 0) {
    free = faces_[number].next;
  } else {
    number = static_cast<uint32_t>(faces_.size());
    faces_.emplace_back();
    faces_.back().first = static_cast<uint32_t>(nodes_.size());
    faces_.back().size = static_cast<uint32_t>(nodes.size());
    nodes_.resize(nodes_.size() + nodes.size());
  }
  Face& face = faces_[number];
  face.serial = serial_++;
  face.cell = cell_;
  face.open = open;
  face.next = 0;
  std::copy(nodes.begin(), nodes.end(), nodes_.begin() + face.first);
  for (const uint32_t vertex : nodes) ++vertices_[vertex].uses;
  ++cell_list_[cell_].uses;
  if (!open) return;
  if (++open_ > table_.size()) grow_table();
  sorted_.assign(nodes.begin(), nodes.end());
  std::sort(sorted_.begin(), sorted_.end());
  uint32_t& bucket = bucket_of(sorted_);
  face.next = std::exchange(bucket, number);
}

void Boundary::remove(uint32_t number) {
  Face& face = faces_[number];
  for (const uint32_t vertex : nodes_of(face)) release(vertex);
  if (--cell_list_[face.cell].uses == 0) cell_values_.remove(face.cell);
  face.open = false;
  face.cell = none;
  face.next = std::exchange(free_faces_[face.size], number);
}

void Boundary::grow_table() {
  const std::vector<uint32_t> before = std::exchange(table_, std::vector<uint32_t>(table_.size() * 4));
  for (uint32_t number : before) {
    while (number != 0) {
      const auto nodes = nodes_of(faces_[number]);
      sorted_.assign(nodes.begin(), nodes.end());
      std::sort(sorted_.begin(), sorted_.end());
      uint32_t& bucket = bucket_of(sorted_);
      const uint32_t next = std::exchange(faces_[number].next, bucket);
      bucket = std::exchange(number, next);
    }
  }
}

/// Flat cells at the border of solids are drawn once: as faces of these.
std::vector<uint32_t> Boundary::faces_in_order() {
  std::vector<uint32_t> order;
  for (uint32_t number = 1; number < faces_.size(); ++number) {
    const Face& face = faces_[number];
    if (face.cell != none && (face.open || *find_open(nodes_of(face)) == 0)) order.push_back(number);
  }
  std::sort(order.begin(), order.end(),
            [&](uint32_t a, uint32_t b) { return faces_[a].serial < faces_[b].serial; });
  return order;
}

Drawable Boundary::finish() {
  Drawable drawable;
  std::vector<uint32_t> drawn_as(vertices_.size(), none), vertices, cells;
  const auto vertex_of = [&](uint32_t number) {
    if (drawn_as[number] == none) {
      drawn_as[number] = static_cast<uint32_t>(vertices.size());
      vertices.push_back(number);
    }
    return drawn_as[number];
  };
  for (const uint32_t number : faces_in_order()) {
    const Face& face = faces_[number];
    const auto nodes = nodes_of(face);
    // A fan around the first corner, as everywhere in maille.
    for (size_t k = 2; k < nodes.size(); ++k) {
      for (const size_t corner : {size_t{0}, k - 1, k})
        drawable.triangles.push_back(vertex_of(nodes[corner]));
      cells.push_back(face.cell);
    }
  }
  gather_vertices(vertices, drawable);
  gather_cells(cells, drawable);
  return drawable;
}

void Boundary::gather_vertices(const std::vector<uint32_t>& vertices, Drawable& drawable) const {
  for (const uint32_t vertex : vertices) drawable.points.push_back(vertices_[vertex].point);
  std::vector<Array> positions;
  take_arrays({&position_array_, 1}, Domain::point, vertex_values_, 0, vertices, positions);
  drawable.positions.resize(3 * positions[0].count());
  drawable.origin = place(positions[0], {}, {}, drawable.positions);
  take_arrays(point_arrays_, Domain::point, vertex_values_, position_array_.tuple_size(), vertices,
              drawable.arrays);
}

void Boundary::gather_cells(const std::vector<uint32_t>& cells, Drawable& drawable) const {
  for (const uint32_t cell : cells) drawable.cells.push_back(cell_list_[cell].number);
  take_arrays(cell_arrays_, Domain::cell, cell_values_, 0, cells, drawable.of_triangles);
}

}  // namespace maille::wasm
