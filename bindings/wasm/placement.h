#pragma once

#include <maille/geometry.h>
#include <maille/mesh.h>

#include <memory>
#include <optional>
#include <span>

namespace maille::wasm {

/// Positions of what is drawn, three numbers for each vertex, which is at the tuple tuples[i] of `positions`;
/// no list: at tuple i. Returns what they are relative to: without an origin it is the first vertex.
Vector3 place(const Array& positions, std::span<const uint32_t> tuples, const std::optional<Vector3>& origin,
              std::span<float> to);

/// What is drawn of a mesh of triangles, side by side, so that JavaScript copies all of it at once. The
/// memory stays for the next chart.
class PackedChart {
 public:
  /// `mesh`: is_plain().
  void pack(const Mesh& mesh, const std::optional<Vector3>& origin);
  void release();

  Vector3 origin;
  std::span<float> positions;     ///< 3 per vertex
  std::span<uint16_t> triangles;  ///< 3 vertices each, behind the positions; none where 16 bits are too few

 private:
  static constexpr size_t most_kept = size_t{1} << 20;
  std::unique_ptr<std::byte[]> bytes_;
  size_t size_ = 0;
};

}  // namespace maille::wasm
