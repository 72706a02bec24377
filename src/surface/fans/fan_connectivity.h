#pragma once

#include <maille/error.h>
#include <maille/source.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/pages.h"
#include "surface/half_edges.h"

namespace maille {

/// Connectivity of triangles for decoding near memory speed: a ring of vertices grows around the coded
/// triangles, and one symbol tells how the fan around the vertex at its head is completed.
/// docs/format.md, 12.2.

/// Vertices whose positions predict that of another one, by number in coded order. All are below it but in
/// rare cases (vertex 0, a vertex that is on a ring twice); what is not decoded yet counts as 0. See
/// positions.h.
///
///           A ---- vertex          closed fans end at N; O2 is beyond the edge from focus to N.
///          / \    /  |             The late triple is a parallelogram that became known
///         B   focus  |             after the vertex: late[0] + late[1] - late[2].
///              | \   |
///              |   \ |
///              O2 --- N
struct VertexReferences {
  enum : unsigned { focus, next, next_opposite, late, before = 6, last = 7, count = 8 };
  std::array<uint32_t, count> at;
};

/// A kind is a byte: place * 12 + 2 * valence class + [there is a late triple]. The place says where in its
/// fan a vertex stands, the class is that of the focus' valence. 0 to 9 are places of closed fans, by the
/// number of new vertices; 10 to 12 those of open ones; 13 that of vertices that nothing predicts.
inline constexpr unsigned fan_places = 21;
inline constexpr unsigned first_open_place = 10;
inline constexpr unsigned start_place = 13;
// In meshes of polygons, by the face in which a vertex comes up: see find_polygon_references(). All have a
// gate focus + last - before; late triples are straight lines that go on, last + last - x.
inline constexpr unsigned quad_place = 14;          ///< the corner behind is known
inline constexpr unsigned quad_last_place = 15;     ///< the last of its four corners
inline constexpr unsigned straight_place = 16;      ///< nothing but the straight line
inline constexpr unsigned pentagon_place = 17;      ///< all other corners are known
inline constexpr unsigned hexagon_place = 18;       ///< likewise
inline constexpr unsigned pentagon_row_place = 19;  ///< three corners before it are known
inline constexpr unsigned row_place = 20;           ///< the same in faces of six and more
inline constexpr unsigned first_polygon_place = quad_place;
inline constexpr unsigned valence_classes = 6;
inline constexpr unsigned vertex_kinds = fan_places * valence_classes * 2;
inline constexpr unsigned place_of_kind(unsigned kind) {
  return kind / (2 * valence_classes);
}
inline constexpr bool kind_has_late(unsigned kind) {
  return (kind & 1) != 0;
}
/// Is it the last vertex of a closed fan, so that the next triangle is known on both sides?
inline constexpr bool kind_is_last(unsigned kind) {
  const unsigned place = place_of_kind(kind);
  return place == 0 || place == 2 || place == 5 || place == 9;
}

/// Faces in coded order. Vertices are numbered by their first corners: vertex v comes up for the first time
/// behind vertex v - 1. This is all that positions and most arrays need of the connectivity. Half-edges
/// (build_surface() in fan_patch.h) are made only for what walks over them: normals, twins, and the arrays of
/// corners of an encoder.
struct FanSurface {
  std::vector<uint32_t> corners;
  /// Where the corners of each face begin, and where they end; empty: three for each triangle.
  std::vector<uint32_t> offsets;
  /// With offsets, by face: the corner beside its second one in the face across its first edge.
  std::vector<uint32_t> across;
  uint32_t vertices = 0;
  /// The first vertex that has references and a kind here: a decoder lets go of those that are done with.
  uint32_t first = 0;
  Scratch<VertexReferences> references;  ///< by vertex, from `first` on
  Scratch<uint8_t> kinds;                ///< likewise
  std::vector<uint8_t> valences;         ///< by vertex: its faces modulo 256, twice that on borders

  uint32_t faces() const {
    return static_cast<uint32_t>(offsets.empty() ? corners.size() / 3 : offsets.size() - 1);
  }
  /// Of which faces are made: a face of d corners takes d - 2.
  uint32_t triangles() const { return static_cast<uint32_t>(corners.size()) - 2 * faces(); }
  uint32_t first_corner(uint32_t face) const { return offsets.empty() ? 3 * face : offsets[face]; }
  std::span<const uint32_t> face(uint32_t i) const {
    return std::span(corners).subspan(first_corner(i), first_corner(i + 1) - first_corner(i));
  }
  /// Fills `valences`, by the faces that are there. Duplicates of faces do not count: they are appended
  /// afterwards.
  void count_valences();
  /// Fills references and kinds of a mesh of polygons, from corners and `across` alone: the same on both
  /// sides.
  void find_polygon_references();
  /// Gives back the memory of references, kinds and valences, once positions are there.
  void forget_vertices();
};

/// What an encoder writes: an event with its context, or a number of some kind.
struct FanOperation {
  static constexpr uint32_t is_number = 1u << 31;
  uint32_t context;  ///< is_number + kind for numbers
  uint32_t value;    ///< a symbol, or the number
};

/// What encode_fans() gives: the surface as the decoder will have it, where it comes from, and either bytes
/// or, with FanModels::shared, operations.
struct EncodedFans {
  FanSurface surface;
  std::vector<uint32_t> points;      ///< by vertex: its number in `origin` of what was encoded
  std::vector<uint32_t> half_edges;  ///< by face: the half-edge at its first corner
  std::vector<std::byte> bytes;
  std::vector<FanOperation> operations;  ///< instead of bytes, where the tables are shared
};

/// Points have at most so many bits: an entry of the ring is 64 bits, of which 32 are a vertex and 4 what it
/// has seen.
inline constexpr unsigned fan_point_bits = 28;
inline constexpr uint32_t most_fan_points = 1u << fan_point_bits;

/// Shared tables stand elsewhere, made for many patches: see fan_tables.h.
enum class FanModels : uint8_t { fixed, shared };
class FanSlots;

/// Codes the real faces of a closed surface (gluing.h): the first `real_half_edges` half-edges belong to
/// them. Origins are points, at most most_fan_points; several vertices of the surface may be one point. No
/// errors: every such surface can be coded. Takes the surface, as its half-edges are the largest thing in
/// memory.
EncodedFans encode_fans(HalfEdges surface, uint32_t real_half_edges, uint32_t point_count,
                        FanModels models = FanModels::fixed);

/// Memory that decoders of many small patches use one after the other.
struct FanBuffers {
  Unfilled<uint64_t> entries;
  Scratch<VertexReferences> references;
  Scratch<uint8_t> kinds;
};

/// Inverse of encode_fans(), in pieces, so that what is known about a vertex is still in the cache when its
/// position is decoded. Safe on any bytes: work is bounded by the size of the bytes and by the number of
/// triangles, memory grows with what was decoded.
///
/// Either `state_` decodes triangles piece by piece, or `complete_` knows everything; one of them is there.
class FanDecoder {
 public:
  /// `triangles` triangles over at most `most_vertices` vertices; `bytes` must stay. There is room for up to
  /// as many `more` of them behind the triangles.
  static Result<FanDecoder> begin(Bytes bytes, uint32_t triangles, uint32_t most_vertices, uint64_t more = 0);
  /// One that knows everything.
  static FanDecoder over(FanSurface surface);
  /// From operations alone, as write_fans() gives them. `slots` must stay, and so must `buffers` if given:
  /// their memory is borrowed and given back by the destructor.
  static Result<FanDecoder> begin(Bytes operations, const FanSlots& slots, uint32_t triangles,
                                  uint32_t vertices, uint64_t more, FanBuffers* buffers);
  FanDecoder(FanDecoder&&) noexcept;
  FanDecoder& operator=(FanDecoder&&) noexcept;
  ~FanDecoder();

  /// Before anything is decoded: decodes all of it, and keeps what is known about each vertex, with valences.
  Result<> decode_all();
  /// Vertices of all triangles: as claimed, until finish() has seen them.
  uint32_t vertices() const;
  /// Vertices that may be waiting: decode_until() must not be asked for more beyond the last release().
  static constexpr uint32_t window = 1 << 10;
  /// Vertices that it may know beyond those asked for. Whoever keeps something by vertex has room for so many
  /// more.
  static constexpr uint32_t most_ahead = 1 << 10;
  /// Decodes until everything about the vertices below `end` is known; `end` is at most vertices(). Error:
  /// corrupt, as of all functions here.
  Result<> decode_until(uint32_t end);
  /// Of one that knows everything; else none.
  std::span<const uint8_t> known_valences() const {
    return complete_ ? complete_->valences : std::span<const uint8_t>();
  }
  const FanSurface& complete() const { return *complete_; }
  /// Of a vertex that is known and not released; those after it follow in memory.
  const VertexReferences* references(uint32_t vertex) const;
  const uint8_t* kinds(uint32_t vertex) const;
  /// Forgets the vertices below `end`, so that memory stays bounded by the window.
  void release(uint32_t end);

  /// Decodes the rest, and gives the triangles, without references and kinds.
  Result<FanSurface> finish();

 private:
  struct State;
  explicit FanDecoder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
  std::unique_ptr<FanSurface> complete_;  ///< instead
  uint32_t kept_ = none;                  ///< of which the references from here on are kept; none: all are
};

/// All at once, with references, kinds and valences.
Result<FanSurface> decode_fans(Bytes bytes, uint32_t triangles, uint32_t most_vertices);
/// The same for so many polygons of so many corners in all.
Result<FanSurface> decode_polygon_fans(Bytes bytes, uint32_t polygons, uint32_t corners,
                                       uint32_t most_vertices);

}  // namespace maille
