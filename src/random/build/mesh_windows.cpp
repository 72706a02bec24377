#include "random/build/mesh_windows.h"

#include <cmath>
#include <cstring>
#include <numeric>
#include <string>

#include "base/pace.h"
#include "base/sort_unique.h"
#include "mesh/space_curve.h"
#include "random/build/level_builder.h"
#include "random/build/sampled_maps.h"
#include "random/mesh_geometry.h"
#include "surface/parts/coded_parts.h"

namespace maille {
namespace {

/// Rows are read in parts of this size, and temporary files are written through buffers of this size in all.
constexpr uint64_t rows_at_once = 1 << 14;
constexpr uint64_t buffer_memory = uint64_t{16} << 20;
/// Corners of a face vote for its window, which takes the square of their number. A face of more corners goes
/// to the window of its lowest point instead, so that a hostile face of a million corners takes no time.
constexpr size_t most_votes = 64;
/// Windows are numbered in 15 bits.
constexpr uint64_t most_windows = 0x7fff;

uint32_t number_in(const std::byte* from) {
  uint32_t number;
  std::memcpy(&number, from, sizeof number);
  return number;
}

/// What stands for each point of some that have all others at their places among them, and its number among
/// those of the same position. Points rise with their numbers in the mesh.
void find_coinciding(std::span<const float> positions, const std::vector<Place>& places,
                     std::vector<uint32_t>& lowest, std::vector<uint32_t>& copies) {
  lowest = lowest_at_place(positions);
  copies.assign(lowest.size(), 0);
  std::vector<uint32_t> several;
  std::vector<uint8_t> listed(lowest.size());
  for (uint32_t v = 0; v < lowest.size(); ++v) {
    if (lowest[v] == v) continue;
    several.push_back(v);
    if (!listed[lowest[v]]) several.push_back(lowest[v]);
    listed[lowest[v]] = 1;
  }
  std::sort(several.begin(), several.end(),
            [&](uint32_t a, uint32_t b) { return places[a] != places[b] ? places[a] < places[b] : a < b; });
  for (size_t i = 1; i < several.size(); ++i) {
    if (places[several[i]] == places[several[i - 1]]) copies[several[i]] = copies[several[i - 1]] + 1;
  }
}

/// Tuples of one array out of records of points or cells.
Array column_of(const Array& shape, std::span<const std::byte* const> tuples, size_t offset) {
  Array array = shape;
  const size_t size = array.tuple_size();
  array.bytes.resize(tuples.size() * size);
  for (size_t i = 0; i < tuples.size(); ++i)
    std::memcpy(array.bytes.data() + i * size, tuples[i] + offset, size);
  return array;
}

tl::unexpected<Error> refused(const char* what) {
  return failure(ErrorCode::unsupported, what);
}

}  // namespace

Result<MeshWindows> MeshWindows::distribute(MeshSource& mesh, const std::vector<ArrayMaps>& maps,
                                            uint64_t faces, bool numbered, const WorkingSpace& space,
                                            const Progress& progress) {
  MeshWindows windows(mesh, maps);
  windows.layout_.numbered = numbered;
  MAILLE_CHECK(windows.lay_out());
  MAILLE_CHECK(windows.measure());
  MAILLE_CHECK(windows.cut(faces));
  windows.points_ = MAILLE_TRY(SpilledParts::create(space.folder, windows.windows_, buffer_memory));
  windows.faces_ = MAILLE_TRY(SpilledParts::create(space.folder, windows.windows_, buffer_memory));
  MAILLE_CHECK(windows.deal_points(progress));
  MAILLE_CHECK(windows.deal_faces(progress));
  MAILLE_CHECK(windows.answer());
  return windows;
}

// Checks what the windows rely on, and lays out their records: one row for a point or face with its number
// and all its tuples, so that a window is read from one place.
Result<> MeshWindows::lay_out() {
  const MeshDescription& mesh = mesh_->description();
  if (mesh.blocks.size() > 1) return refused("out of memory, mode \"random\" takes one block of faces");
  if (mesh.points >= max_points || mesh.cells >= max_points)
    return refused("more than 2^32 - 2 points or faces are too many for mode \"random\"");
  // Windows are cut by a sample of points, which would be empty.
  if (mesh.points == 0 && mesh.cells != 0)
    return failure(ErrorCode::malformed_input, "the mesh has faces but no points");
  if (!mesh.blocks.empty()) {
    layout_.type = mesh.blocks[0].type;
    layout_.degree = nodes_of(layout_.type);
    const CellType type = layout_.type;
    if (type != CellType::triangle && type != CellType::quad && type != CellType::polygon)
      return refused("out of memory, mode \"random\" takes triangles, quads or polygons");
  }
  layout_.arrays.push_back(empty_array_of(mesh, positions_of_source));
  layout_.arrays.insert(layout_.arrays.end(), mesh.arrays.begin(), mesh.arrays.end());
  for (const Array& array : layout_.arrays) {
    if (array.domain != Domain::point && array.domain != Domain::cell)
      return refused("out of memory, mode \"random\" takes arrays of points and of faces");
  }
  for (const Array& array : layout_.arrays)
    (array.domain == Domain::point ? layout_.point_bytes : layout_.cell_bytes) += array.tuple_size();
  return {};
}

// A pass over the positions for their box. Points are placed on a curve of 2^20 steps along the longest side,
// which place_on_curve() can number in 64 bits.
Result<> MeshWindows::measure() {
  const Scalar type = mesh_->description().point_type;
  const uint64_t points = mesh_->description().points;
  const size_t number = size_of(type);
  std::vector<std::byte> bytes(rows_at_once * 3 * number);
  Vector3 low, high;
  for (uint64_t first = 0; first < points; first += rows_at_once) {
    const uint64_t count = std::min(rows_at_once, points - first);
    MAILLE_CHECK(mesh_->read_points(first, count, std::span(bytes).first(count * 3 * number)));
    for (size_t i = 0; i < 3 * count; ++i) {
      const double x = usable_number(type, bytes.data() + i * number);
      const size_t k = i % 3;
      low.x[k] = first + i < 3 ? x : std::min(low.x[k], x);
      high.x[k] = first + i < 3 ? x : std::max(high.x[k], x);
    }
  }
  if (!floats_hold(type)) origin_ = (low + high) * 0.5;
  box_ = {low - origin_, high - origin_};
  const Vector3 size = high - low;
  const double widest = std::max({size[0], size[1], size[2]});
  scale_ = widest > 0 ? 1048575.0 / widest : 0;
  return {};
}

uint64_t MeshWindows::key_of(const Vector3& position) const {
  return place_on_curve((position - box_.low) * scale_);
}

std::vector<uint64_t> MeshWindows::keys_of(const Array& positions) const {
  const LocalPositions local =
      local_positions(piece_to_code(positions, maps_->front()), origin_, serial_executor());
  std::vector<uint64_t> keys(positions.count());
  for (uint32_t i = 0; i < keys.size(); ++i) keys[i] = key_of(finite_position(local.numbers, i));
  return keys;
}

/// Where windows begin, by a sample of points.
Result<> MeshWindows::cut(uint64_t faces) {
  const MeshDescription& mesh = mesh_->description();
  const uint64_t wished = std::max(mesh.cells, mesh.points / 2) / faces + 1;
  if (wished > most_windows) return refused("the mesh is too large for mode \"random\"");
  if (wished == 1) return {};
  constexpr uint64_t at_once = 64;
  // About 2,560 points for each window, in stretches, since single points would cost a read each.
  const uint64_t stretches = std::min(std::max<uint64_t>(40 * wished, 1 << 10), mesh.points / at_once + 1);
  std::vector<uint64_t> sample;
  Array positions = layout_.arrays[0];
  for (uint64_t i = 0; i < stretches; ++i) {
    const uint64_t first = mesh.points / stretches * i;
    positions.resize(std::min(at_once, mesh.points - first));
    MAILLE_CHECK(mesh_->read_points(first, positions.count(), positions.bytes));
    const std::vector<uint64_t> keys = keys_of(positions);
    sample.insert(sample.end(), keys.begin(), keys.end());
  }
  std::sort(sample.begin(), sample.end());
  for (uint64_t i = 1; i < wished; ++i) cuts_.push_back(sample[i * sample.size() / wished]);
  // Many points at one place give equal cuts: fewer, larger windows then.
  cuts_.erase(std::unique(cuts_.begin(), cuts_.end()), cuts_.end());
  windows_ = static_cast<uint32_t>(cuts_.size() + 1);
  return {};
}

/// Sends each point to the window that its place on the curve belongs to, and remembers the window in two
/// bytes.
Result<> MeshWindows::deal_points(const Progress& progress) {
  const uint64_t points = mesh_->description().points;
  Pace pace(progress, "sorting points", points);
  std::vector<Array> columns;
  for (const Array& array : layout_.arrays) {
    if (array.domain == Domain::point) columns.push_back(array);
  }
  std::vector<std::byte> record(4 + layout_.point_bytes);
  owner_.reserve(points);
  for (uint64_t first = 0; first < points; first += rows_at_once) {
    const uint64_t count = std::min(rows_at_once, points - first);
    size_t column = 0;
    for (size_t i = 0; i < layout_.arrays.size(); ++i) {
      if (layout_.arrays[i].domain != Domain::point) continue;
      columns[column].resize(count);
      const size_t array = i == 0 ? positions_of_source : i - 1;
      MAILLE_CHECK(read_tuples_of(*mesh_, array, first, count, columns[column++].bytes));
    }
    const std::vector<uint64_t> keys = keys_of(columns[0]);
    for (uint64_t i = 0; i < count; ++i) {
      const auto window = std::upper_bound(cuts_.begin(), cuts_.end(), keys[i]) - cuts_.begin();
      owner_.push_back(static_cast<uint16_t>(window));
      const auto id = static_cast<uint32_t>(first + i);
      std::memcpy(record.data(), &id, 4);
      std::byte* to = record.data() + 4;
      for (const Array& each : columns)
        to = std::copy_n(each.bytes.data() + i * each.tuple_size(), each.tuple_size(), to);
      MAILLE_CHECK(points_->append(static_cast<size_t>(window), record));
      if (!pace.step()) return cancelled();
    }
  }
  return {};
}

Result<> MeshWindows::deal_faces(const Progress& progress) {
  const uint64_t cells = mesh_->description().cells;
  Pace pace(progress, "sorting faces", cells);
  foreign_.resize(windows_);
  answers_.resize(windows_);
  corners_.resize(windows_);
  std::vector<std::pair<size_t, Array>> columns;
  for (size_t i = 1; i < layout_.arrays.size(); ++i) {
    if (layout_.arrays[i].domain == Domain::cell) columns.emplace_back(i - 1, layout_.arrays[i]);
  }
  CellPiece piece;
  std::vector<std::byte> tuples(layout_.cell_bytes), record;
  for (uint64_t first = 0; first < cells; first += rows_at_once) {
    const uint64_t count = std::min(rows_at_once, cells - first);
    MAILLE_CHECK(mesh_->read_cells(first, count, piece));
    for (auto& [array, values] : columns) {
      values.resize(count);
      MAILLE_CHECK(mesh_->read_array(array, first, count, values.bytes));
    }
    for (uint64_t i = 0; i < count; ++i) {
      std::byte* to = tuples.data();
      for (const auto& [array, values] : columns)
        to = std::copy_n(values.bytes.data() + i * values.tuple_size(), values.tuple_size(), to);
      const std::span<const uint64_t> nodes =
          std::span(piece.connectivity).subspan(piece.offsets[i], piece.offsets[i + 1] - piece.offsets[i]);
      MAILLE_CHECK(deal_face(first + i, nodes, tuples, record));
      if (!pace.step()) return cancelled();
    }
  }
  return {};
}

/// To the window of most of its corners, of those the first in number: for triangles any two agree, or that
/// of the lowest point counts.
Result<> MeshWindows::deal_face(uint64_t face, std::span<const uint64_t> nodes, Bytes tuples,
                                std::vector<std::byte>& record) {
  if (layout_.degree != 0 && nodes.size() != layout_.degree)
    return failure(ErrorCode::malformed_input, "a face has another number of corners than its block");
  record.clear();
  const auto put = [&](uint32_t number) {
    record.resize(record.size() + sizeof number);
    std::memcpy(record.data() + record.size() - sizeof number, &number, sizeof number);
  };
  if (layout_.degree == 0) put(static_cast<uint32_t>(nodes.size()));
  uint16_t window = 0;
  size_t most = 0;
  uint64_t lowest = ~uint64_t{0};
  for (const uint64_t node : nodes) {
    if (node >= owner_.size()) {
      return failure(ErrorCode::malformed_input,
                     "a face names point " + std::to_string(node) + ", which is not there");
    }
    put(static_cast<uint32_t>(node));
    const uint16_t owner = owner_[node] & ~requested_bit & 0xffff;
    if (most > 0 && owner == window && node >= lowest) continue;
    size_t same = nodes.size() > most_votes ? 1 : 0;
    for (const uint64_t other : nodes.size() > most_votes ? std::span<const uint64_t>() : nodes)
      same += other < owner_.size() && (owner_[other] & ~requested_bit) == owner;
    if (same < most || (same == most && node >= lowest)) continue;
    window = owner;
    most = same;
    lowest = node;
  }
  for (const uint64_t node : nodes) {
    uint16_t& owner = owner_[node];
    const auto from = static_cast<uint16_t>(owner & ~requested_bit);
    if (from == window) continue;
    // The window of the face needs the point, and the window of the point must know that others have it: such
    // a point is shared, and is not moved by simplification.
    foreign_[window].push_back(static_cast<uint32_t>(node));
    if ((owner & requested_bit) == 0) answers_[from].push_back({static_cast<uint32_t>(node), 0, 0});
    owner = static_cast<uint16_t>(owner | requested_bit);
  }
  if (layout_.numbered) put(static_cast<uint32_t>(face));
  record.insert(record.end(), tuples.begin(), tuples.end());
  corners_[window] += nodes.size();
  return faces_->append(window, record);
}

/// What windows must know of points that others asked for.
Result<> MeshWindows::answer() {
  for (uint32_t window = 0; window < windows_; ++window) {
    sort_unique(foreign_[window]);
    std::vector<Answer>& answers = answers_[window];
    std::sort(answers.begin(), answers.end(), [](const Answer& a, const Answer& b) { return a.id < b.id; });
    if (answers.empty()) continue;
    const std::vector<std::byte> own = MAILLE_TRY(points_->load(window));
    const size_t stride = 4 + layout_.point_bytes;
    std::vector<const std::byte*> tuples;
    for (size_t at = 0; at < own.size(); at += stride) tuples.push_back(own.data() + at + 4);
    const Array positions = column_of(layout_.arrays[0], tuples, 0);
    const ArrayToCode coded = piece_to_code(positions, maps_->front());
    const LocalPositions local = local_positions(coded, origin_, serial_executor());
    std::vector<uint32_t> lowest, copies;
    find_coinciding(local.numbers, decoded_places(coded), lowest, copies);
    size_t next = 0;
    for (Answer& each : answers) {
      // Both are sorted by number, and each answer is for a point of this window; so the search goes on from
      // where the last one ended.
      while (number_in(own.data() + next * stride) != each.id) ++next;
      each.lowest = number_in(own.data() + lowest[next] * stride);
      each.copy = copies[next];
    }
  }
  return {};
}

Result<LoadedWindow> MeshWindows::load(uint32_t window) {
  LoadedWindow loaded;
  loaded.number = window;
  loaded.own = MAILLE_TRY(points_->load(window));
  loaded.faces = MAILLE_TRY(faces_->load(window));
  for (const Answer& each : answers_[window]) {
    loaded.requested_lowest.push_back(each.lowest);
  }
  sort_unique(loaded.requested_lowest);
  // With what stands for them, which must be there as well.
  const auto answer_for = [&](uint32_t id) -> const Answer& {
    const std::vector<Answer>& answers = answers_[owner_[id] & ~requested_bit];
    return *std::lower_bound(answers.begin(), answers.end(), id,
                             [](const Answer& a, uint32_t number) { return a.id < number; });
  };
  std::vector<Answer> found;
  for (const uint32_t id : foreign_[window]) found.push_back(answer_for(id));
  loaded.foreign_ids = foreign_[window];
  for (const Answer& each : found) loaded.foreign_ids.push_back(each.lowest);
  sort_unique(loaded.foreign_ids);
  loaded.foreign_lowest = loaded.foreign_ids;
  loaded.foreign_copies.assign(loaded.foreign_ids.size(), 0);
  for (const Answer& each : found) {
    const auto at = std::lower_bound(loaded.foreign_ids.begin(), loaded.foreign_ids.end(), each.id) -
                    loaded.foreign_ids.begin();
    loaded.foreign_lowest[static_cast<size_t>(at)] = each.lowest;
    loaded.foreign_copies[static_cast<size_t>(at)] = each.copy;
  }
  MAILLE_CHECK(read_foreign(loaded));
  return loaded;
}

/// Runs of numbers are read at once.
Result<> MeshWindows::read_foreign(LoadedWindow& window) {
  const std::vector<uint32_t>& ids = window.foreign_ids;
  window.foreign.resize(ids.size() * layout_.point_bytes);
  std::vector<std::byte> part;
  for (size_t begin = 0, end = 0; begin < ids.size(); begin = end) {
    // Gaps below 32 numbers are read along, and 4,096 rows are the most that is held. Both were chosen, not
    // swept.
    for (end = begin + 1; end < ids.size() && ids[end] - ids[end - 1] < 32 && ids[end] - ids[begin] < 4096;)
      ++end;
    const uint64_t count = uint64_t{ids[end - 1]} - ids[begin] + 1;
    size_t offset = 0;
    for (size_t a = 0; a < layout_.arrays.size(); ++a) {
      const Array& array = layout_.arrays[a];
      if (array.domain != Domain::point) continue;
      const size_t size = array.tuple_size();
      part.resize(count * size);
      MAILLE_CHECK(read_tuples_of(*mesh_, a == 0 ? positions_of_source : a - 1, ids[begin], count, part));
      for (size_t i = begin; i < end; ++i) {
        std::memcpy(window.foreign.data() + i * layout_.point_bytes + offset,
                    part.data() + (ids[i] - ids[begin]) * size, size);
      }
      offset += size;
    }
  }
  return {};
}

WindowMesh MeshWindows::mesh_of(LoadedWindow window) const {
  WindowMesh made;
  std::vector<const std::byte*> tuples;
  const size_t stride = 4 + layout_.point_bytes;
  for (size_t at = 0; at < window.own.size(); at += stride) {
    made.ids.push_back(number_in(window.own.data() + at));
    tuples.push_back(window.own.data() + at + 4);
  }
  const auto own = static_cast<uint32_t>(made.ids.size());
  made.ids.insert(made.ids.end(), window.foreign_ids.begin(), window.foreign_ids.end());
  for (size_t i = 0; i < window.foreign_ids.size(); ++i)
    tuples.push_back(window.foreign.data() + i * layout_.point_bytes);
  size_t offset = 0;
  for (size_t a = 0; a < layout_.arrays.size(); ++a) {
    const Array& array = layout_.arrays[a];
    Array column = array.domain == Domain::point ? column_of(array, tuples, offset) : array;
    if (array.domain == Domain::point) offset += array.tuple_size();
    if (a == 0) {
      made.mesh.points = std::move(column);
    } else {
      made.mesh.arrays.push_back(std::move(column));
    }
  }
  add_faces(window, own, made);
  find_identities(window, own, made);
  return made;
}

void MeshWindows::add_faces(const LoadedWindow& window, uint32_t own, WindowMesh& made) const {
  CellBlock& block = made.mesh.blocks.emplace_back();
  block.type = layout_.type;
  if (layout_.degree == 0) block.offsets.push_back(0);
  const auto own_end = made.ids.begin() + own;
  std::vector<uint8_t> used(own);
  std::vector<const std::byte*> tuples;
  const auto local = [&](uint32_t id) {
    const bool is_own = (owner_[id] & ~requested_bit) == window.number;
    const auto at = is_own ? std::lower_bound(made.ids.begin(), own_end, id)
                           : std::lower_bound(own_end, made.ids.end(), id);
    return static_cast<uint32_t>(at - made.ids.begin());
  };
  for (size_t at = 0; at < window.faces.size();) {
    size_t degree = layout_.degree;
    if (degree == 0) {
      degree = number_in(window.faces.data() + at);
      at += 4;
    }
    for (size_t k = 0; k < degree; ++k, at += 4) {
      const uint32_t v = local(number_in(window.faces.data() + at));
      block.connectivity.push_back(v);
      if (v < own) used[v] = 1;
    }
    if (layout_.degree == 0) block.offsets.push_back(block.connectivity.size());
    if (layout_.numbered) {
      made.cell_ids.push_back(number_in(window.faces.data() + at));
      at += 4;
    }
    tuples.push_back(window.faces.data() + at);
    at += layout_.cell_bytes;
  }
  size_t offset = 0;
  for (Array& array : made.mesh.arrays) {
    if (array.domain != Domain::cell) continue;
    array = column_of(array, tuples, offset);
    offset += array.tuple_size();
  }
  for (uint32_t v = 0; v < own; ++v) {
    if (used[v] == 0 && (owner_[made.ids[v]] & requested_bit) == 0) made.unused.push_back(v);
  }
}

/// Which points are one for coarser levels, and which other windows have.
void MeshWindows::find_identities(const LoadedWindow& window, uint32_t own, WindowMesh& made) const {
  const ArrayToCode coded = piece_to_code(made.mesh.points, maps_->front());
  made.positions = local_positions(coded, origin_, serial_executor());
  find_coinciding(std::span(made.positions.numbers).first(size_t{3} * own), decoded_places(coded),
                  made.class_of, made.copies);
  const std::vector<uint32_t>& others = window.foreign_ids;
  for (size_t i = 0; i < others.size(); ++i) {
    const auto at = std::lower_bound(others.begin(), others.end(), window.foreign_lowest[i]) - others.begin();
    made.class_of.push_back(own + static_cast<uint32_t>(at));
    made.copies.push_back(window.foreign_copies[i]);
  }
  made.outside.assign(made.ids.size(), 1);
  made.held.assign(made.ids.size(), 1);
  for (uint32_t v = 0; v < own; ++v) {
    made.outside[v] = (owner_[made.ids[v]] & requested_bit) != 0;
    made.held[v] =
        std::binary_search(window.requested_lowest.begin(), window.requested_lowest.end(), made.ids[v]);
  }
}

}  // namespace maille
