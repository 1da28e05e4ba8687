// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/context.hpp"

#include <unistd.h>

#include <thread>
#include <utility>

#include "common/limits.hpp"
#include "common/validate.hpp"
#include "pipeline/device_engine.hpp"

namespace gpureg {
namespace {

/// A child of fork() has none of the engine's threads: to join them would wait for ever. It keeps
/// the engine instead.
std::shared_ptr<Engine> freed_by_its_process(std::shared_ptr<Engine> engine) {
  Engine* const used = engine.get();
  return {used, [engine = std::move(engine), process = ::getpid()](Engine*) mutable {
            if (::getpid() != process) new std::shared_ptr<Engine>(std::move(engine));
          }};
}

}  // namespace

const char* to_string(Backend backend) { return backend == Backend::cpu ? "cpu" : "cuda"; }

Context Context::cpu(unsigned threads) {
  require(threads <= limits::kMaxThreads, "threads", threads, "at most 1024");
  if (threads == 0) threads = std::thread::hardware_concurrency();
  return Context(freed_by_its_process(make_cpu_engine(threads == 0 ? 1 : threads)));
}

Context Context::cuda(int device) {
  require(device >= 0, "device", device, "0 or more");
  CudaOptions options;
  options.devices = {device};
  return Context(freed_by_its_process(make_cuda_engine(options)));
}

Context Context::cuda(const CudaOptions& options) {
  for (const int device : options.devices) require(device >= 0, "device", device, "0 or more");
  return Context(freed_by_its_process(make_cuda_engine(options)));
}

Context Context::best() {
  try {
    return cuda(0);
  } catch (const BackendUnavailable&) {
    return cpu();
  }
}

Backend Context::backend() const { return engine_->backend(); }
unsigned Context::threads() const { return engine_->threads(); }
std::string Context::description() const { return engine_->description(); }
std::vector<DeviceMemoryUse> Context::device_memory() const {
  const auto* engine = dynamic_cast<const DeviceEngine*>(engine_.get());
  return engine ? engine->device_memory() : std::vector<DeviceMemoryUse>{};
}

void Context::trim() const {
  if (auto* engine = dynamic_cast<DeviceEngine*>(engine_.get())) engine->trim();
}

std::vector<std::string> describe_backends() {
  std::vector<std::string> lines;
  try {
    lines.push_back(Context::cpu().description());
  } catch (const Error& error) {
    lines.push_back(std::string("cpu: ") + error.what());
  }
  for (std::string& line : describe_cuda_devices()) lines.push_back(std::move(line));
  return lines;
}

}  // namespace gpureg
