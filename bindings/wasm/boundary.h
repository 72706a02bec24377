#pragma once

#include <maille/stream.h>

#include <vector>

#include "drawable.h"

namespace maille::wasm {

/// Things with numbers of 32 bits, each with a tuple of bytes; numbers of those that are gone are given out
/// again.
class TuplePool {
 public:
  explicit TuplePool(size_t tuple_size) : size_(tuple_size) {}
  uint32_t add();
  void remove(uint32_t number) { free_.push_back(number); }
  std::byte* at(uint32_t number) { return bytes_.data() + number * size_; }
  const std::byte* at(uint32_t number) const { return bytes_.data() + number * size_; }
  size_t held() const { return bytes_.size(); }

 private:
  size_t size_;
  uint32_t count_ = 0;
  std::vector<std::byte> bytes_;
  std::vector<uint32_t> free_;
};

/// The surface of a mesh that comes in pieces: the faces that it has, and those of solids that no other solid
/// has. In memory are the surface, and what touches cells that may still come.
class Boundary {
 public:
  explicit Boundary(const StreamDescription& description);
  /// Error: memory_bound, for more than a page can show.
  Result<> add(const StreamPortion& piece);
  /// Of all pieces. Triangles come in the order of their cells.
  Drawable finish();

  uint64_t cells() const { return cells_; }

 private:
  struct Vertex {
    uint32_t point = 0;
    uint32_t uses = 0;  ///< by faces, and by the slot while cells may come
  };
  struct Cell {
    uint32_t number = 0;
    uint32_t uses = 0;
  };
  struct Face {
    uint64_t serial = 0;  ///< in the order of the mesh
    uint32_t cell = 0;
    uint32_t first = 0, size = 0;  ///< in nodes_
    uint32_t next = 0;             ///< of the same bucket, or of those that are free; 0: none
    bool open = false;             ///< another solid may have it, too
  };

  void add_points(const StreamPortion& piece);
  void end_points(const StreamPortion& piece);
  void add_cell(const StreamPortion& piece, size_t i);
  uint32_t* find_open(std::span<const uint32_t> nodes);
  void meet(std::span<const uint32_t> nodes);
  void keep(std::span<const uint32_t> nodes, bool open);
  void remove(uint32_t face);
  void release(uint32_t vertex);
  uint32_t& bucket_of(std::span<const uint32_t> sorted);
  void grow_table();
  std::span<const uint32_t> nodes_of(const Face& face) const {
    return std::span(nodes_).subspan(face.first, face.size);
  }
  std::vector<uint32_t> faces_in_order();
  void gather_vertices(const std::vector<uint32_t>& points, Drawable& drawable) const;
  void gather_cells(const std::vector<uint32_t>& cells, Drawable& drawable) const;

  StreamArray position_array_;
  std::vector<StreamArray> point_arrays_, cell_arrays_;
  std::vector<uint32_t> vertex_of_slot_;
  std::vector<Vertex> vertices_;
  std::vector<Cell> cell_list_;
  TuplePool vertex_values_, cell_values_;
  std::vector<Face> faces_;  ///< the first is none
  std::vector<uint32_t> nodes_;
  std::vector<uint32_t> free_faces_;  ///< by number of corners: a list through Face::next
  std::vector<uint32_t> table_;       ///< by hash of the sorted corners
  std::vector<uint32_t> cell_nodes_, sorted_, known_;
  uint64_t open_ = 0, serial_ = 0, cells_ = 0;
  uint32_t cell_ = 0;  ///< at hand
};

}  // namespace maille::wasm
