#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace maille {

/// What ends a fan. See FanMachine, and docs/format.md, 12.2.
enum class FanEnd : uint8_t {
  close,    ///< the last triangle is on the next vertex of the ring
  pocket,   ///< on a vertex beyond the next one; the ones between leave the ring as well
  swallow,  ///< a triangle with the two vertices before the head; the nearer one leaves the ring
  border,   ///< the edge is a border
  split,    ///< a vertex elsewhere on the ring
  known,    ///< a known vertex that is on no ring, like a new one
  merge,    ///< a vertex of a ring that waits
  open,     ///< the fan goes on
  none      ///< never coded
};

/// A symbol: so many new vertices around the head of the ring, then an end.
struct FanPattern {
  FanEnd end = FanEnd::none;
  uint8_t added = 0;
  /// Vertices that a pocket takes out of the ring beside the head; 0: a number tells.
  uint8_t taken = 1;
  /// By triangle, from the lowest bit: is its edge from the head to the third corner one of the mesh? Else it
  /// is a diagonal, and the polygon goes on.
  uint32_t spokes = 0xffffffff;

  bool real(unsigned triangle) const { return (spokes >> triangle & 1) != 0; }
};

/// Symbols of meshes of triangles; i is the number of new vertices.
enum FanSymbol : unsigned {
  fan_close = 0,     ///< 0 to 3: i = 0 to 3
  fan_pocket = 4,    ///< 4 to 7: i = 0 to 3
  fan_close_4 = 8,   ///< 8 to 15: i = 4 to 11
  fan_swallow = 16,  ///< i = 0
  fan_border = 17,   ///< i = 0 to 3
  fan_split = 21,    ///< i = 0 to 5
  fan_known = 27,
  fan_merge = 28,
  fan_open = 29,    ///< i = 1
  fan_open_4 = 30,  ///< i = 4
  fan_marker = 31,  ///< never coded: the head is no vertex
  fan_symbols = 32
};
// The first eight symbols are nine of ten, and are what the loop without branches does: bits 0 and 1 are the
// new vertices, bit 2 tells close from pocket.
inline constexpr unsigned fast_fan_symbols = 8;
inline constexpr unsigned most_closed = 11;
inline constexpr unsigned most_border = 3;

inline constexpr auto triangle_patterns = [] {
  std::array<FanPattern, fan_symbols> patterns{};
  const auto fill = [&](unsigned first, unsigned count, FanEnd end, unsigned added) {
    for (unsigned k = 0; k < count; ++k) patterns[first + k] = {end, static_cast<uint8_t>(added + k)};
  };
  fill(fan_close, 4, FanEnd::close, 0);
  fill(fan_pocket, 4, FanEnd::pocket, 0);
  fill(fan_close_4, 8, FanEnd::close, 4);
  fill(fan_swallow, 1, FanEnd::swallow, 0);
  fill(fan_border, 4, FanEnd::border, 0);
  fill(fan_split, 6, FanEnd::split, 0);
  fill(fan_known, 1, FanEnd::known, 0);
  fill(fan_merge, 1, FanEnd::merge, 0);
  fill(fan_open, 1, FanEnd::open, 1);
  fill(fan_open_4, 1, FanEnd::open, 4);
  return patterns;
}();

/// Symbols of meshes of polygons.
inline constexpr unsigned polygon_symbols = 64;
/// Pockets that take more vertices have a symbol with a number.
inline constexpr unsigned most_listed_taken = 3;
inline constexpr auto polygon_patterns = [] {
  std::array<FanPattern, polygon_symbols> patterns{};
  unsigned count = 0;
  const auto add = [&](FanEnd end, unsigned added, unsigned taken, uint32_t spokes) {
    patterns[count++] = {end, static_cast<uint8_t>(added), static_cast<uint8_t>(taken), spokes};
  };
  // What everything can be spelled with: no new vertices and an end, or new ones and no end.
  add(FanEnd::close, 0, 1, 0);
  for (const unsigned spoke : {0u, 1u}) {
    for (const FanEnd end : {FanEnd::pocket, FanEnd::swallow, FanEnd::split, FanEnd::merge, FanEnd::known})
      add(end, 0, 1, spoke);
    add(FanEnd::open, 1, 1, spoke);
  }
  for (const unsigned taken : {0u, 2u, 3u}) add(FanEnd::pocket, 0, taken, 0);
  add(FanEnd::border, 0, 1, 0);
  add(FanEnd::open, 4, 1, 0);
  // The others that occur most.
  struct Listed {
    FanEnd end;
    uint8_t added, taken, spokes;
  };
  // These occur most in the meshes of build/data/poly, counted (bdc9dee). A pattern that is missing is
  // spelled with two symbols or more, so another set is only larger, never wrong; it is part of the format
  // (12.2).
  constexpr Listed listed[] = {
      {FanEnd::close, 1, 1, 0},  {FanEnd::close, 1, 1, 1},  {FanEnd::close, 2, 1, 0},
      {FanEnd::close, 2, 1, 1},  {FanEnd::close, 2, 1, 2},  {FanEnd::close, 2, 1, 3},
      {FanEnd::close, 3, 1, 0},  {FanEnd::close, 3, 1, 2},  {FanEnd::close, 3, 1, 3},
      {FanEnd::close, 3, 1, 5},  {FanEnd::close, 3, 1, 6},  {FanEnd::close, 3, 1, 7},
      {FanEnd::close, 4, 1, 0},  {FanEnd::close, 4, 1, 5},  {FanEnd::close, 4, 1, 6},
      {FanEnd::close, 4, 1, 10}, {FanEnd::close, 4, 1, 15}, {FanEnd::close, 5, 1, 10},
      {FanEnd::close, 6, 1, 21}, {FanEnd::close, 7, 1, 42}, {FanEnd::close, 8, 1, 85},
      {FanEnd::pocket, 1, 1, 0}, {FanEnd::pocket, 1, 1, 1}, {FanEnd::pocket, 1, 1, 2},
      {FanEnd::pocket, 1, 1, 3}, {FanEnd::pocket, 2, 1, 0}, {FanEnd::pocket, 2, 1, 2},
      {FanEnd::pocket, 2, 1, 3}, {FanEnd::pocket, 2, 1, 7}, {FanEnd::pocket, 3, 1, 0},
      {FanEnd::pocket, 3, 1, 5}, {FanEnd::pocket, 3, 1, 6}, {FanEnd::pocket, 3, 1, 10},
      {FanEnd::pocket, 1, 2, 0}, {FanEnd::pocket, 2, 2, 0}, {FanEnd::pocket, 1, 3, 0},
      {FanEnd::border, 1, 1, 1}, {FanEnd::border, 2, 1, 2}, {FanEnd::border, 2, 1, 3},
      {FanEnd::border, 3, 1, 5}, {FanEnd::split, 1, 1, 0},  {FanEnd::split, 1, 1, 1},
      {FanEnd::split, 1, 1, 2},  {FanEnd::split, 1, 1, 3},  {FanEnd::split, 2, 1, 2},
  };
  for (const Listed& one : listed) add(one.end, one.added, one.taken, one.spokes);
  return patterns;
}();

constexpr std::span<const FanPattern> patterns_of(bool polygons) {
  return polygons ? std::span<const FanPattern>(polygon_patterns)
                  : std::span<const FanPattern>(triangle_patterns);
}

}  // namespace maille
