// SPDX-License-Identifier: BSD-3-Clause
#include "sets/prepare_fragments.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <deque>
#include <numeric>
#include <utility>

#include "common/fnv1a.hpp"
#include "common/for_each_on.hpp"
#include "gpureg/error.hpp"
#include "gpureg/registration.hpp"

namespace gpureg {
namespace sets {
namespace {

// One batch for prepare_batch(): enough to fill a device, little beside the memory of a long run.
constexpr std::size_t kChunkClouds = 32, kChunkPoints = 4'000'000;
constexpr double kPieceSeconds = 0.4;  // of the CPU, between two looks at go_on

/// The cloud without these ascending rows, in memory of its own.
LoadedCloud without(const std::vector<std::uint32_t>& rows, const PointCloudView& view) {
  PointCloud out;
  std::size_t next = 0;
  for (std::size_t k = 0; k < view.size; ++k) {
    if (next < rows.size() && rows[next] == k) {
      ++next;
      continue;
    }
    out.points.emplace_back(view.points + k * view.point_stride);
    if (view.normals != nullptr) out.normals.emplace_back(view.normals + k * view.normal_stride);
  }
  for (std::size_t k = 0; k < view.viewpoint_count; ++k)
    out.viewpoints.emplace_back(view.viewpoints + 3 * k);
  out.model = view.model;
  out.origin = Eigen::Vector3d(view.origin);
  LoadedCloud cloud(std::move(out));
  cloud.view.infer_viewpoint = view.infer_viewpoint;
  return cloud;
}

/// Whether points may be left out. Of a view that contradicts itself, prepare_batch() says so.
bool is_plain(const PointCloudView& view) {
  try {
    view.validate();
  } catch (const InvalidArgument&) {
    return false;
  }
  return view.features == nullptr;
}

FixedParts parts_of(const std::vector<LoadedCloud>& clouds) {
  std::vector<PointCloudView> views;
  for (const LoadedCloud& cloud : clouds)
    if (is_plain(cloud.view)) views.push_back(cloud.view);
  return find_fixed_parts(views);
}

}  // namespace

/// Clouds that are in memory together.
struct Preparer::Chunk {
  std::vector<std::size_t> places;  // among those that are asked for
  std::vector<LoadedCloud> clouds;
  std::vector<std::string> names;
  std::vector<std::size_t> fixed_points;
  std::size_t points = 0;

  void add(std::size_t place, LoadedCloud cloud, std::string name) {
    points += cloud.view.size;
    places.push_back(place);
    clouds.push_back(std::move(cloud));
    names.push_back(std::move(name));
    fixed_points.push_back(0);
  }
  bool full() const { return clouds.size() >= kChunkClouds || points >= kChunkPoints; }
};

void Preparer::leave_out_parts(Chunk& chunk) {
  if (!parts_) parts_ = parts_of(chunk.clouds);
  if (parts_->cells.empty()) return;
  for (std::size_t k = 0; k < chunk.clouds.size(); ++k) {
    LoadedCloud& cloud = chunk.clouds[k];
    if (!is_plain(cloud.view)) continue;
    const std::vector<std::uint32_t> rows = rows_in(*parts_, cloud.view);
    if (rows.empty()) continue;
    chunk.fixed_points[k] = rows.size();
    cloud = without(rows, cloud.view);
  }
}

void Preparer::find_parts() {
  Chunk chunk;
  for (std::size_t k = 0; k < fragments_.size() && !chunk.full(); ++k) try {
      chunk.add(k, fragments_.read(k, options_), "");
    } catch (const IoError&) {  // whoever asks for it hears it
    }
  parts_ = parts_of(chunk.clouds);
}

/// Together, and one by one if one of them cannot be prepared. False: ended.
bool Preparer::prepare_chunk(Chunk& chunk, std::vector<PreparedFragment>& out,
                             const std::function<bool(std::size_t)>& go_on) {
  const auto prepare_some = [&](std::size_t begin, std::size_t end) {
    std::vector<PointCloudView> views;
    for (std::size_t k = begin; k < end; ++k) views.push_back(chunk.clouds[k].view);
    const std::vector<std::string> names(chunk.names.begin() + static_cast<std::ptrdiff_t>(begin),
                                         chunk.names.begin() + static_cast<std::ptrdiff_t>(end));
    std::vector<PreparedCloud> clouds = prepare_batch(context_, views, options_, names);
    for (std::size_t k = begin; k < end; ++k)
      out[chunk.places[k]] = {std::move(clouds[k - begin]), "", chunk.fixed_points[k]};
  };
  // Fewer clouds than threads would leave threads without work.
  const std::size_t least =
      context_.backend() == Backend::cpu ? context_.threads() : chunk.clouds.size();
  std::size_t piece = least;
  for (std::size_t begin = 0; begin < chunk.clouds.size();) {
    const std::size_t end = std::min(chunk.clouds.size(), begin + piece);
    const auto start = std::chrono::steady_clock::now();
    try {
      prepare_some(begin, end);
    } catch (const InvalidArgument&) {
      for (std::size_t k = begin; k < end; ++k) try {
          prepare_some(k, k + 1);
        } catch (const InvalidArgument& error) {
          out[chunk.places[k]].reason = error.what();
        }
    }
    if (go_on && !go_on(chunk.places[end - 1] + 1)) return false;
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const double fitting =
        kPieceSeconds * static_cast<double>(end - begin) / std::max(seconds, 1e-6);
    piece = std::max(
        least, static_cast<std::size_t>(std::min(fitting, static_cast<double>(kChunkClouds))));
    begin = end;
  }
  return true;
}

std::vector<PreparedFragment> Preparer::prepare(const std::vector<std::size_t>& which,
                                                const std::function<bool(std::size_t)>& go_on) {
  struct Read {
    LoadedCloud cloud;
    std::string reason;
  };
  std::vector<PreparedFragment> out(which.size());
  std::deque<Read> ahead;
  std::size_t done = 0;
  while (done < which.size()) {
    const std::size_t begin = done;
    if (go_on && !go_on(done)) {
      out.resize(done);
      return out;
    }
    Chunk chunk;
    for (; done < which.size() && !chunk.full(); ++done) {
      if (ahead.empty()) {
        const std::size_t count = std::min(fragments_.readers(), which.size() - done);
        ahead.resize(count);
        for_each_on(count, count, [&](std::size_t k) {
          try {
            ahead[k].cloud = fragments_.read(which[done + k], options_);
          } catch (const IoError& error) {
            ahead[k].reason = error.what();
          }
        });
      }
      if (ahead.front().reason.empty())
        chunk.add(done, std::move(ahead.front().cloud), fragments_.label(which[done]));
      else
        out[done].reason = std::move(ahead.front().reason);
      ahead.pop_front();
    }
    leave_out_parts(chunk);
    if (!prepare_chunk(chunk, out, go_on)) {
      out.resize(begin);
      return out;
    }
  }
  if (go_on) go_on(done);  // the last ones may have had no cloud
  return out;
}

}  // namespace sets

LoadedCloud::LoadedCloud(PointCloud cloud) {
  auto owned = std::make_shared<const PointCloud>(std::move(cloud));
  view = owned->view();
  owner = std::move(owned);
}

std::vector<PreparedCloud> clouds_of(const std::vector<PreparedFragment>& fragments) {
  std::vector<PreparedCloud> out;
  for (const PreparedFragment& fragment : fragments) out.push_back(fragment.cloud);
  return out;
}

std::string FragmentSet::fingerprint(std::size_t k) const {
  return fingerprint_of(read(k, {}).view);
}

std::string fingerprint_of(const PointCloudView& view) {
  Fnv1a sum;
  const auto add = [&](const float* rows, std::size_t count, std::size_t stride) {
    sum.add(rows != nullptr ? count : 0);
    for (std::size_t row = 0; rows != nullptr && row < count; ++row)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        std::uint32_t bits;
        std::memcpy(&bits, rows + row * stride + axis, sizeof bits);
        sum.add(bits);
      }
  };
  add(view.points, view.size, view.point_stride);
  add(view.normals, view.size, view.normal_stride);
  add(view.viewpoints, view.viewpoint_count, 3);
  for (const double& x : view.origin) {
    std::uint64_t bits;
    std::memcpy(&bits, &x, sizeof bits);
    sum.add(bits);
  }
  char digits[17];
  std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(sum.value()));
  return digits;
}

std::vector<PreparedFragment> prepare_all(const Context& context, const FragmentSet& fragments,
                                          const RegistrationOptions& options,
                                          const SetCallbacks& callbacks) {
  options.validate();
  std::vector<std::size_t> all(fragments.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return sets::Preparer(context, fragments, options).prepare(all, [&](std::size_t done) {
    if (callbacks.on_progress) callbacks.on_progress(done);
    return !(callbacks.should_stop && callbacks.should_stop());
  });
}

}  // namespace gpureg
