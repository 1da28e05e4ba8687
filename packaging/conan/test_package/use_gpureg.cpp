// SPDX-License-Identifier: BSD-3-Clause
// Aligns a bent sheet with itself, moved.
#include <gpureg/registration.hpp>
#include <iostream>

int main() {
  std::vector<Eigen::Vector3f> source, target;
  for (int i = 0; i < 60; ++i)
    for (int j = 0; j < 40; ++j) {
      const float x = 0.05f * static_cast<float>(i), y = 0.05f * static_cast<float>(j);
      const float z = 0.3f * x * y - 0.2f * x * x + (x > 1 && y > 1 ? 0.4f : 0.0f);
      source.emplace_back(x, y, z);
      target.emplace_back(y + 1, -x, z + 2);
    }
  const gpureg::RegistrationOptions options{0.05f};
  const auto result = gpureg::align(gpureg::Context::cpu(), gpureg::PointCloudView(source),
                                    gpureg::PointCloudView(target), options);
  std::cout << explain(result.reason) << "\n" << result.target_from_source.matrix() << "\n";
  return result.has_pose() ? 0 : 1;
}
