#include "random/read/random_reader.h"

#include <algorithm>
#include <string_view>

#include "base/hash.h"
#include "base/named_error.h"
#include "base/result.h"
#include "container/chunk_finder.h"
#include "random/read/rebuild_index.h"
#include "surface/left_out.h"
#include "surface/mesh_description.h"

namespace maille {
namespace {

constexpr std::string_view known_types[] = {"DESC", "CTAB", "CDIR", "CIDX", "CHRT", "ARRY", "ORDR"};
/// Of index pages that are read at once: hostile directories may name one place many times.
constexpr uint64_t most_pages_bytes = uint64_t{16} << 20;

/// The bytes did not come: there is nothing damaged that could be found by other ways.
bool is_of_source(const Error& error) {
  return error.code == ErrorCode::cannot_read || error.code == ErrorCode::network;
}

Result<Description> read_description(Bytes bytes, const Limits& limits) {
  Description description = MAILLE_TRY(decode_description(bytes, limits));
  if (description.welded)
    return failure(ErrorCode::corrupt, "the description of the mesh is damaged: charts have no twins");
  return description;
}

/// Chunks from the front on, as long as they are whole.
class FrontChunks {
 public:
  explicit FrontChunks(const Source& source) : source_(source), window_(source) {}

  Result<FileHeader> header() {
    const Bytes bytes = MAILLE_TRY(window_.at(0, file_header_bytes));
    return read_file_header(bytes.first(std::min(bytes.size(), file_header_bytes)), source_.name());
  }
  /// Nothing behind the last one that is whole.
  Result<std::optional<ChunkHeader>> next(std::vector<std::byte>& content) {
    const auto parsed = read_chunk_header(MAILLE_TRY(window_.at(offset_, max_chunk_header_bytes)));
    if (!parsed || parsed->total_bytes() > source_.size() - offset_) return std::nullopt;
    const auto size = static_cast<size_t>(parsed->total_bytes());
    const Bytes bytes = MAILLE_TRY(window_.at(offset_, size));
    if (bytes.size() < size) return std::nullopt;
    const auto checksum = load<uint64_t>(bytes.data() + size - chunk_checksum_bytes);
    const auto found = chunk_content(bytes.first(size), {parsed->header, offset_, checksum});
    if (!found) return std::nullopt;
    content.insert(content.end(), found->begin(), found->end());
    offset_ += size;
    return parsed->header;
  }

 private:
  const Source& source_;
  SourceWindow window_;
  uint64_t offset_ = file_header_bytes;
};

}  // namespace

// The front is tried first, which takes one request; then once more, if the source can fetch it anew; then
// all of the file is searched for what the front should have said. Errors of the source itself end this at
// once, as searching would only ask it for more.
Result<RandomReader> RandomReader::open(const Source& source, const DecodeOptions& options) {
  RandomReader reader(source, options);
  reader.header_ = MAILLE_TRY(FrontChunks(source).header());
  if (reader.header_.mode != Mode::random) {
    return failure(ErrorCode::usage, source.name() +
                                         ": only files of mode \"random\" can be read in parts; "
                                         "`maille compress --mode random` makes one");
  }
  auto read = reader.read_front();
  if (!read && read.error().code == ErrorCode::corrupt && source.forget(0, source.size()))
    read = reader.read_front();
  if (!read && is_of_source(read.error())) return tl::unexpected(std::move(read).error());
  if (!read) MAILLE_CHECK(reader.read_by_key());
  return reader;
}

Result<> RandomReader::read_front() {
  FrontChunks chunks(*source_);
  // From the first byte on, although it is known: what a distant source gives with one request begins there.
  MAILLE_CHECK(chunks.header());
  Front front;
  for (;;) {
    std::vector<std::byte> content;
    const auto header = MAILLE_TRY(chunks.next(content));
    if (!header) return failure(ErrorCode::corrupt, "the front is damaged");
    const std::string_view type(header->type.data(), header->type.size());
    const auto append = [&](std::vector<std::byte>& to) {
      to.insert(to.end(), content.begin(), content.end());
    };
    if (type == "DESC") append(front.description);
    if (type == "CDIR") append(front.directory);
    if (type == "CTAB" && header->patch < chart_sets) append(front.tables[header->patch]);
    if (type != "CIDX") continue;
    MAILLE_CHECK(set_front(front));
    return set_index_page(0, content);
  }
}

/// The slow way, for files whose front is damaged: finds the same streams by their chunks, anywhere in the
/// file.
Result<> RandomReader::read_by_key() {
  if (charts_alone) return left_out_of_charts();
  const FileReader& file = MAILLE_TRY(whole_file());
  Front front;
  front.description = MAILLE_TRY(file.read_stream(random_description_key));
  for (uint32_t set = 0; set < chart_sets; ++set) {
    // Without them charts that have no tables of their own are lost, and no others.
    if (auto tables = file.read_stream(tables_key(set)); tables && file.has_stream(tables_key(set)))
      front.tables[set] = std::move(*tables);
  }
  auto directory = file.read_stream(directory_key);
  const auto page = file.read_stream(index_page_key(0));
  if (directory && page) {
    front.directory = *directory;
    if (set_front(front) && set_index_page(0, *page)) return {};
  }
  // Without a directory only the description is known.
  description_ = MAILLE_TRY(read_description(front.description, options_.limits));
  directory_ = {};
  if (auto found = directory ? decode_directory(*directory, options_.limits) : Result<ChartDirectory>();
      found)
    directory_ = std::move(*found);
  MAILLE_CHECK(set_sets(front, true));
  return rebuild();
}

/// The index from what stands in the pages of charts.
Result<> RandomReader::rebuild() {
  if (charts_alone) return left_out_of_charts();
  const FileReader& file = MAILLE_TRY(whole_file());
  RebuiltIndex rebuilt = MAILLE_TRY(rebuild_index(*source_, file, sets_, options_));
  // Sizes of arrays cannot be found by decoding; where the directory survived they are taken from it.
  if (directory_.finest.arrays.size() == description_.arrays.size() + 1) {
    rebuilt.directory.finest = std::move(directory_.finest);
    rebuilt.directory.coarser = std::move(directory_.coarser);
  }
  directory_ = std::move(rebuilt.directory);
  ++rebuilt_;
  index_ = ChartIndex(directory_.groups);
  for (size_t first = 0; first < rebuilt.groups.size(); first += groups_per_index_page) {
    const auto begin = rebuilt.groups.begin() + static_cast<ptrdiff_t>(first);
    const size_t count = std::min<size_t>(groups_per_index_page, rebuilt.groups.size() - first);
    index_.set_page(
        ChartIndex::page_of(static_cast<uint32_t>(first)),
        {std::make_move_iterator(begin), std::make_move_iterator(begin + static_cast<ptrdiff_t>(count))});
  }
  return {};
}

Result<> RandomReader::set_front(const Front& front) {
  description_ = MAILLE_TRY(read_description(front.description, options_.limits));
  directory_ = MAILLE_TRY(decode_directory(front.directory, options_.limits));
  if (directory_.finest.arrays.size() != description_.arrays.size() + 1)
    return failure(ErrorCode::corrupt, "the directory of charts is not that of these arrays");
  MAILLE_CHECK(set_sets(front, false));
  index_ = ChartIndex(directory_.groups);
  return {};
}

/// Makes the two sets of charts, level 0 and coarser ones, from the description and the tables. `lenient`:
/// damaged tables are as good as none.
Result<> RandomReader::set_sets(const Front& front, bool lenient) {
  for (uint32_t set = 0; set < chart_sets; ++set) {
    auto read = chart_set(description_, set, front.tables[set]);
    if (!read && lenient) read = chart_set(description_, set, {});
    sets_[set] = MAILLE_TRY(std::move(read));
  }
  return {};
}

Result<> RandomReader::set_index_page(uint32_t page, Bytes bytes) {
  auto groups =
      MAILLE_TRY(decode_index_page(directory_.frame, bytes, page * groups_per_index_page, directory_.groups));
  for (const IndexedGroup& group : groups) {
    if (group.level >= directory_.levels)
      return failure(ErrorCode::corrupt, "chart index: a level that is not there");
  }
  index_.set_page(page, std::move(groups));
  return {};
}

/// The chunk of a page of the index where the directory says that it stands, to be read; empty where it
/// cannot be there.
RandomReader::PageChunk RandomReader::place_of_page(uint32_t page) const {
  const StreamPlace place = directory_.index_pages[page];
  PageChunk chunk;
  if (place.size == 0 || place.size > max_chunk_bytes) return chunk;
  std::copy_n(index_page_key(page).type, chunk.header.type.size(), chunk.header.type.begin());
  chunk.header.patch = page;
  chunk.header.part_and_last = 1;
  chunk.header.size = place.size;
  const uint64_t total = chunk_total_bytes(chunk.header);
  const uint64_t before = total - place.size - chunk_checksum_bytes;
  // The place comes from the directory and may be anything; no sum here can wrap around.
  if (place.offset < before || place.offset - before > source_->size() ||
      total > source_->size() - (place.offset - before)) {
    return chunk;
  }
  chunk.offset = place.offset - before;
  chunk.bytes.resize(static_cast<size_t>(total));
  return chunk;
}

bool RandomReader::set_index_page(const PageChunk& chunk) {
  if (chunk.bytes.empty()) return false;
  const auto checksum = load<uint64_t>(chunk.bytes.data() + chunk.bytes.size() - chunk_checksum_bytes);
  const std::optional<Bytes> content = chunk_content(chunk.bytes, {chunk.header, chunk.offset, checksum});
  return content && set_index_page(chunk.header.patch, *content);
}

Result<std::reference_wrapper<const FileReader>> RandomReader::whole_file() const {
  if (charts_alone) return left_out_of_charts();
  if (!file_) file_ = std::make_unique<FileReader>(MAILLE_TRY(FileReader::open(*source_, known_types)));
  return std::cref(*file_);
}

Result<> RandomReader::load_index_pages(const std::vector<uint32_t>& pages) {
  for (size_t next = 0; next < pages.size();) {
    std::vector<uint32_t> numbers;
    std::vector<PageChunk> chunks;
    for (uint64_t bytes = 0; next < pages.size() && bytes < most_pages_bytes; ++next) {
      numbers.push_back(pages[next]);
      chunks.push_back(place_of_page(pages[next]));
      bytes += chunks.back().bytes.size();
    }
    std::vector<Source::Part> parts;
    for (PageChunk& chunk : chunks) parts.push_back({chunk.offset, chunk.bytes});
    MAILLE_CHECK(source_->read_many(parts));
    for (size_t i = 0; i < chunks.size(); ++i) {
      if (!MAILLE_TRY(repair_index_page(numbers[i], chunks[i]))) return rebuild();
    }
  }
  return {};
}

/// Sets a page of the index. A damaged one is read again, since a cache or a connection may have damaged it,
/// and then looked for elsewhere in the file; false: it is nowhere.
Result<bool> RandomReader::repair_index_page(uint32_t page, PageChunk& chunk) {
  if (set_index_page(chunk)) return true;
  if (!chunk.bytes.empty() && source_->forget(chunk.offset, chunk.bytes.size())) {
    MAILLE_CHECK(source_->read_at(chunk.offset, chunk.bytes));
    if (set_index_page(chunk)) return true;
  }
  const FileReader& file = MAILLE_TRY(whole_file());
  const auto bytes = file.read_stream(index_page_key(page));
  return bytes && set_index_page(page, *bytes);
}

Result<> RandomReader::find(const std::vector<ChartPlace>& places) {
  for (const ChartPlace& place : places) {
    const auto is_group = [&] { return place.group < index_.size(); };
    if (is_group() && !index_.has_page(ChartIndex::page_of(place.group)))
      MAILLE_CHECK(load_index_pages({ChartIndex::page_of(place.group)}));
    if (is_group() && place.chart < index_.group(place.group).charts.size()) continue;
    return failure(ErrorCode::usage, source_->name() + ": has no chart " + std::to_string(place.chart) +
                                         " of group " + std::to_string(place.group));
  }
  return {};
}

std::string RandomReader::name_of(const ChartPlace& place) const {
  return source_->name() + ": chart " + std::to_string(place.chart) + " of group " +
         std::to_string(place.group) + " (level " + std::to_string(index_.group(place.group).level) + ")";
}

/// Bytes of a group that stand before a chart.
uint64_t RandomReader::before(const ChartPlace& place) const {
  const IndexedGroup& group = index_.group(place.group);
  uint64_t bytes = 0;
  for (uint32_t i = 0; i < place.chart; ++i) bytes += group.charts[i].bytes;
  return bytes;
}

/// The bytes of a chart by the chunks of its group, for groups of several, and for files whose bytes have
/// moved. None where they are not. `page`: what was read last.
Result<Bytes> RandomReader::bytes_by_key(const ChartPlace& place, ChartPage& page) const {
  if (page.group != place.group) {
    page = {place.group, {}, 0};
    const FileReader& file = MAILLE_TRY(whole_file());
    // Each chart has a check of its own.
    auto bytes = file.read_unchecked(charts_key(place.group));
    if (!bytes && bytes.error().code != ErrorCode::corrupt) return tl::unexpected(std::move(bytes).error());
    const auto head = bytes ? decode_page_head(*bytes) : Result<ParsedPageHead>();
    if (bytes && head) page = {place.group, std::move(*bytes), head->bytes};
  }
  const uint64_t begin = page.head + before(place), size = indexed(place).bytes;
  if (begin > page.bytes.size() || size > page.bytes.size() - begin) return Bytes();
  return Bytes(page.bytes).subspan(static_cast<size_t>(begin), static_cast<size_t>(size));
}

/// The bytes of charts, checked; none for those that are damaged.
Result<std::vector<RandomReader::ChartBytes>> RandomReader::read_bytes(
    const std::vector<ChartPlace>& places) const {
  struct Range {
    uint64_t offset, size;
    size_t place;
  };
  std::vector<Range> ranges;
  std::vector<std::vector<std::byte>> bytes(places.size());
  for (size_t i = 0; i < places.size(); ++i) {
    const uint64_t group = index_.group(places[i].group).offset, offset = group + before(places[i]);
    const uint64_t size = indexed(places[i]).bytes;
    if (group > 0 && group <= source_->size() && offset <= source_->size() &&
        size <= source_->size() - offset)
      ranges.push_back({offset, size, i});
  }
  std::sort(ranges.begin(), ranges.end(), [](const Range& a, const Range& b) {
    return a.offset != b.offset ? a.offset < b.offset : a.place < b.place;
  });
  // Charts that share bytes would make a small file a large mesh.
  for (size_t i = 1; i < ranges.size(); ++i) {
    const bool same = places[ranges[i].place] == places[ranges[i - 1].place];
    if (!same && ranges[i].offset < ranges[i - 1].offset + ranges[i - 1].size)
      return failure(ErrorCode::corrupt, source_->name() + ": charts overlap");
  }
  std::vector<Source::Part> parts;
  for (const Range& range : ranges) {
    bytes[range.place].resize(static_cast<size_t>(range.size));
    parts.push_back({range.offset, bytes[range.place]});
  }
  MAILLE_CHECK(source_->read_many(parts));
  // Once more, where it was the way here that damaged them.
  parts.clear();
  for (const Range& range : ranges) {
    if (!is_intact(places[range.place], bytes[range.place]) && source_->forget(range.offset, range.size))
      parts.push_back({range.offset, bytes[range.place]});
  }
  MAILLE_CHECK(source_->read_many(parts));
  ChartPage page;
  std::vector<ChartBytes> intact(places.size());
  for (size_t i = 0; i < places.size(); ++i) {
    if (is_intact(places[i], bytes[i])) {
      intact[i] = std::move(bytes[i]);
      continue;
    }
    const Bytes found = MAILLE_TRY(bytes_by_key(places[i], page));
    if (is_intact(places[i], found)) intact[i].emplace(found.begin(), found.end());
  }
  return intact;
}

bool RandomReader::is_intact(const ChartPlace& place, Bytes bytes) const {
  const IndexedChart& chart = indexed(place);
  return bytes.size() == chart.bytes && checksum_matches(chart.check, static_cast<uint32_t>(hash64(bytes)));
}

/// How many charts may be decoded at once. Of all of them together: a few bytes may claim much.
Result<size_t> RandomReader::charts_at_once(const std::vector<ChartPlace>& places,
                                            const std::vector<ChartBytes>& bytes, ChartUse use) const {
  PatchesMemory memory;
  memory.add_description(description_, 4);  // both sets of charts and the mesh have it, too
  for (size_t i = 0; i < places.size() && !memory.is_over(options_.limits); ++i) {
    // Those that claim what makes no sense are told by decode().
    if (bytes[i]) (void)add_claimed_memory(set_of(places[i]), *bytes[i], memory);
  }
  // Of charts in a region more may be shared than this says, but they are few.
  if (use == ChartUse::join) memory.add_shared_points(description_.points);
  if (use == ChartUse::join) memory.add_after(std::min(joining_memory(description_), memory.meshes));
  // join_levels() has rows of all points, and then the mesh.
  if (use == ChartUse::show && places.size() > 1) memory.add_after(2 * memory.meshes);
  return with_name(memory.at_once(options_.limits), source_->name());
}

Result<> RandomReader::read_mesh_arrays(Mesh& mesh) const {
  for (Array& array : mesh.arrays) {
    if (array.domain != Domain::mesh) continue;
    const auto found = std::find_if(
        description_.arrays.begin(), description_.arrays.end(),
        [&](const ArrayDescription& d) { return d.domain == Domain::mesh && d.name == array.name; });
    const auto number = static_cast<uint32_t>(found - description_.arrays.begin());
    const FileReader& file = MAILLE_TRY(whole_file());
    const auto bytes = MAILLE_TRY(file.read_stream(mesh_array_key(number)));
    MAILLE_CHECK(decode_mesh_array(bytes, found->mesh_tuples, array));
  }
  return {};
}

Result<DecodedChart> RandomReader::decode(const ChartPlace& place, const ChartBytes& bytes,
                                          ChartUse use) const {
  if (!bytes) return failure(ErrorCode::corrupt, name_of(place) + ": is damaged, its checksum does not fit");
  DecodeOptions options;
  options.limits = options_.limits;
  options.arrays = options_.arrays;
  thread_local FanBuffers buffers;
  auto decoded = decode_chart(set_of(place), *bytes, options, &buffers, use);
  if (!decoded) {
    Error error = std::move(decoded).error();
    error.message = name_of(place) + ": " + error.message;
    return tl::unexpected(std::move(error));
  }
  return decoded;
}

Result<std::vector<DecodedChart>> RandomReader::read_charts(const std::vector<ChartPlace>& places,
                                                            std::vector<std::string>* problems,
                                                            ChartUse use) const {
  const std::vector<ChartBytes> bytes = MAILLE_TRY(read_bytes(places));
  const size_t at_once = MAILLE_TRY(charts_at_once(places, bytes, use));
  // Made in place: without exceptions tl::expected 1.0 copies what it is assigned.
  std::vector<std::optional<Result<DecodedChart>>> results(places.size());
  Executor& executor = options_.executor == nullptr ? serial_executor() : *options_.executor;
  for (size_t first = 0; first < places.size(); first += at_once) {
    executor.parallel_for(std::min(at_once, places.size() - first), [&](size_t next) {
      const size_t i = first + next;
      results[i].emplace(decode(places[i], bytes[i], use));
    });
  }
  std::vector<DecodedChart> charts;
  for (std::optional<Result<DecodedChart>>& result : results) {
    if (*result) {
      charts.push_back(std::move(**result));
    } else if (problems != nullptr) {
      problems->push_back(result->error().message);
    } else {
      return tl::unexpected(std::move(*result).error());
    }
  }
  return charts;
}

}  // namespace maille
