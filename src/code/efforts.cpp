#include "code/efforts.h"

#include <maille/encode.h>

namespace maille {
namespace {

// By row of the table; not in it, as decoders for the web have that, too. Figures: build/data at 14 bits,
// volumes lossless.
constexpr std::array<const char*, efforts.size()> summaries = {
    "surfaces in two thirds of the time of -2, both ways",
    "surfaces a tenth smaller than at -1",
    "volumes a tenth smaller than at -2, at two thirds of the speed; surfaces hardly smaller",
    "surfaces a fifth smaller than at -5, decoded at a thirtieth of the speed; fields of volumes a few "
    "percent",
};

}  // namespace

std::vector<EffortRange> effort_ranges() {
  std::vector<EffortRange> ranges;
  for (size_t i = 0; i < efforts.size(); ++i)
    ranges.push_back({efforts[i].first, efforts[i].last, summaries[i]});
  return ranges;
}

}  // namespace maille
