#pragma once

#include <maille.h>

#include <maille/mesh.h>
#include <memory>
#include <span>
#include <string>
#include <vector>

struct maille_mesh {
  maille::Mesh mesh;
  std::vector<std::string> notes;
  std::vector<uint32_t> cell_numbers, point_numbers;
};

namespace maille::c {

Result<std::unique_ptr<maille_mesh>> handle(Result<Mesh> mesh);

/// The i-th of a list, NULL behind its end.
template <class List>
auto at(const List& list, uint64_t i) -> decltype(list.data()) {
  return i < list.size() ? list.data() + i : nullptr;
}
/// A list as C takes it.
template <class List>
auto listed(const List& list, uint64_t* count) -> decltype(list.data()) {
  if (count) *count = list.size();
  return list.empty() ? nullptr : list.data();
}
/// What a function gives that has no list to show.
template <class T>
const T* none(uint64_t* count) {
  if (count) *count = 0;
  return nullptr;
}

}  // namespace maille::c
