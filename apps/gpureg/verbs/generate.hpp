// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace gpureg::cli {

/// Goes on as the program gpureg-generate, with the arguments after the verb. The generator is a
/// program of its own so that the command builds quickly, and without Embree.
/// @throws BackendUnavailable where the program is not there.
[[noreturn]] void become_generator(char** argv);

}  // namespace gpureg::cli
