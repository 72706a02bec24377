#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/result.h"
#include "io/foam/foam_writer.h"
#include "io/foam/polymesh_groups.h"
#include "io/list_sorter.h"

namespace maille {

/// The zones of one kind, to be written: elements come in any order, and are sorted by zone out of core.
/// Numbers of an element: its zone, then its number (N = 2: cells, points); or its zone, its place in it, its
/// number, whether it is flipped (N = 4: faces, whose order in a zone is kept).
template <size_t N>
class FoamZoneLists {
 public:
  /// `memory`: bytes, about; `folder`: of temporary files.
  FoamZoneLists(uint64_t memory, const std::string& folder) : sorted_(memory, folder) {}

  Result<> add(const std::array<uint64_t, N>& numbers) {
    if (counts_.size() <= numbers[0]) counts_.resize(numbers[0] + 1);
    ++counts_[numbers[0]];
    return sorted_.add(numbers, {});
  }
  /// Writes the file of the zones; none where there are no names. Once.
  Result<> write(const FoamZoneKind& kind, const FoamNames& names, FoamWriter& file);

 private:
  static constexpr bool with_flips = N == 4;
  uint64_t count(uint64_t zone) const { return zone < counts_.size() ? counts_[zone] : 0; }
  Result<> put_zone(const FoamZoneKind& kind, uint64_t zone, FoamWriter& file);
  static void begin_list(const std::string& key, const char* type, uint64_t count, FoamWriter& file);
  static void end_list(uint64_t count, FoamWriter& file) { file.out().put(count == 0 ? "0;\n" : ");\n"); }

  ListSorter<N> sorted_;
  std::vector<uint64_t> counts_;
};

template <size_t N>
Result<> FoamZoneLists<N>::write(const FoamZoneKind& kind, const FoamNames& names, FoamWriter& file) {
  if (names.size() == 0) return {};
  MAILLE_CHECK(sorted_.sort());
  MAILLE_CHECK(file.begin(kind.file, "regIOobject"));
  file.out().put_number(names.size());
  file.out().put("\n(\n");
  for (uint64_t zone = 0; zone < names.size(); ++zone) {
    file.out().put(names.words()[zone] + "\n{\n    type " + kind.type + ";\n");
    MAILLE_CHECK(put_zone(kind, zone, file));
    file.out().put("}\n");
  }
  file.end_list();
  return file.end();
}

/// Writes one zone; those before it were taken from the sorter.
template <size_t N>
Result<> FoamZoneLists<N>::put_zone(const FoamZoneKind& kind, uint64_t zone, FoamWriter& file) {
  std::vector<uint8_t> flips;
  begin_list(kind.labels, "label", count(zone), file);
  for (uint64_t i = 0; i < count(zone); ++i) {
    const auto& numbers = sorted_.front()->numbers;
    file.put_label(numbers[with_flips ? 2 : 1]);
    if (with_flips) flips.push_back(static_cast<uint8_t>(numbers[N - 1]));
    MAILLE_CHECK(sorted_.take());
  }
  end_list(count(zone), file);
  if (!with_flips) return {};
  begin_list("flipMap", "bool", flips.size(), file);
  for (const uint8_t flip : flips) file.put_flag(flip != 0);
  end_list(flips.size(), file);
  return {};
}

/// Begins a list; without its "(", and so without a count, where there is nothing in it, as OpenFOAM writes
/// empty lists.
template <size_t N>
void FoamZoneLists<N>::begin_list(const std::string& key, const char* type, uint64_t count,
                                  FoamWriter& file) {
  file.out().put("    " + key + " " + (count == 0 ? "" : std::string("List<") + type + "> \n"));
  if (count > 0) file.begin_list(count);
}

}  // namespace maille
