#pragma once

#include <maille/mesh.h>
#include <maille/source.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "io/budget.h"

namespace maille {

/// A netCDF file: named dimensions, and variables over them, of which Exodus is made. Every place and size is
/// checked against the file before use. Two formats of files share this interface: the classic ones, which
/// are read here, and netCDF-4, which is HDF5. Values come in native byte order.
class NetcdfFile {
 public:
  struct Variable {
    std::string name;
    std::vector<uint64_t> shape;  ///< the record dimension with the number of records
    Scalar type = Scalar::u8;
    bool is_text = false;
    bool has_records = false;
    uint64_t begin = 0;                        ///< in a classic file
    std::map<std::string, std::string> texts;  ///< attributes that are text; of HDF5, those of Exodus

    /// Values, or those of one record where there are records. Saturates instead of overflowing, far beyond
    /// any file.
    uint64_t count() const;
  };
  virtual ~NetcdfFile() = default;

  /// The length of a dimension; 0 where there is none. That of records is the number of records.
  virtual uint64_t dimension(const std::string& name) const = 0;
  const Variable* find(const std::string& name) const;
  /// All values, or those of one record where the variable has records; in native byte order. `array`: what
  /// the name, domain and number of components should be.
  virtual Result<Array> read(const Variable& variable, uint64_t record, Array array,
                             Budget& budget) const = 0;
  // All values as whole numbers, of the first record where there are records; empty where there is no such
  // variable. Errors: malformed_input, for floats and what read() finds.
  Result<std::vector<int64_t>> integers(const std::string& name, Budget& budget) const;
  /// The rows of a table of characters, without the zeros behind them; empty where there is no such table.
  Result<std::vector<std::string>> strings(const std::string& name, Budget& budget) const;

  const std::string& name() const { return name_; }

 protected:
  explicit NetcdfFile(std::string name) : name_(std::move(name)) {}

  std::string name_;
  std::map<std::string, Variable> variables_;
};

/// Opens a file in one of the classic formats (CDF-1, -2 and -5: offsets of 32 bits, of 64, and counts of
/// 64). Error: malformed_input.
Result<std::unique_ptr<NetcdfFile>> open_netcdf_classic(const Source& source);
/// Opens netCDF-4. Errors: malformed_input; unsupported, where there is no library of HDF5.
Result<std::unique_ptr<NetcdfFile>> open_netcdf_hdf5(const Source& source);

}  // namespace maille
