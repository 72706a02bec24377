#include "rate.h"

#include <cstdlib>

#include "code/residual_model.h"
#include "entropy/rans.h"

namespace maille::bench {

double bits_per_vertex(const std::vector<Point>& residuals) {
  if (residuals.empty()) return 0;
  RansEncoder coder(3);
  ResidualModel<32> model;
  for (const Point& residual : residuals) {
    for (unsigned k = 0; k < 3; ++k) {
      const unsigned length = bit_length(static_cast<uint64_t>(std::abs(residual[k])));
      model.code_length(coder, length, k, {}, k);
      model.code_value(coder, residual[k], length, k, k);
    }
  }
  return 8.0 * static_cast<double>(coder.finish().size()) / static_cast<double>(residuals.size());
}

}  // namespace maille::bench
