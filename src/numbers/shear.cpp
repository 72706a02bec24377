#include "numbers/shear.h"

#include <algorithm>
#include <cstdlib>

namespace maille {

Shear::Shear(std::span<const uint8_t> order, const std::array<std::array<int32_t, 4>, 4>& weights)
    : components_(static_cast<unsigned>(order.size())), weights_(weights) {
  std::copy(order.begin(), order.end(), order_.begin());
}

int64_t Shear::growth() const {
  int64_t most = 0;
  for (unsigned i = 0; i < components_; ++i) {
    int64_t sum = 0;
    for (unsigned j = 0; j < i; ++j) sum += std::abs(weights_[i][j]);
    most = std::max(most, sum);
  }
  return 1 + (most + unit - 1) / unit;
}

void Shear::write(ByteWriter& out) const {
  for (unsigned i = 0; i < components_; ++i) out.put(order_[i]);
  for (unsigned i = 1; i < components_; ++i) {
    for (unsigned j = 0; j < i; ++j) out.put_zigzag(weights_[i][j]);
  }
}

Result<Shear> Shear::read(ByteReader& in, unsigned components) {
  Shear shear;
  shear.components_ = components;
  unsigned seen = 0;
  for (unsigned i = 0; i < components; ++i) {
    shear.order_[i] = in.get<uint8_t>();
    seen |= shear.order_[i] < components ? 1u << shear.order_[i] : 0;
  }
  bool small = true;
  for (unsigned i = 1; i < components; ++i) {
    for (unsigned j = 0; j < i; ++j) {
      const int64_t weight = in.get_zigzag();
      small = small && weight >= -most_weight && weight <= most_weight;
      shear.weights_[i][j] = static_cast<int32_t>(weight);
    }
  }
  // All components were seen once, so the order is a permutation.
  if (!in.ok() || !small || seen + 1 != 1u << components)
    return failure(ErrorCode::corrupt, "numbers: a damaged shear");
  return shear;
}

}  // namespace maille
