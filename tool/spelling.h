#pragma once

#include <maille/error.h>

#include <string>
#include <string_view>
#include <vector>

namespace maille::tool {

/// The candidate that a misspelt word most likely means: the first of those at the least distance, counted in
/// letters that are missing, too many, wrong, or swapped with the next one (optimal string alignment).
/// Capitals count as small letters. Empty where none is near: more than a third of the word would have to
/// change.
std::string nearest_word(std::string_view word, const std::vector<std::string>& candidates);

/// " (did you mean 'X'?)", or nothing.
std::string suggestion(std::string_view word, const std::vector<std::string>& candidates);

/// Error (usage): an array that a mesh does not have, with the nearest name, and all that it has.
tl::unexpected<Error> no_array(const std::string& file, const std::string& name,
                               const std::vector<std::string>& known);
/// An unknown name of an array is an error (usage), not an output without that array, because it is mostly a
/// typing mistake.
Result<> check_names(const std::string& file, const std::vector<std::string>& wanted,
                     const std::vector<std::string>& known);

}  // namespace maille::tool
