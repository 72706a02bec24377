#pragma once

#include <maille/file.h>
#include <maille/mesh.h>

#include <optional>

#include "options.h"

namespace maille::tool {

/// The decoded mesh in the order of the original, so that errors can be measured element by element.
///
/// A file that keeps the order is there already. Another is compressed once more from the original, with the
/// settings the file tells and the order kept; the result counts only when compare() shows that it is
/// `decoded` up to order, so nothing has to be believed. Without a value: the settings could not be found
/// again, or the file does not hold this original.
Result<std::optional<Mesh>> in_original_order(const Mesh& original, const Mesh& decoded, const FileInfo& info,
                                              const CommonOptions& common);

/// Whether everything in the file is lossless.
bool all_lossless(const FileInfo& info);

/// `original` with the lossy arrays (and lossy positions) of `ordered` in place of its own: equal to
/// `ordered` in the same order when connectivity and everything lossless are right.
Mesh with_lossy_values(const Mesh& original, const Mesh& ordered, const FileInfo& info);

}  // namespace maille::tool
