#pragma once

#include <optional>

#include "code/efforts.h"
#include "numbers/shear.h"
#include "surface/fans/position_runs.h"

namespace maille::positions {

/// What the codes of a patch mean: maps and shear give the codes, the bias makes them small enough for
/// floats.
struct CodedNumbers {
  Scalar type;
  std::vector<NumberMap> maps;
  Shear shear;  ///< of codes before bias
  Bias bias{};
  bool wide = false;  ///< as doubles, without a bias

  void widen() {
    wide = true;
    bias = {};
  }
};

/// All points in a coding.
struct CodedPoints {
  Writer writer;
  std::vector<StaticTables> tables;
  std::vector<std::byte> side;  ///< rows, dictionaries and tables
};
struct ChosenCoding {
  Coding coding;
  double size = 0;                 ///< in bytes, as far as trials tell
  std::optional<CodedPoints> all;  ///< where that was asked for, or cost nothing
};

/// Chooses by trials on a sample. `exact`: in the end what an effort adds is compared with what a lower one
/// has by all points, so that no effort is larger than a lower one. The result depends on its arguments
/// alone. `patch` must stay until it returns.
ChosenCoding choose_coding(const Patch& patch, const CodedNumbers& numbers, const Effort& effort, bool exact);

}  // namespace maille::positions
