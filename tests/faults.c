/* Loaded before the C library (LD_PRELOAD), lets one call of a program fail.
 *
 * Calls that open, look at, read, write, sync, cut, lock, map, rename or remove what is below the folder
 * FAULTS_BELOW are counted and written to the file FAULTS_LOG, a line each: the name of the call and the
 * path. The call of number FAULTS_AT fails: with FAULTS_HOW=once it alone, with `on` every one from it
 * on, with `kill` the process ends there. With `short` none fails, but each reads or writes a part only.
 * With `memory` allocations of FAULTS_BYTES and more are counted instead. */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

static enum { NOT_READ, ONCE, ON, KILL, SHORT, MEMORY, OFF } how;
static const char *below;
static long at, least;
static int log_file = -1;
static atomic_long count;

__attribute__((constructor)) static void begin(void) {
    static const char *names[] = {"", "once", "on", "kill", "short", "memory"};
    const char *wanted = getenv("FAULTS_HOW"), *path = getenv("FAULTS_LOG");
    below = getenv("FAULTS_BELOW");
    int found = OFF;
    for (int k = ONCE; below && wanted && path && k < OFF; k++) {
        if (!strcmp(names[k], wanted)) {
            found = k;
        }
    }
    if (found != OFF) {
        at = atol(getenv("FAULTS_AT") ? getenv("FAULTS_AT") : "0");
        least = atol(getenv("FAULTS_BYTES") ? getenv("FAULTS_BYTES") : "65536");
        log_file = syscall(SYS_openat, AT_FDCWD, path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
    }
    how = found;
}

/* Counts a call; whether it fails, with this error. */
static int counted(const char *call, const char *path, int error) {
    char line[2 * PATH_MAX + 32];
    long number = ++count;
    int length = snprintf(line, sizeof line, "%s %s\n", call, path);
    syscall(SYS_write, log_file, line, length);
    if (how == SHORT || at == 0 || number < at || (how != ON && number > at)) {
        return 0;
    }
    if (how == KILL) {
        syscall(SYS_exit_group, 137);
    }
    errno = error;
    return 1;
}

static int fails_at(const char *call, const char *path, int error) {
    char whole[2 * PATH_MAX + 2];
    if (how == NOT_READ || how >= MEMORY || !path) {
        return 0;
    }
    if (path[0] != '/') {
        char folder[PATH_MAX];
        if (syscall(SYS_getcwd, folder, sizeof folder) < 0) {
            return 0;
        }
        snprintf(whole, sizeof whole, "%s/%s", folder, path);
        path = whole;
    }
    size_t length = strlen(below);
    return !strncmp(path, below, length) && path[length] == '/' &&
           counted(call, path + length + 1, error);
}

static int fails_of(const char *call, int file, int error) {
    char link[32], path[PATH_MAX];
    if (how == NOT_READ || how >= MEMORY) {
        return 0;
    }
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    long length = syscall(SYS_readlink, link, path, sizeof path - 1);
    path[length < 0 ? 0 : length] = 0;
    /* A pipe has no path. */
    return path[0] == '/' && fails_at(call, path, error);
}

/* How much of so much is read or written at once. */
static size_t part(size_t bytes) {
    return how == SHORT && bytes > 1 ? (bytes + 1) / 2 : bytes;
}

#define REAL(type, name) ((type)dlsym(RTLD_NEXT, name))

/* A call on a path or on a file: its return type, name, parameters and arguments, what of them says
 * which file it is, and the error. */
#define ON_PATH(type, name, parameters, arguments, path, error)                                    \
    type name parameters {                                                                         \
        if (fails_at(#name, path, error)) {                                                        \
            return (type)-1;                                                                       \
        }                                                                                          \
        static type(*real) parameters;                                                             \
        real = real ? real : REAL(type(*) parameters, #name);                                      \
        return real arguments;                                                                     \
    }
#define ON_FILE(type, name, parameters, arguments, file, error)                                    \
    type name parameters {                                                                         \
        if (fails_of(#name, file, error)) {                                                        \
            return (type)-1;                                                                       \
        }                                                                                          \
        static type(*real) parameters;                                                             \
        real = real ? real : REAL(type(*) parameters, #name);                                      \
        return real arguments;                                                                     \
    }

ON_FILE(ssize_t, read, (int f, void *to, size_t n), (f, to, part(n)), f, EIO)
ON_FILE(ssize_t, pread, (int f, void *to, size_t n, off_t o), (f, to, part(n), o), f, EIO)
ON_FILE(ssize_t, pread64, (int f, void *to, size_t n, off64_t o), (f, to, part(n), o), f, EIO)
ON_FILE(ssize_t, readv, (int f, const struct iovec *v, int n), (f, v, n), f, EIO)
ON_FILE(ssize_t, write, (int f, const void *from, size_t n), (f, from, part(n)), f, ENOSPC)
ON_FILE(ssize_t, pwrite, (int f, const void *b, size_t n, off_t o), (f, b, part(n), o), f, ENOSPC)
ON_FILE(ssize_t, pwrite64, (int f, const void *b, size_t n, off64_t o), (f, b, part(n), o), f, ENOSPC)
ON_FILE(ssize_t, writev, (int f, const struct iovec *v, int n), (f, v, n), f, ENOSPC)
ON_FILE(int, fsync, (int f), (f), f, EIO)
ON_FILE(int, fdatasync, (int f), (f), f, EIO)
ON_FILE(int, ftruncate, (int f, off_t n), (f, n), f, ENOSPC)
ON_FILE(int, ftruncate64, (int f, off64_t n), (f, n), f, ENOSPC)
ON_FILE(int, flock, (int f, int operation), (f, operation), f, ENOLCK)
ON_FILE(int, fchmod, (int f, mode_t mode), (f, mode), f, EIO)
ON_FILE(off64_t, lseek64, (int f, off64_t o, int whence), (f, o, whence), f, EIO)
ON_FILE(ssize_t, copy_file_range, (int f, off64_t *a, int g, off64_t *b, size_t n, unsigned flags),
        (f, a, g, b, part(n), flags), g, ENOSPC)
ON_PATH(int, rename, (const char *from, const char *to), (from, to), to, EIO)
ON_PATH(int, unlink, (const char *path), (path), path, EIO)
ON_PATH(int, mkdir, (const char *path, mode_t mode), (path, mode), path, ENOSPC)

char *realpath(const char *restrict path, char *restrict to) {
    typedef char *(*real_t)(const char *, char *);
    return fails_at("realpath", path, EIO) ? NULL : REAL(real_t, "realpath")(path, to);
}

/* Of an empty path it looks at the file. Without one it is asked whether it is there. */
int statx(int f, const char *restrict path, int flags, unsigned mask, struct statx *restrict to) {
    const char *volatile asked = path;
    int fails = asked && (*path ? fails_at("statx", path, EIO) : fails_of("statx", f, EIO));
    return fails ? -1 : syscall(SYS_statx, f, path, flags, mask, to);
}

static int opened(const char *path, int flags, va_list more) {
    int mode = flags & (O_CREAT | __O_TMPFILE) ? va_arg(more, int) : 0;
    if (fails_at("open", path, flags & O_CREAT ? ENOSPC : EIO)) {
        return -1;
    }
    return syscall(SYS_openat, AT_FDCWD, path, flags, mode);
}

int open(const char *path, int flags, ...) {
    va_list more;
    va_start(more, flags);
    int file = opened(path, flags, more);
    va_end(more);
    return file;
}

int open64(const char *path, int flags, ...) {
    va_list more;
    va_start(more, flags);
    int file = opened(path, flags | O_LARGEFILE, more);
    va_end(more);
    return file;
}

DIR *opendir(const char *path) {
    return fails_at("opendir", path, EIO) ? NULL : REAL(DIR *(*)(const char *), "opendir")(path);
}

struct dirent64 *readdir64(DIR *folder) {
    int fails = fails_of("readdir", dirfd(folder), EIO);
    return fails ? NULL : REAL(struct dirent64 *(*)(DIR *), "readdir64")(folder);
}

static void *mapped(void *to, size_t n, int allowed, int flags, int f, off_t o) {
    if (f >= 0 && fails_of("mmap", f, ENOMEM)) {
        return MAP_FAILED;
    }
    return (void *)syscall(SYS_mmap, to, n, allowed, flags, f, o);
}

void *mmap(void *to, size_t n, int allowed, int flags, int f, off_t o) {
    return mapped(to, n, allowed, flags, f, o);
}

void *mmap64(void *to, size_t n, int allowed, int flags, int f, off64_t o) {
    return mapped(to, n, allowed, flags, f, o);
}

/* The C library's own, since looking these up allocates. */
void *__libc_malloc(size_t bytes);
void *__libc_calloc(size_t number, size_t bytes);
void *__libc_realloc(void *old, size_t bytes);

static int is_out_of_memory(size_t bytes) {
    char text[32];
    if (how != MEMORY || bytes < (size_t)least) {
        return 0;
    }
    snprintf(text, sizeof text, "%zu", bytes);
    return counted("allocate", text, ENOMEM);
}

void *malloc(size_t bytes) {
    return is_out_of_memory(bytes) ? NULL : __libc_malloc(bytes);
}

void *calloc(size_t number, size_t bytes) {
    return is_out_of_memory(number * bytes) ? NULL : __libc_calloc(number, bytes);
}

void *realloc(void *old, size_t bytes) {
    return is_out_of_memory(bytes) ? NULL : __libc_realloc(old, bytes);
}
