#pragma once

#include <maille/mesh.h>
#include <maille/source.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/budget.h"

namespace maille {

/// A dataset of HDF5, as far as meshes need it. What the file says of sizes was not checked against its
/// bytes: rows() does that.
struct Hdf5Dataset {
  /// Rows, and numbers in one. No dimension: one row.
  std::vector<uint64_t> shape;
  bool grows = false;          ///< rows may be added
  std::optional<Scalar> type;  ///< none: no numbers, or of a type we do not know
  uint64_t text_size = 0;      ///< bytes of each, where it holds text of fixed length
  uint64_t stored = 0;         ///< bytes in the file
  bool packed = false;         ///< by filters
  bool elsewhere = false;      ///< its values are in other files
  uint64_t chunk_size = 0;     ///< numbers that are read at once, at least

  uint64_t rows() const { return shape.empty() ? 1 : shape[0]; }
  /// What a row has; saturates.
  uint64_t row_size() const;
};

class ChildProcess;

/// A file of HDF5, read by the library of The HDF Group. Damaged files make that one crash (of 3,000 files
/// with one to four bytes changed, each run of seven crashed it before the end, 75581a5), so it works in a
/// process of its own. It sees the bytes of the source and nothing else: links to other files, and values
/// that lie in them, are not followed. Not for several threads at once.
class Hdf5File {
 public:
  /// Errors: malformed_input; cannot_read; unsupported, where there is no library.
  static Result<std::unique_ptr<Hdf5File>> open(const Source& source);
  ~Hdf5File();

  bool is_group(const std::string& path) const;
  /// Names in a group, sorted; none where there is no such group.
  std::vector<std::string> members(const std::string& group) const;
  /// None where there is no dataset of that path.
  std::optional<Hdf5Dataset> find(const std::string& path) const;
  /// Reads `count` rows from `first` on as tuples of the array, whose type and number of components are set;
  /// of text, as bytes. Values come in native byte order. Nothing is reserved that the file does not have.
  /// Errors: malformed_input; memory_bound.
  Result<Array> rows(const std::string& path, uint64_t first, uint64_t count, Array array,
                     Budget& budget) const;
  /// An attribute of an object; none where there is none, or it is no text, or no whole number.
  std::optional<std::string> text(const std::string& object, const std::string& name) const;
  std::optional<int64_t> number(const std::string& object, const std::string& name) const;

  /// What the source is called.
  const std::string& name() const { return name_; }
  /// The library gave up: what was not found may be there.
  bool is_broken() const { return broken_; }

 private:
  explicit Hdf5File(std::string name);
  /// Nothing where the child is gone.
  std::vector<std::byte> ask(Bytes question) const;
  tl::unexpected<Error> malformed(const std::string& path, const std::string& what) const;

  std::string name_;
  std::unique_ptr<ChildProcess> reader_;
  mutable bool broken_ = false;
};

/// Whether these first bytes look like HDF5: its signature at offset 0. The format also allows it at 512,
/// 1024, ... behind a block of the user's, which is not looked for.
bool is_hdf5(Bytes first_bytes);

}  // namespace maille
