// The C API given scenes that can't be rendered, or asked for what isn't planned yet.
#include "refusals.hpp"

#include <algorithm>

namespace parian::test {
namespace {

/// Meshes that a renderer is given one after the other.
class ArgumentsMeshes : public Arguments {
 protected:
  void mesh_refused(const parian_mesh& mesh, const std::vector<std::string>& words,
                    parian_status status = PARIAN_INVALID_ARGUMENT) {
    refused(parian_set_mesh(r.get(), &mesh), status, words);
  }
};

TEST_F(ArgumentsMeshes, LackParts) {
  parian_mesh mesh = scene.mesh();
  mesh.positions = nullptr;
  mesh_refused(mesh, {"positions"});
  mesh = scene.mesh();
  const std::vector<double> twice(3);
  mesh.positions_double = twice.data();
  mesh_refused(mesh, {"positions"});
  mesh = scene.mesh();
  mesh.indices = nullptr;
  mesh_refused(mesh, {"indices"});
  mesh = scene.mesh();
  mesh.n_triangles = 0;
  mesh_refused(mesh, {"0 triangles"}, PARIAN_INVALID_SCENE);
  mesh = scene.mesh();
  mesh.n_positions = 0;
  mesh_refused(mesh, {"0 positions"}, PARIAN_INVALID_SCENE);
  mesh = scene.mesh();
  mesh.position_stride = 8;
  mesh_refused(mesh, {"position_stride", "8", "12"});
  for (const int kind : {-1, 3, 1 << 30}) {
    mesh = scene.mesh();
    std::memcpy(&mesh.normals_kind, &kind, sizeof kind);
    mesh_refused(mesh, {"normals_kind"});
  }
}

TEST_F(ArgumentsMeshes, HaveBadNumbers) {
  parian_mesh mesh = scene.mesh();
  mesh.normals_kind = PARIAN_NORMALS_PER_VERTEX;
  mesh_refused(mesh, {"normals"});
  std::vector<float> normals(scene.positions.size(), 0.57735F);
  mesh.normals = normals.data();
  for (const double bad : {nan, infinity, 0.0, 1e30}) {
    std::fill_n(normals.begin() + 9, 3, static_cast<float>(bad));
    mesh_refused(mesh, {"normal"}, PARIAN_INVALID_SCENE);
  }
  // Indices and coordinates, with normals and without.
  std::fill(normals.begin(), normals.end(), 0.57735F);
  for (const parian_normals kind : {PARIAN_NORMALS_NONE, PARIAN_NORMALS_PER_VERTEX}) {
    mesh.normals_kind = kind;
    SmallScene bad = scene;
    bad.indices[37] = mesh.n_positions;
    mesh.indices = bad.indices.data();
    mesh_refused(mesh, {std::to_string(mesh.n_positions)}, PARIAN_INVALID_SCENE);
    mesh.indices = scene.indices.data();
    mesh.positions = bad.positions.data();
    for (const double value : {nan, infinity, -infinity}) {
      bad.positions[31] = static_cast<float>(value);
      mesh_refused(mesh, {"vertex 10", "finite"}, PARIAN_INVALID_SCENE);
    }
    mesh.positions = scene.positions.data();
  }
  // Points without a triangle between them.
  const std::vector<std::uint32_t> none(6, 5);
  mesh = scene.mesh();
  mesh.indices = none.data();
  mesh.n_triangles = 2;
  mesh_refused(mesh, {"triangle"}, PARIAN_INVALID_SCENE);
}

TEST_F(Arguments, MeshesInBuffers) {
  const cl::Buffer vertices = opencl().buffer(scene.positions), triangles = opencl().buffer(scene.indices);
  const parian_mesh good = SmallScene::mesh(scene, vertices, triangles);
  const auto mesh_refused = [&](const parian_mesh& mesh, const std::vector<std::string>& words) {
    refused(parian_set_mesh(r.get(), &mesh), PARIAN_INVALID_ARGUMENT, words);
  };
  const std::string bytes = std::to_string(scene.positions.size() * 4);
  parian_mesh mesh = good;
  mesh.index_buffer = nullptr;
  mesh_refused(mesh, {"NULL"});
  mesh = good;
  mesh.position_buffer = nullptr;
  mesh_refused(mesh, {"NULL"});
  mesh = good;
  mesh.positions = scene.positions.data();
  mesh_refused(mesh, {"both"});
  mesh = good;
  mesh.position_offset = 4;
  mesh_refused(mesh, {"position_buffer", bytes, std::to_string(scene.positions.size() * 4 + 4)});
  mesh.position_offset = 2;
  mesh_refused(mesh, {"position_offset"});
  mesh.position_offset = ~std::size_t{0} - 3;
  mesh_refused(mesh, {"position_offset"});
  mesh = good;
  mesh.position_stride = 8;
  mesh_refused(mesh, {"position_stride"});
  mesh.position_stride = 14;
  mesh_refused(mesh, {"position_stride"});
  mesh = good;
  mesh.n_positions = (1U << 31) + 1;  // whose bytes are 12 modulo 2^64
  mesh.position_stride = std::size_t{1} << 33;
  mesh_refused(mesh, {"position_buffer", bytes});
  mesh = good;
  mesh.index_offset = 4;
  mesh_refused(
      mesh, {"index_buffer", std::to_string(scene.indices.size() * 4), std::to_string(scene.indices.size() * 4 + 4)});
  mesh = good;
  mesh.n_triangles = 0xffffffff;
  mesh_refused(mesh, {"index_buffer"});
  for (const double radius : {-1.0, nan, infinity}) {
    mesh = good;
    mesh.radius = radius;
    refused(parian_set_mesh(r.get(), &mesh), PARIAN_INVALID_SCENE, {"radius"});
  }
  mesh = good;
  mesh.centre[1] = nan;
  refused(parian_set_mesh(r.get(), &mesh), PARIAN_INVALID_SCENE, {"centre"});
}

TEST_F(Arguments, Settings) {
  const auto settings_refused = [&](auto&& change, const std::vector<std::string>& words) {
    parian_settings s = scene.settings;
    change(s);
    refused(parian_set_settings(r.get(), &s), PARIAN_INVALID_ARGUMENT, words);
  };
  using S = parian_settings;
  settings_refused([](S& s) { s.error = nan; }, {"error"});
  settings_refused([](S& s) { s.error = -1e-3; }, {"error"});
  settings_refused([](S& s) { s.error = infinity; }, {"error"});
  settings_refused([](S& s) { s.disc_radius = nan; }, {"disc_radius"});
  settings_refused([](S& s) { s.disc_radius = -1.0; }, {"disc_radius"});
  settings_refused([](S& s) { s.disc_radius = 1e10; }, {"disc_radius"});
  settings_refused([](S& s) { s.layers = 1025; }, {"settings: layers is 1025; give a whole number from 1 to 1024"});
  for (const std::uint32_t value : {0U, 0x80000000U, 0xffffffffU}) {
    settings_refused([&](S& s) { s.layers = value; }, {"layers", std::to_string(value)});
    settings_refused([&](S& s) { s.layer_size = value; }, {"layer_size"});
    settings_refused([&](S& s) { s.light_map_size = value; }, {"light_map_size"});
    settings_refused([&](S& s) { s.samples = value; }, {"samples"});
  }
  settings_refused([](S& s) { s.samples = 5; }, {"samples", "even"});
  settings_refused([](S& s) { s.frames = 0; }, {"frames"});
  settings_refused([](S& s) { s.frames = 0xffffffff; }, {"frames", "samples", "2^32"});
  settings_refused([](S& s) { s.keep = "pyramids,nothing-of-that-name"; }, {"keep nothing-of-that-name: "});
  settings_refused([](S& s) { s.model = static_cast<parian_model>(3); }, {"model"});
  settings_refused([](S& s) { s.estimator = static_cast<parian_estimator>(3); }, {"estimator"});
  settings_refused([](S& s) { s.views = static_cast<parian_views>(3); }, {"views"});
  settings_refused([](S& s) { s.views = PARIAN_CAMERA; }, {"fixed_cameras"});
}

TEST_F(Arguments, MaterialsLightsAndCameras) {
  const auto material_refused = [&](auto&& change, const char* word) {
    parian_material m = scene.material;
    change(m);
    refused(parian_set_material(r.get(), &m), PARIAN_INVALID_SCENE, {word});
  };
  using M = parian_material;
  for (const double bad : {nan, infinity, -infinity, -1.0}) {
    material_refused([&](M& m) { m.sigma_s[1] = bad; }, "sigma_s");
    material_refused([&](M& m) { m.sigma_a[2] = bad; }, "sigma_a");
    material_refused([&](M& m) { m.ior = bad; }, "ior");
  }
  for (const double bad : {nan, 1.5, -1.5}) material_refused([&](M& m) { m.g[0] = bad; }, "g");
  for (const double bad : {0.0, -1.5, 100.5}) material_refused([&](M& m) { m.ior = bad; }, "ior");

  for (const double bad : {nan, infinity, -1.0, 1e31}) {
    parian_light light = scene.lights.front();
    light.irradiance[1] = bad;
    refused(parian_set_lights(r.get(), 1, &light), PARIAN_INVALID_SCENE, {"light 1", "irradiance"});
  }
  for (const double bad : {nan, infinity, 0.0, 1e200}) {
    parian_light light = scene.lights.front();
    for (double& x : light.towards) x = bad;
    refused(parian_set_lights(r.get(), 1, &light), PARIAN_INVALID_SCENE, {"light 1", "towards"});
  }

  const auto camera_refused = [&](const parian_camera& c, std::uint32_t width = 8, std::uint32_t height = 8) {
    refused(parian_set_cameras(r.get(), 1, &c, width, height), PARIAN_INVALID_SCENE, {});
  };
  for (const double bad : {nan, infinity, -infinity}) {
    parian_camera c = scene.camera;
    c.eye[0] = bad;
    camera_refused(c);
    c = scene.camera;
    c.target[1] = bad;
    camera_refused(c);
    c = scene.camera;
    c.up[2] = bad;
    camera_refused(c);
  }
  for (const double bad : {nan, infinity, 0.0, -1.0, 180.0}) {
    parian_camera c = scene.camera;
    c.fov = bad;
    camera_refused(c);
  }
  parian_camera c = scene.camera;
  std::copy_n(c.eye, 3, c.target);
  camera_refused(c);
  for (const std::uint32_t side : {0U, 16385U, 0xffffffffU}) {
    camera_refused(scene.camera, side, 8);
    camera_refused(scene.camera, 8, side);
  }
  refused(parian_set_cameras(r.get(), 0, &scene.camera, 8, 8), PARIAN_INVALID_ARGUMENT, {"cameras"});
}

TEST(Unplanned, IsRefused) {
  const auto unplanned = [](parian_status status, const char* word) { refused(status, PARIAN_NOT_PLANNED, {word}); };
  const Handle r = create();
  const SmallScene scene;
  const Pixels pixels;
  const parian_image image = pixels.image();
  const parian_mesh mesh = scene.mesh();
  Rgba rgba(Pixels::count * 4);
  double relmse = 0.0;
  std::size_t bytes = 0;
  const auto all_refused = [&](const char* word) {
    unplanned(parian_frame(r.get(), nullptr, 0, nullptr, nullptr), word);
    unplanned(parian_estimate(r.get(), nullptr, &relmse), word);
  };
  all_refused("plan");
  for (int i = 0; i < 4; ++i) {
    static constexpr const char* missing[] = {"parian_set_mesh", "parian_set_material", "parian_set_lights",
                                              "parian_set_cameras"};
    unplanned(parian_plan(r.get(), nullptr), missing[i]);
    unplanned(parian_scratch_size(r.get(), &bytes), missing[i]);
    const parian_status given =
        i == 0   ? parian_set_mesh(r.get(), &mesh)
        : i == 1 ? parian_set_material(r.get(), &scene.material)
        : i == 2 ? parian_set_lights(r.get(), 1, scene.lights.data())
                 : parian_set_cameras(r.get(), 1, &scene.camera, SmallScene::width, SmallScene::height);
    ASSERT_EQ(given, PARIAN_SUCCESS);
  }
  CALL(parian_set_settings(r.get(), &scene.settings));
  all_refused("plan");
  std::uint32_t due = 1;
  CALL(parian_estimate_due(r.get(), &due));
  EXPECT_EQ(due, 0U);
  auto statistics = sized<parian_statistics>();
  CALL(parian_get_statistics(r.get(), &statistics));
  EXPECT_EQ(statistics.frames, 0U);
  CALL(parian_plan(r.get(), nullptr));
  // Planned, but without a frame. The event of a call that is refused is never waited for.
  const cl::UserEvent never(opencl().context);
  const cl_event wait = never();
  unplanned(parian_gather(r.get(), nullptr, 0, &image, 1, &wait, nullptr), "parian_frame");
  unplanned(parian_read(r.get(), nullptr, 0, rgba.data(), nullptr), "parian_frame");
  EXPECT_EQ(read_after(r.get(), 2), right_image());
  // Whatever needs a new plan.
  CALL(parian_set_material(r.get(), &scene.material));
  all_refused("parian_plan");
  CALL(parian_plan(r.get(), nullptr));
  EXPECT_EQ(read_after(r.get(), 2), right_image());
}

TEST(Unplanned, MeshForOnePlan) {
  const Handle r = create();
  const SmallScene scene;
  parian_mesh mesh = scene.mesh();
  mesh.for_one_plan = 1;
  std::size_t bytes = 0;
  CALL(parian_set_mesh(r.get(), &mesh));
  CALL(scene.describe(r.get()));
  CALL(parian_scratch_size(r.get(), &bytes));
  CALL(parian_plan(r.get(), nullptr));
  EXPECT_EQ(read_after(r.get(), 2), right_image());
  refused(parian_scratch_size(r.get(), &bytes), PARIAN_NOT_PLANNED, {"parian_set_mesh"});
  refused(parian_plan(r.get(), nullptr), PARIAN_NOT_PLANNED, {"parian_set_mesh"});
  EXPECT_EQ(read_after(r.get(), 0), right_image()) << "a refused plan undid the one before";
  CALL(parian_set_mesh(r.get(), &mesh));
  CALL(parian_plan(r.get(), nullptr));
  EXPECT_EQ(read_after(r.get(), 2), right_image());
}

}  // namespace
}  // namespace parian::test
