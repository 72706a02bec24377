#include "description/remains.h"

namespace maille {

std::string sentence_of(const Remains& remains) {
  constexpr size_t most_named = 8;
  std::string sentence;
  for (size_t i = 0; i < remains.lost.size() && i < most_named; ++i)
    sentence += (i == 0 ? "; lost: " : ", ") + remains.lost[i];
  if (remains.lost.size() > most_named)
    sentence += ", and " + std::to_string(remains.lost.size() - most_named) + " more";
  return sentence;
}

}  // namespace maille
