// Scenes, renders and comparisons of the named cases.
#include "truth/trial.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "plan/plan.hpp"
#include "session/rendering.hpp"
#include "truth/compare.hpp"

namespace parian {
namespace {

/// A grid of n x n quads over `place`(u, v), u and v in [-1, 1], added to `mesh`.
template <class Place>
void add_grid(PolygonMesh& mesh, int n, const Place& place) {
  const auto first = static_cast<std::uint32_t>(mesh.points.size());
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) mesh.points.push_back(place(2.0 * i / n - 1, 2.0 * j / n - 1));
  const auto at = [&](int i, int j) { return first + static_cast<std::uint32_t>(i * (n + 1) + j); };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      mesh.face_sizes.push_back(4);
      mesh.corners.insert(mesh.corners.end(), {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    }
}

}  // namespace

Material medium_of(double sigma_s, double sigma_a, double g, double ior) {
  return {"case", glm::dvec3(sigma_s), glm::dvec3(sigma_a), glm::dvec3(g), ior};
}

Mesh sphere_mesh(double radius, int n) {
  PolygonMesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0})
      add_grid(mesh, n, [&](double u, double v) {
        glm::dvec3 p;
        p[axis] = side, p[(axis + 1) % 3] = side * u, p[(axis + 2) % 3] = v;
        // In one order whatever the face, so that faces share their borders to the last bit.
        std::array<double, 3> square{p.x * p.x, p.y * p.y, p.z * p.z};
        std::sort(square.begin(), square.end());
        return p * (radius / std::sqrt(square[0] + square[1] + square[2]));
      });
  return clean_mesh(mesh);
}

Mesh plate_mesh(double half, int n) {
  PolygonMesh mesh;
  add_grid(mesh, n, [&](double u, double v) { return glm::dvec3(half * u, half * v, 0); });
  return clean_mesh(mesh);
}

Scene ordinary_scene() {
  Scene scene;
  scene.mesh = sphere_mesh();
  scene.material = {"case", {0.5, 1.0, 2.0}, {0.002, 0.01, 0.05}, glm::dvec3(0.0), 1.3};
  scene.lights.push_back({{0.5, 0.6, 0.8}, glm::dvec3(std::numbers::pi)});
  scene.cameras.push_back({{40, 30, 210}, {0, 0, 0}, {0, 1, 0}, 26.0});
  scene.film = {16, 16};
  return scene;
}

Settings ordinary_settings() {
  Settings settings;
  settings.error = 0;
  settings.frames = 64;  // one subpixel position each
  settings.layers = 4;
  settings.layer_size = 32;
  settings.light_map_size = 64;
  settings.gather = Gather::camera;
  settings.keep = {"black-channels", "equal-channels", "clipping"};
  settings.force = true;  // what a device gets wrong is to be seen, not refused
  return settings;
}

Trial::Trial(const std::string& selector) : selector_(selector), compute_(selector) {
  const Plan plan = make_plan(ordinary_scene(), ordinary_settings(), compute_.info());
  lanes_ = plan.lanes;
}

Trial::Result Trial::render(const Scene& scene, const Settings& settings) const {
  Rendering renderer(scene, settings, selector_);
  render_frames(renderer, {.frames = settings.frames, .checkpoints = false});
  Result result{renderer.image(0), {}};
  result.statistics = renderer.statistics();
  const Image& image = result.image;
  if (result.statistics.nonfinite > 0)
    throw std::runtime_error(fmt::format("{} values are not finite or negative", result.statistics.nonfinite));
  for (std::size_t i = 0; i < image.rgba.size(); ++i) {
    const float v = image.rgba[i], alpha = image.rgba[i / 4 * 4 + 3];
    if (!(v >= 0 && v <= std::numeric_limits<float>::max()) || !(alpha <= 1) || (alpha == 0 && v != 0))
      throw std::runtime_error(fmt::format("value {} of pixel ({}, {}) is {} where alpha is {}", "RGBA"[i % 4],
                                           i / 4 % image.width, i / 4 / image.width, v, alpha));
  }
  return result;
}

const Trial::Result& Trial::ordinary() {
  if (!ordinary_) ordinary_ = std::make_unique<Result>(render(ordinary_scene(), ordinary_settings()));
  return *ordinary_;
}

Finding Trial::bssrdf(const Material& material) {
  std::vector<VectorCase> cases;
  const glm::vec3 up(0, 0, 1), directions[] = {{0, 0, 1}, {0.6F, 0, 0.8F}, {0, -0.99995F, 0.01F}};
  for (int channel = 0; channel < 3; ++channel)
    for (const double r : {0.0, 1e-4, 1e-2, 0.1, 0.5, 1.0, 3.0, 10.0, 30.0, 100.0})
      for (const glm::vec3& w_i : directions)
        for (const glm::vec3& n_o : {up, -up, glm::vec3(0.8F, 0, 0.6F)}) {
          VectorCase c;
          c.name = material.name;
          c.sigma_s = static_cast<float>(material.sigma_s[channel]);
          c.sigma_a = static_cast<float>(material.sigma_a[channel]);
          c.g = static_cast<float>(material.g[channel]), c.eta = static_cast<float>(material.ior);
          c.w_i = w_i, c.n_i = up, c.n_o = n_o;
          c.derive();
          c.x_o = glm::dvec3(0.28, 0.96, n_o.z < 0 ? -1 : 0) * (r / c.channel.sigma_t_prime);
          c.S[0] = exact_bssrdf(c, Model::directional);
          cases.push_back(c);
        }
  const Judgement j = judge(cases, device_bssrdf(compute_, cases, Model::directional, lanes_), Model::directional);
  return {j.worst_of_tol, 1, fmt::format("S_d over its tolerance, {} pairs", cases.size())};
}

Finding same_bits(const Image& picture, const Image& expected) {
  if (picture.rgba.size() != expected.rgba.size()) return {INFINITY, 0, "sizes differ"};
  std::size_t count = 0;
  for (std::size_t i = 0; i < picture.rgba.size(); ++i)
    count += std::bit_cast<std::uint32_t>(picture.rgba[i]) != std::bit_cast<std::uint32_t>(expected.rgba[i]);
  return {static_cast<double>(count), 0, fmt::format("values that differ in bits, of {}", picture.rgba.size())};
}

Finding same_picture(const Image& picture, const Image& expected, double allowed) {
  return {compare(picture, expected).relmse, allowed, "relMSE"};
}

Finding black(const Image& picture) {
  double largest = 0;
  for (std::size_t i = 0; i < picture.rgba.size(); ++i)
    if (i % 4 < 3) largest = std::max(largest, double{picture.rgba[i]});
  return {largest, 0, "largest value"};
}

}  // namespace parian
