// The directional dipole as its paper prints it, eight samples side by side, three channels: what the library's own
// form is measured against, in speed and in value. Nothing here is clever, so that it stays a measure. FHK: Frisvad,
// Hachisuka, Kjeldsen, Directional Dipole Model for Subsurface Scattering, 2014.

typedef struct {
  float8 x, y, z;
} Vector;

// One channel of a medium, lengths in the unit of the positions.
typedef struct {
  float sigma_t, D, sigma_tr, d_e, z_v, C_phi, C_E, C_phi_inv;
} PlainMedium;

static Vector vector(float8 x, float8 y, float8 z) {
  Vector v;
  v.x = x;
  v.y = y;
  v.z = z;
  return v;
}
static Vector add(Vector a, Vector b) { return vector(a.x + b.x, a.y + b.y, a.z + b.z); }
static Vector scale(Vector a, float8 s) { return vector(a.x * s, a.y * s, a.z * s); }
static float8 dot3(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static Vector cross3(Vector a, Vector b) {
  return vector(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static float8 length3(Vector a) { return sqrt(dot3(a, a)); }
static Vector divided(Vector a, float8 s) { return vector(a.x / s, a.y / s, a.z / s); }

// Eight vectors from arrays of their components, each `stride` long.
static Vector load(__global const float* components, uint stride, uint at) {
  return vector(vload8(0, components + at), vload8(0, components + stride + at),
                vload8(0, components + 2 * stride + at));
}

// S'_d (FHK 20).
static float8 source(PlainMedium m, Vector x, Vector w, float8 d, Vector n_o) {
  const float8 t = m.sigma_tr * d, x_w = dot3(x, w);
  const float8 fluence = d * d / m.D + 3.0f * (1.0f + t) * x_w;
  const float8 flux = 3.0f * m.D * (1.0f + t) * dot3(w, n_o) -
                      ((1.0f + t) + 3.0f * m.D * (3.0f * (1.0f + t) + t * t) / (d * d) * x_w) * dot3(x, n_o);
  return 1.0f / (4.0f * m.C_phi_inv) / (4.0f * M_PI_F * M_PI_F) * exp(-t) / (d * d * d) *
         (m.C_phi * fluence - m.C_E * flux);
}

// S_d (FHK 23 to 26), from x = x_o - x_i and the refracted direction w.
static float8 dipole(PlainMedium m, Vector x, Vector w, Vector n_i, Vector n_o) {
  const float8 r = length3(x), x_w = dot3(x, w), mu_0 = -dot3(n_o, w);
  const Vector n_cross_x = cross3(n_i, x);
  const Vector n_star = cross3(divided(x, r), divided(n_cross_x, length3(n_cross_x)));
  const float8 cos_beta = -sqrt((r * r - x_w * x_w) / (r * r + m.d_e * m.d_e));
  const float8 lit = m.D * mu_0 * (m.D * mu_0 - 2.0f * m.d_e * cos_beta);
  const float8 back = (float8)(1.0f / (3.0f * m.sigma_t) / (3.0f * m.sigma_t));
  const float8 d_r = sqrt(r * r + select(back, lit, mu_0 > 0.0f));
  const Vector x_from_virtual = add(x, scale(n_star, (float8)(-m.z_v)));
  const Vector w_v = add(w, scale(n_star, -2.0f * dot3(w, n_star)));
  return fmax(source(m, x, w, d_r, n_o) - source(m, x_from_virtual, w_v, length3(x_from_virtual), n_o), 0.0f);
}

// S_d of each channel, summed over n_samples from sample i * stride on, of point i: (x, n_o) from `points`. A sample
// is (x_i, w_i, n_i) as arrays of components.
__kernel void plain_dipole(const uint n_points, const uint n_samples, const uint stride, const uint all_samples,
                           __constant PlainMedium* media, const float eta, __global const float* restrict samples,
                           __global const float* restrict points, __global float* restrict sums) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_points) return;
  __global const float* p = points + 6 * i;
  const Vector x_o = vector((float8)(p[0]), (float8)(p[1]), (float8)(p[2]));
  const Vector n_o = vector((float8)(p[3]), (float8)(p[4]), (float8)(p[5]));
  float8 red = (float8)(0.0f), green = (float8)(0.0f), blue = (float8)(0.0f);
  for (uint j = i * stride; j < i * stride + n_samples; j += 8) {
    const Vector x_i = load(samples, all_samples, j), w_i = load(samples + 3 * all_samples, all_samples, j);
    const Vector n_i = load(samples + 6 * all_samples, all_samples, j);
    const float8 c = dot3(w_i, n_i);
    const Vector along = scale(add(scale(n_i, c), scale(w_i, (float8)(-1.0f))), (float8)(1.0f / eta));
    const Vector w = add(along, scale(n_i, -sqrt(1.0f - (1.0f - c * c) / (eta * eta))));
    const Vector x = add(x_o, scale(x_i, (float8)(-1.0f)));
    red += dipole(media[0], x, w, n_i, n_o);
    green += dipole(media[1], x, w, n_i, n_o);
    blue += dipole(media[2], x, w, n_i, n_o);
  }
  const float8 channels[3] = {red, green, blue};
  for (uint c = 0; c < 3; ++c) {
    const float4 half_sum = channels[c].lo + channels[c].hi;
    sums[3 * i + c] = (half_sum.x + half_sum.y) + (half_sum.z + half_sum.w);
  }
}
