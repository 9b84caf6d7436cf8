/* Calls every function of the header with what it asks for and with what it must refuse; fails, with
 * the line of the check, where a call breaks its promise about NULL, sizes, codes, strides or outputs.
 * The argument is the path of a draft. */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "selvedge.h"

#define CHECK(condition)                                                    \
    do {                                                                    \
        if (!(condition)) {                                                 \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
            exit(1);                                                        \
        }                                                                   \
    } while (0)

#define REFUSED(status, call) CHECK((call) == SELVEDGE_STATUS_##status)
#define DONE(call) REFUSED(OK, call)

enum { COUNT = 300 };

static const double uv[2] = {2.4e-4, 2e-4}, elsewhere[2] = {7e-4, -3e-4};
static const float wi[3] = {0.6f, 0.0f, 0.8f}, wo[3] = {0.0f, 0.6f, 0.8f}, xi[3] = {0.2f, 0.3f, 0.7f};

static selvedge_draft *plain_draft(void)
{
    const uint8_t warp_up[4] = {1, 0, 0, 1};
    const float colors[6] = {0.5f, 0.1f, 0.1f, 0.1f, 0.1f, 0.5f};
    const uint32_t types[2] = {7, SELVEDGE_NO_TYPE};
    const double diameters[2] = {4e-4, 0.0};
    selvedge_pattern pattern = {0};
    selvedge_draft *draft = NULL;
    char message[80] = "?";

    pattern.ends = pattern.picks = 2;
    REFUSED(INVALID_ARGUMENT, selvedge_draft_from_pattern(&pattern, message, sizeof message, &draft));
    CHECK(strstr(message, "pattern.struct_size: 0, expected") == message);
    pattern.struct_size = sizeof pattern + 1;
    REFUSED(INVALID_ARGUMENT, selvedge_draft_from_pattern(&pattern, NULL, 0, &draft));
    pattern.struct_size = (size_t)-1;
    REFUSED(INVALID_ARGUMENT, selvedge_draft_from_pattern(&pattern, NULL, 0, &draft));
    pattern.struct_size = sizeof pattern;
    REFUSED(NULL_POINTER, selvedge_draft_from_pattern(&pattern, NULL, 0, &draft));
    pattern.warp_up = warp_up;
    REFUSED(NULL_POINTER, selvedge_draft_from_pattern(&pattern, NULL, 0, NULL));
    REFUSED(NULL_POINTER, selvedge_draft_from_pattern(NULL, NULL, 0, &draft));
    pattern.end_pitch = NAN;
    REFUSED(INVALID_ARGUMENT, selvedge_draft_from_pattern(&pattern, NULL, 0, &draft));
    pattern.end_pitch = pattern.pick_pitch = 5e-4;
    pattern.ends = 0;
    REFUSED(INVALID_DRAFT, selvedge_draft_from_pattern(&pattern, NULL, 0, &draft));
    pattern.ends = pattern.picks = UINT32_MAX;
    REFUSED(INVALID_DRAFT, selvedge_draft_from_pattern(&pattern, NULL, 0, &draft));
    pattern.ends = pattern.picks = 2;
    pattern.end_colors = pattern.pick_colors = colors;
    pattern.end_types = types;
    pattern.end_diameters = diameters;
    CHECK(draft == NULL);
    DONE(selvedge_draft_from_pattern(&pattern, message, sizeof message, &draft));
    CHECK(message[0] == '\0');
    return draft;
}

static void drafts(const char *path)
{
    const uint8_t bytes[1] = {'x'};
    char message[8] = "???????";
    selvedge_draft *draft = NULL;
    size_t length = 99;

    REFUSED(INVALID_DRAFT, selvedge_draft_new(bytes, 1, message, sizeof message, &draft));
    CHECK(draft == NULL && strlen(message) == sizeof message - 1);
    REFUSED(NULL_POINTER, selvedge_draft_new(NULL, 1, NULL, 0, &draft));
    REFUSED(NULL_POINTER, selvedge_draft_new(bytes, 1, NULL, 0, NULL));
    REFUSED(INVALID_ARGUMENT, selvedge_draft_new(bytes, (size_t)-1, NULL, 0, &draft));
    REFUSED(INVALID_DRAFT, selvedge_draft_new(bytes, 0, NULL, 0, &draft));
    REFUSED(UNREADABLE, selvedge_draft_load("no such file", NULL, 0, &draft));
    REFUSED(INVALID_ARGUMENT, selvedge_draft_load("\xff", NULL, 0, &draft));
    REFUSED(NULL_POINTER, selvedge_draft_load(NULL, NULL, 0, &draft));
    REFUSED(NULL_POINTER, selvedge_draft_load(path, NULL, 0, NULL));
    REFUSED(NULL_POINTER, selvedge_draft_warnings(NULL, NULL, 0, &length));
    CHECK(draft == NULL && length == 99);
    DONE(selvedge_draft_load(path, NULL, 0, &draft));
    DONE(selvedge_draft_warnings(draft, NULL, 0, &length));
    REFUSED(NULL_POINTER, selvedge_draft_warnings(draft, NULL, 0, NULL));
    selvedge_draft_free(draft);
    selvedge_draft_free(NULL);
}

static void parameters(selvedge_fabric *fabric)
{
    const double none[3] = {NAN, 0.0, 0.0}, quarter[3] = {0.25, 0.25, 0.25}, one[3] = {1.0, 0.0, 0.0};
    const double untouched[3] = {7.0, 7.0, 7.0};
    const uint32_t count = selvedge_parameter_count();
    selvedge_parameter parameter = {0};
    double value[3] = {7.0, 7.0, 7.0};
    uint32_t index = 77;
    char message[128] = "?";

    CHECK(count > 20);
    REFUSED(INVALID_ARGUMENT, selvedge_parameter_describe(0, NULL, 0, &parameter));
    REFUSED(NULL_POINTER, selvedge_parameter_describe(0, NULL, 0, NULL));
    parameter.struct_size = sizeof parameter;
    REFUSED(INVALID_ARGUMENT, selvedge_parameter_describe(count, NULL, 0, &parameter));
    REFUSED(INVALID_ARGUMENT, selvedge_parameter_find("sheen", NULL, 0, &index));
    REFUSED(NULL_POINTER, selvedge_parameter_find(NULL, NULL, 0, &index));
    REFUSED(NULL_POINTER, selvedge_parameter_find("psi", NULL, 0, NULL));
    CHECK(index == 77);
    for (uint32_t i = 0; i < count; i++) {
        selvedge_status status;
        DONE(selvedge_parameter_describe(i, NULL, 0, &parameter));
        DONE(selvedge_parameter_find(parameter.name, NULL, 0, &index));
        CHECK(index == i && parameter.low <= parameter.high && parameter.meaning[0] != '\0');
        REFUSED(NULL_POINTER, selvedge_fabric_value(NULL, 0, i, NULL, 0, value));
        REFUSED(NULL_POINTER, selvedge_fabric_value(fabric, 0, i, NULL, 0, NULL));
        REFUSED(NULL_POINTER, selvedge_fabric_set_value(fabric, 0, i, NULL, NULL, 0));
        REFUSED(NULL_POINTER, selvedge_fabric_set_value(NULL, 0, i, one, NULL, 0));
        REFUSED(INVALID_ARGUMENT, selvedge_fabric_set_value(fabric, 0, i, none, NULL, 0));
        memcpy(value, untouched, sizeof value);
        status = selvedge_fabric_value(fabric, 0, i, NULL, 0, value);
        if (status == SELVEDGE_STATUS_ABSENT) {
            CHECK(memcmp(value, untouched, sizeof value) == 0);
        } else {
            CHECK(status == SELVEDGE_STATUS_OK && value[0] >= parameter.low);
            DONE(selvedge_fabric_set_value(fabric, 0, i, value, NULL, 0));
        }
        if (!parameter.is_of_cloth)
            REFUSED(INVALID_ARGUMENT, selvedge_fabric_value(fabric, 99, i, NULL, 0, value));
    }
    DONE(selvedge_parameter_find("color", NULL, 0, &index));
    DONE(selvedge_fabric_set_value(fabric, 1, index, quarter, NULL, 0));
    DONE(selvedge_fabric_value(fabric, 1, index, NULL, 0, value));
    CHECK(memcmp(value, quarter, sizeof value) == 0);
    DONE(selvedge_parameter_find("delta", NULL, 0, &index));
    REFUSED(ABSENT, selvedge_fabric_set_value(fabric, 0, index, quarter, message, sizeof message));
    CHECK(strcmp(message, "delta: absent from yarn 0, expected one that it has") == 0);
    REFUSED(INVALID_ARGUMENT, selvedge_fabric_set_value(fabric, 0, count, one, NULL, 0));
}

static void checks(void *user, const double *at, double footprint, float *rgb)
{
    ++*(int *)user;
    CHECK(footprint == 0.0 && isfinite(at[0]));
    rgb[0] = 0.25f;
    rgb[1] = NAN;
    rgb[2] = 99.0f;
}

static selvedge_fabric *fabrics(const selvedge_draft *draft, const char *path)
{
    const char json[] = "{\"yarn\": {\"psi\": 0.5}}", bad[] = "{\"yarn\": {\"sigm\": 1}}",
               range[] = "{\"yarn\": {\"psi\": 9}}";
    selvedge_fabric_info info = {0};
    selvedge_fabric *fabric = NULL;
    uint8_t up[4] = {7, 7, 7, 7};
    uint32_t yarns[2] = {7, 7};

    REFUSED(NULL_POINTER, selvedge_fabric_new(NULL, NULL, 0, NULL, 0, &fabric));
    REFUSED(NULL_POINTER, selvedge_fabric_new(draft, NULL, 0, NULL, 0, NULL));
    REFUSED(INVALID_FABRIC, selvedge_fabric_new(draft, bad, sizeof bad - 1, NULL, 0, &fabric));
    REFUSED(INVALID_FABRIC, selvedge_fabric_new(draft, json, 0, NULL, 0, &fabric));
    REFUSED(INVALID_ARGUMENT, selvedge_fabric_new(draft, json, (size_t)-1, NULL, 0, &fabric));
    REFUSED(INVALID_CLOTH, selvedge_fabric_new(draft, range, sizeof range - 1, NULL, 0, &fabric));
    REFUSED(UNREADABLE, selvedge_fabric_load("no such file", NULL, 0, &fabric));
    REFUSED(NULL_POINTER, selvedge_fabric_load(NULL, NULL, 0, &fabric));
    REFUSED(NULL_POINTER, selvedge_fabric_load(path, NULL, 0, NULL));
    CHECK(fabric == NULL);
    DONE(selvedge_fabric_load(path, NULL, 0, &fabric));
    selvedge_fabric_free(fabric);
    DONE(selvedge_fabric_new(draft, json, sizeof json - 1, NULL, 0, &fabric));

    REFUSED(INVALID_ARGUMENT, selvedge_fabric_describe(fabric, NULL, 0, &info));
    info.struct_size = sizeof info;
    REFUSED(NULL_POINTER, selvedge_fabric_describe(fabric, NULL, 0, NULL));
    REFUSED(NULL_POINTER, selvedge_fabric_describe(NULL, NULL, 0, &info));
    DONE(selvedge_fabric_describe(fabric, NULL, 0, &info));
    CHECK(info.ends == 2 && info.picks == 2 && info.yarns == 3 && fabs(info.width - 1e-3) < 1e-12);
    REFUSED(INVALID_ARGUMENT, selvedge_fabric_warp_up(fabric, 3, NULL, 0, up));
    REFUSED(NULL_POINTER, selvedge_fabric_warp_up(fabric, 4, NULL, 0, NULL));
    REFUSED(NULL_POINTER, selvedge_fabric_warp_up(NULL, 4, NULL, 0, up));
    CHECK(up[0] == 7);
    DONE(selvedge_fabric_warp_up(fabric, 4, NULL, 0, up));
    CHECK(up[0] == 1 && up[1] == 0 && up[2] == 0 && up[3] == 1);
    REFUSED(INVALID_ARGUMENT, selvedge_fabric_yarns(fabric, 2, 2, NULL, 0, yarns));
    REFUSED(INVALID_ARGUMENT, selvedge_fabric_yarns(fabric, 0, 1, NULL, 0, yarns));
    REFUSED(NULL_POINTER, selvedge_fabric_yarns(fabric, 0, 2, NULL, 0, NULL));
    DONE(selvedge_fabric_yarns(fabric, 0, 2, NULL, 0, yarns));
    CHECK(yarns[0] == 0 && yarns[1] == 1);
    selvedge_fabric_free(NULL);
    return fabric;
}

static void textures(selvedge_fabric *fabric)
{
    const selvedge_shader *shader = NULL;
    uint32_t color = 0, size = 0;
    int calls = 0;
    float f[3] = {7.0f, 7.0f, 7.0f};

    DONE(selvedge_parameter_find("color", NULL, 0, &color));
    DONE(selvedge_parameter_find("size", NULL, 0, &size));
    REFUSED(NULL_POINTER,
            selvedge_fabric_set_texture(fabric, 0, color, NULL, NULL, 0.0f, 1.0f, NULL, 0));
    REFUSED(NULL_POINTER,
            selvedge_fabric_set_texture(NULL, 0, color, checks, NULL, 0.0f, 1.0f, NULL, 0));
    REFUSED(INVALID_ARGUMENT,
            selvedge_fabric_set_texture(fabric, 0, color, checks, NULL, 1.0f, 0.0f, NULL, 0));
    REFUSED(INVALID_ARGUMENT,
            selvedge_fabric_set_texture(fabric, 0, color, checks, NULL, NAN, 1.0f, NULL, 0));
    REFUSED(INVALID_ARGUMENT,
            selvedge_fabric_set_texture(fabric, 9, color, checks, NULL, 0.0f, 1.0f, NULL, 0));
    REFUSED(INVALID_ARGUMENT,
            selvedge_fabric_set_texture(fabric, 0, size, checks, NULL, 0.0f, 1.0f, NULL, 0));
    DONE(selvedge_fabric_set_texture(fabric, 0, color, checks, &calls, 0.0f, 1.0f, NULL, 0));
    DONE(selvedge_shader_new(fabric, NULL, 0, &shader));
    DONE(selvedge_shader_eval(shader, uv, 0.0f, wi, wo, f));
    CHECK(calls >= 1 && f[0] > f[1] && f[2] > f[0] && f[1] >= 0.0f);
    selvedge_shader_free(shader);
}

static void points(const selvedge_shader *shader)
{
    float f[3] = {7.0f, 7.0f, 7.0f}, g[3] = {7.0f, 7.0f, 7.0f}, pdf = 7.0f;
    selvedge_yarn_point yarn = {0};

    REFUSED(NULL_POINTER, selvedge_shader_eval(NULL, uv, 0.0f, wi, wo, f));
    REFUSED(NULL_POINTER, selvedge_shader_eval(shader, NULL, 0.0f, wi, wo, f));
    REFUSED(NULL_POINTER, selvedge_shader_eval(shader, uv, 0.0f, wi, wo, NULL));
    REFUSED(NULL_POINTER, selvedge_shader_eval_lobes(shader, uv, 0.0f, wi, wo, f, NULL));
    REFUSED(NULL_POINTER, selvedge_shader_pdf(shader, uv, 0.0f, wi, NULL, &pdf));
    REFUSED(NULL_POINTER, selvedge_shader_reverse_pdf(shader, uv, 0.0f, NULL, wo, &pdf));
    REFUSED(NULL_POINTER, selvedge_shader_eval_pdf(shader, uv, 0.0f, wi, wo, f, NULL));
    REFUSED(NULL_POINTER, selvedge_shader_sample(shader, uv, 0.0f, wo, NULL, f, g, &pdf));
    REFUSED(NULL_POINTER, selvedge_shader_albedo(shader, uv, 0.0f, wo, NULL));
    REFUSED(NULL_POINTER, selvedge_shader_opacity(shader, uv, 0.0f, NULL));
    REFUSED(NULL_POINTER, selvedge_shader_yarn_at(shader, uv, NULL));
    REFUSED(INVALID_ARGUMENT, selvedge_shader_yarn_at(shader, uv, &yarn));
    CHECK(f[0] == 7.0f && g[0] == 7.0f && pdf == 7.0f && yarn.kind == 0);

    yarn.struct_size = sizeof yarn;
    DONE(selvedge_shader_yarn_at(shader, uv, &yarn));
    CHECK(yarn.kind == SELVEDGE_YARN_KIND_TOP && yarn.is_warp == 1 && yarn.struct_size == sizeof yarn);
    DONE(selvedge_shader_eval(shader, uv, 0.0f, wi, wo, f));
    DONE(selvedge_shader_eval_pdf(shader, uv, 0.0f, wi, wo, g, &pdf));
    CHECK(memcmp(f, g, sizeof f) == 0 && pdf > 0.0f && pdf < 100.0f);
    DONE(selvedge_shader_eval_lobes(shader, uv, 0.0f, wi, wo, f, g));
    CHECK(f[0] > 0.0f && g[0] > 0.0f);
    DONE(selvedge_shader_reverse_pdf(shader, uv, 0.0f, wo, wi, f));
    CHECK(f[0] == pdf);
    DONE(selvedge_shader_sample(shader, uv, 0.0f, wo, xi, f, g, &pdf));
    CHECK(f[2] > 0.0f && pdf > 0.0f && g[0] > 0.0f);
    DONE(selvedge_shader_albedo(shader, uv, 0.0f, wo, f));
    DONE(selvedge_shader_opacity(shader, uv, 0.0f, &pdf));
    CHECK(f[0] > 0.0f && f[0] < 1.0f && pdf == 1.0f);

    /* From far away all places are the same; what is no width is none. */
    DONE(selvedge_shader_eval(shader, uv, 1.0f, wi, wo, f));
    DONE(selvedge_shader_eval(shader, elsewhere, 1.0f, wi, wo, g));
    CHECK(memcmp(f, g, sizeof f) == 0 && f[0] > 0.0f);
    DONE(selvedge_shader_eval(shader, uv, 0.0f, wi, wo, f));
    DONE(selvedge_shader_eval(shader, uv, NAN, wi, wo, g));
    CHECK(memcmp(f, g, sizeof f) == 0);
    DONE(selvedge_shader_eval(shader, uv, -1.0f, wi, wo, g));
    CHECK(memcmp(f, g, sizeof f) == 0);
}

/* All points in packed records of odd length, so that nothing but the first is aligned. */
static void batches(const selvedge_shader *shader)
{
    enum { RECORD = 2 * 8 + 3 * 4 + 1, OUT = 13 };
    uint8_t *records = malloc(COUNT * RECORD), *f = malloc(COUNT * OUT);
    float *planes = malloc(sizeof(float) * 7 * COUNT), one[3];
    selvedge_points batch = {0};
    selvedge_vectors_out out = {0}, other = {0};
    selvedge_numbers_out numbers = {0};
    selvedge_yarn_point *yarns = calloc(COUNT, sizeof *yarns);
    char message[128] = "?";

    CHECK(records != NULL && f != NULL && planes != NULL && yarns != NULL);
    for (int i = 0; i < COUNT; i++) {
        const double at[2] = {1.3e-5 * i, 3.1e-5 * i};
        uint8_t *record = records + i * RECORD;
        memcpy(record, at, 16);
        memcpy(record + 16, i % 2 ? wi : wo, 12);
        record[28] = i % 3 != 0;
    }
    memset(f, 0x7f, COUNT * OUT);
    for (int k = 0; k < 2; k++)
        batch.uv.component[k] = (const double *)(const void *)(records + 8 * k);
    for (int k = 0; k < 3; k++) {
        batch.wi.component[k] = (const float *)(const void *)(records + 16 + 4 * k);
        batch.wo.component[k] = wo + k;
        batch.xi.component[k] = xi + k;
        out.component[k] = (float *)(void *)(f + 4 * k);
        other.component[k] = planes + (k + 3) * COUNT;
    }
    batch.uv.stride = batch.wi.stride = batch.active.stride = RECORD;
    batch.active.values = records + 28;
    batch.count = COUNT;
    out.stride = OUT;
    other.stride = sizeof(float);
    numbers.values = planes;
    numbers.stride = sizeof(float);

    REFUSED(INVALID_ARGUMENT, selvedge_shader_eval_batch(shader, &batch, NULL, 0, &out));
    batch.struct_size = sizeof batch;
    REFUSED(NULL_POINTER, selvedge_shader_eval_batch(NULL, &batch, NULL, 0, &out));
    REFUSED(NULL_POINTER, selvedge_shader_eval_batch(shader, NULL, NULL, 0, &out));
    REFUSED(NULL_POINTER, selvedge_shader_eval_batch(shader, &batch, NULL, 0, NULL));
    batch.lobes = 3;
    REFUSED(INVALID_ARGUMENT, selvedge_shader_eval_batch(shader, &batch, NULL, 0, &out));
    batch.lobes = 0;
    batch.sides = UINT32_MAX;
    REFUSED(INVALID_ARGUMENT, selvedge_shader_eval_batch(shader, &batch, NULL, 0, &out));
    batch.sides = 0;
    batch.count = (size_t)-1;
    REFUSED(INVALID_ARGUMENT, selvedge_shader_eval_batch(shader, &batch, NULL, 0, &out));
    batch.count = COUNT;
    batch.wi.component[1] = NULL;
    REFUSED(NULL_POINTER,
            selvedge_shader_eval_batch(shader, &batch, message, sizeof message, &out));
    CHECK(strcmp(message, "points.wi: null, expected a pointer") == 0);
    DONE(selvedge_shader_albedo_batch(shader, &batch, NULL, 0, &other));
    batch.count = 0;
    DONE(selvedge_shader_eval_batch(shader, &batch, NULL, 0, &out));
    batch.count = COUNT;
    batch.wi.component[1] = (const float *)(const void *)(records + 20);
    out.stride = 0;
    REFUSED(INVALID_ARGUMENT, selvedge_shader_eval_batch(shader, &batch, NULL, 0, &out));
    out.stride = OUT;
    for (int i = 0; i < COUNT * OUT; i++)
        CHECK(f[i] == 0x7f);

    DONE(selvedge_shader_eval_batch(shader, &batch, message, sizeof message, &out));
    DONE(selvedge_shader_pdf_batch(shader, &batch, NULL, 0, &numbers));
    CHECK(message[0] == '\0');
    for (int i = 0; i < COUNT; i++) {
        const double at[2] = {1.3e-5 * i, 3.1e-5 * i};
        float expected[3] = {0}, pdf = 0.0f;
        if (i % 3 == 0) {
            CHECK(f[i * OUT] == 0x7f && f[i * OUT + 11] == 0x7f);
        } else {
            DONE(selvedge_shader_eval(shader, at, 0.0f, i % 2 ? wi : wo, wo, expected));
            CHECK(memcmp(f + i * OUT, expected, 12) == 0);
            DONE(selvedge_shader_pdf(shader, at, 0.0f, i % 2 ? wi : wo, wo, &pdf));
            CHECK(planes[i] == pdf);
        }
        CHECK(f[i * OUT + 12] == 0x7f);
    }

    batch.active.values = NULL;
    DONE(selvedge_shader_eval_lobes_batch(shader, &batch, NULL, 0, &out, &other));
    DONE(selvedge_shader_eval_pdf_batch(shader, &batch, NULL, 0, &out, &numbers));
    DONE(selvedge_shader_reverse_pdf_batch(shader, &batch, NULL, 0, &numbers));
    DONE(selvedge_shader_opacity_batch(shader, &batch, NULL, 0, &numbers));
    DONE(selvedge_shader_sample_batch(shader, &batch, NULL, 0, &out, &other, &numbers));
    REFUSED(INVALID_ARGUMENT, selvedge_shader_yarn_at_batch(shader, &batch, NULL, 0, yarns));
    yarns[0].struct_size = sizeof *yarns;
    DONE(selvedge_shader_yarn_at_batch(shader, &batch, NULL, 0, yarns));
    CHECK(yarns[COUNT - 1].struct_size == sizeof *yarns && yarns[COUNT - 1].width > 0.0);
    /* Seen from behind, the face alone is black. */
    one[0] = 0.0f, one[1] = 0.0f, one[2] = -1.0f;
    for (int k = 0; k < 3; k++)
        batch.wo.component[k] = one + k;
    batch.wi = batch.wo;
    batch.sides = SELVEDGE_SIDES_FACE;
    DONE(selvedge_shader_eval_batch(shader, &batch, NULL, 0, &other));
    CHECK(other.component[0][5] == 0.0f);
    batch.sides = SELVEDGE_SIDES_BOTH;
    DONE(selvedge_shader_eval_batch(shader, &batch, NULL, 0, &other));
    CHECK(other.component[0][5] > 0.0f);

    free(records);
    free(f);
    free(planes);
    free(yarns);
}

static void divisors(selvedge_fabric *fabric)
{
    const selvedge_shader *shader = NULL;
    float found[256], f[3], g[3], more[256];
    size_t count = 99;

    DONE(selvedge_shader_new(fabric, NULL, 0, &shader));
    REFUSED(NULL_POINTER, selvedge_shader_divisors(NULL, 0, 0, NULL, 0, NULL, &count));
    REFUSED(NULL_POINTER, selvedge_shader_divisors(shader, 0, 256, NULL, 0, NULL, &count));
    REFUSED(NULL_POINTER, selvedge_shader_divisors(shader, 0, 0, NULL, 0, NULL, NULL));
    REFUSED(INVALID_ARGUMENT, selvedge_shader_divisors(shader, 9, 0, NULL, 0, NULL, &count));
    CHECK(count == 99);
    DONE(selvedge_shader_divisors(shader, 0, 0, NULL, 0, NULL, &count));
    CHECK(count > 0 && count <= 256);
    DONE(selvedge_shader_divisors(shader, 0, count, NULL, 0, found, &count));
    DONE(selvedge_shader_eval_lobes(shader, uv, 0.0f, wi, wo, f, g));
    selvedge_shader_free(shader);

    REFUSED(NULL_POINTER, selvedge_fabric_set_divisors(NULL, 0, found, count, NULL, 0));
    REFUSED(NULL_POINTER, selvedge_fabric_set_divisors(fabric, 0, NULL, count, NULL, 0));
    REFUSED(INVALID_ARGUMENT, selvedge_fabric_set_divisors(fabric, 9, found, count, NULL, 0));
    REFUSED(INVALID_ARGUMENT, selvedge_fabric_set_divisors(fabric, 0, found, (size_t)-1, NULL, 0));
    for (size_t i = 0; i < count; i++)
        more[i] = 2.0f * found[i];
    DONE(selvedge_fabric_set_divisors(fabric, 0, more, count, NULL, 0));
    DONE(selvedge_shader_new(fabric, NULL, 0, &shader));
    DONE(selvedge_shader_eval_lobes(shader, uv, 0.0f, wi, wo, g, more));
    CHECK(f[0] > 0.0f && fabsf(f[0] - 2.0f * g[0]) < 1e-6f * f[0]);
    selvedge_shader_free(shader);
    shader = NULL;
    DONE(selvedge_fabric_set_divisors(fabric, 0, found, count - 1, NULL, 0));
    REFUSED(INVALID_CLOTH, selvedge_shader_new(fabric, NULL, 0, &shader));
    CHECK(shader == NULL);
    DONE(selvedge_fabric_set_divisors(fabric, 0, found, 0, NULL, 0));
}

static void shaders(const selvedge_fabric *fabric)
{
    const selvedge_shader *shader = NULL;
    selvedge_shader_info info = {0};
    selvedge_normalization factors = {0};
    size_t length = 99;

    REFUSED(NULL_POINTER, selvedge_shader_new(NULL, NULL, 0, &shader));
    REFUSED(NULL_POINTER, selvedge_shader_new(fabric, NULL, 0, NULL));
    REFUSED(NULL_POINTER, selvedge_shader_share(NULL));
    CHECK(shader == NULL);
    DONE(selvedge_shader_new(fabric, NULL, 0, &shader));
    DONE(selvedge_shader_share(shader));
    selvedge_shader_free(shader);
    REFUSED(INVALID_ARGUMENT, selvedge_shader_describe(shader, NULL, 0, &info));
    info.struct_size = sizeof info;
    DONE(selvedge_shader_describe(shader, NULL, 0, &info));
    CHECK(info.yarns == 3 && info.bytes > 1000 && info.has_gaps == 1);
    REFUSED(NULL_POINTER, selvedge_shader_warnings(shader, NULL, 0, NULL));
    DONE(selvedge_shader_warnings(shader, NULL, 0, &length));
    REFUSED(INVALID_ARGUMENT, selvedge_shader_normalization(shader, 0, NULL, 0, &factors));
    factors.struct_size = sizeof factors;
    REFUSED(INVALID_ARGUMENT, selvedge_shader_normalization(shader, 3, NULL, 0, &factors));
    DONE(selvedge_shader_normalization(shader, 2, NULL, 0, &factors));
    CHECK(factors.factor[0] > 0.0 && factors.max_albedo[0] > 0.0);
    points(shader);
    batches(shader);
    selvedge_shader_free(shader);
    selvedge_shader_free(NULL);
}

int main(int argc, char **argv)
{
    const uint32_t abi = selvedge_abi_version();
    selvedge_draft *draft;
    selvedge_fabric *fabric;

    CHECK(argc == 2);
    CHECK(abi >> 16 == SELVEDGE_ABI_VERSION >> 16 && abi >= SELVEDGE_ABI_VERSION);
    CHECK(strlen(selvedge_version_string()) >= 5);
    drafts(argv[1]);
    draft = plain_draft();
    fabric = fabrics(draft, argv[1]);
    selvedge_draft_free(draft);
    parameters(fabric);
    shaders(fabric);
    divisors(fabric);
    textures(fabric);
    selvedge_fabric_free(fabric);
    return 0;
}
