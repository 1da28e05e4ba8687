// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/stl.h>

#include <algorithm>
#include <cstdio>
#include <future>

#include "cloud_input.hpp"
#include "gpureg/registration.hpp"
#include "interrupt.hpp"

namespace gpureg::python {
namespace {

/// Clouds of the host whose viewpoints cannot be what they were seen from: says so, as nothing else
/// would.
void warn_of_viewpoints(const std::vector<Input>& inputs, const std::vector<std::string>& names) {
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    if (inputs[k].on_device) continue;
    const double share = inputs[k].view.share_facing_away();
    if (share <= PointCloudView::kMaxFacingAway) continue;
    char percent[16];
    std::snprintf(percent, sizeof(percent), "%.1f %%", 100 * share);
    const std::string text = (names.empty() ? "" : names[k] + ": ") + "viewpoints: " + percent +
                             " of the normals show all of them their back: are they in the frame "
                             "of the cloud, and do the normals point to where it was seen from?";
    if (PyErr_WarnEx(PyExc_UserWarning, text.c_str(), 2) != 0) throw py::error_already_set();
  }
}

/// Raw points and clouds on a device that are copied at a time: copies of all clouds of a long list
/// would take as much memory as the clouds.
constexpr std::size_t kDevicePoints = std::size_t(1) << 25, kDeviceClouds = 256;

/// Prepares clouds that are on a device.
std::vector<PreparedCloud> prepare_on_device(const Context& context,
                                             const std::vector<const Input*>& inputs,
                                             const RegistrationOptions& options,
                                             const std::vector<std::string>& names) {
  std::vector<PreparedCloud> out;
  for (std::size_t begin = 0, end; begin < inputs.size(); begin = end) {
    std::vector<DevicePointCloudView> views;
    std::vector<CudaStream> streams;
    std::vector<std::string> some_names;
    std::size_t points = 0;
    for (end = begin; end < inputs.size() && end - begin < kDeviceClouds &&
                      (end == begin || points + inputs[end]->view.size <= kDevicePoints);
         ++end) {
      points += inputs[end]->view.size;
      views.push_back(inputs[end]->device_view());
      streams.push_back(inputs[end]->streams[0]);
      if (!names.empty()) some_names.push_back(names[end]);
    }
    for (PreparedCloud& cloud :
         prepare_batch_async(context, views, options, streams, some_names).get())
      out.push_back(std::move(cloud));
  }
  return out;
}

/// Clouds on a device in batches, those of the host as one batch.
std::vector<Cloud> prepare_clouds(const Context& context, const std::vector<Input>& inputs,
                                  const RegistrationOptions& options,
                                  const std::vector<std::string>& names) {
  std::vector<PointCloudView> views;
  std::vector<const Input*> device_inputs;
  std::vector<std::string> view_names, device_names;
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    if (inputs[k].on_device)
      device_inputs.push_back(&inputs[k]);
    else
      views.push_back(inputs[k].view);
    if (!names.empty()) (inputs[k].on_device ? device_names : view_names).push_back(names[k]);
  }
  std::vector<PreparedCloud> on_device =
                                 prepare_on_device(context, device_inputs, options, device_names),
                             hosted = prepare_batch(context, views, options, view_names);
  std::vector<Cloud> out;
  std::size_t next[2] = {0, 0};
  for (const Input& input : inputs)
    out.push_back({std::move(input.on_device ? on_device[next[1]++] : hosted[next[0]++])});
  return out;
}

}  // namespace

void bind_prepare(py::module_& m) {
  m.def(
      "prepare_batch",
      [](const Context& context, const py::sequence& clouds, const RegistrationOptions options,
         const std::vector<std::string>& names) {
        std::vector<Input> inputs;
        for (const py::handle cloud : clouds) inputs.emplace_back(cloud.cast<py::tuple>());
        if (!names.empty() && names.size() != inputs.size())
          throw py::value_error("names: expected one for each cloud");
        if (options.prepare.depth_maps > 0) warn_of_viewpoints(inputs, names);
        std::vector<Cloud> prepared =
            interruptible([&] { return prepare_clouds(context, inputs, options, names); });
        py::list out;
        for (Cloud& cloud : prepared) out.append(py::cast(std::move(cloud)));
        return out;
      },
      py::arg("context"), py::arg("clouds"), py::arg("options"),
      py::arg("names") = std::vector<std::string>());
}

}  // namespace gpureg::python
