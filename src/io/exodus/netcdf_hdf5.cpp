// netCDF-4: a file of HDF5 whose datasets are the variables. A dimension is a dataset, too, whose length says
// how long it is; one that grows is the dimension of records, of any name.
#include <algorithm>
#include <optional>

#include "base/result.h"
#include "io/exodus/netcdf.h"
#include "io/hdf5/hdf5_file.h"

namespace maille {
namespace {

class Hdf5Netcdf final : public NetcdfFile {
 public:
  explicit Hdf5Netcdf(std::unique_ptr<Hdf5File> file) : NetcdfFile(file->name()), file_(std::move(file)) {
    for (const std::string& name : file_->members("/")) {
      const auto dataset = file_->find(name);
      if (!dataset) continue;
      Variable variable;
      variable.name = name;
      variable.shape = dataset->shape;
      variable.has_records = dataset->grows;
      variable.is_text = dataset->text_size == 1;
      // Dimensions that are no variables have values of no use, of any type.
      if (dataset->grows) records_ = std::max(records_, dataset->rows());
      lengths_[name] = dataset->grows ? std::nullopt : std::optional(dataset->rows());
      if (!dataset->type && !variable.is_text) continue;
      variable.type = dataset->type.value_or(Scalar::u8);
      // The only attribute that Exodus needs: it names the shape of the cells of a block.
      if (auto type = file_->text(name, "elem_type")) variable.texts["elem_type"] = *std::move(type);
      variables_[name] = std::move(variable);
    }
  }

  uint64_t dimension(const std::string& name) const override {
    const auto found = lengths_.find(name);
    if (found == lengths_.end()) return 0;
    // That of records need not tell how many there are.
    return found->second.value_or(records_);
  }

  Result<Array> read(const Variable& variable, uint64_t record, Array array, Budget& budget) const override {
    const uint32_t components = array.components;
    const uint64_t rows = variable.shape.empty() ? 1 : variable.shape[0];
    const bool one = variable.has_records;
    array =
        MAILLE_TRY(file_->rows(variable.name, one ? record : 0, one ? 1 : rows, std::move(array), budget));
    array.components = components;
    return array;
  }

 private:
  std::unique_ptr<Hdf5File> file_;
  std::map<std::string, std::optional<uint64_t>> lengths_;  ///< none: that of the records
  uint64_t records_ = 0;
};

}  // namespace

Result<std::unique_ptr<NetcdfFile>> open_netcdf_hdf5(const Source& source) {
  std::unique_ptr<Hdf5File> file = MAILLE_TRY(Hdf5File::open(source));
  const Hdf5File& opened = *file;
  auto netcdf = std::make_unique<Hdf5Netcdf>(std::move(file));
  if (!opened.is_broken()) return netcdf;
  return failure(ErrorCode::malformed_input, source.name() + ": it is damaged: the library of HDF5 gave up");
}

}  // namespace maille
