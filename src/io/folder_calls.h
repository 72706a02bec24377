#pragma once

#include "base/system.h"

// What folder_sink() asks of the system. io/posix and io/windows each have all of it. A folder is a
// descriptor where that is possible, so that it is found again should somebody rename what is above. Calls
// that fail leave the reason in errno.
namespace maille {

Descriptor open_folder(const std::string& path);
/// Others see, until it is closed, that it is in use. Best effort: some file systems have no locks.
Descriptor open_folder_in_use(const std::string& path);
/// A folder that nobody has in use; not valid where somebody has, and for links.
Descriptor open_unused_folder(const std::string& path);

bool make_folder(int around, const std::string& name);
/// Where it is empty.
void remove_folder(int around, const std::string& name);
/// A new file to write; nobody else may have made it.
Descriptor make_file(int folder, const std::string& name);
void remove_file(int folder, const std::string& name);
/// Makes durable which files there are, where that is possible.
void sync_folder(int folder);
/// Renames a folder; `open` is one of its descriptors.
bool rename_folder(const std::string& from, const std::string& to, Descriptor& open);

}  // namespace maille
