#include "selection.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "result.h"
#include "tolerance.h"

namespace maille::tool {

namespace {

/// The own names of all arrays that are meant.
/// A user may call an array by another format's name (arrays_called()); what is compared later are names of
/// the mesh. `lenient`: a name that no array has is passed over, as in a batch whose meshes differ in their
/// arrays.
Result<std::set<std::string>> own_names(const std::vector<std::string>& names,
                                        const std::vector<Array>& arrays, const std::string& input,
                                        bool lenient) {
  std::set<std::string> all;
  for (const std::string& name : names) {
    const auto found = arrays_called(name, arrays, input);
    if (!found && !lenient) return tl::unexpected(found.error());
    if (found) all.insert(found->begin(), found->end());
  }
  return all;
}

template <class T>
void keep_taken(std::vector<T>& values, const std::vector<bool>& taken) {
  size_t kept = 0;
  for (size_t i = 0; i < values.size(); ++i) {
    if (!taken[i]) continue;
    if (kept != i) values[kept] = std::move(values[i]);
    ++kept;
  }
  values.resize(kept);
}

/// The arrays of a mesh that are taken, and all else of it.
class SelectedArrays final : public MeshSource {
 public:
  SelectedArrays(std::unique_ptr<MeshSource> mesh, const std::vector<bool>& taken)
      : mesh_(std::move(mesh)), description_(mesh_->description()) {
    // `taken` has the arrays on points and cells first, then those of the mesh, as select_arrays() put them
    // together.
    const size_t elements = description_.arrays.size();
    for (size_t i = 0; i < elements; ++i) {
      if (taken[i]) arrays_.push_back(i);
    }
    keep_taken(description_.arrays, {taken.begin(), taken.begin() + static_cast<ptrdiff_t>(elements)});
    keep_taken(description_.mesh_arrays, {taken.begin() + static_cast<ptrdiff_t>(elements), taken.end()});
  }

  const MeshDescription& description() const override { return description_; }
  Result<> read_points(uint64_t first, uint64_t count, std::span<std::byte> out) override {
    return mesh_->read_points(first, count, out);
  }
  Result<> read_cells(uint64_t first, uint64_t count, CellPiece& out) override {
    return mesh_->read_cells(first, count, out);
  }
  Result<> read_array(size_t array, uint64_t first, uint64_t count, std::span<std::byte> out) override {
    return mesh_->read_array(arrays_[array], first, count, out);
  }
  std::vector<std::string> notes() const override { return mesh_->notes(); }

 private:
  std::unique_ptr<MeshSource> mesh_;
  MeshDescription description_;
  std::vector<size_t> arrays_;  ///< by array, its number in `mesh_`
};

}  // namespace

Result<std::vector<bool>> taken_arrays(const ArraySelection& selection, const std::vector<Array>& arrays,
                                       const std::string& input) {
  const auto wanted = TOOL_TRY(
      own_names(selection.wanted.value_or(std::vector<std::string>()), arrays, input, selection.lenient));
  const auto dropped = TOOL_TRY(own_names(selection.dropped, arrays, input, selection.lenient));
  std::vector<bool> taken;
  for (const Array& array : arrays) {
    if (wanted.contains(array.name) && dropped.contains(array.name))
      return failure(ErrorCode::usage, fmt::format("--arrays and --drop both name '{}'", array.name));
    taken.push_back((!selection.wanted || wanted.contains(array.name)) && !dropped.contains(array.name));
  }
  return taken;
}

Result<> select_arrays(const ArraySelection& selection, Mesh& mesh, const std::string& input) {
  if (selection.takes_all()) return {};
  keep_taken(mesh.arrays, TOOL_TRY(taken_arrays(selection, mesh.arrays, input)));
  return {};
}

Result<std::unique_ptr<MeshSource>> select_arrays(const ArraySelection& selection,
                                                  std::unique_ptr<MeshSource> mesh,
                                                  const std::string& input) {
  if (selection.takes_all()) return mesh;
  std::vector<Array> all = mesh->description().arrays;
  const std::vector<Array>& whole = mesh->description().mesh_arrays;
  all.insert(all.end(), whole.begin(), whole.end());
  const std::vector<bool> taken = TOOL_TRY(taken_arrays(selection, all, input));
  return std::make_unique<SelectedArrays>(std::move(mesh), taken);
}

}  // namespace maille::tool
