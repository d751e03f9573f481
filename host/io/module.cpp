// Modules, loaded after the drivers of OpenCL.
#include "io/module.hpp"

#include <CL/cl.h>
#include <dlfcn.h>
#include <fmt/format.h>

namespace parian {

const void* module_symbol(const char* module, const char* symbol, ErrorKind kind, const char* fault) {
  // Embree and OpenImageIO bring the system's TBB, and a driver may bring a newer one under the same name: there is one
  // in a process, the first. The newer one does for all, the older one doesn't do for the driver. So drivers go first.
  cl_uint platforms = 0;
  (void)clGetPlatformIDs(0, nullptr, &platforms);
  // Lazily: of what OpenImageIO brings along hardly anything is called.
  void* loaded = dlopen(module, RTLD_LAZY | RTLD_LOCAL);
  const void* found = loaded ? dlsym(loaded, symbol) : nullptr;
  if (!found)
    throw Error(kind, fmt::format("{} ({}); install the library that is missing, or Parian anew", fault, dlerror()));
  return found;
}

}  // namespace parian
