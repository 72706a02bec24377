#include "surface/front/connectivity_models.h"

#include <algorithm>

namespace maille {

std::array<int32_t, 16> ConnectivityModels::initial_weights() {
  std::array<int32_t, 16> weights{};
  // A quarter each to begin with, although there are ten contexts: the mixer learns from there. Chosen, not
  // swept.
  for (unsigned i = 0; i < contexts; ++i) weights[i] = 65536 / 4;
  return weights;
}

ConnectivityModels::ConnectivityModels() : mixer_(nodes, 16 * 4, nodes, initial_weights()) {
  for (auto& table : tables_) table.resize(size_t{1} << table_bits);
}

/// Hashes of the contexts. On irregular meshes the sums of valences count, as valences balance each other (on
/// closed surfaces of triangles their mean is about 6); on machine parts the exact patterns do. One vertex
/// that is finished on a side makes the one behind it a neighbour, too. The list is part of the format
/// (14.3).
void ConnectivityModels::look(const FrontView& view) {
  const auto& [q, p, r, s, w] = view;
  const auto real = [](const FrontView::Node& node) {
    return node.valence == FrontView::dummy ? 0 : node.valence;
  };
  const auto is_dummy = [](const FrontView::Node& node) {
    return static_cast<uint32_t>(node.valence == FrontView::dummy);
  };
  const bool p_full = p.free == 0;
  const bool r_full = r.free == 0;
  const int32_t sum = real(p) + real(r) + (p_full ? real(q) : 0) + (r_full ? real(s) : 0);
  const int32_t others = real(w) + (p_full ? 0 : real(q)) + (r_full ? 0 : real(s));
  const uint32_t fullness = p_full + 2u * r_full;
  const uint32_t dummies = is_dummy(p) + 2 * is_dummy(r) + 4 * is_dummy(w) + 8 * is_dummy(q);
  uint32_t kind = 0;
  const auto put = [&](auto... values) {
    uint32_t hash = hashed(kind + 1, 0x51ed270bu);
    ((hash = hashed(hash, static_cast<uint32_t>(values))), ...);
    hashes_[kind] = hash;
    groups_[kind] = &tables_[kind][hash >> (32 - table_bits)];
    // The ten tables are larger than the first caches together.
    __builtin_prefetch(groups_[kind]);
    ++kind;
  };
  put(sum, fullness, dummies);
  put(p.valence, r.valence, p.free);
  put(sum, others);
  put(w.valence, r.valence, p.valence);
  put(earlier_[0], earlier_[1], p.valence);
  put(q.valence, q.free, p.free, r.valence);
  put(real(p) + real(r) + real(w) + real(q), fullness);
  put(sum, p.free + r.free + q.free + s.free);
  put(s.valence, s.free, r.free, p.valence);
  put(p.free, r.free, q.free, s.free);
  free_class_ = std::min(p.free, 3u) * 4 + std::min(r.free, 3u);
}

}  // namespace maille
