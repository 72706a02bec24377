#include "surface/element_order.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "base/result.h"
#include "entropy/integer_model.h"
#include "entropy/rans.h"
#include "surface/half_edges.h"

namespace maille {
namespace {

tl::unexpected<Error> corrupt(const char* what) {
  return failure(ErrorCode::corrupt, std::string("order: ") + what);
}

/// Steps from one element's number to the next one's, in the context of the size of the step before: files
/// keep neighbours together, if in another order than ours.
template <class Coder>
class StepCoder {
 public:
  explicit StepCoder(Coder& coder) : coder_(coder) {}

  uint32_t code(uint32_t number) {
    const auto step = static_cast<int32_t>(number - before_ - 1);
    const uint32_t zigzag = static_cast<uint32_t>(step) << 1 ^ static_cast<uint32_t>(step >> 31);
    const uint32_t coded = models_[context_].code(coder_, zigzag);
    context_ = std::min(bit_length(coded), 15u);
    return before_ += 1 + (coded >> 1 ^ (0 - (coded & 1)));
  }

 private:
  Coder& coder_;
  std::array<CountModel, 16> models_;
  unsigned context_ = 0;
  uint32_t before_ = none_before;
  static constexpr uint32_t none_before = 0xffffffff;
};

template <class Coder>
void code_permutation(Coder& coder, std::vector<uint32_t>& numbers) {
  StepCoder<Coder> steps(coder);
  for (uint32_t& number : numbers) {
    number = steps.code(number);
    if (coder.exhausted()) return;
  }
}

template <class Coder>
void code_rotations(Coder& coder, std::vector<uint32_t>& rotations) {
  std::array<CountModel, 4> models;
  uint32_t before = 0;
  for (uint32_t& rotation : rotations) {
    rotation = models[std::min(before, 3u)].code(coder, rotation);
    before = rotation;
    if (coder.exhausted()) return;
  }
}

bool is_permutation(std::span<const uint32_t> numbers) {
  std::vector<bool> used(numbers.size());
  for (const uint32_t number : numbers) {
    if (number >= numbers.size() || used[number]) return false;
    used[number] = true;
  }
  return true;
}

/// Puts the cells of one block in order; `corner_place` gets the new place of each of its corners.
Result<CellBlock> restore_block(const CellBlock& block, const ElementOrder& order, uint32_t first_cell,
                                uint32_t first_corner, std::vector<uint32_t>& corner_place) {
  const auto cells = static_cast<uint32_t>(block.size());
  std::vector<uint32_t> decoded(cells, 0);  // by original place in the block
  for (uint32_t i = 0; i < cells; ++i) {
    const uint32_t original = order.cells[first_cell + i];
    if (original < first_cell || original - first_cell >= cells) return corrupt("a cell leaves its block");
    decoded[original - first_cell] = i;
  }
  CellBlock result;
  result.name = block.name;
  result.type = block.type;
  if (!block.offsets.empty()) result.offsets.push_back(0);
  const std::span all(block.connectivity);
  for (const uint32_t i : decoded) {
    const auto corners = block.cell(i);
    const size_t size = corners.size();
    const size_t rotation = order.rotation[first_cell + i];
    if (rotation != 0 && rotation >= size) return corrupt("a cell is turned too far");
    for (size_t k = 0; k < size; ++k) {
      const size_t from = (k + size - rotation) % size;
      corner_place[first_corner + static_cast<size_t>(corners.data() - all.data()) + from] =
          first_corner + static_cast<uint32_t>(result.connectivity.size());
      result.connectivity.push_back(order.points[corners[from]]);
    }
    if (!block.offsets.empty()) result.offsets.push_back(result.connectivity.size());
    if (!block.types.empty()) result.types.push_back(block.types[i]);
  }
  return result;
}

}  // namespace

void move_tuples(Array& array, std::span<const uint32_t> places, uint64_t count) {
  const size_t size = array.tuple_size();
  std::vector<std::byte> bytes(count * size);
  for (size_t i = 0; i < places.size(); ++i) {
    if (places[i] == none) continue;
    std::copy_n(array.bytes.begin() + static_cast<ptrdiff_t>(i * size), size,
                bytes.begin() + static_cast<ptrdiff_t>(places[i] * size));
  }
  array.bytes = std::move(bytes);
}

std::vector<std::byte> encode_order(const ElementOrder& order) {
  RansEncoder encoder;
  ElementOrder coded = order;
  code_permutation(encoder, coded.points);
  code_permutation(encoder, coded.cells);
  code_rotations(encoder, coded.rotation);
  return encoder.finish();
}

Result<ElementOrder> decode_order(Bytes bytes, uint32_t points, uint32_t cells) {
  ElementOrder order;
  order.points.resize(points);
  order.cells.resize(cells);
  order.rotation.resize(cells);
  RansDecoder decoder(bytes);
  code_permutation(decoder, order.points);
  code_permutation(decoder, order.cells);
  code_rotations(decoder, order.rotation);
  if (decoder.exhausted() || !is_permutation(order.points) || !is_permutation(order.cells)) {
    return corrupt("not a permutation of the elements");
  }
  return order;
}

Result<Mesh> restore_order(Mesh mesh, const ElementOrder& order) {
  std::vector<uint32_t> corner_place(mesh.corner_count());
  uint32_t first_cell = 0;
  uint32_t first_corner = 0;
  for (CellBlock& block : mesh.blocks) {
    const auto cells = static_cast<uint32_t>(block.size());
    const auto corners = static_cast<uint32_t>(block.connectivity.size());
    block = MAILLE_TRY(restore_block(block, order, first_cell, first_corner, corner_place));
    first_cell += cells;
    first_corner += corners;
  }
  move_tuples(mesh.points, order.points, order.points.size());
  for (Array& array : mesh.arrays) {
    if (array.domain == Domain::point) move_tuples(array, order.points, order.points.size());
    if (array.domain == Domain::cell) move_tuples(array, order.cells, order.cells.size());
    if (array.domain == Domain::corner) move_tuples(array, corner_place, corner_place.size());
  }
  return mesh;
}

}  // namespace maille
