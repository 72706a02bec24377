#include "description/element_order.h"

#include <algorithm>
#include <array>
#include <utility>

#include "base/result.h"
#include "entropy/integer_model.h"
#include "entropy/rans.h"
#include "mesh/none.h"

namespace maille {
namespace {

tl::unexpected<Error> corrupt(const char* what) {
  return failure(ErrorCode::corrupt, std::string("order: ") + what);
}

/// Steps from one element's number to the next one's, in the context of the size of the step before: files
/// keep neighbours together, if in another order than ours. A step of 1 more is coded as 0. All arithmetic is
/// modulo 2^32, so decoder and encoder agree for any numbers.
class StepModel {
 public:
  template <class Coder>
  uint32_t code(Coder& coder, uint32_t number) {
    const auto step = static_cast<int32_t>(number - before_ - 1);
    const uint32_t zigzag = static_cast<uint32_t>(step) << 1 ^ static_cast<uint32_t>(step >> 31);
    const uint32_t coded = models_[context_].code(coder, zigzag);
    context_ = std::min(bit_length(coded), 15u);
    return before_ += 1 + (coded >> 1 ^ (0 - (coded & 1)));
  }

 private:
  std::array<CountModel, 16> models_;
  unsigned context_ = 0;
  uint32_t before_ = none_before;
  // So that element 0 first is a step of 1, too.
  static constexpr uint32_t none_before = 0xffffffff;
};

/// Which corner came first, in the context of the cell before; 3 stands for all larger ones.
class RotationModel {
 public:
  template <class Coder>
  uint32_t code(Coder& coder, uint32_t rotation) {
    return before_ = models_[std::min(before_, 3u)].code(coder, rotation);
  }

 private:
  std::array<CountModel, 4> models_;
  uint32_t before_ = 0;
};

/// A RansEncoder whose bytes can be taken meanwhile: its blocks do not know of each other, so they are what
/// one encoder would write.
class BlockwiseEncoder {
 public:
  static constexpr bool encoding = true;

  bool code(bool bit, uint32_t probability) {
    block_.code(bit, probability);
    count();
    return bit;
  }
  uint32_t code_raw(uint32_t value, unsigned bits) {
    block_.code_raw(value, bits);
    count();
    return value;
  }
  void put(uint32_t start, uint32_t frequency, unsigned bits, unsigned lane) {
    block_.put(start, frequency, bits, lane);
    count();
  }
  std::vector<std::byte> take() { return std::exchange(bytes_, {}); }
  std::vector<std::byte> finish() {
    end_block();
    return take();
  }

 private:
  void count() {
    if (++operations_ == operations_per_block) end_block();
  }
  void end_block() {
    const std::vector<std::byte> block = std::exchange(block_, RansEncoder()).finish();
    bytes_.insert(bytes_.end(), block.begin(), block.end());
    operations_ = 0;
  }

  RansEncoder block_;
  std::vector<std::byte> bytes_;
  uint32_t operations_ = 0;
};

/// Decodes as many numbers as there is room for. False: the stream is too short.
template <class Model>
bool decode_numbers(RansDecoder& decoder, std::vector<uint32_t>& numbers) {
  Model model;
  for (uint32_t& number : numbers) {
    number = model.code(decoder, 0);
    if (decoder.exhausted()) return false;
  }
  return true;
}

bool is_permutation(std::span<const uint32_t> numbers) {
  std::vector<bool> used(numbers.size());
  for (const uint32_t number : numbers) {
    if (number >= numbers.size() || used[number]) return false;
    used[number] = true;
  }
  return true;
}

/// Puts the cells of one block in order; `corner_place` gets the new place of each of its corners. `order` is
/// a permutation of all cells, but may take some out of their block, which is refused here.
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
      // The first corner was at place `rotation`, so place k has the corner k - rotation, around.
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

/// Models are kept over all calls, so that adding one by one gives the same bytes.
struct OrderEncoder::State {
  template <class Model>
  void add(Model& model, std::span<const uint32_t> numbers) {
    for (const uint32_t number : numbers) model.code(coder, number);
  }
  BlockwiseEncoder coder;
  StepModel points, cells;
  RotationModel rotations;
};

OrderEncoder::OrderEncoder() : state_(std::make_unique<State>()) {}
OrderEncoder::~OrderEncoder() = default;
void OrderEncoder::add_points(std::span<const uint32_t> numbers) {
  state_->add(state_->points, numbers);
}
void OrderEncoder::add_cells(std::span<const uint32_t> numbers) {
  state_->add(state_->cells, numbers);
}
void OrderEncoder::add_rotations(std::span<const uint32_t> rotations) {
  state_->add(state_->rotations, rotations);
}
std::vector<std::byte> OrderEncoder::take() {
  return state_->coder.take();
}
std::vector<std::byte> OrderEncoder::finish() {
  return state_->coder.finish();
}

std::vector<std::byte> encode_order(const ElementOrder& order) {
  OrderEncoder encoder;
  encoder.add_points(order.points);
  encoder.add_cells(order.cells);
  encoder.add_rotations(order.rotation);
  return encoder.finish();
}

Result<ElementOrder> decode_order(Bytes bytes, uint32_t points, uint32_t cells) {
  ElementOrder order;
  order.points.resize(points);
  order.cells.resize(cells);
  order.rotation.resize(cells);
  RansDecoder decoder(bytes);
  const bool whole = decode_numbers<StepModel>(decoder, order.points) &&
                     decode_numbers<StepModel>(decoder, order.cells) &&
                     decode_numbers<RotationModel>(decoder, order.rotation);
  if (!whole || !is_permutation(order.points) || !is_permutation(order.cells)) {
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
