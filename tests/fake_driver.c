/* A driver of OpenCL that offers nothing: PARIAN_FAKE_DRIVER says how it goes about it. */
#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>
#include <stdlib.h>
#include <string.h>

static cl_int platforms(cl_uint room, cl_platform_id* found, cl_uint* count) {
  const char* way = getenv("PARIAN_FAKE_DRIVER");
  (void)room, (void)found;
  if (way && strcmp(way, "crash") == 0) abort();
  if (way && strcmp(way, "exit") == 0) exit(1);
  if (count) *count = 0;
  return way && strcmp(way, "memory") == 0 ? CL_OUT_OF_HOST_MEMORY : -1001; /* as vendors' drivers without their GPU */
}

cl_int clIcdGetPlatformIDsKHR(cl_uint room, cl_platform_id* found, cl_uint* count);
cl_int clIcdGetPlatformIDsKHR(cl_uint room, cl_platform_id* found, cl_uint* count) {
  return platforms(room, found, count);
}

void* clGetExtensionFunctionAddress(const char* name) {
  union {
    cl_int (*function)(cl_uint, cl_platform_id*, cl_uint*);
    void* address;
  } found = {platforms};
  return strcmp(name, "clIcdGetPlatformIDsKHR") == 0 ? found.address : NULL;
}

cl_int clGetPlatformInfo(cl_platform_id platform, cl_platform_info what, size_t size, void* value, size_t* needed) {
  (void)platform, (void)what, (void)size, (void)value, (void)needed;
  return CL_INVALID_PLATFORM;
}
