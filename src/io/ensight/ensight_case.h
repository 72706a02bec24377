#pragma once

#include <maille/source.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace maille {

/// The numbers by which a line of the case refers to a time set and a file set; 0: none.
struct EnsightSets {
  int64_t time = 0, file = 0;
};

/// A variable and the file (or pattern of files) that holds it; one value of `components` numbers for each
/// element.
struct EnsightVariable {
  std::string name, file;
  unsigned components = 1;
  bool on_points = true;
  EnsightSets sets;
};

/// Of a whole case: one number, or one for each step of a time set.
struct EnsightConstant {
  std::string name;
  std::vector<double> values;
};

/// Steps of time, ascending, and how their files are numbered.
struct EnsightTimeSet {
  int64_t number = 0;
  uint64_t steps = 0;
  std::vector<double> times;
  /// What stands for the stars of file names, one for each step.
  std::vector<double> file_numbers;
  std::optional<int64_t> first_number;
  int64_t increment = 1;
};

/// Steps that share files: how many are in each, and the number for the stars of its name.
struct EnsightFileSet {
  struct File {
    std::optional<int64_t> number;
    uint64_t steps = 0;
  };
  int64_t number = 0;
  std::vector<File> files;
};

/// Where the data of a step are: the file, and how many steps stand before it there.
struct EnsightPlace {
  std::string file;
  uint64_t steps_before = 0;
  bool many_steps = false;
};

/// The case file of EnSight Gold: which files there are, and their times.
struct EnsightCase {
  std::string geometry;
  EnsightSets geometry_sets;
  std::vector<EnsightVariable> variables;
  std::vector<EnsightConstant> constants;
  std::vector<EnsightTimeSet> time_sets;
  std::vector<EnsightFileSet> file_sets;
  std::vector<std::string> notes;

  /// The times of all sets, ascending; none without time sets.
  std::vector<double> times() const;
  /// Of the step of the set that holds at this time: the last one that has begun, or the first one.
  Result<EnsightPlace> place(const std::string& case_file, const std::string& file, EnsightSets sets,
                             std::optional<double> time) const;
};

bool recognise_ensight(Bytes first_bytes);
/// Errors: malformed_input, unsupported.
Result<EnsightCase> read_ensight_case(std::string_view text, const std::string& name);

}  // namespace maille
