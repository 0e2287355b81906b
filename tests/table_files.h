/* What the tests of files of tables share: tables, bits, and what every writer must refuse. */
#ifndef TABLE_FILES_H
#define TABLE_FILES_H

#include "tests/check.h"

#include "io/exr.h"
#include "io/file.h"

#include <dirent.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

typedef bool (*table_writer)(const char *path, const struct io_image *image, int depth, bool is_half,
                             dipole_status *status);

/* Values over all of float's range, infinities and NaN; or, for half, over what a half has. */
static inline struct io_image *random_table(int width_px, int height_px, bool is_half, unsigned seed)
{
    struct io_image *image;
    struct rng rng = { .seed = seed };
    assert_true(io_image_create(width_px, height_px, 3, &image, NULL));
    const size_t count = (size_t)width_px * (size_t)height_px * 3;
    for (size_t i = 0; i < count; i++) {
        const uint32_t bits = (uint32_t)random_bits(&rng);
        if (is_half)
            image->pixels[i] = (float)(bits & 1 ? log_uniform(&rng, 1e-9, 6.5e4) : -uniform(&rng, 0, 1));
        else
            memcpy(&image->pixels[i], &bits, sizeof bits);
    }
    return image;
}

static inline float table_value(const struct io_image *image, int depth, int x, int y, int z, int channel)
{
    const int width = image->width_px / depth;
    return image
        ->pixels[((size_t)y * (size_t)image->width_px + (size_t)(z * width + x)) * 3 + (size_t)channel];
}

static inline uint32_t float_bits(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

/* By arithmetic on doubles: nearest, ties to even, for finite values
 * up to 65504. Independent of io/half.c. */
static inline uint32_t half_bits(float value)
{
    int exponent;
    const double magnitude = fabs((double)value);
    frexp(fmax(magnitude, 0x1p-14), &exponent); /* subnormals keep the step of the smallest normal */
    const double units = nearbyint(ldexp(magnitude, 11 - exponent)); /* of 2^(exponent - 11) */
    /* With the hidden bit in units, 1024 units more are one exponent more. */
    const uint32_t bits = (uint32_t)units + ((uint32_t)(exponent + 13) << 10);
    return bits | (signbit(value) ? 0x8000u : 0u);
}

static inline uint64_t little_endian(const unsigned char *bytes, size_t size)
{
    uint64_t value = 0;
    for (size_t i = 0; i < size; i++)
        value |= (uint64_t)bytes[i] << (8 * i);
    return value;
}

static inline unsigned char *read_bytes(const char *path, size_t *size)
{
    char *data;
    assert_true(io_file_read(path, (size_t)1 << 26, &data, size, NULL));
    return (unsigned char *)data;
}

static inline int entry_count(const char *folder)
{
    DIR *const entries = opendir(folder);
    int count = 0;
    while (readdir(entries))
        count++;
    closedir(entries);
    return count - 2; /* . and .. */
}

static inline void enter_fresh_folder(void)
{
    assert_int_equal(system("chmod -R u+w empty 2>/dev/null; rm -rf empty && mkdir empty"), 0);
    assert_int_equal(chdir("empty"), 0);
}

/* Oracle: the same table twice, with another file between. */
static inline void expect_same_bytes(table_writer write_table)
{
    struct io_image *const image = random_table(40, 7, true, 5);
    size_t first_size, second_size;
    assert_true(write_table("a", image, 4, true, NULL));
    unsigned char *const first = read_bytes("a", &first_size);
    assert_true(write_table("a", image, 4, false, NULL));
    assert_true(write_table("a", image, 4, true, NULL));
    unsigned char *const second = read_bytes("a", &second_size);
    assert_int_equal(first_size, second_size);
    assert_memory_equal(first, second, first_size);
    free(first);
    free(second);
    io_image_destroy(image);
}

static inline void expect_refused(table_writer write_table, const char *path, const struct io_image *image,
                                  int depth, bool is_half, dipole_code code, const char *message)
{
    dipole_status status = { 0 };
    assert_false(write_table(path, image, depth, is_half, &status));
    assert_int_equal(status.code, code);
    assert_string_equal(status.message, message);
    assert_string_equal(status.source, path);
}

/* Oracle: the documented conditions; nothing is written. */
static inline void expect_bad_tables_refused(table_writer write_table)
{
    struct io_image *image;
    enter_fresh_folder();
    assert_true(io_image_create(6, 4, 4, &image, NULL));
    expect_refused(write_table, "x", image, 1, false, DIPOLE_BAD_VALUE,
                   "a table of 4 channels, expected 3");
    io_image_destroy(image);
    assert_true(io_image_create(6, 4, 3, &image, NULL));
    expect_refused(write_table, "x", image, 4, false, DIPOLE_BAD_VALUE,
                   "4 slices in a width of 6, expected slices of equal width");
    expect_refused(write_table, "x", image, 0, false, DIPOLE_BAD_VALUE,
                   "0 slices in a width of 6, expected slices of equal width");
    image->pixels[(6 * 2 + 5) * 3 + 2] = -65520.0f;
    expect_refused(write_table, "x", image, 2, true, DIPOLE_BAD_VALUE,
                   "pixel (5, 2) of channel B is -65520, expected at most 65504 in half");
    assert_int_equal(entry_count("."), 0);
    assert_true(write_table("x", image, 2, false, NULL));
    io_image_destroy(image);
    assert_int_equal(chdir(".."), 0);
}

/* Oracle: the system's reasons. */
static inline void expect_unwritable_named(table_writer write_table)
{
    struct io_image *const image = random_table(6, 4, true, 1);
    enter_fresh_folder();
    expect_refused(write_table, "missing/x", image, 1, false, DIPOLE_NOT_FOUND,
                   "cannot be written: No such file or directory");
    assert_int_equal(mkdir("folder", 0777), 0);
    expect_refused(write_table, "folder", image, 1, false, DIPOLE_IO_FAILED,
                   "cannot be written: Is a directory");
    assert_int_equal(chmod("folder", 0555), 0);
    const uid_t user = geteuid(), nobody = 65534; /* root may write anywhere */
    assert_int_equal(user == 0 ? seteuid(nobody) : 0, 0);
    expect_refused(write_table, "folder/x", image, 1, false, DIPOLE_IO_FAILED,
                   "cannot be written: Permission denied");
    assert_int_equal(user == 0 ? seteuid(user) : 0, 0);
    assert_int_equal(entry_count("folder"), 0);
    assert_int_equal(entry_count("."), 1);
    io_image_destroy(image);
    assert_int_equal(chdir(".."), 0);
}

/* Run in a child whose files may grow to limit_bytes, as on a full disk; its exit code, -1 after a crash.
 */
static inline int write_limited(table_writer write_table, const struct io_image *image, size_t limit_bytes,
                                const char *message)
{
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        const struct rlimit limit = { .rlim_cur = limit_bytes, .rlim_max = limit_bytes };
        dipole_status status;
        signal(SIGXFSZ, SIG_IGN);
        setrlimit(RLIMIT_FSIZE, &limit);
        _exit(write_table("x", image, 2, false, &status) ? 1
              : status.code != DIPOLE_IO_FAILED          ? 2
              : strcmp(status.message, message) != 0     ? 3
                                                         : 0);
    }
    int result;
    waitpid(child, &result, 0);
    return WIFEXITED(result) ? WEXITSTATUS(result) : -1;
}

/* Oracle: a limit on the size of files. */
static inline void expect_full_disk_harmless(table_writer write_table)
{
    struct io_image *const old = random_table(8, 4, true, 1), *const image = random_table(80, 40, true, 2);
    enter_fresh_folder();
    size_t size, size_after;
    assert_true(write_table("x", old, 2, false, NULL));
    const int count = entry_count(".");
    unsigned char *const bytes = read_bytes("x", &size);
    assert_int_equal(write_limited(write_table, image, 3000, "cannot be written: File too large"), 0);
    unsigned char *const bytes_after = read_bytes("x", &size_after);
    assert_int_equal(size, size_after);
    assert_memory_equal(bytes, bytes_after, size);
    assert_int_equal(entry_count("."), count);
    free(bytes);
    free(bytes_after);
    io_image_destroy(old);
    io_image_destroy(image);
    assert_int_equal(chdir(".."), 0);
}

#endif
