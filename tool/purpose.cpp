#include "purpose.h"

#include <algorithm>

#include "tolerance.h"

namespace maille::tool {

const std::vector<Purpose>& purposes() {
  static const std::vector<Purpose> all = {
      // The bits are what gltfpack and gltf-transform use for glTF; -2 is decoded eight times as fast as -5.
      {.name = "web",
       .summary =
           "to look at: -2 --bits 14 --bits normal=10 --bits tangent=10 --bits texcoord=12 --bits color=8",
       .effort = 2,
       .bits = {"14", "normal=10", "tangent=10", "texcoord=12", "color=8"}},
      // Programs for printing compute normals themselves, and printers reach some ten micrometres.
      {.name = "print",
       .summary =
           "positions within half a micrometre where the unit is a millimetre, no normals: --error 0.0005 "
           "--drop normal",
       .error = "0.0005",
       .dropped = {"normal"}},
      {.name = "archive",
       .summary = "the smallest file, bit for bit, in the order of the input: -9 --keep-order",
       .effort = 9,
       .keep_order = true},
      {.name = "simulation",
       .summary = "volumes with fields, bit for bit, of which parts can be read: --mode stream --pieces auto",
       .mode = Mode::stream,
       .pieces = "auto"},
      {.name = "scan",
       .summary =
           "large surfaces, bit for bit, seen and read in parts, with levels of detail: --mode random -2",
       .mode = Mode::random,
       .effort = 2},
  };
  return all;
}

namespace {

/// Is there a bound of the same array, or of positions?
bool has_bound(const CompressOptions& options, const std::string& name) {
  for (const auto& [kind, texts] : options.bounds) {
    for (const std::string& text : texts) {
      if (means_same_array(bound_name(text), name)) return true;
    }
  }
  return false;
}

void add_bound(Tolerance::Kind kind, const std::string& text, const CompressOptions& given,
               CompressOptions& options) {
  if (!options.lossless && !has_bound(given, bound_name(text))) options.bounds[kind].push_back(text);
}

}  // namespace

void set_for(const std::string& name, const Given& given, CompressOptions& options) {
  const auto found = std::find_if(purposes().begin(), purposes().end(),
                                  [&](const Purpose& each) { return each.name == name; });
  if (found == purposes().end()) return;
  const Purpose& purpose = *found;
  // What the user gave counts, not what this function has added so far.
  const CompressOptions before = options;
  options.lenient = true;
  // A purpose only fills in what was not given; options beside it always win.
  if (!options.mode) options.mode = purpose.mode;
  if (!given.effort) options.effort = purpose.effort.value_or(options.effort);
  if (!given.order) options.keep_order = purpose.keep_order;
  const bool stream = options.mode.value_or(Mode::stream) == Mode::stream;
  if (options.pieces.empty() && stream && options.delay == 0) options.pieces = purpose.pieces;
  for (const std::string& text : purpose.bits) add_bound(Tolerance::Kind::bits, text, before, options);
  if (!purpose.error.empty()) add_bound(Tolerance::Kind::absolute, purpose.error, before, options);
  if (!options.lossless && !options.arrays.wanted)
    options.arrays.dropped.insert(options.arrays.dropped.end(), purpose.dropped.begin(),
                                  purpose.dropped.end());
}

}  // namespace maille::tool
