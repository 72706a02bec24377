#include "io/foam/polymesh_zones.h"

#include <algorithm>
#include <cstring>

namespace maille {
namespace {

/// Begins a list in a dictionary, which may say what it is of: "List<label> 3(1 2 3)".
Result<uint64_t> begin_typed_list(FoamReader& file, bool& values) {
  const uint64_t at = file.position();
  if (!file.word().starts_with("List<")) file.jump(at);
  return file.begin_list(values);
}

}  // namespace

// Reads a list of 0 and 1, or one value for all: "count{value}". This form says its length without its
// values, but the budget is asked first.
Result<> FoamZones::read_flips(FoamReader& file, Budget& budget, std::vector<bool>& flips) {
  bool values = false, flip = false;
  const uint64_t count = MAILLE_TRY(begin_typed_list(file, values));
  if (values && count > file.size()) return file.malformed("a list is longer than the file");
  MAILLE_CHECK(budget.take(count, 1));
  flips.clear();
  for (uint64_t i = 0; i < count; ++i) {
    if ((values || i == 0) && !file.next_flag(flip)) return file.malformed("there should be 0 or 1");
    flips.push_back(flip);
  }
  return count == 0 && !values ? Result<>() : file.end_list(values);
}

// Adds the elements of the last zone that was named. A uniform list "count{value}" is read once and repeated.
Result<> FoamZones::read_labels(FoamReader& file, uint64_t elements, Budget& budget,
                                const std::vector<bool>& flips) {
  bool values = false;
  const uint64_t count = MAILLE_TRY(begin_typed_list(file, values));
  if (count > elements) return file.malformed("a zone is larger than the mesh");
  // Four numbers are kept for each element in the list that is sorted.
  MAILLE_CHECK(budget.take(count, 4 * sizeof(uint64_t)));
  int64_t label = 0;
  for (uint64_t i = 0; i < count; ++i) {
    if (values ? !file.next_label(label) : i == 0 && !file.label(label))
      return file.malformed("there should be a number in a zone");
    if (label < 0 || static_cast<uint64_t>(label) >= elements)
      return file.malformed(std::string("a ") + kind_.type + " has element " + std::to_string(label) +
                            ", but there are " + std::to_string(elements));
    const bool flip = i < flips.size() && flips[i];
    MAILLE_CHECK(sorted_.add({static_cast<uint64_t>(label), names_.size() - 1, i, uint64_t{flip}}, {}));
  }
  return count == 0 && !values ? Result<>() : file.end_list(values);
}

/// Reads what is between a zone's braces. Labels are read behind the flips, which may follow them, by jumping
/// back.
Result<> FoamZones::read_zone(FoamReader& file, uint64_t elements, Budget& budget) {
  uint64_t labels_at = 0;
  bool has_labels = false;
  std::vector<bool> flips;
  while (!file.take('}')) {
    if (file.at_end()) return file.malformed("the file ends inside a zone");
    const std::string key(file.word());
    if (key == kind_.labels) {
      labels_at = file.position();
      has_labels = true;
      MAILLE_CHECK(skip_labels(file));
    } else if (key == "flipMap") {
      MAILLE_CHECK(read_flips(file, budget, flips));
    }
    // Entries that do not matter, such as the type, end at the next ";".
    while (!file.at_end() && file.word() != ";") {
    }
  }
  const uint64_t behind = file.position();
  if (!has_labels) return {};
  file.jump(labels_at);
  MAILLE_CHECK(read_labels(file, elements, budget, flips));
  file.jump(behind);
  return {};
}

Result<> FoamZones::skip_labels(FoamReader& file) {
  bool values = false;
  const uint64_t count = MAILLE_TRY(begin_typed_list(file, values));
  int64_t label = 0;
  if (values && count > file.size()) return file.malformed("a list is longer than the file");
  for (uint64_t i = 0; i < (values ? count : std::min<uint64_t>(count, 1)); ++i) {
    if (values ? !file.next_label(label) : !file.label(label))
      return file.malformed("there should be a number in a zone");
  }
  return count == 0 && !values ? Result<>() : file.end_list(values);
}

// Takes zones whose elements are known already, instead of reading them from a file.
Result<> FoamZones::take(std::vector<std::string> names, std::span<const Element> elements) {
  names_ = std::move(names);
  uint64_t place = 0;
  for (const Element& element : elements)
    MAILLE_CHECK(sorted_.add({element.element, element.zone, place++, uint64_t{element.flipped}}, {}));
  MAILLE_CHECK(sorted_.sort());
  return count();
}

Result<> FoamZones::read(FoamReader& file, uint64_t elements, Budget& budget) {
  bool values = false;
  const uint64_t zones = MAILLE_TRY(file.begin_list(values));
  for (uint64_t i = 0; i < zones && values; ++i) {
    names_.emplace_back(file.word());
    MAILLE_CHECK(budget.take(1, sizeof(std::string) + names_.back().size()));
    if (!file.take('{')) return file.malformed("there should be \"{\" behind the name of a zone");
    MAILLE_CHECK(read_zone(file, elements, budget));
  }
  MAILLE_CHECK(sorted_.sort());
  return count();
}

/// Counts what decides how zones are held: how many overlap, and how often they change along the mesh.
Result<> FoamZones::count() {
  uint64_t behind = 0, last = ~uint64_t{0};
  while (sorted_.front() != nullptr) {
    const uint64_t element = sorted_.front()->numbers[0];
    const auto uses = MAILLE_TRY(of(element));
    layers_ = std::max<uint64_t>(layers_, uses.size());
    if (element != behind || uses[0].zone != last) runs_ += element == behind ? 1 : 2;
    behind = element + 1;
    last = uses[0].zone;
  }
  return rewind();
}

// The zones of one element. Elements must be asked for in rising order: what lies before is passed over.
Result<std::span<const FoamZones::Use>> FoamZones::of(uint64_t element) {
  uses_.clear();
  while (sorted_.front() != nullptr && sorted_.front()->numbers[0] <= element) {
    const auto& [found, zone, place, flipped] = sorted_.front()->numbers;
    // An element that a zone lists twice is in it once.
    if (found == element && (uses_.empty() || uses_.back().zone != zone))
      uses_.push_back({zone, place, flipped != 0});
    MAILLE_CHECK(sorted_.take());
  }
  return std::span<const Use>(uses_);
}

// Keeps the faces of zones with their corners, sorted by zone and place, so that each zone becomes a block
// with its faces in the order of its list.
Result<> FoamZoneFaces::add(std::span<const FoamZones::Use> uses, std::span<const uint32_t> corners) {
  for (const FoamZones::Use& use : uses) {
    if (zones_.size() <= use.zone) zones_.resize(use.zone + 1);
    zones_[use.zone].types.add(corners.size());
    ++zones_[use.zone].faces;
    turned_.assign(corners.begin(), corners.end());
    // A flipped face keeps its first corner.
    if (use.flipped && !turned_.empty()) std::reverse(turned_.begin() + 1, turned_.end());
    MAILLE_CHECK(sorted_.add({use.zone, use.place}, turned_));
  }
  return {};
}

std::vector<Array> foam_zone_arrays(const FoamZones& zones, const FoamZoneKind& kind, Domain domain) {
  std::vector<Array> arrays;
  const size_t labels = zones.names().size() + 1;
  // The narrowest that holds all names and "none".
  const Scalar type = labels <= 0x100 ? Scalar::u8 : labels <= 0x10000 ? Scalar::u16 : Scalar::u32;
  // One array holds one zone for each element; where zones overlap, further arrays hold the others.
  for (uint64_t layer = 0; layer < zones.layers(); ++layer) {
    const std::string name = kind.type + (layer == 0 ? std::string() : ":" + std::to_string(layer + 1));
    arrays.push_back(make_array(name, domain, type, 1, Role::label));
    arrays.back().labels.assign(1, "");
    for (const std::string& zone : zones.names()) arrays.back().labels.push_back(zone);
  }
  return arrays;
}

void put_foam_label(Scalar type, uint64_t value, std::byte* to) {
  std::memcpy(to, &value, size_of(type));  // little-endian
}

void add_foam_zone_metadata(const FoamZones& zones, const FoamZoneKind& kind,
                            std::vector<std::pair<std::string, std::string>>& metadata) {
  for (const std::string& name : zones.names()) metadata.emplace_back(kind.metadata + name, kind.type);
}

bool has_foam_zones(const std::string& folder, const FoamZoneKind& kind) {
  return has_foam_file(folder + "/" + kind.file);
}

}  // namespace maille
