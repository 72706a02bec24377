#include "numbers/table_finder.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <limits>
#include <set>
#include <vector>

#include "numbers/number_map.h"

namespace maille {
namespace {

NumberMap map_of(const std::vector<double>& numbers) {
  NumberMap map;
  map.kind = NumberMap::Kind::ordered;
  map.table = numbers;
  return map;
}

RC_GTEST_PROP(TableFinder, FindsWhatTheMapFinds, ()) {
  const auto found = *rc::gen::nonEmpty(rc::gen::arbitrary<std::set<int>>());
  const double unit = *rc::gen::element(1.0, 1e-300, 1e290, 0.1);
  std::vector<double> numbers;
  for (const int number : found) numbers.push_back(unit * number);
  const NumberMap map = map_of(numbers);
  const TableFinder finder(map.table);
  const auto check = [&](double value) {
    RC_ASSERT(finder.nearest(value) == map.nearest_code(Scalar::f64, value));
  };
  for (size_t i = 0; i < numbers.size(); ++i) {
    check(numbers[i]);
    if (i > 0) check(numbers[i - 1] + (numbers[i] - numbers[i - 1]) / 2);
  }
  check(unit * *rc::gen::arbitrary<int>());
}

TEST(TableFinder, TakesAnyValueAndAnyTable) {
  constexpr double largest = std::numeric_limits<double>::max(),
                   least = std::numeric_limits<double>::denorm_min();
  for (const std::vector<double>& numbers : {std::vector<double>{0},
                                             {-0.0, 0},
                                             {-largest, largest},
                                             {-largest, 0, least, 2 * least, largest},
                                             {0, least},
                                             {5, 5}}) {
    const NumberMap map = map_of(numbers);
    const TableFinder finder(map.table);
    for (const double value :
         {0.0, -0.0, 1.0, -1.0, least, -least, largest, -largest, std::numeric_limits<double>::infinity(),
          -std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
      EXPECT_EQ(finder.nearest(value), map.nearest_code(Scalar::f64, value)) << value;
  }
}

}  // namespace
}  // namespace maille
