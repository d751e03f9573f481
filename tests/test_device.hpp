// Runs small kernels over the shared headers on the OpenCL device under test.
#pragma once
#include <CL/opencl.hpp>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "compute.hpp"
#include "embedded.hpp"

namespace parian {

/// The device that PARIAN_DEVICE means, as it does to the library.
inline cl::Device test_device() {
  const char* wanted = std::getenv("PARIAN_DEVICE");
  return Compute(wanted ? wanted : "").device();
}

/// The headers of the embedded program, up to bssrdf.h, followed by `kernels`.
inline std::string with_headers(const std::string& kernels) {
  const std::string all = kernel_sources;
  return all.substr(0, all.find("#line 1 \"kernels/sampling.h\"")) + "\n" + kernels;
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
  cl::Context context_{device_};
  cl::CommandQueue queue_{context_, device_};
};

}  // namespace parian
