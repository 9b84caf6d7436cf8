/* A program as the comments of thunderloom.h describe one: a pattern from a file, whose path is the argument,
 * and one from memory, with a texture; pieces of yarn, lobes, opacity. */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TL_THUNDERLOOM_IMPLEMENTATION
#include "../../hosts/thunderloom/thunderloom.h"

#define CHECK(condition)                                                    \
    do {                                                                    \
        if (!(condition)) {                                                 \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
            exit(1);                                                        \
        }                                                                   \
    } while (0)

tlColor tl_eval_texmap_color(void *texmap, void *context)
{
    const float scale = *(const float *)context;
    tlColor color = *(const tlColor *)texmap;
    color.r *= scale;
    color.g *= scale;
    color.b *= scale;
    return color;
}

static int near_to(float found, double expected) { return fabs((double)found - expected) < 1e-5; }

/* The point in the middle of a part of a cell: uv of one repeat. */
static tlIntersectionData at(const tlWeaveParameters *params, double x, double y)
{
    tlIntersectionData point;
    memset(&point, 0, sizeof point);
    point.uv_x = (float)(x / params->pattern_width);
    point.uv_y = (float)(y / params->pattern_height);
    point.wi_y = 0.6f;
    point.wi_z = 0.8f;
    point.wo_z = 1.0f;
    return point;
}

static void memory(void)
{
    /* A twill, two up and one down: end i is on top of picks i and i + 1. */
    const uint8_t up[9] = {1, 0, 1, 1, 1, 0, 0, 1, 1}, types[9] = {0, 1, 0, 0, 0, 1, 1, 0, 0};
    const tlColor colors[2] = {{0.5f, 0.25f, 0.1f}, {0.1f, 0.2f, 0.6f}};
    tlWeaveParameters *params = tl_weave_pattern_from_data(up, types, 2, colors, 3, 3);
    tlIntersectionData point;
    tlPatternData data;
    tlColor diffuse, specular, both, textured, texture = {0.25f, 0.25f, 0.1f};
    float scale = 0.5f;

    CHECK(params != NULL && params->num_yarn_types == 2 && params->pattern_width == 3);
    CHECK(near_to(params->yarn_types[0].umax, 0.5) && near_to(params->yarn_types[0].psi, 0.5));
    tl_prepare(params);
    CHECK(params->shader != NULL);

    /* End 1 is on top of picks 1 and 2: two cells, of which this is the first quarter of the second. */
    point = at(params, 1.75, 2.25);
    data = tl_get_pattern_data(point, params);
    CHECK(data.yarn_hit && data.warp_above && data.yarn_type == 0 && !data.ext_between_parallel);
    CHECK(near_to(data.length, 4.0) && near_to(data.width, 2.0));
    CHECK(near_to(data.x, 0.5) && near_to(data.y, 0.25));
    CHECK(near_to(data.u, 0.25 * 0.5) && near_to(data.v, 0.25 * TL_PI));
    CHECK(near_to(data.normal_x, sin(0.25 * TL_PI)));
    CHECK(data.total_index_x == 1 && data.total_index_y == 2);
    /* Pick 0 is on top of end 1 alone; across a weft, x runs against v. */
    data = tl_get_pattern_data(at(params, 1.25, 0.75), params);
    CHECK(!data.warp_above && data.yarn_type == 1 && near_to(data.length, 2.0));
    CHECK(near_to(data.x, -0.5) && near_to(data.y, -0.5));
    /* Three hundred repeats away it is the same. */
    point = at(params, 901.25, -899.25);
    data = tl_get_pattern_data(point, params);
    CHECK(!data.warp_above && fabs(data.x + 0.5) < 1e-3 && data.total_index_y == (uint32_t)-900);

    point = at(params, 1.5, 2.0);
    data = tl_get_pattern_data(point, params);
    diffuse = tl_eval_diffuse(point, data, params);
    specular = tl_eval_specular(point, data, params);
    both = tl_shade(point, params);
    CHECK(diffuse.r > diffuse.g && diffuse.g > diffuse.b && diffuse.b > 0.0f && specular.r >= 0.0f);
    CHECK(near_to(both.r, 0.8 * (diffuse.r + specular.r)));
    /* (1 - k) of the colour: the highlight has 0.4. */
    CHECK(near_to(diffuse.r, 0.6 * 0.5) && near_to(diffuse.b, 0.6 * 0.1));
    CHECK(near_to(tl_eval_opacity(point, data, params), 1.0));

    params->yarn_types[0].color_texmap = &texture;
    point.context = &scale;
    textured = tl_eval_diffuse(point, data, params);
    CHECK(near_to(textured.r, diffuse.r * 0.25) && near_to(textured.b, diffuse.b * 0.5));
    params->yarn_types[0].color_texmap = NULL;

    params->yarn_types[0].yarnsize = 0.5f;
    tl_prepare(params);
    data = tl_get_pattern_data(at(params, 1.5, 2.0), params);
    CHECK(near_to(data.width, 1.0) && near_to(data.length, 2.0 * (2.0 + 0.25 + 0.25)));
    point = at(params, 0.02, 0.02);
    data = tl_get_pattern_data(point, params);
    CHECK(!data.yarn_hit && tl_eval_opacity(point, data, params) == 0.0f);
    CHECK(tl_shade(point, params).r == 0.0f);
    tl_free_weave_parameters(params);
}

static void files(const char *path)
{
    const char *error = NULL;
    tlWeaveParameters *params = tl_weave_pattern_from_file("no such file", &error);
    CHECK(params == NULL && error != NULL && strstr(error, "cannot be read") != NULL);
    error = NULL;
    params = tl_weave_pattern_from_file(path, &error);
    CHECK(params != NULL && error == NULL && params->num_yarn_types >= 2);
    CHECK(params->yarn_types[1].color_enabled && params->pattern_realwidth > 0.0f);
    /* Before it is prepared nothing is seen. */
    CHECK(tl_shade(at(params, 0.5, 0.5), params).r == 0.0f);
    params->uvrotation = 90.0f;
    tl_prepare(params);
    CHECK(tl_shade(at(params, 0.5, 0.5), params).g > 0.0f);
    tl_free_weave_parameters(params);
    tl_free_weave_parameters(NULL);
    CHECK(tl_weave_pattern_from_data(NULL, NULL, 0, NULL, 0, 0) == NULL);
}

int main(int argc, char **argv)
{
    CHECK(argc == 2);
    memory();
    files(argv[1]);
    return 0;
}
