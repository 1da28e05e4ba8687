// SPDX-License-Identifier: BSD-3-Clause
#include <fstream>

#include "files/envelope.hpp"
#include "fuzz/targets.hpp"
#include "gpureg/evaluation/trajectory.hpp"
#include "gpureg/pose_graph/files.hpp"
#include "gpureg/pose_graph/optimize.hpp"
#include "gpureg/registration.hpp"
#include "io/run_reader.hpp"
#include "loop_closure/saving/saved_state.hpp"

namespace gpureg::fuzz {
namespace {

template <test::Reader reader>
void read(std::string_view bytes) {
  test::run_reader(reader, bytes);
}

/// What a reader accepts must be a graph that the library optimises, and that it can write and read
/// again.
template <typename Read, typename Write>
void check_graph(std::string_view bytes, const Read& read_graph, const Write& write_graph) {
  const test::MemoryFile file(bytes);
  pose_graph::Graph graph;
  try {
    graph = read_graph(file.path());
  } catch (const IoError& error) {
    if (std::string_view(error.what()).find(file.path()) == std::string_view::npos)
      broken("an error names its file");
    return;
  }
  graph.validate();
  pose_graph::Options options;
  options.threads = 1;
  for (const UnalignedIsometry3d& pose : pose_graph::optimize(graph, options).world_from_node)
    if (!pose.matrix().allFinite()) broken("poses are finite");
  static const std::string copy = "/dev/shm/gpureg-fuzz-" + std::to_string(::getpid());
  try {
    write_graph(copy, graph);
  } catch (const InvalidArgument&) {
    return;  // the format cannot hold every graph
  }
  const std::size_t edges = read_graph(copy).edges.size();
  ::unlink(copy.c_str());
  if (edges != graph.edges.size()) broken("a written graph reads back");
}

/// In every format, and against itself.
void read_trajectory(std::string_view bytes) {
  using evaluation::TrajectoryFormat;
  const test::MemoryFile file(bytes);
  for (const TrajectoryFormat format : {TrajectoryFormat::automatic, TrajectoryFormat::tum,
                                        TrajectoryFormat::kitti, TrajectoryFormat::blocks}) {
    try {
      const evaluation::Trajectory poses = evaluation::read_trajectory(file.path(), format);
      if (poses.empty()) broken("a trajectory has a pose");
      for (std::size_t k = 1; k < poses.size(); ++k)
        if (!(poses[k - 1].time < poses[k].time)) broken("times ascend");
      evaluation::evaluate_trajectory(poses, poses);
    } catch (const IoError& error) {
      if (std::string_view(error.what()).find(file.path()) == std::string_view::npos)
        broken("an error names its file");
    } catch (const InvalidArgument&) {
      // Too few poses.
    }
  }
}

/// Scans of KITTI are known by their name alone.
void read_kitti(std::string_view bytes) {
  static const std::string path = "/dev/shm/gpureg-fuzz-" + std::to_string(::getpid()) + ".bin";
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<long>(bytes.size()));
  try {
    if (io::read_point_cloud(path).points.size() * 16 != bytes.size()) broken("a row is a point");
  } catch (const IoError& error) {
    if (std::string_view(error.what()).find(path) == std::string_view::npos)
      broken("an error names its file");
  }
  ::unlink(path.c_str());
}

/// The input is what follows the header: no mutation finds a checksum.
std::string with_header(std::string_view payload) {
  files::Envelope envelope;
  envelope.add(payload);
  return envelope.header({"gpuregLC", 2, ""}) + std::string(payload);
}

void read_saved_state(std::string_view bytes) {
  const std::string path = "saved", content = with_header(bytes);
  try {
    const loop_closure::State state = loop_closure::from_bytes(content, path);
    const std::string again = loop_closure::to_bytes(state);
    if (loop_closure::to_bytes(loop_closure::from_bytes(again, path)) != again)
      broken("a state reads back");
  } catch (const IoError& error) {
    if (std::string_view(error.what()).find(path) == std::string_view::npos)
      broken("an error names its file");
  }
}

/// Whatever is read as a state can be gone on with.
void go_on_from_saved_state(std::string_view bytes) {
  static const Context context = Context::cpu(1);
  static const PreparedCloud cloud = [] {
    PointCloud points;
    for (int k = 0; k < 90; ++k) {
      const float x = 0.1f * static_cast<float>(k % 10), y = 0.1f * static_cast<float>(k / 10);
      points.points.emplace_back(x, y, x * y - 0.3f * x);
    }
    return prepare(context, points.view());
  }();
  static const std::string path = "/dev/shm/gpureg-fuzz-" + std::to_string(::getpid());
  loop_closure::State state;
  try {
    state = loop_closure::from_bytes(with_header(bytes), path);
  } catch (const IoError&) {
    return;
  }
  loop_closure::FragmentId unused = 0;
  for (auto& [id, node] : state.nodes) {
    node.fingerprint = loop_closure::fingerprint_of(cloud);
    if (id == unused) ++unused;
  }
  loop_closure::Options options;
  state.voxel_size = options.registration.voxel_size;
  std::ofstream(path, std::ios::binary) << loop_closure::to_bytes(state);
  options.registration.quality = 0;
  options.graph.threads = 1;
  loop_closure::LoopCloser closer(context, options);
  closer.load(path, [](loop_closure::FragmentId) { return cloud; });
  loop_closure::ProcessLimits limits;
  limits.registrations = 1;
  closer.process(limits);
  closer.add({unused, 0, 0, cloud});
  if (!state.nodes.empty()) {
    closer.add_odometry(unused, state.nodes.begin()->first, UnalignedIsometry3d::Identity());
    closer.process(limits);
    closer.remove(state.nodes.begin()->first);
  }
  closer.process(limits);
  for (const loop_closure::FragmentPose& pose : closer.poses())
    if (!pose.world_from_fragment.matrix().allFinite()) broken("poses are finite");
  closer.save(path);
  closer.load(path, [](loop_closure::FragmentId) { return cloud; });
  ::unlink(path.c_str());
}

void read_g2o(std::string_view bytes) {
  check_graph(
      bytes, [](const std::string& path) { return pose_graph::read_g2o(path); },
      [](const std::string& path, const pose_graph::Graph& g) { pose_graph::write_g2o(path, g); });
}

void read_open3d(std::string_view bytes) {
  check_graph(
      bytes, [](const std::string& path) { return pose_graph::read_open3d(path); },
      [](const std::string& path, const pose_graph::Graph& graph) {
        pose_graph::write_open3d(path, graph);
      });
}

}  // namespace

std::vector<Target> file_targets() {
  using test::Reader;
  return {{"point_cloud", read<Reader::point_cloud>},
          {"log", read<Reader::log>},
          {"information", read<Reader::information>},
          {"cameras", read<Reader::cameras>},
          {"pairs", read<Reader::pairs>},
          {"trajectory", read_trajectory},
          {"kitti", read_kitti},
          {"g2o", read_g2o},
          {"open3d", read_open3d},
          {"saved_state", read_saved_state},
          {"loop_closer", go_on_from_saved_state}};
}

}  // namespace gpureg::fuzz
