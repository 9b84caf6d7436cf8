/*
 * Woven-cloth shading for any renderer: the C interface of Selvedge.
 *
 * A WIF file or a pattern in memory is a `selvedge_draft`; woven of yarn it is a `selvedge_fabric`,
 * whose parameters can be listed, read and set; and prepared, a `selvedge_shader`, which answers how
 * the cloth reflects light, at one point or at many:
 *
 * ```c
 * char message[256];
 * selvedge_fabric *fabric = NULL;
 * const selvedge_shader *shader = NULL;
 * if (selvedge_fabric_load("denim.json", message, sizeof message, &fabric) ||
 *     selvedge_shader_new(fabric, message, sizeof message, &shader)) {
 *     fprintf(stderr, "%s\n", message);
 * } else {
 *     const double uv[2] = {0.0010, 0.0025};
 *     const float wi[3] = {0.6f, 0.0f, 0.8f}, wo[3] = {0.0f, 0.0f, 1.0f};
 *     float f[3];
 *     selvedge_shader_eval(shader, uv, 0.0f, wi, wo, f);
 * }
 * selvedge_shader_free(shader);
 * selvedge_fabric_free(fabric);
 * ```
 *
 * `cargo build --release -p selvedge-ffi` makes the libraries, to be linked, on Linux, with
 *
 * ```text
 * cc program.c -Icrates/ffi/include target/release/libselvedge.a -lpthread -ldl -lm
 * cc program.c -Icrates/ffi/include -Ltarget/release -lselvedge
 * ```
 *
 * # Ownership
 *
 * - What a `_new` function returns belongs to the caller, who passes it once to the `_free`
 *   function of its type, and to no other deallocator. Freeing NULL does nothing.
 * - A shader has as many owners as `selvedge_shader_new` and `selvedge_shader_share` have made;
 *   each frees it once.
 * - Every other pointer is lent for the call: nothing of the caller's is kept, changed or
 *   freed, but the function and the `user` of a texture. A fabric keeps nothing of its draft and a
 *   shader nothing of its fabric, which may be freed before it.
 * - A returned string is static and belongs to the library.
 * - A struct begins with `struct_size`, which the caller sets to its `sizeof`, also where the
 *   library writes it. Another size is a failure: such a caller was compiled with another header.
 *
 * # Failure
 *
 * - Functions that can fail return a `selvedge_status`; everything but `SELVEDGE_STATUS_OK`,
 *   which is 0, is a failure, also a code that this header does not know yet.
 * - Outputs are the last arguments; on failure they are as they were, but for those of many points
 *   after `SELVEDGE_STATUS_PANIC`.
 * - `message` is a buffer of `message_size` bytes, its terminating NUL included. A failure
 *   writes its reason there, UTF-8, cut between two characters where the buffer is too short;
 *   a success writes the empty string. 256 bytes suffice for most reasons. NULL, or a size of 0,
 *   asks for no text.
 * - NULL for any other pointer is a failure, never a crash. Pointers that are neither NULL nor
 *   what the function asks for cannot be recognised.
 * - A defect of the library becomes `SELVEDGE_STATUS_PANIC` and does not unwind into the
 *   caller; the Rust run time names it on standard error, where nothing else is ever printed.
 *   Running out of memory ends the process.
 *
 * # Threads
 *
 * There is no global state. Drafts and shaders never change once made: any number of threads may use
 * one at the same time, without a lock. A fabric may be read by many threads, or changed by one while
 * no other uses it. Freeing must come after every use.
 *
 * # Frame and units
 *
 * Positions `uv` are metres along the cloth from the outer edge of end 1 and pick 1: `u` along
 * the weft, `v` along the warp; any values, since the draft repeats. Directions are unit
 * vectors pointing away from the surface, `wi` to the light and `wo` to the viewer, in the
 * shading frame: x = dP/du along the weft, y = dP/dv along the warp, z the normal of the face.
 * Colours are linear, with the primaries of sRGB.
 *
 * No value contains a cosine but the weight of a sample, which contains that of `wi`: light that
 * arrives from `wi` with the radiance L adds f L |wi.z| to what is seen from `wo`.
 */

/* Generated from the Rust sources by `BLESS=1 cargo test -p selvedge-ffi`. */

#ifndef SELVEDGE_H
#define SELVEDGE_H

#include <stddef.h>
#include <stdint.h>

/**
 * The type of a thread that has none.
 */
#define SELVEDGE_NO_TYPE UINT32_MAX

/**
 * The version of the interface that this header describes: the generation in the upper 16
 * bits, the number of additions since its start in the lower 16.
 */
#define SELVEDGE_ABI_VERSION (1 << 16)

/**
 * How a call ended. The numbers never change their meaning.
 */
enum selvedge_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * The call did what was asked.
   */
  SELVEDGE_STATUS_OK = 0,
  /**
   * A pointer that must not be NULL is.
   */
  SELVEDGE_STATUS_NULL_POINTER = 1,
  /**
   * A number is outside the range that the function names.
   */
  SELVEDGE_STATUS_INVALID_ARGUMENT = 2,
  /**
   * The bytes are not a draft that can be read, or the draft lacks what weaving takes.
   */
  SELVEDGE_STATUS_INVALID_DRAFT = 3,
  /**
   * The draft weaves, but not into a cloth that can be shaded.
   */
  SELVEDGE_STATUS_INVALID_CLOTH = 4,
  /**
   * A defect of the library.
   */
  SELVEDGE_STATUS_PANIC = 5,
  /**
   * A file cannot be read.
   */
  SELVEDGE_STATUS_UNREADABLE = 6,
  /**
   * The text is not a fabric.
   */
  SELVEDGE_STATUS_INVALID_FABRIC = 7,
  /**
   * The yarn has no such parameter: its highlight or phase function is of another kind.
   */
  SELVEDGE_STATUS_ABSENT = 8,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum selvedge_status selvedge_status;
#else
typedef uint32_t selvedge_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * What the value of a parameter is. The numbers never change their meaning.
 */
enum selvedge_parameter_kind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * One number.
   */
  SELVEDGE_PARAMETER_KIND_NUMBER = 0,
  /**
   * Three numbers: linear red, green and blue with the primaries of sRGB.
   */
  SELVEDGE_PARAMETER_KIND_COLOR = 1,
  /**
   * The index of one of its choices.
   */
  SELVEDGE_PARAMETER_KIND_CHOICE = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum selvedge_parameter_kind selvedge_parameter_kind;
#else
typedef uint32_t selvedge_parameter_kind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * How a piece of yarn comes to be seen. The numbers never change their meaning.
 */
enum selvedge_yarn_kind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * There is no yarn.
   */
  SELVEDGE_YARN_KIND_GAP = 0,
  /**
   * It is on top of the crossing.
   */
  SELVEDGE_YARN_KIND_TOP = 1,
  /**
   * It dips here under the one on top of the crossing.
   */
  SELVEDGE_YARN_KIND_EXTENSION = 2,
  /**
   * It shows in the slit between two parallel yarns that cover it: straight.
   */
  SELVEDGE_YARN_KIND_BETWEEN = 3,
  /**
   * It is never covered: straight, one repeat long.
   */
  SELVEDGE_YARN_KIND_ENDLESS = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum selvedge_yarn_kind selvedge_yarn_kind;
#else
typedef uint32_t selvedge_yarn_kind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * The lobes of the BRDF. The numbers never change their meaning.
 */
enum selvedge_lobes
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * Both, whose sum is the BRDF.
   */
  SELVEDGE_LOBES_BOTH = 0,
  /**
   * The highlight, which the fibres mirror.
   */
  SELVEDGE_LOBES_SPECULAR = 1,
  /**
   * The diffuse reflection.
   */
  SELVEDGE_LOBES_DIFFUSE = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum selvedge_lobes selvedge_lobes;
#else
typedef uint32_t selvedge_lobes;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * The sides of the cloth. The numbers never change their meaning.
 */
enum selvedge_sides
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * Both reflect: behind, each crossing shows its other thread.
   */
  SELVEDGE_SIDES_BOTH = 0,
  /**
   * The face alone; the back is black.
   */
  SELVEDGE_SIDES_FACE = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum selvedge_sides selvedge_sides;
#else
typedef uint32_t selvedge_sides;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * A weaving draft: how threads interlace, with their colours and sizes.
 *
 * Never changes; any number of threads may use one at the same time.
 */
typedef struct selvedge_draft selvedge_draft;

/**
 * A draft woven of yarn whose parameters can be read and set, until shaders are made of it.
 *
 * Any number of threads may read one at the same time; while one changes it, no other may use it.
 */
typedef struct selvedge_fabric selvedge_fabric;

/**
 * Cloth ready to be shaded, counted by references.
 *
 * Never changes; any number of threads may use one at the same time.
 */
typedef struct selvedge_shader selvedge_shader;

/**
 * A weave and its threads, for those who have no WIF file. Numbering is that of the cloth: end 0 at
 * u = 0, pick 0 at v = 0. Every pointer but `warp_up` may be NULL, which leaves open what it tells.
 */
typedef struct selvedge_pattern {
  /**
   * `sizeof(selvedge_pattern)`.
   */
  size_t struct_size;
  /**
   * Ends, the threads of the warp; at least 1.
   */
  uint32_t ends;
  /**
   * Picks, the threads of the weft; at least 1.
   */
  uint32_t picks;
  /**
   * For each pick, for each end: 0 if the pick is on top of their crossing, else the end.
   */
  const uint8_t *warp_up;
  /**
   * Number of each end's type, which a fabric can give yarn of its own (`"color"` in its
   * overrides), or `SELVEDGE_NO_TYPE`.
   */
  const uint32_t *end_types;
  /**
   * As `end_types`, of the picks.
   */
  const uint32_t *pick_types;
  /**
   * Colour of each end, three numbers for each: linear red, green and blue with the primaries of
   * sRGB, each in [0, 1]. Open, all is black.
   */
  const float *end_colors;
  /**
   * As `end_colors`, of the picks.
   */
  const float *pick_colors;
  /**
   * Distance between the middles of neighbouring ends, m; 0 leaves it open.
   */
  double end_pitch;
  /**
   * As `end_pitch`, of the picks.
   */
  double pick_pitch;
  /**
   * Diameter of each end, m; 0 leaves that of one thread open.
   */
  const double *end_diameters;
  /**
   * As `end_diameters`, of the picks.
   */
  const double *pick_diameters;
} selvedge_pattern;

/**
 * The size of a fabric.
 */
typedef struct selvedge_fabric_info {
  /**
   * `sizeof(selvedge_fabric_info)`, set by the caller.
   */
  size_t struct_size;
  /**
   * Ends in the repeat, the threads of the warp.
   */
  uint32_t ends;
  /**
   * Picks in the repeat, the threads of the weft.
   */
  uint32_t picks;
  /**
   * Types of yarn, counted from 0.
   */
  uint32_t yarns;
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * Extent of one repeat along the weft, m, before rotation and scale.
   */
  double width;
  /**
   * Extent of one repeat along the warp, m, before rotation and scale.
   */
  double height;
} selvedge_fabric_info;

/**
 * What a parameter is, for a panel. Texts are ASCII and end with a NUL.
 */
typedef struct selvedge_parameter {
  /**
   * `sizeof(selvedge_parameter)`, set by the caller.
   */
  size_t struct_size;
  /**
   * As in files and messages; it never changes, where the index may with a later library.
   */
  char name[32];
  /**
   * What it is, in a few words.
   */
  char meaning[96];
  /**
   * Its unit; empty for a pure number.
   */
  char unit[8];
  /**
   * The names of a choice's values 0, 1, ..., with a `|` between two; empty if it is none.
   */
  char choices[64];
  /**
   * A `selvedge_parameter_kind`: whether it is one number, a colour of three, or a choice.
   */
  uint32_t kind;
  /**
   * 1 if it is one of the cloth as a whole, 0 if each type of yarn has its own.
   */
  uint32_t is_of_cloth;
  /**
   * The least value of each number.
   */
  double low;
  /**
   * The greatest value of each number.
   */
  double high;
  /**
   * The value where nothing is said.
   */
  double default_value[3];
} selvedge_parameter;

/**
 * A place of the cloth's face, as a renderer may want to show it.
 */
typedef struct selvedge_yarn_point {
  /**
   * `sizeof(selvedge_yarn_point)`, set by the caller.
   */
  size_t struct_size;
  /**
   * A `selvedge_yarn_kind`. In a gap all else is 0.
   */
  uint32_t kind;
  /**
   * 1 if the yarn is an end, 0 if it is a pick.
   */
  uint32_t is_warp;
  /**
   * Index of its type.
   */
  uint32_t yarn;
  /**
   * The thread's index within the repeat, from 0.
   */
  uint32_t thread;
  /**
   * Number of crossings that the piece is on top of; 0 between two threads, those of one repeat on
   * an endless thread.
   */
  uint32_t crossings;
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * The thread's index over all repeats.
   */
  int64_t line;
  /**
   * Index over all repeats of the thread at the first of these crossings.
   */
  int64_t first;
  /**
   * Position across the yarn, in [-1, 1], in the yarn frame.
   */
  double x;
  /**
   * Position along the piece, in [-1, 1], in the yarn frame.
   */
  double y;
  /**
   * Length of the piece, in cells.
   */
  double length;
  /**
   * Width of the yarn, in cells.
   */
  double width;
  /**
   * Inclination along the arc, rad.
   */
  double u;
  /**
   * Angle around the section, rad.
   */
  double v;
  /**
   * Normal of the yarn, unit, in the shading frame.
   */
  double normal[3];
  /**
   * Tangent of the fibres, unit, in the shading frame.
   */
  double tangent[3];
} selvedge_yarn_point;

/**
 * Pairs of numbers, each component with a pointer of its own, so that both arrays of structures
 * (`{p, p + 1}`, stride `2 * sizeof(double)`) and structures of arrays (`{u, v}`, stride
 * `sizeof(double)`) are told without a copy.
 */
typedef struct selvedge_positions {
  /**
   * Of the first point.
   */
  const double *component[2];
  /**
   * Bytes from one point to the next, of any alignment; 0 gives all points the first.
   */
  ptrdiff_t stride;
} selvedge_positions;

/**
 * Vectors, each component with a pointer of its own.
 */
typedef struct selvedge_vectors {
  /**
   * Of the first point.
   */
  const float *component[3];
  /**
   * Bytes from one point to the next, of any alignment; 0 gives all points the first.
   */
  ptrdiff_t stride;
} selvedge_vectors;

/**
 * Numbers.
 */
typedef struct selvedge_numbers {
  /**
   * That of the first point.
   */
  const float *values;
  /**
   * Bytes from one point to the next, of any alignment; 0 gives all points the first.
   */
  ptrdiff_t stride;
} selvedge_numbers;

/**
 * Flags.
 */
typedef struct selvedge_flags {
  /**
   * That of the first point.
   */
  const uint8_t *values;
  /**
   * Bytes from one point to the next; 0 gives all points the first.
   */
  ptrdiff_t stride;
} selvedge_flags;

/**
 * Points to shade. What a function has no use for is not looked at; zero it.
 */
typedef struct selvedge_points {
  /**
   * `sizeof(selvedge_points)`.
   */
  size_t struct_size;
  /**
   * How many points there are.
   */
  size_t count;
  /**
   * Positions, m.
   */
  struct selvedge_positions uv;
  /**
   * Directions to the light.
   */
  struct selvedge_vectors wi;
  /**
   * Directions to the viewer.
   */
  struct selvedge_vectors wo;
  /**
   * The caller's random numbers in [0, 1), of which a sample takes three.
   */
  struct selvedge_vectors xi;
  /**
   * Width of what is seen at each point, m, as for `selvedge_shader_eval`; values of NULL stand for 0.
   */
  struct selvedge_numbers footprint;
  /**
   * Points whose flag is 0 are neither read nor written; values of NULL leave none out.
   */
  struct selvedge_flags active;
  /**
   * A `selvedge_lobes`: of which lobes f and the weights of samples are. Densities and albedos are
   * those of both.
   */
  uint32_t lobes;
  /**
   * A `selvedge_sides`: which sides of the cloth reflect.
   */
  uint32_t sides;
} selvedge_points;

/**
 * Where vectors go, each component with a pointer of its own.
 */
typedef struct selvedge_vectors_out {
  /**
   * Of the first point.
   */
  float *component[3];
  /**
   * Bytes from one point to the next, of any alignment.
   */
  ptrdiff_t stride;
} selvedge_vectors_out;

/**
 * Where numbers go.
 */
typedef struct selvedge_numbers_out {
  /**
   * Of the first point.
   */
  float *values;
  /**
   * Bytes from one point to the next, of any alignment.
   */
  ptrdiff_t stride;
} selvedge_numbers_out;

/**
 * What a shader is like.
 */
typedef struct selvedge_shader_info {
  /**
   * `sizeof(selvedge_shader_info)`, set by the caller.
   */
  size_t struct_size;
  /**
   * The memory it takes, bytes.
   */
  uint64_t bytes;
  /**
   * Types of yarn, counted from 0.
   */
  uint32_t yarns;
  /**
   * 1 if something may show between the yarns; if 0, no place has an opacity of 0 for that reason.
   */
  uint32_t has_gaps;
} selvedge_shader_info;

/**
 * By what the highlight of a type of yarn is scaled, so that it reflects no more than it receives, and
 * what that rests on.
 */
typedef struct selvedge_normalization {
  /**
   * `sizeof(selvedge_normalization)`, set by the caller.
   */
  size_t struct_size;
  /**
   * For pieces of yarn of endless length and for the shortest that bend as far as their yarn.
   */
  double factor[2];
  /**
   * The greatest albedos found, before scaling.
   */
  double max_albedo[2];
  /**
   * What the true ones are taken to be at most: 1 / `factor`.
   */
  double upper_bound[2];
} selvedge_normalization;

/**
 * Writes to `rgb` what a texture is at `uv`, metres along the weft and the warp, averaged over about
 * `footprint` metres: linear red, green and blue, or a number in the first.
 *
 * Equal arguments must give equal values. What is not in the texture's range is moved into it. It is
 * called by every thread that shades, at the same time, with the `user` that it was set with, and
 * must neither throw nor jump out.
 */
typedef void (*selvedge_texture_value)(void *user, const double *uv, double footprint, float *rgb);

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Reads the `length` bytes of a WIF file into `*draft`, which the caller frees with
 * `selvedge_draft_free`.
 *
 * What departs from the format is read past where it can be, and told by
 * `selvedge_draft_warnings`. Fails with `SELVEDGE_STATUS_INVALID_DRAFT` where no draft is left, or
 * it does not say how its threads interlace; `message` then says where in the file and why, in
 * three lines for each reason. Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` if `length` is more
 * than any object in memory can have, such as -1 from a file that could not be read.
 *
 * # Safety
 *
 * `bytes` is NULL or points to `length` bytes; `message` is NULL or points to `message_size`
 * bytes; `draft` is NULL or points to a pointer. Safe from any thread.
 */
selvedge_status selvedge_draft_new(const uint8_t *bytes,
                                   size_t length,
                                   char *message,
                                   size_t message_size,
                                   struct selvedge_draft **draft);

/**
 * As `selvedge_draft_new`, of the WIF file at `path`, which ends with a NUL and is UTF-8.
 *
 * Fails with `SELVEDGE_STATUS_UNREADABLE` if there is no file that can be read, or it is larger than
 * 256 MiB.
 *
 * # Safety
 *
 * `path` is NULL or points to bytes that end with a NUL; `message` is NULL or points to
 * `message_size` bytes; `draft` is NULL or points to a pointer. Safe from any thread.
 */
selvedge_status selvedge_draft_load(const char *path,
                                    char *message,
                                    size_t message_size,
                                    struct selvedge_draft **draft);

/**
 * Copies a weave and its threads into `*draft`, which the caller frees with `selvedge_draft_free`.
 *
 * Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` where a number is out of its range or not finite,
 * with `SELVEDGE_STATUS_INVALID_DRAFT` if there are no or more than 2^28 crossings.
 *
 * # Safety
 *
 * `pattern` is NULL or points to a pattern whose pointers are NULL or point to as many elements as
 * it tells; `message` is NULL or points to `message_size` bytes; `draft` is NULL or points to a
 * pointer. Safe from any thread.
 */
selvedge_status selvedge_draft_from_pattern(const struct selvedge_pattern *pattern,
                                            char *message,
                                            size_t message_size,
                                            struct selvedge_draft **draft);

/**
 * Writes to `*length` the bytes of what was odd about the draft's file, without the NUL, and to
 * `text` as much of it as fits: UTF-8, three lines for each warning; empty if nothing was.
 *
 * # Safety
 *
 * `draft` is NULL or a draft not freed; `text` is NULL or points to `text_size` bytes; `length` is
 * NULL or points to a number. Safe from any thread.
 */
selvedge_status selvedge_draft_warnings(const struct selvedge_draft *draft,
                                        char *text,
                                        size_t text_size,
                                        size_t *length);

/**
 * Frees a draft; NULL is nothing to free.
 *
 * # Safety
 *
 * `draft` is NULL or comes from a function that makes a draft, has not been freed, and is not used
 * by another thread.
 */
void selvedge_draft_free(struct selvedge_draft *draft);

/**
 * Weaves `draft` of the yarn that `json` describes into `*fabric`, which the caller frees with
 * `selvedge_fabric_free`. A `json` of NULL is the default fabric.
 *
 * Colours, distances and diameters of the threads are those of the draft where the fabric leaves
 * them open. The text is that of a fabric file, `{"yarn": {"psi": 0.5}, "overrides": [...]}`; its
 * `version` may be missing, its `draft` is not looked at. Fails with
 * `SELVEDGE_STATUS_INVALID_FABRIC` if it is none, with `SELVEDGE_STATUS_INVALID_CLOTH` if a
 * parameter is out of its range.
 *
 * # Safety
 *
 * `draft` is NULL or a draft not freed; `json` is NULL or points to `json_length` bytes; `message` is
 * NULL or points to `message_size` bytes; `fabric` is NULL or points to a pointer. Safe from any
 * thread.
 */
selvedge_status selvedge_fabric_new(const struct selvedge_draft *draft,
                                    const char *json,
                                    size_t json_length,
                                    char *message,
                                    size_t message_size,
                                    struct selvedge_fabric **fabric);

/**
 * As `selvedge_fabric_new`, of the file at `path`, which ends with a NUL and is UTF-8: a fabric with
 * its draft, or a draft alone, which is woven of the default yarn.
 *
 * The path of a fabric's draft starts where the fabric is. Fails with `SELVEDGE_STATUS_UNREADABLE`
 * if either file cannot be read, and as `selvedge_draft_new`.
 *
 * # Safety
 *
 * `path` is NULL or points to bytes that end with a NUL; `message` is NULL or points to
 * `message_size` bytes; `fabric` is NULL or points to a pointer. Safe from any thread.
 */
selvedge_status selvedge_fabric_load(const char *path,
                                     char *message,
                                     size_t message_size,
                                     struct selvedge_fabric **fabric);

/**
 * Writes to `*info`, whose `struct_size` the caller has set, how large the fabric is.
 *
 * # Safety
 *
 * `fabric` is NULL or a fabric not freed, which no thread changes; `message` is NULL or points to
 * `message_size` bytes; `info` is NULL or points to a struct that is as large as it says.
 */
selvedge_status selvedge_fabric_describe(const struct selvedge_fabric *fabric,
                                         char *message,
                                         size_t message_size,
                                         struct selvedge_fabric_info *info);

/**
 * Writes to `warp_up` for each pick, for each end of the repeat 1 if the end is on top of their
 * crossing, else 0.
 *
 * Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` unless `length` is the number of crossings.
 *
 * # Safety
 *
 * `fabric` is NULL or a fabric not freed, which no thread changes; `message` is NULL or points to
 * `message_size` bytes; `warp_up` is NULL or points to `length` bytes.
 */
selvedge_status selvedge_fabric_warp_up(const struct selvedge_fabric *fabric,
                                        size_t length,
                                        char *message,
                                        size_t message_size,
                                        uint8_t *warp_up);

/**
 * Writes to `yarns` the type of yarn of each end, or of each pick if `is_weft` is 1.
 *
 * Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` unless `length` is the number of these threads and
 * `is_weft` is 0 or 1.
 *
 * # Safety
 *
 * `fabric` is NULL or a fabric not freed, which no thread changes; `message` is NULL or points to
 * `message_size` bytes; `yarns` is NULL or points to `length` numbers.
 */
selvedge_status selvedge_fabric_yarns(const struct selvedge_fabric *fabric,
                                      uint32_t is_weft,
                                      size_t length,
                                      char *message,
                                      size_t message_size,
                                      uint32_t *yarns);

/**
 * Has shaders made of the fabric from now on scale the highlight of the type `yarn` as another shader of
 * the same fabric does, whose `selvedge_shader_divisors` these are, wherever it was made. A `length` of 0
 * has them find their own again.
 *
 * Whether there are as many as such a shader has, and all are positive and finite, is checked when one is
 * made.
 *
 * # Safety
 *
 * `fabric` is NULL or a fabric not freed, which no other thread uses; `divisors` is NULL or points to
 * `length` numbers; `message` is NULL or points to `message_size` bytes.
 */
selvedge_status selvedge_fabric_set_divisors(struct selvedge_fabric *fabric,
                                             uint32_t yarn,
                                             const float *divisors,
                                             size_t length,
                                             char *message,
                                             size_t message_size);

/**
 * Frees a fabric; NULL is nothing to free. Shaders made of it stay.
 *
 * # Safety
 *
 * `fabric` is NULL or comes from a function that makes a fabric, has not been freed, and is not used
 * by another thread.
 */
void selvedge_fabric_free(struct selvedge_fabric *fabric);

/**
 * The number of parameters.
 *
 * # Safety
 *
 * Takes no pointer; there is nothing to keep. Safe from any thread.
 */
uint32_t selvedge_parameter_count(void);

/**
 * Writes to `*parameter`, whose `struct_size` the caller has set, what the parameter `index` is:
 * those of yarn in the order in which a panel would show them, then those of the cloth.
 *
 * Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` if there are not that many.
 *
 * # Safety
 *
 * `parameter` is NULL or points to a struct that is as large as it says; `message` is NULL or points
 * to `message_size` bytes. Safe from any thread.
 */
selvedge_status selvedge_parameter_describe(uint32_t index,
                                            char *message,
                                            size_t message_size,
                                            struct selvedge_parameter *parameter);

/**
 * Writes to `*index` which parameter is called `name`, which ends with a NUL.
 *
 * Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` if none is.
 *
 * # Safety
 *
 * `name` is NULL or points to bytes that end with a NUL; `index` is NULL or points to a number;
 * `message` is NULL or points to `message_size` bytes. Safe from any thread.
 */
selvedge_status selvedge_parameter_find(const char *name,
                                        char *message,
                                        size_t message_size,
                                        uint32_t *index);

/**
 * Writes to `value` the parameter `index` of the type `yarn`, or of the cloth, where `yarn` is not
 * looked at: one number, or three of a colour, where all else is 0.
 *
 * Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` if there is no such parameter or type, with
 * `SELVEDGE_STATUS_ABSENT` if the type's highlight or phase function has no such parameter.
 *
 * # Safety
 *
 * `fabric` is NULL or a fabric not freed, which no thread changes; `value` is NULL or points to three
 * numbers; `message` is NULL or points to `message_size` bytes.
 *
 */
selvedge_status selvedge_fabric_value(const struct selvedge_fabric *fabric,
                                      uint32_t yarn,
                                      uint32_t index,
                                      char *message,
                                      size_t message_size,
                                      double value[3]);

/**
 * Sets the parameter `index` of the type `yarn`, or of the cloth, where `yarn` is not looked at, to
 * `value`: one number, or three of a colour.
 *
 * A choice of another highlight or phase function gives it its default numbers. Shaders made before
 * stay as they are. Fails as `selvedge_fabric_value`, and with `SELVEDGE_STATUS_INVALID_ARGUMENT` if
 * a number is not in the parameter's range.
 *
 * # Safety
 *
 * `fabric` is NULL or a fabric not freed, which no other thread uses; `value` is NULL or points to
 * three numbers; `message` is NULL or points to `message_size` bytes.
 *
 */
selvedge_status selvedge_fabric_set_value(struct selvedge_fabric *fabric,
                                          uint32_t yarn,
                                          uint32_t index,
                                          const double value[3],
                                          char *message,
                                          size_t message_size);

/**
 * Writes to `f` the BRDF at `uv` for light from `wi` seen from `wo`, in sr^-1, *without* the
 * cosine: linear red, green and blue, each finite and at least 0.
 *
 * Both directions above the surface show the face of the cloth, both below it the back. The
 * value is 0 in a gap between yarns, for one direction on each side or in the plane of the
 * cloth, and where a number is not finite. `f` may be the array of a direction.
 *
 * `footprint` is the width, m, of what a pixel sees there. Where it spans a few threads, so that they can
 * no longer be told apart, the mean over the repeat gradually takes over: it costs some microseconds and
 * saves the samples that would find it, and the mean over the cloth stays the same. 0 shades the point
 * itself, as does what is below 0 or no number. All calls for one sample get the same.
 *
 * # Safety
 *
 * `shader` is NULL or a shader not freed; `uv` is NULL or points to two numbers, `wi`, `wo` and
 * `f` are NULL or point to three. Safe from any thread.
 *
 */
selvedge_status selvedge_shader_eval(const struct selvedge_shader *shader,
                                     const double uv[2],
                                     float footprint,
                                     const float wi[3],
                                     const float wo[3],
                                     float f[3]);

/**
 * As `selvedge_shader_eval`, with the two lobes apart, whose sum it is: the highlight, which the
 * fibres mirror, and the diffuse reflection.
 *
 * # Safety
 *
 * As for `selvedge_shader_eval`; `specular` and `diffuse` are NULL or point to three numbers.
 *
 */
selvedge_status selvedge_shader_eval_lobes(const struct selvedge_shader *shader,
                                           const double uv[2],
                                           float footprint,
                                           const float wi[3],
                                           const float wo[3],
                                           float specular[3],
                                           float diffuse[3]);

/**
 * Writes to `*pdf` the density, sr^-1, with which `selvedge_shader_sample` draws `wi` for `wo` at
 * `uv`: finite and at least 0.
 *
 * # Safety
 *
 * As for `selvedge_shader_eval`; `pdf` is NULL or points to a number.
 *
 */
selvedge_status selvedge_shader_pdf(const struct selvedge_shader *shader,
                                    const double uv[2],
                                    float footprint,
                                    const float wi[3],
                                    const float wo[3],
                                    float *pdf);

/**
 * Writes to `*pdf` the density, sr^-1, with which `selvedge_shader_sample` would draw `wo` for `wi`,
 * as bidirectional methods ask for it.
 *
 * # Safety
 *
 * As for `selvedge_shader_pdf`.
 *
 */
selvedge_status selvedge_shader_reverse_pdf(const struct selvedge_shader *shader,
                                            const double uv[2],
                                            float footprint,
                                            const float wi[3],
                                            const float wo[3],
                                            float *pdf);

/**
 * Both `selvedge_shader_eval` and `selvedge_shader_pdf`.
 *
 * # Safety
 *
 * As for these.
 *
 */
selvedge_status selvedge_shader_eval_pdf(const struct selvedge_shader *shader,
                                         const double uv[2],
                                         float footprint,
                                         const float wi[3],
                                         const float wo[3],
                                         float f[3],
                                         float *pdf);

/**
 * Draws a direction to light `wi` for `wo` at `uv`, nearly in proportion to f cos theta, by the
 * three numbers `xi` of the caller in [0, 1): its `weight`, f cos theta / pdf, linear, and its
 * density `*pdf`, sr^-1.
 *
 * Where nothing is reflected, or the drawn direction is below the surface, `wi` is (0, 0, 1), and
 * `weight` and `*pdf` are 0: such a draw counts as a sample that reflects nothing.
 *
 * # Safety
 *
 * `shader` is NULL or a shader not freed; `uv` is NULL or points to two numbers; `wo`, `xi`, `wi` and
 * `weight` are NULL or point to three; `pdf` is NULL or points to a number. Safe from any thread.
 *
 */
selvedge_status selvedge_shader_sample(const struct selvedge_shader *shader,
                                       const double uv[2],
                                       float footprint,
                                       const float wo[3],
                                       const float xi[3],
                                       float wi[3],
                                       float weight[3],
                                       float *pdf);

/**
 * Writes to `albedo` the share of the light from all sides that is reflected to `wo` at `uv`: linear
 * red, green and blue, good to some hundredths, that of the highlight averaged over its piece of yarn.
 * Where the diffuse reflection follows the yarn's normal it is that of the point, which may be above 1
 * at the expense of its neighbours.
 *
 * # Safety
 *
 * `shader` is NULL or a shader not freed; `uv` is NULL or points to two numbers; `wo` and `albedo` are
 * NULL or point to three. Safe from any thread.
 *
 */
selvedge_status selvedge_shader_albedo(const struct selvedge_shader *shader,
                                       const double uv[2],
                                       float footprint,
                                       const float wo[3],
                                       float albedo[3]);

/**
 * Writes to `*opacity` the share of the light that does not pass straight through the cloth at `uv`:
 * 0 in a gap. One less it is what is transmitted; nothing is scattered to the other side.
 *
 * # Safety
 *
 * `shader` is NULL or a shader not freed; `uv` is NULL or points to two numbers; `opacity` is NULL or
 * points to one. Safe from any thread.
 *
 */
selvedge_status selvedge_shader_opacity(const struct selvedge_shader *shader,
                                        const double uv[2],
                                        float footprint,
                                        float *opacity);

/**
 * Writes to `*yarn_point`, whose `struct_size` the caller has set, which piece of yarn the face shows
 * at `uv`, and where on it that is.
 *
 * # Safety
 *
 * `shader` is NULL or a shader not freed; `uv` is NULL or points to two numbers; `yarn_point` is NULL
 * or points to a struct that is as large as it says. Safe from any thread.
 *
 */
selvedge_status selvedge_shader_yarn_at(const struct selvedge_shader *shader,
                                        const double uv[2],
                                        struct selvedge_yarn_point *yarn_point);

/**
 * Writes to `f` what `selvedge_shader_eval` finds at each point: uses `uv`, `footprint`, `wi`, `wo`,
 * `lobes`.
 *
 * An output may be an input if both have the same components and stride. Fails with
 * `SELVEDGE_STATUS_INVALID_ARGUMENT` if there are more points than memory can hold, a code is not
 * known, or the stride of an output is 0 and there is more than one point. No points are no failure,
 * whatever their arrays are.
 *
 * # Safety
 *
 * `shader` is NULL or a shader not freed; `points` and the output are NULL or point to structs whose
 * pointers are NULL or point, with their strides and whatever their alignment, to as many elements
 * as there are points; `message` is NULL or points to `message_size` bytes. Safe from any thread.
 */
selvedge_status selvedge_shader_eval_batch(const struct selvedge_shader *shader,
                                           const struct selvedge_points *points,
                                           char *message,
                                           size_t message_size,
                                           const struct selvedge_vectors_out *f);

/**
 * Writes to `specular` and `diffuse` what `selvedge_shader_eval_lobes` finds at each point: uses
 * `uv`, `footprint`, `wi`, `wo`. Otherwise as `selvedge_shader_eval_batch`.
 *
 * # Safety
 *
 * As for `selvedge_shader_eval_batch`.
 */
selvedge_status selvedge_shader_eval_lobes_batch(const struct selvedge_shader *shader,
                                                 const struct selvedge_points *points,
                                                 char *message,
                                                 size_t message_size,
                                                 const struct selvedge_vectors_out *specular,
                                                 const struct selvedge_vectors_out *diffuse);

/**
 * Writes to `pdf` what `selvedge_shader_pdf` finds at each point: uses `uv`, `footprint`, `wi`,
 * `wo`. Otherwise as `selvedge_shader_eval_batch`.
 *
 * # Safety
 *
 * As for `selvedge_shader_eval_batch`.
 */
selvedge_status selvedge_shader_pdf_batch(const struct selvedge_shader *shader,
                                          const struct selvedge_points *points,
                                          char *message,
                                          size_t message_size,
                                          const struct selvedge_numbers_out *pdf);

/**
 * Writes to `pdf` what `selvedge_shader_reverse_pdf` finds at each point: uses `uv`, `footprint`,
 * `wi`, `wo`. Otherwise as `selvedge_shader_eval_batch`.
 *
 * # Safety
 *
 * As for `selvedge_shader_eval_batch`.
 */
selvedge_status selvedge_shader_reverse_pdf_batch(const struct selvedge_shader *shader,
                                                  const struct selvedge_points *points,
                                                  char *message,
                                                  size_t message_size,
                                                  const struct selvedge_numbers_out *pdf);

/**
 * Both `selvedge_shader_eval_batch` and `selvedge_shader_pdf_batch`.
 *
 * # Safety
 *
 * As for `selvedge_shader_eval_batch`.
 */
selvedge_status selvedge_shader_eval_pdf_batch(const struct selvedge_shader *shader,
                                               const struct selvedge_points *points,
                                               char *message,
                                               size_t message_size,
                                               const struct selvedge_vectors_out *f,
                                               const struct selvedge_numbers_out *pdf);

/**
 * Writes to `wi`, `weight` and `pdf` what `selvedge_shader_sample` draws at each point: uses `uv`,
 * `footprint`, `wo`, `xi`, `lobes`. Otherwise as `selvedge_shader_eval_batch`.
 *
 * # Safety
 *
 * As for `selvedge_shader_eval_batch`.
 */
selvedge_status selvedge_shader_sample_batch(const struct selvedge_shader *shader,
                                             const struct selvedge_points *points,
                                             char *message,
                                             size_t message_size,
                                             const struct selvedge_vectors_out *wi,
                                             const struct selvedge_vectors_out *weight,
                                             const struct selvedge_numbers_out *pdf);

/**
 * Writes to `albedo` what `selvedge_shader_albedo` finds at each point: uses `uv`, `footprint`,
 * `wo`. Otherwise as `selvedge_shader_eval_batch`.
 *
 * # Safety
 *
 * As for `selvedge_shader_eval_batch`.
 */
selvedge_status selvedge_shader_albedo_batch(const struct selvedge_shader *shader,
                                             const struct selvedge_points *points,
                                             char *message,
                                             size_t message_size,
                                             const struct selvedge_vectors_out *albedo);

/**
 * Writes to `opacity` what `selvedge_shader_opacity` finds at each point: uses `uv`,
 * `footprint`. Otherwise as `selvedge_shader_eval_batch`.
 *
 * # Safety
 *
 * As for `selvedge_shader_eval_batch`.
 */
selvedge_status selvedge_shader_opacity_batch(const struct selvedge_shader *shader,
                                              const struct selvedge_points *points,
                                              char *message,
                                              size_t message_size,
                                              const struct selvedge_numbers_out *opacity);

/**
 * Writes to `yarn_points`, one after the other, what `selvedge_shader_yarn_at` finds at each point:
 * uses `uv`. The caller has set the `struct_size` of the first. Otherwise as
 * `selvedge_shader_eval_batch`.
 *
 * # Safety
 *
 * As for `selvedge_shader_eval_batch`; `yarn_points` is NULL or points to as many structs as there are
 * points.
 */
selvedge_status selvedge_shader_yarn_at_batch(const struct selvedge_shader *shader,
                                              const struct selvedge_points *points,
                                              char *message,
                                              size_t message_size,
                                              struct selvedge_yarn_point *yarn_points);

/**
 * Prepares `fabric` as it is now into `*shader`, which the caller frees with `selvedge_shader_free`.
 *
 * All work that does not depend on a position or a direction is done here, once: a tenth of a second
 * for most fabrics, more for many types of yarn and where noise or textures change its shape. Fails with
 * `SELVEDGE_STATUS_INVALID_CLOTH` if the result cannot be shaded.
 *
 * # Safety
 *
 * `fabric` is NULL or a fabric not freed, which no thread changes; `message` is NULL or points to
 * `message_size` bytes; `shader` is NULL or points to a pointer.
 */
selvedge_status selvedge_shader_new(const struct selvedge_fabric *fabric,
                                    char *message,
                                    size_t message_size,
                                    const struct selvedge_shader **shader);

/**
 * Counts one more owner of a shader, each of whom frees it once.
 *
 * # Safety
 *
 * `shader` is NULL or a shader not freed. Safe from any thread.
 */
selvedge_status selvedge_shader_share(const struct selvedge_shader *shader);

/**
 * Frees a shader once its last owner has; NULL is nothing to free.
 *
 * # Safety
 *
 * `shader` is NULL or comes from `selvedge_shader_new`, and is freed once for that and once for each
 * `selvedge_shader_share`; who frees it uses it no more. Safe from any thread.
 */
void selvedge_shader_free(const struct selvedge_shader *shader);

/**
 * Writes to `*info`, whose `struct_size` the caller has set, what the shader is like.
 *
 * # Safety
 *
 * `shader` is NULL or a shader not freed; `message` is NULL or points to `message_size` bytes;
 * `info` is NULL or points to a struct that is as large as it says. Safe from any thread.
 */
selvedge_status selvedge_shader_describe(const struct selvedge_shader *shader,
                                         char *message,
                                         size_t message_size,
                                         struct selvedge_shader_info *info);

/**
 * Writes to `*length` the bytes of what the fabric said in vain or could not be shaded as it said,
 * without the NUL, and to `text` as much of it as fits: UTF-8, a line for each warning; empty if
 * there is none.
 *
 * # Safety
 *
 * `shader` is NULL or a shader not freed; `text` is NULL or points to `text_size` bytes; `length` is
 * NULL or points to a number. Safe from any thread.
 */
selvedge_status selvedge_shader_warnings(const struct selvedge_shader *shader,
                                         char *text,
                                         size_t text_size,
                                         size_t *length);

/**
 * Writes to `*count` how many numbers it takes to scale the highlight of the type `yarn`, and these to
 * `divisors` if its `length` is at least that.
 *
 * They are 1 / factor for each kind of piece of yarn and each shape in turn, the result of a search when the
 * shader was made. `selvedge_fabric_set_divisors` has another machine, or a later library, scale as this one.
 * Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` if there is no such type.
 *
 * # Safety
 *
 * `shader` is NULL or a shader not freed; `message` is NULL or points to `message_size` bytes; `divisors`
 * points to `length` numbers, or is NULL for a `length` of 0; `count` is NULL or points to a number. Safe
 * from any thread.
 */
selvedge_status selvedge_shader_divisors(const struct selvedge_shader *shader,
                                         uint32_t yarn,
                                         size_t length,
                                         char *message,
                                         size_t message_size,
                                         float *divisors,
                                         size_t *count);

/**
 * Writes to `*normalization`, whose `struct_size` the caller has set, by what the highlight of the
 * type `yarn` is scaled.
 *
 * Equal fabrics have equal factors, bit for bit, on machines of one kind. Fails with
 * `SELVEDGE_STATUS_INVALID_ARGUMENT` if there is no such type.
 *
 * # Safety
 *
 * `shader` is NULL or a shader not freed; `message` is NULL or points to `message_size` bytes;
 * `normalization` is NULL or points to a struct that is as large as it says. Safe from any thread.
 */
selvedge_status selvedge_shader_normalization(const struct selvedge_shader *shader,
                                              uint32_t yarn,
                                              char *message,
                                              size_t message_size,
                                              struct selvedge_normalization *normalization);

/**
 * Lets `value` determine the parameter `index` of the type `yarn`: a colour at each point, a number
 * in the middle of each piece of yarn, which it does not change within. It stands for the value that
 * the type has. Later textures of the same parameter win.
 *
 * `low` and `high` are the least and the greatest that any component may be: the highlight is
 * normalised for all between them. Not every parameter can have one: `size` and those of noise, of
 * the cloth, `specular_uniform` and choices cannot. `footprint` is 0 where a shader looks at points.
 *
 * Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` if there is no such type or parameter, or no such
 * range.
 *
 * # Safety
 *
 * `fabric` is NULL or a fabric not freed, which no other thread uses; `value` is NULL or a function
 * that may be called with `user`, from any thread, until the fabric and all shaders made of it are
 * freed; `message` is NULL or points to `message_size` bytes.
 */
selvedge_status selvedge_fabric_set_texture(struct selvedge_fabric *fabric,
                                            uint32_t yarn,
                                            uint32_t index,
                                            selvedge_texture_value value,
                                            void *user,
                                            float low,
                                            float high,
                                            char *message,
                                            size_t message_size);

/**
 * The version of the interface that the library implements.
 *
 * A program fits if the generations are equal and the library has at least the additions that
 * the program was compiled with:
 *
 * ```c
 * const uint32_t abi = selvedge_abi_version();
 * const int fits = abi >> 16 == SELVEDGE_ABI_VERSION >> 16 && abi >= SELVEDGE_ABI_VERSION;
 * ```
 *
 * # Safety
 *
 * Takes no pointer; there is nothing to keep. Safe from any thread.
 */
uint32_t selvedge_abi_version(void);

/**
 * The version of the library, as in `0.1.0`, for people to read: a static string, never freed.
 *
 * # Safety
 *
 * Takes no pointer; there is nothing to keep. Safe from any thread.
 */
const char *selvedge_version_string(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* SELVEDGE_H */
