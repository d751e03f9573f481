// Pass 2: at each needed layer texel, the directional dipole summed over samples of the light maps.
//
// Build options: VW lanes, MODEL, ESTIMATOR (0 density around the nearest lit place, 1 exponential radii and 2 uniform
// disc around the point's projection), MEDIA (distinct channels of the medium) and MEDIUM_R, _G, _B (the medium
// of each colour, MEDIA where a colour has none).
#include "bssrdf.h"
#include "sampling.h"

#define PI_F 3.14159265358979f
#define POINT_BITS 0x40000000u  // with them an index kept as a float is a normal number, which no device flushes
#define NO_SLOT 0xffffffffu     // of a texel without values

// What every evaluation reads: lights with their maps, the medium, and the density of samples.
typedef struct {
  __constant Light* lights;
  __global const float4* map;  // of all lights, halves A then B
  __constant Medium* media;
  Boundary boundary;
  Density density;
  __global const float2* rho;
  uint seed;
} Transport;

// In the light's own frame: the direction towards it, and a texel's shading normal, unpacked.
static real3 towards_light(void) { return real3_make(real_splat(0.0f), real_splat(0.0f), real_splat(1.0f)); }

static real3 shading_normal(mask packed) {
  const real n_x = convert_real((packed << 16) >> 16) * (1.0f / 32767.0f);
  const real n_y = convert_real(packed >> 16) * (1.0f / 32767.0f);
  return real3_make(n_x, n_y, real_sqrt(real_max(1.0f - n_x * n_x - n_y * n_y, real_splat(1e-4f))));
}

// Where samples of one light are centred for one point: (x, y in the light's frame, h, log G(h)). Inlined,
// since a GPU would pass the density through memory.
__attribute__((always_inline)) static float4 sampling_centre(float3 x, float3 n, __constant Light* light,
                                                             __global const float4* map, Boundary boundary,
                                                             Density density, __global const float2* rho,
                                                             __global const float2* extent,
                                                             __constant uint* level_first, uint levels) {
  const float3 p = to_frame(light->view, x - light->view.origin.xyz);
#if ESTIMATOR != 0
  return (float4)(p.xy, 0.0f, 0.0f);
#else
  const float scale = light->view.scale;
  const float2 corner = (float2)(light->sample_x[0] - 0.5f, light->sample_y[0] - 0.5f);
  const float3 t = (float3)(p.x * scale + light->view.centre_x - corner.x,
                            p.y * scale + light->view.centre_y - corner.y, p.z * scale);
  const Lit nearest = nearest_lit(t, light, map, extent, level_first, levels);
  const float2 centre = nearest.place + corner;
  // Light that runs along the surface at x has its real source near the surface: mu_0 / 3 mean free paths (FHK 25).
  float d_min = 0.0f, h_min = density.h_min;
  if (nearest.distance_sq < FLT_MAX) {
    d_min = sqrt(nearest.distance_sq) / scale;
    const mask packed = as_mask(real_splat(map[light->map + nearest.texel].w));
    const real3 w12 = refract_into(towards_light(), shading_normal(packed), boundary);
    const float3 n_o = to_frame(light->view, n);
    const float mu_0 = -(LANE(w12.x, 0) * n_o.x + LANE(w12.y, 0) * n_o.y + LANE(w12.z, 0) * n_o.z);
    if (mu_0 > 0.0f) h_min *= clamp(mu_0 / 0.75f, LEAST_H_MIN, 1.0f);
  }
  const float h = sqrt(h_min * h_min + d_min * d_min);
  uint low = 0, high = density.entries - 1;  // rho falls: rho[low] > h >= rho[high]
  while (high - low > 1) {
    const uint middle = (low + high) / 2;
    if (rho[middle].x > h)
      low = middle;
    else
      high = middle;
  }
  const float log_G =
      density.log_G_min + ((float)low + clamp((rho[low].x - h) / rho[low].y, 0.0f, 1.0f)) / density.inverse_step;
  return (float4)((centre.x - light->view.centre_x) / scale, (centre.y - light->view.centre_y) / scale, h, log_G);
#endif
}

// cos and sin of 2 pi v for v in [0, 1): the same bits wherever sums and products are.
static void turn(real v, real* c, real* s) {
  const real quarter = floor(v * 4.0f + 0.5f), t = (v - quarter * 0.25f) * (2.0f * PI_F), t2 = t * t;
  const real cosine = 1.0f + t2 * (-0.5f + t2 * (1.0f / 24.0f + t2 * (-1.0f / 720.0f + t2 * (1.0f / 40320.0f))));
  const real sine =
      t * (1.0f + t2 * (-1.0f / 6.0f + t2 * (1.0f / 120.0f + t2 * (-1.0f / 5040.0f + t2 * (1.0f / 362880.0f)))));
  const mask swap = (quarter == 1.0f) | (quarter == 3.0f);
  const real a = real_select(swap, sine, cosine), b = real_select(swap, cosine, sine);
  *c = real_select((quarter == 1.0f) | (quarter == 2.0f), -a, a);
  *s = real_select((quarter == 2.0f) | (quarter == 3.0f), -b, b);
}

#if ESTIMATOR != 2
// Natural logarithm of a normal number in (0, 1], to 1e-7: the built-in one is scalar on some CPU drivers.
static real log_of_fraction(real t) {
  const mask bits = as_mask(t), exponent = (bits - 0x3f400000) & (int)0xff800000;  // mantissa in [0.75, 1.5)
  const real m = as_real(bits - exponent), z = (m - 1.0f) / (m + 1.0f), z2 = z * z;
  const real series = 2.0f * z * (1.0f + z2 * (1.0f / 3.0f + z2 * (0.2f + z2 * (1.0f / 7.0f + z2 * (1.0f / 9.0f)))));
  return convert_real(exponent >> 23) * 0.69314718f + series;
}
#endif

// A sample's distance from the centre and the inverse of its area density (0: outside of what is sampled), from one
// number of the sequence; `t` is 1 - u.
static real sample_radius(Density density, __global const float2* rho_table, float h, float log_G, real t,
                          real* weight) {
#if ESTIMATOR == 0
  // rho = G^-1(t G(h)), r^2 = rho^2 - h^2. Within a step rho is linear in log G with slope s, so that the area density
  // is t / (2 pi |s| rho): exact, whatever the table's own error.
  const real position = (log_of_fraction(t) + log_G - density.log_G_min) * density.inverse_step;
  const real cell = real_min(real_max(floor(position), real_splat(0.0f)), real_splat((float)density.entries - 2.0f));
  const ureal entry = convert_ureal(cell);
#define RHO(lane) rho_table[LANE(entry, lane)].x
#define FALL(lane) rho_table[LANE(entry, lane)].y
  const real fall = FROM_LANES(FALL), rho = FROM_LANES(RHO) - fall * (position - cell);
  *weight = real_select(position >= 0.0f, 2.0f * PI_F * density.inverse_step * fall * rho / t, real_splat(0.0f));
  return real_sqrt(real_max(rho * rho - h * h, real_splat(0.0f)));
#elif ESTIMATOR == 1
  const float reach = 1.0f - exp(-density.sigma * density.radius);
  const real decay = 1.0f - (1.0f - t) * reach, r = -log_of_fraction(decay) / density.sigma;
  *weight = 2.0f * PI_F * r * reach / (density.sigma * decay);
  return r;
#else
  *weight = real_splat(PI_F * density.radius * density.radius);
  return density.radius * real_sqrt(t);
#endif
}

// Scattered radiance (without T21) at x with normal n, from light l, of one half: rounds `round` to `round + rounds` -
// 1 of the point's own sequence, each of as many samples as the light takes in a frame, summed over rounds. Inlined,
// since a GPU would pass what it takes through memory.
__attribute__((always_inline)) static float3 scattered_radiance(Transport transport, uint l, float4 centre, float3 x,
                                                                float3 n, uint point, uint half_index, uint round,
                                                                uint rounds) {
  __constant Light* light = transport.lights + l;
  const View view = light->view;
  const float3 p = to_frame(view, x - view.origin.xyz), n_frame = to_frame(view, n);
  const real3 n_o = real3_make(real_splat(n_frame.x), real_splat(n_frame.y), real_splat(n_frame.z));
  const float sample_x = light->sample_x[half_index], sample_y = light->sample_y[half_index];
  __global const float4* map = transport.map + light->map + half_index * view.width * view.height;
  const uint scramble = hash_combine(hash_combine(point, transport.seed), 2 * l + half_index);
  const uint shift_u = hash(scramble), shift_v = hash(scramble ^ 0x68bc21ebu);
  const uint first = round * light->samples, last = first + rounds * light->samples;
  real sum[MEDIA + 1];
  UNROLL for (uint m = 0; m <= MEDIA; ++m) sum[m] = real_splat(0.0f);
  for (uint j = first; j < last; j += VW) {
    const ureal index = j + LANES;
    const real t = (real_from_bits((index * R2_STEP_U + shift_u) >> 8) + 0.5f) * 0x1p-24f;
    const real v = real_from_bits((index * R2_STEP_V + shift_v) >> 8) * 0x1p-24f;
    real weight, cosine, sine;
    const real r = sample_radius(transport.density, transport.rho, centre.z, centre.w, t, &weight);
    turn(v, &cosine, &sine);
    const real light_x = centre.x + r * cosine, light_y = centre.y + r * sine;
    const real film_x = light_x * view.scale + view.centre_x, film_y = light_y * view.scale + view.centre_y;
    const real column = floor(film_x - sample_x + 0.5f), row = floor(film_y - sample_y + 0.5f);
    mask lit =
        (column >= 0.0f) & (column < (float)view.width) & (row >= 0.0f) & (row < (float)view.height) & (weight > 0.0f);
#if VW > 1
    lit &= index < (ureal)(last);
#endif
    // Texels are read lane by lane; everything else is as wide as the device likes.
    const ureal texel = convert_ureal(real_select(lit, row * (float)view.width + column, real_splat(0.0f)));
#define HEIGHT(lane) map[LANE(texel, lane)].x
#define SLOPE_X(lane) map[LANE(texel, lane)].y
#define SLOPE_Y(lane) map[LANE(texel, lane)].z
#define NORMAL(lane) map[LANE(texel, lane)].w
    const real height = FROM_LANES(HEIGHT), slope_x = FROM_LANES(SLOPE_X), slope_y = FROM_LANES(SLOPE_Y);
    const mask packed = as_mask(FROM_LANES(NORMAL));
    lit &= height > UNLIT;
    // The light ray through the sample meets the plane of the texel's geometric normal.
    const real light_z =
        height + (slope_x * (film_x - column - sample_x) + slope_y * (film_y - row - sample_y)) / view.scale;
    const real3 n_i = shading_normal(packed);
    const real3 w12 = refract_into(towards_light(), n_i, transport.boundary);
    const real T12 = fresnel_transmittance(n_i.z, transport.boundary);
    const DipoleGeometry geometry =
        dipole_geometry(real3_make(p.x - light_x, p.y - light_y, p.z - light_z), w12, n_i, n_o);
    const real factor = real_select(lit, weight * T12, real_splat(0.0f));
    UNROLL for (uint m = 0; m < MEDIA; ++m) sum[m] += factor * bssrdf(transport.media[m], geometry);
  }
  return light->irradiance.xyz * (float3)(real_sum(sum[MEDIUM_R]), real_sum(sum[MEDIUM_G]), real_sum(sum[MEDIUM_B]));
}

static Transport make_transport(__constant Light* lights, __global const float4* map, __constant Medium* media,
                                Boundary boundary, Density density, __global const float2* rho, uint seed) {
  Transport t;
  t.lights = lights;
  t.map = map;
  t.media = media;
  t.boundary = boundary;
  t.density = density;
  t.rho = rho;
  t.seed = seed;
  return t;
}

// Geometry of every texel of one layer, (n_g in the layer's frame, q), its triangle, and slot 0 (covered) or NO_SLOT
// (empty).
__kernel void layers_resolve(const View view, __global const uint* restrict ids,
                             __global const float4* restrict positions, __global const uint* restrict triangles,
                             __global const float* restrict normals, const uint first,
                             __global uint* restrict layer_ids, __global float4* restrict geometry,
                             __global uint* restrict slots) {
  const uint i = (uint)get_global_id(0);
  if (i >= view.width * view.height) return;
  float4 texel = (float4)(0.0f);
  if (ids[i] != NO_TRIANGLE) {
    const float px = (float)(i % view.width) + 0.5f, py = (float)(i / view.width) + 0.5f;
    const Surface s = surface_at(view, px, py, ids[i], positions, triangles, normals);
    texel = (float4)(to_frame(view, s.n_g), dot(s.x - view.origin.xyz, view.back.xyz) + 2.0f);
  }
  layer_ids[first + i] = ids[i];
  geometry[first + i] = texel;
  slots[first + i] = ids[i] != NO_TRIANGLE ? 0 : NO_SLOT;
}

// The needed texels' points: (x, texel) and (n_s, 0), and where their samples are centred: light after light.
__kernel void layers_points(__constant View* views, const uint n_points, __global const uint* restrict needed,
                            __global const uint* restrict ids, __global const float4* restrict positions,
                            __global const uint* restrict triangles, __global const float* restrict normals,
                            __constant Light* lights, __global const float4* restrict map, const Boundary boundary,
                            const Density density, __global const float2* restrict rho,
                            __global const float2* restrict extent, __constant uint* level_first, const uint levels,
                            const uint n_lights, __global float4* restrict points, __global float4* restrict centres) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_points) return;
  const uint texel = needed[i], size = views[0].width * views[0].height, layer = texel / size, t = texel % size;
  const View view = views[layer];
  const float px = (float)(t % view.width) + 0.5f, py = (float)(t / view.width) + 0.5f;
  const Surface s = surface_at(view, px, py, ids[texel], positions, triangles, normals);
  points[2 * i] = (float4)(s.x, as_float(texel | POINT_BITS));
  points[2 * i + 1] = (float4)(s.n_s, 0.0f);
  for (uint l = 0; l < n_lights; ++l)
    centres[l * n_points + i] =
        sampling_centre(s.x, s.n_s, lights + l, map, boundary, density, rho, extent, level_first, levels);
}

// Some rounds of samples of one light for both halves of every point: values[2 i + half] sums them, RGB, and what was
// there before.
__kernel void layers_accumulate(const uint n_points, __global const float4* restrict points,
                                __global const float4* restrict centres, const uint l, __constant Light* lights,
                                __global const float4* restrict map, __constant Medium* media, const Boundary boundary,
                                const Density density, __global const float2* restrict rho, const uint seed,
                                const uint round, const uint rounds, const uint add, __global float4* restrict values) {
  const uint i = (uint)get_global_id(0);
  if (i >= 2 * n_points) return;
  const uint half_index = i >= n_points, point = i - half_index * n_points;  // one half's maps stay in the caches
  const Transport transport = make_transport(lights, map, media, boundary, density, rho, seed);
  const float4 x = points[2 * point];
  const float3 radiance =
      scattered_radiance(transport, l, centres[l * n_points + point], x.xyz, points[2 * point + 1].xyz,
                         as_uint(x.w) & ~POINT_BITS, half_index, round, rounds);
  const uint slot = 2 * point + half_index;
  const float4 before = add ? values[slot] : (float4)(0.0f);
  values[slot] = before + (float4)(radiance, 0.0f);
}

// For the choice of layers: how well a view and the opposite one see each point of the surface, its cosine, or 0 where
// it is hidden; one after the other from `first` on.
__kernel void layers_visibility(const View view, __global const uint* restrict nearest,
                                __global const uint* restrict farthest, const uint n_points,
                                __global const float4* restrict points, const uint first,
                                __global float* restrict quality) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_points) return;
  const float3 n = points[2 * i + 1].xyz, film = film_coordinates(view, view_coordinates(view, points[2 * i].xyz));
  const float cosine = fabs(dot(n, view.back.xyz));
  const int x = clamp((int)film.x, 0, (int)view.width - 1), y = clamp((int)film.y, 0, (int)view.height - 1);
  const uint pixel = (uint)y * view.width + (uint)x;
  const int empty = nearest[pixel] == NO_DEPTH;
  const float front = empty ? 0.0f : as_float(~nearest[pixel]), back = empty ? FLT_MAX : as_float(~farthest[pixel]);
  // Within the texel the surface itself rises by its slope; a quarter more forgives the neighbours' curvature.
  const float rise = (0.25f + 0.7071f * sqrt(1.0f - fmin(cosine * cosine, 1.0f)) / fmax(cosine, 0.05f)) / view.scale;
  quality[first + i] = film.z + rise >= front ? cosine : 0.0f;
  quality[first + n_points + i] = film.z - rise <= back ? cosine : 0.0f;
}
