// The library's S_d over the arrays of plain_dipole.cl, at any width: what follows the headers of the library's
// program. As in scattering.cl, several samples take each step side by side where there are lanes, so that a CPU
// computes one while it waits for another.

#if VW == 1
#define SIDE_BY_SIDE 1u
#define LOAD(p) (*(p))
#else
#define SIDE_BY_SIDE 4u
#define LOAD(p) PASTE(vload, VW)(0, p)
#endif

static real3 load(__global const float* components, uint stride, uint at) {
  return real3_make(LOAD(components + at), LOAD(components + stride + at), LOAD(components + 2 * stride + at));
}

__kernel void library_dipole(const uint n_points, const uint n_samples, const uint stride, const uint all_samples,
                             __constant Medium* media, const Boundary boundary, __global const float* restrict samples,
                             __global const float* restrict points, __global float* restrict sums) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_points) return;
  __global const float* p = points + 6 * i;
  const real3 x_o = real3_make(real_splat(p[0]), real_splat(p[1]), real_splat(p[2]));
  const real3 n_o = real3_make(real_splat(p[3]), real_splat(p[4]), real_splat(p[5]));
  real sum[3];
  UNROLL for (uint c = 0; c < 3; ++c) sum[c] = real_splat(0.0f);
  const uint last = i * stride + n_samples;
  for (uint first = i * stride; first < last; first += SIDE_BY_SIDE * VW) {
    const uint n = min(SIDE_BY_SIDE, (last - first) / VW);
    DipoleGeometry geometry[SIDE_BY_SIDE];
    for (uint k = 0; k < n; ++k) {
      const uint j = first + k * VW;
      const real3 x_i = load(samples, all_samples, j), w_i = load(samples + 3 * all_samples, all_samples, j);
      const real3 n_i = load(samples + 6 * all_samples, all_samples, j);
      geometry[k] = dipole_geometry(real3_sub(x_o, x_i), refract_into(w_i, n_i, boundary), n_i, n_o);
    }
    for (uint k = 0; k < n; ++k) UNROLL for (uint c = 0; c < 3; ++c) sum[c] += bssrdf(media[c], boundary, geometry[k]);
  }
  for (uint c = 0; c < 3; ++c) {
    float total = 0.0f;
    for (uint lane = 0; lane < VW; ++lane) total += ((const float*)&sum[c])[lane];
    sums[3 * i + c] = total;
  }
}
