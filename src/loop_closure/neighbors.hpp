// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "loop_closure/state.hpp"

namespace gpureg::loop_closure {

/// A loop implies where the neighbours of both fragments lie to each other, as far as odometry
/// knows them: if they contradict that, the first mode loses confidence. Places that look alike
/// differ in what is beside them.
/// @param records of this state's fragments, just registered.
/// @throws what verify_poses_batch() throws; the records may be changed then.
void hear_neighbors(const Context& context, const State& state, const Options& options,
                    std::vector<LoopRecord>& records);

}  // namespace gpureg::loop_closure
