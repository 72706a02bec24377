#include "volume/cells/patterns.h"

#include "base/hash.h"

namespace maille {
namespace {

/// The hash decides only where an entry stands; equality is compared in full, and ids follow the order of
/// arrival.
uint64_t hash_of(const Pattern& pattern) {
  uint64_t hash = hash_mix(pattern.kind, pattern.final);
  for (unsigned i = 0; i < most_corners; ++i)
    hash = hash_mix(hash, pattern.source[i] * 256u + pattern.corner[i]);
  for (unsigned i = 0; i < most_faces; ++i) hash = hash_mix(hash, pattern.glue[i] * 256u + pattern.other[i]);
  return hash;
}

/// Glues face f to an open face in memory that has its known corners, of which at most one may be missing;
/// that one becomes known. One missing corner is what a face is sure about: with two, their order would be
/// open.
bool glue_by_search(unsigned f, const Hull& hull, Assembly& cell) {
  const CellFace& face = cell.shape().face[f];
  std::array<uint32_t, 4> known{};
  const unsigned count = cell.known_of(face, known);
  if (count == 0 || count + 1u < face.size) return false;
  const FaceRef found = hull.find_face(face.size, known.data(), count);
  if (found.cell == no_slot) return false;
  cell.set_glue(f, found);
  if (count == face.size) return true;
  const Hull::Cell& other = hull.cell(found.cell);
  const CellFace& other_face = Hull::shape_of(other).face[found.face];
  for (unsigned i = 0; i < face.size; ++i) {
    if (cell.has(face.corner[i])) continue;
    for (unsigned j = 0; j < other_face.size; ++j) {
      const uint32_t slot = other.corner[other_face.corner[j]];
      bool taken = false;
      for (unsigned k = 0; k < count; ++k) taken = taken || known[k] == slot;
      if (!taken) cell.set_corner(face.corner[i], slot);
    }
  }
  return true;
}

}  // namespace

uint32_t Patterns::add(const Pattern& pattern, uint32_t signature) {
  size_t at = hash_of(pattern) & (table_.size() - 1);
  while (table_[at] != 0) {
    if (patterns_[table_[at]] == pattern) return table_[at];
    at = (at + 1) & (table_.size() - 1);
  }
  if (patterns_.size() > most) return 0;
  patterns_.push_back(pattern);
  plans_.emplace_back(pattern);
  signatures_.push_back(signature);
  return table_[at] = static_cast<uint32_t>(patterns_.size() - 1);
}

// Corners by search are in no list here: the faces by search make them known.
PatternPlan::PatternPlan(const Pattern& pattern) : kind(pattern.kind), final(pattern.final) {
  const CellShape& shape = cell_shapes[kind];
  for (unsigned i = 0; i < shape.corners; ++i) {
    if (pattern.source[i] == Pattern::new_point) fresh = static_cast<uint8_t>(fresh | 1u << i);
    if (pattern.source[i] >= source_count) continue;
    corner[corners++] = {static_cast<uint8_t>(i), pattern.source[i], pattern.corner[i]};
    sources = static_cast<uint8_t>(sources | 1u << pattern.source[i]);
    known = static_cast<uint8_t>(known | 1u << i);
  }
  for (unsigned f = 0; f < shape.faces; ++f) {
    if (pattern.glue[f] == 0) continue;
    if (pattern.glue[f] == Pattern::by_search) {
      searched = static_cast<uint8_t>(searched | 1u << f);
      continue;
    }
    const auto source = static_cast<uint8_t>(pattern.glue[f] - 1);
    glue[glues++] = {static_cast<uint8_t>(f), source, pattern.other[f]};
    sources = static_cast<uint8_t>(sources | 1u << source);
    glued = static_cast<uint8_t>(glued | 1u << f);
  }
  // known | fresh == 0xff: nothing is left to a search, and each corner comes from a source or is new.
  sweeps = kind == hexahedron_kind && searched == 0 && corners > 0 && (known | fresh) == 0xff;
}

bool Patterns::search(const PatternPlan& plan, const Hull& hull, Assembly& cell) {
  for (unsigned left = plan.searched; left != 0; left &= left - 1) {
    if (!glue_by_search(static_cast<unsigned>(__builtin_ctz(left)), hull, cell)) return false;
  }
  return (cell.known | cell.fresh) == (1u << cell.shape().corners) - 1;
}

bool Patterns::is_nearer(const PatternPlan& plan, const Sources& sources, const Assembly& cell) {
  for (unsigned left = plan.searched; left != 0; left &= left - 1) {
    const uint32_t found = cell.glue[static_cast<unsigned>(__builtin_ctz(left))].cell;
    for (const uint32_t source : sources.cell) {
      if (source == found) return true;
    }
  }
  return false;
}

bool Patterns::describe(const Assembly& cell, const Hull& hull, const Sources& sources, Pattern& pattern) {
  const CellShape& shape = cell.shape();
  pattern.kind = static_cast<uint8_t>(cell.kind);
  const auto source_of = [&](uint32_t slot) {
    unsigned s = 0;
    while (s < source_count && sources.cell[s] != slot) ++s;
    return s;
  };
  // The first source that has the corner, at its first place there: which one is part of the format, as equal
  // cells must have equal patterns.
  for (unsigned i = 0; i < shape.corners; ++i) {
    pattern.source[i] = cell.is_fresh(i) ? Pattern::new_point : Pattern::by_search;
    for (unsigned s = 0; s < source_count && pattern.source[i] == Pattern::by_search; ++s) {
      if (sources.cell[s] == no_slot) continue;
      const Hull::Cell& source = hull.cell(sources.cell[s]);
      for (unsigned j = 0; j < most_corners && pattern.source[i] == Pattern::by_search; ++j) {
        if (source.corner[j] != cell.corner[i]) continue;
        pattern.source[i] = static_cast<uint8_t>(s);
        pattern.corner[i] = static_cast<uint8_t>(j);
      }
    }
  }
  for (unsigned f = 0; f < shape.faces; ++f) {
    if (!cell.is_glued(f)) continue;
    const unsigned s = source_of(cell.glue[f].cell);
    pattern.glue[f] = s < source_count ? static_cast<uint8_t>(s + 1) : Pattern::by_search;
    if (s < source_count) pattern.other[f] = static_cast<uint8_t>(cell.glue[f].face);
  }
  // Fresh corners have no slots yet, so only the others are compared.
  Assembly again;
  if (!apply(PatternPlan(pattern), hull, sources, again) || again.fresh != cell.fresh) return false;
  for (unsigned i = 0; i < shape.corners; ++i) {
    if (!cell.is_fresh(i) && again.corner[i] != cell.corner[i]) return false;
  }
  return true;
}

}  // namespace maille
