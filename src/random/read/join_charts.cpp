#include "random/read/join_charts.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <tuple>

#include "base/bytes.h"
#include "base/result.h"
#include "description/remains.h"
#include "mesh/empty_like.h"
#include "random/read/random_reader.h"
#include "surface/parts/merge_parts.h"

namespace maille {

JoinedPoints join_charts(std::span<const DecodedChart> charts) {
  std::vector<PieceOfPoints> pieces;
  for (const DecodedChart& chart : charts) pieces.push_back(piece_of_points(chart.mesh.points, chart.shared));
  return join_points(pieces);
}

namespace {

/// A chart of level 0 without any cells or points.
/// It stands in where nothing was selected or nothing is left, so that the result still has the arrays of the
/// mesh.
DecodedChart empty_chart(const Description& description, const DecodeOptions& options) {
  DecodedChart chart;
  chart.mesh.points = empty_like(description.positions);
  for (const ArrayDescription& described : description.arrays) {
    if (is_wanted(options, described.name)) chart.mesh.arrays.push_back(empty_like(described));
  }
  return chart;
}

Mesh join(std::vector<DecodedChart> charts, const Description& description, Executor& executor) {
  const JoinedPoints joined = join_charts(charts);
  std::vector<PartToMerge> parts;
  for (DecodedChart& chart : charts) parts.push_back({std::move(chart.mesh), std::move(chart.block_numbers)});
  Mesh mesh = merge_parts(std::move(parts), description.blocks, joined, executor);
  mesh.metadata = description.metadata;
  return mesh;
}

}  // namespace

Result<Mesh> join_finest(std::vector<DecodedChart> charts, const RandomReader& reader,
                         const DecodeOptions& options, std::vector<std::string>* problems) {
  if (charts.empty()) charts.push_back(empty_chart(reader.description(), options));
  Executor& executor = options.executor == nullptr ? serial_executor() : *options.executor;
  Mesh mesh = join(std::move(charts), reader.description(), executor);
  auto arrays = reader.read_mesh_arrays(mesh);
  if (arrays) return mesh;
  if (problems == nullptr || !is_loss(arrays.error())) return tl::unexpected(std::move(arrays).error());
  problems->push_back(arrays.error().message);
  // Reading stops at the first array that is damaged; all arrays of the mesh are left out then.
  std::erase_if(mesh.arrays, [](const Array& array) { return array.domain == Domain::mesh; });
  return mesh;
}

namespace {

/// Points of all charts as rows of bytes: position, then the arrays of points.
class PointRows {
 public:
  explicit PointRows(std::span<const DecodedChart> charts) {
    for (const DecodedChart& chart : charts) {
      first_.push_back(count_);
      count_ += static_cast<uint32_t>(chart.mesh.point_count());
    }
    add(charts, [](const Mesh& mesh) -> const Array& { return mesh.points; });
    for (size_t i = 0; i < charts[0].mesh.arrays.size(); ++i) {
      const Array& array = charts[0].mesh.arrays[i];
      if (array.domain == Domain::point)
        add(charts, [&](const Mesh& mesh) -> const Array& { return *mesh.find(array.name, Domain::point); });
    }
  }

  uint32_t first_of(size_t chart) const { return first_[chart]; }
  /// For each row the number of its first equal one among those that stay; fills `kept` with the rows that
  /// do.
  std::vector<uint32_t> join(std::vector<uint32_t>& kept) const {
    std::vector<uint32_t> order(count_);
    std::iota(order.begin(), order.end(), 0u);
    const auto compare = [this](uint32_t a, uint32_t b) {
      for (const Column& column : columns_) {
        const int difference =
            std::memcmp(&column.bytes[a * column.size], &column.bytes[b * column.size], column.size);
        if (difference != 0) return difference;
      }
      return 0;
    };
    std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
      const int difference = compare(a, b);
      return difference != 0 ? difference < 0 : a < b;
    });
    std::vector<uint32_t> first(count_);
    for (size_t i = 0; i < order.size(); ++i) {
      first[order[i]] = i > 0 && compare(order[i], order[i - 1]) == 0 ? first[order[i - 1]] : order[i];
    }
    std::vector<uint32_t> number(count_);
    for (uint32_t row = 0; row < count_; ++row) {
      if (first[row] == row) {
        number[row] = static_cast<uint32_t>(kept.size());
        kept.push_back(row);
      } else {
        number[row] = number[first[row]];
      }
    }
    return number;
  }
  /// Positions, then arrays of points.
  std::vector<Array> take(const std::vector<uint32_t>& kept) const {
    std::vector<Array> arrays;
    for (const Column& column : columns_) {
      Array& array = arrays.emplace_back(column.like);
      for (const uint32_t row : kept) {
        const auto begin = column.bytes.begin() + static_cast<ptrdiff_t>(row * column.size);
        array.bytes.insert(array.bytes.end(), begin, begin + static_cast<ptrdiff_t>(column.size));
      }
    }
    return arrays;
  }

 private:
  struct Column {
    Array like;
    size_t size;
    std::vector<std::byte> bytes;
  };
  template <class ArrayOf>
  void add(std::span<const DecodedChart> charts, ArrayOf array_of) {
    const Array& from = array_of(charts[0].mesh);
    Column column{empty_like(from), from.tuple_size(), {}};
    for (const DecodedChart& chart : charts) {
      const Array& array = array_of(chart.mesh);
      column.bytes.insert(column.bytes.end(), array.bytes.begin(), array.bytes.end());
    }
    columns_.push_back(std::move(column));
  }

  std::vector<uint32_t> first_;
  uint32_t count_ = 0;
  std::vector<Column> columns_;
};

/// Arrays of cells and corners that all charts have, for their faces one by one.
class FaceRows {
 public:
  explicit FaceRows(std::span<const DecodedChart> charts) {
    for (const Array& from : charts[0].mesh.arrays) {
      if (from.domain != Domain::cell && from.domain != Domain::corner) continue;
      const bool everywhere = std::all_of(charts.begin(), charts.end(), [&](const DecodedChart& chart) {
        return chart.mesh.find(from.name, from.domain) != nullptr;
      });
      if (everywhere) arrays_.push_back(empty_like(from));
    }
  }
  void begin(const Mesh& chart) {
    from_.clear();
    for (const Array& array : arrays_) from_.push_back(chart.find(array.name, array.domain));
  }
  void add(uint64_t cell, uint64_t first_corner, size_t corners) {
    for (size_t i = 0; i < arrays_.size(); ++i) {
      const bool of_cell = arrays_[i].domain == Domain::cell;
      const size_t size = arrays_[i].tuple_size();
      const Buffer<std::byte>& bytes = from_[i]->bytes;
      const auto begin = bytes.begin() + static_cast<ptrdiff_t>((of_cell ? cell : first_corner) * size);
      const auto end = begin + static_cast<ptrdiff_t>((of_cell ? 1 : corners) * size);
      arrays_[i].bytes.insert(arrays_[i].bytes.end(), begin, end);
    }
  }
  std::vector<Array> take() { return std::move(arrays_); }

 private:
  std::vector<Array> arrays_;
  std::vector<const Array*> from_;
};

}  // namespace

Mesh join_levels(std::span<const DecodedChart> charts) {
  Mesh mesh;
  if (charts.empty()) return mesh;
  const PointRows rows(charts);
  std::vector<uint32_t> kept;
  const std::vector<uint32_t> number = rows.join(kept);
  std::vector<Array> arrays = rows.take(kept);
  mesh.points = std::move(arrays[0]);
  mesh.arrays.assign(std::make_move_iterator(arrays.begin() + 1), std::make_move_iterator(arrays.end()));

  CellBlock& block = mesh.blocks.emplace_back();
  block.offsets.push_back(0);
  bool triangles = true;
  FaceRows face_rows(charts);
  for (size_t c = 0; c < charts.size(); ++c) {
    face_rows.begin(charts[c].mesh);
    uint64_t cell = 0, corner = 0;
    for (const CellBlock& from : charts[c].mesh.blocks) {
      for (uint64_t i = 0; i < from.size(); ++i, ++cell) {
        const auto nodes = from.cell(i);
        if (is_face(from.type_of(i))) {
          for (const uint32_t point : nodes) block.connectivity.push_back(number[rows.first_of(c) + point]);
          triangles = triangles && nodes.size() == 3;
          block.offsets.push_back(block.connectivity.size());
          face_rows.add(cell, corner, nodes.size());
        }
        corner += nodes.size();
      }
    }
  }
  for (Array& array : face_rows.take()) mesh.arrays.push_back(std::move(array));
  if (triangles) {
    block.type = CellType::triangle;
    block.offsets.clear();
  }
  return mesh;
}

}  // namespace maille
