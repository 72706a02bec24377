#pragma once

#include <algorithm>
#include <cstring>
#include <map>

#include "io/cell_store.h"
#include "io/gmsh/gmsh.h"
#include "io/token_reader.h"

namespace maille {

/// The places of numbers that need not be 1 to n. Most files number their nodes 1 to n: then nothing is
/// sorted and finding is a subtraction. Other files cost 16 bytes more for each number, and a binary search
/// for each lookup.
class NumberIndex {
 public:
  void add(int64_t number) { numbers_.push_back(number); }
  uint64_t size() const { return numbers_.size(); }
  const std::vector<int64_t>& numbers() const { return numbers_; }
  bool in_order() const { return in_order_; }
  /// Call when all are there. Of equal numbers the first counts.
  void finish() {
    for (size_t i = 0; in_order_ && i < numbers_.size(); ++i)
      in_order_ = numbers_[i] == static_cast<int64_t>(i) + 1;
    if (in_order_) return;
    for (size_t i = 0; i < numbers_.size(); ++i) sorted_.emplace_back(numbers_[i], i);
    std::sort(sorted_.begin(), sorted_.end());
  }
  /// UINT64_MAX when it is not there.
  uint64_t find(int64_t number) const {
    if (in_order_)
      return number >= 1 && static_cast<uint64_t>(number) <= numbers_.size()
                 ? static_cast<uint64_t>(number) - 1
                 : UINT64_MAX;
    const auto at = std::lower_bound(sorted_.begin(), sorted_.end(), std::pair<int64_t, uint64_t>(number, 0));
    return at != sorted_.end() && at->first == number ? at->second : UINT64_MAX;
  }

 private:
  std::vector<int64_t> numbers_;
  std::vector<std::pair<int64_t, uint64_t>> sorted_;
  bool in_order_ = true;
};

/// Reads a file whole. gmsh_reader.cpp has what versions 2.x and 4.1 share, and 2.x; gmsh_reader_4.cpp
/// has 4.1.
class GmshReader {
 public:
  GmshReader(const Source& source, std::string_view text, const ReadOptions& options)
      : in_(text, source.name()),
        text_(text),
        budget_(source.name(), text.size(), options.limits),
        pace_(budget_, options.progress, text.size()) {}

  Result<ReadResult> read();

 private:
  using Entity = std::pair<int, int64_t>;  // dimension and tag

  Result<> read_section(const std::string& name);
  Result<> read_format();
  Result<> read_names();
  Result<> read_nodes_2();
  Result<> read_elements_2();
  Result<> read_entities(bool partitioned);
  Result<> read_partitions();
  Result<> skip_parent();
  Result<> read_nodes_4();
  Result<> read_elements_4();
  Result<> read_periodic();
  /// What stands before the values of data.
  struct DataHead {
    std::string name, time;  ///< without a time, empty
    int64_t step = 0, components = 1, entries = 0;
  };
  Result<DataHead> read_data_head();
  Result<> read_data(Domain domain);
  Result<> read_values(const DataHead& head, const NumberIndex& index, std::span<double> values);
  Result<> read_point();
  Result<> add_element(const GmshType& type, int64_t number, int64_t physical, int64_t geometrical);
  Result<> skip_section(const std::string& name);
  Result<std::string> quoted();
  void add_tags(Mesh& mesh);

  // Numbers, as text or in binary: integer() has 32 bits in binary files, size() 64, as Gmsh's int and
  // size_t.
  bool integer(int64_t& value) { return binary_ ? raw<int32_t>(value) : in_.integer(value); }
  bool size(int64_t& value) { return binary_ ? raw<int64_t>(value) : in_.integer(value); }
  bool real(double& value) {
    if (binary_) return raw<double>(value);
    Number number;
    if (!in_.number(number)) return false;
    value = number.value;
    return true;
  }
  template <class T, class To>
  bool raw(To& value) {
    if (static_cast<size_t>(in_.scanner.end() - in_.scanner.here()) < sizeof(T)) return false;
    std::byte bytes[sizeof(T)];
    std::memcpy(bytes, in_.scanner.here(), sizeof(T));
    if (swapped_) std::reverse(bytes, bytes + sizeof(T));
    value = static_cast<To>(load<T>(bytes));
    in_.scanner.jump(in_.scanner.here() + sizeof(T));
    return true;
  }
  tl::unexpected<Error> expected(const std::string& what) {
    if (!binary_) return in_.expected(what);
    return malformed_byte(in_.name(), in_.scanner.position(), "there should be " + what);
  }
  tl::unexpected<Error> malformed(const std::string& what) const {
    return binary_ ? malformed_byte(in_.name(), in_.scanner.position(), what) : in_.malformed(what);
  }
  // Gmsh writes the tag of a group negative where the element is turned over against its entity; the name is
  // that of the positive tag. INT64_MIN has no positive counterpart, hence the max().
  std::string name_of_group(CellType type, int64_t physical) const {
    const auto found =
        names_.find({dimension_of(type), physical < 0 ? -std::max(physical, -INT64_MAX) : physical});
    return found == names_.end() ? "" : found->second;
  }

  TokenReader in_;
  std::string_view text_;
  Budget budget_;
  ReadingPace pace_;
  bool binary_ = false, swapped_ = false;
  int version_ = 0;
  std::map<Entity, std::string> names_;
  std::map<Entity, std::vector<int64_t>> entities_;  ///< their physical groups
  RealColumn positions_;
  NumberIndex nodes_, elements_;
  bool has_nodes_ = false, has_elements_ = false;
  CellStore cells_;
  BlockShapes shapes_;
  std::vector<int32_t> physical_, geometrical_;
  std::vector<Array> arrays_;
  std::vector<std::pair<std::string, std::string>> metadata_;
  std::vector<std::string> notes_;
  /// Counted for the notes: elements with tags of partitions, and nodes with parametric coordinates.
  uint64_t more_tags_ = 0, parametric_ = 0;
};

}  // namespace maille
