// Compares what we generate with what OpenFOAM's blockMesh made of the same dictionary;
// scripts/check-generate runs it.
//
//     maille_check_generate DICTIONARY POLYMESH    prints: cells points faces difference, or why not
#include <maille/compare.h>
#include <maille/folder.h>
#include <maille/generate.h>
#include <maille/io.h>
#include <maille/source.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>

#include "base/result.h"
#include "io/foam/foam_dictionary.h"
#include "io/reading.h"

namespace maille {
namespace {

struct PolyMesh {
  std::vector<Position> points;
  std::vector<std::vector<uint64_t>> faces;
  std::vector<uint64_t> owner;
  std::vector<uint64_t> neighbour;
  std::map<std::string, std::pair<uint64_t, uint64_t>> patches;  // first face, number
};

// A list of numbers and lists of them, flat: the count of each inner list is left out.
Result<std::vector<std::vector<double>>> read_list(const std::string& path) {
  const auto source = MAILLE_TRY(file_source(path));
  const InputBytes bytes = MAILLE_TRY(InputBytes::load(*source));
  FoamLexer lexer(bytes.text());
  while (!MAILLE_TRY(lexer.next()).is('}')) continue;  // the header
  std::vector<std::vector<double>> list;
  unsigned depth = 0;
  double count = 0;
  for (FoamToken token = MAILLE_TRY(lexer.next()); token.kind != FoamToken::Kind::end;
       token = MAILLE_TRY(lexer.next())) {
    if (token.is('(') && ++depth == 2) list.emplace_back();
    if (token.is(')')) --depth;
    if (token.is('{')) {  // 6{0}: six times the same
      const FoamToken value = MAILLE_TRY(lexer.next());
      list.assign(static_cast<size_t>(count), {value.value});
      break;
    }
    if (depth == 0) count = token.value;
    if (token.kind != FoamToken::Kind::number || depth == 0) continue;
    if (depth == 2) {
      list.back().push_back(token.value);
    } else {
      list.push_back({token.value});
    }
  }
  return list;
}

std::vector<uint64_t> labels(const std::vector<double>& numbers) {
  return {numbers.begin(), numbers.end()};
}

Result<std::vector<uint64_t>> read_labels(const std::string& path) {
  std::vector<uint64_t> result;
  for (const auto& one : MAILLE_TRY(read_list(path))) result.push_back(static_cast<uint64_t>(one.at(0)));
  return result;
}

Result<PolyMesh> read_poly_mesh(const std::string& folder) {
  PolyMesh mesh;
  for (const auto& p : MAILLE_TRY(read_list(folder + "/points")))
    mesh.points.push_back({p.at(0), p.at(1), p.at(2)});
  // Faces are written as 4(0 1 2 3): the count stands at depth 1.
  for (const auto& f : MAILLE_TRY(read_list(folder + "/faces"))) {
    if (f.size() > 2) mesh.faces.push_back(labels(f));
  }
  mesh.owner = MAILLE_TRY(read_labels(folder + "/owner"));
  mesh.neighbour = MAILLE_TRY(read_labels(folder + "/neighbour"));
  const auto source = MAILLE_TRY(file_source(folder + "/boundary"));
  const InputBytes bytes = MAILLE_TRY(InputBytes::load(*source));
  const std::string_view text = bytes.text();
  const size_t list = text.find('(', text.find('}'));
  const FoamFile file =
      MAILLE_TRY(parse_foam_text("patches " + std::string(text.substr(list)) + ";", folder + "/boundary"));
  FoamCursor at(file, *file.dictionary.find("patches"));
  MAILLE_CHECK(at.open_list());
  while (!at.take(')')) {
    const std::string name = MAILLE_TRY(at.word());
    const FoamDictionary patch = MAILLE_TRY(at.dictionary());
    mesh.patches[name] = {static_cast<uint64_t>(patch.find("startFace")->tokens.at(0).value),
                          static_cast<uint64_t>(patch.find("nFaces")->tokens.at(0).value)};
  }
  return mesh;
}

std::vector<std::vector<uint64_t>> cells_of(const PolyMesh& mesh) {
  std::vector<std::set<uint64_t>> points;
  const auto add = [&](uint64_t cell, const std::vector<uint64_t>& face) {
    if (points.size() <= cell) points.resize(cell + 1);
    points[cell].insert(face.begin(), face.end());
  };
  for (size_t f = 0; f < mesh.owner.size(); ++f) add(mesh.owner[f], mesh.faces[f]);
  for (size_t f = 0; f < mesh.neighbour.size(); ++f) add(mesh.neighbour[f], mesh.faces[f]);
  std::vector<std::vector<uint64_t>> cells;
  for (const auto& cell : points) cells.emplace_back(cell.begin(), cell.end());
  return cells;
}

// A face from its smallest point on: the same for the same side.
std::vector<uint64_t> turned(std::vector<uint64_t> face) {
  std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
  return face;
}

bool same_patches(const Mesh& ours, size_t first, const PolyMesh& theirs) {
  std::map<std::string, std::set<std::vector<uint64_t>>> a;
  std::map<std::string, std::set<std::vector<uint64_t>>> b;
  for (size_t i = first; i < ours.blocks.size(); ++i) {
    for (uint64_t f = 0; f < ours.blocks[i].size(); ++f) {
      const auto face = ours.blocks[i].cell(f);
      a[ours.blocks[i].name].insert(turned({face.begin(), face.end()}));
    }
  }
  for (const auto& [name, range] : theirs.patches) {
    for (uint64_t f = 0; f < range.second; ++f) b[name].insert(turned(theirs.faces[range.first + f]));
  }
  return a == b;
}

double difference(const Mesh& ours, const PolyMesh& theirs) {
  Position low = theirs.points.at(0);
  Position high = low;
  double largest = 0;
  const auto x = ours.points.values<double>();
  for (size_t i = 0; i < theirs.points.size(); ++i) {
    for (unsigned c = 0; c < 3; ++c) {
      low[c] = std::min(low[c], theirs.points[i][c]);
      high[c] = std::max(high[c], theirs.points[i][c]);
      largest = std::max(largest, std::fabs(x[3 * i + c] - theirs.points[i][c]));
    }
  }
  return largest / std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
}

/// Written as polyMesh: how many faces are not where they are in theirs, of all faces and of those inside.
Result<std::string> order_of_faces(const Mesh& ours, const PolyMesh& theirs, const std::string& folder) {
  const auto sink = MAILLE_TRY(polymesh_sink(folder));
  MAILLE_TRY(write_mesh(ours, *sink, {.format = "polymesh", .ascii = true}));
  MAILLE_CHECK(sink->commit());
  const PolyMesh written = MAILLE_TRY(read_poly_mesh(folder + "/constant/polyMesh"));
  uint64_t inside = 0, outside = 0, begins = 0;
  for (size_t f = 0; f < std::min(theirs.faces.size(), written.faces.size()); ++f) {
    const bool inner = f < theirs.neighbour.size();
    const bool same = turned(theirs.faces[f]) == turned(written.faces[f]) && theirs.owner[f] == written.owner[f];
    if (!same) ++(inner ? inside : outside);
    if (same && theirs.faces[f] != written.faces[f]) ++begins;
  }
  std::string text = written.patches == theirs.patches ? "" : " patches elsewhere;";
  if (inside + outside == 0 && begins == 0) return text + " faces equal";
  return text + " faces elsewhere: " + std::to_string(inside) + " inside, " + std::to_string(outside) +
         " outside; begin elsewhere: " + std::to_string(begins) + " of " + std::to_string(theirs.faces.size());
}

Result<> check(const std::string& dictionary, const std::string& folder) {
  const BlockDictionary blocks = MAILLE_TRY(read_block_dictionary(dictionary));
  const Mesh ours = MAILLE_TRY(generate_mesh(blocks.description, {}));
  MAILLE_CHECK(validate(ours));
  GenerateOptions streaming;
  streaming.streaming_order = true;
  const Mesh other = MAILLE_TRY(generate_mesh(blocks.description, streaming));
  if (!compare(ours, other).equal) return failure(ErrorCode::differs, "streaming order makes another mesh");
  const PolyMesh theirs = MAILLE_TRY(read_poly_mesh(folder));
  std::vector<std::vector<uint64_t>> cells;
  size_t first_face = 0;
  for (const CellBlock& block : ours.blocks) {
    if (block.size() > 0 &&
        nodes_of(static_cast<CellType>(block.types.empty() ? static_cast<uint8_t>(block.type)
                                                           : block.types[0])) <= 4 &&
        block.type != CellType::tetrahedron) {
      break;
    }
    ++first_face;
    for (uint64_t i = 0; i < block.size(); ++i) {
      const std::set<uint64_t> cell(block.cell(i).begin(), block.cell(i).end());
      cells.emplace_back(cell.begin(), cell.end());
    }
  }
  if (ours.point_count() != theirs.points.size()) {
    return failure(ErrorCode::differs, std::to_string(ours.point_count()) + " points instead of " +
                                           std::to_string(theirs.points.size()));
  }
  if (cells != cells_of(theirs)) return failure(ErrorCode::differs, "other cells");
  if (!same_patches(ours, first_face, theirs)) return failure(ErrorCode::differs, "other boundary faces");
  const std::string order = MAILLE_TRY(order_of_faces(ours, theirs, folder + "/../../ours"));
  std::printf("%zu cells %.2g%s\n", cells.size(), difference(ours, theirs), order.c_str());
  return {};
}

}  // namespace
}  // namespace maille

int main(int count, char** arguments) {
  if (count != 3) return 2;
  const auto result = maille::check(arguments[1], arguments[2]);
  if (result) return 0;
  std::printf("%s\n", result.error().message.c_str());
  return static_cast<int>(result.error().code);
}
