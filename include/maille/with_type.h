#pragma once

#include <maille/mesh.h>

#include <cstdint>

namespace maille {

/// Calls f with a value of the C++ type of `type`: with_type(array.type, [&](auto zero) { using T = ...; }).
/// All ten calls must return the same type. The value is 0 and says nothing but its type.
template <class F>
decltype(auto) with_type(Scalar type, F&& f) {
  switch (type) {
    case Scalar::i8:
      return f(int8_t{});
    case Scalar::u8:
      return f(uint8_t{});
    case Scalar::i16:
      return f(int16_t{});
    case Scalar::u16:
      return f(uint16_t{});
    case Scalar::i32:
      return f(int32_t{});
    case Scalar::u32:
      return f(uint32_t{});
    case Scalar::i64:
      return f(int64_t{});
    case Scalar::u64:
      return f(uint64_t{});
    case Scalar::f32:
      return f(float{});
    case Scalar::f64:
      break;
  }
  return f(double{});
}

}  // namespace maille
