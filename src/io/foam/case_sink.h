#pragma once

#include <maille/folder.h>

namespace maille {

/// A case of OpenFOAM around the folder of its mesh, which `mesh` writes. What is written besides waits in a
/// file without a name until commit(): then each file appears whole, behind the mesh. `overwrite`: files of
/// times that are there already are replaced, otherwise they are an error (usage). Files in "constant" and
/// "system" that are there stay.
std::unique_ptr<FolderSink> case_sink(std::unique_ptr<FolderSink> mesh, const std::string& folder,
                                      bool overwrite);

}  // namespace maille
