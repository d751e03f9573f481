// A device's context, its program, buffers and launches.
#include "core/compute.hpp"

#include <algorithm>
#include <bit>

#include "core/drivers.hpp"
#include "core/words.hpp"

namespace parian {
namespace {

/// Whether commands for `device` may go into `context`: it is one of the context's, or a part of one, which not all
/// drivers list.
bool belongs(const cl::Device& device, const cl::Context& context) {
  const std::vector<cl::Device> devices = context.getInfo<CL_CONTEXT_DEVICES>();
  if (std::any_of(devices.begin(), devices.end(), [&](const cl::Device& d) { return d() == device(); })) return true;
  if (!device.getInfo<CL_DEVICE_PARENT_DEVICE>()()) return false;
  cl_int code = CL_SUCCESS;
  const cl::CommandQueue queue(clCreateCommandQueue(context(), device(), 0, &code));
  if (code != CL_SUCCESS && code != CL_INVALID_DEVICE) throw cl::Error(code, "clCreateCommandQueue");
  return code == CL_SUCCESS;
}

}  // namespace

std::string describe_cl_error(const cl::Error& error) {
  std::string name, remedy = "run 'parian devices', or choose another" + setting("with_device");
  switch (error.err()) {
    case CL_MEM_OBJECT_ALLOCATION_FAILURE:
    case CL_OUT_OF_HOST_MEMORY:
    case CL_INVALID_BUFFER_SIZE:
      name = "out of memory";
      remedy = "lower " + setting("layer_size") + ", " + setting("layers") + " or " + setting("light_map_size");
      if (memory_limit() > 0) remedy += ", or " + memory_remedy();
      break;
    case CL_OUT_OF_RESOURCES:
      name = "out of resources";
      remedy = "the driver may have stopped a long kernel or lost the device; lower " + setting("samples") + " or " +
               setting("layer_size");
      break;
    case CL_DEVICE_NOT_AVAILABLE:
    case CL_COMPILER_NOT_AVAILABLE:
      name = "device or its compiler not available";
      break;
    case CL_INVALID_BINARY:
    case CL_INVALID_PROGRAM_EXECUTABLE:
    case CL_INVALID_KERNEL_NAME:
    case CL_INVALID_KERNEL_DEFINITION:
      name = "what the driver compiled isn't what its source says";
      remedy = "delete the kernels that it has kept";
      if (has_pocl(registered_drivers())) remedy += ", PoCL in " + pocl_cache().folder;
      remedy += ", which may be damaged";
      break;
    default:
      name = "OpenCL call failed";
  }
  return name + " (" + error.what() + ", code " + std::to_string(error.err()) + "); " + remedy;
}

Compute::Compute(const std::string& selector) {
  std::tie(info_, device_) = pick(selector);
  with_device_errors(info_, [&] { in_driver([&] { context_ = cl::Context(device_); }); });
  use(nullptr, {});
}

Compute::Compute(cl_context context, cl_device_id device) {
  try {
    context_ = cl::Context(context, true);
    device_ = cl::Device(device, true);
    info_ = describe(cl::Platform(device_.getInfo<CL_DEVICE_PLATFORM>()), device_);
    if (!belongs(device_, context_))
      throw Error(ErrorKind::usage, "device: '" + info_.name + "' isn't a device of the context; give one that is");
    require_kernel_cache(info_);
  } catch (const cl::Error& e) {
    const bool unknown = e.err() == CL_INVALID_CONTEXT || e.err() == CL_INVALID_DEVICE;
    throw Error(unknown ? ErrorKind::usage : ErrorKind::device, "context or device: " + describe_cl_error(e), e.err());
  }
}

void Compute::use(cl_command_queue queue, std::vector<cl::Event> wait) {
  with_device_errors(info_, [&] {
    if (queue) {
      queue_ = cl::CommandQueue(queue, true);
      if (handle_of<cl_context>(clGetCommandQueueInfo, queue, CL_QUEUE_CONTEXT) != context_())
        throw Error(ErrorKind::usage, "queue: it is of another context than the renderer; create it in that one");
      if (handle_of<cl_device_id>(clGetCommandQueueInfo, queue, CL_QUEUE_DEVICE) != device_())
        throw Error(ErrorKind::usage, "queue: it is of another device than the renderer's '" + info_.name + "'");
    } else {
      if (!own_queue_())
        in_driver([&] { own_queue_ = cl::CommandQueue(context_, device_, CL_QUEUE_PROFILING_ENABLE); });
      queue_ = cl::CommandQueue(own_queue_);
    }
    for (const cl::Event& event : wait)
      if (handle_of<cl_context>(clGetEventInfo, event(), CL_EVENT_CONTEXT) != context_())
        throw Error(ErrorKind::usage, "wait list: an event is of another context than the renderer");
    profiling_ = (queue_.getInfo<CL_QUEUE_PROPERTIES>() & CL_QUEUE_PROFILING_ENABLE) != 0;
    book(false);
    after_.insert(after_.end(), std::make_move_iterator(wait.begin()), std::make_move_iterator(wait.end()));
  });
}

cl::Event Compute::submit() {
  if (after_.size() != 1)
    chain([&](const auto* after, cl::Event* event) { queue_.enqueueMarkerWithWaitList(after, event); });
  in_driver([&] { queue_.flush(); });
  return after_.front();
}

void Compute::take_scratch(cl::Buffer scratch) { scratch_ = std::move(scratch); }

void Compute::build(const std::string& options, const std::string& source) {
  const auto known = programs_.find({options, source});
  if (known != programs_.end()) {
    program_ = &known->second;
    return;
  }
  if (cancelled_ && cancelled_()) throw Cancelled();
  with_device_errors(info_, [&] {
    program_ = nullptr;
    const std::shared_ptr<SharedProgram> shared = shared_program(context_(), device_(), options, source);
    const std::scoped_lock lock(shared->building);
    if (shared->abandoned) throw Error(ErrorKind::device, info_.name + lost_driver, CL_OUT_OF_RESOURCES);
    // Known from here on, so that a driver that is lost while it builds this doesn't have to release it.
    Program& program = programs_[{options, source}] = {shared, {}};
    try {
      if (!shared->built) {
        const std::string key = cache_ ? cache_key(options, source) : "";
        if (!cache_ || !build_from_cache(*shared, key, options)) {
          build_from_source(*shared, options, source);
          if (cache_) keep_binary(*shared, key);
        }
        shared->built = true;
      }
    } catch (...) {
      programs_.erase({options, source});
      throw;
    }
    program_ = &program;
  });
}

/// All that a binary depends on.
std::string Compute::cache_key(const std::string& options, const std::string& source) const {
  std::string key;
  const cl::Platform platform(device_.getInfo<CL_DEVICE_PLATFORM>());
  for (const std::string& part : {info_.platform, platform.getInfo<CL_PLATFORM_VERSION>(), info_.vendor, info_.name,
                                  info_.version, info_.driver, options, source})
    key += part + '\n';
  return key;
}

/// Whether there is a binary that the driver takes. One that it doesn't take is forgotten.
bool Compute::build_from_cache(SharedProgram& program, const std::string& key, const std::string& options) {
  const std::optional<ProgramCache::Bytes> binary = cache_.find(key);
  if (!binary) return false;
  const cl_device_id device = device_();
  const std::size_t size = binary->size();
  const unsigned char* bytes = binary->data();
  cl_int code = CL_SUCCESS, of_device = CL_SUCCESS;
  in_driver([&] {
    program.handle =
        cl::Program(clCreateProgramWithBinary(context_(), 1, &device, &size, &bytes, &of_device, &code), false);
  });
  if (code == CL_SUCCESS && of_device == CL_SUCCESS)
    code = in_driver([&] { return clBuildProgram(program.handle(), 1, &device, options.c_str(), nullptr, nullptr); });
  if (code == CL_SUCCESS && of_device == CL_SUCCESS) return true;
  program.handle = cl::Program();
  cache_.forget(key);
  return false;
}

void Compute::build_from_source(SharedProgram& program, const std::string& options, const std::string& source) {
  in_driver([&] { program.handle = cl::Program(context_, source); });
  // Not by cl::Program: it allocates on its way back, and a failure of that is none of the driver's.
  const cl_device_id device = device_();
  const cl_int code =
      in_driver([&] { return clBuildProgram(program.handle(), 1, &device, options.c_str(), nullptr, nullptr); });
  if (code == CL_SUCCESS) return;
  if (code != CL_BUILD_PROGRAM_FAILURE) throw cl::Error(code, "clBuildProgram");
  const std::string log = program.handle.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device_);
  const std::size_t at = log.find("error"), begin = at == std::string::npos ? 0 : log.rfind('\n', at) + 1;
  throw Error(ErrorKind::device, info_.name + ": the kernels don't compile (" +
                                     log.substr(begin, log.find('\n', std::max(at, begin)) - begin) +
                                     "); update the driver or choose another" + setting("with_device"));
}

/// Keeps what has been compiled, if the driver hands it out.
void Compute::keep_binary(SharedProgram& program, const std::string& key) {
  const auto of_program = [&](cl_program_info what, std::size_t bytes, void* values) {
    return in_driver([&] { return clGetProgramInfo(program.handle(), what, bytes, values, nullptr); });
  };
  cl_uint count = 0;
  if (of_program(CL_PROGRAM_NUM_DEVICES, sizeof count, &count) != CL_SUCCESS) return;
  std::vector<cl_device_id> devices(count);
  std::vector<std::size_t> sizes(count);
  if (of_program(CL_PROGRAM_DEVICES, count * sizeof(cl_device_id), devices.data()) != CL_SUCCESS ||
      of_program(CL_PROGRAM_BINARY_SIZES, count * sizeof(std::size_t), sizes.data()) != CL_SUCCESS)
    return;
  // The context's other devices, for which nothing was built, get no place to write to.
  const auto at = static_cast<std::size_t>(std::find(devices.begin(), devices.end(), device_()) - devices.begin());
  if (at == devices.size() || sizes[at] == 0) return;
  ProgramCache::Bytes binary(sizes[at]);
  std::vector<unsigned char*> places(count, nullptr);
  places[at] = binary.data();
  if (of_program(CL_PROGRAM_BINARIES, count * sizeof(unsigned char*), places.data()) == CL_SUCCESS)
    cache_.keep(key, binary);
}

cl::Buffer Compute::allocate(std::size_t bytes) {
  cl::Buffer b =
      scratch_() ? part_of_scratch(bytes) : in_driver([&] { return cl::Buffer(context_, CL_MEM_READ_WRITE, bytes); });
  bytes_ += bytes;
  peak_ = std::max(peak_, bytes_);
  return b;
}

/// The first gap that is large enough.
cl::Buffer Compute::part_of_scratch(std::size_t bytes) {
  const std::size_t align = device_.getInfo<CL_DEVICE_MEM_BASE_ADDR_ALIGN>() / 8;
  std::size_t begin = 0;
  auto next = parts_.begin();
  for (; next != parts_.end() && next->begin < begin + bytes; ++next) begin = (next->end + align - 1) / align * align;
  const std::size_t size = scratch_.getInfo<CL_MEM_SIZE>();
  if (begin + bytes > size)
    throw Error(ErrorKind::device,
                "scratch buffer: it has " + std::to_string(size) + " bytes and needs " + std::to_string(begin + bytes) +
                    " by now; ask for its size again after every change of the scene",
                CL_MEM_OBJECT_ALLOCATION_FAILURE);
  const cl_buffer_region region{begin, bytes};
  cl::Buffer b = scratch_.createSubBuffer(CL_MEM_READ_WRITE, CL_BUFFER_CREATE_TYPE_REGION, &region);
  parts_.insert(next, {begin, begin + bytes, b()});
  return b;
}

void Compute::release(cl::Buffer& b) {
  if (b()) bytes_ -= b.getInfo<CL_MEM_SIZE>();
  parts_.erase(std::remove_if(parts_.begin(), parts_.end(), [&](const Part& p) { return p.buffer == b(); }),
               parts_.end());
  b = cl::Buffer();
}

void Compute::drain() noexcept {
  for (int attempts = 0; !after_.empty() && attempts < 2; ++attempts) {  // the memory may be somebody else's next
    try {
      cl::Event::waitForEvents(after_);
      after_.clear();
    } catch (const cl::Error&) {  // events that failed, of which their owner has been told; or the call itself
    }
  }
  after_.clear();
}

void Compute::abandon() noexcept {
  abandoned_ = true;
  // Without a release, which would wait for a lock for ever.
  for (cl::Event& event : after_) event() = nullptr;
  for (Running& running : running_) running.event() = nullptr;
  for (auto& [source, program] : programs_) {
    for (auto& [name, prepared] : program.kernels) prepared.kernel() = nullptr;
    program.shared->abandoned = true;
    keep_abandoned(program.shared);
  }
  scratch_() = nullptr;
  own_queue_() = nullptr;
  queue_() = nullptr;
  context_() = nullptr;
  after_.clear();
  running_.clear();
  programs_.clear();
  program_ = nullptr;
}

void Compute::release_all() noexcept {
  running_.clear();
  parts_.clear();
  limits_.clear();
  seconds_.clear();
  table_.clear();
  bytes_ = peak_ = 0;
}

void Compute::transfer(const cl::Buffer& b, bool to_device, std::size_t offset, std::size_t bytes, void* host) {
  chain([&](const auto* after, cl::Event* event) {
    if (to_device)
      queue_.enqueueWriteBuffer(b, CL_TRUE, offset, bytes, host, after, event);
    else
      queue_.enqueueReadBuffer(b, CL_TRUE, offset, bytes, host, after, event);
  });
  after_.clear();  // done
}

void Compute::assign_patterns(const cl::Buffer& b, const std::vector<Pattern>& patterns) {
  for (std::size_t i = 0; i < patterns.size(); ++i)
    chain([&](const auto* after, cl::Event* event) {
      const cl_uint4 pattern{{patterns[i][0], patterns[i][1], patterns[i][2], patterns[i][3]}};
      queue_.enqueueFillBuffer(b, pattern, i * sizeof pattern, sizeof pattern, after, event);
    });
}

void Compute::fill(const cl::Buffer& b, cl_uint value, std::size_t words) {
  if (words == 0) return;
  chain([&](const auto* after, cl::Event* event) {
    queue_.enqueueFillBuffer(b, value, 0, words * sizeof(cl_uint), after, event);
  });
}

Compute::Prepared& Compute::prepared(const char* name) {
  const auto it = program_->kernels.find(name);
  if (it != program_->kernels.end()) return it->second;
  cl::Kernel kernel = in_driver([&] { return cl::Kernel(program_->shared->handle, name); });
  const std::size_t most_in_group = kernel.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(device_);
  return program_->kernels.emplace(name, Prepared{std::move(kernel), most_in_group, {}}).first->second;
}

std::size_t Compute::group_size(const Prepared& kernel) const {
  return std::max<std::size_t>(std::bit_floor(std::min(most_in_group_, kernel.most_in_group)), 1);
}

void Compute::enqueue(const char* name, const Prepared& kernel, std::size_t items, Stage stage) {
  if (cancelled_ && cancelled_()) throw Cancelled();
  const std::size_t group = group_size(kernel), global = (items + group - 1) / group * group;
  const auto limit = limits_.find(name);
  const std::size_t piece = limit == limits_.end() ? global : std::max<std::size_t>(limit->second / group, 1) * group;
  for (std::size_t first = 0; first < global; first += piece) {
    const std::size_t n = std::min(piece, global - first);
    const cl::Event& done = chain([&](const auto* after, cl::Event* event) {
      queue_.enqueueNDRangeKernel(kernel.kernel, first ? cl::NDRange(first) : cl::NullRange, cl::NDRange(n),
                                  cl::NDRange(group), after, event);
    });
    if (profiling_) running_.push_back({done, stage, name, std::min(n, items - first)});
  }
  if (running_.size() >= 4096) book(false);
}

void Compute::book(bool all) {
  for (; !running_.empty(); running_.pop_front()) {
    const Running& r = running_.front();
    if (!all && r.event.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>() > CL_COMPLETE) return;
    const cl_ulong begin = r.event.getProfilingInfo<CL_PROFILING_COMMAND_START>();
    const cl_ulong end = r.event.getProfilingInfo<CL_PROFILING_COMMAND_END>();
    const double seconds = 1e-9 * static_cast<double>(end - begin);
    seconds_[r.stage] += seconds;
    KernelWork& work = table_[{r.stage, r.kernel}];
    ++work.launches;
    work.items += r.items;
    work.seconds += seconds;
  }
}

void Compute::finish() {
  if (!after_.empty()) in_driver([&] { cl::Event::waitForEvents(after_); });
  after_.clear();
  book(true);
}

}  // namespace parian
