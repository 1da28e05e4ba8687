// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/calibration.hpp"

#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <exception>
#include <optional>

#include "cloud_input.hpp"
#include "fields.hpp"

namespace gpureg::python {
namespace {

using PoseArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

py::dict to_dict(const CalibrationCount& count) {
  py::dict out;
  out["pairs"] = count.pairs;
  out["samples"] = count.samples;
  out["correct"] = count.correct;
  return out;
}

/// Raises what the callback raised, Ctrl-C included, between two pieces.
CalibrationResult run(const Context& context, const py::sequence& clouds,
                      const RegistrationOptions options, const CalibrationOptions& calibration,
                      const std::optional<PoseArray>& poses, const py::object& progress) {
  std::vector<Input> inputs;
  std::vector<PointCloudView> views;
  for (const py::handle cloud : clouds) {
    inputs.emplace_back(cloud.cast<py::tuple>());
    views.push_back(inputs.back().view);
  }
  std::vector<UnalignedIsometry3d> world_from_cloud;
  if (poses) {
    if (poses->ndim() != 3 || poses->shape(1) != 4 || poses->shape(2) != 4)
      throw py::type_error("poses: not an array of 4 x 4 matrices");
    for (py::ssize_t k = 0; k < poses->shape(0); ++k) {
      world_from_cloud.push_back(no_pose());
      world_from_cloud.back().matrix() =
          Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(poses->data() + 16 * k);
    }
  }
  std::exception_ptr error;
  const auto guarded = [&](auto&& action) {
    if (error) return;
    const py::gil_scoped_acquire acquire;
    try {
      action();
    } catch (...) {
      error = std::current_exception();
    }
  };
  CalibrationCallbacks callbacks;
  callbacks.on_progress = [&](std::size_t done, std::size_t total) {
    if (!progress.is_none()) guarded([&] { progress(done, total); });
  };
  callbacks.should_stop = [&] {
    guarded([] {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    });
    return error != nullptr;
  };
  CalibrationResult result;
  {
    const py::gil_scoped_release release;
    result = calibrate(context, views, options, calibration, world_from_cloud, callbacks);
  }
  if (error) std::rethrow_exception(error);
  return result;
}

}  // namespace

void bind_calibration(py::module_& m) {
  m.def(
      "calibrate",
      [](const Context& context, const py::sequence& clouds, const RegistrationOptions& options,
         std::uint32_t self_pairs, std::uint32_t scan_pairs, const std::optional<PoseArray>& poses,
         const py::object& progress) {
        CalibrationOptions calibration;
        calibration.self_pairs = self_pairs;
        calibration.scan_pairs = scan_pairs;
        const CalibrationResult result =
            run(context, clouds, options, calibration, poses, progress);
        py::dict out, counts;
        for (const CalibrationKind kind :
             {CalibrationKind::one_scan, CalibrationKind::loop_consistency,
              CalibrationKind::trajectory})
          counts[to_string(kind)] = to_dict(result.count(kind));
        out["calibration"] = result.calibration;
        out["enough_samples"] = result.enough_samples;
        out["error_before"] = result.error_before;
        out["error_after"] = result.error_after;
        out["counts"] = counts;
        py::list confidences, correct, scans;
        for (const CalibrationSample& sample : result.of_two_scans()) {
          confidences.append(sample.confidence);
          correct.append(sample.correct);
          scans.append(py::make_tuple(sample.source, sample.target));
        }
        out["samples"] = py::make_tuple(confidences, correct);
        out["scans"] = scans;
        out["scan_groups"] = result.scan_groups;
        py::list fingerprints;
        for (const py::handle cloud : clouds) {
          const Input input(cloud.cast<py::tuple>());
          if (input.view.size > 0 && !input.on_device)
            fingerprints.append(cloud_fingerprint(input.view));
        }
        out["clouds"] = fingerprints;
        return out;
      },
      py::arg("context"), py::arg("clouds"), py::arg("options"), py::arg("self_pairs"),
      py::arg("scan_pairs"), py::arg("poses"), py::arg("progress"));
  m.def(
      "fit_calibration",
      [](const std::vector<double>& confidences, const std::vector<bool>& correct,
         const std::vector<double>& weights) {
        std::vector<CalibrationSample> samples;
        for (std::size_t k = 0; k < confidences.size(); ++k)
          samples.push_back({confidences[k], correct.at(k), weights.at(k)});
        const CalibrationFit fit = fit_calibration(samples);
        return py::make_tuple(fit.calibration, fit.enough_samples);
      },
      py::arg("confidences"), py::arg("correct"), py::arg("weights"));
  m.def(
      "control_risk",
      [](const std::vector<double>& confidences, const std::vector<bool>& correct,
         const std::optional<std::vector<std::array<std::uint32_t, 2>>>& scans,
         const std::vector<std::uint32_t>& scan_groups,
         const std::optional<std::vector<std::size_t>>& scenes, double max_risk, double max_failure,
         const ConfidenceCalibration& calibration) {
        // Without scenes, all are of the first.
        std::vector<std::vector<CalibrationSample>> samples(scenes ? 0 : 1);
        for (std::size_t k = 0; k < confidences.size(); ++k) {
          const std::size_t scene = scenes ? scenes->at(k) : 0;
          samples.resize(std::max(samples.size(), scene + 1));
          samples[scene].push_back({confidences[k], correct.at(k)});
          if (!scans) continue;
          samples[scene].back().source = scans->at(k)[0];
          samples[scene].back().target = scans->at(k)[1];
        }
        RiskControl control;
        control.max_risk = max_risk;
        control.max_failure = max_failure;
        const RiskThreshold found =
            scenes  ? control_risk_of_scenes(samples, control, calibration)
            : scans ? control_risk_of_scans(samples[0], scan_groups, control, calibration)
                    : control_risk(samples[0], control, calibration);
        py::dict out;
        out["supported"] = found.supported;
        out["min_confidence"] = found.min_confidence;
        out["scans"] = found.scans;
        out["scenes"] = found.scenes;
        out["samples"] = found.samples;
        out["reported"] = found.reported;
        out["wrong"] = found.wrong;
        out["recall"] = found.recall;
        out["more_samples"] = found.more_samples;
        out["more_scans"] = found.more_scans;
        out["more_scenes"] = found.more_scenes;
        return out;
      },
      py::arg("confidences"), py::arg("correct"), py::arg("scans"), py::arg("scan_groups"),
      py::arg("scenes"), py::arg("max_risk"), py::arg("max_failure"), py::arg("calibration"));
}

}  // namespace gpureg::python
