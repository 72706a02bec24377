// Which values of the mesh, or of the step before, those of a new step go with. docs/format.md, 16.9.
#include "volume/stream/step_partners.h"

#include <algorithm>
#include <array>

#include "base/result.h"
#include "volume/stream/step_chain.h"

namespace maille {
namespace {

/// The lattice for differences. The step before an array's partner had a finer lattice: on the same one
/// errors do not add up, as a difference of 0 gives the same number again. A lattice up to twice as fine is
/// taken; each halving of the step costs a bit a number.
std::vector<NumberMap> lattice_for(const std::vector<NumberMap>& now, const std::vector<NumberMap>& before) {
  for (size_t k = 0; k < now.size(); ++k) {
    if (now[k].kind != NumberMap::Kind::lattice) return {};
    const bool same = k < before.size() && before[k].kind == NumberMap::Kind::lattice &&
                      before[k].step <= now[k].step && before[k].step >= now[k].step / 2;
    if (!same) return now;
  }
  return before;
}

/// Holds the arrays of a new step against those of an earlier one, portion by portion, in the order of the
/// stream. What is kept is decided by the numbers that a decoder would give out, not by those that were
/// given.
class Comparison {
 public:
  Comparison(const StepHeader& step, const StreamHeader& mesh, StepSource& values)
      : step_(step), mesh_(mesh), values_(values) {}

  /// Arrays go together by name, domain, type and components; the first one of a name counts. `differences`:
  /// values may be coded as such. `known` and `maps` are those of the earlier step.
  void add_partners(const std::vector<StreamArray>& known, const std::vector<std::vector<NumberMap>>& maps,
                    bool differences) {
    for (size_t i = 0; i < step_.arrays.size(); ++i) {
      for (size_t k = 0; k < known.size(); ++k) {
        if (known[k].name != step_.arrays[i].name || !are_alike(known[k], step_.arrays[i])) continue;
        Partner& partner = partners_.emplace_back();
        partner.array = i;
        partner.of = static_cast<uint32_t>(k);
        if (differences && step_.bounds[i] > 0) partner.maps = lattice_for(step_.maps[i], maps[k]);
        partner.on_lattice = !partner.maps.empty();
        partner.follows = differences && step_.array(i, mesh_).mixed && !is_numbered(known[k]);
        break;
      }
    }
  }
  std::vector<Partner>& partners() { return partners_; }
  /// Reads all values of the earlier step, until no array needs them: then most of the file is left unread.
  Result<> read(StreamReader& reader, const std::vector<StreamArray>& known) {
    StreamPortion portion;
    while (is_any_left() && MAILLE_TRY(reader.next(portion))) {
      for (Partner& partner : partners_) {
        if (!is_of_use(partner)) continue;
        size_t place = 0;  // among the arrays of the domain
        for (size_t k = 0; k < partner.of; ++k) place += known[k].domain == known[partner.of].domain;
        const bool points = known[partner.of].domain == Domain::point;
        MAILLE_CHECK(
            compare(partner, portion, points ? portion.point_arrays[place] : portion.cell_arrays[place]));
      }
    }
    return {};
  }

 private:
  bool is_any_left() const { return std::any_of(partners_.begin(), partners_.end(), is_of_use); }
  static bool is_of_use(const Partner& partner) {
    return partner.keeps || partner.on_lattice || partner.follows;
  }
  // Values of the new step are held against a portion of the earlier one, number by number, until the bound
  // is exceeded once: from then on that way is out.
  Result<> compare(Partner& partner, const StreamPortion& portion, Bytes tuples) {
    const size_t i = partner.array;
    const StreamedArray array{step_.arrays[i].type, step_.arrays[i].components, step_.maps[i],
                              step_.bounds[i]};
    const size_t size = array.tuple_size(), number_size = size_of(array.type);
    tuple_.resize(size);
    if (partner.on_lattice || partner.follows)
      partner.before.insert(partner.before.end(), tuples.begin(), tuples.end());
    // Tuples of the new step are asked for by number; the caller's source may be a file.
    for (size_t at = 0; at * size < tuples.size() && (partner.keeps || partner.on_lattice); ++at) {
      const bool points = step_.arrays[i].domain == Domain::point;
      MAILLE_CHECK(values_.read(i, points ? portion.points[at] : portion.first_cell + at, tuple_.data()));
      for (size_t c = 0; c < array.components; ++c) {
        const std::byte* const number = tuple_.data() + c * number_size;
        const bool logarithm = array.maps[c].kind == NumberMap::Kind::logarithm;
        const std::byte* const known = tuples.data() + at * size + c * number_size;
        partner.keeps = partner.keeps && is_kept(array, logarithm, number, known, partner.error);
        if (!partner.on_lattice) continue;
        std::array<std::byte, 8> back{};
        partner.maps[c].store_number(array.type, partner.maps[c].code_of(array.type, number), back.data());
        partner.on_lattice = is_kept(array, logarithm, number, back.data(), partner.lattice_error);
      }
    }
    // Not needed any more: the values of a whole step would stay in memory.
    if (!partner.on_lattice && !partner.follows) partner.before = {};
    return {};
  }

  /// Numbers that are not coded with the mesh, so that no chain of steps can begin with them.
  bool is_numbered(const StreamArray& array) const {
    const StreamDescription& mesh = mesh_.description;
    return std::any_of(mesh.numbered.begin(), mesh.numbered.end(), [&](const NumberedArray& numbered) {
      return mesh.arrays[numbered.array].name == array.name && are_alike(mesh.arrays[numbered.array], array);
    });
  }

  const StepHeader& step_;
  const StreamHeader& mesh_;
  StepSource& values_;
  std::vector<Partner> partners_;
  std::vector<std::byte> tuple_;
};

}  // namespace

Result<std::vector<Partner>> compare_with_earlier(const Source& source, const StreamHeader& mesh,
                                                  uint64_t number, StepHeader& step, StepSource& values,
                                                  const StepOptions& options) {
  const StreamReadOptions reading{.limits = options.limits, .any_order = true, .executor = options.executor};
  const bool by_itself = number % key_steps == 0;
  std::vector<Partner> differences;
  // The mesh first: values that come back to those of the mesh then refer to nothing else, so that no chain
  // is read for them.
  const auto hold = [&](uint64_t earlier, const std::vector<StreamArray>& known, const auto& maps,
                        StepCoding::Method method) -> Result<> {
    Comparison comparison(step, mesh, values);
    comparison.add_partners(known, maps, earlier + 1 == number && !by_itself);
    StreamReader reader = MAILLE_TRY(StreamReader::open(source, earlier, reading));
    MAILLE_CHECK(comparison.read(reader, known));
    for (Partner& partner : comparison.partners()) {
      if (step.codings[partner.array].method != StepCoding::alone) continue;
      if (partner.keeps) {
        step.codings[partner.array] = {method, partner.of};
        step.errors[partner.array] = partner.error;
      } else if (partner.on_lattice || partner.follows) {
        differences.push_back(std::move(partner));
      }
    }
    return {};
  };
  const std::vector<std::vector<NumberMap>> of_arrays(mesh.maps.begin() + 1, mesh.maps.end());
  MAILLE_CHECK(hold(0, mesh.description.arrays, of_arrays, StepCoding::as_mesh));
  if (number == 1 || by_itself) return differences;
  const auto before = StepValues::open(source, number - 1);
  const Result<> held =
      before ? hold(number - 1, before->header().arrays, before->header().maps, StepCoding::as_before)
             : Result<>(tl::unexpected(before.error()));
  // What is damaged is of no use to later steps, and no reason against them.
  if (!held && held.error().code != ErrorCode::corrupt) return tl::unexpected(held.error());
  return differences;
}

}  // namespace maille
