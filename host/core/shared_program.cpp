// The list of programs that are in use.
#include "core/shared_program.hpp"

#include <map>
#include <tuple>
#include <utility>
#include <vector>

namespace parian {

void keep_abandoned(std::shared_ptr<SharedProgram> program) {
  static std::mutex mutex;
  static std::vector<std::shared_ptr<SharedProgram>> lost;
  const std::scoped_lock lock(mutex);
  lost.push_back(std::move(program));
}

std::shared_ptr<SharedProgram> shared_program(cl_context context, cl_device_id device, const std::string& options,
                                              const std::string& source) {
  using Key = std::tuple<cl_context, cl_device_id, std::string, std::string>;
  // Owns no program, so that nothing of OpenCL's is left when the process ends.
  static std::mutex mutex;
  static std::map<Key, std::weak_ptr<SharedProgram>> in_use;
  const std::scoped_lock lock(mutex);
  std::erase_if(in_use, [](const auto& entry) { return entry.second.expired(); });
  std::weak_ptr<SharedProgram>& entry = in_use[{context, device, options, source}];
  std::shared_ptr<SharedProgram> program = entry.lock();
  if (!program) entry = program = std::make_shared<SharedProgram>();
  return program;
}

}  // namespace parian
