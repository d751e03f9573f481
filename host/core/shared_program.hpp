// A compiled program, and who shares it.
#pragma once
#include <CL/opencl.hpp>
#include <atomic>
#include <memory>
#include <mutex>
#include <string>

namespace parian {

/// A program in one context, for one device. Whoever finds it unbuilt builds it, holding `building`.
struct SharedProgram {
  std::mutex building;
  cl::Program handle;
  bool built = false;
  /// An exception left the driver in the middle of a call that was for this program: the handle may not be released.
  std::atomic<bool> abandoned = false;

  SharedProgram() = default;
  ~SharedProgram() {
    if (abandoned) handle() = nullptr;
  }
  SharedProgram(const SharedProgram&) = delete;
  SharedProgram& operator=(const SharedProgram&) = delete;
};

/// Keeps a program that is abandoned for as long as the process lives, so that whoever asks for it is told.
void keep_abandoned(std::shared_ptr<SharedProgram> program);

/// The one program of `source` with `options` that all renderers of a context and device share as long as one of them
/// has it. They must retain the context, so that its handle is nobody else's. Any thread may ask.
[[nodiscard]] std::shared_ptr<SharedProgram> shared_program(cl_context context, cl_device_id device,
                                                            const std::string& options, const std::string& source);

}  // namespace parian
