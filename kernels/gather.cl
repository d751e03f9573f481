// Pass 4: the camera's view looks each of its points up in all layers that see it, as in shadow mapping.

#define MIN_WEIGHT 1e-3f  // below it no layer is taken to see a point
#define EDGE_ON 0.0025f   // squared cosine: layers that see a surface more edge-on are never asked
#define OBLIQUE 0.2f      // squared cosine: such layers are asked only where no other sees the point

// The layers as pass 4 reads them, `count` from `first` on.
typedef struct {
  __constant View* views;
  __constant uint* level_first;
  __global const float4* geometry;
  __global const uint* slots;
  uint first;
  uint count;
} Layers;

static Layers make_layers(__constant View* views, __constant uint* level_first, __global const float4* geometry,
                          __global const uint* slots, uint first, uint count) {
  Layers l;
  l.views = views;
  l.level_first = level_first;
  l.geometry = geometry;
  l.slots = slots;
  l.first = first;
  l.count = count;
  return l;
}

// How much each of four texels around a point counts: bilinear weight x (cos^2 to the layer - `least`) where the texel
// and the point lie in each other's planes (within half a texel) and face alike; 0 elsewhere. All in the layer's frame,
// four texels side by side; `texels` is valid where the weight isn't 0.
static float4 texel_weights(Layers layers, uint layer, uint level, float3 x, float3 n, float least, uint4* texels) {
  __constant View* view = layers.views + layer;
  const int pinhole = view->near_distance > 0.0f;
  const float3 d = x - view->origin.xyz;
  const float3 c = (float3)(dot(d, view->right.xyz), dot(d, view->down.xyz), dot(d, view->back.xyz));
  const float3 m = (float3)(dot(n, view->right.xyz), dot(n, view->down.xyz), dot(n, view->back.xyz));
  const float cosine = pinhole ? -dot(m, c) * rsqrt(dot(c, c)) : m.z;
  if (cosine <= 0.0f || cosine * cosine <= least || (pinhole && c.z >= -view->near_distance)) return (float4)(0.0f);
  const float distance = pinhole ? -c.z : 1.0f;  // texels of a pinhole grow with it
  const float side = (float)(1u << level), texel_side = side / view->scale, tolerance = 0.5f * texel_side * distance;
  const float u = (c.x / distance * view->scale + view->centre_x) / side - 0.5f;
  const float v = (c.y / distance * view->scale + view->centre_y) / side - 0.5f;
  const float u0 = floor(u), v0 = floor(v);
  const int width = (int)level_size(view->width, level), height = (int)level_size(view->height, level);
  const int4 column = (int)u0 + (int4)(0, 1, 0, 1), row = (int)v0 + (int4)(0, 0, 1, 1);
  const int4 on_film = (column >= 0) & (row >= 0) & (column < width) & (row < height);
  const int4 texel = (int)(layers.level_first[level] + layer * (uint)(width * height)) +
                     select((int4)(0), row * width + column, on_film);
  *texels = as_uint4(texel);
  const float4 g0 = layers.geometry[texel.x], g1 = layers.geometry[texel.y], g2 = layers.geometry[texel.z],
               g3 = layers.geometry[texel.w];
  const float4 t_x = (float4)(g0.x, g1.x, g2.x, g3.x), t_y = (float4)(g0.y, g1.y, g2.y, g3.y),
               t_z = (float4)(g0.z, g1.z, g2.z, g3.z), q = (float4)(g0.w, g1.w, g2.w, g3.w);
  const float4 off_x = convert_float4(column) - u, off_y = convert_float4(row) - v;
  float4 away_x = off_x * texel_side, away_y = off_y * texel_side, away_z = q - (c.z + 2.0f);
  if (pinhole) {
    const float4 of_texel = 1.0f / q, farther = of_texel - distance;
    away_x = away_x * of_texel + c.x / distance * farther;
    away_y = away_y * of_texel + c.y / distance * farther;
    away_z = -farther;
  }
  const float4 from_point = away_x * m.x + away_y * m.y + away_z * m.z;
  const float4 from_texel = away_x * t_x + away_y * t_y + away_z * t_z;
  const int4 accepted = on_film & (fabs(from_point) <= tolerance) & (fabs(from_texel) <= tolerance) &
                        (t_x * m.x + t_y * m.y + t_z * m.z > 0.5f);
  return select((float4)(0.0f), (1.0f - fabs(off_x)) * (1.0f - fabs(off_y)) * (cosine * cosine - least), accepted);
}

// Adds a texel's halves; returns the weight that it takes: none where it has no values.
static float add_texel(Layers layers, uint texel, float weight, __global const float4* values, float3* a, float3* b) {
  const uint slot = layers.slots[texel];
  if (slot == NO_SLOT) return 0.0f;
  *a += weight * values[2 * slot].xyz;
  *b += weight * values[2 * slot + 1].xyz;
  return weight;
}

// Values of halves A and B at a point from one level of all layers; returns the total weight.
static float gather_level(Layers layers, uint level, float3 x, float3 n, __global const float4* values, float3* a,
                          float3* b) {
  float total = 0.0f;
  for (int oblique = 0; oblique < 2 && total < MIN_WEIGHT; ++oblique) {
    float3 sum_a = (float3)(0.0f), sum_b = (float3)(0.0f);
    total = 0.0f;
    for (uint layer = layers.first; layer < layers.first + layers.count; ++layer) {
      uint4 texels;
      const float4 w = texel_weights(layers, layer, level, x, n, oblique ? EDGE_ON : OBLIQUE, &texels);
      if (w.x > 0.0f) total += add_texel(layers, texels.x, w.x, values, &sum_a, &sum_b);
      if (w.y > 0.0f) total += add_texel(layers, texels.y, w.y, values, &sum_a, &sum_b);
      if (w.z > 0.0f) total += add_texel(layers, texels.z, w.z, values, &sum_a, &sum_b);
      if (w.w > 0.0f) total += add_texel(layers, texels.w, w.w, values, &sum_a, &sum_b);
    }
    *a = sum_a / fmax(total, FLT_MIN);
    *b = sum_b / fmax(total, FLT_MIN);
  }
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
  return LANE(fresnel_transmittance(real3_dot(bend_normal(n, w_o), w_o), boundary), 0);
}

// Marks the level-0 texels that a view reads: many work-items may write one mark, all of them the same 1.
__kernel void gather_mark(const View view, const Window window, __global const uint* restrict ids,
                          __global const float4* restrict positions, __global const uint* restrict triangles,
                          __global const float* restrict normals, __constant View* layer_views,
                          __constant uint* level_first, __global const float4* restrict geometry,
                          __global const uint* restrict slots, const uint layers_first, const uint layers_count,
                          __global uint* marks) {
  const uint i = (uint)get_global_id(0);
  if (i >= window.width * window.height || ids[i] == NO_TRIANGLE) return;
  const Layers layers = make_layers(layer_views, level_first, geometry, slots, layers_first, layers_count);
  const float3 p = pixel_sample(window, i);
  const Surface s = surface_at(view, p.x, p.y, ids[i], positions, triangles, normals);
  float total = 0.0f;
  for (int oblique = 0; oblique < 2 && total < MIN_WEIGHT; ++oblique)
    for (uint layer = layers.first; layer < layers.first + layers.count; ++layer) {
      uint4 t;
      const float4 w = texel_weights(layers, layer, 0, s.x, s.n_g, oblique ? EDGE_ON : OBLIQUE, &t);
      if (w.x > 0.0f) marks[t.x] = 1;
      if (w.y > 0.0f) marks[t.y] = 1;
      if (w.z > 0.0f) marks[t.z] = 1;
      if (w.w > 0.0f) marks[t.w] = 1;
      total += w.x + w.y + w.z + w.w;
    }
}

// For statistics: the layers' total weight at points of the surface.
__kernel void gather_weight(const uint n_points, __global const float4* restrict points, __constant View* layer_views,
                            __constant uint* level_first, __global const float4* restrict geometry,
                            __global const uint* restrict slots, const uint layers_first, const uint layers_count,
                            __global float* restrict weights) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_points) return;
  const Layers layers = make_layers(layer_views, level_first, geometry, slots, layers_first, layers_count);
  float total = 0.0f;
  for (uint layer = layers.first; layer < layers.first + layers.count; ++layer)
    for (int side = 0; side < 2; ++side) {
      uint4 t;
      const float3 n = side ? -points[2 * i + 1].xyz : points[2 * i + 1].xyz;
      const float4 w = texel_weights(layers, layer, 0, points[2 * i].xyz, n, EDGE_ON, &t);
      total += w.x + w.y + w.z + w.w;
    }
  weights[i] = total;
}

// Whether a pixel's position hits the same smooth surface as its first one, or like it nothing: within half a pixel of
// the first one's plane, normals within 25 degrees. That plane, (n_g, n_g.x) from the eye or 0 for nothing, is kept in
// `plane` by position 0.
static int on_first_plane(View view, Surface s, int hit, uint position, __global float4* plane) {
  const float3 n = s.n_g, x = s.x - view.origin.xyz;
  if (position == 0) {
    *plane = (float4)(n, dot(n, x));
    return 1;
  }
  const float4 first = *plane;
  const int first_hit = dot(first.xyz, first.xyz) > 0.0f;
  if (!hit || !first_hit) return !hit && !first_hit;
  const float half_pixel = -1.0f * dot(x, view.back.xyz) / view.scale;
  return fabs(dot(first.xyz, x) - first.w) <= half_pixel && dot(first.xyz, n) > 0.5f;
}

// Marks as edges the pixels whose subpixel position number `position`, from 0 on, isn't on their first one's plane.
__kernel void gather_edges(const View view, const Window window, __global const uint* restrict ids,
                           __global const float4* restrict positions, __global const uint* restrict triangles,
                           __global const float* restrict normals, const uint position, __global float4* planes,
                           __global uint* edges) {
  const uint i = (uint)get_global_id(0);
  if (i >= window.width * window.height) return;
  const int hit = ids[i] != NO_TRIANGLE;
  const float3 p = pixel_sample(window, i);
  Surface s;
  s.x = s.n_g = (float3)(0.0f);
  if (hit) s = surface_at(view, p.x, p.y, ids[i], positions, triangles, normals);
  if (!on_first_plane(view, s, hit, position, planes + i)) edges[i] = 1;
}

// Pixels that need no more positions: all positions so far of the pixel and of its neighbours hit one smooth surface.
// Their sums are multiplied by `factor`, positions in all over positions so far. The others stay open: depth NO_DEPTH,
// where nothing can be drawn elsewhere.
__kernel void gather_settle(const Window window, __global const uint* restrict edges, const float factor,
                            const uint sets, __global float4* restrict film, __global uint* restrict open) {
  const uint i = (uint)get_global_id(0), n_pixels = window.width * window.height;
  if (i >= n_pixels) return;
  const int x = (int)(i % window.width), y = (int)(i / window.width);
  uint edge = 0;
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      const int u = clamp(x + dx, 0, (int)window.width - 1), v = clamp(y + dy, 0, (int)window.height - 1);
      edge |= edges[v * (int)window.width + u];
    }
  open[i] = edge ? NO_DEPTH : 0;
  if (edge) return;
  for (uint k = 0; k < sets; ++k) {
    film[2 * (k * n_pixels + i)] *= factor;
    film[2 * (k * n_pixels + i) + 1] *= factor;
  }
}

// Takes the set-up records of triangles that can't cover any open pixel out of what is drawn.
__kernel void gather_cull(const Window window, __global const uint* restrict open, const uint n_records,
                          __global RasterTriangle* records) {
  const uint i = (uint)get_global_id(0);
  if (i >= n_records) return;
  RasterTriangle t = records[i];
  Window any = window;  // one pixel around for whatever position
  any.sample_x = any.sample_y = 0;
  const PixelBox box = pixel_box(t, any);
  if (t.triangle == NO_TRIANGLE || box.x1 - box.x0 > SMALL_BOX || box.y1 - box.y0 > SMALL_BOX) return;
  const int right = (int)(window.x + window.width) - 1, bottom = (int)(window.y + window.height) - 1;
  for (int y = max(box.y0 - 1, (int)window.y); y <= min(box.y1, bottom); ++y)
    for (int x = max(box.x0 - 1, (int)window.x); x <= min(box.x1, right); ++x)
      if (open[((uint)y - window.y) * window.width + (uint)x - window.x] == NO_DEPTH) return;
  records[i].triangle = NO_TRIANGLE;
}

// Adds one subpixel position to the film, for up to four pyramid levels at once: film[set][pixel][half]. Points that
// no layer sees go to the list that gather_direct works off, and count as edges.
__kernel void gather_pixels(const View view, const Window window, __global const uint* restrict ids,
                            __global const float4* restrict positions, __global const uint* restrict triangles,
                            __global const float* restrict normals, __constant View* layer_views,
                            __constant uint* level_first, __global const float4* restrict geometry,
                            __global const uint* restrict slots, const uint layers_first, const uint layers_count,
                            __global const float4* restrict values, const float scale, const Boundary boundary,
                            const uint4 levels, const uint sets, __global float4* restrict film,
                            __global uint* n_direct, __global uint* direct, __global uint* edges) {
  const uint i = (uint)get_global_id(0), n_pixels = window.width * window.height;
  if (i >= n_pixels || ids[i] == NO_TRIANGLE) return;
  const Layers layers = make_layers(layer_views, level_first, geometry, slots, layers_first, layers_count);
  const float3 p = pixel_sample(window, i);
  const Surface s = surface_at(view, p.x, p.y, ids[i], positions, triangles, normals);
  const float factor = scale * transmittance_to(view, s, boundary);
  float3 a0, b0;
  const int seen = gather_level(layers, 0, s.x, s.n_g, values, &a0, &b0) >= MIN_WEIGHT;
  if (!seen) {
    direct[atomic_inc(n_direct)] = i;
    edges[i] = 1;
  }
  for (uint set = 0; set < sets; ++set) {
    float3 a = a0, b = b0;
    __global float4* pixel = film + 2 * (set * n_pixels + i);
    pixel[0].w += 1.0f;
    if (!seen) continue;
    // Where a level sees too little, the next finer one stands in.
    uint level = set == 0 ? levels.x : set == 1 ? levels.y : set == 2 ? levels.z : levels.w;
    while (level > 0 && gather_level(layers, level, s.x, s.n_g, values, &a, &b) < MIN_WEIGHT) --level;
    pixel[0].xyz += factor * (level > 0 ? a : a0);
    pixel[1].xyz += factor * (level > 0 ? b : b0);
  }
}

// The points of listed pixels, for pass 2's own function: those that no layer sees, or some that layers do see, to tell
// how far off these are. Of the n_direct[0] pixels these are the ones from `first` on, up to `most`; n_held says how
// many. As layers_points, with T21 beside the normal. The list's length is added to n_direct[1] once.
__kernel void gather_points(const View view, __global const uint* restrict ids, const Window window,
                            __global const float4* restrict positions, __global const uint* restrict triangles,
                            __global const float* restrict normals, __constant Light* lights,
                            __global const float4* restrict map, const Boundary boundary, const Density density,
                            __global const float2* restrict rho, __global const float2* restrict extent,
                            __constant uint* level_first, const uint levels, const uint n_lights, const uint first,
                            const uint most, __global const uint* restrict direct, __global uint* restrict n_direct,
                            __global uint* restrict n_held, __global float4* restrict points,
                            __global float4* restrict centres) {
  const uint item = (uint)get_global_id(0), n_all = n_direct[0],
             n_points = n_all > first ? min(n_all - first, most) : 0;
  if (item == 0) n_held[0] = n_points;
  if (item == 0 && first == 0) n_direct[1] += n_all;
  if (item >= n_points) return;
  const uint i = direct[first + item];
  const float3 p = pixel_sample(window, i);
  const Surface s = surface_at(view, p.x, p.y, ids[i], positions, triangles, normals);
  const uint pixel = (uint)p.y * view.width + (uint)p.x;
  points[2 * item] = (float4)(s.x, as_float(0x80000000u | POINT_BITS | pixel));
  points[2 * item + 1] = (float4)(s.n_s, transmittance_to(view, s, boundary));
  for (uint l = 0; l < n_lights; ++l)
    centres[l * n_points + item] =
        sampling_centre(s.x, s.n_s, lights + l, map, boundary, density, rho, extent, level_first, levels);
}

// Adds their values to the film.
__kernel void gather_direct(__global const uint* restrict n_held, const uint first,
                            __global const uint* restrict direct, __global const float4* restrict points,
                            __global const float4* restrict values, const float scale, const uint sets,
                            const uint n_pixels, __global float4* restrict film) {
  const uint item = (uint)get_global_id(0);
  if (item >= n_held[0]) return;
  const float factor = scale * points[2 * item + 1].w;
  for (uint set = 0; set < sets; ++set) {
    const uint pixel = 2 * (set * n_pixels + direct[first + item]);
    film[pixel].xyz += factor * values[2 * item].xyz;
    film[pixel + 1].xyz += factor * values[2 * item + 1].xyz;
  }
}

// The film as an image in its owner's buffer: means of both halves, premultiplied by alpha = coverage. `gain` is the
// lights' colour and the exposure; what isn't a number or below 0 counts as 0.
__kernel void gather_image(const Window window, __global const float4* restrict film, const float4 gain,
                           const float per_position, const uint first, const uint pitch,
                           __global float4* restrict image) {
  const uint i = (uint)get_global_id(0);
  if (i >= window.width * window.height) return;
  const float4 a = film[2 * i], b = film[2 * i + 1];
  const float3 light = (a.xyz + b.xyz) * (0.5f * per_position) * gain.xyz;
  const float3 sound =
      select((float3)(0.0f), light, isgreater(light, (float3)(0.0f)) & isless(light, (float3)(FLT_MAX)));
  const size_t x = window.x + i % window.width, y = window.y + i / window.width;
  image[first + y * pitch + x] = (float4)(sound, a.w * per_position);
}
