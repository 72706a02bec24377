#include "io/foam/block_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "base/result.h"
#include "generate/transfinite_curve.h"
#include "io/foam/foam_surface.h"

namespace maille {

namespace {

// Reads a blockMeshDict into a description, in the order in which entries refer to each other: surfaces,
// vertices, edges, blocks, faces, patches; then all lengths are scaled. What OpenFOAM accepts and ignores is
// noted, what is not supported is refused with its line.
class BlockReader {
 public:
  BlockReader(const FoamFile& file, const Limits& limits) : file_(file), limits_(limits) {}

  Result<BlockDictionary> read() {
    MAILLE_CHECK(refuse_what_is_missing());
    MAILLE_CHECK(geometry());
    MAILLE_CHECK(vertices());
    MAILLE_CHECK(edges());
    MAILLE_CHECK(blocks());
    MAILLE_CHECK(faces());
    MAILLE_CHECK(boundary());
    MAILLE_CHECK(default_patch());
    MAILLE_CHECK(scale());
    return std::move(result_);
  }

 private:
  using Entry = FoamDictionary::Entry;

  const Entry* find(const char* keyword) const { return file_.dictionary.find(keyword); }

  Result<const Entry*> needed(const char* keyword) const {
    const Entry* entry = find(keyword);
    if (entry != nullptr && entry->dictionary == nullptr) return entry;
    return failure(ErrorCode::malformed_input,
                   file_.files[0] + ": no entry '" + keyword + "'; is this a blockMeshDict?");
  }

  Result<> refuse_what_is_missing() const {
    if (const Entry* pairs = find("mergePatchPairs"); pairs != nullptr && !is_empty_list(*pairs)) {
      return file_.unsupported(pairs->at,
                               "entry 'mergePatchPairs': merging of patches which do not match is not "
                               "supported");
    }
    return {};
  }

  static bool is_empty_list(const Entry& entry) {
    return std::all_of(entry.tokens.begin(), entry.tokens.end(), [](const FoamToken& token) {
      return token.is('(') || token.is(')') || token.kind == FoamToken::Kind::number;
    });
  }

  /// Notes which surfaces there are. They are read when something lies on them: tutorials describe more than
  /// they use.
  Result<> geometry() {
    const Entry* entry = find("geometry");
    if (entry == nullptr || entry->dictionary == nullptr) return {};
    for (const Entry& surface : entry->dictionary->entries()) {
      if (surface.dictionary == nullptr) continue;
      // Older dictionaries call a surface by its file, with a name beside.
      std::string name = surface.keyword;
      if (const Entry* other = surface.dictionary->find("name"); other != nullptr) {
        FoamCursor at(file_, *other);
        name = MAILLE_TRY(at.word());
      }
      surfaces_[name] = {&surface, {}};
    }
    return {};
  }

  Result<uint32_t> surface(FoamCursor& at) {
    const std::string name = MAILLE_TRY(at.word());
    const auto found = surfaces_.find(name);
    if (found == surfaces_.end()) return at.bad("there is no surface '" + name + "' in 'geometry'");
    KnownSurface& known = found->second;
    if (!known.number) {
      known.number = static_cast<uint32_t>(description().surfaces.size());
      description().surfaces.push_back(MAILLE_TRY(read_foam_surface(file_, *known.entry, name, limits_)));
    }
    return *known.number;
  }
  Result<std::vector<uint32_t>> surfaces(FoamCursor& at) {
    std::vector<uint32_t> list;
    MAILLE_CHECK(at.open_list());
    while (!at.take(')')) list.push_back(MAILLE_TRY(surface(at)));
    if (list.empty()) return at.bad("a projection to no surface");
    return list;
  }

  Result<> vertices() {
    FoamCursor at(file_, *MAILLE_TRY(needed("vertices")));
    MAILLE_CHECK(at.open_list());
    while (!at.take(')')) {
      if (at.take("name")) {
        const auto number = static_cast<uint32_t>(description().vertices.size());
        vertex_names_[MAILLE_TRY(at.word())] = number;
      }
      const bool projected = at.take("project");
      description().vertices.push_back(MAILLE_TRY(read_foam_position(at)));
      if (!projected) continue;
      const auto number = static_cast<uint32_t>(description().vertices.size() - 1);
      description().projected_vertices.push_back({number, MAILLE_TRY(surfaces(at))});
    }
    return {};
  }

  Result<uint32_t> vertex(FoamCursor& at) {
    if (at.peek().kind == FoamToken::Kind::word) {
      const auto found = vertex_names_.find(at.peek().text);
      if (found == vertex_names_.end()) return at.bad("there is no vertex '" + at.peek().text + "'");
      at.take();
      return found->second;
    }
    return static_cast<uint32_t>(MAILLE_TRY(at.label(description().vertices.size(), "vertex")));
  }

  Result<> edges() {
    const Entry* entry = find("edges");
    if (entry == nullptr) return {};
    FoamCursor at(file_, *entry);
    MAILLE_CHECK(at.open_list());
    while (!at.take(')')) {
      BlockCurve curve = MAILLE_TRY(edge(at));
      if (!curves_.insert({std::min(curve.from, curve.to), std::max(curve.from, curve.to)}).second) {
        note("edge " + std::to_string(curve.from) + " " + std::to_string(curve.to) +
             " is given more than once; the first one counts");
        continue;
      }
      description().curves.push_back(std::move(curve));
    }
    return {};
  }

  Result<BlockCurve> edge(FoamCursor& at) {
    static const std::map<std::string, CurveKind> kinds{
        {"line", CurveKind::line},        {"arc", CurveKind::arc},          {"polyLine", CurveKind::polyline},
        {"spline", CurveKind::spline},    {"BSpline", CurveKind::b_spline}, {"bezier", CurveKind::bezier},
        {"project", CurveKind::projected}};
    const auto kind = kinds.find(at.peek().text);
    if (kind == kinds.end()) {
      return at.unsupported(
          "edges of type '" + at.peek().text +
          "' are not supported; known: arc, spline, polyLine, BSpline, bezier, line, project");
    }
    at.take();
    BlockCurve curve;
    curve.kind = kind->second;
    curve.from = MAILLE_TRY(vertex(at));
    curve.to = MAILLE_TRY(vertex(at));
    if (curve.kind == CurveKind::arc) {
      curve.points.push_back(MAILLE_TRY(arc_point(at, curve)));
    } else if (curve.kind == CurveKind::projected) {
      curve.surfaces = MAILLE_TRY(surfaces(at));
    } else if (curve.kind != CurveKind::line) {
      MAILLE_CHECK(at.open_list());
      while (!at.take(')')) curve.points.push_back(MAILLE_TRY(read_foam_position(at)));
    }
    return curve;
  }

  // Reads a point of the arc; or "origin", a factor if there is one, the centre; or the angle and the axis.
  Result<Position> arc_point(FoamCursor& at, const BlockCurve& curve) {
    const Position from = description().vertices[curve.from];
    const Position to = description().vertices[curve.to];
    if (at.at('(')) return read_foam_position(at);
    Result<Position> middle = Position{};
    if (at.take("origin")) {
      double factor = 1;
      if (!at.at('(')) factor = MAILLE_TRY(at.number());
      middle = arc_middle_about(from, to, MAILLE_TRY(read_foam_position(at)), factor);
    } else {
      const double angle = MAILLE_TRY(at.number());
      middle = arc_middle(from, to, angle, MAILLE_TRY(read_foam_position(at)));
    }
    if (!middle) return at.bad(middle.error().message);
    return middle;
  }

  Result<> blocks() {
    FoamCursor at(file_, *MAILLE_TRY(needed("blocks")));
    MAILLE_CHECK(at.open_list());
    while (!at.take(')')) {
      HexBlock block = MAILLE_TRY(this->block(at));
      if (!block.name.empty()) {
        block_names_[block.name] = static_cast<uint32_t>(description().blocks.size());
      }
      description().blocks.push_back(std::move(block));
    }
    return {};
  }

  Result<HexBlock> block(FoamCursor& at) {
    HexBlock block;
    if (at.take("name")) block.name = MAILLE_TRY(at.word());
    if (!at.take("hex")) return at.unsupported("'" + at.peek().text + "' where a 'hex' block is expected");
    MAILLE_CHECK(at.open_list());
    for (uint32_t& corner : block.corners) corner = MAILLE_TRY(vertex(at));
    if (!at.at(')')) {
      // blockMesh takes the first eight; the note names the line.
      MAILLE_TRY(vertex(at));
      note(file_.place(at.last()) + ": a block has more than eight vertices; the first eight count");
    }
    MAILLE_CHECK(at.expect(')'));
    if (at.peek().kind == FoamToken::Kind::word) block.zone = at.take().text;
    MAILLE_CHECK(at.open_list());
    for (uint32_t& n : block.divisions) {
      n = static_cast<uint32_t>(MAILLE_TRY(at.label(uint64_t{max_block_divisions} + 1, "number of cells")));
    }
    MAILLE_CHECK(at.expect(')'));
    block.gradings.fill({GradingSection{}});
    const bool named = at.take("simpleGrading") || at.take("edgeGrading");
    if (!named && !at.at('(')) return block;
    MAILLE_CHECK(gradings(at, block));
    return block;
  }

  Result<> gradings(FoamCursor& at, HexBlock& block) {
    std::vector<Grading> list;
    MAILLE_CHECK(at.open_list());
    while (!at.take(')')) list.push_back(MAILLE_TRY(grading(at)));
    if (list.size() != 1 && list.size() != 3 && list.size() != 12) {
      return at.bad("1, 3 or 12 expansion ratios expected, " + std::to_string(list.size()) + " found");
    }
    // One ratio is for all edges, three are for those along x, y and z (edges 0 to 3, 4 to 7, 8 to 11),
    // twelve for each.
    for (size_t edge = 0; edge < 12; ++edge) block.gradings[edge] = list[edge * list.size() / 12];
    return {};
  }

  Result<> faces() {
    const Entry* entry = find("faces");
    if (entry == nullptr) return {};
    FoamCursor at(file_, *entry);
    MAILLE_CHECK(at.open_list());
    while (!at.take(')')) {
      if (!at.take("project")) return at.bad("'project', four vertices and a surface are expected");
      ProjectedFace face;
      MAILLE_CHECK(at.open_list());
      for (uint32_t& corner : face.corners) corner = MAILLE_TRY(vertex(at));
      MAILLE_CHECK(at.expect(')'));
      face.surfaces = at.at('(') ? MAILLE_TRY(surfaces(at)) : std::vector<uint32_t>{MAILLE_TRY(surface(at))};
      description().projected_faces.push_back(std::move(face));
    }
    return {};
  }

  // A negative expansion stands for its inverse.
  static Result<double> expansion(FoamCursor& at) {
    const double ratio = MAILLE_TRY(at.number());
    if (!(std::fabs(ratio) > 0) || !std::isfinite(ratio)) return at.bad("an expansion ratio of 0");
    return ratio > 0 ? ratio : -1 / ratio;
  }

  Result<Grading> grading(FoamCursor& at) {
    Grading grading;
    if (!at.at('(')) {
      GradingSection section;
      section.expansion = MAILLE_TRY(expansion(at));
      grading.push_back(section);
      return grading;
    }
    MAILLE_CHECK(at.open_list());
    while (!at.take(')')) {
      GradingSection section;
      if (at.take('(')) {
        section.length = MAILLE_TRY(at.number());
        section.cells = MAILLE_TRY(at.number());
        section.expansion = MAILLE_TRY(expansion(at));
        MAILLE_CHECK(at.expect(')'));
      } else {
        section.expansion = MAILLE_TRY(expansion(at));
      }
      grading.push_back(section);
    }
    if (grading.empty()) return at.bad("a list of gradings without any");
    return grading;
  }

  Result<> boundary() {
    if (const Entry* entry = find("boundary"); entry != nullptr) return new_boundary(*entry);
    const Entry* entry = find("patches");
    return entry == nullptr ? Result<>{} : old_patches(*entry);
  }

  Result<> new_boundary(const Entry& entry) {
    FoamCursor at(file_, entry);
    MAILLE_CHECK(at.open_list());
    while (!at.take(')')) {
      BlockPatch patch;
      patch.name = MAILLE_TRY(at.word());
      const FoamDictionary dictionary = MAILLE_TRY(at.dictionary());
      if (const Entry* type = dictionary.find("type"); type != nullptr) {
        FoamCursor value(file_, *type);
        patch.type = MAILLE_TRY(value.word());
      }
      const Entry* faces = dictionary.find("faces");
      if (faces == nullptr) return at.bad("patch '" + patch.name + "' has no faces");
      FoamCursor list(file_, *faces);
      MAILLE_CHECK(face_list(list, patch));
      description().patches.push_back(std::move(patch));
    }
    return {};
  }

  // Reads the older list: type name ((face) ...)
  Result<> old_patches(const Entry& entry) {
    FoamCursor at(file_, entry);
    MAILLE_CHECK(at.open_list());
    while (!at.take(')')) {
      BlockPatch patch;
      patch.type = MAILLE_TRY(at.word());
      patch.name = MAILLE_TRY(at.word());
      MAILLE_CHECK(face_list(at, patch));
      description().patches.push_back(std::move(patch));
    }
    return {};
  }

  // Reads faces, each by four vertices, or by a block and the number of one of its faces.
  Result<> face_list(FoamCursor& at, BlockPatch& patch) {
    MAILLE_CHECK(at.open_list());
    while (!at.take(')')) {
      MAILLE_CHECK(at.open_list());
      std::vector<uint32_t> numbers;
      if (at.peek().kind == FoamToken::Kind::word && block_names_.count(at.peek().text) != 0) {
        numbers.push_back(block_names_[at.take().text]);
        numbers.push_back(static_cast<uint32_t>(MAILLE_TRY(at.label(6, "face of a block"))));
      }
      while (!at.at(')')) {
        if (numbers.size() == 4) return at.bad("a face of a patch has four vertices");
        numbers.push_back(MAILLE_TRY(face_number(at)));
      }
      at.take();
      if (numbers.size() == 2) {
        if (numbers[0] >= description().blocks.size() || numbers[1] >= 6) {
          return at.bad("there is no face " + std::to_string(numbers[1]) + " of block " +
                        std::to_string(numbers[0]));
        }
        patch.faces.push_back(face_of(description().blocks[numbers[0]], numbers[1]));
      } else if (numbers.size() == 4) {
        patch.faces.push_back({numbers[0], numbers[1], numbers[2], numbers[3]});
      } else {
        return at.bad("a face of a patch has four vertices, or a block and one of its faces");
      }
    }
    return {};
  }

  Result<uint32_t> face_number(FoamCursor& at) {
    if (at.peek().kind == FoamToken::Kind::word) return vertex(at);
    const size_t limit = std::max(description().vertices.size(), description().blocks.size());
    return static_cast<uint32_t>(MAILLE_TRY(at.label(limit, "vertex")));
  }

  static std::array<uint32_t, 4> face_of(const HexBlock& block, uint32_t face) {
    static constexpr unsigned corners[6][4] = {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4},
                                               {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}};
    std::array<uint32_t, 4> result{};
    for (unsigned i = 0; i < 4; ++i) result[i] = block.corners[corners[face][i]];
    return result;
  }

  Result<> default_patch() {
    const Entry* entry = find("defaultPatch");
    if (entry == nullptr || entry->dictionary == nullptr) return {};
    if (const Entry* name = entry->dictionary->find("name"); name != nullptr) {
      FoamCursor at(file_, *name);
      description().default_patch.name = MAILLE_TRY(at.word());
    }
    if (const Entry* type = entry->dictionary->find("type"); type != nullptr) {
      FoamCursor at(file_, *type);
      description().default_patch.type = MAILLE_TRY(at.word());
    }
    return {};
  }

  Result<> scale() {
    const Entry* entry = find("scale") != nullptr ? find("scale") : find("convertToMeters");
    if (entry == nullptr) return {};
    FoamCursor at(file_, *entry);
    const double factor = MAILLE_TRY(at.number());
    // OpenFOAM scales by positive factors only.
    if (!(factor > 0)) return {};
    for (Position& p : description().vertices) multiply(p, factor);
    // Arc points were computed in the dictionary's units, which this scales as well.
    for (BlockCurve& curve : description().curves) {
      for (Position& p : curve.points) multiply(p, factor);
    }
    for (BlockSurface& surface : description().surfaces) {
      multiply(surface.a, factor);
      multiply(surface.b, factor);  // the length of a plane's normal says nothing
      surface.radius *= factor;
      for (Position& p : surface.points) multiply(p, factor);
    }
    return {};
  }
  static void multiply(Position& p, double factor) {
    for (double& x : p) x *= factor;
  }

  BlockDescription& description() { return result_.description; }
  void note(std::string text) { result_.notes.push_back(std::move(text)); }

  const FoamFile& file_;
  const Limits& limits_;
  BlockDictionary result_;
  std::map<std::string, uint32_t> vertex_names_;
  std::map<std::string, uint32_t> block_names_;
  struct KnownSurface {
    const Entry* entry;
    std::optional<uint32_t> number;  ///< in the description, if it is used
  };
  std::map<std::string, KnownSurface> surfaces_;
  std::set<std::pair<uint32_t, uint32_t>> curves_;
};

}  // namespace

Result<BlockDictionary> blocks_of(const FoamFile& file, const Limits& limits) {
  return BlockReader(file, limits).read();
}

Result<BlockDictionary> read_block_dictionary(const std::string& path, const Limits& limits) {
  return blocks_of(MAILLE_TRY(read_foam_file(path)), limits);
}

Result<BlockDictionary> read_block_dictionary(const Source& source, const Limits& limits) {
  return blocks_of(MAILLE_TRY(read_foam_file(source)), limits);
}

}  // namespace maille
