/* A disk that fails, for tests: preloaded (LD_PRELOAD) into a program, it lets calls on files whose
 * path contains SGIMP_FAULT_PATH fail, in every process by itself:
 *
 *   SGIMP_FAULT_BYTES=n     bytes that still fit; beyond them writes end short, then ENOSPC
 *   SGIMP_FAULT_SYNC=n      the n-th fsync and all after it return EIO
 *   SGIMP_FAULT_OPEN=1      opening for writing returns EACCES
 *
 * Bytes are those written, not those that files hold: replacing a file gives none back. All other
 * files, sockets and pipes are left alone. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

/* The function of the C library behind the one of this name here. */
#define NEXT(name) dlsym(RTLD_NEXT, name)

static long long written, syncs;

static int matches(const char *path)
{
  const char *wanted = getenv("SGIMP_FAULT_PATH");
  return wanted != NULL && strstr(path, wanted) != NULL;
}

/* Whether the descriptor is a regular file with such a path. */
static int is_faulty(int descriptor)
{
  char link[64], path[PATH_MAX];
  struct stat status;
  if (getenv("SGIMP_FAULT_PATH") == NULL || fstat(descriptor, &status) != 0
      || !S_ISREG(status.st_mode))
    return 0;
  snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
  ssize_t length = readlink(link, path, sizeof path - 1);
  if (length < 0)
    return 0;
  path[length] = '\0';
  return matches(path);
}

/* How many of `length` bytes still fit; -1 with errno set if none does. */
static ssize_t room_for(int descriptor, size_t length)
{
  const char *limit = getenv("SGIMP_FAULT_BYTES");
  if (limit == NULL || length == 0 || !is_faulty(descriptor))
    return (ssize_t)length;
  long long left = atoll(limit) - written;
  if (left <= 0) {
    errno = ENOSPC;
    return -1;
  }
  if ((long long)length > left)
    length = (size_t)left;
  written += (long long)length;
  return (ssize_t)length;
}

ssize_t write(int descriptor, const void *bytes, size_t length)
{
  ssize_t (*next)(int, const void *, size_t) = NEXT("write");
  ssize_t room = room_for(descriptor, length);
  return room < 0 ? -1 : next(descriptor, bytes, (size_t)room);
}

ssize_t pwrite(int descriptor, const void *bytes, size_t length, off_t offset)
{
  ssize_t (*next)(int, const void *, size_t, off_t) = NEXT("pwrite");
  ssize_t room = room_for(descriptor, length);
  return room < 0 ? -1 : next(descriptor, bytes, (size_t)room, offset);
}

ssize_t pwrite64(int descriptor, const void *bytes, size_t length, off64_t offset)
{
  ssize_t (*next)(int, const void *, size_t, off64_t) = NEXT("pwrite64");
  ssize_t room = room_for(descriptor, length);
  return room < 0 ? -1 : next(descriptor, bytes, (size_t)room, offset);
}

/* A short write of the first part is allowed. */
ssize_t writev(int descriptor, const struct iovec *parts, int count)
{
  ssize_t (*next)(int, const struct iovec *, int) = NEXT("writev");
  if (count > 0 && is_faulty(descriptor))
    return write(descriptor, parts[0].iov_base, parts[0].iov_len);
  return next(descriptor, parts, count);
}

/* A file that grows needs room as well. */
static int may_grow(int descriptor, long long length)
{
  struct stat status;
  if (fstat(descriptor, &status) != 0 || length <= status.st_size)
    return 1;
  return room_for(descriptor, (size_t)(length - status.st_size)) == length - status.st_size;
}

int ftruncate(int descriptor, off_t length)
{
  int (*next)(int, off_t) = NEXT("ftruncate");
  if (may_grow(descriptor, length))
    return next(descriptor, length);
  errno = ENOSPC;
  return -1;
}

int ftruncate64(int descriptor, off64_t length)
{
  int (*next)(int, off64_t) = NEXT("ftruncate64");
  if (may_grow(descriptor, length))
    return next(descriptor, length);
  errno = ENOSPC;
  return -1;
}

int fsync(int descriptor)
{
  int (*next)(int) = NEXT("fsync");
  const char *first = getenv("SGIMP_FAULT_SYNC");
  if (first != NULL && is_faulty(descriptor) && ++syncs >= atoll(first)) {
    errno = EIO;
    return -1;
  }
  return next(descriptor);
}

static int may_open(const char *path, int flags)
{
  if ((flags & O_ACCMODE) == O_RDONLY || getenv("SGIMP_FAULT_OPEN") == NULL || !matches(path))
    return 1;
  errno = EACCES;
  return 0;
}

/* The mode is there only with flags that make files, but reading it does no harm here. */
#define MODE_OF(flags) \
  va_list rest; va_start(rest, flags); mode_t mode = va_arg(rest, mode_t); va_end(rest)

int open(const char *path, int flags, ...)
{
  int (*next)(const char *, int, ...) = NEXT("open");
  MODE_OF(flags);
  return may_open(path, flags) ? next(path, flags, mode) : -1;
}

int open64(const char *path, int flags, ...)
{
  int (*next)(const char *, int, ...) = NEXT("open64");
  MODE_OF(flags);
  return may_open(path, flags) ? next(path, flags, mode) : -1;
}
