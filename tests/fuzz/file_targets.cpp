// SPDX-License-Identifier: BSD-3-Clause
#include "fuzz/targets.hpp"
#include "gpureg/pose_graph/files.hpp"
#include "io/run_reader.hpp"

namespace gpureg::fuzz {
namespace {

template <test::Reader reader>
void read(std::string_view bytes) {
  test::run_reader(reader, bytes);
}

/// What a reader accepts must be a graph that the library takes, and that it can write and read
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
  const test::MemoryFile copy("");
  try {
    write_graph(copy.path(), graph);
  } catch (const InvalidArgument&) {
    return;  // the format cannot hold every graph
  }
  if (read_graph(copy.path()).edges.size() != graph.edges.size())
    broken("a written graph reads back");
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
          {"g2o", read_g2o},
          {"open3d", read_open3d}};
}

}  // namespace gpureg::fuzz
