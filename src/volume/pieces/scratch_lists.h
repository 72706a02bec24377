#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/bytes.h"
#include "base/scratch_file.h"

namespace maille {

/// Lists of bytes that grow side by side in one temporary file. The end of each waits in memory until it is
/// worth a write. A list takes room in the file for as much as it has already, so that its extents are few
/// however many lists there are: with an extent for each write, those of a billion cells in 15,000 lists took
/// 150 MB. Room that is never written takes no disk, where the file system knows holes. For one thread.
/// Errors are those of the file: write_failed, cannot_read.
class ScratchLists {
 public:
  /// `memory`: bytes that may wait, about, of all lists together; each has some hundred at least.
  static Result<ScratchLists> create(const std::string& folder, size_t lists, uint64_t memory);

  size_t count() const { return lists_.size(); }
  uint64_t size(size_t list) const { return lists_[list].size; }
  Result<> append(size_t list, Bytes bytes);
  /// All of a list.
  Result<std::vector<std::byte>> read(size_t list);
  /// What waits is written, and its memory given back: nothing is appended any more.
  Result<> finish();

  /// A place in a list, for reading it in parts.
  struct Place {
    size_t extent = 0;
    uint64_t offset = 0;  ///< in the extent
  };
  /// Bytes from the place on, which moves behind them: not more than fit; none only at the end. After
  /// finish().
  Result<size_t> read_some(size_t list, Place& place, std::span<std::byte> out);

 private:
  struct Extent {
    uint64_t begin, size,
        room;  ///< `size` bytes of `room` are written; all, but of the last extent of a list
  };
  struct List {
    std::vector<std::byte> waiting;
    std::vector<Extent> extents;
    uint64_t size = 0;
  };
  ScratchLists(ScratchFile file, size_t lists, size_t waiting)
      : file_(std::move(file)), lists_(lists), most_waiting_(waiting) {}
  Result<> write(List& list, Bytes bytes);
  void make_room(List& list, size_t bytes);

  ScratchFile file_;
  uint64_t end_ = 0;  ///< of the rooms in the file
  std::vector<List> lists_;
  size_t most_waiting_;
};

/// Appends rising numbers to a list, by the gaps between them: a byte each where they are near one another.
class RisingWriter {
 public:
  /// `at_once`: bytes that wait here.
  RisingWriter(ScratchLists& lists, size_t list, size_t at_once)
      : lists_(&lists), list_(list), at_once_(at_once) {}
  Result<> add(uint64_t number);
  /// After the last one.
  Result<> finish();
  uint64_t count() const { return count_; }

 private:
  ScratchLists* lists_;
  size_t list_, at_once_;
  ByteWriter out_;
  uint64_t next_ = 0, count_ = 0;
};

/// The numbers of a list that RisingWriter made, one after the other, through a small buffer.
class RisingCursor {
 public:
  /// `buffer`: bytes read at once, at least 16.
  RisingCursor(ScratchLists& lists, size_t list, size_t buffer)
      : lists_(&lists), list_(list), buffer_(buffer) {}
  /// False: there is no more. Before the first number, too.
  Result<bool> next();
  uint64_t number() const { return number_; }

 private:
  Result<> fill();

  ScratchLists* lists_;
  size_t list_;
  ScratchLists::Place place_;
  std::vector<std::byte> buffer_;
  size_t at_ = 0, end_ = 0;
  bool all_read_ = false;
  uint64_t next_ = 0, number_ = 0;
};

/// All numbers of such a list, which are below 2^32.
Result<std::vector<uint32_t>> read_rising(ScratchLists& lists, size_t list);

}  // namespace maille
