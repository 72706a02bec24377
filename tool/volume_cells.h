#pragma once

#include <maille/volume_file.h>

#include <optional>

#include "files.h"
#include "options.h"

namespace maille::tool {

/// The names of all arrays of a volume.
std::vector<std::string> names_of_arrays(const StreamDescription& description);

/// What may be fetched grows by what the query reads.
Result<> allow(const VolumeFile& file, const VolumeQuery& query, const Input& input);

/// A plane by a point on it and its normal. Error: usage, for a normal of no length.
Result<Region::Plane> plane_of(const std::vector<double>& numbers);

/// A volume that is open for queries. Of a file of mode stream a query reads no more than it has to; other
/// inputs are read once, whole, when they are opened.
class VolumeInput {
 public:
  static Result<VolumeInput> open(const VolumeOptions& options);

  /// The cells a query is for, with the arrays wanted; of other inputs than mode stream all of them. Error:
  /// corrupt, where a piece is damaged.
  Result<const Mesh*> cells(const VolumeQuery& query);

  const Input& input() const { return input_; }

 private:
  VolumeInput(Input input, unsigned threads) : input_(std::move(input)), threads_(threads) {}

  Input input_;
  Threads threads_;
  std::optional<VolumeFile> file_;
  Mesh mesh_;  ///< all of it, or what the last query was for
};

}  // namespace maille::tool
