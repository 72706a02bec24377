#pragma once

#include <memory>
#include <utility>
#include <vector>

namespace maille {

/// A vector whose resize() leaves new numbers as they are in memory, for those that are written before they
/// are read: large arrays are not touched twice. Numbers are constructed by default, which does nothing for
/// them, instead of by value, which would fill them with zeros.
template <class T>
struct UnfilledAllocator : std::allocator<T> {
  template <class U>
  struct rebind {
    using other = UnfilledAllocator<U>;
  };
  using std::allocator<T>::allocator;
  template <class U>
  void construct(U* at) {
    ::new (static_cast<void*>(at)) U;
  }
  template <class U, class... Arguments>
  void construct(U* at, Arguments&&... arguments) {
    ::new (static_cast<void*>(at)) U(std::forward<Arguments>(arguments)...);
  }
};
template <class T>
using Unfilled = std::vector<T, UnfilledAllocator<T>>;

}  // namespace maille
