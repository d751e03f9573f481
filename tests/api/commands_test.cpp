// What frames and gathers may not do, where buffers come from, and that the renderer behind the API gives the same.
#include <algorithm>

#include "frames.hpp"
#include "opencl_watch.hpp"
#include "render/renderer.hpp"

namespace parian::test {
namespace {

TEST(Commands, QueuesOfBothKindsGiveTheSameBits) {
  const SmallScene scene;
  const cl::CommandQueue profiled(opencl().context, opencl().device,
                                  CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE | CL_QUEUE_PROFILING_ENABLE);
  for (const cl_command_queue queue : {opencl().queue(), opencl().unordered(), profiled()}) {
    const Handle r = planned(scene, queue);
    EXPECT_EQ(read_after(r.get(), 2, queue), right_image());
  }
  const Handle r = planned(scene, opencl().unordered());
  frames(r.get(), 1, opencl().queue());
  frames(r.get(), 1, opencl().unordered());
  EXPECT_EQ(read_after(r.get(), 0, profiled()), right_image()) << "a queue for each call";
}

TEST(Commands, FramesAndGathersNeitherWaitNorRead) {
  SmallScene scene;
  scene.settings.samples = 64;  // light maps are shifted every other frame
  scene.lights.push_back(SmallScene::light({1, 0.2, 0.4}, 3.0));
  OnDevice mesh(scene, opencl().unordered());
  const Pixels pixels;
  OpenclWatch watch;
  // Nothing can be complete before the caller says so: a call that waited would never return.
  cl::UserEvent start(opencl().context);
  const cl_event wait = start();
  cl_event last = nullptr;
  for (int i = 0; i < 12; ++i) {
    cl_event framed = nullptr;
    CALL(parian_frame(mesh.r.get(), opencl().unordered(), i == 0 ? 1 : 0, i == 0 ? &wait : nullptr, &framed));
    const cl::Event frame(framed);
    EXPECT_EQ(watch.waits(), 0U) << "frame " << i;
    const parian_image image = pixels.image(i % 2 ? 64 : 1);
    if (last) clReleaseEvent(last);
    CALL(parian_gather(mesh.r.get(), opencl().unordered(), 0, &image, 1, &framed, &last));
    if (i == 3) {
      CALL(parian_positions_changed(mesh.r.get()));
    }
    if (i == 6) {
      scene.lights[0] = SmallScene::light({-0.7, 0.5, -0.3}, 3.0);
      CALL(parian_set_lights(mesh.r.get(), 2, scene.lights.data()));
    }
    if (i == 8) {
      scene.lights[1].irradiance[0] = 0.1;
      CALL(parian_set_lights(mesh.r.get(), 2, scene.lights.data()));
    }
    if (i == 9) {
      scene.camera.eye[0] = 30.0;
      CALL(parian_set_cameras(mesh.r.get(), 1, &scene.camera, SmallScene::width, SmallScene::height));
    }
  }
  EXPECT_EQ(watch.waits(), 0U);
  EXPECT_EQ(watch.bytes_to_host(), 0U);
  EXPECT_EQ(watch.calls("clFinish") + watch.calls("clWaitForEvents") + watch.calls("clEnqueueReadBuffer"), 0U);
  start.setStatus(CL_COMPLETE);
  expect_picture(pixels.read(last));
}

TEST(Commands, GeometryInBuffersIsNotCopiedThroughTheHost) {
  struct Bytes {
    std::uint64_t plan_from, plan_to, frame_from, frame_to;
    bool operator==(const Bytes&) const = default;
  };
  const auto bytes_of = [](std::uint32_t copies) {
    const SmallScene scene;
    SmallScene many = scene;
    for (std::uint32_t k = 1; k < copies; ++k) {
      many.positions.insert(many.positions.end(), scene.positions.begin(), scene.positions.end());
      for (const std::uint32_t i : scene.indices)
        many.indices.push_back(i + k * static_cast<std::uint32_t>(scene.positions.size() / 3));
    }
    const cl::Buffer vertices = opencl().buffer(many.positions), triangles = opencl().buffer(many.indices);
    const parian_mesh mesh = SmallScene::mesh(many, vertices, triangles);
    const Pixels pixels;
    const parian_image image = pixels.image(1);
    OpenclWatch watch;
    const Handle r = create();
    EXPECT_EQ(parian_set_mesh(r.get(), &mesh), PARIAN_SUCCESS);
    EXPECT_EQ(many.describe(r.get()), PARIAN_SUCCESS);
    EXPECT_EQ(parian_plan(r.get(), nullptr), PARIAN_SUCCESS) << parian_message();
    Bytes bytes{watch.bytes_from_host(), watch.bytes_to_host(), 0, 0};
    for (int i = 0; i < 4; ++i) {
      EXPECT_EQ(parian_positions_changed(r.get()), PARIAN_SUCCESS);
      frames(r.get(), 1);
    }
    EXPECT_EQ(parian_gather(r.get(), nullptr, 0, &image, 0, nullptr, nullptr), PARIAN_SUCCESS);
    bytes.frame_from = watch.bytes_from_host() - bytes.plan_from;
    bytes.frame_to = watch.bytes_to_host() - bytes.plan_to;
    return bytes;
  };
  const Bytes one = bytes_of(1), many = bytes_of(50);
  EXPECT_EQ(many, one) << "what is copied grows with the mesh: " << one.plan_from << " bytes in a plan, "
                       << many.plan_from << " with 50 times the triangles";
  EXPECT_LE(one.frame_from, 16384U);  // the lights, and patterns that buffers are filled with
  RecordProperty("bytes_per_plan", static_cast<int>(one.plan_from));
  RecordProperty("bytes_per_five_commands", static_cast<int>(one.frame_from));
}

TEST(Scratch, HoldsEverything) {
  const SmallScene scene;
  const Rgba& right = right_image();
  const Handle r = create();
  CALL(scene.give(r.get()));
  std::size_t bytes = 0;
  CALL(parian_scratch_size(r.get(), &bytes));
  const cl::Buffer scratch = opencl().buffer(bytes);
  CALL(parian_set_scratch(r.get(), scratch()));
  {
    OpenclWatch watch;
    CALL(parian_plan(r.get(), nullptr));
    EXPECT_EQ(read_after(r.get(), 2), right);
    EXPECT_EQ(watch.calls("clCreateBuffer"), 0U);
    EXPECT_GT(watch.calls("clCreateSubBuffer"), 20U);
  }
  auto statistics = sized<parian_statistics>();
  CALL(parian_get_statistics(r.get(), &statistics));
  EXPECT_LE(statistics.bytes_peak, bytes);
  CALL(parian_set_scratch(r.get(), nullptr));
  EXPECT_EQ(parian_frame(r.get(), nullptr, 0, nullptr, nullptr), PARIAN_NOT_PLANNED);
  CALL(parian_plan(r.get(), nullptr));
  EXPECT_EQ(read_after(r.get(), 2), right);
}

TEST(Scratch, OneByteTooSmall) {
  const SmallScene scene;
  const Handle r = create();
  CALL(scene.give(r.get()));
  // As many bytes as each refusal says that it needs, until it is enough.
  std::size_t bytes = 1;
  for (int i = 0; i < 200; ++i) {
    CALL(parian_set_scratch(r.get(), opencl().buffer(bytes)()));
    const parian_status status = parian_plan(r.get(), nullptr);
    if (status == PARIAN_SUCCESS) break;
    ASSERT_EQ(status, PARIAN_OUT_OF_MEMORY) << parian_message();
    const std::string message = parian_message(), has = "has " + std::to_string(bytes) + " bytes", needs = "needs ";
    ASSERT_NE(message.find(has), std::string::npos) << message;
    const std::size_t needed = std::stoull(message.substr(message.find(needs) + needs.size()));
    ASSERT_GT(needed, bytes);
    bytes = needed;
  }
  EXPECT_EQ(read_after(r.get(), 2), right_image());
  CALL(parian_set_scratch(r.get(), opencl().buffer(bytes - 1)()));
  EXPECT_EQ(parian_plan(r.get(), nullptr), PARIAN_OUT_OF_MEMORY);
  const std::string message = parian_message();
  EXPECT_NE(message.find(std::to_string(bytes - 1)), std::string::npos) << message;
  EXPECT_NE(message.find(std::to_string(bytes)), std::string::npos) << message;
  std::size_t asked = 0;
  CALL(parian_scratch_size(r.get(), &asked));
  EXPECT_GE(asked, bytes);
}

TEST(Scratch, LargerFilms) {
  constexpr std::uint32_t side = 512;
  const SmallScene scene;
  const cl::Buffer pixels = opencl().buffer(std::size_t{16} * side * side);
  auto image = sized<parian_image>();
  image.buffer = pixels();
  image.positions = 2;
  const auto picture = [&](parian_renderer* r) {
    cl_event done = nullptr;
    EXPECT_EQ(parian_gather(r, nullptr, 0, &image, 0, nullptr, &done), PARIAN_SUCCESS) << parian_message();
    const std::vector<cl::Event> wait{cl::Event(done)};
    Rgba rgba(std::size_t{4} * side * side);
    opencl().queue.enqueueReadBuffer(pixels, CL_TRUE, 0, 4 * rgba.size(), rgba.data(), &wait);
    return rgba;
  };
  const Handle r = create();
  CALL(scene.give(r.get()));
  std::size_t bytes = 0, more = 0;
  CALL(parian_scratch_size(r.get(), &bytes));
  CALL(parian_set_scratch(r.get(), opencl().buffer(std::size_t{11} << 20)()));  // too small for 256 x 256 pixels
  CALL(parian_plan(r.get(), nullptr));
  EXPECT_EQ(parian_set_cameras(r.get(), 1, &scene.camera, side, side), PARIAN_OUT_OF_MEMORY);
  EXPECT_EQ(parian_frame(r.get(), nullptr, 0, nullptr, nullptr), PARIAN_NOT_PLANNED);
  CALL(parian_scratch_size(r.get(), &more));  // of the larger film
  EXPECT_GT(more, bytes);
  Rgba pictures[2];
  for (const std::size_t size : {std::size_t{20} << 20, more}) {  // in four windows, and at once
    CALL(parian_set_cameras(r.get(), 1, &scene.camera, SmallScene::width, SmallScene::height));
    CALL(parian_set_scratch(r.get(), opencl().buffer(size)()));
    CALL(parian_plan(r.get(), nullptr));
    CALL(parian_frame(r.get(), nullptr, 0, nullptr, nullptr));
    CALL(parian_set_cameras(r.get(), 1, &scene.camera, side, side));
    pictures[size == more] = picture(r.get());
  }
  expect_picture(pictures[0]);
  EXPECT_EQ(pictures[0], pictures[1]);
  CALL(parian_set_cameras(r.get(), 1, &scene.camera, SmallScene::width, SmallScene::height));
  EXPECT_EQ(read_after(r.get(), 1), right_image());
}

/// The renderer behind the API, given the same, gives the same bits; whether stages are timed or not.
TEST(Inside, GivesTheSameBits) {
  SmallScene scene;
  scene.settings.fixed_cameras = 1;
  parian::Scene inside;
  parian::PolygonMesh polygons;
  for (std::size_t i = 0; i < scene.positions.size(); i += 3)
    polygons.points.emplace_back(scene.positions[i], scene.positions[i + 1], scene.positions[i + 2]);
  polygons.corners = scene.indices;
  polygons.face_sizes.assign(scene.indices.size() / 3, 3);
  inside.mesh = parian::clean_mesh(std::move(polygons));
  const auto vec3 = [](const double(&v)[3]) { return glm::dvec3(v[0], v[1], v[2]); };
  const parian_material& m = scene.material;
  inside.material = {"given", vec3(m.sigma_s), vec3(m.sigma_a), vec3(m.g), m.ior};
  inside.lights = {{vec3(scene.lights[0].towards), vec3(scene.lights[0].irradiance)}};
  inside.cameras = {{vec3(scene.camera.eye), vec3(scene.camera.target), vec3(scene.camera.up), scene.camera.fov}};
  inside.film = {SmallScene::width, SmallScene::height};
  parian::Settings settings;
  settings.layers = scene.settings.layers;
  settings.layer_size = scene.settings.layer_size;
  settings.light_map_size = scene.settings.light_map_size;
  const char* name = std::getenv("PARIAN_DEVICE");
  for (const bool stages : {false, true}) {
    settings.time_stages = stages;
    parian::Renderer direct(inside, settings, name ? name : opencl().device.getInfo<CL_DEVICE_NAME>().c_str());
    scene.settings.time_stages = stages;
    const Handle r = planned(scene);
    for (int i = 0; i < 3; ++i) direct.frame();
    const parian::Image image = direct.image(0);
    EXPECT_EQ(read_after(r.get(), 3), image.rgba);
    double estimated = 0.0;
    Rgba again(Pixels::count * 4);
    CALL(parian_read(r.get(), nullptr, 0, again.data(), &estimated));
    EXPECT_EQ(estimated, image.estimated_relmse);
    expect_picture(again);
  }
}

/// What a gather puts into a buffer is what is read, up to the rounding of a few products.
TEST(Inside, GathersWhatItReads) {
  SmallScene scene;
  scene.settings.pyramids = 0;
  const Handle r = planned(scene);
  const Rgba read = read_after(r.get(), 3), in_buffer = gathered(r.get(), nullptr, 64);
  double worst = 0.0;
  for (std::size_t i = 0; i < read.size(); ++i)
    worst = std::max(worst, std::abs(double{read[i]} - in_buffer[i]) / std::max(double{read[i]}, 1e-6));
  EXPECT_LE(worst, 1e-6);
}

}  // namespace
}  // namespace parian::test
