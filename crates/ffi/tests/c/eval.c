/* Reads the draft named by the argument, prepares it, and prints one line for each of a row of
 * positions and directions: the BRDF there, as the bits of its three numbers. */

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "selvedge.h"

static const float directions[][2][3] = {
    {{0.0f, 0.0f, 1.0f}, {0.0f, 0.0f, 1.0f}},
    {{0.6f, 0.0f, 0.8f}, {0.0f, 0.6f, 0.8f}},
    {{-0.48f, 0.64f, 0.6f}, {0.28f, 0.0f, 0.96f}},
    {{0.6f, 0.0f, -0.8f}, {0.0f, -0.6f, -0.8f}},
    {{0.6f, 0.0f, -0.8f}, {0.0f, 0.6f, 0.8f}},
};

/* The bytes of the file at `path`, for the caller to free; NULL if it cannot be read. */
static uint8_t *read_file(const char *path, size_t *length)
{
    FILE *file = fopen(path, "rb");
    uint8_t *bytes = NULL;
    long size;
    if (file == NULL)
        return NULL;
    if (fseek(file, 0, SEEK_END) == 0 && (size = ftell(file)) >= 0 &&
        (bytes = malloc((size_t)size + 1)) != NULL) {
        rewind(file);
        *length = fread(bytes, 1, (size_t)size, file);
    }
    fclose(file);
    return bytes;
}

static int print_values(const selvedge_shader *shader)
{
    for (int step = 0; step < 40; step++) {
        const double uv[2] = {1.1e-4 * step, 2.3e-4 * step - 1.0e-3};
        for (size_t pair = 0; pair < sizeof directions / sizeof directions[0]; pair++) {
            float f[3];
            uint32_t bits[3];
            uint32_t status =
                selvedge_shader_eval(shader, uv, 0.0f, directions[pair][0], directions[pair][1], f);
            if (status != SELVEDGE_STATUS_OK) {
                fprintf(stderr, "eval: status %" PRIu32 "\n", status);
                return 1;
            }
            memcpy(bits, f, sizeof bits);
            printf("%08" PRIx32 " %08" PRIx32 " %08" PRIx32 "\n", bits[0], bits[1], bits[2]);
        }
    }
    return 0;
}

int main(int argc, char **argv)
{
    char message[256] = "";
    size_t length = 0;
    uint8_t *bytes = argc == 2 ? read_file(argv[1], &length) : NULL;
    selvedge_draft *draft = NULL;
    selvedge_fabric *fabric = NULL;
    const selvedge_shader *shader = NULL;
    int result = 1;

    if (bytes == NULL)
        fprintf(stderr, "expected the path of a draft\n");
    else if (selvedge_draft_new(bytes, length, message, sizeof message, &draft) ||
             selvedge_fabric_new(draft, NULL, 0, message, sizeof message, &fabric) ||
             selvedge_shader_new(fabric, message, sizeof message, &shader))
        fprintf(stderr, "%s: %s\n", argv[1], message);
    else
        result = print_values(shader);

    selvedge_shader_free(shader);
    selvedge_fabric_free(fabric);
    selvedge_draft_free(draft);
    free(bytes);
    return result;
}
