#pragma once

#include <optional>
#include <queue>
#include <span>
#include <string>
#include <vector>

#include "base/scratch_file.h"

namespace maille {

/// A face as one of its cells has it.
struct FaceUse {
  uint64_t cell = 0, face = 0;
  bool turned = false;  ///< the cell is the face's neighbour
  std::vector<uint32_t> corners;
};

/// Puts the faces of a mesh in the order of cells, and of faces within a cell, out of core: runs that fit
/// into memory are sorted, and merged when they are read.
class FaceSorter {
 public:
  /// `memory`: bytes, about. `folder`: as ScratchFile has it.
  FaceSorter(uint64_t memory, std::string folder) : memory_(memory), folder_(std::move(folder)) {}

  Result<> add(uint64_t cell, uint64_t face, bool turned, std::span<const uint32_t> corners);
  /// Behind the last face.
  Result<> sort();
  /// The next one in order; nullptr behind the last. Valid until take().
  const FaceUse* front() const { return waiting_.empty() ? nullptr : &runs_[waiting_.top().run].use; }
  Result<> take();

 private:
  struct Entry {
    uint64_t cell, face, begin;
    uint32_t size;
    bool turned;
  };
  struct Run {
    uint64_t at, end;  ///< of what was not read yet
    std::vector<std::byte> window;
    size_t place = 0;
    FaceUse use;
  };
  struct Head {
    uint64_t cell, face;
    size_t run;
    bool operator<(const Head& other) const {  // the least one is on top
      return cell != other.cell ? cell > other.cell : face > other.face;
    }
  };
  Result<> write_run();
  Result<> advance(size_t run);
  Result<> provide(Run& run, size_t bytes);

  uint64_t memory_;
  std::string folder_;
  std::optional<ScratchFile> file_;
  std::vector<Entry> entries_;
  std::vector<uint32_t> corners_;
  std::vector<Run> runs_;
  size_t window_bytes_ = 0;
  std::priority_queue<Head> waiting_;
};

}  // namespace maille
