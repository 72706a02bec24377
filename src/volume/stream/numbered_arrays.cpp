#include "volume/stream/numbered_arrays.h"

#include <algorithm>
#include <cstring>

#include "base/bytes.h"
#include "base/result.h"

namespace maille {
namespace {

/// The number modulo 2^64; of negative ones the low bytes are the same in any width.
template <class T>
uint64_t widened(const std::byte* number) {
  return static_cast<uint64_t>(load<T>(number));
}

}  // namespace

// Types of one byte and floats are left out.
uint64_t (*number_reader(Scalar type))(const std::byte*) {
  switch (type) {
    case Scalar::i16:
      return widened<int16_t>;
    case Scalar::u16:
      return widened<uint16_t>;
    case Scalar::i32:
      return widened<int32_t>;
    case Scalar::u32:
      return widened<uint32_t>;
    case Scalar::i64:
      return widened<int64_t>;
    case Scalar::u64:
      return widened<uint64_t>;
    default:
      return nullptr;
  }
}

namespace {

/// The runs of an array of `count` tuples, read some at a time. It gives up as soon as there are too many
/// runs for what was read, so that an array in no order is left after a few numbers.
template <class Read>
Result<std::optional<NumberedArray>> find_numbered(const Array& array, size_t i, uint64_t count, Read read) {
  std::optional<NumberedArray> none;
  const auto number_at = number_reader(array.type);
  // An array this short costs less than the words about it.
  if (array.components != 1 || number_at == nullptr || count < fewest_numbered) return none;
  NumberedArray found = {i, {}};
  constexpr uint64_t at_once = 4096;
  uint64_t before = 0;
  for (uint64_t first = 0; first < count; first += at_once) {
    const Bytes some = MAILLE_TRY(read(first, std::min(at_once, count - first)));
    for (size_t k = 0; k < some.size() / array.tuple_size(); ++k) {
      const uint64_t number = number_at(some.data() + k * array.tuple_size());
      if (found.runs.empty() || number != before + 1) {
        if (found.runs.size() * fewest_numbered > first + k || found.runs.size() == most_number_runs)
          return none;
        found.runs.push_back({0, number});
      }
      before = number;
      ++found.runs.back().count;
    }
  }
  return found.runs.size() * fewest_numbered > count ? none : std::optional(std::move(found));
}

}  // namespace

std::optional<NumberedArray> find_numbered(const Array& array, size_t i) {
  const size_t size = array.tuple_size();
  return *find_numbered(array, i, array.count(), [&](uint64_t first, uint64_t count) -> Result<Bytes> {
    return Bytes(array.bytes).subspan(first * size, count * size);
  });
}

// Places count the arrays on points and cells only, as the header of a stream lists them.
std::vector<NumberedArray> find_numbered(const Mesh& mesh) {
  std::vector<NumberedArray> found;
  size_t next = 0;
  for (const Array& array : mesh.arrays) {
    if (array.domain == Domain::mesh) continue;
    if (auto numbered = find_numbered(array, next)) found.push_back(std::move(*numbered));
    ++next;
  }
  return found;
}

// One reading of each array of integers, which mostly ends after its first numbers.
Result<std::vector<NumberedArray>> find_numbered(MeshSource& mesh) {
  std::vector<NumberedArray> found;
  std::vector<std::byte> bytes;
  for (size_t i = 0; i < mesh.description().arrays.size(); ++i) {
    const Array& array = mesh.description().arrays[i];
    const uint64_t count = mesh.description().count_of(array);
    const auto read = [&](uint64_t first, uint64_t some) -> Result<Bytes> {
      bytes.resize(some * array.tuple_size());
      MAILLE_CHECK(mesh.read_array(i, first, some, bytes));
      return Bytes(bytes);
    };
    auto numbered = MAILLE_TRY(find_numbered(array, i, count, read));
    if (numbered) found.push_back(std::move(*numbered));
  }
  return found;
}

RisingNumbers::RisingNumbers(const NumberedArray& array, Scalar type)
    : runs_(array.runs), size_(size_of(type)) {
  uint64_t begin = 0;
  for (const NumberedArray::Run& run : runs_) {
    begin_.push_back(begin);
    begin += run.count;
  }
}

void RisingNumbers::store(uint64_t element, std::byte* out) const {
  // The run before the first one that begins behind the element; there is one, as the first begins at 0.
  const auto run =
      static_cast<size_t>(std::upper_bound(begin_.begin(), begin_.end(), element) - begin_.begin()) - 1;
  const uint64_t number = runs_[run].first + (element - begin_[run]);
  // Little-endian: the low bytes are the number in the narrower type.
  std::memcpy(out, &number, size_);
}

void RisingNumbers::store_all(uint64_t first, std::span<std::byte> bytes) const {
  for (size_t i = 0; i < bytes.size() / size_; ++i) store(first + i, bytes.data() + i * size_);
}

}  // namespace maille
