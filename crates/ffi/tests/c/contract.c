/* Prints what the header promises as a C compiler sees it: the version, and each code by name.
 * Fails, with the line of the check, where a call breaks its promise about NULL and outputs. */

#include <stdio.h>
#include <string.h>

#include "selvedge.h"

#define CHECK(condition)                                                  \
    do {                                                                  \
        if (!(condition)) {                                               \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
            return 1;                                                     \
        }                                                                 \
    } while (0)

#define PRINT(code) printf("%s %lu\n", #code, (unsigned long)(code))

int main(void)
{
    const uint8_t bytes[1] = {'x'};
    const double uv[2] = {0.0, 0.0};
    const float up[3] = {0.0f, 0.0f, 1.0f};
    float f[3] = {7.0f, 7.0f, 7.0f};
    char message[8] = "???????";
    selvedge_draft *draft = NULL;
    selvedge_shader *shader = NULL;

    PRINT(SELVEDGE_ABI_VERSION);
    PRINT(sizeof(selvedge_status));
    PRINT(SELVEDGE_STATUS_OK);
    PRINT(SELVEDGE_STATUS_NULL_POINTER);
    PRINT(SELVEDGE_STATUS_INVALID_ARGUMENT);
    PRINT(SELVEDGE_STATUS_INVALID_DRAFT);
    PRINT(SELVEDGE_STATUS_INVALID_CLOTH);
    PRINT(SELVEDGE_STATUS_PANIC);
    printf("version %s\n", selvedge_version_string());

    CHECK(selvedge_abi_version() == SELVEDGE_ABI_VERSION);
    CHECK(selvedge_draft_new(bytes, 1, message, sizeof message, &draft) ==
          SELVEDGE_STATUS_INVALID_DRAFT);
    CHECK(draft == NULL && strlen(message) == sizeof message - 1);
    CHECK(selvedge_draft_new(NULL, 1, NULL, 0, &draft) == SELVEDGE_STATUS_NULL_POINTER);
    CHECK(selvedge_draft_new(bytes, (size_t)-1, NULL, 0, &draft) ==
          SELVEDGE_STATUS_INVALID_ARGUMENT);
    CHECK(selvedge_shader_new(NULL, NULL, 0, &shader) == SELVEDGE_STATUS_NULL_POINTER);
    CHECK(selvedge_shader_eval(NULL, uv, up, up, f) == SELVEDGE_STATUS_NULL_POINTER);
    CHECK(draft == NULL && shader == NULL && f[0] == 7.0f && f[1] == 7.0f && f[2] == 7.0f);
    selvedge_draft_free(NULL);
    selvedge_shader_free(NULL);
    return 0;
}
