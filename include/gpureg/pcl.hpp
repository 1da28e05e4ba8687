// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/common/transforms.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/registration.h>

#include <string>
#include <type_traits>
#include <utility>

#include "gpureg/registration.hpp"

/// Adapters for PCL. Header only: link PCL yourself (common; the adapter also search, kdtree and
/// registration).
namespace gpureg {

/// View of a PCL cloud without a copy: points, normals if PointT has them, and sensor_origin_ as
/// the viewpoint.
/// @tparam PointT any point type with x, y, z.
/// @return a view, valid until the cloud is resized or destroyed.
template <typename PointT>
PointCloudView view_of(const pcl::PointCloud<PointT>& cloud) {
  static_assert(pcl::traits::has_xyz<PointT>::value,
                "gpureg::view_of needs a point type with x, y, z");
  static_assert(sizeof(PointT) % sizeof(float) == 0,
                "gpureg::view_of needs a point type that is a whole number of floats");
  PointCloudView view;
  view.size = cloud.size();
  view.point_stride = sizeof(PointT) / sizeof(float);
  if (!cloud.empty()) view.points = &cloud.points.front().x;
  if constexpr (pcl::traits::has_normal<PointT>::value) {
    view.normal_stride = view.point_stride;
    if (!cloud.empty()) view.normals = &cloud.points.front().normal_x;
  }
  // A zero sensor_origin_ may mean unknown. Without normals the origin is the viewpoint anyway.
  const auto origin = cloud.sensor_origin_.template head<3>();
  if (origin.allFinite() && !(view.normals != nullptr && origin.isZero(0))) {
    view.viewpoints = cloud.sensor_origin_.data();
    view.viewpoint_count = 1;
  }
  return view;
}

/// view_of() with features that replace FPFH. The features describe the points of this very cloud,
/// so prepare it with voxel_size 0.
/// @tparam SignatureT any PCL signature with a histogram (pcl::FPFHSignature33,
///   pcl::VFHSignature308, pcl::Histogram<N>, ...).
/// @param features one per point.
/// @throws InvalidArgument if the clouds differ in size.
template <typename PointT, typename SignatureT>
PointCloudView view_of(const pcl::PointCloud<PointT>& cloud,
                       const pcl::PointCloud<SignatureT>& features) {
  static_assert(sizeof(SignatureT) % sizeof(float) == 0,
                "gpureg::view_of needs a signature that is a whole number of floats");
  if (features.size() != cloud.size())
    throw InvalidArgument("features.size is " + std::to_string(features.size()) +
                          ", expected one per point, " + std::to_string(cloud.size()));
  PointCloudView view = view_of(cloud);
  if (features.empty()) return view;
  view.features = features.points.front().histogram;
  view.feature_dimension = std::extent_v<decltype(SignatureT::histogram)>;
  view.feature_stride = sizeof(SignatureT) / sizeof(float);
  return view;
}

/// Copies a view into a PCL cloud of one row; normals are copied if both sides have them.
/// @throws InvalidArgument as PointCloudView::validate().
template <typename PointT>
pcl::PointCloud<PointT> to_pcl(const PointCloudView& view) {
  view.validate();
  pcl::PointCloud<PointT> cloud;
  cloud.resize(view.size);
  for (std::size_t k = 0; k < view.size; ++k) {
    PointT& point = cloud.points[k];
    point.getVector3fMap() = Eigen::Map<const Eigen::Vector3f>(view.points + k * view.point_stride);
    if (!point.getVector3fMap().allFinite()) cloud.is_dense = false;
    if constexpr (pcl::traits::has_normal<PointT>::value)
      if (view.normals != nullptr)
        point.getNormalVector3fMap() =
            Eigen::Map<const Eigen::Vector3f>(view.normals + k * view.normal_stride);
  }
  if (view.viewpoint_count == 1)
    cloud.sensor_origin_.template head<3>() = Eigen::Map<const Eigen::Vector3f>(view.viewpoints);
  return cloud;
}

/// gpureg with the interface of pcl::Registration: setInputSource, setInputTarget, align,
/// hasConverged, getFinalTransformation and getFitnessScore work as in PCL; setIndices selects
/// points of the source.
///
/// The registration is global: it ignores the guess of align(), and PCL's maximum iterations,
/// epsilons and correspondence distance have no effect. RegistrationOptions hold the settings.
/// Without an alignment hasConverged() is false, the transformation is the identity, and result()
/// has the reason. The target is prepared once for all sources. Throws as prepare() and align().
/// Not thread-safe, like all algorithm objects of PCL; use one per thread (they may share a
/// Context).
template <typename PointSource, typename PointTarget = PointSource>
class PclRegistration : public pcl::Registration<PointSource, PointTarget, float> {
  using Base = pcl::Registration<PointSource, PointTarget, float>;

 public:
  using Ptr = pcl::shared_ptr<PclRegistration>;
  using ConstPtr = pcl::shared_ptr<const PclRegistration>;
  using typename Base::Matrix4;
  using typename Base::PointCloudSource;
  using typename Base::PointCloudTargetConstPtr;

  explicit PclRegistration(RegistrationOptions options = {}, Context context = Context::best())
      : options_(options), context_(std::move(context)) {
    this->reg_name_ = "PclRegistration";
    options_.validate();
  }

  void setInputTarget(const PointCloudTargetConstPtr& cloud) override {
    Base::setInputTarget(cloud);
    prepared_target_ = {};
  }

  /// @throws InvalidArgument naming field and value.
  void setOptions(const RegistrationOptions& options) {
    options.validate();
    options_ = options;
    prepared_target_ = {};
  }
  const RegistrationOptions& getOptions() const { return options_; }

  void setContext(Context context) {
    context_ = std::move(context);
    prepared_target_ = {};
  }
  const Context& getContext() const { return context_; }

  /// @return the full result of the last align(): status and reason, confidence, statistics,
  ///   timings, and the pose in double precision.
  const RegistrationResult& result() const { return result_; }

 protected:
  // output already holds the selected points of the source.
  void computeTransformation(PointCloudSource& output, const Matrix4& /*guess*/) override {
    PointCloudView source = view_of(output);
    source.viewpoints = view_of(*this->input_).viewpoints;
    source.viewpoint_count = source.viewpoints == nullptr ? 0 : 1;
    if (!prepared_target_.valid())
      prepared_target_ = prepare(context_, view_of(*this->target_), options_);
    result_ =
        gpureg::align(context_, prepare(context_, source, options_), prepared_target_, options_);
    this->converged_ = result_.aligned();
    if (!this->converged_) return;
    this->final_transformation_ = this->transformation_ =
        result_.target_from_source.matrix().template cast<float>();
    if constexpr (pcl::traits::has_normal<PointSource>::value)
      pcl::transformPointCloudWithNormals(output, output, this->final_transformation_);
    else
      pcl::transformPointCloud(output, output, this->final_transformation_);
  }

 private:
  RegistrationOptions options_;
  Context context_;
  PreparedCloud prepared_target_;
  RegistrationResult result_;

 public:
  PCL_MAKE_ALIGNED_OPERATOR_NEW
};

}  // namespace gpureg
