// Encodes meshes in memory as files of mode `random`.
#include <maille/version.h>

#include <algorithm>
#include <array>
#include <string>

#include "base/hash.h"
#include "base/result.h"
#include "description/element_order.h"
#include "mesh/ranked_set.h"
#include "random/build/build_hierarchy.h"
#include "random/build/hierarchy_index.h"
#include "random/build/random_writer.h"
#include "random/build/seams.h"
#include "random/chart_codec.h"
#include "random/random_file.h"
#include "random/read/join_charts.h"
#include "surface/arrays/array_report.h"
#include "surface/fans/shared_fans.h"
#include "surface/mesh_description.h"
#include "surface/parts/coded_parts.h"
#include "surface/parts/mesh_parts.h"

namespace maille {
namespace {

/// The faces of all blocks as one list; spans where the mesh has them so already.
struct AllFaces {
  std::vector<uint32_t> corners, first;
  FaceLists lists;
};

AllFaces all_faces(const Mesh& mesh) {
  AllFaces faces;
  if (mesh.blocks.size() == 1 && mesh.blocks[0].type == CellType::triangle) {
    faces.lists.corners = mesh.blocks[0].connectivity;
    return faces;
  }
  faces.first.push_back(0);
  for (const CellBlock& block : mesh.blocks) {
    faces.corners.insert(faces.corners.end(), block.connectivity.begin(), block.connectivity.end());
    for (uint64_t i = 0; i < block.size(); ++i) {
      faces.first.push_back(faces.first.back() + static_cast<uint32_t>(block.cell(i).size()));
    }
  }
  faces.lists = {faces.corners, faces.first};
  return faces;
}

/// A chart of a coarser level as a mesh of its own.
MeshPart coarse_part(const Chart& chart, std::span<const uint32_t> corners, const Seams& seams) {
  MeshPart part;
  std::vector<uint32_t> triangles = chart.triangles;
  for (size_t i = 0; i < chart.corners.size(); ++i) triangles[i] = seams.point_of[corners[chart.corners[i]]];
  part.numbers.points = rank_all(triangles);
  part.mesh.points.resize(part.numbers.points.size());
  // A chart has no blocks without cells.
  if (!triangles.empty()) {
    CellBlock& block = part.mesh.blocks.emplace_back();
    block.type = CellType::triangle;
    block.connectivity = std::move(triangles);
    part.block_numbers = {0};
  }
  for (uint32_t i = 0; i < chart.face_count(); ++i) {
    part.numbers.cells.push_back(chart.origins.empty() ? i : chart.origins[i]);
    part.numbers.first_corner.push_back(3 * i);
  }
  part.numbers.corners = chart.corners;
  return part;
}

Result<> check_cells(const Mesh& mesh) {
  uint64_t corners = 0;
  for (const CellBlock& block : mesh.blocks) {
    corners += block.connectivity.size();
    // Charts and seams number corners in 32 bits.
    if (corners > UINT32_MAX)
      return failure(ErrorCode::unsupported, "mode \"random\" holds 4,294,967,295 corners at most in memory");
    for (uint64_t i = 0; i < block.size(); ++i) {
      if (dimension_of(block.type_of(i)) < 3) continue;
      return failure(ErrorCode::unsupported,
                     "mode \"random\" holds surfaces; for volumes there is mode \"stream\"");
    }
  }
  return {};
}

/// The steps of run(), in order: numbers become codes, the hierarchy is built over the decoded positions (so
/// that errors are those of the file), each chart is coded as a patch of mode single, and the file is written
/// in one pass. All coded charts are in memory; random_source_encoder.cpp does without.
class RandomEncoder {
 public:
  RandomEncoder(const Mesh& mesh, const EncodeOptions& options, const HierarchyOptions& hierarchy)
      : mesh_(mesh),
        options_(options),
        building_(hierarchy),
        executor_(options.executor == nullptr ? serial_executor() : *options.executor) {}

  Result<EncodeReport> run(Sink& sink) {
    MAILLE_CHECK(validate(mesh_));
    MAILLE_CHECK(check_options(mesh_, options_));
    MAILLE_CHECK(check_cells(mesh_));
    arrays_ = MAILLE_TRY(map_arrays(mesh_, options_));
    const AllFaces faces = all_faces(mesh_);
    MAILLE_CHECK(build(faces.lists));
    MAILLE_CHECK(encode_charts(faces.lists.corners));
    make_charts();
    return write(sink);
  }

 private:
  Result<> build(const FaceLists& faces) {
    const LocalPositions positions = local_positions(arrays_[0], executor_);
    building_.executor = &executor_;
    building_.progress = options_.progress;
    const bool with_values = std::any_of(mesh_.arrays.begin(), mesh_.arrays.end(),
                                         [](const Array& array) { return array.domain != Domain::mesh; });
    if (with_values) seams_ = find_seams(mesh_, faces, decoded_places(arrays_[0]));
    building_.corner_values = seams_.values;
    hierarchy_ = MAILLE_TRY(
        build_hierarchy(faces, positions.numbers, static_cast<uint32_t>(mesh_.point_count()), building_));
    // Points alone need a chart, too.
    if (hierarchy_.charts.empty()) hierarchy_.charts.emplace_back();
    indexed_ = index_hierarchy(hierarchy_, faces, positions);
    return {};
  }

  // Charts of level 0 come first in the hierarchy, and take their faces from the mesh; all others are
  // triangles of their own. The two sets have tables of their own, because triangles of a finest level and of
  // simplified ones differ.
  Result<> encode_charts(std::span<const uint32_t> corners) {
    const size_t count = hierarchy_.charts.size();
    std::vector<uint32_t> part_of(mesh_.cell_count());
    for (uint32_t c = 0; c < count; ++c) {
      for (const uint32_t face : hierarchy_.charts[c].faces) part_of[face] = c;
    }
    MeshParts parts(mesh_, part_of, executor_);
    level_0_ = parts.count();
    patches_.resize(count);
    counts_.resize(count);
    const std::vector<ArrayToCode> coarse_arrays = arrays_of_level(arrays_, 1);
    const auto part_at = [&](size_t i) { return parts.take(i); };
    MAILLE_CHECK(encode_set(0, 0, level_0_, arrays_, part_at));
    return encode_set(1, level_0_, count, coarse_arrays,
                      [&](size_t i) { return coarse_part(hierarchy_.charts[i], corners, seams_); });
  }

  /// The charts from `begin` to `end`, with tables of theirs.
  template <class PartAt>
  Result<> encode_set(uint32_t set, size_t begin, size_t end, std::span<const ArrayToCode> arrays,
                      PartAt part_at) {
    // Charts are many: threads take one each, and none divides its own work or tells its progress.
    EncodeOptions of_chart = options_;
    of_chart.executor = nullptr;
    of_chart.progress = {};
    std::vector<Result<>> results(end - begin);
    // The error of the lowest chart is returned, so that it does not depend on threads.
    const auto for_each = [&](auto work) -> Result<> {
      executor_.parallel_for(end - begin, [&](size_t i) { results[i] = work(i); });
      for (const Result<>& result : results) MAILLE_CHECK(result);
      return {};
    };
    std::vector<MeshPart> parts(end - begin);
    MAILLE_CHECK(for_each([&](size_t i) -> Result<> {
      parts[i] = part_at(begin + i);
      return {};
    }));
    const SharedFanEncoder shared = MAILLE_TRY(make_tables(set, parts));
    const auto encode_all = [&](const SharedFanEncoder& tables) {
      return for_each([&](size_t i) -> Result<> {
        patches_[begin + i] =
            MAILLE_TRY(encode_chart(parts[i].mesh, parts[i].numbers, arrays, of_chart, tables));
        return {};
      });
    };
    MAILLE_CHECK(encode_all(shared));
    if (shared.is_for_polygons() && parts.size() <= few_charts) {
      const auto first = patches_.begin() + static_cast<ptrdiff_t>(begin);
      std::vector<EncodedPatch> sharing(
          std::make_move_iterator(first),
          std::make_move_iterator(first + static_cast<ptrdiff_t>(parts.size())));
      MAILLE_CHECK(encode_all({}));
      keep_smaller(set, std::move(sharing), begin);
    }
    std::transform(parts.begin(), parts.end(), counts_.begin() + static_cast<ptrdiff_t>(begin), counts_of);
    return {};
  }
  /// Tables of polygons have many symbols, and up to so many charts each may be smaller with its own: two of
  /// three such meshes are, by 1 to 2 %. More charts are not tried, as fitting takes longer than all else.
  static constexpr size_t few_charts = 12;
  /// Either the charts from `begin` on as they are, or those that share the tables of the set.
  void keep_smaller(uint32_t set, std::vector<EncodedPatch> sharing, size_t begin) {
    uint64_t alone = 0, together = tables_[set].size();
    for (size_t i = 0; i < sharing.size(); ++i) {
      alone += size_of_patch(patches_[begin + i]);
      together += size_of_patch(sharing[i]);
    }
    if (alone <= together) return tables_[set].clear();
    std::move(sharing.begin(), sharing.end(), patches_.begin() + static_cast<ptrdiff_t>(begin));
  }

  /// From some charts, evenly over all of them.
  Result<SharedFanEncoder> make_tables(uint32_t set, const std::vector<MeshPart>& parts) {
    SharedFanEncoder shared;
    if (!can_share_tables(arrays_[0])) return shared;
    const size_t count = std::min(parts.size(), most_sampled_patches);
    for (size_t i = 0; i < count; ++i) {
      // The middles of `count` equal stretches.
      const MeshPart& part = parts[(2 * i + 1) * parts.size() / (2 * count)];
      MAILLE_CHECK(shared.add(part.mesh, part.numbers.points, *arrays_[0].array));
    }
    tables_[set] =
        shared.finish(arrays_[0].maps, options_.effort, range_of_codes(arrays_[0]), arrays_[0].array);
    return shared;
  }

  void make_charts() {
    std::vector<std::span<const uint32_t>> points;
    for (size_t i = 0; i < level_0_; ++i) points.push_back(patches_[i].sources.points);
    const auto shared = find_shared(points, static_cast<uint32_t>(mesh_.point_count()),
                                    [&](uint32_t point) { return decoded_place(arrays_[0], point); });
    bytes_.resize(hierarchy_.charts.size());
    for (size_t i = 0; i < bytes_.size(); ++i) {
      bytes_[i] = i < level_0_ ? chart_bytes(counts_[i], mesh_.blocks.size(), patches_[i], shared[i])
                               : chart_bytes(counts_[i], 1, patches_[i], std::nullopt);
      count_bytes(i);
    }
    for (size_t g = 0; g < indexed_.groups.size(); ++g) {
      IndexedGroup& group = indexed_.groups[g];
      for (size_t i = 0; i < group.charts.size(); ++i) {
        const std::vector<std::byte>& bytes = bytes_[indexed_.charts[g][i]];
        group.charts[i].bytes = static_cast<uint32_t>(bytes.size());
        group.charts[i].check = static_cast<uint32_t>(hash64(bytes));
      }
    }
  }
  /// Sums for reports and for the directory, of the finest level and of all others.
  void count_bytes(size_t chart) {
    ChartTotals& totals = chart < level_0_ ? directory_.finest : directory_.coarser;
    totals.topology += patches_[chart].topology.bytes.size();
    totals.arrays.resize(std::max(totals.arrays.size(), patches_[chart].arrays.size()));
    uint64_t all = patches_[chart].topology.bytes.size();
    for (size_t i = 0; i < patches_[chart].arrays.size(); ++i) {
      totals.arrays[i] += patches_[chart].arrays[i].bytes.size();
      all += patches_[chart].arrays[i].bytes.size();
    }
    totals.other += bytes_[chart].size() - all;
  }

  void fill_directory() {
    directory_.levels = hierarchy_.levels();
    directory_.faces.resize(directory_.levels);
    directory_.charts.resize(directory_.levels);
    for (const Chart& chart : hierarchy_.charts) {
      directory_.faces[chart.level] += chart.face_count();
      ++directory_.charts[chart.level];
    }
    directory_.frame = indexed_.frame;
  }

  Result<EncodeReport> write(Sink& sink) {
    fill_directory();
    RandomContents contents;
    contents.description = describe(mesh_, arrays_, options_);
    contents.mesh_arrays = encode_mesh_arrays();
    contents.tables = tables_;
    contents.directory = directory_;
    contents.groups = indexed_.groups;
    contents.charts = [this](uint32_t g) -> Result<std::vector<std::byte>> {
      std::vector<std::byte> charts;
      for (const uint32_t chart : indexed_.charts[g])
        charts.insert(charts.end(), bytes_[chart].begin(), bytes_[chart].end());
      return charts;
    };
    FileWriter writer = MAILLE_TRY(write_random(sink, contents));
    EncodeReport report = report_of_charts();
    if (options_.order == Order::keep) {
      const std::vector<std::byte> order = encode_order(MAILLE_TRY(order_of_charts()));
      report.order_bytes = order.size();
      MAILLE_CHECK(writer.write_stream(random_order_key, order));
    }
    report.file_bytes = MAILLE_TRY(writer.finish());
    MAILLE_CHECK(sink.commit());
    set_other_bytes(report);
    return report;
  }

  std::vector<std::pair<uint32_t, std::vector<std::byte>>> encode_mesh_arrays() {
    std::vector<std::pair<uint32_t, std::vector<std::byte>>> coded;
    for (uint32_t i = 1; i < arrays_.size(); ++i) {
      if (arrays_[i].array->domain != Domain::mesh) continue;
      coded.emplace_back(i - 1, encode_mesh_array(arrays_[i]));
      mesh_array_bytes_.resize(arrays_.size());
      mesh_array_bytes_[i] = coded.back().second.size();
    }
    return coded;
  }

  EncodeReport report_of_charts() const {
    EncodeReport report = report_of(mesh_);
    report.connectivity.coded_bytes = directory_.finest.topology + directory_.coarser.topology;
    std::vector<uint64_t> bytes(arrays_.size());
    for (size_t i = 0; i < arrays_.size(); ++i) {
      bytes[i] = directory_.finest.arrays[i];
      if (!mesh_array_bytes_.empty()) bytes[i] += mesh_array_bytes_[i];
    }
    size_t coarse = 0;
    for (size_t i = 0; i < arrays_.size(); ++i) {
      if (arrays_[i].array->domain == Domain::mesh || directory_.coarser.arrays.empty()) continue;
      bytes[i] += directory_.coarser.arrays[coarse++];
    }
    report.positions = report_of(*arrays_[0].array, arrays_[0].maps, bytes[0]);
    for (size_t i = 1; i < arrays_.size(); ++i) {
      report.arrays.push_back(report_of(*arrays_[i].array, arrays_[i].maps, bytes[i]));
    }
    return report;
  }

  /// As decode_random() will have the elements: charts of level 0 in the order of the file.
  // Points get their final numbers only when charts are joined, which is done by decoded positions: so the
  // charts are decoded here once more, as a reader will.
  Result<ElementOrder> order_of_charts() {
    std::vector<PatchSources> sources;
    std::vector<DecodedChart> decoded;
    const ChartSet set = MAILLE_TRY(chart_set(describe(mesh_, arrays_, options_), 0, tables_[0]));
    for (size_t g = 0; g < indexed_.groups.size(); ++g) {
      for (const uint32_t chart : indexed_.charts[g]) {
        if (chart >= level_0_) continue;
        decoded.push_back(MAILLE_TRY(decode_chart(set, bytes_[chart], {})));
        sources.push_back(patches_[chart].sources);
      }
    }
    return original_order(mesh_, sources, join_charts(decoded));
  }

  const Mesh& mesh_;
  const EncodeOptions& options_;
  HierarchyOptions building_;
  Executor& executor_;
  std::vector<ArrayToCode> arrays_;
  Hierarchy hierarchy_;
  IndexedHierarchy indexed_;
  Seams seams_;
  size_t level_0_ = 0;
  std::vector<EncodedPatch> patches_;          ///< by chart
  std::vector<ChartCounts> counts_;            ///< by chart
  std::vector<std::vector<std::byte>> bytes_;  ///< by chart
  std::array<std::vector<std::byte>, chart_sets> tables_;
  std::vector<uint64_t> mesh_array_bytes_;
  ChartDirectory directory_;
};

}  // namespace

Result<EncodeReport> encode_random(const Mesh& mesh, Sink& sink, const EncodeOptions& options,
                                   const HierarchyOptions& hierarchy) {
  return RandomEncoder(mesh, options, hierarchy).run(sink);
}

}  // namespace maille
