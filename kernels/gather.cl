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

// How one layer sees points: where they and their normals lie in its frame, where on its film in texels of one level,
// and how much that counts, cos^2 - `least`, 0 or less where it doesn't see them.
typedef struct {
  real3 c, m;
  real distance, u, v, facing;
} Sight;

static void sight_of(Layers layers, uint layer, uint level, real3 x, real3 n, float least, Sight* s) {
  __constant View* view = layers.views + layer;
  const int pinhole = view->near_distance > 0.0f;
  s->c = to_frame_wide(*view, real3_sub(x, uniform3(view->origin)));
  s->m = to_frame_wide(*view, n);
  s->distance = pinhole ? -s->c.z : real_splat(1.0f);  // texels of a pinhole grow with it
  const real cosine = pinhole ? -1.0f * real3_dot(s->m, s->c) * real_rsqrt(real3_dot(s->c, s->c)) : s->m.z;
  const float side = (float)(1u << level);
  s->u = (s->c.x / s->distance * view->scale + view->centre_x) / side - 0.5f;
  s->v = (s->c.y / s->distance * view->scale + view->centre_y) / side - 0.5f;
  s->facing =
      real_select((cosine > 0.0f) & (s->distance > view->near_distance), cosine * cosine - least, real_splat(0.0f));
}

// How much one of the four texels around each point counts: bilinear weight x facing where the texel and the point lie
// in each other's planes (within half a texel) and face alike; 0 elsewhere. All in the layer's frame.
static real texel_weight(Layers layers, uint layer, uint level, const Sight* s, uint corner, ureal* texel) {
  __constant View* view = layers.views + layer;
  const int pinhole = view->near_distance > 0.0f;
  const uint width = level_size(view->width, level), height = level_size(view->height, level);
  const real column = floor(s->u) + (float)(corner & 1u), row = floor(s->v) + (float)(corner >> 1);
  const mask on_film = (column >= 0.0f) & (row >= 0.0f) & (column < (float)width) & (row < (float)height);
  const real zero = real_splat(0.0f);
  *texel = convert_ureal(real_select(on_film, row, zero)) * width + convert_ureal(real_select(on_film, column, zero)) +
           (layers.level_first[level] + layer * width * height);
#define READ_ELEMENT(k) layers.geometry[INDEX(*texel, k)]
  READ_FOURS(layers.geometry, *texel, t_x, t_y, t_z, q)
#undef READ_ELEMENT
  const float texel_side = (float)(1u << level) / view->scale;
  const real off_x = column - s->u, off_y = row - s->v;
  real3 away = real3_make(off_x * texel_side, off_y * texel_side, q - (s->c.z + 2.0f));
  if (pinhole) {
    const real of_texel = 1.0f / q, farther = of_texel - s->distance;
    away = real3_make(away.x * of_texel + s->c.x / s->distance * farther,
                      away.y * of_texel + s->c.y / s->distance * farther, -1.0f * farther);
  }
  const real3 n_t = real3_make(t_x, t_y, t_z);
  const real tolerance = 0.5f * texel_side * s->distance;
  const real from_point = real_abs(real3_dot(away, s->m)), from_texel = real_abs(real3_dot(away, n_t));
  const real alike = real3_dot(n_t, s->m);
  const mask accepted =
      on_film & (from_point <= tolerance) & (from_texel <= tolerance) & (alike > 0.5f) & (s->facing > 0.0f);
  return real_select(accepted, (1.0f - real_abs(off_x)) * (1.0f - real_abs(off_y)) * s->facing, zero);
}

// Values of halves A and B at points from one level of all layers; returns the total weight. Nothing at points to skip.
static real gather_level(Layers layers, uint level, real3 x, real3 n, mask skip, __global const float4* values,
                         real3* a, real3* b) {
  const real zero = real_splat(0.0f);
  real total = zero;
  *a = *b = real3_make(zero, zero, zero);
  ROLLED for (int oblique = 0; oblique < 2; ++oblique) {
    const mask done = skip | (total >= MIN_WEIGHT);
    if (mask_all(done)) break;
    total = real_select(done, total, zero);
    ROLLED for (uint layer = layers.first; layer < layers.first + layers.count; ++layer) {
      Sight s;
      sight_of(layers, layer, level, x, n, oblique ? EDGE_ON : OBLIQUE, &s);
      if (mask_all(done | (s.facing <= 0.0f))) continue;
      ROLLED for (uint corner = 0; corner < 4; ++corner) {
        ureal texel;
        const real weight = real_select(done, zero, texel_weight(layers, layer, level, &s, corner, &texel));
        if (mask_all(weight <= 0.0f)) continue;
#define SLOT(lane) layers.slots[INDEX(texel, lane)]
        const ureal slot = (ureal)(OF_EACH(SLOT));
#undef SLOT
        const mask empty = slot == NO_SLOT;
        const real w = real_select(empty, zero, weight);
        const ureal of_a = 2 * select(slot, (ureal)(0u), empty);
        *a = real3_madd(*a, three_at(values, of_a), w);
        *b = real3_madd(*b, three_at(values, of_a + 1), w);
        total += w;
      }
    }
    // What comes after adds to nothing.
    const mask seen = done | (total >= MIN_WEIGHT);
    *a = real3_select(seen, *a, real3_make(zero, zero, zero));
    *b = real3_select(seen, *b, real3_make(zero, zero, zero));
  }
  const real inverse = 1.0f / real_max(total, real_splat(FLT_MIN));
  *a = real3_scale(*a, inverse);
  *b = real3_scale(*b, inverse);
  return total;
}

// Samples of a window that a work-item takes, the first and those after it, up to `n`: VW or more, those of whole
// pixels; with one lane the one at a single position, since in a loop a GPU would keep what is the same for all in more
// registers than it has.
#if VW == 1
#define FIRST_SAMPLE(item, window, position) (((item) << (window).log_positions) + (position))
#define NEXT_SAMPLE(i, window, n) (n)
#else
#define FIRST_SAMPLE(item, window, position) ((item)*max(1u << (window).log_positions, (uint)VW))
#define NEXT_SAMPLE(i, window, n) \
  (((i) + VW) >> (window).log_positions == (i) >> (window).log_positions ? (i) + VW : (n))
#endif

static real transmittance_to(View view, real3 x, real3 n_s, Boundary boundary) {  // T21 towards the camera
  const real3 w_o = real3_normalize(real3_sub(uniform3(view.origin), x));
  return fresnel_transmittance(real3_dot(bend_normal(n_s, w_o), w_o), boundary);
}

// Marks the level-0 texels that a view reads: many may write one mark, all of them the same 1.
__kernel void gather_mark(const View view, const Window window, __global const uint* restrict ids,
                          __global const float4* restrict positions, __global const uint* restrict triangles,
                          __global const float* restrict normals, __constant View* layer_views,
                          __constant uint* level_first, __global const float4* restrict geometry,
                          __global const uint* restrict slots, const uint layers_first, const uint layers_count,
                          const uint position, __global uint* marks) {
  const uint item = (uint)get_global_id(0), first = FIRST_SAMPLE(item, window, position);
  const uint n = (window.width * window.height) << window.log_positions;
  const Layers layers = make_layers(layer_views, level_first, geometry, slots, layers_first, layers_count);
  for (uint i = first; i < n; i = NEXT_SAMPLE(i, window, n)) {
    mask empty;
    const ureal id = triangles_at(ids, i, n, &empty);
    if (mask_all(empty)) continue;
    real px, py, total = real_splat(0.0f);
    film_samples(window, i, &px, &py);
    Surface s;
    surface_at(view, px, py, id, positions, triangles, normals, &s);
    ROLLED for (int oblique = 0; oblique < 2; ++oblique) {
      const mask done = empty | (total >= MIN_WEIGHT);
      ROLLED for (uint layer = layers.first; layer < layers.first + layers.count; ++layer) {
        Sight sight;
        sight_of(layers, layer, 0, s.x, s.n_g, oblique ? EDGE_ON : OBLIQUE, &sight);
        if (mask_all(done | (sight.facing <= 0.0f))) continue;
        ROLLED for (uint corner = 0; corner < 4; ++corner) {
          ureal texel;
          const real weight =
              real_select(done, real_splat(0.0f), texel_weight(layers, layer, 0, &sight, corner, &texel));
          for (uint left = lanes_of(weight > 0.0f); left != 0;) {
            const uint k = 31 - clz(left);
            left ^= 1u << k;
            marks[INDEX(texel, k)] = 1;
          }
          total += weight;
        }
      }
    }
  }
}

// For statistics: the layers' total weight at points of the surface, VW to a work-item.
__kernel void gather_weight(const uint n_points, __global const float4* restrict points, __constant View* layer_views,
                            __constant uint* level_first, __global const float4* restrict geometry,
                            __global const uint* restrict slots, const uint layers_first, const uint layers_count,
                            __global float* restrict weights) {
  const uint i = (uint)get_global_id(0) * VW;
  if (i >= n_points) return;
  const Layers layers = make_layers(layer_views, level_first, geometry, slots, layers_first, layers_count);
  real total = real_splat(0.0f);
#define POINT(lane) min(i + lane, n_points - 1) * 2
  const ureal point = (ureal)(OF_EACH(POINT));
#undef POINT
  const real3 x = three_at(points, point), n = three_at(points, point + 1);
  for (uint layer = layers.first; layer < layers.first + layers.count; ++layer)
    for (int side = 0; side < 2; ++side) {
      Sight s;
      sight_of(layers, layer, 0, x, real3_scale(n, real_splat(side ? -1.0f : 1.0f)), EDGE_ON, &s);
      for (uint corner = 0; corner < 4; ++corner) {
        ureal texel;
        total += texel_weight(layers, layer, 0, &s, corner, &texel);
      }
    }
  for (uint k = 0; k < VW && i + k < n_points; ++k) weights[i + k] = ELEMENT(total, k);
}

// Marks as edges the pixels whose subpixel positions don't all hit the same smooth surface as their first one, or like
// it nothing: within half a pixel of the first one's plane, normals within 60 degrees.
__kernel void gather_edges(const View view, const Window window, __global const uint* restrict ids,
                           __global const float4* restrict positions, __global const uint* restrict triangles,
                           __global const float* restrict normals, __global uint* edges) {
  const uint of_item = max(1u << window.log_positions, (uint)VW), first = (uint)get_global_id(0) * of_item;
  const uint log_positions = window.log_positions, n = (window.width * window.height) << log_positions;
  const real zero = real_splat(0.0f);
  real3 first_n = real3_make(zero, zero, zero);  // of each pixel's first position: n_g, or 0 for nothing, and n_g.x
  real first_along = zero;
  for (uint i = first; i < min(first + of_item, n); i += VW) {
    mask empty;
    const ureal id = triangles_at(ids, i, n, &empty);
    real3 n_g = real3_make(zero, zero, zero), x = n_g;
    if (!mask_all(empty)) {
      real px, py;
      film_samples(window, i, &px, &py);
      Surface s;
      surface_at(view, px, py, id, positions, triangles, normals, &s);
      n_g = real3_select(empty, n_g, s.n_g);
      x = real3_sub(s.x, uniform3(view.origin));
    }
    if ((i & ((1u << log_positions) - 1)) == 0) {
      const real along = real3_dot(n_g, x);
#define FIRST_OF_PIXEL(v, lane) ELEMENT(v, (lane) >> log_positions << log_positions)
#define N_X(lane) FIRST_OF_PIXEL(n_g.x, lane)
#define N_Y(lane) FIRST_OF_PIXEL(n_g.y, lane)
#define N_Z(lane) FIRST_OF_PIXEL(n_g.z, lane)
#define ALONG(lane) FIRST_OF_PIXEL(along, lane)
      first_n = real3_make((real)(OF_EACH(N_X)), (real)(OF_EACH(N_Y)), (real)(OF_EACH(N_Z)));
      first_along = (real)(OF_EACH(ALONG));
#undef FIRST_OF_PIXEL
#undef N_X
#undef N_Y
#undef N_Z
#undef ALONG
    }
    const real half_pixel = real3_dot(x, uniform3(view.back)) / -view.scale;
    const real off = real_abs(real3_dot(first_n, x) - first_along), facing = real3_dot(first_n, n_g);
    const mask alike = (off <= half_pixel) & (facing > 0.5f), first_empty = real3_dot(first_n, first_n) <= 0.0f;
    const mask smooth = (alike & (first_empty == empty)) | (first_empty & empty);
    if (mask_all(smooth)) continue;
    for (uint k = 0; k < VW && i + k < n; ++k)
      if (!INDEX(smooth, k)) edges[(i + k) >> log_positions] = 1;
  }
}

// Pixels that need no more positions: all positions so far of the pixel and of its neighbours hit one smooth surface.
// Their sums are multiplied by `factor`, positions in all over positions so far. The others stay open.
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
  open[i] = edge;
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
  const PixelBox box = any_pixel_box(t, window);
  if (t.triangle == NO_TRIANGLE || box.x1 - box.x0 > SMALL_BOX || box.y1 - box.y0 > SMALL_BOX) return;
  for (int y = box.y0; y < box.y1; ++y)
    for (int x = box.x0; x < box.x1; ++x)
      if (open[((uint)y - window.y) * window.width + (uint)x - window.x]) return;
  records[i].triangle = NO_TRIANGLE;
}

// Adds the subpixel positions of a window to the film, for up to four pyramid levels at once: film[set][pixel][half].
// Points that no layer sees go to the lists that gather_direct works off, one for each position, and count as edges.
__kernel void gather_pixels(const View view, const Window window, __global const uint* restrict ids,
                            __global const float4* restrict positions, __global const uint* restrict triangles,
                            __global const float* restrict normals, __constant View* layer_views,
                            __constant uint* level_first, __global const float4* restrict geometry,
                            __global const uint* restrict slots, const uint layers_first, const uint layers_count,
                            __global const float4* restrict values, const float scale, const Boundary boundary,
                            const uint4 levels, const uint sets, const uint position, __global float4* restrict film,
                            __global uint* n_direct, __global uint* direct, __global uint* edges) {
  const uint item = (uint)get_global_id(0), first = FIRST_SAMPLE(item, window, position);
  const uint log_positions = window.log_positions, n_pixels = window.width * window.height;
  const uint n = n_pixels << log_positions;
  const Layers layers = make_layers(layer_views, level_first, geometry, slots, layers_first, layers_count);
  const real zero = real_splat(0.0f);
  for (uint i = first; i < n; i = NEXT_SAMPLE(i, window, n)) {
    mask empty;
    const ureal id = triangles_at(ids, i, n, &empty);
    if (mask_all(empty)) continue;
    real px, py;
    film_samples(window, i, &px, &py);
    Surface s;
    surface_at(view, px, py, id, positions, triangles, normals, &s);
    const real factor = scale * transmittance_to(view, s.x, s.n_s, boundary);
    const real hit = real_select(empty, zero, real_splat(1.0f));
    real3 a0 = real3_make(zero, zero, zero), b0 = a0;
    mask unseen = empty;
    // Level 0, which tells what no layer sees, before what was asked for: one call, since each takes many registers.
    ROLLED for (uint round = 0; round <= sets; ++round) {
      real3 a = a0, b = b0;
      uint level = round == 0 ? 0 : round == 1 ? levels.x : round == 2 ? levels.y : round == 3 ? levels.z : levels.w;
      mask done = unseen;
      // Where a level sees too little, the next finer one stands in.
      ROLLED for (uint last = round == 0 ? 0 : 1; level >= last && !mask_all(done); --level) {
        real3 a_level, b_level;
        const real weight = gather_level(layers, level, s.x, s.n_g, done, values, &a_level, &b_level);
        const mask missed = done | (weight < MIN_WEIGHT);
        a = real3_select(missed, a, a_level);
        b = real3_select(missed, b, b_level);
        done = done | (missed == done);
        if (level > 0) continue;
        a0 = a;
        b0 = b;
        unseen = missed;
        break;
      }
      if (round == 0) {
        for (uint k = 0; k < VW && !mask_all(empty == unseen); ++k)
          if (INDEX(unseen, k) && !INDEX(empty, k)) {
            const uint pixel = (i + k) >> log_positions, list = (i + k) & ((1u << log_positions) - 1);
            direct[list * n_pixels + atomic_inc(n_direct + list)] = pixel;
            edges[pixel] = 1;
          }
        continue;
      }
      a = real3_scale(a, real_select(unseen, zero, factor));
      b = real3_scale(b, real_select(unseen, zero, factor));
      for (uint k = 0; k < VW && i + k < n; ++k) {
        __global float4* pixel = film + 2 * ((round - 1) * n_pixels + ((i + k) >> log_positions));
        pixel[0] += (float4)(ELEMENT(a.x, k), ELEMENT(a.y, k), ELEMENT(a.z, k), ELEMENT(hit, k));
        pixel[1].xyz += (float3)(ELEMENT(b.x, k), ELEMENT(b.y, k), ELEMENT(b.z, k));
      }
    }
  }
}

// The points of listed pixels at one of the window's subpixel positions, for pass 2's own function: those that no layer
// sees, or some that layers do see, to tell how far off these are. Of list number `list` these are the pixels from
// `first` on, up to `most`; n_held says how many. As layers_points, with T21 beside the normal. The list's length is
// added to n_direct's last number once.
__kernel void gather_points(const View view, __global const uint* restrict ids, const Window window,
                            __global const float4* restrict positions, __global const uint* restrict triangles,
                            __global const float* restrict normals, __constant Light* lights,
                            __global const float4* restrict map, const Boundary boundary, const Density density,
                            __global const float2* restrict rho, __global const float2* restrict extent,
                            __constant uint* level_first, const uint levels, const uint n_lights, const uint position,
                            const uint list, const uint first, const uint most, __global const uint* restrict direct,
                            __global uint* restrict n_direct, __global uint* restrict n_held,
                            __global float4* restrict points, __global float4* restrict centres) {
  // Work-groups take points in turn, so that a few points keep all compute units busy.
  const uint id = (uint)(get_local_id(0) * get_num_groups(0) + get_group_id(0)), items = (uint)get_global_size(0);
  const uint n_all = n_direct[list], n_points = n_all > first ? min(n_all - first, most) : 0;
  if (id == 0) n_held[0] = n_points;
  if (id == 0 && first == 0) n_direct[POSITIONS_SIDE_BY_SIDE] += n_all;
  for (uint item = id; item < n_points; item += items) {
    const uint i = direct[list * window.width * window.height + first + item];
    const uint x = window.x + i % window.width, y = window.y + i / window.width;
    mask sub_x, sub_y;
    subpixel(window, (ureal)(position), &sub_x, &sub_y);
    const Point s =
        point_at(view, (float)x + (float)INDEX(sub_x, 0) / SUBPIXELS, (float)y + (float)INDEX(sub_y, 0) / SUBPIXELS,
                 ids[(i << window.log_positions) + position], positions, triangles, normals);
    const real T21 = transmittance_to(view, uniform3((float4)(s.x, 0.0f)), uniform3((float4)(s.n_s, 0.0f)), boundary);
    const uint number = point_number(0, view.width, view.height, x, y);
    points[2 * item] = (float4)(s.x, as_float(0x80000000u | POINT_BITS | number));
    points[2 * item + 1] = (float4)(s.n_s, ELEMENT(T21, 0));
    for (uint l = 0; l < n_lights; ++l)
      centres[l * n_points + item] =
          sampling_centre(s.x, s.n_s, lights + l, map, boundary, density, rho, extent, level_first, levels);
    if (VW == 1) break;  // see NEXT_SAMPLE
  }
}

// Adds their values to the film.
__kernel void gather_direct(__global const uint* restrict n_held, const uint list, const uint first,
                            __global const uint* restrict direct, __global const float4* restrict points,
                            __global const float4* restrict values, const float scale, const uint sets,
                            const uint n_pixels, __global float4* restrict film) {
  const uint id = (uint)get_global_id(0), items = (uint)get_global_size(0);
  for (uint item = id; item < n_held[0]; item += items) {
    const float factor = scale * points[2 * item + 1].w;
    for (uint set = 0; set < sets; ++set) {
      const uint pixel = 2 * (set * n_pixels + direct[list * n_pixels + first + item]);
      film[pixel].xyz += factor * values[2 * item].xyz;
      film[pixel + 1].xyz += factor * values[2 * item + 1].xyz;
    }
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
