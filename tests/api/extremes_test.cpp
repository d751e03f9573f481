// Values that are allowed and hardly sensible: each is refused with a reason, or gives finite pictures.
#include <algorithm>

#include "small_scene.hpp"

namespace parian::test {
namespace {

/// A picture of finite values, none negative, or an INVALID_SCENE somewhere on the way.
void finite_or_refused(parian_renderer* r, parian_status so_far, const std::string& what, std::size_t pixels = 0) {
  auto image = sized<parian_image>();
  const std::size_t count = pixels > 0 ? pixels : Pixels::count;
  const cl::Buffer buffer = opencl().buffer(16 * count);
  image.buffer = buffer();
  image.positions = 3;
  cl_event done = nullptr;
  parian_status s = so_far;
  if (s == PARIAN_SUCCESS) s = parian_frame(r, nullptr, 0, nullptr, nullptr);
  if (s == PARIAN_NOT_PLANNED) s = parian_plan(r, nullptr);
  if (s == PARIAN_SUCCESS) s = parian_frame(r, nullptr, 0, nullptr, nullptr);
  if (s == PARIAN_SUCCESS) s = parian_gather(r, nullptr, 0, &image, 0, nullptr, &done);
  EXPECT_TRUE(s == PARIAN_SUCCESS || s == PARIAN_INVALID_SCENE) << what << ": " << s << ", " << parian_message();
  if (s != PARIAN_SUCCESS) return;
  Rgba rgba(4 * count);
  const std::vector<cl::Event> wait{cl::Event(done)};
  opencl().queue.enqueueReadBuffer(buffer, CL_TRUE, 0, 16 * count, rgba.data(), &wait);
  const auto bad = std::count_if(rgba.begin(), rgba.end(), [](float v) { return !(std::isfinite(v) && v >= 0.0F); });
  EXPECT_EQ(bad, 0) << what;
}

/// All warnings of a plan of the scene, one after the other.
std::string warnings_of(const SmallScene& scene, const parian_mesh& mesh) {
  const Handle r = create();
  auto statistics = sized<parian_statistics>();
  parian_status s = parian_set_mesh(r.get(), &mesh);
  if (s == PARIAN_SUCCESS) s = scene.describe(r.get());
  if (s == PARIAN_SUCCESS) s = parian_plan(r.get(), nullptr);
  if (s == PARIAN_SUCCESS) s = parian_get_statistics(r.get(), &statistics);
  EXPECT_EQ(s, PARIAN_SUCCESS) << parian_message();
  std::string all;
  for (std::size_t i = 0; i < statistics.n_warnings; ++i) {
    const char* text = nullptr;
    EXPECT_EQ(parian_get_warning(r.get(), i, &text), PARIAN_SUCCESS);
    all += std::string(text) + '\n';
  }
  return all;
}

TEST(Extremes, MeshesThatLookOtherwiseThanMeantAreWarnedOf) {
  SmallScene scene;
  EXPECT_NE(warnings_of(scene, scene.mesh()).find("coarse mesh: "), std::string::npos);
  std::vector<double> far(scene.positions.begin(), scene.positions.end());
  for (double& x : far) x += 5400000.0;
  parian_mesh doubles = scene.mesh();
  doubles.positions = nullptr;
  doubles.positions_double = far.data();
  EXPECT_EQ(warnings_of(scene, doubles).find("in steps of"), std::string::npos);
  for (float& x : scene.positions) x += 5400000.0F;
  EXPECT_NE(warnings_of(scene, scene.mesh()).find("comes in steps of 0.5"), std::string::npos);
}

TEST(Extremes, Cameras) {
  const SmallScene scene;
  const Handle r = create();
  CALL(scene.give(r.get()));
  CALL(parian_plan(r.get(), nullptr));
  const auto camera = [](std::array<double, 3> eye, std::array<double, 3> target, std::array<double, 3> up,
                         double fov) {
    auto c = sized<parian_camera>();
    std::copy(eye.begin(), eye.end(), c.eye);
    std::copy(target.begin(), target.end(), c.target);
    std::copy(up.begin(), up.end(), c.up);
    c.fov = fov;
    return c;
  };
  const parian_camera cameras[] = {
      camera({0, 0, 200}, {0, 0, 400}, {0, 1, 0}, 30),         // looks away
      camera({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 90),             // in the middle
      camera({30, 0, 0}, {30, 0, 1}, {0, 1, 0}, 179.999999),   // inside, and sees everything before it
      camera({42, 0, 0}, {0, 0, 0}, {0, 1, 0}, 60),            // on the surface
      camera({0, 0, 200}, {0, 0, 0}, {0, 0, 1}, 30),           // up is forwards
      camera({0, 0, 200}, {0, 0, 0}, {0, 0, 0}, 30),           // no up
      camera({0, 0, 200}, {0, 0, 0}, {0, 1e-300, 0}, 30),      //
      camera({0, 0, 200}, {0, 0, 0}, {0, 1e300, 0}, 30),       //
      camera({0, 0, 200}, {0, 0, 0}, {0, 1, 0}, 1e-300),       //
      camera({0, 0, 200}, {0, 0, 0}, {0, 1, 0}, 1e-9),         //
      camera({0, 0, 1e9}, {0, 0, 0}, {0, 1, 0}, 1e-6),         //
      camera({0, 0, 1e30}, {0, 0, 0}, {0, 1, 0}, 30),          //
      camera({0, 0, 1e300}, {0, 0, 0}, {0, 1, 0}, 30),         //
      camera({0, 0, 200}, {0, 0, 200 - 1e-13}, {0, 1, 0}, 30)  //
  };
  int i = 0;
  for (const parian_camera& c : cameras) {
    finite_or_refused(r.get(), parian_set_cameras(r.get(), 1, &c, SmallScene::width, SmallScene::height),
                      "camera " + std::to_string(i));
    ++i;
  }
  const std::pair<std::uint32_t, std::uint32_t> films[] = {{1, 1}, {1, 16384}, {16384, 1}, {3, 2049}, {2049, 5}};
  for (const auto& [width, height] : films)
    finite_or_refused(r.get(), parian_set_cameras(r.get(), 1, &scene.camera, width, height),
                      "film " + std::to_string(width), std::size_t{width} * height);
}

TEST(Extremes, Lights) {
  const SmallScene scene;
  const Handle r = create();
  CALL(scene.give(r.get()));
  CALL(parian_plan(r.get(), nullptr));
  const std::array<double, 3> directions[] = {{0, 1, 0},         {0, -1, 0},   {1e-300, 0, 0},
                                              {1e300, 1e300, 0}, {1e-5, 1, 0}, {-1e308, 0, 1e308}};
  for (const double irradiance : {1e-40, 1.0, 1e30})
    for (const auto& d : directions) {
      const parian_light light = SmallScene::light(d, irradiance);
      finite_or_refused(r.get(), parian_set_lights(r.get(), 1, &light),
                        std::to_string(d[0]) + ", " + std::to_string(irradiance));
    }
  const std::vector<parian_light> many(40, scene.lights.front());
  finite_or_refused(r.get(), parian_set_lights(r.get(), many.size(), many.data()), "many");
}

TEST(Extremes, Sizes) {
  for (const double scale : {1e-300, 1e-40, 1e-30, 1e-9, 1e9, 1e30, 1e38, 1e300}) {
    const SmallScene scene;
    SmallScene sized_scene = scene;
    std::vector<double> positions(scene.positions.begin(), scene.positions.end());
    for (double& x : positions) x *= scale;
    for (double& x : sized_scene.camera.eye) x *= scale;
    parian_mesh mesh = scene.mesh();
    mesh.positions = nullptr;
    mesh.positions_double = positions.data();
    const Handle r = create();
    const parian_status described = sized_scene.describe(r.get());
    EXPECT_TRUE(described == PARIAN_SUCCESS || described == PARIAN_INVALID_SCENE) << parian_message();
    if (described != PARIAN_SUCCESS) continue;
    finite_or_refused(r.get(), parian_set_mesh(r.get(), &mesh), "on the host, " + std::to_string(scale));
    for (std::size_t i = 0; i < positions.size(); ++i) sized_scene.positions[i] = static_cast<float>(positions[i]);
    const cl::Buffer vertices = opencl().buffer(sized_scene.positions), triangles = opencl().buffer(scene.indices);
    parian_mesh in_buffers = SmallScene::mesh(scene, vertices, triangles);
    in_buffers.radius *= scale;
    finite_or_refused(r.get(), parian_set_mesh(r.get(), &in_buffers), "in buffers, " + std::to_string(scale));
  }
  // A sphere that has little to do with the mesh.
  const SmallScene scene;
  const cl::Buffer vertices = opencl().buffer(scene.positions), triangles = opencl().buffer(scene.indices);
  for (const double radius : {1e-9, 1.0, 30.0, 1e4, 1e12}) {
    parian_mesh mesh = SmallScene::mesh(scene, vertices, triangles);
    mesh.radius = radius;
    mesh.centre[0] = 10.0;
    const Handle r = create();
    CALL(scene.describe(r.get()));
    finite_or_refused(r.get(), parian_set_mesh(r.get(), &mesh), "radius " + std::to_string(radius));
  }
}

TEST(Extremes, Settings) {
  const std::pair<std::uint32_t, std::uint32_t> sizes[] = {{1, 1}, {2, 1}, {1, 7}, {5, 3}};
  for (const auto& [layer, map] : sizes) {
    SmallScene scene;
    scene.settings.layers = layer;
    scene.settings.layer_size = map;
    scene.settings.light_map_size = layer;
    scene.settings.samples = 2;
    const Handle r = create();
    CALL(scene.describe(r.get()));
    const parian_mesh mesh = scene.mesh();
    finite_or_refused(r.get(), parian_set_mesh(r.get(), &mesh), "layers " + std::to_string(layer));
  }
  SmallScene scene;
  const Handle r = create();
  CALL(scene.give(r.get()));
  scene.settings.layers = 1024;
  scene.settings.layer_size = 16384;
  CALL(parian_set_settings(r.get(), &scene.settings));
  EXPECT_EQ(parian_plan(r.get(), nullptr), PARIAN_OUT_OF_MEMORY) << parian_message();
  // In the names of parian_settings, not in those of the command line.
  EXPECT_NE(std::string(parian_message()).find("; lower layer_size, layers or light_map_size"), std::string::npos)
      << parian_message();
}

}  // namespace
}  // namespace parian::test
