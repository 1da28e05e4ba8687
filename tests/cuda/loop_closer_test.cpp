// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/gpu.hpp"
#include "loop_closure/scans.hpp"

namespace gpureg::test {
namespace {

TEST(LoopCloserOnCuda, TheBitsDoNotDependOnTheBackend) {
  GPUREG_GPU_OR_SKIP();
  const Scans scans = scans_of_one_room(5);
  const auto drive = [&](const Context& context) {
    LoopCloser closer(context, quick_options());
    scans.add_to(closer, context, 0, 4);
    closer.process();
    scans.add_to(closer, context, 4, 5);
    closer.process();
    EXPECT_GE(closer.loops().size(), 5u);
    return bytes_of(closer);
  };
  EXPECT_EQ(drive(Context::cpu(2)), drive(Context::cuda()));
}

}  // namespace
}  // namespace gpureg::test
