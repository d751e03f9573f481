// A renderer made ready: the device, the plan's second half, from what is seen, and the buffers that frames need.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/renderer_state.hpp"
#include "render/self_test.hpp"

namespace parian {

static constexpr double longest_launch = 0.05;  // seconds, of launches that a frame is cut into

Readied make_ready(Scene& scene, const Settings& settings, Compute& compute, const DeviceMesh* mesh) {
  Readied ready{make_plan(scene, settings, compute.info()), {}};
  with_device_errors(compute.info(), [&] {
    std::vector<std::string> doubts;
    {
      Timer timer(ready.statistics.seconds.compile);
      doubts = require_sound(compute, settings, ready.plan.lanes);
      compute.build(ready.plan.options);
    }
    Timer timer(ready.statistics.seconds.plan);
    if (mesh) {
      const MeshBounds given = *scene.on_device;
      const MeshSphere sphere = measure_sphere(compute, *mesh, given);
      if (sphere.space.radius != given.radius) {
        scene.on_device->centre = sphere.space.centre;
        scene.on_device->radius = sphere.space.radius;
        ready.plan = make_plan(scene, settings, compute.info());  // what is compiled doesn't depend on it
      }
      if (const std::string said = doubt_of(sphere, given); !said.empty()) ready.plan.warnings.push_back(said);
    }
    ready.plan.warnings.insert(ready.plan.warnings.end(), doubts.begin(), doubts.end());
  });
  return ready;
}

void Renderer::State::prepare() {
  with_device_errors(compute.info(), [&] {
    Timer timer(statistics.seconds.plan);
    passes.seed = settings.seed;
    if (plan.unit_lights && plan.lights.size() == 1) colour = plan.lights[0].light.irradiance;
    for (const Camera& camera : scene.cameras) cameras.push_back(pinhole_view(camera, plan.space, scene.film));
    if (device_mesh) {
      allocate_geometry(passes, scene.on_device->positions, scene.on_device->triangles);
      read_geometry(passes, *device_mesh);
    } else {
      upload_geometry(passes, scene.mesh);
    }
    scene.mesh.normals = {};  // at millions of triangles each copy counts
    for (glm::dvec3& x : scene.mesh.positions) x = (x - plan.space.centre) / plan.space.radius;
    passes.media = compute.upload(plan.media);
    passes.rho = compute.upload(plan.density.rho);
    allocate_film();
    touch_film();
    make_light_maps(passes, device_mesh ? sphere_points() : scene.mesh.positions, settings.light_map_size);
    draw_light_maps(passes, 0, settings.light_map_shift);
    if (settings.still)
      plan_layers();
    else
      plan_live_layers();
    scene.mesh = {};
    measure_rate();
    compute.finish();
  });
}

/// Buffers of one window of the film. Where there is no room for them, smaller windows are tried.
void Renderer::State::allocate_film() {
  Film& f = passes.film;
  for (;; f.side /= 2) {
    for (cl::Buffer* b : {&f.depth, &f.ids, &f.direct, &f.n_direct, &f.n_held, &f.points, &f.centres, &f.values,
                          &f.edges, &f.open, &f.sums})
      compute.release(*b);
    const std::size_t pixels = std::size_t{std::min(scene.film.x, f.side)} * std::min(scene.film.y, f.side);
    const std::size_t held = std::min<std::size_t>(pixels, direct_points);
    try {
      f.depth = compute.buffer<cl_uint>(pixels * POSITIONS_SIDE_BY_SIDE);
      f.ids = compute.buffer<cl_uint>(pixels * POSITIONS_SIDE_BY_SIDE);
      f.direct = compute.buffer<cl_uint>(pixels * POSITIONS_SIDE_BY_SIDE);
      f.n_direct = compute.buffer<cl_uint>(POSITIONS_SIDE_BY_SIDE + 1);
      f.n_held = compute.buffer<cl_uint>(1);
      f.points = compute.buffer<kernels::float4>(2 * held);
      f.centres = compute.buffer<kernels::float4>(plan.lights.size() * held);
      f.values = compute.buffer<kernels::float4>(2 * held);
      f.edges = compute.buffer<cl_uint>(pixels);
      f.open = compute.buffer<cl_uint>(pixels);
      f.sums = compute.buffer<kernels::float4>(pixels * 2 * (plan.pyramids ? 3 : 1));
      return;
    } catch (const cl::Error& e) {
      if (e.err() != CL_MEM_OBJECT_ALLOCATION_FAILURE || f.side <= smallest_window) throw;
    } catch (const Error& e) {  // of a scratch buffer
      if (e.code() != CL_MEM_OBJECT_ALLOCATION_FAILURE || f.side <= smallest_window) throw;
    }
  }
}

/// Some drivers find memory when it is first used: while planning, and not in the first picture's time.
void Renderer::State::touch_film() {
  const Film& f = passes.film;
  const std::size_t pixels = std::size_t{std::min(scene.film.x, f.side)} * std::min(scene.film.y, f.side);
  for (const cl::Buffer* b : {&f.depth, &f.ids, &f.direct}) compute.fill(*b, 0, pixels * POSITIONS_SIDE_BY_SIDE);
  compute.fill(f.sums, 0, pixels * 8 * (plan.pyramids ? 3 : 1));
}

std::vector<kernels::View> Renderer::State::placed_layers(SurfaceSight& sight) {
  std::vector<kernels::View> views = place_layers(passes, scene.mesh.positions, scene.mesh.triangles, settings.layers,
                                                  settings.layer_size, sight, kept(settings, "redundant-layers"));
  leave_out("redundant-layers", fmt::format("{} layers see all of the surface as well as more would", views.size()),
            "layers", settings.layers - static_cast<double>(views.size()));
  for (std::size_t k = 0; k < views.size(); ++k) views[k].number = static_cast<cl_uint>(k);
  return views;
}

void Renderer::State::plan_layers() {
  if (plan.gather == Gather::camera) {  // nothing to place, and all that is seen is read
    std::vector<kernels::View> views;
    for (const kernels::View& camera : cameras) views.push_back(camera_layer(camera));
    make_layers(passes, views, plan.pyramids);
    const std::vector<cl_uint> seen = covered_texels(passes);
    set_needed(passes, seen);
    count_layers(seen.size(), seen.size());
    statistics.layers_covered = 1.0;  // until a picture finds pixels whose points no texel stands for
    return;
  }
  SurfaceSight sight;
  const std::vector<kernels::View> views = placed_layers(sight);
  make_layers(passes, views, plan.pyramids);
  statistics.layers_covered = layer_coverage(passes, sight);
  std::vector<cl_uint> needed = covered_texels(passes);
  const std::size_t covered = needed.size();
  if (!kept(settings, "unread-texels")) needed = read_texels(passes, cameras, scene.film);

  // Layers of which nothing is read cost memory and look-ups: the others are drawn again without them.
  const cl_uint per_layer = settings.layer_size * settings.layer_size;
  std::vector<cl_uint> new_index(views.size(), 0);
  for (const cl_uint t : needed) new_index[t / per_layer] = 1;
  const auto idle = static_cast<std::size_t>(std::count(new_index.begin(), new_index.end(), 0U));
  if (idle > 0 && idle < views.size() && !kept(settings, "idle-layers")) {
    std::vector<kernels::View> busy;
    for (std::size_t k = 0; k < views.size(); ++k)
      if (new_index[k]) {
        new_index[k] = static_cast<cl_uint>(busy.size());
        busy.push_back(views[k]);
      }
    for (cl_uint& t : needed) t = new_index[t / per_layer] * per_layer + t % per_layer;
    const std::size_t before = passes.layers.level_first.back();
    release_layers(passes);
    make_layers(passes, busy, plan.pyramids);
    leave_out("idle-layers", fmt::format("{} of {} layers see nothing that a camera reads", idle, views.size()),
              "bytes", static_cast<double>((before - passes.layers.level_first.back()) * 20));
  }
  set_needed(passes, needed);
  leave_out("unread-texels",
            fmt::format("{} of {} covered texels are read by no camera", covered - needed.size(), covered),
            "evaluations", static_cast<double>(covered - needed.size()) * samples_per_frame() * plan.channels());
  count_layers(covered, needed.size());
}

void Renderer::State::count_layers(std::size_t covered, std::size_t needed) {
  for (Omission& o : left_out)
    if (o.what == "equal-channels" || o.what == "black-channels")
      o.count = static_cast<double>(needed) * samples_per_frame();
  statistics.layers_count = passes.layers.count();
  statistics.layers_size = std::max(passes.layers.views.front().width, passes.layers.views.front().height);
  statistics.layers_texels = covered;
  statistics.layers_texels_evaluated = needed;
}

/// Layers for cameras that may go anywhere: all covered texels count as needed, and the device itself lists them.
void Renderer::State::plan_live_layers() {
  SurfaceSight sight;
  std::vector<kernels::View> views;
  if (device_mesh) {
    const std::vector<glm::dvec3> sphere = sphere_points();
    for (const glm::dvec3& d : even_directions(settings.layers)) {
      views.push_back(orthographic_view(sphere, d, settings.layer_size));
      views.back().number = static_cast<cl_uint>(views.size() - 1);
    }
  } else {
    views = placed_layers(sight);
  }
  make_layers(passes, views, plan.pyramids);
  statistics.layers_covered = device_mesh ? -1.0 : layer_coverage(passes, sight);
  allocate_points(passes, passes.layers.level_first[1]);
  list_covered(passes);
  find_centres(passes);
  const cl_uint listed = compute.read<cl_uint>(passes.layers.n_needed, 1)[0];
  count_layers(listed, listed);
}

/// How many points a launch may take, from how long a few take: no launch may look to a watchdog like a hang, and
/// cancelling should not take long.
void Renderer::State::measure_rate() {
  const std::size_t items = std::min<std::size_t>(accumulate_items(passes), 512);
  double seconds = 0.0;
  for (int i = 0; i < 2; ++i) {  // the first compiles
    seconds = 0.0;
    const Timer timer(seconds);
    try_accumulate(passes, items);
    compute.finish();
  }
  const double rate = static_cast<double>(items) / std::max(seconds, 1e-9);  // clocks may stand still for so few
  compute.limit("layers_accumulate", static_cast<std::size_t>(rate * longest_launch));
}

}  // namespace parian
