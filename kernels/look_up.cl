// Layers looked up as in shadow mapping: which of their texels stand for a point, and how much each counts.
#ifndef PARIAN_LOOK_UP_CL
#define PARIAN_LOOK_UP_CL
#include "surface.cl"

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

#endif
