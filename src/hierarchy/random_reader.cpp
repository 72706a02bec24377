#include "hierarchy/random_reader.h"

#include <algorithm>
#include <string_view>

#include "base/hash.h"
#include "base/result.h"
#include "container/chunk_finder.h"

namespace maille {
namespace {

constexpr std::string_view known_types[] = {"DESC", "CTAB", "CDIR", "CIDX", "CHRT", "ARRY", "ORDR"};
/// Bytes between two charts that are read along rather than left out: one request costs more than they do.
constexpr uint64_t reading_gap = 16 * 1024;

/// Chunks from the front on, as long as they are whole.
class FrontChunks {
 public:
  explicit FrontChunks(const Source& source) : source_(source), window_(source) {}

  Result<FileHeader> header() {
    const Bytes bytes = MAILLE_TRY(window_.at(0, file_header_bytes));
    return read_file_header(bytes.first(std::min(bytes.size(), file_header_bytes)), source_.name());
  }
  /// Nothing behind the last one that is whole.
  std::optional<ChunkHeader> next(std::vector<std::byte>& content) {
    const auto front = window_.at(offset_, max_chunk_header_bytes);
    const auto parsed = front ? read_chunk_header(*front) : std::nullopt;
    if (!parsed || parsed->total_bytes() > source_.size() - offset_) return std::nullopt;
    const auto size = static_cast<size_t>(parsed->total_bytes());
    const auto bytes = window_.at(offset_, size);
    if (!bytes || bytes->size() < size) return std::nullopt;
    const auto checksum = load<uint64_t>(bytes->data() + size - chunk_checksum_bytes);
    const auto found = chunk_content(bytes->first(size), {parsed->header, offset_, checksum});
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

Result<RandomReader> RandomReader::open(const Source& source, const DecodeOptions& options) {
  RandomReader reader(source, options);
  FrontChunks front(source);
  reader.header_ = MAILLE_TRY(front.header());
  if (reader.header_.mode != Mode::random) {
    return failure(ErrorCode::usage,
                   source.name() + ": is no file of mode \"random\"; only these can be read in parts");
  }
  if (!reader.read_front()) MAILLE_CHECK(reader.read_by_key());
  return reader;
}

Result<> RandomReader::read_front() {
  FrontChunks chunks(*source_);
  Front front;
  for (;;) {
    std::vector<std::byte> content;
    const auto header = chunks.next(content);
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

Result<> RandomReader::read_by_key() {
  const FileReader& file = MAILLE_TRY(whole_file());
  Front front;
  front.description = MAILLE_TRY(file.read_stream(random_description_key));
  front.directory = MAILLE_TRY(file.read_stream(directory_key));
  for (uint32_t set = 0; set < chart_sets; ++set) {
    if (file.has_stream(tables_key(set))) front.tables[set] = MAILLE_TRY(file.read_stream(tables_key(set)));
  }
  MAILLE_CHECK(set_front(front));
  return set_index_page(0, MAILLE_TRY(file.read_stream(index_page_key(0))));
}

Result<> RandomReader::set_front(const Front& front) {
  description_ = MAILLE_TRY(decode_description(front.description, options_.limits));
  directory_ = MAILLE_TRY(decode_directory(front.directory));
  for (uint32_t set = 0; set < chart_sets; ++set)
    sets_[set] = MAILLE_TRY(chart_set(description_, set, front.tables[set]));
  index_ = ChartIndex(directory_.groups);
  return {};
}

Result<> RandomReader::set_index_page(uint32_t page, Bytes bytes) {
  index_.set_page(page, MAILLE_TRY(decode_index_page(directory_.frame, bytes, page * groups_per_index_page,
                                                     directory_.groups)));
  return {};
}

Result<std::reference_wrapper<const FileReader>> RandomReader::whole_file() const {
  if (!file_) file_ = std::make_unique<FileReader>(MAILLE_TRY(FileReader::open(*source_, known_types)));
  return std::cref(*file_);
}

Result<> RandomReader::load_index_pages(const std::vector<uint32_t>& pages) {
  for (const uint32_t page : pages) {
    const StreamPlace place = directory_.index_pages[page];
    std::vector<std::byte> bytes(place.size);
    const bool inside = place.size > 0 && place.size <= max_chunk_bytes && place.offset <= source_->size() &&
                        place.size + chunk_checksum_bytes <= source_->size() - place.offset;
    if (inside) MAILLE_CHECK(source_->read_at(place.offset, bytes));
    // The checksum of a chunk covers its header: what is read here is checked by what it says.
    if (inside && set_index_page(page, bytes)) continue;
    const FileReader& file = MAILLE_TRY(whole_file());
    MAILLE_CHECK(set_index_page(page, MAILLE_TRY(file.read_stream(index_page_key(page)))));
  }
  return {};
}

std::string RandomReader::name_of(const ChartPlace& place) const {
  return source_->name() + ": chart " + std::to_string(place.chart) + " of group " +
         std::to_string(place.group) + " (level " + std::to_string(index_.group(place.group).level) + ")";
}

/// The bytes of charts, unchecked; none for those that lie outside the file.
Result<std::vector<std::vector<std::byte>>> RandomReader::read_bytes(
    const std::vector<ChartPlace>& places) const {
  struct Range {
    uint64_t offset, size;
    size_t place;
  };
  std::vector<Range> ranges;
  std::vector<std::vector<std::byte>> bytes(places.size());
  for (size_t i = 0; i < places.size(); ++i) {
    const IndexedGroup& group = index_.group(places[i].group);
    uint64_t offset = group.offset;
    for (uint32_t c = 0; c < places[i].chart; ++c) offset += group.charts[c].bytes;
    const uint64_t size = indexed(places[i]).bytes;
    if (group.offset == 0) {
      const FileReader& file = MAILLE_TRY(whole_file());
      const auto page = MAILLE_TRY(file.read_stream(charts_key(places[i].group)));
      const size_t head = MAILLE_TRY(decode_page_head(page)).bytes;
      if (head + offset + size > page.size()) continue;
      const auto begin = page.begin() + static_cast<ptrdiff_t>(head + offset);
      bytes[i].assign(begin, begin + static_cast<ptrdiff_t>(size));
    } else if (offset <= source_->size() && size <= source_->size() - offset) {
      ranges.push_back({offset, size, i});
    }
  }
  std::sort(ranges.begin(), ranges.end(), [](const Range& a, const Range& b) {
    return a.offset != b.offset ? a.offset < b.offset : a.place < b.place;
  });
  std::vector<std::byte> run;
  for (size_t begin = 0, end = 0; begin < ranges.size(); begin = end) {
    uint64_t stop = ranges[begin].offset + ranges[begin].size;
    for (end = begin + 1; end < ranges.size() && ranges[end].offset <= stop + reading_gap; ++end) {
      stop = std::max(stop, ranges[end].offset + ranges[end].size);
    }
    run.resize(static_cast<size_t>(stop - ranges[begin].offset));
    MAILLE_CHECK(source_->read_at(ranges[begin].offset, run));
    for (size_t i = begin; i < end; ++i) {
      const auto at = run.begin() + static_cast<ptrdiff_t>(ranges[i].offset - ranges[begin].offset);
      bytes[ranges[i].place].assign(at, at + static_cast<ptrdiff_t>(ranges[i].size));
    }
  }
  return bytes;
}

Result<DecodedChart> RandomReader::decode(const ChartPlace& place, Bytes bytes) const {
  const IndexedChart& chart = indexed(place);
  const bool intact =
      bytes.size() == chart.bytes && checksum_matches(chart.check, static_cast<uint32_t>(hash64(bytes)));
  if (!intact) return failure(ErrorCode::corrupt, name_of(place) + ": is damaged, its checksum does not fit");
  DecodeOptions options;
  options.limits = options_.limits;
  options.arrays = options_.arrays;
  thread_local FanBuffers buffers;
  auto decoded = decode_chart(sets_[set_of_level(index_.group(place.group).level)], bytes, options, &buffers);
  if (!decoded) {
    Error error = std::move(decoded).error();
    error.message = name_of(place) + ": " + error.message;
    return tl::unexpected(std::move(error));
  }
  return decoded;
}

Result<std::vector<DecodedChart>> RandomReader::read_charts(const std::vector<ChartPlace>& places,
                                                            std::vector<std::string>* problems) const {
  const std::vector<std::vector<std::byte>> bytes = MAILLE_TRY(read_bytes(places));
  std::vector<Result<DecodedChart>> results(places.size());
  Executor& executor = options_.executor == nullptr ? serial_executor() : *options_.executor;
  executor.parallel_for(places.size(), [&](size_t i) { results[i] = decode(places[i], bytes[i]); });
  std::vector<DecodedChart> charts;
  for (Result<DecodedChart>& result : results) {
    if (result) {
      charts.push_back(std::move(*result));
    } else if (problems != nullptr) {
      problems->push_back(result.error().message);
    } else {
      return tl::unexpected(std::move(result).error());
    }
  }
  return charts;
}

}  // namespace maille
