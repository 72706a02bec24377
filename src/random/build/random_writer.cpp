#include "random/build/random_writer.h"

#include <maille/version.h>

#include <algorithm>

#include "base/pace.h"
#include "base/result.h"

namespace maille {
namespace {

PageHead head_of(const IndexedGroup& group) {
  PageHead head{group.level, group.replaces, group.view_error, group.bound, {}};
  for (const IndexedChart& chart : group.charts)
    head.charts.push_back({chart.producer, chart.faces, chart.bytes});
  return head;
}

std::vector<std::byte> index_page(const RandomContents& contents, uint32_t page) {
  const uint32_t first = page * groups_per_index_page;
  const size_t count = std::min<size_t>(groups_per_index_page, contents.groups.size() - first);
  return encode_index_page(contents.directory.frame, std::span(contents.groups).subspan(first, count), first);
}

/// Where the content of a stream will stand, if it is one chunk; `offset` moves behind it.
StreamPlace place_of(const StreamKey& key, size_t size, uint64_t& offset) {
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
    // A stream of several chunks has no place: its content has headers in between, and only reading the whole
    // file by chunks gives it. Readers see a size of 0.
    if (whole) found = {offset + total - header.size - chunk_checksum_bytes, header.size};
    offset += total;
    if (size == 0) return found;
  }
}

/// Offsets do not change the size of what they stand in, so that all places are known before anything is
/// written.
void place_pages(RandomContents& contents, uint64_t offset) {
  ChartDirectory& directory = contents.directory;
  place_of(directory_key, encode_directory(directory).size(), offset);
  for (uint32_t g = 0; g < contents.groups.size(); ++g) {
    if (g % groups_per_index_page == 0) {
      const uint32_t page = g / groups_per_index_page;
      directory.index_pages[page] = place_of(index_page_key(page), index_page(contents, page).size(), offset);
    }
    IndexedGroup& group = contents.groups[g];
    const size_t head = encode_page_head(head_of(group)).size();
    size_t size = head;
    for (const IndexedChart& chart : group.charts) size += chart.bytes;
    const StreamPlace page = place_of(charts_key(g), size, offset);
    group.offset = page.size == 0 ? 0 : page.offset + head;
  }
}

}  // namespace

// What a reader wants first stands first: description, tables, directory, the first page of the index, then
// the coarsest charts. Charts come from a function, so that callers need not hold them.
Result<FileWriter> write_random(Sink& sink, RandomContents& contents, const Progress& progress) {
  FileWriter writer = MAILLE_TRY(
      FileWriter::begin(sink, {.major = format_major, .minor = format_minor, .mode = Mode::random}));
  MAILLE_CHECK(
      writer.write_stream(random_description_key, MAILLE_TRY(encode_description(contents.description))));
  for (const auto& [array, bytes] : contents.mesh_arrays)
    MAILLE_CHECK(writer.write_stream(mesh_array_key(array), bytes));
  for (uint32_t set = 0; set < contents.tables.size(); ++set) {
    if (!contents.tables[set].empty())
      MAILLE_CHECK(writer.write_stream(tables_key(set), contents.tables[set]));
  }
  contents.directory.groups = static_cast<uint32_t>(contents.groups.size());
  contents.directory.index_pages.resize((contents.groups.size() - 1) / groups_per_index_page + 1);
  place_pages(contents, writer.offset());
  MAILLE_CHECK(writer.write_stream(directory_key, encode_directory(contents.directory)));
  for (uint32_t g = 0; g < contents.groups.size(); ++g) {
    if (g % groups_per_index_page == 0) {
      const uint32_t page = g / groups_per_index_page;
      MAILLE_CHECK(writer.write_stream(index_page_key(page), index_page(contents, page)));
      const double done = static_cast<double>(g) / static_cast<double>(contents.groups.size());
      if (progress && !progress({"writing", done})) return cancelled();
    }
    std::vector<std::byte> page = encode_page_head(head_of(contents.groups[g]));
    const std::vector<std::byte> charts = MAILLE_TRY(contents.charts(g));
    page.insert(page.end(), charts.begin(), charts.end());
    MAILLE_CHECK(writer.write_stream(charts_key(g), page));
  }
  return writer;
}

}  // namespace maille
