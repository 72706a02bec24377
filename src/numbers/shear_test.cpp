#include "numbers/shear.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <vector>

namespace maille {
namespace {

rc::Gen<Shear> any_shear(unsigned components) {
  return rc::gen::exec([components] {
    std::vector<uint8_t> order(components);
    std::iota(order.begin(), order.end(), uint8_t{0});
    for (unsigned i = components; i-- > 1;) std::swap(order[i], order[*rc::gen::inRange(0u, i + 1)]);
    std::array<std::array<int32_t, 4>, 4> weights{};
    for (unsigned i = 1; i < components; ++i) {
      for (unsigned j = 0; j < i; ++j)
        weights[i][j] = *rc::gen::inRange<int32_t>(-Shear::most_weight, Shear::most_weight + 1);
    }
    return Shear(order, weights);
  });
}

RC_GTEST_PROP(Shear, BringsBackAllCodes, ()) {
  const unsigned components = *rc::gen::inRange(2u, 5u);
  const Shear shear = *any_shear(components);
  const auto codes = *rc::gen::container<std::vector<int64_t>>(components, rc::gen::arbitrary<int64_t>());
  auto changed = codes;
  shear.apply(changed.data());
  shear.undo(changed.data());
  RC_ASSERT(changed == codes);
}

RC_GTEST_PROP(Shear, BringsBackCodesOf32BitsFromTheirLowerHalves, ()) {
  const unsigned components = *rc::gen::inRange(2u, 5u);
  const Shear shear = *any_shear(components);
  const auto codes = *rc::gen::container<std::vector<int32_t>>(components, rc::gen::arbitrary<int32_t>());
  std::vector<int64_t> wide(codes.begin(), codes.end());
  shear.apply(wide.data());
  std::vector<int32_t> cut;
  for (const int64_t code : wide) cut.push_back(static_cast<int32_t>(code));
  shear.undo(cut.data());
  RC_ASSERT(cut == codes);
}

RC_GTEST_PROP(Shear, IsReadAsItWasWritten, ()) {
  const unsigned components = *rc::gen::inRange(2u, 5u);
  const Shear shear = *any_shear(components);
  ByteWriter out;
  shear.write(out);
  const std::vector<std::byte> bytes = out.take();
  ByteReader in(bytes);
  const auto read = Shear::read(in, components);
  RC_ASSERT(read.has_value());
  RC_ASSERT(in.remaining() == 0u);
  std::vector<int64_t> a = {1000, -70, 12345, 9}, b = a;
  shear.apply(a.data());
  read->apply(b.data());
  RC_ASSERT(a == b);
}

TEST(Shear, OfAnOrderThatNamesAComponentTwiceIsRefused) {
  for (const std::vector<uint8_t>& order : {std::vector<uint8_t>{0, 0, 1}, {0, 1, 3}, {2, 2, 2}}) {
    ByteWriter out;
    for (const uint8_t component : order) out.put(component);
    for (int i = 0; i < 3; ++i) out.put_zigzag(1);
    const std::vector<std::byte> bytes = out.take();
    ByteReader in(bytes);
    EXPECT_FALSE(Shear::read(in, 3));
  }
}

TEST(Shear, OfTooLargeWeightsIsRefused) {
  ByteWriter out;
  out.put(uint8_t{0});
  out.put(uint8_t{1});
  out.put_zigzag(Shear::most_weight + 1);
  const std::vector<std::byte> bytes = out.take();
  ByteReader in(bytes);
  EXPECT_FALSE(Shear::read(in, 2));
}

}  // namespace
}  // namespace maille
