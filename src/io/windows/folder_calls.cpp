#include "io/folder_calls.h"

#include <fcntl.h>

#include "base/windows/calls.h"

namespace maille {
namespace {

/// `shared`: what others may do with the folder meanwhile.
Descriptor open_as(const std::string& path, DWORD access, DWORD shared, DWORD more_flags) {
  const HANDLE folder = CreateFileW(wide(path).c_str(), access, shared, nullptr, OPEN_EXISTING,
                                    FILE_FLAG_BACKUP_SEMANTICS | more_flags, nullptr);
  if (folder == INVALID_HANDLE_VALUE) return failed(), Descriptor();
  return Descriptor(::_open_osfhandle(reinterpret_cast<intptr_t>(folder), _O_RDONLY | _O_NOINHERIT));
}

constexpr DWORD share_all = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;

std::wstring path_in(int folder, const std::string& name) {
  return real_path(folder) + L"\\" + wide(name);
}

}  // namespace

Descriptor open_folder(const std::string& path) {
  return open_as(path, GENERIC_READ, share_all, 0);
}

// Windows locks no folders, but who does not share it for removal keeps others from opening it for that.
Descriptor open_folder_in_use(const std::string& path) {
  return open_as(path, GENERIC_READ, FILE_SHARE_READ | FILE_SHARE_WRITE, 0);
}

Descriptor open_unused_folder(const std::string& path) {
  Descriptor folder = open_as(path, DELETE | FILE_READ_ATTRIBUTES, share_all, FILE_FLAG_OPEN_REPARSE_POINT);
  BY_HANDLE_FILE_INFORMATION info{};
  if (!folder.valid() || !GetFileInformationByHandle(handle_of(folder.get()), &info)) return Descriptor();
  const bool is_link = (info.dwFileAttributes & FILE_ATTRIBUTE_REPARSE_POINT) != 0;
  return is_link ? Descriptor() : std::move(folder);
}

bool make_folder(int around, const std::string& name) {
  return CreateDirectoryW(path_in(around, name).c_str(), nullptr) || failed();
}

void remove_folder(int around, const std::string& name) {
  RemoveDirectoryW(path_in(around, name).c_str());
}

Descriptor make_file(int folder, const std::string& name) {
  const HANDLE file = CreateFileW(path_in(folder, name).c_str(), GENERIC_WRITE, share_all, nullptr,
                                  CREATE_NEW, FILE_ATTRIBUTE_NORMAL, nullptr);
  if (file == INVALID_HANDLE_VALUE) return failed(), Descriptor();
  return Descriptor(
      ::_open_osfhandle(reinterpret_cast<intptr_t>(file), _O_WRONLY | _O_BINARY | _O_NOINHERIT));
}

void remove_file(int folder, const std::string& name) {
  DeleteFileW(path_in(folder, name).c_str());
}

void sync_folder(int) {}

// A folder that is open cannot be renamed.
bool rename_folder(const std::string& from, const std::string& to, Descriptor& open) {
  open = Descriptor();
  return MoveFileExW(wide(from).c_str(), wide(to).c_str(), MOVEFILE_WRITE_THROUGH) || failed();
}

}  // namespace maille
