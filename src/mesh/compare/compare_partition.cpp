#include "mesh/compare/compare_partition.h"

#include <algorithm>

namespace maille {

// Points of one hash are one class. Equal lists of hashes are needed for a renaming, so nothing is lost by
// stopping here.
std::optional<Partition> Partition::from_hashes(const std::vector<Keyed>& a, const std::vector<Keyed>& b) {
  if (a.size() != b.size()) return std::nullopt;
  const auto same_hash = [](const Keyed& x, const Keyed& y) { return x.hash == y.hash; };
  if (!std::equal(a.begin(), a.end(), b.begin(), same_hash)) return std::nullopt;
  Partition partition;
  const std::vector<Keyed>* keyed[2] = {&a, &b};
  for (unsigned side = 0; side < 2; ++side) {
    partition.order_[side].resize(a.size());
    partition.place_[side].resize(a.size());
    partition.class_of_[side].resize(a.size());
  }
  for (uint32_t i = 0; i < a.size(); ++i) {
    if (i == 0 || a[i].hash != a[i - 1].hash) partition.classes_.push_back({i, 0, 0});
    ++partition.classes_.back().size;
    for (unsigned side = 0; side < 2; ++side) {
      const auto point = static_cast<uint32_t>((*keyed[side])[i].index);
      partition.order_[side][i] = point;
      partition.place_[side][point] = i;
      partition.class_of_[side][point] = partition.class_count() - 1;
    }
  }
  return partition;
}

/// Swaps a point with the one that stands at `end`: within a class the order means nothing.
void Partition::move_to_end(unsigned side, uint32_t point, uint32_t end) {
  auto& order = order_[side];
  auto& place = place_[side];
  const uint32_t from = place[point];
  std::swap(order[from], order[end]);
  place[order[from]] = from;
  place[order[end]] = end;
}

/// The points of a group go to the end of their class, which is then cut off there: the rest of the class
/// need not be touched, and the work is that of the points that move.
void Partition::cut(const std::vector<Entry> (&entries)[2], Group group, std::vector<uint32_t> (&moved)[2]) {
  const uint32_t parent = entries[0][group.begin].class_number;
  const auto size = static_cast<uint32_t>(group.end - group.begin);
  const uint32_t end = classes_[parent].begin + classes_[parent].size;
  for (unsigned side = 0; side < 2; ++side) {
    for (uint32_t i = 0; i < size; ++i) {
      const uint32_t point = entries[side][group.begin + i].point;
      move_to_end(side, point, end - 1 - i);
      class_of_[side][point] = class_count();
      moved[side].push_back(point);
    }
  }
  classes_[parent].size -= size;
  classes_.push_back({end - size, size, parent});
}

void Partition::cut_rest(uint32_t parent, const std::vector<Entry> (&entries)[2], Group touched,
                         std::vector<uint32_t> (&moved)[2]) {
  // The points with an entry go to the front of the class, so that the rest can be cut off at its end.
  const Class whole = classes_[parent];
  const auto size = static_cast<uint32_t>(touched.end - touched.begin);
  for (unsigned side = 0; side < 2; ++side) {
    for (uint32_t i = 0; i < size; ++i) {
      move_to_end(side, entries[side][touched.begin + i].point, whole.begin + i);
    }
    for (uint32_t i = whole.begin + size; i < whole.begin + whole.size; ++i) {
      class_of_[side][order_[side][i]] = class_count();
      moved[side].push_back(order_[side][i]);
    }
  }
  classes_[parent].size = size;
  classes_.push_back({whole.begin + size, whole.size - size, parent});
}

// Entries of both sides are sorted alike, and then compared group by group before anything is cut, so that a
// split that fails leaves no traces. Deterministic: keys, then points, decide.
bool Partition::split(std::vector<Entry> (&entries)[2], std::vector<uint32_t> (&moved)[2], Witness* witness) {
  const auto less = [](const Entry& x, const Entry& y) {
    if (x.class_number != y.class_number) return x.class_number < y.class_number;
    return x.key != y.key ? x.key < y.key : x.point < y.point;
  };
  const auto same_group = [](const Entry& x, const Entry& y) {
    return x.class_number == y.class_number && x.key == y.key;
  };
  for (auto& side : entries) std::sort(side.begin(), side.end(), less);
  const auto [at_a, at_b] =
      std::mismatch(entries[0].begin(), entries[0].end(), entries[1].begin(), entries[1].end(), same_group);
  if (at_a != entries[0].end() || at_b != entries[1].end()) {
    const bool in_b = at_a == entries[0].end() || (at_b != entries[1].end() && less(*at_b, *at_a));
    if (witness) *witness = in_b ? Witness{1, at_b->point} : Witness{0, at_a->point};
    return false;
  }
  const std::vector<Entry>& all = entries[0];
  for (size_t first = 0; first < all.size();) {
    const uint32_t parent = all[first].class_number;
    std::vector<Group> groups;
    size_t last = first;
    for (; last < all.size() && all[last].class_number == parent; ++last) {
      if (last == first || all[last].key != all[last - 1].key) groups.push_back({last, last});
      groups.back().end = last + 1;
    }
    // Points of a class without an entry form a group of their own, the rest.
    const size_t touched = last - first;
    const size_t rest = classes_[parent].size - touched;
    // The largest part keeps the number: a point changes class at most log2(points) times (Hopcroft 1971,
    // "process the smaller half"), which bounds the whole refinement by cells * log(points).
    size_t keeper = groups.size();
    size_t keeper_size = rest;
    for (size_t g = 0; g < groups.size(); ++g) {
      if (groups[g].end - groups[g].begin <= keeper_size) continue;
      keeper = g;
      keeper_size = groups[g].end - groups[g].begin;
    }
    if (keeper < groups.size() && rest > 0) cut_rest(parent, entries, {first, last}, moved);
    for (size_t g = 0; g < groups.size(); ++g) {
      if (g != keeper) cut(entries, groups[g], moved);
    }
    first = last;
  }
  return true;
}

/// In the reverse order of cuts each class stands directly behind what is left of its parent, so a size and
/// the numbers of the points are all there is to take back.
void Partition::undo(uint32_t count) {
  while (classes_.size() > count) {
    const Class last = classes_.back();
    classes_.pop_back();
    classes_[last.parent].size += last.size;
    for (unsigned side = 0; side < 2; ++side) {
      for (uint32_t i = 0; i < last.size; ++i) class_of_[side][order_[side][last.begin + i]] = last.parent;
    }
  }
}

}  // namespace maille
