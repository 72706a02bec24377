// Writes files of mode `random`: the directory, then groups of charts from coarse to fine.
#include <maille/version.h>

#include <algorithm>
#include <array>
#include <string>

#include "base/hash.h"
#include "base/result.h"
#include "container/file_writer.h"
#include "hierarchy/build_hierarchy.h"
#include "hierarchy/chart_codec.h"
#include "hierarchy/hierarchy_index.h"
#include "hierarchy/join_charts.h"
#include "hierarchy/random_file.h"
#include "hierarchy/random_layout.h"
#include "hierarchy/seams.h"
#include "surface/array_report.h"
#include "surface/coded_parts.h"
#include "surface/element_order.h"
#include "surface/mesh_description.h"
#include "surface/mesh_parts.h"

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
  CellBlock& block = part.mesh.blocks.emplace_back();
  block.type = CellType::triangle;
  std::vector<uint32_t>& points = part.numbers.points;
  points = triangles;
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  for (const uint32_t v : triangles) {
    const auto at = std::lower_bound(points.begin(), points.end(), v) - points.begin();
    block.connectivity.push_back(static_cast<uint32_t>(at));
  }
  part.mesh.points.resize(points.size());
  for (uint32_t i = 0; i < chart.face_count(); ++i) {
    part.numbers.cells.push_back(chart.origins.empty() ? i : chart.origins[i]);
    part.numbers.first_corner.push_back(3 * i);
  }
  part.numbers.corners = chart.corners;
  return part;
}

Result<> check_cells(const Mesh& mesh) {
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      if (dimension_of(block.type_of(i)) < 3) continue;
      return failure(ErrorCode::unsupported,
                     "mode \"random\" holds surfaces; for volumes there is mode \"stream\"");
    }
  }
  return {};
}

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
    make_pages();
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

  Result<> encode_charts(std::span<const uint32_t> corners) {
    const size_t count = hierarchy_.charts.size();
    std::vector<uint32_t> part_of(mesh_.cell_count());
    for (uint32_t c = 0; c < count; ++c) {
      for (const uint32_t face : hierarchy_.charts[c].faces) part_of[face] = c;
    }
    MeshParts parts(mesh_, part_of, executor_);
    level_0_ = parts.count();
    patches_.resize(count);
    meshes_.resize(count);
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
    EncodeOptions of_chart = options_;
    of_chart.executor = nullptr;
    of_chart.progress = {};
    std::vector<Result<>> results(end - begin);
    const auto for_each = [&](auto work) -> Result<> {
      executor_.parallel_for(end - begin, [&](size_t i) { results[i] = work(i); });
      for (const Result<>& result : results) MAILLE_CHECK(result);
      return {};
    };
    std::vector<MeshPart> parts(end - begin);
    const bool share = can_share_tables(arrays_[0], options_.effort);
    SharedFanEncoder shared(end - begin, arrays_[0], of_chart);
    MAILLE_CHECK(for_each([&](size_t i) -> Result<> {
      parts[i] = part_at(begin + i);
      if (share) MAILLE_CHECK(shared.find(i, parts[i].mesh, parts[i].numbers.points));
      return {};
    }));
    if (share) tables_[set] = shared.finish(executor_);
    return for_each([&](size_t i) -> Result<> {
      // Not patch 0: arrays of the mesh as a whole are not in charts.
      patches_[begin + i] =
          MAILLE_TRY(encode_patch(parts[i].mesh, &parts[i].numbers, 1, arrays, of_chart, shared.take(i)));
      meshes_[begin + i] = std::move(parts[i].mesh);
      return {};
    });
  }

  void make_pages() {
    std::vector<std::span<const uint32_t>> points;
    for (size_t i = 0; i < level_0_; ++i) points.push_back(patches_[i].sources.points);
    const auto shared = find_shared(points, decoded_places(arrays_[0]));
    bytes_.resize(hierarchy_.charts.size());
    for (size_t i = 0; i < bytes_.size(); ++i) {
      bytes_[i] = i < level_0_ ? chart_bytes(meshes_[i], patches_[i], shared[i])
                               : chart_bytes(meshes_[i], patches_[i], std::nullopt);
      count_bytes(i);
    }
    for (size_t g = 0; g < indexed_.groups.size(); ++g) {
      IndexedGroup& group = indexed_.groups[g];
      PageHead head{group.level, group.replaces, group.view_error, group.bound, {}};
      std::vector<std::byte>& page = pages_.emplace_back();
      for (size_t i = 0; i < group.charts.size(); ++i) {
        const std::vector<std::byte>& bytes = bytes_[indexed_.charts[g][i]];
        IndexedChart& chart = group.charts[i];
        chart.bytes = static_cast<uint32_t>(bytes.size());
        chart.check = static_cast<uint32_t>(hash64(bytes));
        head.charts.push_back({chart.producer, chart.faces, chart.bytes});
      }
      page = encode_page_head(head);
      head_bytes_.push_back(page.size());
      for (const uint32_t chart : indexed_.charts[g])
        page.insert(page.end(), bytes_[chart].begin(), bytes_[chart].end());
    }
  }
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

  std::vector<std::byte> index_page(uint32_t page) const {
    const uint32_t first = page * groups_per_index_page;
    const size_t count = std::min<size_t>(groups_per_index_page, indexed_.groups.size() - first);
    return encode_index_page(indexed_.frame, std::span(indexed_.groups).subspan(first, count), first);
  }

  /// Offsets do not change the size of what they stand in, so that all places are known before anything is
  /// written.
  void place_pages(uint64_t offset) {
    const auto place = [&](const StreamKey& key, size_t size) {
      ChunkHeader header;
      std::copy_n(key.type, header.type.size(), header.type.begin());
      header.patch = key.patch;
      header.number = key.number;
      StreamPlace found;
      for (uint32_t part = 0;; ++part) {
        header.size = static_cast<uint32_t>(std::min<size_t>(size, max_chunk_bytes));
        size -= header.size;
        header.part_and_last = 2 * part + (size == 0 ? 1 : 0);
        const uint64_t total = chunk_total_bytes(header);
        const bool whole = part == 0 && size == 0;
        if (whole) found = {offset + total - header.size - chunk_checksum_bytes, header.size};
        offset += total;
        if (size == 0) return found;
      }
    };
    place(directory_key, encode_directory(directory_).size());
    for (uint32_t g = 0; g < indexed_.groups.size(); ++g) {
      if (g % groups_per_index_page == 0) {
        const uint32_t page = g / groups_per_index_page;
        directory_.index_pages[page] = place(index_page_key(page), index_page(page).size());
      }
      const StreamPlace page = place(charts_key(g), pages_[g].size());
      indexed_.groups[g].offset = page.size == 0 ? 0 : page.offset + head_bytes_[g];
    }
  }

  void fill_directory() {
    directory_.groups = static_cast<uint32_t>(indexed_.groups.size());
    directory_.levels = hierarchy_.levels();
    directory_.faces.resize(directory_.levels);
    directory_.charts.resize(directory_.levels);
    for (const Chart& chart : hierarchy_.charts) {
      directory_.faces[chart.level] += chart.face_count();
      ++directory_.charts[chart.level];
    }
    directory_.frame = indexed_.frame;
    directory_.index_pages.resize((directory_.groups - 1) / groups_per_index_page + 1);
  }

  Result<EncodeReport> write(Sink& sink) {
    FileWriter writer = MAILLE_TRY(
        FileWriter::begin(sink, {.major = format_major, .minor = format_minor, .mode = Mode::random}));
    Description description = describe(mesh_, arrays_, options_);
    MAILLE_CHECK(writer.write_stream(random_description_key, MAILLE_TRY(encode_description(description))));
    MAILLE_CHECK(write_mesh_arrays(writer));
    for (uint32_t set = 0; set < chart_sets; ++set) {
      if (!tables_[set].empty()) MAILLE_CHECK(writer.write_stream(tables_key(set), tables_[set]));
    }
    fill_directory();
    place_pages(writer.offset());
    MAILLE_CHECK(writer.write_stream(directory_key, encode_directory(directory_)));
    for (uint32_t g = 0; g < indexed_.groups.size(); ++g) {
      if (g % groups_per_index_page == 0) {
        const uint32_t page = g / groups_per_index_page;
        MAILLE_CHECK(writer.write_stream(index_page_key(page), index_page(page)));
      }
      MAILLE_CHECK(writer.write_stream(charts_key(g), pages_[g]));
    }
    EncodeReport report = report_of_charts();
    if (options_.order == Order::keep) {
      const std::vector<std::byte> order = encode_order(MAILLE_TRY(order_of_charts()));
      report.order_bytes = order.size();
      MAILLE_CHECK(writer.write_stream(random_order_key, order));
    }
    report.file_bytes = MAILLE_TRY(writer.finish());
    MAILLE_CHECK(sink.commit());
    report.other_bytes = report.file_bytes - report.connectivity.coded_bytes - report.order_bytes -
                         report.positions.coded_bytes;
    for (const ArrayReport& array : report.arrays) report.other_bytes -= array.coded_bytes;
    return report;
  }

  Result<> write_mesh_arrays(FileWriter& writer) {
    for (uint32_t i = 1; i < arrays_.size(); ++i) {
      if (arrays_[i].array->domain != Domain::mesh) continue;
      const std::vector<std::byte> bytes = encode_mesh_array(arrays_[i], options_.effort);
      MAILLE_CHECK(writer.write_stream(mesh_array_key(i - 1), bytes));
      mesh_array_bytes_.resize(arrays_.size());
      mesh_array_bytes_[i] = bytes.size();
    }
    return {};
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
  std::vector<Mesh> meshes_;                   ///< by chart: its cells
  std::vector<std::vector<std::byte>> bytes_;  ///< by chart
  std::vector<std::vector<std::byte>> pages_;  ///< by group
  std::vector<size_t> head_bytes_;             ///< by group: what stands before its charts
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
