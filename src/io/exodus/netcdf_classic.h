#pragma once

#include <maille/mesh.h>
#include <maille/source.h>
#include <map>
#include <string>
#include <vector>
#include "io/budget.h"

namespace maille {

/// A netCDF file in one of the classic formats (CDF-1, -2 and -5): named dimensions, and variables over them.
/// Every place and size is checked against the file before use.
class NetcdfFile {
 public:
  struct Variable {
    std::vector<uint64_t> shape;  ///< the record dimension with the number of records
    Scalar type = Scalar::u8;
    bool is_text = false;
    bool has_records = false;
    uint64_t begin = 0;
    std::map<std::string, std::string> texts;  ///< attributes that are text

    uint64_t count() const;
  };

  static Result<NetcdfFile> open(Bytes bytes, std::string name);

  /// 0 where there is none.
  uint64_t dimension(const std::string& name) const;
  const Variable* find(const std::string& name) const;
  /// All values, or those of one record where the variable has records; in native byte order. `array`: what
  /// the name, domain and number of components should be.
  Result<Array> read(const Variable& variable, uint64_t record, Array array, Budget& budget) const;
  Result<std::vector<int64_t>> integers(const std::string& name, Budget& budget) const;
  /// The rows of a table of characters, without the zeros behind them; empty where there is no such table.
  Result<std::vector<std::string>> strings(const std::string& name, Budget& budget) const;

 private:
  Bytes bytes_;
  std::string name_;
  std::map<std::string, uint64_t> dimensions_;
  std::map<std::string, Variable> variables_;
  uint64_t records_ = 0, record_size_ = 0;
};

}  // namespace maille
