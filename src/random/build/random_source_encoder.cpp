// Encodes meshes that are read in parts as files of mode `random`: docs/random-access.md, "Larger than
// memory".
#include <algorithm>
#include <atomic>
#include <optional>
#include <string>

#include "base/hash.h"
#include "base/pace.h"
#include "base/result.h"
#include "random/build/level_pieces.h"
#include "random/build/random_writer.h"
#include "random/build/sampled_maps.h"
#include "random/chart_orders.h"
#include "random/random_file.h"
#include "surface/arrays/array_report.h"
#include "surface/mesh_description.h"

namespace maille {
namespace {

/// Tables are made of so many charts, which are taken from at most so many windows. Chosen, not swept: all
/// charts use these tables, but the sample must be in memory.
constexpr size_t charts_in_sample = 128;
constexpr uint32_t windows_in_sample = 8;
/// Memory that does not depend on the mesh, and memory of a piece for each of its faces, about.
constexpr uint64_t fixed_memory = uint64_t{96} << 20;
constexpr uint64_t memory_per_face = 200;
/// Pieces that are worked on at once; more would only wait.
constexpr uint64_t most_at_once = 64;

/// A chart of the level that comes next.
struct PendingChart {
  uint32_t number = 0;  ///< in the hierarchy
  Sphere sphere;
  uint64_t triangles = 0;
  uint64_t offset = 0, bytes = 0;  ///< packed, in a temporary file
  std::vector<uint32_t> border;
};

/// Encodes a mesh that memory does not hold. Faces are sorted into windows, which are runs along a
/// space-filling curve, in temporary files; each window is cut, coded and simplified alone; coarser levels
/// are built of runs of charts in the same way, until one run is left. Whatever happens at once is committed
/// in order, so the file does not depend on threads or on memory.
class SourceEncoder {
 public:
  SourceEncoder(MeshSource& mesh, const EncodeOptions& options, const SourceBuilding& building)
      : mesh_(mesh),
        options_(options),
        building_(building),
        executor_(options.executor == nullptr ? serial_executor() : *options.executor) {}

  Result<EncodeReport> run(Sink& sink) {
    MAILLE_CHECK(check());
    rules_.maps = MAILLE_TRY(sample_maps(mesh_, options_));
    coded_ = MAILLE_TRY(ScratchFile::create(building_.space.folder));
    if (keeps_order()) orders_ = MAILLE_TRY(ChartOrders::create(building_.space.folder));
    windows_ = MAILLE_TRY(MeshWindows::distribute(mesh_, rules_.maps, building_.window_faces, keeps_order(),
                                                  building_.space, options_.progress));
    MAILLE_CHECK(plan(std::max(windows_->largest(), building_.window_faces)));
    MAILLE_CHECK(set_rules());
    MAILLE_CHECK(make_tables_of_windows());
    MAILLE_CHECK(build_from_windows());
    for (uint32_t level = 1; !pending_.empty(); ++level) MAILLE_CHECK(build_level(level));
    return write(sink);
  }

 private:
  const MeshDescription& description() const { return mesh_.description(); }
  bool keeps_order() const { return options_.order == Order::keep; }

  Result<> check() {
    Mesh named;
    named.arrays = description().arrays;
    named.arrays.insert(named.arrays.end(), description().mesh_arrays.begin(),
                        description().mesh_arrays.end());
    MAILLE_CHECK(check_options(named, options_));
    return plan(building_.window_faces);
  }
  /// How many pieces of so many faces are worked on at once.
  Result<> plan(uint64_t faces) {
    const uint64_t piece = memory_per_face * std::min(faces, description().cells + 1);
    const uint64_t least = fixed_memory + 2 * description().points + piece;
    if (building_.space.memory < least) {
      return failure(ErrorCode::memory_bound, "building levels of detail needs at least " +
                                                  std::to_string((least >> 20) + 1) +
                                                  " MB of memory for this mesh (--memory)");
    }
    at_once_ = std::min((building_.space.memory - least) / piece + 1, most_at_once);
    return {};
  }

  Result<> set_rules() {
    rules_.sizes = building_.sizes;
    rules_.of_chart = options_;
    rules_.of_chart.executor = nullptr;
    rules_.of_chart.progress = {};
    rules_.arrays.push_back(empty_array_of(description(), positions_of_source));
    rules_.arrays.insert(rules_.arrays.end(), description().arrays.begin(), description().arrays.end());
    rules_.blocks = description().blocks.size();
    rules_.mesh_arrays = description().mesh_arrays.size();
    rules_.origin = windows_->origin();
    return {};
  }

  bool can_share() const {
    const Array positions = rules_.arrays[0];
    return can_share_tables({&positions, rules_.maps[0]});
  }
  /// Of the codes of all positions, so of any chart's.
  uint64_t range_of_codes() const {
    double widest = 0;
    for (unsigned k = 0; k < 3; ++k) {
      if (rules_.maps[0].maps[k].is_curved()) return UINT64_MAX;
      const auto code = [&](const Vector3& at) {
        const double x = at[k] + windows_->origin()[k];
        return static_cast<double>(rules_.maps[0].maps[k].nearest_code(description().point_type, x));
      };
      widest = std::max(widest, code(windows_->box().high) - code(windows_->box().low));
    }
    return widest < 4e9 ? static_cast<uint64_t>(widest) : UINT64_MAX;
  }

  Result<> make_tables_of_windows() {
    if (!can_share()) return {};
    const uint32_t count = std::min(windows_->count(), windows_in_sample);
    const uint64_t faces = charts_in_sample / count * rules_.sizes.finest_faces;
    for (uint32_t i = 0; i < count; ++i) {
      const auto window = static_cast<uint32_t>(uint64_t{i} * windows_->count() / count);
      MAILLE_CHECK(sample_window(windows_->mesh_of(MAILLE_TRY(windows_->load(window))), faces, rules_));
    }
    tables_[0] = rules_.tables[0].finish(rules_.maps[0], options_.effort, range_of_codes());
    return {};
  }
  Result<> make_tables_of_charts() {
    if (!can_share()) return {};
    const size_t count = std::min(pending_.size(), charts_in_sample);
    for (size_t i = 0; i < count; ++i)
      MAILLE_CHECK(sample_chart(MAILLE_TRY(load(pending_[i * pending_.size() / count])), rules_));
    tables_[1] = rules_.tables[1].finish(rules_.maps[0], options_.effort, range_of_codes());
    return {};
  }

  /// Calls make(i) one after the other, work(what was made, executor) at once for as many as memory allows
  /// and threads are there, and commit(piece) in their order.
  template <class Make, class Work, class Commit>
  Result<> for_each_piece(size_t count, const char* stage, Make make, Work work, Commit commit) {
    using Made = typename decltype(make(size_t{0}))::value_type;
    // More than twice as many as there are threads would only wait, and nothing be heard meanwhile.
    size_t wave = 2;
    for (size_t begin = 0, here = 0; begin < count; begin += here) {
      here = static_cast<size_t>(std::min<uint64_t>({at_once_, wave, count - begin}));
      if (options_.progress &&
          !options_.progress({stage, static_cast<double>(begin) / static_cast<double>(count)}))
        return cancelled();
      std::vector<Made> made;
      for (size_t i = begin; i < begin + here; ++i) made.push_back(MAILLE_TRY(make(i)));
      std::vector<Result<LevelPiece>> pieces(here);
      Executor& within = here == 1 ? executor_ : serial_executor();
      std::atomic<size_t> running{0}, most_running{0};
      executor_.parallel_for(here, [&](size_t i) {
        const size_t now = ++running;
        for (size_t most = most_running; most < now && !most_running.compare_exchange_weak(most, now);) {
        }
        pieces[i] = work(std::move(made[i]), within);
        --running;
      });
      wave = std::max<size_t>(2 * most_running, 2);
      for (size_t i = 0; i < here; ++i) MAILLE_CHECK(commit(begin + i, MAILLE_TRY(std::move(pieces[i]))));
    }
    return {};
  }

  Result<> build_from_windows() {
    MAILLE_CHECK(begin_level());
    const bool alone = windows_->count() == 1;
    MAILLE_CHECK(for_each_piece(
        windows_->count(), "levels of detail",
        [&](size_t i) { return windows_->load(static_cast<uint32_t>(i)); },
        [&](LoadedWindow window, Executor& executor) {
          return code_window(windows_->mesh_of(std::move(window)), rules_, alone, executor);
        },
        [&](size_t, LevelPiece piece) {
          std::vector<uint32_t> numbers;
          for (const ChartOfPiece& chart : piece.charts) {
            numbers.push_back(static_cast<uint32_t>(hierarchy_.charts.size()));
            Chart& added = hierarchy_.charts.emplace_back();
            added.sphere = chart.sphere;
          }
          return commit(0, numbers, std::move(piece));
        }));
    MAILLE_CHECK(end_level(0));
    windows_->let_go();
    if (!pending_.empty()) MAILLE_CHECK(make_tables_of_charts());
    return {};
  }

  Result<> build_level(uint32_t level) {
    const std::vector<PendingChart> charts = std::move(pending_);
    pending_.clear();
    const std::vector<std::vector<uint32_t>> runs = cut_into_runs(charts, level);
    const std::vector<uint32_t> held = held_by_several(charts, runs);
    std::optional<ScratchFile> packed = std::move(packed_);
    MAILLE_CHECK(begin_level());
    const bool alone = runs.size() == 1;
    MAILLE_CHECK(for_each_piece(
        runs.size(), "coarser levels",
        [&](size_t i) -> Result<std::vector<CoarseChart>> {
          std::vector<CoarseChart> loaded;
          for (const uint32_t chart : runs[i]) loaded.push_back(MAILLE_TRY(load(charts[chart], *packed)));
          return loaded;
        },
        [&](std::vector<CoarseChart> loaded, Executor& executor) {
          return code_charts(loaded, held, rules_, alone, executor);
        },
        [&](size_t i, LevelPiece piece) {
          std::vector<uint32_t> numbers;
          for (const uint32_t chart : runs[i]) numbers.push_back(charts[chart].number);
          return commit(level, numbers, std::move(piece));
        }));
    return end_level(level);
  }

  /// Charts along the curve, in runs of about as many triangles as a window has faces. Borders of runs lie
  /// elsewhere at each level.
  std::vector<std::vector<uint32_t>> cut_into_runs(const std::vector<PendingChart>& charts,
                                                   uint32_t level) const {
    std::vector<std::pair<uint64_t, uint32_t>> order;
    for (uint32_t i = 0; i < charts.size(); ++i)
      order.emplace_back(windows_->key_of(charts[i].sphere.centre), i);
    std::sort(order.begin(), order.end());
    std::vector<std::vector<uint32_t>> runs(1);
    // Every other level begins with half a run, which moves the borders of runs.
    uint64_t room = building_.window_faces / (level % 2 == 1 ? 2 : 1);
    uint64_t all = 0;
    for (const PendingChart& chart : charts) all += chart.triangles;
    if (all <= building_.window_faces) room = all + 1;
    for (const auto& [key, chart] : order) {
      if (charts[chart].triangles > room && !runs.back().empty()) {
        runs.emplace_back();
        room = building_.window_faces;
      }
      room -= std::min(room, charts[chart].triangles);
      runs.back().push_back(chart);
    }
    return runs;
  }
  /// Points that charts of several runs have.
  static std::vector<uint32_t> held_by_several(const std::vector<PendingChart>& charts,
                                               const std::vector<std::vector<uint32_t>>& runs) {
    std::vector<uint64_t> uses;
    for (uint64_t r = 0; runs.size() > 1 && r < runs.size(); ++r) {
      for (const uint32_t chart : runs[r]) {
        for (const uint32_t id : charts[chart].border) uses.push_back(uint64_t{id} << 32 | r);
      }
    }
    std::sort(uses.begin(), uses.end());
    std::vector<uint32_t> held;
    for (size_t i = 1; i < uses.size(); ++i) {
      const auto id = static_cast<uint32_t>(uses[i] >> 32);
      const bool several = uses[i - 1] >> 32 == id && uses[i - 1] != uses[i];
      if (several && (held.empty() || held.back() != id)) held.push_back(id);
    }
    return held;
  }

  Result<> begin_level() {
    packed_ = MAILLE_TRY(ScratchFile::create(building_.space.folder));
    first_group_ = hierarchy_.groups.size();
    triangles_ = 0;
    return {};
  }

  /// What a piece gave: `numbers` are those of its charts.
  Result<> commit(uint32_t level, const std::vector<uint32_t>& numbers, LevelPiece piece) {
    rounding_ = std::max(rounding_, piece.rounding);
    places_.resize(hierarchy_.charts.size());
    extents_.resize(hierarchy_.charts.size());
    for (size_t i = 0; i < numbers.size(); ++i) {
      ChartOfPiece& chart = piece.charts[i];
      places_[numbers[i]] = {coded_->size(), static_cast<uint32_t>(chart.bytes.size()),
                             static_cast<uint32_t>(hash64(chart.bytes))};
      MAILLE_CHECK(coded_->append(chart.bytes));
      extents_[numbers[i]] = chart.extent;
      triangles_ += chart.triangles;
      count(level, chart);
      // Charts of level 0 come in the order of their numbers.
      if (level == 0 && orders_) MAILLE_CHECK(orders_->add(chart.order));
    }
    for (GroupOfPiece& group : piece.groups) {
      for (uint32_t& input : group.inputs) input = numbers[input];
      const uint32_t number =
          add_group(hierarchy_, level, std::move(group.inputs), group.view_error, group.bound);
      for (CoarseChart& chart : group.outputs) MAILLE_CHECK(add_pending(number, chart));
    }
    return {};
  }
  Result<> add_pending(uint32_t producer, CoarseChart& chart) {
    PendingChart& added = pending_.emplace_back();
    added.sphere = chart.sphere;
    if (chart.triangles.empty()) added.sphere.centre = hierarchy_.groups[producer].sphere.centre;
    added.triangles = chart.triangles.size() / 3;
    added.offset = packed_->size();
    const std::vector<std::byte> bytes = pack(chart);
    added.bytes = bytes.size();
    added.border = std::move(chart.border);
    producers_.push_back(producer);
    return packed_->append(bytes);
  }
  Result<CoarseChart> load(const PendingChart& chart, ScratchFile& packed) {
    std::vector<std::byte> bytes(chart.bytes);
    MAILLE_CHECK(packed.read_at(chart.offset, bytes));
    CoarseChart loaded = unpack_chart(bytes);
    loaded.sphere = chart.sphere;
    return loaded;
  }
  Result<CoarseChart> load(const PendingChart& chart) { return load(chart, *packed_); }

  void count(uint32_t level, const ChartOfPiece& chart) {
    directory_.faces.resize(level + size_t{1});
    directory_.charts.resize(level + size_t{1});
    directory_.faces[level] += chart.extent.faces;
    ++directory_.charts[level];
    ChartTotals& totals = level == 0 ? directory_.finest : directory_.coarser;
    totals.topology += chart.topology;
    totals.arrays.resize(std::max(totals.arrays.size(), chart.arrays.size()));
    uint64_t all = chart.topology;
    for (size_t i = 0; i < chart.arrays.size(); ++i) {
      totals.arrays[i] += chart.arrays[i];
      all += chart.arrays[i];
    }
    totals.other += chart.bytes.size() - all;
  }

  /// Numbers for the charts that this level became, unless little could be removed: then it stays out, and
  /// several roots are left.
  Result<> end_level(uint32_t level) {
    uint64_t after = 0;
    for (const PendingChart& chart : pending_) after += chart.triangles;
    if (!is_worth_a_level(triangles_, after)) {
      for (size_t g = first_group_; g < hierarchy_.groups.size(); ++g) {
        for (const uint32_t input : hierarchy_.groups[g].inputs) hierarchy_.charts[input].consumer = no_group;
      }
      hierarchy_.groups.resize(first_group_);
      pending_.clear();
    }
    for (size_t i = 0; i < pending_.size(); ++i) {
      pending_[i].number = static_cast<uint32_t>(hierarchy_.charts.size());
      Chart& chart = hierarchy_.charts.emplace_back();
      chart.level = level + 1;
      chart.producer = producers_[i];
      chart.sphere = pending_[i].sphere;
      hierarchy_.groups[producers_[i]].outputs.push_back(pending_[i].number);
    }
    producers_.clear();
    return {};
  }

  struct CodedPlace {
    uint64_t offset = 0;
    uint32_t size = 0, check = 0;
  };

  Description describe_source() const {
    Mesh mesh;
    mesh.points = rules_.arrays[0];
    mesh.arrays = description().arrays;
    mesh.arrays.insert(mesh.arrays.end(), description().mesh_arrays.begin(), description().mesh_arrays.end());
    mesh.metadata = description().metadata;
    std::vector<ArrayToCode> arrays{{&mesh.points, rules_.maps[0]}};
    for (size_t i = 0; i < mesh.arrays.size(); ++i)
      arrays.push_back({&mesh.arrays[i], i + 1 < rules_.maps.size()
                                             ? rules_.maps[i + 1]
                                             : mesh_maps_[i + 1 - rules_.maps.size()]});
    Description described = describe(mesh, arrays, options_);
    described.points = static_cast<uint32_t>(description().points);
    described.corners = description().corners;
    for (const MeshDescription::Block& block : description().blocks)
      described.blocks.push_back({block.name, {block.type, block.cells}});
    return described;
  }

  Result<EncodeReport> write(Sink& sink) {
    IndexedHierarchy indexed = index_hierarchy(hierarchy_, extents_, rules_.origin, rounding_);
    RandomContents contents;
    for (const Array& array : description().mesh_arrays) {
      const auto found = options_.arrays.find(array.name);
      mesh_maps_.push_back(MAILLE_TRY(
          choose_maps(array, found == options_.arrays.end() ? Tolerance{} : found->second, false)));
      const auto number = static_cast<uint32_t>(description().arrays.size() + contents.mesh_arrays.size());
      contents.mesh_arrays.emplace_back(number, encode_mesh_array({&array, mesh_maps_.back()}));
    }
    contents.description = describe_source();
    contents.tables = tables_;
    contents.directory = directory_;
    contents.directory.levels = hierarchy_.levels();
    contents.directory.frame = indexed.frame;
    contents.groups = std::move(indexed.groups);
    for (size_t g = 0; g < contents.groups.size(); ++g) {
      for (size_t i = 0; i < indexed.charts[g].size(); ++i) {
        contents.groups[g].charts[i].bytes = places_[indexed.charts[g][i]].size;
        contents.groups[g].charts[i].check = places_[indexed.charts[g][i]].check;
      }
    }
    contents.charts = [&](uint32_t g) -> Result<std::vector<std::byte>> {
      std::vector<std::byte> bytes;
      for (const uint32_t chart : indexed.charts[g]) {
        const CodedPlace& place = places_[chart];
        bytes.resize(bytes.size() + place.size);
        MAILLE_CHECK(coded_->read_at(place.offset, std::span(bytes).last(place.size)));
      }
      return bytes;
    };
    FileWriter writer = MAILLE_TRY(write_random(sink, contents, options_.progress));
    EncodeReport report = report_of_charts(contents);
    if (orders_) report.order_bytes = MAILLE_TRY(write_order(writer, indexed.charts));
    report.file_bytes = MAILLE_TRY(writer.finish());
    MAILLE_CHECK(sink.commit());
    set_other_bytes(report);
    return report;
  }

  /// `charts`: by group, in the order of the file. How many bytes the order takes.
  Result<uint64_t> write_order(FileWriter& writer, const std::vector<std::vector<uint32_t>>& charts) {
    std::vector<uint32_t> finest;
    for (const std::vector<uint32_t>& group : charts) {
      for (const uint32_t chart : group) {
        if (hierarchy_.charts[chart].level == 0) finest.push_back(chart);
      }
    }
    ScratchFile coded = MAILLE_TRY(ScratchFile::create(building_.space.folder));
    MAILLE_CHECK(orders_->encode(finest, description().points, coded));
    const auto read = [&](uint64_t offset, std::span<std::byte> out) { return coded.read_at(offset, out); };
    MAILLE_CHECK(writer.write_stream(random_order_key, coded.size(), read));
    return coded.size();
  }

  ArrayReport report_of_array(const Array& array, const ArrayMaps& maps, uint64_t coded_bytes) const {
    ArrayReport report = report_of(array, maps, coded_bytes);
    report.elements = array.domain == Domain::mesh ? array.count() : description().count_of(array);
    report.raw_bytes = report.elements * array.tuple_size();
    return report;
  }
  EncodeReport report_of_charts(const RandomContents& contents) const {
    EncodeReport report = report_of(Mesh{});
    report.points = description().points;
    report.cells = report.connectivity.elements = description().cells;
    report.connectivity.raw_bytes = 4 * description().corners;
    const ChartTotals &finest = directory_.finest, &coarser = directory_.coarser;
    report.connectivity.coded_bytes = finest.topology + coarser.topology;
    size_t coarse = 0;
    for (size_t i = 0; i < rules_.arrays.size(); ++i) {
      uint64_t bytes = finest.arrays[i];
      if (rules_.arrays[i].domain == Domain::point && !coarser.arrays.empty())
        bytes += coarser.arrays[coarse++];
      const ArrayReport made = report_of_array(rules_.arrays[i], rules_.maps[i], bytes);
      if (i == 0) {
        report.positions = made;
      } else {
        report.arrays.push_back(made);
      }
    }
    for (size_t i = 0; i < mesh_maps_.size(); ++i) {
      report.arrays.push_back(report_of_array(description().mesh_arrays[i], mesh_maps_[i],
                                              contents.mesh_arrays[i].second.size()));
    }
    return report;
  }

  MeshSource& mesh_;
  const EncodeOptions& options_;
  const SourceBuilding& building_;
  Executor& executor_;
  uint64_t at_once_ = 1;
  PieceRules rules_;
  std::optional<MeshWindows> windows_;
  std::array<std::vector<std::byte>, chart_sets> tables_;
  Hierarchy hierarchy_;  ///< charts without faces and triangles
  std::vector<CodedPlace> places_;
  std::vector<ChartExtent> extents_;
  std::optional<ScratchFile> coded_, packed_;
  std::optional<ChartOrders> orders_;  ///< if the order is kept
  std::vector<PendingChart> pending_;  ///< of the next level
  std::vector<uint32_t> producers_;    ///< of these
  size_t first_group_ = 0;             ///< of the level
  uint64_t triangles_ = 0;             ///< of the level
  double rounding_ = 0;
  ChartDirectory directory_;
  std::vector<ArrayMaps> mesh_maps_;
};

}  // namespace

Result<EncodeReport> encode_random(MeshSource& mesh, Sink& sink, const EncodeOptions& options,
                                   const SourceBuilding& building) {
  return SourceEncoder(mesh, options, building).run(sink);
}

}  // namespace maille
