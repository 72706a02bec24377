#include "random/read/rebuild_index.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

#include "base/hash.h"
#include "base/result.h"
#include "random/chart_codec.h"
#include "random/mesh_geometry.h"

namespace maille {
namespace {

/// The bytes of no chart, so that reading one that is lost fails.
constexpr uint32_t lost_check = 0;

/// Around a box; halves, so that no sum overflows.
Sphere around(const Box& box) {
  const Vector3 half = box.high * 0.5 - box.low * 0.5;
  return {box.low * 0.5 + box.high * 0.5, std::sqrt(dot(half, half)) * (1 + 1e-12)};
}

/// Makes an index from the charts themselves, where that of the file is damaged. Each page says of its charts
/// how many bytes they have and what refines them; spheres and boxes come from decoding them. What a lost
/// page said is replaced by the widest assumption: a chart that may be anywhere, whose bytes cannot be read.
/// So select() still finds every chart that is left.
class Rebuilder {
 public:
  Rebuilder(uint64_t file_bytes, const FileReader& file, const ChartSets& sets, const DecodeOptions& options)
      : file_bytes_(file_bytes), file_(file), sets_(sets), options_(options) {
    // Boxes need positions only, so no array is decoded.
    options_.arrays.emplace();  // none
    options_.progress = {};
    options_.executor = nullptr;
  }

  Result<RebuiltIndex> run() {
    MAILLE_CHECK(find_groups());
    for (uint32_t number = 0; number < places_.size(); ++number) {
      if (places_[number]) MAILLE_CHECK(read_group(number));
    }
    find_space();
    replace_lost_groups();
    // A group encloses what refines it: finer ones are behind it.
    for (size_t number = groups_.size(); number-- > 0;) enclose_group(number);
    groups_[0].view_error = groups_[0].bound = std::numeric_limits<double>::infinity();
    return RebuiltIndex{directory_of_groups(), std::move(groups_)};
  }

 private:
  struct Place {
    uint64_t content = 0;  ///< 0: several chunks
  };

  Result<> find_groups() {
    uint64_t count = 0;
    const auto is_page = [](const ChunkRecord& record) {
      const ChunkHeader& header = record.header;
      return std::string_view(header.type.data(), header.type.size()) == "CHRT" && header.number == 0;
    };
    for (const ChunkRecord& record : file_.records()) {
      if (is_page(record)) count = std::max(count, uint64_t{record.header.patch} + 1);
    }
    // Each group once had a chunk; where it is lost, its bytes are still there.
    if (count == 0 || count > file_bytes_ / chunk_total_bytes({}))
      return failure(ErrorCode::corrupt, "no charts were found");
    groups_.resize(static_cast<size_t>(count));
    places_.resize(groups_.size());
    for (const ChunkRecord& record : file_.records()) {
      const ChunkHeader& header = record.header;
      if (!is_page(record) || header.part() != 0) continue;
      Place& place = places_[header.patch].emplace();
      if (header.last())
        place.content = record.offset + chunk_total_bytes(header) - header.size - chunk_checksum_bytes;
    }
    return {};
  }

  /// A group whose page is damaged is passed over; only errors of reading the file end the search. A head
  /// that claims more bytes than its page has ends the charts there.
  Result<> read_group(uint32_t number) {
    auto page = file_.read_stream(charts_key(number));
    if (!page) return page.error().code == ErrorCode::corrupt ? Result<>() : tl::unexpected(page.error());
    const auto parsed = decode_page_head(*page);
    if (!parsed) return {};
    IndexedGroup group;
    group.level = parsed->head.level;
    group.replaces = parsed->head.replaces;
    group.view_error = parsed->head.view_error;
    group.bound = parsed->head.bound;
    group.offset = places_[number]->content == 0 ? 0 : places_[number]->content + parsed->bytes;
    size_t at = parsed->bytes;
    for (const PageHead::Chart& from : parsed->head.charts) {
      IndexedChart& chart = group.charts.emplace_back();
      chart.faces = from.faces;
      chart.bytes = from.bytes;
      if (from.producer != no_group && from.producer > number) chart.producer = producer(from.producer);
      if (from.bytes > page->size() - at) break;
      const Bytes bytes = Bytes(*page).subspan(at, from.bytes);
      at += from.bytes;
      chart.check = static_cast<uint32_t>(hash64(bytes));
      find_box(group.level, bytes, chart);
    }
    groups_[number] = std::move(group);
    return {};
  }

  /// Groups behind the last one found are one group that is lost: its number is that behind the others.
  uint32_t producer(uint32_t group) {
    if (group < places_.size()) return group;
    groups_.resize(places_.size() + 1);
    return static_cast<uint32_t>(places_.size());
  }

  void find_box(uint32_t level, Bytes bytes, IndexedChart& chart) {
    const ChartSet& set = sets_[set_of_level(level)];
    PatchesMemory memory;
    // A damaged chart may claim a mesh of any size; it is held against the limit before it is decoded.
    if (!add_claimed_memory(set, bytes, memory) || !memory.at_once(options_.limits)) return;
    const auto decoded = decode_chart(set, bytes, options_);
    if (!decoded) return;
    const Array& points = decoded->mesh.points;
    for (uint64_t i = 0; i < points.count(); ++i) enclose(chart.box, point_position(points, i), i == 0);
    chart.sphere = around(chart.box);
  }

  void find_space() {
    bool first = true;
    for (const IndexedGroup& group : groups_) {
      for (const IndexedChart& chart : group.charts) {
        enclose(space_, chart.box.low, first);
        enclose(space_, chart.box.high, false);
        first = false;
      }
    }
  }

  IndexedChart lost_chart(uint32_t producer) const {
    IndexedChart chart;
    chart.box = space_;
    chart.sphere = around(space_);
    chart.producer = producer;
    chart.check = lost_check;
    return chart;
  }

  void replace_lost_groups() {
    std::vector<bool> found(groups_.size());
    for (uint32_t number = 0; number < groups_.size(); ++number) {
      IndexedGroup& group = groups_[number];
      if (group.charts.empty()) {
        group.charts.push_back(lost_chart(no_group));
        group.offset = 0;
      }
      for (const IndexedChart& chart : group.charts) {
        if (chart.producer != no_group) found[chart.producer] = true;
      }
    }
    // What lost groups said of the others: these hang on the root, as replacing something that is lost.
    for (uint32_t number = 1; number < groups_.size(); ++number) {
      if (found[number]) continue;
      groups_[0].charts.push_back(lost_chart(number));
      groups_[number].replaces = 1;
    }
  }

  void enclose_group(size_t number) {
    IndexedGroup& group = groups_[number];
    bool first = true;
    const auto add = [&](const Sphere& sphere) {
      group.sphere = first ? sphere : enclosing(group.sphere, sphere);
      first = false;
    };
    for (const IndexedChart& chart : group.charts) {
      add(chart.sphere);
      if (chart.producer == no_group) continue;
      const IndexedGroup& finer = groups_[chart.producer];
      add(finer.sphere);
      group.view_error = std::max(group.view_error, finer.view_error);
      group.bound = std::max(group.bound, finer.bound);
    }
  }

  ChartDirectory directory_of_groups() const {
    ChartDirectory directory;
    directory.groups = static_cast<uint32_t>(groups_.size());
    for (const IndexedGroup& group : groups_) directory.levels = std::max(directory.levels, group.level + 1);
    directory.faces.resize(directory.levels);
    directory.charts.resize(directory.levels);
    for (const IndexedGroup& group : groups_) {
      for (const IndexedChart& chart : group.charts) {
        // Charts that nothing replaces are drawn at all levels, and counted at their own.
        directory.faces[group.level] += chart.faces;
        directory.charts[group.level] += chart.bytes > 0 ? 1 : 0;
      }
    }
    directory.finest.arrays.resize(sets_[0].description.arrays.size() + 1);
    directory.index_pages.resize((groups_.size() - 1) / groups_per_index_page + 1);
    return directory;
  }

  uint64_t file_bytes_;
  const FileReader& file_;
  const ChartSets& sets_;
  DecodeOptions options_;
  std::vector<IndexedGroup> groups_;
  std::vector<std::optional<Place>> places_;
  Box space_;
};

}  // namespace

Result<RebuiltIndex> rebuild_index(const Source& source, const FileReader& file, const ChartSets& sets,
                                   const DecodeOptions& options) {
  return Rebuilder(source.size(), file, sets, options).run();
}

}  // namespace maille
