#include "surface/fans/fan_patch.h"

#include <algorithm>
#include <numeric>
#include <string>

#include "base/bytes.h"
#include "base/result.h"
#include "entropy/integer_model.h"
#include "entropy/rans.h"
#include "surface/fans/fan_tables.h"
#include "surface/gluing.h"

namespace maille {
namespace {

tl::unexpected<Error> corrupt(const char* what) {
  return failure(ErrorCode::corrupt, std::string("topology: ") + what);
}

/// Small numbers, one for each of many things, as runs of equal ones: nearly all are 0, or the same for long.
/// The value before is the context of the next one, and the value that of its length.
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

/// A face from its lowest point on, towards the lower one of the two beside it: the same for all its
/// duplicates, however these begin and run.
std::vector<uint32_t> canonical(std::span<const uint32_t> corners) {
  std::vector<uint32_t> result(corners.begin(), corners.end());
  std::rotate(result.begin(), std::min_element(result.begin(), result.end()), result.end());
  if (result.back() < result[1]) std::reverse(result.begin() + 1, result.end());
  return result;
}

/// The two points beside the lowest one, the lower one first: duplicates have the same, and all triangles
/// that have the same are duplicates.
uint64_t beside_lowest(std::span<const uint32_t> corners, size_t lowest) {
  const uint32_t before = corners[lowest > 0 ? lowest - 1 : corners.size() - 1],
                 after = corners[lowest + 1 < corners.size() ? lowest + 1 : 0];
  return uint64_t{std::min(before, after)} << 32 | std::max(before, after);
}

using NearFaces = std::vector<std::pair<uint64_t, uint32_t>>;
/// Among faces that are the same there.
void find_first(const Faces& faces, std::span<const NearFaces::value_type> near,
                std::vector<uint32_t>& first) {
  if (faces.offsets.empty()) {
    for (const auto& [beside, face] : near) first[face] = near[0].second;
    return;
  }
  std::vector<std::pair<std::vector<uint32_t>, uint32_t>> same;
  for (const auto& [beside, face] : near) same.push_back({canonical(faces.face(face)), face});
  std::sort(same.begin(), same.end());
  for (size_t i = 1; i < same.size(); ++i) {
    if (same[i].first == same[i - 1].first) first[same[i].second] = first[same[i - 1].second];
  }
}

/// Faces that are duplicates of others, whichever way round: by face the first one with the same corners.
/// Candidates are found by counting faces by their lowest point. Non-manifold meshes took twice as long to
/// encode when faces were sorted as vectors here and edges were looked up by bisection (06ec5c6).
std::vector<uint32_t> find_first_duplicates(const Faces& faces) {
  std::vector<uint32_t> first(faces.size()), end_of(size_t{faces.point_count} + 1), by_lowest(faces.size());
  std::iota(first.begin(), first.end(), 0u);
  const auto lowest = [&](uint32_t face) {
    const auto corners = faces.face(face);
    return static_cast<size_t>(std::min_element(corners.begin(), corners.end()) - corners.begin());
  };
  for (uint32_t face = 0; face < faces.size(); ++face) ++end_of[faces.face(face)[lowest(face)] + 1];
  std::partial_sum(end_of.begin(), end_of.end(), end_of.begin());
  for (uint32_t face = 0; face < faces.size(); ++face)
    by_lowest[end_of[faces.face(face)[lowest(face)]]++] = face;
  NearFaces near;
  for (size_t point = 0, begin = 0; point < faces.point_count; begin = end_of[point++]) {
    near.clear();
    for (size_t i = begin; i < end_of[point]; ++i) {
      const uint32_t face = by_lowest[i];
      near.push_back({beside_lowest(faces.face(face), lowest(face)), face});
    }
    std::sort(near.begin(), near.end());
    for (size_t i = 0, end = 0; i < near.size(); i = end) {
      end = i + 1;
      while (end < near.size() && near[end].first == near[i].first) ++end;
      if (end - i > 1) find_first(faces, std::span(near).subspan(i, end - i), first);
    }
  }
  return first;
}

/// Can some face be a duplicate of another one? Then an edge is not plain, or the other one is across all its
/// edges. In most meshes this saves the search, and a copy of all corners.
bool may_have_duplicates(const Faces& faces, const GluedSurface& glued) {
  if (!glued.plain) return true;
  const std::vector<uint32_t>& opposite = glued.half_edges.opposite;
  for (uint32_t face = 0; face < faces.size(); ++face) {
    // If one face is across all edges, the half-edges there are as many successive numbers as this face has;
    // one look at the first numbers is enough for most faces.
    const uint32_t begin = faces.first(face), degree = faces.first(face + 1) - begin;
    uint32_t least = none, most = 0;
    for (uint32_t h = begin; h < begin + degree; ++h) {
      least = std::min(least, opposite[h]);
      most = std::max(most, opposite[h]);
      if (most - least >= degree) break;
    }
    if (most - least == degree - 1 && most < glued.real_half_edges) return true;
  }
  return false;
}

/// The faces of a mesh without their duplicates, and where these went.
struct UniqueFaces {
  std::vector<uint32_t> corners, offsets;                 ///< empty where there are no duplicates
  std::vector<uint32_t> face;                             ///< by unique face: its number among all; likewise
  std::vector<std::pair<uint32_t, uint32_t>> duplicates;  ///< unique face and duplicate, in order

  uint32_t number(uint32_t unique) const { return face.empty() ? unique : face[unique]; }
};

UniqueFaces without_duplicates(const Faces& faces) {
  UniqueFaces result;
  const std::vector<uint32_t> first = find_first_duplicates(faces);
  std::vector<uint32_t> number(faces.size());
  if (!faces.offsets.empty()) result.offsets.push_back(0);
  for (uint32_t face = 0; face < faces.size(); ++face) {
    if (first[face] != face) {
      result.duplicates.push_back({number[first[face]], face});
      continue;
    }
    number[face] = static_cast<uint32_t>(result.face.size());
    result.face.push_back(face);
    const auto corners = faces.face(face);
    result.corners.insert(result.corners.end(), corners.begin(), corners.end());
    if (!faces.offsets.empty()) result.offsets.push_back(static_cast<uint32_t>(result.corners.size()));
  }
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
    const size_t count = faces.view(0).size();
    turned.reserve(count);
    result.sources.cells.reserve(count);
    result.sources.first_corner.reserve(count);
  }
  void add(const FaceSource& source) {
    const uint32_t cell = faces_.cell_of(source.face);
    const uint32_t corner = cells_.corner.empty() ? faces_.first(source.face) : cells_.corner[cell];
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
  std::reverse(fans.corners.begin() + fans.first_corner(face) + 1,
               fans.corners.begin() + fans.first_corner(face + 1));
}

void append_duplicate(FanSurface& fans, uint32_t face) {
  const uint32_t end = fans.first_corner(face + 1);
  for (uint32_t c = fans.first_corner(face); c < end; ++c) fans.corners.push_back(fans.corners[c]);
  if (!fans.offsets.empty()) fans.offsets.push_back(static_cast<uint32_t>(fans.corners.size()));
}

}  // namespace

/// In this order: faces, gluing, duplicates set aside (and the rest glued again), fans, then what each coded
/// face is in the mesh, duplicates behind all others, points and cells that are not on the surface, sections.
Result<std::optional<EncodedFanPatch>> encode_fan_patch(const Mesh& mesh, FanModels models) {
  MAILLE_CHECK(check_patch_size(mesh));
  const SimpleFaces faces = collect_faces(mesh);
  const bool polygons = !faces.offsets.empty();
  if (mesh.point_count() > most_fan_points) return std::nullopt;
  const auto points = static_cast<uint32_t>(mesh.point_count());
  const Faces all = faces.view(points);
  GluedSurface glued = glue(all);
  UniqueFaces unique;
  if (may_have_duplicates(all, glued)) {
    unique = without_duplicates(all);
    if (!unique.duplicates.empty()) glued = glue({unique.corners, unique.offsets, points});
  }
  const Faces glued_faces = unique.duplicates.empty() ? all : Faces{unique.corners, unique.offsets, points};
  EncodedFans coded = encode_fans(std::move(glued.half_edges), glued.real_half_edges, points, models);

  std::optional<EncodedFanPatch> result(std::in_place);
  PatchTopology& topology = result->patch.topology;
  topology.points = points;
  PatchTracer tracer(mesh, faces, *result);
  std::vector<uint32_t> face_at;  // by half-edge; triangles do without
  for (uint32_t face = 0; polygons && face < glued_faces.size(); ++face)
    face_at.resize(glued_faces.first(face + 1), face);
  std::vector<uint32_t> coded_as(unique.duplicates.empty() ? 0 : glued_faces.size());
  for (uint32_t i = 0; i < coded.half_edges.size(); ++i) {
    const uint32_t h = coded.half_edges[i];
    const uint32_t face = polygons ? face_at[h] : h / 3;
    if (!coded_as.empty()) coded_as[face] = i;
    // Flipped faces keep their first corner, the others change places.
    const bool flipped = !glued.flipped.empty() && glued.flipped[face];
    const uint32_t corner = h - glued_faces.first(face);
    const uint32_t degree = glued_faces.first(face + 1) - glued_faces.first(face);
    tracer.add({unique.number(face), flipped && corner > 0 ? degree - corner : corner, flipped});
  }
  // Duplicates in the order of the coded faces.
  std::vector<std::pair<uint32_t, uint32_t>> duplicates;
  for (const auto& [face, duplicate] : unique.duplicates) duplicates.push_back({coded_as[face], duplicate});
  std::sort(duplicates.begin(), duplicates.end());
  std::vector<uint32_t> duplicate_count(duplicates.empty() ? 0 : coded.half_edges.size());
  FanSurface& fans = coded.surface;
  for (const auto& [face, duplicate] : duplicates) {
    ++duplicate_count[face];
    append_duplicate(fans, face);
    const auto corners = all.face(duplicate);
    const auto coded_corners = fans.face(face);
    const auto at = static_cast<size_t>(
        std::find(corners.begin(), corners.end(), coded.points[coded_corners[0]]) - corners.begin());
    // A face has no point twice, so that its second corner tells which way round it runs.
    const bool turned = corners[(at + 1) % corners.size()] != coded.points[coded_corners[1]];
    tracer.add({duplicate, static_cast<uint32_t>(at), turned});
  }
  const uint32_t count = fans.faces();
  topology.surface.face_count = count;
  topology.surface.point_count = fans.vertices;
  result->sources.points = coded.points;
  if (fans.vertices < points) append_other_points(mesh, result->sources);
  if (all.size() < mesh.cell_count()) collect_loose(mesh, topology, result->sources);

  ByteWriter out;
  // Most charts are triangles whose points are all those of the fans: with shared tables nothing stands
  // beside these, not even counts, as the chart's description has them.
  const bool alone = !polygons && duplicates.empty() && topology.loose.size() == 0 &&
                     mesh.blocks.size() == 1 && fans.vertices == points &&
                     std::find(tracer.turned.begin(), tracer.turned.end(), true) == tracer.turned.end();
  const bool shared = models == FanModels::shared;
  result->operations = std::move(coded.operations);
  if (shared && alone) {
    result->patch.fans = std::move(fans);
    return result;
  }
  out.put_count(coded.half_edges.size());
  if (polygons) out.put_count(glued_faces.corners.size());
  if (shared) {
    out.put_count(fans.vertices);
  } else {
    put_section(out, coded.bytes);
  }
  put_section(out, encode_runs(static_cast<uint32_t>(duplicate_count.size()),
                               [&](uint32_t i) { return duplicate_count[i]; }));
  put_section(out, encode_runs(count, [&](uint32_t i) { return uint32_t{tracer.turned[i]}; }));
  put_section(out, encode_runs(static_cast<uint32_t>(topology.face_block.size()),
                               [&](uint32_t i) { return topology.face_block[i]; }));
  put_section(out, encode_loose(topology, mesh));
  result->bytes = out.take();
  for (uint32_t i = 0; i < count; ++i) {
    // Afterwards only: fans run the way the glued surface does, the mesh may run the other way.
    if (tracer.turned[i]) turn_over(fans, i);
  }
  result->patch.fans = std::move(fans);
  return result;
}

std::vector<std::byte> write_shared_fan_patch(const EncodedFanPatch& coded, const FanTables& tables) {
  ByteWriter out;
  put_section(out, coded.bytes);
  out.put_bytes(write_fans(coded.operations, tables, coded.patch.fans.triangles()));
  return out.take();
}

Result<FanPatchDecoder> FanPatchDecoder::begin(Bytes bytes, uint32_t points, uint64_t corners) {
  ByteReader in(bytes);
  const uint64_t triangles = in.get_count();
  const Bytes fans = in.get_bytes(in.get_count());
  FanPatchDecoder decoder;
  // Counts are held against corners of the description before anything is decoded or reserved.
  MAILLE_CHECK(decoder.read_sections(in, triangles, corners));
  const uint64_t repeated = MAILLE_TRY(decoder.count_duplicates(corners));
  decoder.fans = MAILLE_TRY(FanDecoder::begin(fans, decoder.faces, points, repeated));
  return decoder;
}

Result<FanPatchDecoder> FanPatchDecoder::begin_polygons(Bytes bytes, uint32_t points, uint64_t corners) {
  ByteReader in(bytes);
  const uint64_t polygons = in.get_count();
  const uint64_t corners_of_fans = in.get_count();
  const Bytes fans = in.get_bytes(in.get_count());
  FanPatchDecoder decoder;
  MAILLE_CHECK(decoder.read_sections(in, polygons, corners));
  if (corners_of_fans > corners) return corrupt("more corners than the mesh has");
  decoder.fans = FanDecoder::over(
      MAILLE_TRY(decode_polygon_fans(fans, decoder.faces, static_cast<uint32_t>(corners_of_fans), points)));
  return decoder;
}

Result<FanPatchDecoder> FanPatchDecoder::begin_shared(Bytes bytes, const FanSlots& slots, uint32_t points,
                                                      uint64_t corners, FanBuffers* buffers) {
  ByteReader in(bytes);
  const Bytes beside = in.get_bytes(in.get_count());
  const Bytes fans = in.get_bytes(in.remaining());
  if (!in.ok()) return corrupt("the stream has the wrong length");
  FanPatchDecoder decoder;
  uint64_t vertices = points, repeated = 0;
  if (beside.empty()) {
    if (corners >= most_patch_corners || corners % 3 != 0) return corrupt("fans of something else");
    decoder.faces = static_cast<uint32_t>(corners / 3);
  } else {
    ByteReader sections(beside);
    const uint64_t triangles = sections.get_count();
    vertices = sections.get_count();
    MAILLE_CHECK(decoder.read_sections(sections, triangles, corners));
    if (vertices > points) return corrupt("more vertices than points");
    repeated = MAILLE_TRY(decoder.count_duplicates(corners));
  }
  decoder.fans = MAILLE_TRY(
      FanDecoder::begin(fans, slots, decoder.faces, static_cast<uint32_t>(vertices), repeated, buffers));
  return decoder;
}

Result<FanPatchDecoder> FanPatchDecoder::begin_shared_polygons(Bytes bytes, const FanSlots& slots,
                                                               uint32_t points, uint64_t corners) {
  ByteReader in(bytes);
  ByteReader sections(in.get_bytes(in.get_count()));
  const Bytes fans = in.get_bytes(in.remaining());
  if (!in.ok()) return corrupt("the stream has the wrong length");
  const uint64_t polygons = sections.get_count();
  const uint64_t corners_of_fans = sections.get_count();
  const uint64_t vertices = sections.get_count();
  FanPatchDecoder decoder;
  MAILLE_CHECK(decoder.read_sections(sections, polygons, corners));
  if (corners_of_fans > corners || vertices > points)
    return corrupt("more corners or vertices than the mesh has");
  decoder.fans = FanDecoder::over(MAILLE_TRY(decode_polygon_fans(
      fans, slots, decoder.faces, static_cast<uint32_t>(corners_of_fans), static_cast<uint32_t>(vertices))));
  return decoder;
}

Result<> FanPatchDecoder::read_sections(ByteReader& in, uint64_t count, uint64_t corners) {
  duplicates = in.get_bytes(in.get_count());
  turned = in.get_bytes(in.get_count());
  block_numbers = in.get_bytes(in.get_count());
  loose = in.get_bytes(in.get_count());
  if (!in.ok() || in.remaining() != 0) return corrupt("the stream has the wrong length");
  if (corners >= most_patch_corners) return corrupt("more corners than a patch may have");
  if (count > corners / 3) return corrupt("more faces than the mesh has corners for");
  faces = static_cast<uint32_t>(count);
  return {};
}

Result<uint64_t> FanPatchDecoder::count_duplicates(uint64_t corners) const {
  uint64_t repeated = 0;
  MAILLE_CHECK(decode_runs(duplicates, faces, [&](uint32_t begin, uint32_t end, uint32_t duplicate) {
    repeated += uint64_t{end - begin} * duplicate;
    return repeated <= corners / 3 - faces;
  }));
  return repeated;
}

Result<FanPatch> FanPatchDecoder::finish(std::span<const BlockShape> blocks, uint32_t points,
                                         uint64_t corners) {
  FanPatch patch;
  PatchTopology& topology = patch.topology;
  topology.points = points;
  patch.fans = MAILLE_TRY(fans->finish());
  if (patch.fans.corners.size() > corners) return corrupt("more corners than the mesh has");
  MAILLE_CHECK(decode_runs(duplicates, faces, [&](uint32_t begin, uint32_t end, uint32_t duplicate) {
    const uint64_t more = patch.fans.first_corner(end) - patch.fans.first_corner(begin);
    // Checked before anything is appended: a run of a few bits can claim any number of duplicates. The
    // product of two numbers below 2^32 fits.
    if (more * duplicate > corners - patch.fans.corners.size()) return false;
    for (uint32_t face = begin; face < end; ++face) {
      for (uint32_t i = 0; i < duplicate; ++i) append_duplicate(patch.fans, face);
    }
    return true;
  }));
  const uint32_t count = patch.fans.faces();
  topology.surface.face_count = count;
  topology.surface.point_count = patch.fans.vertices;
  MAILLE_CHECK(decode_runs(turned, count, [&](uint32_t begin, uint32_t end, uint32_t value) {
    for (uint32_t face = begin; face < end; ++face) turn_over(patch.fans, face);
    // Flags are 0 (no run) or 1; any other value is refused, after it has done no harm.
    return value == 1;
  }));
  if (!block_numbers.empty()) topology.face_block.resize(count);
  MAILLE_CHECK(decode_runs(block_numbers, count, [&](uint32_t begin, uint32_t end, uint32_t block) {
    std::fill(topology.face_block.begin() + begin, topology.face_block.begin() + end, block);
    // Labels of blocks that are not there are refused before anybody looks at them.
    return block < blocks.size();
  }));
  MAILLE_CHECK(decode_loose(loose, blocks, corners, topology, patch.fans.offsets));
  return patch;
}

Result<> build_surface(const FanSurface& fans, PatchTopology& topology) {
  PatchSurface& surface = topology.surface;
  const std::vector<uint32_t>& corners = fans.corners;
  // Several arrays ask for it; only the first time it is built.
  if (surface.half_edges.size() != 0) return {};
  for (uint32_t face = 0; face < fans.faces(); ++face) {
    if (!is_simple(fans.face(face))) return corrupt("a face has a vertex twice");
  }
  GluedSurface glued = glue({corners, fans.offsets, fans.vertices});
  if (!fans.offsets.empty()) surface.faces.assign(fans.offsets.begin(), fans.offsets.end() - 1);
  topology.flipped = std::move(glued.flipped);
  surface.half_edges = std::move(glued.half_edges);
  HalfEdges& edges = surface.half_edges;
  // Vertices (fans of half-edges) are numbered by their points, those of one point in the order of their
  // lowest half-edge, which becomes corner(V): format 12.4. Sorting by counting keeps that order.
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
    // glue() numbers dummies from the number of points on; here they are to be apart from vertices.
    if (!done[h]) edges.origin[h] = first_dummy + (point_at[h] - fans.vertices);
  }
  if (surface.vertices.size() == fans.vertices) surface.point_of.clear();
  return {};
}

namespace {

/// The places of cells and their corners, block by block.
void find_places(const FanSurface& fans, const PatchTopology& topology, AssembledCells& cells) {
  std::vector<uint32_t> cell(cells.blocks.size() + 1), corner(cells.blocks.size() + 1);
  for (size_t b = 0; b < cells.blocks.size(); ++b) {
    cell[b + 1] = cell[b] + static_cast<uint32_t>(cells.blocks[b].size());
    corner[b + 1] = corner[b] + static_cast<uint32_t>(cells.blocks[b].connectivity.size());
  }
  const auto add = [&](uint32_t block, uint32_t corners) {
    cells.cell_place.push_back(cell[block]++);
    for (uint32_t k = 0; k < corners; ++k) cells.corner_place.push_back(corner[block]++);
  };
  for (uint32_t face = 0; face < topology.surface.face_count; ++face)
    add(topology.block_of_face(face), fans.first_corner(face + 1) - fans.first_corner(face));
  const LooseCells& loose = topology.loose;
  for (uint32_t i = 0; i < loose.size(); ++i) add(loose.block[i], loose.offsets[i + 1] - loose.offsets[i]);
}

void find_offsets(const FanSurface& fans, CellBlock& block) {
  if (fans.faces() == 0) return;
  if (!fans.offsets.empty()) return block.offsets.assign(fans.offsets.begin(), fans.offsets.end());
  for (uint32_t face = 0; face < fans.faces(); ++face) block.offsets.push_back(fans.first_corner(face + 1));
}

}  // namespace

AssembledCells assemble_fans(FanSurface fans, const PatchTopology& topology,
                             std::span<const BlockShape> blocks, bool with_places) {
  const LooseCells& loose = topology.loose;
  AssembledCells cells;
  std::vector<CellBlock>& result = cells.blocks;
  result.resize(blocks.size());
  for (size_t b = 0; b < blocks.size(); ++b) {
    result[b].type = blocks[b].type;
    if (nodes_of(blocks[b].type) == 0 && blocks[b].cells > 0) result[b].offsets.push_back(0);
  }
  // The common case moves the corners instead of copying them.
  const bool polygons = blocks.size() == 1 && blocks[0].type == CellType::polygon;
  if (blocks.size() == 1 && loose.size() == 0 && (polygons || nodes_of(blocks[0].type) != 0)) {
    if (polygons) find_offsets(fans, result[0]);
    result[0].connectivity = std::move(fans.corners);
    return cells;
  }
  const auto end_cell = [](CellBlock& block) {
    if (nodes_of(block.type) == 0) block.offsets.push_back(block.connectivity.size());
  };
  for (uint32_t face = 0; face < topology.surface.face_count; ++face) {
    CellBlock& block = result[topology.block_of_face(face)];
    const auto corners = fans.face(face);
    block.connectivity.insert(block.connectivity.end(), corners.begin(), corners.end());
    end_cell(block);
  }
  for (uint32_t i = 0; i < loose.size(); ++i) {
    CellBlock& block = result[loose.block[i]];
    if (block.type == CellType::mixed) block.types.push_back(loose.type[i]);
    block.connectivity.insert(block.connectivity.end(), loose.nodes.begin() + loose.offsets[i],
                              loose.nodes.begin() + loose.offsets[i + 1]);
    end_cell(block);
  }
  if (with_places && blocks.size() > 1) find_places(fans, topology, cells);
  return cells;
}

}  // namespace maille
