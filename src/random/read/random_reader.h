#pragma once

#include <maille/decode.h>
#include <maille/random_access.h>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "container/file_reader.h"
#include "random/chart_codec.h"
#include "random/random_layout.h"

namespace maille {

/// A file of mode `random`, open. The source must outlive it.
class RandomReader {
 public:
  /// Reads the front: description, directory, first page of the index. Where that is damaged, chunks are
  /// looked for in the whole file. Errors: cannot_read, corrupt, unsupported, memory_bound.
  static Result<RandomReader> open(const Source& source, const DecodeOptions& options);

  const Description& description() const { return description_; }
  /// Of the charts of its level.
  std::span<const CodedBlock> blocks_of(const ChartPlace& place) const { return set_of(place).blocks; }
  const ChartDirectory& directory() const { return directory_; }
  const ChartIndex& index() const { return index_; }
  const FileHeader& header() const { return header_; }
  const Source& source() const { return *source_; }

  /// Of what select() names as missing. Where one is damaged, the index is made anew from the charts.
  Result<> load_index_pages(const std::vector<uint32_t>& pages);
  /// How often the index was made anew: numbers of pages and groups may be others then.
  unsigned rebuilt() const { return rebuilt_; }
  /// Reads the pages of the index that these charts are in. Error: usage, for charts that are not there.
  Result<> find(const std::vector<ChartPlace>& places);
  /// Asks `choose(index)` for a selection until no page of the index is missing.
  template <class Choose>
  Result<Selection> select(Choose choose) {
    for (;;) {
      Selection selection = choose(static_cast<const ChartIndex&>(index_));
      if (selection.missing.empty()) return selection;
      if (auto loaded = load_index_pages(selection.missing); !loaded)
        return tl::unexpected(std::move(loaded).error());
    }
  }

  /// Reads charts whose bytes lie near one another at once, and decodes them where there is an executor for
  /// it. `problems`: not null: damaged charts are left out, and named there.
  Result<std::vector<DecodedChart>> read_charts(const std::vector<ChartPlace>& places,
                                                std::vector<std::string>* problems = nullptr,
                                                ChartUse use = ChartUse::join) const;

  /// Arrays of the mesh as a whole, which are in no chart: fills those that `mesh` has.
  Result<> read_mesh_arrays(Mesh& mesh) const;
  /// All streams, by key: what the front does not have.
  Result<std::reference_wrapper<const FileReader>> whole_file() const;

 private:
  RandomReader(const Source& source, const DecodeOptions& options) : source_(&source), options_(options) {}
  Result<> read_front();
  Result<> read_by_key();
  struct Front {
    std::vector<std::byte> description, directory;
    std::array<std::vector<std::byte>, chart_sets> tables;
  };
  Result<> set_front(const Front& front);
  Result<> set_sets(const Front& front, bool lenient);
  Result<> rebuild();
  Result<> set_index_page(uint32_t page, Bytes bytes);
  struct PageChunk {
    ChunkHeader header;
    uint64_t offset = 0;
    std::vector<std::byte> bytes;
  };
  PageChunk place_of_page(uint32_t page) const;
  bool set_index_page(const PageChunk& chunk);
  Result<bool> repair_index_page(uint32_t page, PageChunk& chunk);
  struct ChartPage {
    uint32_t group = no_group;
    std::vector<std::byte> bytes;
    size_t head = 0;
  };
  Result<Bytes> bytes_by_key(const ChartPlace& place, ChartPage& page) const;
  uint64_t before(const ChartPlace& place) const;
  using ChartBytes = std::optional<std::vector<std::byte>>;
  Result<std::vector<ChartBytes>> read_bytes(const std::vector<ChartPlace>& places) const;
  Result<size_t> charts_at_once(const std::vector<ChartPlace>& places, const std::vector<ChartBytes>& bytes,
                                ChartUse use) const;
  const IndexedChart& indexed(const ChartPlace& place) const {
    return index_.group(place.group).charts[place.chart];
  }
  const ChartSet& set_of(const ChartPlace& place) const {
    return sets_[set_of_level(index_.group(place.group).level)];
  }
  bool is_intact(const ChartPlace& place, Bytes bytes) const;
  Result<DecodedChart> decode(const ChartPlace& place, const ChartBytes& bytes, ChartUse use) const;
  std::string name_of(const ChartPlace& place) const;

  const Source* source_;
  DecodeOptions options_;
  FileHeader header_;
  Description description_;
  ChartSets sets_;
  ChartDirectory directory_;
  ChartIndex index_;
  unsigned rebuilt_ = 0;
  mutable std::unique_ptr<FileReader> file_;
};

}  // namespace maille
