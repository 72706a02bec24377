#pragma once

#include "mesh/compare/compare_elements.h"

#include <optional>
#include <vector>

namespace maille {

/// A hash and the element that has it.
struct Keyed {
  uint64_t hash;
  uint64_t index;
};
inline bool operator<(const Keyed& x, const Keyed& y) {
  return x.hash != y.hash ? x.hash < y.hash : x.index < y.index;
}

/// The points of two meshes, A and B, in classes that every renaming which makes them equal maps onto each
/// other. Each class holds as many points of A as of B (a split that would not is refused: no such renaming
/// exists). A class of one point each is a pair.
class Partition {
 public:
  struct Class {
    uint32_t begin;   ///< of its points in both orders
    uint32_t size;    ///< points of each mesh
    uint32_t parent;  ///< the class it was cut from, at whose end it stood
  };
  /// A point that is to be told apart from others of its class by a key; equal keys stay together.
  struct Entry {
    uint32_t class_number;
    uint32_t point;
    uint64_t key;
  };

  /// From the sorted hashes of both meshes' points; nothing when they differ.
  static std::optional<Partition> from_hashes(const std::vector<Keyed>& a, const std::vector<Keyed>& b);

  uint32_t class_of(unsigned side, uint32_t point) const { return class_of_[side][point]; }
  const Class& at(uint32_t class_number) const { return classes_[class_number]; }
  std::span<const uint32_t> points(unsigned side, uint32_t class_number) const {
    const Class& c = classes_[class_number];
    return std::span(order_[side]).subspan(c.begin, c.size);
  }
  uint32_t class_count() const { return static_cast<uint32_t>(classes_.size()); }
  bool is_pair(unsigned side, uint32_t point) const { return classes_[class_of_[side][point]].size == 1; }
  bool all_pairs() const { return classes_.size() == order_[0].size(); }

  struct Witness {
    unsigned side;
    uint32_t point;
  };
  /// Cuts classes so that the entries' points are grouped by key, and apart from points without an entry.
  /// Sorts the entries. Points that came into a new class are appended to `moved`. False, and nothing is cut,
  /// when A and B do not match; `witness` is then a point of A or B that has no partner.
  bool split(std::vector<Entry> (&entries)[2], std::vector<uint32_t> (&moved)[2], Witness* witness);
  /// Takes back all splits since there were `count` classes.
  void undo(uint32_t count);

 private:
  struct Group {
    size_t begin, end;  ///< among the entries, the same in A and B
  };
  void cut(const std::vector<Entry> (&entries)[2], Group group, std::vector<uint32_t> (&moved)[2]);
  void cut_rest(uint32_t parent, const std::vector<Entry> (&entries)[2], Group touched,
                std::vector<uint32_t> (&moved)[2]);
  void move_to_end(unsigned side, uint32_t point, uint32_t end);

  std::vector<Class> classes_;
  std::vector<uint32_t> order_[2];  ///< points, class by class
  std::vector<uint32_t> place_[2];  ///< of a point in order_
  std::vector<uint32_t> class_of_[2];
};

}  // namespace maille
