#include "spelling.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "result.h"
#include "text.h"

namespace maille::tool {

namespace {

/// Words of the command line are longer than any name by mistake only; the table below grows with both
/// lengths.
constexpr size_t longest_word = 64;

/// Insertions, deletions, changes and swaps of neighbours that turn one word into the other (Damerau 1964, in
/// its restricted form, which counts no letter twice).
size_t distance_of(const std::string& a, const std::string& b) {
  // Row by row of the usual table; swaps need the row before the last one.
  std::vector<size_t> before_last(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t change = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, change});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before_last[j - 2] + 1);
    }
    std::swap(before_last, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

}  // namespace

std::string nearest_word(std::string_view word, const std::vector<std::string>& candidates) {
  if (word.size() > longest_word) return "";
  const std::string wanted = lower_case(word);
  std::string nearest;
  // At most one mistake for three letters, rounded up; more would suggest words that have nothing in common.
  size_t least = std::max<size_t>(1, (wanted.size() + 2) / 3) + 1;
  for (const std::string& candidate : candidates) {
    if (candidate.size() > longest_word) continue;
    const size_t distance = distance_of(wanted, lower_case(candidate));
    // Nor is one near that has none of the letters: "v" is not "T".
    if (distance >= least || distance >= wanted.size()) continue;
    least = distance;
    nearest = candidate;
  }
  return nearest;
}

std::string suggestion(std::string_view word, const std::vector<std::string>& candidates) {
  const std::string nearest = nearest_word(word, candidates);
  return nearest.empty() ? "" : fmt::format(" (did you mean '{}'?)", nearest);
}

tl::unexpected<Error> no_array(const std::string& file, const std::string& name,
                               const std::vector<std::string>& known) {
  return failure(
      ErrorCode::usage,
      fmt::format("{}: has no array '{}'{}; it has: {}", file, name, suggestion(name, known),
                  known.empty() ? "positions and cells only" : fmt::format("{}", fmt::join(known, ", "))));
}

Result<> check_names(const std::string& file, const std::vector<std::string>& wanted,
                     const std::vector<std::string>& known) {
  for (const std::string& name : wanted) {
    if (std::find(known.begin(), known.end(), name) == known.end()) return no_array(file, name, known);
  }
  return {};
}

}  // namespace maille::tool
