#include "system.h"

#define WIN32_LEAN_AND_MEAN
#include <windows.h>

#include <fcntl.h>
#include <io.h>
#include <maille/source.h>
#include <shellapi.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <cwchar>
#include <string>
#include <vector>

namespace maille::tool {
namespace {

std::wstring wide(const std::string& utf8) {
  const int bytes = static_cast<int>(utf8.size());
  std::wstring text(utf8.size(), L'\0');
  const int size = MultiByteToWideChar(CP_UTF8, 0, utf8.data(), bytes, text.data(), bytes);
  text.resize(static_cast<size_t>(size));
  return text;
}

std::string utf8_of(const wchar_t* text) {
  const int size = static_cast<int>(std::wcslen(text));
  std::string utf8(3 * static_cast<size_t>(size), '\0');  // a unit of UTF-16 has at most three bytes in UTF-8
  const int bytes = WideCharToMultiByte(CP_UTF8, 0, text, size, utf8.data(), 3 * size, nullptr, nullptr);
  utf8.resize(static_cast<size_t>(bytes));
  return utf8;
}

UINT code_page_before = 0;

/// The console's code page stays when this process ends, so it is put back.
void write_utf8_to_console() {
  code_page_before = GetConsoleOutputCP();
  if (code_page_before != 0 && SetConsoleOutputCP(CP_UTF8))
    std::atexit([] { SetConsoleOutputCP(code_page_before); });
}

/// An open file without access to its contents, for questions about it; closed at the end.
class OpenFile {
 public:
  explicit OpenFile(const std::string& path)
      : handle_(CreateFileW(wide(path).c_str(), 0, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE,
                            nullptr, OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS, nullptr)) {}
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  ~OpenFile() {
    if (handle_ != INVALID_HANDLE_VALUE) CloseHandle(handle_);
  }
  bool ask(BY_HANDLE_FILE_INFORMATION& info) const {
    return handle_ != INVALID_HANDLE_VALUE && GetFileType(handle_) == FILE_TYPE_DISK &&
           GetFileInformationByHandle(handle_, &info);
  }

 private:
  HANDLE handle_;
};

}  // namespace

// main() has them in the code page of the machine, which has no place for most characters.
char** utf8_arguments(int& count, char** arguments) {
  for (FILE* const stream : {stdin, stdout, stderr}) ::_setmode(::_fileno(stream), _O_BINARY);
  write_utf8_to_console();
  LPWSTR* const given = CommandLineToArgvW(GetCommandLineW(), &count);
  if (given == nullptr) return arguments;
  static std::vector<std::string> texts;
  for (int i = 0; i < count; ++i) texts.push_back(utf8_of(given[i]));
  LocalFree(given);
  static std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  return pointers.data();
}

// Windows removes unfinished files with the process (src/base/windows), and writing to a closed pipe is an
// error anyway.
void install_signal_handlers() {}

// The C library of Windows calls ERROR_NO_DATA, which is what a pipe then gives, an invalid argument.
bool is_of_closed_pipe(const std::string& message) {
  return message.ends_with(std::strerror(EPIPE)) || message.ends_with(std::strerror(EINVAL));
}

// Two open handles, so that neither file's number is given to another one in between.
bool is_same_file(const std::string& a, const std::string& b) {
  const OpenFile first_file(a), second_file(b);
  BY_HANDLE_FILE_INFORMATION first{}, second{};
  return first_file.ask(first) && second_file.ask(second) &&
         first.dwVolumeSerialNumber == second.dwVolumeSerialNumber &&
         first.nFileIndexHigh == second.nFileIndexHigh && first.nFileIndexLow == second.nFileIndexLow;
}

Result<std::string> make_empty_file(const std::string& prefix, const std::string& suffix) {
  for (unsigned count = 0; count < 1000; ++count) {
    const std::string path =
        prefix + std::to_string(GetCurrentProcessId()) + "-" + std::to_string(count) + suffix;
    const HANDLE file = CreateFileW(wide(path).c_str(), GENERIC_WRITE, 0, nullptr, CREATE_NEW,
                                    FILE_ATTRIBUTE_NORMAL, nullptr);
    if (file == INVALID_HANDLE_VALUE && GetLastError() == ERROR_FILE_EXISTS) continue;
    if (file == INVALID_HANDLE_VALUE) break;
    CloseHandle(file);
    return path;
  }
  return failure(ErrorCode::write_failed, prefix + suffix + ": this file cannot be made");
}

// Memory of large tables goes back to Windows at once anyway.
void keep_memory_small() {}

Result<int> become_full_program() {
  return failure(ErrorCode::unsupported,
                 "the verbs bench, serve and view are not in this maille, which was built for Windows");
}

}  // namespace maille::tool
