// The C API given what it can't use: each call refuses before anything is enqueued, says what is wrong, and leaves the
// renderer as it was. Here pointers, sizes, contexts and images.
#include <algorithm>

#include "opencl_watch.hpp"
#include "refusals.hpp"

namespace parian::test {
namespace {

void is_null(parian_status status) { refused(status, PARIAN_INVALID_ARGUMENT, {"NULL"}); }

TEST_F(Arguments, NullRenderers) {
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
}

TEST_F(Arguments, NullInputsAndOutputs) {
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

  // What is filled in stops at the size that the caller knows; what only he knows is 0.
  std::vector<unsigned char> bytes(sizeof(parian_statistics) + 64, 0xab);
  auto* statistics = reinterpret_cast<parian_statistics*>(bytes.data());
  statistics->struct_size = offsetof(parian_statistics, layers_covered);
  CALL(parian_get_statistics(r.get(), statistics));
  EXPECT_EQ(statistics->frames, 1U);
  EXPECT_EQ(statistics->struct_size, offsetof(parian_statistics, layers_covered));
  for (std::size_t i = statistics->struct_size; i < bytes.size(); ++i) ASSERT_EQ(bytes[i], 0xab) << i;
  statistics->struct_size = bytes.size();
  CALL(parian_get_statistics(r.get(), statistics));
  for (std::size_t i = sizeof(parian_statistics); i < bytes.size(); ++i) ASSERT_EQ(bytes[i], 0) << i;
  const auto newer_is_filled = [](auto known, auto&& call) {
    std::vector<unsigned char> larger(sizeof known + 64, 0xab);
    auto* given = reinterpret_cast<decltype(known)*>(larger.data());
    given->struct_size = larger.size();
    CALL(call(given));
    for (std::size_t i = sizeof known; i < larger.size(); ++i) ASSERT_EQ(larger[i], 0) << i;
  };
  newer_is_filled(parian_settings{}, [](auto* s) { return parian_default_settings(s); });
  newer_is_filled(parian_material{}, [](auto* m) { return parian_find_material("marble", m); });
  newer_is_filled(parian_device{}, [&](auto* d) { return parian_get_device(r.get(), d); });
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
    // A part of a device is the context's if a queue says so: here none does.
    parian_create_info info = in_context();
    info.device = parts[0];
    std::uint64_t queue = 0;
    for (const bool refuses : {false, true}) {
      OpenclWatch watch;
      if (refuses) watch.fail(queue, CL_INVALID_DEVICE);
      parian_renderer* made = nullptr;
      const parian_status status = parian_create(&info, &made);
      if (refuses)
        refused(status, PARIAN_INVALID_ARGUMENT, {"device", "context"});
      else
        ASSERT_EQ(status, PARIAN_SUCCESS) << parian_message();
      const auto& names = watch.names();
      queue = static_cast<std::uint64_t>(std::find(names.begin(), names.end(), std::string("clCreateCommandQueue")) -
                                         names.begin());
      parian_release(made);
    }
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

}  // namespace
}  // namespace parian::test
