#include "io/buffered_writer.h"

#include "base/bytes.h"

namespace maille {

void put_scalar(BufferedWriter& out, const std::byte* from, Scalar type) {
  with_type(type, [&](auto zero) {
    using T = decltype(zero);
    if constexpr (sizeof(T) == 1) {
      out.put_number(static_cast<int>(load<T>(from)));  // char types would print as characters
    } else {
      out.put_number(load<T>(from));
    }
  });
}

void put_scalars(BufferedWriter& out, const std::byte* from, Scalar type, uint32_t count) {
  for (uint32_t i = 0; i < count; ++i) {
    if (i != 0) out.put(' ');
    put_scalar(out, from + i * size_of(type), type);
  }
}

}  // namespace maille
