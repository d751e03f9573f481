// The table of extreme cases. Right values need no stored number: they are double forms, exact zeros, coverage known in
// closed form, or pictures that a symmetry makes equal.
#include "truth/extreme_cases.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <future>

#include "plan/plan.hpp"
#include "truth/extreme_outcomes.hpp"

namespace parian {
namespace {

void scale(Scene& scene, double factor) {
  for (glm::dvec3& p : scene.mesh.positions) p *= factor;
  for (Camera& camera : scene.cameras) camera.eye *= factor, camera.target *= factor;
  scene.material.sigma_s /= factor;
  scene.material.sigma_a /= factor;
}

void move(Scene& scene, glm::dvec3 by) {
  for (glm::dvec3& p : scene.mesh.positions) p += by;
  for (Camera& camera : scene.cameras) camera.eye += by, camera.target += by;
}

Image times(Image image, float factor) {
  for (std::size_t i = 0; i < image.rgba.size(); ++i)
    if (i % 4 < 3) image.rgba[i] *= factor;
  return image;
}

// --- Geometric ---

/// Clean triangles, and what cleaning has to drop: no area, one corner twice, corners on a line.
Finding drops_degenerate_faces(Trial&) {
  PolygonMesh mesh;
  mesh.points = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}, {5, 0, 0}, {0, 0, 10}};
  mesh.corners = {0, 1, 2, 0, 0, 1, 0, 3, 1, 2, 2, 2, 0, 1, 4};
  mesh.face_sizes.assign(5, 3);
  const Mesh clean = clean_mesh(mesh);
  const double kept = static_cast<double>(clean.triangles.size()),
               dropped = static_cast<double>(clean.counts.zero_area_faces);
  double normals = 0;
  for (const glm::vec3& n : clean.normals) normals = std::max(normals, std::fabs(double{glm::length(n)} - 1));
  if (!(normals < 1e-6)) return {normals, 1e-6, "length of a normal off 1"};
  return {std::fabs(kept - 2) + std::fabs(dropped - 3), 0, "faces dropped or kept wrongly, of 5"};
}

void turn_inside_out(Scene& scene, Settings&) {
  for (glm::uvec3& t : scene.mesh.triangles) std::swap(t.y, t.z);
  for (std::size_t i = 0; i < scene.mesh.normals.size(); i += 3)
    std::swap(scene.mesh.normals[i + 1], scene.mesh.normals[i + 2]);
  for (glm::vec3& n : scene.mesh.normals) n = -n;
}

/// A plate that fills the film, seen straight on, with vertices on pixel centres; a needle covers its lower half.
void plate_of_needles(Scene& scene, Settings&) {
  scene.mesh = plate_mesh(50, 16);
  for (glm::dvec3& p : scene.mesh.positions)
    if (std::fabs(p.y) < 40) p.y *= 1e-6;  // rows of quads 50 mm by some 1e-5 mm, and two tall ones
  scene.cameras[0] = {{0, 0, 80}, {0, 0, 0}, {0, 1, 0}, 45};
}

void add_geometric(std::vector<ExtremeCase>& list) {
  const char* k = "geometric";
  list.push_back({k, "scaled by 2^20 and 2^-20", "the same bits", [](Trial& trial) {
                    Finding worst;
                    for (const int power : {20, -20})
                      worst = both(
                          worst, changes_nothing([=](Scene& s, Settings&) { scale(s, std::ldexp(1, power)); })(trial));
                    return worst;
                  }});
  list.push_back({k, "scaled by 1e6", "the same to rounding",
                  changes_nothing([](Scene& s, Settings&) { scale(s, 1e6); }, rounding_relmse)});
  list.push_back({k, "scaled by 1e-6", "the same to rounding",
                  changes_nothing([](Scene& s, Settings&) { scale(s, 1e-6); }, rounding_relmse)});
  list.push_back({k, "1e6 mm from the origin", "the same to rounding",
                  changes_nothing(
                      [](Scene& s, Settings&) {
                        move(s, {1e6, -3e5, 7e5});
                      },
                      rounding_relmse)});
  list.push_back(
      {k, "every triangle twice", "the same bits: the lower id wins", changes_nothing([](Scene& s, Settings&) {
         Mesh& m = s.mesh;
         m.triangles.insert(m.triangles.end(), m.triangles.begin(), m.triangles.end());
         m.normals.insert(m.normals.end(), m.normals.begin(), m.normals.end());
       })});
  list.push_back({k, "inside out", "the same to rounding: surfaces have two sides",
                  changes_nothing(turn_inside_out, rounding_relmse)});
  list.push_back({k, "degenerate faces", "dropped and counted", drops_degenerate_faces});
  list.push_back({k, "a vertex at NaN", "refused",
                  refuses([](Scene& s, Settings&) { s.mesh.positions[3].y = nan; }, {"vertex 3", "not finite"})});
  list.push_back({k, "all vertices in one point", "refused", refuses([](Scene& s, Settings&) { scale(s, 0); }, {""})});
  list.push_back({k, "vertices on pixel centres", "every pixel covered once", covers_film([](Scene& s, Settings&) {
                    s.mesh = plate_mesh(64, 16);
                    s.cameras[0] = {{0, 0, 64}, {0, 0, 0}, {0, 1, 0}, 90};
                  })});
  list.push_back({k, "needles of 1e6 to 1", "every pixel covered once", covers_film(plate_of_needles)});
  list.push_back({k, "a triangle 1e4 films wide", "every pixel covered once", covers_film([](Scene& s, Settings&) {
                    s.mesh = plate_mesh(50, 1);
                    s.cameras[0] = {{7, 3, 0.01}, {7, 3, 0}, {0, 1, 0}, 53};
                  })});
}

// --- Lighting ---

void add_lighting(std::vector<ExtremeCase>& list) {
  const char* k = "lighting";
  list.push_back({k, "no light", "exactly black, and a warning", [](Trial& trial) {
                    const auto r = changed(trial, [](Scene& s, Settings&) { s.lights.clear(); });
                    return both(black(r.image), warned(r, "no light"));
                  }});
  list.push_back({k, "irradiance 0", "exactly black", [](Trial& trial) {
                    return black(
                        changed(trial, [](Scene& s, Settings&) { s.lights[0].irradiance = glm::dvec3(0); }).image);
                  }});
  for (const int power : {90, -64})  // products with smaller ones leave float32's normal numbers
    list.push_back(
        {k, power > 0 ? "irradiance times 2^90" : "irradiance times 2^-64", "exactly proportional", [=](Trial& trial) {
           const Image image =
               changed(trial, [&](Scene& s, Settings&) { s.lights[0].irradiance *= std::ldexp(1, power); }).image;
           return same_bits(times(image, std::ldexp(1.0F, -power)), trial.ordinary().image);
         }});
  list.push_back({k, "edge-on to a plate", "exactly black: no light falls on it", [](Trial& trial) {
                    return black(changed(trial, [](Scene& s, Settings&) {
                                   s.mesh = plate_mesh();
                                   s.lights[0].towards = {1, 0, 0};
                                 }).image);
                  }});
  list.push_back({k, "grazing a plate by 2 degrees", "finite, and not black", [](Trial& trial) {
                    return not_black(changed(trial, [](Scene& s, Settings&) {
                      s.mesh = plate_mesh();
                      s.lights[0].towards = {1, 0, 0.035};
                    }));
                  }});
  // The plate's projection falls between the centres of the light map's texels: what light it gets may be missed.
  list.push_back({k, "grazing a plate by 1e-6", "finite, and darker than 1e-3 of its due face-on", [](Trial& trial) {
                    const auto mean = [&](glm::dvec3 towards) {
                      return mean_of(changed(trial, [&](Scene& s, Settings&) {
                                       s.mesh = plate_mesh();
                                       s.lights[0].towards = towards;
                                     }).image);
                    };
                    return Finding{mean({1, 0, 1e-6}) / mean({0, 0, 1}), 1e-3, "share of the radiance face-on"};
                  }});
  list.push_back({k, "direction 1e-150 or 1e90 long", "the same bits", [](Trial& trial) {
                    Finding worst;
                    for (const double length : {0x1p-500, 0x1p+300})
                      worst = both(worst,
                                   changes_nothing([=](Scene& s, Settings&) { s.lights[0].towards *= length; })(trial));
                    return worst;
                  }});
  list.push_back({k, "direction of no length", "refused",
                  refuses([](Scene& s, Settings&) { s.lights[0].towards = {}; }, {"light 1", "no direction"})});
  list.push_back({k, "irradiance NaN", "refused",
                  refuses([](Scene& s, Settings&) { s.lights[0].irradiance.y = nan; }, {"light 1", "irradiance"})});
  list.push_back({k, "irradiance negative", "refused",
                  refuses([](Scene& s, Settings&) { s.lights[0].irradiance.y = -1; }, {"light 1", "irradiance"})});
}

// --- Camera and resources ---

void add_camera(std::vector<ExtremeCase>& list) {
  const char* k = "camera";
  const auto seen = [](glm::dvec3 eye, glm::dvec3 target, double fov) {
    return [=](Scene& s, Settings&) { s.cameras[0] = {eye, target, {0, 1, 0}, fov}; };
  };
  list.push_back({k, "inside the object", "every pixel covered", covers_film(seen({10, 0, 0}, {10, 0, -1}, 60))});
  list.push_back({k, "inside, fov 179.9", "every pixel covered", covers_film(seen({0, 1, 2}, {0, 1, -1}, 179.9))});
  list.push_back(
      {k, "1e-3 mm before the object", "every pixel covered", covers_film(seen({0, 0, 50.001}, {0, 0, 0}, 60))});
  list.push_back({k, "fov 1e-3 from 1e5 mm", "every pixel covered", covers_film(seen({0, 0, 1e5}, {0, 0, 0}, 1e-3))});
  list.push_back({k, "film 1 x 1", "every pixel covered", covers_film([](Scene& s, Settings&) {
                    s.film = {1, 1};
                    s.cameras[0].fov = 5;
                  })});
  list.push_back({k, "film 16384 x 1", "finite", [](Trial& trial) {
                    const auto r = changed(trial, [](Scene& s, Settings&) {
                      s.film = {16384, 1};
                      s.cameras[0].fov = 0.5;
                    });
                    return not_black(r);
                  }});
  list.push_back({k, "looking away", "exactly nothing", [](Trial& trial) {
                    Image image =
                        changed(trial, [](Scene& s, Settings&) { s.cameras[0].target = 2.0 * s.cameras[0].eye; }).image;
                    for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i - 1] += image.rgba[i];
                    return black(image);
                  }});
  list.push_back({k, "film of no pixels", "refused",
                  refuses(
                      [](Scene& s, Settings&) {
                        s.film = {0, 16};
                      },
                      {"film of 0 x 16"})});
  list.push_back({k, "film of 16385 pixels", "refused",
                  refuses(
                      [](Scene& s, Settings&) {
                        s.film = {16385, 16};
                      },
                      {"16385"})});
  list.push_back({k, "fov 0, 180, NaN", "refused", [=](Trial& trial) {
                    Finding worst;
                    for (const double fov : {0.0, 180.0, nan})
                      worst =
                          both(worst, refuses([=](Scene& s, Settings&) { s.cameras[0].fov = fov; }, {"fov"})(trial));
                    return worst;
                  }});
  list.push_back({k, "looks at itself", "refused",
                  refuses([](Scene& s, Settings&) { s.cameras[0].target = s.cameras[0].eye; }, {"same point"})});
  list.push_back(
      {k, "eye at NaN", "refused", refuses([](Scene& s, Settings&) { s.cameras[0].eye.z = nan; }, {"camera 1"})});
}

void add_resource(std::vector<ExtremeCase>& list) {
  const char* k = "resource";
  for (const std::uint32_t samples : {10U, 18U})
    list.push_back({k, samples == 10 ? "5 samples a half" : "9 samples a half", "the same mean: idle lanes add nothing",
                    [=](Trial& trial) {
                      const Image image = changed(trial, [=](Scene&, Settings& s) { s.samples = samples; }).image;
                      const double ratio = mean_of(image) / mean_of(trial.ordinary().image);
                      return Finding{std::fabs(ratio - 1), 0.05, "mean off, with noise"};  // a lane more is 0.11
                    }});
  for (const std::uint32_t size : {1U, 2U, 31U})
    list.push_back({k,
                    size == 1   ? "layers of 1 x 1"
                    : size == 2 ? "layers of 2 x 2"
                                : "layers of 31 x 31",
                    "finite", [=](Trial& trial) {
                      const auto r = changed(trial, [=](Scene&, Settings& s) {
                        s.gather = Gather::layers;
                        s.layer_size = size;
                      });
                      return not_black(r);
                    }});
  list.push_back({k, "rendered twice", "the same bits", changes_nothing([](Scene&, Settings&) {})});
  list.push_back({k, "two renderers at once", "the same bits", [](Trial& trial) {
                    const auto render = [&] { return changed(trial, [](Scene&, Settings&) {}).image; };
                    auto other = std::async(std::launch::async, render);
                    const Finding mine = same_bits(render(), trial.ordinary().image);
                    return both(mine, same_bits(other.get(), trial.ordinary().image));
                  }});
  list.push_back({k, "memory too small", "refused, with both sizes", [](Trial& trial) {
                    DeviceInfo small = trial.device();
                    small.global_memory = 1 << 20;
                    Settings settings = ordinary_settings();
                    settings.force = false;
                    return refused([&] { (void)make_plan(ordinary_scene(), settings, small); },
                                   {"MiB", "the device has 1 MiB", "--layer-size"});
                  }});
  list.push_back({k, "buffers too small", "refused, with both sizes", [](Trial& trial) {
                    DeviceInfo small = trial.device();
                    small.max_allocation = 1 << 16;
                    Settings settings = ordinary_settings();
                    settings.force = false;
                    return refused([&] { (void)make_plan(ordinary_scene(), settings, small); },
                                   {"MiB", "per buffer", "--layer-size"});
                  }});
  list.push_back({k, "layers of 65535 x 65535", "refused, even by force",
                  refuses(
                      [](Scene&, Settings& s) {
                        s.gather = Gather::layers;
                        s.layer_size = 65535;
                      },
                      {"--layer-size"})});
  list.push_back(
      {k, "2^32 samples", "refused", refuses([](Scene&, Settings& s) { s.frames = 1U << 31; }, {"--frames"})});
}

}  // namespace

const std::vector<ExtremeCase>& extreme_cases() {
  static const std::vector<ExtremeCase> list = [] {
    std::vector<ExtremeCase> cases;
    add_extreme_media(cases);
    add_geometric(cases);
    add_lighting(cases);
    add_camera(cases);
    add_resource(cases);
    return cases;
  }();
  return list;
}

}  // namespace parian
