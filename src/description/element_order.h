#pragma once

#include <maille/mesh.h>
#include <maille/source.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace maille {

/// Moves the tuples of an array: tuple i goes to places[i], tuples with place none (gaps) fall away. `count`
/// is the number of tuples there are afterwards.
void move_tuples(Array& array, std::span<const uint32_t> places, uint64_t count);

/// How the elements of a decoded mesh stood in the mesh that was encoded.
struct ElementOrder {
  std::vector<uint32_t> points;    ///< by decoded point: its original number
  std::vector<uint32_t> cells;     ///< by decoded cell: its original number
  std::vector<uint32_t> rotation;  ///< by decoded cell: the original position of its first corner
};

// The order as a coded sequence: all points, all cells, all rotations (docs/format.md, 15.2).
std::vector<std::byte> encode_order(const ElementOrder& order);

/// The same an element at a time, for orders that memory does not hold: all points, then all cells, then all
/// rotations.
class OrderEncoder {
 public:
  OrderEncoder();
  ~OrderEncoder();
  OrderEncoder(const OrderEncoder&) = delete;
  OrderEncoder& operator=(const OrderEncoder&) = delete;

  void add_points(std::span<const uint32_t> numbers);
  void add_cells(std::span<const uint32_t> numbers);
  void add_rotations(std::span<const uint32_t> rotations);
  /// The bytes since the last call, all but those of the last few elements: about a megabyte waits.
  std::vector<std::byte> take();
  /// The rest.
  std::vector<std::byte> finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The inverse of encode_order(). Safe on any bytes: permutations of the given sizes, or corrupt. The sizes
/// are the caller's, who has checked them against a limit.
Result<ElementOrder> decode_order(Bytes bytes, uint32_t points, uint32_t cells);

/// The mesh in its original order, with all arrays. Error: corrupt, when `order` would take cells out of
/// their blocks.
Result<Mesh> restore_order(Mesh mesh, const ElementOrder& order);

}  // namespace maille
