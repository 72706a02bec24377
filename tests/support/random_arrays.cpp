#include "support/random_arrays.h"

#include <maille/with_type.h>

#include <cmath>
#include <limits>
#include <string>
#include <type_traits>

#include "support/sine.h"

namespace maille::testing {

namespace {

// Quiet and signalling NaNs with payloads, infinities, -0, smallest and largest denormals, largest finite
// numbers. They are bits and never numbers: i386 returns floats in registers of the 387, which make
// signalling NaNs quiet.
uint32_t special_bits(float, Random& random) {
  static constexpr uint32_t bits[] = {0x7fc00000, 0xffc00001, 0x7f800001, 0xff812345, 0x7fffffff,
                                      0x7f800000, 0xff800000, 0x80000000, 0x00000000, 0x00000001,
                                      0x807fffff, 0x00800000, 0x7f7fffff, 0xff7fffff};
  return bits[random.below(std::size(bits))];
}

uint64_t special_bits(double, Random& random) {
  static constexpr uint64_t bits[] = {
      0x7ff8000000000000, 0xfff8000000000001, 0x7ff0000000000001, 0xfff0000012345678, 0x7fffffffffffffff,
      0x7ff0000000000000, 0xfff0000000000000, 0x8000000000000000, 0x0000000000000000, 0x0000000000000001,
      0x800fffffffffffff, 0x0010000000000000, 0x7fefffffffffffff, 0xffefffffffffffff};
  return bits[random.below(std::size(bits))];
}

template <class T>
void store_special(std::byte* to, T zero, Random& random) {
  if constexpr (std::is_floating_point_v<T>) {
    const auto bits = special_bits(zero, random);
    std::memcpy(to, &bits, sizeof bits);
  } else {
    using Limit = std::numeric_limits<T>;
    const T choices[] = {
        Limit::lowest(), Limit::max(), T{0}, T{1}, static_cast<T>(-1), static_cast<T>(Limit::max() / 2 + 1)};
    const T value = choices[random.below(std::size(choices))];
    std::memcpy(to, &value, sizeof value);
  }
}

/// For every tuple of the array, a number of the element it belongs to that neighbours share: the point for
/// corners.
std::vector<uint32_t> keys_of(const Mesh& mesh, const Array& array) {
  std::vector<uint32_t> keys;
  if (array.domain == Domain::corner) {
    for (const CellBlock& block : mesh.blocks)
      keys.insert(keys.end(), block.connectivity.begin(), block.connectivity.end());
  } else {
    for (uint64_t i = 0; i < array.count(); ++i) keys.push_back(static_cast<uint32_t>(i));
  }
  return keys;
}

template <class T>
T from_double(double value) {
  if constexpr (std::is_floating_point_v<T>) {
    return static_cast<T>(value);
  } else {
    return static_cast<T>(static_cast<int64_t>(value) & 0x7f);
  }
}

enum class Filling { smooth, ramp, palette, constant, seams, random_bits, unit_vectors };

template <class T>
void fill(Array& array, const Mesh& mesh, Random& random, Filling filling) {
  const auto values = array.values<T>();
  const std::vector<uint32_t> keys = keys_of(mesh, array);
  const uint32_t colours = random.between(1, 5);
  const unsigned seam = filling == Filling::seams ? random.between(1, 25) : 0;
  for (size_t i = 0; i < values.size(); ++i) {
    const uint32_t key = keys.empty() ? 0 : keys[i / array.components];
    const auto component = static_cast<uint32_t>(i % array.components);
    switch (filling) {
      case Filling::ramp:
        values[i] = static_cast<T>(key);
        break;
      case Filling::palette:
        values[i] = static_cast<T>(random.below(colours) * 17);
        break;
      case Filling::constant:
        values[i] = T{5};
        break;
      case Filling::random_bits: {
        const uint64_t bits = random.next();
        std::memcpy(&array.bytes[i * sizeof(T)], &bits, sizeof(T));
        break;
      }
      default: {
        const double jump = seam != 0 && random.chance(seam) ? 30 : 0;
        values[i] = from_double<T>(50 + jump + 40 * sine(0.1 * key + component));
      }
    }
  }
}

void fill_unit_vectors(Array& array, Random& random) {
  const auto values = array.values<float>();
  for (size_t i = 0; i + 2 < values.size(); i += 3) {
    const double z = 2 * random.unit() - 1, u = 6.28 * random.unit(), r = std::sqrt(1 - z * z);
    values[i] = static_cast<float>(r * cosine(u));
    values[i + 1] = static_cast<float>(r * sine(u));
    values[i + 2] = static_cast<float>(z);
  }
}

/// Labels in use or not, repeated, empty, not ASCII.
void make_labels(Array& array, Random& random) {
  static const char* const words[] = {"hull", "", "wheel.001", "räder", "a b", "hull", "\"quoted\"", "v"};
  const uint32_t count = random.between(1, 8);
  for (uint32_t i = 0; i < count; ++i) array.labels.push_back(words[random.chance(80) ? i : random.below(8)]);
  with_type(array.type, [&](auto zero) {
    using T = decltype(zero);
    for (T& value : array.values<T>()) value = static_cast<T>(random.below(count));
  });
}

/// Draws before it calls: the order in which arguments are evaluated differs between compilers.
Array described_array(Random& random) {
  const auto domain = static_cast<Domain>(random.below(domain_count));
  const auto type = static_cast<Scalar>(random.below(scalar_count));
  const uint32_t several = random.between(2, 9);
  const uint32_t kind = random.below(8);
  const bool usual = random.chance(80);
  switch (kind) {
    case 0:
      return make_array("normal", usual ? Domain::corner : Domain::point, Scalar::f32, 3, Role::normal);
    case 1:
      return make_array("colour", domain, usual ? Scalar::u8 : Scalar::f32, several % 2 + 3, Role::colour);
    case 2:
      return make_array("uv", usual ? Domain::corner : Domain::point, Scalar::f32, 2,
                        Role::texture_coordinate);
    case 3:
      return make_array("material", usual ? Domain::cell : domain, several < 5 ? Scalar::u8 : Scalar::u32, 1,
                        Role::label);
    default:
      return make_array("field", domain, type, kind < 7 ? 1 : several);
  }
}

}  // namespace

void sprinkle_special_values(Array& array, Random& random, unsigned percent) {
  with_type(array.type, [&](auto zero) {
    for (size_t at = 0; at < array.bytes.size(); at += sizeof zero) {
      if (random.chance(percent)) store_special(&array.bytes[at], zero, random);
    }
  });
}

void add_random_arrays(Mesh& mesh, Random& random, bool special_values) {
  for (uint32_t i = random.chance(10) ? random.between(5, 8) : random.below(4); i > 0; --i) {
    Array array = described_array(random);
    while (mesh.find(array.name, array.domain) ||
           (array.name == "position" && array.domain == Domain::point)) {
      array.name += "'";
    }
    array.resize(array.domain == Domain::mesh ? random.below(6) : mesh.count_of(array.domain));
    if (array.role == Role::label) {
      make_labels(array, random);
    } else if (array.role == Role::normal && random.chance(70)) {
      fill_unit_vectors(array, random);
    } else {
      const auto filling = static_cast<Filling>(random.below(6));
      with_type(array.type, [&](auto zero) { fill<decltype(zero)>(array, mesh, random, filling); });
    }
    if (special_values && array.role != Role::label && random.chance(20)) {
      sprinkle_special_values(array, random, random.chance(50) ? 3 : 40);
    }
    mesh.arrays.push_back(std::move(array));
  }
}

}  // namespace maille::testing
