#pragma once

#include <maille/mesh.h>
#include <limits>
#include "base/bytes.h"
#include "io/numbers.h"

namespace maille {

/// Numbers read from a text that does not tell their type: floats, unless one of them says more than a float
/// can. Then append() is false, and the reader starts again with `wide` set: text files are all of one kind,
/// so this happens within the first lines.
class NumberColumn {
 public:
  explicit NumberColumn(uint32_t components = 3, bool wide = false) : components_(components), wide_(wide) {}

  /// Appends one tuple. False when it needs doubles.
  bool append(const Number* numbers) {
    const size_t size = wide_ ? sizeof(double) : sizeof(float);
    const size_t at = bytes_.size();
    bytes_.resize(at + size * components_);
    std::byte* to = bytes_.data() + at;
    bool fits = true;
    for (uint32_t i = 0; i < components_; ++i, to += size) {
      if (wide_) {
        store(to, numbers[i].value);
      } else {
        store(to, numbers[i].single);
        fits &= numbers[i].fits_single;
      }
    }
    return fits;
  }
  /// Makes it `tuples` long; what is new is NaN, which stands for "none here".
  void pad(uint64_t tuples) {
    const Number nan{std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<float>::quiet_NaN(), true,
                     false};
    const std::vector<Number> tuple(components_, nan);
    while (count() < tuples) append(tuple.data());
  }

  void clear() { bytes_.clear(); }
  uint64_t count() const { return bytes_.size() / tuple_size(); }
  uint32_t components() const { return components_; }
  size_t tuple_size() const { return components_ * (wide_ ? sizeof(double) : sizeof(float)); }
  Scalar type() const { return wide_ ? Scalar::f64 : Scalar::f32; }
  const std::vector<std::byte>& bytes() const { return bytes_; }

  Array take(std::string name, Domain domain, Role role) {
    Array array = make_array(std::move(name), domain, type(), components_, role);
    array.bytes = std::move(bytes_);
    return array;
  }

 private:
  uint32_t components_;
  bool wide_;
  std::vector<std::byte> bytes_;
};

}  // namespace maille
