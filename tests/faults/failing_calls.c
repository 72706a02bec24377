// For LD_PRELOAD: the N-th call to the system fails, is cut short, or is the last thing that the process does; or all
// that is done to files is written to a log. scripts/check-faults says what for. Calls on standard error are not
// touched, so that the program can say what happened.
//   FAULT       eio, enospc, eintr (once), short (once), kill; nothing: no fault
//   FAULT_AT    which of the calls that this can happen to, from 1 on
//   FAULT_LAST  until which call (default FAULT_AT)
//   FAULT_COUNT a file for the number of such calls
//   FAULT_LOG   a file for what is done to files, a record for each call:
//               "write FD INODE OFFSET SIZE\n" and the bytes, "sync INODE\n", "cut INODE SIZE\n", "link INODE PATH\n",
//               "rename FROM TO\n", "remove PATH\n", "syncfolder PATH\n", "create INODE PATH\n"
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

enum Call { opening, making, reading, writing, syncing, naming, closing, mapping };
enum { none, eio, enospc, eintr, cut_short, dies };

static int fault, log_file = -1;
static long first, last, calls;

__attribute__((constructor)) static void set_up(void) {
  const char* const name = getenv("FAULT");
  static const char* const names[] = {"", "eio", "enospc", "eintr", "short", "kill"};
  for (int i = 1; name != NULL && i < 6; ++i)
    if (strcmp(name, names[i]) == 0) fault = i;
  if (getenv("FAULT_AT") != NULL) first = last = atol(getenv("FAULT_AT"));
  if (getenv("FAULT_LAST") != NULL) last = atol(getenv("FAULT_LAST"));
  if (getenv("FAULT_LOG") != NULL)
    log_file = (int)syscall(SYS_openat, AT_FDCWD, getenv("FAULT_LOG"), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
}

__attribute__((destructor)) static void tell(void) {
  const char* const path = getenv("FAULT_COUNT");
  if (path == NULL) return;
  char text[32];
  const int size = snprintf(text, sizeof text, "%ld\n", calls);
  const int file = (int)syscall(SYS_openat, AT_FDCWD, path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (syscall(SYS_write, file, text, size) < 0) abort();
  syscall(SYS_close, file);
}

static int applies(enum Call call) {
  switch (fault) {
    case enospc: return call == making || call == writing || call == syncing || call == naming;
    case eintr: return call == opening || call == making || call == reading || call == writing;
    case cut_short: return call == reading || call == writing;
    default: return 1;
  }
}

// Does the fault strike this call?
static int strikes(enum Call call, int fd) {
  if (fd == STDERR_FILENO || !applies(call)) return 0;
  const long number = __sync_add_and_fetch(&calls, 1);
  if (fault == none || number < first || number > last) return 0;
  if (fault == dies) kill(getpid(), SIGKILL);
  errno = fault == enospc ? ENOSPC : fault == eintr ? EINTR : EIO;
  return 1;
}

static unsigned long inode(int fd) {
  struct stat info;
  return fstat(fd, &info) == 0 && S_ISREG(info.st_mode) ? (unsigned long)info.st_ino : 0;
}

static void note(const char* format, ...) {
  if (log_file < 0) return;
  char line[9000];
  va_list arguments;
  va_start(arguments, format);
  const int size = vsnprintf(line, sizeof line, format, arguments);
  va_end(arguments);
  if (syscall(SYS_write, log_file, line, size) != size) abort();
}

static void note_bytes(int fd, off_t offset, const void* bytes, size_t size) {
  if (log_file < 0 || inode(fd) == 0) return;
  note("write %d %lu %lld %zu\n", fd, inode(fd), (long long)offset, size);
  if (syscall(SYS_write, log_file, bytes, size) != (long)size) abort();
}

#define REAL(name) \
  static __typeof__(&name) real; \
  if (real == NULL) real = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

#define MODE_OF(flags)                                \
  mode_t mode = 0;                                    \
  if (((flags) & (O_CREAT | __O_TMPFILE)) != 0) {     \
    va_list arguments;                                \
    va_start(arguments, flags);                       \
    mode = va_arg(arguments, mode_t);                 \
    va_end(arguments);                                \
  }

static int opened(int fd, const char* path, int flags) {
  if (fd >= 0 && (flags & O_CREAT) != 0 && log_file >= 0) note("create %lu %s\n", inode(fd), path);
  return fd;
}
static enum Call kind_of(int flags) { return (flags & (O_CREAT | __O_TMPFILE)) != 0 ? making : opening; }

int open(const char* path, int flags, ...) {
  REAL(open);
  MODE_OF(flags)
  if (strikes(kind_of(flags), -1)) return -1;
  return opened(real(path, flags, mode), path, flags);
}
int open64(const char* path, int flags, ...) {
  REAL(open64);
  MODE_OF(flags)
  if (strikes(kind_of(flags), -1)) return -1;
  return opened(real(path, flags, mode), path, flags);
}
int openat(int folder, const char* path, int flags, ...) {
  REAL(openat);
  MODE_OF(flags)
  if (strikes(kind_of(flags), -1)) return -1;
  return opened(real(folder, path, flags, mode), path, flags);
}

static size_t part(size_t size) { return fault == cut_short && size > 1 ? size / 2 : size; }

ssize_t read(int fd, void* out, size_t size) {
  REAL(read);
  if (strikes(reading, fd)) return fault == cut_short ? real(fd, out, part(size)) : -1;
  return real(fd, out, size);
}
ssize_t pread(int fd, void* out, size_t size, off_t offset) {
  REAL(pread);
  if (strikes(reading, fd)) return fault == cut_short ? real(fd, out, part(size), offset) : -1;
  return real(fd, out, size, offset);
}
ssize_t pread64(int fd, void* out, size_t size, off64_t offset) { return pread(fd, out, size, offset); }

ssize_t write(int fd, const void* bytes, size_t size) {
  REAL(write);
  const int struck = strikes(writing, fd);
  if (struck && fault != cut_short) return -1;
  const off_t offset = lseek(fd, 0, SEEK_CUR);
  const ssize_t done = real(fd, bytes, struck ? part(size) : size);
  if (done > 0) note_bytes(fd, offset, bytes, (size_t)done);
  return done;
}
ssize_t pwrite(int fd, const void* bytes, size_t size, off_t offset) {
  REAL(pwrite);
  const int struck = strikes(writing, fd);
  if (struck && fault != cut_short) return -1;
  const ssize_t done = real(fd, bytes, struck ? part(size) : size, offset);
  if (done > 0) note_bytes(fd, offset, bytes, (size_t)done);
  return done;
}
ssize_t pwrite64(int fd, const void* bytes, size_t size, off64_t offset) { return pwrite(fd, bytes, size, offset); }

static void note_sync(int fd) {
  if (log_file < 0) return;
  if (inode(fd) != 0) return note("sync %lu\n", inode(fd));
  char link[64], path[4096] = "";
  snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  if (readlink(link, path, sizeof path - 1) > 0) note("syncfolder %s\n", path);
}
int fsync(int fd) {
  REAL(fsync);
  if (strikes(syncing, fd)) return -1;
  const int result = real(fd);
  if (result == 0) note_sync(fd);
  return result;
}
int fdatasync(int fd) {
  REAL(fdatasync);
  if (strikes(syncing, fd)) return -1;
  const int result = real(fd);
  if (result == 0) note_sync(fd);
  return result;
}
int ftruncate(int fd, off_t size) {
  REAL(ftruncate);
  if (strikes(writing, fd)) {
    if (fault != cut_short) return -1;
  }
  const int result = real(fd, size);
  if (result == 0 && log_file >= 0 && inode(fd) != 0) note("cut %lu %lld\n", inode(fd), (long long)size);
  return result;
}
int ftruncate64(int fd, off64_t size) { return ftruncate(fd, size); }

int rename(const char* from, const char* to) {
  REAL(rename);
  if (strikes(naming, -1)) return -1;
  const int result = real(from, to);
  if (result == 0) note("rename %s\t%s\n", from, to);
  return result;
}
int renameat(int from_folder, const char* from, int to_folder, const char* to) {
  REAL(renameat);
  if (strikes(naming, -1)) return -1;
  const int result = real(from_folder, from, to_folder, to);
  if (result == 0) note("rename %s\t%s\n", from, to);
  return result;
}
int linkat(int from_folder, const char* from, int to_folder, const char* to, int flags) {
  REAL(linkat);
  if (strikes(naming, -1)) return -1;
  const int result = real(from_folder, from, to_folder, to, flags);
  struct stat info;
  if (result == 0 && log_file >= 0 && fstatat(to_folder, to, &info, 0) == 0)
    note("link %lu %s\n", (unsigned long)info.st_ino, to);
  return result;
}
int unlinkat(int folder, const char* path, int flags) {
  REAL(unlinkat);
  if (strikes(naming, -1)) return -1;
  const int result = real(folder, path, flags);
  if (result == 0) note("remove %s\n", path);
  return result;
}
int unlink(const char* path) {
  REAL(unlink);
  if (strikes(naming, -1)) return -1;
  const int result = real(path);
  if (result == 0) note("remove %s\n", path);
  return result;
}
int close(int fd) {
  REAL(close);
  // As Linux does it: the descriptor is gone, whatever it says.
  const int struck = strikes(closing, fd);
  const int result = real(fd);
  if (!struck) return result;
  errno = EIO;
  return -1;
}
void* mmap(void* at, size_t size, int protection, int flags, int fd, off_t offset) {
  if (fd >= 0 && strikes(mapping, fd)) return MAP_FAILED;
  return (void*)syscall(SYS_mmap, at, size, protection, flags, fd, offset);
}
