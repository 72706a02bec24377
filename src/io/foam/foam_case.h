#pragma once

#include <maille/mesh.h>

#include <optional>
#include <string>
#include <vector>

#include "base/result.h"

namespace maille {

/// A folder of a case whose name is a time.
struct FoamTime {
  std::string name;
  double value = 0;
  bool divided = false;  ///< in the folders of processors
};

/// What a path says of a case of OpenFOAM.
struct FoamCasePath {
  std::string folder;            ///< of the case; empty: the path is that of a mesh alone
  std::vector<FoamTime> times;   ///< with files in them, by value
  std::optional<FoamTime> time;  ///< the path is that of this one
};
/// The case of a path: of a case itself, a ".foam" file in it, the folder of a time in it or a file in that.
FoamCasePath foam_case_of(const std::string& path);
/// The folders of a case that are times, with files in them, by value.
std::vector<FoamTime> foam_times_in(const std::string& folder);
/// The number that a folder's name is, if it is one and finite.
std::optional<double> foam_time_of(const std::string& name);

/// A file of a case or of a time that is kept as text.
struct FoamText {
  std::string path;  ///< within the case, or the folder of the time
  std::string text;
};
/// The small text files in `folder`/`inside` and below: dictionaries. What is not kept is told in `notes`.
std::vector<FoamText> read_foam_texts(const std::string& folder, const std::string& inside,
                                      std::vector<std::string>& notes);
/// Whether a path is one of these: relative, without "..", hidden names or signs that shells or OpenFOAM give
/// a meaning to.
bool is_plain_foam_path(const std::string& path);

// Keys of metadata.
inline constexpr char foam_time_key[] = "openfoam.time";        ///< name of the folder
inline constexpr char foam_banner_key[] = "openfoam.banner";    ///< the comment that fields begin with
inline constexpr char foam_field_prefix[] = "openfoam.field.";  ///< and the field's name: its text
inline constexpr char foam_text_prefix[] = "openfoam.text.";    ///< and a path within the folder of a time
inline constexpr char foam_case_prefix[] = "openfoam.case.";    ///< and a path within the case

}  // namespace maille
