// Pass 4: the camera's view looks each of its points up in all layers that see it, as in shadow mapping.

#define MIN_WEIGHT 1e-3f      // below it no layer is taken to see a point
#define MIN_LAYER_COSINE 0.05f  // layers that see a surface more edge-on are not asked

// The layers as pass 4 reads them.
typedef struct {
  __constant View* views;
  __constant uint* level_first;
  __global const float4* geometry;
  __global const uint* slots;
  uint count;
  uint size;
} Layers;

static Layers make_layers(__constant View* views, __constant uint* level_first, __global const float4* geometry,
                          __global const uint* slots, uint count, uint size) {
  Layers l;
  l.views = views;
  l.level_first = level_first;
  l.geometry = geometry;
  l.slots = slots;
  l.count = count;
  l.size = size;
  return l;
}

// How much each of four texels around a point counts: bilinear weight x cos^2 to the layer where the texel and the
// point lie in each other's planes (within half a texel) and face alike; 0 elsewhere.
static float4 texel_weights(Layers layers, uint layer, uint level, float3 x, float3 n, uint4* texels) {
  const View view = layers.views[layer];
  const float cosine = dot(n, view.back.xyz);
  *texels = (uint4)(0);
  if (cosine < MIN_LAYER_COSINE) return (float4)(0.0f);
  const float3 film = film_coordinates(view, view_coordinates(view, x));
  const float side = (float)(1u << level), size = side / view.scale;
  const float u = film.x / side - 0.5f, v = film.y / side - 0.5f, u0 = floor(u), v0 = floor(v);
  const int extent = (int)((layers.size + (1u << level) - 1) >> level);
  const uint first = layers.level_first[level] + layer * (uint)(extent * extent);
  float weight[4];
  uint texel[4];
  for (int c = 0; c < 4; ++c) {
    const int tx = (int)u0 + (c & 1), ty = (int)v0 + (c >> 1);
    weight[c] = 0.0f;
    texel[c] = 0;
    if (tx < 0 || ty < 0 || tx >= extent || ty >= extent) continue;
    texel[c] = first + (uint)(ty * extent + tx);
    if (layers.slots[texel[c]] == NO_SLOT) continue;
    const float4 g = layers.geometry[texel[c]];
    const float3 away = view.right.xyz * (((float)tx - u) * size) + view.down.xyz * (((float)ty - v) * size) +
                        view.back.xyz * (g.w - film.z);
    if (fabs(dot(away, n)) > 0.5f * size || fabs(dot(away, g.xyz)) > 0.5f * size || dot(g.xyz, n) <= 0.5f) continue;
    weight[c] = (1.0f - fabs((float)tx - u)) * (1.0f - fabs((float)ty - v)) * cosine * cosine;
  }
  *texels = (uint4)(texel[0], texel[1], texel[2], texel[3]);
  return (float4)(weight[0], weight[1], weight[2], weight[3]);
}

// Values of halves A and B at a point from one level of all layers; returns the total weight.
static float gather_level(Layers layers, uint level, float3 x, float3 n, __global const float4* values, float3* a,
                          float3* b) {
  float3 sum_a = (float3)(0.0f), sum_b = (float3)(0.0f);
  float total = 0.0f;
  for (uint layer = 0; layer < layers.count; ++layer) {
    uint4 texels;
    const float4 w = texel_weights(layers, layer, level, x, n, &texels);
    const float weight[4] = {w.x, w.y, w.z, w.w};
    const uint texel[4] = {texels.x, texels.y, texels.z, texels.w};
    for (uint c = 0; c < 4; ++c) {
      if (weight[c] <= 0.0f) continue;
      const uint slot = layers.slots[texel[c]];
      sum_a += weight[c] * values[2 * slot].xyz;
      sum_b += weight[c] * values[2 * slot + 1].xyz;
      total += weight[c];
    }
  }
  *a = sum_a / fmax(total, FLT_MIN);
  *b = sum_b / fmax(total, FLT_MIN);
  return total;
}

static float3 pixel_sample(Window window, uint i) {
  return (float3)((float)(window.x + i % window.width) + (float)window.sample_x / SUBPIXELS,
                  (float)(window.y + i / window.width) + (float)window.sample_y / SUBPIXELS, 0.0f);
}

static float transmittance_to(View view, Surface s, Boundary boundary) {  // T21 towards the camera
  const float3 o = normalize(view.origin.xyz - s.x);
  const real3 w_o = real3_make(real_splat(o.x), real_splat(o.y), real_splat(o.z));
  const real3 n = real3_make(real_splat(s.n_s.x), real_splat(s.n_s.y), real_splat(s.n_s.z));
  return real_first(fresnel_transmittance(real3_dot(bend_normal(n, w_o), w_o), boundary));
}

// Marks the level-0 texels that a view reads.
__kernel void gather_mark(const View view, const Window window, __global const uint* restrict ids,
                          __global const float4* restrict positions, __global const uint* restrict triangles,
                          __global const float* restrict normals, __constant View* layer_views,
                          __constant uint* level_first, __global const float4* restrict geometry,
                          __global const uint* restrict slots, const uint layers_count, const uint layers_size,
                          __global uint* marks) {
  const uint i = (uint)get_global_id(0);
  if (i >= window.width * window.height || ids[i] == NO_TRIANGLE) return;
  const Layers layers = make_layers(layer_views, level_first, geometry, slots, layers_count, layers_size);
  const float3 p = pixel_sample(window, i);
  const Surface s = surface_at(view, p.x, p.y, ids[i], positions, triangles, normals);
  for (uint layer = 0; layer < layers_count; ++layer) {
    uint4 t;
    const float4 w = texel_weights(layers, layer, 0, s.x, s.n_g, &t);
    if (w.x > 0.0f) marks[t.x] = 1;
    if (w.y > 0.0f) marks[t.y] = 1;
    if (w.z > 0.0f) marks[t.z] = 1;
    if (w.w > 0.0f) marks[t.w] = 1;
  }
}

// For statistics: the layers' total weight at points of the surface.
__kernel void gather_weight(const uint n_points, __global const float4* restrict points, __constant View* layer_views,
                            __constant uint* level_first, __global const float4* restrict geometry,
                            __global const uint* restrict slots, const uint layers_count, const uint layers_size,
                            __global float* restrict weights) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_points) return;
  const Layers layers = make_layers(layer_views, level_first, geometry, slots, layers_count, layers_size);
  float total = 0.0f;
  for (uint layer = 0; layer < layers_count; ++layer)
    for (int side = 0; side < 2; ++side) {
      uint4 t;
      const float3 n = side ? -points[2 * i + 1].xyz : points[2 * i + 1].xyz;
      total += dot(texel_weights(layers, layer, 0, points[2 * i].xyz, n, &t), (float4)(1.0f));
    }
  weights[i] = total;
}

// Adds one subpixel position to the film, for up to four pyramid levels at once: film[set][pixel][half]. Points that
// no layer sees go to the list that gather_direct works off.
__kernel void gather_pixels(const View view, const Window window, __global const uint* restrict ids,
                            __global const float4* restrict positions, __global const uint* restrict triangles,
                            __global const float* restrict normals, __constant View* layer_views,
                            __constant uint* level_first, __global const float4* restrict geometry,
                            __global const uint* restrict slots, const uint layers_count, const uint layers_size,
                            __global const float4* restrict values, const float scale, const Boundary boundary,
                            const uint4 levels, const uint sets, __global float4* restrict film,
                            __global uint* n_direct, __global uint* direct) {
  const uint i = (uint)get_global_id(0), n_pixels = window.width * window.height;
  if (i >= n_pixels || ids[i] == NO_TRIANGLE) return;
  const Layers layers = make_layers(layer_views, level_first, geometry, slots, layers_count, layers_size);
  const float3 p = pixel_sample(window, i);
  const Surface s = surface_at(view, p.x, p.y, ids[i], positions, triangles, normals);
  const float factor = scale * transmittance_to(view, s, boundary);
  const uint level_of[4] = {levels.x, levels.y, levels.z, levels.w};
  for (uint set = 0; set < sets; ++set) {
    float3 a, b;
    uint level = level_of[set];
    float total = gather_level(layers, level, s.x, s.n_g, values, &a, &b);
    while (total < MIN_WEIGHT && level > 0) total = gather_level(layers, --level, s.x, s.n_g, values, &a, &b);
    __global float4* pixel = film + 2 * (set * n_pixels + i);
    pixel[0].w += 1.0f;
    if (total >= MIN_WEIGHT) {
      pixel[0].xyz += factor * a;
      pixel[1].xyz += factor * b;
    } else if (set == 0) {
      direct[atomic_inc(n_direct)] = i;
    }
  }
}

// The pixels that no layer sees, by pass 2's own function at the points themselves.
__kernel void gather_direct(const View view, const Window window, __global const uint* restrict ids,
                            __global const float4* restrict positions, __global const uint* restrict triangles,
                            __global const float* restrict normals, __constant Light* lights,
                            __global const float4* restrict map, __constant Medium* media, const Boundary boundary,
                            const Density density, __global const float* restrict log_rho, const uint seed,
                            __global const float2* restrict extent, __constant uint* level_first, const uint levels,
                            const uint round, const uint rounds, const uint sets,
                            __global const uint* restrict n_direct, __global const uint* restrict direct,
                            __global float4* restrict film) {
  const uint first = (uint)get_global_id(0), stride = (uint)get_global_size(0), n_pixels = window.width * window.height;
  const Transport transport = make_transport(lights, map, media, boundary, density, log_rho, seed);
  const uint n = n_direct[0];
  for (uint item = first; item < n; item += stride) {
    const uint i = direct[item];
    const float3 p = pixel_sample(window, i);
    const Surface s = surface_at(view, p.x, p.y, ids[i], positions, triangles, normals);
    const float factor = transmittance_to(view, s, boundary) / (float)rounds;
    const uint point = 0x80000000u | ((uint)p.y * view.width + (uint)p.x);
    float4 centre[LIGHTS];
    for (uint l = 0; l < LIGHTS; ++l)
      centre[l] = sampling_centre(s.x, lights + l, density, log_rho, extent, level_first, levels);
    const float3 a = factor * scattered_radiance(transport, s.x, s.n_s, point, 0, round, rounds, centre);
    const float3 b = factor * scattered_radiance(transport, s.x, s.n_s, point, 1, round, rounds, centre);
    for (uint set = 0; set < sets; ++set) {
      film[2 * (set * n_pixels + i)].xyz += a;
      film[2 * (set * n_pixels + i) + 1].xyz += b;
    }
  }
}
