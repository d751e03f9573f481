/* Everything is the caller's: context, out-of-order queue, vertex, index and image buffers, and Parian's scratch. Two
 * images with a moved camera share what has been summed. C99. */
#define CL_TARGET_OPENCL_VERSION 120
#include <parian/parian.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "torus.h"

#define REQUIRE(condition, what)                                  \
  do {                                                            \
    if (!(condition)) {                                           \
      fprintf(stderr, "owned: %s: %s\n", what, parian_message()); \
      return 1;                                                   \
    }                                                             \
  } while (0)
#define PARIAN(call) REQUIRE((call) == PARIAN_SUCCESS, #call)
#define OPENCL(call) REQUIRE((call) == CL_SUCCESS, #call)

enum { WIDTH = 96, HEIGHT = 64 };

static parian_camera camera_at(double x) {
  parian_camera camera = {.struct_size = sizeof camera, .eye = {x, 120.0, 250.0}, .up = {0.0, 1.0, 0.0}, .fov = 30.0};
  return camera;
}

/* The first device that can compile and has out-of-order queues. */
static cl_device_id find_device(void) {
  cl_platform_id platforms[16];
  cl_uint n_platforms = 0;
  if (clGetPlatformIDs(16, platforms, &n_platforms) != CL_SUCCESS) return NULL;
  for (cl_uint p = 0; p < n_platforms && p < 16; ++p) {
    cl_device_id device = NULL;
    cl_bool compiles = CL_FALSE;
    cl_command_queue_properties queues = 0;
    if (clGetDeviceIDs(platforms[p], CL_DEVICE_TYPE_ALL, 1, &device, NULL) != CL_SUCCESS) continue;
    clGetDeviceInfo(device, CL_DEVICE_COMPILER_AVAILABLE, sizeof compiles, &compiles, NULL);
    clGetDeviceInfo(device, CL_DEVICE_QUEUE_PROPERTIES, sizeof queues, &queues, NULL);
    if (compiles && (queues & CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE)) return device;
  }
  return NULL;
}

/* Gives the renderer its scene, with the mesh in buffers. 0 if all went well. */
static int describe(parian_renderer* renderer, cl_mem vertices, cl_mem triangles) {
  parian_settings settings = {.struct_size = sizeof settings};
  PARIAN(parian_default_settings(&settings));
  settings.layers = 8;
  settings.layer_size = 64;
  settings.light_map_size = 128;
  PARIAN(parian_set_settings(renderer, &settings));
  parian_mesh mesh = {.struct_size = sizeof mesh,
                      .n_positions = TORUS_POSITIONS,
                      .n_triangles = TORUS_TRIANGLES,
                      .position_buffer = vertices,
                      .index_buffer = triangles,
                      .radius = 51.0};
  PARIAN(parian_set_mesh(renderer, &mesh));
  parian_material marble = {
      .struct_size = sizeof marble, .sigma_s = {2.19, 2.62, 3.00}, .sigma_a = {0.0021, 0.0041, 0.0071}, .ior = 1.5};
  PARIAN(parian_set_material(renderer, &marble));
  parian_light light = {.struct_size = sizeof light, .towards = {0.5, 0.6, -0.6}, .irradiance = {3.14, 3.14, 3.14}};
  PARIAN(parian_set_lights(renderer, 1, &light));
  const parian_camera camera = camera_at(0.0);
  PARIAN(parian_set_cameras(renderer, 1, &camera, WIDTH, HEIGHT));
  return 0;
}

/* Two images of one film each, side by side in one buffer; the second waits for nothing but the first. 0 if all went
 * well; then `done` is the second's event. */
static int render_two(parian_renderer* renderer, cl_command_queue queue, cl_mem pixels, cl_event* done) {
  for (int i = 0; i < 2; ++i) {
    cl_event frame = NULL, gathered = NULL;
    PARIAN(parian_frame(renderer, queue, *done ? 1 : 0, *done ? done : NULL, &frame));
    if (*done) clReleaseEvent(*done);
    const parian_camera camera = camera_at(40.0 * i);
    PARIAN(parian_set_cameras(renderer, 1, &camera, WIDTH, HEIGHT));
    parian_image image = {.struct_size = sizeof image,
                          .buffer = pixels,
                          .offset = (size_t)i * WIDTH * 4 * sizeof(float),
                          .row_pitch = 2 * WIDTH * 4 * sizeof(float),
                          .positions = 8};
    PARIAN(parian_gather(renderer, queue, 0, &image, 1, &frame, &gathered));
    clReleaseEvent(frame);
    *done = gathered;
  }
  parian_statistics statistics = {.struct_size = sizeof statistics};
  PARIAN(parian_get_statistics(renderer, &statistics));
  REQUIRE(statistics.frames == 2, "a moved camera should keep what has been summed");
  return 0;
}

/* Says what the two images show. 0 if they show something. */
static int look_at(const float* rgba) {
  double covered[2] = {0.0, 0.0}, light_seen[2] = {0.0, 0.0};
  for (int y = 0; y < HEIGHT; ++y)
    for (int x = 0; x < 2 * WIDTH; ++x) {
      const float* pixel = rgba + 4 * (y * 2 * WIDTH + x);
      covered[x / WIDTH] += pixel[3];
      light_seen[x / WIDTH] += pixel[0] + pixel[1] + pixel[2];
    }
  for (int i = 0; i < 2; ++i) {
    printf("image %d: %.1f pixels covered, mean radiance %.4f\n", i, covered[i], light_seen[i] / (3.0 * covered[i]));
    REQUIRE(covered[i] > 500.0 && light_seen[i] > 0.0, "an image is empty");
  }
  return 0;
}

int main(void) {
  cl_int code = CL_SUCCESS;
  cl_device_id device = find_device();
  REQUIRE(device, "no OpenCL device with out-of-order queues");
  cl_context context = clCreateContext(NULL, 1, &device, NULL, NULL, &code);
  OPENCL(code);
  cl_command_queue queue = clCreateCommandQueue(context, device, CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE, &code);
  OPENCL(code);

  static float positions[3 * TORUS_POSITIONS];
  static uint32_t indices[3 * TORUS_TRIANGLES];
  torus_positions(positions, 14.0f);
  torus_indices(indices);
  cl_mem vertices =
      clCreateBuffer(context, CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, sizeof positions, positions, &code);
  OPENCL(code);
  cl_mem triangles = clCreateBuffer(context, CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, sizeof indices, indices, &code);
  OPENCL(code);
  cl_mem pixels = clCreateBuffer(context, CL_MEM_READ_WRITE, 2 * WIDTH * HEIGHT * 4 * sizeof(float), NULL, &code);
  OPENCL(code);

  parian_renderer* renderer = NULL;
  parian_create_info info = {.struct_size = sizeof info, .context = context, .device = device};
  PARIAN(parian_create(&info, &renderer));
  if (describe(renderer, vertices, triangles)) return 1;

  size_t bytes = 0;
  PARIAN(parian_scratch_size(renderer, &bytes));
  cl_mem scratch = clCreateBuffer(context, CL_MEM_READ_WRITE, bytes, NULL, &code);
  OPENCL(code);
  PARIAN(parian_set_scratch(renderer, scratch));
  PARIAN(parian_plan(renderer, queue));

  cl_event done = NULL;
  if (render_two(renderer, queue, pixels, &done)) return 1;
  static float rgba[2 * WIDTH * HEIGHT * 4];
  OPENCL(clEnqueueReadBuffer(queue, pixels, CL_TRUE, 0, sizeof rgba, rgba, 1, &done, NULL));
  clReleaseEvent(done);
  if (look_at(rgba)) return 1;

  /* In any order: Parian retains what it needs. */
  clReleaseMemObject(scratch);
  clReleaseMemObject(vertices);
  clReleaseMemObject(triangles);
  clReleaseCommandQueue(queue);
  clReleaseContext(context);
  parian_release(renderer);
  clReleaseMemObject(pixels);
  return 0;
}
