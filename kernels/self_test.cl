// The program that asks a device what it must get right before a render trusts it (host/render/self_test.cpp), and S_d
// of single pairs of points for `parian check`. The functions judged are those that render.
#include "bssrdf.h"
#include "raster.cl"

#if VW == 1
#define LOAD_REAL(p) (*(p))
#define STORE_REAL(v, p) (*(p) = (v))
#else
#define LOAD_REAL(p) PASTE(vload, VW)(0, p)
#define STORE_REAL(v, p) PASTE(vstore, VW)(v, 0, p)
#endif

// Geometry of VW pairs from `first` on: components x_i, w_i, n_i, x_o, n_o, each an array of `stride`.
static real3 load_vector(__global const float* vectors, uint component, uint stride, uint first) {
  __global const float* v = vectors + component * stride + first;
  return real3_make(LOAD_REAL(v), LOAD_REAL(v + stride), LOAD_REAL(v + 2 * stride));
}
static DipoleGeometry load_geometry(__global const float* vectors, uint stride, uint first, Boundary boundary) {
  const real3 n_i = load_vector(vectors, 6, stride, first);
  const real3 w12 = refract_into(load_vector(vectors, 3, stride, first), n_i, boundary);
  const real3 x = real3_sub(load_vector(vectors, 9, stride, first), load_vector(vectors, 0, stride, first));
  return dipole_geometry(x, w12, n_i, load_vector(vectors, 12, stride, first));
}

// S of pairs that have a medium and a boundary each; every lane works on all of a work-item's media, and keeps its own.
__kernel void self_test_pairs(__global const Medium* restrict media, __global const Boundary* restrict boundaries,
                              __global const float* restrict vectors, const uint stride, __global float* restrict S) {
  const uint item = (uint)get_global_id(0), first = item * VW;
  if (first >= stride) return;
  for (uint lane = 0; lane < VW; ++lane) {
    const Boundary boundary = boundaries[first + lane];
    const real all = bssrdf(media[first + lane], boundary, load_geometry(vectors, stride, first, boundary));
    S[first + lane] = ((const float*)&all)[lane];
  }
}

#define LAYOUT(T, last)                                       \
  {                                                           \
    T value;                                                  \
    layout[n++] = (uint)sizeof(T);                            \
    layout[n++] = (uint)((char*)&value.last - (char*)&value); \
  }

// SELF_TEST_ITEMS work-items in groups of any power of two. Every check has results of its own, so that what fails can
// be named.
__kernel void self_test(const Medium medium, const Boundary boundary, __global const float* restrict arguments,
                        __global const float* restrict vectors, __global uint* restrict layout,
                        __global uint* restrict reduced, __global uint* minimum, __global float* restrict values) {
  const uint item = (uint)get_global_id(0), member = (uint)get_local_id(0), members = (uint)get_local_size(0);
  __local uint sums[SELF_TEST_ITEMS];
  sums[member] = item * item + 1;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (uint half_of = members / 2; half_of > 0; half_of /= 2) {
    if (member < half_of) sums[member] += sums[member + half_of];
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  reduced[item] = sums[0];
  atomic_min(minimum, SELF_TEST_MINIMUM + (item * 37u + 11u) % SELF_TEST_ITEMS);

  const uint stride = SELF_TEST_ITEMS * VW, first = item * VW;
  const real argument = LOAD_REAL(arguments + first);
  STORE_REAL(real_exp(-argument), values + first);
  STORE_REAL(real_expm1(-argument), values + stride + first);
  STORE_REAL(real_sqrt(argument), values + 2 * stride + first);
  STORE_REAL(real_rsqrt(argument), values + 3 * stride + first);
  STORE_REAL(bssrdf(medium, boundary, load_geometry(vectors, stride, first, boundary)), values + 4 * stride + first);

  if (item > 0) return;
  uint n = 0;
  STRUCTS_THAT_CROSS(LAYOUT)
}
