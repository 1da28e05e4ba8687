// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/scales/similarity_graph.hpp"

#include <Eigen/SparseCholesky>

#include "math/exponential.hpp"
#include "pose_graph/se3.hpp"

namespace gpureg::reconstruction {
namespace {

using pose_graph::skew;
using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

constexpr int kIterations = 10;
/// Largest step that counts as none: radians, metres per metre, logarithm of the scale.
constexpr double kNoStep = 1e-9;

/// Residual of an edge and its derivatives by motions of the nodes in their own frames: rotation,
/// translation, logarithm of the scale.
struct Linearised {
  Vector7 residual;
  Matrix7 by_source, by_target, information;

  Linearised(const SimilarityEdge& edge, const Similarity& source, const Similarity& target) {
    // The source in the target's frame, and its centre there: measured and of the map.
    const Eigen::Matrix3d measured = edge.target_from_source.linear(),
                          turned = target.rigid.linear().transpose() * source.rigid.linear();
    const double grown = source.scale / target.scale;
    const Eigen::Vector3d arm = target.rigid.linear().transpose() *
                                (source * edge.centre - target.rigid.translation()) / target.scale;
    const Eigen::Matrix3d back = measured.transpose();
    const Eigen::Vector3d angle = pose_graph::log_rotation(back * turned);
    const Eigen::Vector3d moved = back * (arm - edge.target_from_source * edge.centre);
    residual << angle, moved + skew(edge.centre) * angle, portable::log(grown) - edge.log_scale;

    Eigen::Matrix<double, 3, 7> at_centre, at_arm;
    at_centre << -skew(edge.centre), Eigen::Matrix3d::Identity(), edge.centre;
    at_arm << -skew(arm), Eigen::Matrix3d::Identity(), arm;
    by_source.setZero();
    by_target.setZero();
    by_source.topLeftCorner<3, 3>().setIdentity();
    by_target.topLeftCorner<3, 3>() = -turned.transpose();
    by_source.middleRows<3>(3) =
        grown * back * turned * at_centre + skew(edge.centre) * by_source.topRows<3>();
    by_target.middleRows<3>(3) = -back * at_arm + skew(edge.centre) * by_target.topRows<3>();
    by_source(6, 6) = 1;
    by_target(6, 6) = -1;
    information.setZero();
    information.topLeftCorner<6, 6>() = edge.information;
    information(6, 6) = edge.scale_information;
  }
};

/// The node moved in its own frame.
void move(const Vector7& step, Similarity& node) {
  const Eigen::Matrix3d turned = node.rigid.linear() * pose_graph::exp_rotation(step.head<3>());
  node.rigid.translation() = node * step.segment<3>(3);
  node.rigid.linear() = Eigen::Quaterniond(turned).normalized().toRotationMatrix();
  node.scale *= portable::exp(step[6]);
}

}  // namespace

bool solve_similarities(const std::vector<SimilarityEdge>& edges, const std::vector<char>& held,
                        std::vector<Similarity>& world_from_node) {
  std::vector<int> place(world_from_node.size(), -1);
  int unknowns = 0;
  for (const SimilarityEdge& edge : edges)
    for (const std::size_t node : {edge.source, edge.target})
      if (!held[node] && place[node] < 0) place[node] = unknowns++;
  if (unknowns == 0) return true;
  std::vector<Similarity> nodes = world_from_node;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    std::vector<Eigen::Triplet<double>> triplets;
    Eigen::VectorXd side = Eigen::VectorXd::Zero(7 * unknowns);
    const auto add = [&](int row, int column, const Matrix7& block) {
      for (int c = 0; c < 7; ++c)
        for (int r = 0; r < 7; ++r) triplets.emplace_back(7 * row + r, 7 * column + c, block(r, c));
    };
    for (const SimilarityEdge& edge : edges) {
      const Linearised e(edge, nodes[edge.source], nodes[edge.target]);
      const int s = place[edge.source], t = place[edge.target];
      const Matrix7 of_source = e.by_source.transpose() * e.information,
                    of_target = e.by_target.transpose() * e.information;
      if (s >= 0) {
        add(s, s, of_source * e.by_source);
        side.segment<7>(7 * s) -= of_source * e.residual;
      }
      if (t >= 0) {
        add(t, t, of_target * e.by_target);
        side.segment<7>(7 * t) -= of_target * e.residual;
      }
      if (s >= 0 && t >= 0) {
        add(s, t, of_source * e.by_target);
        add(t, s, of_target * e.by_source);
      }
    }
    Eigen::SparseMatrix<double> matrix(7 * unknowns, 7 * unknowns);
    matrix.setFromTriplets(triplets.begin(), triplets.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(matrix);
    if (factors.info() != Eigen::Success) return false;
    const Eigen::VectorXd step = factors.solve(side);
    if (factors.info() != Eigen::Success || !step.allFinite()) return false;
    for (std::size_t k = 0; k < nodes.size(); ++k)
      if (place[k] >= 0) move(step.segment<7>(7 * place[k]), nodes[k]);
    if (step.cwiseAbs().maxCoeff() < kNoStep) break;
  }
  world_from_node = std::move(nodes);
  return true;
}

}  // namespace gpureg::reconstruction
