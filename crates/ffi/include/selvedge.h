/*
 * Woven-cloth shading for any renderer: the C interface of Selvedge.
 *
 * The bytes of a WIF file become a `selvedge_draft`, a draft becomes a `selvedge_shader`, and
 * a shader answers how much light the cloth reflects from one direction into another:
 *
 * ```c
 * char message[256];
 * selvedge_draft *draft = NULL;
 * selvedge_shader *shader = NULL;
 * if (selvedge_draft_new(bytes, length, message, sizeof message, &draft) ||
 *     selvedge_shader_new(draft, message, sizeof message, &shader)) {
 *     fprintf(stderr, "%s\n", message);
 * } else {
 *     const double uv[2] = {0.0010, 0.0025};
 *     const float wi[3] = {0.6f, 0.0f, 0.8f}, wo[3] = {0.0f, 0.0f, 1.0f};
 *     float f[3];
 *     selvedge_shader_eval(shader, uv, wi, wo, f);
 * }
 * selvedge_shader_free(shader);
 * selvedge_draft_free(draft);
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
 * - Every other pointer is lent for the call: nothing of the caller's is kept, changed or
 *   freed. A shader keeps nothing of its draft, which may be freed before it.
 * - A returned string is static and belongs to the library.
 *
 * # Failure
 *
 * - Functions that can fail return a `selvedge_status`; everything but `SELVEDGE_STATUS_OK`,
 *   which is 0, is a failure, also a code that this header does not know yet.
 * - Outputs are the last arguments; on failure they are as they were.
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
 * There is no global state. Drafts and shaders never change once made: any number of threads
 * may use one at the same time, without a lock. Only its freeing must come after every use.
 *
 * # Frame and units
 *
 * Positions `uv` are metres along the cloth from the outer edge of end 1 and pick 1: `u` along
 * the weft, `v` along the warp; any values, since the draft repeats. Directions are unit
 * vectors pointing away from the surface, `wi` to the light and `wo` to the viewer, in the
 * shading frame: x = dP/du along the weft, y = dP/dv along the warp, z the normal of the face.
 * Colours are linear, with the primaries of sRGB.
 */

/* Generated from the Rust sources by `BLESS=1 cargo test -p selvedge-ffi`. */

#ifndef SELVEDGE_H
#define SELVEDGE_H

#include <stddef.h>
#include <stdint.h>

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
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum selvedge_status selvedge_status;
#else
typedef uint32_t selvedge_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * A weaving draft: how threads interlace, with their colours and sizes.
 *
 * Never changes; any number of threads may use one at the same time.
 */
typedef struct selvedge_draft selvedge_draft;

/**
 * Cloth ready to be shaded.
 *
 * Never changes; any number of threads may use one at the same time.
 */
typedef struct selvedge_shader selvedge_shader;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Reads the `length` bytes of a WIF file into `*draft`, which the caller frees with
 * `selvedge_draft_free`.
 *
 * What departs from the format is read past where it can be. Fails with
 * `SELVEDGE_STATUS_INVALID_DRAFT` where no draft is left; `message` then says where in the file
 * and why, in three lines for each reason. Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` if
 * `length` is more than any object in memory can have, such as -1 from a file that could not
 * be read.
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
                                   selvedge_draft **draft);

/**
 * Frees a draft; NULL is nothing to free.
 *
 * # Safety
 *
 * `draft` is NULL or comes from `selvedge_draft_new`, has not been freed, and is not used by
 * another thread.
 */
void selvedge_draft_free(selvedge_draft *draft);

/**
 * Prepares the cloth of `draft`, woven from the yarn of a default fabric, into `*shader`,
 * which the caller frees with `selvedge_shader_free`.
 *
 * Colours, spacing and thickness of the threads are those of the draft. All work that does not
 * depend on a position or a direction is done here, once. Fails with
 * `SELVEDGE_STATUS_INVALID_DRAFT` if the draft does not say how its threads interlace, with
 * `SELVEDGE_STATUS_INVALID_CLOTH` if the result cannot be shaded.
 *
 * # Safety
 *
 * `draft` is NULL or a draft not freed; `message` is NULL or points to `message_size` bytes;
 * `shader` is NULL or points to a pointer. Safe from any thread.
 */
selvedge_status selvedge_shader_new(const selvedge_draft *draft,
                                    char *message,
                                    size_t message_size,
                                    selvedge_shader **shader);

/**
 * Frees a shader; NULL is nothing to free.
 *
 * # Safety
 *
 * `shader` is NULL or comes from `selvedge_shader_new`, has not been freed, and is not used by
 * another thread.
 */
void selvedge_shader_free(selvedge_shader *shader);

/**
 * Writes to `f` the BRDF at `uv` for light from `wi` seen from `wo`, in sr^-1, *without* the
 * cosine: linear red, green and blue, each finite and at least 0.
 *
 * Both directions above the surface show the face of the cloth, both below it the back. The
 * value is 0 in a gap between yarns, for one direction on each side or in the plane of the
 * cloth, and where a number is not finite. `f` may be the array of a direction.
 *
 * # Safety
 *
 * `shader` is NULL or a shader not freed; `uv` is NULL or points to two numbers, `wi`, `wo` and
 * `f` are NULL or point to three. Safe from any thread.
 *
 */
selvedge_status selvedge_shader_eval(const selvedge_shader *shader,
                                     const double uv[2],
                                     const float wi[3],
                                     const float wo[3],
                                     float f[3]);

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
