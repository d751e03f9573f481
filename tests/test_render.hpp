// Whole renders in tests: small scenes of the shipped models, and what two images are compared by.
#pragma once
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "io/mesh_file.hpp"
#include "plan/plan.hpp"
#include "relmse.hpp"
#include "render/renderer.hpp"
#include "scene/medium.hpp"
#include "source_file.hpp"
#include "test_device.hpp"

namespace parian::test {

/// A shipped model, its box's centre at the origin and its longest side `size_mm`, as the command line places it.
inline const Mesh& model(const std::string& name, double size_mm = 100.0) {
  static std::map<std::pair<std::string, double>, Mesh> loaded;
  Mesh& mesh = loaded[{name, size_mm}];
  if (!mesh.triangles.empty()) return mesh;
  PolygonMesh polygons = read_mesh_file(source_file("meshes/" + name + ".ply"));
  glm::dvec3 low(INFINITY), high(-INFINITY);
  for (const auto& p : polygons.points) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const double longest = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
  for (auto& p : polygons.points) p = (p - 0.5 * (low + high)) * (size_mm / longest);
  return mesh = clean_mesh(polygons);
}

/// A mesh given by triangles only.
inline Mesh mesh_of(const std::vector<glm::dvec3>& points, const std::vector<std::uint32_t>& corners) {
  PolygonMesh polygons;
  polygons.points = points;
  polygons.corners = corners;
  polygons.face_sizes.assign(corners.size() / 3, 3);
  return clean_mesh(polygons);
}

/// A box around the origin.
inline Mesh box(glm::dvec3 size) {
  std::vector<glm::dvec3> points;
  for (int i = 0; i < 8; ++i) points.push_back(0.5 * size * glm::dvec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  return mesh_of(points, {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                          2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5});
}

inline Material material(double sigma_s_prime, double sigma_a, double ior = 1.3) {
  return {"test", glm::dvec3(sigma_s_prime), glm::dvec3(sigma_a), glm::dvec3(0.0), ior};
}

/// The default scene of a bare mesh: seen from the front so that the bounding sphere fits, lit from behind.
inline Scene bare_scene(const Mesh& mesh, const Material& material, glm::uvec2 film = {64, 64}) {
  Scene scene;
  scene.mesh = mesh;
  scene.material = material;
  scene.lights.emplace_back();
  scene.film = film;
  double radius = 0.0;
  for (const auto& p : mesh.positions) radius = std::max(radius, glm::length(p));
  Camera camera;
  camera.eye = glm::normalize(glm::dvec3(0.2, 0.15, 1.0)) * (1.02 * radius / std::sin(glm::radians(15.0)));
  scene.cameras.push_back(camera);
  return scene;
}

inline Settings small_settings() {
  Settings settings;
  settings.layers = 12;
  settings.layer_size = 64;
  settings.light_map_size = 128;
  settings.gather = Gather::layers;
  settings.error = 0.0;
  return settings;
}

/// A device with the program that a scene's plan asks for.
inline std::shared_ptr<Compute> built_for(const Scene& scene, const Settings& settings,
                                          const std::string& selector = test_selector()) {
  return built(make_plan(scene, settings, opened(selector).info()).options, selector);
}

inline Renderer renderer_of(const Scene& scene, const Settings& settings,
                            const std::string& selector = test_selector()) {
  return {scene, settings, built_for(scene, settings, selector), nullptr};
}

struct Rendered {
  Image image;
  Statistics statistics;   ///< after the image
  double estimate = -1.0;  ///< of the last checkpoint
};

/// Renders as the command line does: an estimate at each checkpoint, then the first camera's image.
inline Rendered render(const Scene& scene, const Settings& settings, std::uint32_t frames) {
  Renderer renderer = renderer_of(scene, settings);
  Rendered r;
  while (renderer.frames() < frames) {
    renderer.frame();
    if (renderer.checkpoint()) r.estimate = renderer.estimate();
  }
  r.image = renderer.image(0);
  r.statistics = renderer.statistics();
  return r;
}

inline bool same_bits(const Image& a, const Image& b) {
  return a.width == b.width && a.height == b.height && a.rgba.size() == b.rgba.size() &&
         std::memcmp(a.rgba.data(), b.rgba.data(), a.rgba.size() * sizeof(float)) == 0;
}

/// Values that differ in bits, and the largest difference, for messages.
inline std::string difference(const Image& a, const Image& b) {
  std::size_t count = 0;
  double largest = 0.0;
  for (std::size_t i = 0; i < std::min(a.rgba.size(), b.rgba.size()); ++i) {
    count += std::bit_cast<std::uint32_t>(a.rgba[i]) != std::bit_cast<std::uint32_t>(b.rgba[i]);
    largest = std::max(largest, std::abs(double{a.rgba[i]} - double{b.rgba[i]}));
  }
  return fmt::format("{} of {} values differ, by up to {:.3g}", count, a.rgba.size(), largest);
}

inline double relmse(const Image& image, const Image& reference) { return relmse(image.rgba, reference.rgba); }

/// Mean of RGB over the whole film.
inline double mean_value(const Image& image) {
  double sum = 0.0;
  for (std::size_t i = 0; i < image.rgba.size(); ++i) sum += i % 4 < 3 ? image.rgba[i] : 0.0;
  return sum / (0.75 * static_cast<double>(image.rgba.size()));
}

inline std::size_t pixels_inside(const Image& image) {
  std::size_t count = 0;
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) count += image.rgba[i] >= fully_covered;
  return count;
}

/// What holds for every image: finite, nothing negative, RGB 0 off the object, alpha a coverage; and on the object no
/// exact 0 beside a pixel brighter than a tenth of the mean, in channels of `lit`.
inline void expect_sane(const Rendered& r, const std::string& what, glm::bvec3 lit = {true, true, true}) {
  const Image& image = r.image;
  EXPECT_EQ(r.statistics.nonfinite, 0U) << what;
  EXPECT_LE(r.statistics.bytes_peak, r.statistics.bytes_planned) << what;
  ASSERT_EQ(image.rgba.size(), std::size_t{4} * image.width * image.height) << what;
  std::size_t bad = 0, holes = 0;
  const double bright = 0.1 * mean_value(image);
  const auto at = [&](std::uint32_t x, std::uint32_t y, int c) { return image.rgba[4 * (y * image.width + x) + c]; };
  for (std::uint32_t y = 0; y < image.height; ++y)
    for (std::uint32_t x = 0; x < image.width; ++x) {
      const float alpha = at(x, y, 3);
      bad += !(alpha >= 0.0F && alpha <= 1.0F);
      for (int c = 0; c < 3; ++c) {
        const float v = at(x, y, c);
        bad += !(v >= 0.0F && v < INFINITY) || (alpha == 0.0F && v != 0.0F);
        if (!lit[c] || alpha < fully_covered || v != 0.0F) continue;
        const bool neighbour =
            (x > 0 && at(x - 1, y, c) > bright) || (x + 1 < image.width && at(x + 1, y, c) > bright) ||
            (y > 0 && at(x, y - 1, c) > bright) || (y + 1 < image.height && at(x, y + 1, c) > bright);
        holes += neighbour;
      }
    }
  EXPECT_EQ(bad, 0U) << what << ": values that are NaN, infinite, negative or off the object";
  EXPECT_EQ(holes, 0U) << what << ": black pixels beside bright ones";
}

}  // namespace parian::test
