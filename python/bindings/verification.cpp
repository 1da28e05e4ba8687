// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/verification.hpp"

#include <pybind11/stl.h>

#include <cstdio>

#include "cloud.hpp"
#include "interrupt.hpp"
#include "matrix.hpp"

namespace gpureg::python {
namespace {

using PoseArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// (K, 4, 4) poses; the package has checked the shape.
std::vector<UnalignedIsometry3d> poses_of(const PoseArray& array) {
  if (array.ndim() != 3 || array.shape(1) != 4 || array.shape(2) != 4)
    throw py::type_error("poses: not an array of 4 x 4 matrices");
  std::vector<UnalignedIsometry3d> poses(static_cast<std::size_t>(array.shape(0)));
  for (std::size_t k = 0; k < poses.size(); ++k)
    poses[k].matrix() =
        Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(array.data() + 16 * k);
  return poses;
}

std::vector<PoseVerification> verify(const Context& context, const Cloud& source,
                                     const Cloud& target, const PoseArray& poses,
                                     const RegistrationOptions options, bool refine,
                                     bool search_alternatives) {
  const std::vector<UnalignedIsometry3d> given = poses_of(poses);
  VerificationOptions verification;
  verification.refine = refine;
  verification.search_alternatives = search_alternatives;
  return interruptible([&] {
    return verify_poses(context, source.prepared, target.prepared, given, options, verification);
  });
}

}  // namespace

void bind_verification(py::module_& m) {
  using V = PoseVerification;
  py::class_<V>(m, "PoseVerification", "Evidence and confidence of one pose.")
      .def_property_readonly(
          "target_from_source", [](const V& v) { return array_of(v.target_from_source.matrix()); },
          "(4, 4) float64: as given, or refined.")
      .def_readonly("confidence", &V::confidence, "Probability that the pose is correct.")
      .def_readonly("overlap_confidence", &V::overlap_confidence,
                    "Probability that the pose is correct and the clouds overlap by 30 % or more.")
      .def_readonly("evidence", &V::evidence, "Evidence for and against the pose.")
      .def_readonly("inliers", &V::inliers, "Points of the moved cloud that overlap.")
      .def_readonly("points", &V::points, "Points of the moved cloud.")
      .def_readonly("inlier_ratio", &V::inlier_ratio, "Inliers over points, [0, 1].")
      .def_readonly("inlier_rmse", &V::inlier_rmse, "Metres, over the inliers.")
      .def_readonly("source_moments", &V::source_moments,
                    "Of all correspondences: points of the source, in its frame.")
      .def_readonly("target_moments", &V::target_moments,
                    "Of all correspondences: points of the target, in its frame.")
      .def("__repr__", [](const V& v) {
        char text[96];
        std::snprintf(text, sizeof(text), "<gpureg.PoseVerification, confidence %.3f>",
                      v.confidence);
        return std::string(text);
      });
  m.def("verify", &verify, py::arg("context"), py::arg("source"), py::arg("target"),
        py::arg("poses"), py::arg("options"), py::arg("refine"), py::arg("search_alternatives"));
}

}  // namespace gpureg::python
