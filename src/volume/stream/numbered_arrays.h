#pragma once

#include <maille/mesh_source.h>
#include <maille/stream.h>

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

namespace maille {

// Numbers of points and cells: what a value is follows from its place in the mesh, so that zeros are coded in
// their stead.

// A table of runs takes 1 MiB at most. Part of the format.
inline constexpr size_t most_number_runs = 1 << 16;

/// Elements a run has on average at least. Fewer are not worth a run, which takes about six bytes, a number
/// in no order about two.
inline constexpr uint64_t fewest_numbered = 64;
/// Gives numbers of the type mod 2^64; nullptr for types that numbers of elements do not have.
uint64_t (*number_reader(Scalar type))(const std::byte*);

/// Array i of a mesh (of those on points and cells), if it is one.
std::optional<NumberedArray> find_numbered(const Array& array, size_t i);
std::vector<NumberedArray> find_numbered(const Mesh& mesh);
Result<std::vector<NumberedArray>> find_numbered(MeshSource& mesh);

/// A mesh with zeros in the stead of numbers, for encoders that read in parts: all else passes through.
class WithoutNumbers final : public MeshSource {
 public:
  WithoutNumbers(MeshSource& mesh, const std::vector<NumberedArray>& numbered)
      : mesh_(mesh), is_numbered_(mesh.description().arrays.size()) {
    for (const NumberedArray& array : numbered) is_numbered_[array.array] = true;
  }
  const MeshDescription& description() const override { return mesh_.description(); }
  Result<> read_points(uint64_t first, uint64_t count, std::span<std::byte> out) override {
    return mesh_.read_points(first, count, out);
  }
  Result<> read_cells(uint64_t first, uint64_t count, CellPiece& out) override {
    return mesh_.read_cells(first, count, out);
  }
  Result<> read_array(size_t array, uint64_t first, uint64_t count, std::span<std::byte> out) override {
    if (!is_numbered_[array]) return mesh_.read_array(array, first, count, out);
    std::fill(out.begin(), out.end(), std::byte{0});
    return {};
  }

 private:
  MeshSource& mesh_;
  std::vector<bool> is_numbered_;
};

/// The values of an array by element. The runs cover all elements of a valid file; an element beyond them
/// gets the number that the last run would have.
class RisingNumbers {
 public:
  RisingNumbers(const NumberedArray& array, Scalar type);
  size_t number_size() const { return size_; }
  void store(uint64_t element, std::byte* out) const;
  /// Those of elements from `first` on.
  void store_all(uint64_t first, std::span<std::byte> bytes) const;

 private:
  std::vector<NumberedArray::Run> runs_;
  std::vector<uint64_t> begin_;  ///< by run
  size_t size_;
};

}  // namespace maille
