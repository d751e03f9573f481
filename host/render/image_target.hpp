// Somebody's buffer that an image is written to.
#pragma once
#include <CL/opencl.hpp>

namespace parian {

struct ImageTarget {
  cl::Buffer buffer;             ///< of float4: linear RGB premultiplied by alpha, alpha
  cl_uint first = 0, pitch = 0;  ///< in pixels: where the image begins, and from row to row
  cl_uint positions = 64;        ///< subpixel positions to gather at
  float gain = 1.0F;             ///< of RGB
};

}  // namespace parian
