// Pass 2, light: at any point, the directional dipole summed over samples of the light maps.
//
// Build options: VW lanes, MODEL, ESTIMATOR (0 density around the nearest lit place, 1 exponential radii and 2 uniform
// disc around the point's projection), MEDIA (distinct channels of the medium) and MEDIUM_R, _G, _B (the medium
// of each colour, MEDIA where a colour has none).
#ifndef PARIAN_SCATTERING_CL
#define PARIAN_SCATTERING_CL
#include "bssrdf.h"
#include "guide.cl"
#include "light_map.cl"
#include "sampling.h"

#define PI_F 3.14159265358979f
#define NO_GUIDE 0xffffffffu
#define POINT_BITS 0x40000000u  // with them an index kept as a float is a normal number, which no device flushes

#if VW == 1  // a work-item takes samples of one half; else of both, side by side
#define HALVES_OF_ITEM 1u
#define POINTS_OF_ITEM 1u
#define OF_HALVES(type, half_index, a, b) ((half_index) ? (b) : (a))
#else
#define HALVES_OF_ITEM 2u
#define POINTS_OF_ITEM POINTS_SIDE_BY_SIDE
#define OF_HALVES(type, half_index, a, b) BOTH_HALVES(type, a, b)
#endif
#define LANES_OF_HALF (VW / HALVES_OF_ITEM)

// What every evaluation reads: lights with their maps, the medium, and the density of samples.
typedef struct {
  __constant Light* lights;
  __global const float4* map;  // of all lights, halves A then B
  __constant Medium* media;
  Boundary boundary;
  Density density;
  __global const float2* rho;
  __global const uint* guides;
  uint first_guide;  // of the light; 0 if points have none
  uint seed;
} Transport;

// The direction towards the light, in its own frame.
static real3 towards_light(void) { return real3_make(real_splat(0.0f), real_splat(0.0f), real_splat(1.0f)); }

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
  Lit nearest;
  nearest_lit(t, light, map, extent, level_first, levels, &nearest);
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

// cos and sin of 2 pi v for v in [0, 1), to 1e-7, by twice the angle: minimax polynomials in a quarter turn around 1/2.
static void turn(real v, real* c, real* s) {
  CONTRACT
  const real a = v - 0.5f, a2 = a * a;
  const real sine =
      a * (3.14159258f + a2 * (-5.16770688f + a2 * (2.55003138f + a2 * (-0.59804518f + a2 * 0.07722014f))));
  const real cosine =
      1.0f + a2 * (-4.93480214f + a2 * (4.05870917f + a2 * (-1.33521207f + a2 * (0.23493762f + a2 * -0.0243968f))));
  *c = 2.0f * sine * sine - 1.0f;
  *s = -2.0f * sine * cosine;
}

#if ESTIMATOR != 2
// Natural logarithm of a normal number in (0, 1], to 1e-7: the built-in one is scalar on some CPU drivers.
static real log_of_fraction(real t) {
  CONTRACT
  const mask bits = as_mask(t), exponent = (bits - 0x3f400000) & (int)0xff800000;  // mantissa in [0.75, 1.5)
  const real x = as_real(bits - exponent) - 1.0f;
  const real rest =
      0.3333345f +
      x * (-0.24995384f +
           x * (0.19982817f + x * (-0.16812843f + x * (0.14920818f + x * (-0.11968618f + x * 0.0535716f)))));
  return convert_real(exponent >> 23) * 0.69314718f + (x + x * x * (x * rest - 0.5f));
}
#endif

// A sample's distance from the centre and the inverse of its area density (0: outside of what is sampled), from one
// number of the sequence, from far to near.
static real sample_radius(Density density, __global const float2* rho_table, float h, float log_G, real t,
                          real* weight) {
  CONTRACT
#if ESTIMATOR == 0
  // rho = G^-1(t G(h)), r^2 = rho^2 - h^2. Within a step rho is linear in log G with slope s, so that the area density
  // is t / (2 pi |s| rho): exact, whatever the table's own error.
  const real position = (log_of_fraction(t) + log_G - density.log_G_min) * density.inverse_step;
  const real cell = real_min(real_max(floor(position), real_splat(0.0f)), real_splat((float)density.entries - 2.0f));
  const ureal entry = convert_ureal(cell);
#define READ_ELEMENT(k) rho_table[INDEX(entry, k)]
  READ_PAIRS(rho_table, entry, rho_of_entry, fall)
#undef READ_ELEMENT
  const real rho = rho_of_entry - fall * (position - cell);
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

#if ESTIMATOR == 0
// Bits in reverse order. The first step is a built-in function: of two shifts, compilers make one rotation or, with the
// steps after it, one reversal, and Oclgrind 21.10 knows neither.
static ureal reversed(ureal x) {
  x = rotate(x, (ureal)(16u));
  x = (x >> 8 & 0x00ff00ffu) | (x & 0x00ff00ffu) << 8;
  x = (x >> 4 & 0x0f0f0f0fu) | (x & 0x0f0f0f0fu) << 4;
  x = (x >> 2 & 0x33333333u) | (x & 0x33333333u) << 2;
  return (x >> 1 & 0x55555555u) | (x & 0x55555555u) << 1;
}
#endif

// Where samples of one light fall, side by side: in the light's frame, from their texels' own samples, in which texels,
// and the inverse of their density, 0 where there is nothing to add.
typedef struct {
  real x, y, off_x, off_y, weight;
  ureal texel;
} Fall;

// Samples of the point's sequences of halves A and B from `first` on, up to `last`; the guide's and the others in turn,
// if there is a guide.
static Fall sample_fall(Transport transport, uint l, float4 centre, uint point, uint guide, ureal places,
                        uint half_index, uint first, uint last) {
  CONTRACT
  __constant Light* light = transport.lights + l;
  const float scale = light->view.scale, width = (float)light->view.width;
#if ESTIMATOR == 0
  const uint sequence = block_of_point(point), of_class = class_of_point(point);
#else  // the baselines: an R2 sequence for each point
  const uint sequence = point, of_class = 0;
#endif
  const uint scramble = hash_combine(sequence, transport.seed), texels = light->view.width * light->view.width;
  const uint scramble_a = hash_combine(scramble, 2 * light->number);
  const uint scramble_b = hash_combine(scramble, 2 * light->number + 1);
  const real sample_x = OF_HALVES(float, half_index, light->sample_x[0], light->sample_x[1]);
  const real sample_y = OF_HALVES(float, half_index, light->sample_y[0], light->sample_y[1]);
  const uint v_a = hash(scramble_a ^ 0x68bc21ebu), v_b = hash(scramble_b ^ 0x68bc21ebu);
  const ureal hash_u = OF_HALVES(uint, half_index, hash(scramble_a), hash(scramble_b));
  const ureal shift_u = hash_u + of_class * CLASS_STEP_U,
              shift_v = OF_HALVES(uint, half_index, v_a, v_b) + of_class * CLASS_STEP_V;
  const ureal index = first + LANES, half_map = OF_HALVES(uint, half_index, 0u, texels);
#if ESTIMATOR == 0
  // Each sampler has a sequence of its own; which one is first depends on the block, as otherwise the sums of odd
  // numbers of samples would be biased. t runs through its range and back, as lattices err where a function isn't
  // periodic (Hickernell 2002).
  const ureal guided = guide != NO_GUIDE ? 1u - ((index ^ hash_u) & 1u) : (ureal)(0u), other = guided * 0x3c6ef372u;
  const ureal u = places + shift_u + other;
  const ureal folded = u ^ as_ureal(as_mask(u) >> 31);
  const real t = (real_from_bits(folded >> 7) + 0.5f) * 0x1p-24f;
  const real v = real_from_bits((places * LATTICE_V + shift_v + other) >> 8) * 0x1p-24f;
#else
  const real t = (real_from_bits((index * R2_STEP_U + shift_u) >> 8) + 0.5f) * 0x1p-24f;
  const real v = real_from_bits((index * R2_STEP_V + shift_v) >> 8) * 0x1p-24f;
#endif
  Fall f;
  real weight, cosine, sine;
  const real r = sample_radius(transport.density, transport.rho, centre.z, centre.w, t, &weight);
  turn(v, &cosine, &sine);
  f.x = centre.x + r * cosine;
  f.y = centre.y + r * sine;
#if ESTIMATOR == 0
  if (guide != NO_GUIDE) {
    const uint guide_b = guide + GUIDE_SIZE;
    const uint list_a = 2 * l * LIST_SIZE(texels), list_b = list_a + LIST_SIZE(texels);
    const float parts_a = as_float(transport.guides[guide + PARTS_PER_TEXEL]);
    const float parts_b = as_float(transport.guides[guide_b + PARTS_PER_TEXEL]);
    guide_samples(transport.guides, OF_HALVES(uint, half_index, guide, guide_b),
                  OF_HALVES(uint, half_index, list_a, list_b), OF_HALVES(float, half_index, parts_a, parts_b),
                  light->view, sample_x, sample_y, centre, transport.density.sigma, guided, t, v, &f.x, &f.y, &weight);
  }
#endif
  const real film_x = f.x * scale + light->view.centre_x, film_y = f.y * scale + light->view.centre_y;
  const real column = floor(film_x - sample_x + 0.5f), row = floor(film_y - sample_y + 0.5f);
  mask on_film = (column >= 0.0f) & (column < width) & (row >= 0.0f) & (row < width) & (weight > 0.0f);
#if VW > 1
  on_film &= index < (ureal)(last);
#endif
  f.off_x = (film_x - column - sample_x) / scale;
  f.off_y = (film_y - row - sample_y) / scale;
  f.weight = real_select(on_film, weight, real_splat(0.0f));
  const ureal line = convert_ureal(real_select(on_film, row, real_splat(0.0f)));
  f.texel =
      light->map + half_map + line * light->view.width + convert_ureal(real_select(on_film, column, real_splat(0.0f)));
  return f;
}

// What enters there, in the light's frame: the place, the surface's normal, the refracted direction, and the flux that
// a sample stands for, 0 where nothing is lit.
typedef struct {
  real3 x, n, w12;
  real flux;
} Entry;

// Through a pointer: of a returned struct clang makes what Oclgrind 21.10 can't run.
static void sample_entry(Transport transport, const Fall* f, Entry* e) {
  CONTRACT
#define READ_ELEMENT(k) transport.map[INDEX(f->texel, k)]
  READ_FOURS(transport.map, f->texel, height, slope_x, slope_y, normal)
#undef READ_ELEMENT
  // The light ray through the sample meets the plane of the texel's geometric normal.
  e->x = real3_make(f->x, f->y, height + (slope_x * f->off_x + slope_y * f->off_y));
  e->n = shading_normal(as_mask(normal));
  e->w12 = refract_into(towards_light(), e->n, transport.boundary);
  const real T12 = fresnel_transmittance(e->n.z, transport.boundary);
  e->flux = real_select(height > UNLIT, f->weight * T12, real_splat(0.0f));
}

// Where the guide of a layer texel, (n, tile), begins for half A of one light; NO_GUIDE if it has none, or is too near
// to what is lit to need one.
static uint guide_of(Transport transport, float4 centre, float4 normal) {
#if ESTIMATOR == 0
  if (transport.first_guide == 0 || !(centre.z > guided_from(transport.density.h_min))) return NO_GUIDE;
  const uint guide = transport.first_guide + 2 * (as_uint(normal.w) & ~POINT_BITS) * GUIDE_SIZE;
  const uint end_a = transport.guides[guide + END_OF_STRIPS];
  const uint end_b = transport.guides[guide + GUIDE_SIZE + END_OF_STRIPS];
  return end_a > 0 && end_b > 0 ? guide : NO_GUIDE;
#else
  return NO_GUIDE;
#endif
}

// Scattered radiance (without T21) of light l at some points, (x, number) and (n, tile), of halves A and B, or with one
// lane of the half `half_index` alone: rounds `round` to `round + rounds` - 1 of each point's own sequences, each of as
// many samples as the light takes in a frame, summed over rounds. Step by step for all points rather than point by
// point: a CPU computes one point's step while it waits for another's. Inlined, since a GPU would pass what it takes
// through memory.
__attribute__((always_inline)) static void scattered_radiance(Transport transport, uint l,
                                                              __global const float4* centres,
                                                              __global const float4* points, uint n_points,
                                                              uint half_index, uint round, uint rounds,
                                                              real sum[POINTS_OF_ITEM][MEDIA + 1]) {
  __constant Light* light = transport.lights + l;
  const uint first = round * light->samples, last = first + rounds * light->samples;
  for (uint k = 0; k < POINTS_OF_ITEM; ++k) UNROLL for (uint m = 0; m <= MEDIA; ++m) sum[k][m] = real_splat(0.0f);
  for (uint j = first; j < last; j += LANES_OF_HALF) {
    Fall fall[POINTS_OF_ITEM];
    Entry entry[POINTS_OF_ITEM];
    DipoleGeometry geometry[POINTS_OF_ITEM];
#if ESTIMATOR == 0
    const ureal index = j + LANES, whole = reversed(index), halved = reversed(index >> 1);
#else
    const ureal whole = (ureal)(0u), halved = whole;
#endif
    for (uint k = 0; k < n_points; ++k) {
      const uint guide = guide_of(transport, centres[k], points[2 * k + 1]);
      fall[k] = sample_fall(transport, l, centres[k], as_uint(points[2 * k].w) & ~POINT_BITS, guide,
                            guide != NO_GUIDE ? halved : whole, half_index, j, last);
    }
    for (uint k = 0; k < n_points; ++k) sample_entry(transport, fall + k, entry + k);
    for (uint k = 0; k < n_points; ++k) {
      const float3 p = to_frame(light->view, points[2 * k].xyz - light->view.origin.xyz);
      const float3 n = to_frame(light->view, points[2 * k + 1].xyz);
      const real3 n_o = real3_make(real_splat(n.x), real_splat(n.y), real_splat(n.z));
      const Entry* e = entry + k;
      geometry[k] = dipole_geometry(real3_make(p.x - e->x.x, p.y - e->x.y, p.z - e->x.z), e->w12, e->n, n_o);
    }
    for (uint k = 0; k < n_points; ++k)
      UNROLL for (uint m = 0; m < MEDIA; ++m) sum[k][m] +=
          entry[k].flux * bssrdf(transport.media[m], transport.boundary, geometry[k]);
  }
}

static Transport make_transport(__constant Light* lights, __global const float4* map, __constant Medium* media,
                                Boundary boundary, Density density, __global const float2* rho,
                                __global const uint* guides, uint first_guide, uint seed) {
  Transport t;
  t.lights = lights;
  t.map = map;
  t.media = media;
  t.boundary = boundary;
  t.density = density;
  t.rho = rho;
  t.guides = guides;
  t.first_guide = first_guide;
  t.seed = seed;
  return t;
}

#endif
