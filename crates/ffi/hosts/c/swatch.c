/* Renders a flat swatch of a fabric or draft, seen from above and lit from one side, to a PPM:
 *     swatch denim.json denim.ppm [MILLIMETRES]                                               */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "selvedge.h"

enum { SIZE = 400, SAMPLES = 16 };

/* The sRGB code of a linear value. */
static unsigned char encode(double linear)
{
    const double x = fmin(fmax(linear, 0.0), 1.0);
    const double y = x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1.0 / 2.4) - 0.055;
    return (unsigned char)(255.0 * y + 0.5);
}

/* Shades one row of pixels, each by points evenly spread over it, in one call. */
static selvedge_status shade(const selvedge_shader *shader, double pixel, int row, unsigned char *out,
                             char *message, size_t message_size)
{
    static double uv[SIZE * SAMPLES][2];
    static float f[SIZE * SAMPLES][3];
    const float wi[3] = {-0.48f, 0.36f, 0.8f}, wo[3] = {0.0f, 0.0f, 1.0f};
    const double light = 3.0; /* irradiance over the cosine */
    const selvedge_vectors_out to = {{&f[0][0], &f[0][1], &f[0][2]}, sizeof f[0]};
    selvedge_points points = {0};
    selvedge_status status;

    points.struct_size = sizeof points;
    points.count = SIZE * SAMPLES;
    points.uv = (selvedge_positions){{&uv[0][0], &uv[0][1]}, sizeof uv[0]};
    points.wi = (selvedge_vectors){{&wi[0], &wi[1], &wi[2]}, 0};
    points.wo = (selvedge_vectors){{&wo[0], &wo[1], &wo[2]}, 0};
    for (int i = 0; i < SIZE * SAMPLES; i++) {
        uv[i][0] = pixel * (i / SAMPLES + (i % 4 + 0.5) / 4);
        uv[i][1] = pixel * (SIZE - 1 - row + (i / 4 % 4 + 0.5) / 4);
    }
    status = selvedge_shader_eval_batch(shader, &points, message, message_size, &to);
    for (int i = 0; i < SIZE * 3 && status == SELVEDGE_STATUS_OK; i++) {
        double sum = 0.0;
        for (int s = 0; s < SAMPLES; s++)
            sum += f[i / 3 * SAMPLES + s][i % 3];
        out[i] = encode(light * wi[2] * sum / SAMPLES);
    }
    return status;
}

int main(int argc, char **argv)
{
    static unsigned char picture[SIZE][SIZE * 3];
    const double side = argc > 3 ? 1e-3 * atof(argv[3]) : 0.01;
    char message[512] = "usage: swatch FABRIC.json|DRAFT.wif OUT.ppm [MILLIMETRES]";
    selvedge_fabric *fabric = NULL;
    const selvedge_shader *shader = NULL;
    selvedge_status status = SELVEDGE_STATUS_INVALID_ARGUMENT;
    FILE *file;

    if (argc > 2 && side > 0.0)
        status = selvedge_fabric_load(argv[1], message, sizeof message, &fabric);
    if (status == SELVEDGE_STATUS_OK)
        status = selvedge_shader_new(fabric, message, sizeof message, &shader);
    for (int row = 0; row < SIZE && status == SELVEDGE_STATUS_OK; row++)
        status = shade(shader, side / SIZE, row, picture[row], message, sizeof message);
    selvedge_shader_free(shader);
    selvedge_fabric_free(fabric);
    file = status == SELVEDGE_STATUS_OK ? fopen(argv[2], "wb") : NULL;
    if (file == NULL || fprintf(file, "P6 %d %d 255\n", SIZE, SIZE) < 0 ||
        fwrite(picture, sizeof picture, 1, file) != 1 || fclose(file) != 0) {
        fprintf(stderr, "swatch: %s\n", message[0] ? message : "cannot write the picture");
        return 1;
    }
    return 0;
}
