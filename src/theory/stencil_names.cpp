#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>

#include "base/result.h"
#include "theory/named_stencils.h"

namespace maille {

namespace {

using Words = std::vector<std::string>;

/// One kind of stencil: how it is called, and how it is made of the words behind its name. The list is at the
/// same time the help's and the parser's.
struct Family {
  StencilFamily info;
  std::function<Result<NamedStencil>(const Words&)> make;
};

/// Between colons; an empty word stays one, and its number is refused later.
Words split_name(const std::string& name) {
  Words words;
  size_t first = 0;
  for (size_t colon = name.find(':'); colon != std::string::npos; colon = name.find(':', first)) {
    words.push_back(name.substr(first, colon - first));
    first = colon + 1;
  }
  words.push_back(name.substr(first));
  return words;
}

/// A whole number, decimal or as 0x..., within bounds. from_chars of integers does not depend on the user's
/// language.
Result<unsigned> number(const std::string& word, const std::string& what, unsigned lowest, unsigned highest) {
  const bool hexadecimal = word.size() > 2 && word[0] == '0' && word[1] == 'x';
  const char* first = word.data() + (hexadecimal ? 2 : 0);
  const char* last = word.data() + word.size();
  unsigned value = 0;
  const auto [end, error] = std::from_chars(first, last, value, hexadecimal ? 16 : 10);
  if (error != std::errc() || end != last || value < lowest || value > highest) {
    return failure(ErrorCode::usage, what + " is a number from " + std::to_string(lowest) + " to " +
                                         std::to_string(highest) + ", not '" + word + "'");
  }
  return value;
}

PredictionRule taylor(unsigned order = largest_taylor_order) {
  PredictionRule rule;
  rule.order = order;
  return rule;
}

PredictionRule spectral() {
  PredictionRule rule;
  rule.kind = PredictionRule::Kind::spectral;
  return rule;
}

/// Stencils without parameters.
Family plain(std::string name, std::string description, Stencil (*make)(), PredictionRule rule = taylor()) {
  return {{name, name, std::move(description)}, [=](const Words&) -> Result<NamedStencil> {
            return NamedStencil{make(), rule};
          }};
}

/// Stencils of a valence.
Family by_valence(std::string name, std::string description, Stencil (*make)(unsigned), PredictionRule rule) {
  return {{name, name + ":K", std::move(description)}, [=](const Words& words) -> Result<NamedStencil> {
            // With centre and target these are at most 62 samples, which predict() takes.
            const unsigned valence = MAILLE_TRY(number(words[0], "K", 3, 60));
            return NamedStencil{make(valence), rule};
          }};
}

/// Digits with a point between them; strtod would ask the user's language about the point. NaN: something
/// else.
double decimal(const std::string& word) {
  const size_t point = std::min(word.find('.'), word.size());
  const std::string digits = word.substr(0, point) + (point < word.size() ? word.substr(point + 1) : "");
  // Nine digits are exact in a double.
  if (digits.empty() || digits.size() > 9) return NAN;
  double value = 0;
  for (const char digit : digits) {
    if (digit < '0' || digit > '9') return NAN;
    value = 10 * value + (digit - '0');
  }
  for (size_t i = point + 1; i < word.size(); ++i) value /= 10;
  return value;
}

/// How far the tips are: by the model's name, or as a number.
Result<double> tips_from(const std::string& word, unsigned valence) {
  if (word == "reflected") return tip_distance(valence, Tips::reflected);
  if (word == "equilateral") return tip_distance(valence, Tips::equilateral);
  const double distance = decimal(word);
  if (distance >= 0.1 && distance <= 10) return distance;
  return failure(
      ErrorCode::usage,
      "the tips of a K-star are reflected, equilateral or a distance from 0.1 to 10, not '" + word + "'");
}

Result<NamedStencil> make_k_star(const Words& words) {
  const unsigned valence = MAILLE_TRY(number(words[0], "K", 3, 16));
  const std::string tips = words.size() < 2 ? "reflected" : words[1];
  const double distance = MAILLE_TRY(tips_from(tips, valence));
  NamedStencil named{k_star_stencil(valence, distance), taylor()};
  named.stencil.name += ":" + tips;
  return named;
}

Result<NamedStencil> make_polygon(const Words& words) {
  const unsigned degree = MAILLE_TRY(number(words[0], "N", 3, 16));
  const unsigned known = MAILLE_TRY(number(words[1], "the number of known corners", 1, degree - 1));
  return NamedStencil{polygon_stencil(degree, known), taylor()};
}

Result<NamedStencil> make_polygon_beside(const Words& words) {
  const unsigned known_degree = MAILLE_TRY(number(words[0], "M", 3, 16));
  const unsigned degree = MAILLE_TRY(number(words[1], "N", 3, 16));
  const unsigned known =
      words.size() < 3 ? 0 : MAILLE_TRY(number(words[2], "the number of known new corners", 0, degree - 3));
  return NamedStencil{polygon_beside_stencil(known_degree, degree, known), taylor()};
}

Result<NamedStencil> make_grid(const Words& words) {
  Stencil stencil = MAILLE_TRY(grid_stencil(words[0]));
  return NamedStencil{std::move(stencil), taylor()};
}

Result<NamedStencil> make_cube(const Words& words) {
  const unsigned mask = MAILLE_TRY(number(words[0], "MASK", 0, 254));
  if (mask % 2 == 1)
    return failure(ErrorCode::usage, "corner 0 of the cube is wanted, so bit 0 of MASK is not set");
  return NamedStencil{cube_stencil(mask), spectral()};
}

Result<NamedStencil> make_hexahedron(const Words& words) {
  const unsigned known = MAILLE_TRY(number(words[0], "the number of known new corners", 0, 3));
  return NamedStencil{hexahedron_stencil(known), taylor()};
}

/// Rules are those by which each stencil is known: full order where symmetry decides, order 2 or 3 where a
/// published scheme has that.
const std::vector<Family>& families() {
  static const std::vector<Family> all = {
      plain("parallelogram", "the tip of a triangle, from the triangle across its edge",
            parallelogram_stencil),
      plain("quad", "the last corner of a quad", quad_stencil),
      by_valence("dual-parallelogram",
                 "a vertex of a fan of K triangles, from the fan's centre and four of its vertices",
                 dual_parallelogram_stencil, taylor()),
      {{"k-star", "k-star:K[:reflected|equilateral|DISTANCE]",
        "a vertex, from its ring of K and the K vertices across the ring's edges"},
       make_k_star},
      {{"polygon", "polygon:N:KNOWN",
        "the next corner of a regular polygon of N, from KNOWN corners in a row"},
       make_polygon},
      {{"polygon-beside", "polygon-beside:M:N[:KNOWN]",
        "a corner of a polygon of N beside a known one of M, after KNOWN new corners (0)"},
       make_polygon_beside},
      {{"grid", "grid:PICTURE", "lattice points: # known, x wanted, . neither; / begins a row, | a layer"},
       make_grid},
      plain("butterfly", "the middle of an edge from 8 vertices", [] { return butterfly_stencil(8); }),
      plain(
          "butterfly-10", "the same with two more vertices, along the edge",
          [] { return butterfly_stencil(10); }, taylor(3)),
      by_valence("modified-butterfly", "the middle of an edge, from one of its ends and its ring of K",
                 modified_butterfly_stencil, taylor(2)),
      plain(
          "sqrt3", "the middle of a triangle from 12 vertices (Labsik and Greiner 2000)",
          [] { return sqrt3_stencil(12); }, taylor(3)),
      plain("sqrt3-small", "the same from 6 vertices", [] { return sqrt3_stencil(6); }),
      by_valence("sqrt3-ring", "the middle of a triangle, from one of its corners and its ring of K",
                 sqrt3_ring_stencil, taylor(2)),
      {{"cube", "cube:MASK",
        "corner 0 of a cube, from the corners whose bits are set; bits of a corner: x y z"},
       make_cube},
      {{"hexahedron", "hexahedron:KNOWN",
        "a new corner of a hexahedron on a face of a known one, after KNOWN new corners"},
       make_hexahedron},
  };
  return all;
}

size_t count_of(const std::string& text, char wanted) {
  size_t count = 0;
  for (const char c : text) count += c == wanted;
  return count;
}

/// Whether there are as many words behind the name as its usage says; those in brackets may be missing. Each
/// ':' of the usage is one word.
bool fits(const Family& family, size_t words) {
  const std::string& usage = family.info.usage;
  const size_t most = count_of(usage, ':');
  return words <= most && words + count_of(usage, '[') >= most;
}

}  // namespace

const std::vector<StencilFamily>& stencil_families() {
  static const std::vector<StencilFamily> infos = [] {
    std::vector<StencilFamily> result;
    for (const Family& family : families()) result.push_back(family.info);
    return result;
  }();
  return infos;
}

Result<NamedStencil> named_stencil(const std::string& name) {
  Words words = split_name(name);
  std::string known;
  for (const Family& family : families()) {
    known += (known.empty() ? "" : ", ") + family.info.name;
    if (family.info.name != words[0]) continue;
    words.erase(words.begin());
    if (fits(family, words.size())) return family.make(words);
    return failure(ErrorCode::usage, "'" + name + "' does not have the parameters of " + family.info.usage);
  }
  return failure(ErrorCode::usage, "no stencil '" + words[0] + "'; known are " + known);
}

}  // namespace maille
