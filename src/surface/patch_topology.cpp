#include "surface/patch_topology.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string_view>

#include "base/bytes.h"
#include "base/result.h"
#include "entropy/integer_model.h"
#include "entropy/rans.h"
#include "numbers/number_map.h"
#include "surface/front/point_identity.h"
#include "surface/gluing.h"

namespace maille {
namespace {

tl::unexpected<Error> corrupt(const char* what) {
  return failure(ErrorCode::corrupt, std::string("topology: ") + what);
}

CellType type_of(const CellBlock& block, uint64_t cell) {
  return block.type == CellType::mixed ? static_cast<CellType>(block.types[cell]) : block.type;
}

/// May one cell have this type? Not "mixed", and none that name_of() does not know.
bool is_type_of_cell(CellType type) {
  return type != CellType::mixed && type != CellType::polyhedron &&
         std::string_view(name_of(type)) != "unknown";
}

/// Calls visit(block, cell in block, cell in mesh, first corner in mesh) for every cell.
template <class Visit>
void for_each_cell(const Mesh& mesh, Visit visit) {
  uint32_t cell = 0;
  uint64_t corner = 0;
  for (uint32_t b = 0; b < mesh.blocks.size(); ++b) {
    for (uint64_t i = 0; i < mesh.blocks[b].size(); ++i) {
      visit(b, i, cell++, static_cast<uint32_t>(corner));
      corner += mesh.blocks[b].cell(i).size();
    }
  }
}

bool in_surface(const CellBlock& block, uint64_t cell) {
  // In blocks of mixed type a triangle and a polygon of three corners differ; they are coded as loose cells.
  return is_face(block.type) && is_simple(block.cell(cell));
}

}  // namespace

Result<> check_patch_size(const Mesh& mesh) {
  // The coder of fronts marks points by their highest bit, also those that no cell uses.
  if (mesh.corner_count() < most_patch_corners && mesh.point_count() < most_patch_points) return {};
  return failure(ErrorCode::unsupported,
                 "a mesh of 2^29 corners or 2^31 points, or more, does not fit one patch; split it");
}

CellTable table_cells(const Mesh& mesh) {
  CellTable cells;
  for_each_cell(mesh, [&](uint32_t b, uint64_t, uint32_t, uint32_t corner) {
    cells.block.push_back(b);
    cells.corner.push_back(corner);
  });
  return cells;
}

void put_section(ByteWriter& out, Bytes bytes) {
  out.put_count(bytes.size());
  out.put_bytes(bytes);
}

SimpleFaces collect_faces(const Mesh& mesh) {
  SimpleFaces faces;
  // The common case costs no copy: one block of triangles, all of them simple.
  if (mesh.blocks.size() == 1 && mesh.blocks[0].type == CellType::triangle) {
    const CellBlock& block = mesh.blocks[0];
    uint64_t i = 0;
    while (i < block.size() && is_simple(block.cell(i))) ++i;
    if (i == block.size()) {
      faces.all_corners = block.connectivity;
      return faces;
    }
  }
  faces.offsets.push_back(0);
  bool triangles = true;
  for_each_cell(mesh, [&](uint32_t b, uint64_t i, uint32_t cell, uint32_t) {
    if (!in_surface(mesh.blocks[b], i)) return;
    const auto corners = mesh.blocks[b].cell(i);
    faces.corners.insert(faces.corners.end(), corners.begin(), corners.end());
    faces.offsets.push_back(static_cast<uint32_t>(faces.corners.size()));
    faces.cell.push_back(cell);
    triangles = triangles && corners.size() == 3;
  });
  if (triangles) faces.offsets.clear();
  faces.all_corners = faces.corners;
  return faces;
}

namespace {

/// First half-edges of real faces in coded order, in the numbering of `surface`. `order` lists all faces as
/// coded; if gluing was a choice, they are ordered by the walk that repeats it (breadth_first_faces()).
std::vector<uint32_t> order_faces(const PatchSurface& surface, std::span<const uint32_t> order, bool chosen) {
  const HalfEdges& edges = surface.half_edges;
  std::vector<bool> real(chosen ? edges.size() : 0);
  std::vector<uint32_t> faces;
  for (const uint32_t first : order) {
    bool dummy = false;
    uint32_t h = first;
    do {
      dummy |= edges.origin[h] >= first_dummy;
      h = edges.next(h);
    } while (h != first);
    if (dummy) continue;
    faces.push_back(first);
    if (!chosen) continue;
    do {
      real[h] = true;
      h = edges.next(h);
    } while (h != first);
  }
  return chosen ? breadth_first_faces(edges, faces, real) : faces;
}

uint32_t count_real_triangles(const HalfEdges& triangles) {
  uint32_t count = 0;
  for (uint32_t h = 0; h < triangles.size(); h += 3) count += !triangles.is_border_triangle(h);
  return count;
}

/// Flags and blocks of the faces, in coded order. Both come in runs: three flags before are the context of
/// one, and a block is mostly that before.
template <class Coder>
class FaceLabels {
 public:
  explicit FaceLabels(Coder& coder) : coder_(coder) {}

  bool code_flipped(bool flipped) {
    flipped = flipped_[history_].code(coder_, flipped);
    history_ = (history_ << 1 | static_cast<unsigned>(flipped)) & 7;
    return flipped;
  }
  uint32_t code_block(uint32_t block) {
    if (!same_[was_same_].code(coder_, block == block_)) {
      was_same_ = 0;
      return block_ = other_.code(coder_, block);
    }
    was_same_ = 1;
    return block_;
  }

 private:
  Coder& coder_;
  std::array<BitModel, 8> flipped_;
  std::array<BitModel, 2> same_;
  CountModel other_;
  unsigned history_ = 0;
  unsigned was_same_ = 0;
  uint32_t block_ = 0;
};

/// Loose cells, one block after the other: types and sizes where they vary; nodes as repeats within the cell
/// or steps from the node before. The coder's state goes on from block to block. docs/format.md, 12.5.
template <class Coder>
class LooseCellCoder {
 public:
  LooseCellCoder(Coder& coder, uint32_t points) : coder_(coder), points_(points) {}

  CellType code_type(CellType block_type, CellType type) {
    if (block_type != CellType::mixed) return block_type;
    const bool same = same_type_.code(coder_, type == type_);
    if (!same) type_ = static_cast<CellType>(other_type_.code(coder_, static_cast<uint32_t>(type)) & 0xff);
    return type_;
  }
  /// A claimed size reserves nothing: nodes are read one by one, and the stream ends first.
  uint32_t code_size(CellType type, uint32_t size) {
    return nodes_of(type) != 0 ? nodes_of(type) : size_.code(coder_, size);
  }

  /// One node of a cell whose earlier nodes are `before`. Gives `points` for a node that is not there.
  uint32_t code_node(std::span<const uint32_t> before, uint32_t node) {
    // Cells can have millions of nodes, so only the last ones are looked at: 200,000 nodes in a line took 9.4
    // s to decode without this, 0.04 s with it (0a1fb87). Part of the format.
    before = before.last(std::min<size_t>(before.size(), 256));
    const auto repeated = std::find(before.rbegin(), before.rend(), node);
    const unsigned position = static_cast<unsigned>(std::min<size_t>(before.size(), 7));
    if (!before.empty() && repeat_[position].code(coder_, repeated != before.rend())) {
      const uint32_t back = which_.code(coder_, static_cast<uint32_t>(repeated - before.rbegin()));
      // points_ stands for a node that is not there, which the caller refuses.
      return back < before.size() ? before[before.size() - 1 - back] : points_;
    }
    const auto step = static_cast<int32_t>(node - last_);
    const uint32_t zigzag = static_cast<uint32_t>(step) << 1 ^ static_cast<uint32_t>(step >> 31);
    const uint32_t coded = step_[position].code(coder_, zigzag);
    // Wraps, so any step is defined.
    last_ += coded >> 1 ^ (0 - (coded & 1));
    return std::min(last_, points_);
  }

 private:
  Coder& coder_;
  uint32_t points_;
  uint32_t last_ = 0;
  CellType type_ = CellType::vertex;
  BitModel same_type_;
  CountModel other_type_;
  CountModel size_;
  std::array<BitModel, 8> repeat_;
  CountModel which_;
  std::array<CountModel, 8> step_;
};

/// One list of fields for reader and writer, with the largest value of each.
template <class Visitor>
void visit_header(Visitor&& visit, ConnectivityHeader& header) {
  visit(header.components, none);
  visit(header.regular_valence, 0xffff);
  visit(header.regular_degree, max_degree);
}

void write_header(ByteWriter& out, ConnectivityHeader header, bool chosen) {
  visit_header([&](uint32_t value, uint32_t) { out.put_count(value); }, header);
  out.put(static_cast<uint8_t>(header.uniform_degree | header.has_border << 1 | chosen << 2));
}

Result<ConnectivityHeader> read_header(ByteReader& in, bool& chosen) {
  ConnectivityHeader header;
  bool fits = true;
  visit_header(
      [&](uint32_t& value, uint32_t most) {
        const uint64_t found = in.get_count();
        fits = fits && found <= most;
        value = static_cast<uint32_t>(found);
      },
      header);
  const auto flags = in.get<uint8_t>();
  header.uniform_degree = (flags & 1) != 0;
  header.has_border = (flags & 2) != 0;
  chosen = (flags & 4) != 0;
  if (!in.ok() || !fits || flags > 7 || header.regular_degree < 3) return corrupt("impossible header");
  return header;
}

// Labels of faces are coded only where they say something.
constexpr uint8_t with_flips = 1;
constexpr uint8_t with_blocks = 2;

std::vector<std::byte> encode_labels(const PatchTopology& topology) {
  ByteWriter out;
  out.put(static_cast<uint8_t>((topology.flipped.empty() ? 0 : with_flips) |
                               (topology.face_block.empty() ? 0 : with_blocks)));
  RansEncoder encoder;
  FaceLabels<RansEncoder> labels(encoder);
  for (uint32_t face = 0; face < topology.surface.face_count; ++face) {
    if (!topology.flipped.empty()) labels.code_flipped(topology.flipped[face]);
    if (!topology.face_block.empty()) labels.code_block(topology.face_block[face]);
  }
  out.put_bytes(encoder.finish());
  return out.take();
}

Result<> decode_labels(Bytes bytes, size_t blocks, PatchTopology& topology) {
  ByteReader in(bytes);
  const auto flags = in.get<uint8_t>();
  if (!in.ok() || flags > (with_flips | with_blocks)) return corrupt("unknown labels of faces");
  RansDecoder decoder(in.get_bytes(in.remaining()));
  FaceLabels<RansDecoder> labels(decoder);
  const uint32_t faces = topology.surface.face_count;
  if ((flags & with_flips) != 0) topology.flipped.resize(faces);
  if ((flags & with_blocks) != 0) topology.face_block.resize(faces);
  for (uint32_t face = 0; face < faces; ++face) {
    if ((flags & with_flips) != 0) topology.flipped[face] = labels.code_flipped(false);
    if ((flags & with_blocks) != 0) topology.face_block[face] = labels.code_block(0);
    if (topology.block_of_face(face) >= blocks) return corrupt("a face of a block that is not there");
  }
  // Behind the loop, as faces are there already and bound it.
  if (decoder.exhausted()) return corrupt("the stream of face labels ends early");
  return {};
}

}  // namespace

std::vector<std::byte> encode_loose(const PatchTopology& topology, const Mesh& mesh) {
  RansEncoder encoder;
  LooseCellCoder<RansEncoder> coder(encoder, topology.points);
  const LooseCells& loose = topology.loose;
  for (uint32_t i = 0; i < loose.size(); ++i) {
    const std::span nodes(loose.nodes.data() + loose.offsets[i], loose.offsets[i + 1] - loose.offsets[i]);
    const CellType type =
        coder.code_type(mesh.blocks[loose.block[i]].type, static_cast<CellType>(loose.type[i]));
    coder.code_size(type, static_cast<uint32_t>(nodes.size()));
    for (size_t k = 0; k < nodes.size(); ++k) coder.code_node(nodes.first(k), nodes[k]);
  }
  return encoder.finish();
}

namespace {

/// Can a face of this degree be in the block?
bool takes_face(const BlockShape& block, unsigned degree) {
  return is_face(block.type) && (nodes_of(block.type) == 0 || nodes_of(block.type) == degree);
}

/// How many cells of each block the faces on the surface leave over: these are loose. Refuses faces that
/// their block cannot take, so that no count wraps.
Result<std::vector<uint64_t>> cells_left(std::span<const BlockShape> blocks, const PatchTopology& topology,
                                         std::span<const uint32_t> offsets) {
  const PatchSurface& surface = topology.surface;
  std::vector<uint64_t> left;
  for (const BlockShape& block : blocks) left.push_back(block.cells);
  if (surface.face_count == 0) return left;
  if (blocks.empty()) return corrupt("faces without a block");
  const bool triangles = surface.half_edges.all_triangles() && offsets.empty();
  if (topology.face_block.empty() && (triangles || blocks[0].type == CellType::polygon)) {
    if (!takes_face(blocks[0], 3)) return corrupt("a face in a block of another type");
    if (surface.face_count > left[0]) return corrupt("more faces than a block has");
    left[0] -= surface.face_count;
    return left;
  }
  for (uint32_t face = 0; face < surface.face_count; ++face) {
    const uint32_t block = topology.block_of_face(face);
    if (left[block]-- == 0) return corrupt("more faces than a block has");
    const unsigned degree =
        offsets.empty() ? surface.half_edges.degree(surface.face(face)) : offsets[face + 1] - offsets[face];
    if (!takes_face(blocks[block], degree)) return corrupt("a face in a block of another type");
  }
  return left;
}

}  // namespace

Result<> decode_loose(Bytes bytes, std::span<const BlockShape> blocks, uint64_t corners,
                      PatchTopology& topology, std::span<const uint32_t> offsets) {
  const std::vector<uint64_t> left = MAILLE_TRY(cells_left(blocks, topology, offsets));
  RansDecoder decoder(bytes);
  LooseCellCoder<RansDecoder> coder(decoder, topology.points);
  LooseCells& loose = topology.loose;
  for (uint32_t block = 0; block < blocks.size(); ++block) {
    for (uint64_t i = 0; i < left[block]; ++i) {
      const CellType type = coder.code_type(blocks[block].type, CellType::vertex);
      if (blocks[block].type == CellType::mixed && !is_type_of_cell(type))
        return corrupt("a cell of an unknown type");
      const uint32_t size = coder.code_size(type, 0);
      for (uint32_t k = 0; k < size; ++k) {
        const uint32_t node = coder.code_node(std::span(loose.nodes).last(k), 0);
        if (node >= topology.points) return corrupt("a cell with a point that is not there");
        if (decoder.exhausted() || loose.nodes.size() >= corners)
          return corrupt("the stream of loose cells ends early");
        loose.nodes.push_back(node);
      }
      if (decoder.exhausted()) return corrupt("the stream of loose cells ends early");
      loose.block.push_back(block);
      loose.type.push_back(static_cast<uint8_t>(type));
      loose.offsets.push_back(static_cast<uint32_t>(loose.nodes.size()));
    }
  }
  return {};
}

namespace {

/// Numbers the points of the surface as coded.
void number_points(const CodedConnectivity& coded, EncodedTopology& result) {
  const PatchSurface& surface = result.topology.surface;
  std::vector<uint32_t>& sources = result.sources.points;
  sources.assign(surface.point_count, none);
  for (uint32_t vertex = 0; vertex < surface.vertices.size(); ++vertex) {
    sources[surface.point(vertex)] = coded.points[vertex];
  }
}

/// Where the faces of the surface come from. Half-edges of real faces still stand where the corners of
/// `faces` do, those of flipped faces in reverse behind the first.
void trace_faces(const Mesh& mesh, const SimpleFaces& faces, const GluedSurface& glued,
                 EncodedTopology& result) {
  PatchTopology& topology = result.topology;
  const Faces view = faces.view(topology.points);
  std::vector<uint32_t> face_at;  // by half-edge; triangles do without
  for (uint32_t face = 0; face < view.size() && !faces.offsets.empty(); ++face) {
    face_at.resize(view.first(face + 1), face);
  }
  CellTable cells;  // where a face is its cell, nothing need be looked up
  if (!faces.cell.empty()) cells = table_cells(mesh);
  for (const uint32_t h : topology.surface.faces) {
    const uint32_t face = face_at.empty() ? h / 3 : face_at[h];
    const uint32_t cell = faces.cell_of(face);
    const uint32_t degree = view.first(face + 1) - view.first(face);
    uint32_t corner = h - view.first(face);
    if (!glued.flipped.empty()) {
      topology.flipped.push_back(glued.flipped[face]);
      if (glued.flipped[face]) corner = (degree - corner) % degree;
    }
    result.sources.cells.push_back(cell);
    result.sources.first_corner.push_back((cells.corner.empty() ? view.first(face) : cells.corner[cell]) +
                                          corner);
    if (mesh.blocks.size() > 1) topology.face_block.push_back(cells.block[cell]);
  }
}

}  // namespace

void append_other_points(const Mesh& mesh, PatchSources& sources) {
  std::vector<bool> used(mesh.point_count());
  for (const uint32_t point : sources.points) used[point] = true;
  const auto append = [&](uint32_t point) {
    if (!used[point]) sources.points.push_back(point);
    used[point] = true;
  };
  for_each_cell(mesh, [&](uint32_t b, uint64_t i, uint32_t, uint32_t) {
    if (in_surface(mesh.blocks[b], i)) return;
    for (const uint32_t point : mesh.blocks[b].cell(i)) append(point);
  });
  const size_t before = sources.points.size();
  for (uint32_t point = 0; point < used.size(); ++point) append(point);
  sources.unused_points = static_cast<uint32_t>(sources.points.size() - before);
}

void collect_loose(const Mesh& mesh, PatchTopology& topology, PatchSources& sources) {
  std::vector<uint32_t> number;  // of points in coded order
  for_each_cell(mesh, [&](uint32_t b, uint64_t i, uint32_t cell, uint32_t corner) {
    if (in_surface(mesh.blocks[b], i)) return;
    if (number.empty()) {
      number.resize(topology.points);
      for (uint32_t point = 0; point < topology.points; ++point) number[sources.points[point]] = point;
    }
    LooseCells& loose = topology.loose;
    loose.block.push_back(b);
    loose.type.push_back(static_cast<uint8_t>(type_of(mesh.blocks[b], i)));
    for (const uint32_t point : mesh.blocks[b].cell(i)) loose.nodes.push_back(number[point]);
    loose.offsets.push_back(static_cast<uint32_t>(loose.nodes.size()));
    sources.cells.push_back(cell);
    sources.first_corner.push_back(corner);
  });
}

/// The front: glue, code connectivity, then which vertices are one point, then faces in coded order with
/// their labels, and what is left.
Result<EncodedTopology> encode_topology(const Mesh& mesh) {
  MAILLE_CHECK(check_patch_size(mesh));
  EncodedTopology result;
  PatchTopology& topology = result.topology;
  const SimpleFaces faces = collect_faces(mesh);
  const auto points = static_cast<uint32_t>(mesh.point_count());
  const Faces view = faces.view(points);
  topology.points = points;
  GluedSurface glued = glue(view);
  CodedConnectivity coded = encode_connectivity(glued.half_edges, glued.real_half_edges, points);

  PatchSurface& surface = topology.surface;
  surface.half_edges = std::move(glued.half_edges);
  surface.vertices = std::move(coded.vertices);
  const auto identity = encode_point_identity(surface.half_edges, surface.vertices, coded.points,
                                              surface.point_of, surface.point_count);
  surface.faces = order_faces(surface, coded.first_half_edges, glued.chosen);
  surface.face_count = static_cast<uint32_t>(surface.faces.size());
  number_points(coded, result);
  append_other_points(mesh, result.sources);

  trace_faces(mesh, faces, glued, result);
  collect_loose(mesh, topology, result.sources);

  ByteWriter out;
  write_header(out, coded.header, glued.chosen);
  put_section(out, coded.bytes);
  put_section(out, identity);
  put_section(out, encode_labels(topology));
  put_section(out, encode_loose(topology, mesh));
  result.bytes = out.take();
  return result;
}

void find_corner_sources(const Mesh& mesh, EncodedTopology& encoded) {
  const CellTable cells = table_cells(mesh);
  const PatchTopology& topology = encoded.topology;
  const HalfEdges& edges = topology.surface.half_edges;
  std::vector<uint32_t>& corners = encoded.sources.corners;
  corners.assign(edges.size(), none);
  for (uint32_t face = 0; face < topology.surface.face_count; ++face) {
    const uint32_t base = cells.corner[encoded.sources.cells[face]];
    const uint32_t degree = edges.degree(topology.surface.face(face));
    uint32_t corner = encoded.sources.first_corner[face] - base;
    for (uint32_t i = 0, h = topology.surface.face(face); i < degree; ++i, h = edges.next(h)) {
      corners[h] = base + corner;
      // Corners of a flipped face run the other way in the mesh.
      corner = (corner + (topology.is_flipped(face) ? degree - 1 : 1)) % degree;
    }
  }
  const uint32_t faces = topology.surface.face_count;
  for (uint32_t i = 0; i < topology.loose.size(); ++i) {
    const uint32_t size = topology.loose.offsets[i + 1] - topology.loose.offsets[i];
    for (uint32_t k = 0; k < size; ++k) corners.push_back(encoded.sources.first_corner[faces + i] + k);
  }
}

Result<PatchTopology> decode_topology(Bytes bytes, std::span<const BlockShape> blocks, uint32_t points,
                                      uint64_t corners, bool with_faces) {
  PatchTopology topology;
  topology.points = points;
  ByteReader in(bytes);
  bool chosen = false;
  const ConnectivityHeader header = MAILLE_TRY(read_header(in, chosen));
  const Bytes connectivity = in.get_bytes(in.get_count());
  const Bytes identity = in.get_bytes(in.get_count());
  const Bytes labels = in.get_bytes(in.get_count());
  const Bytes loose = in.get_bytes(in.get_count());
  if (!in.ok() || in.remaining() != 0) return corrupt("the stream has the wrong length");
  if (corners >= most_patch_corners) return corrupt("more corners than a patch may have");

  // Every border edge adds a triangle, so half-edges are at most four for each corner, and below 2^31 as
  // corners are below 2^29. Room for a sixty-fourth of border is reserved at first.
  auto decoded = MAILLE_TRY(decode_connectivity(header, connectivity, static_cast<uint32_t>(4 * corners),
                                                static_cast<uint32_t>(corners + corners / 64)));
  PatchSurface& surface = topology.surface;
  surface.half_edges = std::move(decoded.surface);
  surface.vertices = std::move(decoded.vertices);
  MAILLE_CHECK(decode_point_identity(surface.half_edges, surface.vertices, identity, surface.point_of,
                                     surface.point_count));
  if (surface.point_count > points) return corrupt("more points than the mesh has");
  // Then cells can be assembled from half-edges without a list of faces: 8 bytes a vertex less, dragon
  // decodes 9 % faster (9b6b0c8).
  const bool plain = surface.half_edges.all_triangles() && !chosen && blocks.size() == 1 &&
                     blocks[0].type == CellType::triangle && labels.size() == 1 && loose.empty();
  if (plain && (!header.has_border || !with_faces)) {
    surface.face_count = count_real_triangles(surface.half_edges);
  } else {
    std::vector<uint32_t> order;
    for (uint32_t h = 0; h < surface.half_edges.size(); h += surface.half_edges.degree(h)) order.push_back(h);
    surface.faces = order_faces(surface, order, chosen);
    surface.face_count = static_cast<uint32_t>(surface.faces.size());
  }
  MAILLE_CHECK(decode_labels(labels, blocks.size(), topology));
  MAILLE_CHECK(decode_loose(loose, blocks, corners, topology));
  return topology;
}

}  // namespace maille
