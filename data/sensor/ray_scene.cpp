// SPDX-License-Identifier: BSD-3-Clause
#include "data/sensor/ray_scene.hpp"

#if GPUREG_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <cstring>
#include <limits>
#include <string>

#include "gpureg/error.hpp"

namespace gpureg::synthetic {

struct RayScene::Embree {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  ~Embree() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

RayScene::RayScene(const Mesh& mesh) : mesh_(mesh), embree_(std::make_unique<Embree>()) {
  // One build thread: the tree, and with it which of two coincident triangles is hit, must not
  // depend on the machine's load.
  embree_->device = rtcNewDevice("threads=1,user_threads=1");
  if (embree_->device == nullptr) {
    throw Error("Embree cannot start (error " + std::to_string(rtcGetDeviceError(nullptr)) + ")");
  }
  RTCGeometry geometry = rtcNewGeometry(embree_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           sizeof(Eigen::Vector3f), mesh.vertices.size());
  void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                          sizeof(mesh.triangles[0]), mesh.triangles.size());
  if (vertices != nullptr && indices != nullptr) {
    std::memcpy(vertices, mesh.vertices.data(), mesh.vertices.size() * sizeof(Eigen::Vector3f));
    std::memcpy(indices, mesh.triangles.data(), mesh.triangles.size() * sizeof(mesh.triangles[0]));
    rtcCommitGeometry(geometry);
    embree_->scene = rtcNewScene(embree_->device);
    rtcSetSceneFlags(embree_->scene,
                     RTC_SCENE_FLAG_ROBUST);  // no leaks between the triangles of a wall
    rtcAttachGeometry(embree_->scene, geometry);
    rtcCommitScene(embree_->scene);
  }
  rtcReleaseGeometry(geometry);
  const RTCError error = rtcGetDeviceError(embree_->device);
  if (error != RTC_ERROR_NONE)
    throw Error("Embree cannot build the scene (error " + std::to_string(error) + ")");
}

RayScene::~RayScene() = default;

RayHit RayScene::cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) const {
  RTCRayHit ray;
  ray.ray.org_x = origin.x();
  ray.ray.org_y = origin.y();
  ray.ray.org_z = origin.z();
  ray.ray.dir_x = direction.x();
  ray.ray.dir_y = direction.y();
  ray.ray.dir_z = direction.z();
  ray.ray.tnear = 0;
  ray.ray.tfar = std::numeric_limits<float>::infinity();
  ray.ray.time = 0;
  ray.ray.mask = 0xFFFFFFFFu;
  ray.ray.id = 0;
  ray.ray.flags = 0;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if GPUREG_EMBREE_MAJOR >= 4
  rtcIntersect1(embree_->scene, &ray);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect1(embree_->scene, &context, &ray);
#endif
  RayHit result;
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return result;
  result.hit = true;
  result.t = ray.ray.tfar;
  result.normal = Eigen::Vector3f(ray.hit.Ng_x, ray.hit.Ng_y, ray.hit.Ng_z).normalized();
  if (result.normal.dot(direction) > 0) result.normal = -result.normal;
  result.triangle = ray.hit.primID;
  return result;
}

}  // namespace gpureg::synthetic
