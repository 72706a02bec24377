#include "verdict.h"

#include <fmt/format.h>

#include <algorithm>

#include "original_order.h"
#include "result.h"

namespace maille::tool {

namespace {

/// The error in the measure of the bound: relative to each number for pointwise bounds, and absolute
/// otherwise.
double error_of(const ArrayInfo& info, const ArrayDifference& difference) {
  return info.asked.kind == Tolerance::Kind::pointwise ? difference.maximum_relative : difference.maximum;
}

ArrayVerdict verdict_of(const ArrayInfo& info, const ArrayDifference& difference) {
  bool good = info.lossless ? difference.unequal == 0 : error_of(info, difference) <= info.bound;
  // A norm bounds the length of a whole tuple, which the bounds of its components alone do not keep.
  if (info.asked.kind == Tolerance::Kind::norm && difference.maximum_norm > info.asked.value) good = false;
  return {info, difference, good};
}

// The file's positions and arrays; `differences` as differences_by_order() lists them, empty: none differs.
std::vector<ArrayVerdict> verdicts(const FileInfo& info, const std::vector<ArrayDifference>& differences) {
  std::vector<ArrayInfo> arrays = {info.positions};
  arrays.insert(arrays.end(), info.arrays.begin(), info.arrays.end());
  std::vector<ArrayVerdict> result;
  for (const ArrayInfo& array : arrays) {
    const auto found = std::find_if(differences.begin(), differences.end(), [&](const ArrayDifference& d) {
      return d.name == array.name && d.domain == array.domain;
    });
    const ArrayDifference none{.name = array.name, .domain = array.domain};
    result.push_back(verdict_of(array, found == differences.end() ? none : *found));
  }
  return result;
}

}  // namespace

void differs(Verdict& verdict, std::vector<std::string> differences) {
  verdict.same = false;
  verdict.differences = std::move(differences);
}

namespace {

Result<> hold_lossy_against(const Mesh& original, const Mesh& decoded, const FileInfo& info,
                            const CommonOptions& common, Verdict& verdict) {
  if (original.point_count() != decoded.point_count() || original.cell_count() != decoded.cell_count()) {
    differs(verdict, compare(original, decoded, {.compare_arrays = false}).differences);
    return {};
  }
  const std::optional<Mesh> ordered = TOOL_TRY(in_original_order(original, decoded, info, common));
  if (!ordered) {
    differs(
        verdict,
        {"the file is not what this original and its settings give; either it was made from another mesh, "
         "or compress with --keep-order to have it compared element by element"});
    return {};
  }
  // First everything that was not rounded, with the rounded values replaced by the decoded ones; then the
  // rounded values against their bounds.
  const Comparison rest =
      compare(with_lossy_values(original, *ordered, info), *ordered, {.same_order = true});
  if (!rest.equal) {
    differs(verdict, rest.differences);
    return {};
  }
  verdict.arrays = verdicts(info, TOOL_TRY(differences_by_order(original, *ordered)));
  for (const ArrayVerdict& array : verdict.arrays) {
    if (array.good) continue;
    verdict.same = false;
    verdict.differences.push_back(fmt::format("{}: error {} is above the bound {}", array.info.name,
                                              number(error_of(array.info, array.difference)),
                                              number(array.info.bound)));
  }
  return {};
}

}  // namespace

Result<> hold_against(const Mesh& original, const Mesh& decoded, const FileInfo& info,
                      const CommonOptions& common, Verdict& verdict) {
  verdict.compared = true;
  if (!all_lossless(info)) return hold_lossy_against(original, decoded, info, common, verdict);
  Comparison comparison = compare(original, decoded, {.same_order = info.order == Order::keep});
  if (comparison.equal) {
    verdict.arrays = verdicts(info, {});
  } else {
    differs(verdict, std::move(comparison.differences));
  }
  return {};
}

std::string table_of(const std::vector<ArrayVerdict>& arrays) {
  Table table({"array", "domain", "bound", "max error", "rms error", "unequal"}, 2);
  for (const ArrayVerdict& array : arrays) {
    table.row({array.info.name, maille::name_of(array.info.domain),
               array.info.lossless ? "lossless" : number(array.info.bound),
               number(error_of(array.info, array.difference)), number(array.difference.root_mean_square),
               fmt::format("{}", array.difference.unequal)});
  }
  return table.str();
}

Json json_of(const std::vector<ArrayVerdict>& arrays) {
  Json list = Json::array();
  for (const ArrayVerdict& array : arrays) {
    list.push_back({{"name", array.info.name},
                    {"domain", maille::name_of(array.info.domain)},
                    {"lossless", array.info.lossless},
                    {"bound", array.info.bound},
                    {"maximum_error", array.difference.maximum},
                    {"rms_error", array.difference.root_mean_square},
                    {"unequal", array.difference.unequal},
                    {"good", array.good}});
  }
  return list;
}

}  // namespace maille::tool
