#include "io/gltf/gltf_weights.h"

#include <maille/gltf.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace maille {
namespace {

/// Rounds the weights of a point down to multiples of `step`, and gives what is missing to 1 to the largest
/// fractions, a step each. Where the sum is not near 1 each goes to the nearest multiple.
void round_weights(std::vector<float>& weights, double step) {
  std::vector<std::pair<double, size_t>> fractions;
  double rest = 1;
  for (size_t i = 0; i < weights.size(); ++i) {
    const double weight = static_cast<double>(weights[i]), below = std::floor(weight / step) * step;
    fractions.emplace_back(below - weight, i);
    rest -= below;
  }
  // Not so for NaN, and for weights whose sum is no 1: these are not what this rule is for.
  const double steps = rest / step;
  if (!(steps >= 0 && steps <= static_cast<double>(weights.size()))) {
    for (float& weight : weights)
      if (std::isfinite(weight))
        weight = static_cast<float>(std::round(static_cast<double>(weight) / step) * step);
    return;
  }
  // By fraction, then by number: a total order.
  std::sort(fractions.begin(), fractions.end());
  for (size_t k = 0; k < fractions.size(); ++k) {
    const double below = std::floor(static_cast<double>(weights[fractions[k].second]) / step) * step;
    weights[fractions[k].second] = static_cast<float>(below + (static_cast<double>(k) < steps ? step : 0));
  }
}

std::vector<Array*> weights_of(Mesh& mesh) {
  std::vector<Array*> arrays;
  for (Array& array : mesh.arrays) {
    if (is_gltf_weights(array.name) && array.domain == Domain::point && array.type == Scalar::f32)
      arrays.push_back(&array);
  }
  return arrays;
}

std::vector<float> sorted(const std::vector<Array*>& arrays) {
  std::vector<float> all;
  for (const Array* array : arrays)
    all.insert(all.end(), array->values<float>().begin(), array->values<float>().end());
  // By bits, as NaN has no order.
  std::sort(all.begin(), all.end(),
            [](float a, float b) { return std::bit_cast<uint32_t>(a) < std::bit_cast<uint32_t>(b); });
  return all;
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](float x, float y) {
    return std::bit_cast<uint32_t>(x) == std::bit_cast<uint32_t>(y);
  });
}

}  // namespace

bool is_gltf_weights(const std::string& name) {
  return name == "weights" || name.starts_with("weights_");
}

void round_gltf_weights(const std::vector<Array*>& arrays, int bits) {
  if (arrays.empty()) return;
  std::vector<float> weights;
  for (uint64_t point = 0; point < arrays[0]->count(); ++point) {
    weights.clear();
    for (const Array* array : arrays) {
      const auto values = array->values<float>().subspan(point * array->components, array->components);
      weights.insert(weights.end(), values.begin(), values.end());
    }
    round_weights(weights, std::ldexp(1.0, -bits));
    const float* next = weights.data();
    for (Array* array : arrays) {
      std::copy_n(next, array->components,
                  array->values<float>().begin() + static_cast<ptrdiff_t>(point * array->components));
      next += array->components;
    }
  }
}

int round_gltf_weights_as(Mesh& original, const Mesh& decoded) {
  Mesh other = decoded;
  // Points may come in another order, so values are compared as sorted lists.
  const std::vector<Array*> arrays = weights_of(original);
  const std::vector<float> wanted = sorted(weights_of(other));
  if (same_bits(sorted(arrays), wanted)) return 0;
  // How many bits were asked for is not in the file; there are few possibilities.
  for (int bits = 1; bits <= most_gltf_weight_bits; ++bits) {
    Mesh rounded = original;
    round_gltf_weights(weights_of(rounded), bits);
    if (!same_bits(sorted(weights_of(rounded)), wanted)) continue;
    original = std::move(rounded);
    return bits;
  }
  return 0;
}

}  // namespace maille
