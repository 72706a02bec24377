#pragma once

#define WIN32_LEAN_AND_MEAN
#include <windows.h>

#include <io.h>
#include <string>

namespace maille {

/// A path as Windows takes it: UTF-16.
std::wstring wide(const std::string& path);
inline HANDLE handle_of(int fd) {
  return reinterpret_cast<HANDLE>(::_get_osfhandle(fd));
}
/// Of what is open: without links, and in one spelling; empty where that fails.
std::wstring real_path(int fd);
/// Puts the reason of the last call that failed into errno; false.
bool failed();
/// CreateFileW() as a descriptor; not valid with errno where it fails.
int create_file(const std::string& path, DWORD access, DWORD creation, DWORD flags, int descriptor_flags);

}  // namespace maille
