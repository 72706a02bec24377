#include "random/build/level_pieces.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/bytes.h"
#include "base/result.h"
#include "base/sort_unique.h"
#include "mesh/ranked_set.h"
#include "random/build/sampled_maps.h"
#include "random/mesh_geometry.h"

namespace maille {
namespace {

/// Points, faces and arrays of one piece, all with numbers of its own.
struct Piece {
  CellType type = CellType::triangle;
  std::vector<uint32_t> first;  ///< of faces; empty: triangles
  FaceLists faces;
  std::vector<ArrayToCode> arrays;
  const LocalPositions* positions = nullptr;
  LevelVertices vertices;
  std::span<const uint32_t> ids;
  std::span<const uint32_t> cell_ids;  ///< of a window, if the order is kept
};

/// Some faces as a mesh of their own, whose points are those of the faces and `more`. Without faces it has no
/// block, as charts have none without cells.
MeshPart part_of(const Piece& piece, const FaceLists& faces, std::span<const uint32_t> chosen,
                 std::span<const uint32_t> more) {
  MeshPart part;
  CellBlock block;
  block.type = piece.type;
  if (nodes_of(piece.type) == 0) block.offsets.push_back(0);
  std::vector<uint32_t> nodes;
  for (const uint32_t face : chosen) {
    const auto corners = faces.face(face);
    nodes.insert(nodes.end(), corners.begin(), corners.end());
    part.numbers.cells.push_back(face);
    part.numbers.first_corner.push_back(static_cast<uint32_t>(corners.data() - faces.corners.data()));
    if (nodes_of(piece.type) == 0) block.offsets.push_back(nodes.size());
  }
  const size_t corners = nodes.size();
  nodes.insert(nodes.end(), more.begin(), more.end());
  part.numbers.points = rank_all(nodes);
  part.mesh.points.resize(part.numbers.points.size());
  if (chosen.empty()) return part;
  nodes.resize(corners);
  block.connectivity = std::move(nodes);
  part.mesh.blocks.push_back(std::move(block));
  part.block_numbers = {0};
  return part;
}

/// Points that several charts have, or other pieces.
struct SharedBy {
  std::vector<uint8_t> charts;  ///< by point: how many, up to 2
  std::span<const uint8_t> outside;
  std::span<const uint32_t> copies;

  /// Numbers are those of the chart, in the order of its points; copies tell apart points that lie at one
  /// place.
  std::vector<SharedPoint> of(std::span<const uint32_t> points) const {
    std::vector<SharedPoint> shared;
    for (uint32_t i = 0; i < points.size(); ++i) {
      if (charts[points[i]] > 1 || outside[points[i]] != 0) shared.push_back({i, copies[points[i]]});
    }
    return shared;
  }
};

/// How many charts have each point, up to 2. Points of no face are in the first chart alone.
void count_charts(const Piece& piece, std::span<const Chart> charts, std::span<const uint32_t> unused,
                  std::vector<uint8_t>& count) {
  std::vector<uint32_t> last(count.size(), no_group);
  for (const uint32_t point : unused) count[point] = 1;
  for (uint32_t i = 0; i < charts.size(); ++i) {
    for (const uint32_t face : charts[i].faces) {
      for (const uint32_t v : piece.faces.face(face)) {
        if (std::exchange(last[v], i) != i) count[v] = static_cast<uint8_t>(std::min(count[v] + 1, 2));
      }
    }
  }
}

ElementOrder order_of(const Piece& piece, const PatchSources& sources) {
  ElementOrder order;
  for (const uint32_t point : sources.points) order.points.push_back(piece.ids[point]);
  for (size_t i = 0; i < sources.cells.size(); ++i) {
    const uint32_t cell = sources.cells[i];
    const auto first = piece.faces.face(cell).data() - piece.faces.corners.data();
    order.cells.push_back(piece.cell_ids[cell]);
    order.rotation.push_back(sources.first_corner[i] - static_cast<uint32_t>(first));
  }
  return order;
}

Result<ChartOfPiece> code_chart(const Piece& piece, const PieceRules& rules, MeshPart part,
                                const Chart& chart, const SharedBy* shared) {
  // Charts of level 0 know which of their points are shared; coarser ones are joined by equal values alone
  // (join_levels()), and have tables of their own.
  const uint32_t set = shared != nullptr ? 0 : 1;
  ChartOfPiece coded;
  coded.sphere = chart.sphere;
  coded.extent.faces = static_cast<uint32_t>(part.numbers.cells.size());
  std::vector<uint32_t> corners;
  for (const CellBlock& block : part.mesh.blocks) {
    for (const uint32_t v : block.connectivity) corners.push_back(part.numbers.points[v]);
  }
  coded.extent.box = box_in_space(corners, *piece.positions, chart.sphere.centre + rules.origin);
  EncodedPatch patch =
      MAILLE_TRY(encode_chart(part.mesh, part.numbers, piece.arrays, rules.of_chart, rules.tables[set]));
  if (shared != nullptr) {
    patch.arrays.resize(patch.arrays.size() + rules.mesh_arrays);
    const std::vector<SharedPoint> points = shared->of(patch.sources.points);
    coded.bytes = chart_bytes(counts_of(part), rules.blocks, patch, points);
    if (rules.of_chart.order == Order::keep) coded.order = order_of(piece, patch.sources);
  } else {
    coded.bytes = chart_bytes(counts_of(part), 1, patch, std::nullopt);
  }
  coded.topology = patch.topology.bytes.size();
  for (const CodedStream& stream : patch.arrays) coded.arrays.push_back(stream.bytes.size());
  return coded;
}

/// Charts at once; the error of the first that has one.
template <class Part>
Result<std::vector<ChartOfPiece>> code_all(const Piece& piece, const PieceRules& rules,
                                           std::span<const Chart> charts, Part part_at,
                                           const SharedBy* shared, Executor& executor) {
  std::vector<Result<ChartOfPiece>> results(charts.size());
  executor.parallel_for(
      charts.size(), [&](size_t i) { results[i] = code_chart(piece, rules, part_at(i), charts[i], shared); });
  std::vector<ChartOfPiece> coded;
  for (size_t i = 0; i < results.size(); ++i) {
    coded.push_back(MAILLE_TRY(std::move(results[i])));
    coded.back().triangles = count_triangles(piece.faces, charts[i]);
  }
  return coded;
}

CoarseChart coarse_chart(const Piece& piece, const Chart& chart, const std::vector<uint8_t>& border) {
  CoarseChart coarse;
  coarse.sphere = chart.sphere;
  coarse.triangles = chart.triangles;
  std::vector<uint32_t> vertices = rank_all(coarse.triangles);
  // Own points of a window come before those of others, whatever their numbers.
  std::vector<uint32_t> order(vertices.size()), place(vertices.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(),
            [&](uint32_t a, uint32_t b) { return piece.ids[vertices[a]] < piece.ids[vertices[b]]; });
  for (uint32_t i = 0; i < order.size(); ++i) place[order[i]] = i;
  for (uint32_t& v : coarse.triangles) v = place[v];
  for (uint32_t& v : order) v = vertices[v];
  vertices = std::move(order);
  for (const uint32_t v : vertices) {
    coarse.ids.push_back(piece.ids[v]);
    if (border[v] != 0) coarse.border.push_back(piece.ids[v]);
  }
  for (const ArrayToCode& coded : piece.arrays) {
    if (coded.array->domain != Domain::point) continue;
    const size_t size = coded.array->tuple_size();
    for (const uint32_t v : vertices) {
      const std::byte* const tuple = coded.array->bytes.data() + v * size;
      coarse.tuples.insert(coarse.tuples.end(), tuple, tuple + size);
    }
  }
  return coarse;
}

std::vector<GroupOfPiece> simplify(const Piece& piece, std::span<const Chart> charts, const PieceRules& rules,
                                   bool alone, Executor& executor) {
  auto groups = simplify_charts(piece.faces, piece.vertices, charts, alone, rules.sizes, executor);
  std::vector<uint32_t> last(piece.ids.size(), no_group);
  std::vector<uint8_t> border(piece.vertices.held.begin(), piece.vertices.held.end());
  uint32_t number = 0;
  // A vertex that two output charts have, or other pieces, is a border: the next level must leave it where it
  // is, or there would be cracks between charts.
  for (const SimplifiedGroup& group : groups) {
    for (const Chart& chart : group.outputs) {
      for (const uint32_t v : chart.triangles) {
        if (last[v] != no_group && last[v] != number) border[v] = 1;
        last[v] = number;
      }
      ++number;
    }
  }
  std::vector<GroupOfPiece> result;
  for (SimplifiedGroup& group : groups) {
    GroupOfPiece& made = result.emplace_back();
    made.inputs = std::move(group.inputs);
    made.view_error = group.view_error;
    made.bound = group.bound;
    for (const Chart& chart : group.outputs) made.outputs.push_back(coarse_chart(piece, chart, border));
  }
  return result;
}

Piece piece_of(const WindowMesh& window, const PieceRules& rules) {
  Piece piece;
  const CellBlock& block = window.mesh.blocks[0];
  piece.type = block.type;
  if (nodes_of(block.type) != 3) {
    const auto degree = static_cast<uint32_t>(nodes_of(block.type));
    for (uint64_t i = 0; i <= block.size(); ++i)
      piece.first.push_back(static_cast<uint32_t>(degree == 0 ? block.offsets[i] : i * degree));
  }
  piece.faces = {block.connectivity, piece.first};
  piece.arrays.push_back(piece_to_code(window.mesh.points, rules.maps[0]));
  for (size_t i = 0; i < window.mesh.arrays.size(); ++i)
    piece.arrays.push_back(piece_to_code(window.mesh.arrays[i], rules.maps[i + 1]));
  piece.positions = &window.positions;
  piece.vertices = {window.positions.numbers, window.class_of, window.held};
  piece.ids = window.ids;
  piece.cell_ids = window.cell_ids;
  return piece;
}

/// Charts of a coarser level joined to one piece: the mesh behind it must stay.
struct JoinedCharts {
  std::vector<uint32_t> ids;
  std::vector<Array> arrays;  ///< of points, positions first
  LocalPositions positions;
  std::vector<uint32_t> class_of;
  std::vector<uint8_t> held;
  std::vector<Chart> charts;
};

JoinedCharts join(std::span<const CoarseChart> charts, std::span<const uint32_t> held,
                  const PieceRules& rules) {
  JoinedCharts joined;
  for (const CoarseChart& chart : charts)
    joined.ids.insert(joined.ids.end(), chart.ids.begin(), chart.ids.end());
  sort_unique(joined.ids);
  for (const Array& array : rules.arrays) {
    if (array.domain != Domain::point) continue;
    joined.arrays.push_back(array);
    joined.arrays.back().resize(joined.ids.size());
  }
  for (const CoarseChart& coarse : charts) {
    std::vector<uint32_t> place;
    for (const uint32_t id : coarse.ids) {
      const auto at = std::lower_bound(joined.ids.begin(), joined.ids.end(), id) - joined.ids.begin();
      place.push_back(static_cast<uint32_t>(at));
    }
    const std::byte* from = coarse.tuples.data();
    for (Array& array : joined.arrays) {
      const size_t size = array.tuple_size();
      for (size_t i = 0; i < place.size(); ++i, from += size)
        std::copy_n(from, size, array.bytes.data() + place[i] * size);
    }
    Chart& chart = joined.charts.emplace_back();
    chart.level = 1;
    chart.sphere = coarse.sphere;
    for (const uint32_t v : coarse.triangles) chart.triangles.push_back(place[v]);
  }
  joined.positions =
      local_positions(piece_to_code(joined.arrays[0], rules.maps[0]), rules.origin, serial_executor());
  joined.class_of.resize(joined.ids.size());
  std::iota(joined.class_of.begin(), joined.class_of.end(), 0u);
  for (const uint32_t id : joined.ids)
    joined.held.push_back(std::binary_search(held.begin(), held.end(), id));
  return joined;
}

Piece piece_of(const JoinedCharts& joined, const PieceRules& rules) {
  Piece piece;
  size_t next = 0;
  for (size_t i = 0; i < rules.arrays.size(); ++i) {
    if (rules.arrays[i].domain == Domain::point)
      piece.arrays.push_back(piece_to_code(joined.arrays[next++], rules.maps[i]));
  }
  piece.positions = &joined.positions;
  piece.vertices = {joined.positions.numbers, joined.class_of, joined.held};
  piece.ids = joined.ids;
  return piece;
}

MeshPart coarse_part(const Piece& piece, const Chart& chart) {
  std::vector<uint32_t> all(chart.triangles.size() / 3);
  std::iota(all.begin(), all.end(), 0u);
  return part_of(piece, {chart.triangles, {}}, all, {});
}

template <class T>
void put_vector(ByteWriter& out, const std::vector<T>& numbers) {
  out.put_count(numbers.size());
  out.put_bytes(std::as_bytes(std::span(numbers)));
}
template <class T>
/// Of bytes that pack() made in this process, so counts are believed.
std::vector<T> get_vector(ByteReader& in) {
  std::vector<T> numbers(in.get_count());
  const Bytes bytes = in.get_bytes(numbers.size() * sizeof(T));
  std::copy(bytes.begin(), bytes.end(), std::as_writable_bytes(std::span(numbers)).begin());
  return numbers;
}

/// So many triangles around one in the middle of the list: charts of them are shaped as in the whole.
std::vector<uint32_t> ball_of_triangles(const Piece& piece, uint64_t most) {
  const std::span<const uint32_t> corners = piece.faces.corners;
  const uint32_t count = piece.faces.size();
  if (count <= most) return {corners.begin(), corners.end()};
  const auto place = [&](uint32_t face) {
    return finite_position(piece.positions->numbers, corners[size_t{3} * face]);
  };
  const Vector3 middle = place(count / 2);
  std::vector<std::pair<double, uint32_t>> order;
  for (uint32_t i = 0; i < count; ++i) {
    const Vector3 step = place(i) - middle;
    order.emplace_back(dot(step, step), i);
  }
  std::nth_element(order.begin(), order.begin() + static_cast<ptrdiff_t>(most), order.end());
  order.resize(most);
  std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  std::vector<uint32_t> chosen;
  for (const auto& [distance, number] : order) {
    const auto face = corners.subspan(size_t{3} * number, 3);
    chosen.insert(chosen.end(), face.begin(), face.end());
  }
  return chosen;
}

}  // namespace

std::vector<std::byte> pack(const CoarseChart& chart) {
  ByteWriter out;
  put_vector(out, chart.ids);
  put_vector(out, chart.tuples);
  put_vector(out, chart.triangles);
  return out.take();
}

CoarseChart unpack_chart(Bytes bytes) {
  ByteReader in(bytes);
  CoarseChart chart;
  chart.ids = get_vector<uint32_t>(in);
  chart.tuples = get_vector<std::byte>(in);
  chart.triangles = get_vector<uint32_t>(in);
  return chart;
}

Result<> sample_window(const WindowMesh& window, uint64_t faces, PieceRules& rules) {
  Piece piece = piece_of(window, rules);
  if (piece.type != CellType::triangle) return {};
  const std::vector<uint32_t> corners = ball_of_triangles(piece, faces);
  piece.faces = {corners, {}};
  for (const Chart& chart : cut_into_charts(piece.faces, piece.vertices, rules.sizes)) {
    const MeshPart part = part_of(piece, piece.faces, chart.faces, {});
    MAILLE_CHECK(rules.tables[0].add(part.mesh, part.numbers.points, window.mesh.points));
  }
  return {};
}

Result<> sample_chart(const CoarseChart& chart, PieceRules& rules) {
  const JoinedCharts joined = join({&chart, 1}, {}, rules);
  const MeshPart part = coarse_part(piece_of(joined, rules), joined.charts[0]);
  return rules.tables[1].add(part.mesh, part.numbers.points, joined.arrays[0]);
}

Result<LevelPiece> code_window(const WindowMesh& window, const PieceRules& rules, bool alone,
                               Executor& executor) {
  const Piece piece = piece_of(window, rules);
  LevelPiece result;
  result.rounding = window.positions.rounding;
  std::vector<Chart> charts = cut_into_charts(piece.faces, piece.vertices, rules.sizes, executor);
  // Points alone need a chart, too.
  if (charts.empty() && (alone || !window.unused.empty())) charts.emplace_back();
  SharedBy shared{std::vector<uint8_t>(window.ids.size()), window.outside, window.copies};
  const auto part_at = [&](size_t i) {
    return part_of(piece, piece.faces, charts[i].faces,
                   i == 0 ? std::span<const uint32_t>(window.unused) : std::span<const uint32_t>());
  };
  count_charts(piece, charts, window.unused, shared.charts);
  result.charts = MAILLE_TRY(code_all(piece, rules, charts, part_at, &shared, executor));
  if (!alone || charts.size() > 1) result.groups = simplify(piece, charts, rules, alone, executor);
  return result;
}

Result<LevelPiece> code_charts(std::span<const CoarseChart> charts, std::span<const uint32_t> held,
                               const PieceRules& rules, bool alone, Executor& executor) {
  const JoinedCharts joined = join(charts, held, rules);
  const Piece piece = piece_of(joined, rules);
  LevelPiece result;
  result.rounding = joined.positions.rounding;
  const auto part_at = [&](size_t i) { return coarse_part(piece, joined.charts[i]); };
  result.charts = MAILLE_TRY(code_all(piece, rules, joined.charts, part_at, nullptr, executor));
  if (!alone || charts.size() > 1) result.groups = simplify(piece, joined.charts, rules, alone, executor);
  return result;
}

}  // namespace maille
