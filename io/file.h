/* Whole files: read with a bound, written under a temporary name and renamed. */
#ifndef IO_FILE_H
#define IO_FILE_H

#include "libdipole/dipole.h"

#ifdef __cplusplus
extern "C" {
#endif

/*
 * Read a whole file of at most limit_bytes. *data_out is NUL-terminated beyond *size_out, the caller
 * frees it. Fails with DIPOLE_NOT_FOUND, DIPOLE_IO_FAILED, DIPOLE_BAD_VALUE (too large) or
 * DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool io_file_read(const char *path, size_t limit_bytes, char **data_out, size_t *size_out,
                                 dipole_status *status);

/* Write size bytes under a temporary name beside path, fsync, rename. On failure path is as it was and
 * the temporary file is gone; status names path and the system's reason. */
DIPOLE_CHECKED bool io_file_write(const char *path, const void *data, size_t size, dipole_status *status);

/* Looks at a file that is complete but has not got its name yet; false, with *status, refuses it. */
typedef bool io_file_check(void *context, const char *path, dipole_status *status);

/* The same, but the file only gets its name when check (may be NULL) has passed what is on disk. */
DIPOLE_CHECKED bool io_file_write_checked(const char *path, const void *data, size_t size,
                                          io_file_check *check, void *context, dipole_status *status);

/*
 * Remove the temporary files of every io_file_write() under way in this process, which then fails. For the
 * handler of a signal that ends the process: async-signal-safe, changes no errno. cli_start() installs one.
 */
void io_file_remove_temporaries(void);

/* Fails unless path's folder exists and is writable: to refuse before long work, not after. */
DIPOLE_CHECKED bool io_file_check_writable(const char *path, dipole_status *status);

/* Make a folder and its parents; an existing folder is success. */
DIPOLE_CHECKED bool io_folder_make(const char *path, dipole_status *status);

/*
 * Resolve reference, a path found in the file `from`, into out (size bytes): relative to from's folder;
 * symbolic links are followed; the result must lie under that folder or under one of the allowed
 * folders, else DIPOLE_BAD_VALUE naming the reference and the flag --allow-path.
 */
DIPOLE_CHECKED bool io_path_resolve(const dipole_place *from, const char *reference,
                                    const char *const *allowed, size_t allowed_count, char *out,
                                    size_t size, dipole_status *status);

/* Path of a file of the bundled data (materials, shaders): under ../share/libdipole beside the folder of
 * the running program. Fails with DIPOLE_NOT_FOUND. */
DIPOLE_CHECKED bool io_data_path(const char *relative, char *out, size_t size, dipole_status *status);

#ifdef __cplusplus
}
#endif
#endif
