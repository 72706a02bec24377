#pragma once

#include <maille/source.h>

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace maille {

// ZIP archives (PKWARE's APPNOTE.TXT, 6.3.10) as packages of documents have them: files stored or deflated.
// Of ZIP64 only the long sizes of files are read, which slicers write for every size.

struct ZipEntry {
  std::string path;
  uint64_t packed = 0, size = 0;
  uint64_t header = 0;  ///< where its local header begins
  uint32_t crc = 0;
  uint16_t method = 0, flags = 0;
};

/// Does this begin like an archive with a file in it?
bool is_zip(Bytes bytes);

class ZipReader {
 public:
  /// `bytes` must outlive the reader. Errors: malformed_input; unsupported, archives of more than 4 GiB.
  static Result<ZipReader> open(Bytes bytes, std::string name);

  const std::vector<ZipEntry>& entries() const { return entries_; }
  /// The entry of this path, with or without a '/' in front, in small or capital letters as packages have it
  /// (ECMA-376, part 2); nullptr: none.
  const ZipEntry* find(std::string_view path) const;
  /// Unpacks a file and checks its sum. Memory grows with what is really there. Errors: malformed_input;
  /// unsupported, other methods and encryption; memory_bound beyond `limit` bytes.
  Result<std::vector<std::byte>> read(const ZipEntry& entry, uint64_t limit) const;

 private:
  Bytes bytes_;
  std::string name_;
  std::vector<ZipEntry> entries_;
};

/// Writes an archive file by file. The same contents give the same bytes: dates are the first of 1980.
class ZipWriter {
 public:
  explicit ZipWriter(Sink& sink) : sink_(sink) {}

  /// Packs what `write` puts into its sink; the packed bytes of one file are held in memory.
  Result<> add(const std::string& path, const std::function<Result<>(Sink&)>& write);
  /// The list of files, at the end. Does not commit the sink.
  Result<> finish();

 private:
  Sink& sink_;
  std::vector<ZipEntry> entries_;
  uint64_t written_ = 0;
};

}  // namespace maille
