#include "surface/fans/fan_patch.h"

#include <algorithm>
#include <string>

#include "base/bytes.h"
#include "base/result.h"
#include "entropy/integer_model.h"
#include "entropy/rans.h"
#include "surface/fans/adaptive_start.h"
#include "surface/fans/fan_tables.h"
#include "surface/gluing.h"

namespace maille {
namespace {

tl::unexpected<Error> corrupt(const char* what) {
  return failure(ErrorCode::corrupt, std::string("topology: ") + what);
}

/// Small numbers, one for each of many things, as runs of equal ones.
class RunModel {
 public:
  template <class Coder>
  void code(Coder& coder, uint32_t& value, uint32_t& length) {
    value = value_[std::min(before_, 3u)].code(coder, value);
    length = length_[std::min(value, 3u)].code(coder, length - 1) + 1;
    before_ = value;
  }

 private:
  std::array<CountModel, 4> value_;
  std::array<CountModel, 4> length_;
  uint32_t before_ = 0;
};

/// Bytes are none where all numbers are 0.
template <class Get>
std::vector<std::byte> encode_runs(uint32_t count, Get get) {
  bool any = false;
  for (uint32_t i = 0; i < count && !any; ++i) any = get(i) != 0;
  if (!any) return {};
  RansEncoder encoder;
  RunModel model;
  for (uint32_t i = 0; i < count;) {
    uint32_t value = get(i);
    uint32_t length = 1;
    while (i + length < count && get(i + length) == value) ++length;
    model.code(encoder, value, length);
    i += length;
  }
  return encoder.finish();
}

/// Calls visit(begin, end, value) for each run of numbers that are not 0; a false from it ends all.
template <class Visit>
Result<> decode_runs(Bytes bytes, uint32_t count, Visit visit) {
  if (bytes.empty()) return {};
  RansDecoder decoder(bytes);
  RunModel model;
  for (uint32_t i = 0; i < count;) {
    uint32_t value = 0, length = 0;
    model.code(decoder, value, length);
    if (decoder.exhausted() || length == 0 || length > count - i) return corrupt("runs that do not fit");
    if (value != 0 && !visit(i, i + length, value)) return corrupt("a run of a number that is not allowed");
    i += length;
  }
  return {};
}

/// Faces that are copies of others, whichever way round: by face the first one with the same corners.
std::vector<uint32_t> find_first_copies(std::span<const uint32_t> corners, uint32_t points) {
  const auto faces = static_cast<uint32_t>(corners.size() / 3);
  const auto lowest = [&](uint32_t face) {
    const uint32_t* corner = corners.data() + 3 * size_t{face};
    return std::min({corner[0], corner[1], corner[2]});
  };
  // The lowest corner is the same for all that are compared.
  const auto others = [&](uint32_t face) {
    const uint32_t* corner = corners.data() + 3 * size_t{face};
    const uint32_t highest = std::max({corner[0], corner[1], corner[2]});
    const uint32_t sum = corner[0] ^ corner[1] ^ corner[2];
    return uint64_t{sum ^ highest ^ lowest(face)} << 32 | highest;
  };
  std::vector<uint32_t> begin(size_t{points} + 1), by_lowest(faces);
  for (uint32_t face = 0; face < faces; ++face) ++begin[lowest(face)];
  uint32_t sum = 0;
  for (uint32_t& place : begin) sum += std::exchange(place, sum);
  std::vector<uint32_t> end = begin;
  for (uint32_t face = 0; face < faces; ++face) by_lowest[end[lowest(face)]++] = face;
  std::vector<uint32_t> first(faces);
  for (uint32_t point = 0; point < points; ++point) {
    std::sort(by_lowest.begin() + begin[point], by_lowest.begin() + end[point],
              [&](uint32_t a, uint32_t b) { return std::pair(others(a), a) < std::pair(others(b), b); });
    for (uint32_t i = begin[point]; i < end[point]; ++i) {
      const bool copy = i > begin[point] && others(by_lowest[i]) == others(by_lowest[i - 1]);
      first[by_lowest[i]] = copy ? first[by_lowest[i - 1]] : by_lowest[i];
    }
  }
  return first;
}

/// The face without its copies, and where they went.
struct UniqueFaces {
  std::vector<uint32_t> corners;
  std::vector<uint32_t> face;                         ///< by unique face: its number among all
  std::vector<std::pair<uint32_t, uint32_t>> copies;  ///< unique face and copy, in order
  std::span<const uint32_t> all_corners;
};

UniqueFaces without_copies(std::span<const uint32_t> corners, uint32_t points) {
  UniqueFaces result;
  const std::vector<uint32_t> first = find_first_copies(corners, points);
  const auto faces = static_cast<uint32_t>(first.size());
  std::vector<uint32_t> number(faces);
  for (uint32_t face = 0; face < faces; ++face) {
    if (first[face] != face) {
      result.copies.push_back({number[first[face]], face});
      continue;
    }
    number[face] = static_cast<uint32_t>(result.face.size());
    result.face.push_back(face);
  }
  result.all_corners = corners;
  if (result.copies.empty()) return result;
  for (const uint32_t face : result.face) {
    const auto triangle = std::span(corners).subspan(3 * size_t{face}, 3);
    result.corners.insert(result.corners.end(), triangle.begin(), triangle.end());
  }
  result.all_corners = result.corners;
  return result;
}

/// What a face of the patch is in the mesh.
struct FaceSource {
  uint32_t face;   ///< among the simple faces
  uint32_t first;  ///< its corner that is the first of the coded face
  bool turned;     ///< runs the other way
};

/// Writes corners, blocks and sources of a patch whose faces come from `faces`.
class PatchTracer {
 public:
  PatchTracer(const Mesh& mesh, const SimpleFaces& faces, EncodedFanPatch& result)
      : mesh_(mesh), faces_(faces), result_(result) {
    if (!faces.cell.empty()) cells_ = table_cells(mesh);
  }
  void add(const FaceSource& source) {
    const uint32_t cell = faces_.cell_of(source.face);
    const uint32_t corner = cells_.corner.empty() ? 3 * source.face : cells_.corner[cell];
    result_.sources.cells.push_back(cell);
    result_.sources.first_corner.push_back(corner + source.first);
    if (mesh_.blocks.size() > 1) result_.patch.topology.face_block.push_back(cells_.block[cell]);
    turned.push_back(source.turned);
  }
  std::vector<bool> turned;

 private:
  const Mesh& mesh_;
  const SimpleFaces& faces_;
  EncodedFanPatch& result_;
  CellTable cells_;  // empty where a face is its cell
};

void turn_over(FanSurface& fans, uint32_t face) {
  std::swap(fans.corners[size_t{3} * face + 1], fans.corners[size_t{3} * face + 2]);
}

void append_copy(FanSurface& fans, uint32_t face) {
  for (unsigned k = 0; k < 3; ++k) fans.corners.push_back(fans.corners[size_t{3} * face + k]);
}

}  // namespace

Result<std::optional<EncodedFanPatch>> encode_fan_patch(const Mesh& mesh, FanModels models) {
  return encode_fan_patch(mesh, models, nullptr);
}

Result<std::optional<EncodedFanPatch>> encode_fan_patch(const Mesh& mesh, FanModels models,
                                                        const AdaptiveFanModel* start) {
  MAILLE_CHECK(check_patch_size(mesh));
  const SimpleFaces faces = collect_faces(mesh);
  if (!faces.offsets.empty() || mesh.point_count() > most_fan_points) return std::nullopt;
  const auto points = static_cast<uint32_t>(mesh.point_count());
  const UniqueFaces unique = without_copies(faces.all_corners, points);
  const GluedSurface glued = glue({unique.all_corners, {}, points});
  EncodedFans coded = encode_fans(glued.half_edges, glued.real_half_edges, points, models, start);

  std::optional<EncodedFanPatch> result(std::in_place);
  PatchTopology& topology = result->patch.topology;
  topology.points = points;
  const auto is_flipped = [&](uint32_t face) { return !glued.flipped.empty() && glued.flipped[face]; };
  PatchTracer tracer(mesh, faces, *result);
  std::vector<uint32_t> coded_as(unique.face.size());
  for (uint32_t i = 0; i < coded.half_edges.size(); ++i) {
    const uint32_t h = coded.half_edges[i];
    coded_as[h / 3] = i;
    // Flipped faces keep their first corner, the others change places.
    const bool flipped = is_flipped(h / 3);
    tracer.add({unique.face[h / 3], flipped ? (3 - h % 3) % 3 : h % 3, flipped});
  }
  // Copies in the order of the coded faces.
  std::vector<std::pair<uint32_t, uint32_t>> copies;
  for (const auto& [face, copy] : unique.copies) copies.push_back({coded_as[face], copy});
  std::sort(copies.begin(), copies.end());
  std::vector<uint32_t> copy_count(copies.empty() ? 0 : coded.half_edges.size());
  FanSurface& fans = coded.surface;
  for (const auto& [face, copy] : copies) {
    ++copy_count[face];
    append_copy(fans, face);
    const uint32_t* corner = faces.all_corners.data() + 3 * size_t{copy};
    const uint32_t first = coded.points[fans.corners[size_t{3} * face]];
    const auto at = static_cast<uint32_t>(std::find(corner, corner + 3, first) - corner);
    const bool turned = corner[(at + 1) % 3] != coded.points[fans.corners[size_t{3} * face + 1]];
    tracer.add({copy, at, turned});
  }
  const uint32_t count = fans.triangles();
  topology.surface.face_count = count;
  topology.surface.point_count = fans.vertices;
  result->sources.points = coded.points;
  append_other_points(mesh, result->sources.points);
  collect_loose(mesh, topology, result->sources);

  ByteWriter out;
  // With shared tables nothing stands beside most fans: triangles, all points are theirs.
  const bool alone = copies.empty() && topology.loose.size() == 0 && mesh.blocks.size() == 1 &&
                     fans.vertices == points &&
                     std::find(tracer.turned.begin(), tracer.turned.end(), true) == tracer.turned.end();
  const bool shared = models == FanModels::shared;
  result->operations = std::move(coded.operations);
  if (shared && alone) {
    result->patch.fans = std::move(fans);
    return result;
  }
  out.put_count(coded.half_edges.size());
  if (shared) {
    out.put_count(fans.vertices);
  } else {
    put_section(out, coded.bytes);
  }
  put_section(
      out, encode_runs(static_cast<uint32_t>(copy_count.size()), [&](uint32_t i) { return copy_count[i]; }));
  put_section(out, encode_runs(count, [&](uint32_t i) { return uint32_t{tracer.turned[i]}; }));
  put_section(out, encode_runs(static_cast<uint32_t>(topology.face_block.size()),
                               [&](uint32_t i) { return topology.face_block[i]; }));
  put_section(out, encode_loose(topology, mesh));
  result->bytes = out.take();
  for (uint32_t i = 0; i < count; ++i) {
    if (tracer.turned[i]) turn_over(fans, i);
  }
  result->patch.fans = std::move(fans);
  return result;
}

std::vector<std::byte> write_shared_fan_patch(const EncodedFanPatch& coded, const FanTables& tables) {
  ByteWriter out;
  put_section(out, coded.bytes);
  out.put_bytes(write_fans(coded.operations, tables));
  return out.take();
}

Result<FanPatchDecoder> FanPatchDecoder::begin(Bytes bytes, uint32_t points, uint64_t corners) {
  ByteReader in(bytes);
  const uint64_t triangles = in.get_count();
  const Bytes fans = in.get_bytes(in.get_count());
  FanPatchDecoder decoder;
  MAILLE_CHECK(decoder.read_sections(in, triangles, corners));
  const uint64_t copied = MAILLE_TRY(decoder.count_copies(corners));
  decoder.fans = MAILLE_TRY(FanDecoder::begin(fans, decoder.triangles, points, copied));
  return decoder;
}

Result<FanPatchDecoder> FanPatchDecoder::begin_shared(Bytes bytes, const FanSlots& slots, uint32_t points,
                                                      uint64_t corners, FanBuffers* buffers) {
  ByteReader in(bytes);
  const Bytes beside = in.get_bytes(in.get_count());
  const Bytes fans = in.get_bytes(in.remaining());
  if (!in.ok()) return corrupt("the stream has the wrong length");
  FanPatchDecoder decoder;
  uint64_t vertices = points, copied = 0;
  if (beside.empty()) {
    if (corners >= most_patch_corners || corners % 3 != 0) return corrupt("fans of something else");
    decoder.triangles = static_cast<uint32_t>(corners / 3);
  } else {
    ByteReader sections(beside);
    const uint64_t triangles = sections.get_count();
    vertices = sections.get_count();
    MAILLE_CHECK(decoder.read_sections(sections, triangles, corners));
    if (vertices > points) return corrupt("more vertices than points");
    copied = MAILLE_TRY(decoder.count_copies(corners));
  }
  decoder.fans = MAILLE_TRY(
      FanDecoder::begin(fans, slots, decoder.triangles, static_cast<uint32_t>(vertices), copied, buffers));
  return decoder;
}

Result<> FanPatchDecoder::decode_fans_first() {
  all_fans = MAILLE_TRY(decode_all(std::move(*fans)));
  fans.reset();
  return {};
}

Result<> FanPatchDecoder::read_sections(ByteReader& in, uint64_t count, uint64_t corners) {
  copies = in.get_bytes(in.get_count());
  turned = in.get_bytes(in.get_count());
  block_numbers = in.get_bytes(in.get_count());
  loose = in.get_bytes(in.get_count());
  if (!in.ok() || in.remaining() != 0) return corrupt("the stream has the wrong length");
  if (corners >= most_patch_corners) return corrupt("more corners than a patch may have");
  if (count > corners / 3) return corrupt("more triangles than the mesh has corners for");
  triangles = static_cast<uint32_t>(count);
  return {};
}

Result<uint64_t> FanPatchDecoder::count_copies(uint64_t corners) const {
  uint64_t copied = 0;
  MAILLE_CHECK(decode_runs(copies, triangles, [&](uint32_t begin, uint32_t end, uint32_t copy) {
    copied += uint64_t{end - begin} * copy;
    return copied <= corners / 3 - triangles;
  }));
  return copied;
}

Result<FanPatch> FanPatchDecoder::finish(std::span<const BlockShape> blocks, uint32_t points,
                                         uint64_t corners) {
  FanPatch patch;
  PatchTopology& topology = patch.topology;
  topology.points = points;
  if (fans) {
    patch.fans = MAILLE_TRY(fans->finish());
  } else {
    patch.fans = std::move(all_fans);
    patch.fans.forget_vertices();
  }
  MAILLE_CHECK(decode_runs(copies, triangles, [&](uint32_t begin, uint32_t end, uint32_t copy) {
    if (uint64_t{end - begin} * copy > corners / 3 - patch.fans.triangles()) return false;
    for (uint32_t face = begin; face < end; ++face) {
      for (uint32_t i = 0; i < copy; ++i) append_copy(patch.fans, face);
    }
    return true;
  }));
  const uint32_t count = patch.fans.triangles();
  topology.surface.face_count = count;
  topology.surface.point_count = patch.fans.vertices;
  MAILLE_CHECK(decode_runs(turned, count, [&](uint32_t begin, uint32_t end, uint32_t value) {
    for (uint32_t face = begin; face < end; ++face) turn_over(patch.fans, face);
    return value == 1;
  }));
  if (!block_numbers.empty()) topology.face_block.resize(count);
  MAILLE_CHECK(decode_runs(block_numbers, count, [&](uint32_t begin, uint32_t end, uint32_t block) {
    std::fill(topology.face_block.begin() + begin, topology.face_block.begin() + end, block);
    return block < blocks.size();
  }));
  MAILLE_CHECK(decode_loose(loose, blocks, corners, topology));
  return patch;
}

Result<> build_surface(const FanSurface& fans, PatchTopology& topology) {
  PatchSurface& surface = topology.surface;
  const std::vector<uint32_t>& corners = fans.corners;
  if (surface.half_edges.size() != 0) return {};
  for (size_t i = 0; i < corners.size(); i += 3) {
    if (!is_simple(std::span(corners).subspan(i, 3))) return corrupt("a triangle has a vertex twice");
  }
  GluedSurface glued = glue({corners, {}, fans.vertices});
  topology.flipped = std::move(glued.flipped);
  surface.half_edges = std::move(glued.half_edges);
  HalfEdges& edges = surface.half_edges;
  // Vertices by their points; those of one point in the order of their half-edges.
  std::vector<uint32_t> by_point(glued.real_half_edges), place(size_t{fans.vertices} + 1);
  for (uint32_t h = 0; h < glued.real_half_edges; ++h) ++place[edges.origin[h] + 1];
  for (uint32_t p = 0; p < fans.vertices; ++p) place[p + 1] += place[p];
  for (uint32_t h = 0; h < glued.real_half_edges; ++h) by_point[place[edges.origin[h]]++] = h;
  const std::vector<uint32_t> point_at = edges.origin;
  std::vector<bool> done(edges.size());
  for (const uint32_t first : by_point) {
    if (done[first]) continue;
    const auto vertex = static_cast<uint32_t>(surface.vertices.corner.size());
    surface.vertices.corner.push_back(first);
    surface.point_of.push_back(point_at[first]);
    uint32_t h = first;
    do {
      edges.origin[h] = vertex;
      done[h] = true;
      h = edges.turn(h);
    } while (h != first);
  }
  for (uint32_t h = 0; h < edges.size(); ++h) {
    if (!done[h]) edges.origin[h] = first_dummy + (point_at[h] - fans.vertices);
  }
  if (surface.vertices.size() == fans.vertices) surface.point_of.clear();
  return {};
}

std::vector<CellBlock> assemble_fans(FanSurface fans, const PatchTopology& topology,
                                     std::span<const BlockShape> blocks) {
  const LooseCells& loose = topology.loose;
  std::vector<CellBlock> result(blocks.size());
  for (size_t b = 0; b < blocks.size(); ++b) {
    result[b].type = blocks[b].type;
    if (nodes_of(blocks[b].type) == 0 && blocks[b].cells > 0) result[b].offsets.push_back(0);
  }
  if (blocks.size() == 1 && blocks[0].type == CellType::triangle && loose.size() == 0) {
    result[0].connectivity = std::move(fans.corners);
    return result;
  }
  const auto end_cell = [](CellBlock& block) {
    if (nodes_of(block.type) == 0) block.offsets.push_back(block.connectivity.size());
  };
  for (uint32_t face = 0; face < topology.surface.face_count; ++face) {
    CellBlock& block = result[topology.block_of_face(face)];
    for (unsigned k = 0; k < 3; ++k) block.connectivity.push_back(fans.corners[size_t{3} * face + k]);
    end_cell(block);
  }
  for (uint32_t i = 0; i < loose.size(); ++i) {
    CellBlock& block = result[loose.block[i]];
    if (block.type == CellType::mixed) block.types.push_back(loose.type[i]);
    block.connectivity.insert(block.connectivity.end(), loose.nodes.begin() + loose.offsets[i],
                              loose.nodes.begin() + loose.offsets[i + 1]);
    end_cell(block);
  }
  return result;
}

}  // namespace maille
