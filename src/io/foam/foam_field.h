#pragma once

#include <maille/mesh.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace maille {

// Fields of a case of OpenFOAM ("0.1/p"): text, and lists of values in it, as text or in binary. A mesh keeps
// the values as an array and the text around them as metadata, in which a mark stands for each list. So a
// field comes back with its boundary conditions, units and comments as they were.

/// What an OpenFOAM class of fields holds values of, and how many numbers each has.
struct FoamFieldKind {
  enum class Place : uint8_t { cells, faces, points };
  Place place = Place::cells;
  uint32_t components = 1;
};
/// The kind of "volScalarField", "surfaceVectorField", "pointTensorField", "volScalarField::Internal";
/// nothing for others.
std::optional<FoamFieldKind> foam_field_kind(std::string_view type);

/// How many numbers a value of "scalar", "vector" ..., "label" or "bool" has; 0 for others.
uint32_t foam_components(std::string_view type);

/// "scalar" of "volScalarField"; empty for other classes.
std::string_view foam_list_type(std::string_view type);

/// "uniform X", or a list of values, as it stands in the text of a field. All places are offsets into the
/// text.
struct FoamValues {
  std::string patch;  ///< empty: those of the field itself
  std::string entry;  ///< "value"; empty: those of the field itself
  std::string type;   ///< "scalar", "vector"; empty where the text does not say it
  bool uniform = false;
  bool repeated = false;  ///< N{value}
  bool marked = false;    ///< a mark instead of the list
  uint64_t count = 0;
  size_t begin = 0, end = 0;  ///< in the text: of "uniform X", or of what follows "List<type>"
  size_t values = 0;          ///< where X or the first value of a list begins

  bool is_internal() const { return entry.empty(); }
};

/// An entry of boundaryField, which is mostly a patch of the mesh.
struct FoamPatchText {
  std::string patch;
  size_t begin = 0, end = 0;  ///< in the text, from the name to behind the closing brace
};

/// The text of a field, taken apart as far as lists ask for it. `text` is a view of the file, which must
/// stay.
struct FoamField {
  std::string name;  ///< of the file, for messages
  std::string_view text;
  std::string type;      ///< "volScalarField"
  std::string object;    ///< the header's
  std::string location;  ///< the header's, without quotes
  bool binary = false, single = false, wide_labels = false;
  std::vector<FoamValues> values;
  std::vector<FoamValues> empty_lists;  ///< of patches, without values
  std::vector<FoamPatchText> patches;
  /// Entries that are not plain text to OpenFOAM: directives and code, which it runs. The first one.
  std::string directive;
  /// Places in the text that change when a field is written elsewhere: of the header's location and format.
  size_t location_begin = 0, location_end = 0, format_begin = 0, format_end = 0;

  Scalar scalar() const { return single ? Scalar::f32 : Scalar::f64; }
  /// "0.1/p: line 12: what".
  tl::unexpected<Error> bad(size_t at, const std::string& what) const;
};

/// Stands for a list in a text: this, for numbers in text the digits they have at most, and a blank. Nothing
/// that OpenFOAM reads begins so.
inline constexpr char foam_list_mark = '@';

/// Finds the lists of a field; of a file of another class, the header alone. Bounded by the text: every list
/// lies in it. Error: malformed_input, with the line.
Result<FoamField> scan_foam_field(std::string_view text, const std::string& name);

/// Reads the values of a field one after the other, in the form of the file. For lists as long as they say,
/// and uniform values, which repeat without end.
class FoamValueReader {
 public:
  FoamValueReader(const FoamField& field, const FoamValues& values);
  uint32_t components() const { return components_; }
  /// The next value: `components()` numbers of type `field.scalar()`. Error: malformed_input.
  Result<> next(std::byte* out);
  /// Call this behind the last value of a list: malformed_input where more follows.
  Result<> end();
  /// Of the numbers so far, the most significant digits that one was written with.
  int digits() const { return digits_; }

 private:
  Result<> read_text(std::byte* out);
  void store(std::byte* out, uint32_t component, double value) const;

  const FoamField& field_;
  const FoamValues& values_;
  uint32_t components_;
  size_t at_;
  uint64_t number_ = 0;
  int digits_ = 0;
  std::vector<std::byte> repeated_;
};

}  // namespace maille
