/* Parian's C API: translucent materials with the directional dipole, as a compute module inside a program that may own
 * the OpenCL context, queues and buffers. docs/embedding.md has complete programs and a table of who owns what.
 *
 * In short: parian_create, set a mesh, a material, lights, cameras and a film, parian_plan (waits), then parian_frame
 * and parian_gather as often as you like (neither waits nor reads back); parian_release.
 *
 * Units. Lengths in millimetres, coefficients of materials in 1/mm, angles in degrees; world space is right-handed.
 * Irradiance and radiance are linear RGB in any unit of power. A uniform scale changes nothing as long as coefficients
 * scale the other way, so any unit of length will do if it is the same everywhere.
 *
 * Structs. The first field of each, struct_size, is sizeof that struct, so that a program compiled against an older
 * header keeps working; fields that a shorter struct lacks count as 0, and what a longer one has more is set to 0 where
 * the library fills it in. Every struct that is passed in may be released or changed as soon as the call returns.
 * Zero-initialised optional fields mean "not given".
 *
 * Errors. Every call returns a status. What went wrong is said in one line by parian_message, with the OpenCL code, if
 * there is one, in parian_opencl_code, both of the calling thread's last failure. The library never prints, never
 * exits, and lets no exception out. Arguments are validated before anything is enqueued: a call that is refused changes
 * nothing. One that fails on the device or for want of memory, or is cancelled, undoes the plan; what the scene is
 * stays set, and parian_plan starts anew.
 *
 * Threads. A renderer is used by one thread at a time; another one that calls in meanwhile gets PARIAN_BUSY. Different
 * renderers are independent of each other, whatever they share in OpenCL. There is no global state but the calling
 * thread's message, and a list of the programs that renderers share.
 *
 * Queues. A call takes the queue to enqueue on: in-order or out-of-order, of the renderer's context and device. NULL
 * means a queue of the renderer's own. Commands of one renderer run one after another, whichever queues they are on;
 * queues are flushed before a call returns, and are not retained after it.
 *
 * Events. `n_wait` and `wait` are as in OpenCL: what the call's first command waits for. `*event`, where `event` isn't
 * NULL, is complete when the call's work is; the caller releases it. On failure it is left alone. */
#ifndef PARIAN_PARIAN_H
#define PARIAN_PARIAN_H

#ifndef CL_TARGET_OPENCL_VERSION
#define CL_TARGET_OPENCL_VERSION 300 /* what OpenCL's header takes by itself, but with a remark; any will do here */
#endif
#include <CL/cl.h>
#include <stddef.h>
#include <stdint.h>

/* On Windows a program that links the static library defines PARIAN_STATIC; CMake's target and pkg-config do so. */
#if defined(_WIN32) && defined(PARIAN_BUILDS_DLL)
#define PARIAN_API __declspec(dllexport)
#elif defined(_WIN32) && !defined(PARIAN_STATIC)
#define PARIAN_API __declspec(dllimport)
#elif defined(__GNUC__) && !defined(_WIN32)
#define PARIAN_API __attribute__((visibility("default")))
#else
#define PARIAN_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* What a call came to. */
typedef enum parian_status {
  PARIAN_SUCCESS = 0,
  PARIAN_INVALID_ARGUMENT = 2, /* null, a wrong size, a wrong context, an unknown name */
  PARIAN_INVALID_SCENE = 3,    /* what was given can't be rendered: the message names the field */
  PARIAN_DEVICE_FAILED = 4,    /* no device, it refuses the kernels, or it fails the self-test or a call */
  PARIAN_OUT_OF_MEMORY = 5,    /* on the device, on the host, or in the scratch buffer that was supplied */
  PARIAN_DEVICE_LOST = 6,      /* the context is of no use any more: release the renderer and make a new context; where
                                  the driver's own code threw an exception, its objects stay behind, and so does it */
  PARIAN_NOT_PLANNED = 7,      /* something changed that needs parian_plan first, or a failure undid the plan */
  PARIAN_BUSY = 8,             /* another thread is inside a call with this renderer */
  PARIAN_CANCELLED = 9,        /* the callback said so: the plan is undone, parian_plan starts anew */
  PARIAN_INTERNAL = 10         /* a defect of Parian */
} parian_status;

/* The library's version, "MAJOR.MINOR.PATCH"; static storage. */
PARIAN_API const char* parian_version(void);
/* One line about this thread's last failure, "what is wrong; what to do"; "" before the first. Valid until the
 * thread's next failure. */
PARIAN_API const char* parian_message(void);
/* The OpenCL code behind it, CL_SUCCESS where there is none. */
PARIAN_API cl_int parian_opencl_code(void);

/* --- Life ---------------------------------------------------------------------------------------------------------*/

/* Everything of one scene on one device. */
typedef struct parian_renderer parian_renderer;

/* Asked before kernels are compiled and between commands; anything but 0 cancels the call that is under way. Runs on
 * the thread that made the call, and must not call back into Parian with the same renderer. */
typedef int (*parian_cancel_callback)(void* user);

typedef struct parian_create_info {
  size_t struct_size;
  cl_context context;   /* the caller's: retained until release; or NULL: Parian makes one for a device it picks */
  cl_device_id device;  /* of `context`, or a part of one of its devices; NULL where there is no context */
  const char* selector; /* without a context, which device: an index of 'parian devices', a part of "NAME PLATFORM" in
                           any case, or NULL: a GPU before an accelerator before a CPU, then most compute units */
  parian_cancel_callback cancel; /* may be NULL */
  void* user;                    /* passed to it */
} parian_create_info;

/* Makes a renderer; nothing is compiled yet. `*renderer` is set on success only. */
PARIAN_API parian_status parian_create(const parian_create_info* info, parian_renderer** renderer);
/* Waits for what the renderer has enqueued, gives everything back, retained objects of the caller included. NULL is
 * allowed. The caller may have released its own references before. Nobody may be inside a call. */
PARIAN_API void parian_release(parian_renderer* renderer);
/* The renderer's context and device, not retained; either pointer may be NULL. */
PARIAN_API parian_status parian_get_opencl(const parian_renderer* renderer, cl_context* context, cl_device_id* device);

/* The device, as 'parian devices' lists it; texts are valid until release. */
typedef struct parian_device {
  size_t struct_size;
  const char *name, *platform, *vendor, *driver, *version;
  uint32_t compute_units;
  uint32_t lanes; /* samples side by side in pass 2 */
  uint32_t index; /* where Parian picked it: what a selector takes */
} parian_device;

PARIAN_API parian_status parian_get_device(const parian_renderer* renderer, parian_device* device);

/* --- Scene --------------------------------------------------------------------------------------------------------*/

typedef enum parian_normals {
  PARIAN_NORMALS_NONE = 0, /* computed: angle-weighted, split at edges sharper than 40 degrees */
  PARIAN_NORMALS_PER_VERTEX = 1,
  PARIAN_NORMALS_PER_CORNER = 2 /* three for each triangle */
} parian_normals;

/* A triangle mesh, either in host memory (copied by the call) or in buffers of the renderer's context (retained until
 * replaced, read when a plan or a frame after parian_positions_changed runs, never copied through the host).
 *
 * Host memory: exactly one of `positions` and `positions_double`; strides in bytes, 0 for tightly packed. Without
 * normals the mesh is cleaned: duplicate points are joined, triangles without area dropped, parts turned outward.
 * Indices out of range and coordinates that aren't finite are refused.
 *
 * Buffers: x, y, z as float at `position_offset` + i * `position_stride` bytes, multiples of 4; three uint of each
 * triangle at `index_offset` on, tightly packed. `centre` and `radius` are of a sphere that holds all positions at all
 * times; parian_plan measures the positions as they are then, and plans for the smallest sphere that holds this one and
 * them, with a warning where it has to be larger, or for theirs alone where radius is 0. What leaves the sphere later
 * is cut off from light maps and layers, which the next call that waits lists as a warning. Triangles with an index out
 * of range, or with a corner that isn't finite or lies two radii from the centre, are not drawn; beside a radius, one
 * that lies alone, farther off than the others reach twice, isn't measured. Normals are computed on the device: where a
 * vertex' smooth normal is more than 40 degrees off the triangle's, the triangle's own.
 *
 * All parts are one medium, and dipoles know surfaces, not paths: light passes cavities, and air gaps between parts, as
 * if they were filled, and several shells are as one solid. Behind walls thicker than two effective mean free paths,
 * 2 / sqrt(3 sigma_a ((1 - g) sigma_s + sigma_a)), that hardly matters; of thinner ones the picture is as of a solid.
 * Warnings tell of closed parts inside others, of coarse triangles whose facets will show, and of float positions so
 * far from the origin that their steps do; of host meshes without normals only. */
typedef struct parian_mesh {
  size_t struct_size;
  uint32_t n_positions;
  uint32_t n_triangles;
  const float* positions;
  const double* positions_double;
  size_t position_stride;
  const uint32_t* indices;
  const float* normals; /* x, y, z, tightly packed, unit length; host meshes only */
  parian_normals normals_kind;
  cl_mem position_buffer;
  size_t position_offset;
  cl_mem index_buffer;
  size_t index_offset;
  double centre[3];      /* of no effect without a radius */
  double radius;         /* 0: measured when planned */
  uint32_t for_one_plan; /* not 0: the host copy is freed once it's planned; a second plan needs the mesh again */
} parian_mesh;

/* Optical coefficients of the material, RGB, in 1/mm, 0 to 1e15 and not both 0; g -1 to 1, ior above 0, at most 100,
 * and below 1 with a warning. */
typedef struct parian_material {
  size_t struct_size;
  double sigma_s[3]; /* scattering; the reduced one where g is 0 */
  double sigma_a[3]; /* absorption */
  double g[3];       /* mean cosine of scattering */
  double ior;        /* index of refraction relative to the outside */
  const char* name;  /* for messages; may be NULL */
} parian_material;

/* A measured material by the name that 'parian materials' lists; case, spaces, '-' and '_' don't matter. Texts that
 * `*material` gets have static storage. A name that isn't there is PARIAN_INVALID_SCENE, and the message has the
 * nearest ones. */
PARIAN_API parian_status parian_find_material(const char* name, parian_material* material);

typedef struct parian_light {
  size_t struct_size;
  double towards[3];    /* direction to the light, any length above 0 that a double holds */
  double irradiance[3]; /* on a surface that faces it, RGB, 0 to 1e30 */
} parian_light;

typedef struct parian_camera {
  size_t struct_size;
  double eye[3], target[3], up[3];
  double fov; /* full vertical angle, above 0 and below 180 */
} parian_camera;

typedef enum parian_model { PARIAN_DIRECTIONAL = 0, PARIAN_STANDARD = 1, PARIAN_BETTER = 2 } parian_model;
typedef enum parian_estimator { PARIAN_NEAREST_LIT = 0, PARIAN_RADIAL = 1, PARIAN_DISC = 2 } parian_estimator;
typedef enum parian_views { PARIAN_AUTO = 0, PARIAN_LAYERS = 1, PARIAN_CAMERA = 2 } parian_views;

/* How well, and how; parian_default_settings fills in the defaults in parentheses. */
typedef struct parian_settings {
  size_t struct_size;
  double error;               /* target of the estimated relMSE, for parian_estimate_due; 0: none (1e-3) */
  uint32_t layers;            /* directions that the object is seen from, at most 1024 (16) */
  uint32_t layer_size;        /* texels along a side of each, at most 16384 (256) */
  uint32_t light_map_size;    /* the same (512) */
  uint32_t light_map_shift;   /* redraw light maps with sub-texel shifts now and then (1) */
  uint32_t samples;           /* per texel and frame, even, at most 2^20, divided between lights by flux (16) */
  parian_model model;         /* (PARIAN_DIRECTIONAL) */
  parian_estimator estimator; /* (PARIAN_NEAREST_LIT) */
  double disc_radius;         /* mm, at most 1e9, with PARIAN_DISC; 0: eight effective mean free paths (0) */
  parian_views views;         /* layers, the cameras' own views as layers, or what costs less (PARIAN_AUTO) */
  uint32_t fixed_cameras;     /* not 0: cameras and film change only with a new plan, so what they don't see is left out
                                 and their own views may be the layers; of no effect on a mesh in buffers (0) */
  uint32_t pyramids;          /* (1) */
  uint32_t seed;              /* (0) */
  uint32_t frames;            /* as many will be asked for at most: times samples, below 2^32, past which samples
                                 repeat (1024) */
  const char* keep;           /* omissions that are forced off: names divided by commas, or "all"; NULL: none (NULL) */
  uint32_t force;             /* try although memory seems too small or the self-test fails (0) */
  uint32_t time_stages;       /* wait after each stage, so that seconds of the wall clock can be told by stage (0) */
} parian_settings;

PARIAN_API parian_status parian_default_settings(parian_settings* settings);

/* These describe; nothing is enqueued. Each says what it costs the next frame. */

/* Needs a new plan. */
PARIAN_API parian_status parian_set_settings(parian_renderer* renderer, const parian_settings* settings);
PARIAN_API parian_status parian_set_mesh(parian_renderer* renderer, const parian_mesh* mesh);
PARIAN_API parian_status parian_set_material(parian_renderer* renderer, const parian_material* material);
/* Another irradiance keeps the sums; another direction redraws that light's maps and starts them anew; another number
 * of lights, or one that comes on and was dark when planned, needs a new plan. Of more than eight lights, of lights
 * whose own sums the device has no memory for, and with settings.fixed_cameras, irradiance keeps the sums if that of
 * all changes by the same colour and starts them anew if not, and a light that goes dark needs a new plan. */
PARIAN_API parian_status parian_set_lights(parian_renderer* renderer, size_t n, const parian_light* lights);
/* The film has `width` x `height` pixels, 1 to 16384 each. Keeps the sums; with settings.fixed_cameras, needs a new
 * plan. A larger film needs more memory; where a scratch buffer hasn't enough even for windows of it,
 * PARIAN_OUT_OF_MEMORY undoes the plan, and parian_scratch_size tells what the new film needs. */
PARIAN_API parian_status parian_set_cameras(parian_renderer* renderer, size_t n, const parian_camera* cameras,
                                            uint32_t width, uint32_t height);
/* For a mesh in buffers: the next frame, once its wait list allows, reads the positions again, redraws light maps and
 * layers, and starts the sums anew. */
PARIAN_API parian_status parian_positions_changed(parian_renderer* renderer);
/* Starts the sums anew with the next frame. */
PARIAN_API parian_status parian_restart(parian_renderer* renderer);

/* --- Memory -------------------------------------------------------------------------------------------------------*/

/* Bytes of device memory that a plan of what is set now takes at most, from which `parian_set_scratch` may be fed. */
PARIAN_API parian_status parian_scratch_size(parian_renderer* renderer, size_t* bytes);
/* From the next plan on, all buffers are parts of this one, which is retained; or of Parian's own making again if it is
 * NULL. Needs a new plan. What has been enqueued may go on using the one before until its event is complete. */
PARIAN_API parian_status parian_set_scratch(parian_renderer* renderer, cl_mem scratch);

/* --- Compiled programs --------------------------------------------------------------------------------------------*/

/* Renderers of one context and device share their programs while they live. From the next plan on, programs are also
 * kept in `folder` between runs of the process; NULL, as after parian_create: nowhere. That gains where a driver keeps
 * none itself (Intel's CPU runtime: 15 processor seconds at each start). The folder is made if it isn't there, and must
 * be the user's own and closed to others (mode 0700), or it is refused; where it can't be written later, programs are
 * compiled anew. What is in it is used only if it is whole, and was made from the same source with the same options by
 * the same driver for the same device; it holds 256 MiB at most. */
PARIAN_API parian_status parian_set_cache(parian_renderer* renderer, const char* folder);

/* --- Rendering ----------------------------------------------------------------------------------------------------*/

/* Compiles what the scene needs, tests the device, places layers, allocates. Waits. */
PARIAN_API parian_status parian_plan(parian_renderer* renderer, cl_command_queue queue);

/* Passes 1 and 2: `samples` more evaluations for each layer texel. Neither waits nor reads back. */
PARIAN_API parian_status parian_frame(parian_renderer* renderer, cl_command_queue queue, cl_uint n_wait,
                                      const cl_event* wait, cl_event* event);

/* Where an image goes: four floats for each pixel, linear R, G, B premultiplied by alpha = coverage, from the top left,
 * pixel (x, y) at `offset` + y * `row_pitch` + 16 x bytes of a buffer of the renderer's context. */
typedef struct parian_image {
  size_t struct_size;
  cl_mem buffer;
  size_t offset;      /* bytes, a multiple of 16 */
  size_t row_pitch;   /* bytes, a multiple of 16; 0 for 16 x the film's width */
  uint32_t positions; /* subpixel positions, 1 to 64; 0 for 64. One makes edges stand out in steps */
  float exposure;     /* stops, -100 to 100: RGB times 2^exposure */
} parian_image;

/* Passes 3 and 4: a camera's view of what has been summed so far, from the pyramid level that suits the frames done, or
 * the last estimate. At least one frame must have been. Neither waits nor reads back. */
PARIAN_API parian_status parian_gather(parian_renderer* renderer, cl_command_queue queue, size_t camera,
                                       const parian_image* image, cl_uint n_wait, const cl_event* wait,
                                       cl_event* event);

/* Whether an estimate is due: after frames 1, 2, 3, 4, 6, 8, 12, 16, ..., but not where the error can't yet be below
 * settings.error. */
PARIAN_API parian_status parian_estimate_due(const parian_renderer* renderer, uint32_t* due);
/* The images' estimated relMSE, the worst camera's; negative, for not known, where only edges are covered, where
 * nothing is although the object's middle lies in the film, or where all is black although light falls on it. Waits. */
PARIAN_API parian_status parian_estimate(parian_renderer* renderer, cl_command_queue queue, double* relmse);
/* The finished image of a camera into host memory, 4 x width x height floats as in parian_image, gathered at 64
 * subpixel positions, of the level with the smaller estimated relMSE, which `*relmse` gets unless NULL. Waits. */
PARIAN_API parian_status parian_read(parian_renderer* renderer, cl_command_queue queue, size_t camera, float* rgba,
                                     double* relmse);

/* --- What it says of itself ---------------------------------------------------------------------------------------*/

typedef struct parian_seconds {
  double plan, compile, light_map, layers, pyramids, gather, bias, read;
} parian_seconds;

typedef struct parian_statistics {
  size_t struct_size;
  uint32_t frames;
  uint32_t layers_count, layers_size; /* size: texels along the longer side */
  double layers_covered;              /* share of the visible surface that at least one layer sees; -1: not known */
  uint64_t layers_texels, layers_texels_evaluated; /* of meshes in buffers: an upper bound */
  uint64_t fallback_pixels;                        /* of the last image read: points that no layer sees */
  double evaluations;                              /* of S_d, for the pictures */
  double bias_evaluations;                         /* of S_d, for the estimate of bias */
  double estimated_relmse;                         /* negative: not known */
  double estimated_bias_relmse;                    /* negative: not known */
  uint64_t bytes_peak, bytes_planned;              /* of device memory */
  uint64_t nonfinite;                              /* values that had to be set to 0 in images read */
  double further_view_seconds;   /* wall time of each image read after the first; negative: not known */
  parian_seconds seconds;        /* wall; by stage with settings.time_stages only */
  parian_seconds kernel_seconds; /* by events; 0 on queues without profiling */
  size_t n_omissions, n_warnings, n_explanations;
} parian_statistics;

typedef struct parian_omission {
  size_t struct_size;
  const char* what; /* what settings.keep takes */
  const char* why;  /* one clause */
  const char* unit; /* of `count`: "evaluations", "bytes", "launches", ... */
  double count;
} parian_omission;

/* What was done so far. Sets the lists that the next calls read; their texts are valid until the next call with this
 * renderer that isn't one of them. */
PARIAN_API parian_status parian_get_statistics(parian_renderer* renderer, parian_statistics* statistics);
PARIAN_API parian_status parian_get_omission(const parian_renderer* renderer, size_t i, parian_omission* omission);
PARIAN_API parian_status parian_get_warning(const parian_renderer* renderer, size_t i, const char** text);
/* The plan in words, a line each. */
PARIAN_API parian_status parian_get_explanation(const parian_renderer* renderer, size_t i, const char** text);

#ifdef __cplusplus
} /* extern "C" */
#endif
#endif
