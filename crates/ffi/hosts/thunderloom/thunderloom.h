/* The interface of ThunderLoom over Selvedge, for plug-ins that were written for it. README.md tells what is
 * the same and what is not.
 *
 *     #define TL_THUNDERLOOM_IMPLEMENTATION       in one source file, before
 *     #include "thunderloom.h"                    which needs selvedge.h and libselvedge
 *
 *     const char *error = 0;
 *     tlWeaveParameters *params = tl_weave_pattern_from_file("twill.wif", &error);
 *     params->uscale = params->vscale = 1.0f;
 *     tl_prepare(params);
 *     tlIntersectionData at = {0};                then uv, wi and wo
 *     tlColor color = tl_shade(at, params);
 *     tl_free_weave_parameters(params);
 *
 * A host that has textures defines tl_eval_texmap_color(texmap, context); one that has none defines
 * TL_NO_TEXTURE_CALLBACKS. */

#ifndef THUNDERLOOM_H
#define THUNDERLOOM_H

#include <stdint.h>

#include "selvedge.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    float r, g, b;
} tlColor;

/* A point of the surface. Directions are unit, away from the surface, in the frame x = dP/du, y = dP/dv,
 * z = n: wi to the light, wo to the viewer. */
typedef struct {
    float uv_x, uv_y;
    float wi_x, wi_y, wi_z;
    float wo_x, wo_y, wo_z;
    void *context; /* handed to texture callbacks */
} tlIntersectionData;

/* One type of yarn. Type 0 is what all have in common; another's parameter counts where it is enabled. */
#define TL_FLOAT_PARAM(name) \
    float name;              \
    uint8_t name##_enabled;  \
    void *name##_texmap;
#define TL_COLOR_PARAM(name) \
    tlColor name;            \
    uint8_t name##_enabled;  \
    void *name##_texmap;
#define TL_YARN_PARAMETERS          \
    TL_FLOAT_PARAM(umax)            \
    TL_FLOAT_PARAM(yarnsize)        \
    TL_FLOAT_PARAM(psi)             \
    TL_FLOAT_PARAM(alpha)           \
    TL_FLOAT_PARAM(beta)            \
    TL_FLOAT_PARAM(delta_x)         \
    TL_COLOR_PARAM(specular_color)  \
    TL_FLOAT_PARAM(specular_amount) \
    TL_FLOAT_PARAM(specular_noise)  \
    TL_COLOR_PARAM(color)           \
    TL_FLOAT_PARAM(color_amount)

typedef struct {
    TL_YARN_PARAMETERS
} tlYarnType;

/* What is on top of a crossing. */
typedef struct {
    uint8_t yarn_type;
    uint8_t warp_above;
} PatternEntry;

typedef struct {
    /* To be set before tl_prepare. */
    float uscale, vscale;    /* repeats for 1 of uv */
    float uvrotation;        /* degrees */
    uint8_t realworld_uv;    /* 1: uv is in metres, times the scales */
    tlYarnType *yarn_types;
    uint32_t num_yarn_types;
    /* By row, that of v = 0 first. */
    PatternEntry *pattern;
    uint32_t pattern_width, pattern_height;
    float pattern_realwidth, pattern_realheight; /* metres */
    /* Set by tl_prepare. */
    const selvedge_shader *shader;
    uint32_t *type_of_yarn; /* the type of each yarn of the shader */
} tlWeaveParameters;

/* Where on which piece of yarn a point is. Lengths are twice those in cells. */
typedef struct {
    float normal_x, normal_y, normal_z;
    float u, v;          /* rad, along the arc and around the section */
    float length, width;
    float x, y;          /* across and along, in [-1, 1] */
    uint32_t total_index_x, total_index_y; /* of the cell, from 0 at uv = 0, wrapping */
    uint8_t yarn_type;
    uint8_t yarn_hit;    /* 0 in a gap */
    uint8_t warp_above;
    uint8_t ext_between_parallel;
} tlPatternData;

/* The pattern of a WIF file or of a fabric (JSON); 0 and a static text in *error where there is none. */
tlWeaveParameters *tl_weave_pattern_from_file(const char *filename, const char **error);

/* A pattern in memory: for each crossing, by row, whether the warp is on top, and the type of the yarn on
 * top, from 0; the colours of the types, linear. What is passed is copied. 0 where memory is short. */
tlWeaveParameters *tl_weave_pattern_from_data(const uint8_t *warp_above, const uint8_t *yarn_type,
                                              uint32_t num_yarn_types, const tlColor *yarn_colors,
                                              uint32_t pattern_width, uint32_t pattern_height);

/* Makes ready for shading what the parameters say now; may be called again when they have changed. */
void tl_prepare(tlWeaveParameters *params);

tlPatternData tl_get_pattern_data(tlIntersectionData at, const tlWeaveParameters *params);

/* pi f of each lobe, where f is the BRDF in 1/sr without the cosine. */
tlColor tl_eval_diffuse(tlIntersectionData at, tlPatternData data, const tlWeaveParameters *params);
tlColor tl_eval_specular(tlIntersectionData at, tlPatternData data, const tlWeaveParameters *params);

/* The share of the light that does not pass straight through. */
float tl_eval_opacity(tlIntersectionData at, tlPatternData data, const tlWeaveParameters *params);

/* pi f cos(wi): what is seen of a light whose irradiance, facing it, is 1. */
tlColor tl_shade(tlIntersectionData at, const tlWeaveParameters *params);

void tl_free_weave_parameters(tlWeaveParameters *params);

#ifndef TL_NO_TEXTURE_CALLBACKS
tlColor tl_eval_texmap_color(void *texmap, void *context);
#endif

#ifdef __cplusplus
}
#endif

#ifdef TL_THUNDERLOOM_IMPLEMENTATION

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TL_PI 3.14159265358979323846

static const char *tl_text_of(selvedge_status status)
{
    if (status == SELVEDGE_STATUS_UNREADABLE)
        return "file: cannot be read, expected a draft (WIF) or a fabric (JSON)";
    if (status == SELVEDGE_STATUS_INVALID_DRAFT || status == SELVEDGE_STATUS_INVALID_FABRIC)
        return "file: not a draft, expected a draft (WIF) or a fabric (JSON)";
    return "file: no cloth can be woven of it";
}

static tlWeaveParameters *tl_allocate(uint32_t types, uint32_t width, uint32_t height)
{
    tlWeaveParameters *params = (tlWeaveParameters *)calloc(1, sizeof *params);
    if (params == NULL)
        return NULL;
    params->uscale = params->vscale = 1.0f;
    params->num_yarn_types = types;
    params->pattern_width = width;
    params->pattern_height = height;
    params->yarn_types = (tlYarnType *)calloc(types, sizeof *params->yarn_types);
    params->pattern = (PatternEntry *)calloc((size_t)width * height, sizeof *params->pattern);
    if (params->yarn_types == NULL || params->pattern == NULL) {
        tl_free_weave_parameters(params);
        return NULL;
    }
    {
        tlYarnType *common = params->yarn_types;
        const tlColor grey = {0.3f, 0.3f, 0.3f}, light = {0.4f, 0.4f, 0.4f};
        common->umax = common->psi = 0.5f;
        common->yarnsize = common->color_amount = common->specular_amount = 1.0f;
        common->alpha = 0.05f;
        common->beta = 4.0f;
        common->delta_x = 0.3f;
        common->color = grey;
        common->specular_color = light;
    }
    return params;
}

tlWeaveParameters *tl_weave_pattern_from_file(const char *filename, const char **error)
{
    selvedge_fabric *fabric = NULL;
    selvedge_fabric_info info;
    selvedge_status status = selvedge_fabric_load(filename, NULL, 0, &fabric);
    tlWeaveParameters *params = NULL;
    const char *reason = status == SELVEDGE_STATUS_OK ? "memory: none is left" : tl_text_of(status);

    memset(&info, 0, sizeof info);
    info.struct_size = sizeof info;
    if (selvedge_fabric_describe(fabric, NULL, 0, &info) == SELVEDGE_STATUS_OK) {
        const size_t crossings = (size_t)info.ends * info.picks;
        uint8_t *up = (uint8_t *)malloc(crossings);
        uint32_t *ends = (uint32_t *)malloc(info.ends * sizeof *ends);
        uint32_t *picks = (uint32_t *)malloc(info.picks * sizeof *picks);
        if (info.yarns > 254)
            reason = "file: more than 254 types of yarn, expected at most 254";
        else if (up != NULL && ends != NULL && picks != NULL)
            params = tl_allocate(info.yarns + 1, info.ends, info.picks);
        if (params != NULL) {
            uint32_t color = 0;
            selvedge_fabric_warp_up(fabric, crossings, NULL, 0, up);
            selvedge_fabric_yarns(fabric, 0, info.ends, NULL, 0, ends);
            selvedge_fabric_yarns(fabric, 1, info.picks, NULL, 0, picks);
            for (size_t i = 0; i < crossings; i++) {
                /* Type 0 is what is common to all. */
                const uint32_t yarn = up[i] ? ends[i % info.ends] : picks[i / info.ends];
                params->pattern[i].warp_above = up[i];
                params->pattern[i].yarn_type = (uint8_t)(yarn + 1);
            }
            selvedge_parameter_find("color", NULL, 0, &color);
            for (uint32_t yarn = 0; yarn < info.yarns; yarn++) {
                double rgb[3] = {0.0, 0.0, 0.0};
                tlYarnType *type = &params->yarn_types[yarn + 1];
                selvedge_fabric_value(fabric, yarn, color, NULL, 0, rgb);
                type->color.r = (float)rgb[0];
                type->color.g = (float)rgb[1];
                type->color.b = (float)rgb[2];
                type->color_enabled = 1;
            }
            params->pattern_realwidth = (float)info.width;
            params->pattern_realheight = (float)info.height;
        }
        free(up);
        free(ends);
        free(picks);
    }
    selvedge_fabric_free(fabric);
    if (params == NULL && error != NULL)
        *error = reason;
    return params;
}

tlWeaveParameters *tl_weave_pattern_from_data(const uint8_t *warp_above, const uint8_t *yarn_type,
                                              uint32_t num_yarn_types, const tlColor *yarn_colors,
                                              uint32_t pattern_width, uint32_t pattern_height)
{
    const size_t crossings = (size_t)pattern_width * pattern_height;
    tlWeaveParameters *params = NULL;
    if (num_yarn_types > 0 && num_yarn_types < 256 && crossings > 0)
        params = tl_allocate(num_yarn_types, pattern_width, pattern_height);
    if (params == NULL)
        return NULL;
    for (size_t i = 0; i < crossings; i++) {
        params->pattern[i].warp_above = warp_above[i] != 0;
        params->pattern[i].yarn_type = yarn_type[i] < num_yarn_types ? yarn_type[i] : 0;
    }
    for (uint32_t i = 0; i < num_yarn_types; i++) {
        params->yarn_types[i].color = yarn_colors[i];
        params->yarn_types[i].color_enabled = 1;
    }
    params->pattern_realwidth = 5e-4f * (float)pattern_width;
    params->pattern_realheight = 5e-4f * (float)pattern_height;
    return params;
}

/* A parameter of a type, or of type 0 where it is not enabled. */
#define TL_OF(params, type, name) \
    ((params)->yarn_types[(params)->yarn_types[type].name##_enabled ? (type) : 0].name)

static void tl_set(selvedge_fabric *fabric, uint32_t yarn, const char *name, double r, double g, double b)
{
    uint32_t index = 0;
    selvedge_parameter parameter;
    double value[3];

    memset(&parameter, 0, sizeof parameter);
    parameter.struct_size = sizeof parameter;
    value[0] = r, value[1] = g, value[2] = b;
    if (selvedge_parameter_find(name, NULL, 0, &index) != SELVEDGE_STATUS_OK ||
        selvedge_parameter_describe(index, NULL, 0, &parameter) != SELVEDGE_STATUS_OK)
        return;
    for (int k = 0; k < 3; k++)
        value[k] = fmin(fmax(value[k], parameter.low), parameter.high);
    selvedge_fabric_set_value(fabric, yarn, index, value, NULL, 0);
}

/* The types of ends and picks, as far as they are on top somewhere; else 0. */
static void tl_types_of_threads(const tlWeaveParameters *params, uint32_t *ends, uint32_t *picks)
{
    memset(ends, 0, params->pattern_width * sizeof *ends);
    memset(picks, 0, params->pattern_height * sizeof *picks);
    for (size_t i = (size_t)params->pattern_width * params->pattern_height; i-- > 0;) {
        const PatternEntry entry = params->pattern[i];
        *(entry.warp_above ? &ends[i % params->pattern_width] : &picks[i / params->pattern_width]) =
            entry.yarn_type;
    }
}

/* The fabric of the parameters; type_of_yarn tells the type of each of its yarns. */
static selvedge_fabric *tl_fabric(const tlWeaveParameters *params, uint32_t *type_of_yarn)
{
    const uint32_t width = params->pattern_width, height = params->pattern_height;
    uint32_t *types = (uint32_t *)malloc(2 * ((size_t)width + height) * sizeof *types);
    uint8_t *up = (uint8_t *)malloc((size_t)width * height);
    /* An override for each type keeps types of one look apart. */
    char *json = (char *)malloc(64 + 32 * (size_t)params->num_yarn_types);
    selvedge_pattern pattern;
    selvedge_draft *draft = NULL;
    selvedge_fabric *fabric = NULL;

    if (types != NULL && up != NULL && json != NULL) {
        size_t length = (size_t)sprintf(json, "{\"overrides\": [");
        for (uint32_t i = 0; i < params->num_yarn_types; i++)
            length += (size_t)sprintf(json + length, "%s{\"color\": %u}", i ? ", " : "", i);
        length += (size_t)sprintf(json + length, "]}");
        tl_types_of_threads(params, types, types + width);
        for (size_t i = 0; i < (size_t)width * height; i++)
            up[i] = params->pattern[i].warp_above;
        memset(&pattern, 0, sizeof pattern);
        pattern.struct_size = sizeof pattern;
        pattern.ends = width;
        pattern.picks = height;
        pattern.warp_up = up;
        pattern.end_types = types;
        pattern.pick_types = types + width;
        pattern.end_pitch = (double)params->pattern_realwidth / width;
        pattern.pick_pitch = (double)params->pattern_realheight / height;
        if (selvedge_draft_from_pattern(&pattern, NULL, 0, &draft) == SELVEDGE_STATUS_OK)
            selvedge_fabric_new(draft, json, length, NULL, 0, &fabric);
        selvedge_draft_free(draft);
    }
    if (fabric != NULL) {
        uint32_t *yarns = types + width + height;
        selvedge_fabric_yarns(fabric, 0, width, NULL, 0, yarns);
        selvedge_fabric_yarns(fabric, 1, height, NULL, 0, yarns + width);
        for (size_t i = 0; i < (size_t)width + height; i++)
            type_of_yarn[yarns[i]] = types[i];
    }
    free(types);
    free(up);
    free(json);
    return fabric;
}

void tl_prepare(tlWeaveParameters *params)
{
    uint32_t *type_of_yarn = (uint32_t *)calloc(params->num_yarn_types, sizeof *type_of_yarn);
    selvedge_fabric *fabric = type_of_yarn != NULL ? tl_fabric(params, type_of_yarn) : NULL;
    selvedge_fabric_info info;

    selvedge_shader_free(params->shader);
    free(params->type_of_yarn);
    params->shader = NULL;
    params->type_of_yarn = type_of_yarn;
    memset(&info, 0, sizeof info);
    info.struct_size = sizeof info;
    if (selvedge_fabric_describe(fabric, NULL, 0, &info) != SELVEDGE_STATUS_OK)
        return;
    tl_set(fabric, 0, "mapping", 1, 0, 0);
    tl_set(fabric, 0, "combination", 1, 0, 0);
    for (uint32_t yarn = 0; yarn < info.yarns; yarn++) {
        const uint32_t type = type_of_yarn[yarn];
        const tlColor color = TL_OF(params, type, color);
        const tlColor specular = TL_OF(params, type, specular_color);
        const double amount = TL_OF(params, type, color_amount);
        const double strength = TL_OF(params, type, specular_amount);
        tl_set(fabric, yarn, "highlight", 0, 0, 0);
        tl_set(fabric, yarn, "u_max", TL_OF(params, type, umax), 0, 0);
        tl_set(fabric, yarn, "size", TL_OF(params, type, yarnsize), 0, 0);
        tl_set(fabric, yarn, "psi", TL_OF(params, type, psi), 0, 0);
        tl_set(fabric, yarn, "alpha", TL_OF(params, type, alpha), 0, 0);
        tl_set(fabric, yarn, "beta", TL_OF(params, type, beta), 0, 0);
        tl_set(fabric, yarn, "delta", TL_OF(params, type, delta_x), 0, 0);
        tl_set(fabric, yarn, "noise.intensity", TL_OF(params, type, specular_noise), 0, 0);
        tl_set(fabric, yarn, "color", amount * color.r, amount * color.g, amount * color.b);
        tl_set(fabric, yarn, "specular", strength * specular.r, strength * specular.g,
               strength * specular.b);
    }
    selvedge_shader_new(fabric, NULL, 0, &params->shader);
    selvedge_fabric_free(fabric);
}

/* The position in metres; cells from uv = 0 in `cell`. */
static void tl_place(tlIntersectionData at, const tlWeaveParameters *params, double uv[2], double cell[2])
{
    const double angle = params->uvrotation * TL_PI / 180.0, c = cos(angle), s = sin(angle);
    const double u = (at.uv_x * c - at.uv_y * s) * params->uscale;
    const double v = (at.uv_x * s + at.uv_y * c) * params->vscale;
    uv[0] = params->realworld_uv ? u : u * params->pattern_realwidth;
    uv[1] = params->realworld_uv ? v : v * params->pattern_realheight;
    cell[0] = floor(uv[0] / params->pattern_realwidth * params->pattern_width);
    cell[1] = floor(uv[1] / params->pattern_realheight * params->pattern_height);
}

tlPatternData tl_get_pattern_data(tlIntersectionData at, const tlWeaveParameters *params)
{
    tlPatternData data;
    selvedge_yarn_point point;
    double uv[2], cell[2];

    memset(&data, 0, sizeof data);
    memset(&point, 0, sizeof point);
    point.struct_size = sizeof point;
    tl_place(at, params, uv, cell);
    data.total_index_x = (uint32_t)(int64_t)fmin(fmax(cell[0], -9e18), 9e18);
    data.total_index_y = (uint32_t)(int64_t)fmin(fmax(cell[1], -9e18), 9e18);
    if (selvedge_shader_yarn_at(params->shader, uv, &point) != SELVEDGE_STATUS_OK ||
        point.kind == SELVEDGE_YARN_KIND_GAP)
        return data;
    data.normal_x = (float)point.normal[0];
    data.normal_y = (float)point.normal[1];
    data.normal_z = (float)point.normal[2];
    data.u = (float)point.u;
    data.v = (float)point.v;
    data.length = (float)(2.0 * point.length);
    data.width = (float)(2.0 * point.width);
    data.x = (float)point.x;
    data.y = (float)point.y;
    data.yarn_type = (uint8_t)params->type_of_yarn[point.yarn];
    data.yarn_hit = 1;
    data.warp_above = (uint8_t)point.is_warp;
    data.ext_between_parallel = point.kind == SELVEDGE_YARN_KIND_BETWEEN;
    return data;
}

/* pi times the lobes at a point; black before tl_prepare. */
static void tl_lobes(tlIntersectionData at, tlPatternData data, const tlWeaveParameters *params,
                     tlColor *specular, tlColor *diffuse)
{
    float wi[3], wo[3], lobes[2][3] = {{0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}};
    double uv[2], cell[2];

    wi[0] = at.wi_x, wi[1] = at.wi_y, wi[2] = at.wi_z;
    wo[0] = at.wo_x, wo[1] = at.wo_y, wo[2] = at.wo_z;
    tl_place(at, params, uv, cell);
    selvedge_shader_eval_lobes(params->shader, uv, 0.0f, wi, wo, lobes[0], lobes[1]);
    for (int k = 0; k < 6; k++)
        lobes[k / 3][k % 3] *= (float)TL_PI;
#ifndef TL_NO_TEXTURE_CALLBACKS
    if (data.yarn_hit) {
        const tlYarnType *type = &params->yarn_types[data.yarn_type];
        const tlYarnType *own = type->color_enabled ? type : params->yarn_types;
        if (own->color_texmap != NULL) {
            /* The diffuse lobe is in proportion to the colour of the yarn. */
            const tlColor texture = tl_eval_texmap_color(own->color_texmap, at.context);
            const float amount = TL_OF(params, data.yarn_type, color_amount);
            const float to[3] = {texture.r, texture.g, texture.b};
            const float from[3] = {own->color.r, own->color.g, own->color.b};
            for (int k = 0; k < 3; k++) {
                const float shaded = fminf(amount * from[k], 1.0f);
                lobes[1][k] = shaded > 0.0f ? lobes[1][k] / shaded * fminf(amount * to[k], 1.0f) : 0.0f;
            }
        }
    }
#else
    (void)data;
#endif
    specular->r = lobes[0][0], specular->g = lobes[0][1], specular->b = lobes[0][2];
    diffuse->r = lobes[1][0], diffuse->g = lobes[1][1], diffuse->b = lobes[1][2];
}

tlColor tl_eval_diffuse(tlIntersectionData at, tlPatternData data, const tlWeaveParameters *params)
{
    tlColor specular, diffuse;
    tl_lobes(at, data, params, &specular, &diffuse);
    return diffuse;
}

tlColor tl_eval_specular(tlIntersectionData at, tlPatternData data, const tlWeaveParameters *params)
{
    tlColor specular, diffuse;
    tl_lobes(at, data, params, &specular, &diffuse);
    return specular;
}

float tl_eval_opacity(tlIntersectionData at, tlPatternData data, const tlWeaveParameters *params)
{
    double uv[2], cell[2];
    float opacity = 0.0f;
    (void)data;
    tl_place(at, params, uv, cell);
    selvedge_shader_opacity(params->shader, uv, 0.0f, &opacity);
    return opacity;
}

tlColor tl_shade(tlIntersectionData at, const tlWeaveParameters *params)
{
    const float cosine = fabsf(at.wi_z);
    tlColor specular, sum;
    tl_lobes(at, tl_get_pattern_data(at, params), params, &specular, &sum);
    sum.r = cosine * (sum.r + specular.r);
    sum.g = cosine * (sum.g + specular.g);
    sum.b = cosine * (sum.b + specular.b);
    return sum;
}

void tl_free_weave_parameters(tlWeaveParameters *params)
{
    if (params == NULL)
        return;
    selvedge_shader_free(params->shader);
    free(params->type_of_yarn);
    free(params->yarn_types);
    free(params->pattern);
    free(params);
}

#endif /* TL_THUNDERLOOM_IMPLEMENTATION */

#endif /* THUNDERLOOM_H */
