#pragma once

#include "base/hash.h"

#include <maille/mesh.h>

#include <array>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace maille {

/// hash_mix leaves the low bits weak; these hashes are added up, so every bit must depend on every other. The
/// finalizer of MurmurHash3 (Appleby 2011).
inline uint64_t scrambled(uint64_t x) {
  x = (x ^ (x >> 33)) * 0xff51afd7ed558ccdu;
  x = (x ^ (x >> 33)) * 0xc4ceb9fe1a85ec53u;
  return x ^ (x >> 33);
}

/// True when an array's numbers stand for texts: compared by text then.
inline bool has_labels(const Array& array) {
  return !array.labels.empty() && !is_float(array.type);
}

/// One mesh as compare() sees it: points, cells one after the other over all blocks, and the values that
/// belong to each of them. Equal values have equal hashes in both meshes; hashes prove differences only, see
/// equal_values().
class Elements {
 public:
  struct Cell {
    const uint32_t* nodes;
    uint32_t degree;
    uint32_t kind;

    std::span<const uint32_t> points() const { return {nodes, degree}; }
  };

  /// Compares `arrays` only (positions among them). Another seed gives other hashes, without the collisions
  /// of this one.
  Elements(const Mesh& mesh, const std::vector<const Array*>& arrays, bool block_names, uint64_t seed);

  const Mesh& mesh() const { return *mesh_; }
  const std::vector<Cell>& cells() const { return cells_; }
  /// Corner number, over all blocks, of a cell's first corner.
  uint64_t first_corner(const Cell& cell) const;
  CellType type_of(const Cell& cell) const { return kinds_[cell.kind].type; }
  /// For messages: "triangle 12 (points 3 4 5) with material ("wood")", naming the arrays compared, if they
  /// are few.
  std::string describe_cell(uint64_t cell) const;
  /// " with temperature (20)"; nothing when there is none but the position.
  std::string describe_values(Domain domain, uint64_t element, uint64_t count = 1) const;

  uint64_t point_hash(uint64_t point) const { return values_hash(Domain::point, point); }
  uint64_t corner_hash(uint64_t corner) const { return values_hash(Domain::corner, corner); }
  /// Type, block name and cell arrays; not the corners.
  uint64_t cell_hash(uint64_t cell) const {
    return values_hash(Domain::cell, cell) ^ kinds_[cells_[cell].kind].hash;
  }

  friend bool equal_values(const Elements& a, Domain domain, uint64_t i, const Elements& b, uint64_t j);
  friend bool equal_kinds(const Elements& a, const Cell& i, const Elements& b, const Cell& j);

 private:
  struct Kind {
    CellType type;  ///< polygons of 3 and 4 corners count as triangle and quad
    size_t block;
    uint64_t first_corner;
    uint64_t hash;
    std::vector<uint32_t> face_sizes;  ///< of polyhedra
  };
  struct Attribute {
    const Array* array;
    std::vector<uint64_t> label_hashes;
  };

  uint64_t values_hash(Domain domain, uint64_t element) const;
  void add_block(size_t block, uint64_t first_corner);
  uint32_t kind_of(size_t block, CellType type, std::span<const uint32_t> faces, uint64_t first_corner);

  const Mesh* mesh_;
  bool block_names_;
  uint64_t seed_;
  static constexpr uint32_t no_kind = UINT32_MAX;

  std::vector<Kind> kinds_;
  // Of the block at hand.
  std::array<uint32_t, 256> kind_of_type_;
  std::map<std::vector<uint32_t>, uint32_t> kind_of_faces_;
  std::vector<Cell> cells_;
  std::array<std::vector<Attribute>, domain_count> attributes_;
};

/// Whether all values of element i of `a` are those of element j of `b`: bit for bit, labels by text. Both
/// must have been made with arrays that belong together, in the same order.
bool equal_values(const Elements& a, Domain domain, uint64_t i, const Elements& b, uint64_t j);
/// Same type and, where they count, names of blocks.
bool equal_kinds(const Elements& a, const Elements::Cell& i, const Elements& b, const Elements::Cell& j);

/// One tuple of `a` against one of `b`, bit for bit, or by text when both have labels.
bool equal_tuples(const Array& a, uint64_t i, const Array& b, uint64_t j);

/// "(1 2.5 -3)", as exact as needed to tell it from any other.
std::string describe_tuple(const Array& array, uint64_t i);

}  // namespace maille
