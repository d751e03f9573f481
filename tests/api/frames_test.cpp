// What changes between frames cost and keep, what frames and gathers may not do, and where buffers come from.
#include <algorithm>
#include <limits>
#include <random>

#include "opencl_watch.hpp"
#include "renderer.hpp"
#include "small_scene.hpp"

namespace parian::test {
namespace {

Handle planned(const SmallScene& scene, cl_command_queue queue = nullptr) {
  Handle r = create();
  EXPECT_EQ(scene.give(r.get()), PARIAN_SUCCESS) << parian_message();
  EXPECT_EQ(parian_plan(r.get(), queue), PARIAN_SUCCESS) << parian_message();
  return r;
}

void frames(parian_renderer* r, int n, cl_command_queue queue = nullptr) {
  for (int i = 0; i < n; ++i)
    ASSERT_EQ(parian_frame(r, queue, 0, nullptr, nullptr), PARIAN_SUCCESS) << parian_message();
}

/// What a renderer that is planned for the scene gathers after so many frames.
Rgba fresh(const SmallScene& scene, int n) {
  const Handle r = planned(scene);
  frames(r.get(), n);
  return gathered(r.get());
}

std::uint32_t summed(parian_renderer* r) {
  auto statistics = sized<parian_statistics>();
  EXPECT_EQ(parian_get_statistics(r, &statistics), PARIAN_SUCCESS);
  return statistics.frames;
}

Rgba scaled(Rgba image, std::array<float, 3> factor) {
  for (std::size_t i = 0; i < image.size(); ++i)
    if (i % 4 < 3) image[i] *= factor[i % 4];
  return image;
}

/// As the contract defines relMSE, over pixels that both cover.
double relmse(const Rgba& image, const Rgba& reference) {
  double mean = 0.0, sum = 0.0;
  std::size_t n = 0;
  const auto inside = [&](std::size_t i) { return image[i | 3] >= 0.999F && reference[i | 3] >= 0.999F && i % 4 < 3; };
  for (std::size_t i = 0; i < image.size(); ++i)
    if (inside(i)) mean += reference[i], ++n;
  const double epsilon = 0.01 * mean / static_cast<double>(n);
  for (std::size_t i = 0; i < image.size(); ++i)
    if (inside(i)) {
      const double r = reference[i], d = image[i] - r;
      sum += d * d / (r * r + epsilon * epsilon);
    }
  return sum / static_cast<double>(n);
}

TEST(Changes, CamerasAndFilmKeepTheSums) {
  SmallScene scene, moved;
  moved.camera.eye[0] = 90.0;
  moved.camera.fov = 50.0;
  const Handle r = planned(scene);
  frames(r.get(), 2);
  CALL(parian_set_cameras(r.get(), 1, &moved.camera, SmallScene::width, SmallScene::height));
  frames(r.get(), 1);
  EXPECT_EQ(summed(r.get()), 3U);
  EXPECT_EQ(gathered(r.get()), fresh(moved, 3)) << "moved camera";
  // Another film and two cameras, and back.
  const parian_camera both[] = {scene.camera, moved.camera};
  CALL(parian_set_cameras(r.get(), 2, both, 40, 31));
  const cl::Buffer large = opencl().buffer(40 * 31 * 16);
  auto image = sized<parian_image>();
  image.buffer = large();
  CALL(parian_gather(r.get(), nullptr, 1, &image, 0, nullptr, nullptr));
  CALL(parian_set_cameras(r.get(), 1, &scene.camera, SmallScene::width, SmallScene::height));
  EXPECT_EQ(summed(r.get()), 3U);
  EXPECT_EQ(gathered(r.get()), fresh(scene, 3)) << "the first camera again";
}

TEST(Changes, ExposureScales) {
  const Handle r = planned(SmallScene());
  frames(r.get(), 1);
  const Rgba before = gathered(r.get());
  const Pixels pixels;
  parian_image image = pixels.image();
  image.exposure = 3.0F;
  cl_event done = nullptr;
  CALL(parian_gather(r.get(), nullptr, 0, &image, 0, nullptr, &done));
  EXPECT_EQ(pixels.read(done), scaled(before, {8, 8, 8}));
  EXPECT_EQ(summed(r.get()), 1U);
}

TEST(Changes, ColourOfLightRescales) {
  SmallScene scene;
  scene.lights.push_back(SmallScene::light({1, 0.2, 0.4}, 1.5));
  const Handle r = planned(scene);
  frames(r.get(), 2);
  const Rgba before = gathered(r.get());
  const std::array<float, 3> factor{4.0F, 0.5F, 2.0F};
  std::vector<parian_light> lights = scene.lights;
  for (parian_light& l : lights)
    for (int c = 0; c < 3; ++c) l.irradiance[c] *= factor[c];
  CALL(parian_set_lights(r.get(), 2, lights.data()));
  EXPECT_EQ(gathered(r.get()), scaled(before, factor));
  frames(r.get(), 1);
  EXPECT_EQ(summed(r.get()), 3U);
  const Rgba three = gathered(r.get());
  CALL(parian_set_lights(r.get(), 2, scene.lights.data()));
  EXPECT_EQ(scaled(gathered(r.get()), factor), three);
  EXPECT_EQ(gathered(r.get()), fresh(scene, 3));
  // Black in one channel, and back.
  for (parian_light& l : lights) l.irradiance[1] = 0.0;
  CALL(parian_set_lights(r.get(), 2, lights.data()));
  EXPECT_EQ(gathered(r.get()), scaled(three, {1, 0, 1}));
  CALL(parian_set_lights(r.get(), 2, scene.lights.data()));
  EXPECT_EQ(summed(r.get()), 3U);
  EXPECT_EQ(gathered(r.get()), fresh(scene, 3));
  // What is read, and how good it is.
  double relative = 0.0, relative_scaled = 0.0;
  Rgba read(Pixels::count * 4), read_scaled(Pixels::count * 4);
  CALL(parian_read(r.get(), nullptr, 0, read.data(), &relative));
  for (std::size_t l = 0; l < 2; ++l)
    for (int c = 0; c < 3; ++c) lights[l].irradiance[c] = 8.0 * scene.lights[l].irradiance[c];
  CALL(parian_set_lights(r.get(), 2, lights.data()));
  CALL(parian_read(r.get(), nullptr, 0, read_scaled.data(), &relative_scaled));
  EXPECT_EQ(read_scaled, scaled(read, {8, 8, 8}));
  EXPECT_EQ(relative_scaled, relative);
}

TEST(Changes, OtherColoursStartAnew) {
  SmallScene scene, other;
  scene.lights.push_back(SmallScene::light({1, 0.2, 0.4}, 1.5));
  other.lights = scene.lights;
  other.lights[0].irradiance[0] += 0.5;  // the same flux: samples are divided between lights as before
  other.lights[0].irradiance[2] -= 0.5;
  const Handle r = planned(scene);
  frames(r.get(), 3);
  const Rgba before = gathered(r.get());
  CALL(parian_set_lights(r.get(), 2, other.lights.data()));
  EXPECT_EQ(gathered(r.get()), before) << "until the next frame";
  frames(r.get(), 2);
  EXPECT_EQ(summed(r.get()), 2U);
  EXPECT_EQ(gathered(r.get()), fresh(other, 2));
  // From nearly nothing to a great deal there are no digits left to rescale.
  for (parian_light& l : other.lights)
    for (double& e : l.irradiance) e = 1e-28;
  CALL(parian_set_lights(r.get(), 2, other.lights.data()));
  frames(r.get(), 2);
  for (parian_light& l : other.lights)
    for (double& e : l.irradiance) e = 1e28;
  CALL(parian_set_lights(r.get(), 2, other.lights.data()));
  frames(r.get(), 1);
  EXPECT_EQ(summed(r.get()), 1U);
  expect_picture(gathered(r.get()));
}

TEST(Changes, NumberOfLightsNeedsAPlan) {
  SmallScene scene;
  const Handle r = planned(scene);
  frames(r.get(), 1);
  scene.lights.push_back(SmallScene::light({1, 0.2, 0.4}, 1.5));
  CALL(parian_set_lights(r.get(), 2, scene.lights.data()));
  EXPECT_EQ(parian_frame(r.get(), nullptr, 0, nullptr, nullptr), PARIAN_NOT_PLANNED);
  CALL(parian_plan(r.get(), nullptr));
  frames(r.get(), 2);
  EXPECT_EQ(gathered(r.get()), fresh(scene, 2));
  for (double& e : scene.lights[0].irradiance) e = 0.0;  // goes dark
  CALL(parian_set_lights(r.get(), 2, scene.lights.data()));
  EXPECT_EQ(parian_frame(r.get(), nullptr, 0, nullptr, nullptr), PARIAN_NOT_PLANNED);
  CALL(parian_set_lights(r.get(), 0, nullptr));
  CALL(parian_plan(r.get(), nullptr));
  frames(r.get(), 1);
  const Rgba dark = gathered(r.get());
  for (std::size_t i = 0; i < dark.size(); ++i) ASSERT_TRUE(i % 4 == 3 || dark[i] == 0.0F) << i;
}

TEST(Changes, DirectionStartsAnew) {
  SmallScene scene;
  scene.settings.light_map_size = 128;
  const auto turned = [&](std::array<double, 3> towards) { return SmallScene::light(towards, 3.0); };
  const parian_light a = turned({0.5, 0.6, -0.6}), b = turned({-0.7, 0.5, -0.3}), c = turned({0, 1, 0});
  const auto light = [](parian_renderer* r, const parian_light& l) {
    ASSERT_EQ(parian_set_lights(r, 1, &l), PARIAN_SUCCESS);
  };
  const Handle direct = planned(scene), detour = planned(scene);
  light(direct.get(), b);
  frames(direct.get(), 2);
  frames(detour.get(), 20);  // light maps have been shifted by now
  light(detour.get(), c);
  frames(detour.get(), 1);
  light(detour.get(), a);
  light(detour.get(), b);
  frames(detour.get(), 2);
  EXPECT_EQ(summed(detour.get()), 2U);
  EXPECT_EQ(gathered(detour.get()), gathered(direct.get()));
  frames(direct.get(), 62);
  scene.lights = {b};
  // The map of a turned light holds the bounding sphere, not the mesh alone: other texels, the same light.
  const double difference = relmse(gathered(direct.get(), nullptr, 8), [&] {
    const Handle r = planned(scene);
    frames(r.get(), 64);
    return gathered(r.get(), nullptr, 8);
  }());
  RecordProperty("relmse", std::to_string(difference));
  EXPECT_LE(difference, 2e-3);
}

TEST(Changes, MaterialAndSeedStartAnew) {
  SmallScene scene;
  const Handle r = planned(scene);
  frames(r.get(), 3);
  const Rgba first = gathered(r.get());
  scene.settings.seed = 5;
  CALL(parian_set_settings(r.get(), &scene.settings));
  CALL(parian_plan(r.get(), nullptr));
  EXPECT_EQ(summed(r.get()), 0U);
  frames(r.get(), 3);
  const Rgba seeded = gathered(r.get());
  EXPECT_NE(seeded, first);
  EXPECT_EQ(seeded, fresh(scene, 3));
  for (double& s : scene.material.sigma_s) s *= 0.5;
  CALL(parian_set_material(r.get(), &scene.material));
  CALL(parian_plan(r.get(), nullptr));
  frames(r.get(), 2);
  EXPECT_EQ(gathered(r.get()), fresh(scene, 2));
}

TEST(Changes, RestartForgetsEverything) {
  SmallScene scene;
  const Handle r = planned(scene);
  frames(r.get(), 20);
  double relative = 0.0;
  CALL(parian_estimate(r.get(), nullptr, &relative));
  CALL(parian_restart(r.get()));
  EXPECT_EQ(read_after(r.get(), 2), right_image());
}

/// A renderer of a mesh in buffers.
struct OnDevice {
  explicit OnDevice(const SmallScene& s, cl_command_queue queue = nullptr)
      : vertices(opencl().buffer(s.positions)), triangles(opencl().buffer(s.indices)) {
    const parian_mesh mesh = SmallScene::mesh(s, vertices, triangles);
    EXPECT_EQ(parian_set_mesh(r.get(), &mesh), PARIAN_SUCCESS) << parian_message();
    EXPECT_EQ(s.describe(r.get()), PARIAN_SUCCESS) << parian_message();
    EXPECT_EQ(parian_plan(r.get(), queue), PARIAN_SUCCESS) << parian_message();
  }
  Rgba after(int n) {
    frames(r.get(), n);
    return gathered(r.get());
  }
  cl::Buffer vertices, triangles;
  Handle r = create();
};

TEST(MeshOnDevice, MovedPositionsStartAnew) {
  const SmallScene scene;
  SmallScene bent = scene;
  for (std::size_t i = 1; i < bent.positions.size(); i += 3)
    bent.positions[i] += 4.0F * std::sin(0.1F * bent.positions[i - 1]);
  OnDevice mesh(scene);
  frames(mesh.r.get(), 20);
  opencl().queue.enqueueWriteBuffer(mesh.vertices, CL_TRUE, 0, bent.positions.size() * 4, bent.positions.data());
  const Rgba before = gathered(mesh.r.get());
  CALL(parian_positions_changed(mesh.r.get()));
  EXPECT_EQ(gathered(mesh.r.get()), before) << "until the next frame";
  EXPECT_EQ(mesh.after(2), OnDevice(bent).after(2));
  EXPECT_EQ(summed(mesh.r.get()), 2U);
  const Handle on_host = planned(scene);
  EXPECT_EQ(parian_positions_changed(on_host.get()), PARIAN_INVALID_ARGUMENT);
}

TEST(MeshOnDevice, AgreesWithTheMeshOnTheHost) {
  SmallScene scene;
  scene.settings.layers = 16;
  scene.settings.layer_size = 64;
  scene.settings.light_map_size = 128;
  const Handle host = planned(scene);
  const OnDevice device(scene);
  frames(host.get(), 64);
  frames(device.r.get(), 64);
  const double difference = relmse(gathered(device.r.get(), nullptr, 8), gathered(host.get(), nullptr, 8));
  RecordProperty("relmse", std::to_string(difference));
  EXPECT_LE(difference, 2e-3);  // other layers, other views of the light: two estimates of the same picture
}

TEST(MeshOnDevice, LeavesOutWhatIsBroken) {
  const SmallScene whole;
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  const float bad[] = {nan, infinity, -infinity, 3e38F, -1e20F, 1e6F, 100.0F};
  SmallScene broken = whole, removed = whole;
  removed.indices.clear();
  for (std::size_t k = 0; k < std::size(bad); ++k) broken.positions[3 * (20 * k + 3) + k % 3] = bad[k];
  broken.indices[50] = 0xffffffff;
  broken.indices[200] = 0x7fffffff;
  broken.indices[300] = static_cast<std::uint32_t>(whole.positions.size() / 3);
  for (std::size_t t = 0; t < whole.indices.size(); t += 3) {
    const auto* c = &broken.indices[t];
    const bool sound = std::all_of(c, c + 3, [&](std::uint32_t i) {
      return i < whole.positions.size() / 3 && broken.positions[3 * i] == whole.positions[3 * i] &&
             broken.positions[3 * i + 1] == whole.positions[3 * i + 1] &&
             broken.positions[3 * i + 2] == whole.positions[3 * i + 2];
    });
    if (sound) removed.indices.insert(removed.indices.end(), c, c + 3);
  }
  EXPECT_LT(removed.indices.size(), whole.indices.size() - 100);
  const Rgba image = OnDevice(broken).after(2);
  expect_picture(image);
  EXPECT_EQ(image, OnDevice(removed).after(2));
  // Nothing that can be drawn, now and then.
  SmallScene nothing = whole;
  std::fill(nothing.positions.begin(), nothing.positions.end(), nan);
  OnDevice mesh(nothing);
  for (const float v : mesh.after(2)) ASSERT_EQ(v, 0.0F);
  opencl().queue.enqueueWriteBuffer(mesh.vertices, CL_TRUE, 0, whole.positions.size() * 4, whole.positions.data());
  CALL(parian_positions_changed(mesh.r.get()));
  EXPECT_EQ(mesh.after(2), OnDevice(whole).after(2));
}

TEST(MeshOnDevice, OffsetsAndStrides) {
  SmallScene scene;
  const Rgba right = OnDevice(scene).after(1);
  std::vector<float> spread(6, -1.0F);
  for (std::size_t i = 0; i < scene.positions.size(); i += 3) {
    spread.insert(spread.end(), scene.positions.begin() + i, scene.positions.begin() + i + 3);
    spread.insert(spread.end(), 5, 1e9F);
  }
  spread.resize(spread.size() - 5);  // nothing after the last
  std::vector<std::uint32_t> indices(7, 99999);
  indices.insert(indices.end(), scene.indices.begin(), scene.indices.end());
  const cl::Buffer vertices = opencl().buffer(spread), triangles = opencl().buffer(indices);
  parian_mesh mesh = SmallScene::mesh(scene, vertices, triangles);
  mesh.position_offset = 24;
  mesh.position_stride = 32;
  mesh.index_offset = 28;
  const Handle r = create();
  CALL(parian_set_mesh(r.get(), &mesh));
  CALL(scene.describe(r.get()));
  CALL(parian_plan(r.get(), nullptr));
  frames(r.get(), 1);
  EXPECT_EQ(gathered(r.get()), right);
}

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
      scene.lights = {SmallScene::light({-0.7, 0.5, -0.3}, 3.0)};
      CALL(parian_set_lights(mesh.r.get(), 1, scene.lights.data()));
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
  const Handle r = create();
  CALL(scene.give(r.get()));
  std::size_t bytes = 0;
  CALL(parian_scratch_size(r.get(), &bytes));
  const cl::Buffer scratch = opencl().buffer(bytes);
  CALL(parian_set_scratch(r.get(), scratch()));
  {
    OpenclWatch watch;
    CALL(parian_plan(r.get(), nullptr));
    EXPECT_EQ(read_after(r.get(), 2), right_image());
    EXPECT_EQ(watch.calls("clCreateBuffer"), 0U);
    EXPECT_GT(watch.calls("clCreateSubBuffer"), 20U);
  }
  auto statistics = sized<parian_statistics>();
  CALL(parian_get_statistics(r.get(), &statistics));
  EXPECT_LE(statistics.bytes_peak, bytes);
  CALL(parian_set_scratch(r.get(), nullptr));
  EXPECT_EQ(parian_frame(r.get(), nullptr, 0, nullptr, nullptr), PARIAN_NOT_PLANNED);
  CALL(parian_plan(r.get(), nullptr));
  EXPECT_EQ(read_after(r.get(), 2), right_image());
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
  const SmallScene scene;
  const Handle r = create();
  CALL(scene.give(r.get()));
  std::size_t bytes = 0, more = 0;
  CALL(parian_scratch_size(r.get(), &bytes));
  CALL(parian_set_scratch(r.get(), opencl().buffer(bytes)()));
  CALL(parian_plan(r.get(), nullptr));
  EXPECT_EQ(parian_set_cameras(r.get(), 1, &scene.camera, 512, 512), PARIAN_OUT_OF_MEMORY);
  EXPECT_EQ(parian_frame(r.get(), nullptr, 0, nullptr, nullptr), PARIAN_NOT_PLANNED);
  CALL(parian_scratch_size(r.get(), &more));  // of the larger film
  EXPECT_GT(more, bytes);
  CALL(parian_set_scratch(r.get(), opencl().buffer(more)()));
  CALL(parian_plan(r.get(), nullptr));
  CALL(parian_set_cameras(r.get(), 1, &scene.camera, SmallScene::width, SmallScene::height));
  EXPECT_EQ(read_after(r.get(), 2), right_image());
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
