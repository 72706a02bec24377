#pragma once

#include <maille/limits.h>
#include <maille/mesh.h>

#include <string>
#include <string_view>
#include <vector>

#include "io/budget.h"
#include "io/foam/foam_case.h"
#include "io/foam/foam_field.h"
#include "io/foam/foam_field_joiner.h"
#include "io/foam/foam_places.h"

namespace maille {

/// Adds the fields of one time to a mesh: arrays with their values, and metadata with the text around them.
/// All it is given must outlive it.
class FoamFieldReader {
 public:
  FoamFieldReader(const FoamPlaces& places, const Limits& limits, Budget& budget, Mesh& mesh,
                  std::vector<std::string>& notes)
      : places_(places), limits_(limits), budget_(budget), mesh_(mesh), notes_(notes) {}

  /// Of a case that was divided: fields are those of the processors. It must outlive the reader.
  void set_joiner(const FoamFieldJoiner& joiner) { joiner_ = &joiner; }

  /// Reads the files of a time's folder in the case, in the order of their names. Errors: cannot_read,
  /// malformed_input with file and line, memory_bound, unsupported (a mesh of its own).
  Result<> read(const std::string& case_folder, const FoamTime& time);

 private:
  Result<> read_file(const std::string& folder, const std::string& name, const std::string& time);
  Result<> add(const FoamField& field, const FoamFieldKind& kind, const std::string& name,
               const std::string& time);
  Result<> add_internal(const FoamField& field, const FoamValues& values, const FoamFieldKind& kind,
                        Array& array);
  Result<bool> add_patch(const FoamField& field, const FoamValues& values, const FoamFieldKind& kind,
                         size_t first_array, int& digits);
  Result<> fill(const FoamField& field, const FoamValues& values, Array& array, uint64_t first,
                uint64_t count, int& digits) const;
  void put_at_patches(Array& array) const;
  Result<> fill_owned(const FoamField& field, const FoamValues& values, Array& array, int& digits) const;
  Result<size_t> new_array(const std::string& name, Domain domain, Scalar type, uint64_t components,
                           const FoamField& field);
  void add_text(const std::string& name, std::string_view text);
  std::string without_banner(std::string_view text);

  const FoamPlaces& places_;
  const Limits& limits_;
  Budget& budget_;
  Mesh& mesh_;
  std::vector<std::string>& notes_;
  const FoamFieldJoiner* joiner_ = nullptr;
  std::optional<std::string> banner_;
  std::string internal_digits_;
};

}  // namespace maille
