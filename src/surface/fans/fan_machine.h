#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "surface/fans/fan_connectivity.h"
#include "surface/fans/fan_patterns.h"

namespace maille {

/// What an entry of the ring has seen saturates here, as it has 4 bits; markers have seen nothing.
inline constexpr uint32_t most_seen = 15;

/// The context of a symbol is what the head of the ring has seen, and classes of what the next and the last
/// entry have, and in rings of four and more those beyond these two (else class 0): 0 or 1, 2, 3, more. How
/// many triangles an entry has seen says how many its vertex still lacks. With the two entries beyond, static
/// tables are as small as adaptive models were: ogre 7,185 to 4,549 bytes, turbineblade 27,701 to 27,425, for
/// 0.7 ns a triangle of decoding (ad9f141).
inline constexpr unsigned fan_contexts = (most_seen + 1) << 8;
[[gnu::always_inline]] constexpr unsigned seen_class(unsigned seen) {
  // Two bits for each number from 0 to 15; a table would be a load more on the way to the symbol.
  return 0xffffff90u >> (2 * seen) & 3;
}
/// The map of contexts to tables takes heads that have seen ten triangles and more for one. No sweep is
/// recorded; such heads are rare.
inline constexpr unsigned mapped_heads = 10;
inline constexpr unsigned mapped_contexts = mapped_heads << 8;
inline constexpr unsigned mapped_context(unsigned context) {
  return (std::clamp(context >> 8, 1u, mapped_heads) - 1) << 8 | (context & 255);
}

/// The same in meshes of polygons: faces that were seen, 0, 1, 2 or more of them, and whether a polygon has
/// been begun at the gate to the head.
inline constexpr unsigned most_open = 2;
inline constexpr unsigned most_head_of_polygons = 7;
inline constexpr unsigned polygon_rows = (most_open + 1) * (most_head_of_polygons + 1);
/// Where the next two entries have seen two faces each, the third one counts as well: behind all others.
inline constexpr unsigned third_contexts = polygon_rows << 8;
inline constexpr unsigned polygon_contexts = third_contexts + (polygon_rows << 6);
[[gnu::always_inline]] constexpr unsigned seen_class_of_polygons(unsigned seen) {
  return 0xffffffe4u >> (2 * seen) & 3;
}
inline constexpr unsigned most_fan_contexts = std::max(fan_contexts, polygon_contexts);

/// Numbers beside the symbols.
enum class FanNumber : unsigned { start, side, split_head, split_tail, ring, place, reference, taken, count };

// Tables of 2^9 slots are as good as larger ones within a thousandth, and take less of the cache (b7a9e3f).
inline constexpr unsigned fan_slot_bits = 9;
// At most so many tables were enough to equal adaptive models (ad9f141); table_at has to stay below 2^16
// bytes.
inline constexpr unsigned most_event_tables = 32;
inline constexpr auto number_contexts = static_cast<unsigned>(FanNumber::count);
// A number below 12 is its own symbol; then come symbols for the number of bits, from 4 on, with the bits
// below the highest raw. So 8 to 11 have two codes, of which writers take the direct one.
inline constexpr unsigned direct_numbers = 12;
inline constexpr unsigned number_symbols = direct_numbers + 29;

/// Kind of the j-th of i new vertices (from 1) at a focus that has then seen `seen` triangles.
constexpr unsigned fan_kind(bool closed, unsigned i, unsigned j, unsigned seen) {
  unsigned place = first_open_place + std::min(j, 3u) - 1;
  if (closed) {
    // 0 | 1 2 | 3 4 5 | 6 7 8 9 for i = 1 to 3 and more.
    place = i < 4 ? i * (i - 1) / 2 + j - 1 : j == i ? 9 : 5 + std::min(j, 3u);
  }
  return (place * valence_classes + std::clamp(seen, 4u, 9u) - 4) * 2;
}

/// The ring and what symbols do to it. There is one code for both directions: a decoder's `Coder` gives the
/// numbers, an encoder's finds them by looking at the machine, and is told how the gates of its mesh move.
/// docs/format.md, 12.2.
///
/// Entries [head, tail) are the ring, cyclic. An entry and the next one make a gate to triangles that are not
/// coded, unless one of them is a marker (vertex none, seen 0): then a border lies there. Rings that wait are
/// other ranges of the same array, on a stack.
///
/// Safe with any symbols and numbers: each function checks what it reads of the ring before it changes
/// anything that memory depends on, and returns false for what cannot be.
template <class Coder>
class FanMachine {
 public:
  /// `polygons`: so many faces, else of none but triangles.
  FanMachine(Coder& coder, FanSurface& out, uint32_t triangles, uint32_t most_vertices,
             std::optional<uint32_t> polygons = std::nullopt)
      : coder_(coder),
        out_(out),
        triangles_(triangles),
        most_vertices_(most_vertices),
        most_faces_(polygons.value_or(0)),
        polygons_(polygons.has_value()) {
    // Damaged bytes could split and merge one long ring again and again, which is quadratic work for few
    // triangles. Splits of an encoder copy the shorter side where they can, merges happen once for each
    // handle, so an encoder stays far below; it also looks at moves_left(), and codes a vertex as known
    // instead.
    moves_left_ = 8 * uint64_t{triangles} + 4096;
    entries.resize(1024);
  }

  struct Ring {
    uint32_t begin;
    uint32_t end;
  };
  // What an encoder looks at.
  // These change with every symbol; make_room() may move all of them.
  uint32_t head = 0, tail = 0;
  /// The vertex (32 bits); above it the vertex beyond the gate to the next entry (28), above that how many
  /// triangles the entry has seen (4).
  Unfilled<uint64_t> entries;
  std::vector<Ring> waiting;
  uint32_t vertices = 0;
  uint32_t triangle_count = 0;
  uint32_t vertex(uint32_t e) const { return static_cast<uint32_t>(entries[e]); }
  uint32_t opposite(uint32_t e) const {
    return static_cast<uint32_t>(entries[e] >> 32) & (most_fan_points - 1);
  }
  uint32_t seen(uint32_t e) const { return static_cast<uint32_t>(entries[e] >> (32 + fan_point_bits)); }
  uint64_t moves_left() const { return moves_left_; }
  uint32_t vertices_left() const { return most_vertices_ - vertices; }
  uint32_t triangles_left() const { return triangles_ - triangle_count; }

  /// Triangles of a polygon that has been begun at the gate to the head: most_open are two and more.
  /// (Two and more are one class: how many diagonals a polygon has had says little beyond that.)
  unsigned open() const { return open_; }

  bool done() const { return triangle_count == triangles_; }
  /// Once done: is it what was announced?
  bool complete() const { return open_ == 0 && vertices == most_vertices_ && face_count_ == most_faces_; }

  /// Makes the head and the last entry vertices, and goes on with a ring that waits where this one ended.
  /// False: there is no ring. Nothing happens inside of a polygon, whose next triangle lies at the head. Both
  /// sides do this before they look at the context.
  bool prepare() {
    if (open_ > 0) return true;
    for (;;) {
      const uint32_t size = tail - head;
      if (size <= 1 || (size == 2 && vertex(head) != none && vertex(head + 1) != none)) {
        if (waiting.empty()) return false;
        head = waiting.back().begin;
        tail = waiting.back().end;
        waiting.pop_back();
        continue;
      }
      const bool open = vertex(tail - 1) == none;
      if (vertex(head) == none) {
        if (!open) push_copy(head);
        ++head;
      } else if (open) {
        if (vertex(head + 1) != none) push_copy(head);
        ++head;
      } else {
        return true;
      }
    }
  }

  /// The first triangle of a component. False: triangles are all there, or a vertex is not.
  bool start() {
    if (done()) return false;
    head = tail = 0;
    make_room(3);
    const uint32_t known = coder_.number(FanNumber::start, 0);
    std::array<uint32_t, 3> v;
    for (unsigned k = 0; k < 3; ++k) {
      if ((known >> k & 1) != 0) {
        if (!take_known(v[k])) return false;
      } else {
        // Nothing predicts these vertices but the one before, so all eight references are that.
        const uint32_t near = k > 0 ? v[k - 1] : vertices > 0 ? vertices - 1 : 0;
        if (vertices == most_vertices_) return false;
        v[k] = vertices;
        VertexReferences references;
        references.at.fill(near);
        add_vertex(references, start_place * valence_classes * 2);
      }
    }
    if (!begin_face(v[0], v[1], v[2])) return false;
    add_corner(v[2]);
    if ((known >> 3 & 1) != 0 && polygons_) {
      before_ = v[1];
      open_ = 1;
    } else {
      end_face();
    }
    for (unsigned k = 0; k < 3; ++k) push(v[k], v[(k + 2) % 3], 1);
    if constexpr (Coder::encoding) coder_.gates_of_start(tail - 3);
    return true;
  }

  /// Room for `more` entries behind the ring. May move all rings, so places must be kept relative to them.
  /// Entries that neither the ring nor one that waits has are dead. They are dropped only if half of the
  /// array is free afterwards: that half must be filled before the next time, so packing moves no more
  /// entries than were written in between.
  void make_room(uint64_t more) {
    const uint64_t capacity = entries.size();
    if (tail + more <= capacity) return;
    uint64_t live = tail - head;
    for (const Ring& ring : waiting) live += ring.end - ring.begin;
    if (2 * (live + more) <= capacity) {
      pack();
    } else {
      entries.resize(std::max(2 * capacity, tail + more));
    }
  }

  unsigned context() const {
    const unsigned near = seen(head) << 8 | seen_class(seen(head + 1)) << 6 | seen_class(seen(tail - 1)) << 4;
    return tail - head < 4 ? near : near | seen_class(seen(head + 2)) << 2 | seen_class(seen(tail - 2));
  }
  unsigned polygon_context() const {
    const auto of = [&](uint32_t e) { return seen_class_of_polygons(seen(e)); };
    const unsigned row = open_ * (most_head_of_polygons + 1) + std::min(seen(head), most_head_of_polygons);
    const unsigned next = of(head + 1), last = of(tail - 1);
    if (tail - head < 5) return (row << 4 | next << 2 | last) << 4;
    const unsigned beyond = of(head + 2), before = of(tail - 2);
    // Two entries in a row that have seen two faces are the common case in regular meshes of quads; there the
    // third one still tells something.
    if (next == 2 && beyond == 2)
      return third_contexts + ((row << 4 | last << 2 | before) << 2 | of(head + 3));
    return (row << 4 | next << 2 | last) << 4 | beyond << 2 | before;
  }

  /// For moves of entries beyond those of a symbol. False: more than any encoder needs.
  bool spend(uint64_t moves) {
    if (moves > moves_left_) return false;
    moves_left_ -= moves;
    return true;
  }

  /// The number of a vertex that is known, as a zigzag difference to the last one taken: such vertices come
  /// in rows along seams. The arithmetic wraps, so any number is a vertex or is refused. False: it is not
  /// known.
  bool take_known(uint32_t& v) {
    const auto delta = coder_.number(FanNumber::reference, 0, last_reference_);
    // Zigzag, around the last vertex taken.
    v = last_reference_ + ((delta >> 1) ^ (0 - (delta & 1)));
    if (v >= vertices) return false;
    last_reference_ = v;
    return true;
  }

  /// Does what the symbol says; false when it cannot be (a decoder then refuses the bytes).
  bool apply(const FanPattern& pattern) {
    switch (pattern.end) {
      case FanEnd::close:
        return close(pattern);
      case FanEnd::pocket:
        return pocket(pattern);
      case FanEnd::swallow:
        return swallow(pattern);
      case FanEnd::border:
        return border(pattern);
      case FanEnd::split:
        return split(pattern);
      case FanEnd::known:
        return known(pattern);
      case FanEnd::merge:
        return merge(pattern);
      case FanEnd::open:
        return open_fan(pattern);
      case FanEnd::none:
        break;
    }
    return false;
  }

 private:
  static uint64_t entry_of(uint32_t v, uint32_t across, uint32_t triangles) {
    return v | uint64_t{across} << 32 | uint64_t{triangles} << (32 + fan_point_bits);
  }
  void set_opposite(uint32_t e, uint32_t across) { entries[e] = entry_of(vertex(e), across, seen(e)); }
  void see(uint32_t e, unsigned triangles) {
    entries[e] = entry_of(vertex(e), opposite(e), std::min(seen(e) + triangles, most_seen));
  }
  void move_entry(uint32_t to, uint32_t from) {
    entries[to] = entries[from];
    if constexpr (Coder::encoding) coder_.moved(to, from);
  }
  void push(uint32_t v, uint32_t across, uint32_t triangles) {
    make_room(1);
    entries[tail] = entry_of(v, across, triangles);
    if constexpr (Coder::encoding) coder_.no_gate(tail);
    ++tail;
  }
  void push_copy(uint32_t from) {
    // Making room may move the ring.
    const uint32_t place = from - head;
    make_room(1);
    move_entry(tail, head + place);
    ++tail;
  }
  /// Moves the rings to the front of the array.
  void pack() {
    uint32_t end = 0;
    const auto move_ring = [&](uint32_t& ring_begin, uint32_t& ring_end) {
      const uint32_t begin = end;
      for (uint32_t e = ring_begin; e < ring_end; ++e) move_entry(end++, e);
      ring_begin = begin;
      ring_end = end;
    };
    for (Ring& ring : waiting) move_ring(ring.begin, ring.end);
    move_ring(head, tail);
  }
  void add_vertex(const VertexReferences& references, unsigned kind) {
    if (!polygons_) {
      out_.references[vertices - out_.first] = references;
      out_.kinds[vertices - out_.first] = static_cast<uint8_t>(kind);
    }
    ++vertices;
  }

  /// False: there are more faces than announced.
  bool begin_face(uint32_t a, uint32_t b, uint32_t across) {
    if (!polygons_) {
      uint32_t* corner = out_.corners.data() + size_t{3} * triangle_count;
      corner[0] = a;
      corner[1] = b;
      return true;
    }
    if (face_count_ == most_faces_) return false;
    out_.corners.push_back(a);
    out_.corners.push_back(b);
    out_.across.push_back(across);
    return true;
  }
  void add_corner(uint32_t c) {
    if (polygons_) {
      out_.corners.push_back(c);
    } else {
      out_.corners[size_t{3} * triangle_count + 2] = c;
    }
    ++triangle_count;
  }
  void end_face() {
    open_ = 0;
    if (!polygons_) return;
    out_.offsets.push_back(static_cast<uint32_t>(out_.corners.size()));
    ++face_count_;
  }

  bool has_room(unsigned new_vertices, uint32_t triangles) const {
    return new_vertices <= most_vertices_ - vertices && triangles <= triangles_ - triangle_count;
  }

  /// The triangle on the head, the last entry and w; `real`: the edge from the head to w is one of the mesh.
  bool add_triangle(uint32_t w, bool real) {
    if (open_ == 0) {
      if (!begin_face(vertex(head), vertex(tail - 1), opposite(tail - 1))) return false;
      see(tail - 1, 1);
    }
    before_ = vertex(tail - 1);
    add_corner(w);
    if (real) {
      end_face();
      see(head, 1);
    } else {
      open_ = std::min(open_ + 1, most_open);
    }
    return true;
  }
  /// The same, k-th of a symbol from 1, where the edge from the last entry to w is a gate from then on.
  bool add_behind_last(uint32_t w, bool real, unsigned k) {
    const uint32_t across = open_ > 0 ? before_ : vertex(head);
    if (!add_triangle(w, real)) return false;
    set_opposite(tail - 1, across);
    if constexpr (Coder::encoding) coder_.gate_along(tail - 1, k);
    return true;
  }

  /// The new vertices of a symbol, with a triangle each. `closing` says how many triangles will follow at the
  /// focus, towards n, with n_opposite beyond it: kinds and references of all new vertices know this already.
  bool fan(const FanPattern& pattern, unsigned closing, uint32_t n, uint32_t n_opposite) {
    const unsigned i = pattern.added;
    make_room(i + 2);
    const uint32_t focus = vertex(head);
    const unsigned seen_then = std::min<unsigned>(seen(head) + i + closing, most_seen);
    for (unsigned j = 1; j <= i; ++j) {
      const uint32_t v = vertices, last = vertex(tail - 1);
      VertexReferences references;
      references.at = {focus, n, n_opposite, focus, focus, focus, opposite(tail - 1), last};
      add_vertex(references, fan_kind(closing > 0, i, j, seen_then));
      if (!add_behind_last(v, pattern.real(j - 1), j)) return false;
      push(v, last, 1);
    }
    return true;
  }
  /// The newest vertex learns of the triangle that closes its fan now: that triangle was not known when it
  /// came up. Of older vertices the position may be decoded already (the decoder works hand in hand), so they
  /// cannot learn it.
  void note_late(uint32_t n, uint32_t n_opposite) {
    const uint32_t v = vertex(tail - 1);
    if (polygons_ || v + 1 != vertices || n_opposite == v) return;
    VertexReferences& references = out_.references[v - out_.first];
    references.at[VertexReferences::late] = vertex(head);
    references.at[VertexReferences::late + 1] = n;
    references.at[VertexReferences::late + 2] = n_opposite;
    out_.kinds[v - out_.first] |= 1;
  }

  bool close(const FanPattern& pattern) {
    const unsigned i = pattern.added;
    const uint32_t n = vertex(head + 1);
    if (n == none || !has_room(i, i + 1)) return false;
    const uint32_t n_opposite = opposite(head);
    if (i == 0) note_late(n, n_opposite);
    if (!fan(pattern, 1, n, n_opposite) || !add_behind_last(n, true, i + 1)) return false;
    ++head;
    see(head, 1);
    return true;
  }

  bool pocket(const FanPattern& pattern) {
    const unsigned i = pattern.added;
    uint32_t taken = pattern.taken;
    if (taken == 0) taken = coder_.number(FanNumber::taken, 0);
    const uint32_t size = tail - head;
    if (taken == 0 || taken + 1 >= size || taken + 3 > size + i || !has_room(i, i + 1) ||
        taken > triangles_ - triangle_count - i - 1) {
      return false;
    }
    for (uint32_t k = 1; k <= taken + 1; ++k) {
      if (vertex(head + k) == none) return false;
    }
    const uint32_t m = vertex(head + taken + 1), n = vertex(head + taken);
    const bool real = pattern.real(i);
    if (i == 0) note_late(m, n);
    if (!fan(pattern, 2, m, n) || !add_behind_last(m, real, i + 1)) return false;
    if (real && (taken != 1 || !begin_face(vertex(head), m, vertex(tail - 1)))) return false;
    for (uint32_t k = taken; k > 0; --k) add_corner(vertex(head + k));
    end_face();
    head += taken + 1;
    see(head, real ? 2 : 1);
    return true;
  }

  /// The ring shrinks at its tail: the triangle lies on the head and the two last entries.
  bool swallow(const FanPattern& pattern) {
    if (tail - head < 3 || vertex(tail - 2) == none || !has_room(0, 1)) return false;
    const uint32_t last = vertex(tail - 1);
    if (!add_triangle(vertex(tail - 2), pattern.real(0))) return false;
    --tail;
    set_opposite(tail - 1, last);
    see(tail - 1, 1);
    if constexpr (Coder::encoding) coder_.gate_back(tail - 1, 1);
    return true;
  }

  bool open_fan(const FanPattern& pattern) {
    const unsigned i = pattern.added;
    if (!has_room(i, i) || !fan(pattern, 0, vertex(head), vertex(head))) return false;
    if constexpr (Coder::encoding) coder_.gate_back(tail - 1, i);
    return true;
  }

  bool border(const FanPattern& pattern) {
    const unsigned i = pattern.added;
    if (!has_room(i, i) || !fan(pattern, 0, vertex(head), vertex(head)) || open_ > 0) return false;
    if constexpr (Coder::encoding) coder_.no_gate(tail - 1);
    if (vertex(head + 1) != none) {
      make_room(2);
      push(none, 0, 0);
      push_copy(head);
    }
    ++head;
    return true;
  }

  /// A vertex that no ring leads to joins the ring as a new one would, without a new number.
  bool known(const FanPattern& pattern) {
    if (!has_room(0, 1)) return false;
    uint32_t v;
    if (!take_known(v)) return false;
    make_room(1);
    const uint32_t last = vertex(tail - 1);
    if (!add_behind_last(v, pattern.real(0), 1)) return false;
    push(v, last, 1);
    if constexpr (Coder::encoding) coder_.gate_back(tail - 1, 1);
    return true;
  }

  /// The fan reaches another vertex of the ring, so that two rings are left: one goes on, the other one
  /// waits.
  bool split(const FanPattern& pattern) {
    const unsigned i = pattern.added;
    if (!has_room(i, i + 1) || !fan(pattern, 0, vertex(head), vertex(head))) return false;
    // The places beside the head and the last entry are not meant: at least four entries.
    if (tail - head < 4) return false;
    const uint32_t most = tail - head - 4;
    const bool at_tail = coder_.number(FanNumber::side, 0) != 0;
    const uint32_t offset = coder_.number(at_tail ? FanNumber::split_tail : FanNumber::split_head, 0);
    if (offset > most) return false;
    const uint32_t place = at_tail ? tail - 2 - offset : head + 2 + offset;
    // A polygon that goes on does so at the head.
    const bool tail_goes_on = at_tail && pattern.real(i);
    if (vertex(place) == none || !spend((tail_goes_on ? offset : place - head - 2) + 3)) return false;
    return tail_goes_on ? split_at_tail(pattern, place - head) : split_at_head(pattern, place - head);
  }
  /// The entries from the head to m go on, as a copy behind the others, which wait where they are.
  bool split_at_head(const FanPattern& pattern, uint32_t distance) {
    const unsigned i = pattern.added;
    make_room(distance + 1);
    const uint32_t place = head + distance;
    const uint32_t last = vertex(tail - 1);
    if (!add_behind_last(vertex(place), pattern.real(i), i + 1)) return false;
    see(place, 1);
    for (uint32_t k = 0; k <= distance; ++k) move_entry(tail + k, head + k);
    // Both have an entry for m; the gate beyond it is in the ring that waits.
    if constexpr (Coder::encoding) coder_.moved(place, tail + distance);
    set_opposite(tail + distance, last);
    if constexpr (Coder::encoding) coder_.gate_back(tail + distance, i + 1);
    waiting.push_back({place, tail});
    head = tail;
    tail += distance + 1;
    return true;
  }
  /// The vertices from m to the last go on, moved by one place; those from the head to m wait.
  bool split_at_tail(const FanPattern& pattern, uint32_t distance) {
    const unsigned i = pattern.added;
    make_room(1);
    const uint32_t place = head + distance;
    const uint32_t last = vertex(tail - 1);
    if (!add_behind_last(vertex(place), pattern.real(i), i + 1)) return false;
    see(place, 1);
    for (uint32_t k = tail; k > place; --k) move_entry(k, k - 1);
    ++tail;
    set_opposite(place, last);
    if constexpr (Coder::encoding) coder_.gate_back(place, i + 1);
    waiting.push_back({head, place + 1});
    head = place + 1;
    return true;
  }

  /// The fan reaches a ring that waits: both are one ring from then on. A surface has one merge for each
  /// handle.
  bool merge(const FanPattern& pattern) {
    if (!has_room(0, 1)) return false;
    const uint32_t from_top = coder_.number(FanNumber::ring, 0);
    if (from_top >= waiting.size()) return false;
    const size_t which = waiting.size() - 1 - from_top;
    const uint32_t offset = coder_.number(FanNumber::place, 0);
    const uint32_t size = waiting[which].end - waiting[which].begin;
    if (offset >= size || !spend(uint64_t{size} + from_top + 1)) return false;
    make_room(uint64_t{size} + 1);
    const Ring ring = waiting[which];
    if (vertex(ring.begin + offset) == none) return false;
    const uint32_t m = ring.begin + offset;
    const uint32_t last = vertex(tail - 1);
    if (!add_behind_last(vertex(m), pattern.real(0), 1)) return false;
    see(m, 1);
    const uint32_t copy = tail;
    for (uint32_t k = m; k < ring.end; ++k) move_entry(tail++, k);
    for (uint32_t k = ring.begin; k < m; ++k) move_entry(tail++, k);
    entries[tail] = entries[copy];
    set_opposite(tail, last);
    ++tail;
    if constexpr (Coder::encoding) coder_.gate_back(tail - 1, 1);
    waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(which));
    return true;
  }

  Coder& coder_;
  FanSurface& out_;
  uint32_t triangles_;
  uint32_t most_vertices_;
  uint32_t most_faces_;
  bool polygons_;
  uint32_t face_count_ = 0;
  unsigned open_ = 0;
  uint32_t before_ = 0;  ///< in an open polygon: the corner before the last entry
  uint32_t last_reference_ = 0;
  uint64_t moves_left_ = 0;
};

}  // namespace maille
