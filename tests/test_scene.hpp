// Small scenes made by code, one device with a plan and passes over them, and views in double for references.
#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "kernels/bssrdf.h"
#include "passes/passes.hpp"
#include "test_device.hpp"

namespace parian::test {

/// Uniform numbers, the same on every platform.
class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  double operator()(double low, double high) { return low + (high - low) * (double(engine_()) / 4294967296.0); }
  glm::dvec3 direction() {
    const double z = (*this)(-1, 1), phi = (*this)(0, 2 * std::numbers::pi), s = std::sqrt(1 - z * z);
    return {s * std::cos(phi), s * std::sin(phi), z};
  }

 private:
  std::mt19937 engine_;
};

/// The largest of the values added, and where; NaN counts as larger than all.
struct Worst {
  double value = 0;
  std::string where;
  template <class Text>  // a string, or a function that makes one
  void add(double v, const Text& text) {
    if (std::isnan(value) || v <= value) return;
    value = v;
    if constexpr (std::is_invocable_v<Text>)
      where = text();
    else
      where = text;
  }
};

/// The largest, or NaN if any is NaN.
inline double largest(std::initializer_list<double> values) {
  Worst worst;
  for (const double v : values) worst.add(v, "");
  return worst.value;
}

/// Adds a triangle whose corners share its geometric normal.
inline void add_triangle(Mesh& mesh, glm::dvec3 a, glm::dvec3 b, glm::dvec3 c) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {a, b, c});
  mesh.triangles.emplace_back(first, first + 1, first + 2);
  const glm::dvec3 n = glm::cross(b - a, c - a);
  mesh.normals.insert(mesh.normals.end(), 3, glm::length(n) > 0 ? glm::vec3(glm::normalize(n)) : glm::vec3(0, 0, 1));
}

/// A closed grid of nu x nv quads over a torus-like parameter square, with the surface's own normals.
inline Mesh torus(int nu, int nv, double major = 1.0, double minor = 0.4) {
  Mesh mesh;
  std::vector<glm::vec3> normals;
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j) {
      const double u = 2 * std::numbers::pi * i / nu, v = 2 * std::numbers::pi * j / nv;
      const glm::dvec3 ring(std::cos(u), 0, std::sin(u)), n(ring.x * std::cos(v), std::sin(v), ring.z * std::cos(v));
      mesh.positions.push_back(ring * major + n * minor);
      normals.emplace_back(n);
    }
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>((i % nu) * nv + j % nv); };
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j) {
      mesh.triangles.emplace_back(at(i, j), at(i, j + 1), at(i + 1, j));
      mesh.triangles.emplace_back(at(i + 1, j), at(i, j + 1), at(i + 1, j + 1));
    }
  for (const glm::uvec3& t : mesh.triangles)
    for (int c = 0; c < 3; ++c) mesh.normals.push_back(normals[t[c]]);
  return mesh;
}

/// An icosahedron divided `levels` times onto the unit sphere, with the sphere's normals.
inline Mesh icosphere(int levels) {
  const double g = 0.5 * (1 + std::sqrt(5.0));
  const glm::dvec3 p[12] = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                            {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  const int faces[20][3] = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                            {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                            {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  Mesh mesh;
  const std::function<void(glm::dvec3, glm::dvec3, glm::dvec3, int)> divide = [&](glm::dvec3 a, glm::dvec3 b,
                                                                                  glm::dvec3 c, int level) {
    if (level > 0) {
      const glm::dvec3 ab = glm::normalize(a + b), bc = glm::normalize(b + c), ca = glm::normalize(c + a);
      divide(a, ab, ca, level - 1), divide(ab, b, bc, level - 1), divide(ca, bc, c, level - 1);
      return divide(ab, bc, ca, level - 1);
    }
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {a, b, c});
    mesh.triangles.emplace_back(first, first + 1, first + 2);
    mesh.normals.insert(mesh.normals.end(), {glm::vec3(a), glm::vec3(b), glm::vec3(c)});
  };
  for (const auto& f : faces) divide(glm::normalize(p[f[0]]), glm::normalize(p[f[1]]), glm::normalize(p[f[2]]), levels);
  return mesh;
}

/// The cube of side 2, each face a jittered grid of n x n quads.
inline Mesh box(int n, std::uint32_t seed) {
  Mesh mesh;
  Random random(seed);
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      std::vector<glm::dvec3> grid;
      for (int i = 0; i <= n; ++i)
        for (int j = 0; j <= n; ++j) {
          const auto place = [&](int k) { return 2.0 * (k + (k > 0 && k < n ? random(-0.3, 0.3) : 0.0)) / n - 1.0; };
          // Corners on the cube's edges stay on a regular grid, so that faces share them.
          const bool border = i == 0 || j == 0 || i == n || j == n;
          const double u = border ? 2.0 * i / n - 1.0 : place(i), v = border ? 2.0 * j / n - 1.0 : place(j);
          glm::dvec3 p;
          p[axis] = side, p[(axis + 1) % 3] = u, p[(axis + 2) % 3] = v;
          grid.push_back(p);
        }
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const glm::dvec3 a = grid[i * (n + 1) + j], b = grid[(i + 1) * (n + 1) + j],
                           c = grid[(i + 1) * (n + 1) + j + 1], d = grid[i * (n + 1) + j + 1];
          add_triangle(mesh, a, b, c);
          add_triangle(mesh, a, c, d);
        }
    }
  return mesh;
}

/// A material by its coefficients in 1/mm; marble's when none are given.
inline Material medium(glm::dvec3 sigma_s = {2.19, 2.62, 3.0}, glm::dvec3 sigma_a = {0.0021, 0.0041, 0.0071},
                       double ior = 1.5) {
  Material m;
  m.name = "test";
  m.sigma_s = sigma_s, m.sigma_a = sigma_a, m.ior = ior;
  return m;
}

inline Scene scene_of(Mesh mesh, Material material = medium(), std::vector<DirectionalLight> lights = {{}}) {
  Scene scene;
  scene.mesh = std::move(mesh);
  scene.material = std::move(material);
  scene.lights = std::move(lights);
  return scene;
}

/// A scene on the device under test. `change` may edit the plan before anything is compiled.
struct Bench {
  explicit Bench(Scene s, const Settings& settings = {}, const std::function<void(Plan&)>& change = {},
                 const std::string& selector = test_selector())
      : scene(std::move(s)),
        plan(changed(make_plan(scene, settings, opened(selector).info()), change)),
        shared(built(plan.options, selector)),
        compute(*shared) {
    upload_geometry(passes, scene.mesh);
    passes.media = compute.upload(plan.media);
    passes.rho = compute.upload(plan.density.rho);
    for (const glm::dvec3& x : scene.mesh.positions) points.push_back((x - plan.space.centre) / plan.space.radius);
  }
  /// The mesh's corner as the device has it.
  [[nodiscard]] glm::dvec3 corner(std::uint32_t triangle, int c) const {
    return glm::dvec3(glm::vec3(points[scene.mesh.triangles[triangle][c]]));
  }

  Scene scene;
  Plan plan;
  std::shared_ptr<Compute> shared;
  Compute& compute;
  Passes passes{compute, plan};
  std::vector<glm::dvec3> points;  ///< positions in object units

 private:
  static Plan changed(Plan plan, const std::function<void(Plan&)>& change) {
    if (change) change(plan);
    return plan;
  }
};

inline kernels::Window window_of(std::uint32_t width, std::uint32_t height, int sample_x = 128, int sample_y = 128) {
  kernels::Window w{};
  w.width = width, w.height = height, w.sample_x = sample_x, w.sample_y = sample_y;
  return w;
}

/// Sets `-DNAME=` in compiler options.
inline void set_option(std::string& options, const std::string& name, int value) {
  const std::size_t at = options.find("-D" + name + "="), end = options.find(' ', at);
  options = options.substr(0, at) + fmt::format("-D{}={}", name, value) +
            (end == std::string::npos ? "" : options.substr(end));
}

inline glm::dvec3 exact(const kernels::float4& v) { return {v.x, v.y, v.z}; }
inline std::string hex(glm::dvec3 v) { return fmt::format("({:a}, {:a}, {:a})", v.x, v.y, v.z); }

/// A view in double.
struct ExactView {
  explicit ExactView(const kernels::View& v)
      : view(v), origin(exact(v.origin)), right(exact(v.right)), down(exact(v.down)), back(exact(v.back)) {}
  [[nodiscard]] glm::dvec3 frame(glm::dvec3 v) const {
    return {glm::dot(v, right), glm::dot(v, down), glm::dot(v, back)};
  }
  /// (film x, film y, nearness)
  [[nodiscard]] glm::dvec3 film(glm::dvec3 p) const {
    const glm::dvec3 c = frame(p - origin);
    const bool pinhole = view.near_distance > 0;
    const double s = pinhole ? view.scale / -c.z : view.scale;
    return {view.centre_x + s * c.x, view.centre_y + s * c.y, pinhole ? -1 / c.z : c.z + 2};
  }
  /// The ray through a film position.
  [[nodiscard]] std::pair<glm::dvec3, glm::dvec3> ray(double x, double y) const {
    const glm::dvec3 lateral = (right * (x - view.centre_x) + down * (y - view.centre_y)) / double(view.scale);
    return view.near_distance > 0 ? std::pair(origin, lateral - back) : std::pair(origin + lateral, -back);
  }
  kernels::View view;
  glm::dvec3 origin, right, down, back;
};

/// Where a ray meets a triangle's plane, by areas of the sub-triangles; both normals turned to the viewer.
struct Hit {
  glm::dvec3 x, n_g, n_s;
  double b[3];        ///< barycentric coordinates
  double cosine = 0;  ///< of geometric normal and ray, at least 0
  [[nodiscard]] double inside() const { return std::min({b[0], b[1], b[2]}); }
};
inline Hit hit_triangle(const Bench& bench, std::uint32_t id, const ExactView& view, double px, double py) {
  const auto [o, d] = view.ray(px, py);
  const glm::dvec3 p[3] = {bench.corner(id, 0), bench.corner(id, 1), bench.corner(id, 2)};
  const glm::dvec3 n = glm::cross(p[1] - p[0], p[2] - p[0]);
  Hit h;
  h.x = o + d * (glm::dot(p[0] - o, n) / glm::dot(d, n));
  h.n_s = glm::dvec3(0);
  for (int c = 0; c < 3; ++c) {
    h.b[c] = glm::dot(glm::cross(p[(c + 1) % 3] - h.x, p[(c + 2) % 3] - h.x), n) / glm::dot(n, n);
    h.n_s += h.b[c] * glm::dvec3(bench.scene.mesh.normals[3 * id + c]);
  }
  const double turned = glm::dot(n, d) > 0 ? -1 : 1;
  h.n_g = turned * glm::normalize(n);
  h.n_s = turned * glm::normalize(h.n_s);
  h.cosine = -glm::dot(h.n_g, glm::normalize(d));
  return h;
}

/// A light map's texel as it was read back, its shading normal unpacked from two signed 16-bit fractions.
struct MapTexel {
  explicit MapTexel(const kernels::float4& t) : lit(t.x > -8.0F), height(t.x), slope(t.y, t.z) {
    const auto bits = std::bit_cast<std::uint32_t>(t.w);
    n.x = static_cast<std::int16_t>(bits & 0xffffU) / 32767.0;
    n.y = static_cast<std::int16_t>(bits >> 16) / 32767.0;
    n.z = std::sqrt(std::max(1 - n.x * n.x - n.y * n.y, 1e-4));
  }
  bool lit;
  double height;
  glm::dvec2 slope;
  glm::dvec3 n;
};

/// S_d T12 of each medium, in double, for light that falls on a light map's texel at a film position and leaves at a
/// point `p` with normal `n_o`, both in the light's frame. The last entry, of colours without a medium, is 0.
using PerMedium = std::array<double, 4>;
inline PerMedium texel_response(const Plan& plan, const kernels::Light& light, const MapTexel& texel, glm::dvec2 sample,
                                glm::dvec2 film, glm::dvec3 p, glm::dvec3 n_o, double turn_of_n_o = 0) {
  using kernels::real3;
  PerMedium response{};
  if (!texel.lit) return response;
  const double scale = light.view.scale;
  const glm::dvec3 x_i((film.x - light.view.centre_x) / scale, (film.y - light.view.centre_y) / scale,
                       texel.height + glm::dot(texel.slope, film - sample) / scale);
  const real3 towards{0, 0, 1}, n_i{texel.n.x, texel.n.y, texel.n.z};
  const real3 w12 = kernels::refract_into(towards, n_i, plan.boundary);
  kernels::DipoleGeometry g =
      kernels::dipole_geometry({p.x - x_i.x, p.y - x_i.y, p.z - x_i.z}, w12, n_i, {n_o.x, n_o.y, n_o.z});
  g.w_n += turn_of_n_o;
  for (std::size_t m = 0; m < plan.media.size(); ++m)
    response[m] =
        kernels::fresnel_transmittance(n_i.z, plan.boundary) * kernels::bssrdf(plan.media[m], plan.boundary, g);
  return response;
}

/// Scattered radiance at a point by quadrature over the whole of a light's map (half A), each lit texel divided until
/// its parts are small beside their distance and beside the mean free path.
inline glm::dvec3 quadrature(const Plan& plan, const kernels::Light& light, const std::vector<kernels::float4>& map,
                             glm::dvec3 x, glm::dvec3 n) {
  const ExactView view(light.view);
  const glm::dvec3 p = view.frame(x - view.origin), n_o = view.frame(n);
  const double scale = light.view.scale;
  double floor = 2, sigma_tr = 0;
  for (const kernels::Medium& m : plan.media) {
    floor = std::min(floor, 0.1 / m.sigma_t_prime);
    sigma_tr = std::max(sigma_tr, double{m.sigma_tr} * m.sigma_t_prime);
  }
  PerMedium sum{};
  for (std::uint32_t k = 0; k < light.view.width * light.view.height; ++k) {
    const MapTexel texel(map[light.map + k]);
    if (!texel.lit) continue;
    const glm::dvec2 sample =
        glm::dvec2(k % light.view.width, k / light.view.width) + glm::dvec2(light.sample_x[0], light.sample_y[0]);
    const std::function<void(glm::dvec2, double)> add = [&](glm::dvec2 film, double side) {
      const glm::dvec3 to((film.x - light.view.centre_x) / scale - p.x, (film.y - light.view.centre_y) / scale - p.y,
                          texel.height + glm::dot(texel.slope, film - sample) / scale - p.z);
      const double size = side / scale * std::sqrt(1 + glm::dot(texel.slope, texel.slope));
      if (side > 1e-4 && (size > 0.1 * std::max(glm::length(to), floor) || size * sigma_tr > 0.4)) {
        for (const double v : {-0.25, 0.25})
          for (const double u : {-0.25, 0.25}) add(film + glm::dvec2(u, v) * side, 0.5 * side);
        return;
      }
      const PerMedium r = texel_response(plan, light, texel, sample, film, p, n_o);
      for (std::size_t m = 0; m < plan.media.size(); ++m) sum[m] += r[m] * side * side / (scale * scale);
    };
    add(sample, 1.0);
  }
  return exact(light.irradiance) * double(light.samples) *
         glm::dvec3(sum[plan.medium_of[0]], sum[plan.medium_of[1]], sum[plan.medium_of[2]]);
}

}  // namespace parian::test
