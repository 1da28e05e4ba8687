// SPDX-License-Identifier: BSD-3-Clause
#include "api/confidence.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "api/confidence_model.hpp"

namespace gpureg {
namespace {

namespace model = confidence_model;

double at_least(double value, double least) { return std::log(std::max(value, least)); }

/// What the model sees of one mode; bench/accuracy/fit_confidence.py computes the same.
std::vector<double> measures(const PoseEvidence& e, bool free_space) {
  const double low = std::min(e.source_overlap, e.target_overlap);
  const double low_balanced = std::min(e.source_balanced_overlap, e.target_balanced_overlap);
  const double high_balanced = std::max(e.source_balanced_overlap, e.target_balanced_overlap);
  double volume = 0;
  for (const double s : e.stiffness) volume += std::log1p(s);
  std::vector<double> out{at_least(e.match_support, 1e-5),  at_least(e.match_inliers, 1),      at_least(low_balanced, 1e-3),
                          at_least(high_balanced, 1e-3),    at_least(low, 1e-3),               at_least(e.stiffness[0], 1e-2),
                          at_least(e.stiffness[1], 1e-2),   volume};
  if (!free_space) return out;
  // Where only one cloud's viewpoints are known, what they saw stands for both.
  const bool source = e.source_seen > 0, target = e.target_seen > 0;
  const auto both = [&](double s, double t) { return std::pair<double, double>(source ? s : t, target ? t : s); };
  const auto seen = both(e.source_seen, e.target_seen), impossible = both(e.source_impossible, e.target_impossible);
  const auto hidden = both(e.source_hidden, e.target_hidden);
  const double of_all[2] = {seen.first * impossible.first, seen.second * impossible.second};
  const double most = std::max(impossible.first, impossible.second), least = std::min(impossible.first, impossible.second);
  for (const double v : {std::min(seen.first, seen.second), std::max(seen.first, seen.second), std::max(of_all[0], of_all[1]),
                         std::min(of_all[0], of_all[1]), most, least, at_least(most, 3e-3), std::min(hidden.first, hidden.second), at_least(of_all[0] + of_all[1], 1e-3)})
    out.push_back(v);
  return out;
}

double logit(const std::vector<double>& x, const double* weights, double bias) {
  double sum = bias;
  for (std::size_t k = 0; k < x.size(); ++k) sum += weights[k] * x[k];
  return sum;
}

/// Of distinct poses at most one is right: what a pose may have beside the others, were each of them judged by itself. Twins share.
std::vector<double> shares(const std::vector<double>& logits) {
  const double most = *std::max_element(logits.begin(), logits.end());
  double sum = 0;
  std::vector<double> out;
  for (const double l : logits) out.push_back(std::exp(l - most)), sum += out.back();
  for (double& share : out) share /= sum;
  return out;
}

double probability(double logit_value) { return 1.0 / (1.0 + std::exp(-logit_value)); }

}  // namespace

void set_confidences(std::vector<RegistrationMode>& modes, const std::function<bool(const RegistrationMode&, const RegistrationMode&)>& same) {
  if (modes.empty()) return;
  const PoseEvidence& first = modes.front().evidence;
  const bool free_space = first.source_seen > 0 || first.target_seen > 0;
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t k = 0; k < modes.size(); ++k) {
    const PoseEvidence& e = modes[k].evidence;
    order.emplace_back(free_space ? logit(measures(e, true), model::ranking_with_free_space, model::ranking_with_free_space_bias)
                                  : logit(measures(e, false), model::ranking_without_free_space, model::ranking_without_free_space_bias),
                       k);
  }
  std::stable_sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<RegistrationMode> out;
  std::vector<double> own, rank;
  for (const auto& [value, k] : order) {
    const RegistrationMode& mode = modes[k];
    if (std::any_of(out.begin(), out.end(), [&](const RegistrationMode& better) { return same(better, mode); })) continue;
    out.push_back(mode), own.push_back(value), rank.push_back(std::clamp(value, -14.0, 14.0));
  }
  const std::vector<double> share = shares(own);
  for (std::size_t k = 0; k < out.size(); ++k) {
    RegistrationMode& mode = out[k];
    const double rival = k > 0 ? rank[0] : out.size() > 1 ? rank[1] : -14.0;
    std::vector<double> x = measures(mode.evidence, free_space);
    x.push_back(rank[k]);
    x.push_back(rank[k] - rival);
    mode.confidence = free_space ? probability(logit(x, model::confidence_with_free_space, model::confidence_with_free_space_bias))
                                 : probability(logit(x, model::confidence_without_free_space, model::confidence_without_free_space_bias));
    mode.overlap_confidence = free_space ? probability(logit(x, model::overlap_with_free_space, model::overlap_with_free_space_bias))
                                         : probability(logit(x, model::overlap_without_free_space, model::overlap_without_free_space_bias));
    mode.confidence = std::min(mode.confidence, share[k]);
    if (k > 0) mode.confidence = std::min(mode.confidence, out.front().confidence);
    mode.overlap_confidence = std::min(mode.overlap_confidence, mode.confidence);
  }
  modes = std::move(out);
}

}  // namespace gpureg
