// SPDX-License-Identifier: BSD-3-Clause
// Aligns many small pairs in one process, then makes and destroys many contexts. Every result must
// equal the first one of its pair, byte for byte; memory, threads and open files must not grow.
//   gpureg_soak [--cuda] [--pairs N] [--contexts N] [--threads N]
// Exits with 1 where a result differs or something grows, with 77 without the backend.
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "gpureg/error.hpp"
#include "gpureg/registration.hpp"
#include "portability/scans.hpp"
#include "support/result_bytes.hpp"

namespace gpureg {
namespace {

constexpr float kVoxelSize = 0.5f;  // metres: about a hundred points remain of a scan
constexpr std::size_t kRows = 10;
constexpr std::size_t kWarmUp = 10;  // 1 / share of the run after which nothing may grow
// Growth that the fragmentation of the heap is allowed, in pages of 4 KiB: 4 MiB. A leak of 100
// bytes per pair would be 10 MiB.
constexpr long kAllowedPages = 1024;

struct Use {
  long resident = 0;  // pages of 4 KiB
  long threads = 0;
  long files = 0;
  std::size_t device = 0;  // bytes reserved on devices
};

Use use_of(const Context* context) {
  namespace fs = std::filesystem;
  Use use;
  long size = 0;
  std::ifstream("/proc/self/statm") >> size >> use.resident;
  use.resident = use.resident * (sysconf(_SC_PAGESIZE) / 4096);
  const auto count = [](const char* folder) {
    return static_cast<long>(
        std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
  };
  use.threads = count("/proc/self/task");
  use.files = count("/proc/self/fd");
  if (context != nullptr)
    for (const DeviceMemoryUse& device : context->device_memory())
      use.device += device.bytes_reserved;
  return use;
}

/// Prints a table of kRows rows; remembers the use at the end of the warm-up.
class Watch {
 public:
  Watch(const std::string& unit, std::size_t total)
      : total_(total), begin_(std::chrono::steady_clock::now()) {
    std::printf("%10s %9s %10s %8s %6s %11s\n", unit.c_str(), "seconds", "MiB", "threads", "files",
                "device MiB");
  }

  void at(std::size_t done, const Context* context) {
    if (done * kRows < next_ * total_) return;
    while (next_ * total_ <= done * kRows) ++next_;
    const Use use = use_of(context);
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin_;
    std::printf("%10zu %9.1f %10.1f %8ld %6ld %11.1f\n", done, elapsed.count(),
                static_cast<double>(use.resident) / 256, use.threads, use.files,
                static_cast<double>(use.device) / (1 << 20));
    std::fflush(stdout);
    if (!warm_ && done * kWarmUp >= total_) {
      warm_ = true;
      first_ = use;
    }
    last_ = use;
  }

  bool grew() const {
    return last_.resident > first_.resident + kAllowedPages || last_.threads > first_.threads ||
           last_.files > first_.files || last_.device > first_.device;
  }

 private:
  std::size_t total_, next_ = 1;
  std::chrono::steady_clock::time_point begin_;
  bool warm_ = false;
  Use first_, last_;
};

std::vector<Pair> all_pairs(std::size_t clouds) {
  std::vector<Pair> pairs;
  for (int round = 0; round < 2; ++round)
    for (std::uint32_t a = 0; a < clouds; ++a)
      for (std::uint32_t b = 0; b < clouds; ++b)
        if (a != b) pairs.push_back({a, b});
  return pairs;
}

using Bytes = std::vector<std::vector<char>>;

Bytes bytes_of(const std::vector<RegistrationResult>& results) {
  Bytes out;
  for (const RegistrationResult& r : results) out.push_back(test::bytes(r));
  return out;
}

struct Soak {
  RegistrationOptions options{kVoxelSize};
  std::vector<PointCloud> scans = test::portable_scans();
  std::vector<Pair> pairs = all_pairs(scans.size());  // 84

  std::vector<PreparedCloud> prepare_all(const Context& context) const {
    std::vector<PreparedCloud> out;
    for (const PointCloud& scan : scans) out.push_back(prepare(context, scan.view(), options));
    return out;
  }

  /// Batches on one context; every eighth prepares the clouds anew.
  bool many_pairs(const Context& context, std::size_t total) const {
    std::vector<PreparedCloud> clouds = prepare_all(context);
    const Bytes expected = bytes_of(align_batch(context, clouds, pairs, options));
    std::size_t aligned = 0;
    Watch watch("pairs", total);
    std::size_t done = 0, different = 0;
    for (std::size_t batch = 0; done < total; ++batch) {
      if (batch % 8 == 7) clouds = prepare_all(context);
      const std::vector<RegistrationResult> results = align_batch(context, clouds, pairs, options);
      const Bytes found = bytes_of(results);
      for (std::size_t k = 0; k < found.size(); ++k) {
        different += found[k] != expected[k];
        aligned += results[k].aligned();
      }
      done += found.size();
      watch.at(done, &context);
    }
    std::printf("%zu pairs, %zu aligned, %zu differ from the first time; %s\n\n", done, aligned,
                different, watch.grew() ? "SOMETHING GREW" : "nothing grew");
    return different == 0 && !watch.grew();
  }

  /// A context, two clouds, one pair, and all of it destroyed.
  template <typename Make>
  bool many_contexts(const Make& make, std::size_t total) const {
    Watch watch("contexts", total);
    std::vector<char> expected;
    std::size_t different = 0;
    for (std::size_t k = 0; k < total; ++k) {
      {
        const Context context = make();
        const PreparedCloud a = prepare(context, scans[0].view(), options),
                            b = prepare(context, scans[1].view(), options);
        const std::vector<char> found = test::bytes(align(context, a, b, options));
        if (k == 0) expected = found;
        different += found != expected;
      }
      watch.at(k + 1, nullptr);
    }
    std::printf("%zu contexts, %zu results differ; %s\n", total, different,
                watch.grew() ? "SOMETHING GREW" : "nothing grew");
    return different == 0 && !watch.grew();
  }
};

int run(int count, char** arguments) {
  std::size_t pairs = 100000, contexts = 1000;
  unsigned threads = 2;
  bool cuda = false;
  for (int k = 1; k < count; ++k) {
    const std::string name = arguments[k];
    if (name == "--cuda") {
      cuda = true;
    } else if (k + 1 < count &&
               (name == "--pairs" || name == "--contexts" || name == "--threads")) {
      const std::size_t value = std::stoul(arguments[++k]);
      if (name == "--pairs") pairs = value;
      if (name == "--contexts") contexts = value;
      if (name == "--threads") threads = static_cast<unsigned>(value);
    } else {
      std::cerr << "usage: gpureg_soak [--cuda] [--pairs N] [--contexts N] [--threads N]\n";
      return 2;
    }
  }
  const auto make = [&] { return cuda ? Context::cuda() : Context::cpu(threads); };
  const Soak soak;
  bool good = true;
  try {
    {
      const Context context = make();
      const std::vector<PreparedCloud> clouds = soak.prepare_all(context);
      std::printf("%s; clouds of", context.description().c_str());
      for (const PreparedCloud& cloud : clouds) std::printf(" %zu", cloud.points().size());
      std::printf(" points\n");
      if (pairs > 0) good = soak.many_pairs(context, pairs);
    }
    if (contexts > 0) good = soak.many_contexts(make, contexts) && good;
  } catch (const BackendUnavailable& error) {
    std::cout << error.what() << "\n";
    return 77;
  }
  return good ? 0 : 1;
}

}  // namespace
}  // namespace gpureg

int main(int count, char** arguments) {
  try {
    return gpureg::run(count, arguments);
  } catch (const std::exception& error) {
    std::cerr << "error: " << error.what() << "\n";
    return 1;
  }
}
