// netCDF in its classic formats, and what all of them have in common.
#include <algorithm>
#include <cstring>

#include "base/bytes.h"
#include "io/buffered_writer.h"
#include "io/exodus/netcdf.h"
#include "io/reading.h"
#include "io/vtk/vtk_field_data.h"

namespace maille {
namespace {

// By number of the type, from 1 on; 2 is text. 7 to 11 are of CDF-5. Source: "NetCDF Classic Format
// Specification" and its 64-bit data variant (Unidata, PnetCDF).
constexpr Scalar scalars[] = {Scalar::i8, Scalar::u8,  Scalar::i16, Scalar::i32, Scalar::f32, Scalar::f64,
                              Scalar::u8, Scalar::u16, Scalar::u32, Scalar::i64, Scalar::u64};
constexpr uint64_t tag_dimensions = 10, tag_variables = 11, tag_attributes = 12, type_text = 2;

/// Walks over the header: big-endian numbers, everything padded to 4 bytes. Each list has at most as many
/// items as the file has bytes, and each item takes some, so every loop ends with the header.
class HeaderReader {
 public:
  HeaderReader(Bytes bytes, std::string name) : bytes_(bytes), name_(std::move(name)) {}

  tl::unexpected<Error> malformed(const std::string& what) const {
    return failure(ErrorCode::malformed_input, name_ + ": byte " + std::to_string(at_) + ": " + what);
  }
  Result<uint64_t> number(size_t size) {
    if (size > bytes_.size() - at_) return malformed("the file ends inside its header");
    uint64_t value = 0;
    for (size_t i = 0; i < size; ++i) value = value << 8 | std::to_integer<uint64_t>(bytes_[at_ + i]);
    at_ += size;
    return value;
  }
  Result<uint64_t> word() { return number(4); }
  /// As wide as the version has it.
  Result<uint64_t> count() { return number(version == 5 ? 8 : 4); }
  Result<std::string> text(uint64_t size) {
    // size + 3 may wrap around for a hostile size; the size itself is compared with the file first.
    const uint64_t padded = (size + 3) / 4 * 4;
    if (size > bytes_.size() || padded > bytes_.size() - at_) return malformed("the file ends inside a name");
    std::string text(reinterpret_cast<const char*>(bytes_.data() + at_), size);
    at_ += padded;
    return text;
  }
  Result<std::string> name() {
    const uint64_t size = MAILLE_TRY(count());
    return text(size);
  }
  /// The length of a list with this tag; an absent list has none.
  Result<uint64_t> list(uint64_t tag) {
    const uint64_t found = MAILLE_TRY(word());
    const uint64_t length = MAILLE_TRY(count());
    if (found != tag && (found != 0 || length != 0))
      return malformed("a list of the header is not the one expected");
    if (length > bytes_.size()) return malformed("a list of the header is longer than the file");
    return length;
  }
  Result<std::map<std::string, std::string>> attributes() {
    std::map<std::string, std::string> texts;
    const uint64_t length = MAILLE_TRY(list(tag_attributes));
    for (uint64_t i = 0; i < length; ++i) {
      std::string key = MAILLE_TRY(name());
      const uint64_t type = MAILLE_TRY(word());
      const uint64_t values = MAILLE_TRY(count());
      if (type < 1 || type > std::size(scalars) || values > bytes_.size())
        return malformed("an attribute has no known type");
      std::string value = MAILLE_TRY(text(values * size_of(scalars[type - 1])));
      if (type == type_text) texts[std::move(key)] = std::move(value);
    }
    return texts;
  }

  int version = 1;

 private:
  Bytes bytes_;
  std::string name_;
  size_t at_ = 4;
};

/// Reads what stands behind a variable's name. `lengths`: of the dimensions, 0 for that of the records.
Result<NetcdfFile::Variable> read_variable(HeaderReader& in, const std::vector<uint64_t>& lengths,
                                           uint64_t records) {
  NetcdfFile::Variable variable;
  const uint64_t rank = MAILLE_TRY(in.count());
  for (uint64_t k = 0; k < rank; ++k) {
    const uint64_t dimension = MAILLE_TRY(in.count());
    if (dimension >= lengths.size()) return in.malformed("a variable has a dimension that is not there");
    // Only the first dimension may be that of records, as the specification has it. Elsewhere a length of 0
    // stays 0.
    const bool of_records = k == 0 && lengths[dimension] == 0;
    variable.has_records = variable.has_records || of_records;
    variable.shape.push_back(of_records ? records : lengths[dimension]);
  }
  variable.texts = MAILLE_TRY(in.attributes());
  const uint64_t type = MAILLE_TRY(in.word());
  if (type < 1 || type > std::size(scalars)) return in.malformed("a variable has no known type");
  variable.type = scalars[type - 1];
  variable.is_text = type == type_text;
  MAILLE_CHECK(in.count());  // its size, which follows from its shape and may not fit
  variable.begin = MAILLE_TRY(in.number(in.version == 1 ? 4 : 8));
  return variable;
}

class ClassicFile final : public NetcdfFile {
 public:
  ClassicFile(InputBytes input, std::string name) : NetcdfFile(std::move(name)), input_(std::move(input)) {}
  Result<> read_header();

  uint64_t dimension(const std::string& name) const override;
  Result<Array> read(const Variable& variable, uint64_t record, Array array, Budget& budget) const override;

 private:
  InputBytes input_;
  std::map<std::string, uint64_t> dimensions_;
  uint64_t records_ = 0, record_size_ = 0;
};

Result<> ClassicFile::read_header() {
  const Bytes bytes = input_.bytes();
  HeaderReader in(bytes, name_);
  if (bytes.size() < 8 || std::memcmp(bytes.data(), "CDF", 3) != 0)
    return in.malformed("it is no netCDF file of a classic format");
  in.version = std::to_integer<int>(bytes[3]);
  if (in.version != 1 && in.version != 2 && in.version != 5)
    return in.malformed("its version is not 1, 2 or 5");
  records_ = MAILLE_TRY(in.count());
  std::vector<uint64_t> lengths;
  const uint64_t dimensions = MAILLE_TRY(in.list(tag_dimensions));
  for (uint64_t i = 0; i < dimensions; ++i) {
    std::string dimension = MAILLE_TRY(in.name());
    const uint64_t length = MAILLE_TRY(in.count());
    lengths.push_back(length);
    dimensions_[std::move(dimension)] = length == 0 ? records_ : length;
  }
  MAILLE_CHECK(in.attributes());
  const uint64_t variables = MAILLE_TRY(in.list(tag_variables));
  // Records of all variables that have them are interleaved: a record is one slice of each, padded to 4
  // bytes.
  uint64_t with_records = 0, unpadded = 0;
  for (uint64_t i = 0; i < variables; ++i) {
    std::string key = MAILLE_TRY(in.name());
    Variable variable = MAILLE_TRY(read_variable(in, lengths, records_));
    if (variable.has_records) {
      ++with_records;
      if (variable.count() > bytes.size()) return in.malformed("a variable is longer than the file");
      unpadded = variable.count() * size_of(variable.type);
      record_size_ += (unpadded + 3) / 4 * 4;
    }
    variable.name = key;
    variables_[std::move(key)] = std::move(variable);
  }
  // The one variable of a file with only one that has records is not padded.
  if (with_records == 1) record_size_ = unpadded;
  return {};
}

uint64_t ClassicFile::dimension(const std::string& name) const {
  const auto found = dimensions_.find(name);
  return found == dimensions_.end() ? 0 : found->second;
}

Result<Array> ClassicFile::read(const Variable& variable, uint64_t record, Array array,
                                Budget& budget) const {
  const Bytes bytes = input_.bytes();
  array.type = variable.type;
  const auto too_long = [&] {
    return failure(ErrorCode::malformed_input,
                   name_ + ": the values of \"" + array.name + "\" lie behind the end of the file");
  };
  const uint64_t count = variable.count();
  const size_t size = size_of(variable.type);
  if (count > bytes.size() / size || variable.begin > bytes.size()) return too_long();
  if (variable.has_records &&
      // Records in the file take record_size_ bytes each, so the product below cannot overflow.
      (record >= records_ || record > bytes.size() / std::max<uint64_t>(record_size_, 1)))
    return too_long();
  const uint64_t begin = variable.begin + (variable.has_records ? record * record_size_ : 0);
  if (begin > bytes.size() || count * size > bytes.size() - begin) return too_long();
  MAILLE_CHECK(budget.take(count, size));
  array.bytes.assign(bytes.begin() + static_cast<ptrdiff_t>(begin),
                     bytes.begin() + static_cast<ptrdiff_t>(begin + count * size));
  // Big-endian in the file; this machine is little-endian, as all of maille assumes.
  for (size_t i = 0; size > 1 && i < array.bytes.size(); i += size) {
    std::reverse(array.bytes.begin() + static_cast<ptrdiff_t>(i),
                 array.bytes.begin() + static_cast<ptrdiff_t>(i + size));
  }
  return array;
}

}  // namespace

uint64_t NetcdfFile::Variable::count() const {
  uint64_t count = 1;
  for (size_t i = has_records ? 1 : 0; i < shape.size(); ++i) {
    // The bound leaves room for callers to multiply by a size of eight bytes.
    if (shape[i] != 0 && count > (uint64_t{1} << 56) / shape[i]) return UINT64_MAX >> 8;
    count *= shape[i];
  }
  return count;
}

const NetcdfFile::Variable* NetcdfFile::find(const std::string& name) const {
  const auto found = variables_.find(name);
  return found == variables_.end() ? nullptr : &found->second;
}

Result<std::vector<int64_t>> NetcdfFile::integers(const std::string& name, Budget& budget) const {
  std::vector<int64_t> values;
  const Variable* const variable = find(name);
  if (variable == nullptr) return values;
  if (is_float(variable->type))
    return failure(ErrorCode::malformed_input, name_ + ": \"" + name + "\" should be integers");
  const Array array =
      MAILLE_TRY(read(*variable, 0, make_array(name, Domain::mesh, variable->type, 1), budget));
  MAILLE_CHECK(budget.take(array.count(), sizeof(int64_t)));
  for (uint64_t i = 0; i < array.count(); ++i) values.push_back(static_cast<int64_t>(integer_at(array, i)));
  return values;
}

Result<std::vector<std::string>> NetcdfFile::strings(const std::string& name, Budget& budget) const {
  std::vector<std::string> rows;
  const Variable* const variable = find(name);
  if (variable == nullptr || !variable->is_text || variable->shape.size() != 2 || variable->has_records)
    return rows;
  const Array array = MAILLE_TRY(read(*variable, 0, make_array(name, Domain::mesh, Scalar::u8, 1), budget));
  const uint64_t length = variable->shape[1];
  for (uint64_t row = 0; length != 0 && row < variable->shape[0]; ++row) {
    std::string text(reinterpret_cast<const char*>(array.bytes.data() + row * length), length);
    text.resize(std::min(text.size(), text.find('\0')));
    while (!text.empty() && text.back() == ' ') text.pop_back();
    rows.push_back(std::move(text));
  }
  return rows;
}

Result<std::unique_ptr<NetcdfFile>> open_netcdf_classic(const Source& source) {
  auto file = std::make_unique<ClassicFile>(MAILLE_TRY(InputBytes::load(source)), source.name());
  MAILLE_CHECK(file->read_header());
  return file;
}

}  // namespace maille
