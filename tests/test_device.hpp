// The OpenCL device under test: programs that all tests of a process share, and small kernels over the shared headers.
#pragma once
#include <CL/opencl.hpp>
#include <cstdlib>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "core/compute.hpp"
#include "core/embedded.hpp"

namespace parian {

/// What PARIAN_DEVICE says, as the library takes it.
inline std::string test_selector() {
  const char* wanted = std::getenv("PARIAN_DEVICE");
  return wanted ? wanted : "";
}

/// What a selector means: one device and one context of it for the whole process.
inline Compute& opened(const std::string& selector = test_selector()) {
  static auto& all = *new std::map<std::string, Compute>;  // never destroyed: drivers may end first
  return all.try_emplace(selector, selector).first->second;
}

/// The device that PARIAN_DEVICE means.
inline cl::Device test_device() { return opened().device(); }

/// Of interpreted kernels, some thousand times as slow as others, `few`, else `all`: under Oclgrind tests take the
/// smallest films that reach every branch of every kernel.
template <class T>
T fitted(T all, T few) {
  return opened().info().platform == "Oclgrind" ? few : all;
}

/// Whether the long forms of tests are asked for, as tools/test deep does.
inline bool deep() { return std::getenv("PARIAN_TEST_DEEP") != nullptr; }

/// A device with a program, for one owner at a time, who leaves it as good as new. Programs are built once in a
/// process, since building takes drivers longer than most tests do.
inline std::shared_ptr<Compute> built(const std::string& options, const std::string& selector = test_selector(),
                                      const std::string& program = render_sources) {
  using Key = std::tuple<std::string, std::string, std::string>;
  static auto& idle = *new std::multimap<Key, std::unique_ptr<Compute>>;
  const Key key{selector, options, program};
  std::unique_ptr<Compute> compute;
  if (const auto found = idle.find(key); found != idle.end()) {
    compute = std::move(found->second);
    idle.erase(found);
  } else {
    compute = std::make_unique<Compute>(opened(selector).context()(), opened(selector).device()());
    compute->use(nullptr, {});
    compute->build(options, program);
  }
  return {compute.release(), [key](Compute* used) {
            used->drain();
            used->release_all();
            used->limit_groups(64);
            used->ask({});
            idle.emplace(key, used);
          }};
}

/// bssrdf.h and what it includes, followed by `kernels`.
inline std::string with_headers(const std::string& kernels) {
  const std::string all = self_test_sources;
  return all.substr(0, all.find("#line 1 \"kernels/raster.h\"")) + "\n" + kernels;
}

class TestDevice {
 public:
  /// Builds the headers and `source` and runs `kernel` over `items`; arguments are the inputs, `items`, the output.
  std::vector<float> run(const char* source, const std::string& options, const char* kernel, std::size_t items,
                         std::size_t outputs, const std::vector<cl::Buffer>& inputs) {
    cl::Program program(context_, with_headers(source));
    try {
      program.build(("-cl-std=CL1.2 -Werror " + options).c_str());
    } catch (const cl::Error&) {
      throw std::runtime_error(program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device_));
    }
    cl::Kernel k(program, kernel);
    cl_uint argument = 0;
    for (const cl::Buffer& input : inputs) k.setArg(argument++, input);
    std::vector<float> result(outputs, std::numeric_limits<float>::quiet_NaN());
    const cl::Buffer out(context_, CL_MEM_WRITE_ONLY | CL_MEM_COPY_HOST_PTR, outputs * sizeof(float), result.data());
    k.setArg(argument++, static_cast<cl_uint>(items));
    k.setArg(argument++, out);
    queue_.enqueueNDRangeKernel(k, cl::NullRange, cl::NDRange((items + 63) / 64 * 64), cl::NDRange(64));
    queue_.enqueueReadBuffer(out, CL_TRUE, 0, outputs * sizeof(float), result.data());
    return result;
  }
  template <typename T>
  cl::Buffer buffer(std::vector<T> data) {
    return {context_, CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, data.size() * sizeof(T), data.data()};
  }

 private:
  cl::Device device_ = test_device();
  cl::Context context_ = opened().context();
  cl::CommandQueue queue_{context_, device_};
};

}  // namespace parian
