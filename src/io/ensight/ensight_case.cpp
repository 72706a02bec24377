#include "io/ensight/ensight_case.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "base/sort_unique.h"
#include "io/reading.h"
#include "io/text_scanner.h"

namespace maille {
namespace {

struct VariableKind {
  std::string_view key;
  unsigned components;
  bool on_points;
};
constexpr VariableKind variable_kinds[] = {
    {"scalar per node", 1, true},          {"vector per node", 3, true},
    {"tensor symm per node", 6, true},     {"tensor asym per node", 9, true},
    {"scalar per element", 1, false},      {"vector per element", 3, false},
    {"tensor symm per element", 6, false}, {"tensor asym per element", 9, false}};

/// Words of a line; names with blanks stand in quotes. Each round takes a character at least, so it ends.
std::vector<std::string> words_of(std::string_view line) {
  std::vector<std::string> words;
  while (!(line = trim(line)).empty()) {
    const bool quoted = line[0] == '"';
    if (quoted) line.remove_prefix(1);
    const size_t end = std::min(quoted ? line.find('"') : line.find_first_of(" \t"), line.size());
    words.emplace_back(line.substr(0, end));
    line.remove_prefix(std::min(end + 1, line.size()));
  }
  return words;
}

std::optional<int64_t> integer_of(std::string_view text) {
  int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<double> number_of(std::string_view text) {
  Number number;
  const char* const end = text.data() + text.size();
  if (parse_number(text.data(), end, number) != end || !std::isfinite(number.value)) return std::nullopt;
  return number.value;
}

/// Reads a case file line by line. A line without a colon is a section or, behind a key whose list of numbers
/// may go on, more numbers. What is not read is noted where the mesh is complete without it, and refused
/// where it is not.
class CaseReader {
 public:
  CaseReader(std::string_view text, const std::string& name) : scanner_(text), name_(name) {}

  Result<EnsightCase> read() {
    scanner_.skip_byte_order_mark();
    for (; !scanner_.at_end(); scanner_.skip_line_end()) {
      line_ = scanner_.line();
      const std::string_view line = trim(scanner_.rest_of_line());
      if (line.empty() || line[0] == '#') continue;
      MAILLE_CHECK(read_line(line));
    }
    if (!gold_)
      return failure(ErrorCode::unsupported,
                     name_ + ": its type is not \"ensight gold\"; older EnSight formats are not read");
    if (case_.geometry.empty())
      return failure(ErrorCode::malformed_input, name_ + ": it names no file with the geometry (model:)");
    for (EnsightTimeSet& set : case_.time_sets) MAILLE_CHECK(finish(set));
    return std::move(case_);
  }

 private:
  Result<> read_line(std::string_view line) {
    const size_t colon = line.find(':');
    if (colon == std::string_view::npos) {
      if (list_ != nullptr && number_of(words_of(line).front())) return add_numbers(line);
      section_ = line;
      list_ = nullptr;
      return {};
    }
    list_ = nullptr;
    const std::string key(trim(line.substr(0, colon)));
    const std::string_view rest = line.substr(colon + 1);
    if (section_ == "FORMAT" && key == "type")
      gold_ = words_of(rest) == std::vector<std::string>{"ensight", "gold"};
    if (section_ == "GEOMETRY") return read_geometry(key, words_of(rest));
    if (section_ == "VARIABLE") return read_variable(key, words_of(rest));
    if (section_ == "TIME") return read_time(key, rest);
    if (section_ == "FILE") return read_file_set(key, rest);
    return {};
  }

  /// Takes the numbers of a time set and a file set from in front of `least` other words: without counting
  /// them, a name that is a number could not be told from a set.
  static EnsightSets take_sets(std::vector<std::string>& words, size_t least) {
    EnsightSets sets;
    for (int64_t* set : {&sets.time, &sets.file}) {
      const auto number = words.size() > least ? integer_of(words.front()) : std::nullopt;
      if (!number) break;
      *set = *number;
      words.erase(words.begin());
    }
    return sets;
  }

  Result<> read_geometry(const std::string& key, std::vector<std::string> words) {
    if (key != "model") {
      case_.notes.push_back("geometry \"" + key.substr(0, 40) + "\" left out");
      return {};
    }
    case_.geometry_sets = take_sets(words, 1);
    if (words.empty()) return malformed("there should be the name of a file");
    case_.geometry = words[0];
    // With a step behind it, connectivity is in the file of that step only, and other files have none.
    if (words.size() > 2 && words[1] == "change_coords_only")
      return failure(ErrorCode::unsupported,
                     name_ + ": connectivity in the file of one step only (change_coords_only) is not read");
    return {};
  }

  Result<> read_variable(const std::string& key, std::vector<std::string> words) {
    if (key == "constant per case") return read_constant(std::move(words));
    const bool complex = key.starts_with("complex ");
    const std::string_view real = std::string_view(key).substr(complex ? 8 : 0);
    const auto* const kind = std::find_if(std::begin(variable_kinds), std::end(variable_kinds),
                                          [&](const VariableKind& known) { return known.key == real; });
    if (kind == std::end(variable_kinds) || (complex && kind->components > 3)) {
      case_.notes.push_back("variable \"" + key.substr(0, 40) + "\" left out");
      return {};
    }
    const EnsightSets sets = take_sets(words, complex ? 4 : 2);
    if (words.size() < (complex ? 4 : 2)) return malformed("there should be a name and a file");
    const auto add = [&](const std::string& name, const std::string& file) {
      case_.variables.push_back({name, file, kind->components, kind->on_points, sets});
    };
    // A complex variable is two files, and becomes two arrays.
    if (!complex) {
      add(words[0], words.back());
    } else {
      add(words[0] + ":real", words[1]);
      add(words[0] + ":imaginary", words[2]);
    }
    return {};
  }

  Result<> read_constant(std::vector<std::string> words) {
    const EnsightSets sets = take_sets(words, 2);
    if (words.size() < 2) return malformed("there should be a name and a value");
    if (sets.time != 0) {
      case_.notes.push_back("constant \"" + words[0] + "\" left out: it changes in time");
      return {};
    }
    EnsightConstant constant{words[0], {}};
    for (size_t i = 1; i < words.size(); ++i) {
      const auto value = number_of(words[i]);
      if (!value) return malformed("\"" + words[i].substr(0, 40) + "\" where a number belongs");
      constant.values.push_back(*value);
    }
    case_.constants.push_back(std::move(constant));
    return {};
  }

  Result<> read_time(const std::string& key, std::string_view rest) {
    if (key == "time set") {
      case_.time_sets.emplace_back();
      return whole(rest, case_.time_sets.back().number);
    }
    if (case_.time_sets.empty()) return malformed("there should be \"time set:\" before");
    EnsightTimeSet& set = case_.time_sets.back();
    if (key == "number of steps") return count(rest, set.steps);
    if (key == "filename increment") return whole(rest, set.increment);
    if (key == "filename start number") {
      int64_t first = 0;
      MAILLE_CHECK(whole(rest, first));
      set.first_number = first;
      return {};
    }
    if (key == "time values" || key == "filename numbers") {
      list_ = key == "time values" ? &set.times : &set.file_numbers;
      return add_numbers(rest);
    }
    // Other keys (names or numbers of files in another file) decide which file is read, so guessing would be
    // wrong.
    return failure(ErrorCode::unsupported,
                   name_ + ": line " + std::to_string(line_) + ": \"" + key.substr(0, 40) + "\" is not read");
  }

  Result<> read_file_set(const std::string& key, std::string_view rest) {
    if (key == "file set") {
      case_.file_sets.emplace_back();
      return whole(rest, case_.file_sets.back().number);
    }
    if (case_.file_sets.empty()) return malformed("there should be \"file set:\" before");
    auto& files = case_.file_sets.back().files;
    if (key == "filename index") {
      int64_t number = 0;
      MAILLE_CHECK(whole(rest, number));
      files.push_back({number, 0});
      return {};
    }
    if (key != "number of steps") return {};
    if (files.empty()) files.emplace_back();
    return count(rest, files.back().steps);
  }

  Result<> whole(std::string_view text, int64_t& value) const {
    // A description may follow.
    const auto words = words_of(text);
    const auto number = words.empty() ? std::nullopt : integer_of(words.front());
    if (!number) return malformed("there should be a whole number");
    value = *number;
    return {};
  }
  Result<> count(std::string_view text, uint64_t& value) const {
    int64_t number = 0;
    MAILLE_CHECK(whole(text, number));
    if (number < 0) return malformed("there should be a number of steps");
    value = static_cast<uint64_t>(number);
    return {};
  }
  Result<> add_numbers(std::string_view text) const {
    for (const std::string& word : words_of(text)) {
      const auto number = number_of(word);
      if (!number) return malformed("\"" + word.substr(0, 40) + "\" where a number belongs");
      list_->push_back(*number);
    }
    return {};
  }

  /// Every step has a time, and sets that have numbers for file names have one for each. Steps that are
  /// claimed are only used after this, so a count costs nothing.
  Result<> finish(const EnsightTimeSet& set) const {
    const std::string what = name_ + ": time set " + std::to_string(set.number);
    if (set.steps != set.times.size() || set.steps == 0)
      return failure(ErrorCode::malformed_input, what + " has " + counted(set.steps, "step") + " but " +
                                                     counted(set.times.size(), "time"));
    if (!set.file_numbers.empty() && set.file_numbers.size() != set.steps)
      return failure(ErrorCode::malformed_input, what + " has " + counted(set.steps, "step") + " but " +
                                                     counted(set.file_numbers.size(), "number") +
                                                     " for names of files");
    if (!std::is_sorted(set.times.begin(), set.times.end()))
      return failure(ErrorCode::unsupported, what + ": its times do not ascend");
    return {};
  }
  tl::unexpected<Error> malformed(const std::string& what) const {
    return malformed_line(name_, line_, what);
  }

  TextScanner scanner_;
  std::string name_, section_;
  EnsightCase case_;
  // Points into case_.time_sets.back(); a new set is only begun after it was cleared.
  std::vector<double>* list_ = nullptr;  // what further lines of numbers belong to
  uint64_t line_ = 1;
  bool gold_ = false;
};

template <class Sets>
auto find_set(const Sets& sets, int64_t number) {
  return std::find_if(sets.begin(), sets.end(), [&](const auto& set) { return set.number == number; });
}

/// The file's name with its stars replaced by the number, padded with zeros to as many digits as there are
/// stars.
Result<std::string> without_stars(const std::string& case_file, std::string name, double number) {
  const size_t first = name.find('*');
  if (first == std::string::npos) return name;
  const size_t last = std::min(name.find_first_not_of('*', first), name.size());
  // 2^53 is about 9e15: all whole numbers below 1e15 are exact in a double. NaN fails the comparison.
  if (!(number >= 0 && number < 1e15))
    return failure(ErrorCode::malformed_input,
                   case_file + ": the name \"" + name + "\" has stars, but no number to put there");
  std::string digits = std::to_string(static_cast<uint64_t>(number));
  if (digits.size() < last - first) digits.insert(0, last - first - digits.size(), '0');
  return name.replace(first, last - first, digits);
}

}  // namespace

bool recognise_ensight(Bytes first_bytes) {
  const std::string_view text(reinterpret_cast<const char*>(first_bytes.data()), first_bytes.size());
  const size_t type = text.find("type:");
  return text.find("FORMAT") < type && type != std::string_view::npos &&
         text.find("ensight", type) != std::string_view::npos;
}

Result<EnsightCase> read_ensight_case(std::string_view text, const std::string& name) {
  return CaseReader(text, name).read();
}

std::vector<double> EnsightCase::times() const {
  std::vector<double> all;
  for (const EnsightTimeSet& set : time_sets) all.insert(all.end(), set.times.begin(), set.times.end());
  sort_unique(all);
  return all;
}

Result<EnsightPlace> EnsightCase::place(const std::string& case_file, const std::string& file,
                                        EnsightSets sets, std::optional<double> time) const {
  const bool stars = file.find('*') != std::string::npos;
  // A name with stars but without a set is taken to mean the first one.
  if (sets.time == 0 && stars && !time_sets.empty()) sets.time = time_sets[0].number;
  if (sets.time == 0) return EnsightPlace{MAILLE_TRY(without_stars(case_file, file, -1)), 0, false};
  const auto set = find_set(time_sets, sets.time);
  if (set == time_sets.end())
    return failure(ErrorCode::malformed_input,
                   case_file + ": there is no time set " + std::to_string(sets.time));
  // finish() has made sure that each set has a time.
  const auto behind =
      std::upper_bound(set->times.begin(), set->times.end(), time.value_or(set->times.back()));
  uint64_t step = behind == set->times.begin() ? 0 : static_cast<uint64_t>(behind - set->times.begin()) - 1;
  const double start = set->first_number ? static_cast<double>(*set->first_number) : -1;
  const double number = !set->file_numbers.empty() ? set->file_numbers[step]
                        : set->first_number
                            ? start + static_cast<double>(step) * static_cast<double>(set->increment)
                            : -1;
  if (sets.file == 0) return EnsightPlace{MAILLE_TRY(without_stars(case_file, file, number)), 0, false};
  const auto shared = find_set(file_sets, sets.file);
  if (shared == file_sets.end())
    return failure(ErrorCode::malformed_input,
                   case_file + ": there is no file set " + std::to_string(sets.file));
  for (const EnsightFileSet::File& each : shared->files) {
    const double index = each.number ? static_cast<double>(*each.number) : -1;
    if (step < each.steps) return EnsightPlace{MAILLE_TRY(without_stars(case_file, file, index)), step, true};
    step -= each.steps;
  }
  return failure(ErrorCode::malformed_input, case_file + ": file set " + std::to_string(sets.file) +
                                                 " has fewer steps than its time set");
}

}  // namespace maille
