/* What the tests share: checks, files and checksums. */

#ifndef TEST_H
#define TEST_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gip.h"

/* What is being tested, for whoever reads that it failed. */
static const char *subject = "";

/* Ends the test if something does not hold. */
#define CHECK(holds)                                                                       \
    do {                                                                                   \
        if (!(holds)) {                                                                    \
            fprintf(stderr, "%s:%d: %s: does not hold: %s; last error: %s\n", __FILE__,   \
                    __LINE__, subject, #holds, gip_last_error());                          \
            exit(EXIT_FAILURE);                                                            \
        }                                                                                  \
    } while (0)

/* Checks how a call ends. */
#define EXPECT(status, call) CHECK((call) == (status))
#define OK(call) EXPECT(GIP_STATUS_OK, call)

static inline void *allocate(size_t size)
{
    void *memory = malloc(size ? size : 1);
    CHECK(memory);
    return memory;
}

/* The bytes of a file, to be freed with free. */
static inline uint8_t *read_file(const char *folder, const char *name, size_t *size)
{
    size_t room = strlen(folder) + strlen(name) + 2;
    char *path = (char *)allocate(room);
    FILE *file;
    long length;
    uint8_t *bytes;
    snprintf(path, room, "%s/%s", folder, name);
    file = fopen(path, "rb");
    if (!file) {
        perror(path);
        exit(EXIT_FAILURE);
    }
    free(path);
    CHECK(fseek(file, 0, SEEK_END) == 0);
    length = ftell(file);
    CHECK(length >= 0 && fseek(file, 0, SEEK_SET) == 0);
    *size = (size_t)length;
    bytes = (uint8_t *)allocate(*size);
    CHECK(fread(bytes, 1, *size, file) == *size);
    fclose(file);
    return bytes;
}

/* The CRC-32 of PNG and of .gip, continued. */
static inline uint32_t crc32_of(uint32_t crc, const void *data, size_t size)
{
    const uint8_t *bytes = (const uint8_t *)data;
    size_t i;
    int bit;
    crc = ~crc;
    for (i = 0; i < size; i++) {
        crc ^= bytes[i];
        for (bit = 0; bit < 8; bit++) {
            crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320u : 0);
        }
    }
    return ~crc;
}

#endif
