#include "base/system.h"

#include <fcntl.h>

#include <algorithm>
#include <utility>

#include "base/unfinished.h"
#include "base/windows/calls.h"

namespace maille {
namespace {

// The calls below take 32 bits of size.
constexpr size_t most_at_once = size_t{1} << 30;

FileStatus status_of_handle(HANDLE file) {
  using Kind = FileStatus::Kind;
  BY_HANDLE_FILE_INFORMATION info{};
  if (GetFileType(file) != FILE_TYPE_DISK) return {Kind::other};
  if (!GetFileInformationByHandle(file, &info)) return failed(), FileStatus();
  const bool is_folder = (info.dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY) != 0;
  return {is_folder ? Kind::folder : Kind::regular, 0,
          uint64_t{info.nFileSizeHigh} << 32 | info.nFileSizeLow};
}

OVERLAPPED at(uint64_t offset) {
  OVERLAPPED place{};
  place.Offset = static_cast<DWORD>(offset);
  place.OffsetHigh = static_cast<DWORD>(offset >> 32);
  return place;
}

}  // namespace

std::wstring wide(const std::string& path) {
  const int bytes = static_cast<int>(path.size());
  std::wstring result(path.size(), L'\0');
  const int size = MultiByteToWideChar(CP_UTF8, 0, path.data(), bytes, result.data(), bytes);
  result.resize(static_cast<size_t>(size));
  return result;
}

std::wstring real_path(int fd) {
  std::wstring path(32768, L'\0');  // the longest there can be
  path.resize(GetFinalPathNameByHandleW(handle_of(fd), path.data(), static_cast<DWORD>(path.size()), 0));
  return path;
}

bool failed() {
  const DWORD error = GetLastError();
  constexpr std::pair<DWORD, int> reasons[] = {
      {ERROR_FILE_NOT_FOUND, ENOENT},      {ERROR_PATH_NOT_FOUND, ENOENT}, {ERROR_INVALID_NAME, ENOENT},
      {ERROR_ACCESS_DENIED, EACCES},       {ERROR_WRITE_PROTECT, EROFS},   {ERROR_SHARING_VIOLATION, EBUSY},
      {ERROR_LOCK_VIOLATION, EBUSY},       {ERROR_FILE_EXISTS, EEXIST},    {ERROR_ALREADY_EXISTS, EEXIST},
      {ERROR_TOO_MANY_OPEN_FILES, EMFILE}, {ERROR_DISK_FULL, ENOSPC},      {ERROR_BROKEN_PIPE, EPIPE}};
  const auto* const reason = std::find_if(std::begin(reasons), std::end(reasons),
                                          [&](const auto& known) { return known.first == error; });
  errno = reason == std::end(reasons) ? EIO : reason->second;
  return false;
}

int create_file(const std::string& path, DWORD access, DWORD creation, DWORD flags, int descriptor_flags) {
  // Others may read, rename and remove a file that is open, as elsewhere.
  const HANDLE file =
      CreateFileW(wide(path).c_str(), access, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, nullptr,
                  creation, flags, nullptr);
  if (file == INVALID_HANDLE_VALUE) return failed(), -1;
  return ::_open_osfhandle(reinterpret_cast<intptr_t>(file), descriptor_flags | _O_BINARY | _O_NOINHERIT);
}

Descriptor open_to_read(const std::string& path) {
  return Descriptor(create_file(path, GENERIC_READ, OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL, _O_RDONLY));
}

Descriptor open_to_write(const std::string& path) {
  return Descriptor(create_file(path, GENERIC_WRITE, OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL, _O_WRONLY));
}

// The file that was opened is asked where it lies, so nobody can put a link into its way meanwhile.
Descriptor open_within(const std::string& folder, const std::string& name) {
  const Descriptor root(create_file(folder, 0, OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS, _O_RDONLY));
  if (!root.valid()) return Descriptor();
  Descriptor file = open_to_read(folder + "/" + name);
  if (!file.valid() || real_path(file.get()).starts_with(real_path(root.get()) + L"\\")) return file;
  errno = EXDEV;
  return Descriptor();
}

Descriptor open_nameless(const std::string& folder) {
  return Descriptor(create_file(folder + "/" + temporary_name("maille"),
                                GENERIC_READ | GENERIC_WRITE | DELETE, CREATE_NEW,
                                FILE_ATTRIBUTE_TEMPORARY | FILE_FLAG_DELETE_ON_CLOSE, _O_RDWR));
}

std::string temporary_folder() {
  wchar_t path[MAX_PATH + 1];
  const int size = static_cast<int>(GetTempPathW(MAX_PATH + 1, path));
  std::string result(3 * size_t{MAX_PATH}, '\0');  // a unit of UTF-16 has at most three bytes in UTF-8
  const int bytes =
      WideCharToMultiByte(CP_UTF8, 0, path, size, result.data(), 3 * MAX_PATH, nullptr, nullptr);
  result.resize(static_cast<size_t>(bytes));
  return result;
}

FileStatus status_of(const std::string& path) {
  const Descriptor file(create_file(path, 0, OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS, _O_RDONLY));
  return file.valid() ? status_of(file.get()) : FileStatus();
}

FileStatus status_of(int fd) {
  return status_of_handle(handle_of(fd));
}

bool is_writable(const std::string& path) {
  return ::_waccess(wide(path).c_str(), W_OK) == 0;
}

// Standard input and output have lines with "\r\n" unless one says otherwise; other files are opened as they
// are.
ptrdiff_t read_some(int fd, std::span<std::byte> out) {
  ::_setmode(fd, _O_BINARY);
  return ::_read(fd, out.data(), static_cast<unsigned>(std::min(out.size(), most_at_once)));
}

ptrdiff_t read_from(int fd, uint64_t offset, std::span<std::byte> out) {
  size_t done = 0;
  while (done < out.size()) {
    OVERLAPPED place = at(offset + done);
    DWORD count = 0;
    const auto size = static_cast<DWORD>(std::min(out.size() - done, most_at_once));
    if (!ReadFile(handle_of(fd), out.data() + done, size, &count, &place) &&
        GetLastError() != ERROR_HANDLE_EOF)
      return failed(), -1;
    if (count == 0) break;
    done += count;
  }
  return static_cast<ptrdiff_t>(done);
}

bool write_all(int fd, Bytes bytes) {
  ::_setmode(fd, _O_BINARY);
  while (!bytes.empty()) {
    const int count = ::_write(fd, bytes.data(), static_cast<unsigned>(std::min(bytes.size(), most_at_once)));
    if (count <= 0) return false;
    bytes = bytes.subspan(static_cast<size_t>(count));
  }
  return true;
}

bool write_to(int fd, uint64_t offset, Bytes bytes) {
  while (!bytes.empty()) {
    OVERLAPPED place = at(offset);
    DWORD count = 0;
    const auto size = static_cast<DWORD>(std::min(bytes.size(), most_at_once));
    if (!WriteFile(handle_of(fd), bytes.data(), size, &count, &place)) return failed();
    offset += count;
    bytes = bytes.subspan(count);
  }
  return true;
}

bool sync(int fd) {
  return FlushFileBuffers(handle_of(fd)) || failed();
}

bool cut_to(int fd, uint64_t size) {
  const auto end = static_cast<int64_t>(size);
  return ::_chsize_s(fd, end) == 0 && ::_lseeki64(fd, end, SEEK_SET) == end;
}

// Nobody else could read a byte that is locked, hence one behind the end of every file.
bool lock(int fd) {
  OVERLAPPED place = at(UINT64_MAX >> 1);
  return LockFileEx(handle_of(fd), LOCKFILE_EXCLUSIVE_LOCK | LOCKFILE_FAIL_IMMEDIATELY, 0, 1, 0, &place) ||
         failed();
}

PathParts split_path(const std::string& path) {
  const size_t slash = path.find_last_of("/\\");
  if (slash == std::string::npos) return {".", path};
  const bool is_root = slash == 0 || path[slash - 1] == ':';  // "C:" is not "C:/"
  return {path.substr(0, is_root ? slash + 1 : slash), path.substr(slash + 1)};
}

uint64_t memory_of_machine() {
  MEMORYSTATUSEX status{};
  status.dwLength = sizeof status;
  return GlobalMemoryStatusEx(&status) ? status.ullTotalPhys : 0;
}

// Nothing to remove: what is unfinished, Windows removes with the process (windows/pending_file.cpp).
UnfinishedRegistration::UnfinishedRegistration(int, const std::string&) {}
UnfinishedRegistration::~UnfinishedRegistration() = default;
void remove_unfinished_files() noexcept {}

}  // namespace maille
