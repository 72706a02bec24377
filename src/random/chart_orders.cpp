#include "random/chart_orders.h"

#include "base/result.h"

namespace maille {

Result<ChartOrders> ChartOrders::create(const std::string& folder) {
  return ChartOrders(MAILLE_TRY(ScratchFile::create(folder)));
}

// Numbers of points, numbers of cells and rotations of a chart stand one behind the other; encode() wants
// each kind for all charts in turn, so each list is read when it is its turn, and no more than one is held.
Result<> ChartOrders::add(const ElementOrder& order) {
  places_.push_back(
      {file_.size(), static_cast<uint32_t>(order.points.size()), static_cast<uint32_t>(order.cells.size())});
  for (const auto* numbers : {&order.points, &order.cells, &order.rotation})
    MAILLE_CHECK(file_.append(std::as_bytes(std::span(*numbers))));
  return {};
}

Result<std::vector<uint32_t>> ChartOrders::read(uint64_t offset, uint32_t count) {
  std::vector<uint32_t> numbers(count);
  MAILLE_CHECK(file_.read_at(offset, std::as_writable_bytes(std::span(numbers))));
  return numbers;
}

Result<> ChartOrders::encode(std::span<const uint32_t> charts, uint64_t points, ScratchFile& out) {
  OrderEncoder encoder;
  std::vector<bool> seen(points);
  for (const uint32_t chart : charts) {
    std::vector<uint32_t> numbers = MAILLE_TRY(read(places_[chart].offset, places_[chart].points));
    // A point that several charts have is told once, by the first of them, as the joined mesh has it
    // (join_charts()).
    std::erase_if(numbers, [&](uint32_t point) { return seen[point]; });
    for (const uint32_t point : numbers) seen[point] = true;
    encoder.add_points(numbers);
    MAILLE_CHECK(out.append(encoder.take()));
  }
  // Lists of cells begin behind the points, 4 bytes a number; rotations are one list of cells further on.
  const auto cells_of = [&](uint32_t chart, uint64_t lists_before) {
    const Place& place = places_[chart];
    return read(place.offset + 4 * (place.points + lists_before * place.cells), place.cells);
  };
  for (const uint32_t chart : charts) {
    encoder.add_cells(MAILLE_TRY(cells_of(chart, 0)));
    MAILLE_CHECK(out.append(encoder.take()));
  }
  for (const uint32_t chart : charts) {
    encoder.add_rotations(MAILLE_TRY(cells_of(chart, 1)));
    MAILLE_CHECK(out.append(encoder.take()));
  }
  return out.append(encoder.finish());
}

}  // namespace maille
