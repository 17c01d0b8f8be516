/* What Fortran cannot say of files and signals. Every function returns 0 (or a value >= 0) for
 * success and -errno for failure, unless said otherwise. */
#define _GNU_SOURCE
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <sched.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* Before anything else: a program built for another processor says so, instead of dying of an
 * illegal instruction. */
#define NEED(feature) if (!__builtin_cpu_supports(feature)) missing = feature
__attribute__((constructor)) static void check_processor(void)
{
  const char *missing = NULL;
#if defined(__x86_64__) || defined(__i386__)
  __builtin_cpu_init();
#endif
#ifdef SGIMP_NEEDS_AVX2
  NEED("avx2");
#endif
#ifdef SGIMP_NEEDS_FMA
  NEED("fma");
#endif
#ifdef SGIMP_NEEDS_AVX512F
  NEED("avx512f");
#endif
#ifdef SGIMP_NEEDS_AVX512DQ
  NEED("avx512dq");
#endif
#ifdef SGIMP_NEEDS_AVX512BW
  NEED("avx512bw");
#endif
#ifdef SGIMP_NEEDS_AVX512VL
  NEED("avx512vl");
#endif
  if (missing == NULL)
    return;
  fprintf(stderr, "sgimp: built for a processor with %s, which this one has not; build it on such "
    "a machine as this, or with -D SGIMP_ARCH=x86-64-v3 (preset portable)\n", missing);
  _exit(1);
}

static volatile sig_atomic_t caught_signal = 0;

static void note_signal(int number) { caught_signal = number; }

/* SIGTERM, SIGUSR1 and SIGINT set a flag and nothing else. */
int sg_catch_signals(void)
{
  const int numbers[] = {SIGTERM, SIGUSR1, SIGINT};
  struct sigaction action;
  memset(&action, 0, sizeof action);
  action.sa_handler = note_signal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; ++i)
    if (sigaction(numbers[i], &action, NULL) != 0)
      return -errno;
  return 0;
}

/* The last signal caught, or 0. */
int sg_caught_signal(void) { return caught_signal; }

static int sync_descriptor(int descriptor)
{
  if (fsync(descriptor) == 0)
    return 0;
  /* Some file systems cannot sync a directory or a pipe. */
  return errno == EINVAL || errno == ENOTSUP ? 0 : -errno;
}

/* Descriptor of a file open for reading and appending, made if absent. */
int sg_open_append(const char *path)
{
  int descriptor = open(path, O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  return descriptor < 0 ? -errno : descriptor;
}

int sg_close(int descriptor) { return close(descriptor) == 0 ? 0 : -errno; }

/* Writes all bytes at the end of the file. */
int sg_append(int descriptor, const char *bytes, int64_t length)
{
  while (length > 0) {
    ssize_t written = write(descriptor, bytes, (size_t)length);
    if (written < 0) {
      if (errno == EINTR)
        continue;
      return -errno;
    }
    bytes += written;
    length -= written;
  }
  return 0;
}

/* Waits until all that was written is on disk. */
int sg_sync(int descriptor) { return sync_descriptor(descriptor); }

int sg_truncate(int descriptor, int64_t length)
{
  return ftruncate(descriptor, (off_t)length) == 0 ? sync_descriptor(descriptor) : -errno;
}

/* 1: locked; 0: another process holds the lock. Ends with the process, however it ends. A file
 * system without locks counts as locked. */
int sg_lock(int descriptor)
{
  if (flock(descriptor, LOCK_EX | LOCK_NB) == 0)
    return 1;
  if (errno == EWOULDBLOCK)
    return 0;
  return errno == ENOLCK || errno == ENOSYS || errno == EOPNOTSUPP || errno == EINVAL ? 1 : -errno;
}

/* Size in bytes, or -errno. */
int64_t sg_file_size(const char *path)
{
  struct stat status;
  return stat(path, &status) == 0 ? (int64_t)status.st_size : -(int64_t)errno;
}

int64_t sg_read(const char *path, char *bytes, int64_t length)
{
  int64_t done = 0;
  int descriptor = open(path, O_RDONLY | O_CLOEXEC);
  if (descriptor < 0)
    return -(int64_t)errno;
  while (done < length) {
    ssize_t got = read(descriptor, bytes + done, (size_t)(length - done));
    if (got < 0 && errno == EINTR)
      continue;
    if (got < 0) {
      done = -(int64_t)errno;
      break;
    }
    if (got == 0)
      break;
    done += got;
  }
  close(descriptor);
  return done;
}

static int sync_parent(const char *path)
{
  char *copy = strdup(path);
  if (copy == NULL)
    return -ENOMEM;
  int descriptor = open(dirname(copy), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  free(copy);
  if (descriptor < 0)
    return -errno;
  int status = sync_descriptor(descriptor);
  close(descriptor);
  return status;
}

/* Makes `from` appear as `to` at once and for good: sync, rename, sync of the directory. */
int sg_replace(const char *from, const char *to)
{
  int descriptor = open(from, O_RDONLY | O_CLOEXEC);
  if (descriptor < 0)
    return -errno;
  int status = sync_descriptor(descriptor);
  close(descriptor);
  if (status != 0)
    return status;
  if (rename(from, to) != 0)
    return -errno;
  return sync_parent(to);
}

/* The directory and those above it; no error if it is there. */
int sg_make_directory(const char *path)
{
  struct stat status;
  char *copy = strdup(path);
  int result = 0;
  if (copy == NULL)
    return -ENOMEM;
  for (char *mark = copy + 1; result == 0; ++mark) {
    int last = *mark == '\0';
    if (!last && *mark != '/')
      continue;
    *mark = '\0';
    if (mkdir(copy, 0777) == 0)
      (void)sync_parent(copy);  /* where that is not allowed, it is left to the system */
    else if (!(stat(copy, &status) == 0 && S_ISDIR(status.st_mode)))
      result = -errno;
    if (last)
      break;
    *mark = '/';
  }
  free(copy);
  return result;
}

/* No error if the file is not there. */
int sg_remove_file(const char *path)
{
  return unlink(path) == 0 || errno == ENOENT ? 0 : -errno;
}

static int ends_with(const char *name, const char *suffix)
{
  size_t length = strlen(name), wanted = strlen(suffix);
  return length >= wanted && strcmp(name + length - wanted, suffix) == 0;
}

/* Removes the files of a directory whose names end in `suffix`. */
int sg_remove_files(const char *directory, const char *suffix)
{
  DIR *stream = opendir(directory);
  struct dirent *entry;
  int result = 0;
  if (stream == NULL)
    return errno == ENOENT ? 0 : -errno;
  while ((entry = readdir(stream)) != NULL)
    if (ends_with(entry->d_name, suffix) && unlinkat(dirfd(stream), entry->d_name, 0) != 0)
      result = -errno;
  closedir(stream);
  return result;
}

/* Text of an error number, of the host name and of the time now, as C strings. */
void sg_error_text(int number, char *text, int capacity)
{
  snprintf(text, (size_t)capacity, "%s", strerror(number));
}

void sg_host_name(char *text, int capacity)
{
  if (gethostname(text, (size_t)capacity) != 0)
    snprintf(text, (size_t)capacity, "unknown");
  text[capacity - 1] = '\0';
}

/* 1: the loops that threads share are compiled with OpenMP. */
int sg_has_threads(void) { return SGIMP_HAS_THREADS; }

/* Cores that this process may run on; 0: nobody says. */
int sg_usable_cores(void)
{
  cpu_set_t set;
  return sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 0;
}

/* A number >= 0 that is the same for the same set of cores. */
int sg_core_set(void)
{
  cpu_set_t set;
  uint32_t hash = 2166136261u;
  if (sched_getaffinity(0, sizeof set, &set) != 0)
    return 0;
  for (int core = 0; core < CPU_SETSIZE; core++)
    if (CPU_ISSET(core, &set))
      hash = (hash ^ (uint32_t)core) * 16777619u;
  return (int)(hash >> 1);
}

void sg_working_directory(char *text, int capacity)
{
  if (getcwd(text, (size_t)capacity) == NULL)
    snprintf(text, (size_t)capacity, ".");
}

void sg_utc_time(char *text, int capacity)
{
  time_t now = time(NULL);
  struct tm parts;
  gmtime_r(&now, &parts);
  if (strftime(text, (size_t)capacity, "%Y-%m-%dT%H:%M:%SZ", &parts) == 0)
    text[0] = '\0';
}

void sg_sleep(double seconds)
{
  struct timespec pause;
  pause.tv_sec = (time_t)seconds;
  pause.tv_nsec = (long)((seconds - (double)pause.tv_sec) * 1e9);
  nanosleep(&pause, NULL);
}

/* CRC-32 (IEEE 802.3, reflected), four bits at a time. */
int32_t sg_crc32(const unsigned char *bytes, int64_t length)
{
  static const uint32_t table[16] = {
    0x00000000u, 0x1db71064u, 0x3b6e20c8u, 0x26d930acu, 0x76dc4190u, 0x6b6b51f4u, 0x4db26158u,
    0x5005713cu, 0xedb88320u, 0xf00f9344u, 0xd6d6a3e8u, 0xcb61b38cu, 0x9b64c2b0u, 0x86d3d2d4u,
    0xa00ae278u, 0xbdbdf21cu};
  uint32_t crc = 0xffffffffu;
  for (int64_t i = 0; i < length; ++i) {
    crc ^= bytes[i];
    crc = (crc >> 4) ^ table[crc & 15u];
    crc = (crc >> 4) ^ table[crc & 15u];
  }
  return (int32_t)(crc ^ 0xffffffffu);
}

/* 64-bit FNV-1a. */
int64_t sg_fnv1a(const unsigned char *bytes, int64_t length)
{
  uint64_t hash = 14695981039346656037u;
  for (int64_t i = 0; i < length; ++i)
    hash = (hash ^ bytes[i]) * 1099511628211u;
  return (int64_t)hash;
}
