#include <algorithm>
#include <memory>

#include "base/result.h"
#include "generate/transfinite_block.h"
#include "generate/transfinite_cell.h"
#include "generate/transfinite_order.h"
#include "generate/transfinite_topology.h"

namespace maille {

namespace {

using Place = SweepOrder::Place;

/// Numbers and last cells of a row of points, from which cells are made without asking for each point again.
struct PointRow {
  std::vector<uint64_t> number;
  std::vector<uint64_t> last_cell;
};

/// Points of blocks, made when they are first asked for: tables of a block take memory only while it is
/// swept.
class BlockTables {
 public:
  BlockTables(const BlockDescription& description, const BlockTopology& topology, const Surfaces& surfaces)
      : description_(description),
        topology_(topology),
        surfaces_(surfaces),
        tables_(description.blocks.size()) {}

  Result<const BlockPoints*> of(uint32_t block) {
    if (tables_[block] == nullptr) {
      tables_[block] = std::make_unique<BlockPoints>(
          MAILLE_TRY(BlockPoints::make(description_, topology_, surfaces_, block)));
      held_.push_back(block);
    }
    return tables_[block].get();
  }
  /// Frees all tables: a sweep needs its own blocks and those around it, and the next one others.
  void forget() {
    for (const uint32_t block : held_) tables_[block].reset();
    held_.clear();
  }

 private:
  const BlockDescription& description_;
  const BlockTopology& topology_;
  const Surfaces& surfaces_;
  std::vector<std::unique_ptr<BlockPoints>> tables_;
  std::vector<uint32_t> held_;
};

/// Corners of a face of a block, seen from outside: first of x, last of x, first of y, ...
constexpr unsigned face_corners[6][4] = {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4},
                                         {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}};

/// Hands faces with the points that they have to the output, in runs of one type.
class FaceRuns {
 public:
  FaceRuns(uint32_t patch, GeneratedOutput& output) : patch_(patch), output_(output) {}
  /// `number_of` a corner of the cell.
  template <class NumberOf>
  Result<> put(unsigned face, NumberOf number_of) {
    std::array<uint64_t, 4> corners{};
    size_t count = 0;
    for (const unsigned corner : face_corners[face]) {
      const uint64_t point = number_of(corner);
      const auto end = corners.begin() + static_cast<ptrdiff_t>(count);
      if (std::find(corners.begin(), end, point) == end) corners[count++] = point;
    }
    if (count < 3) return {};  // collapsed to a line
    const CellType type = count == 3 ? CellType::triangle : CellType::quad;
    if (type != type_) MAILLE_CHECK(flush());
    type_ = type;
    kept_.insert(kept_.end(), corners.begin(), corners.begin() + static_cast<ptrdiff_t>(count));
    return {};
  }
  Result<> flush() {
    if (kept_.empty()) return {};
    const auto put = output_.faces(patch_, type_, kept_);
    kept_.clear();
    return put;
  }

 private:
  uint32_t patch_;
  GeneratedOutput& output_;
  CellType type_ = CellType::quad;
  std::vector<uint64_t> kept_;
};

/// Makes the points, faces and cells of one block, a layer at a time. Memory is four rows of numbers beside
/// the block's tables. Every point comes before the first cell that has it.
class BlockSweeper {
 public:
  BlockSweeper(const SweepOrder& order, uint32_t block, BlockTables& tables, GeneratedOutput& output,
               bool with_faces)
      : order_(order),
        block_(block),
        n_(order.divisions(block)),
        swept_(order.swept(block)),
        tables_(tables),
        repeats_points_(order.topology().repeats_points(block)),
        output_(output),
        with_faces_(with_faces) {
    for (unsigned corner = 0; corner < 8; ++corner) {
      // VTK's corners by their places along the axes of the sweep.
      const unsigned y = corner >> 1 & 1;
      const std::array<unsigned, 3> at{(corner & 1) ^ y, y, corner >> 2};
      step_[corner] = at[swept_.axis[0]];
      row_of_[corner] = at[swept_.axis[1]] + 2 * (at[swept_.axis[2]] ^ (swept_.backwards ? 1u : 0u));
    }
  }

  Result<> layer(uint32_t layer) {
    // Points of a layer come with the cells in front of it, and those of the first with the first cells
    // (SweepOrder).
    if (layer == 0) MAILLE_CHECK(make_points(0));
    MAILLE_CHECK(make_points(layer + 1));
    number_row(0, layer, rows_[0]);
    number_row(0, layer + 1, rows_[2]);
    for (uint32_t row = 0; row < n_[1]; ++row) {
      number_row(row + 1, layer, rows_[1]);
      number_row(row + 1, layer + 1, rows_[3]);
      if (with_faces_) MAILLE_CHECK(make_faces(row, layer));
      MAILLE_CHECK(make_cells(row, layer));
      std::swap(rows_[0], rows_[1]);
      std::swap(rows_[2], rows_[3]);
    }
    return {};
  }

 private:
  Result<> make_points(uint32_t layer) {
    const uint32_t layer_class = SweepOrder::class_of(layer, n_[2]);
    for (uint32_t row = 0; row <= n_[1]; ++row) {
      const uint32_t row_class = SweepOrder::class_of(row, n_[1]);
      const bool first = order_.owns(block_, {0, row_class, layer_class});
      const bool between = n_[0] > 1 && order_.owns(block_, {1, row_class, layer_class});
      const bool last = order_.owns(block_, {2, row_class, layer_class});
      if (!first && !between && !last) continue;
      coordinates_.clear();
      if (first) MAILLE_CHECK(place_points(0, 0, row, layer));
      if (between) MAILLE_CHECK(place_points(1, n_[0] - 1, row, layer));
      if (last) MAILLE_CHECK(place_points(n_[0], n_[0], row, layer));
      const uint64_t number = order_.owned_number(block_, {first ? 0 : between ? 1 : n_[0], row, layer});
      MAILLE_CHECK(output_.points(number, coordinates_));
    }
    return {};
  }

  bool alone(uint32_t at, uint32_t row, uint32_t layer) const {
    const Place classes{SweepOrder::class_of(at, n_[0]), SweepOrder::class_of(row, n_[1]),
                        SweepOrder::class_of(layer, n_[2])};
    return order_.topology().alone(order_.node(block_, classes));
  }

  // Places points of one node. Where a node belongs to several blocks, the last of them says where its points
  // are, in any order of blocks, so that both orders give the same bits.
  Result<> place_points(uint32_t from, uint32_t to, uint32_t row, uint32_t layer) {
    if (alone(from, row, layer)) {
      Place at{};
      at[swept_.axis[1]] = row;
      at[swept_.axis[2]] = swept_.backwards ? n_[2] - layer : layer;
      MAILLE_TRY(tables_.of(block_))->row(at, swept_.axis[0], from, to, coordinates_);
      return {};
    }
    for (uint32_t i = from; i <= to; ++i) {
      const SweepOrder::Origin origin = order_.origin(block_, {i, row, layer});
      const BlockPoints* const points = MAILLE_TRY(tables_.of(origin.block));
      points->row(origin.at, 0, origin.at[0], origin.at[0], coordinates_);
    }
    return {};
  }

  void number_row(uint32_t row, uint32_t layer, PointRow& out) const {
    out.number.resize(size_t{n_[0]} + 1);
    out.last_cell.resize(size_t{n_[0]} + 1);
    const auto set = [&](uint32_t i) {
      const SweepOrder::Point point = order_.point(block_, {i, row, layer});
      out.number[i] = point.number;
      out.last_cell[i] = point.last_cell;
    };
    set(0);
    set(n_[0]);
    if (n_[0] == 1) return;
    if (!alone(1, row, layer)) {
      for (uint32_t i = 1; i < n_[0]; ++i) set(i);
    } else {
      // Nobody else has them: points and cells count on along the row.
      const SweepOrder::Point point = order_.point(block_, {1, row, layer});
      for (uint32_t i = 1; i < n_[0]; ++i) {
        out.number[i] = point.number + (i - 1);
        out.last_cell[i] = point.last_cell + (i - 1);
      }
    }
  }

  uint64_t number_at(unsigned corner, uint32_t i) const {
    return rows_[row_of_[corner]].number[i + step_[corner]];
  }

  Result<> make_cells(uint32_t row, uint32_t layer) {
    nodes_.resize(8 * size_t{n_[0]});
    last_use_.resize(nodes_.size());
    const uint64_t first_cell = order_.cell(block_, {0, row, layer});
    for (unsigned corner = 0; corner < 8; ++corner) {
      const PointRow& points = rows_[row_of_[corner]];
      const uint64_t* const number = points.number.data() + step_[corner];
      const uint64_t* const last = points.last_cell.data() + step_[corner];
      for (size_t i = 0; i < n_[0]; ++i) {
        nodes_[8 * i + corner] = number[i];
        last_use_[8 * i + corner] = last[i] == first_cell + i ? 1 : 0;
      }
    }
    return repeats_points_ ? put_reduced() : output_.cells(block_, CellType::hexahedron, nodes_, last_use_);
  }

  // Puts runs of cells of one type. A point that a cell has twice is used last at its last place.
  Result<> put_reduced() {
    kept_.clear();
    kept_last_use_.clear();
    CellType type = CellType::hexahedron;
    for (size_t i = 0; i < n_[0]; ++i) {
      const ReducedCell cell = reduce_hexahedron(nodes_.data() + 8 * i);
      if (cell.type != type && !kept_.empty()) MAILLE_CHECK(flush(type));
      type = cell.type;
      for (unsigned k = 0; k < cell.count; ++k) {
        const uint64_t node = nodes_[8 * i + cell.corner[k]];
        bool again = false;
        for (unsigned j = k + 1; j < cell.count; ++j) again = again || nodes_[8 * i + cell.corner[j]] == node;
        kept_.push_back(node);
        kept_last_use_.push_back(again ? 0 : last_use_[8 * i + cell.corner[k]]);
      }
    }
    return flush(type);
  }

  Result<> flush(CellType type) {
    const auto put = output_.cells(block_, type, kept_, kept_last_use_);
    kept_.clear();
    kept_last_use_.clear();
    return put;
  }

  Result<> make_faces(uint32_t row, uint32_t layer) {
    const Place first{0, row, layer};
    for (unsigned a = 0; a < 3; ++a) {
      for (unsigned end = 0; end < 2; ++end) {
        const bool backwards = a == 2 && swept_.backwards;
        const unsigned face = 2u * swept_.axis[a] + (end ^ (backwards ? 1u : 0u));
        const int32_t patch = order_.topology().patch[block_][face];
        if (patch < 0 || (a > 0 && first[a] != (end == 0 ? 0 : n_[a] - 1))) continue;
        const uint32_t from = a == 0 && end == 1 ? n_[0] - 1 : 0;
        const uint32_t to = a == 0 && end == 0 ? 1 : n_[0];
        MAILLE_CHECK(put_faces(static_cast<uint32_t>(patch), face, from, to));
      }
    }
    return {};
  }

  Result<> put_faces(uint32_t patch, unsigned face, uint32_t from, uint32_t to) {
    FaceRuns runs(patch, output_);
    for (uint32_t i = from; i < to; ++i)
      MAILLE_CHECK(runs.put(face, [&](unsigned corner) { return number_at(corner, i); }));
    return runs.flush();
  }

  const SweepOrder& order_;
  const uint32_t block_;
  const Place n_;
  const SweepPlan::Block& swept_;
  BlockTables& tables_;
  const bool repeats_points_;
  GeneratedOutput& output_;
  const bool with_faces_;
  std::array<unsigned, 8> step_{};    ///< of a corner along the row
  std::array<unsigned, 8> row_of_{};  ///< of the four of a row of cells
  std::array<PointRow, 4> rows_;      ///< this and the next row of points; the same in the next layer
  std::vector<double> coordinates_;
  std::vector<uint64_t> nodes_;
  std::vector<uint8_t> last_use_;
  std::vector<uint64_t> kept_;
  std::vector<uint8_t> kept_last_use_;
};

/// Puts the faces of one side of a block in blockMesh's order, found by comparing: of x along y, then z; of y
/// along z, then x; of z along y, then x. For plans block by block, whose axes are the block's.
Result<> put_side(const SweepOrder& order, uint32_t block, unsigned side, FaceRuns& runs) {
  constexpr unsigned fast[3] = {1, 2, 1}, slow[3] = {2, 0, 0};
  const unsigned axis = side / 2;
  const Place n = order.divisions(block);
  Place cell{};
  cell[axis] = side % 2 == 0 ? 0 : n[axis] - 1;
  for (uint32_t j = 0; j < n[slow[axis]]; ++j) {
    for (uint32_t i = 0; i < n[fast[axis]]; ++i) {
      cell[fast[axis]] = i;
      cell[slow[axis]] = j;
      MAILLE_CHECK(runs.put(side, [&](unsigned corner) {
        const unsigned y = corner >> 1 & 1;
        return order.point(block, {cell[0] + ((corner & 1) ^ y), cell[1] + y, cell[2] + (corner >> 2)})
            .number;
      }));
    }
  }
  return {};
}

/// Puts faces patch by patch, sides of blocks as the patch names them; those of the default patch block by
/// block.
Result<> put_patches(const BlockDescription& description, const SweepOrder& order, GeneratedOutput& output) {
  const BlockTopology& topology = order.topology();
  for (uint32_t patch = 0; patch < topology.patches.size(); ++patch) {
    FaceRuns runs(patch, output);
    std::vector<std::pair<uint32_t, unsigned>> sides;
    for (uint32_t block = 0; block < topology.patch.size(); ++block) {
      for (unsigned side = 0; side < 6; ++side) {
        if (topology.patch[block][side] == static_cast<int32_t>(patch)) sides.emplace_back(block, side);
      }
    }
    const auto place = [&](const std::pair<uint32_t, unsigned>& side) {
      if (patch >= description.patches.size()) return size_t{0};
      const auto& faces = description.patches[patch].faces;
      const auto found = std::find_if(faces.begin(), faces.end(), [&](const auto& face) {
        return BlockPoints::has_corners(description.blocks[side.first], side.second / 2, side.second % 2,
                                        face);
      });
      return static_cast<size_t>(found - faces.begin());
    };
    std::stable_sort(sides.begin(), sides.end(),
                     [&](const auto& a, const auto& b) { return place(a) < place(b); });
    for (const auto& [block, side] : sides) MAILLE_CHECK(put_side(order, block, side, runs));
    MAILLE_CHECK(runs.flush());
  }
  return {};
}

Result<> sweep_together(const SweepOrder& order, const SweepPlan::Sweep& sweep, BlockTables& tables,
                        bool with_faces, GeneratedOutput& output) {
  std::vector<BlockSweeper> blocks;
  blocks.reserve(sweep.blocks.size());
  for (const SweepPlan::Block& b : sweep.blocks)
    blocks.emplace_back(order, b.block, tables, output, with_faces);
  for (uint32_t layer = 0; layer < sweep.layers; ++layer) {
    for (BlockSweeper& block : blocks) MAILLE_CHECK(block.layer(layer));
  }
  return {};
}

/// Each projected face must be one of a block, as blockMesh has it, too: else it is a slip of the pen.
Result<> check_projected_faces(const BlockDescription& description) {
  for (const ProjectedFace& face : description.projected_faces) {
    const bool found =
        std::any_of(description.blocks.begin(), description.blocks.end(), [&](const auto& block) {
          for (unsigned side = 0; side < 6; ++side) {
            if (BlockPoints::has_corners(block, side / 2, side % 2, face.corners)) return true;
          }
          return false;
        });
    if (found) continue;
    std::string corners;
    for (const uint32_t corner : face.corners)
      corners += (corners.empty() ? "" : " ") + std::to_string(corner);
    return failure(ErrorCode::malformed_input, "the projected face (" + corners + ") is no face of a block");
  }
  return {};
}

Result<BlockTopology> checked_topology(const BlockDescription& description, uint32_t refine) {
  BlockTopology topology = MAILLE_TRY(join_blocks(description, refine));
  double cells = 0;
  for (const auto& n : topology.divisions) cells += (n[0] + 1.0) * (n[1] + 1.0) * (n[2] + 1.0);
  // In doubles, which do not wrap around; all numbers below fit 64 bits then.
  if (cells >= 0x1p62) return failure(ErrorCode::unsupported, "more than 2^62 cells");
  return topology;
}

}  // namespace

Result<> generate(const BlockDescription& given, const GenerateOptions& options, GeneratedOutput& output) {
  const Surfaces surfaces = MAILLE_TRY(Surfaces::make(given));
  MAILLE_CHECK(check_projected_faces(given));
  BlockDescription description = given;
  description.surfaces.clear();
  for (const ProjectedVertex& projected : given.projected_vertices) {
    Position& at = description.vertices[projected.vertex];
    at = surfaces.project(at, projected.surfaces);
  }
  const BlockTopology topology = MAILLE_TRY(checked_topology(description, options.refine));
  const SweepOrder order(topology,
                         options.streaming_order ? plan_streaming(topology) : plan_block_by_block(topology));
  MAILLE_CHECK(output.begin({order.points(), order.cells(), topology.patches}));
  BlockTables tables(description, topology, surfaces);
  const bool faces_last = options.faces_last && !options.streaming_order;
  for (const SweepPlan::Sweep& sweep : order.plan().sweeps) {
    MAILLE_CHECK(sweep_together(order, sweep, tables, !faces_last, output));
    tables.forget();
  }
  if (faces_last) return put_patches(description, order, output);
  return {};
}

}  // namespace maille
