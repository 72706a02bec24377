#pragma once

#include <maille/stream.h>

#include <deque>

#include "container/file_reader.h"
#include "volume/stream/stream_layout.h"
#include "volume/values/array_stage.h"

namespace maille {

/// Steps whose number is a multiple of this need no other one: a reader opens at most 16 steps for one. Part
/// of the format. Chosen, no sweep is on record: less often would make single steps slower to read, more
/// often would make files larger.
inline constexpr uint64_t key_steps = 16;

/// The values of one step in a file, apart from the mesh, and of the steps before it that it needs. Headers
/// only are read on opening; tuples are read batch by batch.
class StepValues {
 public:
  /// Step `number` of the file, counted from 1. `source` must outlive it. Errors: usage (there is no such
  /// step), corrupt (also of a step before that is needed), memory_bound, cannot_read, unsupported.
  static Result<StepValues> open(const Source& source, uint64_t number, const Limits& limits = {});

  uint64_t number() const { return number_; }
  const StepHeader& header() const { return headers_.back(); }
  /// Of this step, or of one that it needs.
  const StepHeader& header_of(uint64_t step) const {
    return headers_[headers_.size() - 1 - static_cast<size_t>(number_ - step)];
  }
  /// Of this step; `mesh`: that of the mesh. Errors: corrupt, memory_bound, cannot_read.
  Result<Metadata> metadata(const StreamHeader& mesh) const;
  /// Coded tuples of an array in a batch.
  Result<std::vector<std::byte>> read(uint64_t step, uint32_t batch, size_t array) const;

 private:
  StepValues(FileReader file, uint64_t number, const Limits& limits)
      : file_(std::move(file)), number_(number), limits_(limits) {}
  FileReader file_;
  uint64_t number_;
  Limits limits_;
  std::deque<StepHeader> headers_;  ///< of the steps up to this one
};

/// The metadata of a step of the file; that of the mesh for step 0. Errors: corrupt, memory_bound,
/// cannot_read.
Result<Metadata> metadata_of_step(const FileReader& file, const StreamHeader& mesh, uint64_t step,
                                  const Limits& limits = {});

/// Key of the values of array i of a step in a batch. Error: unsupported, beyond 2^32 of them.
Result<StreamKey> key_of(uint64_t step, uint64_t batch, uint64_t array, uint64_t arrays);

/// One array as a reader gives it out: coded by itself, or as differences of codes to that of the step
/// before, which may be differences, too. Links stand from the first to the last; each is decoded on top of
/// the one before, block by block, so that no more than a block of values is held.
class ValueChain {
 public:
  /// Array `i` (positions: none) of the mesh.
  static ValueChain of_mesh(const StreamHeader& mesh, std::optional<size_t> array);
  /// Array `i` of the step. Error: corrupt, where the step before has no array like it.
  static Result<ValueChain> of_step(const StreamHeader& mesh, const StepValues& values, size_t array);

  Domain domain() const { return links_.front().stage.domain(); }
  size_t tuple_size() const { return size_of(type_) * components_; }
  /// The array of the mesh that all begins with, counted from 1; 0: none.
  size_t mesh_array() const { return links_.front().step == 0 ? links_.front().array + 1 : 0; }
  /// What the coders take at most before they have met any number.
  uint64_t coder_bytes() const { return coder_bytes_; }
  /// What came to that, while numbers of so many slots of points or cells are kept.
  uint64_t grown_bytes(uint64_t points, uint64_t cells) const;

  /// `of_mesh`: the bytes of mesh_array() in the batch; `values`: what of_step() was given.
  Result<> begin_batch(Bytes of_mesh, const StepValues* values, uint32_t batch);
  /// A batch of which this domain has no tuples.
  void begin_empty_batch();
  /// code() needs to know where points are.
  bool is_placed() const;
  /// Decodes the tuples of a block. False: the stream is damaged.
  bool code(const CodedCells& cells, std::span<const Vector3> places, std::byte* tuples);

 private:
  struct Link {
    uint64_t step;
    size_t array;
    ArrayStage<RansDecoder> stage;
    std::vector<NumberMap> maps;  ///< of differences: what the codes are of
    std::vector<std::byte> bytes = {};
  };
  ValueChain(Scalar type, uint32_t components) : type_(type), components_(components) {}
  void add(uint64_t step, size_t array, const StreamedArray& coded, Domain domain,
           std::vector<NumberMap> maps = {});

  Scalar type_;
  uint32_t components_;
  uint64_t coder_bytes_ = 0;
  std::vector<Link> links_;
  std::vector<std::byte> differences_;
};

/// Differences of codes of lattices: `tuples` become what the differences to them say, or the differences are
/// found. Both wrap in the width of the codes. docs/format.md, 16.9.
void add_differences(Scalar type, const std::vector<NumberMap>& maps, Bytes differences, std::byte* tuples);
void find_differences(Scalar type, const std::vector<NumberMap>& maps, Bytes before, Bytes tuples,
                      std::byte* differences);

}  // namespace maille
