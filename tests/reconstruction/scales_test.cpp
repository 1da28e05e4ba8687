// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/reconstruction/scales.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "pose_graph/se3.hpp"
#include "reconstruction/scales/log_scale_graph.hpp"
#include "reconstruction/scales/similarity_graph.hpp"
#include "support/expect_error.hpp"
#include "support/scan.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::test {
namespace {

using reconstruction::Similarity;
using reconstruction::SimilarityEdge;

reconstruction::SearchedPair searched(std::size_t source, std::size_t target,
                                      std::vector<ScaleCandidate> candidates) {
  return {source, target, std::move(candidates), 0.001};
}

TEST(LogScaleGraph, LoopsTellTheScalesAndAFalseOne) {
  const std::vector<double> truth{1, 3, 0.2, 7, 5};
  std::vector<reconstruction::SearchedPair> pairs;
  const auto add = [&](std::size_t source, std::size_t target, double factor) {
    pairs.push_back(searched(source, target, {{factor * truth[source] / truth[target], 0.9}}));
  };
  for (std::size_t k = 1; k < truth.size(); ++k) add(k, k - 1, 1.002);
  for (std::size_t k = 2; k < truth.size(); ++k) add(k, k - 2, 0.999);
  add(4, 0, 1.9);  // of a wrong pose
  const reconstruction::AgreedScales agreed = reconstruction::agreed_scales(truth.size(), pairs);
  for (std::size_t k = 0; k < truth.size(); ++k) {
    EXPECT_NEAR(std::exp(agreed.log_scales[k]) / truth[k], 1, 0.01);
    EXPECT_EQ(agreed.parts[k], 0u);
    EXPECT_EQ(agreed.settled[k], agreed.settled[0]);
  }
}

TEST(LogScaleGraph, ASecondCandidateIsTakenWhereTheOthersWantIt) {
  const auto agreed = reconstruction::agreed_scales(
      3, {searched(1, 0, {{2, 0.95}}), searched(2, 1, {{2, 0.95}}),
          searched(2, 0, {{9, 0.5}, {4.02, 0.4}}), searched(2, 0, {{4, 0.9}})});
  EXPECT_NEAR(std::exp(agreed.log_scales[2]), 4, 0.05);
  EXPECT_EQ(agreed.settled[2], agreed.settled[0]);
}

TEST(LogScaleGraph, OneDoubtfulPairConnectsNothing) {
  const auto agreed = reconstruction::agreed_scales(
      4, {searched(1, 0, {{2, 0.95}}), searched(3, 2, {{3, 0.6}}), searched(2, 1, {})});
  EXPECT_EQ(agreed.parts, (std::vector<std::uint32_t>{0, 0, 1, 2}));
  EXPECT_EQ(agreed.settled, (std::vector<std::uint32_t>{0, 1, 2, 3}));  // a loop confirms nothing
  EXPECT_EQ(agreed.log_scales[2], 0);
}

/// Nodes on a circle with scales of their own, and the exact edges between them.
struct Circle {
  std::vector<Similarity> nodes;
  std::vector<SimilarityEdge> edges;

  explicit Circle(int count) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (int k = 0; k < count; ++k) {
      Similarity node;
      node.rigid = random_pose(random);
      node.rigid.translation() =
          Eigen::Vector3d(5 * std::cos(0.5 * k), 5 * std::sin(0.5 * k), unit(random));
      node.scale = 1 + 0.1 * unit(random);
      nodes.push_back(node);
    }
    nodes[0].scale = 1;
    for (int k = 0; k < count; ++k)
      for (const int step : {1, 2}) add((k + step) % count, k, random);
  }
  void add(int source, int target, std::mt19937& random) {
    std::uniform_real_distribution<double> unit(-1, 1);
    const Similarity &s = nodes[static_cast<std::size_t>(source)],
                     &t = nodes[static_cast<std::size_t>(target)];
    SimilarityEdge edge;
    edge.source = static_cast<std::size_t>(source);
    edge.target = static_cast<std::size_t>(target);
    edge.centre = {unit(random), unit(random), 2 + unit(random)};
    edge.target_from_source.linear() = t.rigid.linear().transpose() * s.rigid.linear();
    edge.log_scale = std::log(s.scale / t.scale);
    const Eigen::Vector3d there =
        t.rigid.linear().transpose() * (s * edge.centre - t.rigid.translation()) / t.scale;
    edge.target_from_source.translation() = there - edge.target_from_source.linear() * edge.centre;
    edge.information.setIdentity();
    edge.information.topLeftCorner<3, 3>() *= 1e4;
    edge.information.bottomRightCorner<3, 3>() *= 1e3;
    edge.scale_information = 1e4;
    edges.push_back(edge);
  }
};

TEST(SimilarityGraph, FindsTheNodesOfExactEdges) {
  const Circle circle(8);
  std::vector<Similarity> found = circle.nodes;
  std::mt19937 random(9);
  std::normal_distribution<double> noise(0, 0.05);
  for (std::size_t k = 1; k < found.size(); ++k) {
    const Eigen::Vector3d turn(noise(random), noise(random), noise(random));
    found[k].rigid.linear() *= pose_graph::exp_rotation(turn);
    found[k].rigid.translation() += Eigen::Vector3d(noise(random), noise(random), noise(random));
    found[k].scale *= 1 + noise(random);
  }
  std::vector<char> held(found.size(), 0);
  held[0] = 1;
  ASSERT_TRUE(reconstruction::solve_similarities(circle.edges, held, found));
  for (std::size_t k = 0; k < found.size(); ++k) {
    EXPECT_NEAR(found[k].scale, circle.nodes[k].scale, 1e-8);
    EXPECT_LT((found[k].rigid.matrix() - circle.nodes[k].rigid.matrix()).norm(), 1e-7);
  }
}

// The least squares are where no small motion of a node lowers the sum.
TEST(SimilarityGraph, IsAMinimumOfNoisyEdges) {
  Circle circle(7);
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0, 0.01);
  for (SimilarityEdge& edge : circle.edges) {
    edge.log_scale += noise(random);
    edge.target_from_source.translation() +=
        Eigen::Vector3d(noise(random), noise(random), noise(random));
    const Eigen::Vector3d turn(noise(random), noise(random), noise(random));
    edge.target_from_source.linear() *= pose_graph::exp_rotation(turn);
  }
  const auto cost = [&](const std::vector<Similarity>& nodes) {
    double sum = 0;
    for (const SimilarityEdge& edge : circle.edges) {
      const Similarity &s = nodes[edge.source], &t = nodes[edge.target];
      const Eigen::Vector3d arm =
          t.rigid.linear().transpose() * (s * edge.centre - t.rigid.translation()) / t.scale;
      const Eigen::Matrix3d back = edge.target_from_source.linear().transpose();
      Eigen::Matrix<double, 6, 1> e;
      e.head<3>() =
          pose_graph::log_rotation(back * t.rigid.linear().transpose() * s.rigid.linear());
      e.tail<3>() = back * (arm - edge.target_from_source * edge.centre) +
                    edge.centre.cross(Eigen::Vector3d(e.head<3>()));
      const double grown = std::log(s.scale / t.scale) - edge.log_scale;
      sum += e.dot(edge.information * e) + edge.scale_information * grown * grown;
    }
    return sum;
  };
  std::vector<Similarity> found = circle.nodes;
  std::vector<char> held(found.size(), 0);
  held[0] = 1;
  ASSERT_TRUE(reconstruction::solve_similarities(circle.edges, held, found));
  const double least = cost(found);
  EXPECT_LT(least, cost(circle.nodes));
  for (std::size_t k = 1; k < found.size(); ++k)
    for (int unknown = 0; unknown < 7; ++unknown)
      for (const double step : {-1e-3, 1e-3}) {
        std::vector<Similarity> other = found;
        if (unknown == 6) other[k].scale *= std::exp(step);
        if (unknown < 3) {
          Eigen::Vector3d turn = Eigen::Vector3d::Zero();
          turn[unknown] = step;
          other[k].rigid.linear() *= pose_graph::exp_rotation(turn);
        } else if (unknown < 6) {
          other[k].rigid.translation()[unknown - 3] += step;
        }
        EXPECT_GT(cost(other), least);
      }
  EXPECT_EQ(found[0].scale, circle.nodes[0].scale);
}

/// Scans of one room, each in a unit of its own.
struct ScaledRooms {
  std::vector<double> factors{1, 1.5, 0.8, 1.2};  ///< of the first's unit
  std::vector<Eigen::Isometry3d> world_from_scan;
  std::vector<std::vector<Eigen::Vector3f>> clouds;

  ScaledRooms() {
    std::mt19937 random(4);
    for (const double factor : factors) {
      world_from_scan.push_back(random_pose(random));
      std::vector<Eigen::Vector3f> points;
      const auto all = moved(world_from_scan.back().inverse(), scan_room(random));
      for (std::size_t k = 0; k < all.size(); k += 4)
        points.push_back((all[k].cast<double>() / factor).cast<float>());
      clouds.push_back(std::move(points));
    }
  }
  FragmentsOf fragments() const {
    std::vector<std::string> names;
    for (std::size_t k = 0; k < clouds.size(); ++k) names.push_back(std::to_string(k));
    return {names, [this](std::size_t k) {
              PointCloud cloud;
              cloud.points = clouds[k];
              return cloud;
            }};
  }
};

TEST(ScaledMap, OfScansInUnitsOfTheirOwn) {
  const ScaledRooms rooms;
  const FragmentsOf fragments = rooms.fragments();
  const Context context = Context::cpu(2);
  std::size_t told = 0, total = 0;
  reconstruction::ScaleSearch search;
  search.range = {0.5, 2};
  search.on_progress = [&](std::size_t done, std::size_t all) {
    EXPECT_GE(done, told);
    told = done;
    total = all;
  };
  const auto found =
      reconstruction::find_scales(context, fragments, RegistrationOptions{0.1f}, search).scans;
  EXPECT_EQ(told, 6u);
  EXPECT_EQ(total, 6u);
  ASSERT_EQ(found.size(), rooms.factors.size());
  std::vector<double> scales;
  for (std::size_t k = 0; k < found.size(); ++k) {
    EXPECT_EQ(found[k].part, 0u);
    EXPECT_NEAR(found[k].scale / rooms.factors[k], 1, 0.02);
    scales.push_back(found[k].scale);
  }
  scales[1] *= 1.02;  // the map mends it
  reconstruction::MapOptions options{RegistrationOptions{0.1f}};
  const reconstruction::ScaledMapOfSet map =
      reconstruction::reconstruct_scaled(context, fragments, scales, {}, options);
  EXPECT_GE(map.rounds, 2);
  ASSERT_EQ(map.made.map.islands.size(), 1u);
  ASSERT_EQ(map.made.map.placed(), 4u);
  EXPECT_EQ(map.scales[0], scales[0]);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(map.scales[k] / rooms.factors[k], 1, 0.005);
    const Eigen::Isometry3d truth = rooms.world_from_scan[0].inverse() * rooms.world_from_scan[k];
    for (std::size_t n = 0; n < rooms.clouds[k].size(); n += 97) {
      const Eigen::Vector3d p = rooms.clouds[k][n].cast<double>();
      EXPECT_LT((map.made.map.scans[k].island_from_scan * (map.scales[k] * p) -
                 truth * (rooms.factors[k] * p))
                    .norm(),
                0.05);
    }
  }
}

TEST(ScaledMap, FragmentsAreMultiplied) {
  PointCloud cloud;
  cloud.points = {{1, 2, 3}, {4, 5, 6}};
  cloud.normals = {{1, 0, 0}, {0, 1, 0}};
  cloud.viewpoints = {{1, 1, 1}};
  cloud.origin = {100, 0, -10};
  const FragmentsOf fragments({"a", "b"}, [&](std::size_t) { return cloud; });
  const reconstruction::ScaledFragments scaled(fragments, {2, 1});
  EXPECT_EQ(scaled.size(), 2u);
  EXPECT_EQ(scaled.name(1), "b");
  const LoadedCloud twice = scaled.read(0, {}), same = scaled.read(1, {});
  EXPECT_EQ(twice.view.points[4], 10);
  EXPECT_EQ(twice.view.normals[4], 1);
  EXPECT_EQ(twice.view.viewpoints[0], 2);
  EXPECT_EQ(twice.view.origin[0], 200);
  EXPECT_EQ(same.view.points[4], 5);
  EXPECT_NE(scaled.fingerprint(0), scaled.fingerprint(1));
}

TEST(ScaledMap, SaysWhatIsWrong) {
  const FragmentsOf fragments({"a", "b"}, [](std::size_t) { return PointCloud(); });
  const Context context = Context::cpu(1);
  expect_error<InvalidArgument>([&] { reconstruction::ScaledFragments(fragments, {1}); },
                                {"scales: 1 of 2"});
  expect_error<InvalidArgument>([&] { reconstruction::ScaledFragments(fragments, {1, 0}); },
                                {"scales[1]", "0"});
  expect_error<InvalidArgument>(
      [&] { reconstruction::find_scales(context, fragments, {}, {ScaleRange::known(2)}); },
      {"known"});
  expect_error<InvalidArgument>(
      [&] { reconstruction::find_scales(context, fragments, {}, {ScaleRange{3, 2}}); }, {"scale"});
  expect_error<InvalidArgument>(
      [&] {
        reconstruction::find_scales(context, fragments, RegistrationOptions::loopsmart(0.1f));
      },
      {"method"});
  reconstruction::MapOptions options;
  options.journal = "/tmp/pairs.journal";
  expect_error<InvalidArgument>(
      [&] { reconstruction::reconstruct_scaled(context, fragments, {1, 1}, {}, options); },
      {"journal"});
}

TEST(ScaledMap, UnreadableFragmentsArePartsOfTheirOwn) {
  const FragmentsOf fragments({"a", "b", "c"}, [](std::size_t k) -> PointCloud {
    if (k == 1) throw IoError("b is gone");
    return {};
  });
  const auto found = reconstruction::find_scales(Context::cpu(1), fragments).scans;
  for (std::uint32_t k = 0; k < 3; ++k) {
    EXPECT_EQ(found[k].part, k);
    EXPECT_EQ(found[k].scale, 1);
  }
}

TEST(ScaledMap, ACloudThatCannotBePreparedCostsItsOwnPairs) {
  const ScaledRooms rooms;
  const FragmentsOf fragments({"0", "far", "1"}, [&](std::size_t k) {
    PointCloud cloud;
    cloud.points = rooms.clouds[k == 2 ? 1 : 0];
    if (k == 1)
      for (Eigen::Vector3f& p : cloud.points) p *= 1e30f;
    return cloud;
  });
  const auto found = reconstruction::find_scales(Context::cpu(2), fragments,
                                                 RegistrationOptions{0.1f}, {ScaleRange{1.2, 1.8}})
                         .scans;
  EXPECT_EQ(found[0].part, found[2].part);
  EXPECT_NE(found[0].part, found[1].part);
  EXPECT_NEAR(found[2].scale / rooms.factors[1], 1, 0.02);
}

TEST(ScaledMap, ASearchGoesOnWhereItStopped) {
  const ScaledRooms rooms;
  const TemporaryFolder folder;
  const Context context = Context::cpu(2);
  const RegistrationOptions options{0.1f};
  reconstruction::ScaleSearch search;
  search.range = {0.5, 2};
  search.journal = folder / "scales.journal";
  std::size_t done = 0;
  search.on_progress = [&](std::size_t now, std::size_t) { done = now; };
  search.should_stop = [&] { return done >= 2; };
  EXPECT_THROW(reconstruction::find_scales(context, rooms.fragments(), options, search),
               reconstruction::Cancelled);
  search.should_stop = {};
  const auto resumed = reconstruction::find_scales(context, rooms.fragments(), options, search);
  EXPECT_LT(resumed.searched, 6u);
  resumed.journal->remove();
  search.journal.clear();
  const auto whole = reconstruction::find_scales(context, rooms.fragments(), options, search);
  EXPECT_EQ(whole.searched, resumed.searched + 2);
  EXPECT_EQ(whole.journal, nullptr);
  for (std::size_t k = 0; k < whole.scans.size(); ++k)
    EXPECT_EQ(whole.scans[k].scale, resumed.scans[k].scale);
  // Another range is another run.
  search.journal = folder / "scales.journal";
  search.on_progress = [&](std::size_t, std::size_t) { done = 100; };
  done = 0;
  search.should_stop = [&] { return done == 100; };
  EXPECT_THROW(reconstruction::find_scales(context, rooms.fragments(), options, search),
               reconstruction::Cancelled);
  search.should_stop = {};
  search.range = {0.4, 2};
  expect_error<InvalidArgument>(
      [&] { reconstruction::find_scales(context, rooms.fragments(), options, search); },
      {"scale was 0.5:2"});
}

TEST(ScaledMap, CanBeCancelled) {
  const ScaledRooms rooms;
  reconstruction::ScaleSearch search;
  search.should_stop = [] { return true; };
  EXPECT_THROW(reconstruction::find_scales(Context::cpu(2), rooms.fragments(), {}, search),
               reconstruction::Cancelled);
}

}  // namespace
}  // namespace gpureg::test
