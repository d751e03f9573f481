// How many floating-point operations a device can do in a second, for `parian bench`: a program of its own, so that
// nothing of it is compiled for a render.
#include "types.h"

__kernel void bench_peak(const uint n_items, const uint rounds, const float a, const float b,
                         __global float* restrict sums) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_items) return;
  real x[PEAK_CHAINS];
  UNROLL for (uint c = 0; c < PEAK_CHAINS; ++c) x[c] = convert_real(LANES + c * VW);  // equal lanes would be merged
  for (uint r = 0; r < rounds; ++r) {
    UNROLL for (uint c = 0; c < PEAK_CHAINS; ++c) x[c] = mad(x[c], real_splat(a), real_splat(b));
  }
  real sum = real_splat(0.0f);
  UNROLL for (uint c = 0; c < PEAK_CHAINS; ++c) sum += x[c];
  float total = 0.0f;
  UNROLL for (uint lane = 0; lane < VW; ++lane) total += ((const float*)&sum)[lane];
  sums[i] = total;
}
