#pragma once

#include <maille/limits.h>

#include <span>
#include <string>
#include <vector>

#include "io/foam/foam_field.h"
#include "io/foam/foam_processors.h"

namespace maille {

/// Puts the field that processors have parts of together to that of the whole mesh, as text: what
/// reconstructPar would write, but for blanks. Parts, whole and limits must outlive it.
class FoamFieldJoiner {
 public:
  struct Whole {
    uint64_t points = 0, cells = 0, inner_faces = 0;
    std::span<const FoamPatch> patches;
  };
  FoamFieldJoiner(std::span<const FoamProcessors::Part> parts, const Whole& whole, const Limits& limits)
      : parts_(parts), whole_(whole), limits_(limits) {}

  struct Joined {
    std::string text;
    std::string left_out;  ///< why there is none
  };
  /// Joins a file in the folders of a time. Errors: cannot_read, malformed_input, memory_bound of a packed
  /// file.
  Result<Joined> join(const std::string& time, const std::string& name) const;
  std::string first_folder(const std::string& time) const { return parts_[0].place.folder + "/" + time; }

 private:
  std::span<const FoamProcessors::Part> parts_;
  Whole whole_;
  const Limits& limits_;
};

}  // namespace maille
