// The C API given what it can't use: each call refuses before anything is enqueued, says what is wrong, and leaves the
// renderer as it was.
#include <limits>

#include "opencl_watch.hpp"
#include "small_scene.hpp"

namespace parian::test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();

/// Expects a status and words in its message.
void refused(parian_status status, parian_status expected, const std::vector<std::string>& words) {
  EXPECT_EQ(status, expected) << parian_message();
  const std::string message = parian_message();
  EXPECT_EQ(message.find('\n'), std::string::npos);
  for (const std::string& word : words) EXPECT_NE(message.find(word), std::string::npos) << message;
}

/// A renderer with a plan and a frame, and the same image at the end as at the start.
class Arguments : public testing::Test {
 protected:
  void SetUp() override {
    CALL(scene.give(r.get()));
    CALL(parian_plan(r.get(), nullptr));
    CALL(parian_frame(r.get(), nullptr, 0, nullptr, nullptr));
    before = gathered(r.get());
    expect_picture(before);
  }
  void TearDown() override { EXPECT_EQ(gathered(r.get()), before) << "a refused call changed something"; }

  parian_status gather(const parian_image& image, cl_command_queue queue = nullptr, cl_uint n = 0,
                       const cl_event* wait = nullptr) {
    return parian_gather(r.get(), queue, 0, &image, n, wait, nullptr);
  }

  SmallScene scene;
  Handle r = create();
  Pixels pixels;
  Rgba before;
};

TEST_F(Arguments, Null) {
  const auto is_null = [](parian_status status) { refused(status, PARIAN_INVALID_ARGUMENT, {"NULL"}); };
  const parian_create_info info = in_context();
  parian_renderer* made = nullptr;
  const parian_image image = pixels.image();
  double relmse = 0.0;
  Rgba rgba(Pixels::count * 4);
  const parian_mesh mesh = scene.mesh();
  is_null(parian_create(nullptr, &made));
  is_null(parian_create(&info, nullptr));
  parian_release(nullptr);
  // Without a renderer.
  is_null(parian_get_opencl(nullptr, nullptr, nullptr));
  is_null(parian_get_device(nullptr, nullptr));
  is_null(parian_set_settings(nullptr, &scene.settings));
  is_null(parian_set_mesh(nullptr, &mesh));
  is_null(parian_set_material(nullptr, &scene.material));
  is_null(parian_set_lights(nullptr, 1, scene.lights.data()));
  is_null(parian_set_cameras(nullptr, 1, &scene.camera, 8, 8));
  is_null(parian_positions_changed(nullptr));
  is_null(parian_restart(nullptr));
  is_null(parian_scratch_size(nullptr, nullptr));
  is_null(parian_set_scratch(nullptr, nullptr));
  is_null(parian_plan(nullptr, nullptr));
  is_null(parian_frame(nullptr, nullptr, 0, nullptr, nullptr));
  is_null(parian_gather(nullptr, nullptr, 0, &image, 0, nullptr, nullptr));
  is_null(parian_estimate_due(nullptr, nullptr));
  is_null(parian_estimate(nullptr, nullptr, &relmse));
  is_null(parian_read(nullptr, nullptr, 0, rgba.data(), nullptr));
  is_null(parian_get_statistics(nullptr, nullptr));
  is_null(parian_get_omission(nullptr, 0, nullptr));
  is_null(parian_get_warning(nullptr, 0, nullptr));
  is_null(parian_get_explanation(nullptr, 0, nullptr));
  // Without what the renderer is to take or fill.
  is_null(parian_get_device(r.get(), nullptr));
  is_null(parian_default_settings(nullptr));
  is_null(parian_set_settings(r.get(), nullptr));
  is_null(parian_set_mesh(r.get(), nullptr));
  is_null(parian_set_material(r.get(), nullptr));
  is_null(parian_set_lights(r.get(), 1, nullptr));
  refused(parian_set_cameras(r.get(), 1, nullptr, 8, 8), PARIAN_INVALID_ARGUMENT, {"cameras"});
  is_null(parian_scratch_size(r.get(), nullptr));
  is_null(parian_gather(r.get(), nullptr, 0, nullptr, 0, nullptr, nullptr));
  is_null(gather(sized<parian_image>()));
  is_null(parian_estimate_due(r.get(), nullptr));
  is_null(parian_read(r.get(), nullptr, 0, nullptr, nullptr));
  is_null(parian_get_statistics(r.get(), nullptr));
  auto statistics = sized<parian_statistics>();
  CALL(parian_get_statistics(r.get(), &statistics));
  ASSERT_GT(statistics.n_explanations, 0U);
  is_null(parian_get_explanation(r.get(), 0, nullptr));
  auto omission = sized<parian_omission>();
  const char* text = nullptr;
  refused(parian_get_omission(r.get(), statistics.n_omissions, &omission), PARIAN_INVALID_ARGUMENT, {"omission"});
  refused(parian_get_warning(r.get(), statistics.n_warnings, &text), PARIAN_INVALID_ARGUMENT, {"warning"});
  refused(parian_get_explanation(r.get(), ~std::size_t{0}, &text), PARIAN_INVALID_ARGUMENT, {"explanation"});
  // What may be.
  CALL(parian_get_opencl(r.get(), nullptr, nullptr));
  CALL(parian_restart(r.get()));
  CALL(parian_frame(r.get(), nullptr, 0, nullptr, nullptr));
}

TEST_F(Arguments, StructSizes) {
  struct Newer {
    parian_material known;
    std::array<double, 4> unknown{};
  } newer{scene.material, {}};
  const auto set = [&](std::size_t size) {
    newer.known.struct_size = size;
    return parian_set_material(r.get(), &newer.known);
  };
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, sizeof(std::size_t), ~std::size_t{0},
                                 ~std::size_t{0} / 2, std::size_t{1} << 32})
    refused(set(size), PARIAN_INVALID_ARGUMENT, {"material", "struct_size"});
  newer.unknown[2] = 1.0;
  refused(set(sizeof newer), PARIAN_INVALID_ARGUMENT, {"material", "newer"});
  // A renderer of its own for what is accepted and needs a new plan.
  const Handle other = create();
  newer.unknown[2] = 0.0;
  newer.known.struct_size = sizeof newer;
  EXPECT_EQ(parian_set_material(other.get(), &newer.known), PARIAN_SUCCESS) << parian_message();
  newer.known.struct_size = offsetof(parian_material, name);  // before there were names
  EXPECT_EQ(parian_set_material(other.get(), &newer.known), PARIAN_SUCCESS) << parian_message();
  newer.known.struct_size = offsetof(parian_material, ior);  // an index of 0 then, which can't be
  refused(parian_set_material(other.get(), &newer.known), PARIAN_INVALID_SCENE, {"ior"});

  // In arrays the size is the step.
  struct NewerLight {
    parian_light known;
    double unknown = 0.0;
  };
  std::vector<NewerLight> lights(2);
  for (NewerLight& l : lights) l.known = scene.lights.front(), l.known.struct_size = sizeof l;
  EXPECT_EQ(parian_set_lights(other.get(), 2, &lights[0].known), PARIAN_SUCCESS) << parian_message();
  lights[1].known.struct_size = 0;
  refused(parian_set_lights(other.get(), 2, &lights[0].known), PARIAN_INVALID_ARGUMENT, {"light", "struct_size"});

  // What is filled in stops at the size that the caller knows.
  std::vector<unsigned char> bytes(sizeof(parian_statistics) + 64, 0xab);
  auto* statistics = reinterpret_cast<parian_statistics*>(bytes.data());
  statistics->struct_size = offsetof(parian_statistics, layers_covered);
  CALL(parian_get_statistics(r.get(), statistics));
  EXPECT_EQ(statistics->frames, 1U);
  EXPECT_EQ(statistics->struct_size, offsetof(parian_statistics, layers_covered));
  for (std::size_t i = statistics->struct_size; i < bytes.size(); ++i) ASSERT_EQ(bytes[i], 0xab) << i;
  statistics->struct_size = bytes.size();
  CALL(parian_get_statistics(r.get(), statistics));
  for (std::size_t i = sizeof(parian_statistics); i < bytes.size(); ++i) ASSERT_EQ(bytes[i], 0xab) << i;
  statistics->struct_size = 0;
  refused(parian_get_statistics(r.get(), statistics), PARIAN_INVALID_ARGUMENT, {"statistics", "struct_size"});
}

TEST_F(Arguments, OtherContexts) {
  const auto& cl = opencl();
  const auto elsewhere = [](parian_status status, const char* what) {
    refused(status, PARIAN_INVALID_ARGUMENT, {what, "context"});
  };
  Rgba rgba(Pixels::count * 4);
  double relmse = 0.0;
  const parian_image image = pixels.image();
  const cl_command_queue queue = cl.other_queue();
  elsewhere(parian_plan(r.get(), queue), "queue");
  elsewhere(parian_frame(r.get(), queue, 0, nullptr, nullptr), "queue");
  elsewhere(gather(image, queue), "queue");
  elsewhere(parian_estimate(r.get(), queue, &relmse), "queue");
  elsewhere(parian_read(r.get(), queue, 0, rgba.data(), nullptr), "queue");

  const cl::UserEvent event(cl.other), ours(cl.context);
  const cl_event list[] = {ours(), event()}, with_null[] = {ours(), nullptr};
  elsewhere(parian_frame(r.get(), nullptr, 2, list, nullptr), "event");
  elsewhere(gather(image, nullptr, 2, list), "event");
  refused(parian_frame(r.get(), nullptr, 2, with_null, nullptr), PARIAN_INVALID_ARGUMENT, {"event 1", "NULL"});
  refused(parian_frame(r.get(), nullptr, 1, nullptr, nullptr), PARIAN_INVALID_ARGUMENT, {"wait list"});
  refused(parian_frame(r.get(), nullptr, 0, list, nullptr), PARIAN_INVALID_ARGUMENT, {"wait list"});

  const cl::Buffer foreign(cl.other, CL_MEM_READ_WRITE, 1 << 20), here = cl.buffer(1 << 20);
  parian_image into_foreign = image;
  into_foreign.buffer = foreign();
  elsewhere(gather(into_foreign), "image");
  elsewhere(parian_set_scratch(r.get(), foreign()), "scratch");
  parian_mesh mesh = SmallScene::mesh(scene, foreign, here);
  elsewhere(parian_set_mesh(r.get(), &mesh), "position_buffer");
  mesh = SmallScene::mesh(scene, here, foreign);
  elsewhere(parian_set_mesh(r.get(), &mesh), "index_buffer");
}

TEST_F(Arguments, Images) {
  const auto image_refused = [&](const parian_image& image, const std::vector<std::string>& words) {
    refused(gather(image), PARIAN_INVALID_ARGUMENT, words);
  };
  const cl::Buffer exact = opencl().buffer(64 + Pixels::bytes), constant(opencl().context, CL_MEM_READ_ONLY, 1 << 16);
  parian_image image = pixels.image();
  image.buffer = exact();
  image.offset = 64;
  CALL(gather(image));
  image.offset = 80;
  image_refused(image, {"image", std::to_string(64 + Pixels::bytes), std::to_string(80 + Pixels::bytes)});
  for (const std::size_t offset : {~std::size_t{0} - 15, std::size_t{1} << 63, std::size_t{1} << 52}) {
    image.offset = offset;
    image_refused(image, {"image", std::to_string(64 + Pixels::bytes)});
  }
  image.offset = 8;
  image_refused(image, {"offset"});
  image.offset = 0;
  constexpr std::size_t row = std::size_t{16} * SmallScene::width;
  image.row_pitch = row - 16;
  image_refused(image, {"row_pitch", std::to_string(row - 16), std::to_string(row)});
  image.row_pitch = row + 8;
  image_refused(image, {"row_pitch"});
  for (int bits = 16; bits < 64; ++bits) {  // products that wrap around
    image.row_pitch = std::size_t{1} << bits;
    image_refused(image, {"image"});
    image.row_pitch = ~std::size_t{0} - (std::size_t{1} << (bits - 12)) * 16 + 1;
    image_refused(image, {"image"});
  }
  image = pixels.image(65);
  image_refused(image, {"65"});
  image = pixels.image();
  for (const double stops : {nan, infinity, -infinity, 128.0, -101.0}) {
    image.exposure = static_cast<float>(stops);
    image_refused(image, {"exposure"});
  }
  image = pixels.image();
  image.buffer = constant();
  image_refused(image, {"image", "write"});
  const parian_image good = pixels.image();
  refused(parian_gather(r.get(), nullptr, 1, &good, 0, nullptr, nullptr), PARIAN_INVALID_ARGUMENT,
          {"camera", "1 of 1"});
  Rgba rgba(4);
  refused(parian_read(r.get(), nullptr, ~std::size_t{0}, rgba.data(), nullptr), PARIAN_INVALID_ARGUMENT, {"camera"});
}

TEST_F(Arguments, ImagesStayInTheirRows) {
  constexpr std::size_t pitch = 16 * (SmallScene::width + 3), offset = 5 * 16,
                        bytes = offset + SmallScene::height * pitch;
  const cl::Buffer wide = opencl().buffer(std::vector<float>(bytes / 4, -7.0F));
  parian_image image = pixels.image();
  image.buffer = wide();
  image.offset = offset;
  image.row_pitch = pitch;
  cl_event done = nullptr;
  CALL(parian_gather(r.get(), nullptr, 0, &image, 0, nullptr, &done));
  const std::vector<cl::Event> wait{cl::Event(done)};
  std::vector<float> all(bytes / 4);
  opencl().queue.enqueueReadBuffer(wide, CL_TRUE, 0, bytes, all.data(), &wait);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::size_t x = (i / 4 + pitch / 16 - offset / 16) % (pitch / 16),
                      y = (i / 4 + pitch / 16 - offset / 16) / (pitch / 16);
    const bool inside = y >= 1 && x < SmallScene::width;
    ASSERT_EQ(all[i], inside ? before[4 * ((y - 1) * SmallScene::width + x) + i % 4] : -7.0F) << i;
  }
}

TEST_F(Arguments, Meshes) {
  const auto mesh_refused = [&](const parian_mesh& mesh, const std::vector<std::string>& words,
                                parian_status status = PARIAN_INVALID_ARGUMENT) {
    refused(parian_set_mesh(r.get(), &mesh), status, words);
  };
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
  mesh = scene.mesh();
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
  for (const std::uint32_t value : {0U, 0x80000000U, 0xffffffffU}) {
    settings_refused([&](S& s) { s.layers = value; }, {"layers", std::to_string(value)});
    settings_refused([&](S& s) { s.layer_size = value; }, {"layer_size"});
    settings_refused([&](S& s) { s.light_map_size = value; }, {"light_map_size"});
    settings_refused([&](S& s) { s.samples = value; }, {"samples"});
  }
  settings_refused([](S& s) { s.samples = 5; }, {"samples", "even"});
  settings_refused([](S& s) { s.frames = 0; }, {"frames"});
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
  for (const double bad : {0.0, -1.5}) material_refused([&](M& m) { m.ior = bad; }, "ior");

  for (const double bad : {nan, infinity, -1.0, 1e31}) {
    parian_light light = scene.lights.front();
    light.irradiance[1] = bad;
    refused(parian_set_lights(r.get(), 1, &light), PARIAN_INVALID_SCENE, {"light 1", "irradiance"});
  }
  for (const double bad : {nan, infinity, 0.0}) {
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

TEST(ArgumentsOfCreate, ContextsAndDevices) {
  parian_renderer* made = nullptr;
  parian_create_info info = in_context();
  info.device = nullptr;
  refused(parian_create(&info, &made), PARIAN_INVALID_ARGUMENT, {"context", "device"});
  info = in_context();
  info.context = nullptr;
  refused(parian_create(&info, &made), PARIAN_INVALID_ARGUMENT, {"context", "device"});
  info = sized<parian_create_info>();
  info.selector = "no such device";
  refused(parian_create(&info, &made), PARIAN_DEVICE_FAILED, {"no such device"});
  info = sized<parian_create_info>();
  info.struct_size = 0;
  refused(parian_create(&info, &made), PARIAN_INVALID_ARGUMENT, {"struct_size"});
  EXPECT_EQ(made, nullptr);
}

TEST(ArgumentsOfCreate, OtherDevices) {
  const cl_device_partition_property each[] = {CL_DEVICE_PARTITION_EQUALLY, 1, 0};
  cl_uint n = 0;
  clCreateSubDevices(opencl().device(), each, 0, nullptr, &n);
  std::vector<cl_device_id> parts(n);
  if (n > 0 && clCreateSubDevices(opencl().device(), each, n, parts.data(), nullptr) == CL_SUCCESS) {
    parian_create_info info = in_context();
    info.device = parts[0];
    parian_renderer* made = nullptr;
    refused(parian_create(&info, &made), PARIAN_INVALID_ARGUMENT, {"device", "context"});
    for (const cl_device_id part : parts) clReleaseDevice(part);
  }
  // Contexts of two devices are rare: a queue says that it is of another.
  const Handle r = create();
  CALL(SmallScene().give(r.get()));
  int nothing = 0;
  OpenclWatch watch;
  watch.pretend_device_of_queues(reinterpret_cast<cl_device_id>(&nothing));
  refused(parian_plan(r.get(), opencl().queue()), PARIAN_INVALID_ARGUMENT, {"queue", "device"});
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
