#pragma once

#include <maille/encode.h>
#include <maille/mesh.h>

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "options.h"

namespace maille::tool {

/// An option that allows an error.
struct BoundOption {
  Tolerance::Kind kind;
  const char* name;       ///< as in "--bits"
  const char* flags;      ///< with the short one, if there is one
  const char* arguments;  ///< of compress, "X|NAME=X"; behind the bar those of append
  const char* meaning;
};
extern const std::array<BoundOption, 6> bound_options;

/// A unit of length behind a bound, as in "0.1mm".
struct LengthUnit {
  const char* name;
  double metres;
};

/// The loss asked for on the command line.
struct Tolerances {
  std::optional<Tolerance> positions;
  const LengthUnit* unit = nullptr;  ///< of the bound of positions; without: that of the file
  std::map<std::string, Tolerance> arrays;

  bool lossless() const { return !positions && arrays.empty(); }
};

/// Reads the options of bounds, and --lossless. Errors (usage): no number, a number out of range, two
/// tolerances for one array, --lossless beside a tolerance.
Result<Tolerances> parse_tolerances(const CompressOptions& options);

/// "NAME" of "NAME=X"; empty of "X", which is for positions.
std::string bound_name(const std::string& text);
/// Do two names mean the same array, or the same role?
bool means_same_array(const std::string& a, const std::string& b);

/// The arrays that a name means: the one that has it; or those of a role, for what programs and formats call
/// that ("uv", "COLOR_0", "normals"), of which there may be none. Error: usage, listing the arrays there are.
Result<std::vector<std::string>> arrays_called(const std::string& name, const std::vector<Array>& arrays,
                                               const std::string& input);

/// The loss asked for, by the names of a mesh's arrays. A role that no array has is a note, so that one line
/// serves many files. `metres`: of a unit of the file, if known. Errors: usage, for other names that no array
/// has, and for a bound with a unit where that of the file is not known.
Result<Tolerances> tolerances_of(const Tolerances& asked, const std::vector<Array>& arrays,
                                 const std::string& input, bool quiet, std::optional<double> metres = {});

/// What the positions of a mesh count in: 3MF says it, glTF counts in metres. `format`: of the input; meshes
/// in .maille files have metadata of the one that they came from.
std::optional<double> metres_of_unit(const Mesh& mesh, const std::string& format);

/// A note where an error allowed is so large that the shape goes: for files in metres and bounds in
/// millimetres.
std::optional<std::string> note_of_size(const Tolerances& tolerances, const Mesh& mesh);

/// Notes on relative bounds of arrays most of whose range a few values make: others are all but lost then.
std::vector<std::string> notes_of_ranges(const Tolerances& tolerances, const Mesh& mesh);

}  // namespace maille::tool
