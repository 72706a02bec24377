#include "io/foam/foam_processors.h"

#include <maille/path.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <set>
#include <tuple>

#include "io/foam/foam_file.h"

namespace maille {
namespace {

const std::array<const FoamZoneKind*, 3>& zone_kinds() {
  static const std::array<const FoamZoneKind*, 3> kinds = {&foam_cell_zones, &foam_face_zones,
                                                           &foam_point_zones};
  return kinds;
}

tl::unexpected<Error> malformed(const std::string& what) {
  return failure(ErrorCode::malformed_input, what);
}

}  // namespace

bool is_between_processors(const FoamPatch& patch) {
  return patch.type == "processor" || patch.type == "processorCyclic";
}

std::string referred_patch(const FoamPatch& patch) {
  constexpr std::string_view key = "referPatch";
  size_t at = patch.entries.find(key);
  if (at == std::string::npos) return {};
  at = patch.entries.find_first_not_of(" \t\n", at + key.size());
  const size_t end = patch.entries.find_first_of(" \t\n;", at);
  return at == std::string::npos ? std::string() : patch.entries.substr(at, end - at);
}

namespace {

/// Decompositions have some ten thousands of processors; each takes some bytes here before its files are
/// looked at, and the number is in a folder's name. Chosen, not swept.
constexpr uint64_t most_processors = uint64_t{1} << 20;

/// The numbers in "processors4_2-3", or "processors4", which has 0 to 3.
struct Collated {
  uint64_t of = 0, first = 0, last = 0;
  std::string name;
};

bool take_number(std::string_view& text, uint64_t& number) {
  const auto [behind, bad] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (bad != std::errc()) return false;
  text.remove_prefix(static_cast<size_t>(behind - text.data()));
  return true;
}

bool take_sign(std::string_view& text, char sign) {
  if (!text.starts_with(sign)) return false;
  text.remove_prefix(1);
  return true;
}

/// Names of folders are as hostile as files: whatever is not exactly of this form is no part of the case.
std::optional<Collated> collated_of(const std::string& name) {
  Collated found;
  found.name = name;
  std::string_view text = name;
  text.remove_prefix(std::string_view("processors").size());
  if (!take_number(text, found.of) || found.of == 0) return {};
  found.last = found.of - 1;
  if (!text.empty() && !(take_sign(text, '_') && take_number(text, found.first) && take_sign(text, '-') &&
                         take_number(text, found.last)))
    return {};
  return text.empty() ? std::optional(found) : std::nullopt;
}

Result<std::vector<FoamPart>> parts_of(std::vector<Collated>& collated, const std::string& case_folder) {
  std::sort(collated.begin(), collated.end(), [](const Collated& a, const Collated& b) {
    return std::tie(a.of, a.first, a.last) < std::tie(b.of, b.first, b.last);
  });
  std::vector<FoamPart> parts;
  const auto bad = [&](const std::string& what) { return malformed(case_folder + ": " + what); };
  for (const Collated& some : collated) {
    if (some.of != collated[0].of)
      return bad(collated[0].name + " and " + some.name + " are of different numbers of processors");
    if (some.of > most_processors) return bad(some.name + " says more processors than there may be");
    if (some.first != parts.size() || some.last < some.first || some.last >= some.of)
      return bad("processor " + std::to_string(parts.size()) + " is not in " + some.name + ", or twice");
    for (uint64_t i = some.first; i <= some.last; ++i)
      parts.push_back({case_folder + "/" + some.name, i - some.first});
  }
  if (!collated.empty() && parts.size() != collated[0].of)
    return bad("processor " + std::to_string(parts.size()) + " of " + std::to_string(collated[0].of) +
               " is in no folder");
  return parts;
}

}  // namespace

Result<std::vector<FoamPart>> foam_processors_of(const std::string& case_folder) {
  namespace fs = std::filesystem;
  std::error_code error;
  std::set<uint64_t> numbers;
  std::vector<Collated> collated;
  for (fs::directory_iterator entry(to_path(case_folder), error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = to_utf8(entry->path().filename());
    std::error_code unknown;
    if (!name.starts_with("processor") || !entry->is_directory(unknown)) continue;
    if (name.starts_with("processors")) {
      if (const auto some = collated_of(name)) collated.push_back(*some);
      continue;
    }
    std::string_view rest = std::string_view(name).substr(std::string_view("processor").size());
    uint64_t number = 0;
    if (take_number(rest, number) && rest.empty()) numbers.insert(number);
  }
  // If a case has both forms, the folders of single processors are read.
  if (numbers.empty()) return parts_of(collated, case_folder);
  std::vector<FoamPart> parts;
  for (const uint64_t number : numbers) {
    if (number != parts.size())
      return malformed(case_folder + ": processor" + std::to_string(parts.size()) +
                       " is missing, but there is processor" + std::to_string(*numbers.rbegin()));
    parts.push_back({case_folder + "/processor" + std::to_string(number)});
  }
  return parts;
}

std::string foam_case_folder(const std::string& path) {
  const std::string folder = foam_case_of(path).folder;
  return folder.empty() ? foam_folder_of(path) : folder;
}

namespace {

/// Whether a processor's mesh says where it is in the whole one. decomposePar writes such lists; a mesher
/// that runs in parallel makes meshes without.
bool has_numbers(const FoamPart& part) {
  return has_foam_file(part.mesh() + "/pointProcAddressing");
}

}  // namespace

bool has_other_processors(const std::string& case_folder) {
  const auto parts = foam_processors_of(case_folder);
  return parts && !parts->empty() && !has_numbers(parts->front()) &&
         !foam_times_in(parts->front().folder).empty();
}

std::vector<FoamTime> foam_times_of(const std::string& path) {
  const FoamCasePath place = foam_case_of(path);
  if (place.time) return {};
  std::vector<FoamTime> times = place.times;
  const auto parts = foam_processors_of(foam_case_folder(path));
  if (!parts || parts->empty()) return times;
  if (!place.folder.empty() && !has_numbers(parts->front())) return times;
  for (FoamTime& time : foam_times_in(parts->front().folder)) {
    const bool known = std::any_of(place.times.begin(), place.times.end(),
                                   [&](const FoamTime& own) { return own.value == time.value; });
    time.divided = true;
    if (!known) times.push_back(std::move(time));
  }
  std::stable_sort(times.begin(), times.end(),
                   [](const FoamTime& a, const FoamTime& b) { return a.value < b.value; });
  return times;
}

Result<std::vector<int64_t>> FoamProcessors::read_list(const FoamPart& place, const char* name,
                                                       uint64_t count, Budget& budget) const {
  Result<FoamReader> file = FoamReader::open(place.mesh(), name, limits_, place.block);
  if (!file)
    return failure(file.error().code, file.error().message +
                                          "; decomposePar writes it, and without it the processors' meshes "
                                          "cannot be put together");
  std::vector<int64_t> labels;
  MAILLE_CHECK(file->labels(labels, budget));
  if (labels.size() != count)
    return file->malformed("there are " + std::to_string(labels.size()) + " numbers for " +
                           std::to_string(count) + " elements of the mesh");
  return labels;
}

Result<FoamProcessors::Numbers> FoamProcessors::read_numbers(const FoamPart& place, const FoamLists& part,
                                                             Budget& budget) const {
  Numbers numbers;
  const std::string folder = place.mesh();
  const auto read = [&](const char* name, uint64_t count, std::vector<uint64_t>& out) -> Result<> {
    // Each processor has such lists: together they take no more than the budget allows.
    for (const int64_t label : MAILLE_TRY(read_list(place, name, count, budget))) {
      if (label < 0 || label > INT32_MAX)
        return malformed(folder + "/" + name + ": " + std::to_string(label) + " is no number in a mesh");
      out.push_back(static_cast<uint64_t>(label));
    }
    return {};
  };
  MAILLE_CHECK(read("pointProcAddressing", part.points.count(), numbers.points));
  MAILLE_CHECK(read("cellProcAddressing", part.cells, numbers.cells));
  // A face is its number plus one, negative where it is turned: 0 could have no sign.
  for (const int64_t label : MAILLE_TRY(read_list(place, "faceProcAddressing", part.ends.size(), budget))) {
    if (label == 0 || label > INT32_MAX || label < -INT32_MAX)
      return malformed(folder + "/faceProcAddressing: " + std::to_string(label) + " is no face and side");
    numbers.faces.push_back(static_cast<uint64_t>(label < 0 ? -label : label) - 1);
    numbers.turned.push_back(label < 0);
  }
  return numbers;
}

// Points that several processors have are written again, with the same values.
Result<> FoamProcessors::add_points(const std::string& folder, const FoamLists& part, const Numbers& numbers,
                                    Budget& budget) {
  if (has_point_.empty() && part.points.count() > 0)
    points_ = make_array("position", Domain::point, part.points.type, 3);
  if (part.points.count() > 0 && points_.type != part.points.type)
    return malformed(folder + ": its points have another precision than those of the processors before");
  const size_t size = part.points.tuple_size();
  for (size_t i = 0; i < numbers.points.size(); ++i) {
    const uint64_t number = numbers.points[i];
    if (number >= has_point_.size()) {
      // A number may be any: what lies below it takes memory, so the budget is asked.
      MAILLE_CHECK(budget.take(number + 1 - has_point_.size(), size + 1));
      has_point_.resize(number + 1);
      points_.resize(number + 1);
    }
    has_point_[number] = true;
    std::copy_n(part.points.bytes.data() + i * size, size, points_.bytes.data() + number * size);
  }
  return {};
}

// A face between processors comes twice, once from either side, and so gets both its cells.
Result<> FoamProcessors::add_faces(const std::string& folder, const FoamLists& part, const Numbers& numbers,
                                   Budget& budget) {
  for (size_t i = 0; i < numbers.faces.size(); ++i) {
    const uint64_t number = numbers.faces[i];
    if (number >= faces_.size()) {
      MAILLE_CHECK(budget.take(number + 1 - faces_.size(), sizeof(Face)));
      faces_.resize(number + 1);
    }
    Face& face = faces_[number];
    const bool turned = numbers.turned[i];
    uint64_t& owner = turned ? face.neighbour : face.owner;
    uint64_t& neighbour = turned ? face.owner : face.neighbour;
    const bool inner = i < part.neighbour.size();
    if (owner != nobody || (inner && neighbour != nobody))
      return malformed(folder + ": face " + std::to_string(number) +
                       " of the whole mesh has more than two cells; the processors are of different meshes");
    owner = numbers.cells[part.owner[i]];
    if (inner) neighbour = numbers.cells[part.neighbour[i]];
    if (!face.corners.empty()) continue;
    const uint64_t begin = i == 0 ? 0 : part.ends[i - 1];
    for (uint64_t k = begin; k < part.ends[i]; ++k)
      face.corners.push_back(static_cast<uint32_t>(numbers.points[part.corners[k]]));
    // The first corner stays: faces of the whole mesh keep where they begin.
    if (turned && !face.corners.empty()) std::reverse(face.corners.begin() + 1, face.corners.end());
  }
  return {};
}

void FoamProcessors::add_patches(const FoamLists& part, const Numbers& numbers) {
  for (const FoamPatch& patch : part.patches) {
    const std::string name = is_between_processors(patch) ? referred_patch(patch) : patch.name;
    if (name.empty()) continue;
    auto at =
        std::find_if(patches_.begin(), patches_.end(), [&](const Patch& p) { return p.patch.name == name; });
    if (at == patches_.end()) {
      patches_.push_back({{name, patch.type, 0, 0, patch.entries}});
      at = patches_.end() - 1;
    }
    for (uint64_t i = patch.first; i < patch.first + patch.faces; ++i) {
      // First, last and number of faces are enough to see in check_patches() whether a patch has gaps.
      at->first = std::min(at->first, numbers.faces[i]);
      at->last = std::max(at->last, numbers.faces[i]);
      ++at->faces;
    }
  }
}

Result<> FoamProcessors::add_zones(const FoamPart& place, const FoamZoneKind& kind, size_t which,
                                   std::span<const uint64_t> numbers, const std::vector<bool>& turned,
                                   Budget& budget) {
  if (!has_foam_zones(place.mesh(), kind)) return {};
  FoamReader file = MAILLE_TRY(FoamReader::open(place.mesh(), kind.file, limits_, place.block));
  FoamZones zones(kind, nobody, "");
  MAILLE_CHECK(zones.read(file, numbers.size(), budget));
  ZoneElements& all = zones_[which];
  std::vector<uint64_t> zone_of;
  for (const std::string& name : zones.names()) {
    const auto at = std::find(all.names.begin(), all.names.end(), name);
    zone_of.push_back(static_cast<uint64_t>(at - all.names.begin()));
    if (at == all.names.end()) all.names.push_back(name);
  }
  for (uint64_t i = 0; i < numbers.size(); ++i) {
    for (const FoamZones::Use& use : MAILLE_TRY(zones.of(i))) {
      MAILLE_CHECK(budget.take(1, sizeof(FoamZones::Element)));
      const bool flipped = use.flipped != (!turned.empty() && turned[i]);
      all.elements.push_back({numbers[i], zone_of[use.zone], flipped});
    }
  }
  return {};
}

Result<> FoamProcessors::add(const FoamPart& place, const FoamLists& part, Budget& budget) {
  const std::string folder = place.mesh();
  if (first_folder_.empty()) first_folder_ = folder;
  Numbers numbers = MAILLE_TRY(read_numbers(place, part, budget));
  MAILLE_CHECK(add_points(folder, part, numbers, budget));
  for (const uint64_t cell : numbers.cells) {
    if (cell >= has_cell_.size()) MAILLE_CHECK(budget.take(cell + 1 - has_cell_.size(), 1));
    if (cell >= has_cell_.size()) has_cell_.resize(cell + 1);
    if (has_cell_[cell])
      return malformed(folder + ": cell " + std::to_string(cell) +
                       " of the whole mesh is in another processor, too");
    has_cell_[cell] = true;
  }
  MAILLE_CHECK(add_faces(folder, part, numbers, budget));
  add_patches(part, numbers);
  const std::array<std::span<const uint64_t>, 3> elements = {numbers.cells, numbers.faces, numbers.points};
  for (size_t i = 0; i < zones_.size(); ++i) {
    const std::vector<bool> none;
    MAILLE_CHECK(add_zones(place, *zone_kinds()[i], i, elements[i], i == 1 ? numbers.turned : none, budget));
  }
  parts_.push_back({place, std::move(numbers), part.patches, part.neighbour.size()});
  return {};
}

/// Checks that faces of a patch follow each other, and patches, too, as OpenFOAM's order demands: a gap is a
/// missing processor.
Result<> FoamProcessors::check_patches() {
  uint64_t next = static_cast<uint64_t>(
      std::find_if(faces_.begin(), faces_.end(), [](const Face& face) { return face.neighbour == nobody; }) -
      faces_.begin());
  for (Patch& patch : patches_) {
    if (patch.faces == 0) patch.first = next;
    if (patch.faces > 0 && (patch.first != next || patch.last - patch.first + 1 != patch.faces))
      return malformed(first_folder_ + ": faces of patch " + patch.patch.name.substr(0, 40) +
                       " are missing; is a "
                       "processor missing?");
    next = patch.first + patch.faces;
    patch.patch.first = patch.first;
    patch.patch.faces = patch.faces;
  }
  if (next != faces_.size())
    return malformed(first_folder_ + ": faces " + std::to_string(next) + " to " +
                     std::to_string(faces_.size() - 1) +
                     " of the whole mesh are of no patch and have one cell only; is a processor missing?");
  return {};
}

Result<FoamLists> FoamProcessors::finish() {
  const auto missing = [&](const char* what, size_t number) {
    return malformed(first_folder_ + ": " + what + " " + std::to_string(number) +
                     " of the whole mesh is in no processor; is one missing?");
  };
  const auto gap = [](const std::vector<bool>& has) {
    return static_cast<size_t>(std::find(has.begin(), has.end(), false) - has.begin());
  };
  if (gap(has_point_) < has_point_.size()) return missing("point", gap(has_point_));
  if (gap(has_cell_) < has_cell_.size()) return missing("cell", gap(has_cell_));
  for (size_t i = 0; i < faces_.size(); ++i) {
    if (faces_[i].owner == nobody)
      return missing(faces_[i].neighbour == nobody ? "face" : "the owner of face", i);
  }
  MAILLE_CHECK(check_patches());
  FoamLists all;
  all.points = std::move(points_);
  all.cells = has_cell_.size();
  for (const Face& face : faces_) {
    all.corners.insert(all.corners.end(), face.corners.begin(), face.corners.end());
    all.ends.push_back(all.corners.size());
    all.owner.push_back(face.owner);
    if (face.neighbour == nobody) continue;
    if (all.neighbour.size() + 1 != all.owner.size()) return missing("a cell of face", all.neighbour.size());
    all.neighbour.push_back(face.neighbour);
  }
  for (Patch& patch : patches_) all.patches.push_back(std::move(patch.patch));
  return all;
}

/// The elements of zones by zone and number; those between processors are in both, and once here.
FoamProcessors::ZoneElements FoamProcessors::zones(const FoamZoneKind& kind) {
  const auto place = std::find(zone_kinds().begin(), zone_kinds().end(), &kind) - zone_kinds().begin();
  ZoneElements& zones = zones_[static_cast<size_t>(place)];
  const auto key = [](const FoamZones::Element& e) { return std::tie(e.zone, e.element, e.flipped); };
  std::sort(zones.elements.begin(), zones.elements.end(),
            [&](const auto& a, const auto& b) { return key(a) < key(b); });
  zones.elements.erase(
      std::unique(zones.elements.begin(), zones.elements.end(),
                  [](const auto& a, const auto& b) { return a.zone == b.zone && a.element == b.element; }),
      zones.elements.end());
  return std::move(zones);
}

}  // namespace maille
